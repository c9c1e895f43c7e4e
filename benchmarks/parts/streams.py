"""Streams of poses without a plan, and what a stream deposits, as anybody's paths."""

from __future__ import annotations

import numpy as np

from geoprint import transforms
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


DOME_RADIUS = 20.0  # of the dome of `benchmarks.parts.surfaces` [mm]
STEEPEST = 0.5  # polar angle at which the spiral ends [rad]


def spiral(count: int, *, standoff: float) -> PoseStream:
    """Return poses on a spiral over the top of the dome, evenly spaced, the nozzle against the normal."""
    polar = STEEPEST * np.sqrt((np.arange(count) + 0.5) / count)
    turn = 2.0 * np.pi * np.sqrt(count / 50.0) * polar / STEEPEST
    normals = np.column_stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])
    down = np.diag([1.0, -1.0, -1.0])
    rotations = transforms.smallest_rotation(down[:, 2], -normals) @ down
    tips = (DOME_RADIUS + standoff) * normals
    steps = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    ends = np.zeros(count, dtype=bool)
    ends[[0, -1]] = True
    return PoseStream(
        tips=tips,
        quaternions=transforms.same_sign(transforms.quaternion_of(rotations)),
        normals=normals,
        runs=np.zeros(count, dtype=np.int64),
        levels=np.zeros(count, dtype=np.int64),
        layers=np.zeros(count, dtype=np.int64),
        deposit=np.ones(count, dtype=bool),
        stops=ends,
        arcs=np.append(0.0, np.cumsum(steps)),
        flow=np.full(count, 0.5),
        standoff=standoff,
    )
