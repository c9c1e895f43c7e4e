"""From what a field file says to the lines on a surface that fibres follow."""

from __future__ import annotations

from collections.abc import Callable
from math import radians

import numpy as np

from geoprint.config import FieldFile, PreferenceTable
from geoprint.errors import FieldError
from geoprint.fields import (
    AlongCurvature,
    AlongDirection,
    AlongRim,
    AlongStroke,
    DirectionField,
    HelixRule,
    Preference,
    prescribed_field,
    singularities_near,
    smoothest_field,
)
from geoprint.model import FloatArray, Surface, SurfaceCurves
from geoprint.surfaces import closest, edge_lengths, even_points, in_words

# Fibres have no sense.
LINES = 2
# A place may miss the surface by this [mm]: what is read off a screen is rounded.
PLACE_TOLERANCE = 1.0


def lines_of(file: FieldFile) -> Callable[[Surface], DirectionField]:
    """Return what makes the lines of a field file on a surface.

    What is returned raises:
        FieldError: indices do not add up to what the surface demands, a place lies off it, or it has nothing of what
            is preferred.
        InputError: two singularities have one vertex.
    """

    def lines(surface: Surface) -> DirectionField:
        if file.helix is not None:
            axis, angle = np.array(file.helix.axis), radians(file.helix.angle)
            heights = surface.vertices @ (axis / np.linalg.norm(axis))
            return HelixRule(angle, angle).field(surface, heights=heights, depths=np.zeros(heights.size))
        preferences = [_preference(table, surface) for table in file.preferences]
        if not file.singularities:
            return smoothest_field(surface, symmetry=LINES, preferences=preferences)
        places = _on(surface, np.array([table.place for table in file.singularities]), what="singularity")
        indices = np.array([table.index for table in file.singularities])
        return prescribed_field(
            surface,
            symmetry=LINES,
            singularities=singularities_near(surface, places, indices=indices),
            preferences=preferences,
        )

    return lines


def _preference(table: PreferenceTable, surface: Surface) -> Preference:
    """Return what a table prefers on a surface."""
    weighted = {} if table.weight is None else {"weight": table.weight}
    if table.direction is not None:
        return AlongDirection(np.array(table.direction), **weighted)
    if table.curvature is not None:
        return AlongCurvature(table.curvature, **weighted)
    if table.stroke is not None:
        corners = _on(surface, np.array(table.stroke), what="point of a stroke")
        drawn = even_points(corners, step=float(np.median(edge_lengths(surface))))
        points, _ = closest(surface, drawn)
        return AlongStroke(SurfaceCurves(points, np.array([0, len(drawn)]), np.array([False])), **weighted)
    return AlongRim(**weighted)


def _on(surface: Surface, places: FloatArray, *, what: str) -> FloatArray:
    """Return (k, 3) places after checking that they lie on a surface [mm].

    Raises:
        FieldError: one lies off it.
    """
    _, away = closest(surface, places)
    worst = int(np.argmax(away))
    if away[worst] > PLACE_TOLERANCE:
        raise FieldError(
            f"the {what} {worst + 1} of the field, {in_words(places[worst])}, lies {away[worst]:.3g} mm off "
            f"{surface.name}, at most {PLACE_TOLERANCE:g} mm is allowed: give a place on it.",
            distance=float(away[worst]),
        )
    return places
