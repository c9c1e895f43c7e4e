"""What a plan tells of a table that tilts the part."""

from __future__ import annotations

from pathlib import Path

import pytest

from geoprint import compare, job_of, plan
from geoprint.config import TILTING_CELL, packaged_cell_text
from geoprint.geometry.files import save_ply
from geoprint.guide import pages
from geoprint.metrics import overhang
from geoprint.reporting import outcome_text, record_plan, recorded_comparison
from geoprint.reporting.comparison import comparison_table
from geoprint.reporting.evenness import overhang_rows, record_overhang, table_sentences, table_text
from geoprint.reporting.records.comparison import PartRecord, PlannedRecord
from geoprint.results import Comparison, Plan
from tests.meshes import cylinder_patch, spherical_cap

PART = Path(__file__).parents[2] / "data" / "heart_apex_patch.ply"


def tilting_cell(folder: Path, kind: str) -> Path:
    path = folder / f"{kind}.toml"
    path.write_text(f'{packaged_cell_text("irb120-bent45")}\n[table]\nkind = "{kind}"\nposition_mm = [300, 0, 20]\n')
    return path


@pytest.fixture(scope="module")
def over_tilt_turn(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    cell = tilting_cell(tmp_path_factory.mktemp("table"), "tilt-turn")
    return plan(job_of(surface=PART, unit="mm", spacing=4.0, backend="heat", robot=False, cell=cell))


@pytest.fixture(scope="module")
def cap(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cap that is steeper at its rim than a hexapod can bring up."""
    path = tmp_path_factory.mktemp("part") / "cap.ply"
    save_ply(spherical_cap(radius=12.0, angle=1.1, rings=6), path)
    return path


@pytest.fixture(scope="module")
def over_hexapod(cap: Path, tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    cell = tilting_cell(tmp_path_factory.mktemp("table"), "hexapod")
    return compare(job_of(surface=cap, unit="mm", spacing=4.0, robot=False, cell=cell), backends=["heat", "lscm"])


def test_a_tilt_turn_table_leaves_nothing_overhanging_and_all_of_it_printed_once(over_tilt_turn: Plan) -> None:
    planned = over_tilt_turn
    record = record_overhang(planned)
    assert record.share > 0.2
    assert record.table is not None
    assert (record.table.length_mm, record.table.missing_deg) == (0.0, 0.0)
    assert len(record.table.attitudes) == min(record.table.moves_kept, record.table.moves_gathered) > 1
    total = overhang(planned.poses, up=planned.workpiece.upright[2], critical=1e-6).length
    assert sum(one.length_mm for one in record.table.attitudes) == pytest.approx(total, rel=0.01)
    assert all(one.slack >= -1e-6 and len(one.axes) == 2 for one in record.table.attitudes)
    assert "nothing overhangs" in table_text(record.table)


def test_the_guides_example_overhangs_at_rest_as_the_page_says_and_nowhere_in_its_attitudes(tmp_path: Path) -> None:
    cell = tmp_path / "cell.toml"
    cell.write_text(packaged_cell_text(TILTING_CELL))
    tip = {"at": [8.0, 0.0, -60.0], "radius": 9.0}
    job = job_of(surface=PART, patch=tip, unit="mm", spacing=4.0, backend="heat", robot=False, cell=cell)
    record = record_overhang(plan(job))
    assert record.table is not None
    assert record.table.length_mm == 0.0
    total = record.length_mm / record.share
    words = f"here {record.length_mm:.0f} of {total:.0f} mm without the table, and nothing in three attitudes"
    assert len(record.table.attitudes) == 3
    assert words in " ".join(next(page.text for page in pages() if page.name == "overhang").split())


def test_a_hexapod_tells_what_it_cannot_bring_up(over_hexapod: Comparison) -> None:
    ((name, outcome), _) = over_hexapod.planned
    assert name == "heat"
    record = record_overhang(outcome.plan)
    assert record.table is not None
    # It tilts by up to 15 degrees to any side: what is steeper than critical by more than that misses by the rest.
    assert (
        record.largest_deg - record.critical_deg - 15.5
        <= record.table.missing_deg
        <= record.largest_deg - record.critical_deg
    )
    assert 0.0 < record.table.length_mm < record.length_mm
    assert "still overhang" in table_text(record.table)
    assert all(len(one.axes) == 6 for one in record.table.attitudes)


def test_a_row_of_the_report_stands_only_where_the_cell_has_a_table(over_tilt_turn: Plan) -> None:
    without = plan(job_of(surface=PART, unit="mm", spacing=4.0, backend="heat", robot=False))
    found = [record_overhang(each) for each in (without, over_tilt_turn)]
    rows = [PlannedRecord.model_construct(backend="heat", overhang=one) for one in found]
    still, tilted = (overhang_rows([row]) for row in rows)
    assert [row.quantity for row in tilted[: len(still)]] == [row.quantity for row in still]
    assert [row.quantity for row in tilted[len(still) :]] == ["attitudes of the table"]
    # So it is with the sentence that `compare` says.
    assert table_sentences(rows[:1]) == []
    table = found[1].table
    assert table is not None
    left = f"nothing over the tilt-turn table in {len(table.attitudes)} attitudes"
    assert table_sentences(rows) == [f"Overhang: {found[1].length_mm:.0f} mm without the table, with heat and {left}."]


def test_overhang_is_stated_where_the_material_has_its_angle_and_a_detail_where_not(cap: Path, tmp_path: Path) -> None:
    cell = tmp_path / "cell.toml"
    cell.write_text(f"{packaged_cell_text('irb120-bent45')}\n[material]\noverhang_deg = 45\n")
    # Rings of a cap of 63 degrees, some of which lie between 30 and 45.
    job = job_of(surface=cap, unit="mm", spacing=3.0, backend="heat", robot=False)
    assumed, stated = (compare(each, backends=["heat"]) for each in (job, job.model_copy(update={"cell": cell})))
    records = [record_overhang(each.planned[0][1].plan) for each in (assumed, stated)]
    assert [(one.critical_deg, one.assumed) for one in records] == [(pytest.approx(30.0), True), (45.0, False)]
    assert records[0].length_mm > records[1].length_mm > 0.0
    for found, record in zip((assumed, stated), records, strict=True):
        line = f"{100 * record.share:.1f} % of the deposit"
        plan_json, recorded = record_plan(found.planned[0][1].plan), recorded_comparison([found])
        assert (line in outcome_text(plan_json)) is not record.assumed
        assert ("overhang" in comparison_table(recorded)) is not record.assumed
        # Asked for, it is there, and says what was assumed.
        assert line in outcome_text(plan_json, verbose=True)
        assert ("assumed: [material] states no overhang_deg" in outcome_text(plan_json, verbose=True)) is record.assumed
        assert f"{100 * record.share:.1f} %" in comparison_table(recorded, verbose=True)
        assert all("overhang" not in text for text in (*plan_json.warnings, *plan_json.notes))
        deposit, _ = overhang_rows([PlannedRecord.model_construct(backend="heat", overhang=record)])
        assert deposit.values == (f"{100 * record.share:.1f} %, {record.length_mm:.0f} mm",)


def test_compare_says_what_a_hexapod_leaves_with_each_backend(over_hexapod: Comparison) -> None:
    record = recorded_comparison([over_hexapod]).record.parts[0]
    assert isinstance(record, PartRecord)
    (said,) = [text for text in record.verdict if text.startswith("Overhang: ")]
    assert [name for name, _ in over_hexapod.planned] == ["heat", "lscm"]
    for name, outcome in over_hexapod.planned:
        recorded = record_overhang(outcome.plan)
        assert recorded.table is not None
        assert 0.0 < recorded.table.length_mm < recorded.length_mm
        assert (
            f"{recorded.length_mm:.0f} mm without the table, with {name} and {recorded.table.length_mm:.0f} mm over "
            f"the hexapod in "
            f"{len(recorded.table.attitudes)} attitudes, up to {recorded.table.missing_deg:.0f} degrees beyond" in said
        )


def test_a_layer_over_a_table_is_divided_among_attitudes_of_its_own(tmp_path: Path) -> None:
    cell, arch = tilting_cell(tmp_path, "tilt-turn"), tmp_path / "arch.ply"
    save_ply(cylinder_patch(radius=4.0, angle=1.6, length=4.0, divisions=(8, 4)), arch)
    job = job_of(surface=arch, unit="mm", spacing=1.5, backend="lscm", robot=False, cell=cell, thickness=1.0)
    first, second = (plan(job.model_copy(update={"layer": number})) for number in (1, 2))
    for planned in (first, second):
        assert planned.tilting is not None
        assert len(planned.tilting.attitudes) > 1
        assert planned.tilting.overhanging == 0.0
        assert sum(planned.tilting.lengths) == pytest.approx(deposited_length(planned), rel=0.01)
    # The second lies outside the first, and is longer.
    assert first.tilting is not None
    assert second.tilting is not None
    assert sum(second.tilting.lengths) > sum(first.tilting.lengths)


def deposited_length(planned: Plan) -> float:
    return overhang(planned.poses, up=planned.workpiece.upright[2], critical=1e-6).length


def test_the_time_of_a_driven_table_is_what_the_program_gives_each_of_its_motions(
    over_tilt_turn: Plan, tmp_path: Path
) -> None:
    driven = tilting_cell(tmp_path, "tilt-turn")
    driven.write_text(f'{driven.read_text()}control = "external axes"\nmechanical_unit = "STN1"\n')
    job = job_of(surface=PART, unit="mm", spacing=4.0, backend="heat", robot=False, cell=driven)
    free, given = over_tilt_turn.tilting, plan(job).tilting
    assert free is not None
    assert given is not None
    # The slowest axis turns by 360 degrees at 90 a second, at the share of the cell: a quarter.
    assert given.seconds == pytest.approx((16.0,) * len(given.attitudes))
    assert len(free.seconds) == len(given.seconds)
    assert max(free.seconds) <= 4.0
