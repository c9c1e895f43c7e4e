"""What is said of prints before they are made: who cannot be told apart, what to mend first, and whose errors count."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of, load_cell, packaged_cell_text
from geoprint.geometry.files import save_ply
from geoprint.model import Placement, PrintErrors, TouchedPoints
from geoprint.reporting import outcome_text, record_plan
from geoprint.reporting.comparison import recorded_comparison
from geoprint.reporting.evenness import expected_rows, expected_text, in_print
from geoprint.reporting.records.comparison import PartRecord, PlannedRecord
from geoprint.reporting.records.evenness import PrintedApartRecord, PrintedRecord, StandoffRecord, VarianceRecord
from geoprint.results import Comparison
from geoprint.workflow import compare
from geoprint.workflow.covering import errors_of
from tests.meshes import plate

PLAIN = {
    "plan": 0.0,
    "run_flow": 0.0,
    "repeatability": 0.1,
    "path_repeatability": 0.8,
    "placement": 0.1,
    "needle_runout": 0.0,
}


def in_prints(cv: float, *, mend: str | None = "path_repeatability", errors: str = "cell") -> PrintedRecord:
    shares = VarianceRecord(**(PLAIN if mend else {**PLAIN, "plan": 0.9, "path_repeatability": 0.0, "placement": 0.0}))
    return PrintedRecord.model_validate(
        {"cv": cv, "low": 0.8 * cv, "high": 1.3 * cv, "shares": shares, "mend_first": mend, "errors": errors}
    )


def apart(one: str, other: str, *, alike: bool) -> PrintedApartRecord:
    low = -0.001 if alike else 0.001
    return PrintedApartRecord(backends=(one, other), mean=0.01, low=low, high=0.02, indistinguishable=alike)


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    """Return one backend on a plate, with a cell whose arm repeats within 0.2 mm and has no other errors."""
    folder = tmp_path_factory.mktemp("plate")
    save_ply(plate((20.0, 16.0), (10, 8)), folder / "plate.ply")
    text = packaged_cell_text("irb120-bent45")
    for key, old, new in (
        ("repeatability_mm", 0.01, 0.2), ("path_repeatability_mm", 0.03, 0), ("placement_mm", 0.1, 0),
        ("needle_runout_mm", 0.05, 0), ("path_accuracy_mm", 0.114, 0), ("run_flow_share", 0.02, 0.3),
    ):  # fmt: skip
        assert f"\n{key} = {old}\n" in text
        text = text.replace(f"\n{key} = {old}\n", f"\n{key} = {new}\n")
    (folder / "own.toml").write_text(text, encoding="utf-8")
    job = job_of(surface=folder / "plate.ply", unit="mm", spacing=2.0, robot=False, cell=folder / "own.toml")
    return compare(job, backends=["heat"])


@pytest.fixture(scope="module")
def record(compared: Comparison) -> PlannedRecord:
    (part,) = recorded_comparison([compared]).record.parts
    assert isinstance(part, PartRecord)
    return part.planned[0]


def like(record: PlannedRecord, name: str, printed: PrintedRecord | None) -> PlannedRecord:
    measured = record.uniformity.model_copy(update={"printed": printed})
    return record.model_copy(update={"backend": name, "uniformity": measured})


def test_plans_that_print_alike_are_indistinguishable_on_this_cell(record: PlannedRecord) -> None:
    a, b, c = (like(record, name, in_prints(cv)) for name, cv in (("a", 0.01), ("b", 0.011), ("c", 0.09)))
    pairs = [apart("b", "a", alike=True), apart("a", "c", alike=False), apart("b", "c", alike=False)]
    assert in_print([a, b, c], pairs)[0] == (
        "In print, thickness is expected to vary by 1.0 % (0.8-1.3) with a, 1.1 % (0.9-1.4) with b and 9.0 % "
        "(7.2-11.7) with c (95 % interval in brackets). On this cell, a and b are indistinguishable."
    )
    assert in_print([a, b], pairs)[0].endswith(". On this cell, they are indistinguishable.")
    assert in_print([a, c], pairs)[0].endswith(". a differs measurably from the other.")
    assert in_print([c, a, b], pairs)[0].endswith(". c differs measurably from the others.")
    assert in_print([a], [])[0].endswith("(95 % interval in brackets).")
    assert in_print([like(record, "a", None)], []) == ()


def test_the_largest_error_is_the_one_to_mend_first(record: PlannedRecord) -> None:
    def said(printed: PrintedRecord) -> str:
        return in_print([like(record, "a", printed)], [])[1]

    arm = (
        "Largest error source: path repeatability of the arm (`path_repeatability_mm`), 80 % of the variance of a in "
        "print."
    )
    assert said(in_prints(0.01)) == arm
    assert said(in_prints(0.01, errors="packaged cell")).startswith(f"{arm} These are errors of the packaged cell")
    assert (
        said(in_prints(0.01, mend=None)) == "Largest error source: the plan of a itself, 90 % of its variance in print."
    )


def test_figures_stand_with_their_interval_and_a_dash_where_there_are_none() -> None:
    assert expected_text(in_prints(0.0142)) == "1.42 % (1.14-1.85)"
    assert expected_text(in_prints(0.0142), digits=1) == "1.4 % (1.1-1.8)"
    assert expected_text(None) == "-"
    printed, shares = expected_rows([in_prints(0.0142), None])
    assert printed.values == ("1.42 % (1.14\N{NON-BREAKING HYPHEN}1.85)", "-")
    assert "errors of the cell" in printed.meaning
    assert shares.values == ("0 / 0 / 90 / 10 %", "-")


def test_the_standoff_that_the_arm_keeps_stands_beside_the_wanted_one() -> None:
    kept, unknown = (
        in_prints(0.01).model_copy(update={"standoff": StandoffRecord(wanted_mm=0.5, within_mm=within)})
        for within in (0.178, None)
    )
    assert expected_rows([kept, unknown, in_prints(0.01), None])[2].values == (
        "\N{PLUS-MINUS SIGN}0.18, 36 % of 0.5", "path accuracy not measured", "-", "-"
    )  # fmt: skip


def test_a_cell_of_ones_own_says_how_far_its_prints_stray(compared: Comparison, record: PlannedRecord) -> None:
    printed, plan = record.uniformity.printed, compared.planned[0][1].plan
    assert printed is not None
    assert (printed.errors, printed.mend_first) == ("cell", "run_flow")
    assert printed.standoff == StandoffRecord(wanted_mm=0.3, within_mm=None)
    shares = printed.shares
    # How the part is turned, which the cell still has, matters along the rim alone.
    assert 0.0 < shares.placement < 5e-4
    assert shares.run_flow + shares.repeatability + shares.plan + shares.placement == pytest.approx(1.0, abs=1e-5)
    assert 0.02 < shares.repeatability < 0.035
    text = outcome_text(record_plan(plan))
    assert f"in print: thickness is expected to vary by {expected_text(printed)}" in text
    assert "largest error source: flow differences between runs" in text
    assert "packaged" not in text
    assert record.deposition is not None
    # 0.05 of flow from print to print, 1.96 times to either side.
    assert record.deposition.printed_mean_within == pytest.approx(0.098)
    # 0.3 of flow from run to run: the spread leaves the root of 0.47, and the mean of four runs takes its part.
    assert 0.14 < printed.cv < 0.3 * np.sqrt(0.47)


def test_without_a_cell_the_packaged_one_counts_and_so_it_does_for_cells_without_errors(tmp_path: Path) -> None:
    text = packaged_cell_text("irb120-bent45")
    start = text.index("[errors]")
    (tmp_path / "old.toml").write_text(text[:start] + text[text.index("[signals]") :], encoding="utf-8")
    old = load_cell(tmp_path / "old.toml")
    assert old.errors is None
    (tmp_path / "unmeasured.toml").write_text(text.replace("\npath_accuracy_mm = 0.114\n", "\n"), encoding="utf-8")
    assert load_cell(tmp_path / "unmeasured.toml").errors == replace(PrintErrors(), path_accuracy=0.0)
    assert load_cell(None).errors == errors_of(old, None, middle=np.zeros(3)) == PrintErrors()


def test_touched_points_tell_where_the_part_stands() -> None:
    corners = np.array([[-50.0, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]])
    touched = TouchedPoints(model=corners, touched=corners, T_fixture_work=np.eye(4), noise=0.2)
    placement = Placement(np.eye(4), np.eye(4), calibrated=True, part_stated=True, misses=np.zeros(4))
    cell = replace(load_cell(None), fixture=touched)
    found = errors_of(cell, placement, middle=np.zeros(3))
    # 0.2 mm over the square root of four touches; a turn about x or y: over the root of 4 times 50 mm squared.
    assert found.placement == pytest.approx(0.1)
    assert found.placement_turn == pytest.approx(0.2 / 100.0)
    assert found.needle_runout == 0.05
    demo = Placement(np.eye(4), np.eye(4), calibrated=False, part_stated=False, misses=np.zeros(0))
    assert errors_of(cell, demo, middle=np.zeros(3)).placement == 0.1
