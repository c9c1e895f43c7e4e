"""Cell files and jobs: what comes with geoprint is right, and every wrong key is named."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from geoprint.config import (
    PACKAGED_CELLS,
    TILTING_CELL,
    UR_CELL,
    Needle,
    cell_of,
    common_needles,
    job_cell,
    job_of,
    job_text,
    load_cell,
    needle_keys,
    packaged_cell_text,
    with_needle,
)
from geoprint.config.cell_file import CellFile
from geoprint.config.cells import needle_of
from geoprint.config.strict import Table
from geoprint.errors import UsageError
from geoprint.model import GoodPrint, TiltTurn
from geoprint.robot.arm import Arm, check_load, require_abb_conventions
from tests.robot.cells import bent_cell, straight_cell

# Of what the packaged cells leave out, in their order.
EXAMPLES = (
    "[good_print]\n# pressure_kpa = 10\n# rounds = 20",
    "layer_pause_s = 60",
    "pressure_kpa = 10\n# rounds = 20",
    'vacuum = "doVacuum"',
    "[flood]\n# duration_s = 60\n# joints_deg",
)


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "cell.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_packaged_cells_are_those_of_the_motion_tests(tmp_path: Path) -> None:
    for name, wanted in (("irb120-bent45", bent_cell()), ("irb120-straight160", straight_cell())):
        found = load_cell(written(tmp_path, packaged_cell_text(name)))
        np.testing.assert_allclose(found.tool.T_flange_tool, wanted.tool.T_flange_tool, atol=1e-6)
        np.testing.assert_allclose(found.robot.limits, wanted.robot.limits)
        np.testing.assert_allclose(found.robot.speeds, wanted.robot.speeds)
        np.testing.assert_allclose(found.robot.accelerations, wanted.robot.accelerations, rtol=1e-4)
        np.testing.assert_allclose(found.robot.home, wanted.robot.home)
        np.testing.assert_allclose(found.demo_position, wanted.demo_position)
        assert found.demo_rotation is None
        np.testing.assert_array_equal(found.demo_turn, np.eye(3))
        assert found.process == wanted.process
        assert found.fixture is None


def test_the_needle_that_comes_along_is_a_common_one_that_passes_between_paths_1_mm_apart() -> None:
    tables = [needle for needle in common_needles() if needle.outer <= 1.0]
    for name in ("irb120-bent45", "irb120-straight160"):
        found = needle_of(cell_of(packaged_cell_text(name), name=name).tool)
        # 20 gauge, 1 inch: 0.03575 and 0.02375 inch outside and inside.
        assert (found.length, found.outer, found.inner) == pytest.approx((25.4, 0.908, 0.603), abs=0.005)
        assert max(needle.outer for needle in tables) == found.outer


def test_the_slim_cell_is_the_bent_one_with_another_needle() -> None:
    slim, bent = (cell_of(packaged_cell_text(name), name=name) for name in ("irb120-slim45", "irb120-bent45"))
    np.testing.assert_array_equal(slim.tool.T_flange_tool, bent.tool.T_flange_tool)
    found = needle_of(slim.tool)
    (common,) = (each for each in common_needles() if (each.gauge, each.length) == (23, 38.1))
    assert (found.length, found.outer, found.inner) == (common.length, common.outer, common.inner)
    assert found.outer < needle_of(bent.tool).outer
    # The pressure that it asks for, by the law of Hagen and Poiseuille.
    before = needle_of(bent.tool)
    more = (found.length / before.length) * (before.inner / found.inner) ** 4
    assert more == pytest.approx(14.5, rel=0.01)
    assert "about 15 times the pressure" in " ".join(packaged_cell_text("irb120-slim45").replace("#", " ").split())


def test_the_cell_with_a_ur5e_is_served_in_closed_form_and_carries_its_tool() -> None:
    cell = load_cell(UR_CELL)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    tip = arm.tool_poses(cell.robot.home[None])[0]

    assert (cell.name, cell.robot.model, arm.no_closed_form) == ("ur5e.toml", "ur5e", None)
    # At home the nozzle points down, over the part.
    assert tip[2, 2] < -0.999
    np.testing.assert_allclose(tip[:2, 3], cell.demo_position[:2], atol=15.0)
    assert tip[2, 3] > cell.demo_position[2] + 100.0
    assert check_load(cell.tool, arm).mass_kg == pytest.approx(0.6)
    with pytest.raises(UsageError, match=r"RAPID program is impossible for the arm ur5e: .* parallel"):
        require_abb_conventions(arm)


def test_a_packaged_cell_is_known_by_its_name_unless_a_file_has_that_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert load_cell("irb120-straight160").name == "irb120-straight160.toml"
    (tmp_path / "irb120-straight160").write_text(packaged_cell_text("irb120-bent45"), encoding="utf-8")
    found = load_cell("irb120-straight160")
    assert (found.name, found.tool.T_flange_tool[0, 3] > 80.0) == ("irb120-straight160", True)
    with pytest.raises(UsageError, match="the cell file ur6e does not exist"):
        load_cell("ur6e")


def test_a_part_tilts_only_in_the_cell_that_says_so_and_there_below_the_arm_at_home() -> None:
    for name in PACKAGED_CELLS:
        assert cell_of(packaged_cell_text(name), name=name).table is None
    found = cell_of(packaged_cell_text(TILTING_CELL), name=TILTING_CELL)
    slim = cell_of(packaged_cell_text("irb120-slim45"), name="slim")
    assert isinstance(found.table, TiltTurn)
    np.testing.assert_array_equal(found.table.T_base_table[:2, 3], found.demo_position[:2])
    assert found.table.T_base_table[2, 3] < found.demo_position[2]
    assert needle_of(found.tool) == needle_of(slim.tool)


def test_the_packaged_cells_name_every_key() -> None:
    # The calibration of an arm belongs to one of them.
    text = packaged_cell_text(PACKAGED_CELLS[0]) + packaged_cell_text("ur5e")
    for name, field in CellFile.model_fields.items():
        assert re.search(rf"\[{name}[\].]", text)
        for table in (field.annotation, *get_args(field.annotation)):
            keys = table.model_fields if isinstance(table, type) and issubclass(table, Table) else ()
            for key in keys:
                assert re.search(rf"^(# *)?{key} = ", text, re.MULTILINE), f"{name}.{key}"


LAMP = """
[lamp]
position_mm = [0, 45, 10]
rpy_deg = [0, 90, 0]
length_mm = 60
diameter_mm = 20

