"""A line over a part at an angle, for rows to run beside: the section of the part by an upright plane."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from geoprint.backends import isolines
from geoprint.errors import FieldError
from geoprint.model import BoolArray, FloatArray, ScalarField, Seed, Surface, SurfaceCurves, SurfacePoints
from geoprint.surfaces import direction_across, face_areas, mean_normal, positions

# A vertex this near to the plane [mm] lies in it, and points of a section this near to each other are one: rounding of
# coordinates up to some metres is less.
IN_PLANE = 1e-9


def section_seed(surface: Surface, *, angle_deg: float, base: Surface) -> Seed:
    """Return the line over a surface at an angle: straight as it is seen along the mean normal.

    It is the section by the plane that holds the mean normal of the base, the direction at the angle across it
    (`direction_across`) and the middle of the base's area; exact in each triangle. Where that misses the surface, as it
    may one piece of several in a layer, a parallel plane goes through the middle of the surface's own area, which it
    never misses. All pieces of the section count: beside a hole or a bay a part has several, and rows run beside each.

    Args:
        surface: in one piece.
        angle_deg: counter-clockwise seen from outside, from the x axis as it is seen along the mean normal [degrees].
        base: that says where and how the plane stands: the surface itself, or of a layer the part that the lowest one
            lies on, so that layers with the same angle lie over each other, and those with others cross them.

    Raises:
        FieldError: the base has no mean normal, as a closed part, whose normals cancel.
    """
    if not mean_normal(base).any():
        raise FieldError(
            f"{base.name} has no mean normal to count an angle about, because its normals cancel, as those of a "
            "closed part do: draw the line (`--from curve.csv`, columns x,y,z), or cut out the part that is printed."
        )
    square = direction_across(base, angle=np.radians(angle_deg + 90.0))
    curves = _section(surface, _area_middle(base), square)
    if curves.count == 0:
        curves = _section(surface, _area_middle(surface), square)
    return Seed(curves)


def _section(surface: Surface, middle: FloatArray, square: FloatArray) -> SurfaceCurves:
    """Return the section by the plane through a place, square to a direction, without parts of no length."""
    heights = (surface.vertices - middle) @ square
    heights[np.abs(heights) < IN_PLANE] = 0.0
    curves, _ = isolines(surface, ScalarField(heights), levels=np.zeros(1))
    places = positions(surface, curves.points)
    kept = [begin + np.flatnonzero(_moves(places[begin:end])) for begin, end in pairwise(curves.offsets.tolist())]
    lines = [index for index, rows in enumerate(kept) if rows.size > 1]
    rows = np.concatenate([np.zeros(0, dtype=np.int64), *(kept[line] for line in lines)])
    return SurfaceCurves(
        SurfacePoints(curves.points.faces[rows], curves.points.weights[rows]),
        np.concatenate([[0], np.cumsum([kept[line].size for line in lines], dtype=np.int64)]),
        curves.closed[lines],
    )


def _moves(places: FloatArray) -> BoolArray:
    """Return which of (k, 3) places of a curve are another than the one before; the first is."""
    return np.append([True], np.linalg.norm(np.diff(places, axis=0), axis=1) > IN_PLANE)


def _area_middle(surface: Surface) -> FloatArray:
    """Return the (3,) middle of the area of a surface [mm]."""
    areas = face_areas(surface)
    return areas @ surface.vertices[surface.faces].mean(axis=1) / areas.sum()
