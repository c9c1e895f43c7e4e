"""Strokes deposited one after another along a field, one spacing apart as far as its lines run side by side.

A stroke begins beside one that is there, exactly one spacing away, and runs on until it comes too near to another one
[Jobard1997]. What lies between paths that run apart is filled from its widest place, always the widest of all first
[Mebarki2005]. The rim counts as a stroke half a spacing outside of it. Where
the spacing differs from place to place, that between two paths is the mean of what is wanted where they lie.
"""

from __future__ import annotations

from collections.abc import Iterator
from heapq import heapify, heappop, heappush
from typing import NamedTuple, final

import numpy as np

from geoprint.fibers.net import ComplexArray, LineNet, rim_sides
from geoprint.fibers.streamlines import (
    FULL,
    NOBODY,
    RETURNED,
    Rules,
    deposit,
    deposit_straight,
    gaps,
    nearest,
    no_segments,
    rim_segments,
    straight,
    streamline,
    take_back,
    window_room,
    with_room,
)
from geoprint.model import BoolArray, IntArray

# A stroke ends nearer to another than this share of the spacing ...
APART_SHARE = 0.6
# ... begins beside one where no other is nearer than this, which is one but for rounding and bends,
BESIDE_SHARE = 0.98
# and in a gap where it is farther than this from the paths on both sides.
GAP_SHARE = 0.7
# A stroke does not crowd what is less than so many spacings along it.
CLEAR = 2.0
# It looks about each so many spacings; where paths begin beside it is tried each so many.
STEP_SHARE, TRIED = 0.125, 1.0
# A shorter stroke than so many spacings is not worth a start.
SHORTEST = 3.0
# A stroke that comes back no farther aside of its beginning than this share of the spacing may be closed,
RETURN_SHARE = 0.45
# by turning the field by at most this [rad], in so many trials, until it misses by no more than the first share, or at
# last by the second: around a vertex what it misses by may jump. The rest is made up for over so many spacings.
MOST_LEAN, TRIALS, MET_SHARE, JOINED_SHARE, JOIN = np.radians(1.5), 6, 0.005, 0.06, 0.4
# Gaps are measured to so many spacings; wider ones are equally wide.
FAR = 1.5
# LaidSegments that there is room for at first.
ROOM = 10_000


class DepositedStroke(NamedTuple):
    """A stroke as its segments.

    Attributes:
        faces: (s,) in which each lies.
        starts: (s,) in the plane of that [mm].
        ends: (s,) [mm].
        closed: whether it ends where it starts.
        row: how many paths lie between it and the first one, at most.
        length: [mm].
    """

    faces: IntArray
    starts: ComplexArray
    ends: ComplexArray
    closed: bool
    row: int
    length: float


def deposited_strokes(
    net: LineNet, *, first: tuple[int, complex], spread: IntArray, beside_rim: BoolArray
) -> tuple[list[DepositedStroke], list[float]]:
    """Deposit paths until there is no gap for another one.

    Args:
        net: a surface in one piece with a field.
        first: where the first one begins: a face, and the place in its plane.
        spread: (k,) faces all over the surface, nearer together than gaps are wide.
        beside_rim: (k,) whether the middle of each may lie nearer to the rim than a spacing.

    Returns:
        The paths, in the order in which they are deposited, and the lengths of those that are too short to be worth a
        start [mm].
    """
    laying = _Depositing(net)
    laying.beside(laying.begun(*first, row=0))
    laying.fill(spread, beside_rim)
    return laying.paths, laying.dropped


