"""Where levels cross the edges of a mesh, given the marched front: a numba kernel.

A straight line between the two values on an edge misses the level by up to the edge's squared length by eight radii
of the front. The front knows its slopes at both ends, and the cubic through values and slopes hits it.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from geoprint.backends.marching_kernels import Front, Mesh, after, before, slope
from geoprint.model import FloatArray, IntArray

# Half-edges whose length differs by more than this share from the edge's are another line between its ends.
SAME_LENGTH = 1e-9
# Halvings of the bracket: the share is exact to 1e-12.
HALVINGS = 40


@njit(cache=True, error_model="numpy")
def crossing_shares(
    mesh: Mesh, front: Front, edges: IntArray, lengths: FloatArray, levels: FloatArray, meeting: float
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
        (k,) shares of the way from the first vertex. Along lines that no triangle has as a side the distance is taken
        as linear.
    """
    shares = np.empty(levels.size)
    for k in range(levels.size):
        start, end = edges[k, 0], edges[k, 1]
        low, high = front.distances[start], front.distances[end]
        shares[k] = min(1.0, max(0.0, (levels[k] - low) / (high - low)))
        half = half_edge_between(mesh, start, end, lengths[k])
        turned = half < 0
        if turned:
            half = half_edge_between(mesh, end, start, lengths[k])
        if half >= 0:
            first, last = slopes(mesh, front, half)
            if turned:
                first, last = -last, -first
            first, last = first * lengths[k], last * lengths[k]
            if first - last > meeting * lengths[k]:
                shares[k] = ridge_share(low, high, first, last, levels[k], shares[k])
            else:
                shares[k] = cubic_crossing(low, high, first, last, levels[k])
    return shares


@njit(cache=True, error_model="numpy")
def half_edge_between(mesh: Mesh, start: int, end: int, length: float) -> int:
    """Return the half-edge of a length from one vertex to another, -1 where there is none."""
    half = mesh.first[start]
    while True:
        if mesh.corners[after(half)] == end and abs(mesh.lengths[half] - length) <= SAME_LENGTH * length:
            return half
        half = mesh.twins[before(half)]
        if half < 0 or half == mesh.first[start]:
            return -1


@njit(cache=True, error_model="numpy")
def slopes(mesh: Mesh, front: Front, half: int) -> tuple[float, float]:
    """Return the slopes of the distance along a half-edge at its start and its end, per mm."""
    start, following = mesh.corners[half], after(half)
    end = mesh.corners[following]
    first = slope(mesh, front, start, mesh.bearings[half])
    back = mesh.bearings[following] + mesh.angles[following] * mesh.stretch[end]
    return first, -slope(mesh, front, end, back)


@njit(cache=True, error_model="numpy")
def ridge_share(low: float, high: float, first: float, last: float, level: float, linear: float) -> float:
    """Return where a level is crossed on the side of a ridge that rises or falls through it."""
    if high > low:
        share = (level - low) / first if first > 0.0 else linear
    else:
        share = 1.0 + (level - high) / last if last < 0.0 else linear
    return min(1.0, max(0.0, share))


@njit(cache=True, error_model="numpy")
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
