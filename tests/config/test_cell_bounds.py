"""The bounds of a cell file: every one is kept just inside and refused just outside, and what belongs together is."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Mapping

import pytest
from pydantic import ValidationError

from geoprint.config import packaged_cell_text
from geoprint.config.cell_file import CellFile
from geoprint.model import LoadLimits

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
        ({"robot.model": None, "robot.urdf": "own.urdf"}, {"robot.urdf": "own.urdf"}, "give either model"),
        ({}, {"robot.model": None}, "give either model"),
        ({"robot.payload_kg": None, "robot.wrist_inertia_kg_m2": None}, {"robot.payload_kg": None}, "give both"),
        ({}, {"robot.wrist_inertia_kg_m2": None}, "give both"),
        (TOUCHED, {"work.model_mm": [[0.0, 0.0, 0.0]]}, "model_mm lists 1 points and touched_mm 0"),
        ({**TOUCHED, "work.source": "calibrated"}, {"work.source": "calibrated"}, "needs the points that were touched"),
        (
            {"work.part_mm": [0.0] * 3, "work.part_rpy_deg": [0.0] * 3},
            {"work.part_rpy_deg": [0.0] * 3},
            "part_mm does not say where it stands",
        ),
        ({"work.part_mm": [0.0] * 3}, {**TOUCHED, "work.part_rpy_deg": [0.0] * 3}, "part_rpy_deg turns the part"),
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
