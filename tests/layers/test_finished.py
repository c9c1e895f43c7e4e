"""The finished stack: what its layers make together, and what a layer with too little makes of it."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.layers.stack_thickness import Finished, finished
from geoprint.metrics import measure_paths, uniformity
from geoprint.model import BoolArray, FloatArray, Polylines, PoseStream
from tests.meshes import plate
from tests.metrics.deposits import deposited, straight_line

HEIGHT = 0.4
BOTTOMS = np.array([0.0, 0.4, 0.8, 1.2, 1.6])


def together(
    deposited: FloatArray,
    *,
    wanted: FloatArray | None = None,
    met: BoolArray | None = None,
    within: BoolArray | None = None,
) -> Finished:
    found = finished(
        deposited,
        5 * HEIGHT * np.ones(deposited.shape[1]) if wanted is None else wanted,
        met=np.zeros(deposited.shape, dtype=np.bool_) if met is None else met,
        within=np.ones(deposited.shape, dtype=np.bool_) if within is None else within,
        bottoms=BOTTOMS[: len(deposited)],
        height=HEIGHT,
    )
    assert found is not None
    return found


def test_even_layers_make_the_thickness_that_was_wanted() -> None:
    found = together(np.full((5, 1000), HEIGHT))
    assert (found.mean, found.cv, found.p1, found.p99) == pytest.approx((1.0, 0.0, 1.0, 1.0))
    assert (found.within_5_percent, found.judged, found.creased) == (1.0, 1.0, 0.0)


def test_a_layer_with_half_of_its_flow_is_found() -> None:
    deposited = np.full((5, 1000), HEIGHT)
    deposited[2] *= 0.5
    assert together(deposited).mean == pytest.approx(0.9)
    deposited[2, :500] = HEIGHT
    found = together(deposited)
    assert found.cv == pytest.approx(0.05 / 0.95)
    assert found.within_5_percent == 0.5
    assert found.p1 == pytest.approx(0.9)


def test_layers_that_are_uneven_in_opposite_places_even_each_other_out() -> None:
    wave = 0.1 * HEIGHT * np.sin(np.linspace(0.0, 20.0 * np.pi, 1001)[:-1])
    deposited = HEIGHT + np.outer([1.0, -1.0, 1.0, -1.0, 0.0], wave)
    assert together(deposited).cv == pytest.approx(0.0, abs=1e-12)
    assert together(HEIGHT + np.outer(np.ones(5), wave)).cv == pytest.approx(0.1 / np.sqrt(2.0), rel=1e-3)


def test_columns_that_meet_below_what_is_wanted_are_left_out_and_told() -> None:
    deposited, met = np.full((5, 1000), HEIGHT), np.zeros((5, 1000), dtype=np.bool_)
    deposited[:, :250], met[3:, :250] = 9.0, True
    found = together(deposited, met=met)
    assert (found.judged, found.creased, found.p99) == (0.75, 0.25, pytest.approx(1.0))
    assert np.isnan(found.ratios[:250]).all()
    # Where no more was wanted than lies below it does not matter.
    wanted = np.full(1000, 5 * HEIGHT)
    wanted[:250] = 3 * HEIGHT
    assert together(deposited, met=met, wanted=wanted).creased == 0.0


def test_columns_that_leave_through_a_side_are_judged_up_to_there() -> None:
    deposited, within = np.full((5, 1000), HEIGHT), np.ones((5, 1000), dtype=np.bool_)
    within[3:, :100], deposited[3:, :100] = False, 0.0
    found = together(deposited, within=within)
    assert (found.mean, found.cv, found.judged, found.under_sides) == pytest.approx((1.0, 0.0, 1.0, 0.1))
    # What lies beyond the side, and what comes back from there, is no column's.
    deposited[3:, :100], within[4, :100] = HEIGHT, True
    assert together(deposited, within=within).cv == pytest.approx(0.0)
    # But a layer that is missing below the side is missed.
    deposited[2, :100] = 0.0
    assert together(deposited, within=within).p1 == pytest.approx(2.0 / 3.0)
    # Columns that leave below the first layer hold none, and those that end lower anyway are as they were.
    within[:, :100] = False
    assert (together(deposited, within=within).judged, together(deposited, within=within).under_sides) == (0.9, 0.1)
    within[:, :100] = np.array([True, True, False, False, False])[:, None]
    wanted = np.full(1000, 2 * HEIGHT)
    assert together(deposited[:2], wanted=wanted, within=within[:2]).under_sides == 0.0


def test_only_where_at_least_a_layer_is_wanted_is_judged() -> None:
    wanted = np.repeat([0.0, 0.5 * HEIGHT, 5 * HEIGHT], [100, 300, 600])
    found = together(np.full((5, 1000), HEIGHT), wanted=wanted)
    assert found.judged == pytest.approx(600 / 900)
    assert (found.mean, found.cv) == pytest.approx((1.0, 0.0))
    nothing = np.zeros(1000)
    met = np.zeros((5, 1000), dtype=np.bool_)
    deposited = np.full((5, 1000), HEIGHT)
    assert finished(deposited, nothing, met=met, within=~met, bottoms=BOTTOMS, height=HEIGHT) is None


# Evenness where the wanted spacing differs: rows that are right by formula, and one that is missing.


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
