"""Programs of every kind before a judge from outside, which knows nothing of geoprint: no error."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of, packaged_cell_text
from geoprint.model import Cell, Flood, Placement, PoseStream, Program, Purge, Signals
from geoprint.postprocessor.rapid import program as rapid
from geoprint.workflow import plan
from tests.postprocessor.export_cases import CELL, DEMONSTRATION, PLACEMENT, orders, proven_program, stream, tips_of
from tests.postprocessor.rapid.language.test_names import OLD_GUARD
from tests.shared_data import shared

ANALOG = Signals(mode="analog", dispenser="doValve", uv_lamp="doUV", flow="aoFlow", flow_per_mm3_s=0.1, flow_lag=0.04)
ABOVE = np.zeros(6)
CELLS = {
    "io": CELL,
    "analog": replace(CELL, signals=ANALOG),
    "vacuum": replace(CELL, signals=replace(CELL.signals, vacuum="doVacuum")),
    "purge": replace(CELL, purge=Purge(joints=ABOVE, duration=2.0)),
    "purge, analog": replace(CELL, signals=ANALOG, purge=Purge(joints=ABOVE, duration=2.0)),
    "flood": replace(CELL, flood=Flood(60.0, joints=ABOVE)),
    "flood by hand": replace(CELL, flood=Flood(60.0)),
    "everything": replace(
        CELL,
        signals=replace(ANALOG, vacuum="doVacuum"),
        purge=Purge(joints=ABOVE, duration=2.0),
        flood=Flood(60.0, joints=ABOVE),
    ),
}


def errors(program: Program, folder: Path) -> list[dict[str, object]]:
    """What the judge calls an error in a program that lies in a folder."""
    judge = shared("../checks/rapid_lint.py")
    for name, text in program.modules:
        (folder / name).write_text(text, encoding="ascii")
    ran = subprocess.run(
        [sys.executable, str(judge), str(folder), "--json"], capture_output=True, text=True, check=False
    )
    found = json.loads(ran.stdout)
    wrong = [finding for finding in found if finding["level"] == "error"]
    assert ran.returncode == int(bool(wrong)), ran.stderr
    assert sum(finding["code"] == "module" for finding in found) >= 3
    return wrong


def written(cell: Cell, placement: Placement, poses: PoseStream | None = None) -> Program:
    poses = stream() if poses is None else poses
    within = 0.2 if placement.calibrated else None
    return proven_program(
        orders(poses, placement), cell=cell, placement=placement, surface_within=within, tips_at=tips_of(poses),
        part_name="rings", spacing=2.0,
    )[0]  # fmt: skip


@pytest.mark.parametrize("placement", [PLACEMENT, DEMONSTRATION], ids=["calibrated", "demo"])
@pytest.mark.parametrize("name", CELLS)
def test_no_kind_of_program_has_an_error(name: str, placement: Placement, tmp_path: Path) -> None:
    assert errors(written(CELLS[name], placement), tmp_path) == []


@pytest.mark.parametrize("placement", [PLACEMENT, DEMONSTRATION], ids=["calibrated", "demo"])
def test_a_program_of_several_modules_has_no_error(
    placement: Placement, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rapid, "MODULE_LINES", 55)
    program = written(CELL, placement, stream(runs=5, points=9))
    assert sum(name.startswith("GeoPath") for name, _ in program.modules) == 3
    assert errors(program, tmp_path) == []


def test_the_judge_refuses_the_guard_as_it_was(tmp_path: Path) -> None:
    guard = OLD_GUARD.replace("ENDMODULE\n", "")
    modules = tuple(
        (name, text.replace("MODULE GeoGuard\n  !", f"{guard}  !") if name == "GeoGuard.mod" else text)
        for name, text in written(CELL, PLACEMENT).modules
    )
    found = errors(Program(modules, targets=18, dry_run=False), tmp_path)
    assert any(finding["code"] == "duplicate" for finding in found)


@pytest.mark.parametrize(
    ("part", "mode", "spacing"),
    [("patches/tricuspid_leaflet_disc_r6.ply", "io", 2.0), ("patches/lv_lateral_disc_r15.ply", "analog", 5.0)],
)
def test_programs_for_real_parts_have_no_error(part: str, mode: str, spacing: float, tmp_path: Path) -> None:
    text = packaged_cell_text("irb120-bent45").replace('mode = "io"', f'mode = "{mode}"')
    for key in ("flow", "flow_per_mm3_s", "vacuum"):
        text = text.replace(f"# {key} =", f"{key} =")
    (tmp_path / "cell.toml").write_text(text)
    job = job_of(surface=shared(part), unit="mm", spacing=spacing, cell=tmp_path / "cell.toml", place="demo")
    (robot,) = plan(job).robot
    (tmp_path / "rapid").mkdir()
    assert errors(robot.program, tmp_path / "rapid") == []
