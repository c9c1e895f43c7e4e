"""Figures of a stack: sliced open, and where its runs start over the part."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from scipy.spatial import KDTree

from geoprint.layers.slices import Slice
from geoprint.model import FloatArray, IntArray, Surface
from geoprint.reporting.figures import (
    COVERAGE_DOTS,
    add_ruler,
    add_title,
    draw_part,
    png_bytes,
)
from geoprint.reporting.thickness_page import LOWEST, side_panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Places, line after line, and where each line starts.
Lines: TypeAlias = tuple[FloatArray, IntArray]
# Layers in turns; of Okabe and Ito, safe for colour-blind readers.
LAYER_COLOURS = ("#56b4e9", "#e69f00")
GROUND, LINE = "#cfd6dc", "#1c2730"
# Places along the outline of a drawn bead, and the radius of its corners over the lesser of half its height and width.
BEAD_CORNERS, BEAD_ROUND = 24, 0.6
# Width of the enlarged piece over the thickness of the stack, and at least over the median width of a bead.
ENLARGED, ENLARGED_BEADS = 4.0, 8.0
# It lies at this share of the longest line of the part: in the middle of that fronts meet.
ENLARGED_AT = 0.3
# From where to where it reaches, over the thickness of the stack, from the part upwards.
ENLARGED_DOWN, ENLARGED_UP = 0.5, 1.4
WIDTH_INCHES, FRAME_SHARE = 9.0, 0.04
# As much of the part is drawn below the stack, over the width of the enlarged piece.
BELOW_SHARE = 0.12
SEAM_COLOURS = "viridis"
SEAM_SIZE = 10.0


def sliced_figure(ground: Lines, slices: Sequence[Slice], heights: Sequence[float], *, title: str) -> Figure:
    """Draw a stack sliced open: all of it, and an enlarged piece.

    Args:
        ground: places of the part in the plane, line after line, and where each line starts.
        slices: what the plane cuts of each layer, the lowest first.
        heights: of the layers [mm].
        title: above everything.
    """
    from matplotlib.figure import Figure

    low, high = _extent(ground, slices, heights)
    size = high - low
    thickness = sum(heights)
    widths = np.concatenate([one.widths for one in slices])
    bead = float(np.median(widths)) if widths.size else 0.0
    middle, half = _enlarged(ground), 0.5 * min(max(ENLARGED * thickness, ENLARGED_BEADS * bead), float(size[0]))
    part = np.clip((ENLARGED_DOWN + ENLARGED_UP) * thickness / (2.0 * half), LOWEST, 1.0)
    whole = np.clip(size[1] / size[0], LOWEST, 1.0)
    figure = Figure(
        figsize=(WIDTH_INCHES, WIDTH_INCHES * (whole + part) + 1.2), dpi=COVERAGE_DOTS, layout="constrained"
    )
    axes = figure.subplots(2, 1, height_ratios=(whole, part))
    for axis in axes:
        _draw(axis, ground, slices, heights)
        axis.set_aspect("equal")
        axis.axis("off")
    edge = FRAME_SHARE * float(size[0])
    axes[0].set_xlim(low[0] - edge, high[0] + edge)
    axes[0].set_ylim(low[1] - edge, high[1] + edge)
    axes[1].set_xlim(middle[0] - half, middle[0] + half)
    axes[1].set_ylim(middle[1] - ENLARGED_DOWN * thickness, middle[1] + ENLARGED_UP * thickness)
    for axis in axes:
        add_ruler(axis)
    axes[1].set_title("detail, enlarged", fontsize=10, loc="left")
    add_title(figure, title)
    return figure


def seams_figure(surface: Surface, seams: Sequence[FloatArray], *, R_view_work: FloatArray, title: str) -> bytes:
    """Draw where the runs of all layers start, over the part, from enough sides.

    Args:
        surface: the part.
        seams: (r, 3) starts of each layer, the lowest first [mm].
        R_view_work: (3, 3) rotation to the first side.
        title: above everything.

    Returns:
        The PNG's bytes; the same for the same input.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm

    figure, axes, sides = side_panels(surface, R_view_work)
    count = len(seams)
    scale = BoundaryNorm(np.arange(count + 1) + 0.5, 256)
    number = np.repeat(np.arange(1, count + 1), [len(some) for some in seams])
    for axis, R_side_work in zip(axes, sides, strict=True):
        draw_part(axis, surface, R_side_work, shades=(0.55, 0.88))
        seen = np.concatenate(seams) @ R_side_work.T
        axis.scatter(
            seen[:, 0], seen[:, 1], c=number, norm=scale, cmap=SEAM_COLOURS, s=SEAM_SIZE, edgecolors="white",
            linewidths=0.3, zorder=3,
        )  # fmt: skip
        axis.autoscale_view()
    ticks = np.unique(np.linspace(1, count, min(count, 8)).round())
    bar = figure.colorbar(ScalarMappable(scale, SEAM_COLOURS), ax=axes, shrink=0.8, pad=0.01, ticks=ticks)
    bar.set_label("layer, counted from the part", fontsize=9)
    add_title(figure, title)
    return png_bytes(figure)


