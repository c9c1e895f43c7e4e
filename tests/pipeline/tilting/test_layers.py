"""Layers over a tilting table: each is divided among attitudes in its turn, and has its own verified program."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from geoprint.account import StackRecord, check_text, stack_text
from geoprint.config import job_of
from geoprint.model import Surface
from geoprint.motion.arm import Arm
from geoprint.pipeline import check_folder, plan, plan_stack
from geoprint.pipeline.tilting import printing
from tests.pipeline.tilting.test_printing import cell, part


@pytest.fixture(scope="module", params=["heat", "lscm"])
def device(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, StackRecord]:
    folder = tmp_path_factory.mktemp("layers")
    job = job_of(
        surface=part(folder), unit="mm", spacing=3.0, backend=request.param, place="demo", cell=cell(folder),
        thickness=1.0,
    )  # fmt: skip
    return folder / "device", plan_stack(job, folder / "device")


@pytest.mark.dear
def test_each_layer_is_printed_in_attitudes_of_its_own_in_which_nothing_overhangs(
    device: tuple[Path, StackRecord],
) -> None:
    folder, told = device
    assert told.program is None
    assert len(told.layers) == 2
    for layer in told.layers:
        own = json.loads((folder / layer.folder / "plan.json").read_text())
        assert layer.attitudes is not None
        assert layer.attitudes == len(own["robot"]) > 1
        assert own["overhang"]["table"]["length_mm"] == 0.0
        assert layer.print_s == own["joined"]["print_s"]
        # An output that follows the speed lays in all attitudes together what the layer holds.
        assert layer.laid_mm3 == pytest.approx(layer.wanted_mm3, rel=0.04)
    assert told.finished.printed is not None
    assert told.finished.printed.mean == pytest.approx(1.0, abs=0.04)


@pytest.mark.dear
def test_the_folder_checks_and_says_how_its_programs_are_loaded(device: tuple[Path, StackRecord]) -> None:
    folder, told = device
    found = check_folder(folder)
    assert found.findings == ()
    moves = sum(layer.attitudes or 0 for layer in told.layers)
    for text in (stack_text(told), check_text(found)):
        said = " ".join(text.split())
        assert f"2, one a layer, in {moves} attitudes of the table; load that of layer-01" in said
    assert not list(folder.glob("rapid/*"))


@pytest.mark.dear
def test_the_table_moves_with_the_layers_below_on_the_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[list[str], float]] = []
    proof = printing.table_motion_clearance

    def noted(arm: Arm, *, surfaces: Sequence[Surface], kept: float, **others: Any) -> float:
        asked.append(([surface.name for surface in surfaces], kept))
        return proof(arm, surfaces=surfaces, kept=kept, **others)

    monkeypatch.setattr(printing, "table_motion_clearance", noted)
    job = job_of(
        surface=part(tmp_path), unit="mm", spacing=4.0, backend="heat", place="demo", cell=cell(tmp_path),
        thickness=1.0, layer=2,
    )  # fmt: skip
    planned = plan(job)
    process, place = planned.workpiece.cell.process, planned.workpiece.place
    assert place is not None
    assert len(asked) == len(planned.robot)
    for names, kept in asked:
        assert (names[0], names[-1]) == (planned.workpiece.base.name, planned.workpiece.ground.name)
        assert kept == pytest.approx(process.clearance + place.height)
    assert planned.workpiece.ground is place.ground
