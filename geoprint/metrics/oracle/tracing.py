"""The deposited path laid onto the triangles: between neighbouring poses the shortest way over the surface."""

from __future__ import annotations

from math import inf
from typing import final

import numpy as np

from geoprint.errors import FieldError
from geoprint.geometry.halfedges import next_half
from geoprint.kernels import inner, njit, uncounted
from geoprint.metrics.oracle.unfolding import (
    ComplexArray,
    FlatMesh,
    Goal,
    Horizon,
    Places,
    Segments,
    cross,
    empty_horizon,
    search,
    spatial,
)
from geoprint.model import BoolArray, FloatArray, IntArray, frozen

# Windows that one connection may take: neighbouring poses are a fraction of a spacing apart, which is a few triangles.
WINDOWS = 50_000
# A line at a smaller angle [rad] to an edge runs along it; where it crosses would be rounding alone.
ALONG_EDGE = 1e-9
# Segments shorter than this [mm] are rounding.
SHORTEST_SEGMENT = 1e-12


@final
@frozen
class SurfacePath:
    """Runs on a mesh as straight segments, each in one face, end to end.

    Attributes:
        faces: (p,) face of each segment.
        starts: (p,) where it starts in the plane of its face [mm].
        ends: (p,) where it ends [mm].
        runs: (p,) run of each segment, not falling.
        arcs: (p,) arc length from the start of the run to the start of the segment [mm].
        lengths: (r,) length of each run [mm].
        levels: (r,) level of each run.
        closed: (r,) whether a run ends where it starts.
    """

    faces: IntArray
    starts: ComplexArray
    ends: ComplexArray
    runs: IntArray
    arcs: FloatArray
    lengths: FloatArray
    levels: IntArray
    closed: BoolArray

    def at(self, runs: IntArray, arcs: FloatArray) -> Places:
        """Return the places at (k,) arc lengths of (k,) runs [mm]."""
        before = np.concatenate([[0.0], np.cumsum(self.lengths)])
        total = before[runs] + np.clip(arcs, 0.0, self.lengths[runs])
        segment = np.searchsorted(before[self.runs] + self.arcs, total, side="right") - 1
        # Where one run ends another starts: rounding must not lead from one into the other.
        first = np.searchsorted(self.runs, runs, side="left")
        last = np.searchsorted(self.runs, runs, side="right") - 1
        segment = np.clip(segment, first, last)
        along = self.ends[segment] - self.starts[segment]
        share = np.clip((arcs - self.arcs[segment]) / np.abs(along), 0.0, 1.0)
        return Places(self.faces[segment], self.starts[segment] + share * along)

    def lines(self, mesh: FlatMesh) -> list[FloatArray]:
        """Return the (k, 3) corners of each run in space [mm]."""
        starts = spatial(mesh, Places(self.faces, self.starts))
        ends = spatial(mesh, Places(self.faces, self.ends))
        last = np.flatnonzero(np.diff(self.runs, append=-1))
        return [np.vstack([line, ends[i]]) for line, i in zip(np.split(starts, last[:-1] + 1), last, strict=True)]

    def middles(self, mesh: FlatMesh) -> FloatArray:
        """Return the (p, 3) middles of the segments in space [mm]."""
        return spatial(mesh, Places(self.faces, 0.5 * (self.starts + self.ends)))


def trace(mesh: FlatMesh, places: Places, *, runs: IntArray, levels: IntArray, closed: BoolArray) -> SurfacePath:
    """Connect the points of runs over the surface.

    Args:
        mesh: m triangles.
        places: (k,) points, run after run; consecutive ones near each other.
        runs: (k,) run of each, from 0, not falling; every run has two different points.
        levels: (r,) level of each run.
        closed: (r,) whether it is closed; then its last point is its first.

    Raises:
        FieldError: neighbouring points have no short connection on the surface.
    """
    first = np.flatnonzero(runs[1:] == runs[:-1])
    pairs, faces, starts, ends = _connected(mesh, places, first)
    lost = np.setdiff1d(first, pairs)
    if lost.size:
        raise FieldError(
            f"run {runs[lost[0]] + 1} of the path joins points that are not connected on the surface, so evenness "
            "cannot be measured: plan with another backend.",
            run=int(runs[lost[0]]),
        )
    # A connection is unwound from its end.
    forward = np.lexsort((-np.arange(pairs.size), pairs))
    forward = forward[np.abs(ends[forward] - starts[forward]) > SHORTEST_SEGMENT]
    faces, starts, ends, segment_runs = faces[forward], starts[forward], ends[forward], runs[pairs[forward]]
    lengths = np.abs(ends - starts)
    run_lengths = np.asarray(np.bincount(segment_runs, lengths, minlength=levels.size), dtype=np.float64)
    arcs = np.cumsum(lengths) - lengths - (np.cumsum(run_lengths) - run_lengths)[segment_runs]
    return SurfacePath(faces, starts, ends, segment_runs, np.maximum(arcs, 0.0), run_lengths, levels, closed)


