"""Fibres of layers: lines of the part carried into its layers, turned from layer to layer, and planned again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import geoprint
from geoprint.config import job_of
from geoprint.errors import UsageError
from geoprint.geometry.files import save_ply
from geoprint.model import FloatArray
from geoprint.results import Plan
from geoprint.workflow import compare, plan, plan_stack, save_plan
from geoprint.workflow.backend_choice import check_options
from tests.meshes import cylinder_patch, disc, plate
from tests.workflow.layers_here import planning_here

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
    with planning_here():
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
        UsageError, match=r"own.toml: \[through\] turns lines from layer to layer, but there is a single"
    ):
        check_options(job, ["heat"])
