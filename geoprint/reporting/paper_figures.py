"""Figures for papers, as PNG and SVG in the widths of a two-column page: paths by local spacing, and its histograms."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from geoprint.model import FloatArray, Surface
from geoprint.reporting.figures import (
    BEAD_SHARE,
    COLOUR_MAP,
    UNCOVERED,
    UNCOVERED_SHARE,
    UNMEASURED,
    CoveragePanel,
    add_ruler,
    colour_range,
    draw_part,
    png_bytes,
    svg_bytes,
)
from geoprint.reporting.histogram import BINS, EVEN, ratio_axis, spacing_shares, tick_texts
from geoprint.reporting.pictures import coverage_panel
from geoprint.reporting.view import bead_sides, squares_on
from geoprint.results import Planned, Workpiece

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Widths of one column and of the page [inch], and the sizes of letters in print [points].
COLUMN_INCHES, PAGE_INCHES = 3.5, 7.2
HISTOGRAM_INCHES = 2.5
LARGE, SMALL = 8.0, 7.0
DOTS_PER_INCH = 400
# Room below and above the panels for names, figures and the colour scale [inch].
MAP_ROOM = 1.2
# Shades of the colour scale: neighbouring stretches of one shade are one line, which keeps the SVG small.
SHADES = 100
# Colours of Okabe and Ito, safe for colour-blind readers; dashes tell them apart in grey.
LINES = (("#D55E00", "-"), ("#0072B2", (0, (4, 1.2))), ("#009E73", (0, (1, 0.8))), ("#000000", (0, (5, 1, 1, 1))))
# The least share of path that the histograms show [%].
LEAST_SHARE = 0.01


def paper_figures(
    surface: Surface, panels: Sequence[CoveragePanel], *, R_view_work: FloatArray, spacing: float
) -> dict[str, bytes]:
    """Return name and content of each file; the same bytes for the same input.

    Args:
        surface: the part, coarse enough to be drawn.
        panels: one a backend; at most four are told apart in the histograms.
        R_view_work: (3, 3) rotation to the view: x to the right, y up, z towards the reader.
        spacing: wanted spacing [mm].

    Returns:
        `spacing-map` and `spacing-histogram`, each as `.png` and `.svg`.
    """
    figures = {
        "spacing-map": _map(surface, panels, R_view_work, spacing=spacing),
        "spacing-histogram": _histogram(panels, spacing=spacing),
    }
    files: dict[str, bytes] = {}
    for name, figure in figures.items():
        files |= {f"{name}.png": png_bytes(figure), f"{name}.svg": svg_bytes(figure)}
    return files


def _map(surface: Surface, panels: Sequence[CoveragePanel], R_view_work: FloatArray, *, spacing: float) -> Figure:
    """Draw the paths of every backend side by side, coloured by local spacing."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    width = COLUMN_INCHES if len(panels) == 1 else PAGE_INCHES
    size = np.ptp(surface.vertices @ R_view_work.T, axis=0)
    panel_inches = width / len(panels)
    height = min(panel_inches * float(size[1] / size[0]), PAGE_INCHES) + MAP_ROOM
    figure = Figure(figsize=(width, height), dpi=DOTS_PER_INCH, layout="constrained")
    axes: list[Axes] = list(figure.subplots(1, len(panels), squeeze=False)[0])
    ends = colour_range([panel.ratios for panel in panels])
    for axis, panel in zip(axes, panels, strict=True):
        draw_part(axis, surface, R_view_work)
        _draw_uncovered(axis, surface, panel, R_view_work, spacing=spacing)
        # Part and marks as images within the SVG: their thousands of polygons would make it heavy.
        for collection in axis.collections:
            collection.set_rasterized(True)
        _draw_stretches(axis, surface, panel, R_view_work, spacing=spacing, ends=ends)
        axis.set_title(panel.title, fontsize=LARGE, loc="left", parse_math=False)
        axis.set_xlabel(panel.caption, fontsize=SMALL, parse_math=False)
        add_ruler(axis, font_size=SMALL)
    scale = figure.colorbar(
        ScalarMappable(Normalize(*ends), COLOUR_MAP), ax=axes, location="bottom", shrink=min(1.0, 3.3 / width),
        aspect=35, pad=0.02, extend="both",
    )  # fmt: skip
    scale.ax.tick_params(labelsize=SMALL)
    uncovered = ", uncovered area yellow" if any(len(panel.gaps) for panel in panels) else ""
    scale.set_label(f"local spacing / wanted spacing of {spacing:.3g} mm; no neighbour grey{uncovered}", fontsize=LARGE)
    return figure


