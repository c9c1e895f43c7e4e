"""The stages with a UR5e: reach without quadrants of ABB, time, and obstacles planted beside each of its links."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.config import UR_CELL, load_cell
from geoprint.errors import ClearanceError
from geoprint.model import Box, Clearance, FloatArray, JointPath, PoseStream
from geoprint.robot.arm import branch_of, wrist_angles
from geoprint.robot.collision import clearance, link_solids
from geoprint.robot.controller import controller_path, written_targets
from geoprint.robot.reach import frame_room, reach
from geoprint.robot.reach.quadrants import near_border
from geoprint.robot.timing import retime
from geoprint.transforms import apply, rigid
from tests.meshes import plate
from tests.robot.joint_paths import arm_of, line, stream

CELL = load_cell(UR_CELL)
ARM = arm_of(CELL)
T_BASE_WORK = rigid(np.eye(3), CELL.demo_position)


def printed(poses: PoseStream) -> JointPath:
    return reach(poses, ARM, T_base_work=T_BASE_WORK)


@pytest.fixture(scope="module")
def path() -> JointPath:
    """Return a line across the plate, straight under the nozzle."""
    return printed(stream(line((-15.0, -15.0, 0.3), (15.0, 15.0, 0.3), count=81)))


def test_one_branch_is_followed_within_the_limits_and_away_from_the_wrist_singularity(path: JointPath) -> None:
    limits = CELL.robot.limits

    assert np.abs(np.diff(path.joints, axis=0)).max() < np.radians(2.0)
    assert ((path.joints >= limits[:, 0]) & (path.joints <= limits[:, 1])).all()
    assert wrist_angles(path.joints, arm=ARM).min() > np.radians(60.0)
    # The lower arm rises, the elbow is above the line between shoulder and wrist.
    assert ARM.link_poses(path.joints)[:, 3, 2, 3].min() > 400.0


def test_no_quarter_turn_of_an_axis_counts(path: JointPath) -> None:
    assert not near_border(np.zeros((3, 6)), ARM).any()
    # The straight nozzle is turned as near to home as it goes: joint 6 stays within a quarter turn of zero.
    assert np.abs(path.joints[:, 5]).max() < np.pi / 2.0
    room = frame_room(path.joints, ARM, extent=np.array([[-15.0, -15, 0], [15.0, 15, 0]]), T_base_work=T_BASE_WORK)
    assert 5.0 < room < 1000.0


def checked(path: JointPath, obstacle: Box) -> Clearance:
    targets = written_targets(path, retime(path, CELL.robot, process=CELL.process), process=CELL.process)
    return clearance(
        controller_path(path, targets, ARM), ARM, tool=CELL.tool, process=CELL.process, T_base_work=T_BASE_WORK,
        poses=path.poses, part=plate(), body=None, obstacles=(*CELL.obstacles, obstacle),
    )  # fmt: skip


def highest(path: JointPath, joint: int) -> FloatArray:
    """Return the highest point of a link's axes over all poses of a path [mm], with the radius there added."""
    frames = ARM.link_poses(path.joints)[:, joint]
    ends = [
        (*apply(frame, end[None])[0, :2], apply(frame, end[None])[0, 2] + solid.start_radius)
        for frame in frames
        for solid in link_solids("ur5e")[joint].solids
        for end in (solid.start, solid.end)
    ]
    return np.array(max(ends, key=lambda end: end[2]))


@pytest.mark.parametrize("joint", [2, 3])
def test_a_lid_in_a_link_is_found_and_one_above_all_of_it_is_not(path: JointPath, joint: int) -> None:
    x, y, top = highest(path, joint)
    size = np.array([60.0, 60.0, 20.0])
    # At home, where the motion starts and ends, the arm is higher than over the part.
    above = Box("lid", np.array([x, y, top + 250.0]), size)
    within = replace(above, centre=np.array([x, y, top - 5.0]))

    assert checked(path, above).smallest > 0.5
    with pytest.raises(ClearanceError, match=r"arm's link \d reaches .* into the obstacle lid"):
        checked(path, within)


def test_the_arm_stays_on_the_side_of_home(path: JointPath) -> None:
    assert branch_of(CELL.robot.home[None], arm=ARM)[0] == path.branch
    assert np.abs(path.joints - CELL.robot.home).max() < np.radians(60.0)
