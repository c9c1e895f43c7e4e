"""Streamlines of a field of lines, straight in each triangle, ended before they crowd what is deposited."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np

from geoprint.fibers.net import ComplexArray, LineNet, rim_sides
from geoprint.kernels import inner, njit
from geoprint.model import FloatArray, IntArray

# How near deposited segments are to a place, over the surface: triangles are unfolded about it, as far as it sees them.
#
# A straight line from the place through the sides of unfolded triangles is a shortest way unless it bends about a
# vertex with more than a full turn around it; behind those lies a wedge, as narrow as the vertex bends, that nothing
# is seen in.


# Windows that may wait at once: each triangle that is passed outwards leaves at most one behind.
WAITING = 4096
# What is asked for as `own` where every stroke counts.
NOBODY = -1


class DepositedSegments(NamedTuple):
    """Straight segments in faces, listed face by face; arrays are longer than what is filled.

    Attributes:
        head: (m,) the segment of each face that was deposited last, -1 for none.
        before: (s,) the one that was deposited in the same face before each, -1 for none.
        faces: (s,) in which each lies.
        starts: (s,) in the plane of that [mm].
        ends: (s,) [mm].
        paths: (s,) to which each belongs.
        arcs: (s,) arc length of the stroke at its start, counted from where the stroke was begun [mm].
        filled: (1,) how many are.
    """

    head: IntArray
    before: IntArray
    faces: IntArray
    starts: ComplexArray
    ends: ComplexArray
    paths: IntArray
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


def no_segments(faces: int, *, room: int) -> DepositedSegments:
    """Return room for segments in so many faces."""
    return DepositedSegments(
        head=np.full(faces, -1),
        before=np.full(room, -1),
        faces=np.full(room, -1),
        starts=np.zeros(room, dtype=np.complex128),
        ends=np.zeros(room, dtype=np.complex128),
        paths=np.full(room, -1),
        arcs=np.zeros(room),
        filled=np.zeros(1, dtype=np.int64),
    )


def rim_segments(net: LineNet) -> DepositedSegments:
    """Return the rim of a surface as segments of one stroke, 0."""
    halves, starts, ends = rim_sides(net)
    rim = no_segments(len(net.corners), room=halves.size)
    rim.faces[:], rim.starts[:], rim.ends[:], rim.paths[:] = halves // 3, starts, ends, 0
    for row, face in enumerate(rim.faces.tolist()):
        rim.before[row], rim.head[face] = rim.head[face], row
    rim.filled[0] = halves.size
    return rim


def with_room(segments: DepositedSegments, *, room: int) -> DepositedSegments:
    """Return the same segments with room for so many more."""
    more = no_segments(segments.head.size, room=room)
    return DepositedSegments(
        head=segments.head,
        before=np.concatenate([segments.before, more.before]),
        faces=np.concatenate([segments.faces, more.faces]),
        starts=np.concatenate([segments.starts, more.starts]),
        ends=np.concatenate([segments.ends, more.ends]),
        paths=np.concatenate([segments.paths, more.paths]),
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
    deposited: DepositedSegments,
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
    best, which, vector = _in_face(deposited, face, place, place, place, 1 + 0j, best, which, vector, own, arc, clear)
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
            deposited, here, source, right, left, turned, best, which, vector, own, arc, clear
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
    deposited: DepositedSegments, face: int, source: complex, right: complex, left: complex, turned: complex,
    best: float,
    which: int, vector: complex, own: int, arc: float, clear: float,
) -> tuple[float, int, complex]:  # fmt: skip
    """Return the nearest so far, and now of the segments in a face as they are seen between two bounds.

    Everything is seen where both bounds are the place itself.
    """
    segment: int = deposited.head[face]
    while segment >= 0:
        if deposited.paths[segment] != own or abs(deposited.arcs[segment] - arc) > clear:
            start: complex = deposited.starts[segment]
            along: complex = deposited.ends[segment] - start
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
        segment = deposited.before[segment]
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
    net: LineNet, deposited: DepositedSegments, room: Windows, faces: IntArray, places: ComplexArray, limits: FloatArray
) -> FloatArray:
    """Return (k,) how far the nearest segment is from (k,) places in faces [mm]; infinite beyond (k,) limits.

    Most have one near by: what is looked through first is a ninth of the area, and only where that is empty all of it.
    """
    found = np.empty(faces.size)
    for row in range(faces.size):
        found[row] = nearest(net, deposited, room, faces[row], places[row], limits[row] / 3.0, NOBODY, 0.0, 0.0)[0]
        if found[row] == inf:
            found[row] = nearest(net, deposited, room, faces[row], places[row], limits[row], NOBODY, 0.0, 0.0)[0]
    return found


# Streamlines of a field of lines, straight in each triangle, ended before they crowd what is deposited.
#
# Where the lines of two neighbouring faces both lead to the side between them, a streamline follows that side to its
# end. A streamline that comes back beside its own beginning is told from one that crowds another.


# Why a streamline ended: at the rim, at a singularity, near another, back at its beginning, where lines lead nowhere,
# or for want of room.
RIM, SINGULAR, CROWDED, RETURNED, STUCK, FULL = range(6)
# Where a line leads out of a face by less than this share of its length it runs along the side.
ALONG_SIDE = 1e-9
# A side is crossed no nearer to its ends than this share of it: beyond a vertex everything is decided by rounding.
FROM_VERTEX = 1e-6
# What leads to the beginning points ahead by no more than this share of it where a streamline is abreast of that.
ABREAST = 0.2
# So many steps in a row that are shorter than this [mm] lead nowhere: around one vertex.
TINY_STEP, MOST_TINY = 1e-5, 40


class Rules(NamedTuple):
    """When a streamline ends: lengths over the spacing that is wanted where it is.

    Attributes:
        step: it is looked at no farther apart than this.
        apart: it ends nearer than this to another; 0 lets it pass.
        itself: and nearer than this to itself.
        clear: only farther than this along it.
        beside: with its beginning no farther aside than this it came back and crowds nothing.
        lean: unit number that the field is turned by.
    """

    step: float
    apart: float
    itself: float
    clear: float
    beside: float
    lean: complex


@inner
def side_ahead(net: LineNet, face: int, place: complex, ahead: complex, entered: int) -> tuple[int, float]:
    """Return over which side a straight line leaves a face, -1 for none, and after how far [mm]."""
    side, reach = -1, inf
    for other in range(3):
        if other == entered:
            continue
        start = net.corners[face, other]
        along = net.corners[face, (other + 1) % 3] - start
        outwards = -1j * along / abs(along)
        speed = (ahead * outwards.conjugate()).real
        if speed > ALONG_SIDE:
            away = max(((start - place) * outwards.conjugate()).real / speed, 0.0)
            if away < reach:
                side, reach = other, away
    return side, reach


@inner
def on_side(net: LineNet, face: int, side: int, place: complex) -> complex:
    """Return the place on a side that is nearest to one, but for its ends."""
    start = net.corners[face, side]
    along = net.corners[face, (side + 1) % 3] - start
    share = ((place - start) * along.conjugate()).real / abs(along) ** 2
    return start + min(max(share, FROM_VERTEX), 1.0 - FROM_VERTEX) * along


@njit
def straight(net: LineNet, face: int, place: complex, ahead: complex, length: float) -> tuple[int, complex, float]:
    """Return where a straight line over the surface ends: its face, the place there, and how far it came [mm]."""
    entered, gone = -1, 0.0
    while True:
        side, reach = side_ahead(net, face, place, ahead, entered)
        if side < 0 or gone + reach >= length:
            return face, place + (length - gone) * ahead, length
        gone += reach
        place = on_side(net, face, side, place + reach * ahead)
        half = 3 * face + side
        beyond: int = net.twins[half]
        if beyond < 0:
            return face, place, gone
        place, ahead = net.turns[half] * place + net.shifts[half], net.turns[half] * ahead
        face, entered = beyond // 3, beyond % 3


@njit
def deposit(deposited: DepositedSegments, face: int, start: complex, end: complex, stroke: int, arc: float) -> None:
    """Add a segment."""
    at = deposited.filled[0]
    deposited.before[at], deposited.head[face] = deposited.head[face], at
    deposited.faces[at], deposited.starts[at], deposited.ends[at] = face, start, end
    deposited.paths[at], deposited.arcs[at] = stroke, arc
    deposited.filled[0] = at + 1


@njit
def deposit_straight(
    net: LineNet,
    deposited: DepositedSegments,
    face: int,
    place: complex,
    ahead: complex,
    length: float,
    stroke: int,
    arc: float,
) -> bool:
    """Deposit a straight line of some length [mm] over the surface; say whether there was room for it."""
    entered = -1
    while deposited.filled[0] < deposited.before.size:
        side, reach = side_ahead(net, face, place, ahead, entered)
        beyond: int = -1 if side < 0 else net.twins[3 * face + side]
        if reach >= length or beyond < 0:
            deposit(deposited, face, place, place + min(reach, length) * ahead, stroke, arc)
            return True
        onward = on_side(net, face, side, place + reach * ahead)
        deposit(deposited, face, place, onward, stroke, arc)
        arc, length, half = arc + reach, length - reach, 3 * face + side
        place, ahead = net.turns[half] * onward + net.shifts[half], net.turns[half] * ahead
        face, entered = beyond // 3, beyond % 3
    return False


@njit
def take_back(deposited: DepositedSegments, count: int) -> None:
    """Take back what was deposited last, up to so many segments."""
    while deposited.filled[0] > count:
        at = deposited.filled[0] - 1
        deposited.head[deposited.faces[at]] = deposited.before[at]
        deposited.filled[0] = at


@inner
def _direction(net: LineNet, face: int, sign: float, lean: complex, entered: int) -> complex:
    """Return where a streamline goes in a face: along its line, or along the side where it was entered."""
    ahead = sign * net.lines[face] * lean
    if entered < 0:
        return ahead
    along = net.corners[face, (entered + 1) % 3] - net.corners[face, entered]
    along /= abs(along)
    if (ahead * (1j * along).conjugate()).real > ALONG_SIDE:
        return ahead
    return along if (ahead * along.conjugate()).real >= 0.0 else -along


@inner
def _seen(
    net: LineNet, deposited: DepositedSegments, room: Windows, rules: Rules, face: int, place: complex, ahead: complex,
    stroke: int, arc: float,
) -> tuple[int, bool, float]:  # fmt: skip
    """Return why a streamline ends at a place, -1 for not at all, whether it nears its beginning, and how far aside."""
    spacing = net.spacings[face]
    if rules.apart > 0.0:
        _, found, _ = nearest(net, deposited, room, face, place, rules.apart * spacing, stroke, arc, inf)
        if found >= 0:
            return CROWDED, False, 0.0
    clear = rules.clear * spacing
    away, found, vector = nearest(net, deposited, room, face, place, rules.itself * spacing, stroke, arc, clear)
    if found < 0 or deposited.paths[found] != stroke:
        return -1, False, 0.0
    aside = (vector * ahead.conjugate()).imag
    if arc < 0.0 or deposited.arcs[found] > clear or abs(aside) > rules.beside * spacing:
        return CROWDED, False, 0.0
    # Abreast of the beginning it lies square to the line.
    if (vector * ahead.conjugate()).real <= ABREAST * away:
        return RETURNED, True, aside
    return -1, True, 0.0


@njit
def streamline(
    net: LineNet, deposited: DepositedSegments, room: Windows, rules: Rules, face: int, place: complex, sign: float,
    stroke: int,
) -> tuple[int, float, float]:  # fmt: skip
    """Deposit a streamline from a place on, in one sense of the line there.

    It begins at a place in the plane of a face, along the line there (sign 1) or against it (-1), and is added to what
    was laid, with arc lengths from there on that fall where the sign is -1.

    Returns:
        Why it ended; its length [mm]; and where it came back, how far its beginning lies to its left [mm].
    """
    entered, gone, tiny, sense = -1, 0.0, 0, sign
    # Triangles may be far smaller than steps: it looks about once a step, but at each side where it comes back.
    looked, back = 0.0, False
    while True:
        if net.singular[face]:
            return SINGULAR, gone, 0.0
        if deposited.filled[0] + 1 >= deposited.before.size:
            return FULL, gone, 0.0
        ahead = _direction(net, face, sign, rules.lean, entered)
        side, reach = side_ahead(net, face, place, ahead, entered)
        tiny = tiny + 1 if reach < TINY_STEP else 0
        if side < 0 or tiny > MOST_TINY:
            return STUCK, gone, 0.0
        step = rules.step * net.spacings[face]
        crossing = reach <= step
        reach = min(reach, step)
        onward = on_side(net, face, side, place + reach * ahead) if crossing else place + reach * ahead
        arc = sense * (gone + reach)
        if back or gone + reach - looked >= step:
            looked = gone + reach
            found, back, aside = _seen(net, deposited, room, rules, face, onward, ahead, stroke, arc)
            if found == RETURNED:
                deposit(deposited, face, place, onward, stroke, arc - sense * reach)
                return RETURNED, gone + reach, aside
            if found == CROWDED:
                return CROWDED, gone, 0.0
        deposit(deposited, face, place, onward, stroke, arc - sense * reach)
        gone += reach
        if not crossing:
            place = onward
            continue
        half = 3 * face + side
        beyond: int = net.twins[half]
        if beyond < 0:
            return RIM, gone, 0.0
        place, sign = net.turns[half] * onward + net.shifts[half], sign * net.signs[half]
        face, entered = beyond // 3, beyond % 3
