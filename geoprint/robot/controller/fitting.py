"""Places of targets beside the path, so that the controller's corner passes the path itself.

A controller rounds a target with a zone by a parabola [ABBRapid, zonedata] whose apex lies between the target and the
chord from the zone's entry to its exit (`zones`). Where a path bends so tightly that straight moves within the
tolerance would follow each other too soon, the target is put outside of the bend by what the corner cuts off: the
apex is then the pose that it stands for. Where zones reach halfway to the next target, the written path is a quadratic
spline through the poses, off by the fourth power of its step instead of the second.
"""

from __future__ import annotations

import math

import numpy as np

from geoprint.kernels import inner, uncounted
from geoprint.model import BoolArray, FloatArray, IntArray

# Largest radius in which the controller may round a target [mm]: below half a bead, however wide the targets stand.
LARGEST_ZONE = 0.3
# A corner of the path itself is cut by no more than this [mm]: less than the path may be off in all.
LARGEST_CUT = 0.004
# Steps of the tip below this [mm] are turns on the spot.
COINCIDENT = 1e-6
# The places are found by iteration; each round leaves a third of what was off, or less.
ROUNDS = 16
# Straight pieces that stand for half a parabola.
PIECES = 6


def zones_of(places: FloatArray, rests: BoolArray, *, moved: BoolArray | None = None) -> FloatArray:
    """Return the (t,) zones of targets [mm]; 0 at rest.

    They are half the distance to the nearer neighbour, and no larger than `LARGEST_ZONE`. One that is not moved stands
    on the path: its zone cuts its corner by no more than `LARGEST_CUT`.

    Args:
        places: (t, 3) [mm].
        rests: (t,) where the tool stops.
        moved: (t,) which stand outside of a bend, by what their zones cut off; all of them where it is left out.
    """
    steps = places[1:] - places[:-1]
    distances = np.linalg.norm(steps, axis=1)
    nearer = np.zeros(len(places))
    nearer[1:-1] = np.minimum(distances[1:], distances[:-1])
    zones = np.where(rests | (nearer < COINCIDENT), 0.0, np.minimum(nearer / 2.0, LARGEST_ZONE))
    if moved is not None:
        along = steps / np.maximum(distances[:, None], COINCIDENT)
        bends = np.linalg.norm(np.diff(along, axis=0), axis=1)
        largest = 4.0 * LARGEST_CUT / np.maximum(bends, COINCIDENT)
        zones[1:-1] = np.where(moved[1:-1], zones[1:-1], np.minimum(zones[1:-1], largest))
    return zones


def apexes(places: FloatArray, zones: FloatArray) -> FloatArray:
    """Return (t, 3) where the controller passes each of (t, 3) targets, halfway between its entry and exit [mm].

    Examples:
        >>> apexes(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0]]), np.array([0.0, 1.0, 0.0]))[1]
        array([3.75, 0.25])
    """
    steps = places[1:] - places[:-1]
    along = steps / np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), COINCIDENT)
    passed = places.copy()
    passed[1:-1] += zones[1:-1, None] / 4.0 * (along[1:] - along[:-1])
    return passed


def fitted_places(tips: FloatArray, moved: BoolArray, rests: BoolArray) -> FloatArray:
    """Return (t, 3) targets of which the moved ones are passed at their own (t, 3) tips; others stand there [mm]."""
    if not moved.any():
        return tips
    places = tips.copy()
    _fit(places, tips, moved, rests, np.empty((len(tips) - 1, 4)))
    return places


def rounded_deviations(tips: FloatArray, chosen: IntArray, places: FloatArray, zones: FloatArray) -> FloatArray:
    """Return how far path and controller's path are apart along each move, from apex to apex [mm].

    Args:
        tips: (p, 3) of the path.
        chosen: (t,) poses that the targets stand for.
        places: (t, 3) of the targets.
        zones: (t,) of the targets [mm].

    Returns:
        (t - 1,) the largest distance of a pose from the controller's path, or of that one from the poses.
    """
    return _along_moves(tips, chosen, places, zones)[0]


def rounded_lengths(tips: FloatArray, chosen: IntArray, places: FloatArray, zones: FloatArray) -> FloatArray:
    """Return (t - 1,) the length of the controller's path along each move, from apex to apex [mm]; args as above."""
    return _along_moves(tips, chosen, places, zones)[1]