def _connected(
    mesh: FlatMesh, places: Places, first: IntArray
) -> tuple[IntArray, IntArray, ComplexArray, ComplexArray]:
    """Return the segments of the ways from places `first` to the next ones: pair, face, start and end."""
    order = np.argsort(places.faces, kind="stable")
    points = Segments(
        first=np.searchsorted(places.faces[order], np.arange(int(mesh.origins.shape[0]) + 1)),
        starts=places.flat[order],
        along=np.zeros(order.size, dtype=np.complex128),
        labels=order,
        runs=np.full(order.size, -1),
        arcs=np.zeros(order.size),
        loops=np.full(order.size, np.inf),
    )
    horizon, aims = empty_horizon(mesh, windows=WINDOWS), spatial(mesh, places)
    room, count = 4 * int(first.size), -1
    while True:
        pairs, faces = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64)
        starts, ends = np.empty(room, dtype=np.complex128), np.empty(room, dtype=np.complex128)
        count = connect(mesh, horizon, points, places.faces, places.flat, aims, first, pairs, faces, starts, ends)
        if count >= 0:
            return pairs[:count], faces[:count], starts[:count], ends[:count]
        room *= 2
        # Searches are distinguished by their numbers.
        horizon.visited[:] = -1


@njit
def connect(
    mesh: FlatMesh, horizon: Horizon, points: Segments, faces: IntArray, flat: ComplexArray, aims: FloatArray,
    first: IntArray, pairs: IntArray, where: IntArray, starts: ComplexArray, ends: ComplexArray,
) -> int:  # fmt: skip
    """Write the segments of the shortest ways from points `first` to the next ones: pair, face, start and end.

    Returns:
        How many segments there are, or -1 where there is no room for them.
    """
    count = 0
    for k in range(first.size):
        i = first[k]
        needed = 1
        if faces[i] != faces[i + 1]:
            goal = Goal(i + 1, -2, 0.0, 0.0, True, aims[i + 1, 0], aims[i + 1, 1], aims[i + 1, 2])
            search(mesh, horizon, points, goal, k, int(faces[i]), complex(flat[i]), inf)
            if horizon.found[0] < 0:
                continue
            needed = steps_back(horizon)
        if count + needed > pairs.size:
            return -1
        pairs[count : count + needed] = i
        if faces[i] == faces[i + 1]:
            where[count], starts[count], ends[count] = faces[i], flat[i], flat[i + 1]
        else:
            ways = where[count:], starts[count:], ends[count:]
            unwind(mesh, horizon, int(faces[i]), complex(flat[i]), complex(flat[i + 1]), ways[0], ways[1], ways[2])
        count += needed
    return count


@uncounted
def steps_back(horizon: Horizon) -> int:
    """Return how many segments the way to what was found has."""
    count, item = 1, horizon.found[1]
    while item >= 0:
        count, item = count + 1, horizon.parents[item]
    return count


@uncounted
def unwind(
    mesh: FlatMesh, horizon: Horizon, first_face: int, first: complex, last: complex, faces: IntArray,
    starts: ComplexArray, ends: ComplexArray,
) -> None:  # fmt: skip
    """Write the segments of the way to what was found, from its end back to its start.

    Args:
        mesh: m triangles.
        horizon: as the search left it.
        first_face: where the way starts.
        first: the start in the plane of that face [mm].
        last: the end in the plane of the face in which it was found [mm].
        faces: written: the face of each segment.
        starts: written: where the segment starts.
        ends: written: where it ends.
    """
    k, item, face, seen = 0, int(horizon.found[1]), int(horizon.found[2]), complex(horizon.seen[0])
    while item >= 0:
        half, start = int(horizon.halves[item]), complex(horizon.starts[item])
        faces[k], ends[k] = face, last
        if half >= 0:
            share = crossing(start, complex(horizon.ends[item]) - start, seen)
            starts[k] = on_half_edge(mesh, half, share)
            twin = int(mesh.twins[half])
            face, last = twin // 3, on_half_edge(mesh, twin, 1.0 - share)
        else:
            corner = -1 - half
            for i in range(3):
                if mesh.starts[3 * face + i] == mesh.starts[corner]:
                    starts[k] = mesh.corners[3 * face + i]
            face, last, seen = corner // 3, complex(mesh.corners[corner]), start
        k, item = k + 1, int(horizon.parents[item])
    faces[k], starts[k], ends[k] = first_face, first, last


@inner
def crossing(start: complex, along: complex, seen: complex) -> float:
    """Return the share of an edge at which the line from 0 to a place behind it crosses it."""
    slope = cross(seen, along)
    if abs(slope) > ALONG_EDGE * abs(seen) * abs(along):
        return min(max(-cross(seen, start) / slope, 0.0), 1.0)
    # The line runs along the edge: every point of it between both ends is a crossing.
    offset = seen - start
    squared = along.real**2 + along.imag**2
    return min(max((offset.real * along.real + offset.imag * along.imag) / squared, 0.0), 1.0)


@inner
def on_half_edge(mesh: FlatMesh, half: int, share: float) -> complex:
    """Return the place at a share of a half-edge, in the plane of its face."""
    start, end = complex(mesh.corners[half]), complex(mesh.corners[next_half(half)])
    return start + share * (end - start)
