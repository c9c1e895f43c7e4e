"""Side lengths, areas and thinness of the triangles of a mesh, one triangle after the other: nothing is copied first.

Numba is loaded with this module, so that only who prepares meshes or measures large ones takes it.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from geoprint.kernels import njit
from geoprint.model import FloatArray, IntArray


@njit(cache=True)
def side_lengths(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the (m, 3) distance between corner i and corner i + 1 of each face."""
    lengths = np.empty(faces.shape)
    for face in range(faces.shape[0]):
        for side in range(3):
            start, end = faces[face, side], faces[face, (side + 1) % 3]
            square = 0.0
            for axis in range(3):
                square += (vertices[end, axis] - vertices[start, axis]) ** 2
            lengths[face, side] = sqrt(square)
    return lengths


@njit(cache=True)
def thinness(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return (m,) twice the area of each face, and the (m,) square of its longest side."""
    doubled, squares = np.empty(faces.shape[0]), np.empty(faces.shape[0])
    for face in range(faces.shape[0]):
        a, b, c = vertices[faces[face, 0]], vertices[faces[face, 1]], vertices[faces[face, 2]]
        x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        u, v, w = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        doubled[face] = sqrt((y * w - z * v) ** 2 + (z * u - x * w) ** 2 + (x * v - y * u) ** 2)
        opposite = (c[0] - b[0]) ** 2 + (c[1] - b[1]) ** 2 + (c[2] - b[2]) ** 2
        longest = sqrt(max(x * x + y * y + z * z, opposite, u * u + v * v + w * w))
        squares[face] = longest * longest
    return doubled, squares
