"""Widths of strips and shares of small triangles, by hand: areas laid at known places along runs of few samples."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.metrics.coverage import (
    _share,  # pyright: ignore[reportPrivateUsage]
    strip_widths,
)
from geoprint.metrics.deposited import Samples
from geoprint.metrics.oracle import Places
from geoprint.model import FloatArray


def samples(*lengths: tuple[float, int]) -> Samples:
    """Runs of these lengths, each cut into so many gaps."""
    runs = np.concatenate([np.full(gaps + 1, run) for run, (_, gaps) in enumerate(lengths)])
    arcs = np.concatenate([np.linspace(0.0, length, gaps + 1) for length, gaps in lengths])
    places = Places(np.zeros(len(runs), dtype=np.int64), np.zeros(len(runs), dtype=np.complex128))
    return Samples(places, runs, arcs)


def widths(
    along: Samples,
    pieces: list[tuple[int, float, float]],
    *,
    closed: tuple[bool, ...],
    spacing: float,
    points: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Of pieces of surface, each with its run, its place along it and its area; runs lie apart but where told."""
    runs, arcs, areas = (np.array(column) for column in zip(*pieces, strict=True))
    apart = np.stack([along.arcs, 10.0 * along.runs, np.zeros(along.runs.size)], axis=1, dtype=np.float64)
    where = apart if points is None else points
    return strip_widths(along, runs, arcs, areas, points=where, closed=np.array(closed), spacing=spacing)


FIVE = [(0, float(k), float(2**k)) for k in range(5)]


@pytest.mark.parametrize(
    ("gaps", "spacing", "wanted"),
    [
        # One sample to either side.
        (4, 1.0, [3 / 1.5, 7 / 2.5, 14 / 3, 28 / 2.5, 24 / 1.5]),
        (4, 2.0, [3 / 1.5, 7 / 2.5, 14 / 3, 28 / 2.5, 24 / 1.5]),
        # Two.
        (6, 4.0, [7 / 2.5, 15 / 3.5, 31 / 4.5, 62 / 5, 124 / 4.5, 120 / 3.5, 112 / 2.5]),
        # No farther than to less than half of a short run.
        (4, 20.0, [3 / 1.5, 7 / 2.5, 14 / 3, 28 / 2.5, 24 / 1.5]),
        (5, 20.0, [7 / 2.5, 15 / 3.5, 31 / 4.5, 62 / 4.5, 60 / 3.5, 56 / 2.5]),
        (1, 20.0, [3 / 1, 3 / 1]),
    ],
)
def test_a_width_is_the_area_within_half_a_spacing_over_its_length(
    gaps: int, spacing: float, wanted: list[float]
) -> None:
    pieces = [(0, float(k), float(2**k)) for k in range(gaps + 1)]
    found, lengths = widths(samples((float(gaps), gaps)), pieces, closed=(False,), spacing=spacing)
    assert found * spacing == pytest.approx(wanted)
    assert lengths == pytest.approx([0.5, *[1.0] * (gaps - 1), 0.5])


@pytest.mark.parametrize(
    ("gaps", "spacing", "wanted"),
    [
        (4, 2.0, [11 / 3, 7 / 3, 14 / 3, 13 / 3, 11 / 3]),
        # No farther than once around.
        (4, 100.0, [11 / 3, 7 / 3, 14 / 3, 13 / 3, 11 / 3]),
        (5, 2.0, [19 / 3, 7 / 3, 14 / 3, 28 / 3, 25 / 3, 19 / 3]),
        (5, 4.0, [31 / 5] * 6),
        (3, 4.0, [7 / 3] * 4),
    ],
)
def test_a_closed_run_goes_on_behind_its_end(gaps: int, spacing: float, wanted: list[float]) -> None:
    pieces = [(0, float(k), float(2**k)) for k in range(gaps)]
    found, lengths = widths(samples((float(gaps), gaps)), pieces, closed=(True,), spacing=spacing)
    assert found * spacing == pytest.approx(wanted)
    assert lengths == pytest.approx([0.5, *[1.0] * (gaps - 1), 0.5])
    # Whether a piece is taken for the start or for the end.
    other = [*pieces[1:], (0, float(gaps), 1.0)]
    assert widths(samples((float(gaps), gaps)), other, closed=(True,), spacing=spacing)[0] == pytest.approx(found)


