"""Corners of level curves on ridges: those beyond the triangle in which the curve turns."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.distance.fast_marching import FastMarching, tips_beyond
from geoprint.geometry import boundary_seed, positions
from geoprint.model import FloatArray, IntArray, Surface, SurfacePoints
from tests.meshes import plate


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
    contours = FastMarching(surface).contours(boundary_seed(surface), spacing=1.3)
    places = positions(surface, contours.curves.points)
    inset = (np.arange(10) + 0.5) * 1.3
    corners = np.array([[x, y, 0.0] for d in inset for x in (d, 40.0 - d) for y in (d, 30.0 - d)])
    missed = np.linalg.norm(places[:, None] - corners, axis=2).min(axis=0)
    assert np.mean(missed < 0.05) > 0.65
