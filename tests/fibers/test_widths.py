"""Strokes whose spacing differs from place to place: known answers on a plate, where rows have to end, and refusals."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.distance import BACKENDS
from geoprint.errors import InputError
from geoprint.fibers import AlongDirection, smoothest_field
from geoprint.fibers.pattern import LAYINGS, FibrePattern
from geoprint.geometry import boundary_source
from geoprint.model import FloatArray, Paths, ScalarField, Surface
from tests.fibers.fibres_measures import crossings, lines
from tests.meshes import plate

LEAST, MOST, SIZE = 0.8, 1.6, (12.0, 30.0)


def _plate() -> Surface:
    return plate(SIZE, (24, 60), jitter_seed=1)


def _strokes(surface: Surface, spacing: float | FloatArray, *, laying: str) -> Paths:
    field = smoothest_field(surface, symmetry=2, preferences=[AlongDirection(np.array([1.0, 0.0, 0.0]))])
    wanted = ScalarField(spacing) if isinstance(spacing, np.ndarray) else spacing
    pattern = FibrePattern(field=lambda _: field, laying=laying)
    return pattern.paths(surface, boundary_source(surface), backend=BACKENDS["heat"](surface), spacing=wanted)


def _rising(heights: FloatArray, *, over: float) -> FloatArray:
    return LEAST + (MOST - LEAST) * heights / over


@pytest.mark.parametrize("laying", LAYINGS)
def test_where_the_width_rises_across_the_lines_rows_are_as_far_apart_as_it_is(laying: str) -> None:
    surface = _plate()
    paths = _strokes(surface, _rising(surface.vertices[:, 1], over=SIZE[1]), laying=laying)
    drawn = lines(surface, paths)
    assert max(float(np.ptp(line[:, 1])) for line in drawn) < 0.01
    np.testing.assert_allclose([float(np.ptp(line[:, 0])) for line in drawn], SIZE[0], atol=1e-3)
    heights = np.sort([float(line[:, 1].mean()) for line in drawn])
    # The last row of streamlines has whatever is left.
    ratios = (np.diff(heights) / _rising((heights[1:] + heights[:-1]) / 2, over=SIZE[1]))[:-1]
    np.testing.assert_allclose(ratios, 1.0, atol=0.025)
    # As many rows as one over the width adds up to.
    wanted = SIZE[1] / (MOST - LEAST) * np.log(MOST / LEAST)
    assert paths.curves.count == pytest.approx(wanted, abs=1.0)
    here = paths.curves.points.xyz(surface)[:, 1]
    np.testing.assert_allclose(paths.spacing, _rising(here, over=SIZE[1]), rtol=1e-6)


@pytest.mark.parametrize(("laying", "within"), [("stripes", 0.1), ("streamlines", 0.3)])
def test_where_the_width_rises_along_the_lines_rows_end_and_none_cross(laying: str, within: float) -> None:
    long, high = 40.0, 16.0
    surface = plate((long, high), (80, 32), jitter_seed=1)
    paths = _strokes(surface, _rising(surface.vertices[:, 0], over=long), laying=laying)
    assert crossings(surface, paths.curves) == 0
    drawn = lines(surface, paths)
    for x in (12.0, 20.0, 28.0):
        passing = sum(float(line[:, 0].min()) < x < float(line[:, 0].max()) for line in drawn)
        assert passing == pytest.approx(high / (LEAST + (MOST - LEAST) * x / long), rel=within)


@pytest.mark.parametrize("laying", LAYINGS)
def test_the_same_width_at_each_vertex_is_one_spacing(laying: str) -> None:
    surface = plate((12.0, 8.0), (24, 16), jitter_seed=1)
    one, each = (_strokes(surface, wanted, laying=laying) for wanted in (1.0, np.ones(len(surface.vertices))))
    np.testing.assert_array_equal(one.curves.points.xyz(surface), each.curves.points.xyz(surface))
    np.testing.assert_array_equal(one.spacing, each.spacing)


@pytest.mark.parametrize("wrong", [np.ones(3), np.zeros(9)])
def test_a_spacing_that_is_not_one_above_nothing_a_vertex_is_refused(wrong: FloatArray) -> None:
    surface = plate((2.0, 2.0), (2, 2))
    with pytest.raises(InputError, match=rf"at each vertex of plate is 9 numbers above 0 mm, found {wrong.size} from"):
        _strokes(surface, wrong, laying="stripes")
