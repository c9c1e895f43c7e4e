"""Exact shortest distance over a surface from points to curves, and shortest lines between vertices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import inf
from typing import NamedTuple, final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from geoprint.errors import FieldError
from geoprint.geometry import SurfaceLine, half_edges, in_words, part_of
from geoprint.geometry.clipping import NEAR_SHARE
from geoprint.geometry.topology import used_vertices
from geoprint.kernels import inner, njit
from geoprint.metrics.oracle.tracing import SurfacePath, steps_back, unwind
from geoprint.metrics.oracle.unfolding import (
    ANY,
    ComplexArray,
    FlatMesh,
    Goal,
    Horizon,
    Places,
    Segments,
    counts_for,
    empty_horizon,
    flat_mesh,
    search,
    spatial,
)
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, frozen
from geoprint.threads import each_of

# Shortest distance over a surface from points to curves: exact, or between bounds that are reported.


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
        self._middles = path.middles(mesh)[order]

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

    def narrowed(self, places: Places, ask: Ask) -> Ask:
        """Return the same question with a limit of 0 where nothing that counts lies within the limit in space.

        A way over the surface is no shorter than the straight line, so that the answer is the same without a search.

        Args:
            places: k of them on the mesh.
            ask: with (k,) finite limits, as `Ask.anything` and `Ask.elsewhere`.
        """
        halves = 0.5 * self._lengths
        # Cells as wide as what is looked for is away at most lie in columns along z, the segments sorted by their cell.
        width = float(ask.limits.max(initial=0.0)) * (1.0 + ROUNDING) + float(halves.max()) + ROUNDING
        low = self._middles.min(axis=0) - width
        cells = np.floor((self._middles - low) / width).astype(np.int64)
        counts = cells.max(axis=0) + 2
        numbers = (cells[:, 0] * counts[1] + cells[:, 1]) * counts[2] + cells[:, 2]
        order = np.argsort(numbers, kind="stable")
        grid = _Grid(numbers[order], counts, order, self._middles[order], halves[order])
        points = spatial(self._mesh, places)
        near = any_within(
            grid, self._segments, points, np.floor((points - low) / width).astype(np.int64),
            ask.labels, ask.runs, ask.arcs, ask.clear, ask.limits,
        )  # fmt: skip
        return replace(ask, limits=np.where(near, ask.limits, 0.0))


class _Grid(NamedTuple):
    """Segments sorted by the cells of a grid in space that their middles lie in.

    Attributes:
        numbers: (p,) number of the cell of each, rising: by x, then y, then z.
        counts: (3,) of the cells.
        order: (p,) which segment each is.
        middles: (p, 3) [mm].
        halves: (p,) of their lengths [mm].
    """

    numbers: IntArray
    counts: IntArray
    order: IntArray
    middles: FloatArray
    halves: FloatArray


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


@njit
def any_within(
    grid: _Grid, segments: Segments, points: FloatArray, cells: IntArray, labels: IntArray, runs: IntArray,
    arcs: FloatArray, clear: float, limits: FloatArray,
) -> BoolArray:  # fmt: skip
    """Return for each of k points in (k, 3) cells whether a segment that counts lies within its limit in space."""
    near = np.zeros(limits.size, np.bool_)
    for k in range(limits.size):
        if limits[k] > 0.0:
            goal = Goal(labels[k], runs[k], arcs[k], clear, False, points[k, 0], points[k, 1], points[k, 2])
            near[k] = _reached(grid, segments, goal, cells[k, 0], cells[k, 1], cells[k, 2], limits[k])
    return near


@inner
def _reached(grid: _Grid, segments: Segments, goal: Goal, x: int, y: int, z: int, limit: float) -> bool:
    """Return whether a segment that counts lies within a limit of the place of a goal, which lies in a cell."""
    # Where it lies itself first.
    for i in (x, x - 1, x + 1):
        for j in (y, y - 1, y + 1):
            if not (0 <= i < grid.counts[0] and 0 <= j < grid.counts[1]):
                continue
            column = (i * grid.counts[1] + j) * grid.counts[2]
            last = column + min(z + 1, grid.counts[2] - 1)
            first = np.searchsorted(grid.numbers, np.int64(column + max(z - 1, 0)))
            for at in range(int(first), grid.numbers.size):
                if grid.numbers[at] > last:
                    break
                reach = limit * (1.0 + ROUNDING) + grid.halves[at] + ROUNDING
                across, along = grid.middles[at, 0] - goal.x, grid.middles[at, 1] - goal.y
                up = grid.middles[at, 2] - goal.z
                near = across * across + along * along + up * up <= reach * reach
                if near and counts_for(segments, goal, grid.order[at]):
                    return True
    return False


# The shortest line over the triangles from one vertex of a surface to another: exact.


# Windows of the search: 60 mm on scans of hearts (1.5 mm edges) take 100,000.
WINDOWS = 500_000
# The way along edges bounds the shortest one; it may be the shortest, up to rounding.
ROUNDING = 1e-9


def shortest_way(surface: Surface, first: int, last: int) -> SurfaceLine:
    """Return the shortest line over a surface between two of its vertices.

    The shortest way along edges bounds its length. What no line of that length can reach (an ellipsoid about both
    ends) is left out, and in the rest the triangles are unfolded from the first vertex (`unfolding`).
    Where the line passes an edge within NEAR_SHARE of a vertex, it goes through the vertex.

    Args:
        surface: manifold.
        first: vertex.
        last: another one.

    Raises:
        FieldError: the vertices are not connected, or so many triangles apart that the search does not end.
    """
    bound = _along_edges(surface, first, last)
    if not np.isfinite(bound):
        raise FieldError(
            f"{surface.name}: {_ends(surface, first, last)} lie on pieces of the surface that do not hang together."
        )
    kept = _within_reach(surface, first, last, bound=bound * (1.0 + ROUNDING))
    used = used_vertices(surface.faces[kept])
    part = part_of(surface, kept)
    here, there = np.searchsorted(used, [first, last]).tolist()
    mesh = flat_mesh(part)
    horizon, start = _searched(mesh, here, there, limit=bound * (1.0 + ROUNDING))
    if horizon is None:
        raise FieldError(
            f"{surface.name}: {_ends(surface, first, last)} are too many triangles apart for an exact shortest path, "
            f"which is up to {bound:.3g} mm long. Add a point between them, on the side that is meant.",
            longest=bound,
            windows=WINDOWS,
        )
    faces, ends = _unwound(mesh, horizon, start)
    edges, shares = _crossings(mesh, faces[:-1], ends[:-1])
    inner = used[mesh.starts.reshape(-1, 3)[faces[:-1, None], edges]]
    chain = np.vstack([[first, first], inner, [last, last]])
    return _without_spurs(chain, np.concatenate([[0.0], shares, [0.0]]), length=float(horizon.best[0]))


def _along_edges(surface: Surface, first: int, last: int) -> float:
    """Return the length of the shortest way along edges [mm]; infinity where there is none."""
    starts, ends = half_edges(surface.faces).T
    lengths = np.linalg.norm(surface.vertices[ends] - surface.vertices[starts], axis=1)
    count = len(surface.vertices)
    graph = coo_array((lengths, (starts, ends)), shape=(count, count)).tocsr()
    return float(dijkstra(graph, directed=False, indices=np.array([first]))[0, last])


def _within_reach(surface: Surface, first: int, last: int, *, bound: float) -> BoolArray:
    """Return (m,) which faces may lie on a line of a length between two vertices."""
    corners = surface.vertices[surface.faces]
    middles = corners.mean(axis=1)
    sizes = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    ways = sum(np.linalg.norm(middles - surface.vertices[end], axis=1) for end in (first, last))
    return np.asarray(ways <= bound + 2.0 * sizes)


def _searched(mesh: FlatMesh, first: int, last: int, *, limit: float) -> tuple[Horizon | None, tuple[int, complex]]:
    """Search from a vertex for another; None where the search did not end; and face and place of the start."""
    # The goal is a corner of each face around it, since lines end there from all sides.
    goals = np.flatnonzero(mesh.starts == last)
    begin = int(np.flatnonzero(mesh.starts == first)[0])
    count = int(goals.size)
    segments = Segments(
        first=np.searchsorted(goals // 3, np.arange(int(mesh.origins.shape[0]) + 1)),
        starts=mesh.corners[goals],
        along=np.zeros(count, dtype=np.complex128),
        labels=np.zeros(count, dtype=np.int64),
        runs=np.full(count, -1),
        arcs=np.zeros(count),
        loops=np.full(count, inf),
    )
    horizon = empty_horizon(mesh, windows=WINDOWS)
    goal = Goal(0, -2, 0.0, 0.0, False, 0.0, 0.0, 0.0)
    start = begin // 3, complex(mesh.corners[begin])
    reached = search(mesh, horizon, segments, goal, 0, *start, limit)
    ended = horizon.found[0] >= 0 and reached >= horizon.best[0]
    return (horizon if ended else None), start


def _unwound(mesh: FlatMesh, horizon: Horizon, start: tuple[int, complex]) -> tuple[IntArray, ComplexArray]:
    """Return face and end of each segment of the way that a search found, in its face's plane, from the start on."""
    count = steps_back(horizon)
    faces = np.empty(count, dtype=np.int64)
    starts, ends = np.empty(count, dtype=np.complex128), np.empty(count, dtype=np.complex128)
    # Where the way ends is a corner and needs no unwinding; the end of the last segment is not read.
    unwind(mesh, horizon, *start, 0j, faces, starts, ends)
    return faces[::-1], ends[::-1]


