"""Straight rows: where planes a spacing apart cut the surface."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from geoprint.distance import Backend, isolines, level_distances
from geoprint.model import Paths, ScalarField, Source, Surface


class StraightRows:
    """Rows along a direction, `angle_deg` from the part's x axis; they ask no backend."""

    title: ClassVar[str] = "straight rows"

    def __init__(self, *, angle_deg: float = 0.0) -> None:
        angle = np.radians(angle_deg)
        self._across = np.array([-np.sin(angle), np.cos(angle), 0.0])

    def paths(self, surface: Surface, _source: Source, *, backend: Backend, spacing: float | ScalarField) -> Paths:
        del backend
        assert isinstance(spacing, float)
        heights = surface.vertices @ self._across
        field = ScalarField(heights - heights.min())
        curves, levels = isolines(surface, field, levels=level_distances(field, spacing=spacing))
        row = np.repeat(levels, np.diff(curves.offsets)).astype(np.float64)
        return Paths(curves, row, np.full(row.size, spacing), np.ones(row.size))
