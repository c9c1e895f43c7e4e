"""The largest speeds along a path: its ceiling where the joints hold it, TOPP-RA around the rest.

TOPP-RA [Pham2018] solves small linear programs at each grid point (`reachability`). Where the joints follow the path at
its ceiling, nothing needs to be solved: a motion that has reached the ceiling stays there, and none is faster. So it
solves only windows around both ends and around the places that need a lower speed, each from ceiling to ceiling; a
window in which it cannot get from one to the other is widened. What is joined from them is what TOPP-RA finds for the
whole path, for its solution is nowhere slower than any other.
"""

from __future__ import annotations

import numpy as np

from geoprint.errors import LimitError
from geoprint.model import BoolArray, FloatArray, IntArray, Robot
from geoprint.motion.timing.reachability import Problem, reachable_speeds
from geoprint.motion.timing.strain import GriddedPath, excess

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
    speeds, reached = _attempt(path, strain, highest=highest, ramp=ramp, robot=robot)
    for _ in range(CALMINGS):
        near = _near_holes(speeds, held)
        if not near.any():
            break
        highest = np.where(near, held, highest)
        strain = excess(path, highest, robot=robot)
        speeds, reached = _attempt(path, strain, highest=highest, ramp=ramp, robot=robot)
    return speeds, reached


def _near_holes(speeds: FloatArray, held: FloatArray) -> BoolArray:
    """Tell which grid points are next to a hole: where speed falls to half of what holds there, and rises again.

    TOPP-RA takes the highest speed at each point; on a coarse grid only a very low one may be left for the next.
    """
    holes = np.zeros(speeds.size, dtype=np.bool_)
    inner = speeds[1:-1]
    holes[1:-1] = (inner < HOLE_SHARE * held[1:-1]) & (inner < speeds[:-2]) & (inner < speeds[2:])
    return np.convolve(holes, np.ones(2 * HOLE_REACH + 1), mode="same") > 0.0


def _attempt(
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
                "no speed along the path keeps the joint accelerations: the path turns too sharply between its poses; "
                "smooth it, or let the tool stop at the corner."
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
