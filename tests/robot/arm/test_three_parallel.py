"""The closed form of arms with three parallel axes: against iteration, itself, and a solver from outside."""

from __future__ import annotations

from dataclasses import astuple
from importlib import import_module, metadata

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.config import UR_CELL, load_cell
from geoprint.model import FloatArray, Robot
from geoprint.robot.arm.configuration import branch_of, singularity_distances, wrist_angles
from geoprint.robot.arm.kinematics import Arm, NumericInverse
from geoprint.robot.arm.three_parallel import ThreeParallel
from geoprint.robot.arm.urdf import chain_of
from tests.robot.arms import arm_of_lines, three_parallel_axes

NO_TOOL = np.eye(4)


def turned(*, seed: int, signs: FloatArray) -> Arm:
    """Return the arm with joints counted in other directions, on a base that is turned and moved."""
    screws = Arm(three_parallel_axes(), T_flange_tool=NO_TOOL).screws()
    attitude = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    T_base_foot = transforms.rigid(attitude, np.array([50.0, -20.0, 35.0]))
    flange = T_base_foot @ screws.T_base_flange @ transforms.rigid(attitude, np.array([2.0, -3.0, 4.0]))
    directions = signs[:, None] * (screws.directions @ attitude.T)
    robot = arm_of_lines(transforms.apply(T_base_foot, screws.points), directions, flange, seed=seed)
    return Arm(robot, T_flange_tool=NO_TOOL)


USUAL = Arm(three_parallel_axes(), T_flange_tool=NO_TOOL)
ARMS = [USUAL, turned(seed=3, signs=np.array([-1.0, 1, -1, 1, -1, -1])), turned(seed=4, signs=np.full(6, -1.0))]


def random_joints(count: int) -> FloatArray:
    return np.random.default_rng(11).uniform(-np.pi, np.pi, (count, 6))


@pytest.mark.parametrize("arm", ARMS)
def test_all_solutions_lead_to_the_pose_and_one_back_to_the_joints(arm: Arm) -> None:
    joints = random_joints(1000)
    asked = arm.flange_poses(joints)

    found = arm.solutions(asked)

    assert isinstance(arm.inverse, ThreeParallel)
    exists = np.isfinite(found).all(axis=2)
    misses = np.abs(transforms.wrapped(found - joints[:, None])).max(axis=2)
    assert float(np.nanmin(misses, axis=1).max()) < 1e-7
    off = arm.flange_poses(found[exists]) - np.repeat(asked, exists.sum(axis=1), axis=0)
    assert np.abs(off).max() < 1e-9


@pytest.mark.parametrize("arm", ARMS)
def test_branches_are_numbered_by_the_sides_of_shoulder_elbow_and_wrist(arm: Arm) -> None:
    found = arm.solutions(arm.flange_poses(random_joints(300)))

    exists = np.isfinite(found).all(axis=2)
    np.testing.assert_array_equal(branch_of(found[exists], arm=arm), np.nonzero(exists)[1])


def test_it_finds_what_iteration_finds_from_many_starts() -> None:
    joints = random_joints(60)
    ahead, bend, _ = np.abs(singularity_distances(joints, arm=USUAL)).T
    joints = joints[(ahead > 10.0) & (np.sin(bend) > 0.1) & (wrist_angles(joints, arm=USUAL) > 0.1)]
    numeric = NumericInverse(USUAL.screws(), limits=np.tile([-np.pi, np.pi], (6, 1)))

    closed, iterated = (inverse.solutions(USUAL.flange_poses(joints)) for inverse in (USUAL.inverse, numeric))

    both = np.isfinite(closed) & np.isfinite(iterated)
    assert not (np.isfinite(iterated) & ~both).any()
    assert both.sum() > 0.9 * np.isfinite(closed).sum()
    assert np.abs(transforms.wrapped(closed[both] - iterated[both])).max() < 1e-7


def test_arm_is_singular_where_its_jacobian_is() -> None:
    angles = np.array(
        [[0.4, -1.0, 1.2, 0.3, 0.0, 0.7], [0.4, -1.0, 1.2, 0.3, np.pi, 0.7], [0.4, -1.0, 0.0, 0.3, 1.1, 0.7]]
    )

    conditions = np.linalg.cond(USUAL.jacobians(angles))

    np.testing.assert_allclose(wrist_angles(angles[:2], arm=USUAL), 0.0, atol=1e-12)
    assert singularity_distances(angles, arm=USUAL)[2, 1] == pytest.approx(0.0, abs=1e-12)
    assert (conditions > 1e12).all()


