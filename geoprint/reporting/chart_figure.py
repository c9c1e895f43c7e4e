"""The figure of a parametrization, as figures 4 and 5 of the paper, and the picture of a mesh doctor's findings."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from string import ascii_uppercase
from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.geometry import Inspection, Landmark, boundary_half_edges, face_normals, half_edges
from geoprint.geometry.rays import RayTree
from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.reporting.figures import DOTS_PER_INCH, PANEL_INCHES, add_ruler, add_title, draw_part, png_bytes, polygons
from geoprint.reporting.view import view_surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure


# Flattening in one picture, as figures 4 and 5 of the paper: chart, distance image, curves on the surface.


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
        distances: (rows, columns) distance from the source [mm].
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
    for axis, name in zip(axes, ("chart", "distance in the UV map", "curves on the surface"), strict=True):
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
    scale.set_label("UV area / surface area, 1 on average", fontsize=10)
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
    scale.set_label(f"distance from border or source, mm; {which}, {each * spacing:.3g} mm apart", fontsize=10)
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
    scale.set_label(f"distance from border or source, mm; every level, {spacing:.3g} mm apart", fontsize=10)
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


# The picture of a mesh doctor's findings: the part along its axes, with what is wrong and places marked on it.


# Colours that differ for colour-blind readers too.
LANDMARK = "#a00000"
RIM, CROSSING, CROWDED, FAN, FLIPPED, SLIVER = "#0072b2", "#d55e00", "#cc79a7", "#e69f00", "#009e73", "#56b4e9"
SHADES = (0.45, 0.88)
MOST_DRAWN = 30_000
INSPECTION_DOTS = 110
# Where each view is seen from, and which ways lead right and up in it.
VIEWS = (
    ("+x", "+y", "+z"), ("+y", "-x", "+z"), ("+z", "+x", "+y"),
    ("-x", "-y", "+z"), ("-y", "+x", "+z"), ("-z", "-x", "+y"),
)  # fmt: skip
# Lines of sight start so far off the surface, over the size of the part.
OFF_SHARE = 2e-3
# Up to so many faces their edges are drawn too.
MOST_EDGED = 8000


def inspection_figure(found: Inspection, *, title: str, landmarks: Sequence[Landmark] = ()) -> bytes:
    """Draw the examined mesh along its axes from either end, in its own coordinates, with its border and what is wrong.

    Args:
        found: what was found.
        title: above all views.
        landmarks: places that are marked where they are in sight, by letters from A on.

    Returns:
        The PNG's bytes.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.5, 9.0), dpi=INSPECTION_DOTS, layout="constrained")
    drawn = _drawn(found)
    axes: list[Axes] = list(figure.subplots(2, 3, squeeze=False).ravel())
    rays = RayTree(drawn) if landmarks else None
    for axis, (seen_from, right, up) in zip(axes, VIEWS, strict=True):
        R_view_part = np.stack([_unit(right), _unit(up), _unit(seen_from)])
        _draw_faces(axis, drawn, R_view_part)
        _draw_rim(axis, found.examined, R_view_part)
        for (count, places), colour, mark, label in _marks(found):
            seen = np.array(places).reshape(-1, 3) @ R_view_part.T
            axis.plot(
                seen[:, 0], seen[:, 1], mark, color=colour, markersize=8, markerfacecolor="none", markeredgewidth=2.0,
                label=f"{label}: {count}",
            )  # fmt: skip
        if rays is not None:
            _draw_landmarks(axis, landmarks, rays, R_view_part)
        _scale(axis, right=right, up=up)
        axis.set_title(f"from {seen_from}", fontsize=10, loc="left")
    handles, labels = axes[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=9)
    add_title(figure, title)
    return png_bytes(figure)


def _unit(axis: str) -> FloatArray:
    """Return the direction of an axis such as `+x` or `-z`."""
    return np.eye(3)["xyz".index(axis[1])] * (1.0 if axis[0] == "+" else -1.0)


