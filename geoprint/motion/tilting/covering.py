"""Few directions of the part that together admit everything that is printed: a set cover, found by a heuristic.

Nobody finds the fewest exactly in reasonable time. Greedily the direction is taken that admits the most length of what
is left [Chvatal1979]. Then, as long as it helps, one that the others make needless is left out, or one is put in place
of two: whether any direction admits all that only these two admit is decided by `UpRange.admissible`.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geoprint.model import BoolArray, FloatArray, IntArray
from geoprint.motion.tilting.ranges import UpRange

# Zeros and ones, and lengths that are only compared.
Shares: TypeAlias = NDArray[np.float32]
# Poses and directions that the cover is chosen by at first; poses that it leaves out join them, some at a time.
SAMPLED_POSES = 1500
SAMPLED_UPS = 2000
JOINING = 100
# Directions are admitted up to this: they are worked out in floating point [cosine].
ADMITTED = 1e-9


def covering(aims: FloatArray, nearest: FloatArray, lengths: FloatArray, *, within: UpRange) -> FloatArray:
    """Return (t, 3) directions of which one at least admits each pose.

    Args:
        aims: (n, 3) as `UpRange.aims` returns them.
        nearest: (n, 3) directions that admit these, as `UpRange.nearest` returns them.
        lengths: (n,) of path that each stands for [mm].
        within: what the table can bring up.
    """
    return fewer(_greedily(aims, nearest, lengths, within=within), aims, within=within)


def fewer(taken: FloatArray, aims: FloatArray, *, within: UpRange) -> FloatArray:
    """Return as many or fewer directions that admit all that (t, 3) do: no other is needless, and no two are one.

    Args:
        taken: of which one at least admits each pose.
        aims: (n, 3) of the poses.
        within: what the table can bring up.
    """
    while True:
        better = next(_better(taken, aims, within=within), taken)
        if len(better) == len(taken):
            return taken
        taken = better


def admitted(ups: FloatArray, aims: FloatArray, *, within: UpRange) -> BoolArray:
    """Return (d, n) whether each of (d, 3) directions admits each of n poses."""
    return ups @ aims.T >= np.cos(within.critical) - ADMITTED


def _better(taken: FloatArray, aims: FloatArray, *, within: UpRange) -> Iterator[FloatArray]:
    """Yield what admits all that (t, 3) directions do with one fewer: without one, or with one in place of two."""
    admits = admitted(taken, aims, within=within)
    counts = admits.sum(axis=0)
    for row in np.argsort(admits.sum(axis=1), kind="stable").tolist():
        if (counts > admits[row]).all():
            yield np.delete(taken, row, axis=0)
    for pair in combinations(range(len(taken)), 2):
        alone = aims[counts == admits[list(pair)].sum(axis=0)]
        found = within.admissible(alone)
        if len(found) and admitted(found, alone, within=within).all():
            yield np.vstack([np.delete(taken, pair, axis=0), found])


def _greedily(aims: FloatArray, nearest: FloatArray, lengths: FloatArray, *, within: UpRange) -> FloatArray:
    rows = np.arange(0, len(aims), max(1, len(aims) // SAMPLED_POSES))
    some = within.directions[:: max(1, len(within.directions) // SAMPLED_UPS)]
    while True:
        # What no direction of these may admit is admitted by the nearest of its own.
        choices = np.vstack([some, nearest[rows]])
        admits = admitted(choices, aims[rows], within=within)
        taken = choices[_greedy(admits.astype(np.float32), lengths[rows].astype(np.float32))]
        missed = np.flatnonzero(~admitted(taken, aims, within=within).any(axis=0))
        if not missed.size:
            return taken
        rows = np.union1d(rows, missed[:: max(1, len(missed) // JOINING)])


def _greedy(admits: Shares, weights: Shares) -> IntArray:
    """Return rows of (d, n) that together admit every column, the one with the most weight left first."""
    left, taken = np.maximum(weights, np.finfo(np.float32).tiny), list[int]()
    while left.any():
        taken.append(int((admits @ left).argmax()))
        left = np.where(admits[taken[-1]] > 0.0, np.float32(0.0), left)
    return np.array(taken, dtype=np.int64)
