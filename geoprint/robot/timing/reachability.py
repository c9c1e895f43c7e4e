"""TOPP-RA [Pham2018]: the largest speeds from one grid point to the next, by reachability, in a compiled loop.

Sought are the squares x of the speeds at the grid points of a path. At each point, acceleration and speed may be
anything that keeps all joints; between two points the acceleration is constant, so that it is known from both squares.
So each step is a set of bands |a y + c x| <= b in the square x at its start and the square y at its end, and intervals
for both. A first pass goes back from the end and finds at each point the interval of squares from which the end can be
reached; a second one goes on from the start and takes the largest square of each interval that can be reached.

The widest interval of a step's x is found by Newton's method: for a given x, what the bands leave of y is an interval,
whose length is a concave function of x made of straight pieces. Where it is negative, its root lies where the two lines
cross that bound it, or beyond; each piece is met once at most.
"""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.kernels import inner, uncounted
from geoprint.model import FloatArray, frozen

# An interval that is empty by less than this share of its bounds is one point: rounding must not make it none.
ROUNDING = 1e-12
# Pieces of a concave function that are looked at; it has no more than twice as many as there are bands.
MOST_PIECES = 200
# Where the largest speed that can be reached is next to none, though others could be passed, it is this share of its
# ceiling: a grid may leave nothing better through a narrow place, and the motion must not end there.
LEAST_SHARE = 1e-4


@final
@frozen
class Problem:
    """What bounds the speed along a path from one speed at its start to another at its end.

    Attributes:
        pull: (g, k) coefficients of the path acceleration in each of k quantities that are bounded on both sides.
        square: (g, k) coefficients of the squared speed in them.
        bounds: (k,) what each may be at most, above zero.
        grid: (g,) points of the path, ascending [m].
        highest: (g,) ceilings of the speed [m/s], above zero.
        start: speed at the first point, at most its ceiling [m/s]; it is lower where it cannot be held.
        end: speed at the last one, at most its ceiling [m/s].
    """

    pull: FloatArray
    square: FloatArray
    bounds: FloatArray
    grid: FloatArray
    highest: FloatArray
    start: float
    end: float


def reachable_speeds(problem: Problem) -> FloatArray | None:
    """Return the (g,) largest speeds [m/s] at the points of the grid, or None where there are none."""
    highs = np.full(problem.grid.size, problem.end**2)
    lows, steps = highs.copy(), np.diff(problem.grid)
    if not _come_back(problem.pull, problem.square, problem.bounds, steps, problem.highest, lows, highs):
        return None
    first = min(problem.start**2, float(highs[0]))
    if first < lows[0]:
        return None
    squares = np.full(highs.size, first)
    _go_on(problem.pull, problem.square, problem.bounds, steps, lows, highs, squares)
    speeds = np.sqrt(squares)
    least = LEAST_SHARE * problem.highest
    narrow = (speeds < least) & (np.sqrt(highs) > least)
    narrow[[0, -1]] = False
    return np.where(narrow, least, speeds)


@uncounted
def _come_back(  # noqa: PLR0917
    pull: FloatArray, square: FloatArray, bounds: FloatArray, steps: FloatArray, highest: FloatArray, lows: FloatArray,
    highs: FloatArray,
) -> bool:  # fmt: skip
    """Fill the (g,) intervals of squares from which the end is reached, but the last; return whether there are any."""
    for row in range(steps.size - 1, -1, -1):
        after = (lows[row + 1], highs[row + 1])
        most = _most(pull[row], square[row], bounds, highest[row] * highest[row])
        high = _outermost(pull[row], square[row], bounds, steps[row], after, most, -1.0)
        if not high >= 0.0:
            return False
        low = _outermost(pull[row], square[row], bounds, steps[row], after, 0.0, 1.0)
        lows[row], highs[row] = min(low, high), high
    return True


@uncounted
def _go_on(  # noqa: PLR0917
    pull: FloatArray, square: FloatArray, bounds: FloatArray, steps: FloatArray, lows: FloatArray, highs: FloatArray,
    squares: FloatArray,
) -> None:  # fmt: skip
    """Fill the (g,) largest squares, but the first."""
    for row in range(steps.size):
        after = (lows[row + 1], highs[row + 1])
        _, _, high, _ = _left(pull[row], square[row], bounds, steps[row], after, squares[row])
        squares[row + 1] = min(max(high, after[0]), after[1])


@inner
def _most(pull: FloatArray, square: FloatArray, bounds: FloatArray, most: float) -> float:
    """Return the largest square that is allowed by itself, whatever the acceleration is."""
    for k in range(bounds.size):
        if pull[k] == 0.0 and square[k] != 0.0:
            most = min(most, bounds[k] / abs(square[k]))
    return most


@inner
def _outermost(  # noqa: PLR0917
    pull: FloatArray, square: FloatArray, bounds: FloatArray, step: float, after: tuple[float, float], x: float,
    sense: float,
) -> float:  # fmt: skip
    """Return the first x that leaves a y, going from x up (sense 1) or down (-1); -1 where none does."""
    for _ in range(MOST_PIECES):
        low, rise_of_low, high, rise_of_high = _left(pull, square, bounds, step, after, x)
        if high - low >= -ROUNDING * (abs(low) + abs(high)):
            return x
        gain = (rise_of_high - rise_of_low) * sense
        if not gain > 0.0:
            return -1.0
        moved = x + sense * (low - high) / gain
        if moved == x:
            return x
        x = moved
        if x < 0.0:
            return -1.0
    return -1.0


@inner
def _left(  # noqa: PLR0917
    pull: FloatArray, square: FloatArray, bounds: FloatArray, step: float, after: tuple[float, float], x: float
) -> tuple[float, float, float, float]:
    """Return what the bands leave of y at an x: its least value, how that rises with x, and so its largest."""
    low, rise_of_low, high, rise_of_high = after[0], 0.0, after[1], 0.0
    for k in range(bounds.size):
        a = pull[k] / (2.0 * step)
        c = square[k] - a
        if a < 0.0:
            a, c = -a, -c
        if a == 0.0:
            continue
        least, most = (-bounds[k] - c * x) / a, (bounds[k] - c * x) / a
        if least > low:
            low, rise_of_low = least, -c / a
        if most < high:
            high, rise_of_high = most, -c / a
    return low, rise_of_low, high, rise_of_high
