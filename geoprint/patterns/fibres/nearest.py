"""How near laid segments are to a place, over the surface: triangles are unfolded about it, as far as it sees them.

A straight line from the place through the sides of unfolded triangles is a shortest way unless it bends about a vertex
with more than a full turn around it; behind those lies a wedge, as narrow as the vertex bends, that nothing is seen in.
"""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np

from geoprint.kernels import inner, njit
from geoprint.model import FloatArray, IntArray
from geoprint.patterns.fibres.net import ComplexArray, LineNet, rim_sides

# Windows that may wait at once: each triangle that is passed outwards leaves at most one behind.
WAITING = 4096
# What is asked for as `own` where every stroke counts.
NOBODY = -1


class LaidSegments(NamedTuple):
    """Straight segments in faces, listed face by face; arrays are longer than what is filled.

    Attributes:
        head: (m,) the segment of each face that was laid last, -1 for none.
        before: (s,) the one that was laid in the same face before each, -1 for none.
        faces: (s,) in which each lies.
        starts: (s,) in the plane of that [mm].
        ends: (s,) [mm].
        strokes: (s,) to which each belongs.
        arcs: (s,) arc length of the stroke at its start, counted from where the stroke was begun [mm].
        filled: (1,) how many are.
    """

    head: IntArray
    before: IntArray
    faces: IntArray
    starts: ComplexArray
    ends: ComplexArray
    strokes: IntArray
    arcs: FloatArray
    filled: IntArray


class Windows(NamedTuple):
    """Room for windows: through which half-edge what is seen from a place, in the plane behind that.

    Attributes:
        halves: (w,) the half-edge beyond, at which the window is entered.
        sources: (w,) the place.
        rights: (w,) a point on the line that bounds it on the right.
        lefts: (w,) and on the left.
        turned: (w,) unit numbers that turn vectors back into the plane of the place.
    """

    halves: IntArray
    sources: ComplexArray
    rights: ComplexArray
    lefts: ComplexArray
    turned: ComplexArray


def no_segments(faces: int, *, room: int) -> LaidSegments:
    """Return room for segments in so many faces."""
    return LaidSegments(
        head=np.full(faces, -1),
        before=np.full(room, -1),
        faces=np.full(room, -1),
        starts=np.zeros(room, dtype=np.complex128),
        ends=np.zeros(room, dtype=np.complex128),
        strokes=np.full(room, -1),
        arcs=np.zeros(room),
        filled=np.zeros(1, dtype=np.int64),
    )


def rim_segments(net: LineNet) -> LaidSegments:
    """Return the rim of a surface as segments of one stroke, 0."""
    halves, starts, ends = rim_sides(net)
    rim = no_segments(len(net.corners), room=halves.size)
    rim.faces[:], rim.starts[:], rim.ends[:], rim.strokes[:] = halves // 3, starts, ends, 0
    for row, face in enumerate(rim.faces.tolist()):
        rim.before[row], rim.head[face] = rim.head[face], row
    rim.filled[0] = halves.size
    return rim


def with_room(segments: LaidSegments, *, room: int) -> LaidSegments:
    """Return the same segments with room for so many more."""
    more = no_segments(segments.head.size, room=room)
    return LaidSegments(
        head=segments.head,
        before=np.concatenate([segments.before, more.before]),
        faces=np.concatenate([segments.faces, more.faces]),
        starts=np.concatenate([segments.starts, more.starts]),
        ends=np.concatenate([segments.ends, more.ends]),
        strokes=np.concatenate([segments.strokes, more.strokes]),
        arcs=np.concatenate([segments.arcs, more.arcs]),
        filled=segments.filled,
    )


def window_room() -> Windows:
    """Return room for windows, to be used again and again."""
    plane = [np.zeros(WAITING, dtype=np.complex128) for _ in range(4)]
    return Windows(np.zeros(WAITING, np.int64), *plane)


