"""Which poses are written as targets: few enough for the controller, close enough to the path.

All poses of `required_poses` are kept. Between them the straight move (slerp for the attitude) from one target to
the next stays within `tolerance` and 0.1 degrees of every pose left out, and turns by at most 90 degrees. Of all
such chains of moves that one is taken (`cheapest_chain`) in which no move is shorter than 12 ms, then fewest are
shorter than `period`, then fewest leave the poses by more than a quarter of the tolerances. Where a run begins in
the place where the one before ends (a run that was split, or a neighbour right beside it), that place is a target
once, of the run that begins: no move is shorter than 0.001 mm but for turns on the spot.

Where material is laid in bends so tight that moves are still shorter than the period, moves may be longer and the
targets stand outside of the bend (`fitting`): the controller's rounded corner passes the pose that a target stands
for, and stays within `tolerance` of the poses left out. Such bends are listed, and those that stay closer than
12 ms.

Zones are 0 at stops, which are fine points, and at the first and last target of each run, because whoever resumes
at a run comes from elsewhere; else half the distance to the nearer neighbour, at most 0.3 mm. A target with a
neighbour in the same place (a turn on the spot) has zone 0 as well. Speeds give the time of each move over the
length of the controller's path, and are at most those of the process; where a move holds the ramp at a stop, they
are its mean.
"""

from __future__ import annotations

import numpy as np

from geoprint.errors import UsageError
from geoprint.model import (
    BoolArray,
    FloatArray,
    IntArray,
    JointPath,
    PoseStream,
    Process,
    Targets,
    Trajectory,
)
from geoprint.motion.controller.bends import bends_of
from geoprint.motion.controller.choice import TIME_ROUNDING
from geoprint.motion.controller.fitting import COINCIDENT, rounded_lengths, zones_of
from geoprint.motion.controller.rounded_chain import Course, rounded_chain
from geoprint.motion.reach import bead_steps, tip_lengths, turns
from geoprint.transforms import same_sign

# Largest angle [rad] between a pose left out and the attitude of the straight move past it: at the end of a 120 mm tool
# it moves the flange by 0.2 mm.
ANGLE_TOLERANCE = float(np.radians(0.1))

# No move that lays material is shorter than this [s] where the path allows it: controllers answer shorter ones with
# corner path failures.
SHORTEST_TIME = 0.012

# Speeds are rounded to so many digits, and never below the smallest [mm/s]: a controller needs one above zero.
SPEED_DIGITS = 4
SMALLEST_SPEED = 0.1

# A corner that is cut is a shorter path; the tip is slowed for it by no more than to this share.
EVEN_SHARE = 0.98

# No move is written that neither goes as far as this [mm], a tenth of what an arm repeats, nor turns the tool by this
# [rad], which moves the flange of a 120 mm tool by half of what an arm repeats.
SHORTEST_MOVE = 1e-3
SMALLEST_TURN = 5e-5


def written_targets(
    joint_path: JointPath,
    trajectory: Trajectory,
    *,
    process: Process,
    tolerance: float = 0.01,
    period: float = 0.02,
) -> Targets:
    """Choose the poses that the program names, and how the controller passes them.

    The module says how. The move to the first target has the travel speed.

    Args:
        joint_path: p poses.
        trajectory: when they are passed.
        process: speeds of the tip.
        tolerance: largest distance of a pose from the written path [mm].
        period: time between targets that the controller takes without slowing down [s].

    Returns:
        The targets.

    Raises:
        UsageError: tolerance or period are not positive.
    """
    if not (tolerance > 0.0 and period > 0.0):
        raise UsageError(
            f"targets need a positive tolerance and period, found {tolerance:g} mm and {period:g} s; the usual values "
            "are 0.01 mm and 0.02 s.",
            tolerance_mm=tolerance, period_s=period,
        )  # fmt: skip
    poses = joint_path.poses
    kept = np.flatnonzero(~_repeated(poses))
    course = _course(poses, kept, trajectory.pose_times, tolerance=tolerance, period=period)
    rows, places = rounded_chain(course)
    chosen, moved = kept[rows], np.flatnonzero((places != course.tips[rows]).any(axis=1))
    zones = zones_of(places, course.resting(rows), moved=(places != course.tips[rows]).any(axis=1))
    lengths = rounded_lengths(course.tips, rows, places, zones)
    return Targets(
        poses=chosen,
        zones=zones,
        speeds=_speeds(poses, chosen, trajectory.pose_times, lengths=lengths, process=process),
        moved=moved,
        places=places[moved],
        bends=bends_of(poses, chosen, trajectory.pose_times, places=places, shortest=SHORTEST_TIME),
    )


