"""Each bound of a cell file, from both sides: the last value that is taken and the first that is not."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from geoprint.config import load_cell, packaged_cell_text
from geoprint.errors import UsageError
from geoprint.model import Cell

PURGE = "[purge]\njoints_deg = [40, 28, 20, 0, 87, 180]\nduration_s = {}\n"
FLOOD = "[flood]\nduration_s = {}\n"
MATERIAL = "[material]\ndensity_g_cm3 = 1\nconsistency_pa_sn = 1\nflow_index = 1\nyield_stress_pa = {}\n"
SEARCH = "[search]\nlimits = {}\n"


def loaded(tmp_path: Path, text: str) -> Cell:
    path = tmp_path / "cell.toml"
    path.write_text(text, encoding="utf-8")
    return load_cell(path)


def packaged(**values: str) -> str:
    """Return a packaged cell with keys set, whether they stand there or are commented out."""
    text = packaged_cell_text("irb120-bent45")
    for key, value in values.items():
        text, changes = re.subn(rf"(?m)^(# )?{key} = .*$", f"{key} = {value}", text, count=1)
        assert changes == 1, key
    return text


@pytest.mark.parametrize(
    ("key", "taken", "refused"),
    [
        ("speed_mm_s", "0.1", "0.099"), ("speed_mm_s", "250", "250.1"), ("travel_speed_mm_s", "0.1", "0.099"),
        ("travel_speed_mm_s", "250", "250.1"), ("joint_speed_share", "1", "1.001"), ("joint_speed_share", "0.001", "0"),
        ("standoff_mm", "0.001", "0"), ("layer_height_mm", "0.001", "0"), ("clearance_mm", "0.001", "0"),
        ("valve_open_s", "2", "2.001"), ("valve_close_s", "2", "2.001"), ("uv_lead_s", "2", "2.001"),
        ("uv_tail_s", "2", "2.001"), ("flow_lag_s", "2", "2.001"), ("valve_open_s", "0", "-0.001"),
        ("target_period_ms", "1", "0.999"), ("target_period_ms", "1000", "1000.1"),
        ("cone_half_angle_deg", "88.9", "89"), ("cone_half_angle_deg", "8", "1"), ("needle_length_mm", "0.1", "0"),
        ("inner_diameter_mm", "1.299", "1.3"), ("inner_diameter_mm", "0.001", "0"),
        ("barrel_diameter_mm", "1.301", "1.3"), ("barrel_top_mm", "78.5", "78.4"), ("retract_mm", "1", "0.999"),
        ("payload_kg", "0.7", "0"), ("mass_kg", "0.001", "0"), ("rounds", "100000", "100001"), ("rounds", "1", "0"),
        ("pressure_kpa", "0.001", "0"),
    ],
)  # fmt: skip
def test_a_key_is_taken_up_to_its_bound_and_refused_beyond_by_name(
    tmp_path: Path, key: str, taken: str, refused: str
) -> None:
    # `rounds` and `pressure_kpa` are first met in [good_print], which needs both and its head.
    text = packaged_cell_text("irb120-bent45")
    head = "[good_print]\n# pressure_kpa = 10\n# rounds = 20"
    assert f"# {head}" in text

    def with_value(value: str) -> str:
        if key in {"rounds", "pressure_kpa"}:
            other = {"rounds": "pressure_kpa = 10", "pressure_kpa": "rounds = 20"}[key]
            return text.replace(f"# {head}", f"[good_print]\n{other}\n{key} = {value}", 1)
        return packaged(**{key: value})

    loaded(tmp_path, with_value(taken))
    with pytest.raises(UsageError, match=rf"{key}|leaves no barrel|smaller than|larger than"):
        loaded(tmp_path, with_value(refused))


@pytest.mark.parametrize(
    ("table", "taken", "refused"),
    [
        (PURGE, "60", "60.1"), (PURGE, "0.01", "0"), (FLOOD, "3600", "3601"), (FLOOD, "0.01", "0"),
        (MATERIAL, "0", "-0.1"), (SEARCH, "0", "-0.1"),
    ],
)  # fmt: skip
def test_a_table_that_may_be_left_out_is_taken_up_to_its_bounds(
    tmp_path: Path, table: str, taken: str, refused: str
) -> None:
    loaded(tmp_path, packaged() + table.format(taken))
    with pytest.raises(UsageError, match=r"equal to|greater than"):
        loaded(tmp_path, packaged() + table.format(refused))


def test_a_flow_that_follows_the_speed_needs_its_output_and_its_scale(tmp_path: Path) -> None:
    both = {"mode": '"analog"', "flow": '"aoFlow"', "flow_per_mm3_s": "0.1"}
    assert loaded(tmp_path, packaged(**both)).signals.flow_per_mm3_s == 0.1
    for missing in ("flow", "flow_per_mm3_s"):
        with pytest.raises(UsageError, match='mode "analog" needs flow, the analog output, and flow_per_mm3_s'):
            loaded(tmp_path, packaged(**{key: value for key, value in both.items() if key != missing}))
    # Where the valve is only switched, neither is asked for.
    assert loaded(tmp_path, packaged(mode='"io"', flow='"aoFlow"')).signals.mode == "io"


@pytest.mark.parametrize("one", ["dispenser", "uv_lamp", "flow", "vacuum"])
@pytest.mark.parametrize("other", ["dispenser", "uv_lamp", "flow", "vacuum"])
def test_no_two_outputs_have_one_name(tmp_path: Path, one: str, other: str) -> None:
    names = {"dispenser": '"doA"', "uv_lamp": '"doB"', "flow": '"aoC"', "vacuum": '"doD"'}
    loaded(tmp_path, packaged(**names))
    if one != other:
        with pytest.raises(UsageError, match="name the same output twice"):
            loaded(tmp_path, packaged(**names | {one: names[other].upper()}))


def test_lags_are_none_where_a_cell_names_none(tmp_path: Path) -> None:
    signals = loaded(tmp_path, packaged()).signals
    assert (signals.valve_open, signals.valve_close, signals.uv_lead, signals.uv_tail) == (0.0, 0.0, 0.0, 0.0)


def test_what_an_arm_may_carry_is_stated_whole(tmp_path: Path) -> None:
    assert loaded(tmp_path, packaged(payload_kg="2.5")).robot.load is not None
    with pytest.raises(UsageError, match="belong together: give both"):
        loaded(tmp_path, packaged().replace("wrist_inertia_kg_m2 = [0.175, 0.085]\n", ""))


def test_a_part_is_turned_on_its_fixture_only_where_it_stands_there(tmp_path: Path) -> None:
    text = packaged().replace('source = "demo"', 'source = "demo"\npart_rpy_deg = [0, 0, 90]', 1)
    with pytest.raises(UsageError, match="part_mm does not say where it stands"):
        loaded(tmp_path, text)
