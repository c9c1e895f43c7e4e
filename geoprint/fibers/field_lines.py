"""The lines on a surface that a field file says, and those of a layer over it."""

from __future__ import annotations

from collections.abc import Callable
from math import radians
from pathlib import Path

import numpy as np

from geoprint.config import FieldFile, PreferenceTable, ThroughTable, WallTable
from geoprint.fibers.fields import DirectionField, carried_field
from geoprint.fibers.preferences import AlongCurvature, AlongDirection, AlongRim, AlongStroke, Preference
from geoprint.fibers.prescribed import prescribed_field, singularities_near, smoothest_field
from geoprint.fibers.wall import HelixRule, WallCoordinates, WallVoxels
from geoprint.geometry import closest, edge_lengths, even_points, on_surface, refine
from geoprint.geometry.files import read_volume
from geoprint.model import FloatArray, Surface, SurfaceCurves
from geoprint.results import StackPlace

# Fibres are lines without a sense: who prints one may begin at either end.
LINES = 2


def lines_of(file: FieldFile, *, place: StackPlace | None = None) -> Callable[[Surface], DirectionField]:
    """Return what makes the lines of a field file on a surface.

    Args:
        file: what was read.
        place: of the layer whose middle the surface is: its lines are those of the part, carried up and turned, but
            for a wall's, which has its own as far as it goes; None of a single skin.

    What is returned raises:
        FieldError: indices do not add up to what the surface demands, a place lies off it, or it has nothing of what
            is preferred; or it lies off the wall, or labels make none.
        InputError: two singularities have one vertex, or the volume of a wall cannot be read.
    """

    def lines(surface: Surface) -> DirectionField:
        if file.wall is not None:
            return _in_wall(file.wall, surface, part=None if place is None else place.base)
        if place is None:
            return _designed(file, surface)
        # As fine as the layer, so that lines are as smooth there as on a single skin.
        below = refine(place.base, edge_length=float(np.median(edge_lengths(surface))))
        feet, heights = closest(below, surface.vertices[surface.faces].mean(axis=1))
        turned = _turned(file.through, place, heights)
        return carried_field(_designed(file, below), surface, feet=feet, turned=turned)

    return lines


def _designed(file: FieldFile, surface: Surface) -> DirectionField:
    """Return the lines on the part itself."""
    if file.helix is not None:
        axis, angle = np.array(file.helix.axis), radians(file.helix.angle)
        heights = surface.vertices @ (axis / np.linalg.norm(axis))
        return HelixRule(angle, angle).field(surface, heights=heights, depths=np.zeros(heights.size))
    preferences = [_preference(table, surface) for table in file.preferences]
    if not file.singularities:
        return smoothest_field(surface, symmetry=LINES, preferences=preferences)
    places = np.array([table.place for table in file.singularities])
    on_surface(surface, places, what="the singularity {} of the field")
    indices = np.array([table.index for table in file.singularities])
    return prescribed_field(
        surface,
        symmetry=LINES,
        singularities=singularities_near(surface, places, indices=indices),
        preferences=preferences,
    )


def _in_wall(table: WallTable, surface: Surface, *, part: Surface | None) -> DirectionField:
    """Return the fibres of a wall on a surface within it, or on a layer over a part that is."""
    path = Path(table.volume)
    volume = read_volume(path.read_bytes(), name=path.name)
    wall, cavity, base = (np.isin(volume.labels, labels) for labels in (table.labels, table.cavity, table.base))
    rule = HelixRule(radians(table.epicardial_deg), radians(table.endocardial_deg))
    coordinates = WallCoordinates(WallVoxels(wall, cavity, base, volume.affine, path.name))
    return coordinates.field(surface, rule, part=part)


def _turned(table: ThroughTable | None, place: StackPlace, heights: FloatArray) -> FloatArray:
    """Return by what lines of a layer are turned at (m,) heights over the part [mm], counter-clockwise [rad]."""
    if table is None:
        return np.zeros(heights.size)
    if table.inner_deg is None or table.outer_deg is None:
        return np.radians(table.turn_deg_per_mm or 0.0) * heights
    share = (place.number - 0.5) / place.count
    return np.full(heights.size, radians(table.inner_deg + share * (table.outer_deg - table.inner_deg)))


def _preference(table: PreferenceTable, surface: Surface) -> Preference:
    """Return what a table prefers on a surface."""
    weighted = {} if table.weight is None else {"weight": table.weight}
    if table.direction is not None:
        return AlongDirection(np.array(table.direction), **weighted)
    if table.curvature is not None:
        return AlongCurvature(table.curvature, **weighted)
    if table.stroke is not None:
        corners = np.array(table.stroke)
        on_surface(surface, corners, what="the point of a stroke {} of the field")
        drawn = even_points(corners, step=float(np.median(edge_lengths(surface))))
        points, _ = closest(surface, drawn)
        return AlongStroke(SurfaceCurves(points, np.array([0, len(drawn)]), np.array([False])), **weighted)
    return AlongRim(**weighted)