[work]
"""


def test_the_packaged_cells_leave_the_lamp_unknown_and_their_example_of_one_is_right(tmp_path: Path) -> None:
    for name in (*PACKAGED_CELLS, TILTING_CELL):
        text = packaged_cell_text(name)
        assert load_cell(written(tmp_path, text)).tool.lamp is None
        first, last = text.index("# [lamp]"), text.index("[work]")
        shown = "\n".join(line.removeprefix("# ") for line in text[first:last].splitlines())
        lamp = load_cell(written(tmp_path, text[:first] + shown + "\n" + text[last:])).tool.lamp
        assert lamp is not None
        assert (lamp.length, lamp.diameter) == (60.0, 20.0)


def test_the_lamp_points_along_the_z_axis_that_its_angles_turn(tmp_path: Path) -> None:
    text = packaged_cell_text(PACKAGED_CELLS[0]).replace("\n[work]\n", LAMP, 1)

    lamp = load_cell(written(tmp_path, text)).tool.lamp

    assert lamp is not None
    np.testing.assert_allclose(lamp.T_flange_lamp[:3, 3], [0.0, 45.0, 10.0])
    np.testing.assert_allclose(lamp.T_flange_lamp[:3, 2], [1.0, 0.0, 0.0], atol=1e-12)


def test_a_lamp_without_size_is_refused(tmp_path: Path) -> None:
    text = packaged_cell_text(PACKAGED_CELLS[0]).replace("\n[work]\n", LAMP.replace("length_mm = 60", ""), 1)

    with pytest.raises(UsageError, match=r"lamp\.length_mm"):
        load_cell(written(tmp_path, text))


def test_the_period_of_targets_is_read_and_has_a_default(tmp_path: Path) -> None:
    text = packaged_cell_text(PACKAGED_CELLS[0])

    assert load_cell(written(tmp_path, text.replace("period_ms = 20", "period_ms = 8"))).robot.target_period == 0.008
    assert load_cell(written(tmp_path, text.replace("target_period_ms = 20\n", ""))).robot.target_period == 0.02


def test_the_packaged_cells_leave_the_material_unknown_and_their_example_of_one_is_right(tmp_path: Path) -> None:
    for name in (*PACKAGED_CELLS, TILTING_CELL):
        text = packaged_cell_text(name)
        plain = load_cell(written(tmp_path, text))
        assert (plain.material, plain.overhang) == (None, None)
        first, last = text.index("# [material]"), text.index("# Until the material is measured")
        shown = "\n".join(line.removeprefix("# ") for line in text[first:last].splitlines())
        cell = load_cell(written(tmp_path, text[:first] + shown + "\n" + text[last:]))
        material = cell.material
        assert material is not None
        assert cell.overhang == pytest.approx(np.radians(30.0))
        assert (material.density, material.fluid.consistency, material.fluid.index) == (1.1, 20.0, 0.6)
        assert (material.irradiance, material.spot_diameter, material.dose) == (500.0, 6.0, 100.0)
        assert material.penetration == 0.8


def test_the_packaged_cells_show_what_else_a_cell_may_have_and_their_examples_are_right(tmp_path: Path) -> None:
    for name in (*PACKAGED_CELLS, TILTING_CELL):
        text = packaged_cell_text(name)
        plain = load_cell(written(tmp_path, text))
        assert (plain.good_print, plain.flood, plain.signals.vacuum) == (None, None, None)
        assert (plain.process.pressure, plain.process.rounds) == (None, None)
        for shown in EXAMPLES:
            assert f"# {shown}" in text
            text = text.replace(f"# {shown}", shown.replace("\n# ", "\n"), 1)
        cell = load_cell(written(tmp_path, text))
        assert cell.good_print == GoodPrint(10e3, 20)
        assert (cell.process.pressure, cell.process.rounds, cell.signals.vacuum) == (10e3, 20, "doVacuum")
        assert cell.process.layer_pause == 60.0
        assert cell.flood is not None
        assert cell.flood.duration == 60.0
        assert cell.flood.joints is not None
        assert np.degrees(cell.flood.joints[1]) == pytest.approx(28.0)


def test_the_angle_of_overhang_may_be_known_before_the_flow_and_nothing_else_of_a_material(tmp_path: Path) -> None:
    text = packaged_cell_text(PACKAGED_CELLS[0])
    cell = load_cell(written(tmp_path, f"{text}\n[material]\noverhang_deg = 45\n"))
    assert cell.material is None
    assert (cell.overhang, cell.critical_overhang) == pytest.approx((np.pi / 4.0, np.pi / 4.0))
    # Where nobody states it, the paper's.
    assert load_cell(None).critical_overhang == pytest.approx(np.pi / 6.0)
    for table, missing in (
        ("", "density_g_cm3, consistency_pa_sn, flow_index, yield_stress_pa missing"),
        ("overhang_deg = 45\nuv_dose_mj_cm2 = 100", "density_g_cm3, .*, yield_stress_pa missing"),
        ("density_g_cm3 = 1\nflow_index = 1\nyield_stress_pa = 0", "material: consistency_pa_sn missing"),
    ):
        with pytest.raises(UsageError, match=missing):
            load_cell(written(tmp_path, f"{text}\n[material]\n{table}\n"))


def test_half_a_lamp_spot_is_refused(tmp_path: Path) -> None:
    table = (
        "[material]\ndensity_g_cm3 = 1\nconsistency_pa_sn = 1\nflow_index = 1\nyield_stress_pa = 0\nuv_spot_mm = 6\n"
    )
    text = packaged_cell_text(PACKAGED_CELLS[0]) + "\n" + table

    with pytest.raises(UsageError, match="material: uv_irradiance_mw_cm2 and uv_spot_mm describe one spot"):
        load_cell(written(tmp_path, text))


def test_no_cell_file_means_the_first_packaged_cell() -> None:
    assert load_cell(None).name == "irb120-bent45.toml"


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("speed_mm_s = 20", "speed_mm_s = nan", r"process\.speed_mm_s: .*found nan"),
        # The one that is there, and not the one that is missing for it.
        (
            "speed_mm_s = 20",
            "speed_mms = 20",
            r"108: process\.speed_mms: there is no such key, found 20 \(and 1 more\) \(did you mean `speed_mm_s`\?\)",
        ),
        ("speed_mm_s = 20", "speed_mm_s = -1", r"process\.speed_mm_s: .*at least 0.1"),
        ("speed_mm_s = 20", 'speed_mm_s = "fast"', r"process\.speed_mm_s: .*found 'fast'"),
        ("speed_mm_s = 20", "speed_mm_min = 20", r"process\.(speed_mm_s|speed_mm_min): .*1 more"),
        ("tcp_mm = [84.8528137, 0, 124.8528137]", "tcp_mm = [1, 2]", r"tool\.tcp_mm: .*3 items"),
        ('dispenser = "doValve"', 'dispenser = "do Valve; Stop"', r"signals\.dispenser"),
        ("outer_diameter_mm = 0.91", "outer_diameter_mm = 0.5", "inner_diameter_mm must be smaller"),
        ("barrel_top_mm = 120", "barrel_top_mm = 60", "leaves no barrel"),
        ("barrel_diameter_mm = 20", "barrel_diameter_mm = 0.9", "must be larger"),
        ('source = "demo"', 'source = "calibrated"', "needs the points that were touched"),
        ('source = "demo"', 'source = "demo"\nmodel_mm = [[0, 0, 0]]', "must be pairs"),
        ('source = "demo"', 'source = "demo"\nnoise_mm = 0', r"work\.noise_mm: .*greater than 0"),
        ("joints_deg = [0, 28, 20, 0, 87, 180]", "joints_deg = [0, 28, 80, 0, 87, 180]", "joint 3 at 80"),
        ("retract_mm = 5", "retract_mm = 0.9", r"process: retract_mm is 0\.9.*at least .* = 1 mm"),
        ("travel_speed_mm_s = 60", "travel_speed_mm_s = 60000", r"process\.travel_speed_mm_s: .*250"),
        ("mass_kg = 0.6", "mass_kg = 0", r"tool\.mass_kg: .*greater than 0"),
        ("mass_kg = 0.6", "", r"tool\.mass_kg: this key is missing"),
        ("cog_mm = [25, 0, 65]", "", r"tool\.cog_mm: this key is missing"),
        ("inertia_kg_m2 = [0.002, 0.002, 0.0005]", "", r"tool\.inertia_kg_m2: this key is missing"),
        ("inertia_kg_m2 = [0.002", "inertia_kg_m2 = [-0.002", r"tool\.inertia_kg_m2\.1: .*greater than 0"),
        ('arm = "irb120"', "", "robot: give either arm"),
        ('arm = "irb120"', 'arm = "irb120"\nurdf = "own.urdf"', "robot: give either arm"),
        ("payload_kg = 3", "", "robot: payload_kg and wrist_inertia_kg_m2.*give both"),
        ('arm = "irb120"', 'urdf = "own.urdf"', r"robot\.urdf: .*own\.urdf cannot be read"),
        ('uv_lamp = "doUV"', 'uv_lamp = "DOVALVE"', "same output"),
        ("target_period_ms = 20", "target_period_ms = 0", r"robot\.target_period_ms: .*at least 1"),
        ("[robot]", "[robot", "not valid TOML"),
    ],
)
def test_a_wrong_key_is_named_with_what_was_found(tmp_path: Path, old: str, new: str, complaint: str) -> None:
    text = packaged_cell_text("irb120-bent45")
    assert old in text
    with pytest.raises(UsageError, match=complaint):
        load_cell(written(tmp_path, text.replace(old, new, 1)))


def test_a_calibrated_cell_keeps_its_touched_points(tmp_path: Path) -> None:
    corners = "[[-50, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]]"
    touched = "[[250, 50, 0], [350, 50, 0], [350, -50, 0], [250, -50, 0]]"
    text = packaged_cell_text("irb120-bent45").replace(
        'source = "demo"', f'source = "calibrated"\nmodel_mm = {corners}\ntouched_mm = {touched}\npart_mm = [0, 0, 5]\n'
    )
    fixture = load_cell(written(tmp_path, text)).fixture
    assert fixture is not None
    assert fixture.touched.shape == (4, 3)
    assert fixture.T_fixture_work is not None
    assert fixture.T_fixture_work[2, 3] == 5.0


def test_a_missing_cell_file_says_how_to_get_one(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="geoprint init"):
        load_cell(tmp_path / "nowhere.toml")


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"spacing": 1.0, "rounds": 10}, "not both"),
        ({"spacing": 0.0}, "spacing: .*at least 0"),
        ({"spacing": float("nan")}, "spacing: .*finite|spacing: .*greater"),
        ({"rounds": 0}, "rounds"),
        ({"unit": "furlong"}, "unit: .*'mm'"),
        ({"place": "somewhere"}, "place"),
        ({"colour": "red"}, "colour: there is no such key"),
    ],
)
def test_a_meaningless_job_is_refused(values: dict[str, object], complaint: str) -> None:
    with pytest.raises(UsageError, match=complaint):
        job_of(surface=Path("part.stl"), **values)


# Needles of the table, and the cell with one of them.


CELL = cell_of(packaged_cell_text("irb120-bent45"), name="cell.toml")


def test_table_lists_common_needles_within_the_standard() -> None:
    outer = {needle.gauge: needle.outer for needle in common_needles()}
    # Least and most outer diameter by ISO 9626, of the sizes that are 1.2, 0.9, 0.8, 0.7, 0.6 and 0.5 mm wide.
    allowed = {
        18: (1.20, 1.30),
        20: (0.86, 0.92),
        21: (0.80, 0.83),
        22: (0.69, 0.73),
        23: (0.60, 0.67),
        25: (0.50, 0.53),
    }
    assert outer.keys() == allowed.keys()
    assert all(allowed[gauge][0] <= width <= allowed[gauge][1] for gauge, width in outer.items() if gauge is not None)
    assert {needle.length for needle in common_needles()} == {6.35, 12.7, 25.4, 38.1}
    assert all(needle.inner < needle.outer for needle in common_needles())


def test_longer_needle_moves_the_tip_along_the_nozzle_and_nothing_else() -> None:
    longer = with_needle(CELL.tool, Needle(38.1, 0.82, 0.51, 21))
    moved = longer.T_flange_tool[:3, 3] - CELL.tool.T_flange_tool[:3, 3]
    # 12.7 mm along a nozzle that is bent by 45 degrees.
    np.testing.assert_allclose(moved, [8.9803, 0.0, 8.9803], atol=1e-4)
    np.testing.assert_array_equal(longer.T_flange_tool[:3, :3], CELL.tool.T_flange_tool[:3, :3])
    assert (longer.needle_length, longer.needle_diameter, longer.inner_diameter) == (38.1, 0.82, 0.51)
    assert longer.barrel_top == pytest.approx(132.7)


def test_keys_of_a_needle_written_into_the_cell_file_make_the_cell_that_was_tried() -> None:
    tool = with_needle(CELL.tool, Needle(38.1, 0.82, 0.51, 21))
    keys = needle_keys(CELL.tool, tool)
    text = packaged_cell_text("irb120-bent45")
    for line in [keys]:
        for key in ("needle_length_mm", "outer_diameter_mm", "inner_diameter_mm", "barrel_top_mm", "tcp_mm"):
            if key in line:
                value = line.split(f"{key} = ")[1]
                value = value[: value.index("]") + 1] if value.startswith("[") else value.split(",")[0]
                (before,) = [row for row in text.splitlines() if row.startswith(f"{key} = ")]
                text = text.replace(before, f"{key} = {value}")
    written = cell_of(text, name="cell.toml").tool
    np.testing.assert_allclose(written.T_flange_tool, tool.T_flange_tool, atol=1e-9)
    assert (written.needle_length, written.needle_diameter) == (38.1, 0.82)
    assert (written.inner_diameter, written.barrel_top) == (0.51, 132.7)


def test_keys_of_a_needle_of_the_same_length_leave_the_tip_alone() -> None:
    keys = needle_keys(CELL.tool, with_needle(CELL.tool, Needle(25.4, 0.82, 0.51, 21)))
    assert keys == "[nozzle] outer_diameter_mm = 0.82, inner_diameter_mm = 0.51"


def test_a_needle_sets_spacing_layer_standoff_and_speed_together() -> None:
    job = job_of(surface="part.ply", unit="mm", needle=0.4)
    assert job.spacing == 0.4
    # The strand leaves the needle as fast as the tip moves: 0.4 mm x 0.314 mm is pi / 4 x (0.4 mm)^2.
    assert job.layer_height == job.standoff == 0.314
    # The packaged needle of 0.6 mm prints at 20 mm/s.
    assert job.speed == 13.3
    cell = job_cell(job)
    assert (cell.tool.inner_diameter, cell.tool.needle_diameter) == (0.41, 0.72)
    assert (cell.process.layer_height, cell.process.standoff, cell.process.speed) == (0.314, 0.314, 13.3)
    np.testing.assert_array_equal(cell.tool.T_flange_tool, CELL.tool.T_flange_tool)


def test_what_is_given_beside_a_needle_counts_and_the_volume_still_fits() -> None:
    job = job_of(surface="part.ply", needle=0.4, spacing=0.5, speed=5.0)
    assert (job.spacing, job.speed) == (0.5, 5.0)
    assert job.layer_height == pytest.approx(np.pi / 4 * 0.4**2 / 0.5, abs=5e-4)
    assert job_of(surface="part.ply", needle=0.4, rounds=7).spacing is None


def test_a_wider_needle_prints_no_faster_than_the_cell() -> None:
    assert job_of(surface="part.ply", needle=0.84).speed == 20.0


def test_a_job_file_that_was_made_with_a_needle_says_all_of_it_and_another_needle_replaces_all(tmp_path: Path) -> None:
    job = job_of(surface="part.ply", unit="mm", needle=0.4)
    written = tmp_path / "job.toml"
    written.write_text(job_text(job))
    assert "layer_height = 0.314" in written.read_text()
    again = job_of(surface=written)
    assert again.model_copy(update={"surface": job.surface}) == job
    other = job_of(surface=written, needle=0.6)
    assert (other.spacing, other.layer_height, other.speed) == (0.6, 0.471, 20.0)


def test_a_needle_that_nobody_sells_is_refused_with_those_that_there_are() -> None:
    with pytest.raises(UsageError, match=r"no needle has an inner diameter of 0\.7 mm: .*0\.6 \(20 gauge\)"):
        job_cell(job_of(surface="part.ply", needle=0.7))


def test_a_needle_of_the_cell_itself_is_kept(tmp_path: Path) -> None:
    text = packaged_cell_text("irb120-bent45").replace("inner_diameter_mm = 0.6", "inner_diameter_mm = 0.7")
    (tmp_path / "cell.toml").write_text(text)
    cell = job_cell(job_of(surface="part.ply", needle=0.7, cell=tmp_path / "cell.toml"))
    assert (cell.tool.inner_diameter, cell.tool.needle_diameter) == (0.7, 0.91)
