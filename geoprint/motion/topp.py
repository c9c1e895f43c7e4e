"""The fastest motion along one piece of path, from rest to rest.

The path is a spline of the joints over a length s; what is sought is the speed v(s) at each point of a grid. Between
neighbouring grid points the path acceleration is constant, so that v^2 is linear in s. TOPP-RA [Pham2018] finds the
largest v that keeps the joint speeds, the joint accelerations and a ceiling on v itself. Its solver of small linear
programs wants lengths in metres: in millimetres it often fails.
"""

from __future__ import annotations

import logging
import warnings
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, final

import numpy as np
from scipy.interpolate import CubicSpline

from geoprint.errors import LimitError, UsageError
from geoprint.model import BoolArray, FloatArray, Robot

if TYPE_CHECKING:
    from types import ModuleType

    from toppra.constraint import ConstraintType

# Where nothing else bounds the path speed [m/s]: faster than any arm, small enough for the solver.
FASTEST = 10.0

# The solver keeps limits to rounding only; a motion that breaks them by less than this share is taken as it is.
STRETCH_TOLERANCE = 4e-3

# Grid points at each end of a piece, as shares of the length in which the set speed is reached from rest. That
# length is often far below the distance of the poses, and the speed between two grid points cannot bend.
RAMP_SHARES = np.array([0.2, 0.5, 1.0, 1.2, 2.0])

# A piece of few poses is divided until it has this many steps; its speed would be too coarse otherwise.
SMALLEST_GRID = 8

# Steps that break a limit between their ends are quartered this often, as long as they are few (share of all steps);
# on a path that is rough everywhere finer steps only cost time.
REFINEMENTS = 2
REFINED_SHARE = 0.1

# Grid points that would lie closer to each other than this share of the ramp are left out.
SMALLEST_STEP_SHARE = 0.02


@final
@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """One piece of the path in time, from rest to rest.

    Attributes:
        path: joint angles [rad] over the length s; differentiable twice.
        grid: (g,) s, ascending [m].
        speeds: (g,) ds/dt at each grid point [m/s]; 0 at both ends, positive between them.
        times: (g,) when each grid point is passed [s], from 0.
        stretched: whether it was slowed because a limit was broken between grid points.
    """

    path: CubicSpline[np.float64]
    grid: FloatArray
    speeds: FloatArray
    times: FloatArray
    stretched: bool

    @property
    def duration(self) -> float:
        """Time from rest to rest [s]."""
        return float(self.times[-1])

    def joints_at(self, times: FloatArray) -> FloatArray:
        """Return the (k, 6) joint angles [rad] at (k,) times [s] within the duration."""
        index = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, self.grid.size - 2)
        elapsed = times - self.times[index]
        acceleration = path_accelerations(self.grid, self.speeds)[index]
        place = self.grid[index] + (self.speeds[index] + 0.5 * acceleration * elapsed) * elapsed
        return self.path(np.clip(place, self.grid[0], self.grid[-1]))

    def times_at(self, places: FloatArray) -> FloatArray:
        """Return when grid points are passed [s], given their (k,) s exactly as in the grid."""
        return self.times[np.searchsorted(self.grid, places)]


def straight_motion(start: FloatArray, end: FloatArray, *, speeds: FloatArray, accelerations: FloatArray) -> Motion:
    """Move all joints together along a straight line of joint space, as MoveJ does.

    The slowest joint sets the pace: full acceleration, constant speed, full deceleration.

    Args:
        start: (6,) [rad].
        end: (6,) [rad], different from the start.
        speeds: (6,) limits [rad/s].
        accelerations: (6,) limits [rad/s2].

    Returns:
        The motion; its s is the share of the way.
    """
    way = np.abs(end - start)
    moved = way > 0.0
    top = float((speeds[moved] / way[moved]).min())
    acceleration = float((accelerations[moved] / way[moved]).min())
    ramp = min(top**2 / (2.0 * acceleration), 0.5)
    grid = np.unique([0.0, ramp, 1.0 - ramp, 1.0])
    path_speeds = np.sqrt(2.0 * acceleration * np.minimum(grid, 1.0 - grid)).clip(max=top)
    path = CubicSpline(np.array([0.0, 1.0]), np.stack([start, end]))
    return Motion(path, grid, path_speeds, _times(grid, path_speeds), stretched=False)


