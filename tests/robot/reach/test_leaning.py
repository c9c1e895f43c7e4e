"""A nozzle that leans beside a wall: enough, within the cone, smoothly, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint import transforms
from geoprint.errors import ClearanceError
from geoprint.model import Box, Cell, Clearance, FloatArray, JointPath, PoseStream
from geoprint.robot.arm import tilts
from geoprint.robot.collision import CheckedWorld, clearance
from geoprint.robot.controller import controller_path, written_targets
from geoprint.robot.reach import Leaning, NozzleRoom, reach
from geoprint.robot.reach.attitude_search import LEAN_LENGTH
from geoprint.robot.reach.lean_room import laying
from geoprint.robot.timing import retime
from tests.meshes import plate
from tests.robot.cells import bent_cell, straight_cell
from tests.robot.joint_paths import arm_of, line, stream

PART = plate((130.0, 40.0), (26, 8))
STANDOFF = 0.3
# The plate's middle lies at the demonstration position.
LOW, HIGH = PART.vertices.min(axis=0), PART.vertices.max(axis=0)
MAX_TILT = float(np.radians(15.0))


def placed(cell: Cell) -> FloatArray:
    middle = (LOW + HIGH) / 2.0
    return transforms.rigid(np.eye(3), cell.demo_position - middle)


def along_x(y: float) -> PoseStream:
    """A line over the plate with its approach and retreat, the nozzle straight down."""
    start, end = (LOW[0] + 5.0, y, STANDOFF), (HIGH[0] - 5.0, y, STANDOFF)
    tips = line(start, end, count=241)
    lift = np.array([0.0, 0.0, 30.0])
    down, up = line(tuple(tips[0] + lift), start, count=16), line(end, tuple(tips[-1] + lift), count=16)
    deposited = np.zeros(241 + 30, dtype=np.bool_)
    deposited[15:256] = True
    return stream(np.vstack([down[:-1], tips, up[1:]]), deposit=deposited, stops=(15, 255))


def wall(cell: Cell, *, y: float, thick: float, height: float, length: float = 12.0) -> Box:
    """A wall on the plate, in the base frame: its near face at y, its middle at that of the plate."""
    centre = np.array([(LOW[0] + HIGH[0]) / 2.0, y + thick / 2.0, height / 2.0])
    return Box("wall", transforms.apply(placed(cell), centre[None])[0], np.array([length, thick, height]))


def room_of(cell: Cell, obstacle: Box) -> NozzleRoom:
    scene = CheckedWorld(
        cell.tool, process=cell.process, part=PART, body=None, obstacles=(obstacle,),
        T_work_base=transforms.inverse(placed(cell)),
    )  # fmt: skip
    return NozzleRoom(
        cell.tool,
        process=cell.process,
        standoff=STANDOFF,
        scene=scene,
        T_base_work=placed(cell),
    )


def proved(path: JointPath, cell: Cell, obstacle: Box) -> Clearance:
    trajectory = retime(path, cell.robot, process=cell.process)
    targets = written_targets(path, trajectory, process=cell.process)
    arm = arm_of(cell)
    return clearance(
        controller_path(path, targets, arm), arm, tool=cell.tool, process=cell.process, T_base_work=path.T_base_work,
        poses=path.poses, part=PART, body=None, obstacles=(obstacle,),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("cell", "height", "away"),
    [(bent_cell(), 45.0, 3.0), (straight_cell(), 10.0, 1.1)],
    ids=["bent-wall", "straight-step"],
)
def test_wall_beside_the_path_is_passed_by_a_lean_within_the_cone(cell: Cell, height: float, away: float) -> None:
    poses, arm = along_x(15.0), arm_of(cell)
    obstacle = wall(cell, y=15.0 + away, thick=5.0, height=height)
    upright = reach(poses, arm, T_base_work=placed(cell))
    with pytest.raises(ClearanceError, match="wall"):
        proved(upright, cell, obstacle)
    path = reach(poses, arm, T_base_work=placed(cell), leaning=Leaning(MAX_TILT, room_of(cell, obstacle)))
    found = proved(path, cell, obstacle)
    assert found.smallest >= cell.process.clearance
    leans = np.linalg.norm(path.leans, axis=1)
    far = np.abs(path.poses.tips[:, 0] - (LOW[0] + HIGH[0]) / 2.0) > 6.0 + LEAN_LENGTH + 20.0
    assert np.degrees(leans.max()) > 3.0
    assert leans[far].max() == 0.0
    assert tilts(path.poses)[laying(poses)].max() <= MAX_TILT
    steepest = float(np.degrees(np.abs(np.diff(path.leans, axis=0)).max()))
    assert steepest < 2.0


def test_nozzle_that_has_room_stays_upright_though_it_may_lean() -> None:
    cell = bent_cell()
    poses, arm = along_x(15.0), arm_of(cell)
    leaning = Leaning(MAX_TILT, room_of(cell, wall(cell, y=30.0, thick=5.0, height=10.0)))
    upright = reach(poses, arm, T_base_work=placed(cell))
    path = reach(poses, arm, T_base_work=placed(cell), leaning=leaning)
    np.testing.assert_array_equal(path.leans, 0.0)
    np.testing.assert_array_equal(path.joints, upright.joints)
