"""Side lengths, areas and thinness of the triangles of a mesh, with few arrays at a time."""

from __future__ import annotations

import numpy as np

from geoprint.model import BoolArray, FloatArray, IntArray


def side_lengths(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the (m, 3) distance between corner i and corner i + 1 of each face."""
    lengths = np.empty(faces.shape)
    for side in range(3):
        lengths[:, side] = np.sqrt(_squares(vertices[faces[:, (side + 1) % 3]] - vertices[faces[:, side]]))
    return lengths


def thinness(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return (m,) twice the area of each face, and the (m,) square of its longest side."""
    starts = vertices[faces[:, 0]]
    first, second = vertices[faces[:, 1]] - starts, vertices[faces[:, 2]] - starts
    (x, y, z), (u, v, w) = first.T, second.T
    doubled = np.sqrt((y * w - z * v) ** 2 + (z * u - x * w) ** 2 + (x * v - y * u) ** 2)
    longest = np.maximum(_squares(first), _squares(second))
    longest = np.sqrt(np.maximum(longest, _squares(vertices[faces[:, 2]] - vertices[faces[:, 1]])))
    return doubled, longest * longest


def reaching(vertices: FloatArray, faces: IntArray, centre: FloatArray, radius: float) -> BoolArray:
    """Return (m,) which faces may reach into a ball: their balls, about the means of their corners, meet it."""
    middles = _middles(vertices, faces)
    sizes = np.zeros(len(faces))
    for corner in range(3):
        np.maximum(sizes, np.sqrt(_squares(vertices[faces[:, corner]] - middles)), out=sizes)
    return np.asarray(np.sqrt(_squares(middles - centre)) <= radius + sizes)


def nearest_middle(vertices: FloatArray, faces: IntArray, centre: FloatArray) -> float:
    """Return the distance from a (3,) position to the nearest mean of the corners of a face."""
    return float(np.sqrt(_squares(_middles(vertices, faces) - centre).min(initial=np.inf)))


def _middles(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the (m, 3) means of the corners of the faces."""
    middles = vertices[faces[:, 0]] + vertices[faces[:, 1]]
    middles += vertices[faces[:, 2]]
    middles /= 3.0
    return middles


def _squares(vectors: FloatArray) -> FloatArray:
    """Return the (m,) squared lengths of (m, 3) vectors, always summed in the order of the axes."""
    x, y, z = vectors.T
    return np.asarray(x * x + y * y + z * z)
