"""Level curves of a function that is linear in each triangle, all levels in one pass, chained into oriented curves.

A vertex whose value equals a level, to rounding, counts as above it. With that rule every triangle that a level
crosses has exactly one edge where the boundary of the triangle, walked counter-clockwise, comes down through the level
and one where it goes up; the piece of the level curve runs from the first to the second, so larger values lie on its
left seen from outside, and pieces of neighbouring triangles join head to tail. Flat triangles at a level carry no piece
of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from geoprint.model import BoolArray, FloatArray, IntArray, ScalarField, Surface, SurfaceCurves, SurfacePoints

EdgeShares: TypeAlias = Callable[[IntArray, FloatArray], FloatArray]

# Values that differ by less than this share of their range are equal: where a row of vertices lies at a level, rounding
# would have some of them below it.
ROUNDING = 1e-7


def isolines(
    surface: Surface, field: ScalarField, *, levels: FloatArray, edge_shares: EdgeShares | None = None
) -> tuple[SurfaceCurves, IntArray]:
    """Trace level curves.

    Args:
        surface: n vertices, m faces.
        field: (n,) values at the vertices.
        levels: (l,) strictly rising values.
        edge_shares: given (k, 2) edges and (k,) values between those at their ends, returns the (k,) shares of the edge
            from the first end at which the field takes them; a field that is linear along edges by default.

    Returns:
        The curves, sorted by level, larger values on their left seen from outside, closed unless they end at the
        border; and (c,) the index of each curve's level. Where a level touches nothing it has no curve.
    """
    faces, starts, ends, edges, level = _cut(surface, field.values, levels)
    values = np.clip(levels[level], *np.sort(field.values[edges], axis=1).T)
    shares = _linear_shares(field, edges, values) if edge_shares is None else edge_shares(edges, values)
    order, offsets, closed = _chain(starts, ends, count=shares.size)
    outgoing = np.full(shares.size, -1)
    outgoing[ends] = faces
    outgoing[starts] = faces
    points = _points_on(surface, edges[order], shares[order], outgoing[order])
    return _by_level(SurfaceCurves(points, offsets, closed), level[order[offsets[:-1]]])


def _cut(
    surface: Surface, values: FloatArray, levels: FloatArray
) -> tuple[IntArray, IntArray, IntArray, IntArray, IntArray]:
    """Cut every triangle by every level between its smallest and its largest value.

    Returns:
        Of each straight piece its triangle and the crossings where it starts and ends; then of each crossing of a level
        with an edge the vertices of the edge, the smaller first, and the level.
    """
    reached = values + ROUNDING * float(np.ptp(values))
    ranks = np.searchsorted(levels, reached, side="right")[surface.faces]
    first = np.minimum(np.minimum(ranks[:, 0], ranks[:, 1]), ranks[:, 2])
    count = np.maximum(np.maximum(ranks[:, 0], ranks[:, 1]), ranks[:, 2]) - first
    face: IntArray = np.repeat(np.arange(int(count.size)), count)
    level = np.arange(face.size) - np.repeat(np.cumsum(count) - count - first, count)
    above = ranks[face] > level[:, None]
    following = np.roll(above, -1, axis=1)
    down, up = np.argmax(above & ~following, axis=1), np.argmax(~above & following, axis=1)
    edges, levels_crossed, where = _numbered_crossings(
        surface, np.tile(face, 2), np.concatenate([down, up]), np.tile(level, 2)
    )
    return face, where[: face.size], where[face.size :], edges, levels_crossed


def _numbered_crossings(
    surface: Surface, faces: IntArray, sides: IntArray, levels: IntArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Return edge and level of every crossing once, and which of them each of (k,) sides at a level is.

    Only edges that are crossed are numbered: often a few of all.
    """
    starts, ends = surface.faces[faces, sides], surface.faces[faces, (sides + 1) % 3]
    base = len(surface.vertices)
    edges, edge = np.unique(np.minimum(starts, ends) * base + np.maximum(starts, ends), return_inverse=True)
    count = int(levels.max(initial=0)) + 1
    crossing, where = np.unique(edge * count + levels, return_inverse=True)
    return np.column_stack(np.divmod(edges[crossing // count], base)), crossing % count, where


def _linear_shares(field: ScalarField, edges: IntArray, values: FloatArray) -> FloatArray:
    """Return where a field that is linear along edges takes values on them."""
    low, high = field.values[edges].T
    return np.clip((values - low) / (high - low), 0.0, 1.0)


def _chain(starts: IntArray, ends: IntArray, *, count: int) -> tuple[IntArray, IntArray, BoolArray]:
    """Order crossings along their curves by pointer doubling: about log2(count) passes over all of them at once.

    Returns:
        (k,) crossings in order, curve after curve, closed ones with their first crossing repeated; (c + 1,) offsets;
        (c,) closed. A closed curve starts at its lowest-numbered crossing.
    """
    itself = np.arange(count)
    following = itself.copy()
    following[starts] = ends
    lowest, jump = itself, following
    for _ in range(max(count, 1).bit_length()):
        lowest, jump = np.minimum(lowest, lowest[jump]), jump[jump]
    closed_crossing = following[jump] != jump
    cut = closed_crossing & (following == lowest)
    following[cut] = itself[cut]
    left, jump = (following != itself).astype(np.int64), following
    for _ in range(max(count, 1).bit_length()):
        left, jump = left + left[jump], jump[jump]
    order = np.lexsort((-left, jump))
    last = jump[order]
    heads = np.flatnonzero(np.diff(last, prepend=-1))
    closed = closed_crossing[order[heads]]
    lengths = np.diff(np.append(heads, count)) + closed
    offsets = np.concatenate([[0], np.cumsum(lengths)])
    repeated = np.insert(order, np.append(heads, count)[1:][closed], order[heads[closed]])
    return repeated, offsets, closed


def _points_on(surface: Surface, ends: IntArray, shares: FloatArray, faces: IntArray) -> SurfacePoints:
    """Express points on edges, given by their ends and shares, in the faces that they belong to."""
    corners = surface.faces[faces]
    weights = np.where(corners == ends[:, :1], 1.0 - shares[:, None], 0.0)
    weights += np.where(corners == ends[:, 1:], shares[:, None], 0.0)
    return SurfacePoints(faces, weights)


def _by_level(curves: SurfaceCurves, levels: IntArray) -> tuple[SurfaceCurves, IntArray]:
    """Sort curves by level, keeping the order inside a level."""
    order = np.argsort(levels, kind="stable")
    lengths = np.diff(curves.offsets)
    sorted_lengths = lengths[order]
    offsets = np.concatenate([[0], np.cumsum(sorted_lengths)])
    pick: IntArray = np.arange(int(offsets[-1])) + np.repeat(curves.offsets[order] - offsets[:-1], sorted_lengths)
    points = curves.points[pick]
    return SurfaceCurves(points, offsets, curves.closed[order]), levels[order]
