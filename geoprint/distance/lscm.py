"""The paper's backend: flatten, rasterise, distance transform, marching squares, lift.

Its distance is measured in the chart, so it is as even on the surface as the chart is true to length: exact on a
plane, good on a nearly flat patch, and off by the chart's scale where the surface is doubly bent or forms a cap.

A band, such as a cylinder, is cut and flattened. Distances are taken to the source and its images in moved copies of
the chart, and curves are joined across the cut, so that nothing depends on where it runs.

Straight distance in the chart is shorter than the shortest way where it crosses a hole or a bay of the border. From the
whole border it never does, since the nearest point of it comes first; from any other source it may.
"""

from __future__ import annotations

from functools import partial
from typing import ClassVar, final

import numpy as np

from geoprint.distance.distortion import holds, local_scales, locate
from geoprint.distance.interface import Accuracy, ChartImage, Shown, level_distances, linear_edge_length
from geoprint.distance.lscm_raster import DistanceImage, clipped, region_image, source_image
from geoprint.distance.lscm_seam import Chart, flattened, joined
from geoprint.errors import FieldError, UsageError
from geoprint.geometry import boundary_half_edges, half_edges, in_words, positions
from geoprint.model import Contours, FloatArray, IntArray, ScalarField, Source, Surface, SurfaceCurves

# Pixels along the longer side of the chart: fewer show no shape; with more, the curves of one surface would have
# millions of corners.
SMALLEST_RESOLUTION = 16
LARGEST_RESOLUTION = 8192
# Pixels a spacing, wherever on the surface. Corners of level curves are cut by a fraction of a pixel, which alone
# varies the spacing on a plate of 40 spacings by 0.07 %, with half as many pixels by 0.17 %. Around corners of the
# border, where the distance bends most, curves lie within spacing / 1024 of their place.
PIXELS_PER_SPACING = 16
# What counts as one more pixel: rounding of the chart must not change the raster of a part that is turned.
WHOLE_PIXEL = 1e-6
# Pixels a spacing below which neighbouring curves run together.
FEWEST_PIXELS = 2
# A barycentric weight nearer to 1 than this is a vertex.
AT_VERTEX = 1e-9


