"""How near a distance field is to a true distance: its slope should be 1 everywhere but on the cut locus."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.model import ScalarField, Surface, comparable
from geoprint.surfaces import face_areas, gradient

# Triangles with a smaller slope lie over the cut locus, where fronts meet and the slope breaks.
CUT_LOCUS_SLOPE = 0.9


@final
@comparable
class Diagnostics:
    """The slope of a field, weighted by area.

    Attributes:
        mean_slope_error: mean of | |grad d| - 1 | away from the cut locus.
        p95_slope_error: its 95th percentile there.
        cut_locus_share: share of the area in triangles over the cut locus.
    """

    mean_slope_error: float
    p95_slope_error: float
    cut_locus_share: float


def diagnostics(surface: Surface, field: ScalarField) -> Diagnostics:
    """Measure the slope of a distance field in every triangle.

    Args:
        surface: n vertices.
        field: (n,) distances [mm].

    Returns:
        The measurement; where everything lies over the cut locus the slope errors are those of all triangles.
    """
    slopes = np.sqrt((gradient(surface, field.values) ** 2).sum(axis=1))
    areas = face_areas(surface)
    away = slopes >= CUT_LOCUS_SLOPE
    judged = away if away.any() else ~away
    errors, weights = np.abs(slopes - 1.0)[judged], areas[judged]
    order = np.argsort(errors)
    below = int((np.cumsum(weights[order]) < 0.95 * weights.sum()).sum())
    return Diagnostics(
        mean_slope_error=float(errors @ weights / weights.sum()),
        p95_slope_error=float(errors[order][min(below, errors.size - 1)]),
        cut_locus_share=float(areas[~away].sum() / areas.sum()),
    )