def _draw_uncovered(
    axis: Axes, surface: Surface, panel: CoveragePanel, R_view_work: FloatArray, *, spacing: float
) -> None:
    """Mark what no path covers."""
    from matplotlib.collections import PolyCollection

    seen = (squares_on(surface, panel.gaps, side=UNCOVERED_SHARE * spacing) @ R_view_work.T)[..., :2]
    axis.add_collection(PolyCollection(list(seen), facecolors=UNCOVERED, edgecolors=UNCOVERED, linewidths=0.2))


def _draw_stretches(
    axis: Axes,
    surface: Surface,
    panel: CoveragePanel,
    R_view_work: FloatArray,
    *,
    spacing: float,
    ends: tuple[float, float],
) -> None:
    """Draw the beads of the runs, cut where their shade changes."""
    from matplotlib import colormaps
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize

    sides = bead_sides(surface, panel.places, panel.offsets, width=BEAD_SHARE * spacing * panel.widths)
    left, right = ((side @ R_view_work.T)[:, :2] for side in sides)
    ratios = 0.5 * (panel.ratios[:-1] + panel.ratios[1:])
    low, high = ends
    shades = np.clip(np.round((np.nan_to_num(ratios, nan=1.0) - low) / (high - low) * SHADES), 0, SHADES)
    shades[np.isnan(ratios)] = -1.0
    # Segments between runs are marked apart from all shades, and left out.
    shades[panel.offsets[1:-1] - 1] = -2.0
    cuts = np.concatenate([[0], np.flatnonzero(np.diff(shades)) + 1, [shades.size]])
    drawn = [(first, last) for first, last in pairwise(cuts.tolist()) if shades[first] > -2.0]
    values = np.array([shades[first] for first, _ in drawn])
    beads = PolyCollection(
        [np.concatenate([left[first : last + 1], right[first : last + 1][::-1]]) for first, last in drawn],
        array=np.ma.masked_less(low + (high - low) * values / SHADES, low - (high - low) / (2 * SHADES)),
        cmap=colormaps[COLOUR_MAP].with_extremes(bad=UNMEASURED),
        norm=Normalize(*ends),
        linewidths=0.0,
    )
    axis.add_collection(beads)


def _histogram(panels: Sequence[CoveragePanel], *, spacing: float) -> Figure:
    """Draw the spread of the spacing of every backend on one axis; logarithmic, as the even ones fill few bins."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import FixedFormatter, FixedLocator, FuncFormatter

    figure = Figure(figsize=(COLUMN_INCHES, HISTOGRAM_INCHES), dpi=DOTS_PER_INCH, layout="constrained")
    axis: Axes = figure.subplots()
    low, high, ticks = shown = ratio_axis([panel.ratios for panel in panels])
    edges = np.linspace(low, high, BINS + 1)
    axis.axvspan(*EVEN, color="#ececec", linewidth=0.0, zorder=0)
    axis.text(EVEN[1], 100.0, " within 5 %", fontsize=SMALL, color="#606060", va="center")
    for panel, (colour, dashes) in zip(panels, LINES, strict=False):
        shares = np.maximum(100.0 * spacing_shares(panel.ratios, shown), 0.1 * LEAST_SHARE)
        axis.stairs(
            shares, edges, baseline=0.1 * LEAST_SHARE, label=panel.title, color=colour, linestyle=dashes, linewidth=1.1
        )
    axis.set_yscale("log")
    axis.set_ylim(LEAST_SHARE, 130.0)
    axis.set_xlim(low, high)
    axis.xaxis.set_major_locator(FixedLocator(ticks))
    axis.xaxis.set_major_formatter(FixedFormatter(tick_texts(shown)))
    axis.yaxis.set_major_formatter(FuncFormatter(_plain))
    axis.tick_params(labelsize=SMALL)
    axis.set_xlabel(f"local spacing / wanted spacing of {spacing:.3g} mm", fontsize=LARGE)
    axis.set_ylabel("share of path, %", fontsize=LARGE)
    figure.legend(loc="outside upper center", ncols=len(panels), fontsize=SMALL, frameon=False, columnspacing=1.2)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    return figure


def _plain(value: float, _: int | None) -> str:
    return f"{value:g}"


def paper_files(workpiece: Workpiece, planned: Sequence[tuple[str, Planned]]) -> dict[str, bytes]:
    """Return name and content of the figures for papers, as PNG and SVG.

    Args:
        workpiece: what they planned on.
        planned: name and outcome, at least one.
    """
    return paper_figures(
        workpiece.part,
        [coverage_panel(name, outcome) for name, outcome in planned],
        R_view_work=workpiece.upright,
        spacing=planned[0][1].plan.contours.spacing,
    )