@final
class Lscm:
    """The `lscm` backend: surfaces that a conformal map flattens, straight distance in the chart.

    Args:
        surface: a disc, a band, or what else `flattened` takes.
        resolution: pixels along the longer side of the chart's raster; by default so many that the spacing has 16
            of them, wherever on the surface. Finer ones change nothing, because the loss is the chart's scale.

    Raises:
        UsageError: the resolution is outside 16 ... 8192.
        FieldError: the surface cannot be flattened, or its chart overlaps itself.
    """

    title: ClassVar[str] = "flattened, planned in 2D"
    summary: ClassVar[str] = "Flattens the surface with a conformal map and measures distances in the plane."
    accuracy: ClassVar[Accuracy] = Accuracy.CHART
    compared: ClassVar[bool] = True

    def __init__(self, surface: Surface, *, resolution: int | None = None) -> None:
        if resolution is not None and not SMALLEST_RESOLUTION <= resolution <= LARGEST_RESOLUTION:
            raise UsageError(
                f"resolution is {resolution} pixels; it must lie between {SMALLEST_RESOLUTION} and "
                f"{LARGEST_RESOLUTION}."
            )
        self._surface = surface
        self._resolution = resolution
        self._chart = flattened(surface)
        self._size = float(np.ptp(self._chart.flat.vertices[self._chart.flat.faces], axis=(0, 1)).max())
        self._scales = local_scales(surface, self._chart.flat)

    @staticmethod
    def edge_length(_part: Surface, *, spacing: float) -> float:
        """Return how long edges may be for even contours at a spacing [mm]: the chart is linear in each triangle."""
        return linear_edge_length(spacing=spacing)

    def distance(self, source: Source) -> ScalarField:
        """Return the straight distance from the source in the chart at the vertices [mm], to rounding; no raster.

        Raises:
            InputError: a point of the source names a face that the surface does not have.
        """
        vertices = self._chart.flat.vertices[: len(self._surface.vertices), :2]
        return ScalarField(self._chart.continuation.distances(source_segments(self._chart, source), vertices))

    def shown(self, *, spacing: float) -> Shown:
        """Return the chart, and the raster that `contours` takes for a positive spacing [mm].

        Raises:
            FieldError: the raster is too coarse for the spacing, or the one it needs is too large.
        """
        stretch = 1.0 / float(self._scales.min())
        needed, fewest = (
            int(np.ceil(count * stretch * self._size / spacing - WHOLE_PIXEL))
            for count in (PIXELS_PER_SPACING, FEWEST_PIXELS)
        )
        if self._resolution is None and needed > LARGEST_RESOLUTION:
            raise self._too_fine(spacing, needed)
        resolution = max(needed, SMALLEST_RESOLUTION) if self._resolution is None else self._resolution
        pixel = self._size / resolution
        if pixel * stretch > spacing / FEWEST_PIXELS:
            raise FieldError(
                f"a pixel of the UV map of {self._surface.name} at resolution {resolution} is {pixel * stretch:.3g} "
                f"mm on the surface at {self._tightest()}. Paths {spacing:g} mm apart allow "
                f"{spacing / FEWEST_PIXELS:.3g} mm: omit `options.lscm.resolution`, give at least {fewest}, or use "
                "`--backend heat`, which has no raster.",
                spacing=spacing,
                resolution=resolution,
            )
        return Shown(
            flat=self._chart.flat,
            mapped="the least squares conformal map (lscm)",
            resolution=resolution,
            pixel=pixel,
            largest_pixel=pixel * stretch,
            image=self._image,
            jumps=self._jumps,
        )

    def contours(self, source: Source, *, spacing: float) -> Contours:
        """Return the level curves of the distance image, lifted to the surface [mm].

        They end at the border of the surface where the source is not the whole border.

        Raises:
            InputError: a point of the source names a face that the surface does not have.
            UsageError: the spacing is not positive.
            FieldError: not even the first level lies on the surface, the raster is too coarse for the spacing, the one
                it needs is too large, or a curve is lost at the cut.
        """
        field = self.distance(source)
        distances = level_distances(field, spacing=spacing)
        resolution = self.shown(spacing=spacing).resolution
        region, image = self._images(source, resolution=resolution)
        found = image.contours(distances)
        if image is not region:
            found = _within(region, found)
        inside = partial(holds, self._chart.flat)
        found = joined(found, self._chart.continuation, holds=inside, pixel=region.pixel)
        lines = [line for level in found for line in level]
        if not lines:
            raise FieldError(
                f"no level curve of {self._surface.name} at {spacing / 2:g} mm from the source is longer than a pixel "
                f"of {region.pixel:.3g} mm: choose a spacing below {spacing:g} mm."
            )
        levels = np.repeat(np.arange(distances.size), [len(level) for level in found])
        return Contours(self._lifted(lines), levels, spacing, field)

    def _images(self, source: Source, *, resolution: int) -> tuple[DistanceImage, DistanceImage]:
        """Return the distance to the border in the chart, negative outside, and the distance to the image of a source.

        Where the source is the whole border both are one and the same image.
        """
        chart = self._chart
        border = border_segments(self._surface, chart)
        region = region_image(border, resolution=resolution, continuation=chart.continuation)
        if _is_whole_border(self._surface, source):
            return region, region
        return region, source_image(region, source_segments(chart, source), continuation=chart.continuation)

    def _image(self, source: Source, resolution: int) -> ChartImage:
        region, image = self._images(source, resolution=resolution)
        return ChartImage(region.values >= 0.0, image.values, region.origin, region.pixel)

    def _jumps(self, places: FloatArray) -> IntArray:
        nearest = self._chart.continuation.nearest_images(places[1:], to=places[:-1])
        return np.flatnonzero((nearest != places[1:]).any(axis=1)) + 1

    def _lifted(self, lines: list[FloatArray]) -> SurfaceCurves:
        """Find the chart triangle of every node and keep its barycentric weights: the same point of the surface."""
        offsets = np.concatenate([[0], np.cumsum([len(line) for line in lines])])
        closed = np.array([bool((line[0] == line[-1]).all()) for line in lines])
        return SurfaceCurves(locate(self._chart.flat, np.concatenate(lines)), offsets, closed)

    def _too_fine(self, spacing: float, needed: int) -> FieldError:
        """Return the refusal of a spacing that needs more pixels than are allowed."""
        # Rounded to three digits, but not down.
        finest = 1.005 * spacing * needed / LARGEST_RESOLUTION
        coarser = needed * FEWEST_PIXELS <= LARGEST_RESOLUTION * PIXELS_PER_SPACING
        return FieldError(
            f"paths {spacing:g} mm apart on {self._surface.name} need a raster of {needed} pixels across its UV map "
            f"(scale {self._scales.min():.2g} at {self._tightest()}), at most {LARGEST_RESOLUTION} are allowed. "
            f"Choose a spacing of at least {finest:.3g} mm, "
            + (f"take a coarser raster with `--set options.lscm.resolution={LARGEST_RESOLUTION}`, " if coarser else "")
            + "or use `--backend heat`, which has no raster.",
            spacing=spacing,
            needed=needed,
            allowed=LARGEST_RESOLUTION,
        )

    def _tightest(self) -> str:
        """Return where the chart shrinks the surface most."""
        return in_words(self._surface.vertices[int(np.argmin(self._scales))])


