"""The compiled closed form against Pinocchio, an independent solver, and its own numbering of branches."""

from __future__ import annotations

from dataclasses import asdict, astuple, replace

import numpy as np
import pytest
from py_opw_kinematics import KinematicModel, Robot
from scipy.spatial.transform import RigidTransform

from geoprint import transforms
from geoprint.model import FloatArray
from geoprint.robot.arm.configuration import branch_of
from geoprint.robot.arm.kinematics import Arm
from geoprint.robot.arm.ortho_parallel import BRANCHES, all_branches
from tests.robot.arms import closed_form
from tests.robot.cells import bent_cell

ARM = Arm(bent_cell().robot, T_flange_tool=bent_cell().tool.T_flange_tool)
LENGTHS_OF_ARM = closed_form(ARM).lengths
LENGTHS = np.array(astuple(LENGTHS_OF_ARM))


def random_joints(count: int) -> FloatArray:
    limits = ARM.robot.limits.clip(-np.pi, np.pi)
    return np.random.default_rng(7).uniform(limits[:, 0], limits[:, 1], (count, 6))


def independent_branches(Ts_base_flange: FloatArray) -> FloatArray:
    """Return all branches by py-opw-kinematics, which works in metres and counts joint 3 from the stretched arm."""
    metres = {letter: length / 1000.0 for letter, length in asdict(LENGTHS_OF_ARM).items()}
    model = KinematicModel(**metres, offsets=(0.0, 0.0, -np.pi / 2.0, 0.0, 0.0, 0.0))
    poses = Ts_base_flange.copy()
    poses[:, :3, 3] /= 1000.0
    return transforms.wrapped(Robot(model, degrees=False).reach(RigidTransform.from_matrix(poses)).joints)


def test_one_branch_leads_back_to_the_joints_and_all_of_them_to_the_pose() -> None:
    joints = random_joints(500)
    asked = ARM.flange_poses(joints)
    found = all_branches(asked, LENGTHS)
    misses = np.abs(transforms.wrapped(found - joints[:, None])).max(axis=2)
    assert misses.min(axis=1).max() < 1e-9
    reached = ARM.flange_poses(found.reshape(-1, 6)).reshape(500, BRANCHES, 4, 4)
    np.testing.assert_allclose(reached, np.repeat(asked[:, None], BRANCHES, axis=1), atol=1e-7)
    assert (np.abs(found) <= np.pi).all()


def test_branches_are_numbered_as_configuration_numbers_them() -> None:
    found = all_branches(ARM.flange_poses(random_joints(200)), LENGTHS)
    np.testing.assert_array_equal(
        branch_of(found.reshape(-1, 6), arm=ARM).reshape(200, 8), np.tile(np.arange(8), (200, 1))
    )


def test_it_agrees_with_an_independent_solver_also_where_branches_are_missing() -> None:
    asked = ARM.flange_poses(random_joints(500))
    asked[:, :3, 3] *= np.linspace(0.2, 2.0, 500)[:, None]
    one, other = all_branches(asked, LENGTHS), independent_branches(asked)
    np.testing.assert_array_equal(np.isnan(one), np.isnan(other))
    assert 0.1 < np.isnan(one).mean() < 0.9
    np.testing.assert_allclose(transforms.wrapped(one - other), 0.0 * one, atol=1e-8)


def test_arm_with_offsets_that_the_irb_120_lacks_has_up_to_four_places_of_the_wrist() -> None:
    # With a1 and b the sides of axis 1 are reached differently; every one must lead to the wrist centre asked for.
    lengths = astuple(replace(LENGTHS_OF_ARM, a1=40.0, b=15.0))
    a1, a2, b, c1, c2, c3, _ = lengths
    found = all_branches(ARM.flange_poses(random_joints(100)), np.array(lengths))
    asked = ARM.flange_poses(random_joints(100))
    wrist = asked[:, :3, 3] - lengths[6] * asked[:, :3, 2]
    first, second, third = found[..., 0], found[..., 1], found[..., 2] + np.pi / 2.0
    ahead = a1 + c2 * np.sin(second) + a2 * np.cos(second + third) + c3 * np.sin(second + third)
    up = c1 + c2 * np.cos(second) - a2 * np.sin(second + third) + c3 * np.cos(second + third)
    reached = np.stack(
        [ahead * np.cos(first) - b * np.sin(first), ahead * np.sin(first) + b * np.cos(first), up], axis=-1
    )
    exists = np.isfinite(found[..., 0])
    assert 0.3 < exists.mean() < 1.0
    np.testing.assert_allclose(reached[exists], np.repeat(wrist[:, None], 8, axis=1)[exists], atol=1e-9)


def test_pose_on_axis_2_has_no_branch_rather_than_an_error() -> None:
    asked = transforms.rigid(np.eye(3), np.array([[0.0, 0.0, LENGTHS_OF_ARM.c1 + LENGTHS_OF_ARM.c4]]))
    assert np.isnan(all_branches(asked, LENGTHS)).all()


@pytest.mark.parametrize("fifth", [0.0, 1e-16, 1e-9, -1e-6])
def test_wrist_singularity_still_leads_back_to_the_pose(fifth: float) -> None:
    asked = ARM.flange_poses(np.array([[0.3, 0.2, -0.4, 1.1, fifth, 1.0], [0.0, 0.0, 0.0, 0.0, fifth, 1.0]]))
    found = all_branches(asked, LENGTHS)
    reached = ARM.flange_poses(found.reshape(-1, 6)).reshape(2, BRANCHES, 4, 4)
    np.testing.assert_allclose(reached, np.repeat(asked[:, None], BRANCHES, axis=1), atol=1e-9)
