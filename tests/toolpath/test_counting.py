"""How many beads lie across a ridge: the nearest whole number, and no change of it for a short stretch."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.toolpath.medial_axis import bead_counts


@pytest.mark.parametrize(
    ("width", "fewest", "beads"),
    # Level curves that cross are one more than the fewest. Of 3.5 spacings three beads would miss 0.2, four lay 0.075
    # twice.
    [(6.8, 5, 7), (7.4, 7, 7), (7.6, 7, 8), (8.0, 7, 8), (3.5, 3, 4), (1.2, 1, 1)],
)
def test_as_many_beads_as_fit(width: float, fewest: int, beads: int) -> None:
    places = np.ones(5)
    counts = bead_counts(width * places, np.full(5, fewest), places)
    np.testing.assert_array_equal(counts, beads)


@pytest.mark.parametrize(("bump", "beads"), [(0.5, 20), (4.0, 21)])
def test_a_short_stretch_is_not_worth_a_change(bump: float, beads: int) -> None:
    # Of 20.2 spacings 20 beads fit, of 20.8 there fit 21: (0.8^2 - 0.2^2) a spacing are saved, two changes cost one.
    widths = np.concatenate([np.full(20, 20.2), np.full(10, 20.8), np.full(20, 20.2)])
    lengths = np.concatenate([np.ones(20), np.full(10, bump / 10), np.ones(20)])
    counts = bead_counts(widths, np.full(50, 19), lengths)
    assert set(counts[20:30].tolist()) == {beads}
    assert set(counts[:20].tolist()) == {20}


def test_the_number_follows_level_curves_through_a_tip() -> None:
    # A wedge: where the width reaches 8 spacings two more level curves cross, and a bead on the ridge goes on as one.
    widths = np.linspace(6.6, 9.4, 40)
    fewest = np.where(widths < 8.0, 5, 7)
    counts = bead_counts(widths, fewest, np.full(40, 0.5))
    assert (np.diff(counts) >= 0).all()
    assert np.abs(counts - widths).max() < 1.0
