"""Static figures: toolpaths on the part, coloured by how far neighbours are apart."""

# matplotlib leaves the keyword arguments of its methods untyped, and a part of those of rc_context.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import io
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.model import FloatArray, IntArray, Surface, frozen
from geoprint.surfaces import vertex_normals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Spacing over its wanted value at the ends of the colour scale.
COLOUR_RANGE = (0.8, 1.2)
# Diverging and safe for colour-blind readers; its middle is light, so the part below is dark.
COLOUR_MAP = "RdBu"
# Colour of paths without a neighbour.
UNMEASURED = "#9a9a9a"
PART_DARK, PART_LIGHT = 0.16, 0.42
# Width of a drawn path over the spacing: beads with a seam of the part between them.
LINE_SHARE = 0.62
PANEL_INCHES = 5.2
DOTS_PER_INCH = 160
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
    """

    title: str
    caption: str
    places: FloatArray
    offsets: IntArray
    ratios: FloatArray


def coverage_figure(
    surface: Surface, panels: Sequence[CoveragePanel], *, R_view_work: FloatArray, spacing: float, title: str
) -> bytes:
    """Draw toolpaths side by side as seen from above the part, coloured by local spacing.

    Args:
        surface: the part, coarse enough to be drawn.
        panels: one a backend.
        R_view_work: (3, 3) rotation to the view: x to the right, y up, z towards the reader.
        spacing: wanted spacing [mm].
        title: above everything.

    Returns:
        The PNG's bytes; the same for the same input.
    """
    from matplotlib.figure import Figure

    figure = Figure(
        figsize=(PANEL_INCHES * len(panels) + 1.1, PANEL_INCHES + 1.0), dpi=DOTS_PER_INCH, layout="constrained"
    )
    axes: list[Axes] = list(figure.subplots(1, len(panels), squeeze=False)[0])
    for axis, panel in zip(axes, panels, strict=True):
        draw_part(axis, surface, R_view_work)
        _draw_runs(axis, panel, R_view_work, spacing=spacing)
        axis.set_title(panel.title, fontsize=13, loc="left", parse_math=False)
        axis.set_xlabel(panel.caption, fontsize=10, parse_math=False)
    _add_scale(figure, axes)
    add_title(figure, title)
    return png_bytes(figure)


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
    from matplotlib.collections import PolyCollection

    seen = surface.vertices @ R_view_work.T
    light = R_view_work.T @ np.array([-0.4, 0.5, 0.77])
    brightness = np.clip(vertex_normals(surface)[surface.faces].mean(axis=1) @ light, 0.0, 1.0)
    shade = shades[0] + (shades[1] - shades[0]) * brightness
    order = np.argsort(seen[surface.faces, 2].mean(axis=1))
    colours = np.repeat(shade[order, None], 3, axis=1)
    corners = seen[surface.faces[order], :2]
    axis.add_collection(PolyCollection(list(corners), facecolors=colours, edgecolors=colours, linewidths=0.4))
    low, high = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
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


def _draw_runs(axis: Axes, panel: CoveragePanel, R_view_work: FloatArray, *, spacing: float) -> None:
    from matplotlib import colormaps
    from matplotlib.collections import LineCollection
    from matplotlib.colors import Normalize

    seen = (panel.places @ R_view_work.T)[:, :2]
    starts: IntArray = np.setdiff1d(np.arange(len(seen) - 1), panel.offsets[1:-1] - 1)
    segments = np.stack([seen[starts], seen[starts + 1]], axis=1)
    width_mm = float(np.diff(axis.get_xlim())[0])
    points_per_mm = PANEL_INCHES * 72 / width_mm
    colours = colormaps[COLOUR_MAP].with_extremes(bad=UNMEASURED)
    lines = LineCollection(
        list(segments),
        array=np.ma.masked_invalid(0.5 * (panel.ratios[starts] + panel.ratios[starts + 1])),
        cmap=colours,
        norm=Normalize(*COLOUR_RANGE),
        linewidths=max(LINE_SHARE * spacing * points_per_mm, 0.5),
        capstyle="round",
    )
    axis.add_collection(lines)


def _add_scale(figure: Figure, axes: Sequence[Axes]) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    scale = figure.colorbar(
        ScalarMappable(Normalize(*COLOUR_RANGE), COLOUR_MAP), ax=list(axes), shrink=0.8, pad=0.01, extend="both"
    )
    scale.set_label(
        "distance to the neighbouring path / wanted spacing\n(red: too close, blue: too far, grey: outermost)",
        fontsize=9,
    )


def png_bytes(figure: Figure) -> bytes:
    """Return a figure as a PNG; the same bytes for the same figure."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def svg_bytes(figure: Figure) -> bytes:
    """Return a figure as an SVG; the same bytes for the same figure: no date, no random ids, letters as outlines."""
    from matplotlib import rc_context

    buffer = io.BytesIO()
    with rc_context({"svg.hashsalt": "geoprint", "svg.fonttype": "path"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue()
