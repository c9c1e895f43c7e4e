"""A bundle is all that is needed to make it again: the same bytes, or a sentence why not."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

import geoprint
from geoprint.errors import InputError, VerificationError
from geoprint.workflow import plan, save_plan
from tests.commands import called


def contents(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != "timings.json")
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def test_a_bundle_is_planned_again_to_the_same_bytes_without_the_files_that_it_was_of(
    printed: Path, tmp_path: Path
) -> None:
    save_plan(plan(geoprint.job_from(printed)), tmp_path / "again")
    found, written = contents(tmp_path / "again"), contents(printed)
    assert found.keys() == written.keys()
    assert {"manifest.json", "job.toml", "part.ply", "body.ply", "cell/own cell.toml"} < written.keys()
    assert [name for name in written if found[name] != written[name]] == []
    assert b"plate.obj" in written["rapid/GeoPrint.mod"]
    assert json.loads(written["plan.json"])["input"]["name"] == "plate.obj"


def test_seconds_stand_beside_the_manifest(printed: Path) -> None:
    listed = json.loads((printed / "manifest.json").read_text())["sha256"]
    assert "timings.json" not in listed
    assert "plan.json" in listed
    timings = json.loads((printed / "timings.json").read_text())
    assert set(timings) == {"timings_s", "peak_memory_mb"}
    assert "timings_s" not in json.loads((printed / "plan.json").read_text())


def assert_same_but_for_the_manifest(found: dict[str, bytes], written: dict[str, bytes]) -> None:
    """A backend of a comparison has its hashes in the manifest of the comparison, a plan of its own in its own."""
    assert found.keys() - written.keys() == {"manifest.json"}
    assert [name for name in written if found[name] != written[name]] == []


@pytest.mark.usefixtures("brief_proofs")
def test_a_backend_of_a_comparison_is_planned_again_on_the_surface_of_all_of_them(
    compared: Path, tmp_path: Path
) -> None:
    # Rounds are given, so that the surface depends on who estimates them; nothing prints, and all of it stays.
    # The command below plans the other backend again.
    save_plan(plan(geoprint.job_from(compared / "lscm")), tmp_path / "lscm")
    assert_same_but_for_the_manifest(contents(tmp_path / "lscm"), contents(compared / "lscm"))
    record = json.loads((compared / "lscm" / "plan.json").read_text())
    assert record["robot"] == []
    assert "out of reach" in record["not_printable"]


def test_a_change_of_the_job_counts(printed: Path) -> None:
    job = geoprint.job_from(printed, spacing=1.25)
    assert (job.spacing, job.backend, job.patches[0].radius) == (1.25, "fast-marching", 5.0)


@pytest.mark.parametrize("name", ["job.toml", "part.ply", "body.ply", "cell/own cell.toml"])
def test_what_was_changed_is_not_planned_again(copy: Path, name: str) -> None:
    with (copy / name).open("ab") as handle:
        handle.write(b"\n")
    with pytest.raises(VerificationError, match=rf"{name}: the file was changed after it was written.*restore it"):
        geoprint.job_from(copy)


def test_a_folder_that_is_no_bundle_is_refused(copy: Path, compared: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"there is no folder"):
        geoprint.job_from(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"no single bundle, but several; name one of them, .*heat or .*lscm"):
        geoprint.job_from(compared)
    listed = json.loads((copy / "manifest.json").read_text())
    del listed["sha256"]["job.toml"]
    (copy / "manifest.json").write_text(json.dumps(listed))
    with pytest.raises(InputError, match=r"was written by geoprint .*, which did not keep the job"):
        geoprint.job_from(copy)


@pytest.mark.usefixtures("brief_proofs")
def test_the_command_says_whether_the_bytes_are_the_same(
    compared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    heat = Path(shutil.copytree(compared, tmp_path / "copy")) / "heat"
    out = tmp_path / "out"
    assert called(monkeypatch, "plan", "--from", heat, "--out", out) == 0
    said = capsys.readouterr().err
    assert "no program: the robot cannot print this: " in said
    assert f"planned again from {heat}: all files have the same bytes" in said
    # Only `plan` writes a report of one plan.
    (out / "report.html").unlink()
    assert_same_but_for_the_manifest(contents(out), contents(heat))
    record = json.loads((heat / "plan.json").read_text())
    (heat / "plan.json").write_text(json.dumps({**record, "version": "0.0.1"}))
    assert called(monkeypatch, "plan", "--from", heat, "--no-robot", "--out", out, "--overwrite") == 0
    assert "with another robot: " in capsys.readouterr().err
    assert called(monkeypatch, "plan", "part.ply", "--from", heat, "--out", out) == 2
    assert called(monkeypatch, "plan", "--out", out) == 2
    assert capsys.readouterr().err.count("give a part or a job file, or `--from` a bundle") == 2


def test_another_version_is_named_where_bytes_differ() -> None:
    from geoprint.reporting import again_text

    said = again_text("old", written_by="0.0.1", differing=["plan.json"], changed=[])
    assert said.startswith("warning: planned again from old, but 1 files differ (plan.json")
    assert "geoprint 0.0.1 wrote that one, this is " in said
