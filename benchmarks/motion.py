"""How fast and how exact is the robot chain? Inverse kinematics beside iteration, the stages beside their libraries.

    python -m benchmarks.motion [--smoke]

- inverse: all eight closed-form branches of random reachable poses beside damped least squares with Pinocchio, which
  finds one branch, started 0.05 rad away from it: as near as a neighbouring pose.
- agreement: Pinocchio's forward kinematics of all branches against the poses that were asked for.
- rotation: the search for turn about the nozzle and branch with a nozzle bent by 45 degrees: microseconds a pose, what
  its way costs beside the cheapest way of a dense ladder (every pose a rung, 720 turns), and memory against poses.
- speed: share of the deposit at its set speed on real patches while the normals tremble, and what else is slower, with
  its joint.
- stages: joints, time and collision check of a spiral over a dome, with more and more poses, beside what TOPP-RA and
  Pinocchio take alone for as many, and the exponent with which the time grows.
- bodies: what each body costs in the collision check: the controller's path, the tool, a lamp on it, the arm's links.
"""

from __future__ import annotations

import argparse
import importlib
import time
import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.collision_bodies import bodies, spiral
from benchmarks.surfaces import make
from benchmarks.tables import row, table
from geoprint import transforms
from geoprint.config import job_of, load_cell
from geoprint.model import Cell, FloatArray, JointPath, PoseStream, SearchWeights, Surface
from geoprint.motion import (
    Arm,
    clearance,
    controller_path,
    reach,
    reach_margin,
    retime,
    written_targets,
)
from geoprint.motion.attitude_search import Attitudes, UprightSearch
from geoprint.motion.closed_form import BRANCHES
from geoprint.motion.keyframes import path_lengths
from geoprint.motion.ladder import Rungs, Terms, climb, cost_terms
from geoprint.motion.margins import MINIMUM_WRIST_ANGLE
from geoprint.motion.pose_samples import tool_poses
from geoprint.motion.urdf import read_urdf
from geoprint.paths import largest_lean, mean_lean
from geoprint.paths.attitude import smoothed_axes, tool_quaternions
from geoprint.pipeline.planning import Plan, cover
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.workpiece import prepare_workpiece

Result = TypeVar("Result")

START_ERROR = 0.05  # of the iteration's first joints [rad]
DAMPING = 1e-6
POSITION_ERROR = 1e-10  # at which the iteration has converged [m, rad]
MOST_ITERATIONS = 100
ITERATED = 2_000  # poses for the iteration, which takes longest
REPEATS = 5
DOME = transforms.rigid(np.eye(3), np.array([300.0, 0.0, 50.0]))  # where the dome stands for the search
ARC_RADIUS, ARC_ANGLE = 320.0, 1.5  # of the long arc about the base [mm, rad]
DENSE_TURNS = 720  # of the dense ladder
# Where the dome stands beside the dense ladder [mm]: where the part is put, near the base, aside, far and high.
DENSE_PLACES = ((300.0, 0.0, 50.0), (220.0, 60.0, 50.0), (150.0, 280.0, 80.0), (420.0, -80.0, 120.0))
PATCH_FOLDER = Path(__file__).parents[2] / "shared" / "data" / "patches"
PATCHES = ("lv_lateral_disc_r15", "lv_anterior_disc_r30")
MAX_TILT = float(np.radians(15.0))
ADDED = (
    "\n(TOPP-RA alone times one spline through joints that are known; Pinocchio alone turns them back into poses. What "
    "geoprint adds: the joints themselves, by a search over eight branches and the turn about the nozzle; the cap on "
    "the tip's speed from rest to rest, resampled each millisecond and verified; and "
    "tool and arm swept past the part on the way that the controller takes, with controls.)"
)


