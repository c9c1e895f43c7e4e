"""Level curves fitted to the width that is there.

Across a ridge, from rim to rim, the width holds no whole number of spacings. Every strand on it moves to its share of
that width, by a few hundredths of a spacing near the rim and up to a quarter at the ridge; where one bead more fills
the width than level curves cross it, that is laid along the ridge, and where one less does, the two strands nearest to
the ridge are laid as one. Where fronts meet at more than about 45 degrees nothing of this is done: level curves turn
there, and tips are drawn into the corner outside (`corners`).
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import KDTree

from geoprint.model import Contours, FloatArray, IntArray, Strokes, Surface, freeze_arrays, frozen
from geoprint.paths.backtracks import BACKTRACK, unfolded
from geoprint.patterns.middle.corners import drawn_out
from geoprint.patterns.middle.counting import bead_counts
from geoprint.patterns.middle.lines import LaidLine, MovedStrands, strokes_of
from geoprint.patterns.middle.neighbours import InnerNeighbours, neighbours
from geoprint.patterns.middle.ridges import middles, ridges, steps_along, stretches
from geoprint.patterns.middle.strands import STEP_SHARE, Strands, strands_of
from geoprint.surfaces import arc_lengths

# Beads become at most so much wider or narrower than nominal.
MOST_STRETCHED = 0.2
# What a bead on a ridge goes back by where pieces overlap is left out as far as that moves it by no more [spacings].
OVERLAPPING = 0.5
# A bead on a ridge ends where anything is nearer than this share of what the strands beside it are.
CLEAR_SHARE = 0.9
# Standard deviation of the window in which moves are smoothed along a strand [spacings].
WINDOW = 0.75
# A stretch of ridge shorter than this is not worth a start [spacings].
LEAST_LENGTH = 2.0
# Samples whose middles are within so many spacings lie on the same place of a ridge.
SAME_PLACE = 0.5


@final
@frozen
class _Ridge:
    """One ridge: n samples along it, and how many beads lie across at each."""

    rows: IntArray
    counts: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, rows="int: n", counts="int: n")

    def beads(self, places: FloatArray, beside: InnerNeighbours, *, spacing: float) -> list[LaidLine]:
        """Return the beads that lie on the ridge itself, where their number across it is odd.

        Args:
            places: (k, 3) of all samples now [mm].
            beside: their neighbours.
            spacing: of the levels [mm].
        """
        tree = KDTree(places)
        found = list[LaidLine]()
        for stretch in stretches(self.counts % 2 == 1, closed=False):
            rows, line = self.rows[stretch], middles(self.rows[stretch], places, beside)
            half = 0.5 * np.linalg.norm(places[rows] - places[beside.facing[rows]], axis=1)
            # At either end a third strand may be nearer than the two that face each other.
            clear = np.flatnonzero(tree.query(line)[0] > CLEAR_SHARE * half)
            if clear.size > 1:
                # Pieces of a ridge overlap where they were joined: the bead does not go back for that.
                onwards = line[clear[0] : clear[-1] + 1]
                onwards = onwards[unfolded(onwards, turn=BACKTRACK, error=OVERLAPPING * spacing)]
                found.append(LaidLine(onwards, int(self.counts[stretch[0]] - 1) // 2))
        return found


def fitted(surface: Surface, contours: Contours) -> Strokes:
    """Return strokes made of level curves, fitted to the width across each ridge.

    Args:
        surface: what they lie on.
        contours: c curves of a distance; larger values on their left, seen from outside.

    Returns:
        The strokes, level by level; beads along a ridge have the level of the strand that would lie there.
    """
    strands = strands_of(surface, contours)
    beside = neighbours(strands)
    found = [_counted(rows, strands, beside) for rows in ridges(strands, beside)]
    counts = _on_both_sides(found, strands, beside)
    shared = strands.places + _moves(counts, strands, beside)
    beads = [bead for ridge in found for bead in ridge.beads(shared, beside, spacing=contours.spacing)]
    moved = drawn_out(strands, shared, np.concatenate([np.zeros((0, 3)), *(bead.line for bead in beads)]))
    merged = beside.on_ridge & (counts > 0) & (counts < _crossing(strands.levels))
    return strokes_of(surface, contours, MovedStrands(strands, moved, merged), beads)


def _crossing(levels: IntArray) -> IntArray:
    """Return how many level curves cross a ridge where strands of these levels face each other."""
    return 2 * (levels + 1)


def _counted(rows: IntArray, strands: Strands, beside: InnerNeighbours) -> _Ridge:
    """Return a ridge with the beads across it; where a bead of its own would be too short, it has none."""
    levels = strands.levels[rows]
    widths = 2.0 * (levels + 0.5 + beside.half[rows] / strands.spacing)
    line = middles(rows, strands.places, beside)
    lengths = steps_along(line, spacing=strands.spacing)
    counts = bead_counts(widths, _crossing(levels) - 1, lengths)
    arcs = arc_lengths(line)
    for stretch in stretches(counts % 2 == 1, closed=False):
        if arcs[stretch[-1]] - arcs[stretch[0]] < LEAST_LENGTH * strands.spacing:
            counts[stretch] = _crossing(levels[stretch])
    return _Ridge(rows, counts)


def _on_both_sides(found: list[_Ridge], strands: Strands, beside: InnerNeighbours) -> IntArray:
    """Return the (k,) beads across the ridge at each sample that lies on one, 0 elsewhere."""
    counts = np.zeros(strands.levels.size, dtype=np.int64)
    for ridge in found:
        counts[ridge.rows] = ridge.counts
    known, rest = np.flatnonzero(counts), np.flatnonzero(beside.on_ridge & (counts == 0))
    if not known.size or not rest.size:
        return counts
    tree = KDTree(middles(known, strands.places, beside))
    away, nearest = tree.query(middles(rest, strands.places, beside))
    nearest = known[nearest]
    same = (away < SAME_PLACE * strands.spacing) & (strands.levels[nearest] == strands.levels[rest])
    counts[rest[same]] = counts[nearest[same]]
    return counts


def _moves(counts: IntArray, strands: Strands, beside: InnerNeighbours) -> FloatArray:
    """Return how far each sample moves so that beads share the width across the ridge inside of it (k, 3) [mm]."""
    stretched = np.ones(counts.size)
    for level in np.unique(strands.levels)[::-1]:
        rows = np.flatnonzero(strands.levels == level)
        ridge, below = rows[counts[rows] > 0], rows[beside.inside[rows] >= 0]
        widths = 2.0 * (level + 0.5 + beside.half[ridge] / strands.spacing)
        stretched[ridge] = np.clip(widths / counts[ridge], 1.0 - MOST_STRETCHED, 1.0 + MOST_STRETCHED)
        stretched[below] = stretched[beside.inside[below]]
    inwards = (strands.levels + 0.5) * (stretched - 1.0) * strands.spacing
    for strand in range(strands.count):
        held = strands.rows(strand)
        mode = "wrap" if strands.closed[strand] else "nearest"
        inwards[held] = gaussian_filter1d(inwards[held], WINDOW / STEP_SHARE, mode=mode)
    return inwards[:, None] * strands.inward
