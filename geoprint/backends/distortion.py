"""What a chart does to angles and lengths, triangle by triangle, and the spacing that follows from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from geoprint.backends.overlap import signed_areas
from geoprint.errors import FieldError, InputError
from geoprint.model import FloatArray, Surface, SurfacePoints
from geoprint.model.arrays import freeze_arrays
from geoprint.surfaces import face_areas


@final
@dataclass(frozen=True, slots=True, eq=False)
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
    scales = _area_scales(surface, chart)
    corners, flat = surface.vertices[surface.faces], chart.vertices[chart.faces]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    # The first side runs along the real axis of w, so that the third corner is at (dot + i cross) / length.
    length = np.linalg.norm(first, axis=1)
    height = 2.0 * face_areas(surface) / length
    third = np.einsum("mx,mx->m", first, second) / length + 1j * height
    along = ((flat[:, 1, 0] - flat[:, 0, 0]) + 1j * (flat[:, 1, 1] - flat[:, 0, 1])) / length
    over = (flat[:, 2, 0] - flat[:, 0, 0]) + 1j * (flat[:, 2, 1] - flat[:, 0, 1])
    kept = np.abs(over - np.conj(third) * along)
    turned = np.abs(third * along - over)
    areas = face_areas(surface)
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
    scales, areas = _area_scales(surface, chart), face_areas(surface)
    corners, count = surface.faces.ravel(), len(surface.vertices)
    flat = np.bincount(corners, np.repeat(scales * areas, 3), minlength=count)
    whole = np.bincount(corners, np.repeat(areas, 3), minlength=count)
    # Vertices that no face uses have no scale, and no point lies near them.
    lengths = np.sqrt(np.divide(flat, whole, out=np.ones(count), where=whole > 0.0))
    return 1.0 / np.einsum("kc,kc->k", points.weights, lengths[surface.faces[points.faces]])


def _area_scales(surface: Surface, chart: Surface) -> FloatArray:
    """Return (m,) chart area over surface area of each triangle."""
    if len(surface.faces) != len(chart.faces):
        raise InputError(
            f"the chart has {len(chart.faces)} faces and {surface.name} {len(surface.faces)}; "
            "they must be the same, in the same order."
        )
    flat = signed_areas(chart.vertices, chart.faces)
    count = int((flat <= 0.0).sum())
    if count:
        place = surface.vertices[surface.faces[int(np.argmax(flat <= 0.0))]].mean(axis=0)
        raise FieldError(
            f"{count} of {flat.size} triangles of {surface.name} are flipped or collapsed in the "
            f"chart, the first at ({place[0]:.2f}, {place[1]:.2f}, {place[2]:.2f}) mm: it has no stretch to measure.",
            count=count,
        )
    return flat / face_areas(surface)


def _percentile(values: FloatArray, weights: FloatArray, percent: float) -> float:
    """Return the smallest value up to which this share of the weight [%] lies."""
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    rank = int((reached < percent / 100.0 * float(reached[-1])).sum())
    return float(values[order][min(rank, values.size - 1)])
