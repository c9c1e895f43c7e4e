"""Shortest distance over a surface from points to curves: exact, or between bounds that are told."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import inf
from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.kernels import njit
from geoprint.model import BoolArray, FloatArray, IntArray, frozen
from geoprint.quality.oracle.horizon import ANY, Goal, Horizon, Segments, empty_horizon
from geoprint.quality.oracle.tracing import SurfacePath
from geoprint.quality.oracle.triangles import ComplexArray, FlatMesh, Places
from geoprint.quality.oracle.unfolding import search
from geoprint.threads import each_of

# Windows of one search: they suffice to see about 40 triangles far.
WINDOWS_PER_POINT = 200_000
# Windows of all searches of one question, about 20 s of work.
WINDOWS_IN_ALL = 50_000_000
# Two threads share the work of so many points, and the budget: whether or not there are two processors, so that what is
# found where the budget ends is the same everywhere.
SHARED_POINTS = 1_000
# Nowhere to look first.
NO_AIMS = np.zeros((0, 3))


@final
@frozen
class Nearest:
    """What lies nearest to each of k points, over the surface.

    Attributes:
        distances: (k,) length of the shortest way that was found; infinity where there is none within the limit [mm].
        bounds: (k,) no way is shorter; equal to the distance where that is exact [mm].
        runs: (k,) the run it leads to, -1 for none.
        arcs: (k,) where on that run it ends [mm]; NaN for none.
        complete: (k,) whether the search ended by itself: the distance is exact, or nothing is within the limit.
        windows: how many windows all searches took.
    """

    distances: FloatArray
    bounds: FloatArray
    runs: IntArray
    arcs: FloatArray
    complete: BoolArray
    windows: int

    @staticmethod
    def joined(parts: Sequence[Nearest]) -> Nearest:
        """Return what was found of all points of some parts in their order."""
        return Nearest(
            *(
                np.concatenate([getattr(part, name) for part in parts])
                for name in ("distances", "bounds", "runs", "arcs", "complete")
            ),
            windows=sum(part.windows for part in parts),
        )


@final
@frozen
class Ask:
    """Which segments of the path count for each of k points, and how far to look.

    Attributes:
        labels: (k,) only runs of this level, or `ANY`.
        runs: (k,) segments of this run nearer along it than `clear` to `arcs` do not count; -1 for none.
        arcs: (k,) [mm].
        clear: [mm].
        limits: (k,) [mm].
        aims: (k, 3) where to look first [mm], for any way rather than the shortest; (0, 3) for the shortest.
    """

    labels: IntArray
    runs: IntArray
    arcs: FloatArray
    clear: float
    limits: FloatArray
    aims: FloatArray

    @staticmethod
    def level(levels: IntArray, *, aims: FloatArray = NO_AIMS) -> Ask:
        """Ask for the nearest run of a level, however far."""
        none = np.full(levels.size, -1)
        return Ask(levels, none, np.zeros(levels.size), 0.0, np.full(levels.size, inf), aims)

    @staticmethod
    def anything(*, limits: FloatArray) -> Ask:
        """Ask for the nearest run of any level within (k,) limits [mm]."""
        none = np.full(limits.size, -1)
        return Ask(np.full(limits.size, ANY), none, np.zeros(limits.size), 0.0, limits, NO_AIMS)

    @staticmethod
    def elsewhere(labels: IntArray, runs: IntArray, arcs: FloatArray, *, clear: float, limits: FloatArray) -> Ask:
        """Ask for the nearest run of a level that is another one, or farther along the same one than `clear` [mm]."""
        return Ask(labels, runs, arcs, clear, limits, NO_AIMS)

    def some(self, part: slice) -> Ask:
        """Return what is asked of some of the points."""
        return Ask(self.labels[part], self.runs[part], self.arcs[part], self.clear, self.limits[part], self.aims[part])


@final
class GeodesicDistance:
    """Answers how far points of a surface are from a path on it, along the surface.

    The distance is exact on the triangles as they are (`unfolding`), from every point of the path
    and not only from its corners. Nothing of a backend enters.

    Args:
        mesh: m triangles, not much larger than the distance between runs.
        path: on it.
        windows: work that all searches of one question may take; what is left over then is not answered.
    """

    def __init__(self, mesh: FlatMesh, path: SurfacePath, *, windows: int = WINDOWS_IN_ALL) -> None:
        self._mesh, self._windows = mesh, windows
        order = np.argsort(path.faces, kind="stable")
        lengths = np.abs(path.ends - path.starts)
        runs = path.runs[order]
        self._segments = Segments(
            first=np.searchsorted(path.faces[order], np.arange(int(mesh.origins.shape[0]) + 1)),
            starts=path.starts[order],
            along=(path.ends - path.starts)[order],
            labels=path.levels[runs],
            runs=runs,
            arcs=(path.arcs + 0.5 * lengths)[order],
            loops=np.where(path.closed, path.lengths, inf)[runs],
        )
        self._lengths = lengths[order]
        self._middles = KDTree(path.middles(mesh))

    def __call__(self, places: Places, ask: Ask, *, least: FloatArray | None = None) -> Nearest:
        """Return what is nearest to each of k places.

        Args:
            places: on the mesh.
            ask: which segments count, and how far to look.
            least: (3 m,) how far each half-edge is at least from whatever counts [mm]: long searches are narrower.
        """
        count = int(places.faces.size)
        ends = [0, count // 2, count] if count >= SHARED_POINTS else [0, count]
        parts = [slice(first, last) for first, last in pairwise(ends)]
        windows = self._windows // len(parts)
        return Nearest.joined(
            each_of(lambda part: self._nearest(places.some(part), ask.some(part), windows, least), parts)
        )

    def _nearest(self, places: Places, ask: Ask, windows: int, least: FloatArray | None) -> Nearest:
        """Return what is nearest to each of k places as far as so many windows suffice."""
        horizon = empty_horizon(self._mesh, windows=min(WINDOWS_PER_POINT, windows), least=least)
        distances, bounds, found, shares, spent = search_all(
            self._mesh, horizon, self._segments, places.faces, places.flat,
            ask.labels, ask.runs, ask.arcs, ask.clear, ask.limits, ask.aims, windows,
        )  # fmt: skip
        arcs = np.where(found < 0, np.nan, self._segments.arcs[found] + (shares - 0.5) * self._lengths[found])
        runs = np.where(found < 0, -1, self._segments.runs[found])
        complete = bounds >= np.minimum(distances, ask.limits)
        return Nearest(distances, bounds, runs, arcs, complete, spent)

    def straight(self, points: FloatArray) -> FloatArray:
        """Return a lower bound of the straight distance from (k, 3) points to the path [mm]."""
        away, _ = self._middles.query(points)
        return np.maximum(away - 0.5 * self._lengths.max(), 0.0)


@njit
def search_all(
    mesh: FlatMesh, horizon: Horizon, segments: Segments, faces: IntArray, flat: ComplexArray, labels: IntArray,
    runs: IntArray, arcs: FloatArray, clear: float, limits: FloatArray, aims: FloatArray, windows: int,
) -> tuple[FloatArray, FloatArray, IntArray, FloatArray, int]:  # fmt: skip
    """Search from every point; return distances, lower bounds, segments, shares of them and the windows it took."""
    distances, bounds = np.full(faces.size, inf), np.zeros(faces.size)
    found, shares = np.full(faces.size, -1), np.zeros(faces.size)
    spent = 0
    for k in range(faces.size):
        if spent >= windows:
            break
        aimed = aims.shape[0] > 0
        x, y, z = (aims[k, 0], aims[k, 1], aims[k, 2]) if aimed else (0.0, 0.0, 0.0)
        goal = Goal(labels[k], runs[k], arcs[k], clear, aimed, x, y, z)
        bounds[k] = search(mesh, horizon, segments, goal, k, faces[k], flat[k], limits[k])
        found[k], shares[k] = horizon.found[0], horizon.best[1]
        spent += horizon.counts[0]
        if found[k] >= 0:
            distances[k] = horizon.best[0]
    return distances, bounds, found, shares, spent
