"""A part on several cells: what becomes of it on each, in the table, in cells.json and on the page."""

from __future__ import annotations

from pathlib import Path

import pytest

from geoprint.config import job_of, packaged_cell_text
from geoprint.errors import UsageError
from geoprint.reporting import read_record
from geoprint.reporting.cell_comparison import cells_text, record_cells
from geoprint.reporting.records.comparison import CellsRecord
from geoprint.results import CellComparison
from geoprint.workflow import save
from geoprint.workflow.cell_comparison import compare_cells
from tests.brief_proofs import proving_briefly

PLATE = Path(__file__).parents[2] / "data" / "plate.ply"
DISC = {"patch": {"at": [0.0, 0.0, 0.0], "radius": 4.0}, "spacing": 4.0, "max_tilt": 0.0}
NEAR, STRAIGHT = Path("irb120-bent45"), Path("irb120-straight160")


@pytest.fixture(scope="module")
def far(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a cell whose part stands out of reach; it says how the part is turned, so that it stays there."""
    path = tmp_path_factory.mktemp("cells") / "far.toml"
    text = packaged_cell_text("irb120-bent45").replace("[300, 0, 50]", "[900, 0, 50]")
    path.write_text(text.replace("# demo_rpy_deg", "demo_rpy_deg"), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def compared(far: Path) -> CellComparison:
    job = job_of(surface=PLATE, unit="mm", place="demo", **DISC)
    with proving_briefly():
        return compare_cells(job, [NEAR, far, STRAIGHT])


def test_each_cell_has_its_reach_margin_speed_time_and_clearance(compared: CellComparison) -> None:
    bent, far, straight = record_cells(compared).cells

    assert (bent.refused, straight.refused, bent.reached, straight.reached) == (None, None, 1.0, 1.0)
    assert (bent.arm, far.arm) == ("irb120", "irb120")
    assert bent.speed_mm_s is not None
    assert bent.duration_s is not None
    assert 0.0 < bent.speed_mm_s <= 20.0
    assert bent.duration_s > 1.0
    assert bent.clearance_mm == pytest.approx(1.3, abs=0.1)
    # The bent nozzle keeps joint 5 farther from its singularity than 15 degrees, and so does this straight one.
    assert min(bent.margin_deg or 0.0, straight.margin_deg or 0.0) > 15.0
    assert far.reached == 0.0
    assert far.refused is not None
    assert "is out of reach" in far.refused
    assert (far.speed_mm_s, far.duration_s, far.clearance_mm, far.margin_deg) == (None, None, None, None)


def test_the_table_says_where_it_prints_and_why_not(compared: CellComparison, far: Path) -> None:
    record = record_cells(compared)
    text = cells_text(record)

    assert record.verdict[0] == "plate.ply can be printed on irb120-bent45 and irb120-straight160."
    assert f"{far} cannot print it: run 1 at" in text
    head = "cell arm printable reached margin deg nearest to mm/s time s clear mm"
    assert " ".join(text.splitlines()[2].split()) == head
    narrow = cells_text(record, width=60)
    assert "columns left out at this width, see cells.json: nearest to" in narrow


def test_the_folder_holds_the_record_and_a_page_with_the_same_figures(compared: CellComparison, tmp_path: Path) -> None:
    assert save(compared, tmp_path / "out") == (record := record_cells(compared))

    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["cells.json", "manifest.json", "report.html"]
    assert read_record(tmp_path / "out" / "cells.json", CellsRecord) == record
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert f"{record.cells[0].duration_s:.1f}" in page
    assert "Not printable" in page
    with pytest.raises(UsageError, match="out exists; choose another"):
        save(compared, tmp_path / "out")


@pytest.mark.parametrize(
    ("cells", "keys", "said"),
    [
        (["irb120-bent45"], {}, "names 1 cell: give two or more that differ"),
        (["irb120-bent45", "irb120-bent45"], {}, "names 1 cell"),
        (["irb120-bent45", "irb120-slim45"], {"robot": False}, "omit `--no-robot`"),
    ],
)
def test_what_cannot_be_compared_is_refused(cells: list[str], keys: dict[str, object], said: str) -> None:
    job = job_of(surface=PLATE, unit="mm", place="demo", **DISC, **keys)
    with pytest.raises(UsageError, match=said):
        compare_cells(job, [Path(name) for name in cells])


def test_where_no_cell_can_be_used_the_last_reason_is_raised(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"the cell file .*gone\.toml does not exist"):
        compare_cells(
            job_of(surface=PLATE, unit="mm", place="demo", **DISC), [tmp_path / "none.toml", tmp_path / "gone.toml"]
        )
