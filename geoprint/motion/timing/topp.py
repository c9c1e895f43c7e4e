"""The fastest motion along one leg of path, from rest to rest.

The path is a spline of the joints over a length s; what is sought is the speed v(s) at each point of a grid. Between
neighbouring grid points the path acceleration is constant, so that v^2 is linear in s. Sought is the largest v that
keeps the joint speeds, the joint accelerations and a ceiling on v itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.model import BoolArray, FloatArray, Robot, frozen
from geoprint.motion.timing.confirmation import confirm
from geoprint.motion.timing.path_speeds import largest_speeds, problem
from geoprint.motion.timing.strain import GriddedPath, path_accelerations

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

# Where nothing else bounds the path speed [m/s]: faster than any arm, small enough for the solver.
FASTEST = 10.0

# The solver keeps limits to rounding only; a motion that breaks them by less than this share is taken as it is.
STRETCH_TOLERANCE = 4e-3

# Grid points at each end of a leg, as shares of the length in which the set speed is reached from rest. That
# length is often far below the distance of the poses, and the speed between two grid points cannot bend.
RAMP_SHARES = np.array([0.2, 0.5, 1.0, 1.2, 2.0])

# A leg of few poses is divided until it has this many steps; its speed would be too coarse otherwise.
SMALLEST_GRID = 8

# Steps that break a limit between their ends are quartered, with their neighbours, at most this often.
REFINEMENTS = 4

# Grid points that would lie closer to each other than this share of the ramp are left out.
SMALLEST_STEP_SHARE = 0.02

# Steps of a leg that a second solver is asked about: it takes a thousand times as long for each.
MOST_CONFIRMED = 300


@final
@frozen
class Motion:
    """One leg of the path in time, from rest to rest.

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
        The motion; its s is the share of the line.
    """
    from scipy.interpolate import CubicSpline

    turned = np.abs(end - start)
    moved = turned > 0.0
    top = float((speeds[moved] / turned[moved]).min())
    acceleration = float((accelerations[moved] / turned[moved]).min())
    ramp = min(top**2 / (2.0 * acceleration), 0.5)
    grid = np.unique([0.0, ramp, 1.0 - ramp, 1.0])
    path_speeds = np.sqrt(2.0 * acceleration * np.minimum(grid, 1.0 - grid)).clip(max=top)
    path = CubicSpline(np.array([0.0, 1.0]), np.stack([start, end]))
    return Motion(path, grid, path_speeds, _times(grid, path_speeds), stretched=False)


def fastest_motion(joints: FloatArray, lengths: FloatArray, *, ceilings: FloatArray, robot: Robot) -> Motion:
    """Pass given joint angles in the shortest time, from rest to rest.

    The joints are joined by a cubic spline with continuous second derivative. The result is checked at both ends and
    in the middle of each step of the grid. Where it breaks a limit at a few places it is sought again with finer steps
    there; what is left is healed by stretching the whole leg in time by the smallest factor c that does: speeds fall
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
    """
    from scipy.interpolate import CubicSpline

    path = CubicSpline(lengths, joints)
    ramps = end_ramps(path, ceilings=ceilings, robot=robot)
    grid = _grid(lengths, ramps=ramps)
    path_speeds, strain = _attempt(path, grid, at_grid(ceilings, lengths, grid), ramp=max(ramps), robot=robot)
    for _ in range(REFINEMENTS):
        broken = strain > 1.0 + STRETCH_TOLERANCE
        if not broken.any():
            break
        grid = _refined(grid, broken)
        path_speeds, strain = _attempt(path, grid, at_grid(ceilings, lengths, grid), ramp=max(ramps), robot=robot)
    factor = float(strain.max())
    stretched = factor > 1.0 + STRETCH_TOLERANCE
    if stretched:
        path_speeds = path_speeds / factor
    return Motion(path, grid, path_speeds, _times(grid, path_speeds), stretched=stretched)


def confirm_motion(motion: Motion, lengths: FloatArray, *, ceilings: FloatArray, robot: Robot) -> bool:
    """Let a second solver find the speeds along the beginning of a leg.

    Args:
        motion: as `fastest_motion` gave it.
        lengths: as it was asked; and so the others.
        ceilings: (n - 1,) [m/s].
        robot: its limits.

    Returns:
        Whether the second one found a motion.

    Raises:
        VerificationError: it finds lower speeds.
        UsageError: it cannot be imported.
    """
    last = min(motion.grid.size - 1, MOST_CONFIRMED)
    path, speeds = GriddedPath.of(motion.path, motion.grid[: last + 1]), motion.speeds[: last + 1]
    highest = _highest(path, at_grid(ceilings, lengths, motion.grid)[: last + 1], robot=robot)
    posed = problem(path, highest=highest, accelerations=robot.accelerations, start=0.0, end=float(speeds[-1]))
    return confirm(posed, speeds)


def end_ramps(path: CubicSpline[np.float64], *, ceilings: FloatArray, robot: Robot) -> tuple[float, float]:
    """Return the lengths [m] in which the path speed would rise to its ceiling, and fall from it, on a straight path.

    Args:
        path: joint angles [rad] over the length s.
        ceilings: (n - 1,) largest ds/dt between neighbouring knots [m/s]; the first and the last one count.
        robot: its joint speeds and accelerations are kept.
    """
    slopes = path(path.x[[0, -1]], 1)
    tops = np.minimum(_joint_ceilings(slopes, robot=robot), ceilings[[0, -1]]).clip(max=FASTEST)
    start, end = tops**2 / 2.0 * (np.abs(slopes) / robot.accelerations).max(axis=1)
    return float(start), float(end)


def at_grid(ceilings: FloatArray, lengths: FloatArray, grid: FloatArray) -> FloatArray:
    """Return the lower of the (n - 1,) ceilings on both sides of each grid point, given the (n,) knots."""
    last = ceilings.size - 1
    before = np.clip(np.searchsorted(lengths, grid, side="left") - 1, 0, last)
    after = np.clip(np.searchsorted(lengths, grid, side="right") - 1, 0, last)
    return np.minimum(ceilings[before], ceilings[after])


def _grid(lengths: FloatArray, *, ramps: tuple[float, float]) -> FloatArray:
    """Return the knots of the path and points between them: both ramps, and the steps of a short leg."""
    total = lengths[-1]
    steps = -(-SMALLEST_GRID // (lengths.size - 1))
    shares = np.arange(steps) / steps
    grid = np.append((lengths[:-1, None] + np.diff(lengths)[:, None] * shares).ravel(), total)
    for ramp, end, sign in ((ramps[0], 0.0, 1.0), (ramps[1], total, -1.0)):
        points = end + sign * ramp * RAMP_SHARES[RAMP_SHARES * ramp < total / 2.0]
        right = np.searchsorted(grid, points).clip(1, grid.size - 1)
        distance = np.minimum(np.abs(grid[right] - points), np.abs(points - grid[right - 1]))
        grid = np.sort(np.concatenate([grid, points[distance > SMALLEST_STEP_SHARE * ramp]]))
    return grid


def _attempt(
    path: CubicSpline[np.float64], grid: FloatArray, ceilings: FloatArray, *, ramp: float, robot: Robot
) -> tuple[FloatArray, FloatArray]:
    """Return the (g,) fastest path speeds on a grid, and the (g - 1,) excess over the limits within its steps."""
    gridded = GriddedPath.of(path, grid)
    return largest_speeds(gridded, highest=_highest(gridded, ceilings, robot=robot), ramp=ramp, robot=robot)


def _highest(path: GriddedPath, ceilings: FloatArray, *, robot: Robot) -> FloatArray:
    """Return the (g,) speeds that neither the (g,) ceilings nor the joint speeds allow to exceed [m/s]."""
    return np.minimum(_joint_ceilings(path.slopes, robot=robot), ceilings).clip(max=FASTEST)


def _joint_ceilings(slopes: FloatArray, *, robot: Robot) -> FloatArray:
    """Return the path speed at which the first joint reaches its limit, for (g, 6) slopes; infinite at rest."""
    with np.errstate(divide="ignore"):
        return (robot.speeds / np.abs(slopes)).min(axis=1)


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
