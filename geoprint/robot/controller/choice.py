"""Which poses become targets: the cheapest chain of straight moves, found by dynamic programming.

A greedy choice leaves what remains before a pose that must be a target, however short that is. Here every chain of
moves from one such pose to the next is weighed: first that no move is shorter in time than a controller takes at all,
then that few are shorter than it likes, then that few use the tolerances up, then that there are few.
"""

from __future__ import annotations

import math
from typing import final

import numpy as np

from geoprint.kernels import inner, njit
from geoprint.model import FloatArray, IntArray, frozen

# Share of the tolerances that is used up as long as the rate of targets allows: the closer, the better.
FINE_SHARE = 0.25

# A straight move turns the tool in the shorter direction; far below half a turn [rad] nobody can take it for the other.
LARGEST_TURN = float(np.radians(90.0))

# Steps of the tip below this [mm] are turns on the spot.
COINCIDENT = 1e-6

# Quaternions closer than this [rad] are interpolated straight: slerp would divide by nearly zero, and the straight line
# is off by less than 1e-6 rad.
SMALL_TURN = 1e-3

# What a move costs beside the 1 that every move costs: so far apart that one of a kind outweighs all that come below.
TOO_SHORT = 1e7
CLOSE = 1e4
WIDE = 100.0
COARSE = 10.0

# Every move over so many poses is weighed, of longer ones those over twice as many again, up to the most, and the one
# to the pose that must follow. Where so many in turn leave the tolerance, longer ones are taken to leave it as well.
NEAREST = 24
MOST = 512
TRIES = 4
# How many moves from one pose that makes: the near ones, one for each doubling, and that to the one that must follow.
MOVES = NEAREST + math.ceil(math.log2(MOST / NEAREST)) + 1

# Share of a time by which moves that take it may seem shorter.
TIME_ROUNDING = 1e-4


@final
@frozen
class Weighed:
    """What the moves between p poses cost.

    Attributes:
        allowed: (p,) largest distance of each pose from the straight move past it [mm].
        lasts: (p,) of each pose the next that must be a target; moves end there.
        costs: (p, c) of the moves from each pose, over so many poses as are tried in turn, and to the one that must be
            a target; infinite where a pose past them may not be so far off, not a number where they were not tried.
    """

    allowed: FloatArray
    lasts: IntArray
    costs: FloatArray


def weighed(
    tips: FloatArray,
    quaternions: FloatArray,
    times: FloatArray,
    required: IntArray,
    *,
    allowed: FloatArray,
    turns: FloatArray,
    tolerance: float,
    periods: tuple[float, float],
    known: Weighed | None = None,
) -> Weighed:
    """Weigh the moves between poses.

    Args:
        tips: (p, 3) [mm].
        quaternions: (p, 4) of one sign from pose to pose.
        times: (p,) when they are passed [s].
        required: ascending poses that must be targets; the first and the last pose are among them.
        allowed: (p,) largest distance of each pose from the straight move past it [mm].
        turns: (p,) largest angle of each pose from the attitude there [rad].
        tolerance: distance at which a move counts as wide [mm].
        periods: least time of a move [s], and the time that moves should have.
        known: the same poses weighed with other distances: moves past none that differs are not weighed again.
    """
    lasts = required[np.minimum(np.searchsorted(required, np.arange(len(times)), side="right"), len(required) - 1)]
    if known is None:
        costs, differs = np.full((len(times), MOVES), np.nan), np.ones(len(times), dtype=np.bool_)
    else:
        costs, differs = known.costs.copy(), allowed != known.allowed
    before = np.append(0, np.cumsum(differs))
    _weigh(tips, quaternions, times, allowed, lasts, before, costs, turns, tolerance, *periods)
    return Weighed(allowed.copy(), lasts, costs)


def cheapest_chain(moves: Weighed, required: IntArray) -> IntArray:
    """Return the poses that become targets, the required ones, for which the moves were weighed, among them."""
    return _chain(moves.costs, required)


