"""Layers over a tilting table: each is divided among attitudes in its turn, and one program prints all of them."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geoprint.config import job_of
from geoprint.errors import ClearanceError
from geoprint.layers import StackRecord, plan_stack
from geoprint.layers.check_stack import layer_moves, own_programs
from geoprint.layers.stack_text import stack_text
from geoprint.model import Surface
from geoprint.postprocessor import read_setup
from geoprint.reporting import check_summary, check_text
from geoprint.reporting.check import CheckedComparison
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.rounding import read_record
from geoprint.robot.arm import Arm
from geoprint.workflow import check_bundle, check_folder, table_motion
from geoprint.workflow.check_full import _table_findings  # pyright: ignore[reportPrivateUsage]
from geoprint.workflow.replan import job_from
from geoprint.workflow.workpiece import read_part
from tests.layers.layers_here import planning_here
from tests.painting import painting_nothing
from tests.workflow.edits import rehashed
from tests.workflow.test_printing import cell, part

PAUSE = 20.0


@pytest.fixture(scope="module")
def asked() -> list[tuple[list[Surface], float]]:
    """What of all that is planned for `device` moves with the table past the arm, and how far away it is to stay."""
    return []


@pytest.fixture(scope="module")
def device(
    asked: list[tuple[list[Surface], float]], tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, StackRecord]:
    folder = tmp_path_factory.mktemp("layers")
    path = cell(folder)
    path.write_text(path.read_text().replace("# layer_pause_s = 60", f"layer_pause_s = {PAUSE:g}"))
    job = job_of(
        surface=part(folder), unit="mm", spacing=2.0, backend="heat", place="demo", cell=path, thickness=1.0,
    )  # fmt: skip
    proof = table_motion.table_motion_clearance

    def noted(arm: Arm, *, surfaces: Sequence[Surface], kept: float, **others: Any) -> float:
        asked.append((list(surfaces), kept))
        return proof(arm, surfaces=surfaces, kept=kept, **others)

    with planning_here(), painting_nothing(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(table_motion, "table_motion_clearance", noted)
        return folder / "device", plan_stack(job, folder / "device")


def test_each_layer_is_printed_in_attitudes_of_its_own_in_which_nothing_overhangs(
    device: tuple[Path, StackRecord],
) -> None:
    folder, record = device
    assert len(record.layers) == 2
    for layer in record.layers:
        own = json.loads((folder / layer.folder / "plan.json").read_text())
        assert layer.attitudes is not None
        assert layer.attitudes == len(own["robot"]) > 1
        assert own["overhang"]["table"]["length_mm"] == 0.0
        assert layer.print_s == own["joined"]["print_s"]
        # An output that follows the speed lays in all attitudes together what the layer holds.
        assert layer.laid_mm3 == pytest.approx(layer.wanted_mm3, rel=0.04)
    assert record.finished.printed is not None
    assert record.finished.printed.mean == pytest.approx(1.0, abs=0.04)


def test_one_program_prints_the_attitudes_of_all_layers_with_a_pause_between_layers(
    device: tuple[Path, StackRecord],
) -> None:
    folder, record = device
    program, counts = record.program, [layer.attitudes or 0 for layer in record.layers]
    assert program is not None
    assert program.pause_s == PAUSE
    assert f"printing up to attitude {sum(counts) - 1}" in program.scenarios
    calls = re.findall(r"    (GeoStack(?:Attitude|Pause) \d+)(?:,\"([\w/-]+)\")?", (folder / program.file).with_suffix(
        ".mod").read_text())  # fmt: skip
    loaded = [folder for call, folder in calls if "Attitude" in call]
    assert loaded == [
        f"layer-{layer:02}/part-{number}" for layer, count in enumerate(counts, 1) for number in range(1, count + 1)
    ]
    assert [call for call, _ in calls if "Pause" in call] == [f"GeoStackPause {counts[0]}"]
    # The table goes from layer to layer without a rest, which is proven, and the sooner for it.
    assert program.table_kept_mm is not None
    assert program.table_kept_mm > 2.0
    printed = sum(layer.print_s or 0.0 for layer in record.layers)
    assert printed + PAUSE - 20.0 < program.print_s < printed + PAUSE + 20.0


def test_the_folder_checks_and_says_how_its_program_is_loaded(device: tuple[Path, StackRecord]) -> None:
    folder, record = device
    found = check_folder(folder)
    assert found.findings == ()
    first, second = (layer.attitudes or 0 for layer in record.layers)
    said_to = check_summary(found)
    assert "set_to" not in said_to
    assert said_to["attitudes_set_to"] == {
        "dry_run": True, "speed_pct": 25.0, "first_attitude": 1, "first_run": 1, "last_attitude": first + second,
    }  # fmt: skip
    for text in (stack_text(record), check_text(found)):
        said = " ".join(text.split())
        assert f"in 2 layers and {first + second} attitudes of the table" in said
        assert f", attitudes 1 to {first}; then 20 s at home" in said
        assert f", attitudes {first + 1} to {first + second}" in said
        assert "copy the folders layer-01 to layer-02 of rapid/" in said
        assert "only you can notice a wrong attitude" in said
        assert f"geoLastAttitude, 1 to {first + second}, ends the program after that attitude" in said


def test_the_report_says_which_attitudes_print_each_layer(device: tuple[Path, StackRecord]) -> None:
    folder, record = device
    first, second = (layer.attitudes or 0 for layer in record.layers)
    page = (folder / "report.html").read_text()
    assert '<th scope="col">attitudes</th>' in page
    assert f"<td>1 to {first}</td>" in page
    assert f"<td>{first + 1} to {first + second}</td>" in page


def test_what_was_changed_in_the_program_of_all_layers_or_is_told_wrong_of_it_is_found(
    device: tuple[Path, StackRecord], tmp_path: Path
) -> None:
    folder = shutil.copytree(device[0], tmp_path / "device")
    path = folder / "rapid" / "layer-02" / "part-1" / "GeoCell.mod"
    number = 1 + (device[1].layers[0].attitudes or 0)
    written = path.read_text()
    assert f"nGeoTable:={number};" in written
    path.write_text(written.replace(f"nGeoTable:={number};", "nGeoTable:=1;"))
    record = json.loads((folder / "stack.json").read_text())
    kept = record["program"]["table_kept_mm"]
    record["program"]["table_kept_mm"] = kept + 0.02
    (folder / "stack.json").write_text(json.dumps(record))
    signed(folder, "stack.json")
    text, run, distance = check_folder(folder).findings
    assert text.file == "rapid/layer-02/part-1/GeoCell.mod"
    assert f"nGeoTable:={number};' here" in text.reason
    assert f"nothing asks before the table comes to attitude {number}" in run.reason
    assert distance.file == "stack.json"
    said, again = distance.reason.split(", checked again it is ")
    assert said == f"program.table_kept_mm is {kept + 0.02}"
    assert float(again) == pytest.approx(kept, abs=1e-9)


def test_a_table_that_comes_near_the_arm_between_two_layers_is_refused(device: tuple[Path, StackRecord]) -> None:
    folder, record = device
    jobs, own = [job_from(folder / layer.folder) for layer in record.layers], own_programs(folder, record.layers)
    (move,) = layer_moves(jobs, own)
    assert move.kept == pytest.approx(record.program.table_kept_mm if record.program else 0.0, abs=0.01)
    # Nothing in the cell is half a metre away from all else.
    near = [replace(one, cell=replace(one.cell, process=replace(one.cell.process, clearance=500.0))) for one in own]
    with pytest.raises(ClearanceError, match="layer 2, which comes upon layer 1 without a rest of the table"):
        layer_moves(jobs, near)


def test_a_larger_plate_of_a_layer_is_found_before_the_table_moves_between_two_layers(
    device: tuple[Path, StackRecord], tmp_path: Path
) -> None:
    # Somebody states a larger plate, and signs it: layer 2's own program says nothing of the plate's size.
    folder = shutil.copytree(device[0], tmp_path / "device")
    setup = folder / "layer-02" / "part-1" / "setup.json"
    record = json.loads(setup.read_text())
    assert record["cell"]["table"]["plate_diameter"] == 200.0
    record["cell"]["table"]["plate_diameter"] = 900.0
    setup.write_text(json.dumps(record))
    signed(folder / "layer-02", "part-1/setup.json")
    signed(folder, "layer-02/part-1/setup.json", "layer-02/manifest.json")
    found = check_folder(folder).findings
    assert ("layer-02/part-1/setup.json", "cell.table.plate_diameter is 900.0, by the cell file it is 200.0") in [
        (one.file, one.reason) for one in found
    ]
    # Nothing is said of a stack that has a layer which is not as it was planned.
    assert [one.reason for one in found if one.file == "rapid/GeoStack.pgf"] == [
        "a layer differs from its plan, so the stack was not compared with it"
    ]


def test_a_larger_plate_that_cell_and_setup_agree_on_is_found_as_the_table_moves_between_two_layers(
    device: tuple[Path, StackRecord], tmp_path: Path
) -> None:
    # Each layer by itself is as its cell has it; where the plate passes the arm nothing but the stack's proof says.
    folder = shutil.copytree(device[0], tmp_path / "device")
    for layer in device[1].layers:
        bundle = folder / layer.folder
        (cell_file,) = (bundle / "cell").glob("*.toml")
        text, count = re.subn(
            r"(?m)^\[table\]$", "[table]\nplate_diameter_mm = 900\nstand_distance_mm = 700", cell_file.read_text()
        )
        assert count == 1
        cell_file.write_text(text)
        for setup in bundle.glob("part-*/setup.json"):
            record = json.loads(setup.read_text())
            record["cell"]["table"] |= {"plate_diameter": 900.0, "stand_distance": 700.0}
            setup.write_text(json.dumps(record))
        rehashed(bundle)
    rehashed(folder)
    found = check_folder(folder)
    assert isinstance(found, CheckedComparison)
    assert [one.findings for _, one in found.bundles] == [() for _ in device[1].layers]
    reasons = [one.reason for one in found.findings if one.file == "rapid/GeoStack.pgf"]
    assert len(reasons) == 1
    assert "layer 2, which comes upon layer 1 without a rest of the table" in reasons[0]


def test_a_full_check_proves_anew_that_the_table_keeps_clear_of_the_arm_between_two_attitudes(
    device: tuple[Path, StackRecord], tmp_path: Path
) -> None:
    folder = shutil.copytree(device[0] / "layer-01", tmp_path / "layer")
    plan_file = folder / "plan.json"
    record = json.loads(plan_file.read_text())
    kept = record["robot"][1]["table"]["kept_mm"]
    record["robot"][1]["table"]["kept_mm"] = kept + 0.02
    plan_file.write_text(json.dumps(record))
    signed(folder, "plan.json")
    # As it was told it is found again, and so is all else.
    (found,) = check_bundle(folder, full=True).findings
    said, again = found.reason.split(", checked again it is ")
    what, _, recorded_mm = said.rpartition(" ")
    assert (found.file, what) == ("plan.json", "robot.2.table.kept_mm is")
    assert float(recorded_mm) == pytest.approx(kept + 0.02, abs=1e-5)
    assert float(again) == pytest.approx(kept, abs=1e-3)
    # Nothing in the cell is half a metre away from all else.
    rest, moved = (read_setup(folder / f"part-{number}" / "setup.json") for number in (1, 2))
    far = replace(moved, cell=replace(moved.cell, process=replace(moved.cell.process, clearance=500.0)))
    robots = read_record(plan_file, PlanRecord).robot
    (refused,) = _table_findings(read_part(job_from(folder)), [rest, far], robots)
    assert refused.file == "part-2/setup.json"
    assert "goes to attitude 2 of" in refused.reason
    assert "500.50 mm are required" in refused.reason


def signed(folder: Path, *names: str) -> None:
    """Renew the hashes of files in a manifest, as nobody does by mistake."""
    manifest = folder / "manifest.json"
    record = json.loads(manifest.read_text())
    for name in names:
        assert name in record["sha256"]
        record["sha256"][name] = hashlib.sha256((folder / name).read_bytes()).hexdigest()
    manifest.write_text(json.dumps(record))


def test_the_table_moves_with_the_layers_below_on_the_part(
    device: tuple[Path, StackRecord], asked: list[tuple[list[Surface], float]]
) -> None:
    folder, record = device
    first, second = (layer.attitudes or 0 for layer in record.layers)
    clearance = own_programs(folder, record.layers)[0].cell.process.clearance
    # Into each attitude of both layers, and from the first layer to the second.
    layers = [0] * first + [1] * (len(asked) - first)
    assert len(asked) > first + second
    parts = [read_part(job_from(folder / layer.folder)) for layer in record.layers]
    for (surfaces, kept), layer in zip(asked, layers, strict=True):
        below = parts[layer].place
        assert below is not None
        assert (surfaces[0].name, surfaces[-1].name) == (parts[layer].base.name, below.ground.name)
        np.testing.assert_allclose(surfaces[-1].vertices, below.ground.vertices, atol=1e-6)
        assert kept == pytest.approx(clearance + below.height)
    # The layer below lies on the part.
    assert asked[-1][0][-1].vertices[:, 2].max() > asked[0][0][-1].vertices[:, 2].max() + 0.4
