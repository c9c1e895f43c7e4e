"""What a chart does to angles and lengths, triangle by triangle, and the spacing that follows from it."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.errors import FieldError, InputError
from geoprint.model import FloatArray, IntArray, Surface, SurfacePoints, freeze_arrays, frozen
from geoprint.surfaces import face_areas, in_words, sum_around_vertices


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
            f"the chart has {len(chart.faces)} faces and {surface.name} {len(surface.faces)}; "
            "they must be the same, in the same order."
        )
    flat = signed_areas(chart.vertices, chart.faces)
    count = int((flat <= 0.0).sum())
    if count:
        place = in_words(surface.vertices[surface.faces[int(np.argmax(flat <= 0.0))]].mean(axis=0))
        raise FieldError(
            f"{count} of {flat.size} triangles of {surface.name} are flipped or collapsed in the "
            f"chart, the first at {place}: it has no stretch to measure; choose another backend, or a smaller patch.",
            count=count,
        )


def _percentile(values: FloatArray, weights: FloatArray, percent: float) -> float:
    """Return the smallest value up to which this share of the weight [%] lies."""
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    rank = int((reached < percent / 100.0 * float(reached[-1])).sum())
    return float(values[order][min(rank, values.size - 1)])
