"""Rows joined to strokes: where a row ends, the stroke turns along the line of ends into the next row."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import FloatArray, IntArray, frozen
from geoprint.surfaces import arc_lengths, even_points

# A turn along the line of ends is no longer than this many spacings: beyond, lifting takes less time, and less of the
# next row is laid twice.
LONGEST_TURN = 4.0
# The line of ends is no farther from an end than this many spacings; other ends, such as those at the rim itself, stay.
AT_LINE = 0.05
# Corners between row and turn are rounded by this radius, as a share of the spacing: two make a half circle.
CORNER_SHARE = 0.5
# Cosine of the sharpest corner that is rounded so, and the least length [mm] that is divided by.
SHARPEST = -0.99
SHORTEST = 1e-12
# Steps of a turn, as a share of the spacing, and places of the arc that rounds a corner.
STEP_SHARE = 0.125
CORNER_PLACES = 9


class RowPart(NamedTuple):
    """A part of a row that is printed in one go.

    Attributes:
        places: (k, 3) [mm], from one end to the other.
        number: of the row.
        closed: whether it goes round and has no ends.
        strip: whether it stands for a row that would run outside of the line of ends, and lies on that.
    """

    places: FloatArray
    number: int
    closed: bool
    strip: bool = False


class Stroke(NamedTuple):
    """Rows one after another, and the turns between them.

    Attributes:
        places: (k, 3) [mm].
        numbers: (k,) row that each place lies on; between two rows on a turn.
        closed: whether it is one row that goes round.
    """

    places: FloatArray
    numbers: FloatArray
    closed: bool


@frozen
class _End:
    """Where an end of a row lies along the lines of ends: which line, or -1 for none, and how far along [mm]."""

    line: int
    arc: float


NOWHERE = _End(-1, 0.0)


class Lines:
    """The lines at which rows end.

    Args:
        lines: closed, (k, 3) places each, the first repeated at the end [mm].
        spacing: of the rows [mm].
    """

    def __init__(self, lines: Sequence[FloatArray], *, spacing: float) -> None:
        self._lines = [even_points(line, step=STEP_SHARE * spacing) for line in lines]
        self._arcs = [arc_lengths(line) for line in self._lines]
        self._line_of: IntArray = np.repeat(np.arange(len(lines)), [len(line) for line in self._lines])
        self._place_of = np.concatenate([np.arange(len(line)) for line in self._lines]) if lines else np.zeros(0, int)
        self._tree = KDTree(np.concatenate(self._lines)) if lines else None
        self._spacing = spacing

    def end(self, place: FloatArray) -> _End:
        """Return where a place (3,) lies along them [mm]."""
        if self._tree is None:
            return NOWHERE
        away, found = self._tree.query(place)
        if away > (AT_LINE + STEP_SHARE) * self._spacing:
            return NOWHERE
        line = int(self._line_of[found])
        return _End(line, float(self._arcs[line][self._place_of[found]]))

    def apart(self, first: _End, second: _End) -> float:
        """Return how far two ends are apart along their line [mm]; infinitely where not on one."""
        if first.line < 0 or first.line != second.line:
            return np.inf
        away = abs(first.arc - second.arc)
        return min(away, float(self._arcs[first.line][-1]) - away)

    def between(self, first: _End, second: _End) -> FloatArray:
        """Return (k, 3) places on the shorter part of a line between two ends, both left out [mm]."""
        arcs, line = self._arcs[first.line], self._lines[first.line]
        whole = float(arcs[-1])
        along = (second.arc - first.arc + 0.5 * whole) % whole - 0.5 * whole
        steps = max(int(np.ceil(abs(along) / (STEP_SHARE * self._spacing))), 1)
        at = np.mod(first.arc + along * np.linspace(0.0, 1.0, steps + 1)[1:-1], whole)
        return np.column_stack([np.interp(at, arcs, line[:, axis]) for axis in range(3)])


def joined(rows: Sequence[RowPart], lines: Lines, *, spacing: float) -> list[Stroke]:
    """Join rows to strokes.

    A stroke begins with the row that has the largest number of those left, at the end that is farther from any row next
    to it, and goes on with the row next to it whose end is nearest along the line of ends: numbers differ by one, or
    are both 0, on the two sides of the curve, or a strip leads on to the rest of its row.

    Args:
        rows: parts of rows.
        lines: at which they end.
        spacing: of the rows [mm].

    Returns:
        Strokes; every row is in one.
    """
    ends = [(NOWHERE, NOWHERE) if row.closed else (lines.end(row.places[0]), lines.end(row.places[-1])) for row in rows]
    waiting = sorted(range(len(rows)), key=lambda index: -rows[index].number)
    strokes: list[Stroke] = []

    def following(row: int, end: int) -> tuple[float, int, int]:
        """Return how far the next row begins, which it is, and at which of its ends."""
        found = [
            (lines.apart(ends[row][end], ends[other][side]), other, side)
            for other in waiting
            if _beside(rows[row], rows[other]) and other != row
            for side in (0, 1)
        ]
        return min(found, default=(np.inf, -1, 0))

    while waiting:
        at = waiting[0]
        out = 0 if following(at, 0)[0] < following(at, 1)[0] else 1
        waiting.remove(at)
        stroke = _along(rows[at], out)
        while True:
            away, other, side = following(at, out)
            if away > LONGEST_TURN * spacing:
                break
            turn = lines.between(ends[at][out], ends[other][side])
            stroke = _turned(stroke, turn, _along(rows[other], 1 - side), spacing=spacing)
            waiting.remove(other)
            at, out = other, 1 - side
        strokes.append(stroke)
    return strokes


def _beside(first: RowPart, second: RowPart) -> bool:
    """Return whether a turn may lead from one to the other: neighbours, and parts of one row with a strip between."""
    if first.number == second.number:
        return first.number == 0 or first.strip != second.strip
    return abs(first.number - second.number) == 1


def _along(row: RowPart, out: int) -> Stroke:
    """Return a row as a stroke that leaves at one of its ends."""
    places = row.places if out == 1 else row.places[::-1]
    return Stroke(places, np.full(len(places), float(row.number)), row.closed)


def _turned(first: Stroke, turn: FloatArray, second: Stroke, *, spacing: float) -> Stroke:
    """Return a stroke, a turn and another stroke as one, its two corners rounded."""
    bend = np.concatenate([first.places[-1:], turn, second.places[:1]])
    lengths = [float(arc_lengths(places)[-1]) for places in (first.places, bend, second.places)]
    leaving = _reach(first.places, bend, spacing=spacing)
    arriving = _reach(second.places[::-1], bend[::-1], spacing=spacing)
    shrunk = min(1.0, lengths[1] / max(leaving + arriving, SHORTEST))
    leaving = min(leaving * shrunk, lengths[0] / 2.0)
    arriving = min(arriving * shrunk, lengths[2] / 2.0)
    kept = _part(first.places, 0.0, lengths[0] - leaving)
    inner = _part(bend, leaving, lengths[1] - arriving)[int(leaving + arriving > lengths[1] - SHORTEST) :]
    onward = _part(second.places, arriving, lengths[2])
    places = np.concatenate([
        kept,
        _rounded(kept[-1], first.places[-1], inner[0]),
        inner,
        _rounded(inner[-1], second.places[0], onward[0]),
        onward,
    ])  # fmt: skip
    begun, ended = float(first.numbers[-1]), float(second.numbers[0])
    between: FloatArray = np.linspace(begun, ended, len(places) - len(kept) - len(onward) + 2)[1:-1]
    if begun == ended:
        between = between + 0.5
    numbers = np.concatenate([first.numbers[: len(kept)], between, np.full(len(onward), ended)])
    return Stroke(places, numbers, closed=False)


def _reach(row: FloatArray, bend: FloatArray, *, spacing: float) -> float:
    """Return how far from the corner between a row and a turn its rounding reaches, to be as wide as a half circle."""
    ahead, length = CORNER_SHARE * spacing, float(arc_lengths(row)[-1])
    before = row[-1] - _part(row, max(length - ahead, 0.0), length)[0]
    after = _part(bend, 0.0, ahead)[-1] - bend[0]
    cosine = before @ after / max(float(np.linalg.norm(before) * np.linalg.norm(after)), SHORTEST)
    return ahead * float(np.tan(0.5 * np.arccos(np.clip(cosine, SHARPEST, 1.0))))


def _part(places: FloatArray, begin: float, end: float) -> FloatArray:
    """Return the part of a polyline between two arc lengths [mm]."""
    arcs = arc_lengths(places)
    ends = [np.array([[np.interp(arc, arcs, places[:, axis]) for axis in range(3)]]) for arc in (begin, end)]
    return np.concatenate([ends[0], places[(arcs > begin) & (arcs < end)], ends[1]])


def _rounded(start: FloatArray, corner: FloatArray, end: FloatArray) -> FloatArray:
    """Return places of the parabola between two tangents that meet in a corner, both ends left out."""
    share = np.linspace(0.0, 1.0, CORNER_PLACES + 2)[1:-1, None]
    return (1 - share) ** 2 * start + 2 * share * (1 - share) * corner + share**2 * end
