"""The shortest line over the triangles from one vertex of a surface to another: exact."""

from __future__ import annotations

from math import inf

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from geoprint.errors import FieldError
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.quality.oracle.horizon import Goal, Horizon, Segments, empty_horizon
from geoprint.quality.oracle.tracing import steps_back, unwind
from geoprint.quality.oracle.triangles import ComplexArray, FlatMesh, flat_mesh
from geoprint.quality.oracle.unfolding import search
from geoprint.surfaces import SurfaceLine, half_edges, in_words, part_of
from geoprint.surfaces.inscribing import NEAR_SHARE
from geoprint.surfaces.topology import used_vertices

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
            f"{surface.name}: {_ends(surface, first, last)} are too many triangles apart to find the shortest way "
            f"between them, which is up to {bound:.3g} mm long; give another point between them, if both are on the "
            "side that is meant.",
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
    goal = Goal(0, -2, 0.0, 0.0, False, 0.0, 0.0, 0.0)  # noqa: FBT003  (numba takes them by place)
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
