"""Rows as level curves of a phase: where it takes whole numbers along the sides of faces, joined straight in each.

In a face in which no row ends the phase is linear, and its level curves are exact and as even as it is. In one in which
rows end, those that pass it are joined from neighbour to neighbour along its sides, and what has no partner ends at the
side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geoprint.kernels import njit
from geoprint.model import FloatArray, IntArray
from geoprint.patterns.fibres.net import ComplexArray, LineNet
from geoprint.patterns.fibres.phase import Phase

# A side is crossed no nearer to its ends than this share of it: no piece of a row is a point.
FROM_VERTEX = 1e-6


class Chains(NamedTuple):
    """Rows in pieces, one after the other.

    Attributes:
        faces: (s,) in which each piece lies.
        starts: (s,) in the plane of that [mm].
        ends: (s,) [mm].
        offsets: (c + 1,) where the pieces of each row start.
        closed: (c,) 1 where a row ends where it starts.
        sides: (q,) half-edges on which rows cross sides, the first of each side, from its start to its end.
        rows: (q,) which row crosses there.
    """

    faces: IntArray
    starts: ComplexArray
    ends: ComplexArray
    offsets: IntArray
    closed: IntArray
    sides: IntArray
    rows: IntArray


def level_curves(net: LineNet, phase: Phase) -> Chains:
    """Return where rows run, in the order of the sides at which they start, those that end before closed ones."""
    passed = phase.passed.ravel()
    halves = np.arange(passed.size)
    owner = np.where(net.twins < 0, halves, np.minimum(halves, net.twins))
    counts = np.where(owner == halves, np.abs(passed), 0)
    first = (np.cumsum(counts) - counts)[owner]
    shares = _shares(phase, counts)
    whole = phase.passed.sum(axis=1) == 0
    through = _through(phase.passed, np.flatnonzero(whole))
    around = _around(phase.passed, np.flatnonzero(~whole))
    halves_of, ordinals = (np.concatenate([one, other]) for one, other in zip(through, around, strict=True))
    own = owner[halves_of] == halves_of
    numbers = first[halves_of] + np.where(own, ordinals, np.abs(passed[halves_of]) - 1 - ordinals)
    order, turned, offsets, closed = _chained(numbers, int(counts.sum()))
    share = np.where(own, shares[numbers], 1.0 - shares[numbers])
    corners, sides = net.corners.ravel(), (np.roll(net.corners, -1, axis=1) - net.corners).ravel()
    places = corners[halves_of] + share * sides[halves_of]
    ahead = np.where(turned[:, None] > 0, [[0, 1]], [[1, 0]])
    rows = order[:, None]
    row_of = np.full(int(counts.sum()), -1)
    row_of[numbers[order]] = np.repeat(np.arange(closed.size), np.diff(offsets))[:, None]
    # Where rows end on both sides of a crossing nothing is left of it.
    crossing = np.flatnonzero(row_of >= 0)
    return Chains(
        faces=halves_of[order, 0] // 3,
        starts=places[rows, ahead][:, 0],
        ends=places[rows, ahead][:, 1],
        offsets=offsets,
        closed=closed,
        sides=np.repeat(halves, counts)[crossing],
        rows=row_of[crossing],
    )


def _shares(phase: Phase, counts: IntArray) -> FloatArray:
    """Return the share of its side from the start at which each crossing lies, (3 m,) counts of them."""
    begun, over = phase.shares.ravel(), np.roll(phase.shares, -1, axis=1).ravel() + phase.passed.ravel()
    half = np.repeat(np.arange(counts.size), counts)
    ordinal = np.arange(half.size) - np.repeat(np.cumsum(counts) - counts, counts)
    level = np.where(phase.passed.ravel()[half] > 0, ordinal + 1, -ordinal)
    return np.clip((level - begun[half]) / (over - begun)[half], FROM_VERTEX, 1.0 - FROM_VERTEX)


def _through(passed: IntArray, faces: IntArray) -> tuple[IntArray, IntArray]:
    """Return (s, 2) half-edges at both ends of pieces through faces without ends, and which crossing of each it is."""
    steps = passed[faces]
    starts = np.column_stack([np.zeros(len(steps), dtype=np.int64), steps[:, 0], steps[:, 0] + steps[:, 1]])
    least = starts.min(axis=1)
    count = starts.max(axis=1) - least
    row = np.repeat(np.arange(faces.size), count)
    level = least[row] + 1 + np.arange(row.size) - np.repeat(np.cumsum(count) - count, count)
    ends = starts + steps
    low, high = np.minimum(starts, ends)[row], np.maximum(starts, ends)[row]
    # A level between the corners passes exactly two of the sides.
    which, side = np.nonzero((low < level[:, None]) & (level[:, None] <= high))
    at, below, above = level[which], low[which, side], high[which, side]
    ordinals = at - below - 1
    falling = steps[row[which], side] < 0
    ordinals[falling] = (above - at)[falling]
    return (3 * faces[row[which]] + side).reshape(-1, 2), ordinals.reshape(-1, 2)


def _around(passed: IntArray, faces: IntArray) -> tuple[IntArray, IntArray]:
    """Return the same of faces in which rows end: neighbours of opposite sense along the sides, joined inside out."""
    halves, ordinals = list[tuple[int, int]](), list[tuple[int, int]]()
    for face in faces.tolist():
        open_ends = list[tuple[int, int, bool]]()
        for side, count in enumerate(passed[face].tolist()):
            for ordinal in range(abs(count)):
                if open_ends and open_ends[-1][2] != (count > 0):
                    half, other, _ = open_ends.pop()
                    halves.append((half, 3 * face + side))
                    ordinals.append((other, ordinal))
                else:
                    open_ends.append((3 * face + side, ordinal, count > 0))
    return np.array(halves, dtype=np.int64).reshape(-1, 2), np.array(ordinals, dtype=np.int64).reshape(-1, 2)


@njit
def _chained(crossings: IntArray, count: int) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Return pieces in order, 1 where they run on and -1 where back, where rows start, and what is closed.

    Args:
        crossings: (s, 2) at both ends of each piece; each crossing has at most two pieces.
        count: of the crossings.
    """
    pieces = len(crossings)
    held = np.full((count, 2), -1)
    for piece in range(pieces):
        for end in range(2):
            at = crossings[piece, end]
            held[at, 0 if held[at, 0] < 0 else 1] = piece
    order, turned = np.empty(pieces, np.int64), np.empty(pieces, np.int64)
    offsets, closed = np.empty(pieces + 1, np.int64), np.empty(pieces, np.int64)
    used = np.zeros(pieces, np.bool_)
    filled, rows = 0, 0
    for around in range(2):
        for begin in range(count):
            piece = held[begin, 0]
            if piece < 0 or used[piece] or (around == 0 and held[begin, 1] >= 0):
                continue
            offsets[rows], closed[rows] = filled, around
            rows += 1
            at = begin
            while piece >= 0 and not used[piece]:
                used[piece] = True
                ahead = crossings[piece, 0] == at
                order[filled], turned[filled] = piece, 1 if ahead else -1
                filled += 1
                at = crossings[piece, 1] if ahead else crossings[piece, 0]
                piece = held[at, 1] if held[at, 0] == piece else held[at, 0]
    offsets[rows] = filled
    return order, turned, offsets[: rows + 1], closed[:rows]
