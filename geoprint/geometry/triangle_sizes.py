"""Side lengths, areas and thinness of the triangles of a mesh, one triangle after the other: nothing is copied first.

Numba is loaded with this module, so that only who prepares meshes or measures large ones takes it.
"""

from __future__ import annotations

from math import inf, sqrt

import numpy as np

from geoprint.kernels import inner, njit
from geoprint.model import BoolArray, FloatArray, IntArray


@njit
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


@njit
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


@njit
def reaching(vertices: FloatArray, faces: IntArray, centre: FloatArray, radius: float) -> BoolArray:
    """Return (m,) which faces may reach into a ball: their balls, about the means of their corners, meet it."""
    found = np.empty(faces.shape[0], np.bool_)
    for face in range(faces.shape[0]):
        middle = middle_of_face(vertices, faces[face])
        size = 0.0
        for corner in range(3):
            place = vertices[faces[face, corner]]
            size = max(size, gap((place[0], place[1], place[2]), middle))
        found[face] = gap(middle, (centre[0], centre[1], centre[2])) <= radius + size
    return found


@njit
def nearest_middle(vertices: FloatArray, faces: IntArray, centre: FloatArray) -> float:
    """Return the distance from a (3,) position to the nearest mean of the corners of a face."""
    least = inf
    for face in range(faces.shape[0]):
        least = min(least, gap(middle_of_face(vertices, faces[face]), (centre[0], centre[1], centre[2])))
    return least


@inner
def middle_of_face(vertices: FloatArray, face: IntArray) -> tuple[float, float, float]:
    """Return the mean of the three corners of a face."""
    a, b, c = vertices[face[0]], vertices[face[1]], vertices[face[2]]
    return (a[0] + b[0] + c[0]) / 3.0, (a[1] + b[1] + c[1]) / 3.0, (a[2] + b[2] + c[2]) / 3.0


@inner
def gap(one: tuple[float, float, float], other: tuple[float, float, float]) -> float:
    """Return the distance between two positions."""
    return sqrt((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2 + (one[2] - other[2]) ** 2)
