"""Hostile files and names: refused in one sentence, or harmless in everything that is written."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from os import mkfifo
from pathlib import Path

import pytest

from geoprint.config import job_of
from geoprint.errors import InputError
from geoprint.geometry import inspect, prepare
from geoprint.geometry.files import load, save_ply, unit_hint
from geoprint.reporting import inspection_text
from geoprint.results import FileInspection
from geoprint.workflow import plan
from geoprint.workflow.workpiece import printed_side
from tests import meshes
from tests.commands import called
from tests.geometry.files.hostile_inputs import CASES, EXPECTED, check, planned_in_turn
from tests.meshes import plate
from tests.shared_data import shared

# Markup, quotes, shell and RAPID signs, formats and mathematics; a slash cannot stand in a name.
NASTY = "a <script>alert(1)<b>\"'`&amp;%s{0}$x$!;\\ENDMODULE.ply"


def test_every_crafted_case_has_an_expected_outcome() -> None:
    shared("broken/crafted_cases.json")
    assert set(json.loads(CASES.read_text())["cases"]) == set(EXPECTED)


@pytest.mark.parametrize("name", EXPECTED)
def test_a_crafted_case_is_refused_or_repaired_as_expected(name: str) -> None:
    path = shared(f"broken/{name}")
    status, words = EXPECTED[name]
    if status == InputError.exit_status:
        with pytest.raises(InputError) as caught:
            prepare(load(path, unit="mm"))
        assert words in str(caught.value)
        return
    prepared, report = prepare(load(path, unit="mm"))
    record = (
        *report.repairs.changes(),
        str(unit_hint(prepared, unit="mm")),
        "written and verified",
        printed_side(prepared, None, flip=False)[1].sentence,
    )
    assert any(words in sentence for sentence in record)


def test_a_process_with_little_memory_and_time_is_enough(tmp_path: Path) -> None:
    names = ["x_count_too_large.stl", "x_zip_200MB_zeros.zip", "x_pinhole.ply"]
    outs = [tmp_path / name for name in names]
    found = planned_in_turn([shared(f"broken/{name}") for name in names], "--unit", "mm", outs=outs)
    for name, outcome, out in zip(names, found, outs, strict=True):
        check(name, outcome, out)


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str]]:
    def call(*arguments: object) -> tuple[int, str]:
        status = called(monkeypatch, *arguments)
        return status, capsys.readouterr().err

    return call


def test_a_nasty_file_name_is_harmless_in_every_file_that_is_written(
    run: Callable[..., tuple[int, str]], tmp_path: Path
) -> None:
    save_ply(meshes.plate((8.0, 6.0), (4, 3), jitter_seed=1), tmp_path / NASTY)
    out = tmp_path / "out"
    arguments = ("--unit", "mm", "--rounds", "2", "--place", "demo", "--backend", "heat", "--out", out)
    status, record = run("compare", tmp_path / NASTY, *arguments)
    assert status == 0, record
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "<script>a" not in page
    assert "alert" not in page or "&lt;script&gt;a" in page
    assert json.loads((out / "heat" / "plan.json").read_text())["input"]["name"] == NASTY
    for module in (out / "heat" / "rapid").glob("*.mod"):
        lines = module.read_text(encoding="ascii").splitlines()
        naming = [line.strip() for line in lines if "ENDMODULE" in line.upper() and line.strip() != "ENDMODULE"]
        # The name stands in comments alone, which end with their line.
        assert all(line.startswith("!") for line in naming)


@pytest.mark.parametrize("folder", ["red\x1b[31m", "turned\u202e", "title\x1b]0;owned\x07"])
def test_control_characters_of_a_folder_do_not_reach_the_terminal(
    run: Callable[..., tuple[int, str]], tmp_path: Path, folder: str
) -> None:
    status, record = run("inspect", tmp_path / folder / "absent.ply")
    assert status == InputError.exit_status
    assert "does not exist" in record
    assert record.rstrip("\n").isprintable()


def test_control_characters_of_a_file_do_not_reach_the_terminal(
    run: Callable[..., tuple[int, str]], tmp_path: Path
) -> None:
    (tmp_path / "part.obj").write_bytes(b"v 0 0 0\nv 1 0 0\nv 0 1 \x1b[31m0\nf 1 2 3\n")
    status, record = run("inspect", tmp_path / "part.obj", "--unit", "mm")
    assert (status, record.rstrip("\n").isprintable()) == (3, True)


def test_references_to_other_files_are_not_followed(tmp_path: Path) -> None:
    (tmp_path / "part.obj").write_text("mtllib /dev/zero\nmtllib ../x.mtl\nv 0 0 0\nv 20 0 0\nv 0 20 0\nf 1 2 3\n")
    save_ply(meshes.plate(), tmp_path / "part.ply")
    textured = (
        (tmp_path / "part.ply")
        .read_bytes()
        .replace(b"element vertex", b"comment TextureFile /dev/zero\nelement vertex")
    )
    (tmp_path / "part.ply").write_bytes(textured)
    assert len(load(tmp_path / "part.obj", unit="mm").faces) == 1
    assert len(load(tmp_path / "part.ply", unit="mm").faces) == len(meshes.plate().faces)


def test_a_memory_limit_ends_in_status_six(tmp_path: Path) -> None:
    # All of it is a hole, which takes no place on the disc; in memory it takes 2 GiB.
    with (tmp_path / "huge.stl").open("wb") as file:
        file.truncate(1 << 31)
    command = [sys.executable, "-m", "geoprint", "plan", str(tmp_path / "huge.stl"), "--out", str(tmp_path / "out")]
    options = ["--unit", "mm", "--no-robot", "--max-memory", "1.5"]
    done = subprocess.run([*command, *options], capture_output=True, text=True, check=False)
    assert (done.returncode, "Traceback" in done.stderr) == (6, False), done.stderr
    assert "out of memory" in done.stderr


def test_a_memory_limit_below_what_every_run_takes_is_refused(run: Callable[..., tuple[int, str]]) -> None:
    status, record = run("inspect", "part.ply", "--max-memory", "0.1")
    assert (status, "less than the 1.5 GB" in record) == (2, True)


def test_the_doctor_names_what_it_could_not_look_at() -> None:
    from dataclasses import replace

    found = replace(inspect(meshes.plate()), crossings_complete=False)
    seen = FileInspection("plate.ply", "mm", False, None, (0.0, 0.0, 0.0), (40.0, 30.0, 0.0), found, (), "", None, ())  # noqa: FBT003
    assert "not checked: crossings between all pairs of faces" in inspection_text(seen)


@pytest.mark.parametrize("option", ["surface", "body"])
def test_a_pipe_is_refused_before_it_is_read(tmp_path: Path, option: str) -> None:
    mkfifo(tmp_path / "pipe.ply")
    save_ply(plate((16.0, 12.0), (12, 9)), tmp_path / "part.ply")
    files = {"surface": tmp_path / "part.ply"} | {option: tmp_path / "pipe.ply"}
    with pytest.raises(InputError, match="a pipe or a device; plain files"):
        plan(job_of(**files, unit="mm", spacing=2.0, robot=False))
