"""`geoprint check`: with `--full` from end to end, of a comparison each bundle, of paths alone what there is."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geoprint.reporting import Checked, CheckedComparison, check_summary
from geoprint.reporting.stack_sheet import check_text
from geoprint.workflow import check_bundle, check_folder
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
    assert again.printing is not None
    assert again.dry is not None
    assert again.uniformity is not None
    record = json.loads((printed / "plan.json").read_text())
    clearance = record["robot"][0]["clearance"]
    assert again.printing.smallest == pytest.approx(clearance["smallest_mm"], abs=0.01)
    assert again.printing.arm_smallest == pytest.approx(clearance["arm_smallest_mm"], abs=0.01)
    assert again.printing.tip_margin == pytest.approx(clearance["tip_margin_mm"], abs=0.01)
    assert again.dry.smallest == pytest.approx(clearance["dry_run"]["smallest_mm"], abs=0.01)
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
    assert any("its hash is not that of the manifest" in reason for reason in reasons(checked, "body.ply"))
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
    assert f"{once:.2%} of the area covered once: as in plan.json" in " ".join(said.split())
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
    assert printed.err.count("as planned; holds no program: ") == 2

    (whole / "report.html").write_text("")
    (whole / "lscm" / "surface.ply").unlink()
    assert called(monkeypatch, "check", whole, "--json") == 5
    printed = capsys.readouterr()
    found = json.loads(printed.out)
    assert [one["file"] for one in found["findings"]] == ["report.html"]
    assert {one["bundle"]: one["agrees"] for one in found["bundles"]} == {"lscm": False, "heat": True}
    assert "lscm/surface.ply, line 1: " in printed.err
    assert "  report.html, line 1: the file was changed" in printed.err


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
    (whole / "manifest.json").write_text(json.dumps({"sha256": every}))
    (whole / "compare.json").write_text(json.dumps({**record, "parts": record["parts"] * 2}))
    checked = check_folder(whole)
    assert isinstance(checked, CheckedComparison)
    assert checked.findings == ()
    assert [name.partition("/")[0] for name, _ in checked.bundles] == ["plate"] * 2 + ["plate-2"] * 2
