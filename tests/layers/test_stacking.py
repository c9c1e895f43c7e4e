"""Layers of a thickness: each a part of its own, that lies on the one below and stands where the lowest stands."""

from __future__ import annotations

import json
import re
import shutil
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from datetime import UTC, datetime
from pathlib import Path
from typing import Self

import numpy as np
import pytest

from geoprint.config import Job, job_of, load_cell, packaged_cell_text
from geoprint.errors import FieldError, GeoprintError, ResourceError, UsageError, VerificationError
from geoprint.geometry import closest, face_areas
from geoprint.geometry.files import load, save_ply
from geoprint.layers import StackRecord, plan_stack, stacking
from geoprint.layers.check_stack import own_programs, stack_program
from geoprint.layers.records import StackedLayerRecord
from geoprint.layers.stack_text import stack_text
from geoprint.layers.stack_thickness import stacked_layer
from geoprint.model import Surface
from geoprint.postprocessor import read_setup
from geoprint.reporting import check_summary, check_text, outcome_text, record_plan
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.rounding import read_record
from geoprint.results import Plan
from geoprint.workflow import check_bundle, check_folder, compare, plan, record_seen
from geoprint.workflow.bundles import stream_of
from tests.layers.layers_here import planning_here
from tests.meshes import plate, sphere, spherical_cap
from tests.painting import painting_nothing

# Of the cap [mm].
RADIUS = 20.0


def _saved(folder: Path, surface: Surface) -> Path:
    path = folder / f"{surface.name}.ply"
    save_ply(surface, path)
    return path


def _cap(folder: Path, *, angle: float = 0.35) -> Path:
    return _saved(folder, spherical_cap(radius=RADIUS, angle=angle, rings=round(angle * 32.0)))


