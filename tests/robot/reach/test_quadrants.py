"""Axes 1, 4 and 6 away from the borders of their quadrants on deposit, where turning about the nozzle allows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import BoolArray, FloatArray, JointPath, PoseStream, Targets
from geoprint.reporting.robot_summary import record_quadrants
from geoprint.robot.arm import border_distances
from geoprint.robot.arm.configuration import branch_of, configuration_data
from geoprint.robot.arm.kinematics import about_nozzle
from geoprint.robot.reach.inverse import reach
from geoprint.robot.reach.keyframes import tool_poses
from geoprint.robot.reach.quadrants import axial_rotation, axial_weights, frame_room
from tests.robot.cells import bent_cell, straight_cell
from tests.robot.joint_paths import arc, arm_of, line, solved, stream

ARM = arm_of(bent_cell())
AHEAD = transforms.rigid(np.eye(3), np.array([300.0, 0.0, 50.0]))


def off_borders(joints: FloatArray) -> FloatArray:
    """Return how far axes 1, 4 and 6 are from multiples of 90 degrees [degrees]."""
    past = np.degrees(joints[..., [0, 3, 5]]) % 90.0
    return np.minimum(past, 90.0 - past)


def near(path: JointPath) -> list[int]:
    """Return at how many poses on deposit axes 1, 4 and 6 are within a degree of a border."""
    return (off_borders(path.joints[path.poses.deposit]) < 1.0).sum(axis=0).tolist()


def rings(radii: tuple[float, ...], *, step: float = 1.0) -> PoseStream:
    return stream(np.concatenate([arc(radius=radius, step=step) for radius in radii]))


def clear_turns(poses: PoseStream, *, T_base_work: FloatArray, branch: int) -> BoolArray:
    """Return which of 180 constant turns keep all of a stream 1.5 degrees from borders, and the arm at ease."""
    clear = np.empty(180, dtype=np.bool_)
    limits = np.array([165.0, 110.0, 90.0, 160.0, 120.0])
    for index, turn in enumerate(np.radians(2.0 * np.arange(180))):
        commanded = tool_poses(poses, T_base_work=T_base_work) @ about_nozzle(np.array([turn]))[0]
        joints = ARM.solutions(commanded)[:, branch]
        degrees = np.degrees(joints[:, :5]) + np.array([0.0, 0.0, 20.0, 0.0, 0.0])
        at_ease = (np.abs(degrees) < limits - 12.0).all() and (np.abs(degrees[:, 4]) > 25.0).all()
        clear[index] = at_ease and (off_borders(joints) > 1.5).all()
    return clear


def test_small_ring_ahead_of_the_arm_is_printed_off_the_borders_it_lies_on() -> None:
    poses = rings((2.0, 4.0))
    # As the path has it joint 6 stands at 180 degrees, joints 1 and 4 at zero, each within half a degree or so.
    assert near(solved(poses, ARM, T_base_work=AHEAD))[2] == poses.count
    path = reach(poses, ARM, T_base_work=AHEAD)
    assert near(path) == [0, 0, 0]
    assert len(np.unique(configuration_data(path.joints, arm=ARM), axis=0)) == 1


@pytest.mark.parametrize(
    ("radius", "place"),
    [
        (20.0, (310.0, 5.0, 50.0)),
        (59.0, (236.0, 13.0, 141.0)),
        (58.0, (250.0, 1.0, 73.0)),
        (65.0, (281.0, -5.0, 140.0)),
        (68.0, (295.0, -2.0, 55.0)),
        (72.0, (241.0, -33.0, 123.0)),
    ],
)
def test_no_deposit_is_near_a_border_where_a_constant_turn_keeps_all_of_it_away(
    radius: float, place: tuple[float, float, float]
) -> None:
    poses = rings((radius,), step=3.0)
    T_base_work = transforms.rigid(np.eye(3), np.array(place))
    path = reach(poses, ARM, T_base_work=T_base_work)
    assert clear_turns(poses, T_base_work=T_base_work, branch=path.branch).any()
    assert near(path) == [0, 0, 0]


@pytest.mark.parametrize("radius", [75.0, 90.0])
def test_ring_that_no_constant_turn_keeps_away_is_near_borders_more_rarely_than_with_any(radius: float) -> None:
    poses = rings((radius,))
    path = reach(poses, ARM, T_base_work=AHEAD)
    counts: list[int] = []
    for turn in np.radians(2.0 * np.arange(180)):
        joints = ARM.solutions(tool_poses(poses, T_base_work=AHEAD) @ about_nozzle(np.array([turn]))[0])[:, path.branch]
        if np.isfinite(joints).all():
            counts.append(int((off_borders(joints) < 1.0).any(axis=1).sum()))
    assert min(counts) > 0
    assert 0 < sum(near(path)) < 0.8 * min(counts)


def test_borders_that_an_axis_sweeps_over_are_crossed_and_listed() -> None:
    # From one side of the arm to the other axis 1 turns by 68 degrees: no turn of the nozzle keeps it on one side.
    poses = stream(line((300.0, -200.0, 50.0), (300.0, 200.0, 50.0), count=401))
    path = reach(poses, ARM, T_base_work=np.eye(4))
    record = record_quadrants(path, Targets(np.arange(401), zones=np.zeros(401), speeds=np.full(401, 20.0)), ARM)
    assert [axis.axis for axis in record] == [1, 4, 6]
    assert [axis.targets_near for axis in record] == near(path)
    assert record[0].targets_near > 0
    assert [axis.crossings for axis in record] == np.count_nonzero(
        np.diff(configuration_data(path.joints, arm=ARM)[:, :3], axis=0), 0
    ).tolist()
    assert record[0].crossings == 1
    row = int(off_borders(path.joints)[:, 0].argmin())
    assert record[0].nearest_deg == pytest.approx(off_borders(path.joints)[row, 0], abs=1e-3)
    assert record[0].place_mm == pytest.approx(tuple(poses.tips[row]))


def test_what_is_crossed_on_travel_is_not_listed() -> None:
    deposited = np.zeros(401, dtype=np.bool_)
    deposited[:20] = True
    poses = stream(line((300.0, -200.0, 50.0), (300.0, 200.0, 50.0), count=401), deposit=deposited)
    path = reach(poses, ARM, T_base_work=np.eye(4))
    record = record_quadrants(path, Targets(np.arange(401), zones=np.zeros(401), speeds=np.full(401, 20.0)), ARM)
    assert np.ptp(configuration_data(path.joints, arm=ARM)[:, 0]) == 1
    assert [axis.crossings for axis in record] == [0, 0, 0]
    assert [axis.targets_near for axis in record] == [0, 0, 0]


@pytest.mark.parametrize(
    ("low", "high", "least", "most"),
    [
        # About home a stretch of 20 degrees is turned past it, one that is clear stays, one of 90 is crossed anyhow.
        (-10.0, 10.0, 11.0, 12.0),
        (20.0, 60.0, 25.0, 25.0),
        (0.0, 0.0, 1.0, 2.0),
    ],
)
def test_joint_6_of_an_axial_nozzle_is_turned_off_the_border_and_no_farther(
    low: float, high: float, least: float, most: float
) -> None:
    robot = straight_cell().robot
    home = robot.home.copy()
    home[5] = np.radians(65.0) if low == 20.0 else 0.0
    angles = np.radians(np.linspace(low, high, 101))
    turn = np.degrees(axial_rotation(angles, replace(robot, home=home), weights=np.ones(101)))
    assert least - 1e-9 <= abs(turn) <= most + 1e-9
    past = (np.degrees(angles) + turn) % 90.0
    assert np.minimum(past, 90.0 - past).min() >= 1.0


def test_joint_6_of_an_axial_nozzle_stays_nearest_home_on_travel() -> None:
    robot = straight_cell().robot
    angles = np.radians(np.linspace(-10.0, 10.0, 101))
    assert axial_rotation(angles, robot, weights=np.zeros(101)) == pytest.approx(0.0, abs=1e-12)


def test_joint_6_is_rather_near_a_border_where_another_axis_is() -> None:
    # Over 120 degrees it has to cross one border at least; axis 1 does so in the middle.
    arm, robot = arm_of(straight_cell()), straight_cell().robot
    sweep = np.radians(np.linspace(-60.0, 60.0, 1201))
    joints = np.tile(np.radians([45.0, 0.0, 0.0, 45.0, 60.0, 0.0]), (1201, 1))
    joints[:, 0], joints[:, 5] = sweep / 3.0, sweep
    deposited = np.ones(1201, dtype=np.bool_)
    np.testing.assert_array_equal(axial_weights(joints, arm, deposit=deposited)[[0, 600, 1200]], [2.0, 1.0, 2.0])
    assert not axial_weights(joints, arm, deposit=~deposited).any()
    turn = np.degrees(axial_rotation(sweep, robot, weights=axial_weights(joints, arm, deposit=deposited)))
    assert turn == pytest.approx(0.0, abs=1e-9)


def test_axial_nozzle_prints_with_joint_6_off_its_border() -> None:
    arm = arm_of(straight_cell())
    poses = stream(line((350.0, -5.0, 200.0), (350.0, 5.0, 200.0), count=41))
    path = reach(poses, arm, T_base_work=np.eye(4))
    assert off_borders(path.joints)[:, 2].min() >= 1.0
    assert np.ptp(path.rotations) == 0.0


@pytest.mark.parametrize("seed", range(4))
def test_no_frame_within_the_room_takes_an_axis_over_a_border_and_a_little_beyond_one_does(seed: int) -> None:
    random = np.random.default_rng(seed)
    # Twenty targets that the arm reaches, axis 4 of one 0.05 degrees beside a border.
    joints = np.radians([40.0, 28.0, 20.0, 30.0, 75.0, 130.0]) + random.uniform(-0.1, 0.1, (20, 6))
    joints[7, 3] = np.radians(0.05)
    Ts, middle, radius = ARM.tool_poses(joints), np.array([230.0, 190.0, 60.0]), 25.0
    extent = middle + radius / 3.0**0.5 * np.array([[-1.0], [1.0]])
    room = frame_room(joints, ARM, extent=extent, T_base_work=np.eye(4))
    assert 0.0 < room < 0.5
    branches = branch_of(joints, arm=ARM)
    border = border_distances(joints)

    def crossed(shift: FloatArray, turn: FloatArray) -> bool:
        R = Rotation.from_rotvec(turn).as_matrix()
        moved = transforms.rigid(R, middle + shift - R @ middle) @ Ts
        found = ARM.solutions(moved)[np.arange(20), branches]
        return bool((np.abs(transforms.wrapped(found - joints))[:, [0, 3, 5]] > border).any())

    ways = random.normal(size=(300, 2, 3))
    ways /= np.linalg.norm(ways, axis=2, keepdims=True)
    assert not any(crossed(room * shift, room / radius * turn) for shift, turn in ways)
    # The worst way is the one along which axis 4 turns most: of so many one comes near it.
    assert any(crossed(1.6 * room * shift, 1.6 * room / radius * turn) for shift, turn in ways)
