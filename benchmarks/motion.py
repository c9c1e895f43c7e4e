"""How fast and how exact is the robot chain? Inverse kinematics beside iteration, the stages beside their libraries.

    python -m benchmarks.motion [--smoke]

- inverse: all eight closed-form branches of random reachable poses beside damped least squares with Pinocchio, which
  finds one branch, started 0.05 rad away from it: as near as a neighbouring pose.
- agreement: Pinocchio's forward kinematics of all branches against the poses that were asked for.
- stages: joints, time and collision check of a spiral over a dome, with more and more poses, beside what TOPP-RA and
  Pinocchio take alone for as many, and the exponent with which the time grows.
- bodies: what each body costs in the collision check: the controller's path, the tool, a lamp on it, the arm's links.
"""

from __future__ import annotations

import argparse
import importlib
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TypeVar

import numpy as np

from benchmarks.surfaces import make
from benchmarks.tables import row
from geoprint import transforms
from geoprint.config import load_cell
from geoprint.model import Cell, FloatArray, JointPath, Lamp, PoseStream, Surface, Tool
from geoprint.motion import (
    Arm,
    clearance,
    controller_path,
    reach,
    retime,
    written_targets,
)
from geoprint.motion.arm_clearance import arm_motion
from geoprint.motion.clearance import check_placements
from geoprint.motion.kinematics import read_urdf
from geoprint.motion.link_solids import link_solids
from geoprint.motion.tool_solids import tool_solids

Result = TypeVar("Result")

RADIUS = 20.0  # of the dome of `benchmarks.surfaces` [mm]
STEEPEST = 0.5  # polar angle at which the spiral ends [rad]
START_ERROR = 0.05  # of the iteration's first joints [rad]
DAMPING = 1e-6
POSITION_ERROR = 1e-10  # at which the iteration has converged [m, rad]
MOST_ITERATIONS = 100
ITERATED = 2_000  # poses for the iteration, which takes longest
REPEATS = 5


