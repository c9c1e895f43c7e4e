"""What a reader says beside its data reaches terminal, JSON and report page."""

from __future__ import annotations

import pickle
from pathlib import Path

from geoprint import job_of
from geoprint.geometry.files import save_ply
from geoprint.model import Reading, reading
from geoprint.reporting import as_json, measure_table, record_measurement
from geoprint.reporting.measurement_page import measure_report
from geoprint.workflow import measure_files
from tests.meshes import plate

GCODE = "M104 S200\nG28\nG0 X5 Y9 Z0\nM104 S190\nG1 X35 Y9 E1\nG0 X35 Y11\nG1 X5 Y11 E1\n"
SAID = (
    "read: 1 homing, 4 moves; skipped: 2 M104; assumed: E relative, from the first moves, dialect marlin, from E "
    "words or M-codes of printers"
)


def test_a_record_says_what_was_used_skipped_and_assumed() -> None:
    found = reading(used={"moves": 412, "arcs": 0}, skipped={"G4": 2, "M104": 31}, assumed=["mm", "mm"])
    assert found == Reading({"moves": 412}, {"M104": 31, "G4": 2}, ("mm",))
    assert found.text == "read: 412 moves; skipped: 31 M104, 2 G4; assumed: mm"
    assert reading(used={"faces": 8}).text == "read: 8 faces"
    one = reading(
        used={"vertices": 1}, skipped={"other labels": 1, "properties of `rows`": 1, "`edges`": 1, "GOTOs": 1}
    )
    assert one.text == "read: 1 vertex; skipped: 1 GOTOs, 1 `edges`, 1 other label, 1 property of `rows`"
    assert pickle.loads(pickle.dumps(found)) == found  # noqa: S301


def test_many_kinds_of_a_foreign_file_make_a_short_sentence() -> None:
    text = reading(used={"rows": 1}, skipped={f"column {i:02d} {'x' * 900}": 2 for i in range(50)}).text
    assert text.count("column") == 12
    assert text.endswith(", 76 of 38 other kinds")
    assert len(text) < 1000


def test_terminal_json_and_page_show_it(tmp_path: Path) -> None:
    save_ply(plate((40.0, 30.0), (8, 6)), tmp_path / "plate.ply")
    (tmp_path / "rows.gcode").write_text(GCODE, encoding="utf-8")
    found = measure_files(job_of(surface=tmp_path / "plate.ply", unit="mm", spacing=2.0), [tmp_path / "rows.gcode"])
    record = record_measurement(found)
    assert f"rows.gcode: {SAID}" in measure_table(record)
    assert as_json(record.files[0])["reading"] == {
        "used": {"homings": 1, "moves": 4},
        "skipped": {"M104": 2},
        "assumed": ["E relative, from the first moves", "dialect marlin, from E words or M-codes of printers"],
    }
    assert SAID in measure_report(found, record).decode("utf-8")
