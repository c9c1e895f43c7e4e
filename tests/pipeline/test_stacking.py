"""Layers of a thickness: each a part of its own, that lies on the one below and stands where the lowest stands."""

from __future__ import annotations

import json
import shutil
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Self

import numpy as np
import pytest

from geoprint.account import check_text, outcome_text, record_plan, stack_text
from geoprint.config import job_of, packaged_cell_text
from geoprint.errors import FieldError, GeoprintError, ResourceError, UsageError
from geoprint.model import Surface
from geoprint.pipeline import check_bundle, check_folder, compare, plan, plan_stack, stacking
from geoprint.pipeline.stacked.simulating import stacked_layer
from geoprint.results import Plan
from geoprint.surfaces import closest, face_areas
from geoprint.surfaces.files import save_ply
from tests.meshes import plate, spherical_cap


def _saved(folder: Path, surface: Surface) -> Path:
    path = folder / f"{surface.name}.ply"
    save_ply(surface, path)
    return path


def _cap(folder: Path) -> Path:
    return _saved(folder, spherical_cap(radius=20.0, angle=0.5, rings=16))


@pytest.fixture(scope="module")
def third(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    path = _cap(tmp_path_factory.mktemp("cap"))
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
    told = record_plan(third)
    (layer,) = told.layers
    assert (layer.number, layer.count, layer.bottom_mm, layer.height_mm) == (2, 4, 1.0, 0.5)
    assert "layer 3 of 4: from 1 to 1.5 mm over the part, paths in its middle" in outcome_text(told)
    assert third.poses.layers.min() == third.poses.layers.max() == 2


def test_a_layer_lays_what_it_holds(third: Plan) -> None:
    poses = third.poses
    lengths = np.linalg.norm(np.diff(poses.surface_points, axis=0), axis=1)
    laid = float((lengths * poses.flow[:-1])[poses.laid].sum())
    # Of a shell between two spheres.
    share = (21.5**3 - 21.0**3) / (3.0 * 0.5 * 20.0**2)
    (base,) = (third.workpiece.base,)
    assert laid == pytest.approx(float(face_areas(base).sum()) * share * 0.5, rel=0.03)


def test_what_the_program_lays_is_what_it_was_planned_to_but_for_where_the_tip_slows_down(third: Plan) -> None:
    kept = stacked_layer(third)
    constant, _, executed = kept.volumes
    # A valve that is open lets material through while the tip speeds up and slows down, too.
    assert constant < executed < 1.05 * constant
    (robot,) = third.robot
    open_for = float(np.diff(robot.switching.material, axis=1).sum())
    process = third.workpiece.cell.process
    assert executed == pytest.approx(open_for * process.speed * 2.0 * process.layer_height, rel=0.005)


def test_a_layer_is_kept_as_thick_as_it_is_on_columns_over_the_part(third: Plan) -> None:
    kept = stacked_layer(third)
    assert (kept.bottom, kept.height, kept.printed, kept.spacing) == (pytest.approx(1.0), pytest.approx(0.5), 2, 2.0)
    assert not kept.met.any()
    _, following, _ = kept.laid
    assert following.mean() == pytest.approx(0.5, rel=0.01)
    assert (following > 0.0).all()
    assert len(kept.seams) == record_plan(third).paths.runs
    assert all(one.beads.size and one.line.size for one in kept.slices)


def test_seams_move_on_from_layer_to_layer(tmp_path: Path) -> None:
    starts: list[float] = []
    for layer in (1, 2, 3):
        job = job_of(surface=_cap(tmp_path), unit="mm", spacing=2.0, thickness=1.5, layer=layer, robot=False)
        poses = plan(job).poses
        first = poses.surface_points[poses.deposit][0]
        starts.append(float(np.arctan2(first[1], first[0]) / (2.0 * np.pi)))
    steps = np.mod(np.diff(starts), 1.0)
    assert np.minimum(steps, 1.0 - steps).min() > 0.2


@pytest.mark.dear
def test_a_stack_is_written_whole_and_each_layer_checks(tmp_path: Path) -> None:
    job = job_of(surface=_cap(tmp_path), unit="mm", spacing=3.0, thickness=1.0, place="demo")
    told = plan_stack(job, tmp_path / "device")
    assert [layer.folder for layer in told.layers] == ["layer-01", "layer-02"]
    assert json.loads((tmp_path / "device" / "stack.json").read_text())["layers"][1]["bottom_mm"] == 0.5
    page = (tmp_path / "device" / "report.html").read_text(encoding="utf-8")
    assert "Finished thickness" in page
    assert "as executed" in page
    found = told.finished
    assert found.following_flow is not None
    assert found.printed is not None
    assert found.following_flow.cv < 0.05
    assert found.printed.mean == pytest.approx(1.0, abs=0.1)
    assert (found.printed.judged, found.printed.creased) == (1.0, 0.0)
    assert found.printed.volume == pytest.approx(
        sum(layer.laid_mm3 for layer in told.layers) / sum(layer.wanted_mm3 for layer in told.layers), rel=1e-4
    )
    assert "finished thickness" in stack_text(told)
    for layer in told.layers:
        assert not check_bundle(tmp_path / "device" / layer.folder, full=True).findings
        assert layer.clearance_mm is not None
        assert layer.clearance_mm > 0.5
        assert layer.laid_mm3 == pytest.approx(layer.wanted_mm3, rel=0.1)
    assert "1 mm in 2 layers of 0.5 mm" in stack_text(told)
    checked = check_folder(tmp_path / "device")
    assert check_text(checked).startswith("STACK  device: 2 layers, the lowest first\n\nlayer-01  as planned")
    sheet = check_text(check_folder(tmp_path / "device" / "layer-02"))
    assert "layer 0.5 mm, stand-off 0.3 mm over the layer below" in sheet
    (tmp_path / "device" / "stack.json").write_text("{}", encoding="utf-8")
    shutil.rmtree(tmp_path / "device" / "layer-01")
    text = check_text(check_folder(tmp_path / "device"))
    assert "stack.json, line 1: the file was changed" in text
    assert "layer-01  is not the plan that was made" in text
    text = stack_text(told)
    assert " 2 from 0.5 mm: " in text
    assert text.count("PLACEMENT NOT KNOWN") == 1
    assert "things; `--verbose` lists them" in text
    assert told.layers[0].not_checked[0] in stack_text(told, verbose=True)
    (upper,) = (layer.model_copy(update={"warnings": ("mind this",)}) for layer in told.layers[1:])
    assert "warning: layer 2: mind this" in stack_text(told.model_copy(update={"layers": (told.layers[0], upper)}))


@pytest.mark.dear
def test_nothing_is_written_where_a_layer_is_refused(tmp_path: Path) -> None:
    cell = tmp_path / "cell.toml"
    text = packaged_cell_text("irb120-bent45").replace("[300, 0, 50]", "[300, 0, 50]\ndemo_rpy_deg = [0, 75, 0]")
    cell.write_text(text, encoding="utf-8")
    job = job_of(surface=_cap(tmp_path), unit="mm", spacing=3.0, thickness=1.0, place="demo", cell=cell)
    with pytest.raises(GeoprintError, match=r"layer [12]: "):
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


def test_a_killed_process_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stacking, "ProcessPoolExecutor", _Broken)
    job = job_of(surface=_cap(tmp_path), unit="mm", spacing=3.0, thickness=1.0, robot=False)
    with pytest.raises(ResourceError, match="ended from outside"):
        plan_stack(job, tmp_path / "device")
    assert not (tmp_path / "device").exists()


