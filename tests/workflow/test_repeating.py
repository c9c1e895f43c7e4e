"""`geoprint check`: with `--full` from end to end, of a comparison each bundle, of paths alone what there is."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import geoprint
from geoprint.errors import InputError, VerificationError
from geoprint.reporting import Checked, CheckedComparison, check_summary
from geoprint.reporting.run_sheet import check_text
from geoprint.results import Plan
from geoprint.workflow import check_bundle, check_folder, plan, save_plan
from tests.commands import called


def edited(path: Path, edit: Callable[[dict[str, Any]], None]) -> None:
    """Change a JSON file of a bundle, and its hash with it, as nobody does by mistake."""
    record = json.loads(path.read_text())
    edit(record)
    path.write_text(json.dumps(record))


def reasons(checked: Checked | CheckedComparison, file: str) -> list[str]:
    return [finding.reason for finding in checked.findings if finding.file == file]


def test_all_that_is_computed_once_more_is_what_the_plan_says(printed: Path) -> None:
    checked = check_bundle(printed, full=True)
    assert checked.findings == ()
    again = checked.repeated
    assert again is not None
    assert again.uniformity is not None
    record = json.loads((printed / "plan.json").read_text())
    clearance = record["robot"][0]["clearance"]
    assert again.smallest_mm == pytest.approx(clearance["smallest_mm"], abs=0.01)
    assert again.arm_smallest_mm == pytest.approx(clearance["arm_smallest_mm"], abs=0.01)
    assert again.tip_margin_mm == pytest.approx(clearance["tip_margin_mm"], abs=0.01)
    assert again.dry_run_smallest_mm == pytest.approx(clearance["dry_run"]["smallest_mm"], abs=0.01)
    assert again.uniformity.gap == pytest.approx(record["uniformity"]["gap"], abs=5e-4)
    said = " ".join(check_text(checked).split())
    assert (
        f"checked again {clearance['smallest_mm']:.2f} mm clear, {clearance['dry_run']['smallest_mm']:.2f} mm" in said
    )
    found: Any = check_summary(checked)
    assert found["repeated"]["smallest_mm"] == pytest.approx(clearance["smallest_mm"], abs=0.01)
    assert found["repeated"]["seconds"] > 0.0
    assert check_bundle(printed).repeated is None


def test_figures_that_are_not_those_of_the_bundle_are_found(copy: Path) -> None:
    def flatter(record: dict[str, Any]) -> None:
        clearance = record["robot"][0]["clearance"]
        for of, name in (
            (clearance, "smallest_mm"), (clearance, "arm_smallest_mm"), (clearance, "tip_margin_mm"),
            (clearance["dry_run"], "smallest_mm"),
        ):  # fmt: skip
            of[name] += 0.02
        record["uniformity"]["gap"] += 0.001
        record["uniformity"]["thickness"]["cv"] -= 0.001

    edited(copy / "plan.json", flatter)
    found = reasons(check_bundle(copy, full=True), "plan.json")
    for name in ("smallest_mm", "arm_smallest_mm", "tip_margin_mm", "dry_run.smallest_mm"):
        assert sum(reason.startswith(f"robot.1.clearance.{name} is ") for reason in found) == 1, name
    for name in ("gap", "thickness.cv"):
        assert sum(reason.startswith(f"uniformity.{name} is ") for reason in found) == 1, name
    # Without asking for it only the hash tells.
    assert len(reasons(check_bundle(copy), "plan.json")) == 1


def test_a_part_that_was_changed_is_found_by_its_hash_and_the_check_goes_on(copy: Path) -> None:
    content = bytearray((copy / "body.ply").read_bytes())
    start = content.index(b"end_header\n") + len(b"end_header\n")
    end = content.index(b"end_header\n") + len(b"end_header\n") + 24 * 25
    vertices = np.frombuffer(bytes(content[start:end])).reshape(-1, 3).copy()
    vertices[:, 2] += 0.3
    content[start:end] = vertices.tobytes()
    (copy / "body.ply").write_bytes(bytes(content))
    checked = check_bundle(copy, full=True)
    assert any("its hash differs from the manifest" in reason for reason in reasons(checked, "body.ply"))
    # Raised by 3 mm the table is where the needle goes.
    assert any("checked again: " in reason for reason in reasons(checked, "targets.csv"))
    assert checked.repeated is not None
    assert checked.repeated.uniformity is not None


def test_paths_alone_are_checked_and_said_to_hold_no_program(compared: Path, tmp_path: Path) -> None:
    heat = Path(shutil.copytree(compared, tmp_path / "whole")) / "heat"
    checked = check_bundle(heat, full=True)
    assert (checked.findings, checked.program) == ((), False)
    said = check_text(checked)
    assert said.startswith("PATHS ONLY  plate.ply  (heat)")
    assert "NONE: the robot cannot print it: " in said
    once = json.loads((heat / "plan.json").read_text())["uniformity"]["covered_once"]
    assert f"{100 * once:.2f} % of the area covered once: as in plan.json" in " ".join(said.split())
    rows = (heat / "poses.csv").read_text().split("\n")
    row = next(i for i, text in enumerate(rows[1:], start=1) if text.split(",")[3] == "1") + 3
    cells = rows[row].split(",")
    cells[6] = f"{float(cells[6]) + 0.05:.6f}"
    (heat / "poses.csv").write_text("\n".join([*rows[:row], ",".join(cells), *rows[row + 1 :]]))
    (found,) = (one for one in check_bundle(heat).findings if "off surface.ply" in one.reason)
    assert (found.file, found.line) == ("poses.csv", row + 1)
    assert "0.050 mm off surface.ply, allowed are 0.01 mm" in found.reason


def test_figures_of_paths_that_are_not_theirs_are_found(compared: Path, tmp_path: Path) -> None:
    heat = Path(shutil.copytree(compared, tmp_path / "whole")) / "heat"
    names = ("runs", "poses", "deposit_mm", "travel_mm")

    def more(record: dict[str, Any]) -> None:
        for name in names:
            record["paths"][name] += 1

    edited(heat / "plan.json", more)
    found = reasons(check_bundle(heat), "plan.json")
    for name in names:
        assert any(reason.startswith(f"paths.{name} is ") for reason in found), name


def test_a_comparison_is_checked_bundle_by_bundle_the_best_first(
    compared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = Path(shutil.copytree(compared, tmp_path / "whole"))
    assert called(monkeypatch, "check", whole, "--json") == 0
    printed = capsys.readouterr()
    found = json.loads(printed.out)
    assert found["agrees"] is True
    record = json.loads((whole / "compare.json").read_text())["parts"][0]
    order = [one["bundle"] for one in found["bundles"]]
    assert sorted(order) == ["heat", "lscm"]
    # Neither as they were asked for, nor by their names.
    assert order[0] == record["best"] == "lscm"
    assert [one["program"] for one in found["bundles"]] == [False] * 2
    assert called(monkeypatch, "check", whole) == 0
    assert capsys.readouterr().out.count("as planned; holds no program: ") == 2

    (whole / "report.html").write_text("")
    (whole / "lscm" / "surface.ply").unlink()
    assert called(monkeypatch, "check", whole, "--json") == 5
    printed = capsys.readouterr()
    found = json.loads(printed.out)
    assert [one["file"] for one in found["findings"]] == ["report.html"]
    assert {one["bundle"]: one["agrees"] for one in found["bundles"]} == {"lscm": False, "heat": True}
    assert called(monkeypatch, "check", whole) == 5
    said = capsys.readouterr().out
    assert "lscm/surface.ply, line 1: " in said
    assert "  report.html, line 1: the file was changed" in said


def test_parts_of_a_comparison_are_in_folders_of_their_own(compared: Path, tmp_path: Path) -> None:
    whole = tmp_path / "several"
    listed = json.loads((compared / "manifest.json").read_text())["sha256"]
    record = json.loads((compared / "compare.json").read_text())
    (whole / "plate").mkdir(parents=True)
    names = {name: digest for name, digest in listed.items() if "/" in name}
    for place in ("plate", "plate-2"):
        for backend in ("lscm", "heat"):
            shutil.copytree(compared / backend, whole / place / backend)
    every = {f"{place}/{name}": digest for place in ("plate-2", "plate") for name, digest in names.items()}
    several = json.dumps({**record, "parts": record["parts"] * 2}).encode()
    (whole / "compare.json").write_bytes(several)
    every |= {"compare.json": hashlib.sha256(several).hexdigest()}
    (whole / "manifest.json").write_text(json.dumps({"sha256": every}))
    checked = check_folder(whole)
    assert isinstance(checked, CheckedComparison)
    assert checked.findings == ()
    assert [name.partition("/")[0] for name, _ in checked.bundles] == ["plate"] * 2 + ["plate-2"] * 2
    assert check_text(checked).startswith("COMPARISON  several: 4 bundles, the best of a part first\n")
    assert check_text(replace(checked, bundles=checked.bundles[:1])).startswith("COMPARISON  several: 1 bundle\n")


# A bundle is all that is needed to make it again: the same bytes, or a sentence why not.


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


def test_seconds_stand_beside_the_manifest(printed: Path, printed_plan: Plan) -> None:
    listed = json.loads((printed / "manifest.json").read_text())["sha256"]
    assert "timings.json" not in listed
    assert "plan.json" in listed
    timings = json.loads((printed / "timings.json").read_text())
    assert set(timings) == {"timings_s", "peak_memory_mb"}
    assert [name for name, _ in printed_plan.timings].count("path") > 1
    # Each stage is rounded to a thousandth of a second.
    rounding = 0.0005 * len(timings["timings_s"]) + 1e-9
    took = sum(seconds for _, seconds in printed_plan.timings)
    assert sum(timings["timings_s"].values()) == pytest.approx(took, abs=rounding)
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
    with pytest.raises(InputError, match=r"several bundles; name one of them, .*heat or .*lscm"):
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
    said, noted = capsys.readouterr()
    assert "no program, the robot cannot print this: " in said
    assert f"replanned from {heat}: all files are identical" in noted
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
    from geoprint.reporting import replanned_text

    said = replanned_text("old", written_by="0.0.1", differing=["plan.json"], changed=[])
    assert said.startswith("warning: replanned from old, but 1 file differs (plan.json")
    assert "it was written by geoprint 0.0.1, this is " in said
