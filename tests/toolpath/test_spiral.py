"""The spiral: one stroke a piece, Archimedes' on a flat disc, and refusals where rings have no one middle."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.distance import BACKENDS
from geoprint.errors import FieldError, UsageError
from geoprint.geometry import boundary_source, point_source, united
from geoprint.model import FloatArray, Paths, ScalarField, Surface
from geoprint.toolpath import PATTERNS
from tests.meshes import annulus, disc, plate, sphere


def _spiral(surface: Surface, *, spacing: float, **options: float) -> Paths:
    source = boundary_source(surface)
    return PATTERNS["spiral"](**options).paths(surface, source, backend=BACKENDS["heat"](surface), spacing=spacing)


def _polar(line: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return radius [mm] and turns from the start."""
    turns = np.unwrap(np.arctan2(line[:, 1], line[:, 0])) / (2.0 * np.pi)
    return np.hypot(line[:, 0], line[:, 1]), np.abs(turns - turns[0])


def test_on_a_flat_disc_it_is_the_spiral_of_archimedes() -> None:
    surface = disc(radius=10.0, rings=40)
    paths = _spiral(surface, spacing=1.0, rise=0.0)
    assert paths.curves.count == 1
    radius, turns = _polar(paths.curves.xyz(surface, 0))
    outer = radius > 1.0
    np.testing.assert_allclose(radius[outer], (9.5 - turns)[outer], atol=0.03)
    assert radius[-1] < 0.7
    np.testing.assert_allclose(paths.row[outer], turns[outer], atol=0.03)


def test_the_first_turn_follows_the_rim_and_rows_rise_by_one_a_turn() -> None:
    surface = disc(radius=10.0, rings=40)
    paths = _spiral(surface, spacing=1.0)
    assert paths.curves.count == 1
    radius, turns = _polar(paths.curves.xyz(surface, 0))
    early = turns < 0.8
    assert np.abs(radius[early] - 9.5).max() < 0.1
    assert np.diff(paths.row).min() > -0.01
    opposite = np.interp(np.arange(8) + 0.5, turns, paths.row)
    np.testing.assert_allclose(np.diff(opposite), 1.0, atol=0.1)


def test_neighbouring_turns_lie_one_spacing_apart() -> None:
    surface = disc(radius=10.0, rings=40)
    radius, turns = _polar(_spiral(surface, spacing=1.0).curves.xyz(surface, 0))
    at = np.linspace(0.0, 7.0, 701)
    apart = np.interp(at, turns, radius) - np.interp(at + 1.0, turns, radius)
    assert np.abs(apart - 1.0).max() < 0.1
    assert apart.std() < 0.03


def test_pieces_have_a_stroke_each() -> None:
    left, right = disc(radius=6.0, rings=20), disc(radius=5.0, rings=20)
    aside = Surface(right.vertices + np.array([20.0, 0.0, 0.0]), right.faces)
    paths = _spiral(united([left, aside]), spacing=1.0)
    assert paths.curves.count == 2
    assert not paths.curves.closed.any()
    np.testing.assert_array_equal(paths.levels, [0, 0])


def test_on_a_closed_part_it_winds_from_a_point_to_the_other_side() -> None:
    surface = sphere(radius=10.0, subdivisions=5)
    source = point_source(surface, np.array([0.0, 0.0, 10.0]), tolerance=0.5)
    paths = PATTERNS["spiral"]().paths(surface, source, backend=BACKENDS["heat"](surface), spacing=2.0)
    assert paths.curves.count == 1
    line = paths.curves.xyz(surface, 0)
    radius, turns = np.hypot(line[:, 0], line[:, 1]), _polar(line)[1]
    away = 10.0 * np.arctan2(radius, line[:, 2])
    middle = (away > 5.0) & (away < 27.0)
    slope, start = np.polyfit(turns[middle], away[middle], 1)
    assert slope == pytest.approx(2.0, abs=0.03)
    np.testing.assert_allclose(away[middle], (start + slope * turns)[middle], atol=0.15)


def test_it_covers_a_plate_with_sharp_corners_in_one_stroke() -> None:
    surface = plate((20.0, 12.0), divisions=(80, 48))
    paths = _spiral(surface, spacing=1.0)
    line = paths.curves.xyz(surface, 0)
    length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    assert not paths.curves.closed[0]
    assert length == pytest.approx(20.0 * 12.0 / 1.0, rel=0.04)


@pytest.mark.parametrize("inner", [4.0, 8.0])
def test_a_part_with_a_hole_is_refused(inner: float) -> None:
    surface = annulus(inner=inner, outer=16.0, divisions=(60, 20))
    with pytest.raises(UsageError, match="has 2 borders"):
        _spiral(surface, spacing=1.0)


def test_rings_about_two_middles_are_refused() -> None:
    surface = disc(radius=10.0, rings=40)
    waisted = surface.vertices * np.array([1.0, 0.0, 0.0])
    waist = surface.vertices[:, 1] * (0.3 + 0.7 * (surface.vertices[:, 0] / 10.0) ** 2) * 0.9
    wide = Surface(waisted * 2.0 + np.outer(waist, [0.0, 1.0, 0.0]), surface.faces)
    with pytest.raises(UsageError, match="form several sets of rings"):
        _spiral(wide, spacing=1.0)


def test_a_spacing_too_wide_or_uneven_and_a_negative_rise_are_refused() -> None:
    surface = disc(radius=10.0, rings=10)
    with pytest.raises(FieldError, match="choose a spacing below"):
        _spiral(surface, spacing=30.0)
    with pytest.raises(UsageError, match="or choose the pattern fibres"):
        PATTERNS["spiral"]().paths(
            surface,
            boundary_source(surface),
            backend=BACKENDS["heat"](surface),
            spacing=ScalarField(np.ones(len(surface.vertices))),
        )
    with pytest.raises(UsageError, match="rise is -1"):
        PATTERNS["spiral"](rise=-1.0)


# Contours as paths: a row a level, and a spacing that is the same everywhere.


def test_a_stroke_is_a_level_curve_and_its_row_the_level() -> None:
    surface = annulus(inner=10.0, outer=24.0, divisions=(60, 20))
    backend, source = BACKENDS["heat"](surface), boundary_source(surface)
    contours = backend.contours(source, spacing=2.0)
    paths = PATTERNS["contours"]().paths(surface, source, backend=backend, spacing=2.0)
    np.testing.assert_array_equal(paths.curves.points.weights, contours.curves.points.weights)
    np.testing.assert_array_equal(paths.levels, contours.levels)
    assert paths.row.size == paths.curves.points.faces.size
    assert set(paths.row.tolist()) == set(contours.levels.tolist())
    assert (paths.spacing == 2.0).all()
    assert (paths.width == 1.0).all()


def test_contours_refuse_a_spacing_that_differs_from_place_to_place() -> None:
    surface = annulus(inner=10.0, outer=24.0, divisions=(60, 20))
    field = ScalarField(np.full(len(surface.vertices), 2.0))
    with pytest.raises(UsageError, match="or choose the pattern fibres"):
        PATTERNS["contours"]().paths(
            surface, boundary_source(surface), backend=BACKENDS["heat"](surface), spacing=field
        )
