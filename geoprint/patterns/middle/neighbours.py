"""What lies beside a strand on its inner side: the strand that faces it across a ridge, or the next level.

A ridge is where fronts meet: there the distance has its largest values, and the strands of one level face each other.
InnerNeighbours are found through the air; within two spacings that is the distance over the surface but for folds.
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import BoolArray, FloatArray, IntArray, freeze_arrays, frozen
from geoprint.patterns.middle.strands import Strands

# Two strands face each other across at most so many spacings: between them no level has room.
FACING_REACH = 2.1
# The next level is nearer than so many spacings.
NEXT_REACH = 1.3
# Least cosine between the line to a neighbour and the inward direction: it lies ahead.
AHEAD = 0.8
# Least cosine between inward directions, or the opposite of one, of strands side by side.
ALIKE = 0.7


@final
@frozen
class InnerNeighbours:
    """The inner neighbours of strands with k samples.

    Attributes:
        facing: (k,) sample that faces each across a ridge, -1 for none.
        half: (k,) half the distance to it, 0 for none [mm].
        inside: (k,) sample of the next level inside, -1 for none, or where a strand that faces is nearer.
    """

    facing: IntArray
    half: FloatArray
    inside: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, facing="int: k", half="float: k", inside="int: k")

    @property
    def on_ridge(self) -> BoolArray:
        """(k,) whether a sample faces another one across a ridge."""
        return self.facing >= 0


def neighbours(strands: Strands) -> InnerNeighbours:
    """Find the inner neighbour of each sample of the strands."""
    facing, across = _facing(strands)
    inside, away = _inside(strands)
    ridge = (facing >= 0) & (across < away)
    return InnerNeighbours(np.where(ridge, facing, -1), np.where(ridge, 0.5 * across, 0.0), np.where(ridge, -1, inside))


def _facing(strands: Strands) -> tuple[IntArray, FloatArray]:
    """Return the nearest sample of the same level that faces each, -1 for none, and the (k,) distance to it [mm]."""
    count = strands.levels.size
    found, away = np.full(count, -1), np.full(count, np.inf)
    for level in np.unique(strands.levels):
        rows = np.flatnonzero(strands.levels == level)
        pairs = KDTree(strands.places[rows]).query_pairs(FACING_REACH * strands.spacing, output_type="ndarray")
        first, second = rows[np.vstack([pairs, pairs[:, ::-1]])].T
        length, ahead, behind = _seen(strands, first, second)
        alike = np.einsum("kx,kx->k", strands.inward[first], strands.inward[second])
        facing = (ahead > AHEAD * length) & (behind > AHEAD * length) & (alike < -ALIKE)
        first, second, length = first[facing], second[facing], length[facing]
        # The nearest one of each is written last.
        farthest_first = np.argsort(-length, kind="stable")
        found[first[farthest_first]] = second[farthest_first]
        away[first[farthest_first]] = length[farthest_first]
    return found, away


def _inside(strands: Strands) -> tuple[IntArray, FloatArray]:
    """Return the nearest sample of the next level where it lies inwards of each, -1 for none, and its distance [mm]."""
    count = strands.levels.size
    found, away = np.full(count, -1), np.full(count, np.inf)
    for level in np.unique(strands.levels):
        rows, following = (np.flatnonzero(strands.levels == number) for number in (level, level + 1))
        if not following.size:
            continue
        reach = NEXT_REACH * strands.spacing
        distances, nearest = KDTree(strands.places[following]).query(strands.places[rows], distance_upper_bound=reach)
        reached = np.isfinite(distances)
        first, second = rows[reached], following[np.asarray(nearest, dtype=np.int64)[reached]]
        length, ahead, _ = _seen(strands, first, second)
        alike = np.einsum("kx,kx->k", strands.inward[first], strands.inward[second])
        beside = (ahead > AHEAD * length) & (alike > ALIKE)
        found[first[beside]], away[first[beside]] = second[beside], length[beside]
    return found, away


def _seen(strands: Strands, first: IntArray, second: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the lengths of lines between samples, and their parts along the inward directions at either end [mm]."""
    line = strands.places[second] - strands.places[first]
    ahead = np.einsum("kx,kx->k", line, strands.inward[first])
    return np.linalg.norm(line, axis=1), ahead, -np.einsum("kx,kx->k", line, strands.inward[second])