def test_a_piece_between_two_samples_is_shared_by_its_place_and_one_beyond_the_end_belongs_to_it() -> None:
    along = samples((30.0, 3))
    found, lengths = widths(along, [(0, 12.5, 4.0), (0, 40.0, 8.0), (0, -3.0, 16.0)], closed=(False,), spacing=1.0)
    # Areas of 16, 3, 1, 8, and one sample to either side.
    assert found == pytest.approx([19 / 15, 20 / 25, 12 / 25, 9 / 15])
    assert lengths == pytest.approx([5.0, 10.0, 10.0, 5.0])


def test_runs_keep_to_themselves_and_each_has_its_own_reach() -> None:
    along = samples((4.0, 4), (2.5, 5), (4.0, 4))
    pieces = [*FIVE, (2, 1.0, 6.0), *((1, 0.5 * k, float(2**k)) for k in range(6))]
    found, lengths = widths(along, pieces, closed=(False, False, True), spacing=2.0)
    assert found[:5] * 2.0 == pytest.approx([3 / 1.5, 7 / 2.5, 14 / 3, 28 / 2.5, 24 / 1.5])
    # Two samples of half a millimetre to either side.
    assert found[5:11] * 2.0 == pytest.approx([7 / 1.25, 15 / 1.75, 31 / 2.25, 62 / 2.25, 60 / 1.75, 56 / 1.25])
    assert found[11:] * 2.0 == pytest.approx([2.0, 2.0, 2.0, 0.0, 2.0])
    assert lengths[5:11] == pytest.approx([0.25, 0.5, 0.5, 0.5, 0.5, 0.25])


@pytest.mark.parametrize("end", [(0, 4.0), (1, 0.0)])
def test_runs_that_meet_end_to_end_share_what_lies_beyond_the_corner_whoever_is_nearer(end: tuple[int, float]) -> None:
    """A run along x is split where it turns to go along y; rounding says whose the corner's surface is."""
    along = samples((4.0, 4), (4.0, 4))
    first = along.runs == 0
    points = np.column_stack([np.where(first, along.arcs, 4.0), np.where(first, 0.0, along.arcs), 0.0 * along.arcs])
    points[~first] += 1e-6
    found, _ = widths(
        along, [(0, 2.0, 1.0), (1, 2.0, 1.0), (*end, 6.0)], closed=(False, False), spacing=1.0, points=points
    )
    # Three square millimetres for each of the ends, and one sample to either side.
    half = [0.0, 1 / 2.5, 1 / 3, 4 / 2.5, 3 / 1.5]
    assert found == pytest.approx([*half, *half[::-1]])


@pytest.mark.parametrize(
    ("low", "high", "share"),
    [
        (-9.0, 9.0, 1.0), (-1.0, 1.0, 1.0), (0.0, 9.0, 0.5), (-9.0, 0.0, 0.5), (-0.5, 0.25, 0.375), (0.25, 0.75, 0.25),
        (-0.75, -0.25, 0.25), (1.5, 9.0, 0.0), (-9.0, -1.5, 0.0), (0.5, -0.5, 0.0), (0.9, 9.0, 0.05),
    ],
)  # fmt: skip
def test_a_triangle_holds_the_part_of_its_extent_that_lies_between_two_bounds(
    low: float, high: float, share: float
) -> None:
    """Two millimetres across, one to either side of its middle."""
    assert _share(np.array([2.0]), np.array([low]), np.array([high])).tolist() == pytest.approx([share])
