"""Streamlines of a field of lines, straight in each triangle, ended before they crowd what is laid.

Where the lines of two neighbouring faces both lead to the side between them, a streamline follows that side to its
end. A streamline that comes back beside its own beginning is told from one that crowds another.
"""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from geoprint.kernels import inner, njit
from geoprint.patterns.fibres.nearest import LaidSegments, Windows, nearest
from geoprint.patterns.fibres.net import LineNet

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
def lay(laid: LaidSegments, face: int, start: complex, end: complex, stroke: int, arc: float) -> None:
    """Add a segment."""
    at = laid.filled[0]
    laid.before[at], laid.head[face] = laid.head[face], at
    laid.faces[at], laid.starts[at], laid.ends[at] = face, start, end
    laid.strokes[at], laid.arcs[at] = stroke, arc
    laid.filled[0] = at + 1


@njit
def lay_straight(
    net: LineNet, laid: LaidSegments, face: int, place: complex, ahead: complex, length: float, stroke: int, arc: float
) -> bool:
    """Lay a straight line of some length [mm] over the surface; say whether there was room for it."""
    entered = -1
    while laid.filled[0] < laid.before.size:
        side, reach = side_ahead(net, face, place, ahead, entered)
        beyond: int = -1 if side < 0 else net.twins[3 * face + side]
        if reach >= length or beyond < 0:
            lay(laid, face, place, place + min(reach, length) * ahead, stroke, arc)
            return True
        onward = on_side(net, face, side, place + reach * ahead)
        lay(laid, face, place, onward, stroke, arc)
        arc, length, half = arc + reach, length - reach, 3 * face + side
        place, ahead = net.turns[half] * onward + net.shifts[half], net.turns[half] * ahead
        face, entered = beyond // 3, beyond % 3
    return False


@njit
def take_back(laid: LaidSegments, count: int) -> None:
    """Take back what was laid last, up to so many segments."""
    while laid.filled[0] > count:
        at = laid.filled[0] - 1
        laid.head[laid.faces[at]] = laid.before[at]
        laid.filled[0] = at


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
    net: LineNet, laid: LaidSegments, room: Windows, rules: Rules, face: int, place: complex, ahead: complex,
    stroke: int, arc: float,
) -> tuple[int, bool, float]:  # fmt: skip
    """Return why a streamline ends at a place, -1 for not at all, whether it nears its beginning, and how far aside."""
    spacing = net.spacings[face]
    if rules.apart > 0.0:
        _, found, _ = nearest(net, laid, room, face, place, rules.apart * spacing, stroke, arc, inf)
        if found >= 0:
            return CROWDED, False, 0.0
    clear = rules.clear * spacing
    away, found, vector = nearest(net, laid, room, face, place, rules.itself * spacing, stroke, arc, clear)
    if found < 0 or laid.strokes[found] != stroke:
        return -1, False, 0.0
    aside = (vector * ahead.conjugate()).imag
    if arc < 0.0 or laid.arcs[found] > clear or abs(aside) > rules.beside * spacing:
        return CROWDED, False, 0.0
    # Abreast of the beginning it lies square to the line.
    if (vector * ahead.conjugate()).real <= ABREAST * away:
        return RETURNED, True, aside
    return -1, True, 0.0


@njit
def streamline(
    net: LineNet, laid: LaidSegments, room: Windows, rules: Rules, face: int, place: complex, sign: float, stroke: int
) -> tuple[int, float, float]:
    """Lay a streamline from a place on, in one sense of the line there.

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
        if laid.filled[0] + 1 >= laid.before.size:
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
            found, back, aside = _seen(net, laid, room, rules, face, onward, ahead, stroke, arc)
            if found == RETURNED:
                lay(laid, face, place, onward, stroke, arc - sense * reach)
                return RETURNED, gone + reach, aside
            if found == CROWDED:
                return CROWDED, gone, 0.0
        lay(laid, face, place, onward, stroke, arc - sense * reach)
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
