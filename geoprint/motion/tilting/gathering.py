"""What one attitude of the table admits is printed in it, of whichever run it is: far fewer moves, in another order.

A heuristic. The fewest attitudes that admit everything are a set cover, which nobody finds exactly in reasonable time:
greedily the direction is taken that admits the most length of what is left [Chvatal1979]. Then each run is divided
among the directions that were taken, into as few pieces as these allow, which is exact by the argument of `tilts`.
Within an attitude the pieces keep their order, and layers follow one another.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from geoprint.errors import InputError
from geoprint.kernels import njit
from geoprint.model import BoolArray, FloatArray, IntArray, freeze_arrays, frozen
from geoprint.motion.tilting.ranges import UpRange
from geoprint.motion.tilting.tilts import Tilts, roomiest

# Zeros and ones, and lengths that are only compared.
Shares: TypeAlias = NDArray[np.float32]
# Poses and directions that the cover is chosen by at first; poses that it leaves out join them, some at a time.
SAMPLED_POSES = 1500
SAMPLED_UPS = 2000
JOINING = 100
# Directions are admitted up to this: they are worked out in floating point [cosine].
ADMITTED = 1e-9


@final
@frozen
class Attitude:
    """One attitude of the table, and what is printed in it.

    Attributes:
        up: (3,) unit direction of the part that points up.
        slack: share that is left, as `Tilts.slacks`.
        pieces: (k, 2) first pose and pose behind the last of what is printed, each within one run, in this order. The
            last pose of a piece is the first of the one that goes on with its run.
    """

    up: FloatArray
    slack: float
    pieces: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, up="float: 3", pieces="int: k 2")


def attitudes_of(found: Tilts, runs: IntArray) -> tuple[Attitude, ...]:
    """Return the attitudes of tilts with what of each run is printed in them.

    Args:
        found: along a deposit.
        runs: (n,) run of each pose.
    """
    breaks = np.flatnonzero(np.diff(runs) != 0) + 1
    attitudes: list[Attitude] = []
    behind = 0
    for start, end, up, slack in zip(found.starts, found.ends, found.ups, found.slacks, strict=True):
        # Where no attitude admits both ends of a step, it is laid in that of its end.
        first = start - (start == behind and start > 0 and runs[start] == runs[start - 1])
        edges = np.concatenate([[first], breaks[(breaks > first) & (breaks < end)], [end]])
        pieces = np.column_stack([edges[:-1], edges[1:]])
        attitudes.append(Attitude(up, float(slack), pieces[np.diff(pieces, axis=1)[:, 0] > 1]))
        behind = end
    return tuple(each for each in attitudes if len(each.pieces))


def gathered(
    normals: FloatArray, *, runs: IntArray, layers: IntArray, lengths: FloatArray, within: UpRange
) -> tuple[Attitude, ...]:
    """Choose attitudes of a table for a deposit whose pieces may be printed in any order within their layer.

    Args:
        normals: (n, 3) outward unit normals of the deposited poses.
        runs: (n,) run of each, not falling.
        layers: (n,) layer of each, not falling, the same along a run.
        lengths: (n,) of path that each stands for [mm].
        within: what the table can bring up, with the critical angle.

    Raises:
        InputError: there is no pose, or the arrays differ in length.
    """
    if not len(normals) or {len(normals)} != {len(runs), len(layers), len(lengths)}:
        raise InputError(
            f"a table tilts along poses with a normal, a run, a layer and a length each, found {len(normals)}, "
            f"{len(runs)}, {len(layers)} and {len(lengths)}: give those that deposit."
        )
    nearest = within.nearest(normals)
    aims = within.aims(normals, nearest)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(layers) != 0) + 1, [len(normals)]])
    attitudes: list[Attitude] = []
    for first, behind in pairwise(edges.tolist()):
        rows = slice(first, behind)
        found = _layer(aims[rows], nearest[rows], runs[rows], lengths[rows], within=within)
        attitudes += [Attitude(one.up, one.slack, one.pieces + first) for one in found]
    return tuple(attitudes)


def _layer(
    aims: FloatArray, nearest: FloatArray, runs: IntArray, lengths: FloatArray, *, within: UpRange
) -> list[Attitude]:
    taken = _cover(aims, nearest, lengths, within=within)
    admits = _admits(taken, aims, within=within)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(runs) != 0) + 1])
    chosen = np.concatenate(
        [_divided(np.ascontiguousarray(admits[:, a:b])) for a, b in pairwise([*starts.tolist(), len(aims)])]
    )
    cuts = np.union1d(starts, np.flatnonzero(np.diff(chosen)) + 1)
    ends = np.append(cuts[1:], len(aims))
    # What is laid from the last pose of a piece to the first of the next is laid by the piece.
    ends += np.isin(ends, np.setdiff1d(cuts, starts))
    attitudes: list[Attitude] = []
    for number, up in enumerate(taken):
        # The last pose of a run alone lays nothing: what leads to it is laid by the piece before.
        own = np.flatnonzero((chosen[cuts] == number) & (ends - cuts > 1))
        if own.size:
            at, slack = roomiest(aims[chosen == number], up, within=within)
            attitudes.append(Attitude(at, slack, np.column_stack([cuts[own], ends[own]])))
    return sorted(attitudes, key=lambda each: int(each.pieces[0, 0]))


def _cover(aims: FloatArray, nearest: FloatArray, lengths: FloatArray, *, within: UpRange) -> FloatArray:
    """Return (t, 3) directions of which one at least admits each pose."""
    rows = np.arange(0, len(aims), max(1, len(aims) // SAMPLED_POSES))
    some = within.directions[:: max(1, len(within.directions) // SAMPLED_UPS)]
    while True:
        # What no direction of these may admit is admitted by the nearest of its own.
        choices = np.vstack([some, nearest[rows]])
        admits = _admits(choices, aims[rows], within=within)
        taken = choices[_greedy(admits.astype(np.float32), lengths[rows].astype(np.float32))]
        missed = np.flatnonzero(~_admits(taken, aims, within=within).any(axis=0))
        if not missed.size:
            return taken
        rows = np.union1d(rows, missed[:: max(1, len(missed) // JOINING)])


def _admits(ups: FloatArray, aims: FloatArray, *, within: UpRange) -> BoolArray:
    """Return (d, n) whether each of (d, 3) directions admits each of (n, 3) poses."""
    return ups @ aims.T >= np.cos(within.critical) - ADMITTED


def _greedy(admits: Shares, weights: Shares) -> IntArray:
    """Return rows of (d, n) that together admit every column, the one with the most weight left first."""
    left, taken = np.maximum(weights, np.finfo(np.float32).tiny), list[int]()
    while left.any():
        taken.append(int((admits @ left).argmax()))
        left = np.where(admits[taken[-1]] > 0.0, np.float32(0.0), left)
    return np.array(taken, dtype=np.int64)


@njit(cache=True)
def _divided(admits: BoolArray) -> IntArray:
    """Return the (n,) row of (d, n) by which each column is admitted, with the fewest changes from column to column."""
    rows, count = admits.shape
    chosen = np.empty(count, dtype=np.int64)
    place = 0
    while place < count:
        best, end = 0, place
        for row in range(rows):
            behind = place
            while behind < count and admits[row, behind]:
                behind += 1
            if behind > end:
                best, end = row, behind
        # Every column is admitted by a row, so that one is left behind each time.
        chosen[place:end] = best
        place = end
    return chosen
