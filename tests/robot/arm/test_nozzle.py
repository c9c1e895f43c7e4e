"""Turns and leans of a round nozzle, and when turning it helps nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import FloatArray
from geoprint.robot.arm import Arm, is_axial, tilts
from geoprint.robot.arm.kinematics import about_nozzle, turned
from geoprint.robot.reach import reach
from geoprint.robot.reach.keyframes import keyframe_rate, keyframes_of, smoothed, tool_poses
from geoprint.robot.reach.quadrants import axial_rotation
from tests.robot.cells import bent_cell, straight_cell
from tests.robot.joint_paths import arc, line, stream, two_runs

HERE = transforms.rigid(np.eye(3), np.array([330.0, 0.0, 150.0]))


def tool_frame(*, aside: float = 0.0, bent_deg: float = 0.0, turned_deg: float = 0.0) -> FloatArray:
    attitude = Rotation.from_euler("yz", [bent_deg, turned_deg], degrees=True).as_matrix()
    return transforms.rigid(attitude, np.array([aside, 0.0, 160.0]))


@pytest.mark.parametrize(
    ("T_flange_tool", "axial"),
    [
        (tool_frame(), True),
        (tool_frame(turned_deg=70.0), True),
        (tool_frame(aside=1e-4), True),
        (tool_frame(aside=1.0), False),
        (tool_frame(bent_deg=0.1), False),
        (bent_cell().tool.T_flange_tool, False),
        (straight_cell().tool.T_flange_tool, True),
    ],
)
def test_nozzle_on_the_axis_of_the_flange_is_told_from_one_beside_it(T_flange_tool: FloatArray, *, axial: bool) -> None:
    assert is_axial(T_flange_tool) is axial
    # What it means: turning about the nozzle moves joint 6 only.
    arm = Arm(straight_cell().robot, T_flange_tool=T_flange_tool)
    pose = arm.tool_poses(np.array([[0.1, 0.3, 0.2, 0.2, 0.8, 0.4]]))
    moved = np.ptp(arm.solutions(pose @ about_nozzle(np.array([0.0, 0.3])))[:, 0], axis=0)
    assert bool(moved[:5].max() < 1e-5) is axial
    assert moved[5] == pytest.approx(0.3, abs=1e-5) or not axial


@pytest.mark.parametrize("turned_deg", [0.0, 130.0])
def test_axial_nozzle_is_turned_once_to_where_joint_6_is_nearest_home(turned_deg: float) -> None:
    cell = straight_cell()
    home = cell.robot.home.copy()
    home[5] = 1.0
    arm = Arm(replace(cell.robot, home=home), T_flange_tool=tool_frame(turned_deg=turned_deg))
    path = reach(two_runs(), arm, T_base_work=HERE)
    assert np.ptp(path.rotations) == 0.0
    assert (path.joints[:, 5].min() + path.joints[:, 5].max()) / 2.0 == pytest.approx(1.0, abs=1e-9)
    assert path.turns_of_joint_6 == pytest.approx(np.ptp(path.joints[:, 5]) / (2.0 * np.pi))


def test_joint_6_stays_inside_its_range_before_it_is_near_home() -> None:
    robot = straight_cell().robot
    most = float(robot.limits[5, 1])
    near_the_end = replace(robot, home=np.append(robot.home[:5], most))
    travel = np.zeros(2)
    assert axial_rotation(np.array([0.0, 1.0]), near_the_end, weights=travel) == pytest.approx(most - 1.0)
    assert axial_rotation(np.array([-10.0, 10.0]), robot, weights=travel) == pytest.approx(0.0)
    assert axial_rotation(np.empty(0), robot, weights=travel[:0]) == 0.0


def test_bent_nozzle_turns_along_the_path_without_winding_up() -> None:
    cell = bent_cell()
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    path = reach(stream(arc(radius=40.0)), arm, T_base_work=HERE)
    assert np.ptp(path.rotations) <= 2.0 * np.pi
    np.testing.assert_allclose(
        tool_poses(path.poses, T_base_work=HERE),
        tool_poses(stream(arc(radius=40.0)), T_base_work=HERE) @ about_nozzle(path.rotations),
        atol=1e-9,
    )


def test_lean_tilts_the_nozzle_by_its_angle_and_a_turn_does_not() -> None:
    poses = stream(line((0.0, 0.0, 0.0), (10.0, 0.0, 0.0), count=11))
    leans = np.column_stack([np.linspace(0.0, 0.2, 11), np.linspace(0.1, 0.0, 11)])
    leaned = turned(poses, rotations=np.linspace(0.0, 3.0, 11), leans=leans)
    np.testing.assert_allclose(tilts(leaned), np.linalg.norm(leans, axis=1), atol=1e-9)
    np.testing.assert_array_equal(leaned.tips, poses.tips)


def test_keyframes_begin_and_end_with_the_stream_about_each_tenth_pose() -> None:
    poses = two_runs()
    frames = keyframes_of(poses, T_base_work=HERE, rates=np.full(poses.count, keyframe_rate(poses)))
    commanded = tool_poses(poses, T_base_work=HERE)
    np.testing.assert_allclose(frames.Ts_base_tool[[0, -1]], commanded[[0, -1]], atol=1e-9)
    assert frames.places[0] == 0.0
    assert frames.places[-1] == frames.count - 1
    assert (np.diff(frames.places) >= 0.0).all()
    assert poses.count / 12 < frames.count < poses.count / 6
    assert 0.5 < frames.deposit.mean() < 1.0


def test_keyframes_are_denser_where_they_are_asked_to_be() -> None:
    poses = stream(line((0.0, 0.0, 0.0), (100.0, 0.0, 0.0), count=201))
    rates = np.where(np.abs(poses.tips[:, 0] - 50.0) < 10.0, 1.0, 0.1)
    frames = keyframes_of(poses, T_base_work=HERE, rates=rates)
    x = frames.Ts_base_tool[:, 0, 3] - HERE[0, 3]
    assert 18 <= np.count_nonzero(np.abs(x - 50.0) < 10.0) <= 23
    assert frames.count == pytest.approx(20 + 8, abs=3)


def test_single_pose_is_its_own_keyframe() -> None:
    pose = stream(np.array([[1.0, 2.0, 3.0]]))
    frames = keyframes_of(pose, T_base_work=HERE, rates=np.array([keyframe_rate(pose)]))
    assert frames.count == 1
    np.testing.assert_allclose(smoothed(np.array([[4.0]]), frames.places), [[4.0]], atol=1e-12)


def test_smooth_values_stay_between_their_four_keyframes_and_bend_without_a_jump() -> None:
    values = np.random.default_rng(1).normal(size=(12, 2))
    places = np.linspace(0.0, 11.0, 2201)
    found = smoothed(values, places)
    for row, place in enumerate(places):
        low = max(int(np.floor(place)) - 1, 0)
        around = values[low : int(np.floor(place)) + 3]
        assert (found[row] >= around.min(axis=0) - 1e-12).all()
        assert (found[row] <= around.max(axis=0) + 1e-12).all()
    slopes = np.diff(found, axis=0) / 0.005
    assert np.abs(np.diff(slopes, axis=0)).max() < 0.05


def test_smooth_values_of_a_straight_rise_are_straight_and_of_a_constant_constant() -> None:
    places = np.linspace(1.0, 8.0, 50)
    np.testing.assert_allclose(smoothed(np.arange(10.0)[:, None], places)[:, 0], places, atol=1e-12)
    np.testing.assert_allclose(smoothed(np.full((10, 1), 3.0), np.linspace(0.0, 9.0, 50)), 3.0, atol=1e-12)