@njit
def nearest(
    net: LineNet,
    laid: LaidSegments,
    room: Windows,
    face: int,
    place: complex,
    limit: float,
    own: int,
    arc: float,
    clear: float,
) -> tuple[float, int, complex]:
    """Return how far the nearest segment is that is seen within a limit, which it is, and the vector to it.

    LaidSegments of the stroke `own` count only where their arc length is farther than `clear` from `arc`.

    Returns:
        Distance [mm], infinite for none; the segment, -1 for none; the vector in the plane of the place.
    """
    best, which, vector = limit, -1, 0j
    best, which, vector = _in_face(laid, face, place, place, place, 1 + 0j, best, which, vector, own, arc, clear)
    waiting = 0
    for side in range(3):
        waiting = _opened(net, room, waiting, 3 * face + side, place, net.corners[face, side],
                          net.corners[face, (side + 1) % 3], 1 + 0j, best)  # fmt: skip
    while waiting > 0:
        waiting -= 1
        half: int = room.halves[waiting]
        source: complex = room.sources[waiting]
        turned: complex = room.turned[waiting]
        right: complex = room.rights[waiting]
        left: complex = room.lefts[waiting]
        here, side = half // 3, half % 3
        if _apart(source, net.corners[here, side], net.corners[here, (side + 1) % 3]) >= best:
            continue
        best, which, vector = _in_face(
            laid, here, source, right, left, turned, best, which, vector, own, arc, clear
        )  # fmt: skip
        after, before = (side + 1) % 3, (side + 2) % 3
        tip: complex = net.corners[here, before]
        if _cross(right - source, tip - source) > 0.0:
            bound = left if _cross(left - source, tip - source) > 0.0 else tip
            waiting = _opened(net, room, waiting, 3 * here + after, source, right, bound, turned, best)
        if _cross(left - source, tip - source) < 0.0:
            bound = right if _cross(right - source, tip - source) < 0.0 else tip
            waiting = _opened(net, room, waiting, 3 * here + before, source, bound, left, turned, best)
    return (inf, -1, 0j) if which < 0 else (best, which, vector)


@inner
def _opened(
    net: LineNet, room: Windows, waiting: int, half: int, source: complex, right: complex, left: complex,
    turned: complex, best: float,
) -> int:  # fmt: skip
    """Add what is seen over a side between two bounds, if that is near; return how many windows wait."""
    face, side = half // 3, half % 3
    beyond: int = net.twins[half]
    if beyond < 0 or waiting >= WAITING:
        return waiting
    if _apart(source, net.corners[face, side], net.corners[face, (side + 1) % 3]) >= best:
        return waiting
    turn: complex = net.turns[half]
    shift: complex = net.shifts[half]
    room.halves[waiting] = beyond
    room.sources[waiting] = turn * source + shift
    room.rights[waiting] = turn * right + shift
    room.lefts[waiting] = turn * left + shift
    room.turned[waiting] = turned * turn.conjugate()
    return waiting + 1


@inner
def _in_face(
    laid: LaidSegments, face: int, source: complex, right: complex, left: complex, turned: complex, best: float,
    which: int, vector: complex, own: int, arc: float, clear: float,
) -> tuple[float, int, complex]:  # fmt: skip
    """Return the nearest so far, and now of the segments in a face as they are seen between two bounds.

    Everything is seen where both bounds are the place itself.
    """
    segment: int = laid.head[face]
    while segment >= 0:
        if laid.strokes[segment] != own or abs(laid.arcs[segment] - arc) > clear:
            start: complex = laid.starts[segment]
            along: complex = laid.ends[segment] - start
            low, high = 0.0, 1.0
            if right != left:
                low, high = _within(start - source, along, right - source, 1.0, low, high)
                low, high = _within(start - source, along, left - source, -1.0, low, high)
            if low <= high:
                square = abs(along) ** 2
                share = ((source - start) * along.conjugate()).real / square if square > 0.0 else 0.0
                foot = start + min(max(share, low), high) * along
                away = abs(foot - source)
                if away < best:
                    best, which, vector = away, segment, (foot - source) * turned
        segment = laid.before[segment]
    return best, which, vector


@inner
def _within(
    start: complex, along: complex, bound: complex, sense: float, low: float, high: float
) -> tuple[float, float]:
    """Return the shares of a segment between two that lie left of a line through 0 (sense 1), or right of it (-1)."""
    begun, rate = sense * _cross(bound, start), sense * _cross(bound, along)
    if rate == 0.0:
        return (low, high) if begun >= 0.0 else (1.0, 0.0)
    if rate > 0.0:
        return max(low, -begun / rate), high
    return low, min(high, -begun / rate)


@inner
def _apart(place: complex, start: complex, end: complex) -> float:
    """Return how far a place is from a segment [mm]."""
    along = end - start
    share = ((place - start) * along.conjugate()).real / (abs(along) ** 2)
    return abs(start + min(max(share, 0.0), 1.0) * along - place)


@inner
def _cross(first: complex, second: complex) -> float:
    return first.real * second.imag - first.imag * second.real


@njit
def gaps(
    net: LineNet, laid: LaidSegments, room: Windows, faces: IntArray, places: ComplexArray, limits: FloatArray
) -> FloatArray:
    """Return (k,) how far the nearest segment is from (k,) places in faces [mm]; infinite beyond (k,) limits.

    Most have one near by: what is looked through first is a ninth of the area, and only where that is empty all of it.
    """
    found = np.empty(faces.size)
    for row in range(faces.size):
        found[row] = nearest(net, laid, room, faces[row], places[row], limits[row] / 3.0, NOBODY, 0.0, 0.0)[0]
        if found[row] == inf:
            found[row] = nearest(net, laid, room, faces[row], places[row], limits[row], NOBODY, 0.0, 0.0)[0]
    return found
