"""The picture of a mesh doctor's findings: the part along its axes, with what is wrong and places marked on it."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from string import ascii_uppercase
from typing import TYPE_CHECKING

import numpy as np

from geoprint.model import FloatArray, Surface
from geoprint.report.figures import add_title, png_bytes
from geoprint.report.view_surface import view_surface
from geoprint.surfaces import Landmark, boundary_half_edges, face_normals, half_edges
from geoprint.surfaces.rays import RayTree
from geoprint.surfaces.repair import Inspection

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
    from matplotlib.collections import PolyCollection

    corners = surface.vertices[surface.faces] @ rotation.T
    upward = np.abs(face_normals(surface) @ rotation.T[:, 2])
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    shade = (SHADES[0] + (SHADES[1] - SHADES[0]) * upward)[order]
    colours = np.repeat(shade[:, None], 3, axis=1)
    edges = colours * (0.82 if len(order) < MOST_EDGED else 1.0)
    axis.add_collection(
        PolyCollection(list(corners[order, :, :2]), facecolors=colours, edgecolors=edges, linewidths=0.4)
    )
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
