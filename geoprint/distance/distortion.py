"""The UV map of a parametrization: which triangle holds a point, and what the map does to angles and lengths."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.errors import FieldError, InputError
from geoprint.geometry import closest, face_areas, in_words, sum_around_vertices
from geoprint.kernels import njit, writable
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfacePoints, freeze_arrays, frozen

# Which triangle of a flat mesh holds a point: bins over the plane, exact barycentric weights, a numba kernel.


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
    return held(corners, faces, offsets, boxes[:, 1] * columns + boxes[:, 0], writable(places))


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


# What a chart does to angles and lengths, triangle by triangle, and the spacing that follows from it.


@final
@frozen
class Distortion:
    """How a flat chart differs from its surface; means and percentiles are weighted by the surface's area.

    Attributes:
        dilatations: (m,) larger over smaller stretch of each triangle, 1 where its angles are kept.
        area_scales: (m,) chart area over surface area of each triangle, over that of the whole, so that the mean is 1.
        areas: (m,) area of each triangle on the surface [mm2].
    """

    dilatations: FloatArray
    area_scales: FloatArray
    areas: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, dilatations="float: m", area_scales="float: m", areas="float: m")

    @property
    def mean_dilatation(self) -> float:
        """Mean ratio of the stretches."""
        return float(self.dilatations @ self.areas / self.areas.sum())

    @property
    def worst_dilatation(self) -> float:
        """Largest ratio of the stretches."""
        return float(self.dilatations.max())

    def dilatation_percentile(self, percent: float) -> float:
        """Return the dilatation below which this share of the area [%] lies."""
        return _percentile(self.dilatations, self.areas, percent)

    def scale_percentile(self, percent: float) -> float:
        """Return the relative area scale below which this share of the area [%] lies."""
        return _percentile(self.area_scales, self.areas, percent)


def distortion(surface: Surface, chart: Surface) -> Distortion:
    """Measure what a chart does to each triangle.

    Over a triangle the map is f(w) = a w + b conj(w) in complex coordinates w of its plane; its stretches are
    |a| + |b| and |a| - |b|. As a sum and a difference they are right to rounding also where b is nearly zero.

    Args:
        surface: m faces.
        chart: its m faces in the same order and winding, at z = 0.

    Returns:
        The measurement.

    Raises:
        InputError: the numbers of faces differ.
        FieldError: a chart triangle is flipped or collapsed.
    """
    _refuse_unlike(surface, chart)
    areas = face_areas(surface)
    scales = face_areas(chart) / areas
    corners, flat = surface.vertices[surface.faces], chart.vertices[chart.faces]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    # The first side runs along the real axis of w, so that the third corner is at (dot + i cross) / length.
    length = np.linalg.norm(first, axis=1)
    height = 2.0 * areas / length
    third = np.einsum("mx,mx->m", first, second) / length + 1j * height
    along = ((flat[:, 1, 0] - flat[:, 0, 0]) + 1j * (flat[:, 1, 1] - flat[:, 0, 1])) / length
    over = (flat[:, 2, 0] - flat[:, 0, 0]) + 1j * (flat[:, 2, 1] - flat[:, 0, 1])
    kept = np.abs(over - np.conj(third) * along)
    turned = np.abs(third * along - over)
    return Distortion(
        dilatations=(kept + turned) / (kept - turned), area_scales=scales / (scales @ areas / areas.sum()), areas=areas
    )


def predicted_spacing(surface: Surface, chart: Surface, points: SurfacePoints) -> FloatArray:
    """Return how far apart curves come to lie that are one wanted spacing apart in the chart, over that spacing.

    It is one over the chart's local length scale: the square root of the area scale around each vertex, linear in
    each triangle. The prediction is that of a map that keeps angles, and holds for spacings over which the scale
    hardly changes.

    Args:
        surface: m faces.
        chart: its m faces in the same order and winding, at z = 0; its lengths are those in which the spacing is even.
        points: (k,) where to predict.

    Returns:
        (k,) predicted over wanted spacing, around 1.

    Raises:
        InputError: the numbers of faces differ.
        FieldError: a chart triangle is flipped or collapsed.
    """
    _refuse_unlike(surface, chart)
    lengths = local_scales(surface, chart)
    return 1.0 / points.values(surface, lengths)


def local_scales(surface: Surface, chart: Surface) -> FloatArray:
    """Return the (n,) length scale of a chart around each vertex: square root of chart area over surface area.

    The triangles around a vertex are taken together, because a sliver alone, far thinner than a pixel, may be mapped
    out of proportion without any harm. A vertex without triangles has scale 1.

    Args:
        surface: n vertices, m faces.
        chart: its m faces in the same order.
    """
    on_surface, on_chart = (sum_around_vertices(surface, face_areas(mesh)) for mesh in (surface, chart))
    return np.sqrt(np.divide(on_chart, on_surface, out=np.ones(on_chart.size), where=on_surface > 0.0))


def signed_areas(flat: FloatArray, faces: IntArray) -> FloatArray:
    """Return the (m,) areas of triangles in the plane, positive where they are counter-clockwise [mm2].

    Examples:
        >>> signed_areas(np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 1]]))
        array([ 1., -1.])
    """
    a, b, c = (flat[faces[:, corner], :2] for corner in range(3))
    along, across = b - a, c - a
    return 0.5 * (along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0])


def _refuse_unlike(surface: Surface, chart: Surface) -> None:
    """Refuse a chart of another surface, or one with triangles that have no stretch to measure."""
    if len(surface.faces) != len(chart.faces):
        raise InputError(
            f"the UV map of {surface.name} must have the same faces in the same order: it has {len(chart.faces)}, the "
            f"surface {len(surface.faces)}."
        )
    flat = signed_areas(chart.vertices, chart.faces)
    count = int((flat <= 0.0).sum())
    if count:
        place = in_words(surface.vertices[surface.faces[int(np.argmax(flat <= 0.0))]].mean(axis=0))
        raise FieldError(
            f"{count} of {flat.size} triangles of {surface.name} are flipped or collapsed in the UV map, the first at "
            f"{place}. Choose another backend or a smaller patch.",
            count=count,
        )


def _percentile(values: FloatArray, weights: FloatArray, percent: float) -> float:
    """Return the smallest value up to which this share of the weight [%] lies."""
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    rank = int((reached < percent / 100.0 * float(reached[-1])).sum())
    return float(values[order][min(rank, values.size - 1)])
