"""Branch numbers and RAPID configuration data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from geoprint.robot.arm.configuration import branch_of, configuration_data, singularity_distances
from geoprint.robot.arm.kinematics import Arm
from geoprint.robot.arm.urdf import read_urdf
from tests.robot.cells import straight_cell

# Branch of the solver for cfx 0 to 7, as RobotComponents orders the same solutions for the same controllers.
BRANCH_OF_CFX = np.array([0, 4, 1, 5, 2, 6, 3, 7])


@pytest.fixture(scope="module")
def arm() -> Arm:
    cell = straight_cell()
    return Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)


@pytest.mark.parametrize(
    ("joints_deg", "cfx"),
    [
        ((0, 0, 0, 0, 30, 0), 0),
        ((0, 0, 0, 0, -30, 0), 1),
        ((0, 60, -100, 0, 30, 0), 2),
        ((0, 60, -100, 0, -30, 0), 3),
        ((0, -100, 0, 0, 30, 0), 4),
        ((0, -100, 0, 0, -30, 0), 5),
        ((0, -60, -100, 0, 30, 0), 6),
        ((0, -60, -100, 0, -30, 0), 7),
    ],
)
def test_cfx_follows_the_table_of_the_reference(arm: Arm, joints_deg: tuple[float, ...], cfx: int) -> None:
    assert configuration_data(np.radians([joints_deg]), arm=arm)[0, 3] == cfx


@pytest.mark.parametrize(
    ("joints_deg", "cfx"),
    [
        ((-103.1, -85.03, 19.06, -70.19, -35.87, 185.01), 5),
        ((-124.68, -61.16, -20.4, 56.41, -38.79, -24.56), 5),
        ((-103.1, -85.03, 19.06, 109.81, 35.87, 5.01), 4),
        ((-124.68, -61.16, -20.4, -123.59, 38.79, 155.44), 4),
    ],
)
def test_cfx_agrees_with_published_cases_of_an_irb_1660(joints_deg: tuple[float, ...], cfx: int) -> None:
    # An arm whose axes 1 and 2 are apart; the cases are those of the tests of py-opw-kinematics.
    urdf = read_urdf("irb120")
    for ours, theirs in [
        ("0 0 0.290", "0.150 0 0.4865"),
        ("0 0 0.270", "0 0 0.700"),
        ("0 0 0.070", "0 0 0.110"),
        ("0.302 0 0", "0.678 0 0"),
        ("0.072 0 0", "0.135 0 0"),
    ]:
        urdf = urdf.replace(f'xyz="{ours}"', f'xyz="{theirs}"')

    arm = Arm(replace(straight_cell().robot, urdf=urdf), T_flange_tool=np.eye(4))
    joints = np.radians([joints_deg])
    assert configuration_data(joints, arm=arm)[0, 3] == cfx
    assert branch_of(joints, arm=arm)[0] == BRANCH_OF_CFX[cfx]


@pytest.mark.parametrize(
    ("angle_deg", "quadrant"),
    [
        (0, 0),
        (45, 0),
        (90, 1),
        (179.9, 1),
        (180, 2),
        (360, 4),
        (400, 4),
        (-0.1, -1),
        (-90, -1),
        (-90.1, -2),
        (-400, -5),
    ],
)
def test_quadrants_count_quarter_turns(arm: Arm, angle_deg: float, quadrant: int) -> None:
    joints = np.radians([[angle_deg, 0.0, 0.0, angle_deg, 30.0, angle_deg]])
    assert configuration_data(joints, arm=arm)[0, :3].tolist() == [quadrant] * 3


@pytest.mark.parametrize("quarter", [-2, -1, 0, 1, 2, 4])
def test_rounding_below_a_multiple_of_90_degrees_counts_as_the_upper_quadrant(arm: Arm, quarter: int) -> None:
    angle = quarter * np.pi / 2.0 - 1e-15
    joints = np.array([[angle, 0.0, 0.0, angle, 0.5, angle]])
    assert configuration_data(joints, arm=arm)[0, :3].tolist() == [quarter] * 3


def test_axis_5_at_zero_counts_as_positive(arm: Arm) -> None:
    joints = np.array([[0.0, 0.0, 0.0, 0.0, -1e-16, 0.0]])
    assert configuration_data(joints, arm=arm)[0, 3] == 0
    assert branch_of(joints, arm=arm)[0] == 0


def test_stretched_arm_is_singular_below_minus_77_degrees_of_joint_3(arm: Arm) -> None:
    stretched = -np.arctan2(302.0, 70.0)
    joints = np.array([[0.0, 0.0, stretched, 0.0, 0.5, 0.0]])
    ahead, bend, wrist = singularity_distances(joints, arm=arm)[0]
    np.testing.assert_allclose([ahead, bend, wrist], [0.0, 0.0, 0.5], atol=1e-9)
    assert np.degrees(stretched) == pytest.approx(-76.95, abs=0.01)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6))
def test_branch_is_the_slot_of_the_solver(arm: Arm, angles: list[float]) -> None:
    joints = np.array([angles])
    ahead, bend, wrist = np.abs(singularity_distances(joints, arm=arm)[0])
    assume(ahead > 1.0 and min(bend, np.pi - bend) > 0.01 and min(wrist, np.pi - wrist) > 0.01)
    branch = branch_of(joints, arm=arm)[0]
    solution = arm.solutions(arm.tool_poses(joints))[0, branch]
    np.testing.assert_allclose(np.exp(1j * solution), np.exp(1j * joints[0]), atol=1e-6)
    assert BRANCH_OF_CFX[configuration_data(joints, arm=arm)[0, 3]] == branch
