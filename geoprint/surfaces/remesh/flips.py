"""Better triangles without new vertices: flipping edges inside the planar faces that a mesh was refined from."""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray, IntArray
from geoprint.surfaces.topology import twins

# An edge is flipped if the cotangents opposite to it sum to less than minus this: rounding does not decide.
COTANGENT_TOLERANCE = 1e-9


def flipped_inside(vertices: FloatArray, faces: IntArray, parents: IntArray) -> IntArray:
    """Flip edges between pieces of one planar face until they are locally Delaunay.

    An edge is flipped if the angles opposite to it sum to more than a half turn and the other diagonal is shorter.
    The surface stays exactly as it is, because both pieces lie in the plane of their common parent.

    Args:
        vertices: (n, 3) positions.
        faces: (m, 3), at most two at an edge.
        parents: (m,) the face that each one is a piece of; pieces with parent -1 are left alone.

    Returns:
        (m, 3) faces; each one is still a piece of its parent.
    """
    result = faces.copy()
    active = np.flatnonzero(parents >= 0)
    while active.size:
        chosen = _independent_flips(vertices, result[active], parents[active])
        left, right = active[chosen[:, 0] // 3], active[chosen[:, 1] // 3]
        a, b, c = (result[left, (chosen[:, 0] + shift) % 3] for shift in range(3))
        d = result[right, (chosen[:, 1] + 2) % 3]
        result[left], result[right] = np.column_stack([a, d, c]), np.column_stack([d, b, c])
        # What a flip changes stays inside its parent.
        touched = np.zeros(int(parents.max()) + 1, dtype=np.bool_)
        touched[parents[left]] = True
        active = active[touched[parents[active]]]
    return result


def _independent_flips(vertices: FloatArray, faces: IntArray, parents: IntArray) -> IntArray:
    """Return (k, 2) half-edges and their twins to flip, the most obtuse first, each face in one flip at most."""
    other = twins(faces)
    half = np.flatnonzero(other > np.arange(other.size))
    half = half[parents[half // 3] == parents[other[half] // 3]]
    a, b, c = (vertices[faces[half // 3, (half + shift) % 3]] for shift in range(3))
    d = vertices[faces[other[half] // 3, (other[half] + 2) % 3]]
    opposite = _cotangents(a - c, b - c) + _cotangents(a - d, b - d)
    shorter = np.linalg.norm(d - c, axis=1) < np.linalg.norm(b - a, axis=1)
    wanted = np.flatnonzero((opposite < -COTANGENT_TOLERANCE) & shorter)
    rank = np.empty(wanted.size, dtype=np.int64)
    rank[np.argsort(opposite[wanted], kind="stable")] = np.arange(wanted.size)
    pairs = np.column_stack([half[wanted], other[half[wanted]]])
    first = np.full(len(faces), wanted.size)
    np.minimum.at(first, pairs // 3, rank[:, None])
    return pairs[(first[pairs // 3] == rank[:, None]).all(axis=1)]


def _cotangents(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return (k,) the cotangent of the angle between (k, 3) vectors."""
    crossed = np.linalg.norm(np.cross(first, second), axis=1)
    return np.einsum("kx,kx->k", first, second) / np.maximum(crossed, np.finfo(np.float64).tiny)
