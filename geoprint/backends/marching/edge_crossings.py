"""Where levels cross the edges of a mesh, given the marched front: a numba kernel.

A straight line between the two values on an edge misses the level by up to the edge's squared length by eight radii
of the front. The front knows its slopes at both ends, and the cubic through values and slopes hits it.
"""

from __future__ import annotations

from math import sin

import numpy as np

from geoprint.backends.marching.front import SEED_VERTEX, Front, MarchingMesh
from geoprint.backends.marching.kernels import slope
from geoprint.kernels import inner, njit
from geoprint.model import FloatArray, IntArray
from geoprint.surfaces.halfedges import next_half, previous_half

# Half-edges whose length differs by more than this share from the edge's are another line between its ends.
SAME_LENGTH = 1e-9
# Halvings of the bracket: the share is exact to 1e-12.
HALVINGS = 40


@njit
def crossing_shares(
    mesh: MarchingMesh, front: Front, edges: IntArray, lengths: FloatArray, levels: FloatArray, meeting: float
) -> FloatArray:
    """Return where levels cross edges.

    Args:
        mesh: the triangles that were marched.
        front: as marching left it.
        edges: (k, 2) vertices of the edges; they need not be edges of the triangles.
        lengths: (k,) of the edges [mm].
        levels: (k,) values between those at the ends of the edge [mm].
        meeting: as for `march`.

    Returns:
        (k,) shares of the edge from the first vertex. Along lines that no triangle has as a side the distance is taken
        as linear.
    """
    shares = np.empty(levels.size)
    for k in range(levels.size):
        start, end = int(edges[k, 0]), int(edges[k, 1])
        low, high = front.distances[start], front.distances[end]
        first, last = edge_slopes(mesh, front, start, end, lengths[k])
        if first - last > meeting * lengths[k]:
            shares[k] = ridge_crossing(low, high, first, last, levels[k])
        else:
            shares[k] = cubic_crossing(low, high, first, last, levels[k])
    return shares


@njit
def slopes_at(
    mesh: MarchingMesh, front: Front, edges: IntArray, lengths: FloatArray, shares: FloatArray, meeting: float
) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of the distance along edges, at shares of their length, and where it rises across.

    The other arguments are those of `crossing_shares`.

    Returns:
        (k,) derivatives, per mm; (k,) positive where the distance rises to the left of the edge, negative where to the
        right, and 0 where the front does not know.
    """
    slopes, sides = np.empty(shares.size), np.empty(shares.size)
    for k in range(shares.size):
        start, end = int(edges[k, 0]), int(edges[k, 1])
        low, high = front.distances[start], front.distances[end]
        first, last = edge_slopes(mesh, front, start, end, lengths[k])
        first_side, last_side = edge_sides(mesh, front, start, end, lengths[k])
        share, rest = shares[k], 1.0 - shares[k]
        sides[k] = first_side if share < 0.5 else last_side
        if first - last > meeting * lengths[k]:
            on_first = low + share * first < high - rest * last
            slopes[k] = (first if on_first else last) / lengths[k]
            sides[k] = first_side if on_first else last_side
        else:
            climb = high - low
            change = (first - climb) * rest * (1.0 - 3.0 * share) + (climb - last) * share * (2.0 - 3.0 * share)
            slopes[k] = (climb + change) / lengths[k]
    return slopes, sides


@inner
def edge_slopes(mesh: MarchingMesh, front: Front, start: int, end: int, length: float) -> tuple[float, float]:
    """Return the derivatives of the distance by the share of an edge, at its start and its end.

    Both are the difference of the distances where the edge is no side of a triangle.
    """
    half = half_edge_between(mesh, start, end, length)
    if half >= 0:
        first, last = slopes_along(mesh, front, half)
        return first * length, last * length
    half = half_edge_between(mesh, end, start, length)
    if half >= 0:
        last, first = slopes_along(mesh, front, half)
        return -first * length, -last * length
    climb = front.distances[end] - front.distances[start]
    return climb, climb


@inner
def edge_sides(mesh: MarchingMesh, front: Front, start: int, end: int, length: float) -> tuple[float, float]:
    """Return whether the distance rises to the left (positive) or right of an edge, at its start and its end.

    Both are 0 where the edge is no side of a triangle.
    """
    half = half_edge_between(mesh, start, end, length)
    if half >= 0:
        return sides_along(mesh, front, half)
    half = half_edge_between(mesh, end, start, length)
    if half >= 0:
        last, first = sides_along(mesh, front, half)
        return -first, -last
    return 0.0, 0.0


@inner
def half_edge_between(mesh: MarchingMesh, start: int, end: int, length: float) -> int:
    """Return the half-edge of a length from one vertex to another, -1 where there is none."""
    half = mesh.first[start]
    while True:
        if mesh.corners[next_half(half)] == end and abs(mesh.lengths[half] - length) <= SAME_LENGTH * length:
            return half
        half = mesh.twins[previous_half(half)]
        if half < 0 or half == mesh.first[start]:
            return -1


@inner
def slopes_along(mesh: MarchingMesh, front: Front, half: int) -> tuple[float, float]:
    """Return the slopes of the distance along a half-edge at its start and its end, per mm."""
    start, following = mesh.corners[half], next_half(half)
    end = mesh.corners[following]
    first = slope(mesh, front, start, mesh.bearings[half])
    back = mesh.bearings[following] + mesh.angles[following] * mesh.stretch[end]
    return first, -slope(mesh, front, end, back)


@inner
def sides_along(mesh: MarchingMesh, front: Front, half: int) -> tuple[float, float]:
    """Return the derivatives of the distance to the left of a half-edge at its start and its end; 0 on the seed."""
    start, following = mesh.corners[half], next_half(half)
    end = mesh.corners[following]
    back = mesh.bearings[following] + mesh.angles[following] * mesh.stretch[end]
    first = 0.0 if front.marks[start] & SEED_VERTEX else sin(mesh.bearings[half] - front.origins[start])
    last = 0.0 if front.marks[end] & SEED_VERTEX else -sin(back - front.origins[end])
    return first, last


@inner
def ridge_crossing(low: float, high: float, first: float, last: float, level: float) -> float:
    """Return where a level between the values at 0 and 1 is crossed from the lower one up to the ridge."""
    share = (level - low) / (high - low)
    if high > low and first > 0.0:
        share = (level - low) / first
    elif high < low and last < 0.0:
        share = 1.0 + (level - high) / last
    return min(1.0, max(0.0, share))


@inner
def cubic_crossing(low: float, high: float, first: float, last: float, level: float) -> float:
    """Return where the cubic with the given values and slopes at 0 and 1 takes a level between the values."""
    rising = high > low
    left, right = 0.0, 1.0
    for _ in range(HALVINGS):
        share = 0.5 * (left + right)
        rest = 1.0 - share
        value = low + share * (high - low)
        value += share * rest * ((first - (high - low)) * rest + ((high - low) - last) * share)
        if (value < level) == rising:
            left = share
        else:
            right = share
    return 0.5 * (left + right)
