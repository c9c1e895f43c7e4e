"""Level curves per triangle: where they are, how they join, and which way they run."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.distance.fast_marching import FastMarching, tips_beyond
from geoprint.distance.isolines import isolines
from geoprint.geometry import boundary_source, face_normals, gradient, positions
from geoprint.model import FloatArray, IntArray, ScalarField, Surface, SurfaceCurves, SurfacePoints
from tests.meshes import disc, plate, sphere


def trace(surface: Surface, values: FloatArray, *levels: float) -> tuple[SurfaceCurves, IntArray]:
    return isolines(surface, ScalarField(values), levels=np.array(levels))


def pieces(surface: Surface, curves: SurfaceCurves) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return start, end and face of every piece that does not join two curves."""
    places = positions(surface, curves.points)
    inner = np.ones(len(places) - 1, dtype=np.bool_)
    inner[curves.offsets[1:-1] - 1] = False
    return places[:-1][inner], places[1:][inner], curves.points.faces[:-1][inner]


def test_levels_of_a_linear_function_are_straight_lines() -> None:
    surface = plate((40.0, 30.0), (9, 7), jitter_seed=1)
    curves, levels = trace(surface, surface.vertices[:, 0].copy(), 5.0, 20.0, 35.0)
    assert levels.tolist() == [0, 1, 2]
    assert not curves.closed.any()
    x = positions(surface, curves.points)[:, 0]
    np.testing.assert_allclose(x, np.repeat([5.0, 20.0, 35.0], np.diff(curves.offsets)), atol=1e-12)


def test_levels_of_the_radius_are_closed_rings_of_the_right_length() -> None:
    surface = disc(radius=20.0, rings=40)
    curves, levels = trace(surface, np.linalg.norm(surface.vertices, axis=1), 5.0, 15.0)
    assert curves.closed.all()
    assert levels.tolist() == [0, 1]
    start, end, _ = pieces(surface, curves)
    assert np.linalg.norm(end - start, axis=1).sum() == pytest.approx(2 * np.pi * 20.0, rel=2e-3)


def test_a_closed_curve_repeats_its_first_point() -> None:
    surface = disc(radius=20.0, rings=10)
    curves, _ = trace(surface, np.linalg.norm(surface.vertices, axis=1), 9.3)
    places = positions(surface, curves.points)
    np.testing.assert_allclose(places[0], places[-1], atol=1e-12)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 1000))
def test_larger_values_lie_on_the_left_and_pieces_join_head_to_tail(seed: int) -> None:
    surface = sphere(radius=20.0, subdivisions=3, jitter_seed=seed)
    rng = np.random.default_rng(seed)
    values = np.sin(surface.vertices @ rng.normal(size=3) / 6.0) + 2.0
    curves, levels = trace(surface, values, 1.3, 2.0, 2.6)
    assert curves.closed.all()
    assert (np.diff(levels) >= 0).all()
    start, end, face = pieces(surface, curves)
    left = np.cross(face_normals(surface)[face], end - start)
    rise = np.einsum("ij,ij->i", left, gradient(surface, values)[face])
    assert (rise[np.linalg.norm(end - start, axis=1) > 1e-9] > 0).all()
    interpolated = (values[surface.faces[curves.points.faces]] * curves.points.weights).sum(axis=1)
    wanted = np.repeat(np.array([1.3, 2.0, 2.6])[levels], np.diff(curves.offsets))
    np.testing.assert_allclose(interpolated, wanted, atol=1e-9)


def test_levels_through_vertices_give_one_curve() -> None:
    surface = plate((8.0, 6.0), (8, 6))
    curves, levels = trace(surface, surface.vertices[:, 0].copy(), 3.0)
    assert curves.count == 1
    assert levels.tolist() == [0]
    start, end, _ = pieces(surface, curves)
    assert np.linalg.norm(end - start, axis=1).sum() == pytest.approx(6.0)


def test_flat_triangles_and_untouched_levels_carry_nothing() -> None:
    surface = plate((8.0, 6.0), (8, 6))
    curves, levels = trace(surface, np.full(len(surface.vertices), 2.0), 1.0, 2.0, 3.0)
    assert curves.count == 0
    assert levels.size == 0