def test_what_is_no_layer_is_refused(tmp_path: Path) -> None:
    path = _saved(tmp_path, plate((20.0, 12.0), (20, 12)))
    asked = {"surface": path, "unit": "mm", "spacing": 2.0, "robot": False}
    with pytest.raises(UsageError, match="2 mm are 4 layers, which are planned one by one: give `--layer` 1 to 4"):
        plan(job_of(**asked, thickness=2.0))
    with pytest.raises(UsageError, match=r"no layer 5: 2 mm are 4 layers of 0\.5 mm"):
        compare(job_of(**asked, thickness=2.0, layer=5))
    with pytest.raises(UsageError, match="`--layer 2` is of a thickness"):
        plan(job_of(**asked, layer=2))
    with pytest.raises(UsageError, match="over one patch"):
        job_of(**asked, thickness=2.0, patches=[{"at": [5, 5, 0], "radius": 2.0}, {"at": [15, 5, 0], "radius": 2.0}])
    with pytest.raises(UsageError, match="needs a thickness or a target and no layer"):
        plan_stack(job_of(**asked), tmp_path / "device")
    low = tmp_path / "low.toml"
    low.write_text(packaged_cell_text("irb120-bent45").replace("layer_height_mm = 0.5", "layer_height_mm = 0.7"))
    with pytest.raises(UsageError, match=r"ends within the lower half of layers of 0\.7 mm: raise"):
        plan(job_of(**asked, thickness=1.4, layer=1, cell=low))


def test_a_hollow_that_is_filled_before_is_refused(tmp_path: Path) -> None:
    bowl = spherical_cap(radius=4.0, angle=1.3, rings=20)
    turned = Surface(bowl.vertices, bowl.faces[:, ::-1], "bowl")
    job = job_of(surface=_saved(tmp_path, turned), unit="mm", spacing=1.0, thickness=6.0, layer=12, robot=False)
    with pytest.raises(FieldError, match="nothing of the outer side"):
        plan(job)
