"""How many beads fill the width across a ridge: as many as fit, but no change of their number for a short stretch.

The work in the plane that lays beads of varying width through the middle of a shape changes their number where that
costs least [Kuipers2020]; along a line that is a shortest path over its places and numbers.
"""

from __future__ import annotations

import numpy as np

from geoprint.model import GAP_SHARE, OVERLAP_SHARE, FloatArray, IntArray

# A change of the number costs as much as half a spacing squared of surface that is missed.
CHANGE = 0.5


def bead_counts(widths: FloatArray, fewest: IntArray, lengths: FloatArray) -> IntArray:
    """Return how many beads lie across a ridge at each of n places along it.

    Args:
        widths: (n,) across the ridge from rim to rim [spacings].
        fewest: (n,) one bead less than the level curves that cross there.
        lengths: (n,) that each place stands for [spacings].

    Returns:
        (n,) numbers, positive, from the fewest to two more.
    """
    numbers = np.arange(max(int(fewest.min()), 1), int(fewest.max()) + 3)
    more = numbers - fewest[:, None]
    costs = np.where((more >= 0) & (more <= 2), _waste(widths[:, None], numbers) * lengths[:, None], np.inf)
    change = CHANGE * np.abs(numbers[:, None] - numbers)
    total, came_from = costs[0], np.zeros(costs.shape, dtype=np.int64)
    for place in range(1, len(costs)):
        arriving = total[:, None] + change
        came_from[place] = arriving.argmin(axis=0)
        total = arriving.min(axis=0) + costs[place]
    best = np.empty(len(costs), dtype=np.int64)
    best[-1] = total.argmin()
    for place in range(len(costs) - 1, 0, -1):
        best[place - 1] = came_from[place][best[place]]
    return numbers[best]


def _waste(widths: FloatArray, numbers: IntArray) -> FloatArray:
    """Return what a number of beads misses or lays twice of a width, and the square of what they are off by."""
    # The middle between two beads is half a bead away from both: beads a tenth wider or narrower do neither.
    bead = widths / numbers
    missed = numbers * np.maximum(bead - 2.0 * GAP_SHARE, 0.0)
    twice = (numbers - 1) * np.maximum(2.0 * OVERLAP_SHARE - bead, 0.0)
    return missed + twice + (widths - numbers) ** 2
