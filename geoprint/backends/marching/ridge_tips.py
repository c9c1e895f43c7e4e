"""Corners of level curves that lie just beyond a triangle: the curve pokes through its third side and comes back.

Both ends of that side are on the same side of the level, so that tracing sees no crossing there.
"""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray, IntArray, Surface, SurfacePoints
from geoprint.surfaces import half_edges

# A piece with an end nearer to the third side than this barycentric weight lies on it.
TOUCHING = 1e-6


def tips_beyond(
    surface: Surface, faces: IntArray, *, first: FloatArray, corners: FloatArray, last: FloatArray
) -> tuple[IntArray, SurfacePoints]:
    """Lead pieces of level curves to corners beyond the third side of their triangle, and back.

    The triangle on the other side is unfolded, and the curve continues straight into it.

    Args:
        surface: m faces, consistently wound.
        faces: (k,) triangle of each piece, which runs from one of its sides to another.
        first: (k, 3) barycentric weights of the piece's start.
        corners: (k, 3) of the corner to reach, one of them negative.
        last: (k, 3) of the piece's end.

    Returns:
        The (j,) piece that each new point belongs to, ascending, and the points in their order along it: on going out
        through the side, the corner, and on coming back. Corners beyond the next triangle too are left out of it, and
        pieces whose third side is border, or that touch it, get nothing.
    """
    opposite = np.argmin(corners, axis=1)
    twins = _half_edges_beyond(surface, faces, (opposite + 1) % 3)
    each = np.arange(faces.size)
    apart = np.minimum(first[each, opposite], last[each, opposite]) > TOUCHING
    leads = np.flatnonzero((twins >= 0) & apart)
    faces, opposite, twins = faces[leads], opposite[leads], twins[leads]
    # Corners in the order start of the side, end of the side, apex; the twin runs from the end to the start.
    here = np.column_stack([(opposite + 1) % 3, (opposite + 2) % 3, opposite])
    there = np.column_stack([(twins + 1) % 3, twins % 3, (twins + 2) % 3])
    corners = np.take_along_axis(corners[leads], here, axis=1)
    into, back = (_where_crossed(np.take_along_axis(point[leads], here, axis=1), corners) for point in (first, last))
    tips = _unfolded(_triangles(surface, faces, here), _triangles(surface, twins // 3, there), corners)
    weights = np.stack([_arranged(into, there), _arranged(tips, there), _arranged(back, here)], axis=1)
    found = np.column_stack([twins // 3, twins // 3, faces])
    kept = np.ones(found.shape, dtype=np.bool_)
    kept[:, 1] = tips.min(axis=1) >= 0.0
    return np.repeat(leads, kept.sum(axis=1)), SurfacePoints(found[kept], weights[kept])


def _half_edges_beyond(surface: Surface, faces: IntArray, sides: IntArray) -> IntArray:
    """Return the half-edge 3 f + i on the other side of each side of a face, -1 on the border."""
    starts, ends = surface.faces[faces, sides], surface.faces[faces, (sides + 1) % 3]
    near = np.zeros(len(surface.vertices), dtype=np.bool_)
    near[starts] = near[ends] = True
    around = np.flatnonzero(np.count_nonzero(near[surface.faces], axis=1) >= 2)
    base = len(surface.vertices)
    tails, heads = half_edges(surface.faces[around]).T
    keys = tails * base + heads
    order = np.argsort(keys)
    wanted = ends * base + starts
    place = order[np.minimum(np.searchsorted(keys[order], wanted), order.size - 1)]
    return np.where(keys[place] == wanted, 3 * around[place // 3] + place % 3, -1)


def _where_crossed(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the (k, 3) weights of where the lines from points to corners cross the side opposite to the last one."""
    share = points[:, 2] / (points[:, 2] - corners[:, 2])
    end = points[:, 1] + share * (corners[:, 1] - points[:, 1])
    return np.column_stack([1.0 - end, end, np.zeros(end.size)])


def _unfolded(here: FloatArray, there: FloatArray, corners: FloatArray) -> FloatArray:
    """Return weights in the triangles there of places beyond the first side of the triangles here.

    Args:
        here: (k, 3, 3) start and end of the side, and apex.
        there: (k, 3, 3) start and end of the same side, and the apex on its other side.
        corners: (k, 3) weights here, the last negative.

    Returns:
        (k, 3) weights; negative where the place lies beyond that triangle too.
    """
    foot, height = _foot_and_height(here)
    far_foot, far_height = _foot_and_height(there)
    apex = -corners[:, 2] * height / far_height
    end = corners[:, 1] + corners[:, 2] * foot - apex * far_foot
    return np.column_stack([1.0 - end - apex, end, apex])


def _foot_and_height(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where the foot of each apex lies, as a share of the line from start to end, and its height [mm]."""
    side, slant = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    foot = np.einsum("kx,kx->k", slant, side) / np.einsum("kx,kx->k", side, side)
    return foot, np.linalg.norm(slant - foot[:, None] * side, axis=1)


def _triangles(surface: Surface, faces: IntArray, order: IntArray) -> FloatArray:
    """Return (k, 3, 3) corners of faces in the given order."""
    return surface.vertices[np.take_along_axis(surface.faces[faces], order, axis=1)]


def _arranged(weights: FloatArray, order: IntArray) -> FloatArray:
    """Return weights, given for corners in an order, for the corners as the face has them."""
    result = np.empty_like(weights)
    np.put_along_axis(result, order, weights, axis=1)
    return result
