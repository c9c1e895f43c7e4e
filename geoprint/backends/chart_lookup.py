"""Which triangle of a flat mesh holds a point: bins over the plane, exact barycentric weights, a numba kernel."""

from __future__ import annotations

import numpy as np

from geoprint.kernels import njit
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfacePoints
from geoprint.surfaces import closest

# Triangles a bin of the grid, on average over its box.
TRIANGLES_PER_BIN = 2.0
# A weight this far below zero is rounding on an edge; a point beyond goes to the closest triangle.
OUTSIDE_WEIGHT = 1e-9


def locate(chart: Surface, places: FloatArray) -> SurfacePoints:
    """Return points of the plane as points of a flat mesh.

    A point on an edge belongs to one of its triangles; one beside the mesh, by a hair or far, becomes the nearest
    point of its border.

    Args:
        chart: m triangles in the plane z = 0, counter-clockwise.
        places: (k, 2) x and y [mm].

    Examples:
        >>> square = Surface(np.array([[0.0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))
        >>> locate(square, np.array([[1.0, 3.0], [3.0, -1.0]])).weights
        array([[0.25, 0.25, 0.5 ], [0.25, 0.75, 0.  ]])
    """
    found, weights = _nearest_held(chart, places)
    beside = weights.min(axis=1) < -OUTSIDE_WEIGHT
    if beside.any():
        lost = places[beside]
        nearest, _ = closest(chart, np.column_stack([lost, np.zeros(len(lost))]))
        found[beside], weights[beside] = nearest.faces, nearest.weights
    weights = np.maximum(weights, 0.0)
    return SurfacePoints(found, weights / weights.sum(axis=1, keepdims=True))


def holds(chart: Surface, places: FloatArray) -> BoolArray:
    """Tell which (k, 2) points of the plane [mm] lie in a flat mesh, as `locate` takes it, or on its border.

    Examples:
        >>> square = Surface(np.array([[0.0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))
        >>> holds(square, np.array([[1.0, 3.0], [3.0, -1.0]]))
        array([ True, False])
    """
    _, weights = _nearest_held(chart, places)
    return np.asarray(weights.min(axis=1) >= -OUTSIDE_WEIGHT)


def _nearest_held(chart: Surface, places: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return, as `held`, the triangles near points and weights, of which one is negative for points outside."""
    corners: FloatArray = np.ascontiguousarray(chart.vertices[chart.faces][:, :, :2])
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    side = float(np.sqrt((high - low).prod() * TRIANGLES_PER_BIN / len(corners)))
    columns, rows = (int(count) for count in np.floor((high - low) / side).astype(np.int64) + 1)
    first = np.floor((corners.min(axis=1) - low) / side).astype(np.int64)
    last = np.floor((corners.max(axis=1) - low) / side).astype(np.int64)
    faces, offsets = binned(first, last, columns, rows)
    boxes = np.clip(np.floor((places - low) / side).astype(np.int64), 0, [columns - 1, rows - 1])
    return held(corners, faces, offsets, boxes[:, 1] * columns + boxes[:, 0], places)


@njit
def binned(first: IntArray, last: IntArray, columns: int, rows: int) -> tuple[IntArray, IntArray]:
    """List the triangles of every bin that their boxes touch.

    Args:
        first: (m, 2) column and row of the first bin of each triangle's box.
        last: (m, 2) of the last one.
        columns: of the grid.
        rows: of the grid.

    Returns:
        Triangles, bin after bin, and (bins + 1,) where each bin begins; bin = row * columns + column.
    """
    offsets = np.zeros(columns * rows + 1, dtype=np.int64)
    for face in range(first.shape[0]):
        for row in range(first[face, 1], last[face, 1] + 1):
            for column in range(first[face, 0], last[face, 0] + 1):
                offsets[row * columns + column + 1] += 1
    offsets = np.cumsum(offsets)
    place = offsets[:-1].copy()
    faces = np.empty(offsets[-1], dtype=np.int64)
    for face in range(first.shape[0]):
        for row in range(first[face, 1], last[face, 1] + 1):
            for column in range(first[face, 0], last[face, 0] + 1):
                faces[place[row * columns + column]] = face
                place[row * columns + column] += 1
    return faces, offsets


@njit
def held(
    corners: FloatArray, faces: IntArray, offsets: IntArray, bins: IntArray, places: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Return, for points in bins, the triangle there whose smallest weight is largest, and the weights.

    Args:
        corners: (m, 3, 2) of the triangles.
        faces: of every bin, as `binned`.
        offsets: where each bin begins.
        bins: (k,) bin of each point.
        places: (k, 2).

    Returns:
        (k,) triangles and (k, 3) barycentric weights, negative where the point is outside; -1 in a bin without any.
    """
    found = np.zeros(places.shape[0], dtype=np.int64)
    weights = np.full((places.shape[0], 3), -1.0)
    for point in range(places.shape[0]):
        best = -np.inf
        for place in range(offsets[bins[point]], offsets[bins[point] + 1]):
            a, b, c = corners[faces[place]]
            x, y = places[point, 0] - a[0], places[point, 1] - a[1]
            area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            second = (x * (c[1] - a[1]) - y * (c[0] - a[0])) / area
            third = ((b[0] - a[0]) * y - (b[1] - a[1]) * x) / area
            least = min(1.0 - second - third, second, third)
            if least > best:
                best = least
                found[point] = faces[place]
                weights[point, 0], weights[point, 1], weights[point, 2] = 1.0 - second - third, second, third
    return found, weights
