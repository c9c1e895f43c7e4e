"""What lies nearest to a path on its left and on its right, over the surface: a search within a cone to that side.

The search is that of `unfolding`, begun not all around a place but within a cone about the direction square to the
path. A shortest way to the nearest stretch leaves the path squarely and stays on its side; where the nearest place in
the cone is none of that kind, it is told apart: at the cone's edge it is nearest only because the cone ends there, at
an open end of a run only because the run does; behind the path's own bend, or around a rim, it is no neighbour.
"""

from __future__ import annotations

from cmath import phase, rect
from math import inf, pi
from typing import final

import numpy as np

from geoprint.kernels import inner, njit
from geoprint.metrics.oracle.tracing import SurfacePath, steps_back, unwind
from geoprint.metrics.oracle.unfolding import (
    ANY,
    POINT,
    ComplexArray,
    FlatMesh,
    Goal,
    Horizon,
    Places,
    Segments,
    cross,
    empty_horizon,
    first_around,
    look,
    meet,
    see,
    spread,
)
from geoprint.model import BoolArray, FloatArray, IntArray, frozen

# Half of the cone's opening [rad].
HALF_CONE = pi / 3.0
# What is nearest within this [rad] of the cone's edge is nearest because the cone ends there.
EDGE_TOLERANCE = 1e-6
# A way that ends at an open end of a run at less than this cosine from square still ends squarely.
SQUARE_COSINE = 0.1
# Pieces of a way that are shorter than this [mm] have no direction.
SHORTEST_PIECE = 1e-9
# Where a way ends within this share of a segment's end, it ends at that.
END_SHARE = 1e-9
# A way starts from the path itself: nearer than this share of what counts as the same stretch it crosses none.
NEAR_SHARE = 0.01
# Windows of one search: a cone that is three spacings long takes some hundreds.
WINDOWS_PER_PLACE = 100_000
# Pieces of a way that are looked through; longer ones are not known.
MOST_PIECES = 4096
# What was found on a side: a neighbour, none within the limit, one that is none squarely, or the search did not end.
FOUND, NONE, OBLIQUE, UNKNOWN = 0, 1, 2, 3


@final
@frozen
class Stretches:
    """The segments of a path, by the stretch that they belong to: runs that touch end to end are one.

    Attributes:
        stretches: (p,) stretch of each segment of the path.
        arcs: (p,) arc length of its middle along the stretch [mm].
        loops: (p,) length of the stretch where it is closed, else infinity [mm].
        open_starts: (p,) whether an open stretch begins or ends where the segment starts.
        open_ends: (p,) whether one begins or ends where the segment ends.
    """

    stretches: IntArray
    arcs: FloatArray
    loops: FloatArray
    open_starts: BoolArray
    open_ends: BoolArray


@final
@frozen
class Neighbours:
    """What lies on both sides of k places of a path: the first column is the left, the second the right.

    Attributes:
        distances: (k, 2) to the nearest other stretch [mm]; infinite where there is none.
        kinds: (k, 2) FOUND, NONE, OBLIQUE or UNKNOWN.
        segments: (k, 2) segment of the path that is nearest, -1 for none.
    """

    distances: FloatArray
    kinds: IntArray
    segments: IntArray


def neighbours(
    mesh: FlatMesh, path: SurfacePath, stretches: Stretches, places: Places, *, ahead: ComplexArray,
    own: IntArray, arcs: FloatArray, clear: float, limit: float, windows: int,
) -> Neighbours:  # fmt: skip
    """Return the nearest other stretch on either side of places of a path.

    Args:
        mesh: m triangles, seen from outside: left is left there.
        path: p segments.
        stretches: to which they belong.
        places: (k,) on the path, but on no edge and no vertex.
        ahead: (k,) direction of the path there in the plane of the face.
        own: (k,) stretch that each place lies on.
        arcs: (k,) where along it [mm].
        clear: what is nearer along the same stretch does not count [mm].
        limit: how far to look [mm].
        windows: work that all searches may take; what is left over is unknown.
    """
    order = np.argsort(path.faces, kind="stable")
    segments = Segments(
        first=np.searchsorted(path.faces[order], np.arange(int(mesh.origins.shape[0]) + 1)),
        starts=path.starts[order],
        along=(path.ends - path.starts)[order],
        labels=np.zeros(order.size, dtype=np.int64),
        runs=stretches.stretches[order],
        arcs=stretches.arcs[order],
        loops=stretches.loops[order],
    )
    horizon = empty_horizon(mesh, windows=min(WINDOWS_PER_PLACE, windows))
    distances, kinds, found = search_sides(
        mesh, horizon, segments, stretches.open_starts[order], stretches.open_ends[order], places.faces, places.flat,
        ahead / np.abs(ahead), own, arcs, clear, limit, windows,
    )  # fmt: skip
    return Neighbours(distances, kinds, np.where(found < 0, -1, order[found]))