def main() -> None:
    """Print the three comparisons."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smoke", action="store_true", help="the smallest cases only, to see that the script runs")
    smoke = parser.parse_args().smoke
    cell = load_cell(None)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    for line in inverse(arm, count=500 if smoke else 20_000):
        print(line)
    for line in agreement(arm, count=1000 if smoke else 100_000):
        print(line)
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
    yield from _table("inverse kinematics", "us a pose", "times faster than iteration")
    for (name, _, _), microseconds in zip(rows, times, strict=True):
        yield row(name, f"{microseconds:.2f}", f"{times[-1] / microseconds:.1f}")
    yield f"(the iteration converged on {_iterated(arm, Ts_base_flange[:few], joints[:few]) / few:.1%} of {few} poses)"


def agreement(arm: Arm, *, count: int) -> Iterator[str]:
    """Yield the largest misses of forward kinematics over all branches."""
    asked = arm.tool_poses(_random_joints(arm, count))
    yield from _table(f"forward kinematics of {count} poses", "branches", "worst mm", "worst rad")
    found = arm.solutions(asked)
    exists = np.isfinite(found).all(axis=2)
    wanted = np.repeat(asked, exists.sum(axis=1), axis=0)
    reached = arm.tool_poses(found[exists])
    off = np.linalg.norm(reached[:, :3, 3] - wanted[:, :3, 3], axis=1).max()
    # For small angles the difference of the rotations is sqrt(2) times the angle; their traces would lose it.
    turned = np.linalg.norm(reached[:, :3, :3] - wanted[:, :3, :3], axis=(1, 2)).max() / np.sqrt(2.0)
    yield row("Arm.solutions", str(int(exists.sum())), f"{off:.1e}", f"{turned:.1e}")


def stages(cell: Cell, arm: Arm, *, counts: tuple[int, ...]) -> Iterator[str]:
    """Yield a table of seconds a stage and share, and the exponents with which they grow."""
    part = make("cap", faces=20_000)
    names = ("reach", "timing", "collision check", "all", "TOPP-RA alone", "Pinocchio alone")
    yield from _table("poses", *names)
    rows: list[list[float]] = []
    for count in counts:
        poses = spiral(count, standoff=cell.process.standoff)
        seconds = _chain(cell, arm, part=part, poses=poses)
        total = sum(seconds[:3])
        rows.append([*seconds[:3], total, *seconds[3:]])
        shares = [f"{value:.2f} s, {value / total:.0%}" for value in seconds[:3]]
        yield row(str(count), *shares, f"{total:.2f} s", *(f"{value:.2f} s" for value in seconds[3:]))
    slopes = np.polyfit(np.log(counts), np.log(rows), 1)[0]
    yield row("exponent", *(f"{slope:.2f}" for slope in slopes))


def bodies(cell: Cell, arm: Arm, *, count: int) -> Iterator[str]:
    """Yield a table of seconds and share of each body in the collision check of a spiral over the dome."""
    part, poses = make("cap", faces=20_000), spiral(count, standoff=cell.process.standoff)
    T_base_work = transforms.rigid(np.eye(3), cell.demo_position)
    joint_path = reach(poses, arm, T_base_work=T_base_work)
    targets = written_targets(joint_path, retime(joint_path, cell.robot, process=cell.process), process=cell.process)
    path, following = _timed(lambda: controller_path(joint_path, targets, arm))
    lamp = Lamp(transforms.rigid(np.eye(3), np.array([0.0, 45.0, 10.0])), length=60.0, diameter=20.0)
    links, T_work_base = link_solids(arm.robot.model), transforms.inverse(T_base_work)
    motion, placing = _timed(
        lambda: arm_motion(path, arm, tool=tool_solids(cell.tool), links=links, T_work_base=T_work_base)
    )

    def check_tool(tool: Tool) -> None:
        check_placements(
            motion.tool, tool=tool, process=cell.process, standoff=poses.standoff, part=part, body=None,
            obstacles=cell.obstacles, T_work_base=T_work_base,
        )  # fmt: skip

    def check_all() -> None:
        clearance(
            path, arm, tool=cell.tool, process=cell.process, T_base_work=T_base_work, poses=poses, part=part,
            body=None, obstacles=cell.obstacles,
        )  # fmt: skip

    _, tool = _timed(lambda: check_tool(cell.tool))
    _, with_lamp = _timed(lambda: check_tool(replace(cell.tool, lamp=lamp)))
    _, everything = _timed(check_all)
    names = ("controller's path", "where tool and links are", "tool", "lamp besides", "arm's links")
    seconds = (following, placing, tool, max(with_lamp - tool, 0.0), everything - placing - tool)
    yield from _table(f"collision check of {count} poses, {motion.tool.count} placements", *names)
    yield row("s, share", *(f"{value:.2f} s, {value / sum(seconds):.0%}" for value in seconds))


def spiral(count: int, *, standoff: float) -> PoseStream:
    """Return poses on a spiral over the top of the dome, evenly spaced, the nozzle against the normal."""
    polar = STEEPEST * np.sqrt((np.arange(count) + 0.5) / count)
    turn = 2.0 * np.pi * np.sqrt(count / 50.0) * polar / STEEPEST
    normals = np.column_stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])
    down = np.diag([1.0, -1.0, -1.0])
    rotations = transforms.smallest_rotation(down[:, 2], -normals) @ down
    tips = (RADIUS + standoff) * normals
    steps = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    ends = np.zeros(count, dtype=bool)
    ends[[0, -1]] = True
    return PoseStream(
        tips=tips,
        quaternions=transforms.same_sign(transforms.quaternion_of(rotations)),
        normals=normals,
        runs=np.zeros(count, dtype=np.int64),
        levels=np.zeros(count, dtype=np.int64),
        layers=np.zeros(count, dtype=np.int64),
        deposit=np.ones(count, dtype=bool),
        stops=ends,
        arcs=np.append(0.0, np.cumsum(steps)),
        flow=np.full(count, 0.5),
        standoff=standoff,
    )


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
    data, frame = model.createData(), model.getFrameId("tool0")
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


def _table(*cells: str) -> list[str]:
    return ["", row(*cells), row(*("---" for _ in cells))]


if __name__ == "__main__":
    main()
