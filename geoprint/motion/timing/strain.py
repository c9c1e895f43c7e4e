"""How much of the joints' limits a motion along a path uses."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.kernels import inner, uncounted
from geoprint.model import FloatArray, Robot, frozen

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


@final
@frozen
class GriddedPath:
    """How the joints turn along a path, at the points of a grid: what timing asks of it again and again.

    Attributes:
        grid: (g,) lengths s, ascending [m]; a step lies between two knots of the path.
        slopes: (g, 6) derivatives of the joint angles by s [rad/m].
        bends: (g, 6) second derivatives [rad/m2].
        middle_slopes: (g - 1, 6) derivatives in the middle of each step [rad/m].
    """

    grid: FloatArray
    slopes: FloatArray
    bends: FloatArray
    middle_slopes: FloatArray

    @classmethod
    def of(cls, path: CubicSpline[np.float64], grid: FloatArray) -> GriddedPath:
        """Look at joint angles [rad], a spline over s [m], at (g,) points that hold all its knots between them."""
        middle = grid[:-1] + 0.5 * np.diff(grid)
        return cls(grid, path(grid, 1), path(grid, 2), path(middle, 1))

    def between(self, first: int, last: int) -> GriddedPath:
        """Return the stretch from one grid point to another."""
        points = slice(first, last + 1)
        return GriddedPath(self.grid[points], self.slopes[points], self.bends[points], self.middle_slopes[first:last])


def path_accelerations(grid: FloatArray, speeds: FloatArray) -> FloatArray:
    """Return the (g - 1,) constant path accelerations between grid points [m/s2]."""
    return np.diff(speeds**2) / (2.0 * np.diff(grid))


def strains(path: GriddedPath, path_speeds: FloatArray, *, robot: Robot) -> FloatArray:
    """Return by what factor the time of each step must be stretched for each joint to keep its limits.

    Within a step the joint accelerations q' u + q'' v^2 are parabolas in s, as q' is one and q'' and v^2 are straight:
    start, middle and end give their exact extremes. Speeds are compared at the same three places.

    Args:
        path: on a grid of g points.
        path_speeds: (g,) ds/dt [m/s].
        robot: its joint speeds and accelerations are the limits.

    Returns:
        (g - 1, 12) factors: for the speeds of the joints, then for their accelerations; 1 is a limit just kept.
    """
    factors = np.empty((path.grid.size - 1, 2 * path.slopes.shape[1]))
    limits = np.concatenate([robot.speeds, robot.accelerations])
    _fill_factors(path.grid, path.slopes, path.bends, path.middle_slopes, path_speeds, limits, factors)
    return factors


def excess(path: GriddedPath, path_speeds: FloatArray, *, robot: Robot) -> FloatArray:
    """Return the (g - 1,) largest of the `strains` of each step; below 1 where there is room."""
    return strains(path, path_speeds, robot=robot).max(axis=1)


@uncounted
def _fill_factors(  # noqa: PLR0917
    grid: FloatArray, slopes: FloatArray, bends: FloatArray, middle_slopes: FloatArray, path_speeds: FloatArray,
    limits: FloatArray, factors: FloatArray,
) -> None:  # fmt: skip
    """Fill in the (g - 1, 12) factors, given the (12,) limits of speeds and accelerations."""
    joints = slopes.shape[1]
    for row in range(grid.size - 1):
        first, last = path_speeds[row] * path_speeds[row], path_speeds[row + 1] * path_speeds[row + 1]
        pull, square = (last - first) / (2.0 * (grid[row + 1] - grid[row])), 0.5 * (first + last)
        for joint in range(joints):
            slope, middle, after = slopes[row, joint], middle_slopes[row, joint], slopes[row + 1, joint]
            bend, next_bend = bends[row, joint], bends[row + 1, joint]
            rate = max(abs(slope * path_speeds[row]), abs(middle) * sqrt(square), abs(after * path_speeds[row + 1]))
            change = _largest_of_parabola(
                slope * pull + bend * first,
                middle * pull + 0.5 * (bend + next_bend) * square,
                after * pull + next_bend * last,
            )
            factors[row, joint] = rate / limits[joint]
            factors[row, joints + joint] = sqrt(change / limits[joints + joint])


@inner
def _largest_of_parabola(start: float, middle: float, end: float) -> float:
    """Return the largest absolute value of a parabola between its start and end, given its middle too."""
    slope = 4.0 * middle - 3.0 * start - end
    curve = 2.0 * (start + end) - 4.0 * middle
    vertex = -slope / (2.0 * curve)
    extreme = start + (slope + curve * vertex) * vertex if 0.0 < vertex < 1.0 else start
    return max(abs(start), abs(end), abs(extreme))
