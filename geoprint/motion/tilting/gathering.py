"""What one attitude of the table admits is printed in it, of whichever run it is: far fewer moves, in another order.

A heuristic. Few directions that admit everything are chosen by `covering`. Then each run is divided among these, into
as few pieces as they allow, which is exact by the argument of `tilts`.
Within an attitude the pieces keep their order, and layers follow one another.
"""

from __future__ import annotations

from itertools import pairwise
from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.kernels import njit
from geoprint.model import BoolArray, FloatArray, IntArray, freeze_arrays, frozen
from geoprint.motion.tilting.covering import admitted, covering
from geoprint.motion.tilting.ranges import UpRange
from geoprint.motion.tilting.tilts import Tilts, roomiest


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
    starts = np.concatenate([[0], np.flatnonzero(np.diff(runs) != 0) + 1])
    before = np.arange(len(aims)) - 1
    before[starts] = starts
    taken = covering(aims, nearest, lengths, within=within, starts=aims[before])
    admits = admitted(taken, aims, within=within)
    chosen = np.concatenate(
        [_divided(np.ascontiguousarray(admits[:, a:b])) for a, b in pairwise([*starts.tolist(), len(aims)])]
    )
    cuts = np.union1d(starts, np.flatnonzero(np.diff(chosen)) + 1)
    # What is laid from the last pose of a piece to the first of the next is laid by the piece, or by the next one where
    # that alone admits both.
    inner = ~np.isin(cuts, starts)
    taking = inner & ~admits[chosen[cuts - 1], cuts] & admits[chosen[cuts], cuts - 1]
    firsts, ends = cuts - taking, np.append(cuts[1:] + (inner & ~taking)[1:], len(aims))
    attitudes: list[Attitude] = []
    for number, up in enumerate(taken):
        # A pose alone lays nothing: what leads to it is laid by the piece before.
        own = np.flatnonzero((chosen[cuts] == number) & (ends - firsts > 1))
        if own.size:
            pieces = np.column_stack([firsts[own], ends[own]])
            along: list[IntArray] = [np.arange(first, end) for first, end in pieces]
            rows = np.unique(np.concatenate(along))
            at, slack = roomiest(aims[rows[admits[number, rows]]], up, within=within)
            attitudes.append(Attitude(at, slack, pieces))
    return sorted(attitudes, key=lambda each: int(each.pieces[0, 0]))


@njit
def _divided(admits: BoolArray) -> IntArray:
    """Return the (n,) row of (d, n) by which each column is admitted, with the fewest changes from column to column.

    A row that also admits the column before its first goes before one that does not: it takes the step from there.
    """
    rows, count = admits.shape
    chosen = np.empty(count, dtype=np.int64)
    place = 0
    while place < count:
        best, end, joined = 0, place, False
        for row in range(rows):
            behind = place
            while behind < count and admits[row, behind]:
                behind += 1
            joins = place > 0 and admits[row, place - 1]
            if behind > place and (joins > joined or (joins == joined and behind > end)):
                best, end, joined = row, behind, joins
        # Every column is admitted by a row, so that one is left behind each time.
        chosen[place:end] = best
        place = end
    return chosen
