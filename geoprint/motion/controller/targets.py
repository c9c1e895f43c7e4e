"""Which poses are written as targets: few enough for the controller, close enough to the path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from geoprint.errors import UsageError
from geoprint.model import BoolArray, FloatArray, IntArray, JointPath, PoseStream, Process, Targets, Trajectory
from geoprint.motion.reach import tip_lengths, turns
from geoprint.transforms import same_sign

# Largest angle [rad] between a pose left out and the attitude of the straight move past it: at the end of a 120 mm tool
# it moves the flange by 0.2 mm.
ANGLE_TOLERANCE = float(np.radians(0.1))

# Share of the tolerances that is used up as long as the rate of targets allows: the closer, the better.
FINE_SHARE = 0.25

# Largest radius in which the controller may round a target [mm]: below half a bead, however wide the targets stand.
LARGEST_ZONE = 0.3

# Speeds are rounded to these decimals, and never below the smallest [mm/s]: a controller needs one above zero.
SPEED_DECIMALS = 1
SMALLEST_SPEED = 0.5

# Steps of the tip below this [mm] are turns on the spot; their speed is that of the tool's turning.
COINCIDENT = 1e-6

# No move is written that neither goes as far as this [mm], a tenth of what an arm repeats, nor turns the tool by this
# [rad], which moves the flange of a 120 mm tool by half of what an arm repeats.
SHORTEST_MOVE = 1e-3
SMALLEST_TURN = 5e-5

# A straight move turns the tool in the shorter direction; far below half a turn [rad] nobody can take it for the other.
LARGEST_TURN = float(np.radians(90.0))

# Share of the period by which times of targets that keep it may seem shorter.
TIME_ROUNDING = 1e-9

# Quaternions closer than this [rad] are interpolated straight: slerp would divide by nearly zero, and the straight line
# is off by less than 1e-6 rad.
SMALL_TURN = 1e-3


def written_targets(
    joint_path: JointPath,
    trajectory: Trajectory,
    *,
    process: Process,
    tolerance: float = 0.01,
    period: float = 0.02,
) -> Targets:
    """Choose the poses that the program names, and how the controller passes them.

    All poses of `required_poses` are kept. Between them the straight move (slerp for the attitude) from one target to
    the next stays within `tolerance` and 0.1 degrees of every pose left out, and turns by at most 90 degrees. From
    each target the next one is the farthest pose within a quarter of that; where this would come sooner than `period`
    after it, the first pose that is late enough, or, if that is out of tolerance, the farthest one within it: the
    tolerance wins, and `close_targets` counts where. Where a run begins in the place where the one before ends (a run
    that was split, or a neighbour right beside it), that place is a target once, of the run that begins: no move is
    shorter than 0.001 mm but for turns on the spot.

    Zones are 0 at stops, which are fine points, and at the first and last target of each run, because whoever resumes
    at a run comes from elsewhere; else half the distance to the nearer neighbour, at most 0.3 mm. A target with a
    neighbour in the same place (a turn on the spot) has zone 0 as well. Speeds are those of the process, or the mean
    speed of the tip up to the target where the trajectory is slower there: where joints limit it, and where the move
    holds the ramp at a stop. The move to the first target has the travel speed.

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
    chosen = _thinned(poses, trajectory.pose_times, tolerance=tolerance, period=period)
    return Targets(
        poses=chosen,
        zones=_zones(poses, chosen),
        speeds=_speeds(poses, chosen, trajectory.pose_times, process=process),
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


def _thinned(poses: PoseStream, times: FloatArray, *, tolerance: float, period: float) -> IntArray:
    kept = np.flatnonzero(~_repeated(poses))
    times = times[kept]
    course = _Course(poses.tips[kept], same_sign(poses.quaternions)[kept], tolerance)
    late = np.searchsorted(times, times + period)
    required = np.searchsorted(kept, required_poses(poses)).tolist()
    chosen = required[:1]
    for last in required[1:]:
        while chosen[-1] < last:
            at = chosen[-1]
            soonest = min(int(late[at]), last)
            farthest = course.farthest(at, last, share=FINE_SHARE)
            chosen.append(farthest if farthest >= soonest else course.farthest(at, soonest, share=1.0))
    return kept[chosen]


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Course:
    """The path of the tool, and how far straight moves may leave it.

    Attributes:
        tips: (p, 3) [mm].
        quaternions: (p, 4) of one sign from pose to pose.
        tolerance: largest distance of a pose from a straight move [mm].
    """

    tips: FloatArray
    quaternions: FloatArray
    tolerance: float

    def farthest(self, first: int, last: int, *, share: float) -> int:
        """Return the farthest pose up to the last to which a straight move keeps a share of the tolerances.

        The distance is doubled as long as this holds, then halved in; where a move is out of tolerance but a longer
        one would not be, the shorter move is taken.
        """
        good, length = first + 1, 2
        while good < last and self.deviation(first, min(first + length, last)) <= share:
            good = min(first + length, last)
            length *= 2
        bad = min(first + length, last + 1)
        while bad - good > 1:
            middle = (good + bad) // 2
            good, bad = (middle, bad) if self.deviation(first, middle) <= share else (good, middle)
        return good

    def deviation(self, first: int, last: int) -> float:
        """Return the largest deviation of the poses between two from the straight move, by the tolerances.

        A pose belongs to the place of the move that is nearest to its tip; where the tip stays in place, to the one
        whose turn is nearest to its own.
        """
        tips, quaternions = self.tips, self.quaternions
        turn = 2.0 * float(np.arcsin(min(float(np.linalg.norm(quaternions[last] - quaternions[first])) / 2.0, 1.0)))
        if turn > LARGEST_TURN / 2.0:
            return np.inf
        line, offsets = tips[last] - tips[first], tips[first + 1 : last] - tips[first]
        between = quaternions[first + 1 : last]
        square = float(line @ line)
        if square > COINCIDENT**2:
            places = (offsets @ line / square).clip(0.0, 1.0)
        else:
            places = _turned_shares(quaternions[first], quaternions[last], between, turn=turn)
        missed = offsets - places[:, None] * line
        turned = between - _slerp(quaternions[first], quaternions[last], places, turn=turn)
        distance = float(np.einsum("ij,ij->i", missed, missed).max(initial=0.0)) ** 0.5
        angle = 2.0 * float(np.einsum("ij,ij->i", turned, turned).max(initial=0.0)) ** 0.5
        return max(distance / self.tolerance, angle / ANGLE_TOLERANCE)


def _slerp(start: FloatArray, end: FloatArray, shares: FloatArray, *, turn: float) -> FloatArray:
    """Return (k, 4) quaternions between one and another, `turn` [rad] apart; straight where that is small."""
    if turn < SMALL_TURN:
        return start + shares[:, None] * (end - start)
    weights = np.sin(turn * np.column_stack([1.0 - shares, shares])) / np.sin(turn)
    return weights @ np.stack([start, end])


def _turned_shares(start: FloatArray, end: FloatArray, between: FloatArray, *, turn: float) -> FloatArray:
    """Return the shares of the slerp from one quaternion to another, `turn` [rad] apart, nearest to (k, 4) others."""
    if turn == 0.0:
        return np.zeros(len(between))
    across = (end - np.cos(turn) * start) / np.sin(turn)
    return (np.arctan2(between @ across, between @ start) / turn).clip(0.0, 1.0)


def _zones(poses: PoseStream, chosen: IntArray) -> FloatArray:
    distances = np.linalg.norm(np.diff(poses.tips[chosen], axis=0), axis=1)
    nearer = np.minimum(np.append(distances, 0.0), np.append([0.0], distances))
    borders = np.diff(poses.runs[chosen]) != 0
    ends = np.append(borders, np.True_) | np.insert(borders, 0, np.True_)
    rests = (poses.stops | _switches(poses))[chosen] | ends
    return np.where(rests | (nearer < COINCIDENT), 0.0, np.minimum(nearer / 2.0, LARGEST_ZONE))


def _speeds(poses: PoseStream, chosen: IntArray, times: FloatArray, *, process: Process) -> FloatArray:
    """Return the speed of the move to each target [mm/s]."""
    passed = np.append([0.0], np.cumsum(tip_lengths(poses)))
    lengths, durations = np.diff(passed[chosen]), np.diff(times[chosen])
    planned = np.where(poses.laid[chosen[:-1]], process.speed, process.travel_speed)
    turning = (lengths < COINCIDENT) | (durations <= 0.0)
    mean = np.where(turning, planned, lengths / np.where(turning, 1.0, durations))
    rounded = np.round(mean, SPEED_DECIMALS)
    return np.append([process.travel_speed], np.minimum(planned, np.maximum(rounded, SMALLEST_SPEED)))