def _draw(axis: Axes, ground: Lines, slices: Sequence[Slice], heights: Sequence[float]) -> None:
    """Draw the part in grey, the beads of each layer in its colour, and the lines of the layers over them."""
    from matplotlib.collections import LineCollection, PolyCollection

    depth = BELOW_SHARE * ENLARGED * sum(heights)
    for line in _split(*ground):
        strip = _strip(line, slices[0].line, depth=depth)
        axis.fill(strip[:, 0], strip[:, 1], color=GROUND, linewidth=0)
        axis.plot(line[:, 0], line[:, 1], color=LINE, linewidth=1.2)
    for number, (one, height) in enumerate(zip(slices, heights, strict=True)):
        beads = bead_outlines(one.beads, one.along, one.widths, height=height)
        colour = LAYER_COLOURS[number % len(LAYER_COLOURS)]
        axis.add_collection(PolyCollection(list(beads), facecolors=colour, edgecolors=LINE, linewidths=0.15))
        lines = _split(one.line, one.offsets)
        axis.add_collection(LineCollection(lines, colors=LINE, linewidths=0.3, alpha=0.5))


def bead_outlines(places: FloatArray, along: FloatArray, widths: FloatArray, *, height: float) -> FloatArray:
    """Return the (b, 24, 2) outlines of beads that lie on a layer: as wide as they are, and as high as it.

    Args:
        places: (b, 2) their middles [mm].
        along: (b, 2) unit vectors along the layer.
        widths: (b,) [mm].
        height: of the layer [mm].
    """
    turn: FloatArray = 2.0 * np.pi * (np.arange(BEAD_CORNERS) + 0.5) / BEAD_CORNERS
    radii = 0.5 * BEAD_ROUND * np.minimum(widths, height)[:, None]
    # Each quarter of a circle about its own corner, and stretched so that it ends at the sides.
    cosines, sines = (each / np.abs(each).max() for each in (np.cos(turn), np.sin(turn)))
    wide = np.sign(cosines) * (0.5 * widths[:, None] - radii) + radii * cosines
    high = np.sign(sines) * (0.5 * height - radii) + radii * sines
    up = np.column_stack([-along[:, 1], along[:, 0]])
    return places[:, None] + wide[..., None] * along[:, None] + high[..., None] * up[:, None]


def _extent(ground: Lines, slices: Sequence[Slice], heights: Sequence[float]) -> tuple[FloatArray, FloatArray]:
    """Return the lower left and the upper right corner of what is drawn [mm]."""
    half = 0.5 * max(heights)
    everything = np.concatenate([ground[0], *(one.line for one in slices)])
    return everything.min(axis=0) - half, everything.max(axis=0) + half


def _enlarged(ground: Lines) -> FloatArray:
    """Return the place of the part about which a piece is enlarged [mm]."""
    lines = _split(*ground)
    line = max(lines, key=lambda each: float(np.linalg.norm(np.diff(each, axis=0), axis=1).sum()))
    return line[int(ENLARGED_AT * len(line))]


def _split(places: FloatArray, offsets: IntArray) -> list[FloatArray]:
    return [places[start:end] for start, end in pairwise(offsets.tolist())]


def _strip(line: FloatArray, over: FloatArray, *, depth: float) -> FloatArray:
    """Return the outline of what lies below a (q, 2) line, away from the layer whose (k, 2) places are over it [mm]."""
    along = np.gradient(line, axis=0)
    lengths = np.linalg.norm(along, axis=1, keepdims=True)
    up = np.column_stack([-along[:, 1], along[:, 0]]) / np.where(lengths > 0.0, lengths, 1.0)
    if len(over):
        _, nearest = KDTree(over).query(line)
        up *= np.sign(np.einsum("qx,qx->", over[np.asarray(nearest)] - line, up)) or 1.0
    return np.concatenate([line, (line - depth * up)[::-1]])
