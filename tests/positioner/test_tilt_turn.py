"""The tilt-turn table: each direction is brought up, by the smaller motion, as rotations of SciPy say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.config import cell_of, packaged_cell_text
from geoprint.errors import ReachError
from geoprint.model import Cylinder, FloatArray, Placement, TablePose, TiltingTable
from geoprint.positioner import (
    HexapodMachine,
    TiltTurnMachine,
    driven_seconds,
    move_seconds,
    obstacles_at,
    straight_course,
    table_machine,
    work_poses,
)
from tests.positioner.tables import hexapod, hexapod_noun, random_directions, random_poses, tilt_turn, tilt_turn_noun

UP = np.array([0.0, 0.0, 1.0])
DEPTH = 75.0


def by_scipy(tilt: float, turn: float) -> FloatArray:
    """Return the pose of the plate at two angles, the tilting axis `DEPTH` below it."""
    axis = transforms.rigid(np.eye(3), np.array([0.0, 0.0, -DEPTH]))
    tilted, turned = (Rotation.from_euler(name, angle).as_matrix() for name, angle in (("x", tilt), ("z", turn)))
    return (
        axis @ transforms.rigid(tilted, np.zeros(3)) @ transforms.inverse(axis) @ transforms.rigid(turned, np.zeros(3))
    )


def test_each_direction_is_brought_up() -> None:
    ups = random_directions(500)
    poses = tilt_turn(axis_depth_mm=DEPTH).plates(ups)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", poses[:, :3, :3], ups), np.tile(UP, (500, 1)), atol=1e-12)


def test_the_pose_of_two_angles_is_that_of_scipy_and_leads_back_to_them() -> None:
    machine = tilt_turn(axis_depth_mm=DEPTH)
    for tilt, turn in np.random.default_rng(0).uniform(-np.pi, np.pi, (300, 2)):
        found = machine.plate(np.array([tilt, turn]))
        np.testing.assert_allclose(found, by_scipy(tilt, turn), atol=1e-12)
        np.testing.assert_allclose(machine.axes(found[None])[0], [tilt, turn], atol=1e-12)


def test_of_both_solutions_the_smaller_turn_is_taken() -> None:
    machine = tilt_turn()
    ups = random_directions(500)
    tilts, turns = machine.axes(machine.plates(ups)).T
    np.testing.assert_allclose(np.abs(tilts), np.arccos(ups[:, 2]), atol=1e-7)
    assert np.abs(turns).max() <= np.pi / 2.0 + 1e-12
    # The other one tilts to the other side and turns by half a turn more or less.
    other = machine.axes(
        np.array([machine.plate(np.array([-a, b + np.pi])) for a, b in zip(tilts, turns, strict=True)])
    )
    assert (np.abs(turns) <= np.abs(other[:, 1]) + 1e-12).all()
    np.testing.assert_allclose(
        np.einsum("nij,nj->ni", np.array([machine.plate(each) for each in other])[:, :3, :3], ups),
        np.tile(UP, (500, 1)),
        atol=1e-12,
    )


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_where_both_turns_are_equal_the_positive_tilt_is_taken(sign: float) -> None:
    machine = tilt_turn()
    tilt, turn = machine.axes(machine.plates(np.array([[sign * np.sin(0.5), 0.0, np.cos(0.5)]])))[0]
    assert tilt == pytest.approx(0.5)
    assert abs(turn) == pytest.approx(np.pi / 2.0)


def test_a_solution_within_the_ranges_goes_before_a_smaller_turn() -> None:
    ups = np.array([[0.1, 0.4, 0.9]]) / np.linalg.norm([0.1, 0.4, 0.9])
    free, onesided = tilt_turn(), tilt_turn(tilt_deg=[-90.0, 5.0])
    assert free.axes(free.plates(ups))[0, 0] > 0.0
    assert onesided.axes(onesided.plates(ups))[0, 0] < 0.0
    assert onesided.margins(onesided.plates(ups))[0] > 0.0


def test_a_direction_along_the_axis_needs_no_turn() -> None:
    machine = tilt_turn()
    np.testing.assert_array_equal(machine.plates(UP[None])[0], np.eye(4))
    np.testing.assert_allclose(machine.axes(machine.plates(-UP[None]))[0], [np.pi, 0.0])


def test_the_margins_of_thousands_of_poses_are_those_of_a_plain_loop() -> None:
    machine = tilt_turn(tilt_deg=[-30.0, 100.0], turn_deg=[-120.0, 170.0], axis_depth_mm=DEPTH)
    angles = np.random.default_rng(1).uniform(-np.pi, np.pi, (10_000, 2))
    rotations = Rotation.from_euler("XZ", angles).as_matrix()
    tilted = Rotation.from_euler("X", angles[:, :1]).as_matrix()[:, :, 2]
    found = machine.margins(transforms.rigid(rotations, DEPTH * (tilted - UP)))
    ranges = tilt_turn_noun(tilt_deg=[-30.0, 100.0], turn_deg=[-120.0, 170.0]).ranges.tolist()
    for margin, row in zip(found.tolist(), angles.tolist(), strict=True):
        left = [1.0 - angle / (low if angle < 0.0 else high) for angle, (low, high) in zip(row, ranges, strict=True)]
        assert margin == pytest.approx(min(left), abs=1e-9)


def test_a_pose_that_two_axes_cannot_take_is_refused_with_how_much_it_misses() -> None:
    machine = tilt_turn()
    poses = np.concatenate([machine.plates(random_directions(3)), random_poses(1, shift=1.0, turn=0.3)])
    with pytest.raises(
        ReachError, match=r"tilt-turn table: pose 4 of the plate is missed by 4\.\d+ .* allowed is 1e-06"
    ):
        machine.axes(poses)
    assert machine.axes(np.empty((0, 4, 4))).shape == (0, 2)


def test_the_solids_stand_in_the_base_of_the_robot_and_only_plate_and_hub_move() -> None:
    machine, noun = tilt_turn(axis_depth_mm=DEPTH), tilt_turn_noun(axis_depth_mm=DEPTH)
    T_table_plate = machine.plate(np.array([0.7, 0.3]))
    rest, moved = machine.solids(np.eye(4)), machine.solids(T_table_plate)
    assert [solid.name for solid in moved] == ["table's plate", "table's hub", "table's beam", "table's post"]
    np.testing.assert_allclose(moved[0].start, (noun.T_base_table @ T_table_plate)[:3, 3])
    np.testing.assert_allclose(moved[0].end, moved[1].start)
    for before, after in zip(rest[2:], moved[2:], strict=True):
        np.testing.assert_array_equal(before.start, after.start)
        np.testing.assert_array_equal(before.end, after.end)
    along = moved[2].start - moved[2].end
    np.testing.assert_allclose(along / np.linalg.norm(along), noun.T_base_table[:3, 0], atol=1e-12)
    # The tilting axis keeps its distance from the plate.
    top = T_table_plate[:3, 3] - np.array([0.0, 0.0, -DEPTH])
    assert np.linalg.norm(top) == pytest.approx(DEPTH)


# What follows from any table: where the part stands, and how long a move takes.


BOTH = pytest.mark.parametrize("table", [hexapod(), tilt_turn()], ids=["hexapod", "tilt-turn"])
T_BASE_WORK = random_poses(1, shift=300.0, turn=0.4, seed=3)[0]


def test_each_table_of_a_cell_has_its_kinematics() -> None:
    assert isinstance(table_machine(hexapod_noun()), HexapodMachine)
    assert isinstance(table_machine(tilt_turn_noun()), TiltTurnMachine)


@BOTH
def test_a_part_stands_where_it_was_touched_while_the_table_rests(table: TiltingTable) -> None:
    found = work_poses(table, Ts_table_plate=np.eye(4)[None], T_base_work=T_BASE_WORK)
    np.testing.assert_allclose(found[0], T_BASE_WORK, atol=1e-10)


@BOTH
def test_a_point_of_the_part_stays_where_it_is_on_the_plate(table: TiltingTable) -> None:
    plates = table.plates(random_directions(20))
    works = work_poses(table, Ts_table_plate=plates, T_base_work=T_BASE_WORK)
    seen = transforms.inverse(table.T_base_table @ plates) @ works
    np.testing.assert_allclose(
        seen, np.tile(transforms.inverse(table.T_base_table) @ T_BASE_WORK, (20, 1, 1)), atol=1e-9
    )


def test_the_table_is_an_obstacle_where_it_holds_the_part_and_not_where_it_rests() -> None:
    noun, T_table_plate = tilt_turn_noun(), tilt_turn().plates(random_directions(1, seed=5))[0]
    cell = replace(cell_of(packaged_cell_text("irb120-tilting45"), name="cell.toml"), table=noun, obstacles=())
    still = Placement(np.eye(4), np.eye(4), calibrated=False, part_stated=False, misses=np.zeros(0))
    held = replace(still, table=TablePose(1, T_table_plate=T_table_plate, axes=np.zeros(2)))
    for placement, pose in ((still, np.eye(4)), (held, T_table_plate)):
        (plate,) = [one for one in obstacles_at(cell, placement) if one.name == "table's plate"]
        assert isinstance(plate, Cylinder)
        top = transforms.apply(tilt_turn().T_base_table @ pose, np.zeros((1, 3)))[0]
        assert min(np.linalg.norm(plate.start - top), np.linalg.norm(plate.end - top)) < 1e-9


def test_a_direction_of_the_part_points_up_in_the_base_once_the_plate_has_brought_it_up() -> None:
    table = hexapod()
    up = random_directions(1, seed=5)
    T_base_plate = table.T_base_table @ table.plates(up)[0]
    np.testing.assert_allclose(T_base_plate[:3, :3] @ up[0], [0.0, 0.0, 1.0], atol=1e-12)


def test_the_slowest_leg_says_how_long_a_move_takes() -> None:
    table = hexapod(leg_speed_mm_s=10.0)
    risen = np.eye(4)
    risen[2, 3] = 5.0
    longest = np.abs(table.axes(risen[None]) - table.axes(np.eye(4)[None])).max()
    (found,) = move_seconds(table, Ts_from=np.eye(4)[None], Ts_to=risen[None])
    assert found == pytest.approx(longest / 10.0)
    assert 0.4 < found < 0.5


def test_the_slowest_axis_says_how_long_a_tilt_and_turn_take() -> None:
    table = tilt_turn(tilt_speed_deg_s=30.0, turn_speed_deg_s=90.0)
    ends = np.array([table.plate(np.radians(angles)) for angles in ([10.0, 0.0], [10.0, 80.0], [40.0, 80.0])])
    np.testing.assert_allclose(move_seconds(table, Ts_from=ends[:2], Ts_to=ends[1:]), [80.0 / 90.0, 1.0])


def test_the_plate_of_the_default_hexapod_rises_by_60_mm_a_second() -> None:
    table, risen = hexapod(), np.eye(4)
    risen[2, 3] = 0.01
    (seconds,) = move_seconds(table, Ts_from=np.eye(4)[None], Ts_to=risen[None])
    assert 0.01 / seconds == pytest.approx(60.0, rel=0.02)


def test_a_driven_table_has_the_time_of_its_whole_range_at_the_share_of_motions_at_home() -> None:
    noun = tilt_turn_noun(control='"external axes"', mechanical_unit='"STN1"', turn_speed_deg_s="45")
    # 360 degrees at 45 a second, a quarter as fast; tilting takes 2 s at its largest speed.
    assert driven_seconds(noun, share=0.25) == pytest.approx(32.0)


def test_axes_that_turn_go_in_proportion_on_a_straight_course() -> None:
    table = tilt_turn()
    ends = np.stack([table.plate(np.radians(axes)) for axes in ([10.0, -40.0], [30.0, 80.0])])
    found = np.degrees(table.axes(straight_course(table, ends, np.array([0.0, 0.25, 1.0]))))
    np.testing.assert_allclose(found, [[10.0, -40.0], [15.0, -10.0], [30.0, 80.0]], atol=1e-9)


def test_a_plate_on_legs_goes_straight_and_turns_evenly() -> None:
    table, ends = hexapod(), np.stack([np.eye(4), np.eye(4)])
    turn = np.radians(12.0)
    ends[1, :3, :3] = [[1.0, 0.0, 0.0], [0.0, np.cos(turn), -np.sin(turn)], [0.0, np.sin(turn), np.cos(turn)]]
    ends[1, :3, 3] = [2.0, -4.0, 6.0]
    (found,) = straight_course(table, ends, np.array([0.25]))
    np.testing.assert_allclose(found[:3, 3], [0.5, -1.0, 1.5], atol=1e-12)
    assert np.degrees(np.arctan2(found[2, 1], found[1, 1])) == pytest.approx(3.0)
