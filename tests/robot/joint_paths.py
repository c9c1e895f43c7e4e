"""Joint paths that the tests of motion share: made by hand from tip and attitude, solved by the arm."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import BoolArray, Cell, FloatArray, IntArray, JointPath, PoseStream
from geoprint.robot.arm.kinematics import Arm
from geoprint.robot.reach.keyframes import tool_poses

WORK = transforms.rigid(np.eye(3), np.array([300.0, 0.0, 100.0]))
DOWN = np.array([0.0, 1.0, 0.0, 0.0])


def arm_of(cell: Cell) -> Arm:
    """Return the arm with the cell's tool."""
    return Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)


def stream(
    tips: FloatArray,
    *,
    quaternions: FloatArray | None = None,
    stops: tuple[int, ...] = (),
    deposit: BoolArray | None = None,
    runs: IntArray | None = None,
) -> PoseStream:
    """Return poses at given tips [mm], pointing straight down, all on deposit in run 0 where nothing else is said."""
    count = len(tips)
    deposited = np.ones(count, dtype=np.bool_) if deposit is None else deposit
    halts = np.zeros(count, dtype=np.bool_)
    halts[list(stops)] = True
    halts[:1] = halts[-1:] = True
    attitude = np.tile(DOWN, (count, 1)) if quaternions is None else quaternions
    return PoseStream(
        tips=tips,
        quaternions=attitude,
        normals=-transforms.rotation_of(attitude)[:, :, 2],
        runs=np.zeros(count, dtype=np.int64) if runs is None else runs,
        levels=np.where(deposited, 0, -1),
        layers=np.zeros(count, dtype=np.int64),
        deposit=deposited,
        stops=halts,
        arcs=np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(tips, axis=0), axis=1))])[:count],
        flow=np.where(deposited, 0.5, 0.0),
        standoff=0.3,
    )


def solved(poses: PoseStream, arm: Arm, *, branch: int = 0, T_base_work: FloatArray = WORK) -> JointPath:
    """Return the joint path of poses on one branch, without turning them."""
    joints = np.unwrap(arm.solutions(tool_poses(poses, T_base_work=T_base_work))[:, branch], axis=0)
    assert np.isfinite(joints).all(), "a test asks for a pose out of reach"
    return JointPath(
        poses=poses,
        joints=joints,
        branch=branch,
        rotations=np.zeros(poses.count),
        leans=np.zeros((poses.count, 2)),
        T_base_work=T_base_work,
    )


def arc(*, radius: float = 20.0, step: float = 0.5, angle: float = 2.0 * np.pi) -> FloatArray:
    """Return the tips of a circular arc in the plane z = 0 [mm]."""
    count = round(radius * angle / step) + 1
    phase = np.linspace(0.0, angle, count)
    return radius * np.column_stack([np.cos(phase), np.sin(phase), np.zeros(count)])


def line(start: tuple[float, float, float], end: tuple[float, float, float], *, count: int) -> FloatArray:
    """Return evenly spaced tips from start to end [mm]."""
    return np.linspace(np.array(start), np.array(end), count)


def tilted(angles: FloatArray, *, axis: str = "y") -> FloatArray:
    """Return quaternions that lean the downward tool by angles [rad] about one of its own axes."""
    return transforms.quaternion_of(
        transforms.rotation_of(DOWN) @ Rotation.from_euler(axis, angles[:, None]).as_matrix()
    )


def two_runs() -> PoseStream:
    """Return two half circles, with lift, crossing and descent between them, approach and retreat."""
    first, second = arc(angle=np.pi), arc(radius=16.0, angle=np.pi)[::-1]
    lift = np.array([0.0, 0.0, 5.0])
    corners = [first[-1] + lift, second[0] + lift]
    travel = np.vstack(
        [
            line(tuple(first[-1]), tuple(corners[0]), count=6)[1:],
            line(tuple(corners[0]), tuple(corners[1]), count=5)[1:],
            line(tuple(corners[1]), tuple(second[0]), count=6)[1:-1],
        ]
    )
    approach = line(tuple(first[0] + lift), tuple(first[0]), count=6)[:-1]
    retreat = line(tuple(second[-1]), tuple(second[-1] + lift), count=6)[1:]
    tips = np.vstack([approach, first, travel, second, retreat])
    sizes = [len(approach), len(first), len(travel), len(second), len(retreat)]
    ends = np.cumsum(sizes)
    deposit = np.repeat([False, True, False, True, False], sizes)
    runs = np.repeat([0, 0, 1, 1, 1], sizes)
    stops = (ends[0], ends[1] - 1, ends[1] + 4, ends[1] + 8, ends[2], ends[3] - 1)
    return stream(tips, deposit=deposit, runs=runs, stops=tuple(int(row) for row in stops))