def _along_moves(tips: FloatArray, chosen: IntArray, places: FloatArray, zones: FloatArray) -> FloatArray:
    """Return (2, t - 1) deviations and lengths of the moves."""
    places, zones = np.array(places, order="C"), np.array(zones)  # one kind of array: one loop to compile
    found = np.zeros((2, len(chosen) - 1))
    _follow(tips, chosen, places, zones, apexes(places, zones), np.empty((2 * PIECES + 2, 3)), found)
    return found


@uncounted
def _fit(places: FloatArray, tips: FloatArray, moved: BoolArray, rests: BoolArray, steps: FloatArray) -> None:
    """Move the (t, 3) places; (t - 1, 4) steps are room for the direction and the length of each."""
    last = len(tips) - 1
    for _ in range(ROUNDS):
        for row in range(last):
            steps[row, 3] = max(_apart(places[row + 1], places[row]), COINCIDENT)
            for axis in range(3):
                steps[row, axis] = (places[row + 1, axis] - places[row, axis]) / steps[row, 3]
        for row in range(1, last):
            if moved[row] and not rests[row]:
                zone = min(min(steps[row - 1, 3], steps[row, 3]) / 2.0, LARGEST_ZONE)
                for axis in range(3):
                    places[row, axis] = tips[row, axis] - zone / 4.0 * (steps[row, axis] - steps[row - 1, axis])


@uncounted
def _follow(  # noqa: PLR0917
    tips: FloatArray, chosen: IntArray, places: FloatArray, zones: FloatArray, passed: FloatArray, line: FloatArray,
    found: FloatArray,
) -> None:  # fmt: skip
    """Fill (2, t - 1) deviations and lengths of the moves; the line is room for the pieces of one."""
    for move in range(len(chosen) - 1):
        length = _apart(places[move + 1], places[move])
        if length <= COINCIDENT:
            continue
        ahead, behind = zones[move] / length, zones[move + 1] / length
        for k in range(PIECES + 1):
            # Half a parabola, from its apex along the chord's direction to its tangent at the end.
            _put_half(line[k], passed[move], places[move], places[move + 1], ahead, k / PIECES)
            _put_half(line[2 * PIECES + 1 - k], passed[move + 1], places[move + 1], places[move], behind, k / PIECES)
        for row in range(len(line) - 1):
            found[1, move] += _apart(line[row + 1], line[row])
        path = tips[chosen[move] : chosen[move + 1] + 1]
        for row in range(1, len(path) - 1):
            found[0, move] = max(found[0, move], _distance(path[row], line))
        for row in range(len(line)):
            found[0, move] = max(found[0, move], _distance(line[row], path))


@inner
def _put_half(  # noqa: PLR0917
    place: FloatArray, apex: FloatArray, corner: FloatArray, next_corner: FloatArray, zone: float, share: float
) -> None:
    """Fill (3,) a place on the half of a parabola from its apex to its end: its middle control point is halfway.

    It ends towards the next corner, at a zone that is a share of the distance to it.
    """
    for axis in range(3):
        end = corner[axis] + zone * (next_corner[axis] - corner[axis])
        middle = (corner[axis] + end) / 2.0
        place[axis] = (1.0 - share) ** 2 * apex[axis] + 2.0 * share * (1.0 - share) * middle + share**2 * end


@inner
def _apart(one: FloatArray, other: FloatArray) -> float:
    square = 0.0
    for axis in range(3):
        square += (one[axis] - other[axis]) ** 2
    return math.sqrt(square)


@inner
def _distance(place: FloatArray, line: FloatArray) -> float:
    """Return the distance of a place from a polyline [mm]."""
    least = np.inf
    for row in range(len(line) - 1):
        square, inner = 0.0, 0.0
        for axis in range(3):
            step = line[row + 1, axis] - line[row, axis]
            square += step * step
            inner += step * (place[axis] - line[row, axis])
        share = min(max(inner / square, 0.0), 1.0) if square > 0.0 else 0.0
        missed = 0.0
        for axis in range(3):
            missed += (place[axis] - line[row, axis] - share * (line[row + 1, axis] - line[row, axis])) ** 2
        least = min(least, missed)
    return math.sqrt(least)
