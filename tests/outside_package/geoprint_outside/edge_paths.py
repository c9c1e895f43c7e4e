"""The shortest paths along the edges of the triangles: easily understood, and too long across them."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from geoprint.distance import isolines, level_distances, linear_edge_length
from geoprint.geometry import edge_lengths, edges
from geoprint.model import Contours, ScalarField, Source, Surface


class EdgePaths:
    """Distance along the edges; `stretch` is what it is divided by to be right in the mean."""

    title: ClassVar[str] = "shortest paths along the edges"

    def __init__(self, surface: Surface, *, stretch: float = 1.0) -> None:
        self._surface, self._stretch = surface, stretch
        count, ends = len(surface.vertices), edges(surface.faces)
        self._graph = coo_array((edge_lengths(surface), (ends[:, 0], ends[:, 1])), shape=(count, count)).tocsr()

    @staticmethod
    def edge_length(_part: Surface, *, spacing: float) -> float:
        return linear_edge_length(spacing=spacing)

    def distance(self, source: Source) -> ScalarField:
        points = source.curves.points
        starts = np.unique(self._surface.faces[points.faces, points.weights.argmax(axis=1)])
        found = dijkstra(self._graph, directed=False, indices=starts, min_only=True)
        return ScalarField(np.asarray(found) / self._stretch)

    def contours(self, source: Source, *, spacing: float) -> Contours:
        field = self.distance(source)
        curves, levels = isolines(self._surface, field, levels=level_distances(field, spacing=spacing))
        return Contours(curves, levels, spacing, field)
