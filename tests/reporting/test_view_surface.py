"""A thinned surface still looks like the surface: its border, its size and the values on it stay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geoprint.geometry import boundary_half_edges, face_areas, half_edges
from geoprint.geometry.files import load
from geoprint.model import IntArray, Surface
from geoprint.reporting import view_surface
from geoprint.reporting.view import with_normals
from tests.meshes import plate
from tests.reporting.report_cases import RADIUS, dome

HEART = Path(__file__).parents[2] / "data" / "heart.ply"


def border(surface: Surface) -> IntArray:
    return np.unique(half_edges(surface.faces)[boundary_half_edges(surface.faces)])


def test_a_small_surface_stays_as_it_is() -> None:
    part = dome(rings=6)
    view = view_surface(part)
    assert view.surface is part
    np.testing.assert_array_equal(view.vertices, np.arange(len(part.vertices)))


@pytest.mark.parametrize("faces", [400, 1500, 4000])
def test_a_large_surface_keeps_to_the_number_of_faces_and_uses_most_of_it(faces: int) -> None:
    view = view_surface(dome(rings=40), faces=faces)
    assert 0.5 * faces < len(view.surface.faces) <= faces


def test_vertices_are_vertices_of_the_original_so_that_values_follow() -> None:
    part = dome(rings=40)
    view = view_surface(part, faces=1500)
    np.testing.assert_array_equal(view.surface.vertices, part.vertices[view.vertices])
    assert len(np.unique(view.vertices)) == len(view.vertices)


def test_the_border_stays_the_border_and_the_area_stays() -> None:
    part = dome(rings=40)
    view = view_surface(part, faces=1500)
    radii = np.hypot(*view.surface.vertices[border(view.surface), :2].T)
    np.testing.assert_allclose(radii, RADIUS)
    assert face_areas(view.surface).sum() == pytest.approx(face_areas(part).sum(), rel=0.02)


def test_all_but_a_few_small_faces_keep_their_outside() -> None:
    view = view_surface(dome(rings=40), faces=1500)
    a, b, c = (view.surface.vertices[view.surface.faces[:, corner]] for corner in range(3))
    doubled = np.cross(b - a, c - a)[:, 2]
    assert -doubled[doubled < 0.0].sum() < 0.005 * doubled.sum()


def test_a_fan_that_is_folded_flat_goes_and_its_neighbour_stays() -> None:
    # Its rim is a line: what two of its faces add the third one takes away, and its hub has no normal.
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0]])
    fan, neighbour = [[0, 1, 3], [1, 2, 3], [0, 3, 2]], [0, 4, 2]
    np.testing.assert_array_equal(with_normals(vertices, np.array([*fan, neighbour])), [neighbour])
    np.testing.assert_array_equal(with_normals(vertices, np.array(fan[:2])), fan[:2])


def test_a_closed_surface_stays_closed() -> None:
    view = view_surface(load(HEART, unit="mm"), faces=5000)
    assert len(view.surface.faces) <= 5000
    assert border(view.surface).size == 0


def test_both_sides_of_a_thin_wall_stay_apart() -> None:
    above = dome(rings=40)
    count = len(above.vertices)
    wall = Surface(
        np.vstack([above.vertices, above.vertices - [0.0, 0.0, 0.05]]),
        np.vstack([above.faces, above.faces[:, ::-1] + count]),
    )
    view = view_surface(wall, faces=2000)
    outer = (view.vertices[view.surface.faces] < count).all(axis=1)
    inner = (view.vertices[view.surface.faces] >= count).all(axis=1)
    np.testing.assert_array_equal(outer | inner, np.ones_like(outer))
    assert min(outer.sum(), inner.sum()) > 500


def test_no_face_of_a_thinned_surface_is_without_area() -> None:
    # On a plate whose vertices stand in a grid many clusters lie on a line.
    thinned = view_surface(plate((20.0, 20.0), (60, 60)), faces=3000).surface
    assert len(thinned.faces) <= 3000
    assert face_areas(thinned).min() > 1e-6