def fastest_motion(joints: FloatArray, lengths: FloatArray, *, ceilings: FloatArray, robot: Robot) -> Motion:
    """Pass given joint angles in the shortest time, from rest to rest.

    The joints are joined by a cubic spline with continuous second derivative. The result is checked at both ends and
    in the middle of each step of the grid. Where it breaks a limit at a few places it is sought again with finer steps
    there; what is left is healed by stretching the whole piece in time by the smallest factor c that does: speeds fall
    to 1/c, accelerations to 1/c^2.

    Args:
        joints: (n, 6) [rad], n at least 2.
        lengths: (n,) s of each row, strictly ascending from 0 [m].
        ceilings: (n - 1,) largest ds/dt between neighbouring rows [m/s]; infinite where only the joints count.
        robot: its joint speeds and accelerations are kept.

    Returns:
        The motion; every entry of `lengths` is one of its grid points.

    Raises:
        LimitError: no motion within the limits was found.
        UsageError: toppra is not installed.
    """
    path = CubicSpline(lengths, joints)
    grid = _grid(path, lengths, ceilings=ceilings, robot=robot)
    path_speeds, excess = _attempt(path, grid, _at_grid(ceilings, lengths, grid), robot=robot)
    for _ in range(REFINEMENTS):
        broken = excess > 1.0 + STRETCH_TOLERANCE
        if not 0.0 < broken.mean() <= REFINED_SHARE:
            break
        grid = _refined(grid, broken)
        path_speeds, excess = _attempt(path, grid, _at_grid(ceilings, lengths, grid), robot=robot)
    factor = float(excess.max())
    stretched = factor > 1.0 + STRETCH_TOLERANCE
    if stretched:
        path_speeds = path_speeds / factor
    return Motion(path, grid, path_speeds, _times(grid, path_speeds), stretched=stretched)


def path_accelerations(grid: FloatArray, speeds: FloatArray) -> FloatArray:
    """Return the (g - 1,) constant path accelerations between grid points [m/s2]."""
    return np.diff(speeds**2) / (2.0 * np.diff(grid))


def ramp_length(slope: FloatArray, *, ceiling: float, robot: Robot) -> float:
    """Return the length [m] in which the path speed rises from rest to its ceiling where the path is straight.

    Args:
        slope: (6,) dq/ds at the end of the piece [rad/m].
        ceiling: largest ds/dt [m/s].
        robot: its joint speeds and accelerations are kept.
    """
    top = min(ceiling, float(_joint_ceilings(slope[None], robot=robot)[0]), FASTEST)
    return top**2 / 2.0 * float((np.abs(slope) / robot.accelerations).max())


