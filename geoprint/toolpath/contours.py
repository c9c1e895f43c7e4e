"""Contours: the level curves of a distance, each one spacing (stepover) from the one before it."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from geoprint.distance import Backend
from geoprint.errors import UsageError
from geoprint.model import Contours, Paths, ScalarField, Source, Surface
from geoprint.toolpath.medial_axis_fitting import fitted, parted

PLAIN, FITTED = MIDDLES = ("plain", "fitted")


@final
class ContourPattern:
    """The `contours` pattern: what the backend traces at (k + 1/2) * spacing from the source is row k.

    Args:
        middle: what becomes of the curves where fronts meet: `plain`, or `fitted` to the width that is there.

    Raises:
        UsageError: there is no such treatment.

    Examples:
        >>> ContourPattern.title
        'level curves of the distance'
    """

    title: ClassVar[str] = "level curves of the distance"
    summary: ClassVar[str] = "Follows the level curves of the distance from the source, as the backend traces them."

    def __init__(self, *, middle: str = PLAIN) -> None:
        if middle not in MIDDLES:
            raise UsageError(f"contours have no `middle` '{middle[:40]}'; choose one of: {', '.join(MIDDLES)}.")
        self._middle = middle

    def paths(self, surface: Surface, source: Source, *, backend: Backend, spacing: float | ScalarField) -> Paths:
        """Return a stroke for each level curve, and where the middle is fitted for each bead along a ridge.

        None comes near to itself: where both sides of a finger or a neck are one bead, one bead is drawn.

        Raises:
            UsageError: the spacing is not the same everywhere.
            FieldError: not even the first level lies on the surface, or on a piece of it.
        """
        if isinstance(spacing, ScalarField):
            raise UsageError(
                "contours lie one spacing apart everywhere, but a spacing at each vertex is given. Give one number, "
                "or choose the pattern fibres."
            )
        contours = backend.contours(source, spacing=spacing)
        if self._middle == FITTED:
            return _apart(surface, fitted(surface, contours), contours)
        row = contours.point_levels.astype(np.float64)
        promised = (row + 0.5) * contours.spacing
        drawn = Paths(contours.curves, row, np.full(row.size, contours.spacing), np.ones(row.size), promised=promised)
        return _apart(surface, drawn, contours)


def _apart(surface: Surface, drawn: Paths, contours: Contours) -> Paths:
    """Return paths that keep their distance from themselves; what is drawn anew promises the distance there."""
    curves, origins, anew = parted(surface, drawn.curves, spacing=contours.spacing)
    if curves is drawn.curves:
        return drawn
    sizes = np.diff(curves.offsets)
    row = np.repeat(drawn.levels[origins], sizes).astype(np.float64)
    promised = None
    if drawn.promised is not None:
        away = curves.points.values(surface, contours.distance.values)
        promised = np.where(np.repeat(anew, sizes), away, (row + 0.5) * contours.spacing)
    return Paths(curves, row, np.full(row.size, contours.spacing), np.ones(row.size), promised=promised)
