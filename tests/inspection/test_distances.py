"""The Hausdorff distance is a metric, agrees with its definition, and the figures beside it hide nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from geoprint.errors import InputError
from geoprint.inspection import apart
from geoprint.model import FloatArray

POINTS = st.integers(1, 12).flatmap(lambda n: arrays(np.float64, (n, 2), elements=st.floats(-50, 50, width=32)))


def by_definition(first: FloatArray, second: FloatArray) -> float:
    table = np.linalg.norm(first[:, None, :] - second[None, :, :], axis=2)
    return float(max(table.min(axis=1).max(), table.min(axis=0).max()))


@given(POINTS, POINTS)
@settings(max_examples=100)
def test_it_is_what_the_paper_defines_and_the_same_both_ways(first: FloatArray, second: FloatArray) -> None:
    distances, back = apart(first, second), apart(second, first)
    assert distances.hausdorff == pytest.approx(by_definition(first, second), abs=1e-9)
    assert back.hausdorff == distances.hausdorff
    assert (back.there, back.back) == (distances.back, distances.there)
    for side in (distances.there, distances.back):
        assert 0.0 <= side.mean <= side.largest + 1e-12
        assert side.p95 <= side.largest + 1e-12


@given(POINTS, POINTS, POINTS)
@settings(max_examples=100)
def test_it_is_zero_of_a_set_with_itself_and_no_detour_is_shorter(
    first: FloatArray, second: FloatArray, third: FloatArray
) -> None:
    assert apart(first, first).hausdorff == 0.0
    direct = apart(first, third).hausdorff
    assert direct <= apart(first, second).hausdorff + apart(second, third).hausdorff + 1e-9


def test_one_stray_point_spoils_the_largest_and_not_the_others() -> None:
    line = np.column_stack([np.arange(100.0), np.zeros(100)])
    spoiled = np.vstack([line, [[50.0, 40.0]]])
    distances = apart(line, spoiled)
    assert distances.hausdorff == pytest.approx(40.0)
    assert (distances.there.largest, distances.p95) == (0.0, 0.0)
    assert distances.back.mean == pytest.approx(40.0 / 101.0)


def test_the_distance_from_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="two sets of points"):
        apart(np.zeros((0, 2)), np.zeros((3, 2)))
    with pytest.raises(InputError, match="as many coordinates"):
        apart(np.zeros((4, 3)), np.zeros((3, 2)))
