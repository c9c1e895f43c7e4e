"""The picture of the lines that paths follow: dashes all over the part, and the places about which they turn."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from geoprint.model import FloatArray, FollowedLines, IntArray, Surface
from geoprint.report.figures import COVERAGE_DOTS, SIDE_INCHES, add_ruler, add_title, draw_part, png_bytes
from geoprint.report.sides import readable, views
from geoprint.report.view_surface import view_surface
from geoprint.surfaces import face_areas

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
