"""Patterns that take turns: layers cross as their angles do, one alone is planned as its own, and all is told."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

import geoprint
from geoprint.config import job_of, packaged_cell_text
from geoprint.errors import UsageError
from geoprint.geometry.files import save_ply
from geoprint.layers import plan_stack
from geoprint.layers.stack_text import stack_text
from geoprint.model import FloatArray
from geoprint.reporting import outcome_text, record_plan
from geoprint.results import Plan
from geoprint.workflow import compare, plan, save_plan
from geoprint.workflow.backend_choice import check_options
from geoprint.workflow.covering import cover
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import prepare_workpiece
from tests.layers.layers_here import planning_here
from tests.meshes import cylinder_patch, disc, plate
from tests.painting import painting_nothing

MATERIAL = """
[material]
density_g_cm3 = 1.1
consistency_pa_sn = 20
flow_index = 0.6
yield_stress_pa = 0
uv_irradiance_mw_cm2 = 100
uv_spot_mm = 6
uv_dose_mj_cm2 = 100
uv_penetration_mm = 0.5
"""
FLAT = Path(__file__).parents[2] / "data" / "heart_flat_patch.ply"


def _rows(layer: int, backend: str) -> tuple[FloatArray, FloatArray]:
    """Return (k, 3) places on the straight rows of a layer [mm] and the unit vectors along these."""
    job = job_of(
        surface=FLAT, unit="mm", patches=[{"at": [41.7, 4.0, -6.4], "radius": 11.0}], spacing=2.0, thickness=1.0,
        layer=layer, backend=backend, robot=False, pattern="guided:0,guided:90",
    )  # fmt: skip
    stage = Stages(lambda _: None)
    workpiece = prepare_workpiece(job, stage, backends=[backend])
    toolpath = cover(job, workpiece, stage).toolpath
    places = toolpath.curves.points.xyz(workpiece.surface)
    middles, along = list[FloatArray](), list[FloatArray]()
    for begin, end in pairwise(toolpath.curves.offsets.tolist()):
        line, rows = places[begin:end], toolpath.rows[begin:end]
        on = (rows[1:] % 1.0 == 0.0) & (rows[1:] == rows[:-1])
        middles.append((0.5 * (line[1:] + line[:-1]))[on])
        along.append(np.diff(line, axis=0)[on])
    steps = np.concatenate(along)
    return np.concatenate(middles), steps / np.linalg.norm(steps, axis=1, keepdims=True)


def test_layers_at_0_and_90_degrees_cross_square_whatever_backend_draws_them() -> None:
    (below, first), (above, second) = _rows(1, "heat"), _rows(2, "lscm")
    away, at = KDTree(below).query(above)
    crossing = np.degrees(np.arccos(np.abs(np.einsum("kx,kx->k", first[at], second))))
    # The patch is not quite flat: away from the middle, rows beside a line turn with its curvature.
    middle = (np.asarray(away) < 1.0) & (np.linalg.norm(above - below.mean(axis=0), axis=1) < 8.0)
    assert middle.sum() > 100
    assert np.abs(crossing[middle] - 90.0).max() < 1.0


def test_a_stack_says_the_pattern_of_each_layer_and_a_layer_alone_has_its_own(tmp_path: Path) -> None:
    part = tmp_path / "plate.ply"
    save_ply(plate((12.0, 8.0), (12, 8)), part)
    pattern = "contours,guided:-45"
    cell = tmp_path / "cell.toml"
    cell.write_text(packaged_cell_text("irb120-bent45") + MATERIAL, encoding="utf-8")
    asked = {
        "surface": part, "unit": "mm", "spacing": 2.0, "thickness": 1.5, "robot": False, "pattern": pattern,
        "cell": cell,
    }  # fmt: skip
    with planning_here(), painting_nothing():
        record = plan_stack(job_of(**asked), tmp_path / "device")
    assert [layer.pattern for layer in record.layers] == ["contours", "guided:-45", "contours"]
    assert " 2 from 0.5 mm: guided:-45, " in stack_text(record)
    # The lamp's power, spread over speed times spacing, reaches through half a millimetre to the bottom. A layer whose
    # missing volume is made up is printed slower.
    plans = [json.loads((tmp_path / "device" / layer.folder / "plan.json").read_text()) for layer in record.layers]
    doses = 100.0 * np.pi * 9.0 / (2.0 * np.array([each["settings"]["speed_mm_s"] for each in plans]))
    assert {layer.speed_mm_s for layer in record.layers} == {20.0}
    first, *_, last = (layer.cure for layer in record.layers)
    assert first is not None
    assert last is not None
    assert last.own_mj_cm2 == last.whole_mj_cm2 == pytest.approx(doses[-1] * np.exp(-1.0), rel=1e-5)
    assert first.own_mj_cm2 == pytest.approx(doses[0] * np.exp(-1.0), rel=1e-5)
    assert first.whole_mj_cm2 == pytest.approx(doses @ np.exp(-np.arange(1.0, 4.0)), rel=1e-5)
    assert "warning: layers 1, 2, 3 are not cured through" in stack_text(record)
    again = job_of(surface=tmp_path / "device" / "layer-02" / "job.toml")
    assert (again.pattern, again.layer) == (pattern, 2)
    alone = plan(job_of(**asked, layer=2))
    (layer,) = record_plan(alone).layers
    assert layer.pattern == "guided:-45"
    assert "paths at mid-height, guided:-45" in outcome_text(record_plan(alone))
    table = (tmp_path / "device" / "layer-02" / "poses.csv").read_text(encoding="utf-8").splitlines()
    assert len(table) == alone.poses.count + 1


def test_what_is_wrong_with_patterns_is_said_before_any_layer_is_planned(tmp_path: Path) -> None:
    part = tmp_path / "plate.ply"
    save_ply(plate((20.0, 12.0), (20, 12)), part)
    with pytest.raises(UsageError, match=r"^`--pattern`: spiral:30 gives an angle"):
        plan_stack(job_of(surface=part, thickness=2.0, pattern="contours,spiral:30"), tmp_path / "device")


# Fibres of layers: lines of the part carried into its layers, turned from layer to layer, and planned again.


HELIX = "[helix]\naxis = [0.0, 1.0, 0.0]\nangle = 0.0\n"
THROUGH = "[through]\ninner_deg = 60.0\nouter_deg = -60.0\n"


def _asked(folder: Path, field: str, **keys: object) -> dict[str, object]:
    """Return the keys of a job over a part of a tube of 20 mm, in layers of 0.5 mm."""
    save_ply(cylinder_patch(radius=20.0, angle=0.5, length=9.0, divisions=(12, 10), jitter_seed=1), folder / "tube.ply")
    (folder / "own.toml").write_text(field)
    return {
        "surface": folder / "tube.ply", "unit": "mm", "spacing": 1.5, "thickness": 2.0, "pattern": "fibres",
        "field": folder / "own.toml", "robot": False, **keys,
    }  # fmt: skip


def _angles(paths: Plan) -> FloatArray:
    """Return the (k,) helix angles about the y axis of all pieces of strokes longer than a fifth of a mm [degrees]."""
    found = list[FloatArray]()
    for curve in range(paths.toolpath.curves.count):
        line = paths.toolpath.curves.xyz(paths.workpiece.surface, curve)
        steps, middles = np.diff(line, axis=0), (line[1:] + line[:-1]) / 2
        steps, middles = (each[np.linalg.norm(steps, axis=1) > 0.2] for each in (steps, middles))
        right = np.cross([0.0, 1.0, 0.0], middles)
        right /= np.linalg.norm(right, axis=1)[:, None]
        along = np.einsum("kx,kx->k", steps, right)
        found.append(np.degrees(np.arctan2(steps[:, 1] * np.sign(along), np.abs(along))))
    return np.concatenate(found)


def test_strokes_of_each_layer_wind_at_the_angle_of_its_depth(tmp_path: Path) -> None:
    asked = _asked(tmp_path, HELIX + THROUGH)
    for backend, layer, wanted in (("heat", 1, 45.0), ("lscm", 3, -15.0), ("heat", 4, -45.0)):
        found = _angles(plan(job_of(**asked, backend=backend, layer=layer)))
        assert found.mean() == pytest.approx(wanted, abs=0.5)
        assert np.abs(found - wanted).mean() < 1.0


def test_lines_turn_by_so_many_degrees_each_mm_from_those_of_the_part(tmp_path: Path) -> None:
    asked = _asked(tmp_path, HELIX.replace("angle = 0.0", "angle = 20.0") + "[through]\nturn_deg_per_mm = 10.0\n")
    # In the middle of the fourth layer, 1.75 mm over the part.
    assert _angles(plan(job_of(**asked, layer=4))).mean() == pytest.approx(20.0 + 17.5, abs=0.5)


def test_a_singularity_stands_in_all_layers_where_it_is_on_the_part(tmp_path: Path) -> None:
    save_ply(disc(radius=7.0, rings=9, jitter_seed=1), tmp_path / "disc.ply")
    circles = "[[preferences]]\nrim = true\n[[singularities]]\nplace = [2.0, 1.0, 0.0]\nindex = 1.0\n"
    (tmp_path / "own.toml").write_text(circles)
    job = job_of(
        surface=tmp_path / "disc.ply", unit="mm", spacing=1.5, thickness=4.0, layer=7, pattern="fibres",
        field=tmp_path / "own.toml", robot=False,
    )  # fmt: skip
    # 3.25 mm over the part a place of the field would lie off the layer, but it is one of the part.
    paths = plan(job)
    curves = paths.toolpath.curves
    closed = [curves.xyz(paths.workpiece.surface, curve) for curve in np.flatnonzero(curves.closed).tolist()]
    smallest = min(closed, key=lambda line: float(np.ptp(line[:, 0])))
    assert np.linalg.norm((smallest.max(axis=0) + smallest.min(axis=0))[:2] / 2.0 - [2.0, 1.0]) < 0.75


def test_stacks_and_comparisons_of_layers_follow_it_and_are_planned_again_to_the_same_bytes(tmp_path: Path) -> None:
    save_ply(plate((12.0, 9.0), (12, 9), jitter_seed=1), tmp_path / "plate.ply")
    (tmp_path / "own.toml").write_text("[[preferences]]\ndirection = [1.0, 0.0, 0.0]\n" + THROUGH)
    asked = {
        "surface": tmp_path / "plate.ply", "unit": "mm", "spacing": 2.0, "thickness": 1.0, "pattern": "fibres",
        "field": tmp_path / "own.toml", "robot": False,
    }  # fmt: skip
    with planning_here(), painting_nothing():
        record = plan_stack(job_of(**asked), tmp_path / "device")
    assert [layer.pattern for layer in record.layers] == ["fibres", "fibres"]
    for _, compared in compare(job_of(**asked, layer=2), backends=["lscm", "heat"]).planned:
        line = compared.plan.toolpath.curves.xyz(compared.plan.workpiece.surface, 0)
        along = (line[-1] - line[0]) / np.linalg.norm(line[-1] - line[0])
        assert np.degrees(np.arccos(abs(along @ [np.cos(np.pi / 6), -0.5, 0.0]))) < 1.0
    (tmp_path / "own.toml").unlink()
    again = plan(geoprint.job_from(tmp_path / "device" / "layer-02"))
    save_plan(again, tmp_path / "again")
    written = tmp_path / "device" / "layer-02" / "manifest.json"
    assert written.read_bytes() == (tmp_path / "again" / "manifest.json").read_bytes()


def test_turning_through_a_single_skin_is_refused(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(HELIX + THROUGH)
    job = job_of(surface="part.ply", spacing=1.0, pattern="fibres", field=tmp_path / "own.toml")
    with pytest.raises(
        UsageError, match=r"own.toml: \[through\] turns lines from layer to layer, but this job has one layer"
    ):
        check_options(job, ["heat"])
