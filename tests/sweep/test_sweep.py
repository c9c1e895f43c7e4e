"""A study plans each of its cells once, says of each what became of it, and goes on after any stop."""

from __future__ import annotations

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from geoprint import plan
from geoprint.errors import InputError, UsageError
from geoprint.geometry.files import save_ply
from geoprint.sweep import StudyCell, read_study
from geoprint.sweep.report import save_study_table, study_page
from geoprint.sweep.running import CELLS, Limits, ending_of, outcomes, run_cell, run_study
from tests.commands import called
from tests.meshes import plate

STUDY = """\
parts = ["parts"]
unit = "mm"
backends = ["lscm", "heat"]
[job]
robot = false
[[settings]]
name = "fine"
spacing = 3.0
[[settings]]
name = "coarse"
spacing = 4.0
"""
PATIENCE = 120.0


@pytest.fixture
def study(tmp_path: Path) -> Path:
    (tmp_path / "parts").mkdir()
    save_ply(plate((16.0, 12.0)), tmp_path / "parts" / "a.ply")
    save_ply(plate((20.0, 12.0)), tmp_path / "parts" / "b.ply")
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path / "study.toml"


@pytest.fixture
def coarse(study: Path) -> Path:
    """The study at the wide spacing alone: each of its four cells is planned in a process that imports for seconds."""
    fine = '[[settings]]\nname = "fine"\nspacing = 3.0\n'
    study.write_text(STUDY.replace(fine, ""))
    return study


def table(folder: Path) -> list[dict[str, str]]:
    return list(csv.DictReader((folder / "study.csv").read_text().splitlines()))


def test_every_part_meets_every_way_and_each_has_a_name_of_its_own(study: Path) -> None:
    cells = read_study(study).cells
    assert [cell.name for cell in cells] == [
        f"{part}_{setting}_{backend}" for part in "ab" for setting in ("fine", "coarse") for backend in ("lscm", "heat")
    ]
    assert [cell.job.spacing for cell in cells[:4]] == [3.0, 3.0, 4.0, 4.0]
    (study.parent / "more").mkdir()
    save_ply(plate((16.0, 12.0)), study.parent / "more" / "a.ply")
    study.write_text(STUDY.replace('["parts"]', '["parts/*.ply", "more"]'))
    names = [cell.name for cell in read_study(study).cells]
    assert len(set(names)) == len(names) == 12
    assert "parts-a.ply_fine_lscm" in names


def test_parts_come_from_a_column_and_patches_from_sites(study: Path) -> None:
    (study.parent / "cohort.csv").write_text("id,mesh\n1,parts/b.ply\n2,parts/a.ply\n")
    study.write_text(
        STUDY.replace('parts = ["parts"]\n', "").replace(
            "[job]", '[table]\nfile = "cohort.csv"\ncolumn = "mesh"\n[job]'
        )
        + '[[sites]]\nname = "middle"\nat = [8.0, 6.0, 0.0]\nradius = 4.0\n'
    )
    cells = read_study(study).cells
    assert [cell.name for cell in cells[::4]] == ["b_middle_fine_lscm", "a_middle_fine_lscm"]
    assert cells[0].job.patches[0].radius == 4.0


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("unit", "units", r"study.toml, line 2: units: there is no such key"),
        ('["parts"]', '["gone/*.stl"]', r"no part is found under 'gone/\*\.stl'"),
        ("spacing = 4.0", "spacng = 4.0", r"study.toml: the cell a_coarse_lscm: spacng: there is no such key"),
        ('name = "coarse"', 'name = "fine"', r"each of the settings needs a `name` of its own, found fine, fine"),
        ('parts = ["parts"]', "", r"a study names its parts"),
        ('["parts"]', '["/gone/*.stl"]', r"parts: /gone/\*\.stl does not exist"),
        ("robot = false", 'robot = false\npattern = "spiral"', r"pattern stands in the study itself"),
        ('name = "coarse"', 'name = "Fine"', r"two cells are called a_Fine_lscm"),
    ],
)
def test_a_study_that_cannot_be_is_refused_before_anything_is_planned(
    study: Path, old: str, new: str, sentence: str
) -> None:
    study.write_text(STUDY.replace(old, new, 1))
    with pytest.raises((UsageError, InputError), match=sentence):
        read_study(study)


def test_parts_of_one_name_but_for_blanks_are_refused_and_files_are_found_from_the_study(study: Path) -> None:
    save_ply(plate((16.0, 12.0)), study.parent / "parts" / "a 1.ply")
    save_ply(plate((16.0, 12.0)), study.parent / "parts" / "a-1.ply")
    with pytest.raises(UsageError, match=r"two cells are called a-1_fine_lscm, of the parts parts/a 1\.ply and"):
        read_study(study)
    (study.parent / "parts" / "a-1.ply").unlink()
    study.write_text(STUDY.replace("robot = false", 'robot = false\nbody = "body.ply"\ncell = "irb120-bent45"'))
    job = read_study(study).cells[0].job
    assert job.body == study.parent / "body.ply"
    assert str(job.cell) == "irb120-bent45"


