"""How much of the joints' limits a motion along a path uses."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from geoprint.model import FloatArray, Robot


def path_accelerations(grid: FloatArray, speeds: FloatArray) -> FloatArray:
    """Return the (g - 1,) constant path accelerations between grid points [m/s2]."""
    return np.diff(speeds**2) / (2.0 * np.diff(grid))


def strains(
    path: CubicSpline[np.float64], grid: FloatArray, path_speeds: FloatArray, *, robot: Robot
) -> tuple[FloatArray, FloatArray]:
    """Return by what factor the time of each step must be stretched for each joint to keep its limits.

    Within a step the joint accelerations q' u + q'' v^2 are parabolas in s, as q' is one and q'' and v^2 are straight:
    start, middle and end give their exact extremes. Speeds are compared at the same three places.

    Args:
        path: joint angles [rad] over the length s; a step lies between two of its knots.
        grid: (g,) s, ascending [m].
        path_speeds: (g,) ds/dt [m/s].
        robot: its joint speeds and accelerations are the limits.

    Returns:
        (g - 1, 6) factors for the speeds, and for the accelerations; 1 is a limit that is just kept.
    """
    squares = path_speeds**2
    pull = path_accelerations(grid, path_speeds)[:, None]
    # The slopes and bends at the ends of neighbouring steps are the same: they are evaluated once.
    slopes, bends, roots = path(grid, 1), path(grid, 2), np.abs(path_speeds)[:, None]
    middle = grid[:-1] + 0.5 * np.diff(grid)
    slope = path(middle, 1)
    square = (0.5 * (squares[:-1] + squares[1:]))[:, None]
    changes = _largest_of_parabola(
        slopes[:-1] * pull + bends[:-1] * squares[:-1, None],
        slope * pull + 0.5 * (bends[:-1] + bends[1:]) * square,
        slopes[1:] * pull + bends[1:] * squares[1:, None],
    )
    at_ends = np.abs(slopes) * roots
    rates = np.maximum.reduce([at_ends[:-1], np.abs(slope) * np.sqrt(square), at_ends[1:]])
    return rates / robot.speeds, np.sqrt(changes / robot.accelerations)


def excess(path: CubicSpline[np.float64], grid: FloatArray, path_speeds: FloatArray, *, robot: Robot) -> FloatArray:
    """Return the (g - 1,) largest of the `strains` of each step; below 1 where there is room."""
    rates, changes = strains(path, grid, path_speeds, robot=robot)
    return np.maximum(rates.max(axis=1), changes.max(axis=1))


def _largest_of_parabola(start: FloatArray, middle: FloatArray, end: FloatArray) -> FloatArray:
    """Return the largest absolute value of parabolas between their start and end, given their middle too."""
    slope = 4.0 * middle - 3.0 * start - end
    curve = 2.0 * (start + end) - 4.0 * middle
    with np.errstate(divide="ignore", invalid="ignore"):
        vertex = -slope / (2.0 * curve)
    vertex = np.where((vertex > 0.0) & (vertex < 1.0), vertex, 0.0)
    extreme = start + (slope + curve * vertex) * vertex
    return np.maximum.reduce([np.abs(start), np.abs(end), np.abs(extreme)])
