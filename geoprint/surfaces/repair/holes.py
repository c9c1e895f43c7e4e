"""Closing small holes: a missing triangle is put back, a larger hole is closed where somebody asks for it."""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray, IntArray, Surface
from geoprint.surfaces.operators import face_areas
from geoprint.surfaces.topology import loop_length

# A hole that one triangle closes is a missing triangle if that triangle has at most this share of the area; the rim
# of a small triangular part has more.
MISSING_SHARE = 0.01


def fill_holes(
    surface: Surface, loops: tuple[IntArray, ...], *, longest: float | None
) -> tuple[Surface, tuple[tuple[float, ...], ...]]:
    """Close holes with triangles between the vertices of their rims; the longest rim of an open surface stays.

    Args:
        surface: manifold, consistently wound.
        loops: as `topology.boundary_loops` gives them.
        longest: holes whose rim is up to this long [mm] are closed by the triangles of least area
            [Barequet1995]; None closes those alone that lack a single small triangle, where there is no choice.

    Returns:
        The surface with the new faces behind the others, and the middle of each hole that was closed [mm].
    """
    if longest is None:
        limit = MISSING_SHARE * float(face_areas(surface).sum())
        chosen = [loop for loop in loops if loop.size == 3 and _area(surface.vertices[loop]) <= limit]
    else:
        chosen = [loop for loop in loops[1:] if loop_length(surface.vertices, loop) <= longest]
    if not chosen:
        return surface, ()
    lids = [_lid(surface.vertices, loop) for loop in chosen]
    closed = Surface(vertices=surface.vertices, faces=np.concatenate([surface.faces, *lids]), name=surface.name)
    return closed, tuple(tuple(surface.vertices[loop].mean(axis=0).tolist()) for loop in chosen)


def _area(corners: FloatArray) -> float:
    return float(np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]))) / 2


def _lid(vertices: FloatArray, loop: IntArray) -> IntArray:
    """Return the triangles of least total area that close a loop, wound as its surface.

    Each stretch of the rim from corner i to corner j is closed best by some triangle i, k, j between the best lids of
    its two sides: found for short stretches first.
    """
    # The rim runs with the surface on its left, so that the lid runs in the opposite direction.
    rim = loop[::-1]
    points, count = vertices[rim], loop.size
    cost, split = np.zeros((count, count)), np.zeros((count, count), dtype=np.int64)
    for span in range(2, count):
        for i in range(count - span):
            j = i + span
            middle = np.arange(i + 1, j)
            areas = np.linalg.norm(np.cross(points[middle] - points[i], points[j] - points[i]), axis=1)
            total = cost[i, middle] + cost[middle, j] + areas
            best = int(np.argmin(total))
            cost[i, j], split[i, j] = total[best], middle[best]
    faces: list[tuple[int, int, int]] = []
    waiting = [(0, count - 1)]
    while waiting:
        i, j = waiting.pop()
        if j - i >= 2:
            k = int(split[i, j])
            faces.append((int(rim[i]), int(rim[k]), int(rim[j])))
            waiting += [(i, k), (k, j)]
    return np.array(faces, dtype=np.int64)