def _scale(axis: Axes, *, right: str, up: str) -> None:
    """Number both directions of a view in mm as the part's coordinates have them, whichever way these rise."""
    from matplotlib.ticker import FuncFormatter

    for side, name in ((axis.xaxis, right), (axis.yaxis, up)):
        sign = 1.0 if name[0] == "+" else -1.0
        side.set_major_formatter(FuncFormatter(partial(_coordinate, sign)))
        side.set_label_text(f"{name[1]} [mm]", fontsize=9)
    axis.tick_params(labelsize=8)
    axis.grid(color="#bbbbbb", linewidth=0.4)
    axis.set_axisbelow(True)


def _coordinate(sign: float, value: float, _: int | None) -> str:
    return f"{sign * value + 0.0:g}"


def _draw_landmarks(axis: Axes, landmarks: Sequence[Landmark], rays: RayTree, R_view_part: FloatArray) -> None:
    """Mark the places that nothing hides."""
    places = np.array([one.place for one in landmarks])
    ahead = np.tile(R_view_part[2], (len(places), 1))
    size = float(np.ptp(places, axis=0).max())
    hidden = rays.first_hits(places + OFF_SHARE * size * (ahead + np.array([one.normal for one in landmarks])), ahead)
    for letter, place, behind in zip(ascii_uppercase, places @ R_view_part.T, hidden.met, strict=False):
        if not behind:
            axis.plot(place[0], place[1], ".", color=LANDMARK, markersize=7)
            axis.annotate(
                letter, (place[0], place[1]), xytext=(3, 3), textcoords="offset points", fontsize=10, color=LANDMARK,
                fontweight="bold",
            )  # fmt: skip


def _drawn(found: Inspection) -> Surface:
    """Return a surface of few enough faces; of a mesh that is none, which cannot be thinned, evenly chosen ones."""
    surface = found.examined
    if found.preparation is not None:
        return view_surface(surface, faces=MOST_DRAWN).surface
    step = -(-len(surface.faces) // MOST_DRAWN)
    return Surface(vertices=surface.vertices, faces=surface.faces[::step], name=surface.name)


def _draw_faces(axis: Axes, surface: Surface, rotation: FloatArray) -> None:
    """Draw faces from far to near, darker the more they turn away; a damaged mesh has no normals at vertices."""
    corners = surface.vertices[surface.faces] @ rotation.T
    upward = np.abs(face_normals(surface) @ rotation.T[:, 2])
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    shade = (SHADES[0] + (SHADES[1] - SHADES[0]) * upward)[order]
    colours = np.repeat(shade[:, None], 3, axis=1)
    edges = colours * (0.82 if len(order) < MOST_EDGED else 1.0)
    axis.add_collection(polygons(corners[order, :, :2], faces=colours, edges=edges, width=0.4))
    low, high = corners[:, :, :2].min(axis=(0, 1)), corners[:, :, :2].max(axis=(0, 1))
    edge = 0.03 * float((high - low).max())
    axis.set_xlim(low[0] - edge, high[0] + edge)
    axis.set_ylim(low[1] - edge, high[1] + edge)
    axis.set_aspect("equal")


def _marks(found: Inspection) -> list[tuple[tuple[int | None, tuple[tuple[float, ...], ...]], str, str, str]]:
    """Return count and places, colour, marker and name of each kind of finding that there is."""
    kinds = (
        (found.crossings, CROSSING, "x", "crossing pairs of faces"),
        (found.nonmanifold_edges, CROWDED, "s", "edges with more than two faces"),
        (found.nonmanifold_vertices, FAN, "D", "vertices where fans touch"),
        (found.flipped_faces, FLIPPED, "v", "flipped faces"),
        (found.slivers, SLIVER, "^", "slivers"),
    )
    return [((kind.count, kind.places), colour, mark, label) for kind, colour, mark, label in kinds if kind.places]


def _draw_rim(axis: Axes, surface: Surface, rotation: FloatArray) -> None:
    from matplotlib.collections import LineCollection

    rim = half_edges(surface.faces)[boundary_half_edges(surface.faces)]
    if len(rim) == 0:
        return
    segments = (surface.vertices[rim] @ rotation.T)[:, :, :2]
    axis.add_collection(LineCollection(list(segments), colors=RIM, linewidths=1.6, label="border and holes"))