def _grid(path: CubicSpline[np.float64], lengths: FloatArray, *, ceilings: FloatArray, robot: Robot) -> FloatArray:
    """Return the knots of the path and points between them: both ramps, and the steps of a short piece."""
    total = lengths[-1]
    steps = -(-SMALLEST_GRID // (lengths.size - 1))
    shares = np.arange(steps) / steps
    grid = np.append((lengths[:-1, None] + np.diff(lengths)[:, None] * shares).ravel(), total)
    slopes = path(np.array([0.0, total]), 1)
    for slope, ceiling, end, sign in ((slopes[0], ceilings[0], 0.0, 1.0), (slopes[1], ceilings[-1], total, -1.0)):
        ramp = ramp_length(slope, ceiling=float(ceiling), robot=robot)
        points = end + sign * ramp * RAMP_SHARES[RAMP_SHARES * ramp < total / 2.0]
        right = np.searchsorted(grid, points).clip(1, grid.size - 1)
        distance = np.minimum(np.abs(grid[right] - points), np.abs(points - grid[right - 1]))
        grid = np.sort(np.concatenate([grid, points[distance > SMALLEST_STEP_SHARE * ramp]]))
    return grid


def _attempt(
    path: CubicSpline[np.float64], grid: FloatArray, ceilings: FloatArray, *, robot: Robot
) -> tuple[FloatArray, FloatArray]:
    """Return the (g,) fastest path speeds on a grid, and the (g - 1,) excess over the limits within its steps."""
    slopes, bends = path(grid, 1), path(grid, 2)
    highest = np.minimum(_joint_ceilings(slopes, robot=robot), ceilings).clip(max=FASTEST)
    path_speeds = _solve(grid, slopes, bends, highest=highest, accelerations=robot.accelerations)
    return path_speeds, _excess(path, grid, path_speeds, robot=robot)


def _joint_ceilings(slopes: FloatArray, *, robot: Robot) -> FloatArray:
    """Return the path speed at which the first joint reaches its limit, for (g, 6) slopes; infinite at rest."""
    with np.errstate(divide="ignore"):
        return (robot.speeds / np.abs(slopes)).min(axis=1)


def _at_grid(ceilings: FloatArray, lengths: FloatArray, grid: FloatArray) -> FloatArray:
    """Return the lower of the ceilings on both sides of each grid point."""
    last = ceilings.size - 1
    before = np.clip(np.searchsorted(lengths, grid, side="left") - 1, 0, last)
    after = np.clip(np.searchsorted(lengths, grid, side="right") - 1, 0, last)
    return np.minimum(ceilings[before], ceilings[after])


def _times(grid: FloatArray, speeds: FloatArray) -> FloatArray:
    """Return when each grid point is passed [s]: at constant acceleration the mean speed is that of both ends."""
    return np.concatenate([[0.0], np.cumsum(2.0 * np.diff(grid) / (speeds[1:] + speeds[:-1]))])


def _refined(grid: FloatArray, broken: BoolArray) -> FloatArray:
    """Return the grid with the broken steps and their neighbours quartered."""
    near = broken.copy()
    near[1:] |= broken[:-1]
    near[:-1] |= broken[1:]
    inside = grid[:-1][near, None] + np.diff(grid)[near, None] * np.array([0.25, 0.5, 0.75])
    return np.sort(np.concatenate([grid, inside.ravel()]))


def _excess(path: CubicSpline[np.float64], grid: FloatArray, path_speeds: FloatArray, *, robot: Robot) -> FloatArray:
    """Return by what factor the time of each step must be stretched to keep its limits; below 1 where there is room.

    Within a step the joint accelerations q' u + q'' v^2 are parabolas in s, as q' is one and q'' and v^2 are straight:
    start, middle and end give their exact extremes. Speeds are compared at the same three places.
    """
    squares = path_speeds**2
    pull = path_accelerations(grid, path_speeds)[:, None]
    rates: list[FloatArray] = []
    changes: list[FloatArray] = []
    for share in (0.0, 0.5, 1.0):
        place = grid[:-1] + share * np.diff(grid)
        square = (squares[:-1] + share * np.diff(squares))[:, None]
        slope = path(place, 1)
        rates.append((np.abs(slope) * np.sqrt(square) / robot.speeds).max(axis=1))
        changes.append(slope * pull + path(place, 2) * square)
    change = (_largest_of_parabola(*changes) / robot.accelerations).max(axis=1)
    return np.maximum.reduce([*rates, np.sqrt(change)])


def _largest_of_parabola(start: FloatArray, middle: FloatArray, end: FloatArray) -> FloatArray:
    """Return the largest absolute value of parabolas between their start and end, given their middle too."""
    slope = 4.0 * middle - 3.0 * start - end
    curve = 2.0 * (start + end) - 4.0 * middle
    with np.errstate(divide="ignore", invalid="ignore"):
        vertex = -slope / (2.0 * curve)
    vertex = np.where((vertex > 0.0) & (vertex < 1.0), vertex, 0.0)
    extreme = start + (slope + curve * vertex) * vertex
    return np.maximum.reduce([np.abs(start), np.abs(end), np.abs(extreme)])


def _solve(
    grid: FloatArray, slopes: FloatArray, bends: FloatArray, *, highest: FloatArray, accelerations: FloatArray
) -> FloatArray:
    """Return the (g,) highest path speeds [m/s] by TOPP-RA, interpolation scheme, Seidel solver."""
    toppra = _toppra()
    constraint = _Constraint(
        toppra.constraint.ConstraintType.CanonicalLinear,
        *_rows(grid, slopes, bends),
        np.tile(accelerations, 4),
        highest**2,
    )
    problem = toppra.algorithm.TOPPRA(
        [constraint], _Interval((grid[0], grid[-1])), gridpoints=grid, solver_wrapper="seidel",
        parametrizer="ParametrizeConstAccel",
    )  # fmt: skip
    _, found, _ = problem.compute_parameterization(0.0, 0.0)
    if found is None or not np.isfinite(found).all() or found[1:-1].min(initial=1.0) <= 0.0:
        raise LimitError(
            "no speed along the path keeps the joint accelerations: the path turns too sharply between its poses; "
            "smooth it, or let the tool stop at the corner."
        )
    return found


def _rows(grid: FloatArray, slopes: FloatArray, bends: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (g, 24) coefficients of path acceleration and squared speed in the joint accelerations, both signs.

    A step is held to its limits at both of its ends: at the far end the square of the speed has grown by twice the
    acceleration times the step.
    """
    pull, square = np.tile(slopes, 2), np.tile(bends, 2)
    pull[:-1, 6:] = slopes[1:] + 2.0 * np.diff(grid)[:, None] * bends[1:]
    square[:-1, 6:] = bends[1:]
    return np.hstack([pull, -pull]), np.hstack([square, -square])


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Interval:
    """What TOPP-RA asks of a path when the coefficients are already there."""

    path_interval: tuple[float, float]


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Constraint:
    """All limits of one piece in the form that TOPP-RA asks for: pull * u + square * x <= bounds, x <= highest."""

    constraint_type: ConstraintType
    pull: FloatArray
    square: FloatArray
    bounds: FloatArray
    highest: FloatArray
    identical: bool = True

    def get_constraint_type(self) -> ConstraintType:
        """Return the kind of the constraint: linear."""
        return self.constraint_type

    def compute_constraint_params(self, *_: object) -> tuple[FloatArray | None, ...]:
        """Return a, b, c, F, g, bounds of u, bounds of x, as `toppra.constraint.LinearConstraint` defines them."""
        offset = np.zeros_like(self.pull)
        squares = np.column_stack([np.zeros_like(self.highest), self.highest])
        return self.pull, self.square, offset, np.eye(self.bounds.size), self.bounds, None, squares


def _toppra() -> ModuleType:
    """Import toppra: late, because it pulls in matplotlib; quiet, because its docstrings and its log are not."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            module = import_module("toppra")
    except ImportError as error:
        raise UsageError(
            f"the robot chain needs toppra, which is not installed ({error}); run 'pip install toppra', or leave the "
            f"chain out with --no-robot."
        ) from error
    logging.getLogger("toppra").setLevel(logging.CRITICAL)
    return module
