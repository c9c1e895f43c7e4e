"""When the arm is where: the whole motion from home to home, a row each millisecond, inside all limits."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import final

import numpy as np

from geoprint.errors import InputError, LimitError
from geoprint.model import BoolArray, FloatArray, IntArray, JointPath, PoseStream, Process, Robot, Trajectory
from geoprint.motion.steps import tip_ways, turns
from geoprint.motion.topp import Motion, fastest_motion, ramp_length, straight_motion
from geoprint.motion.verification import SAMPLE_TIME, verify

METRES_PER_MILLIMETRE = 1e-3

# Turning counts as length along the path, so that a tool that turns on the spot moves on: a radian is as long as this
# [m]. It hardly lengthens a path along a surface (by 0.5 % at a radius of 100 mm), and a joint at its top speed
# passes the length about as fast as a tip that prints.
METRES_PER_RADIAN = 0.01

# Neighbouring poses closer than this [m] are one place, and their joints must agree to this [rad]; a larger difference
# would show in the accelerations.
COINCIDENT = 1e-9
COINCIDENT_JOINTS = 1e-8

# At each stop so many times the length of an ideal ramp is left out of the slowest speed on deposit; the path bends,
# so that the true ramp is somewhat longer.
RAMP_FACTOR = 2.0


def retime(joint_path: JointPath, robot: Robot, *, process: Process) -> Trajectory:
    """Run through a joint path in the shortest time that joints and process allow.

    From home to the first pose and from the last one back, all joints move together at a share of their speeds.
    Between the poses' stops each piece runs from rest to rest: a spline of the joints with continuous second
    derivative, timed by TOPP-RA under the joint speeds and accelerations and the speed of the tip. Its parameter is
    the length hypot(way of the tip, turn of the tool * 10 mm per radian), so that a tool that turns on the spot moves
    along too.

    `slowest_deposit` is taken over the depositing steps, less twice the ramp at each stop: the length in which the
    tip would come from rest to its speed on a straight path. Where a piece is all ramp its largest speed counts.

    Args:
        joint_path: p poses with their joints.
        robot: limits and home.
        process: speeds of the tip, and the share of the joint speeds on the way from and to home.

    Returns:
        The trajectory, verified by differentiating its own rows. A pose that lies where the one before it does is
        passed at the same time.

    Raises:
        InputError: the joint path is empty.
        LimitError: a limit cannot be kept, or is broken in the result.
        VerificationError: the result does not pass the poses.
        UsageError: toppra is not installed.
    """
    if joint_path.poses.count == 0:
        raise InputError("the joint path has no poses; there is nothing to time: plan at least one run.")
    ways = _waypoints(joint_path, process=process)
    rows = list(pairwise(np.flatnonzero(ways.stops).tolist()))
    pieces = [_piece(ways, first, last, robot=robot) for first, last in rows]
    there = _home_motion(robot.home, ways.joints[0], robot=robot, process=process)
    back = _home_motion(ways.joints[-1], robot.home, robot=robot, process=process)
    motions = [*there, *pieces, *back]
    starts = np.concatenate([[0.0], np.cumsum([motion.duration for motion in motions])])
    pose_times = _passing_times(ways, rows, pieces, starts[len(there) :])[ways.places]
    times, joints = _sampled(motions, starts, home=robot.home)
    runs, deposit = _labels(joint_path.poses, pose_times, times)
    trajectory = Trajectory(
        times=times,
        joints=joints,
        runs=runs,
        deposit=deposit,
        pose_times=pose_times,
        stretched=len({int(ways.runs[last]) for (_, last), piece in zip(rows, pieces, strict=True) if piece.stretched}),
        slowest_deposit=_slowest_deposit(ways, rows, pieces, robot=robot, process=process),
    )
    verify(trajectory, joint_path, robot=robot, process=process)
    return trajectory


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Waypoints:
    """The poses without those that coincide with the one before, and the steps between them.

    Attributes:
        joints: (w, 6) [rad].
        stops: (w,) where the tool comes to rest; the first and the last one among them.
        runs: (w,) run.
        lengths: (w,) path parameter from the first waypoint [m].
        ceilings: (w - 1,) largest growth of the path parameter on each step [m/s].
        tip_shares: (w - 1,) way of the tip by path parameter, in [0, 1].
        deposit: (w - 1,) whether material is laid on the step.
        places: (p,) waypoint of each pose.
    """

    joints: FloatArray
    stops: BoolArray
    runs: IntArray
    lengths: FloatArray
    ceilings: FloatArray
    tip_shares: FloatArray
    deposit: BoolArray
    places: IntArray


def _waypoints(joint_path: JointPath, *, process: Process) -> _Waypoints:
    poses = joint_path.poses
    ways = tip_ways(poses) * METRES_PER_MILLIMETRE
    steps = np.hypot(ways, turns(poses) * METRES_PER_RADIAN)
    moved = steps > COINCIDENT
    places = np.concatenate([[0], np.cumsum(moved)])
    first = np.flatnonzero(np.concatenate([[True], moved]))
    _refuse_jump(joint_path, np.abs(joint_path.joints - joint_path.joints[first][places]))
    stops = np.zeros(first.size, dtype=np.bool_)
    np.logical_or.at(stops, places, poses.stops)
    stops[[0, -1]] = True
    deposit = poses.laid[moved]
    tip_shares = ways[moved] / steps[moved]
    tip_ceilings = np.where(deposit, process.speed, process.travel_speed) * METRES_PER_MILLIMETRE
    with np.errstate(divide="ignore"):
        ceilings = tip_ceilings / tip_shares
    return _Waypoints(
        joints=joint_path.joints[first],
        stops=stops,
        runs=poses.runs[first],
        lengths=np.concatenate([[0.0], np.cumsum(steps[moved])]),
        ceilings=ceilings,
        tip_shares=tip_shares,
        deposit=deposit,
        places=places,
    )


def _piece(ways: _Waypoints, first: int, last: int, *, robot: Robot) -> Motion:
    try:
        return fastest_motion(
            ways.joints[first : last + 1],
            ways.lengths[first : last + 1] - ways.lengths[first],
            ceilings=ways.ceilings[first:last],
            robot=robot,
        )
    except LimitError as error:
        run = int(ways.runs[last])
        raise LimitError(f"run {run}: {error}", run=run) from error


def _home_motion(start: FloatArray, end: FloatArray, *, robot: Robot, process: Process) -> list[Motion]:
    """Return the joint move, or nothing where the arm is there already."""
    if float(np.abs(end - start).max()) <= COINCIDENT_JOINTS:
        return []
    speeds = process.joint_speed_share * robot.speeds
    return [straight_motion(start, end, speeds=speeds, accelerations=robot.accelerations)]


def _passing_times(
    ways: _Waypoints, rows: list[tuple[int, int]], pieces: list[Motion], starts: FloatArray
) -> FloatArray:
    """Return when each waypoint is passed [s]."""
    times = np.full(ways.stops.size, starts[0])
    for (first, last), piece, start in zip(rows, pieces, starts, strict=False):
        times[first : last + 1] = start + piece.times_at(ways.lengths[first : last + 1] - ways.lengths[first])
    return times


def _sampled(motions: list[Motion], starts: FloatArray, *, home: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the times of all rows, and the joints there; at the end of the last motion and after it, home."""
    count = int(np.ceil(starts[-1] / SAMPLE_TIME)) + 1
    times = np.arange(count, dtype=np.float64) * SAMPLE_TIME
    rows = np.searchsorted(times, starts)
    joints = np.tile(home, (count, 1))
    for motion, start, (low, high) in zip(motions, starts, pairwise(rows.tolist()), strict=False):
        joints[low:high] = motion.joints_at(times[low:high] - start)
    return times, joints


