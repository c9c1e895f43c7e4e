"""Streams of any length: poses on a spiral over the dome of `benchmarks.parts.surfaces`."""

from __future__ import annotations

import numpy as np

from geoprint import transforms
from geoprint.model import PoseStream

RADIUS = 20.0  # of the dome of `benchmarks.parts.surfaces` [mm]
STEEPEST = 0.5  # polar angle at which the spiral ends [rad]


def spiral(count: int, *, standoff: float) -> PoseStream:
    """Return poses on a spiral over the top of the dome, evenly spaced, the nozzle against the normal."""
    polar = STEEPEST * np.sqrt((np.arange(count) + 0.5) / count)
    turn = 2.0 * np.pi * np.sqrt(count / 50.0) * polar / STEEPEST
    normals = np.column_stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])
    down = np.diag([1.0, -1.0, -1.0])
    rotations = transforms.smallest_rotation(down[:, 2], -normals) @ down
    tips = (RADIUS + standoff) * normals
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
