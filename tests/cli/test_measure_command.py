"""`geoprint measure` as a person meets it: a table, files on demand, one sentence where something is wrong."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from geoprint.cli.terminal import fitted
from geoprint.geometry.files import save_ply
from geoprint.reporting import MeasurementRecord, read_record
from tests.commands import called, printed_with
from tests.meshes import plate

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("measure")
    save_ply(plate((40.0, 30.0), (20, 15)), folder / "plate.ply")
    # Rows that cover the plate, the same with every second one off, and some that cover half of it.
    for name, first, count, shift in (
        ("even.csv", 1.0, 15, 0.0),
        ("shifted.csv", 1.0, 15, 0.2),
        ("half.csv", 2.0, 7, 0.0),
    ):
        rows = [f"{x},{first + 2.0 * k + shift * (k % 2)},0,{k}" for k in range(count) for x in (0, 40)]
        (folder / name).write_text("\n".join(["x,y,z,run", *rows, ""]), encoding="utf-8")
    (folder / "above.csv").write_text("x,y,z\n0,5,1\n40,5,1\n", encoding="utf-8")
    (folder / "odd.csv").write_text("x,y,z\n0,5,1\n40,five,1\n", encoding="utf-8")
    return folder


@pytest.fixture
def run(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    def call(line: str) -> tuple[int, str, str]:
        monkeypatch.chdir(folder)
        status = called(monkeypatch, "measure", *line.split())
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return call


PART = "--part plate.ply --unit mm --spacing 2"


def percent(cell: str) -> float:
    return float(cell.rstrip("%"))


def test_several_files_stand_in_one_table_and_nothing_is_written(run: Run, folder: Path) -> None:
    before = sorted(folder.iterdir())
    status, stdout, stderr = run(f"even.csv shifted.csv half.csv {PART}")
    assert (status, stderr) == (0, "")
    heading, _, *rows = stdout.splitlines()[2:7]
    names = re.split(r"\s{2,}", heading)
    even, shifted, half = (dict(zip(names, re.split(r"\s{2,}", row), strict=True)) for row in rows)
    assert even["file"] == "even.csv"
    assert percent(even["thickness CV"]) < 0.5
    assert even["following CV"] == even["thickness CV"]
    # In print each run moves and flows as it likes.
    assert 1.5 < percent(even["printed CV"].split()[0]) < 3.0
    assert re.fullmatch(r"\d\.\d % \(\d\.\d-\d\.\d\)", even["printed CV"])
    assert (even["spacing"], even["spacing CV"]) == ("1.000", "0.00 %")
    assert (even["once"], even["gap"], even["overlap"], even["hole mm2"]) == ("100.00 %", "0.00 %", "0.00 %", "0.00")
    # Rows 1.8 and 2.2 mm apart in turn: a layer spreads some of it.
    assert (shifted["spacing"], shifted["spacing CV"]) == ("1.000", "10.00 %")
    assert percent(shifted["thickness CV"]) == pytest.approx(4.2, abs=0.3)
    assert shifted["once"] == "100.00 %"
    # Of 30 mm, 0.9 at one rim and 14.9 at the other are farther than 1.1 mm from every row.
    assert percent(half["gap"]) == pytest.approx(52.67, abs=0.2)
    assert percent(half["once"]) == pytest.approx(47.33, abs=0.2)
    assert float(half["hole mm2"]) == pytest.approx(14.9 * 40.0, rel=0.01)
    # With as much as would cover all of it left on about half, it is as uneven as a layer and none.
    assert percent(half["thickness CV"]) > 90.0
    assert "even.csv: no neighbour within three spacings along 6.7 % (left) and 6.7 %" in stdout
    assert "95 % interval in brackets; errors of the packaged cell, without a bent needle" in stdout
    assert sorted(folder.iterdir()) == before


def test_a_narrow_terminal_has_the_columns_that_decide(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("geoprint.cli.measuring.columns", lambda: 60)
    _, stdout, _ = run(f"even.csv {PART}")
    heading = stdout.splitlines()[2]
    assert len(heading) <= 60
    shown = [word in heading for word in ("thickness CV", "once", "gap", "overlap", "spacing CV", "length")]
    assert shown == [True, True, True, True, False, False]
    assert "columns left out at this width, see `--json` and `--out`: CPU s/m, off mm" in stdout
    assert fitted(heading, 60) == heading


def test_json_has_every_figure_and_the_time(run: Run) -> None:
    status, stdout, _ = run(f"shifted.csv {PART} --json")
    found = json.loads(stdout)
    (record,) = found["files"]
    assert status == 0
    assert found["timings"]["files"][0]["processor_s_per_m"] > 0.0
    even = record["uniformity"]
    assert even["left"]["spacing"]["cv"] == pytest.approx(0.1, abs=1e-6)
    assert even["right"]["none"] == pytest.approx(1.0 / 15.0, abs=1e-6)
    assert even["thickness"]["cv"] == pytest.approx(0.042, abs=0.003)
    assert even["printed"]["cv"] > even["thickness"]["cv"]
    assert "levels" not in even
    assert (record["format"], record["runs"], record["fit"]) == ("table", 15, None)
    assert json.loads(run(f"half.csv {PART} --json")[1])["files"][0]["uniformity"]["largest_hole_mm2"] > 400.0


def test_files_that_cover_alike_are_called_equal_and_where_none_covers_none_is_praised(run: Run, folder: Path) -> None:
    (folder / "again.csv").write_bytes((folder / "even.csv").read_bytes())
    assert "even.csv and again.csv cover plate.ply equally well." in run(f"even.csv again.csv {PART}")[1]
    said = run(f"even.csv shifted.csv again.csv {PART}")[1]
    assert "even.csv and again.csv cover plate.ply best of 3." in said
    (folder / "most.csv").write_bytes((folder / "half.csv").read_bytes())
    assert "No file covers plate.ply. The best, half.csv: 5" in run(f"half.csv most.csv {PART}")[1]


def test_a_folder_holds_page_picture_table_and_record(run: Run, folder: Path) -> None:
    status, stdout, stderr = run(f"even.csv shifted.csv {PART} --out told")
    assert status == 0, stderr
    assert "even.csv covers plate.ply best of 2." in stdout
    written = folder / "told"
    assert sorted(path.name for path in written.iterdir()) == [
        "manifest.json", "measure.csv", "measure.json", "measure.png", "report.html",
    ]  # fmt: skip
    record = read_record(written / "measure.json", MeasurementRecord)
    assert [row.file for row in record.files] == ["even.csv", "shifted.csv"]
    header, *rows = (written / "measure.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 2
    cells = dict(zip(header.split(","), rows[1].split(","), strict=True))
    assert (cells["left_cv"], cells["both_spacing_cv"]) == ("0.1", "0.1")
    assert float(cells["thickness_cv"]) == record.files[1].uniformity.thickness.cv
    assert "levels_spacing_cv" not in cells
    page = (written / "report.html").read_text(encoding="utf-8")
    assert "even.csv covers plate.ply best of 2." in page
    assert printed_with(written / "report.html")[0] == "irb120-bent45.toml"
    assert "unknown: only the paths are measured" in page
    varies = f"{100 * record.files[1].uniformity.thickness.cv:.2f}&nbsp;%"
    assert f"shifted.csv: with constant flow, layer thickness varies by {varies} (standard" in page
    assert "Distance from border or seed" not in page
    before = {path.name: path.read_bytes() for path in written.iterdir()}
    assert run(f"even.csv shifted.csv {PART} --out told")[0] == 2
    assert run(f"even.csv shifted.csv {PART} --out told --overwrite")[0] == 0
    assert {path.name: path.read_bytes() for path in written.iterdir()} == before


@pytest.mark.parametrize(
    ("line", "status", "complaint"),
    [
        (f"nowhere.csv {PART}", 3, "`nowhere.csv` does not exist; check the name"),
        (f"odd.csv {PART}", 3, "odd.csv, line 3, column y: found 'five', needed is a number of mm"),
        (f"above.csv {PART}", 3, "above.csv: the paths lie up to 1 mm off the part"),
        (f"even.csv {PART} --deposit M3", 0, ""),
        ("even.csv --part plate.ply --unit mm", 2, "give `--spacing`"),
        ("even.csv --part plate.ply --spacing 2", 2, "`plate.ply` has no unit"),
        ("even.csv --part nowhere.ply --unit mm --spacing 2", 3, "`nowhere.ply` does not exist; check the name"),
        ("even.csv --unit mm --spacing 2", 2, "needs `--part FILE`: mesh of the part that they cover; "),
        (f"even.csv {PART} --offset-up-to 0", 2, "it must be a positive number of mm"),
        (f"{PART}", 2, "`geoprint measure` needs `PATHS`: files of toolpaths; "),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(run: Run, line: str, status: int, complaint: str) -> None:
    ended, stdout, stderr = run(line)
    assert ended == status, stderr
    assert complaint in stderr
    assert status == 0 or stdout == ""
    assert "Traceback" not in stderr


def test_a_fit_says_what_it_moved(run: Run, folder: Path) -> None:
    text = (folder / "half.csv").read_text(encoding="utf-8").splitlines()
    rows = [line.split(",") for line in text[1:]]
    away = [f"{float(x) + 100},{y},{float(z) + 30},{k}" for x, y, z, k in rows]
    (folder / "away.csv").write_text("\n".join([text[0], *away, ""]), encoding="utf-8")
    status, stdout, stderr = run(f"away.csv {PART} --fit --json")
    assert status == 0, stderr
    fit = json.loads(stdout)["files"][0]["fit"]
    assert fit["residual_mm"] < 1e-3
    assert fit["before_mm"] > 60.0
    assert "away.csv: fitted to the part, turned by" in run(f"away.csv {PART} --fit")[1]
