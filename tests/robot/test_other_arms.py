"""Arms that are not the IRB 120: other conventions of the URDF, and wrists that no closed form covers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.parts.streams import spiral
from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.model import FloatArray, Robot
from geoprint.robot.arm.configuration import branch_of, require_abb_conventions, singularity_distances, wrist_angles
from geoprint.robot.arm.kinematics import Arm, NumericInverse
from geoprint.robot.arm.ortho_parallel import Screws
from geoprint.robot.arm.urdf import read_urdf
from geoprint.robot.reach import reach
from tests.robot.arms import closed_form, offset_wrist, other_conventions, three_parallel_axes
from tests.robot.cells import bent_cell

TURN = np.pi / 2.0
HANGING = np.diag([1.0, -1.0, -1.0])
# Forearm up at zero and joints 1, 3 and 5 counted backwards; everything at odd angles, hung from the ceiling.
CONVENTIONS = {
    "forearm up": (np.array([0.0, 0.0, -TURN, 0.0, 0.0, 0.0]), np.array([-1.0, 1, -1, 1, -1, 1]), np.eye(3)),
    "odd zeros": (np.array([0.4, -0.9, 0.8, 2.2, TURN, -1.0]), np.array([1.0, -1, -1, -1, 1, -1]), np.eye(3)),
    "ceiling": (np.array([-2.0, 1.1, 0.3, -0.7, -2.5, 3.0]), np.array([-1.0, -1, 1, 1, -1, -1]), HANGING),
}


def arm_of(robot: Robot) -> Arm:
    return Arm(robot, T_flange_tool=bent_cell().tool.T_flange_tool)


def other(name: str) -> Arm:
    offsets, signs, attitude = CONVENTIONS[name]
    T_base_foot = transforms.rigid(attitude, np.array([120.0, -80.0, 35.0]))
    return arm_of(other_conventions(offsets=offsets, signs=signs, T_base_foot=T_base_foot, seed=len(name)))


def random_joints(count: int) -> FloatArray:
    return np.random.default_rng(5).uniform(-np.pi, np.pi, (count, 6))


def away_from_singularities(arm: Arm, joints: FloatArray) -> FloatArray:
    ahead, bend, _ = np.abs(singularity_distances(joints, arm=arm)).T
    return joints[(ahead > 5.0) & (np.sin(bend) > 0.05) & (wrist_angles(joints, arm=arm) > 0.05)]


def farthest_from_any(found: FloatArray, joints: FloatArray) -> float:
    """Return the largest distance of known joint angles from the nearest of their solutions [rad]."""
    misses = np.abs(transforms.wrapped(found - joints[:, None])).max(axis=2)
    return float(np.nanmin(misses, axis=1).max())


@pytest.mark.parametrize("name", list(CONVENTIONS))
def test_closed_form_is_exact_whatever_the_urdf_counts_from(name: str) -> None:
    arm = other(name)
    joints = away_from_singularities(arm, random_joints(1000))
    assert len(joints) > 500
    asked = arm.tool_poses(joints)
    found = arm.solutions(asked)
    assert farthest_from_any(found, joints) < 1e-9
    exists = np.isfinite(found).all(axis=2)
    assert exists.sum() > 4 * len(joints)
    miss = arm.tool_poses(found[exists]) - np.repeat(asked, exists.sum(axis=1), axis=0)
    assert np.linalg.norm(miss[:, :3, 3], axis=1).max() < 1e-7
    # For small angles the difference of two rotations is sqrt(2) times the angle between them.
    assert np.linalg.norm(miss[:, :3, :3], axis=(1, 2)).max() / np.sqrt(2.0) < 1e-9


@pytest.mark.parametrize("name", list(CONVENTIONS))
def test_lengths_do_not_depend_on_what_the_urdf_counts_from(name: str) -> None:
    lengths = closed_form(other(name)).lengths
    found = [lengths.a1, lengths.a2, lengths.b, lengths.c2, lengths.c3]
    np.testing.assert_allclose(found, [40.0, -70.0, 15.0, 270.0, 302.0], atol=1e-9)


@pytest.mark.parametrize("name", list(CONVENTIONS))
def test_branches_keep_their_numbers_and_the_wrist_its_singularity(name: str) -> None:
    arm = other(name)
    joints = away_from_singularities(arm, random_joints(200))
    found = arm.solutions(arm.tool_poses(joints))
    exists = np.isfinite(found).all(axis=2)
    np.testing.assert_array_equal(branch_of(found[exists], arm=arm), np.nonzero(exists)[1])
    straight = joints.copy()
    straight[:, 4] -= closed_form(arm).signs[4] * singularity_distances(joints, arm=arm)[:, 2]
    np.testing.assert_allclose(wrist_angles(straight, arm=arm), 0.0, atol=1e-12)
    screws = arm.screws()
    rest, bent = (arm.link_poses(angles)[:, [4, 6], :3, :3] for angles in (np.zeros((1, 6)), straight))
    turns = np.swapaxes(bent @ np.swapaxes(rest, 2, 3), 0, 1)
    fourth, sixth = (turn @ screws.directions[joint] for turn, joint in zip(turns, (3, 5), strict=True))
    np.testing.assert_allclose(np.cross(fourth, sixth), 0.0, atol=1e-9)


def test_the_packaged_arm_is_read_as_abb_counts() -> None:
    found = closed_form(arm_of(bent_cell().robot))
    np.testing.assert_array_equal(found.offsets, np.zeros(6))
    np.testing.assert_array_equal(found.signs, np.ones(6))
    np.testing.assert_array_equal(found.T_base_foot, np.eye(4))
    np.testing.assert_array_equal(found.T_end_flange, np.eye(4))
    require_abb_conventions(arm_of(bent_cell().robot))


@pytest.mark.parametrize(
    ("name", "reason"), [("forearm up", "joint 1 counts down"), ("ceiling", "joint 1"), ("odd zeros", "joint 2")]
)
def test_no_rapid_program_for_an_arm_that_counts_otherwise(name: str, reason: str) -> None:
    with pytest.raises(UsageError, match=f"a RAPID program.*{reason}"):
        require_abb_conventions(other(name))


def test_no_rapid_program_for_an_arm_whose_frame_alone_is_another() -> None:
    moved = transforms.rigid(np.eye(3), np.array([0.0, 20.0, 0.0]))
    robot = other_conventions(offsets=np.zeros(6), signs=np.ones(6), T_base_foot=moved, seed=3)
    with pytest.raises(UsageError, match="its base frame is another"):
        require_abb_conventions(arm_of(robot))


def test_no_rapid_program_for_an_arm_without_a_spherical_wrist() -> None:
    with pytest.raises(UsageError, match=r"axes 4, 5 and 6 do not meet: .* by 40 mm.*singularities.*joint-trajectory"):
        require_abb_conventions(arm_of(offset_wrist()))


def test_iteration_converges_near_where_it_starts() -> None:
    arm = arm_of(offset_wrist())
    assert isinstance(arm.inverse, NumericInverse)
    joints = random_joints(2000)
    poses = arm.flange_poses(joints)
    starts = joints + np.random.default_rng(1).uniform(-0.2, 0.2, joints.shape)
    found = arm.inverse.refined(poses, starts)
    exists = np.isfinite(found).all(axis=1)
    assert exists.mean() >= 0.99
    miss = np.abs(arm.flange_poses(found[exists]) - poses[exists])
    assert miss[:, :3, 3].max() < 1e-6
    assert miss[:, :3, :3].max() < 1e-9


def test_iteration_says_where_it_does_not_converge() -> None:
    arm = arm_of(offset_wrist())
    assert isinstance(arm.inverse, NumericInverse)
    poses = arm.flange_poses(np.zeros((1, 6)))
    poses[:, 0, 3] += 2000.0
    assert np.isnan(arm.inverse.refined(poses, np.zeros((1, 6)))).all()
    assert np.isnan(arm.inverse.solutions(poses)).all()


def test_iteration_finds_every_solution_of_an_arm_whose_solutions_the_signs_tell_apart() -> None:
    arm = arm_of(three_parallel_axes())
    joints = away_from_singularities(arm, random_joints(60))
    numeric = NumericInverse(arm.screws(), limits=np.tile([-np.pi, np.pi], (6, 1)))
    found = numeric.solutions(arm.flange_poses(joints))
    exists = np.isfinite(found).all(axis=2)
    assert farthest_from_any(found, joints) < 1e-6
    assert np.isin(exists.sum(axis=1), [2, 4, 6, 8]).mean() > 0.9
    np.testing.assert_array_equal(branch_of(found[exists], arm=arm), np.nonzero(exists)[1])
    reached = arm.tool_poses(found[exists])
    np.testing.assert_allclose(reached, np.repeat(arm.tool_poses(joints), exists.sum(axis=1), axis=0), atol=1e-6)


def test_iteration_agrees_with_the_closed_form_where_there_is_one() -> None:
    arm = arm_of(bent_cell().robot)
    numeric = NumericInverse(arm.screws(), limits=np.tile([-np.pi, np.pi], (6, 1)))
    joints = away_from_singularities(arm, random_joints(40))
    poses = arm.flange_poses(joints)
    closed, iterated = arm.inverse.solutions(poses), numeric.solutions(poses)
    np.testing.assert_array_equal(np.isfinite(closed), np.isfinite(iterated))
    np.testing.assert_allclose(transforms.wrapped(closed - iterated), 0.0 * closed, atol=1e-8)
    np.testing.assert_allclose(
        numeric.singularity_distances(joints), arm.inverse.singularity_distances(joints), atol=1e-9
    )


def test_solutions_along_a_path_are_continuous_on_every_branch_that_lasts() -> None:
    arm = arm_of(offset_wrist())
    start = np.array([0.3, 0.4, -0.2, 0.5, 0.9, 0.1])
    joints = start + np.linspace(0.0, 0.2, 60)[:, None] * np.array([1.0, -1.0, 0.5, 1.0, -0.5, 1.0])
    found = arm.solutions(arm.tool_poses(joints))
    lasting = np.isfinite(found).all(axis=(0, 2))
    assert lasting.sum() >= 4
    assert np.abs(transforms.wrapped(np.diff(found[:, lasting], axis=0))).max() < 0.1
    own = np.abs(transforms.wrapped(found - joints[:, None])).max(axis=(0, 2))
    assert np.nanmin(own) < 1e-8


def test_the_flange_never_comes_farther_than_the_reach() -> None:
    for robot in (offset_wrist(), three_parallel_axes(), bent_cell().robot):
        arm = arm_of(robot)
        away = np.linalg.norm(arm.flange_poses(random_joints(3000))[:, :3, 3] - arm.inverse.shoulder, axis=1)
        assert 0.7 * arm.inverse.reach < away.max() <= arm.inverse.reach


def test_points_of_two_lines_that_are_nearest_to_each_other() -> None:
    points, directions = np.zeros((6, 3)), np.tile([1.0, 0.0, 0.0], (6, 1))
    points[1], directions[1] = [7.0, 3.0, 5.0], [0.0, 1.0, 0.0]
    points[2] = [4.0, 0.0, 2.0]
    screws = Screws(points, directions, np.eye(4))
    np.testing.assert_allclose(screws.nearest(0, 1), [7.0, 0.0, 0.0])
    np.testing.assert_allclose(screws.nearest(1, 0), [7.0, 0.0, 5.0])
    np.testing.assert_allclose(screws.nearest(0, 2), [4.0, 0.0, 0.0])
    assert screws.distance(0, points[1]) == pytest.approx(np.hypot(3.0, 5.0))


def test_limits_that_do_not_contain_zero_are_compared_rightly() -> None:
    robot = offset_wrist()
    assert robot.urdf is not None
    text = robot.urdf.replace(f'lower="{-4.0 * TURN}" upper="{4.0 * TURN}"', 'lower="0.5" upper="2.5"', 1)
    limits = robot.limits.copy()
    limits[0] = [0.5, 2.5]
    home = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    arm_of(replace(robot, urdf=text, limits=limits, home=home))
    limits[0] = [0.4, 2.5]
    with pytest.raises(UsageError, match="more than its maker: joint 1"):
        arm_of(replace(robot, urdf=text, limits=limits, home=home))


def test_rounded_angles_in_a_urdf_are_named_as_the_reason() -> None:
    robot = bent_cell().robot
    text = read_urdf("irb120").replace(
        '<origin xyz="0 0 0.270" rpy="0 0 0"/>', '<origin xyz="0 0 0.270" rpy="0.0000037 0 0"/>'
    )
    arm = arm_of(replace(robot, urdf=text))
    assert arm.no_closed_form is not None
    assert "axes 2 and 3 are not parallel: they miss it by 3.7e-06 rad" in arm.no_closed_form


def test_an_arm_without_a_closed_form_reaches_a_short_run() -> None:
    cell = bent_cell()
    limits = np.clip(cell.robot.limits, -2.0 * np.pi, 2.0 * np.pi)
    arm = arm_of(replace(offset_wrist(), limits=limits, home=cell.robot.home))
    # Six keyframes: 72 turns about the nozzle, each pose by iteration from 64 starts.
    path = reach(spiral(6, standoff=0.3), arm, T_base_work=transforms.rigid(np.eye(3), np.array([300.0, 0.0, 50.0])))
    assert np.abs(np.diff(path.joints, axis=0)).max() < 0.5
    assert (path.joints >= limits[:, 0]).all()
    assert (path.joints <= limits[:, 1]).all()
