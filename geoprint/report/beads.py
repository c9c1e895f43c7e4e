"""Beads as they lie on a part: ribbons of their width on the surface, whose foreshortening is that of the part."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import FloatArray, IntArray, Surface
from geoprint.surfaces import vertex_normals


def bead_sides(
    surface: Surface, places: FloatArray, offsets: IntArray, *, width: float | FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the sides of beads whose middles run through given places.

    Args:
        surface: that they lie on.
        places: (k, 3) samples, run after run [mm].
        offsets: (r + 1,) where each run starts among them.
        width: of the beads, one for all or (k,) one a sample [mm].

    Returns:
        (k, 3) left and (k, 3) right side as seen from outside along the run [mm].
    """
    before, after = np.arange(len(places)) - 1, np.arange(len(places)) + 1
    before[offsets[:-1]], after[offsets[1:] - 1] = offsets[:-1], offsets[1:] - 1
    along = places[after] - places[before]
    across = np.cross(normals_at(surface, places), along)
    lengths = np.linalg.norm(across, axis=1, keepdims=True)
    half = 0.5 * np.reshape(width, (-1, 1)) * across / np.where(lengths > 0.0, lengths, 1.0)
    return places + half, places - half


def squares_on(surface: Surface, places: FloatArray, *, side: float) -> FloatArray:
    """Return (j, 4, 3) squares on a surface about (j, 3) places, turned as they come [mm]."""
    normals = normals_at(surface, places)
    # Any direction that is not along the normal serves.
    helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, helper)
    first *= 0.5 * side / np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normals, first)
    corners = [first + second, second - first, -first - second, first - second]
    return places[:, None] + np.stack(corners, axis=1)


def normals_at(surface: Surface, places: FloatArray) -> FloatArray:
    """Return the (k, 3) normals of the vertices nearest to (k, 3) places."""
    _, nearest = KDTree(surface.vertices).query(places)
    return vertex_normals(surface)[np.asarray(nearest, dtype=np.int64)]
