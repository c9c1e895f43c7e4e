"""Ridges from end to end: lines of samples, each with the one that faces it, through the tips of the levels between."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from geoprint.model import BoolArray, FloatArray, IntArray
from geoprint.patterns.middle.neighbours import InnerNeighbours
from geoprint.patterns.middle.strands import STEP_SHARE, Strands

# From one sample to the next the one that faces goes on by at most so many spacings, or the ridge branches there.
LARGEST_STEP = 1.25
# Beyond the tip of the next level a ridge goes on within so many spacings; and where nothing is between, within these.
PAST_TIP = 1.6
PAST_GAP = 1.0
# At a tip strands of the level outside are so far apart, over two spacings, and those of the level inside so near.
WIDE, NARROW = 0.6, 0.5
# Where nothing is between, half the distance across differs by less than so many spacings.
LIKE = 0.3
# A ridge does not turn back where it goes on: the cosine between the directions in which two ends leave their pieces,
# over so many samples, is at most this.
TURNING_BACK, DIRECTION_SAMPLES = 0.5, 4


def ridges(strands: Strands, beside: InnerNeighbours) -> list[IntArray]:
    """Return the ridges: for each the rows of samples in order along it, of one of the two strands that face.

    Args:
        strands: with k samples.
        beside: their neighbours.
    """
    pieces = _pieces(strands, beside)
    return _joined(pieces, strands, beside)


def middles(rows: IntArray, places: FloatArray, beside: InnerNeighbours) -> FloatArray:
    """Return the (n, 3) middles between samples and those that face them [mm].

    Args:
        rows: n samples on a ridge.
        places: (k, 3) of all samples [mm].
        beside: their neighbours.
    """
    return 0.5 * (places[rows] + places[beside.facing[rows]])


def stretches(chosen: BoolArray, *, closed: bool) -> list[IntArray]:
    """Return the indices of each unbroken row of True, in order; round the end of a closed line.

    Examples:
        >>> [each.tolist() for each in stretches(np.array([True, False, True, True]), closed=True)]
        [[2, 3, 0]]
    """
    if chosen.all():
        return [np.arange(chosen.size)] if chosen.size else []
    start = int(np.argmin(chosen)) if closed else 0
    turned = np.roll(chosen, -start).astype(np.int64)
    steps = np.diff(np.concatenate([[0], turned, [0]]))
    bounds = zip(np.flatnonzero(steps == 1).tolist(), np.flatnonzero(steps == -1).tolist(), strict=True)
    return [(np.arange(first, behind) + start) % chosen.size for first, behind in bounds]


def _pieces(strands: Strands, beside: InnerNeighbours) -> list[IntArray]:
    """Return unbroken pieces of ridges, the longest first, none of which is seen from both sides."""
    found = list[IntArray]()
    for strand in range(strands.count):
        held = strands.rows(strand)
        for stretch in stretches(beside.on_ridge[held], closed=bool(strands.closed[strand])):
            rows = stretch + held.start
            opposite = strands.places[beside.facing[rows]]
            jumps = np.linalg.norm(np.diff(opposite, axis=0), axis=1) > LARGEST_STEP * strands.spacing
            # Round the tip of a level a strand faces itself: its ridge runs to the tip once, and not back.
            jumps |= np.diff(_is_behind(rows, beside.facing[rows]).astype(np.int64)) > 0
            found += np.split(rows, np.flatnonzero(jumps) + 1)
    taken = np.zeros(strands.levels.size, dtype=bool)
    kept = list[IntArray]()
    for rows in sorted(found, key=len, reverse=True):
        for stretch in stretches(~taken[rows], closed=False):
            if stretch.size < 2:
                continue
            own = rows[stretch]
            for side in (own, beside.facing[own]):
                for step in (-1, 0, 1):
                    taken[strands.further(side, step)] = True
            kept.append(own)
    return kept


def _is_behind(rows: IntArray, facing: IntArray) -> BoolArray:
    """Return whether each of some rows comes after what it faces among them; not where it faces none of them."""
    order = dict(zip(rows.tolist(), range(rows.size), strict=True))
    return np.array([order.get(faced, rows.size) < own for own, faced in enumerate(facing.tolist())], dtype=np.bool_)


def _joined(pieces: list[IntArray], strands: Strands, beside: InnerNeighbours) -> list[IntArray]:
    """Join pieces end to end, nearest first. End 2 i is where piece i starts, end 2 i + 1 where it ends."""
    partner = dict[int, int]()
    for first, second in _nearest_first(pieces, strands, beside):
        if first not in partner and second not in partner and not _is_joined(first, second, partner):
            partner[first], partner[second] = second, first
    done, lines = set[int](), list[IntArray]()
    for start in range(2 * len(pieces)):
        if start in partner or start // 2 in done:
            continue
        ends = _from(start, partner)
        done.update(end // 2 for end in ends)
        lines.append(np.concatenate([pieces[end // 2][:: -1 if end % 2 else 1] for end in ends]))
    return lines


def _from(start: int, partner: dict[int, int]) -> list[int]:
    """Return the ends at which each piece is entered, from a free end on."""
    ends = [start]
    while ends[-1] ^ 1 in partner:
        ends.append(partner[ends[-1] ^ 1])
    return ends


def _is_joined(first: int, second: int, partner: dict[int, int]) -> bool:
    """Return whether two free ends belong to one line already."""
    return _from(first, partner)[-1] ^ 1 == second


def _nearest_first(pieces: list[IntArray], strands: Strands, beside: InnerNeighbours) -> list[tuple[int, int]]:
    """Return pairs of ends between which a ridge goes on, the nearest first."""
    if not pieces:
        return []
    rows = np.concatenate([piece[[0, -1]] for piece in pieces])
    places, levels, halves = middles(rows, strands.places, beside), strands.levels[rows], beside.half[rows]
    spacing, number = strands.spacing, np.arange(rows.size) // 2
    away = np.linalg.norm(places[:, None] - places, axis=2)
    tip = (levels[:, None] + 1 == levels) & (halves[:, None] > WIDE * spacing) & (halves < NARROW * spacing)
    gap = (levels[:, None] == levels) & (np.abs(halves[:, None] - halves) < LIKE * spacing)
    near = (tip & (away < PAST_TIP * spacing)) | (gap & (away < PAST_GAP * spacing))
    outwards = np.concatenate([_outwards(piece, strands, beside) for piece in pieces])
    near &= outwards @ outwards.T <= TURNING_BACK
    first, second = np.nonzero(near & (number[:, None] != number))
    order = np.argsort(away[first, second], kind="stable")
    return list(zip(first[order].tolist(), second[order].tolist(), strict=True))


def _outwards(piece: IntArray, strands: Strands, beside: InnerNeighbours) -> FloatArray:
    """Return the (2, 3) unit vectors in which a piece of a ridge starts and ends, both away from it."""
    line = middles(piece, strands.places, beside)
    reach = min(DIRECTION_SAMPLES, len(line) - 1)
    vectors = np.stack([line[0] - line[reach], line[-1] - line[-1 - reach]])
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), np.finfo(np.float64).tiny)


def steps_along(line: FloatArray, *, spacing: float) -> FloatArray:
    """Return the length that each of (n, 3) places along a line stands for [spacings]; over joints no more than one."""
    ahead = np.linalg.norm(np.diff(line, axis=0), axis=1)
    pairs = list(pairwise(np.concatenate([[0.0], np.minimum(ahead, spacing), [0.0]]).tolist()))
    return np.maximum(0.5 * np.sum(pairs, axis=1) / spacing, 0.5 * STEP_SHARE)
