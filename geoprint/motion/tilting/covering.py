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


def covering(
    aims: FloatArray, nearest: FloatArray, lengths: FloatArray, *, within: UpRange, starts: FloatArray | None = None
) -> FloatArray:
    """Return (t, 3) directions of which one at least admits each pose, with the start of the step to it if one can.

    Args:
        aims: (n, 3) as `UpRange.aims` returns them.
        nearest: (n, 3) directions that admit these, as `UpRange.nearest` returns them.
        lengths: (n,) of path that each stands for [mm].
        within: what the table can bring up.
        starts: (n, 3) aims of the pose at which the step to each begins, its own where a run does; those of the poses
            without it, so that steps do not count.
    """
    taken, starts = _greedily(aims, aims if starts is None else starts, nearest, lengths, within=within)
    return fewer(taken, aims, starts, within=within)


def fewer(taken: FloatArray, aims: FloatArray, starts: FloatArray, *, within: UpRange) -> FloatArray:
    """Return as many or fewer directions that admit all that (t, 3) do: no other is needless, and no two are one.

    Args:
        taken: of which one at least admits each pose and the start of the step to it.
        aims: (n, 3) of the poses.
        starts: (n, 3) of the starts of the steps to them.
        within: what the table can bring up.
    """
    while True:
        better = next(_better(taken, aims, starts, within=within), taken)
        if len(better) == len(taken):
            return taken
        taken = better


def admitted(ups: FloatArray, aims: FloatArray, *, within: UpRange) -> BoolArray:
    """Return (d, n) whether each of (d, 3) directions admits each of n poses."""
    return ups @ aims.T >= np.cos(within.critical) - ADMITTED


def _steps(ups: FloatArray, aims: FloatArray, starts: FloatArray, *, within: UpRange) -> BoolArray:
    return admitted(ups, aims, within=within) & admitted(ups, starts, within=within)


def _better(taken: FloatArray, aims: FloatArray, starts: FloatArray, *, within: UpRange) -> Iterator[FloatArray]:
    """Yield what admits all that (t, 3) directions do with one fewer: without one, or with one in place of two."""
    admits = _steps(taken, aims, starts, within=within)
    counts = admits.sum(axis=0)
    for row in np.argsort(admits.sum(axis=1), kind="stable").tolist():
        if (counts > admits[row]).all():
            yield np.delete(taken, row, axis=0)
    for pair in combinations(range(len(taken)), 2):
        only = counts == admits[list(pair)].sum(axis=0)
        alone = np.vstack([aims[only], starts[only]])
        found = within.admissible(alone)
        if len(found) and admitted(found, alone, within=within).all():
            yield np.vstack([np.delete(taken, pair, axis=0), found])


def _greedily(
    aims: FloatArray, starts: FloatArray, nearest: FloatArray, lengths: FloatArray, *, within: UpRange
) -> tuple[FloatArray, FloatArray]:
    """Return directions that admit every step, and the starts: the end instead where nothing admits both."""
    starts = starts.copy()
    rows = np.arange(0, len(aims), max(1, len(aims) // SAMPLED_POSES))
    some = within.directions[:: max(1, len(within.directions) // SAMPLED_UPS)]
    while True:
        # What no direction of these may admit is admitted by the nearest of its own, or by one of both ends.
        choices = np.vstack([some, nearest[rows]])
        for row in rows[~_steps(choices, aims[rows], starts[rows], within=within).any(axis=0)].tolist():
            ends = np.stack([aims[row], starts[row]])
            found = within.admissible(ends)
            if len(found) and admitted(found, ends, within=within).all():
                choices = np.vstack([choices, found])
            else:
                starts[row] = aims[row]
        admits = _steps(choices, aims[rows], starts[rows], within=within)
        taken = choices[_greedy(admits.astype(np.float32), lengths[rows].astype(np.float32))]
        missed = np.flatnonzero(~_steps(taken, aims, starts, within=within).any(axis=0))
        if not missed.size:
            return taken, starts
        rows = np.union1d(rows, missed[:: max(1, len(missed) // JOINING)])


def _greedy(admits: Shares, weights: Shares) -> IntArray:
    """Return rows of (d, n) that together admit every column, the one with the most weight left first."""
    left, taken = np.maximum(weights, np.finfo(np.float32).tiny), list[int]()
    while left.any():
        taken.append(int((admits @ left).argmax()))
        left = np.where(admits[taken[-1]] > 0.0, np.float32(0.0), left)
    return np.array(taken, dtype=np.int64)
