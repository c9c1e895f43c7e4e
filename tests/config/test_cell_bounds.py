"""The bounds of a cell file: every one is kept just inside and refused just outside, and what belongs together is."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from geoprint.config import SourceTable, cell_of, job_of, packaged_cell_text, source_named
from geoprint.config.cell_file import CellFile, HexapodTable, TiltTurnTable
from geoprint.errors import UsageError
from geoprint.model import Hexapod, LoadLimits, TiltTurn
from geoprint.workflow.calibrating import edited

Tables = dict[str, dict[str, object]]

# What the packaged cell leaves out.
OPTIONAL: Tables = {
    "lamp": {"position_mm": [0.0, 45.0, 10.0], "rpy_deg": [0.0, 0.0, 0.0], "length_mm": 60.0, "diameter_mm": 20.0},
    "material": {
        "density_g_cm3": 1.1, "consistency_pa_sn": 20.0, "flow_index": 0.6, "yield_stress_pa": 0.0,
        "uv_irradiance_mw_cm2": 500.0, "uv_spot_mm": 6.0, "uv_dose_mj_cm2": 100.0,
        "uv_penetration_mm": 0.8,
    },
    "good_print": {"pressure_kpa": 10.0, "rounds": 20},
    "purge": {"joints_deg": [40.0, 28.0, 20.0, 0.0, 87.0, 180.0], "duration_s": 2.0},
    "flood": {"duration_s": 60.0, "joints_deg": [0.0, 28.0, 20.0, 0.0, 87.0, 180.0]},
    "search": {"motion": 1.0, "limits": 1.0, "singularities": 1.0, "lean": 1.0},
}  # fmt: skip
ANALOG = {"signals.mode": "analog", "signals.flow": "aoFlow", "signals.flow_per_mm3_s": 0.1}
# A needle as wide as its barrel but for 0.7 mm has a short cone, however slender that is.
SLENDER = {"nozzle.barrel_diameter_mm": 2.0}
TOUCHED = {"work.model_mm": [[0.0, 0.0, 0.0]], "work.touched_mm": [[1.0, 0.0, 0.0]]}


def cell(changes: Mapping[str, object]) -> CellFile:
    """Return the packaged cell with every optional table, some keys changed, or left out where they are None."""
    tables: Tables = tomllib.loads(packaged_cell_text("irb120-bent45")) | copy.deepcopy(OPTIONAL)
    for name, value in changes.items():
        table, key = name.split(".")
        tables[table][key] = value
        if value is None:
            del tables[table][key]
    return CellFile.model_validate(tables)


def refused(changes: Mapping[str, object], match: str) -> None:
    with pytest.raises(ValidationError, match=match):
        cell(changes)


@pytest.mark.parametrize(
    ("key", "inside", "outside"),
    [
        ("robot.target_period_ms", 1.0, 0.99),
        ("robot.target_period_ms", 1000.0, 1001.0),
        ("robot.response_ms", 0.0, -0.1),
        ("robot.response_ms", 50.0, 50.1),
        ("process.speed_mm_s", 0.1, 0.09),
        ("process.speed_mm_s", 250.0, 250.1),
        ("process.travel_speed_mm_s", 0.1, 0.09),
        ("process.travel_speed_mm_s", 250.0, 250.1),
        ("process.joint_speed_share", 1e-3, 0.0),
        ("process.joint_speed_share", 1.0, 1.01),
        ("process.rounds", 1, 0),
        ("process.least_flow_share", 1e-3, 0.0),
        ("process.least_flow_share", 1.0, 1.01),
        ("process.most_flow_share", 1.0, 0.99),
        ("process.most_flow_share", 3.0, 3.01),
        ("process.layer_pause_s", 86400.0, 86401.0),
        ("process.layer_pause_s", 0.1, 0.0),
        ("material.overhang_deg", 0.1, 0.0),
        ("material.overhang_deg", 89.9, 90.0),
        ("nozzle.cone_half_angle_deg", 88.9, 89.0),
        ("signals.valve_open_s", 2.0, 2.01),
        ("signals.valve_close_s", 2.0, 2.01),
        ("signals.uv_lead_s", 2.0, 2.01),
        ("signals.uv_tail_s", 3600.0, 3600.1),
        ("signals.settle_ms", 2000.0, 2001.0),
        ("signals.settle_ms", 0.0, -0.1),
        ("signals.flow_lag_s", 2.0, 2.01),
        ("signals.flow_lag_s", 0.0, -0.01),
        ("signals.dispenser", "d" * 32, "d" * 33),
        ("signals.dispenser", "d_1", "_d1"),
        ("signals.vacuum", "v2", "2v"),
        ("material.yield_stress_pa", 0.0, -0.01),
        ("purge.duration_s", 60.0, 60.1),
        ("purge.duration_s", 0.1, 0.0),
        ("flood.duration_s", 3600.0, 3600.1),
        ("flood.duration_s", 0.1, 0.0),
        ("search.limits", 0.0, -0.01),
        ("search.singularities", 0.0, -0.01),
        ("search.lean", 0.0, -0.01),
        ("good_print.rounds", 1, 0),
        ("errors.repeatability_mm", 0.0, -0.001),
        ("errors.path_repeatability_mm", 0.0, -0.001),
        ("errors.path_accuracy_mm", 0.0, -0.001),
        ("errors.correlation_mm", 1.0, 0.99),
        ("errors.correlation_mm", 1000.0, 1001.0),
        ("errors.placement_mm", 0.0, -0.001),
        ("errors.placement_turn_deg", 0.0, -0.001),
        ("errors.needle_runout_mm", 0.0, -0.001),
        ("errors.flow_share", 0.0, -0.001),
        ("errors.flow_share", 0.99, 1.0),
        ("errors.run_flow_share", 0.99, 1.0),
        ("errors.run_flow_share", 0.0, -0.001),
    ],
)
def test_a_number_or_name_is_taken_just_inside_its_bound_and_refused_just_outside(
    key: str, inside: object, outside: object
) -> None:
    table, name = key.split(".")
    assert getattr(getattr(cell({key: inside}), table), name) == inside
    refused({key: outside}, rf"(?m)^{key}$")


def test_the_cone_is_more_than_a_degree_wide() -> None:
    cell(SLENDER | {"nozzle.cone_half_angle_deg": 1.01})
    refused(SLENDER | {"nozzle.cone_half_angle_deg": 1.0}, "cone_half_angle_deg")


@pytest.mark.parametrize(
    ("inside", "outside", "complaint"),
    [
        ({"nozzle.inner_diameter_mm": 0.9}, {"nozzle.inner_diameter_mm": 0.91}, "inner_diameter_mm must be smaller"),
        ({"nozzle.barrel_diameter_mm": 0.92}, {"nozzle.barrel_diameter_mm": 0.91}, "barrel_diameter_mm must be larger"),
        # A needle of 25.4 mm, and a cone from 0.91 to 20 mm at 10 degrees: 9.545 / tan(10 degrees) = 54.13 mm.
        ({"nozzle.barrel_top_mm": 79.6}, {"nozzle.barrel_top_mm": 79.5}, r"are 79\.5 mm long together"),
        # 0.5 mm of clearance over a layer of 0.5 mm.
        ({"process.retract_mm": 1.0}, {"process.retract_mm": 0.99}, r"retract_mm is 0\.99, .* layer_height_mm = 1 mm"),
        ({"robot.arm": None, "robot.urdf": "own.urdf"}, {"robot.urdf": "own.urdf"}, "give either arm"),
        ({}, {"robot.arm": None}, "give either arm"),
        ({"robot.payload_kg": None, "robot.wrist_inertia_kg_m2": None}, {"robot.payload_kg": None}, "give both"),
        ({}, {"robot.wrist_inertia_kg_m2": None}, "give both"),
        (TOUCHED, {"work.model_mm": [[0.0, 0.0, 0.0]]}, "model_mm lists 1 point and touched_mm 0"),
        ({**TOUCHED, "work.source": "calibrated"}, {"work.source": "calibrated"}, "needs the points that were touched"),
        (
            {"work.part_mm": [0.0] * 3, "work.part_rpy_deg": [0.0] * 3},
            {"work.part_rpy_deg": [0.0] * 3},
            "part_mm, the position of the part",
        ),
        ({"work.part_mm": [0.0] * 3}, {**TOUCHED, "work.part_rpy_deg": [0.0] * 3}, "part_rpy_deg needs part_mm"),
        (
            {"material.uv_spot_mm": None, "material.uv_irradiance_mw_cm2": None},
            {"material.uv_spot_mm": None},
            "give both or neither",
        ),
        ({}, {"material.uv_irradiance_mw_cm2": None}, "give both or neither"),
        ({"signals.mode": "analog"}, {**ANALOG, "signals.flow": None}, 'mode "analog" needs both flow'),
        ({**ANALOG, "signals.mode": "io"}, {**ANALOG, "signals.flow_per_mm3_s": None}, 'mode "analog" needs both flow'),
        ({"signals.flow": "doLamp"}, {"signals.uv_lamp": "DOVALVE"}, "name the same output twice"),
        (ANALOG, {"signals.flow": "doUV"}, "name the same output twice"),
        ({"signals.vacuum": "doVac"}, {"signals.vacuum": "dovalve"}, "name the same output twice"),
    ],
)
def test_keys_that_belong_together_are_taken_together_and_refused_apart(
    inside: dict[str, object], outside: dict[str, object], complaint: str
) -> None:
    cell(inside)
    refused(outside, complaint)


@pytest.mark.parametrize(
    "key",
    [
        "robot.payload_kg", "tool.mass_kg", "nozzle.inner_diameter_mm", "nozzle.outer_diameter_mm",
        "nozzle.needle_length_mm", "nozzle.barrel_diameter_mm", "nozzle.barrel_top_mm", "bracket.length_mm",
        "bracket.diameter_mm", "lamp.length_mm", "lamp.diameter_mm", "work.noise_mm", "process.standoff_mm",
        "process.clearance_mm", "process.retract_mm", "process.layer_height_mm", "process.pressure_kpa",
        "material.density_g_cm3", "material.consistency_pa_sn", "material.flow_index", "material.uv_irradiance_mw_cm2",
        "material.uv_spot_mm", "material.uv_dose_mj_cm2", "material.uv_penetration_mm", "good_print.pressure_kpa",
        "signals.flow_per_mm3_s", "search.motion",
    ],
)  # fmt: skip
def test_what_cannot_be_nothing_is_positive(key: str) -> None:
    refused({key: 0.0}, rf"(?m)^{key}$")
    cell({"nozzle.inner_diameter_mm": 1e-3})


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("robot.limits_deg", [[-90.0, 90.0]] * 6), ("robot.speeds_deg_s", [100.0] * 6),
        ("robot.accelerations_deg_s2", [500.0] * 6), ("robot.wrist_inertia_kg_m2", [0.1, 0.1]),
        ("home.joints_deg", [0.0] * 6), ("tool.tcp_mm", [1.0] * 3), ("tool.rpy_deg", [0.0] * 3),
        ("tool.cog_mm", [1.0] * 3), ("tool.inertia_kg_m2", [0.002] * 3), ("tool.inertia_rpy_deg", [0.0] * 3),
        ("lamp.position_mm", [0.0] * 3), ("lamp.rpy_deg", [0.0] * 3), ("work.demo_position_mm", [0.0] * 3),
        ("work.demo_rpy_deg", [0.0] * 3), ("work.part_mm", [0.0] * 3), ("purge.joints_deg", [0.0] * 6),
        ("flood.joints_deg", [0.0] * 6),
    ],
)  # fmt: skip
def test_a_list_has_as_many_numbers_as_it_needs(key: str, value: list[object]) -> None:
    cell({key: value})
    for wrong in (value[:-1], [*value, value[-1]]):
        refused({key: wrong}, rf"(?m)^{key}$")


@pytest.mark.parametrize("key", ["robot.speeds_deg_s", "robot.accelerations_deg_s2", "tool.inertia_kg_m2"])
def test_no_speed_acceleration_or_moment_is_zero(key: str) -> None:
    count = 3 if key.startswith("tool") else 6
    refused({key: [*[0.001] * (count - 1), 0.0]}, rf"{key}\.{count - 1}")
    refused({"robot.wrist_inertia_kg_m2": [0.1, 0.0]}, r"wrist_inertia_kg_m2\.1")


def test_a_range_has_two_ends_and_an_obstacle_three_sides() -> None:
    for ends in ([0.0], [0.0, 1.0, 2.0]):
        refused({"robot.limits_deg": [[-90.0, 90.0]] * 5 + [ends]}, r"robot\.limits_deg\.5")
    obstacle = {"name": "table", "centre_mm": [0.0] * 3, "size_mm": [1.0] * 3}
    tables = tomllib.loads(packaged_cell_text("irb120-bent45"))
    assert CellFile.model_validate(tables | {"obstacles": [obstacle]}).obstacles[0].size_mm == [1.0] * 3
    for size in ([1.0, 1.0, 0.0], [1.0] * 2, [1.0] * 4):
        with pytest.raises(ValidationError, match=r"obstacles\.0\.size_mm"):
            CellFile.model_validate(tables | {"obstacles": [obstacle | {"size_mm": size}]})


def test_what_is_left_out_is_nothing_or_what_the_packaged_cell_says() -> None:
    left_out = dict.fromkeys(["robot.target_period_ms", "robot.response_ms", "tool.inertia_rpy_deg"], None)
    found = cell(left_out | dict.fromkeys(["flood.joints_deg", "search.motion", "search.limits"], None))
    assert (found.robot.target_period_ms, found.robot.response_ms, found.robot.flange) == (20.0, 10.0, "tool0")
    assert found.tool.inertia_rpy_deg == [0.0, 0.0, 0.0]
    assert found.work.demo_rpy_deg is None
    signals = found.signals
    lags = (signals.valve_open_s, signals.valve_close_s, signals.uv_lead_s, signals.uv_tail_s, signals.flow_lag_s)
    assert (*lags, signals.settle_ms) == (0.0,) * 6
    assert CellFile.model_validate(tomllib.loads(packaged_cell_text("irb120-bent45"))).search == found.search
    assert set(found.search.model_dump().values()) == {1.0}
    assert found.flood is not None
    assert found.flood.joints_deg is None


def test_what_the_flange_carries_is_what_the_file_says_or_left_to_the_maker() -> None:
    assert cell({}).robot.load == LoadLimits(mass_kg=3.0, axis_5_kg_m2=0.175, axis_6_kg_m2=0.085)
    assert cell({"robot.payload_kg": None, "robot.wrist_inertia_kg_m2": None}).robot.load is None


# `[table]` of a cell: what is read, what counts where a key is left out, and what is refused with its name.


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
        (HEXAPOD.replace("position_mm = [350, 0, 0]\n", ""), r"position_mm: this key is missing"),
        (f"{HEXAPOD}tilt_deg = [-90, 90]\n", r"tilt_deg: there is no such key"),
        (f"{HEXAPOD}leg_mm = [175.2]\n", r"leg_mm: it must have at least 2 items"),
        (f"{HEXAPOD}leg_mm = [220, 180]\n", "give the shortest, then the longest"),
        (f"{HEXAPOD}leg_diameter_mm = 41\n", "40.7 mm apart from axis to axis, but 41 mm thick"),
        (f"{TILT_TURN}tilt_deg = [0, 90]\n", r"tilt_deg is \[0, 90\]: it must begin below 0"),
        (f"{TILT_TURN}turn_deg = [-90, 0]\n", r"turn_deg is \[-90, 0\]"),
        (f"{TILT_TURN}turn_deg = [-361, 90]\n", "at least -360"),
        (
            f"{TILT_TURN}stand_distance_mm = 140\n",
            "stand_distance_mm is 140, and the turning plate of 200 mm meets",
        ),
        (f"{TILT_TURN}pivot_mm = 3\n", r"pivot_mm: there is no such key"),
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
    with pytest.raises(UsageError, match=rf"cell\.toml, line {len(text.splitlines())}: table\.{key}: it must be"):
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
    with pytest.raises(UsageError, match="needs mechanical_unit"):
        cell_of(f'{start}control = "external axes"\n', name="cell.toml")
    with pytest.raises(UsageError, match="mechanical_unit needs control"):
        cell_of(f'{start}mechanical_unit = "STN1"\n', name="cell.toml")


# What a source is: one of its kinds, from a text, a table or the file of a drawn curve.


@pytest.mark.parametrize(
    ("text", "keys", "said"),
    [
        ("border", {"border": True}, "border"),
        (" best ", {"best": True}, "best"),
        ("loop:2", {"loops": [2]}, "loops:2"),
        ("loops:1,3", {"loops": [1, 3]}, "loops:1,3"),
        ("near:1,-2,3.5", {"near": [[1.0, -2.0, 3.5]]}, "near:1,-2,3.5"),
        ("near:1,2,3:4,5,6", {"near": [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]}, "near:1,2,3:4,5,6"),
        ("between:0,0,0:1,0,0", {"between": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]}, "between:0,0,0:1,0,0"),
        ("point:1e1,2,3", {"point": [10.0, 2.0, 3.0]}, "point:10,2,3"),
        ("angle:-45", {"angle": -45.0}, "angle:-45"),
        ("angle:0", {"angle": 0.0}, "angle:0"),
    ],
)
def test_a_text_is_a_source_and_told_as_it_is_typed(text: str, keys: dict[str, object], said: str) -> None:
    assert source_named(text) == keys
    source = SourceTable.model_validate(keys)
    assert str(source) == said
    assert job_of(surface="part.ply", source=text).source == job_of(surface="part.ply", source=keys).source == source


def test_the_file_of_a_curve_is_read(tmp_path: Path) -> None:
    path = tmp_path / "drawn.csv"
    path.write_text("x,y,z\n1,2,3\n4,5,6\n")
    assert source_named(str(path)) == {"curve": [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]}
    assert str(SourceTable(curve=[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])) == "a curve of 2 points"


@pytest.mark.parametrize("text", ["rim", "loops:", "loops:one", "point:1;2;3", "best:1", "nowhere.csv", ""])
def test_a_text_that_means_nothing_is_refused_with_what_would(text: str) -> None:
    with pytest.raises(
        UsageError, match=r"`--from`: .* is neither a source nor a file: give one of border, best, loops:1,3"
    ):
        source_named(text)
    with pytest.raises(UsageError, match="is neither a source"):
        job_of(surface="part.ply", source=text)


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        ({}, "a source is one of border, best, loops, near, between, curve, point, angle, found none"),
        ({"best": True, "loops": [1]}, "found best and loops"),
        ({"loops": []}, "at least 1 item"),
        ({"loops": [0]}, "greater than 0"),
        ({"near": [[1.0, 2.0]]}, "at least 3 items"),
        ({"between": [[0.0, 0.0, 0.0]]}, "at least 2 items"),
        ({"between": 4 * [[0.0, 0.0, 0.0]]}, "at most 3 items"),
        ({"curve": [[0.0, 0.0, 0.0]]}, "at least 2 items"),
        ({"curve": 501 * [[0.0, 0.0, 0.0]]}, "at most 500 items"),
        ({"point": [0.0, 0.0, float("nan")]}, "finite"),
        ({"border": True, "seed": [0, 0, 0]}, "seed"),
    ],
)
def test_a_table_that_is_no_source_is_refused(keys: dict[str, object], why: str) -> None:
    with pytest.raises(UsageError, match=why):
        job_of(surface="part.ply", source=keys)


def test_several_patches_take_the_border_the_best_or_each_its_own() -> None:
    box = {"box": [0, 0, 0, 1, 1, 1]}
    for source in ("border", "best"):
        assert job_of(surface="part.ply", patches=[box, box], source=source).source is not None
    with pytest.raises(UsageError, match="the source loops:1 lies on one of 2 patches: give each patch its own"):
        job_of(surface="part.ply", patches=[box, box], source="loops:1")
    job = job_of(surface="part.ply", patches=[box, {**box, "source": "loops:2"}])
    assert [str(patch.source) for patch in job.patches] == ["None", "loops:2"]