@final
class _Depositing:
    """Strokes that were deposited, and the loops' arrays of them.

    Args:
        net: a surface with a field.
    """

    def __init__(self, net: LineNet) -> None:
        self._net, self._spacings = net, net.spacings
        self._deposited, self._room = no_segments(len(net.corners), room=ROOM), window_room()
        self._rules = Rules(
            step=STEP_SHARE, apart=APART_SHARE, itself=APART_SHARE, clear=CLEAR, beside=RETURN_SHARE, lean=1 + 0j
        )  # fmt: skip
        self.paths: list[DepositedStroke] = []
        self.dropped = list[float]()
        # What was dropped: a gap with room for a short stroke is met from many places.
        self._left = no_segments(len(net.corners), room=ROOM)
        self._middles: ComplexArray = net.corners.sum(axis=1) / 3.0
        self._rim = rim_segments(net)

    def begun(self, face: int, place: complex, *, row: int) -> DepositedStroke | None:
        """Deposit the stroke through a place; None where it is not worth a start."""
        count = int(self._deposited.filled[0])
        closed = False
        reason, ahead, aside = self._run(self._rules, face, place, 1.0)
        if reason == RETURNED:
            closed = self._closed(face, place, aside, ahead, count)
            if not closed:
                take_back(self._deposited, count)
                _, ahead, _ = self._run(self._rules._replace(beside=0.0), face, place, 1.0)
        middle, back = int(self._deposited.filled[0]), 0.0
        if not closed:
            _, back, _ = self._run(self._rules, face, place, -1.0)
        if ahead + back < SHORTEST * self._spacings[face]:
            self._drop(count, face, place, length=ahead + back)
            return None
        self.paths.append(self._stroke(count, middle, closed=closed, row=row, length=ahead + back))
        return self.paths[-1]

    def _drop(self, count: int, face: int, place: complex, *, length: float) -> None:
        """Take back a stroke of the segments from a number on; it counts if none was dropped so near before."""
        deposited, limit = self._deposited, APART_SHARE * float(self._spacings[face])
        _, found, _ = nearest(self._net, self._left, self._room, face, place, limit, NOBODY, 0.0, 0.0)
        if found < 0:
            self.dropped.append(length)
        rows = range(count, int(deposited.filled[0]))
        if self._left.filled[0] + len(rows) > self._left.before.size:
            self._left = with_room(self._left, room=self._left.before.size + len(rows))
        for row in rows:
            start, end = complex(deposited.starts[row]), complex(deposited.ends[row])
            deposit(self._left, int(deposited.faces[row]), start, end, len(self.dropped), float(deposited.arcs[row]))
        take_back(self._deposited, count)

    def beside(self, stroke: DepositedStroke | None) -> None:
        """Deposit paths beside one, beside these and so on, until there is no place left one spacing away."""
        waiting = [] if stroke is None else [stroke]
        while waiting:
            stroke = waiting.pop(0)
            for face, place in self._places_beside(stroke):
                if self._gap(face, place, BESIDE_SHARE)[0] >= BESIDE_SHARE:
                    new = self.begun(face, place, row=stroke.row + 1)
                    waiting += [] if new is None else [new]

    def fill(self, faces: IntArray, beside_rim: BoolArray) -> None:
        """Deposit paths in gaps about the middles of (k,) faces, the widest first, and others beside them."""
        middles, spacings = self._middles[faces], self._spacings[faces]
        found = gaps(self._net, self._deposited, self._room, faces, middles, FAR * spacings) / spacings
        # From most places the rim is farther than is looked, and nothing shortens the look.
        near = np.flatnonzero(beside_rim)
        rim = gaps(self._net, self._rim, self._room, faces[near], middles[near], spacings[near])
        found[near] = np.minimum(found[near], rim / spacings[near] + 0.5)
        waiting = [
            (-width, face) for width, face in zip(found.tolist(), faces.tolist(), strict=True) if width >= GAP_SHARE
        ]
        heapify(waiting)
        while waiting:
            width, face = heappop(waiting)
            now, near = self._gap(face, complex(self._middles[face]), FAR)
            if now < GAP_SHARE:
                continue
            if now < -width:
                heappush(waiting, (-now, face))
                continue
            row = self.paths[near].row + 1 if near >= 0 else 0
            self.beside(self.begun(face, complex(self._middles[face]), row=row))

    def _gap(self, face: int, place: complex, reach: float) -> tuple[float, int]:
        """Return how many spacings the nearest stroke is away, within so many, and which; the rim's is half beyond."""
        spacing = float(self._spacings[face])
        limit = reach * spacing
        away, found, _ = nearest(self._net, self._deposited, self._room, face, place, limit, NOBODY, 0.0, 0.0)
        beyond = limit - 0.5 * spacing
        rim, _, _ = nearest(self._net, self._rim, self._room, face, place, beyond, NOBODY, 0.0, 0.0)
        width = rim / spacing + 0.5
        if found < 0:
            return width, -1
        there = float(self._spacings[self._deposited.faces[found]])
        return min(away / (0.5 * (spacing + there)), width), int(self._deposited.paths[found])

    def _run(self, rules: Rules, face: int, place: complex, sign: float) -> tuple[int, float, float]:
        """Deposit a streamline; where there is no room for it, with more."""
        while True:
            count = int(self._deposited.filled[0])
            found = streamline(self._net, self._deposited, self._room, rules, face, place, sign, len(self.paths))
            if found[0] != FULL:
                return found
            take_back(self._deposited, count)
            self._deposited = with_room(self._deposited, room=self._deposited.before.size)

    def _closed(self, face: int, place: complex, aside: float, length: float, count: int) -> bool:
        """Deposit a streamline that came back anew, turned by so little that it meets its beginning; say if it did."""
        lean = 0.0
        for trial in range(TRIALS):
            lean += aside / length
            take_back(self._deposited, count)
            if abs(lean) > MOST_LEAN:
                return False
            rules = self._rules._replace(lean=complex(np.exp(1j * lean)))
            reason, length, aside = self._run(rules, face, place, 1.0)
            if reason != RETURNED:
                return False
            if abs(aside) <= (MET_SHARE if trial + 1 < TRIALS else JOINED_SHARE) * self._spacings[face]:
                return self._joined(length)
        return False

    def _joined(self, length: float) -> bool:
        """Lead the end of a stroke that came back straight to its beginning; say if nothing lies between."""
        deposited, last = self._deposited, int(self._deposited.filled[0]) - 1
        spacing = float(self._spacings[deposited.faces[last]])
        reach = JOIN * spacing
        while deposited.arcs[last] > length - reach:
            last -= 1
        face, end, arc = int(deposited.faces[last]), complex(deposited.ends[last]), float(deposited.arcs[last + 1])
        take_back(deposited, last + 1)
        _, found, vector = nearest(
            self._net, deposited, self._room, face, end, 2.0 * reach, len(self.paths), arc, CLEAR * spacing
        )
        if found < 0 or deposited.paths[found] != len(self.paths) or abs(vector) == 0.0:
            return False
        while not deposit_straight(
            self._net, self._deposited, face, end, vector / abs(vector), abs(vector), len(self.paths), arc
        ):
            take_back(self._deposited, last + 1)
            self._deposited = with_room(self._deposited, room=self._deposited.before.size)
        return True

    def _stroke(self, count: int, middle: int, *, closed: bool, row: int, length: float) -> DepositedStroke:
        """Return the stroke of the segments from a number on, those from the middle on in the opposite sense."""
        deposited = self._deposited
        back, ahead = np.arange(int(deposited.filled[0]) - 1, middle - 1, -1), np.arange(count, middle)
        return DepositedStroke(
            faces=deposited.faces[np.concatenate([back, ahead])],
            starts=np.concatenate([deposited.ends[back], deposited.starts[ahead]]),
            ends=np.concatenate([deposited.starts[back], deposited.ends[ahead]]),
            closed=closed,
            row=row,
            length=length,
        )

    def _places_beside(self, stroke: DepositedStroke) -> Iterator[tuple[int, complex]]:
        """Yield places one spacing away from a stroke, on both sides, from end to end."""
        along = stroke.ends - stroke.starts
        lengths = np.abs(along)
        arcs = np.cumsum(lengths) - lengths
        tried = max(int(stroke.length / (TRIED * float(np.median(self._spacings[stroke.faces])))), 1)
        stations = (np.arange(tried) + 0.5) / tried * stroke.length
        rows = np.clip(np.searchsorted(arcs, stations, side="right") - 1, 0, arcs.size - 1)
        units = along[rows] / lengths[rows]
        begins = stroke.starts[rows] + (stations - arcs[rows]) * units
        for side in (1j, -1j):
            for face, place, ahead in zip(stroke.faces[rows].tolist(), begins.tolist(), units.tolist(), strict=True):
                here = float(self._spacings[face])
                beyond, there, gone = straight(self._net, face, place, ahead * side, here)
                wanted = 0.5 * (here + float(self._spacings[beyond]))
                if wanted != here:
                    beyond, there, gone = straight(self._net, face, place, ahead * side, wanted)
                if gone >= wanted:
                    yield beyond, there


def first_place(net: LineNet) -> tuple[int, complex] | None:
    """Return the place half a spacing inside of the rim where lines follow that best; None where there is none."""
    halves, starts, ends = rim_sides(net)
    units = (ends - starts) / np.abs(ends - starts)
    aligned = np.abs((net.lines[halves // 3] * units.conj()).real)
    # Of equally good ones the first, whatever rounding says.
    for row in np.argsort(-np.round(aligned, 6), kind="stable").tolist():
        middle = complex(starts[row] + ends[row]) / 2
        inwards = float(net.spacings[halves[row] // 3]) / 2
        face, place, gone = straight(net, int(halves[row] // 3), middle, complex(1j * units[row]), inwards)
        if gone >= inwards:
            return face, place
    return None