@pytest.fixture(scope="module")
def third(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    path = _cap(tmp_path_factory.mktemp("cap"), angle=0.5)
    return plan(job_of(surface=path, unit="mm", spacing=2.0, thickness=2.0, layer=3, place="demo"))


def test_a_layer_lies_between_its_bottom_and_its_top(third: Plan) -> None:
    place = third.workpiece.place
    assert place is not None
    assert (place.number, place.count, place.bottom, place.height) == (3, 4, pytest.approx(1.0), pytest.approx(0.5))
    base = place.base
    middle = closest(base, third.poses.surface_points[third.poses.deposit])[1]
    assert np.median(middle) == pytest.approx(1.25, abs=2e-3)
    assert np.abs(middle - 1.25).max() < 0.02
    assert np.median(closest(base, place.ground.vertices)[1]) == pytest.approx(1.0, abs=1e-6)
    # The stand-off of the cell counts from what lies below.
    tips = third.poses.tips[third.poses.deposit]
    assert np.median(closest(place.ground, tips)[1]) == pytest.approx(0.3, abs=2e-3)


def test_layers_stand_where_the_part_stands(third: Plan) -> None:
    skin = plan(third.job.model_copy(update={"thickness": None, "layer": None}))
    assert skin.workpiece.placement is not None
    assert third.workpiece.placement is not None
    np.testing.assert_array_equal(skin.workpiece.placement.T_base_work, third.workpiece.placement.T_base_work)
    (robot,) = third.robot
    assert robot.clearance.smallest > 0.5
    assert robot.clearance.tip_margin == pytest.approx(0.3, abs=0.1)


def test_what_is_told_names_the_layer(third: Plan) -> None:
    record = record_plan(third)
    (layer,) = record.layers
    assert (layer.number, layer.count, layer.bottom_mm, layer.height_mm) == (2, 4, 1.0, 0.5)
    assert "layer 3 of 4: from 1 to 1.5 mm above the part, paths at mid-height" in outcome_text(record)
    assert third.poses.layers.min() == third.poses.layers.max() == 2


def test_a_layer_lays_what_it_holds(third: Plan) -> None:
    poses = third.poses
    lengths = np.linalg.norm(np.diff(poses.surface_points, axis=0), axis=1)
    deposited = float((lengths * poses.flow[:-1])[poses.deposited].sum())
    # Of a shell between two spheres.
    share = ((RADIUS + 1.5) ** 3 - (RADIUS + 1.0) ** 3) / (3.0 * 0.5 * RADIUS**2)
    (base,) = (third.workpiece.base,)
    assert deposited == pytest.approx(float(face_areas(base).sum()) * share * 0.5, rel=0.01)
    # What fronts that meet leave out is made up for by the speed, so that the pressure stays.
    assert deposited == pytest.approx(0.5 * float(face_areas(third.workpiece.part).sum()), rel=2e-3)
    process, flow = third.workpiece.cell.process, float(poses.flow.max())
    assert flow * process.speed == pytest.approx(2.0 * 0.5 * load_cell(None).process.speed, rel=1e-12)
    assert process.speed < load_cell(None).process.speed
    assert any(" miss " in note and "prints slower" in note for note in record_plan(third).notes)


def test_what_the_program_lays_is_what_it_was_planned_to_but_for_where_the_tip_slows_down(third: Plan) -> None:
    kept = stacked_layer(third)
    constant, _, executed = kept.volumes
    # A valve that is open lets material through while the tip speeds up and slows down, too.
    assert constant < executed < 1.05 * constant
    (robot,) = third.robot
    open_for = float(np.diff(robot.switching.material, axis=1).sum())
    # The pressure is that of the cell.
    process = load_cell(None).process
    assert executed == pytest.approx(open_for * process.speed * 2.0 * process.layer_height, rel=0.005)


def test_a_layer_is_kept_as_thick_as_it_is_on_columns_over_the_part(third: Plan) -> None:
    kept = stacked_layer(third)
    assert (kept.bottom, kept.height, kept.printed, kept.spacing) == (pytest.approx(1.0), pytest.approx(0.5), 2, 2.0)
    assert not kept.met.any()
    _, following, _ = kept.deposited
    assert following.mean() == pytest.approx(0.5, rel=0.01)
    assert (following > 0.0).all()
    assert len(kept.seams) == record_plan(third).paths.runs
    assert all(one.beads.size and one.line.size for one in kept.slices)


def test_seams_move_on_from_layer_to_layer(tmp_path: Path) -> None:
    starts: list[float] = []
    cap = _saved(tmp_path, spherical_cap(radius=10.0, angle=0.5, rings=8))
    for layer in (1, 2, 3):
        job = job_of(surface=cap, unit="mm", spacing=2.0, thickness=1.5, layer=layer, robot=False)
        poses = plan(job).poses
        first = poses.surface_points[poses.deposit][0]
        starts.append(float(np.arctan2(first[1], first[0]) / (2.0 * np.pi)))
    steps = np.mod(np.diff(starts), 1.0)
    assert np.minimum(steps, 1.0 - steps).min() > 0.2


@pytest.fixture(scope="module")
def device(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, StackRecord]:
    """A stack of two layers with a pause between them."""
    folder = tmp_path_factory.mktemp("device")
    cell = folder / "cell.toml"
    text = packaged_cell_text("irb120-bent45").replace("# layer_pause_s = 60", "layer_pause_s = 20")
    cell.write_text(text, encoding="utf-8")
    job = job_of(surface=_cap(folder), unit="mm", spacing=3.0, thickness=1.0, place="demo", cell=cell)
    with planning_here(), painting_nothing():
        return folder / "device", plan_stack(job, folder / "device")


def test_a_stack_is_written_whole_and_each_layer_checks(device: tuple[Path, StackRecord]) -> None:
    folder, record = device
    assert [layer.folder for layer in record.layers] == ["layer-01", "layer-02"]
    assert json.loads((folder / "stack.json").read_text())["layers"][1]["bottom_mm"] == 0.5
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Finished thickness" in page
    assert "as executed" in page
    found = record.finished
    assert found.following_flow is not None
    assert found.printed is not None
    assert found.following_flow.cv < 0.05
    assert found.printed.mean == pytest.approx(1.0, abs=0.1)
    assert (found.printed.judged, found.printed.creased) == (1.0, 0.0)
    assert found.printed.volume == pytest.approx(
        sum(layer.laid_mm3 for layer in record.layers) / sum(layer.wanted_mm3 for layer in record.layers), rel=1e-4
    )
    assert "finished thickness" in stack_text(record)
    for layer in record.layers:
        assert not check_bundle(folder / layer.folder, full=layer is record.layers[-1]).findings
        assert layer.clearance_mm is not None
        assert layer.clearance_mm > 0.5
        assert layer.laid_mm3 == pytest.approx(layer.wanted_mm3, rel=0.1)
    sheet = check_text(check_folder(folder / "layer-02"))
    assert "layer 0.5 mm, stand-off 0.3 mm over the layer below" in sheet
    text = stack_text(record)
    assert "1 mm in 2 layers of 0.5 mm" in text
    assert " 2 from 0.5 mm: " in text
    assert "placement unknown" not in text
    assert "things; `--verbose` lists them" in text
    assert record.layers[0].not_checked[0] in stack_text(record, verbose=True)
    (upper,) = (layer.model_copy(update={"warnings": ("mind this",)}) for layer in record.layers[1:])
    assert "warning: layer 2: mind this" in stack_text(record.model_copy(update={"layers": (record.layers[0], upper)}))


def test_setup_plan_and_program_of_each_layer_state_the_stand_off_of_the_cell(device: tuple[Path, StackRecord]) -> None:
    folder, record = device
    for layer in record.layers:
        place = folder / layer.folder
        stated = read_record(place / "plan.json", PlanRecord)
        setup = read_setup(place / "setup.json")
        process = setup.cell.process
        assert (process.standoff, process.layer_height) == (0.3, 0.5)
        assert (stated.settings.standoff_mm, stated.layers[0].standoff_mm) == (0.3, 0.3)
        # The frame may shift by a tenth of that, and by less where an axis is near a border of its quadrants.
        (shift,) = re.findall(r"nGeoShift:=(.*);", (place / "rapid" / "GeoCell.mod").read_text(encoding="ascii"))
        assert setup.frame is not None
        assert float(shift) == pytest.approx(min(0.03, setup.frame), rel=1e-3)
        # The tip is as far over the middle of the layer as the stand-off is more than half its height.
        poses = stream_of(place, stated)
        assert poses.standoff == pytest.approx(0.05)
        assert closest(load(place / "surface.ply", unit="mm"), poses.tips[poses.deposit])[1].mean() == pytest.approx(
            0.05, abs=2e-3
        )


def test_a_stack_has_one_program_that_was_executed(device: tuple[Path, StackRecord]) -> None:
    folder, record = device
    program = record.program
    assert program is not None
    assert (program.file, program.pause_s, program.runs_dry_only) == ("rapid/GeoStack.pgf", 20.0, True)
    times = [layer.print_s for layer in record.layers if layer.print_s is not None]
    assert program.print_s == pytest.approx(sum(times) + 20.0, abs=1e-5)
    assert program.scenarios == (
        "dry", "printing", "printing from layer 2 on", "printing up to layer 1",
        f"printing from run {record.layers[1].runs // 2 + 1} of layer 2 on",
    )  # fmt: skip
    assert {path.name for path in (folder / "rapid" / "layer-02").iterdir()} == {
        "GeoCell.mod", "GeoGuard.mod", "GeoPrint.mod",
    }  # fmt: skip
    assert "layer-01` to `layer-02`" in (folder / "rapid" / "controller" / "first_load.md").read_text()


def test_the_run_sheet_of_a_stack_says_what_to_load_and_where_it_pauses(
    device: tuple[Path, StackRecord], tmp_path: Path
) -> None:
    folder = shutil.copytree(device[0], tmp_path / "device")
    stack = folder / "rapid" / "GeoStack.mod"
    stack.write_text(stack.read_text().replace("geoFirstLayer:=1", "geoFirstLayer:=2"))
    text = check_text(check_folder(folder))
    assert text.startswith("STACK  device: 2 layers, the lowest first\n\nlayer-01  as planned")
    assert "copy the folders layer-01 to layer-02 of rapid/ to the controller's HOME folder" in text
    assert "run layers 2 to 2 dry at 25 % speed (geoDryRun TRUE)" in text
    assert re.search(r"layers +1  \d+ runs, \d+ s, [\d.]+ cm3; then 20 s at home\n +2  .* cm3\n", text)
    assert "geoLastLayer, 1 to 2, ends the program after that layer" in text
    found = check_summary(check_folder(folder))
    assert found["set_to"] == {
        "dry_run": True, "speed_pct": 25.0, "first_layer": 2, "first_run": 1, "last_layer": 2,
    }  # fmt: skip
    assert found["executed"] == list(device[1].program.scenarios if device[1].program else ())
    assert "; then 20 s at home" in stack_text(device[1])


def test_what_was_changed_in_the_program_of_a_stack_is_found(device: tuple[Path, StackRecord], tmp_path: Path) -> None:
    folder = shutil.copytree(device[0], tmp_path / "device")
    path = folder / "rapid" / "layer-02" / "GeoPrint.mod"
    lines = path.read_text().split("\n")
    at = next(k for k, line in enumerate(lines) if "MoveL" in line)
    lines[at] = lines[at].replace(",[9E9,", ",[9E8,")
    path.write_text("\n".join(lines))
    (folder / "rapid" / "layer-02" / "GeoGuard.mod").unlink()
    findings = check_folder(folder).findings
    assert [(each.file, each.line) for each in findings[:2]] == [
        ("rapid/layer-02/GeoGuard.mod", 1), ("rapid/layer-02/GeoPrint.mod", at + 1),
    ]  # fmt: skip
    assert "the layer's own program says 'MoveL" in findings[1].reason
    assert sum(each.file == "rapid/layer-02/GeoPrint.mod" for each in findings) == 1
    resident = folder / "rapid" / "controller" / "GeoResident.sys"
    resident.write_text(resident.read_text().replace("SetDO doUV,0;", "SetDO doUV,1;", 1))
    assert any("the guard must say 'SetDO doUV,0;'" in each.reason for each in check_folder(folder).findings)


def test_a_stack_is_not_held_against_layers_that_were_changed(device: tuple[Path, StackRecord], tmp_path: Path) -> None:
    folder = shutil.copytree(device[0], tmp_path / "device")
    shutil.rmtree(folder / "layer-01")
    text = check_text(check_folder(folder))
    assert "layer-01  differs from the plan that was made" in text
    assert "rapid/GeoStack.pgf, line 1: a layer differs from its plan" in text
    (folder / "stack.json").write_text("{}", encoding="utf-8")
    text = check_text(check_folder(folder))
    assert "stack.json, line 1: " in text
    assert "RUN SHEET" not in text


def test_what_a_person_saw_the_program_of_a_stack_do_stands_on_its_run_sheet(
    device: tuple[Path, StackRecord], tmp_path: Path
) -> None:
    folder = shutil.copytree(device[0], tmp_path / "device")
    seen = record_seen(check_folder(folder), "loaded", note="no errors", when=datetime(2026, 3, 4, tzinfo=UTC))
    # The print itself moves the switches on: it is the same program.
    stack = folder / "rapid" / "GeoStack.mod"
    stack.write_text(stack.read_text().replace("geoFirstLayer:=1", "geoFirstLayer:=2"))
    checked = check_folder(folder)
    assert not checked.findings
    said = " ".join(check_text(checked).split())
    assert "loaded on a virtual controller: seen 2026-03-04: no errors run dry: not yet" in said
    found = check_summary(checked)
    assert found["program_sha256"] == seen.program_sha256
    assert found["seen"] == [
        {"stage": "loaded", "date": seen.date, "note": "no errors", "program_sha256": seen.program_sha256}
    ]
    with pytest.raises(UsageError, match="only runs dry, because the pose of the fixture"):
        record_seen(checked, "printed", note="fine")
    evidence = folder / "evidence.json"
    evidence.write_text(evidence.read_text().replace(seen.program_sha256, "0" * 64))
    assert "does not count: reported for another program: loaded" in " ".join(check_text(check_folder(folder)).split())
    evidence.write_text("{}")
    checked = check_folder(folder)
    (unread,) = checked.findings
    assert unread.file == "evidence.json"
    with pytest.raises(VerificationError, match="differs from the plan that was made"):
        record_seen(checked, "dry", note="fine")


def test_without_a_robot_a_stack_has_no_program(tmp_path: Path) -> None:
    layer = StackedLayerRecord.model_validate(
        dict.fromkeys(("bottom_mm", "height_mm", "area_mm2", "deposit_mm", "speed_mm_s", "laid_mm3", "wanted_mm3"), 1.0)
        | dict.fromkeys(("gap", "overlap", "thickness_cv", "print_s", "clearance_mm", "not_printable"))
        | {"folder": "layer-01", "runs": 1, "warnings": (), "not_checked": ()}
    )
    own = own_programs(tmp_path, [layer])
    assert own == []
    assert stack_program(own, [layer], (), part_name="cap.ply") == ({}, None)


def test_nothing_is_written_where_a_layer_is_refused(tmp_path: Path) -> None:
    ball = _saved(tmp_path, sphere(radius=3.0, subdivisions=2))
    job = job_of(surface=ball, unit="mm", spacing=1.5, thickness=1.0, robot=False)
    with planning_here(), pytest.raises(GeoprintError, match=r"layer 2: .* is closed and has no rim"):
        plan_stack(job, tmp_path / "device")
    assert not (tmp_path / "device").exists()


class _Broken:
    """A pool whose process was killed."""

    def __init__(self, *_: object, **__: object) -> None:
        self.future: Future[None] = Future()
        self.future.set_exception(BrokenProcessPool("killed"))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def submit(self, *_: object) -> Future[None]:
        return self.future


def _read(_: Job) -> None:
    pytest.fail("the part was read before the layers were planned")


def test_a_killed_process_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stacking, "layer_processes", _Broken)
    # Nor does the process that waits read what it would then hold beside those that plan.
    monkeypatch.setattr(stacking, "read_stack", _read)
    job = job_of(surface=_cap(tmp_path), unit="mm", spacing=3.0, thickness=1.0, robot=False)
    with pytest.raises(ResourceError, match="was killed"):
        plan_stack(job, tmp_path / "device")
    assert not (tmp_path / "device").exists()