def _course(poses: PoseStream, kept: IntArray, times: FloatArray, *, tolerance: float, period: float) -> Course:
    """Return the course of the poses of a stream that go somewhere."""
    return Course(
        tips=poses.tips[kept],
        quaternions=same_sign(poses.quaternions)[kept],
        times=times[kept],
        required=np.searchsorted(kept, required_poses(poses)),
        runs=poses.runs[kept],
        rests=(poses.stops | _switches(poses))[kept],
        laid=poses.laid[kept[:-1]],
        tolerance=tolerance,
        turn=ANGLE_TOLERANCE,
        periods=(min(SHORTEST_TIME, period), period),
    )


def close_targets(targets: Targets, trajectory: Trajectory, *, period: float) -> tuple[int, float]:
    """Tell where the tolerance or a stop puts targets closer together in time than the controller digests.

    Args:
        targets: that are written.
        trajectory: when their poses are passed.
        period: time between targets that the controller takes without slowing down [s].

    Returns:
        How many targets come sooner than that after the one before, and the smallest time between two [s].
    """
    times = np.diff(trajectory.pose_times[targets.poses])
    return int((times < period * (1.0 - TIME_ROUNDING)).sum()), float(times.min(initial=np.inf))


def required_poses(poses: PoseStream) -> IntArray:
    """Return the poses that must be targets: first, last, all stops, and where deposit begins or ends.

    Where one of them follows another in the same place and attitude, as a run begins where the one before ended, only
    the later one is meant.
    """
    required = poses.stops | _switches(poses)
    required[[0, -1]] = True
    return np.flatnonzero(required & ~_repeated(poses))


def _repeated(poses: PoseStream) -> BoolArray:
    """Tell which poses but the first one a stop or switch repeats right after it, so that a move would go nowhere."""
    switches = _switches(poses)
    same = (tip_lengths(poses) < SHORTEST_MOVE) & (turns(poses) < SMALLEST_TURN)
    repeated = np.append(same & (poses.stops | switches)[1:], np.False_) & ~switches
    repeated[0] = False
    return repeated


def _switches(poses: PoseStream) -> BoolArray:
    """Tell at which poses laying begins or ends."""
    laid = np.concatenate([[False], poses.laid, [False]])
    return laid[1:] != laid[:-1]


def _speeds(
    poses: PoseStream, chosen: IntArray, times: FloatArray, *, lengths: FloatArray, process: Process
) -> FloatArray:
    """Return the speed of the move to each target [mm/s], given the lengths of the controller's path."""
    passed, beads = (np.append([0.0], np.cumsum(each)) for each in (tip_lengths(poses), bead_steps(poses)))
    paths, durations = np.diff(passed[chosen]), np.diff(times[chosen])
    # Over a bulge the tip goes farther than the bead, whose speed is that of the process.
    farther = np.where(paths < COINCIDENT, 1.0, paths / np.maximum(np.diff(beads[chosen]), COINCIDENT))
    lengths = np.clip(lengths, EVEN_SHARE * paths, paths)
    planned = np.where(poses.laid[chosen[:-1]], process.speed * farther, process.travel_speed)
    turning = (lengths < COINCIDENT) | (durations <= 0.0)
    mean = np.where(turning, planned, lengths / np.where(turning, 1.0, durations))
    steps = 10.0 ** (SPEED_DIGITS - 1 - np.floor(np.log10(np.maximum(mean, SMALLEST_SPEED))))
    rounded = np.round(mean * steps) / steps
    return np.append([process.travel_speed], np.minimum(planned, np.maximum(rounded, SMALLEST_SPEED)))
