"""Resampling keeps its two promises, the step and the chord error, and stays on the surface."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.distance import BACKENDS
from geoprint.distance.isolines import isolines
from geoprint.errors import UsageError
from geoprint.geometry import arc_lengths, boundary_source, closest, positions
from geoprint.model import FloatArray, Paths, ScalarField, Surface, SurfacePoints
from geoprint.toolpath import PATTERNS
from geoprint.toolpath.resample import interpolate, resample
from tests.meshes import annulus, disc, plate, spherical_cap


def ring(surface: Surface, level: float) -> SurfacePoints:
    values = np.linalg.norm(surface.vertices[:, :2], axis=1)
    return isolines(surface, ScalarField(values), levels=np.array([level]))[0].points


def distance_to_polyline(points: FloatArray, line: FloatArray) -> FloatArray:
    start, along = line[:-1], np.diff(line, axis=0)
    share = np.einsum("kij,ij->ki", points[:, None] - start, along) / np.einsum("ij,ij->i", along, along)
    nearest = start + np.clip(share, 0, 1)[..., None] * along
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)


@settings(max_examples=20, deadline=None)
@given(step=st.floats(0.2, 5.0), chord_error=st.floats(0.001, 0.5), level=st.floats(2.0, 18.0))
def test_step_and_chord_error_are_bounded(step: float, chord_error: float, level: float) -> None:
    surface = spherical_cap(radius=30.0, angle=0.8, rings=25, jitter_seed=4)
    points = ring(surface, level)
    found = positions(surface, resample(surface, points, step=step, chord_error=chord_error))
    original = positions(surface, points)
    assert np.linalg.norm(np.diff(found, axis=0), axis=1).max() <= step * (1 + 1e-9)
    assert distance_to_polyline(original, found).max() <= chord_error * (1 + 1e-9)
    assert distance_to_polyline(found, original).max() < 1e-9
    np.testing.assert_allclose(found[[0, -1]], original[[0, -1]], atol=1e-12)


def test_sharp_corners_are_kept_as_samples() -> None:
    surface = plate((40.0, 30.0), (40, 30))
    x, y = surface.vertices[:, 0], surface.vertices[:, 1]
    values = np.minimum(np.minimum(x, 40 - x), np.minimum(y, 30 - y))
    points = isolines(surface, ScalarField(values), levels=np.array([5.5]))[0].points
    found = positions(surface, resample(surface, points, step=1.7, chord_error=1e-3))
    for corner in ([5.5, 5.5, 0], [34.5, 5.5, 0], [34.5, 24.5, 0], [5.5, 24.5, 0]):
        assert np.linalg.norm(found - corner, axis=1).min() < 1e-9


def test_samples_between_triangles_that_share_nothing_land_on_the_surface() -> None:
    surface = spherical_cap(rings=12)
    points, _ = closest(surface, surface.vertices[[3, 60, 200]] + [0.2, 0.1, 0.0])
    middle = interpolate(surface, points, np.array([0, 1]), np.array([1, 2]), np.array([0.5, 0.5]))
    places, ends = positions(surface, middle), positions(surface, points)
    chords = 0.5 * (ends[:-1] + ends[1:])
    _, distance = closest(surface, chords)
    np.testing.assert_allclose(np.linalg.norm(places - chords, axis=1), distance, atol=1e-9)


def test_a_reversed_curve_is_interpolated_inside_its_triangles_as_well() -> None:
    surface = disc(rings=20, jitter_seed=1)
    points = ring(surface, 7.3)
    backwards = SurfacePoints(points.faces[::-1], points.weights[::-1])
    there = positions(surface, resample(surface, points, step=0.5, chord_error=0.01))
    back = positions(surface, resample(surface, backwards, step=0.5, chord_error=0.01))
    np.testing.assert_allclose(distance_to_polyline(back, there).max(), 0.0, atol=0.02)
    assert distance_to_polyline(back, positions(surface, points)).max() < 1e-9


def test_repeated_points_do_no_harm() -> None:
    surface = plate((8.0, 6.0), (8, 6))
    points = isolines(surface, ScalarField(surface.vertices[:, 0].copy()), levels=np.array([3.0]))[0].points
    found = positions(surface, resample(surface, points, step=0.7, chord_error=0.01))
    assert np.diff(arc_lengths(found)).min() > 0.1
    assert arc_lengths(found)[-1] == pytest.approx(6.0)


def test_the_ends_of_a_chord_between_triangles_that_share_nothing_stay_what_they_are() -> None:
    surface = spherical_cap(rings=12)
    points = SurfacePoints(np.array([0, 200]), np.array([[0.2, 0.3, 0.5], [0.6, 0.3, 0.1]]))
    found = interpolate(surface, points, np.array([0, 0]), np.array([1, 1]), np.array([0.0, 1.0]))
    np.testing.assert_array_equal(found.faces, points.faces)
    np.testing.assert_allclose(found.weights, points.weights, atol=1e-15)


def test_a_curve_that_skips_triangles_is_left_by_no_sample_further_than_its_chords_are_from_the_surface() -> None:
    surface = disc(rings=20, jitter_seed=1)
    angle = np.linspace(0.0, 2.0 * np.pi, 60)
    points, _ = closest(surface, np.column_stack([9.0 * np.cos(angle), 9.0 * np.sin(angle), 0.0 * angle]))
    found = positions(surface, resample(surface, points, step=0.4, chord_error=0.01))
    assert distance_to_polyline(found, positions(surface, points)).max() < 1e-9


# The middle on shapes of known width: every bead lies at its share of it, on the ridge itself where they are odd.


INNER = 10.0


def paths(surface: Surface, *, middle: str, spacing: float = 1.0) -> Paths:
    backend = BACKENDS["fast-marching"](surface)
    return PATTERNS["contours"](middle=middle).paths(
        surface, boundary_source(surface), backend=backend, spacing=spacing
    )


def radii(drawn: Paths, surface: Surface) -> list[FloatArray]:
    places = positions(surface, drawn.curves.points)
    return np.split(np.linalg.norm(places, axis=1), drawn.curves.offsets[1:-1])


@pytest.mark.parametrize(
    ("width", "beads"),
    [
        # Three level curves on either side leave 0.9 spacings to the ridge: one bead more lies on it.
        (6.8, 7),
        # Four on either side leave 0.2 spacings: the two innermost become one.
        (7.4, 7),
        # Four leave 0.3 spacings: they only move.
        (7.6, 8),
        (8.4, 8),
    ],
)
def test_beads_share_the_width_of_a_ring(width: float, beads: int) -> None:
    ring = annulus(inner=INNER, outer=INNER + width, divisions=(180, 28))
    drawn = paths(ring, middle="fitted")
    found = sorted(float(line.mean()) for line in radii(drawn, ring))
    wanted = INNER + (np.arange(beads) + 0.5) * width / beads
    np.testing.assert_allclose(found, wanted, atol=0.02)
    assert max(float(np.ptp(line)) for line in radii(drawn, ring)) < 0.05
    assert drawn.curves.closed.all()
    # On either side levels count inwards; a bead on the ridge has the level that it would have there.
    assert sorted(drawn.levels.tolist()) == sorted(min(bead, beads - 1 - bead) for bead in range(beads))


def test_contours_are_plain_unless_the_middle_is_fitted() -> None:
    ring = annulus(inner=INNER, outer=INNER + 6.8, divisions=(180, 28))
    drawn = paths(ring, middle="plain")
    assert drawn.curves.count == 6
    np.testing.assert_allclose(
        sorted(float(line.mean()) for line in radii(drawn, ring)), [10.5, 11.5, 12.5, 14.3, 15.3, 16.3], atol=0.01
    )


def test_contours_stay_as_they_were_traced_where_a_whole_number_fits() -> None:
    round_part = disc(radius=10.0, rings=30)
    plain, fitted = (paths(round_part, middle=middle) for middle in ("plain", "fitted"))
    assert fitted.curves.count == plain.curves.count
    for before, after in zip(radii(plain, round_part), radii(fitted, round_part), strict=True):
        assert after.mean() == pytest.approx(before.mean(), abs=0.12)


def test_tips_of_square_corners_reach_outwards_and_those_beside_the_rim_stay() -> None:
    square = plate((12.4, 12.4), (40, 40))
    plain, fitted = (paths(square, middle=middle) for middle in ("plain", "fitted"))
    for level, reach in ((0, 0.0), (1, 0.086), (2, 0.086)):
        tips: list[float] = []
        for drawn in (plain, fitted):
            places = positions(square, drawn.curves.points)
            which = np.flatnonzero(drawn.levels == level)[0]
            line = places[slice(*drawn.curves.offsets[which : which + 2])]
            tips.append(float(np.linalg.norm(line[:, :2], axis=1).min()))
        # From the corner at the origin: half of a right angle, (1 - 0.55 (1 + sin 45)) / sin 45 = 0.086 spacings.
        assert tips[0] - tips[1] == pytest.approx(reach, abs=0.035), level


def test_an_unknown_middle_is_refused() -> None:
    with pytest.raises(UsageError, match="no `middle` 'wide'; choose one of: plain, fitted"):
        PATTERNS["contours"](middle="wide")