@pytest.mark.slow
def test_a_study_with_a_cell_goes_on_and_a_corrected_one_plans_what_was_refused(study: Path, tmp_path: Path) -> None:
    text = STUDY.replace("robot = false", 'robot = false\ncell = "irb120-bent45"').replace(
        "spacing = 4.0", "spacing = 50.0"
    )
    study.write_text(text.replace('["parts"]', '["parts/a.ply"]'))
    out = tmp_path / "out"
    for _ in range(2):
        run_study(read_study(study), out, workers=1)
    assert [outcome.status for outcome in outcomes(read_study(study), out)] == ["done", "done", "refused", "refused"]
    study.write_text(text.replace('["parts"]', '["parts/a.ply"]').replace("spacing = 50.0", "spacing = 4.0"))
    run_study(read_study(study), out, workers=1)
    assert [outcome.status for outcome in outcomes(read_study(study), out)] == ["done"] * 4
    save_ply(plate((18.0, 12.0)), study.parent / "parts" / "a.ply")
    with pytest.raises(UsageError, match=r"was planned from another job or part"):
        run_study(read_study(study), out, workers=1)


def test_a_cell_is_a_bundle_or_a_refusal_with_its_reason(study: Path, tmp_path: Path) -> None:
    cells = read_study(study).cells
    run_cell(cells[0], tmp_path / "one")
    assert (tmp_path / "one" / "manifest.json").is_file()
    too_wide = replace(cells[0], job=cells[0].job.model_copy(update={"spacing": 50.0}))
    run_cell(too_wide, tmp_path / "two")
    assert not (tmp_path / "two").exists()
    assert '"status": "refused"' in (tmp_path / "two.refused.json").read_text()


