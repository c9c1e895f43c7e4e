"""Evenness where the wanted spacing differs: rows that are right by formula, and one that is missing."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.metrics import measure_paths, uniformity
from geoprint.model import FloatArray, Polylines, PoseStream
from tests.meshes import plate
from tests.metrics.deposits import deposited, straight_line

LEAST, MOST, WIDE, HIGH = 1.0, 2.0, 24.0, 30.0
SPACING = 1.4
SLOPE = (MOST - LEAST) / HIGH
SURFACE = plate((WIDE, HIGH), (12, 15))


def _wanted(places: FloatArray) -> FloatArray:
    return LEAST + SLOPE * places[:, 1]


def _lines() -> Polylines:
    """Return the same rows as what another program may have written."""
    stream = _rows()
    deposited = np.flatnonzero(stream.deposit)
    begins = np.flatnonzero(np.diff(stream.runs[deposited], prepend=-1))
    return Polylines(stream.surface_points[deposited], np.append(begins, deposited.size))


def _rows(*, without: int | None = None) -> PoseStream:
    """Return level rows, each where the integral of one over the wanted spacing is half past a whole number."""
    count = round(float(np.log(MOST / LEAST)) / SLOPE)
    levels = np.arange(count, dtype=np.float64) + 0.5
    heights: FloatArray = LEAST / SLOPE * (np.exp(SLOPE * levels) - 1.0)
    kept = [float(height) for row, height in enumerate(heights) if row != without]
    lines = [straight_line((0.0, y), (WIDE, y), points=121) for y in kept]
    return deposited(lines, range(len(lines)))


def test_rows_as_far_apart_as_is_wanted_there_are_even_and_leave_nothing() -> None:
    found = uniformity(_rows(), SURFACE, spacing=SPACING, wanted=_wanted)
    assert found.levels is None
    np.testing.assert_allclose(found.sides.both.ratios, 1.0, atol=2e-3)
    # The last row has 0.8 of its strip below the rim; elsewhere the layer is even over what is wanted there.
    assert found.thickness.within_5_percent > 0.93
    assert found.thickness.smallest > 0.99
    assert (found.gap, found.overlap) == (pytest.approx(0.0, abs=0.003), pytest.approx(0.0, abs=0.003))
    assert found.fill == pytest.approx(1.0, abs=0.03)
    inside = (found.sides.places[:, 1] > 3.0) & (found.sides.places[:, 1] < HIGH - 4.0)
    np.testing.assert_allclose(found.widths[inside], 1.0, atol=0.02)
    own = measure_paths(SURFACE, _lines(), spacing=SPACING, wanted=_wanted)
    assert (own.fill, own.gap) == (pytest.approx(found.fill), pytest.approx(found.gap, abs=0.002))
    assert own.sides.both.cv < 0.002
    # Over one spacing for all the same rows are uneven.
    assert uniformity(_rows(), SURFACE, spacing=SPACING).thickness.cv > 0.1


def test_a_missing_row_is_a_gap_as_wide_as_what_is_wanted_there() -> None:
    found = uniformity(_rows(without=10), SURFACE, spacing=SPACING, wanted=_wanted)
    height = LEAST / SLOPE * (np.exp(SLOPE * 10.5) - 1.0)
    here = LEAST + SLOPE * height
    assert found.sides.both.ratios.max() == pytest.approx(2.0, abs=0.01)
    # Of two spacings 0.55 on either side are covered.
    assert found.gap * HIGH == pytest.approx((2.0 - 1.1) * here, rel=0.05)
    gaps = found.judged_places[found.gaps]
    np.testing.assert_allclose(
        [gaps[:, 1].min(), gaps[:, 1].max()], [height - 0.45 * here, height + 0.45 * here], atol=0.3
    )


def test_the_same_wanted_everywhere_is_another_spacing() -> None:
    lines = [straight_line((0.0, y), (WIDE, y), points=121) for y in np.arange(1.0, HIGH, 2.0).tolist()]
    wave = deposited([np.concatenate([lines[0], lines[1][::-1]]), *lines[2:]], range(len(lines) - 1))
    other = uniformity(wave, SURFACE, spacing=SPACING, wanted=lambda places: np.full(len(places), 2.0))
    np.testing.assert_allclose(np.median(other.sides.both.ratios), 1.0, atol=1e-6)
    one = uniformity(wave, SURFACE, spacing=2.0)
    assert (other.gap, other.overlap, other.fill) == (
        pytest.approx(one.gap, abs=0.005), pytest.approx(one.overlap, abs=0.005), pytest.approx(one.fill)
    )  # fmt: skip
