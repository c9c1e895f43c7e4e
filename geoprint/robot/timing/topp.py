"""Time-optimal path parametrization: the fastest speed profile along one leg of path, from rest to rest."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.errors import LimitError
from geoprint.kernels import inner, uncounted
from geoprint.model import BoolArray, FloatArray, IntArray, Robot, frozen
from geoprint.robot.timing.confirmation import confirm
from geoprint.robot.timing.reachability import Problem, reachable_speeds

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


# How much of the joints' limits a motion along a path uses.


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


# The largest speeds along a path: its ceiling where the joints hold it, TOPP-RA around the rest.
#
# TOPP-RA [Pham2018] solves small linear programs at each grid point (`reachability`). Where the joints follow the
# path at its ceiling, nothing needs to be solved: a motion that has reached the ceiling stays there, and none is
# faster. So it solves only windows around both ends and around the places that need a lower speed, each from ceiling
# to ceiling; a window in which it cannot get from one to the other is widened. What is joined from them is what
# TOPP-RA finds for the whole path, for its solution is nowhere slower than any other.


# A window reaches at least this many steps and this many ramps beyond the steps that need it; where that proves too
# narrow, so many times as far.
PADDING_STEPS = 8
PADDING_RAMPS = 1.5
WIDENING = 4

# A ceiling is held where its joints stay below their limits by this share: rounding must not make it a matter of luck.
ROOM = 1e-6

# TOPP-RA quietly lowers a start speed that it cannot hold; by more than this share the window is too narrow.
LOWERED_START = 1e-6

# A hole in the speed is below this share of what a constant speed could be there. The ceilings of so many grid points
# on either side are lowered to that, at most so often.
HOLE_SHARE = 0.5
HOLE_REACH = 2
CALMINGS = 3

Window = tuple[int, int]


def largest_speeds(
    path: GriddedPath, *, highest: FloatArray, ramp: float, robot: Robot
) -> tuple[FloatArray, FloatArray]:
    """Return the highest path speeds under their ceilings, from rest to rest.

    Args:
        path: on a grid of g points.
        highest: (g,) ceilings of the path speed [m/s], above zero.
        ramp: about the length in which the speed rises from rest to its ceiling [m].
        robot: limits of the joints.

    Returns:
        (g,) speeds [m/s], 0 at both ends; and the (g - 1,) `excess` of each step: the limits hold at the grid points,
        between them they may be broken.

    Raises:
        LimitError: no motion within the limits was found.
    """
    strain = excess(path, highest, robot=robot)
    held = highest / np.maximum(1.0, np.maximum(np.append(strain, 0.0), np.append(0.0, strain)))
    speeds, reached = _attempted_speeds(path, strain, highest=highest, ramp=ramp, robot=robot)
    for _ in range(CALMINGS):
        near = _near_holes(speeds, held)
        if not near.any():
            break
        highest = np.where(near, held, highest)
        strain = excess(path, highest, robot=robot)
        speeds, reached = _attempted_speeds(path, strain, highest=highest, ramp=ramp, robot=robot)
    return speeds, reached


def _near_holes(speeds: FloatArray, held: FloatArray) -> BoolArray:
    """Tell which grid points are next to a hole: where speed falls to half of what holds there, and rises again.

    TOPP-RA takes the highest speed at each point; on a coarse grid only a very low one may be left for the next.
    """
    holes = np.zeros(speeds.size, dtype=np.bool_)
    inner = speeds[1:-1]
    holes[1:-1] = (inner < HOLE_SHARE * held[1:-1]) & (inner < speeds[:-2]) & (inner < speeds[2:])
    return np.convolve(holes, np.ones(2 * HOLE_REACH + 1), mode="same") > 0.0


def _attempted_speeds(
    path: GriddedPath, strain: FloatArray, *, highest: FloatArray, ramp: float, robot: Robot
) -> tuple[FloatArray, FloatArray]:
    """Return the speeds and their strain, given the (g - 1,) strain of the ceilings."""
    hard = strain > 1.0 - ROOM
    hard[[0, -1]] = True
    speeds, strain = highest.copy(), strain.copy()
    for (first, last), found in _solved_windows(path, hard, highest=highest, ramp=ramp, robot=robot).items():
        speeds[first : last + 1] = found
        strain[first:last] = excess(path.between(first, last), found, robot=robot)
    return speeds, strain


def _solved_windows(
    path: GriddedPath, hard: BoolArray, *, highest: FloatArray, ramp: float, robot: Robot
) -> dict[Window, FloatArray]:
    """Return the speeds in the windows that hold all (g - 1,) hard steps; windows have no step in common."""
    solved: dict[Window, FloatArray] = {}
    steps, grid = np.flatnonzero(hard), path.grid
    windows = _padded(grid, np.column_stack([steps, steps + 1]), steps=PADDING_STEPS, length=PADDING_RAMPS * ramp)
    widening = WIDENING
    while True:
        kept = {window: solved[window] for window in windows if window in solved}
        found = {
            window: _solve(path, *window, highest=highest, accelerations=robot.accelerations)
            for window in windows
            if window not in kept
        }
        solved = kept | {window: speeds for window, speeds in found.items() if speeds is not None}
        failed = [window for window in windows if window not in solved]
        if not failed:
            return solved
        if (0, grid.size - 1) in failed:
            raise LimitError(
                "no speed keeps the joint accelerations: the path turns too sharply between its poses. Smooth it, or "
                "let the tool stop at the corner."
            )
        wider = _padded(grid, np.array(failed), steps=widening * PADDING_STEPS, length=widening * PADDING_RAMPS * ramp)
        windows = _merged(np.array([*solved, *wider]))
        widening *= WIDENING


def _padded(grid: FloatArray, windows: IntArray, *, steps: int, length: float) -> list[Window]:
    """Return windows (w, 2) of grid points widened at both ends by steps and by a length [m], the larger counts."""
    first = np.minimum(windows[:, 0] - steps, np.searchsorted(grid, grid[windows[:, 0]] - length))
    last = np.maximum(windows[:, 1] + steps, np.searchsorted(grid, grid[windows[:, 1]] + length))
    return _merged(np.column_stack([first, last]).clip(0, grid.size - 1))


def _merged(windows: IntArray) -> list[Window]:
    """Return windows (w, 2) in their order, those that overlap or touch as one."""
    windows = windows[np.argsort(windows[:, 0], kind="stable")]
    reached = np.maximum.accumulate(windows[:, 1])
    begins = np.concatenate([[True], windows[1:, 0] > reached[:-1]])
    ends = np.append(np.flatnonzero(begins)[1:] - 1, len(windows) - 1)
    return list(zip(windows[begins, 0].tolist(), reached[ends].tolist(), strict=True))


def _solve(
    path: GriddedPath, first: int, last: int, *, highest: FloatArray, accelerations: FloatArray
) -> FloatArray | None:
    """Return the highest path speeds [m/s] from one grid point to another by TOPP-RA, or None where there are none.

    The ends of the whole grid are at rest, those of a window inside it at their ceilings.
    """
    ceilings = highest[first : last + 1]
    start = 0.0 if first == 0 else float(ceilings[0])
    end = 0.0 if last == path.grid.size - 1 else float(ceilings[-1])
    posed = problem(path.between(first, last), highest=ceilings, accelerations=accelerations, start=start, end=end)
    found = reachable_speeds(posed)
    if found is None or found[1:-1].min(initial=1.0) <= 0.0 or found[0] < (1.0 - LOWERED_START) * start:
        return None
    return found


def problem(path: GriddedPath, *, highest: FloatArray, accelerations: FloatArray, start: float, end: float) -> Problem:
    """Return what the joints allow on a grid along a path.

    Args:
        path: on a grid of g points.
        highest: (g,) ceilings of the path speed [m/s], above zero.
        accelerations: (6,) limits of the joints [rad/s2].
        start: speed at the first point [m/s].
        end: speed at the last one [m/s].
    """
    pull, square = _rows(path)
    return Problem(pull, square, np.tile(accelerations, 2), grid=path.grid, highest=highest, start=start, end=end)


def _rows(path: GriddedPath) -> tuple[FloatArray, FloatArray]:
    """Return (g, 12) coefficients of path acceleration and squared speed in the joint accelerations.

    A step is held to its limits at both of its ends: at the far end the square of the speed has grown by twice the
    acceleration times the step.
    """
    pull, square = np.tile(path.slopes, 2), np.tile(path.bends, 2)
    pull[:-1, 6:] = path.slopes[1:] + 2.0 * np.diff(path.grid)[:, None] * path.bends[1:]
    square[:-1, 6:] = path.bends[1:]
    return pull, square


# The fastest motion along one leg of path, from rest to rest.
#
# The path is a spline of the joints over a length s; what is sought is the speed v(s) at each point of a grid.
# Between neighbouring grid points the path acceleration is constant, so that v^2 is linear in s. Sought is the
# largest v that keeps the joint speeds, the joint accelerations and a ceiling on v itself.


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
