"""Static figures: toolpaths on the part, lines of a field, switching in time."""

# matplotlib leaves the keyword arguments of its methods untyped, and a part of those of rc_context.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, cast, final

import numpy as np

from geoprint.geometry import face_areas, vertex_normals
from geoprint.model import FloatArray, FollowedLines, IntArray, Surface, frozen
from geoprint.reporting.histogram import times_wider
from geoprint.reporting.view import bead_sides, readable, squares_on, view_surface, views

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure


# Static figures: toolpaths on the part, coloured by how far neighbours are apart.


# Spacing over its wanted value at the ends of the narrowest colour scale is so far from 1; a scale is as many times as
# wide, at most from 0 to 2, as what was measured asks for.
COLOUR_HALF, MOST_COLOUR_TIMES = 0.2, 5
# Diverging and safe for colour-blind readers; its middle is light, so the part below is dark.
COLOUR_MAP = "RdBu"
# Colour of paths without a neighbour.
UNMEASURED = "#9a9a9a"
# Colour of surface that no path covers: in neither half of the colour map.
UNCOVERED = "#ffd21f"
# Sides of the squares that mark it, over the spacing: about those of the triangles that were judged.
UNCOVERED_SHARE = 0.2
PART_DARK, PART_LIGHT = 0.16, 0.42
# Width of a drawn bead over the spacing: beads with a seam of the part between them.
BEAD_SHARE = 0.62
# Width of a panel, where the part is seen from one side and where it is seen from several.
PANEL_INCHES, SIDE_INCHES = 5.2, 4.0
# Least height of a panel over its width; the largest is 1, in which a part that is higher than wide is drawn smaller.
LOWEST_PANEL = 0.15
DOTS_PER_INCH = 160
# Of PNGs: a tenth of the time of the highest one, which saves less than a tenth of the size.
COMPRESSION = 4
# Thousands of edges make files large: fewer dots, where panels are many.
COVERAGE_DOTS = 125
POINTS_PER_INCH = 72.0
# Width of a letter over the font size: rather more than the mean.
LETTER_WIDTH = 0.6


@final
@frozen
class CoveragePanel:
    """One panel: the runs of a toolpath and the spacing measured along them.

    Attributes:
        title: above the panel.
        caption: below it.
        places: (k, 3) samples, run after run [mm].
        offsets: (r + 1,) where each run starts among them.
        ratios: (k,) spacing over its wanted value; NaN where there is no neighbour, drawn grey.
        gaps: (j, 3) places that no path covers [mm].
        widths: wanted width of the path over the spacing, one for all or (k,) one a sample.
    """

    title: str
    caption: str
    places: FloatArray
    offsets: IntArray
    ratios: FloatArray
    gaps: FloatArray
    widths: FloatArray | float = 1.0


def colour_range(shown: Iterable[FloatArray]) -> tuple[float, float]:
    """Return the spacing over its wanted value at both ends of the colour scale that covers some measured ratios."""
    half = COLOUR_HALF * times_wider(shown, half=COLOUR_HALF, most=MOST_COLOUR_TIMES)
    return round(1.0 - half, 3), round(1.0 + half, 3)


