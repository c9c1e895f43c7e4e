"""Streams of poses without a plan, and what a stream deposits, as anybody's paths."""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray, Polylines, PoseStream


def deposited(poses: PoseStream) -> Polylines:
    """Return what a stream deposits, without its levels."""
    rows = np.flatnonzero(poses.deposit)
    firsts = np.flatnonzero(np.diff(poses.runs[rows], prepend=-1))
    return Polylines(poses.surface_points[rows], np.append(firsts, rows.size))


def rows_on_plate(
    along: FloatArray, *, first: float, spacing: float, count: int, height: float, flow: float
) -> PoseStream:
    """Return the poses of rows along x on a plate at z = 0, without travel between them.

    Args:
        along: (k,) of each pose of a row, rising [mm].
        first: y of the first row [mm].
        spacing: from each to the next [mm].
        count: of the rows.
        height: of the nozzle over the plate [mm].
        flow: of all poses [mm3/mm].
    """
    runs = np.repeat(np.arange(count), along.size)
    points = np.column_stack([np.tile(along, count), first + spacing * runs, np.full(runs.size, height)])
    return PoseStream(
        tips=points.astype(np.float64),
        quaternions=np.tile([0.0, 1.0, 0.0, 0.0], (runs.size, 1)),
        normals=np.tile([0.0, 0.0, 1.0], (runs.size, 1)),
        runs=runs,
        levels=runs,
        layers=np.zeros(runs.size, dtype=np.int64),
        deposit=np.ones(runs.size, dtype=np.bool_),
        stops=np.zeros(runs.size, dtype=np.bool_),
        arcs=np.tile(along - along[0], count),
        flow=np.full(runs.size, flow),
        standoff=height,
    )
