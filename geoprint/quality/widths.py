"""How wide the strip of surface is that lies nearest to each stretch of path: what the flow should follow."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from geoprint.model import BoolArray, FloatArray, IntArray
from geoprint.quality.deposited import Samples

# The width of a strip is its mean over this share of the spacing to both sides along the path: flow follows no faster.
WIDTH_SHARE = 0.5
# Ends of runs that lie so near to each other are one place, as where a run is split at a corner [mm].
ONE_PLACE = 1e-4


def strip_widths(
    samples: Samples,
    runs: IntArray,
    arcs: FloatArray,
    areas: FloatArray,
    *,
    points: FloatArray,
    closed: BoolArray,
    spacing: float,
) -> tuple[FloatArray, FloatArray]:
    """Return the width of the strip around each sample.

    Args:
        samples: k samples along r runs.
        runs: (j,) to which run pieces of the surface are nearest.
        arcs: (j,) and where along it [mm].
        areas: (j,) how large they are [mm2].
        points: (k, 3) where the samples lie [mm].
        closed: (r,) whether each run is closed.
        spacing: wanted [mm].

    Returns:
        (k,) widths over the spacing, means over half a spacing to both sides, and the (k,) length of path that each
        sample stands for [mm].
    """
    strips = _strips(samples, runs, arcs, areas, points=points, closed=closed)
    return _widths(samples, strips, closed=closed, spacing=spacing)


def _strips(
    samples: Samples, runs: IntArray, arcs: FloatArray, areas: FloatArray, *, points: FloatArray, closed: BoolArray
) -> FloatArray:
    """Return the (k,) area nearest to each sample: each piece of it is shared by the samples before and after."""
    first = np.searchsorted(samples.runs, np.arange(closed.size))
    gaps = np.searchsorted(samples.runs, np.arange(closed.size), side="right") - first - 1
    steps = samples.arcs[first + gaps] / gaps
    position = np.clip(arcs / steps[runs], 0.0, gaps[runs])
    before = np.minimum(position.astype(np.int64), gaps[runs] - 1)
    share = position - before
    count = samples.runs.size
    result = np.asarray(np.bincount(first[runs] + before, areas * (1.0 - share), minlength=count), dtype=np.float64)
    result += np.bincount(first[runs] + before + 1, areas * share, minlength=count)
    ends = np.concatenate([first, first + gaps])
    place = _places(points[ends], closed=closed)
    result[ends] = (np.bincount(place, result[ends]) / np.bincount(place))[place]
    return result


def _places(ends: FloatArray, *, closed: BoolArray) -> IntArray:
    """Return the place of each of the 2 r ends, starts before ends: those at one place share what is nearest to it.

    Which of them is nearer, rounding alone would decide. Both ends of a closed run are one place.
    """
    around = np.flatnonzero(closed)
    near: IntArray = KDTree(ends).query_pairs(ONE_PLACE, output_type="ndarray").astype(np.int64)
    one: IntArray = np.concatenate([near[:, 0], around])
    other: IntArray = np.concatenate([near[:, 1], around + closed.size])
    links = coo_array((np.ones(one.size), (one, other)), shape=(ends.shape[0], ends.shape[0]))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _widths(
    samples: Samples, strips: FloatArray, *, closed: BoolArray, spacing: float
) -> tuple[FloatArray, FloatArray]:
    """Return the (k,) mean widths around each sample, over the spacing, and the (k,) length that each stands for."""
    run = samples.runs
    first = np.searchsorted(run, np.arange(closed.size))
    gaps = (np.searchsorted(run, np.arange(closed.size), side="right") - first - 1)[run]
    rank = np.arange(run.size) - first[run]
    steps = samples.arcs[first[run] + gaps] / gaps
    lengths = np.where((rank == 0) | (rank == gaps), 0.5 * steps, steps)
    area, length = np.zeros(run.size), np.zeros(run.size)
    reach = np.maximum(np.round(WIDTH_SHARE * spacing / steps), 1).astype(np.int64)
    # A closed run shorter than the reach to both sides is taken once around.
    reach = np.minimum(reach, np.maximum((gaps - 1) // 2, 1))
    for shift in range(-int(reach.max()), int(reach.max()) + 1):
        place = np.where(closed[run], (rank + shift) % gaps, rank + shift)
        valid = (abs(shift) <= reach) & (place >= 0) & (place <= gaps)
        index = first[run] + np.clip(place, 0, gaps)
        # The ends of a closed run hold half of their strip each.
        whole = np.where(closed[run] & (place == 0), 2.0, 1.0)
        area += np.where(valid, whole * strips[index], 0.0)
        length += np.where(valid, whole * lengths[index], 0.0)
    return area / length / spacing, lengths