def coverage_figure(
    surface: Surface,
    panels: Sequence[CoveragePanel],
    *,
    R_view_work: FloatArray,
    spacing: float,
    title: str,
    bead: float = BEAD_SHARE,
) -> Figure:
    """Draw toolpaths side by side, coloured by local spacing: as beads of their width, on a part from enough sides.

    Args:
        surface: the part, coarse enough to be drawn.
        panels: one a backend.
        R_view_work: (3, 3) rotation to the first side: x to the right, y up, z towards the reader.
        spacing: wanted spacing [mm].
        title: above everything.
        bead: width of a drawn bead over the wanted one.

    Returns:
        The figure; `png_bytes` of it are the same for the same input.
    """
    from matplotlib.figure import Figure

    sides = views(surface, R_view_work)
    inches = PANEL_INCHES if len(sides) == 1 else SIDE_INCHES
    sizes = [np.ptp(surface.vertices @ R.T, axis=0) for R in sides]
    heights = [float(np.clip(size[1] / size[0], LOWEST_PANEL, 1.0)) for size in sizes]
    figure = Figure(
        figsize=(inches * len(panels) + 1.1, inches * sum(heights) + 1.0), dpi=COVERAGE_DOTS, layout="constrained"
    )
    axes = figure.subplots(len(sides), len(panels), squeeze=False, height_ratios=heights)
    ends = colour_range([panel.ratios for panel in panels])
    for row, R_side_work in zip(axes, sides, strict=True):
        for axis, panel in zip(row, panels, strict=True):
            _draw_covered(axis, surface, panel, R_side_work, spacing=spacing, bead=bead, ends=ends)
    for above, below, panel in zip(axes[0], axes[-1], panels, strict=True):
        above.set_title(panel.title, fontsize=13, loc="left", parse_math=False)
        below.set_xlabel(panel.caption, fontsize=10, parse_math=False)
    _add_scale(figure, axes.ravel().tolist(), ends, uncovered=any(len(panel.gaps) for panel in panels))
    add_title(figure, title)
    return figure


def add_title(figure: Figure, title: str, *, font_size: float = 12.0) -> None:
    """Write a title above everything, in as many lines as the width of the figure asks for."""
    columns = int(figure.get_figwidth() * POINTS_PER_INCH / (LETTER_WIDTH * font_size))
    # A file name may hold dollar signs.
    figure.suptitle(textwrap.fill(title, columns), fontsize=font_size, x=0.01, ha="left", parse_math=False)


def draw_part(
    axis: Axes, surface: Surface, R_view_work: FloatArray, *, shades: tuple[float, float] = (PART_DARK, PART_LIGHT)
) -> None:
    """Draw a part as seen along the view's z axis, and set the axis to its size.

    Args:
        axis: to draw on.
        surface: the part.
        R_view_work: (3, 3) rotation to the view.
        shades: grey of what turns away from the light and of what faces it, 0 black, 1 white.
    """
    corners, colours = _part_polygons(surface, R_view_work, shades)
    order = np.argsort(corners[..., 2].mean(axis=1))
    colours = colours[order]
    axis.add_collection(polygons(corners[order, :, :2], faces=colours, edges=colours, width=0.4))
    _frame(axis, surface, R_view_work)


def polygons(corners: FloatArray, *, faces: FloatArray, edges: FloatArray, width: float) -> PolyCollection:
    """Return (n, k, 2) polygons with their colours, and how wide their edges are [points].

    Matplotlib prepares an array in a fraction of the time of a list; its types know lists alone.
    """
    from matplotlib.collections import PolyCollection

    verts = cast("Sequence[FloatArray]", corners)
    return PolyCollection(verts, facecolors=faces, edgecolors=edges, linewidths=width)