def _labels(poses: PoseStream, pose_times: FloatArray, times: FloatArray) -> tuple[IntArray, BoolArray]:
    """Return run and deposit of each row: those of the step it lies on, named by the pose the step leads to."""
    step = np.searchsorted(pose_times, times, side="right") - 1
    on_way = (step >= 0) & (step < poses.count - 1)
    runs = np.where(on_way, poses.runs[np.clip(step + 1, 0, poses.count - 1)], -1)
    deposit = np.append(poses.laid, False)
    return runs, on_way & deposit[np.clip(step, 0, poses.count - 1)]


def _slowest_deposit(
    ways: _Waypoints, rows: list[tuple[int, int]], pieces: list[Motion], *, robot: Robot, process: Process
) -> float:
    """Return the smallest tip speed on deposit off the ramps at stops [mm/s]; the set speed where nothing is laid."""
    slowest = process.speed
    for (first, last), piece in zip(rows, pieces, strict=True):
        knots = ways.lengths[first : last + 1] - ways.lengths[first]
        step = first + np.searchsorted(knots, piece.grid[1:]) - 1
        laid = ways.deposit[step]
        if not laid.any():
            continue
        slopes = piece.path(knots[[0, -1]], 1)
        start = RAMP_FACTOR * ramp_length(slopes[0], ceiling=float(ways.ceilings[first]), robot=robot)
        end = RAMP_FACTOR * ramp_length(slopes[1], ceiling=float(ways.ceilings[last - 1]), robot=robot)
        even = laid & (piece.grid[:-1] >= start) & (piece.grid[1:] <= knots[-1] - end)
        speeds = np.stack([piece.speeds[:-1], piece.speeds[1:]]) * ways.tip_shares[step] / METRES_PER_MILLIMETRE
        slowest = min(slowest, float(speeds[:, even].min()) if even.any() else float(speeds[:, laid].max()))
    return slowest


def _refuse_jump(joint_path: JointPath, differences: FloatArray) -> None:
    pose, joint = np.unravel_index(int(differences.argmax()), differences.shape)
    found = float(differences[pose, joint])
    if found > COINCIDENT_JOINTS:
        run = int(joint_path.poses.runs[pose])
        raise LimitError(
            f"run {run}, pose {pose}: joint {joint + 1} jumps by {found:.3g} rad where the tool stands still, allowed "
            f"is {COINCIDENT_JOINTS:g} rad; keep the whole path on one branch.",
            run=run, joint=int(joint) + 1, found_rad=found, allowed_rad=COINCIDENT_JOINTS,
        )  # fmt: skip