def test_a_reason_names_files_as_every_machine_does(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (cell, *_) = read_study(study.relative_to(tmp_path)).cells

    def refuse(cell: StudyCell, _: Path) -> None:
        raise InputError(f"{cell.job.surface} is bad, and so is {cell.job.surface.resolve()}.")

    run_cell(cell, tmp_path / "one", work=refuse)
    assert ending_of(tmp_path / "one") == ("refused", "a.ply is bad, and so is a.ply.")


def test_what_makes_a_cell_can_be_anything(study: Path, tmp_path: Path) -> None:
    asked, out = read_study(study), tmp_path / "out"
    run_study(asked, out, workers=1, work=named_or_refused)
    assert (out / CELLS / "a_fine_lscm" / "name").read_text() == "a_fine_lscm"
    ended = [ending_of(out / CELLS / cell.name) for cell in asked.cells]
    assert ended == [("done", "")] * 4 + [("refused", "b is not wanted here.")] * 4


def named_or_refused(cell: StudyCell, place: Path) -> None:
    """Write the name of a cell into its folder; one part is refused."""
    if cell.part.endswith("b.ply"):
        raise InputError("b is not wanted here.")
    place.mkdir()
    (place / "name").write_text(cell.name)


@pytest.mark.slow
def test_shares_give_the_files_of_the_whole_and_nothing_is_planned_twice(coarse: Path, tmp_path: Path) -> None:
    asked, whole, shared = read_study(coarse), tmp_path / "whole", tmp_path / "shared"
    run_study(asked, whole, workers=2)
    save_study_table(outcomes(asked, whole), whole)
    for number in (1, 2, 3):
        run_study(asked, shared, cells=asked.shard(number, 3), workers=1)
    save_study_table(outcomes(asked, shared), shared)
    files = [path.relative_to(whole) for path in whole.rglob("*") if path.is_file() and path.name != "timings.json"]
    assert len(files) > 20
    assert all((whole / file).read_bytes() == (shared / file).read_bytes() for file in files)
    rows = table(whole)
    assert {row["status"] for row in rows} == {"done"}
    planned = plan(asked.cells[0].job)
    assert int(rows[0]["runs"]) == planned.toolpath.curves.count
    assert planned.uniformity is not None
    assert float(rows[0]["thickness_cv"]) == pytest.approx(planned.uniformity.thickness.cv, abs=1e-5)
    before = {path: path.stat().st_mtime_ns for path in whole.rglob("*")}
    run_study(asked, whole, workers=2)
    assert {path: path.stat().st_mtime_ns for path in whole.rglob("*")} == before


@pytest.mark.slow
def test_a_cell_that_takes_too_long_is_a_row_until_it_is_tried_again(coarse: Path, tmp_path: Path) -> None:
    coarse.write_text(coarse.read_text().replace('["parts"]', '["parts/a.ply"]'))
    asked, out = read_study(coarse), tmp_path / "out"
    run_study(asked, out, workers=2, limits=Limits(seconds=0.2))
    found = list(outcomes(asked, out))
    assert {outcome.status for outcome in found} == {"failed"}
    assert all("it took longer than the 0.2 s that a cell may take" in outcome.reason for outcome in found)
    run_study(asked, out, workers=2)
    assert {outcome.status for outcome in outcomes(asked, out)} == {"failed"}
    run_study(asked, out, workers=2, retry=True)
    assert {outcome.status for outcome in outcomes(asked, out)} == {"done"}
    assert not list((out / CELLS).glob("*.refused.json"))


@pytest.mark.slow
def test_a_study_that_is_killed_goes_on_where_it_was(coarse: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "geoprint", "sweep", str(coarse), "--out", str(tmp_path / "out")]
    for cells in (1, 2):
        process = subprocess.Popen(command, start_new_session=True, stderr=subprocess.DEVNULL)
        ends = time.monotonic() + PATIENCE
        while len(list((tmp_path / "out" / CELLS).glob("[!.]*"))) < cells and process.poll() is None:
            assert time.monotonic() < ends
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    subprocess.run(command, check=True)
    asked = read_study(coarse)
    assert [row["status"] for row in table(tmp_path / "out")] == ["done"] * len(asked.cells)
    left = [path.name for path in (tmp_path / "out" / CELLS).iterdir() if path.name.startswith(".")]
    assert left == []


def test_an_edited_study_is_not_mixed_with_what_stands_there(study: Path, tmp_path: Path) -> None:
    asked = read_study(study)
    run_cell(asked.cells[0], tmp_path / "out" / CELLS / asked.cells[0].name)
    study.write_text(STUDY.replace("spacing = 3.0", "spacing = 2.5"))
    with pytest.raises(UsageError, match=r"was planned from another job or part than the study asks for"):
        run_study(read_study(study), tmp_path / "out")


def test_the_command_says_what_is_missing(
    study: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for options, sentence in (
        ([], "`--out` is missing"),
        (["--out", "o", "--shard", "4/3"], "`--shard 4/3`: give a share as 3/200"),
        (["--out", "o", "--scheduler", "tcp://x", "--workers", "2"], "are of this machine: omit them"),
    ):
        assert called(monkeypatch, "sweep", study, *options) == 2
        assert re.search(re.escape(sentence), capsys.readouterr().err)


def test_the_page_has_medians_dots_the_worst_and_what_failed(study: Path, tmp_path: Path) -> None:
    study.write_text(STUDY.replace("spacing = 4.0", "spacing = 50.0").replace('["lscm", "heat"]', '["heat"]'))
    asked, out = read_study(study), tmp_path / "out"
    for cell in asked.cells:
        run_cell(cell, out / CELLS / cell.name)
    text = study_page(list(outcomes(asked, out)), name="study.toml").decode()
    assert "4 cells: 2 done, 2 refused." in text
    assert '<th scope="row">fine, heat</th><td>2</td>' in text
    assert text.count('href="cells/') == 2
    assert text.count("<img ") == 1
    (reason,) = re.findall(r'<th scope="row">2</th><td>refused</td><td>([^<]*)</td><td>a_coarse_heat</td>', text)
    assert "50" in reason


def test_diff_tells_settings_figures_and_paths_apart(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = read_study(study)
    one, other = tmp_path / "one" / CELLS, tmp_path / "other" / CELLS
    for cell in asked.cells[:2]:
        run_cell(cell, one / cell.name)
        run_cell(cell, other / cell.name)
    run_cell(asked.cells[2], other / asked.cells[2].name)
    assert called(monkeypatch, "diff", tmp_path / "one", tmp_path / "other") == 0
    assert capsys.readouterr().out.splitlines() == [
        "a_fine_heat: the same", "a_fine_lscm: the same", "only in the second: a_coarse_lscm"
    ]  # fmt: skip
    assert called(monkeypatch, "diff", one / "a_fine_lscm", other / "a_coarse_lscm", "--json") == 0
    (found,) = json.loads(capsys.readouterr().out)["plans"]
    changed = {change["key"]: (change["first"], change["second"]) for change in found["settings"]}
    assert changed == {"spacing_mm": (3.0, 4.0)}
    assert found["same_part"]
    assert 0.4 < found["largest_apart_mm"] < 4.0
    assert called(monkeypatch, "diff", tmp_path / "one", one / "a_fine_lscm") == 3
    assert "have no plan of one name: a_fine_heat, a_fine_lscm there, one plan here" in capsys.readouterr().err