def _part_polygons(
    surface: Surface, R_view_work: FloatArray, shades: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Return the (m, 3, 3) corners of the faces as seen, and their (m, 4) colours in the light."""
    light = R_view_work.T @ np.array([-0.4, 0.5, 0.77])
    brightness = np.clip(vertex_normals(surface)[surface.faces].mean(axis=1) @ light, 0.0, 1.0)
    shade = shades[0] + (shades[1] - shades[0]) * brightness
    return (surface.vertices @ R_view_work.T)[surface.faces], np.column_stack(
        [shade, shade, shade, np.ones(len(shade))]
    )


def _frame(axis: Axes, surface: Surface, R_view_work: FloatArray) -> None:
    """Set an axis to the size of a part."""
    seen = (surface.vertices @ R_view_work.T)[:, :2]
    low, high = seen.min(axis=0), seen.max(axis=0)
    edge = 0.03 * float((high - low).max())
    axis.set_xlim(low[0] - edge, high[0] + edge)
    axis.set_ylim(low[1] - edge, high[1] + edge)
    axis.set_aspect("equal")
    axis.set_xticks([])
    axis.set_yticks([])
    for side in axis.spines.values():
        side.set_visible(False)


def add_ruler(axis: Axes, *, font_size: float = 9.0) -> None:
    """Draw a bar of a round length below the lower left corner and write how long it is [mm].

    Args:
        axis: with its limits set.
        font_size: [points].
    """
    left, right = axis.get_xlim()
    bottom, top = axis.get_ylim()
    room = 0.25 * (right - left)
    length = max(step * 10.0**power for power in range(-3, 4) for step in (1, 2, 5) if step * 10.0**power <= room)
    height = bottom - 0.04 * (top - bottom)
    axis.plot([left, left + length], [height, height], color="black", linewidth=2.0, solid_capstyle="butt")
    axis.text(left + length, height, f" {length:g} mm", fontsize=font_size, va="center")
    axis.set_xlim(left, right)
    axis.set_ylim(bottom - 0.09 * (top - bottom), top)


def _draw_covered(
    axis: Axes,
    surface: Surface,
    panel: CoveragePanel,
    R_view_work: FloatArray,
    *,
    spacing: float,
    bead: float,
    ends: tuple[float, float],
) -> None:
    """Draw a part with its beads and with what they leave open, what is nearer to the reader over what is farther."""
    corners, colours = _part_polygons(surface, R_view_work, (PART_DARK, PART_LIGHT))
    # Beads lie over the faces about them, wherever in these they are.
    over = float(np.ptp(corners, axis=1).max(initial=0.0))
    squares = squares_on(surface, panel.gaps, side=UNCOVERED_SHARE * spacing) @ R_view_work.T
    beads, bead_colours = _bead_polygons(surface, panel, R_view_work, width=bead * spacing, ends=ends)
    drawn = np.concatenate([corners[:, [0, 1, 2, 2]], squares, beads])
    painted = np.concatenate([colours, np.tile(_rgba(UNCOVERED), (len(squares), 1)), bead_colours])
    lift = np.repeat([0.0, over, 1.01 * over], [len(corners), len(squares), len(beads)])
    deposited = lift > 0.0
    facing = _turn(drawn) > 0.0
    order = np.argsort(drawn[..., 2].mean(axis=1) + lift)
    order = order[~deposited[order] | facing[order]]
    painted = painted[order]
    axis.add_collection(polygons(drawn[order, :, :2], faces=painted, edges=painted, width=0.3))
    _frame(axis, surface, R_view_work)


def _turn(polygons: FloatArray) -> FloatArray:
    """Return twice the (n,) areas of (n, 4, 3) polygons as seen, negative from behind."""
    first, second = polygons[:, 2] - polygons[:, 0], polygons[:, 3] - polygons[:, 1]
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


def _bead_polygons(
    surface: Surface, panel: CoveragePanel, R_view_work: FloatArray, *, width: float, ends: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Return the (s, 4, 3) pieces of beads between samples as seen, and their (s, 4) colours."""
    from matplotlib import colormaps
    from matplotlib.colors import Normalize

    left, right = bead_sides(surface, panel.places, panel.offsets, width=width * panel.widths)
    starts: IntArray = np.setdiff1d(np.arange(len(left) - 1), panel.offsets[1:-1] - 1)
    # Counter-clockwise as seen from outside.
    corners = np.stack([right[starts], right[starts + 1], left[starts + 1], left[starts]], axis=1) @ R_view_work.T
    ratios = np.ma.masked_invalid(0.5 * (panel.ratios[starts] + panel.ratios[starts + 1]))
    shades = colormaps[COLOUR_MAP].with_extremes(bad=UNMEASURED)(Normalize(*ends)(ratios))
    return corners, np.asarray(shades, dtype=np.float64).reshape(-1, 4)


def _rgba(colour: str) -> FloatArray:
    from matplotlib.colors import to_rgba

    return np.array(to_rgba(colour))


def _add_scale(figure: Figure, axes: Sequence[Axes], ends: tuple[float, float], *, uncovered: bool) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    scale = figure.colorbar(
        ScalarMappable(Normalize(*ends), COLOUR_MAP), ax=list(axes), shrink=0.8, pad=0.01, extend="both"
    )
    scale.set_label(
        "distance to the neighbouring path / wanted spacing\n"
        f"(red: too close, blue: too far, grey: no neighbour{', yellow: missed' if uncovered else ''})",
        fontsize=9,
    )


def png_bytes(figure: Figure) -> bytes:
    """Return a figure as a PNG; the same bytes for the same figure."""
    buffer = io.BytesIO()
    # Matplotlib would draw all of the figure once more to arrange it.
    if (layout := figure.get_layout_engine()) is not None:
        layout.execute(figure)
        figure.set_layout_engine("none")
    figure.savefig(buffer, format="png", metadata={"Software": None}, pil_kwargs={"compress_level": COMPRESSION})
    return buffer.getvalue()


def svg_bytes(figure: Figure) -> bytes:
    """Return a figure as an SVG; the same bytes for the same figure: no date, no random ids, letters as outlines."""
    from matplotlib import rc_context

    buffer = io.BytesIO()
    with rc_context({"svg.hashsalt": "geoprint", "svg.fonttype": "path"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue()


# Static figure: when material is deposited, when it flows, when the lamp is on and when a vacuum draws.


# Dark enough on white, and apart for colour-blind readers.
COLOURS = ("#7a7a7a", "#0072b2", "#e69f00", "#009e73")
LABELS = ("planned deposit", "material flows", "lamp is on", "vacuum draws")
# What is shown before and after the ends of a run [s].
AROUND = 0.3
BAR = 0.7


def switching_figure(
    deposits: FloatArray, material: FloatArray, lamp: FloatArray, vacuum: FloatArray, *, title: str
) -> bytes:
    """Draw the whole program above, and the beginning and the end of its longest run below.

    Args:
        deposits: (d, 2) when each planned deposit begins and ends [s].
        material: (d, 2) when material begins and ends to flow [s].
        lamp: (l, 2) when the lamp is on [s].
        vacuum: (v, 2) when the vacuum draws material back [s]; without any the figure has no row for it.
        title: above everything.

    Returns:
        The PNG's bytes; the same for the same input.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.4, 4.2), dpi=DOTS_PER_INCH, layout="constrained")
    grid = figure.add_gridspec(2, 2)
    longest = int(np.argmax(np.diff(deposits, axis=1)[:, 0]))
    start, end = deposits[longest].tolist()
    spans = (deposits, material, lamp, vacuum) if vacuum.size else (deposits, material, lamp)
    panels: list[tuple[Axes, str, tuple[float, float]]] = [
        (figure.add_subplot(grid[0, :]), "whole program", (0.0, float(max(span.max() for span in spans)) * 1.01)),
        (figure.add_subplot(grid[1, 0]), f"where run {longest + 1} begins", (start - AROUND, start + AROUND)),
        (figure.add_subplot(grid[1, 1]), f"where run {longest + 1} ends", (end - AROUND, end + AROUND)),
    ]
    for axis, name, limits in panels:
        for row, (span, colour) in enumerate(zip(spans, COLOURS, strict=False)):
            bars = [(first, last - first) for first, last in span.tolist()]
            axis.broken_barh(bars, (row - BAR / 2, BAR), facecolors=colour)
        axis.set_yticks(range(len(spans)), LABELS[: len(spans)], fontsize=9)
        axis.set_ylim(len(spans) - 0.5, -0.5)
        axis.set_xlim(*limits)
        axis.set_xlabel("time [s]", fontsize=9)
        axis.set_title(name, fontsize=10, loc="left")
    for axis, moment in ((panels[1][0], start), (panels[2][0], end)):
        axis.axvline(moment, color="black", linewidth=0.8)
    add_title(figure, title, font_size=11.0)
    return png_bytes(figure)


# The picture of the lines that paths follow: dashes all over the part, and the places about which they turn.


# The part is light, so that dashes and marks stand out.
SHADES = (0.72, 0.96)
# Colours that differ for colour-blind readers too: lines, where they turn with who walks around, and against.
LINE, WITH, AGAINST = "#333333", "#d55e00", "#0072b2"
# About so many dashes, each as long as this share of how far they are apart.
DASHES, DASH_SHARE = 1600, 0.8
MOST_DRAWN = 20_000
LEAST_HEIGHT = 0.15


def lines_figure(surface: Surface, followed: FollowedLines, *, R_view_work: FloatArray, title: str) -> bytes:
    """Draw lines as dashes on the part, seen from enough sides, and mark the places about which they turn.

    Args:
        surface: m faces.
        followed: lines in them.
        R_view_work: (3, 3) rotation to the first side: x to the right, y up, z towards the reader.
        title: above everything.

    Returns:
        The PNG's bytes; the same for the same input.
    """
    from matplotlib.figure import Figure

    sides = views(surface, R_view_work)
    sizes = [np.ptp(surface.vertices @ R.T, axis=0) for R in sides]
    heights = [float(np.clip(size[1] / size[0], LEAST_HEIGHT, 1.0)) for size in sizes]
    figure = Figure(
        figsize=(SIDE_INCHES * len(sides) + 0.4, SIDE_INCHES * max(heights) + 0.6),
        dpi=COVERAGE_DOTS,
        layout="constrained",
    )
    drawn = view_surface(surface, faces=MOST_DRAWN).surface
    apart = float(np.sqrt(face_areas(surface).sum() / DASHES))
    chosen = _spread(surface, apart=apart)
    for axis, R_side_work in zip(figure.subplots(1, len(sides), squeeze=False)[0], sides, strict=True):
        draw_part(axis, drawn, R_side_work, shades=SHADES)
        _draw_dashes(axis, surface, followed, chosen, R_side_work, length=DASH_SHARE * apart)
        _draw_marks(axis, surface, followed, R_side_work)
        add_ruler(axis)
    add_title(figure, title)
    return png_bytes(figure)


def _spread(surface: Surface, *, apart: float) -> IntArray:
    """Return faces all over a surface, one in each cube of a side [mm]: the one nearest to its middle."""
    places = surface.vertices[surface.faces].mean(axis=1) / apart
    cubes = np.floor(places)
    order = np.argsort(np.linalg.norm(places - cubes - 0.5, axis=1), kind="stable")
    return np.sort(order[np.unique(cubes[order], axis=0, return_index=True)[1]])


def _draw_dashes(
    axis: Axes,
    surface: Surface,
    followed: FollowedLines,
    chosen: IntArray,
    R_side_work: FloatArray,
    *,
    length: float,
) -> None:
    from matplotlib.collections import LineCollection

    seen = chosen[readable(surface, R_side_work)[chosen]]
    middles = surface.vertices[surface.faces[seen]].mean(axis=1)
    along = 0.5 * length * followed.directions[seen]
    ends = np.stack([middles - along, middles + along], axis=1) @ R_side_work.T
    axis.add_collection(LineCollection(list(ends[..., :2]), colors=LINE, linewidths=0.7))


def _draw_marks(axis: Axes, surface: Surface, followed: FollowedLines, R_side_work: FloatArray) -> None:
    """Mark the places that are seen from a side."""
    middles = surface.vertices[surface.faces].mean(axis=1)
    shown = readable(surface, R_side_work)
    for place, index in zip(followed.places, followed.indices.tolist(), strict=True):
        if not shown[np.argmin(np.linalg.norm(middles - place, axis=1))]:
            continue
        x, y, _ = R_side_work @ place
        colour = WITH if index > 0.0 else AGAINST
        axis.plot([x], [y], "o", color=colour, markersize=5.0)
        axis.annotate(
            f"{'+' if index > 0.0 else ''}{Fraction(index)}", (x, y), (4, 4), textcoords="offset points",
            fontsize=9, color=colour, fontweight="bold",
            bbox={"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.85},
        )  # fmt: skip
