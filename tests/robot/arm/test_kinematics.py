"""The arm's forward kinematics and its eight inverse solutions."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import UsageError, VerificationError
from geoprint.model import Cell, FloatArray, Robot
from geoprint.robot.arm import confirmation, unconfirmed_kinematics
from geoprint.robot.arm.kinematics import Arm
from geoprint.robot.arm.urdf import read_urdf
from tests.robot.arms import closed_form
from tests.robot.cells import bent_cell, straight_cell

ANGLES = st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6)


@pytest.fixture(scope="module")
def arm() -> Arm:
    cell = bent_cell()
    return Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)


def reference_flange_pose(angles: FloatArray) -> FloatArray:
    """Multiply the six joints of the IRB 120 one by one, lengths as published [mm]."""
    origins = np.array([[0, 0, 0], [0, 0, 290], [0, 0, 270], [0, 0, 70], [302, 0, 0], [72, 0, 0]], dtype=float)
    pose = np.eye(4)
    for axis, origin, angle in zip("zyyxyx", origins, angles, strict=True):
        pose = pose @ transforms.rigid(Rotation.from_euler(axis, angle).as_matrix(), origin)
    return pose @ transforms.rigid(Rotation.from_euler("y", 90, degrees=True).as_matrix(), np.zeros(3))


def test_flange_of_the_arm_at_zero_points_ahead_at_the_published_place(arm: Arm) -> None:
    pose = arm.flange_poses(np.zeros((1, 6)))[0]
    np.testing.assert_allclose(pose[:3, 3], [374.0, 0.0, 630.0], atol=1e-9)
    np.testing.assert_allclose(pose[:3, 2], [1.0, 0.0, 0.0], atol=1e-12)


def test_lengths_are_those_of_the_data_sheet(arm: Arm) -> None:
    lengths = closed_form(arm).lengths
    found = [lengths.a1, lengths.a2, lengths.b, lengths.c1, lengths.c2, lengths.c3, lengths.c4]
    np.testing.assert_allclose(found, [0.0, -70.0, 0.0, 290.0, 270.0, 302.0, 72.0], atol=1e-9)


@pytest.mark.parametrize(("cell", "above"), [(bent_cell(), (300, 0, 150)), (straight_cell(), (350, 0, 300))])
def test_home_holds_the_nozzle_straight_down_above_the_part(cell: Cell, above: tuple[float, float, float]) -> None:
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    pose = arm.tool_poses(cell.robot.home[None])[0]
    np.testing.assert_allclose(pose[:3, 2], [0.0, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(pose[:3, 3], above, atol=3.0)


@settings(max_examples=50, deadline=None)
@given(ANGLES)
def test_poses_are_the_product_of_single_joints(arm: Arm, angles: list[float]) -> None:
    found = arm.flange_poses(np.array([angles]))[0]
    np.testing.assert_allclose(found, reference_flange_pose(np.array(angles)), atol=1e-9)


def test_tool_follows_the_flange(arm: Arm) -> None:
    joints = np.array([[0.3, -0.2, 0.1, 0.5, 0.9, -1.0], [0.0, 0.4, 0.2, -1.5, 0.3, 2.0]])
    np.testing.assert_allclose(arm.tool_poses(joints), arm.flange_poses(joints) @ arm.T_flange_tool, atol=1e-9)


@settings(max_examples=50, deadline=None)
@given(ANGLES)
def test_every_solution_leads_back_to_its_pose(arm: Arm, angles: list[float]) -> None:
    pose = arm.tool_poses(np.array([angles]))
    solutions = arm.solutions(pose)[0]
    exist = np.isfinite(solutions).all(axis=1)
    assert exist.any()
    assert (solutions[exist] > -np.pi).all()
    assert (solutions[exist] <= np.pi).all()
    np.testing.assert_allclose(arm.tool_poses(solutions[exist]), np.broadcast_to(pose, (exist.sum(), 4, 4)), atol=1e-5)


def test_branch_that_does_not_exist_is_nan(arm: Arm) -> None:
    pose = arm.tool_poses(np.zeros((1, 6)))
    pose[0, 0, 3] += 1000.0
    solutions = arm.solutions(pose)
    assert solutions.shape == (1, 8, 6)
    assert np.isnan(solutions).all()


def test_no_poses_have_no_solutions(arm: Arm) -> None:
    assert arm.solutions(np.empty((0, 4, 4))).shape == (0, 8, 6)
    assert arm.tool_poses(np.empty((0, 6))).shape == (0, 4, 4)


def test_tool_frame_of_an_arm_cannot_be_changed_from_outside() -> None:
    cell = straight_cell()
    T_flange_tool = cell.tool.T_flange_tool.copy()
    arm = Arm(cell.robot, T_flange_tool=T_flange_tool)
    T_flange_tool[2, 3] = 0.0
    assert arm.T_flange_tool[2, 3] == 160.0
    with pytest.raises(ValueError, match="read-only"):
        arm.T_flange_tool[2, 3] = 0.0


def test_the_skeleton_goes_from_the_base_to_the_flange_in_links_of_constant_length() -> None:
    arm = Arm(straight_cell().robot, T_flange_tool=np.eye(4))
    joints = np.random.default_rng(1).uniform(-1.0, 1.0, size=(20, 6))
    places = arm.link_poses(joints)[:, :, :3, 3]
    np.testing.assert_array_equal(places[:, 0], 0.0)
    np.testing.assert_allclose(places[:, -1], arm.flange_poses(joints)[:, :3, 3], atol=1e-9)
    lengths = np.linalg.norm(np.diff(places, axis=1), axis=2)
    np.testing.assert_allclose(lengths, np.tile([0.0, 290.0, 270.0, 70.0, 302.0, 72.0, 0.0], (20, 1)), atol=1e-9)


def test_unknown_arm_is_refused_with_the_known_ones() -> None:
    cell = straight_cell()
    robot = Robot(
        model="../irb120",
        limits=cell.robot.limits,
        speeds=cell.robot.speeds,
        accelerations=cell.robot.accelerations,
        home=cell.robot.home,
    )
    with pytest.raises(UsageError, match=r"\.\./irb120.*known are: irb120"):
        Arm(robot, T_flange_tool=np.eye(4))


def test_a_cell_that_allows_the_arm_more_than_its_maker_is_refused_with_every_limit_that_is_wider() -> None:
    robot = straight_cell().robot
    limits, speeds = robot.limits.copy(), robot.speeds.copy()
    limits[0] *= 1.01
    limits[3, 1] += np.radians(0.001)
    speeds[5] *= 1.01
    with pytest.raises(UsageError) as refused:
        Arm(replace(robot, limits=limits, speeds=speeds), T_flange_tool=np.eye(4))
    assert str(refused.value) == (
        "robot: the cell allows the irb120 more than its maker: joint 1 -166.65, 166.65 degrees, the maker -165, 165; "
        "joint 4 -160, 160.001 degrees, the maker -160, 160; joint 6 424.2 deg/s, the maker 420: correct limits_deg or "
        "speeds_deg_s in the cell file."
    )


def test_pinocchio_finds_the_same_frames(arm: Arm) -> None:
    pytest.importorskip("pinocchio")
    joints = np.random.default_rng(0).uniform(-3.0, 3.0, (200, 6))
    links, flanges = arm.link_poses(joints)[:, 1:-1], arm.flange_poses(joints)
    confirmation.confirm(arm.robot, joints=joints, Ts_base_link=links, Ts_base_flange=flanges)

    links[7, 3, 0, 3] += 1e-5
    with pytest.raises(VerificationError, match=r"Pinocchio finds link 4 of the irb120 1e-08 m away at"):
        confirmation.confirm(arm.robot, joints=joints, Ts_base_link=links, Ts_base_flange=flanges)


def test_pinocchio_finds_the_same_frames_whatever_the_urdf_counts_and_fixes() -> None:
    pytest.importorskip("pinocchio")
    post = '<joint name="foot" type="fixed"><origin xyz="0.1 0.2 -0.3" rpy="0.3 -1.1 2"/>'
    post += '<parent link="base_link"/><child link="post"/></joint><link name="post"/></robot>'
    text = read_urdf("irb120").replace('<parent link="base_link"/>', '<parent link="post"/>').replace("</robot>", post)
    text = text.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 -2"/>')
    found = Arm(replace(straight_cell().robot, urdf=text), T_flange_tool=np.eye(4))
    attitude = Rotation.from_euler("xyz", [0.3, -1.1, 2.0]).as_matrix()
    joints = np.array([0.4, -0.3, 0.2, 1.0, 0.6, -2.0])
    wanted = transforms.rigid(attitude, np.array([100.0, 200.0, -300.0]))
    wanted = wanted @ reference_flange_pose(joints * [-1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    np.testing.assert_allclose(found.flange_poses(joints[None])[0], wanted, atol=1e-9)


def test_without_pinocchio_the_arm_is_the_same_and_said_not_to_be_confirmed(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_: str) -> None:
        return None

    assert unconfirmed_kinematics() == ()
    monkeypatch.setattr(confirmation.importlib.util, "find_spec", missing)
    monkeypatch.setattr(confirmation, "import_module", pytest.fail)
    Arm(straight_cell().robot, T_flange_tool=np.eye(4))
    assert unconfirmed_kinematics() == ("the kinematics, by a second library: pin is not installed",)


def test_a_broken_pinocchio_is_named_with_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: str) -> None:
        raise ImportError("libpinocchio.so: undefined symbol")

    monkeypatch.setattr(confirmation, "import_module", broken)
    with pytest.raises(UsageError, match=r"pin is installed but cannot be imported \(libpinocchio.*uninstall"):
        Arm(straight_cell().robot, T_flange_tool=np.eye(4))


@pytest.mark.parametrize(
    ("part", "instead", "reason"),
    [
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 1 0"/>', "axes 1 and 2 are not at right.*cannot move its flange in all"),
        ('<link name="tool0"/>', '<link name="hand"/>', "no link 'tool0' for the flange"),
        ('name="joint_6" type="revolute"', 'name="joint_6" type="fixed"', "by 5 joints"),
    ],
)
def test_arm_that_cannot_be_moved_is_refused(part: str, instead: str, reason: str) -> None:
    text = read_urdf("irb120")
    assert part in text
    robot = replace(straight_cell().robot, urdf=text.replace(part, instead))
    with pytest.raises(UsageError, match=reason):
        Arm(robot, T_flange_tool=np.eye(4))


def test_importing_the_module_does_not_load_pinocchio() -> None:
    code = "import sys, geoprint.robot.arm.kinematics; print({'pinocchio'} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "set()"
