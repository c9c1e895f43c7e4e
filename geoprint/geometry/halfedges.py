"""Half-edges, the sides of triangles: the next and the previous one of a face, and the twin across the edge.

Half-edge h = 3 f + i runs along face f from its corner i to its corner i + 1 (mod 3), the face on its left seen from
outside; it stands for that corner too. What is said of half-edges in arrays of 3 m rows is in this order everywhere.

Numba is loaded with this module, so that `topology` asks for it only when it is needed.
"""

from __future__ import annotations

import numpy as np

from geoprint.kernels import inlined, inner
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


def matched(starts: IntArray, vertices: int) -> IntArray:
    """Return the twin of every half-edge, however the faces beside an edge are wound.

    Half-edges are sorted by their smaller vertex and then by their larger one, so that those of one edge stand
    together.

    Args:
        starts: (3 m,) vertex at which each half-edge starts.
        vertices: more than the largest of them.

    Returns:
        (3 m,) the other half-edge of the same edge; BORDER where there is none, CROWDED where there are several.
    """
    corners = starts.reshape(-1, 3)
    ends = corners[:, [1, 2, 0]]
    edges = (np.minimum(corners, ends) * vertices + np.maximum(corners, ends)).ravel()
    order = np.argsort(edges, kind="stable")
    edges = edges[order]
    first = np.flatnonzero(np.diff(edges, prepend=-1))
    counts = np.diff(first, append=edges.size)
    twins = np.full(edges.size, BORDER)
    one, other = order[first[counts == 2]], order[first[counts == 2] + 1]
    twins[one], twins[other] = other, one
    twins[order[np.repeat(counts > 2, counts)]] = CROWDED
    return twins
