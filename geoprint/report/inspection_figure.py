"""The picture of a mesh doctor's findings: the part from both sides, with what is wrong marked on it."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from geoprint.model import FloatArray, Surface
from geoprint.report.figures import DOTS_PER_INCH, add_ruler, add_title, png_bytes
from geoprint.report.view_surface import view_surface
from geoprint.surfaces import boundary_half_edges, face_normals, half_edges, upright_of
from geoprint.surfaces.repair import Inspection

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Colours that differ for colour-blind readers too.
RIM, CROSSING, CROWDED, FAN, FLIPPED, SLIVER = "#0072b2", "#d55e00", "#cc79a7", "#e69f00", "#009e73", "#56b4e9"
SHADES = (0.45, 0.88)
MOST_DRAWN = 60_000
# Up to so many faces their edges are drawn too.
MOST_EDGED = 8000


def inspection_figure(found: Inspection, *, title: str) -> bytes:
    """Draw the examined mesh from above its mean normal and from below, with its border and what is wrong.

    Args:
        found: what was found.
        title: above both views.

    Returns:
        The PNG's bytes.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.5, 6.2), dpi=DOTS_PER_INCH, layout="constrained")
    above = upright_of(found.examined)
    below = np.diag([-1.0, 1.0, -1.0]) @ above
    drawn = _drawn(found)
    axes: list[Axes] = list(figure.subplots(1, 2, squeeze=False)[0])
    for axis, rotation, side in zip(axes, (above, below), ("front", "back"), strict=True):
        _draw_faces(axis, drawn, rotation)
        _draw_rim(axis, found.examined, rotation)
        for (count, places), colour, mark, label in _marks(found):
            seen = np.array(places).reshape(-1, 3) @ rotation.T
            axis.plot(
                seen[:, 0], seen[:, 1], mark, color=colour, markersize=8, markerfacecolor="none", markeredgewidth=2.0,
                label=f"{label}: {count}",
            )  # fmt: skip
        add_ruler(axis)
        axis.set_title(side, fontsize=11, loc="left")
    handles, labels = axes[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=9)
    add_title(figure, title)
    return png_bytes(figure)


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
    axis.set_axis_off()


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