@pytest.mark.parametrize("fifth", [0.0, 1e-16, 1e-9, np.pi])
def test_wrist_singularity_still_leads_back_to_the_pose(fifth: float) -> None:
    asked = USUAL.flange_poses(np.array([[0.3, -0.9, 1.1, 0.4, fifth, 1.0]]))

    found = USUAL.solutions(asked)[0]

    exists = np.isfinite(found).all(axis=1)
    assert exists.sum() >= 4
    np.testing.assert_allclose(USUAL.flange_poses(found[exists]), np.repeat(asked, exists.sum(), axis=0), atol=1e-7)


def test_pose_beside_axis_1_or_too_far_has_no_branch_and_says_how_far_it_is() -> None:
    asked = USUAL.flange_poses(np.zeros((2, 6)))
    asked[0, :3, 3] = 0.0
    asked[1, 0, 3] += 500.0

    found = USUAL.solutions(asked)
    distances, allowed = USUAL.inverse.wrist_distances(asked)

    assert np.isnan(found).all()
    np.testing.assert_allclose(allowed, [32.7, 817.3])
    assert distances[1] > 1000.0


@pytest.mark.needs("ur_analytic_ik")
def test_a_solver_from_outside_finds_the_same_poses_and_the_same_branches() -> None:
    ur5e = import_module("ur_analytic_ik").ur5e
    arm = Arm(load_cell(UR_CELL).robot, T_flange_tool=NO_TOOL)
    joints = random_joints(1000)
    poses = arm.flange_poses(joints)
    for angles, pose, found in zip(joints, poses, arm.solutions(poses), strict=True):
        metres = pose.copy()
        metres[:3, 3] /= 1000.0
        np.testing.assert_allclose(np.array(ur5e.forward_kinematics(*angles)), metres, atol=1e-9, rtol=0.0)
        theirs, ours = np.array(ur5e.inverse_kinematics(metres)), found[np.isfinite(found).all(axis=1)]
        apart = np.abs(transforms.wrapped(ours[:, None] - theirs[None])).max(axis=2)
        assert len(ours) == len(theirs)
        assert max(apart.min(axis=0).max(), apart.min(axis=1).max()) < 1e-8


# Denavit-Hartenberg parameters of the UR5e as its maker publishes them: a and d [mm], alpha [degrees].
PUBLISHED = ((0, 162.5, 90), (-425, 0, 0), (-392.2, 0, 0), (0, 133.3, 90), (0, 99.7, -90), (0, 99.6, 0))


def test_the_urdf_of_the_ur5e_says_what_its_maker_publishes() -> None:
    arm = Arm(load_cell(UR_CELL).robot, T_flange_tool=NO_TOOL)
    joints = random_joints(50)
    for angles, found in zip(joints, arm.flange_poses(joints), strict=True):
        pose = np.eye(4)
        for (a, d, alpha), angle in zip(PUBLISHED, angles, strict=True):
            turn, tilt = (
                Rotation.from_euler(axis, value).as_matrix() for axis, value in (("z", angle), ("x", np.radians(alpha)))
            )
            pose = (
                pose @ transforms.rigid(turn, np.array([0.0, 0.0, d])) @ transforms.rigid(tilt, np.array([a, 0.0, 0.0]))
            )
        np.testing.assert_allclose(found, pose, atol=1e-9)


def test_a_urdf_of_others_is_recognised_by_its_axes() -> None:
    try:
        files = metadata.files("example-robot-data") or []
    except metadata.PackageNotFoundError:
        pytest.skip("not installed: example-robot-data")
    (text,) = (file.read_text(encoding="utf-8") for file in files if file.name == "ur5_robot.urdf")
    chain = chain_of(text, name="ur5", flange="tool0")
    robot = Robot("ur5", chain.limits, chain.speeds, np.full(6, 5.0), np.zeros(6), urdf=text)
    inverse = Arm(robot, T_flange_tool=NO_TOOL).inverse
    assert isinstance(inverse, ThreeParallel)
    lengths = astuple(inverse.lengths)
    np.testing.assert_allclose(lengths, [89.159, 425.0, 392.25, 109.15, 94.65, 82.3], atol=1e-6)