@njit
def search_sides(
    mesh: FlatMesh, horizon: Horizon, segments: Segments, open_starts: BoolArray, open_ends: BoolArray,
    faces: IntArray, flat: ComplexArray, ahead: ComplexArray, own: IntArray, arcs: FloatArray, clear: float,
    limit: float, windows: int,
) -> tuple[FloatArray, IntArray, IntArray]:  # fmt: skip
    """Search to both sides of every place; return (k, 2) distances, kinds and segments."""
    distances, kinds = np.full((faces.size, 2), inf), np.full((faces.size, 2), UNKNOWN)
    found = np.full((faces.size, 2), -1)
    way_faces = np.empty(MOST_PIECES, dtype=np.int64)
    starts, ends = np.empty(MOST_PIECES, dtype=np.complex128), np.empty(MOST_PIECES, dtype=np.complex128)
    spent = 0
    for k in range(faces.size):
        if spent >= windows:
            break
        goal = Goal(ANY, own[k], arcs[k], clear, False, 0.0, 0.0, 0.0)
        for side in range(2):
            middle = ahead[k] * (1j if side == 0 else -1j)
            face, place, number = int(faces[k]), complex(flat[k]), 2 * k + side
            horizon.counts[0], horizon.counts[1] = 0, 0
            horizon.found[0], horizon.found[1], horizon.found[2] = -1, -1, -1
            horizon.best[0], horizon.best[1] = limit, 0.0
            begin_aside(mesh, horizon, segments, goal, number, face, place, middle)
            bound = spread(mesh, horizon, segments, goal, number)
            spent += horizon.counts[0]
            if bound < horizon.best[0]:
                continue
            if horizon.found[0] < 0:
                kinds[k, side] = NONE
                continue
            found[k, side], distances[k, side] = horizon.found[0], horizon.best[0]
            kinds[k, side] = UNKNOWN
            if steps_back(horizon) <= MOST_PIECES:
                kinds[k, side] = kind_found(
                    mesh, horizon, segments, open_starts, open_ends, goal, face, place, middle, way_faces, starts, ends
                )
    return distances, kinds, found


@inner
def kind_found(
    mesh: FlatMesh, horizon: Horizon, segments: Segments, open_starts: BoolArray, open_ends: BoolArray, goal: Goal,
    face: int, place: complex, middle: complex, faces: IntArray, starts: ComplexArray, ends: ComplexArray,
) -> int:  # fmt: skip
    """Return what the segment that a search has found is; the last three arrays are room for the way to it."""
    if turns_at_rim(mesh, horizon):
        return NONE
    if abs(phase(first_turn(horizon) / middle)) > HALF_CONE - EDGE_TOLERANCE:
        return OBLIQUE
    segment = int(horizon.found[0])
    last = segments.starts[segment] + horizon.best[1] * segments.along[segment]
    unwind(mesh, horizon, face, place, complex(last), faces, starts, ends)
    share, count = horizon.best[1], steps_back(horizon)
    at_end = (open_starts[segment] and share <= END_SHARE) or (open_ends[segment] and share >= 1.0 - END_SHARE)
    if at_end and not ends_squarely(mesh, segments, segment, faces, starts, ends, count):
        return OBLIQUE
    return OBLIQUE if crosses_itself(segments, goal, faces, starts, ends, count) else FOUND


