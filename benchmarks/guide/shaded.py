"""Surfaces, lines and solids as pictures of the guide show them: shaded, seen along one direction."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import io

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

from geoprint.geometry import face_normals, positions
from geoprint.model import BoolArray, FloatArray, Surface, SurfaceCurves

# Of Okabe and Ito, safe for colour-blind readers.
BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#6b7780"
PART = "#d8dee3"
DOTS_PER_INCH = 150
# Colours that a picture keeps, which makes it small.
COLOURS = 160
# Where light comes from, in the view.
LIGHT = np.array([-0.35, 0.45, 0.82])


def view_from(direction: FloatArray, *, up: FloatArray) -> FloatArray:
    """Return the (3, 3) rotation to a view: x to the right, y up, z towards the reader, who stands at a direction."""
    z = direction / np.linalg.norm(direction)
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(z, x), z])


def draw_surface(axis: Axes, surface: Surface, view: FloatArray, *, colours: FloatArray | None = None) -> None:
    """Draw the faces that look at the reader, the far ones first.

    Args:
        axis: to draw on; it gets the size of the surface and loses its frame.
        surface: to draw.
        view: (3, 3) rotation to the view.
        colours: (m, 3) colour of each face, or one for all.
    """
    normals = face_normals(surface) @ view.T
    corners = surface.vertices[surface.faces] @ view.T
    shade = 0.62 + 0.38 * np.clip(normals @ LIGHT / np.linalg.norm(LIGHT), 0.0, 1.0)
    own = np.tile(to_rgb(PART), (len(normals), 1)) if colours is None else colours
    seen = np.flatnonzero(normals[:, 2] > 0.0)
    order = seen[np.argsort(corners[seen, :, 2].mean(axis=1))]
    drawn = (own * shade[:, None])[order]
    axis.add_collection(PolyCollection(list(corners[order, :, :2]), facecolors=drawn, edgecolors=drawn, linewidths=0.4))
    bare(axis)


def draw_curves(
    axis: Axes, surface: Surface, curves: SurfaceCurves, view: FloatArray, *, colour: str, width: float = 1.6
) -> None:
    """Draw curves on a surface where the surface looks at the reader."""
    places = positions(surface, curves.points) @ view.T
    seen = face_normals(surface)[curves.points.faces] @ view[2] > 0.05
    for start, end in zip(curves.offsets[:-1], curves.offsets[1:], strict=True):
        draw_lines(axis, places[start:end, :2], seen[start:end], colour=colour, width=width)


def draw_lines(axis: Axes, places: FloatArray, seen: BoolArray, *, colour: str, width: float) -> None:
    """Draw the pieces of a (k, 2) line whose both ends are seen."""
    pieces = np.stack([places[:-1], places[1:]], axis=1)[seen[:-1] & seen[1:]]
    axis.add_collection(LineCollection(list(pieces), colors=colour, linewidths=width, capstyle="round"))


def bare(axis: Axes) -> None:
    """Give an axis equal scales and take its frame away."""
    axis.set_aspect("equal")
    axis.autoscale_view()
    axis.axis("off")


def panels(count: int, *, width: float = 7.2, height: float = 3.4) -> tuple[Figure, list[Axes]]:
    """Return a figure with so many axes side by side."""
    figure = Figure(figsize=(width, height), dpi=DOTS_PER_INCH, layout="constrained")
    return figure, list(figure.subplots(1, count, squeeze=False)[0])


def small_png(figure: Figure) -> bytes:
    """Return a figure as a small PNG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return smaller(buffer.getvalue(), width=round(figure.get_figwidth() * DOTS_PER_INCH))


def smaller(data: bytes, *, width: int) -> bytes:
    """Return a picture at most so many pixels wide, in few colours."""
    picture = Image.open(io.BytesIO(data)).convert("RGB")
    if picture.width > width:
        picture = picture.resize((width, round(picture.height * width / picture.width)), Image.Resampling.LANCZOS)
    buffer = io.BytesIO()
    # No colour strays far, as those of a scale would where the many shades of a surface take most of the places.
    few = picture.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(buffer, format="png", optimize=True)
    return buffer.getvalue()
