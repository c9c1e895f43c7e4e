"""What follows from any table: where the part stands, and how long a move takes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint import transforms
from geoprint.config import cell_of, packaged_cell_text
from geoprint.model import Cylinder, Placement, TablePose, TiltingTable
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
from tests.positioner.tables import (
    hexapod,
    hexapod_noun,
    random_directions,
    random_poses,
    tilt_turn,
    tilt_turn_noun,
)

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