@inner
def begin_aside(
    mesh: FlatMesh, horizon: Horizon, segments: Segments, goal: Goal, number: int, face: int, place: complex,
    middle: complex,
) -> None:  # fmt: skip
    """Look within the cone in the face of the place, and through those of its edges that the cone meets."""
    half = 3 * face
    right, left = middle * rect(1.0, -HALF_CONE), middle * rect(1.0, HALF_CONE)
    see(horizon, segments, goal, face, -place, 1.0 + 0j, right, left, 0.0, POINT)
    for i in range(3):
        corner, end = mesh.corners[half + i] - place, mesh.corners[half + (i + 1) % 3] - place
        low = phase(corner / middle)
        width = phase(end / corner)
        for turn in range(2):
            start = low - 2.0 * pi * turn
            if max(start, -HALF_CONE) < min(start + width, HALF_CONE):
                from_right = corner if start > -HALF_CONE else right
                from_left = end if start + width < HALF_CONE else left
                look(mesh, horizon, goal, mesh.twins[half + i], end, corner, from_right, from_left, 0.0, POINT)
        if abs(low) < HALF_CONE:
            meet(mesh, horizon, goal, number, half + i, corner, end - corner, 0.0, POINT)


@inner
def first_turn(horizon: Horizon) -> complex:
    """Return the place that the way found leads to straight from the point: where it ends, or turns first."""
    place, item = complex(horizon.seen[0]), int(horizon.found[1])
    while item >= 0:
        if horizon.halves[item] < 0:
            place = complex(horizon.starts[item])
        item = int(horizon.parents[item])
    return place


@inner
def turns_at_rim(mesh: FlatMesh, horizon: Horizon) -> bool:
    """Return whether the way found turns around a vertex of the border: a rim lies between."""
    item = int(horizon.found[1])
    while item >= 0:
        half = int(horizon.halves[item])
        if half < 0 and mesh.twins[first_around(mesh, -1 - half)] < 0:
            return True
        item = int(horizon.parents[item])
    return False


@inner
def ends_squarely(
    mesh: FlatMesh, segments: Segments, segment: int, faces: IntArray, starts: ComplexArray, ends: ComplexArray,
    count: int,
) -> bool:  # fmt: skip
    """Return whether the way found meets its segment at about a right angle."""
    piece = 0
    # Through a vertex or along an edge the last pieces have no length.
    while piece < count - 1 and abs(ends[piece] - starts[piece]) < SHORTEST_PIECE:
        piece += 1
    way, along = ends[piece] - starts[piece], segments.along[segment]
    # The end of the path lies in the face of the last piece.
    here, there = mesh.axes[faces[piece]], mesh.axes[faces[0]]
    product = 0.0
    for x in range(3):
        one = way.real * here[0, x] + way.imag * here[1, x]
        product += one * (along.real * there[0, x] + along.imag * there[1, x])
    return abs(product) <= SQUARE_COSINE * abs(way) * abs(along)


@inner
def crosses_itself(
    segments: Segments, goal: Goal, faces: IntArray, starts: ComplexArray, ends: ComplexArray, count: int
) -> bool:
    """Return whether a way crosses its own stretch where that does not count as another: behind is no neighbour."""
    # Nearer to the place the way starts from the path itself.
    near = NEAR_SHARE * goal.clear
    gone = 0.0
    for piece in range(count - 1, -1, -1):
        start, along = starts[piece], ends[piece] - starts[piece]
        for k in range(segments.first[faces[piece]], segments.first[faces[piece] + 1]):
            apart = abs(segments.arcs[k] - goal.arc)
            if segments.runs[k] != goal.run or min(apart, segments.loops[k] - apart) > goal.clear:
                continue
            other, between = segments.along[k], segments.starts[k] - start
            slope = cross(along, other)
            if slope == 0.0:
                continue
            share, where = cross(between, other) / slope, cross(between, along) / slope
            # What is nearest just where its own stretch begins to count is nearest only because that begins there.
            meets = 0.0 <= share <= 1.0 + END_SHARE and -END_SHARE <= where <= 1.0 + END_SHARE
            if meets and gone + share * abs(along) > near:
                return True
        gone += abs(along)
    return False