def _crossings(mesh: FlatMesh, faces: IntArray, ends: ComplexArray) -> tuple[IntArray, FloatArray]:
    """Return the (c, 2) corners of faces between which segments end, and the (c,) shares of the way between them."""
    flat = mesh.corners.reshape(-1, 3)[faces]
    third = ends.imag / flat[:, 2].imag
    second = (ends.real - third * flat[:, 2].real) / flat[:, 1].real
    weights = np.column_stack([1.0 - second - third, second, third])
    # The edge opposite to the corner that has no weight.
    edges: IntArray = np.array([[1, 2], [2, 0], [0, 1]])[np.argmin(weights, axis=1)]
    pair = np.take_along_axis(weights, edges, axis=1)
    shares = pair[:, 1] / pair.sum(axis=1)
    edges = np.where((shares < NEAR_SHARE)[:, None], edges[:, :1], edges)
    edges = np.where((shares > 1.0 - NEAR_SHARE)[:, None], edges[:, 1:], edges)
    return edges, np.where(edges[:, 0] == edges[:, 1], 0.0, shares)


def _without_spurs(chain: IntArray, shares: FloatArray, *, length: float) -> SurfaceLine:
    """Leave out what lies between two passages through the same vertex: a line beside it that rounding made."""
    last = {edge[0]: index for index, edge in enumerate(chain.tolist()) if edge[0] == edge[1]}
    kept: list[int] = []
    index = 0
    while index < len(chain):
        kept.append(index)
        first, second = chain[index].tolist()
        index = 1 + (last[first] if first == second else index)
    return SurfaceLine(chain[kept], shares[kept], length)


def _ends(surface: Surface, first: int, last: int) -> str:
    return f"{in_words(surface.vertices[first])} and {in_words(surface.vertices[last])}"
