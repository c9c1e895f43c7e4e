"""On which side of a closed surface points lie, by the generalised winding number [Jacobson2013].

Checks of surface against surface call a tool free that is wholly inside a closed body; this one does not. The
winding number is the solid angle under which a surface is seen, over that of the full sphere: 1 inside, 0 outside.
"""

from __future__ import annotations

import numpy as np

from geoprint.model import BoolArray, FloatArray, Surface
from geoprint.surfaces import half_edges

# Closed surfaces give 0 or 1, or -1 where they are wound inside out; half is safely between.
INSIDE = 0.5
# Pairs of points and triangles worked on at a time: about 150 MB of intermediate arrays.
PAIRS_AT_A_TIME = 500_000


def is_closed(surface: Surface) -> bool:
    """Say whether every side of every face has a neighbour that runs along it in the opposite direction.

    Vertices at the very same place count as one, because some formats store every triangle by itself.
    """
    places, joined = np.unique(surface.vertices, axis=0, return_inverse=True)
    sides = joined.reshape(-1)[half_edges(surface.faces)]
    count = len(places)
    forth = np.sort(sides[:, 0] * count + sides[:, 1])
    back = np.sort(sides[:, 1] * count + sides[:, 0])
    return bool((forth == back).all())


def inside(points: FloatArray, triangles: FloatArray) -> BoolArray:
    """Return (k,) whether (k, 3) points [mm] are inside a closed surface of (m, 3, 3) triangles of either winding."""
    within = ((points >= triangles.min(axis=(0, 1))) & (points <= triangles.max(axis=(0, 1)))).all(axis=1)
    within[within] = np.abs(winding_numbers(points[within], triangles)) > INSIDE
    return within


def winding_numbers(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """Return how often triangles wind around points.

    The solid angle of a triangle is that of [VanOosterom1983, eq. 8]. Points on the surface itself are undefined.

    Args:
        points: (k, 3) [mm].
        triangles: (m, 3, 3) corners [mm], counter-clockwise from outside.

    Returns:
        (k,) winding numbers.

    Examples:
        >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
        >>> tetrahedron = corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
        >>> winding_numbers(np.array([[0.1, 0.1, 0.1], [1.0, 1.0, 1.0]]), tetrahedron).round(6) + 0.0
        array([1., 0.])
    """
    total = np.zeros(len(points))
    step = max(PAIRS_AT_A_TIME // max(len(points), 1), 1)
    for first in range(0, len(triangles), step):
        corners = triangles[None, first : first + step] - points[:, None, None]
        a, b, c = corners[:, :, 0], corners[:, :, 1], corners[:, :, 2]
        la, lb, lc = (np.linalg.norm(corner, axis=2) for corner in (a, b, c))
        volume = (a * np.cross(b, c)).sum(axis=2)
        rest = la * lb * lc + (a * b).sum(axis=2) * lc + (b * c).sum(axis=2) * la + (c * a).sum(axis=2) * lb
        total += np.arctan2(volume, rest).sum(axis=1)
    return total / (2 * np.pi)
