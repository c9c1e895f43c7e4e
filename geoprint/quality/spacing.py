"""Distance from every level of a path to the level outside it, over the surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import BoolArray, FloatArray, IntArray
from geoprint.quality.deposited import Samples
from geoprint.quality.geodesic import Ask, GeodesicDistance
from geoprint.quality.tracing import SurfacePath
from geoprint.quality.triangles import Mesh, Places, spatial

# Stretches of one run are two when they are farther apart along it than this many spacings.
APART = 2.0


@final
@dataclass(frozen=True, slots=True, eq=False)
class OuterDistance:
    """How far samples are from the level outside.

    Attributes:
        distances: (k,) length of the shortest way that was found; infinity where no way leads there [mm].
        bounds: (k,) no way is shorter; equal to the distance where that is exact [mm].
        exact: (k,) whether the distance is exact.
    """

    distances: FloatArray
    bounds: FloatArray

    @property
    def exact(self) -> BoolArray:
        """(k,) whether the distance is exact."""
        return self.bounds >= self.distances


def outer_distance(mesh: Mesh, path: SurfacePath, distance: GeodesicDistance, samples: Samples) -> OuterDistance:
    """Return the distance of samples of every level but the first to the nearest run of the level before.

    Where the budget of work does not suffice, a way towards the point that is nearest in space bounds the distance
    from above, and the straight line to it from below.

    Args:
        mesh: m triangles.
        path: r runs.
        distance: to the path.
        samples: k samples along runs, none of the first level.
    """
    levels = np.unique(path.levels)
    outer = levels[np.searchsorted(levels, path.levels[samples.runs]) - 1]
    found = distance(samples.places, Ask.level(outer))
    open_samples = np.flatnonzero(found.bounds < found.distances)
    if open_samples.size == 0:
        return OuterDistance(found.distances, found.bounds)
    places = Places(samples.places.faces[open_samples], samples.places.flat[open_samples])
    straight, aims = _nearest_in_space(mesh, path, places, outer[open_samples])
    ways = distance(places, Ask.level(outer[open_samples], aims=aims))
    distances, bounds = found.distances.copy(), found.bounds.copy()
    distances[open_samples] = np.minimum(distances[open_samples], ways.distances)
    bounds[open_samples] = np.minimum(np.maximum(bounds[open_samples], straight), distances[open_samples])
    return OuterDistance(distances, bounds)


def meeting_share(path: SurfacePath, distance: GeodesicDistance, samples: Samples, *, spacing: float) -> float:
    """Return the share of samples within one spacing of another stretch of their own level.

    There two fronts meet, near the medial axis of the surface, where level curves have corners and fields err most.

    Args:
        path: r runs.
        distance: to the path.
        samples: k samples along runs.
        spacing: wanted [mm].
    """
    levels, limits = path.levels[samples.runs], np.full(samples.runs.size, spacing)
    ask = Ask.elsewhere(levels, samples.runs, samples.arcs, clear=APART * spacing, limits=limits)
    return float(np.isfinite(distance(samples.places, ask).distances).mean())


def _nearest_in_space(mesh: Mesh, path: SurfacePath, places: Places, levels: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return a lower bound of the straight distance to (k,) levels, and where on them about the nearest point is."""
    middles = path.middles(mesh)
    halves = 0.5 * np.abs(path.ends - path.starts)
    points = spatial(mesh, places)
    bounds, nearest = np.zeros(points.shape[0]), np.zeros_like(points)
    for level in np.unique(levels):
        asking, pieces = np.flatnonzero(levels == level), np.flatnonzero(path.levels[path.runs] == level)
        away, which = KDTree(middles[pieces]).query(points[asking])
        bounds[asking] = np.maximum(away - halves[pieces].max(), 0.0)
        nearest[asking] = middles[pieces[which]]
    return bounds, nearest
