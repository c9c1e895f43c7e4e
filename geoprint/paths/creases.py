"""Where a planned tip could not follow the normals of the surface, and how near it comes to the surface there."""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray, IntArray, PoseStream, Surface, Toolpath, frozen
from geoprint.surfaces import closest, normals


@frozen
class Creases:
    """Poses on deposit in creases too narrow for the stand-off, where the tip is lifted along smoothed normals.

    Attributes:
        poses: (j,) rows of the stream, rising.
        distances: (j,) from the tip to the nearest place of the surface [mm].
        count: how often a run crosses one: stretches of these poses farther apart than a stand-off.
    """

    poses: IntArray
    distances: FloatArray
    count: int


def creases(poses: PoseStream, toolpath: Toolpath, surface: Surface) -> Creases:
    """Return where a stream left the normals of the surface, and measure the tip's distance there.

    Args:
        poses: made of the toolpath.
        toolpath: on the surface.
        surface: what is printed on.
    """
    rows = np.flatnonzero(poses.deposit)
    rows = rows[(poses.normals[rows] != normals(surface, toolpath.curves.points)).any(axis=1)]
    if rows.size == 0:
        return Creases(rows, np.zeros(0), 0)
    apart = (np.diff(poses.runs[rows]) > 0) | (np.diff(poses.arcs[rows]) > poses.standoff)
    return Creases(rows, closest(surface, poses.tips[rows])[1], 1 + int(np.count_nonzero(apart)))
