"""Flattening in one picture, as figures 4 and 5 of the paper: chart, distance image, curves on the surface."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.report.figures import DOTS_PER_INCH, PANEL_INCHES, add_ruler, add_title, draw_part, png_bytes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure

# Diverging in lightness too, and safe for colour-blind readers: light is true to area.
SCALE_MAP = "PuOr"
# Rising in lightness, safe for colour-blind readers, and legible in grey; its lightest part is left out, so that every
# colour stands off from the part, which is light here.
DISTANCE_MAP, DISTANCE_MAP_END = "viridis", 0.87
PART_SHADES = (0.74, 0.97)
# Curves on the distance image are white up to this share of the largest distance, black beyond.
WHITE_CURVES = 0.6
# The colour scale of areas reaches this percentile of the deviation from 1, but at least so far.
SCALE_PERCENTILE = 99.0
LEAST_SCALE_RANGE = 1.02
# At most so many curves are drawn on the distance image; of more only each second, third, ... level.
DRAWN_LEVELS = 25
# Size of the colour scales against their panels, and the gap above them.
SCALE_SHRINK, SCALE_PAD = 0.85, 0.01


@final
@frozen
class FlattenedPart:
    """A chart as an image, and the level curves in it and on the surface.

    Attributes:
        area_scales: (rows, columns) chart area over surface area, 1 on average; outside the chart anything.
        distances: (rows, columns) distance from the seed [mm].
        inside: (rows, columns) 1 in the chart, 0 outside.
        extent: (4,) left, right, bottom and top of the image [mm].
        chart_places: (k, 2) nodes of the curves in the chart, curve after curve [mm].
        places: (k, 3) the same nodes on the surface [mm].
        offsets: (c + 1,) where each curve starts among them.
        levels: (c,) level of each curve.
        chart_offsets: (p + 1,) where each piece of a curve starts that the chart shows in one; all `offsets` and,
            where the chart was cut, nodes at which curves go on at its other side.
    """

    area_scales: FloatArray
    distances: FloatArray
    inside: FloatArray
    extent: FloatArray
    chart_places: FloatArray
    places: FloatArray
    offsets: IntArray
    levels: IntArray
    chart_offsets: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, area_scales="float: r q", distances="float: r q", inside="float: r q", extent="float: 4",
            chart_places="float: k 2", places="float: k 3", offsets="int: o", levels="int: c", chart_offsets="int: p",
        )  # fmt: skip


def chart_figure(
    part: Surface, flattened: FlattenedPart, *, R_view_work: FloatArray, spacing: float, title: str
) -> bytes:
    """Draw a chart coloured by its area scale, its distance image with level curves, and the curves on the surface.

    Args:
        part: the surface, coarse enough to be drawn.
        flattened: its chart.
        R_view_work: (3, 3) rotation to the view of the surface: x to the right, y up, z towards the reader.
        spacing: distance between neighbouring levels [mm].
        title: above everything.

    Returns:
        The PNG's bytes; the same for the same input.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3 * PANEL_INCHES, PANEL_INCHES + 0.8), dpi=DOTS_PER_INCH)
    figure.set_layout_engine("constrained", h_pad=0.08, w_pad=0.08)
    axes: list[Axes] = list(figure.subplots(1, 3))
    _draw_scales(figure, axes[0], flattened)
    _draw_distances(figure, axes[1], flattened, spacing=spacing)
    draw_part(axes[2], part, R_view_work, shades=PART_SHADES)
    _draw_curves(figure, axes[2], flattened, (flattened.places @ R_view_work.T)[:, :2], spacing=spacing)
    for axis, name in zip(axes, ("chart", "distance in the chart", "curves on the surface"), strict=True):
        axis.set_title(name, fontsize=13, loc="left")
    add_title(figure, title)
    return png_bytes(figure)