def test_what_lies_exactly_at_a_level_counts_as_above_it() -> None:
    # A hill and a hollow with a flat square of 4 mm: the level of the flat runs around it, or above it nowhere.
    surface = plate((8.0, 8.0), (8, 8))
    away = np.abs(surface.vertices[:, :2] - 4.0).max(axis=1)
    curves, _ = trace(surface, np.minimum(4.0 - away, 2.0), 2.0)
    assert curves.count == 1
    assert curves.closed.all()
    start, end, _ = pieces(surface, curves)
    # Its corners may be cut, between vertices that are there.
    assert 12.0 < np.linalg.norm(end - start, axis=1).sum() <= 16.0
    np.testing.assert_allclose(np.abs(start[:, :2] - 4.0).max(axis=1), 2.0, atol=1e-12)
    hollow, _ = trace(surface, np.maximum(away, 2.0), 2.0)
    assert hollow.count == 0


# Corners of level curves on ridges: those beyond the triangle in which the curve turns.


def hinged(angle: float) -> Surface:
    """Return two triangles at an edge along the x axis: one at y > 0, and one turned about the axis by an angle."""
    turned = [1.0, -1.5 * np.cos(angle), -1.5 * np.sin(angle)]
    return Surface(np.array([[0.0, 0, 0], [2, 0, 0], [1, 1.5, 0], turned]), np.array([[1, 2, 0], [0, 3, 1]]))


def tips(
    surface: Surface, *, first: FloatArray, corner: FloatArray, last: FloatArray
) -> tuple[IntArray, SurfacePoints]:
    """Ask for one corner, all given in the plane of the first triangle."""
    a, b, c = surface.vertices[surface.faces[0]][:, :2]
    to_weights = np.linalg.inv(np.array([[*a, 1.0], [*b, 1.0], [*c, 1.0]]).T)
    weights = [np.array([to_weights @ [*place, 1.0]]) for place in (first, corner, last)]
    return tips_beyond(surface, np.array([0]), first=weights[0], corners=weights[1], last=weights[2])


LEFT, RIGHT = np.array([0.5, 0.75]), np.array([1.5, 0.75])


@pytest.mark.parametrize("angle", [0.0, 0.4, -1.2])
def test_a_corner_beyond_a_side_is_reached_through_it_straight_in_the_unfolded_plane(angle: float) -> None:
    surface = hinged(angle)
    piece, points = tips(surface, first=LEFT, corner=np.array([1.0, -0.3]), last=RIGHT)
    np.testing.assert_array_equal(piece, [0, 0, 0])
    reach = 0.5 * 0.3 / 1.05
    wanted = [[1 - reach, 0, 0], [1, -0.3 * np.cos(angle), -0.3 * np.sin(angle)], [1 + reach, 0, 0]]
    np.testing.assert_allclose(positions(surface, points), wanted, atol=1e-12)
    # Each point lies in the face that the curve crosses next.
    np.testing.assert_array_equal(points.faces, [1, 1, 0])


def test_a_corner_beyond_the_next_triangle_too_is_cut_off_at_the_side() -> None:
    _, points = tips(hinged(0.0), first=LEFT, corner=np.array([1.0, -3.0]), last=RIGHT)
    np.testing.assert_allclose(positions(hinged(0.0), points), [[0.6, 0, 0], [1.4, 0, 0]], atol=1e-12)


def test_nothing_is_led_over_the_border_or_from_a_point_on_the_side_itself() -> None:
    surface = hinged(0.0)
    alone = Surface(surface.vertices[:3], surface.faces[:1])
    for part, first in ((alone, LEFT), (surface, np.array([0.5, 0.0]))):
        piece, points = tips(part, first=first, corner=np.array([1.0, -0.3]), last=RIGHT)
        assert piece.size == 0
        assert points.faces.size == 0


@pytest.mark.parametrize("seed", range(3))
def test_inner_level_curves_of_a_plate_reach_most_corners(seed: int) -> None:
    surface = plate((40.0, 30.0), (40, 30), jitter_seed=seed)
    contours = FastMarching(surface).contours(boundary_source(surface), spacing=1.3)
    places = positions(surface, contours.curves.points)
    inset = (np.arange(10) + 0.5) * 1.3
    corners = np.array([[x, y, 0.0] for d in inset for x in (d, 40.0 - d) for y in (d, 30.0 - d)])
    missed = np.linalg.norm(places[:, None] - corners, axis=2).min(axis=0)
    assert np.mean(missed < 0.05) > 0.65