def main() -> None:
    """Print the comparisons."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smoke", action="store_true", help="the smallest cases only, to see that the script runs")
    smoke = parser.parse_args().smoke
    cell = load_cell(None)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    for line in inverse(arm, count=500 if smoke else 20_000):
        print(line)
    for line in agreement(arm, count=1000 if smoke else 100_000):
        print(line)
    for line in rotation(arm, counts=(200, 400) if smoke else (1_000, 10_000, 100_000), dense=20 if smoke else 120):
        print(line, flush=True)
    for line in even_speed(cell, arm, noises=(0.05,) if smoke else (0.0, 0.05, 0.1)):
        print(line, flush=True)
    for line in bodies(cell, arm, count=400 if smoke else 100_000):
        print(line, flush=True)
    for line in stages(cell, arm, counts=(200, 400) if smoke else (1_000, 10_000, 100_000)):
        print(line, flush=True)


def inverse(arm: Arm, *, count: int) -> Iterator[str]:
    """Yield a table of microseconds a pose."""
    joints = _random_joints(arm, count)
    Ts_base_tool, Ts_base_flange = arm.tool_poses(joints), arm.flange_poses(joints)
    few = min(count, ITERATED)
    rows = [
        ("Arm.solutions, eight branches", count, lambda: arm.solutions(Ts_base_tool)),
        ("damped least squares, one branch", few, lambda: _iterated(arm, Ts_base_flange[:few], joints[:few])),
    ]
    times = [_least_seconds(work) / poses * 1e6 for _, poses, work in rows]
    yield from table("inverse kinematics", "us a pose", "times faster than iteration")
    for (name, _, _), microseconds in zip(rows, times, strict=True):
        yield row(name, f"{microseconds:.2f}", f"{times[-1] / microseconds:.1f}")
    yield f"(the iteration converged on {_iterated(arm, Ts_base_flange[:few], joints[:few]) / few:.1%} of {few} poses)"


def agreement(arm: Arm, *, count: int) -> Iterator[str]:
    """Yield the largest misses of forward kinematics over all branches."""
    asked = arm.tool_poses(_random_joints(arm, count))
    yield from table(f"forward kinematics of {count} poses", "branches", "worst mm", "worst rad")
    found = arm.solutions(asked)
    exists = np.isfinite(found).all(axis=2)
    wanted = np.repeat(asked, exists.sum(axis=1), axis=0)
    reached = arm.tool_poses(found[exists])
    off = np.linalg.norm(reached[:, :3, 3] - wanted[:, :3, 3], axis=1).max()
    # For small angles the difference of the rotations is sqrt(2) times the angle; their traces would lose it.
    turned = np.linalg.norm(reached[:, :3, :3] - wanted[:, :3, :3], axis=(1, 2)).max() / np.sqrt(2.0)
    yield row("Arm.solutions", str(int(exists.sum())), f"{off:.1e}", f"{turned:.1e}")


def rotation(arm: Arm, *, counts: tuple[int, ...], dense: int) -> Iterator[str]:
    """Yield a table of the search for turn and branch, and the cost of its way beside that of a dense ladder."""
    terms = cost_terms(arm, weights=SearchWeights(), minimum_wrist_angle=MINIMUM_WRIST_ANGLE)
    yield from table("poses", "turn and branch, us a pose", "with exact inverse and its checks", "peak bytes a pose")
    for count in counts:
        poses = spiral(count, standoff=0.3)
        search = partial(_searched, poses, arm, terms, T_base_work=DOME)
        times = [_least_cpu_seconds(work) for work in (search, partial(reach_margin, poses, arm, T_base_work=DOME))]
        yield row(
            str(count), *(f"{seconds / count * 1e6:.1f}" for seconds in times), f"{_peak_bytes(search) / count:.0f}"
        )
    yield from table("path", "cost of the way", "cost of the dense ladder", "ratio")
    streams = [("dome", place, spiral(dense, standoff=0.3)) for place in DENSE_PLACES]
    for name, place, poses in [*streams, ("arc about the base", (0.0, 0.0, 80.0), _arc(dense))]:
        T_base_work = transforms.rigid(np.eye(3), np.array(place))
        found = _cost_of(_searched(poses, arm, terms, T_base_work=T_base_work), poses, terms, T_base_work)
        least = _dense_cost(poses, terms, T_base_work)
        yield row(f"{name} at {place}", f"{found:.3f}", f"{least:.3f}", f"{found / least:.4f}")


def even_speed(cell: Cell, arm: Arm, *, noises: tuple[float, ...]) -> Iterator[str]:
    """Yield a table of the deposit within 1 % of the set speed, for noise [degrees] on the normals of real patches."""
    columns = ("noise", "on slowdown", "at speed", "on ramps", "lean largest, mean", "not at speed")
    yield from table(f"patch at {cell.process.speed:g} mm/s", *columns)
    for name in PATCHES:
        path = PATCH_FOLDER / f"{name}.ply"
        if not path.exists():
            yield row(name, *("not here" for _ in columns))
            continue
        stage, job = Stages(lambda _: None), job_of(surface=path, unit="mm", spacing=1.0, place="demo")
        paths = cover(job, prepare_workpiece(job, stage, backends=[job.backend]), stage)
        for noise in noises:
            joint_path, lean = _trembling(paths, arm, noise=noise)
            for on_slowdown in ("lower", "follow"):
                found = retime(joint_path, cell.robot, process=cell.process, on_slowdown=on_slowdown)
                told = [
                    f"run {slow.run} at {slow.arc:.1f} mm, {slow.held_speed:.1f} mm/s, joint {slow.joint} {slow.limit}"
                    for slow in found.slowdowns
                ]
                shares = f"{found.share_at_speed:.2%}", f"{found.share_on_ramps:.2%}"
                yield row(name, f"{noise:g} deg", on_slowdown, *shares, lean, "; ".join(told) or "nothing else")


def stages(cell: Cell, arm: Arm, *, counts: tuple[int, ...]) -> Iterator[str]:
    """Yield a table of seconds a stage and share, and the exponents with which they grow."""
    part = make("cap", faces=20_000)
    names = ("reach", "timing", "collision check", "all three", "TOPP-RA alone", "Pinocchio alone")
    yield from table("poses", *names, "all three / both alone")
    rows: list[list[float]] = []
    # What is compiled at its first call is not part of any row.
    _chain(cell, arm, part=part, poses=spiral(counts[0], standoff=cell.process.standoff))
    for count in counts:
        poses = spiral(count, standoff=cell.process.standoff)
        seconds = _chain(cell, arm, part=part, poses=poses)
        total = sum(seconds[:3])
        rows.append([*seconds[:3], total, *seconds[3:]])
        shares = [f"{value:.2f} s, {value / total:.0%}" for value in seconds[:3]]
        alone = sum(seconds[3:])
        times = (f"{value:.2f} s" for value in (total, *seconds[3:]))
        yield row(str(count), *shares, *times, f"{total / alone:.2f}")
    slopes = np.polyfit(np.log(counts), np.log(rows), 1)[0]
    yield row("exponent", *(f"{slope:.2f}" for slope in slopes), "")
    yield ADDED


def _arc(count: int) -> PoseStream:
    """Return poses on a wide arc about the base, the nozzle straight down and not turned with it."""
    azimuths = np.linspace(-ARC_ANGLE, ARC_ANGLE, count)
    tips = ARC_RADIUS * np.column_stack([np.cos(azimuths), np.sin(azimuths), np.zeros(count)])
    down = np.tile(transforms.quaternion_of(np.diag([1.0, -1.0, -1.0])), (count, 1))
    return replace(
        spiral(count, standoff=0.3), tips=tips, quaternions=down, normals=np.tile([0.0, 0.0, 1.0], (count, 1))
    )


def _searched(poses: PoseStream, arm: Arm, terms: Terms, *, T_base_work: FloatArray) -> Attitudes:
    search = UprightSearch(poses, arm, T_base_work=T_base_work, terms=terms)
    return search.attitudes(search.branches[0], dense=np.zeros(poses.count, dtype=np.bool_))


def _cost_of(attitudes: Attitudes, poses: PoseStream, terms: Terms, T_base_work: FloatArray) -> float:
    """Return what the smooth way costs with every pose a rung."""
    rungs = _every_pose(poses, attitudes.rotations[:, None], T_base_work=T_base_work)
    return float(climb(rungs, terms, branches=np.arange(BRANCHES) == attitudes.branch).costs[attitudes.branch])


def _dense_cost(poses: PoseStream, terms: Terms, T_base_work: FloatArray) -> float:
    """Return the least cost over all branches and 720 turns at every pose."""
    turns = 2.0 * np.pi * np.arange(DENSE_TURNS) / DENSE_TURNS - np.pi
    rungs = _every_pose(poses, np.tile(turns, (poses.count, 1)), T_base_work=T_base_work)
    return float(climb(rungs, terms, branches=np.ones(BRANCHES, dtype=np.bool_)).costs.min())


def _every_pose(poses: PoseStream, turns: FloatArray, *, T_base_work: FloatArray) -> Rungs:
    each = turns.shape[1]
    return Rungs(
        Ts_base_tool=tool_poses(poses, T_base_work=T_base_work),
        deposit=poses.deposit,
        steps=np.diff(path_lengths(poses)),
        candidates=np.column_stack([turns.reshape(-1), np.zeros((turns.size, 2))]),
        offsets=each * np.arange(poses.count + 1, dtype=np.int64),
        extra=np.zeros(turns.size),
    )


def _peak_bytes(work: Callable[[], object]) -> int:
    tracemalloc.start()
    work()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def _trembling(paths: Plan, arm: Arm, *, noise: float) -> tuple[JointPath, str]:
    """Return the joint path for normals with noise [degrees] before they are smoothed, and its leans from the true."""
    stream, placement = paths.poses, paths.workpiece.placement
    assert placement is not None
    generator, quaternions = np.random.default_rng(0), stream.quaternions.copy()
    for run, closed in enumerate(paths.toolpath.curves.closed):
        rows = np.flatnonzero(stream.deposit & (stream.runs == run))
        normals = stream.normals[rows] + generator.normal(scale=np.radians(noise), size=(rows.size, 3))
        normals[-1] = normals[0] if closed else normals[-1]
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        axes = smoothed_axes(normals, stream.arcs[rows], closed=bool(closed), max_tilt=MAX_TILT)
        quaternions[rows] = tool_quaternions(axes, R_base_work=placement.T_base_work[:3, :3])
    poses = replace(stream, quaternions=transforms.same_sign(quaternions))
    lean = f"{np.degrees(largest_lean(poses)):.2f}, {np.degrees(mean_lean(poses)):.2f} deg"
    return reach(poses, arm, T_base_work=placement.T_base_work), lean


def _chain(cell: Cell, arm: Arm, *, part: Surface, poses: PoseStream) -> list[float]:
    """Return seconds of reach, timing, collision check, TOPP-RA alone and Pinocchio alone."""
    T_base_work = transforms.rigid(np.eye(3), cell.demo_position)
    path, reaching = _timed(lambda: reach(poses, arm, T_base_work=T_base_work))
    trajectory, timing = _timed(lambda: retime(path, cell.robot, process=cell.process))

    def check() -> None:
        targets = written_targets(path, trajectory, process=cell.process)
        clearance(
            controller_path(path, targets, arm), arm, tool=cell.tool, process=cell.process, T_base_work=T_base_work,
            poses=path.poses, part=part, body=None, obstacles=cell.obstacles,
        )  # fmt: skip

    _, checking = _timed(check)
    _, alone = _timed(lambda: _toppra_alone(path, cell))
    _, forward = _timed(lambda: arm.flange_poses(path.joints))
    return [reaching, timing, checking, alone, forward]


def _toppra_alone(path: JointPath, cell: Cell) -> None:
    """Time a spline through the joints as TOPP-RA's own examples do, on a grid of the poses."""
    toppra, constraint = (importlib.import_module(name) for name in ("toppra", "toppra.constraint"))
    metres = path.poses.arcs * 1e-3
    problem = toppra.algorithm.TOPPRA(
        [
            constraint.JointVelocityConstraint(np.column_stack([-cell.robot.speeds, cell.robot.speeds])),
            constraint.JointAccelerationConstraint(
                np.column_stack([-cell.robot.accelerations, cell.robot.accelerations])
            ),
        ],
        toppra.SplineInterpolator(metres, path.joints),
        gridpoints=metres,
        solver_wrapper="seidel",
        parametrizer="ParametrizeConstAccel",
    )
    problem.compute_parameterization(0.0, 0.0)