def chord_shares(tips: FloatArray, chosen: IntArray, *, allowed: FloatArray) -> FloatArray:
    """Return the largest distance of the poses left out from each straight move, by what each of (p,) may be [mm]."""
    return _chord_shares(tips, chosen, allowed)


@njit
def _weigh(  # noqa: PLR0917
    tips: FloatArray,
    quaternions: FloatArray,
    times: FloatArray,
    allowed: FloatArray,
    lasts: IntArray,
    before: IntArray,
    costs: FloatArray,
    turns: FloatArray,
    tolerance: float,
    shortest: float,
    period: float,
) -> None:
    """Weigh the moves from each row past which something differs; of the rows before row i, before[i] do."""
    for start in range(len(times) - 1):
        last = lasts[start]
        is_known = not np.isnan(costs[start, 0])
        if is_known and before[_farthest(costs[start], start, last)] == before[start + 1]:
            continue
        costs[start] = np.nan
        tries, end, reach, move = 0, start, 0, 0
        while reach < MOST and end < last and tries < TRIES:
            reach = reach + 1 if reach < NEAREST else 2 * reach
            end = min(start + reach, last)
            if reach == NEAREST and last <= start + MOST:
                # The whole rest at once, where it is straight.
                costs[start, MOVES - 1] = _cost(
                    tips, quaternions, times, allowed, start, last, turns, tolerance, shortest, period
                )
            cost = _cost(tips, quaternions, times, allowed, start, end, turns, tolerance, shortest, period)
            costs[start, move] = cost
            tries = tries + 1 if cost == np.inf else 0
            move += 1


@inner
def _farthest(moves: FloatArray, start: int, last: int) -> int:
    """Return the end of the longest of the moves from a row that have been weighed.

    What lies behind it had no say in them, nor in that no longer ones were tried.
    """
    reach = 0
    for move in range(MOVES - 1):
        if np.isnan(moves[move]):
            break
        reach = reach + 1 if reach < NEAREST else 2 * reach
    return min(start + reach, last) if np.isnan(moves[MOVES - 1]) else last


@njit
def _chain(moves: FloatArray, required: IntArray) -> IntArray:
    """Return the rows of the cheapest chains from each required row to the next, one after the other."""
    costs, before = np.full(len(moves), np.inf), np.zeros(len(moves), np.int64)
    kept = np.zeros(len(moves), np.bool_)
    kept[required] = True
    for part in range(len(required) - 1):
        first, last = required[part], required[part + 1]
        costs[first] = 0.0
        for start in range(first, last):
            reach = 0
            for move in range(MOVES - 1):
                if np.isnan(moves[start, move]):
                    break
                reach = reach + 1 if reach < NEAREST else 2 * reach
                end = min(start + reach, last)
                # What is not a number is not less.
                if reach == NEAREST and costs[start] + moves[start, MOVES - 1] < costs[last]:
                    costs[last], before[last] = costs[start] + moves[start, MOVES - 1], start
                if costs[start] + moves[start, move] < costs[end]:
                    costs[end], before[end] = costs[start] + moves[start, move], start
        while last > first:
            kept[last] = True
            last = before[last]
    return np.flatnonzero(kept)


@inner
def _cost(  # noqa: PLR0917
    tips: FloatArray,
    quaternions: FloatArray,
    times: FloatArray,
    allowed: FloatArray,
    first: int,
    last: int,
    turns: FloatArray,
    tolerance: float,
    shortest: float,
    period: float,
) -> float:
    """Return what a straight move costs, infinite where a pose past it may not be so far off."""
    off = _deviation(tips, quaternions, allowed, first, last, turns, tolerance)
    if off == np.inf:
        return np.inf
    time = times[last] - times[first]
    cost = 1.0
    if off > FINE_SHARE:
        cost += COARSE + off
    if off > 1.0:
        cost += WIDE
    if time < period * (1.0 - TIME_ROUNDING):
        cost += CLOSE
    if time < shortest * (1.0 - TIME_ROUNDING):
        cost += TOO_SHORT * (2.0 - time / shortest)
    return cost