def border_segments(surface: Surface, chart: Chart) -> FloatArray:
    """Return the (b, 2, 2) border edges of a surface in its chart [mm], without those along the cut."""
    ends = half_edges(chart.flat.faces)[boundary_half_edges(surface.faces)]
    return chart.flat.vertices[ends][:, :, :2]


def source_segments(chart: Chart, source: Source) -> FloatArray:
    """Return the (s, 2, 2) image of a source in a chart [mm]: pieces of its curves, points as pieces without length.

    A piece across the cut begins in the chart and ends in a copy.
    """
    places = positions(chart.flat, source.curves.points)[:, :2]
    first, last = source.curves.offsets[:-1], source.curves.offsets[1:] - 1
    starts = np.setdiff1d(np.arange(len(places)), last)
    alone = first[first == last]
    begin, end = places[np.concatenate([starts, alone])], places[np.concatenate([starts + 1, alone])]
    return np.stack([begin, chart.continuation.nearest_images(end, to=begin)], axis=1)


def _within(region: DistanceImage, levels: list[list[FloatArray]]) -> list[list[FloatArray]]:
    """Cut the lines of every level where they leave a region."""
    lines = [line for level in levels for line in level]
    if not lines:
        return levels
    sampled = region.sample(np.concatenate(lines))
    depths = iter(np.split(sampled, np.cumsum([len(line) for line in lines])[:-1]))
    return [
        [piece for line in level for piece in clipped(line, depth=next(depths), shortest=region.pixel)]
        for level in levels
    ]


def _is_whole_border(surface: Surface, source: Source) -> bool:
    """Tell whether a source runs along every border edge and nowhere else."""
    points = source.curves.points
    vertices = surface.faces[points.faces, np.argmax(points.weights, axis=1)]
    edges = half_edges(surface.faces)[boundary_half_edges(surface.faces)]
    starts = np.setdiff1d(np.arange(vertices.size), source.curves.offsets[1:] - 1)
    followed, border = (
        np.unique(np.sort(pairs, axis=1), axis=0)
        for pairs in (np.column_stack([vertices[starts], vertices[starts + 1]]), edges)
    )
    alone = bool((np.diff(source.curves.offsets) == 1).any())
    return not alone and bool((points.weights.max(axis=1) > 1.0 - AT_VERTEX).all()) and np.array_equal(followed, border)
