"""Lines at an angle: sections of known shapes, of layers and of parts with holes, and rows beside them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of
from geoprint.errors import FieldError, UsageError
from geoprint.geometry import pieces, turned_over, united
from geoprint.geometry.files import save_ply
from geoprint.model import FloatArray, Surface
from geoprint.workflow import plan
from geoprint.workflow.sources import section_seed, seed_of
from tests.meshes import annulus, cylinder_patch, plate, sphere, spherical_cap


def _section(surface: Surface, angle: float, base: Surface | None = None) -> list[FloatArray]:
    curves = section_seed(surface, angle_deg=angle, base=base or surface).curves
    return [curves.xyz(surface, curve) for curve in range(curves.count)]


def _slope(line: FloatArray) -> float:
    """Return the direction of a line as it is seen from above [degrees], from -90 to 90."""
    x, y, _ = line[-1] - line[0]
    return float(np.degrees(np.arctan2(y, x)) + 90.0) % 180.0 - 90.0


@pytest.mark.parametrize("angle", [0.0, 30.0, -45.0, 89.0])
def test_the_line_over_a_plate_is_straight_goes_through_its_middle_and_has_the_angle(angle: float) -> None:
    (line,) = _section(plate((20.0, 12.0), (20, 12), jitter_seed=1), angle)
    assert _slope(line) == pytest.approx(angle, abs=1e-9)
    direction = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
    off = np.cross(line - [10.0, 6.0, 0.0], direction)
    assert np.abs(off).max() < 1e-9
    # From rim to rim.
    assert (np.isclose(line[[0, -1]], 0.0) | np.isclose(line[[0, -1]], [20.0, 12.0, 99.0])).any(axis=1).all()


def test_seen_from_the_other_side_the_angle_counts_the_other_way() -> None:
    (line,) = _section(turned_over(plate((20.0, 12.0), (20, 12))), 30.0)
    assert _slope(line) == pytest.approx(-30.0, abs=1e-9)


def test_a_plane_along_edges_has_each_vertex_once() -> None:
    (line,) = _section(plate((20.0, 12.0), (20, 12)), 90.0)
    assert np.linalg.norm(np.diff(line, axis=0), axis=1).min() > 0.1
    np.testing.assert_allclose(line[:, 0], 10.0, atol=1e-9)


def test_over_a_cylinder_the_line_lies_in_its_plane_and_on_the_triangles() -> None:
    radius, around = 12.0, 60
    part = cylinder_patch(radius=radius, angle=1.4, length=30.0, divisions=(around, 40))
    (line,) = _section(part, 45.0)
    x, y, z = line.T
    np.testing.assert_allclose(y - 15.0, x, atol=1e-9)
    # On the chords of the facets, which lie so deep within the cylinder.
    deep = radius - np.hypot(x, z)
    assert deep.min() > -1e-9
    assert deep.max() < radius * (1.0 - np.cos(0.7 / around)) + 1e-9
    # Along the axis and around it the line is one of the cylinder's own.
    (along,), (across,) = _section(part, 90.0), _section(part, 0.0)
    np.testing.assert_allclose(along[:, [0, 2]], [[0.0, radius]] * len(along), atol=1e-9)
    np.testing.assert_allclose(across[:, 1], 15.0, atol=1e-9)


def test_a_layer_has_the_plane_of_the_part_below_it() -> None:
    base = spherical_cap(radius=20.0, angle=0.6, rings=12)
    level = Surface(1.1 * base.vertices[:, [1, 0, 2]] * [1.0, -1.0, 1.0] + [0.0, 0.3, 0.0], base.faces, "level")
    (line,) = _section(level, 0.0, base)
    np.testing.assert_allclose(line[:, 1], 0.0, atol=1e-9)
    (own,) = _section(level, 0.0)
    np.testing.assert_allclose(own[:, 1], 0.3, atol=1e-9)


def test_a_piece_beside_the_plane_gets_a_parallel_one_through_its_own_middle() -> None:
    base = plate((20.0, 12.0), (20, 12))
    corner = Surface(0.2 * base.vertices + [1.0, 8.0, 1.0], base.faces, "island")
    (line,) = _section(corner, 0.0, base)
    np.testing.assert_allclose(line[:, 1], 9.2, atol=1e-9)


def test_a_part_with_a_hole_has_a_line_on_either_side_of_it_and_several_patches_one_each() -> None:
    ring = annulus(inner=6.0, outer=20.0, divisions=(72, 12))
    lines = _section(ring, 20.0)
    assert sorted(round(float(np.linalg.norm(line[-1] - line[0])), 2) for line in lines) == pytest.approx([14.0, 14.0])
    both = united([ring, Surface(ring.vertices + np.array([50.0, 3.0, 0.0]), ring.faces)])
    seed = seed_of(job_of(surface="a.ply", source="angle:0"), both)
    heights = [piece.own(seed.curves).xyz(piece.surface, 0)[:, 1] for piece in pieces(both)]
    np.testing.assert_allclose([np.ptp(each) for each in heights], 0.0, atol=1e-9)
    assert [float(each[0]) for each in heights] == pytest.approx([0.0, 3.0], abs=1e-9)


@pytest.mark.parametrize("backend", ["heat", "lscm"])
def test_rows_at_an_angle_cover_a_part_with_a_hole(tmp_path: Path, backend: str) -> None:
    path = tmp_path / "ring.ply"
    save_ply(annulus(inner=5.0, outer=16.0), path)
    asked = {"surface": path, "unit": "mm", "spacing": 1.5, "robot": False, "backend": backend}
    found = plan(job_of(**asked, pattern="guided", source="angle:30"))
    # Where rows turn at a rim they leave corners: 4 % of such a disc without a hole.
    assert found.uniformity is not None
    assert found.uniformity.gap < 0.08
    # Beside the two lines rows are as straight as these, half a spacing and whole ones away.
    places, rows = found.toolpath.curves.points.xyz(found.workpiece.surface), found.toolpath.rows
    along = np.array([np.cos(np.radians(30.0)), np.sin(np.radians(30.0)), 0.0])
    beside = (np.abs(places @ along) > 6.0) & (np.linalg.norm(places, axis=1) < 13.5) & (rows % 1.0 == 0.0)
    off = np.abs(places @ [-along[1], along[0], 0.0]) - 1.5 * (rows + 0.5)
    assert beside.sum() > 100
    assert np.abs(off[beside]).max() < 0.05


def test_a_part_that_faces_all_ways_has_no_angle() -> None:
    surface = sphere(radius=5.0, subdivisions=2)
    with pytest.raises(FieldError, match="has no mean normal to count an angle about"):
        section_seed(surface, angle_deg=45.0, base=surface)


def test_an_angle_beyond_half_a_turn_is_refused() -> None:
    with pytest.raises(UsageError, match=r"source.angle: input should be less than or equal to 180"):
        job_of(surface="a.ply", source="angle:200")
