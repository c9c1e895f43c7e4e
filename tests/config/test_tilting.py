"""`[table]` of a cell: what is read, what counts where a key is left out, and what is refused with its name."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from geoprint.config import cell_of, packaged_cell_text
from geoprint.config.cell_file import HexapodTable, TiltTurnTable
from geoprint.errors import UsageError
from geoprint.model import Hexapod, TiltTurn
from geoprint.workflow.calibrating import edited

TEXT = packaged_cell_text("irb120-bent45")
HEXAPOD = f'{TEXT}\n[table]\nkind = "hexapod"\nposition_mm = [350, 0, 0]\n'
TILT_TURN = f'{TEXT}\n[table]\nkind = "tilt-turn"\nposition_mm = [350, 0, 0]\n'


def test_a_cell_without_the_table_has_none() -> None:
    assert cell_of(TEXT, name="cell.toml").table is None


@pytest.mark.parametrize(("kind", "table"), [("hexapod", HexapodTable), ("tilt-turn", TiltTurnTable)])
def test_the_examples_in_the_packaged_cells_show_what_counts_where_a_key_is_left_out(
    kind: str, table: type[HexapodTable | TiltTurnTable]
) -> None:
    _, _, shown = TEXT.partition(f'# [table]\n# kind = "{kind}"\n')
    keys = [line.removeprefix("# ") for line in shown.splitlines()]
    stated = "\n".join(keys[: next(at for at, line in enumerate(keys) if " = " not in line)])
    found = table.model_validate(tomllib.loads(f'kind = "{kind}"\n{stated}'))
    # Nobody's unit counts where none is named.
    assert set(tomllib.loads(stated)) == set(table.model_fields) - {"kind", "mechanical_unit"}
    assert found.model_dump() == table.model_validate({"kind": kind, "position_mm": [350.0, 0.0, 0.0]}).model_dump()


def test_the_table_stands_where_it_is_written_and_turned_as_other_frames_are() -> None:
    table = cell_of(f"{HEXAPOD}rpy_deg = [0, 0, 90]\n", name="cell.toml").table
    assert isinstance(table, Hexapod)
    wanted = np.array([[0.0, -1.0, 0.0, 350.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    np.testing.assert_allclose(table.T_base_table, wanted, atol=1e-12)


def test_the_joints_of_a_hexapod_stand_in_pairs_and_those_of_a_leg_nearest_to_each_other() -> None:
    table = cell_of(f"{HEXAPOD}base_joint_spread_deg = 20\nplate_joint_spread_deg = 30\n", name="cell.toml").table
    assert isinstance(table, Hexapod)
    base, plate = (np.degrees(np.arctan2(at[:, 1], at[:, 0])) % 360.0 for at in (table.base_joints, table.plate_joints))
    np.testing.assert_allclose(base, [280.0, 20.0, 40.0, 140.0, 160.0, 260.0])
    np.testing.assert_allclose(plate, [315.0, 345.0, 75.0, 105.0, 195.0, 225.0])
    np.testing.assert_allclose(np.hypot(*table.base_joints[:, :2].T), 110.0)
    np.testing.assert_allclose(table.plate_joints[:, 2] - table.base_joints[:, 2], 188.9)


def test_angles_and_speeds_of_a_tilt_turn_table_are_read_in_degrees() -> None:
    table = cell_of(f"{TILT_TURN}tilt_deg = [-30, 120]\nturn_speed_deg_s = 180\n", name="cell.toml").table
    assert isinstance(table, TiltTurn)
    np.testing.assert_allclose(table.ranges, np.radians([[-30.0, 120.0], [-180.0, 180.0]]))
    np.testing.assert_allclose(table.speeds, np.radians([90.0, 180.0]))


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (HEXAPOD.replace('hexapod"\nposition', 'octopod"\nposition'), "line .*table.*'hexapod', 'tilt-turn'"),
        (HEXAPOD.replace('kind = "hexapod"\nposition', "position"), r"line .*table.*'kind'"),
        (HEXAPOD.replace("position_mm = [350, 0, 0]\n", ""), r"position_mm: field required"),
        (f"{HEXAPOD}tilt_deg = [-90, 90]\n", r"tilt_deg: extra inputs are not permitted"),
        (f"{HEXAPOD}leg_mm = [175.2]\n", r"leg_mm: list should have at least 2 items"),
        (f"{HEXAPOD}leg_mm = [220, 180]\n", "give the shortest, then the longest"),
        (f"{HEXAPOD}leg_diameter_mm = 41\n", "40.7 mm apart from axis to axis, but 41 mm thick"),
        (f"{TILT_TURN}tilt_deg = [0, 90]\n", r"tilt_deg is \[0, 90\]: it must begin below 0"),
        (f"{TILT_TURN}turn_deg = [-90, 0]\n", r"turn_deg is \[-90, 0\]"),
        (f"{TILT_TURN}turn_deg = [-361, 90]\n", "greater than or equal to -360"),
        (
            f"{TILT_TURN}stand_distance_mm = 140\n",
            "stand_distance_mm is 140, so that the turning plate of 200 mm meets",
        ),
        (f"{TILT_TURN}pivot_mm = 3\n", r"pivot_mm: extra inputs are not permitted"),
    ],
)
def test_what_is_wrong_in_the_table_is_named(text: str, complaint: str) -> None:
    with pytest.raises(UsageError, match=complaint):
        cell_of(text, name="cell.toml")


@pytest.mark.parametrize(
    ("key", "inside", "outside"),
    [
        ("base_joint_spread_deg", 59.0, 60.0),
        ("plate_joint_spread_deg", 59.0, 60.0),
        ("base_cone_deg", 89.9, 90.0),
        ("base_cone_deg", 0.1, 0.0),
        ("plate_cone_deg", 89.9, 90.0),
        ("leg_speed_mm_s", 0.1, 0.0),
        ("leg_diameter_mm", 0.1, 0.0),
        ("plate_diameter_mm", 0.1, 0.0),
    ],
)
def test_a_number_is_taken_just_inside_its_bound_and_refused_just_outside_with_its_line(
    key: str, inside: float, outside: float
) -> None:
    wide = f"{HEXAPOD}leg_mm = [100, 400]\n" if "spread" in key else HEXAPOD
    assert isinstance(cell_of(f"{wide}{key} = {inside}\n", name="cell.toml").table, Hexapod)
    text = f"{wide}{key} = {outside}\n"
    with pytest.raises(UsageError, match=rf"cell\.toml, line {len(text.splitlines())}: table\.{key}: input should be"):
        cell_of(text, name="cell.toml")


def test_a_table_that_is_edited_in_the_file_reads_back() -> None:
    values = {"position_mm": [301.25, -4.5, 12.0], "rpy_deg": [0.0, 0.0, 1.5], "pivot_mm": 25.0}
    text = edited(HEXAPOD, table="table", values=values, name="cell.toml")
    table = cell_of(text, name="cell.toml").table
    assert isinstance(table, Hexapod)
    np.testing.assert_allclose(table.T_base_table[:3, 3], values["position_mm"])
    assert table.pivot == 25.0
    assert text.startswith(TEXT)


def test_what_drives_a_tilt_turn_table_is_named_where_the_controller_does_and_only_there() -> None:
    start = f'{TEXT}\n[table]\nkind = "tilt-turn"\nposition_mm = [350, 0, 0]\n'
    driven = cell_of(f'{start}control = "external axes"\nmechanical_unit = "STN1"\n', name="cell.toml").table
    asked = cell_of(start, name="cell.toml").table
    assert isinstance(driven, TiltTurn)
    assert isinstance(asked, TiltTurn)
    assert (driven.unit, asked.unit) == ("STN1", None)
    with pytest.raises(UsageError, match="name the mechanical_unit"):
        cell_of(f'{start}control = "external axes"\n', name="cell.toml")
    with pytest.raises(UsageError, match="mechanical_unit is named"):
        cell_of(f'{start}mechanical_unit = "STN1"\n', name="cell.toml")