@inner
def _deviation(  # noqa: PLR0917
    tips: FloatArray, quaternions: FloatArray, allowed: FloatArray, first: int, last: int, turns: FloatArray,
    tolerance: float,
) -> float:  # fmt: skip
    """Return the largest deviation of the poses between two from the straight move, by tolerance and turn.

    A pose belongs to the place of the move that is nearest to its tip; where the tip stays in place, to the one
    whose turn is nearest to its own. It is infinite where a pose is farther off than allowed.
    """
    if last == first + 1:
        return 0.0
    start, end = quaternions[first], quaternions[last]
    apart = 2.0 * math.asin(min(math.sqrt(_square_apart(start, end)) / 2.0, 1.0))
    if apart > LARGEST_TURN / 2.0:
        return np.inf
    x, y, z = tips[last, 0] - tips[first, 0], tips[last, 1] - tips[first, 1], tips[last, 2] - tips[first, 2]
    square = x * x + y * y + z * z
    sine = math.sin(apart)
    worst = 0.0
    for row in range(first + 1, last):
        u, v, w = tips[row, 0] - tips[first, 0], tips[row, 1] - tips[first, 1], tips[row, 2] - tips[first, 2]
        if square > COINCIDENT**2:
            share = min(max((u * x + v * y + w * z) / square, 0.0), 1.0)
        else:
            share = _turned_share(start, end, quaternions[row], apart)
        missed = (u - share * x) ** 2 + (v - share * y) ** 2 + (w - share * z) ** 2
        if missed > allowed[row] ** 2:
            return np.inf
        ahead, behind = share, 1.0 - share
        if apart >= SMALL_TURN:
            ahead, behind = math.sin(apart * share) / sine, math.sin(apart * (1.0 - share)) / sine
        turned = 0.0
        for axis in range(4):
            turned += (quaternions[row, axis] - behind * start[axis] - ahead * end[axis]) ** 2
        turned = 4.0 * turned / turns[row] ** 2
        if turned > 1.0:
            return np.inf
        worst = max(worst, missed / tolerance**2, turned)
    return math.sqrt(worst)


@inner
def _turned_share(start: FloatArray, end: FloatArray, between: FloatArray, apart: float) -> float:
    """Return the share of the slerp from one quaternion to another, so far apart [rad], that is nearest to a third."""
    if apart == 0.0:
        return 0.0
    sine, cosine = math.sin(apart), math.cos(apart)
    across, along = 0.0, 0.0
    for axis in range(4):
        across += between[axis] * ((end[axis] - cosine * start[axis]) / sine)
        along += between[axis] * start[axis]
    return min(max(math.atan2(across, along) / apart, 0.0), 1.0)


@inner
def _square_apart(one: FloatArray, other: FloatArray) -> float:
    square = 0.0
    for axis in range(len(one)):
        square += (other[axis] - one[axis]) ** 2
    return square


@njit
def _chord_shares(tips: FloatArray, chosen: IntArray, allowed: FloatArray) -> FloatArray:
    shares = np.zeros(len(chosen) - 1)
    for move in range(len(chosen) - 1):
        first, last = chosen[move], chosen[move + 1]
        square = _square_apart(tips[first], tips[last])
        for row in range(first + 1, last):
            ahead, missed = 0.0, 0.0
            for axis in range(3):
                ahead += (tips[row, axis] - tips[first, axis]) * (tips[last, axis] - tips[first, axis])
            share = min(max(ahead / square, 0.0), 1.0) if square > COINCIDENT**2 else 0.0
            for axis in range(3):
                offset = tips[row, axis] - tips[first, axis]
                missed += (offset - share * (tips[last, axis] - tips[first, axis])) ** 2
            shares[move] = max(shares[move], math.sqrt(missed) / allowed[row])
    return shares