def _draw_scales(figure: Figure, axis: Axes, flattened: FlattenedPart) -> None:
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

    scales = flattened.area_scales[flattened.inside > 0.0]
    reach = float(np.exp(np.percentile(np.abs(np.log(scales)), SCALE_PERCENTILE)))
    reach = max(reach, LEAST_SCALE_RANGE)
    drawn = axis.imshow(
        _within(flattened.area_scales, flattened),
        cmap=SCALE_MAP,
        norm=LogNorm(1 / reach, reach),
        origin="lower",
        extent=_extent(flattened),
    )
    scale = figure.colorbar(drawn, ax=axis, location="bottom", shrink=SCALE_SHRINK, pad=SCALE_PAD, extend="both")
    ticks = np.exp(np.linspace(-1, 1, 5) * np.log(reach)).tolist()
    scale.ax.xaxis.set_major_locator(FixedLocator(ticks))
    scale.ax.xaxis.set_minor_locator(NullLocator())
    scale.ax.xaxis.set_major_formatter(FixedFormatter([f"{tick:.2f}" for tick in ticks]))
    scale.set_label("chart area / surface area, 1 on average", fontsize=10)
    _plain(axis)
    add_ruler(axis)


def _draw_distances(figure: Figure, axis: Axes, flattened: FlattenedPart, *, spacing: float) -> None:
    from matplotlib.collections import LineCollection

    drawn = axis.imshow(
        _within(flattened.distances, flattened),
        cmap=_distance_map(),
        norm=_distance_norm(flattened),
        origin="lower",
        extent=_extent(flattened),
    )
    each = 1 + int(flattened.levels.max()) // DRAWN_LEVELS
    curves = np.searchsorted(flattened.offsets, flattened.chart_offsets[:-1], side="right") - 1
    levels = flattened.levels[curves]
    shown = np.flatnonzero(levels % each == 0).tolist()
    lines = np.split(flattened.chart_places, flattened.chart_offsets[1:-1])
    dark = (levels + 0.5) * spacing < WHITE_CURVES * _deepest(flattened)
    colours = ["white" if dark[i] else "black" for i in shown]
    axis.add_collection(LineCollection([lines[i] for i in shown], colors=colours, linewidths=0.7))
    scale = figure.colorbar(drawn, ax=axis, location="bottom", shrink=SCALE_SHRINK, pad=SCALE_PAD)
    which = "every level" if each == 1 else f"one level in {each}"
    scale.set_label(f"distance from border or seed, mm; {which}, {each * spacing:.3g} mm apart", fontsize=10)
    _plain(axis)
    add_ruler(axis)


def _draw_curves(figure: Figure, axis: Axes, flattened: FlattenedPart, seen: FloatArray, *, spacing: float) -> None:
    from matplotlib.collections import LineCollection

    width_mm = float(np.diff(axis.get_xlim())[0])
    lines = LineCollection(
        np.split(seen, flattened.offsets[1:-1]),
        array=(flattened.levels + 0.5) * spacing,
        cmap=_distance_map(),
        norm=_distance_norm(flattened),
        linewidths=float(np.clip(0.5 * spacing * 0.8 * PANEL_INCHES * 72 / width_mm, 0.4, 3.0)),
    )
    axis.add_collection(lines)
    scale = figure.colorbar(lines, ax=axis, location="bottom", shrink=SCALE_SHRINK, pad=SCALE_PAD)
    scale.set_label(f"distance from border or seed, mm; every level, {spacing:.3g} mm apart", fontsize=10)
    add_ruler(axis)


def _distance_norm(flattened: FlattenedPart) -> Normalize:
    from matplotlib.colors import Normalize

    return Normalize(0.0, _deepest(flattened))


def _distance_map() -> Colormap:
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps[DISTANCE_MAP](np.linspace(0.0, DISTANCE_MAP_END, 256)))


def _within(values: FloatArray, flattened: FlattenedPart) -> np.ma.MaskedArray[tuple[int, ...], np.dtype[np.float64]]:
    return np.ma.masked_array(values, flattened.inside == 0.0)


def _deepest(flattened: FlattenedPart) -> float:
    return float(flattened.distances[flattened.inside > 0.0].max())


def _extent(flattened: FlattenedPart) -> tuple[float, float, float, float]:
    left, right, bottom, top = flattened.extent.tolist()
    return left, right, bottom, top


def _plain(axis: Axes) -> None:
    axis.set_aspect("equal")
    axis.set_xticks([])
    axis.set_yticks([])
    for side in axis.spines.values():
        side.set_visible(False)
