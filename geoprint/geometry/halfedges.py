"""Half-edges, the sides of triangles: the next and the previous one of a face, and the twin across the edge.

Half-edge h = 3 f + i runs along face f from its corner i to its corner i + 1 (mod 3), the face on its left seen from
outside; it stands for that corner too. What is said of half-edges in arrays of 3 m rows is in this order everywhere.

Numba is loaded with this module, so that `topology` asks for it only when it is needed.
"""

from __future__ import annotations

import numpy as np

from geoprint.kernels import inlined, inner, njit
from geoprint.model import IntArray

# What `matched` says of half-edges that have no twin, and of those whose edge has more than two faces.
BORDER, CROWDED = -1, -2


@inlined
def next_half(half: int) -> int:
    """Return the half-edge of the same face that starts where this one ends."""
    return half + 1 if half % 3 < 2 else half - 2


@inner
def previous_half(half: int) -> int:
    """Return the half-edge of the same face that ends where this one starts."""
    return half - 1 if half % 3 > 0 else half + 2


def next_halves(halves: IntArray) -> IntArray:
    """Return `next_half` of each of (k,) half-edges."""
    return halves + np.where(halves % 3 < 2, 1, -2)


@njit
def matched(starts: IntArray, vertices: int) -> IntArray:
    """Return the twin of every half-edge, however the faces beside an edge are wound.

    Half-edges are sorted by their larger vertex and then by their smaller one, both times by counting, so that those
    of one edge stand together.

    Args:
        starts: (3 m,) vertex at which each half-edge starts.
        vertices: more than the largest of them.

    Returns:
        (3 m,) the other half-edge of the same edge; BORDER where there is none, CROWDED where there are several.
    """
    count = starts.size
    lows, highs = np.empty(count, np.int64), np.empty(count, np.int64)
    for half in range(count):
        start, end = starts[half], starts[next_half(half)]
        lows[half], highs[half] = min(start, end), max(start, end)
    order = counted(lows, counted(highs, np.arange(count), vertices), vertices)
    twins = np.full(count, BORDER)
    first = 0
    while first < count:
        half, last = order[first], first + 1
        while last < count and lows[order[last]] == lows[half] and highs[order[last]] == highs[half]:
            last += 1
        if last == first + 2:
            twins[half], twins[order[first + 1]] = order[first + 1], half
        elif last > first + 2:
            twins[order[first:last]] = CROWDED
        first = last
    return twins


@njit
def counted(keys: IntArray, order: IntArray, bound: int) -> IntArray:
    """Return an order of keys from 0 to below a bound sorted by them; equal ones keep their places."""
    places = np.zeros(bound + 1, np.int64)
    for key in keys:
        places[key + 1] += 1
    for key in range(bound):
        places[key + 1] += places[key]
    result = np.empty(order.size, np.int64)
    for item in order:
        result[places[keys[item]]] = item
        places[keys[item]] += 1
    return result
