from __future__ import annotations

import numpy as np
import pytest

from geoprint import transforms
from geoprint.errors import ClearanceError, InputError
from geoprint.model import Box, Clearance, ControllerPath, FloatArray, PoseStream
from geoprint.robot.arm.kinematics import Arm
from geoprint.robot.collision.clearance import clearance
from tests.meshes import plate
from tests.robot.cells import straight_cell
from tests.robot.placements import DOWN, line, pointing_down

CELL = straight_cell()
STANDOFF = CELL.process.standoff
LINE = line((20.0, 5.0, STANDOFF), (20.0, 25.0, STANDOFF))
T_BASE_WORK = transforms.rigid(np.eye(3), np.array([330.0, -15.0, 60.0]))


def printed_line() -> tuple[ControllerPath, Arm, PoseStream]:
    """Return a path from home to a line over the plate and back: coarse joint moves, and a row each 0.5 mm between."""
    arm = Arm(CELL.robot, T_flange_tool=CELL.tool.T_flange_tool)
    lift = np.array([0.0, 0.0, 5.0])
    tips = np.concatenate([LINE[:1] + lift, LINE, LINE[-1:] + lift])
    solutions = arm.solutions(T_BASE_WORK @ pointing_down(tips))
    distance = np.abs(solutions - CELL.robot.home).max(axis=2)
    branch = int(np.nanargmin(distance[0]))
    joints = solutions[:, branch]
    home = CELL.robot.home
    count = int(np.ceil(np.degrees(np.abs(joints[0] - home)).max()))
    outward = home + np.linspace(0.0, 1.0, count, endpoint=False)[:, None] * (joints[0] - home)
    back = joints[-1] + np.linspace(0.0, 1.0, count + 1)[1:, None] * (home - joints[-1])
    deposit = np.zeros(2 * count + len(tips), dtype=np.bool_)
    deposit[count + 1 : count + len(tips) - 2] = True
    runs = np.full(len(deposit), -1)
    runs[count : count + len(tips)] = 0
    rows = np.concatenate([outward, joints, back])
    path = ControllerPath(rows, runs=runs, deposit=deposit, rounding=np.zeros_like(rows), step=0.5)
    return path, arm, stream_of(tips)


def stream_of(tips: FloatArray) -> PoseStream:
    count = len(tips)
    laying = (np.arange(count) > 0) & (np.arange(count) < count - 2)
    quaternions = np.tile(transforms.quaternion_of(DOWN), (count, 1))
    return PoseStream(
        tips=tips,
        quaternions=quaternions,
        normals=np.tile([0.0, 0.0, 1.0], (count, 1)),
        runs=np.zeros(count, dtype=np.int64),
        levels=np.where(laying, 0, -1),
        layers=np.zeros(count, dtype=np.int64),
        deposit=laying,
        stops=~laying,
        arcs=np.zeros(count),
        flow=np.zeros(count),
        standoff=STANDOFF,
    )


def check_path(obstacles: tuple[Box, ...] = ()) -> Clearance:
    path, arm, poses = printed_line()
    return clearance(
        path,
        arm,
        tool=CELL.tool,
        process=CELL.process,
        T_base_work=T_BASE_WORK,
        poses=poses,
        part=plate(),
        body=None,
        obstacles=obstacles,
    )


def test_whole_path_is_checked_from_home_to_home():
    path, _, _ = printed_line()

    found = check_path()

    assert found.checks > path.runs.size
    assert found.tip_margin == pytest.approx(STANDOFF, abs=1e-6)
    assert found.smallest == pytest.approx(1.0 + STANDOFF, abs=0.01)


@pytest.mark.parametrize(("share", "name"), [(0.4, "on the way from home"), (-0.4, "on the way to home")])
def test_obstacle_on_a_joint_move_is_found(share: float, name: str):
    path, arm, _ = printed_line()
    travel = np.flatnonzero(path.runs < 0)
    ahead, back = np.split(travel, [int((travel < path.runs.argmax()).sum())])
    row = int(ahead[int(share * len(ahead))] if share > 0 else back[int(share * len(back))])
    tip = arm.tool_poses(path.joints[row][None])[0, :3, 3]
    post = Box("post", tip, np.array([2.0, 2.0, 2.0]))

    with pytest.raises(ClearanceError, match="into the obstacle post") as caught:
        check_path(obstacles=(post,))

    assert name in str(caught.value)


def test_part_placed_by_a_transform_that_is_not_rigid_is_refused():
    path, arm, poses = printed_line()

    with pytest.raises(InputError, match="not a rigid transform"):
        clearance(
            path, arm, tool=CELL.tool, process=CELL.process, T_base_work=np.diag([2.0, 2.0, 2.0, 1.0]), poses=poses,
            part=plate(), body=None, obstacles=(),
        )  # fmt: skip