def test_what_is_no_layer_is_refused(tmp_path: Path) -> None:
    path = _saved(tmp_path, plate((20.0, 12.0), (20, 12)))
    asked = {"surface": path, "unit": "mm", "spacing": 2.0, "robot": False}
    with pytest.raises(UsageError, match="2 mm are 4 layers, which are planned one by one: give `--layer` 1 to 4"):
        plan(job_of(**asked, thickness=2.0))
    with pytest.raises(UsageError, match=r"no layer 5: 2 mm are 4 layers of 0\.5 mm"):
        compare(job_of(**asked, thickness=2.0, layer=5))
    with pytest.raises(UsageError, match="`--layer 2` needs a thickness"):
        plan(job_of(**asked, layer=2))
    with pytest.raises(UsageError, match="`--pattern contours,spiral` needs a thickness"):
        plan(job_of(**asked, pattern="contours,spiral"))
    with pytest.raises(UsageError, match="over one patch"):
        job_of(**asked, thickness=2.0, patches=[{"at": [5, 5, 0], "radius": 2.0}, {"at": [15, 5, 0], "radius": 2.0}])
    with pytest.raises(UsageError, match="needs a thickness or a target and no layer"):
        plan_stack(job_of(**asked), tmp_path / "device")
    low = tmp_path / "low.toml"
    low.write_text(packaged_cell_text("irb120-bent45").replace("layer_height_mm = 0.5", "layer_height_mm = 0.7"))
    with pytest.raises(UsageError, match=r"ends within the lower half of layers of 0\.7 mm. Raise"):
        plan(job_of(**asked, thickness=1.4, layer=1, cell=low))


def test_a_hollow_that_is_filled_before_is_refused(tmp_path: Path) -> None:
    bowl = spherical_cap(radius=4.0, angle=1.3, rings=20)
    turned = Surface(bowl.vertices, bowl.faces[:, ::-1], "bowl")
    job = job_of(surface=_saved(tmp_path, turned), unit="mm", spacing=1.0, thickness=6.0, layer=12, robot=False)
    with pytest.raises(FieldError, match="nothing of the outer side"):
        plan(job)
