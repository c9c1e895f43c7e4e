"""Moves as the controller makes them: straight lines, blends that are circular arcs, and speeds with even ramps.

A movep goes straight with circular blends, accelerates to its speed and keeps it [URScript, Module motion]; blends
must not overlap [URManual]. A blend begins its radius before the target
and ends as far behind it; the arc touches both lines. Speeds change at the acceleration of the move, on straight lines
and on arcs; where a line is too short to stop on it, the model brakes harder. How a controller looks ahead is not
published: of ramps this model is an assumption, of places it is not.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias, final

import numpy as np

from geoprint.model import FloatArray
from geoprint.postprocessor.urscript.poses import Pose, Turn, Vector, between, pose_of

# Shorter than this [m] is no way.
NO_WAY = 1e-8
# Two lines that turn by less than this [rad] are one.
_STRAIGHT = 1e-7
# Time, way, speed and acceleration at the beginning of a phase [s, m, m/s, m/s2].
Phase: TypeAlias = tuple[float, float, float, float]


class Start(NamedTuple):
    """When a way begins, and how fast the tool is then [s, m/s]."""

    time: float
    speed: float


class Pace(NamedTuple):
    """Speed and acceleration of a move [m/s, m/s2]."""

    speed: float
    acceleration: float


@final
class Line:
    """A straight way between two places, over which the tool turns evenly."""

    def __init__(self, start: Vector, end: Vector, turns: tuple[Turn, Turn]) -> None:
        self.start, self.turns = start, turns
        self.length = math.dist(start, end)
        over = max(self.length, NO_WAY)
        self.along: Vector = ((end[0] - start[0]) / over, (end[1] - start[1]) / over, (end[2] - start[2]) / over)

    def place(self, way: float) -> Vector:
        """Return the place on it after so much way [m]."""
        (x, y, z), (a, b, c) = self.start, self.along
        return x + way * a, y + way * b, z + way * c

    def nearest(self, place: Vector) -> float:
        """Return how far along the place on it lies that is nearest to another [m]."""
        way = sum((p - s) * a for p, s, a in zip(place, self.start, self.along, strict=True))
        return min(max(way, 0.0), self.length)

    def attitude(self, share: float) -> Turn:
        """Return the attitude of the tool at a share of it."""
        return between(*self.turns, share)


@final
class Arc:
    """A blend: the circular arc that touches two lines, at the same distance from where they meet."""

    def __init__(self, corner: Vector, along: tuple[Vector, Vector], radius: float, turns: tuple[Turn, Turn]) -> None:
        before, behind = along
        self.turns = turns
        cosine = max(-1.0, min(1.0, sum(a * b for a, b in zip(before, behind, strict=True))))
        self.angle = math.acos(cosine)
        (x, y, z), (a, b, c), (d, e, f) = corner, before, behind
        self.start: Vector = (x - radius * a, y - radius * b, z - radius * c)
        self.before, self.across = before, before
        if self.angle < _STRAIGHT:
            self.bend, self.length = 0.0, 2.0 * radius
            return
        self.bend = radius / math.tan(0.5 * self.angle)
        self.length = self.bend * self.angle
        sine = math.sin(self.angle)
        self.across = ((d - cosine * a) / sine, (e - cosine * b) / sine, (f - cosine * c) / sine)

    def place(self, way: float) -> Vector:
        """Return the place on it after so much way [m]."""
        x, y, z = self.start
        if self.bend == 0.0:
            ahead, aside = way, 0.0
        else:
            phi = way / self.bend
            ahead, aside = self.bend * math.sin(phi), self.bend * (1.0 - math.cos(phi))
        (a, b, c), (d, e, f) = self.before, self.across
        return x + ahead * a + aside * d, y + ahead * b + aside * e, z + ahead * c + aside * f

    def nearest(self, place: Vector) -> float:
        """Return how far along the place on it lies that is nearest to another [m]."""
        off = [p - s for p, s in zip(place, self.start, strict=True)]
        ahead, aside = (sum(o * d for o, d in zip(off, axis, strict=True)) for axis in (self.before, self.across))
        way = ahead if self.bend == 0.0 else self.bend * math.atan2(ahead, self.bend - aside)
        return min(max(way, 0.0), self.length)

    def attitude(self, share: float) -> Turn:
        """Return the attitude of the tool at a share of it."""
        return between(*self.turns, share)


@final
class Rest:
    """A turn of the tool on the spot, or a place where it rests."""

    length = 0.0

    def __init__(self, place: Vector, turns: tuple[Turn, Turn]) -> None:
        self._place, self.turns = place, turns

    def place(self, way: float) -> Vector:
        """Return the place on it after so much way [m]."""
        del way
        return self._place

    def attitude(self, share: float) -> Turn:
        """Return the attitude of the tool at a share of it."""
        return between(*self.turns, share)


@final
class JointWay:
    """A way in joint space: all joints at once, from and to given ones [rad]."""

    length = 1.0

    def __init__(self, joints: tuple[FloatArray, FloatArray]) -> None:
        self.joints = joints

    def at(self, share: float) -> FloatArray:
        """Return (6,) joints at a share of it [rad]."""
        return self.joints[0] + share * (self.joints[1] - self.joints[0])


Way: TypeAlias = Line | Arc | Rest | JointWay


@final
class Piece:
    """A way with the time in which it is gone.

    Attributes:
        way: where it goes.
        move: number of the move that it belongs to; of an arc that which it leads to.
        begins: when it begins [s].
        ends: when it ends [s].
        phases: of even acceleration, along the way.
        leaves: speed at its end [m/s].
    """

    def __init__(self, way: Way, move: int, phases: list[Phase], *, ends: float, leaves: float) -> None:
        self.way, self.move, self.phases = way, move, phases
        self.begins, self.ends, self.leaves = phases[0][0], ends, leaves

    def gone(self, time: float) -> float:
        """Return how much of the way is gone at a time [m]."""
        if time >= self.ends:
            return self.way.length
        since, way, speed, acceleration = self.phases[0]
        for phase in self.phases:
            if phase[0] > time:
                break
            since, way, speed, acceleration = phase
        left = max(time - since, 0.0)
        return min(way + left * (speed + 0.5 * left * acceleration), self.way.length)

    def passed(self, way: float) -> float:
        """Return when so much of the way is gone [s]."""
        ends = [*(phase[0] for phase in self.phases[1:]), self.ends]
        for (since, gone, speed, acceleration), end in zip(self.phases, ends, strict=True):
            left = way - gone
            reached = (end - since) * (speed + 0.5 * (end - since) * acceleration)
            if left <= reached + NO_WAY or end == self.ends:
                # left = speed t + acceleration t^2 / 2, in the form that an acceleration of 0 keeps finite.
                root = math.sqrt(max(speed * speed + 2.0 * acceleration * left, 0.0))
                return min(since + max(2.0 * left / (speed + root), 0.0), end) if speed + root > 0.0 else since
        return self.ends

    def share(self, time: float) -> float:
        """Return the share of the way that is gone; of a turn on the spot, of its time."""
        if self.way.length > 0.0:
            return self.gone(time) / self.way.length
        return min(max((time - self.begins) / max(self.ends - self.begins, 1e-12), 0.0), 1.0)


def through(way: Line | Arc, move: int, start: Start, pace: Pace) -> Piece:
    """Return a way that is left at speed: the tool accelerates or slows down to the speed of the move, and keeps it."""
    (begins, entry), (speed, acceleration) = start, pace
    rate = math.copysign(acceleration, speed - entry)
    needed = abs(speed**2 - entry**2) / (2.0 * acceleration)
    if needed >= way.length:
        leaves = math.sqrt(max(entry**2 + 2.0 * rate * way.length, 0.0))
        took = 2.0 * way.length / max(entry + leaves, 1e-12)
        return Piece(way, move, [(begins, 0.0, entry, rate)], ends=begins + took, leaves=leaves)
    changed = abs(speed - entry) / acceleration
    ends = begins + changed + (way.length - needed) / speed
    phases: list[Phase] = [(begins, 0.0, entry, rate), (begins + changed, needed, speed, 0.0)]
    return Piece(way, move, phases, ends=ends, leaves=speed)


def stopping(way: Line, move: int, start: Start, pace: Pace) -> Piece:
    """Return a way at whose end the tool rests; where it is short, it brakes harder."""
    (begins, entry), (speed, acceleration) = start, pace
    if way.length < NO_WAY:
        return Piece(way, move, [(begins, 0.0, 0.0, 0.0)], ends=begins, leaves=0.0)
    if entry**2 / (2.0 * acceleration) >= way.length:
        rate = -(entry**2) / (2.0 * way.length)
        return Piece(way, move, [(begins, 0.0, entry, rate)], ends=begins + 2.0 * way.length / entry, leaves=0.0)
    # It keeps its speed, or the highest from which the rest of the way just suffices to stop.
    top = min(speed, math.sqrt(acceleration * way.length + 0.5 * entry**2))
    rate = math.copysign(acceleration, top - entry)
    changing, braking = (top**2 - entry**2) / (2.0 * rate), top**2 / (2.0 * acceleration)
    first = begins + (top - entry) / rate
    second = first + max(way.length - changing - braking, 0.0) / top
    phases: list[Phase] = [
        (begins, 0.0, entry, rate), (first, changing, top, 0.0), (second, way.length - braking, top, -acceleration)
    ]  # fmt: skip
    return Piece(way, move, phases, ends=second + top / acceleration, leaves=0.0)


def timed(way: Way, move: int, begins: float, seconds: float) -> Piece:
    """Return a way that takes a given time, at an even speed."""
    speed = way.length / max(seconds, 1e-12)
    return Piece(way, move, [(begins, 0.0, speed, 0.0)], ends=begins + seconds, leaves=0.0)


def pose_on(piece: Piece, time: float) -> Pose:
    """Return the pose of the tool on a way that is none in joint space."""
    way = piece.way
    assert not isinstance(way, JointWay)  # noqa: S101
    return pose_of(way.place(piece.gone(time)), way.attitude(piece.share(time)))


def places_of(pieces: list[Piece], times: FloatArray) -> FloatArray:
    """Return (k, 3) where the tip is at (k,) rising times [m]; between two ways it rests where the first has ended."""
    begins = np.array([piece.begins for piece in pieces])
    rows = np.clip(np.searchsorted(begins, times, side="right") - 1, 0, len(pieces) - 1)
    found = np.empty((times.size, 3))
    for k, time in enumerate(times.tolist()):
        piece = pieces[int(rows[k])]
        way = piece.way
        assert not isinstance(way, JointWay)  # noqa: S101
        found[k] = way.place(piece.gone(time))
    return found
