"""When the arm is where: the whole motion from home to home, a row each millisecond, inside all limits."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from geoprint.errors import InputError, LimitError
from geoprint.model import (
    BoolArray,
    FloatArray,
    IntArray,
    JointPath,
    OnSlowdown,
    PoseStream,
    Process,
    Robot,
    Slowdown,
    Trajectory,
)
from geoprint.motion.timing.slowdown import Pace, held_after_dips, held_speeds, lowered, pace
from geoprint.motion.timing.topp import Motion, fastest_motion, straight_motion
from geoprint.motion.timing.verification import SAMPLE_TIME, verify
from geoprint.motion.timing.waypoints import COINCIDENT_JOINTS, Waypoints, waypoints

# A true ramp may be longer than twice the ideal one: a lower speed is reached sooner. A run that still dips after so
# many lowerings keeps its dips, and they are reported.
MOST_LOWERINGS = 5


def retime(joint_path: JointPath, robot: Robot, *, process: Process, on_slowdown: OnSlowdown = "lower") -> Trajectory:
    """Run through a joint path in the shortest time that joints and process allow.

    From home to the first pose and from the last one back, all joints move together at a share of their speeds.
    Between the poses' stops each piece runs from rest to rest: a spline of the joints with continuous second
    derivative, timed by TOPP-RA under the joint speeds and accelerations and the speed of the tip.

    Where the joints cannot hold the set speed along a run that lays material, `lower` lowers the speed of the whole run
    to what they hold all along it, so that the bead stays even; `follow` keeps the dips. Either way the trajectory
    lists them. The ramps at the stops are left out of this and of `slowest_deposit`: twice the length in which the tip
    would come from rest to its speed on a straight path. Where a piece is all ramp its largest speed counts.

    Args:
        joint_path: p poses with their joints.
        robot: limits and home.
        process: speeds of the tip, and the share of the joint speeds on the way from and to home.
        on_slowdown: what is done where the set speed is not held.

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
    ways = waypoints(joint_path, process=process)
    ways, pieces, slower, found = _timed(ways, robot=robot, process=process, on_slowdown=on_slowdown)
    rows = ways.pieces
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
        slowest_deposit=found.slowest,
        slowdowns=tuple(sorted([*slower, *found.dips], key=lambda slowdown: (slowdown.run, slowdown.arc))),
        share_at_speed=found.share_at_speed,
        share_on_ramps=found.share_on_ramps,
    )
    verify(trajectory, joint_path, robot=robot, process=process)
    return trajectory


def _timed(
    ways: Waypoints, *, robot: Robot, process: Process, on_slowdown: OnSlowdown
) -> tuple[Waypoints, list[Motion], tuple[Slowdown, ...], Pace]:
    """Return the waypoints with the ceilings kept, the motions of the pieces, what was lowered, and the pace."""
    slower = (
        {slow.run: slow for slow in held_speeds(ways, robot=robot, process=process)} if on_slowdown == "lower" else {}
    )
    ways = lowered(ways, tuple(slower.values()))
    pieces = [_piece(ways, first, last, robot=robot) for first, last in ways.pieces]
    found = pace(ways, pieces, robot=robot, process=process)
    for _ in range(MOST_LOWERINGS if on_slowdown == "lower" else 0):
        again = {slow.run: slow for slow in held_after_dips(ways, found.dips)}
        if not again:
            break
        slower |= again
        ways = lowered(ways, tuple(again.values()))
        for piece, (first, last) in enumerate(ways.pieces):
            if int(ways.runs[last]) in again:
                pieces[piece] = _piece(ways, first, last, robot=robot)
        found = pace(ways, pieces, robot=robot, process=process)
    return ways, pieces, tuple(slower.values()), found


def _piece(ways: Waypoints, first: int, last: int, *, robot: Robot) -> Motion:
    try:
        return fastest_motion(
            ways.joints[first : last + 1],
            ways.knots(first, last),
            ceilings=ways.ceilings[first:last],
            robot=robot,
        )
    except LimitError as error:
        run = int(ways.runs[last])
        raise LimitError(f"run {run + 1}: {error}", run=run) from error


def _home_motion(start: FloatArray, end: FloatArray, *, robot: Robot, process: Process) -> list[Motion]:
    """Return the joint move, or nothing where the arm is there already."""
    if float(np.abs(end - start).max()) <= COINCIDENT_JOINTS:
        return []
    speeds = process.joint_speed_share * robot.speeds
    return [straight_motion(start, end, speeds=speeds, accelerations=robot.accelerations)]


def _passing_times(
    ways: Waypoints, rows: list[tuple[int, int]], pieces: list[Motion], starts: FloatArray
) -> FloatArray:
    """Return when each waypoint is passed [s]."""
    times = np.full(ways.stops.size, starts[0])
    for (first, last), piece, start in zip(rows, pieces, starts, strict=False):
        times[first : last + 1] = start + piece.times_at(ways.knots(first, last))
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
