"""The paper's way: flatten, rasterise, distance transform, marching squares, lift.

Its distance is measured in the chart, so it is as even on the surface as the chart is true to length: exact on a
plane, good on a nearly flat patch, and off by the chart's scale where the surface bends both ways or forms a cap.
"""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.backends.chart import conformal_chart
from geoprint.backends.levels import level_distances
from geoprint.backends.raster import DistanceImage
from geoprint.backends.resolution import linear_edge_length
from geoprint.errors import FieldError, UsageError
from geoprint.model import Contours, FloatArray, ScalarField, Seed, Surface, SurfaceCurves, SurfacePoints
from geoprint.surfaces import boundary_loops, closest

# Finer rasters than this do not fit a small machine: 8192 squared pixels are half a gigabyte of distances.
LARGEST_RESOLUTION = 8192


@final
class Lscm:
    """The `lscm` backend: disc-shaped surfaces, distance from the whole border.

    Args:
        surface: a disc.
        resolution: pixels along the longer side of the chart. 1024 puts 16 of them on a millimetre of a 60 mm part;
            finer ones change nothing, because the loss is the chart's scale.

    Raises:
        UsageError: the resolution is outside 16 ... 8192.
        FieldError: the surface is not a disc, or its chart overlaps itself.
    """

    def __init__(self, surface: Surface, *, resolution: int = 1024) -> None:
        if not 16 <= resolution <= LARGEST_RESOLUTION:
            raise UsageError(f"resolution is {resolution} pixels; it must lie between 16 and {LARGEST_RESOLUTION}.")
        self._surface = surface
        self._chart = conformal_chart(surface)
        self._border = boundary_loops(surface)[0]
        self._image = DistanceImage(self._chart.vertices[self._border, :2], resolution=resolution)

    @staticmethod
    def edge_length(_part: Surface, *, spacing: float) -> float:
        """Return how long edges may be for even contours at a spacing [mm]: the chart is linear in each triangle."""
        return linear_edge_length(spacing=spacing)

    def distance(self, seed: Seed) -> ScalarField:
        """Return the distance from the border in the chart at the vertices, scaled to the surface's area [mm].

        Raises:
            UsageError: the seed is not the whole border.
        """
        self._require_border(seed)
        values = self._image.sample(self._chart.vertices[:, :2])
        values[self._border] = 0.0
        return ScalarField(np.maximum(values, 0.0))

    def contours(self, seed: Seed, *, spacing: float) -> Contours:
        """Return the level curves of the distance image, lifted to the surface [mm].

        Raises:
            UsageError: the seed is not the whole border, or the spacing is not positive.
            FieldError: not even the first level lies on the surface, or the raster is too coarse for the spacing.
        """
        field = self.distance(seed)
        distances = level_distances(field, spacing=spacing)
        if spacing < 2.0 * self._image.pixel:
            raise FieldError(
                f"spacing is {spacing:g} mm, but a pixel of the chart is {self._image.pixel:.3g} mm: a raster of "
                f"{int(np.ceil(4 * self._image.pixel / spacing))} times the resolution would be needed; use "
                "`--backend heat`, which has no raster."
            )
        lines = [(level, line) for level, at in enumerate(distances) for line in self._image.contours(float(at))]
        return Contours(self._lifted([line for _, line in lines]), np.array([k for k, _ in lines]), spacing, field)

    def _lifted(self, lines: list[FloatArray]) -> SurfaceCurves:
        """Find the chart triangle of every node and keep its barycentric weights: the same point of the surface."""
        nodes = np.concatenate(lines)
        found, _ = closest(self._chart, np.column_stack([nodes, np.zeros(len(nodes))]))
        offsets = np.concatenate([[0], np.cumsum([len(line) for line in lines])])
        closed = np.array([bool((line[0] == line[-1]).all()) for line in lines])
        return SurfaceCurves(SurfacePoints(found.faces, found.weights), offsets, closed)

    def _require_border(self, seed: Seed) -> None:
        points = seed.curves.points
        at_vertex = points.weights.max(axis=1) > 1.0 - 1e-9
        vertices = self._surface.faces[points.faces, np.argmax(points.weights, axis=1)]
        if not at_vertex.all() or set(vertices.tolist()) != set(self._border.tolist()):
            raise UsageError(
                "the backend 'lscm' measures from the whole border, because its distance transform knows no other "
                "seed; use `--backend heat` for a chosen seed."
            )
