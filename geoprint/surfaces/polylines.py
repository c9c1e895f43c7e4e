"""Polylines in space: length along them, even points on them, and the straight distance to them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import FloatArray

# Nearest pieces that are looked at: a piece's middle may be a little farther than another's and its end nearer.
CANDIDATES = 6


def arc_lengths(points: FloatArray) -> FloatArray:
    """Return (k,) length along a polyline of (k, 3) points from its start [mm].

    Examples:
        >>> arc_lengths(np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0], [3.0, 4.0, 1.0]]))
        array([0., 5., 6.])
    """
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def even_points(points: FloatArray, *, step: float) -> FloatArray:
    """Return points along a polyline at even distances of at most one step, ends included.

    Args:
        points: (k, 3) corners, k >= 2.
        step: [mm].

    Returns:
        (j, 3) points, j >= 2.

    Examples:
        >>> even_points(np.array([[0.0, 0, 0], [3, 0, 0]]), step=1.6)[:, 0]
        array([0. , 1.5, 3. ])
    """
    arcs = arc_lengths(points)
    stations: FloatArray = np.linspace(0.0, float(arcs[-1]), max(int(np.ceil(arcs[-1] / step)), 1) + 1)
    return np.column_stack([np.interp(stations, arcs, points[:, i]) for i in range(points.shape[1])])


@final
class PolylineDistance:
    """Answers how far points are from a set of polylines.

    Args:
        lines: (k, 3) corners of each, k >= 2.
        step: the lines are cut into pieces of at most this length [mm] to find the near ones; the distance to a piece
            is exact, so the step sets speed, not accuracy, as long as it is short against the lines' distances.
    """

    def __init__(self, lines: Sequence[FloatArray], *, step: float) -> None:
        cut = [even_points(line, step=step) for line in lines]
        self._starts = np.vstack([line[:-1] for line in cut])
        self._along = np.vstack([np.diff(line, axis=0) for line in cut])
        self._tree = KDTree(self._starts + 0.5 * self._along)

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the (k,) straight distance from each of (k, 3) points to the nearest polyline [mm]."""
        _, near = self._tree.query(points, k=min(CANDIDATES, len(self._starts)))
        near = np.asarray(near).reshape(len(points), -1)
        start, along = self._starts[near], self._along[near]
        away = points[:, None] - start
        squared = np.maximum((along**2).sum(axis=2), np.finfo(np.float64).tiny)
        share = np.clip((away * along).sum(axis=2) / squared, 0.0, 1.0)
        return np.sqrt(((away - share[..., None] * along) ** 2).sum(axis=2).min(axis=1))
