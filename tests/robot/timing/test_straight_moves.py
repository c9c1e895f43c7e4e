"""One motion: the timed path keeps to the straight moves, where the tool turns far on one step as well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import LimitError
from geoprint.model import FloatArray, JointPath, Targets, Trajectory
from geoprint.robot.controller import written_targets
from geoprint.robot.timing import held_straight, off_moves, retime
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import arm_of, line, solved, stream, tilted

CELL = bent_cell()
ARM = arm_of(CELL)
# Steps of 0.06 mm on which the tool turns by 1 degree each, then one of 0.5 mm and 10 degrees: a crease of a part.
STEPS = np.array([0.06] * 12 + [0.5] + [0.06] * 12)
TURNS = np.radians([1.0] * 12 + [10.0] + [0.0] * 12)


def crease() -> JointPath:
    arcs, angles = (np.append(0.0, np.cumsum(each)) for each in (STEPS, TURNS))
    tips = np.column_stack([arcs, np.zeros(arcs.size), np.zeros(arcs.size)])
    return solved(stream(tips, quaternions=tilted(angles - angles[-1] / 2.0)), ARM)


def off_line(path: JointPath, trajectory: Trajectory) -> tuple[FloatArray, FloatArray]:
    """Return how far the rows between first and last pose are from the line of the tips [mm], and from its plane."""
    rows = (trajectory.times > trajectory.pose_times[0]) & (trajectory.times < trajectory.pose_times[-1])
    found = transforms.inverse(path.T_base_work) @ ARM.tool_poses(trajectory.joints[rows])
    return np.linalg.norm(found[:, 1:3, 3], axis=1), found[:, 0, 3]


def timed(path: JointPath) -> Trajectory:
    return retime(path, CELL.robot, process=CELL.process)


def test_a_crease_is_passed_on_the_line_between_its_poses_and_nowhere_else() -> None:
    path = crease()
    held = held_straight(path, ARM, process=CELL.process)
    assert off_line(path, timed(path))[0].max() > 0.05
    assert off_line(held, timed(held))[0].max() < 0.0065
    assert 0 < held.via_rows.size < 16
    # The poses are what they were, and each is passed.
    np.testing.assert_array_equal(held.joints, path.joints)
    assert held.poses is path.poses
    assert timed(held).pose_times.size == path.poses.count


def test_via_points_lie_on_their_moves_with_the_attitude_of_a_constant_turn() -> None:
    path = crease()
    held = held_straight(path, ARM, process=CELL.process)
    found = transforms.inverse(path.T_base_work) @ ARM.tool_poses(held.via_joints)
    step = held.via_rows.astype(np.int64)
    share = held.via_rows - step
    arcs, angles = (np.append(0.0, np.cumsum(each)) for each in (STEPS, TURNS))
    np.testing.assert_allclose(found[:, 0, 3], arcs[step] + share * STEPS[step], atol=1e-6)
    np.testing.assert_allclose(found[:, 1:3, 3], 0.0, atol=1e-6)
    meant = angles[step] + share * TURNS[step] - angles[-1] / 2.0
    quaternions = np.roll(Rotation.from_matrix(found[:, :3, :3]).as_quat(), 1, axis=1)
    wanted = tilted(meant)
    signs = np.sign((quaternions * wanted).sum(axis=1, keepdims=True))
    np.testing.assert_allclose(signs * quaternions, wanted, atol=1e-6)


def test_a_path_that_keeps_to_its_moves_has_no_via_points() -> None:
    tips = line((0.0, 0.0, 0.0), (20.0, 0.0, 0.0), count=41)
    path = solved(stream(tips, quaternions=tilted(np.linspace(0.0, 0.2, 41))), ARM)
    assert held_straight(path, ARM, process=CELL.process) is path


def test_a_part_of_a_path_keeps_its_own_via_points() -> None:
    held = held_straight(crease(), ARM, process=CELL.process)
    part = held.between(10, 20)
    inside = (held.via_rows > 10) & (held.via_rows < 19)
    np.testing.assert_array_equal(part.via_rows, held.via_rows[inside] - 10)
    np.testing.assert_array_equal(part.via_joints, held.via_joints[inside])
    assert not held.between(0, 2).via_rows.size


def test_what_is_off_the_written_moves_is_found_all_along_and_refused() -> None:
    path = crease()
    held = held_straight(path, ARM, process=CELL.process)
    trajectory = timed(held)
    targets = written_targets(held, trajectory, process=CELL.process)
    found = off_moves(trajectory, held, targets, ARM)
    assert 0.0 < found.distance < 0.015
    assert 0.0 < found.turn < np.radians(0.15)
    loose = timed(path)
    with pytest.raises(LimitError, match=r"run 1: at .* the timed path is .* mm and .* degrees from the move"):
        off_moves(loose, path, written_targets(path, loose, process=CELL.process), ARM)


def test_a_motion_is_off_by_as_much_as_its_targets_are_moved() -> None:
    tips = line((0.0, 0.0, 0.0), (20.0, 0.0, 0.0), count=41)
    path = solved(stream(tips), ARM)
    trajectory = timed(path)
    targets = Targets(poses=np.array([0, 20, 40]), zones=np.zeros(3), speeds=np.full(3, 20.0))
    moved = path.poses.tips.copy()
    moved[20, 1] += 0.015
    aside = replace(path, poses=replace(path.poses, tips=moved))
    assert off_moves(trajectory, path, targets, ARM).distance < 0.001
    assert off_moves(trajectory, aside, targets, ARM).distance == pytest.approx(0.015, abs=0.001)
