"""How fast and how exact is the robot chain? Inverse kinematics beside iteration, the stages beside their libraries.

    python -m benchmarks.motion.chain [--smoke]

- inverse: all eight closed-form branches of random reachable poses beside damped least squares with Pinocchio, which
  finds one branch, started 0.05 rad away from it: as near as a neighbouring pose.
- agreement: Pinocchio's forward kinematics of all branches against the poses that were asked for.
- stages: joints, time and collision check of a spiral over a dome, with more and more poses, beside what TOPP-RA and
  Pinocchio take alone for as many, and the exponent with which the time grows.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterator
from typing import TypeVar

import numpy as np

from benchmarks.parts.streams import spiral
from benchmarks.parts.surfaces import make
from benchmarks.parts.tables import row, script_parser, table
from geoprint import transforms
from geoprint.config import load_cell
from geoprint.errors import percent
from geoprint.model import Cell, FloatArray, JointPath, PoseStream, Surface
from geoprint.robot.arm import Arm
from geoprint.robot.arm.urdf import read_urdf
from geoprint.robot.collision import clearance
from geoprint.robot.controller import controller_path, written_targets
from geoprint.robot.reach import reach
from geoprint.robot.timing import retime

Result = TypeVar("Result")

START_ERROR = 0.05  # of the iteration's first joints [rad]
DAMPING = 1e-6
POSITION_ERROR = 1e-10  # at which the iteration has converged [m, rad]
MOST_ITERATIONS = 100
ITERATED = 2_000  # poses for the iteration, which takes longest
REPEATS = 5
ADDED = (
    "\n(TOPP-RA alone times one spline through joints that are known; Pinocchio alone turns them back into poses. What "
    "geoprint adds: the joints themselves, by a search over eight branches and the turn about the nozzle; the cap on "
    "the tip's speed from rest to rest, resampled each millisecond and verified; and "
    "tool and arm swept past the part on the path that the controller takes, with controls.)"
)


def main() -> None:
    """Print the comparisons."""
    parser = script_parser(__doc__, smoke="the smallest cases only, to see that the script runs")
    smoke: bool = parser.parse_args().smoke
    cell = load_cell(None)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    for line in inverse(arm, count=500 if smoke else 20_000):
        print(line)
    for line in agreement(arm, count=1000 if smoke else 100_000):
        print(line)
    for line in stages(cell, arm, counts=(40, 80) if smoke else (1_000, 10_000, 100_000)):
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
    converged = percent(_iterated(arm, Ts_base_flange[:few], joints[:few]) / few, 1)
    yield f"(the iteration converged on {converged} of {few} poses)"


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
        shares = [f"{value:.2f} s, {percent(value / total)}" for value in seconds[:3]]
        alone = sum(seconds[3:])
        times = (f"{value:.2f} s" for value in (total, *seconds[3:]))
        yield row(str(count), *shares, *times, f"{total / alone:.2f}")
    slopes = np.polyfit(np.log(counts), np.log(rows), 1)[0]
    yield row("exponent", *(f"{slope:.2f}" for slope in slopes), "")
    yield ADDED


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


if __name__ == "__main__":
    main()