def _iterated(arm: Arm, Ts_base_flange: FloatArray, joints: FloatArray) -> int:
    """Solve each pose by damped least squares from joints nearby; return how many converged."""
    pinocchio = importlib.import_module("pinocchio")
    model = pinocchio.buildModelFromXML(read_urdf(arm.robot.model))
    data, frame = model.createData(), model.getFrameId("tool0", pinocchio.FrameType.BODY)
    starts = joints + START_ERROR * np.random.default_rng(1).uniform(-1.0, 1.0, joints.shape)
    damping = DAMPING * np.eye(6)
    converged = 0
    for T_base_flange, start in zip(Ts_base_flange, starts, strict=True):
        wanted = pinocchio.SE3(T_base_flange[:3, :3], T_base_flange[:3, 3] * 1e-3)
        angles: FloatArray = start.copy()
        for _ in range(MOST_ITERATIONS):
            pinocchio.framesForwardKinematics(model, data, angles)
            miss: FloatArray = pinocchio.log6(data.oMf[frame].actInv(wanted)).vector
            if np.abs(miss).max() < POSITION_ERROR:
                converged += 1
                break
            slope: FloatArray = pinocchio.computeFrameJacobian(model, data, angles, frame)
            angles += slope.T @ np.linalg.solve(slope @ slope.T + damping, miss)
    return converged


def _random_joints(arm: Arm, count: int) -> FloatArray:
    """Return (count, 6) joints inside the limits whose wrist is 5 degrees or more from its singularity."""
    generator = np.random.default_rng(0)
    joints = generator.uniform(arm.robot.limits[:, 0], arm.robot.limits[:, 1], (count, 6))
    signs = np.where(joints[:, 4] < 0.0, -1.0, 1.0)
    joints[:, 4] = signs * np.maximum(np.abs(joints[:, 4]), np.radians(5.0))
    return joints


def _timed(work: Callable[[], Result]) -> tuple[Result, float]:
    start = time.perf_counter()
    result = work()
    return result, time.perf_counter() - start


def _least_seconds(work: Callable[[], object]) -> float:
    work()
    return min(_timed(work)[1] for _ in range(REPEATS))


def _least_cpu_seconds(work: Callable[[], object]) -> float:
    """Return the least processor time of several runs: others on the machine lengthen the clock's."""
    work()
    times: list[float] = []
    for _ in range(REPEATS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


if __name__ == "__main__":
    main()
