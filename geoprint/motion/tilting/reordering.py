"""Runs in another order, so that the table moves less: a heuristic."""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray, IntArray
from geoprint.motion.tilting.ranges import UpRange
from geoprint.motion.tilting.tilts import Tilts, longest, tilted

# Runs that are asked exactly whether they fit where none fits the attitude as it is, the nearest first.
ASKED = 4


def reordered(
    normals: FloatArray, *, runs: IntArray, layers: IntArray, arcs: FloatArray, within: UpRange, overlap: float
) -> tuple[IntArray, Tilts]:
    """Choose an order of the runs within each layer, and the attitudes of a table along it.

    A heuristic: of the runs that are left in a layer, one that can be printed whole without another move follows,
    the one whose normals stay nearest to the direction that points up; where there is none, the nearest one. Runs stay
    whole and keep their direction, layers keep their order. It never needs more moves than the given order: where it
    would, that one is kept.

    Args:
        normals: (n, 3) as `tilted` takes them, and so are the others.
        runs: (n,).
        layers: (n,) layer of each pose, not falling, the same along a run.
        arcs: (n,) [mm].
        within: what the table can bring up, with the critical angle.
        overlap: [mm].

    Returns:
        (n,) the poses in their new order, and the attitudes along these without an arm; `tilted` takes that order with
        one.

    Raises:
        InputError: as `tilted`.
    """
    given = tilted(normals, runs=runs, arcs=arcs, within=within, overlap=overlap)
    breaks = np.flatnonzero((np.diff(runs) != 0) | (np.diff(layers) != 0)) + 1
    order = _order(within.aims(normals, within.nearest(normals)), breaks, layers, within=within)
    found = tilted(normals[order], runs=runs[order], arcs=arcs[order], within=within, overlap=overlap)
    if found.moves >= given.moves:
        return np.arange(len(normals)), given
    return order, found


def _order(aims: FloatArray, breaks: IntArray, layers: IntArray, *, within: UpRange) -> IntArray:
    """Return the (n,) poses run by run, each following where it fits best.

    Args:
        aims: (n, 3) as `UpRange.aims` returns them.
        breaks: first pose of each run but the first.
        layers: (n,).
        within: what the table can bring up.
    """
    runs = np.split(np.arange(len(aims)), breaks)
    starts = np.array([int(run[0]) for run in runs])
    poses = np.empty(0, dtype=np.int64)
    first, up = 0, [*within.admissible(aims[:1]), aims[0]][0]
    for layer in np.unique(layers):
        left = np.flatnonzero(layers[starts] == layer)
        while left.size:
            # The smallest cosine of each run says how far its farthest normal is from up.
            fits = np.minimum.reduceat(aims @ up, starts)[left]
            nearest = left[np.argsort(-fits, kind="stable")]
            taken = int(nearest[0])
            if fits.max() < np.cos(within.critical):
                asked = [(int(each), runs[int(each)]) for each in nearest[:ASKED]]
                fitting = (each for each, run in asked if len(within.admissible(aims[np.append(poses[first:], run)])))
                taken = next(fitting, taken)
            left = left[left != taken]
            poses = np.append(poses, runs[taken])
            first, up = _follow(first, aims[poses], up, within=within)
    return poses


def _follow(first: int, aims: FloatArray, up: FloatArray, *, within: UpRange) -> tuple[int, FloatArray]:
    """Return where the last stretch of what is laid starts, and the direction that points up in it.

    Args:
        first: pose at which the last stretch started before.
        aims: (k, 3) of all that is laid.
        up: (3,) direction before.
        within: what the table can bring up.
    """
    if float((aims[first:] @ up).min()) >= np.cos(within.critical):
        return first, up
    while (behind := longest(first, aims, within=within)) < len(aims):
        first = behind
    found = within.admissible(aims[first:])
    return first, [*found, aims[-1]][0]
