"""Marching squares against a plain sixteen-case table, and against contourpy, which draws one level after the other."""

from __future__ import annotations

from itertools import pairwise

import contourpy
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.ndimage import gaussian_filter, map_coordinates

from geoprint.distance.lscm_raster import level_lines
from geoprint.model import FloatArray

# Corners of a cell in the order of the paper's table: bit 1 (row, column), 2 (row, column + 1), 4 (row + 1,
# column + 1), 8 (row + 1, column); edges 0 bottom, 1 right, 2 top, 3 left. Each case lists pairs of edges.
SIXTEEN_CASES: dict[int, list[tuple[int, int]]] = {
    0: [], 1: [(0, 3)], 2: [(0, 1)], 3: [(1, 3)], 4: [(1, 2)], 6: [(0, 2)], 7: [(2, 3)],
    8: [(2, 3)], 9: [(0, 2)], 11: [(1, 2)], 12: [(1, 3)], 13: [(0, 1)], 14: [(0, 3)], 15: [],
}  # fmt: skip
SADDLES: dict[tuple[int, bool], list[tuple[int, int]]] = {
    (5, True): [(0, 1), (2, 3)], (5, False): [(0, 3), (1, 2)],
    (10, True): [(0, 3), (1, 2)], (10, False): [(0, 1), (2, 3)],
}  # fmt: skip


def marching_squares(values: FloatArray, level: float) -> set[frozenset[tuple[float, float]]]:
    """Return the pieces (x, y) of a level curve by the 16-case table, cell by cell: slow and plain."""
    pieces: set[frozenset[tuple[float, float]]] = set()
    for row in range(values.shape[0] - 1):
        for column in range(values.shape[1] - 1):
            corners = [(row, column), (row, column + 1), (row + 1, column + 1), (row + 1, column)]
            z = [float(values[corner]) for corner in corners]
            case = sum(1 << i for i in range(4) if z[i] > level)
            pairs = SADDLES[case, sum(z) / 4 > level] if case in {5, 10} else SIXTEEN_CASES[case]
            for pair in pairs:
                ends: list[tuple[float, float]] = []
                for edge in pair:
                    i, j = edge, (edge + 1) % 4
                    share = (level - z[i]) / (z[j] - z[i])
                    y, x = (corners[i][k] + share * (corners[j][k] - corners[i][k]) for k in range(2))
                    ends.append((round(x, 9), round(y, 9)))
                pieces.add(frozenset(ends))
    return pieces


@pytest.mark.parametrize("smooth", [True, False], ids=["smooth", "noise"])
def test_level_curves_of_fifty_images_are_those_of_the_sixteen_case_table(*, smooth: bool) -> None:
    saddles = 0
    for seed in range(50):
        noise = np.random.default_rng(seed).normal(size=(12, 15))
        values = gaussian_filter(noise, 1.5) if smooth else noise
        level = 0.1 * float(values.std())
        found = {
            frozenset((round(float(x), 9), round(float(y), 9)) for x, y in piece)
            for line in level_lines([(0, values)], levels=np.array([level]))[0]
            for piece in pairwise(line)
        }
        assert found == marching_squares(values, level)
        above = values > level
        saddles += int(((above[:-1, :-1] == above[1:, 1:]) & (above[:-1, :-1] != above[:-1, 1:])
                        & (above[1:, :-1] == above[:-1, 1:])).sum())  # fmt: skip
    assert smooth or saddles > 500


@pytest.mark.parametrize("smooth", [True, False], ids=["smooth", "noise"])
def test_larger_values_lie_on_the_left_of_every_piece(*, smooth: bool) -> None:
    for seed in range(50):
        noise = np.random.default_rng(seed).normal(size=(12, 15))
        values = gaussian_filter(noise, 1.5) if smooth else noise
        for line in level_lines([(0, values)], levels=np.array([0.1 * float(values.std())]))[0]:
            along = np.diff(line, axis=0)
            lengths = np.linalg.norm(along, axis=1)
            middles, left = line[:-1] + 0.5 * along, np.column_stack([-along[:, 1], along[:, 0]])
            step = 1e-6 * left[lengths > 1e-6] / lengths[lengths > 1e-6, None]
            left, right = (
                map_coordinates(values, (middles[lengths > 1e-6] + side * step).T[::-1], order=1, mode="nearest")
                for side in (1.0, -1.0)
            )
            assert (left > right).all()


def test_a_closed_level_curve_repeats_its_first_point_and_one_that_leaves_the_image_does_not() -> None:
    x, y = np.meshgrid(np.arange(21.0), np.arange(21.0))
    circles = level_lines([(0, np.hypot(x - 10, y - 10))], levels=np.array([4.0, 12.0]))
    assert [len(lines) for lines in circles] == [1, 4]
    assert (circles[0][0][0] == circles[0][0][-1]).all()
    assert not (circles[1][0][0] == circles[1][0][-1]).all()


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), rough=st.booleans(), rounded=st.booleans(), rows=st.integers(1, 30))
def test_bands_with_holes_give_the_lines_of_contourpy_point_by_point(
    *, seed: int, rough: bool, rounded: bool, rows: int
) -> None:
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(23, 31))
    values = noise if rough else gaussian_filter(noise, 1.5)
    levels = np.sort(rng.normal(size=7)) * float(values.std())
    if rounded:
        # Many corners at a level, and plateaus.
        values, levels = np.round(values, 1), np.array(sorted(set(np.round(levels, 1).tolist())))
    known = gaussian_filter(rng.normal(size=values.shape), 2.0) > -0.1
    generator = contourpy.contour_generator(
        z=np.ma.masked_array(values, ~known), name="serial", corner_mask=False, line_type="Separate"
    )
    patchy = np.where(known, values, np.nan)
    bands = [(first, patchy[first : first + rows + 1]) for first in range(0, 22, rows)]
    for level, found in zip(levels.tolist(), level_lines(bands, levels=levels), strict=True):
        for one, other in zip(found, generator.lines(level), strict=True):
            np.testing.assert_array_equal(one, other)


def test_a_level_that_touches_nothing_has_no_line() -> None:
    values = np.add.outer(np.arange(5.0), np.arange(6.0))
    assert [len(lines) for lines in level_lines([(0, values)], levels=np.array([-1.0, 3.5, 9.0]))] == [0, 1, 0]
