"""Lines that a field file says, on a surface; and jobs whose fibres follow one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import geoprint
from geoprint.config import FieldFile, job_of
from geoprint.errors import FieldError, UsageError, VerificationError
from geoprint.fibers import DirectionField
from geoprint.fibers.pattern import lines_of
from geoprint.geometry.files import save_ply
from geoprint.model import Surface
from geoprint.workflow import compare, plan, save_plan
from geoprint.workflow.backend_choice import check_options
from tests.fibers.fields_measures import off
from tests.meshes import cylinder_patch, disc, plate, sphere

RIM = "[[preferences]]\nrim = true\n"


def _lines(surface: Surface, **keys: object) -> DirectionField:
    return lines_of(FieldFile.model_validate(keys))(surface)


def _along_axis(field: DirectionField, *axis: float) -> float:
    """Return how far lines are off an axis at most [degrees]."""
    return float(np.degrees(off(field, np.tile(axis, (len(field.angles), 1)))).max())


def test_lines_lean_to_a_direction_a_curvature_and_a_drawn_stroke() -> None:
    flat = plate((20.0, 10.0), (20, 10), jitter_seed=1)
    assert _along_axis(_lines(flat, preferences=[{"direction": [0.6, 0.8, 0.0]}]), 0.6, 0.8, 0.0) < 0.01
    stroke = {"stroke": [[2.0, 2.0, 0.0], [18.0, 8.0, 0.0]], "weight": 500.0}
    assert _along_axis(_lines(flat, preferences=[stroke]), 16.0, 6.0, 0.0) < 0.01
    # Its sides are 7 degrees apart.
    tube = cylinder_patch(jitter_seed=1)
    assert _along_axis(_lines(tube, preferences=[{"curvature": "smallest"}]), 0.0, 1.0, 0.0) < 3.0


def test_lines_have_the_singularities_that_are_asked_for_and_no_others() -> None:
    surface = disc(rings=16, jitter_seed=1)
    halves = [{"place": [x, 0.0, 0.0], "index": 0.5} for x in (-8.0, 8.0)]
    found = _lines(surface, singularities=halves, preferences=[{"rim": True}]).singularities()
    np.testing.assert_array_equal(found.indices, [0.5, 0.5])
    assert np.abs(np.sort(surface.vertices[found.vertices][:, 0]) - [-8.0, 8.0]).max() < 1.5


def test_a_helix_rises_to_the_right_about_its_axis() -> None:
    tube = cylinder_patch(jitter_seed=1)
    field = _lines(tube, helix={"axis": [0.0, 2.0, 0.0], "angle": 30.0})
    middles = tube.vertices[tube.faces].mean(axis=1)
    right = np.cross([0.0, 1.0, 0.0], middles)
    right /= np.linalg.norm(right, axis=1)[:, None]
    wanted = np.cos(np.radians(30.0)) * right + np.sin(np.radians(30.0)) * np.array([0.0, 1.0, 0.0])
    assert np.degrees(off(field, wanted)).max() < 3.0


def test_indices_that_do_not_add_up_on_a_closed_part_are_refused_with_what_they_miss() -> None:
    with pytest.raises(FieldError, match=r"add up to 1.*Euler characteristic"):
        _lines(sphere(), singularities=[{"place": sphere().vertices[0].tolist(), "index": 1.0}])


def test_a_place_off_the_surface_is_refused() -> None:
    stroke = {"stroke": [[1.0, 1.0, 0.0], [5.0, 5.0, 7.0]]}
    with pytest.raises(FieldError, match=r"the point of a stroke 2 of the field, .* lies 7 mm off plate, at most 1 mm"):
        _lines(plate(), preferences=[stroke])


def test_fibres_without_a_field_and_a_field_without_fibres_are_refused(tmp_path: Path) -> None:
    (tmp_path / "field.toml").write_text(RIM)
    alone = job_of(surface="part.ply", spacing=1.0, pattern="fibres")
    with pytest.raises(
        UsageError, match=r"fibres follows a field of lines: give `--field field.toml`; `geoprint init`"
    ):
        check_options(alone, ["heat"])
    other = job_of(surface="part.ply", spacing=1.0, field=tmp_path / "field.toml")
    with pytest.raises(UsageError, match=r"sets which lines fibres follow, but the pattern contours has none"):
        check_options(other, ["heat"])


def test_fibres_are_planned_compared_and_planned_again_to_the_same_bytes(tmp_path: Path) -> None:
    save_ply(plate((16.0, 12.0), (12, 9), jitter_seed=1), tmp_path / "plate.ply")
    (tmp_path / "own.toml").write_text("[[preferences]]\ndirection = [1.0, 0.0, 0.0]\n")
    job = job_of(
        surface=tmp_path / "plate.ply", unit="mm", spacing=2.0, pattern="fibres", field=tmp_path / "own.toml",
        robot=False,
    )  # fmt: skip
    for _, compared in compare(job, backends=["lscm", "heat"]).planned:
        found = compared.plan.uniformity
        assert found is not None
        assert (found.sides.both.mean, found.gap) == (pytest.approx(1.0, abs=1e-4), pytest.approx(0.0, abs=0.01))
        assert found.thickness.cv < 0.01
        assert compared.plan.toolpath.curves.count == 6
        assert compared.plan.followed is not None
        np.testing.assert_allclose(np.abs(compared.plan.followed.directions[:, 0]), 1.0, atol=1e-9)
    save_plan(plan(job), tmp_path / "out")
    (tmp_path / "own.toml").unlink()
    save_plan(plan(geoprint.job_from(tmp_path / "out")), tmp_path / "again")
    assert (tmp_path / "out" / "field.toml").read_text() == "[[preferences]]\ndirection = [1.0, 0.0, 0.0]\n"
    assert (tmp_path / "out" / "manifest.json").read_bytes() == (tmp_path / "again" / "manifest.json").read_bytes()
    with (tmp_path / "out" / "field.toml").open("a") as handle:
        handle.write("\n")
    with pytest.raises(VerificationError, match=r"field.toml: the file was changed after it was written"):
        geoprint.job_from(tmp_path / "out")
