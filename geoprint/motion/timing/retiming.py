"""When the arm is where: the whole motion from home to home, a row each millisecond, inside all limits.

From home to the first pose and from the last one back, all joints move together at a share of their speeds.
Between the poses' stops each leg runs from rest to rest: a spline of the joints with continuous second
derivative, timed by TOPP-RA under the joint speeds and accelerations and the speed of the tip. On deposit it is rounded
within what the arm responds to, by at most 0.004 mm.

Where joints or targets do not hold the speed of a run that deposits, it dips there and no farther than it must; the
trajectory lists where. The ramps at the stops are left out of this and of `slowest_deposit`: twice the length in which
the tip would come from rest to its speed on a straight path. Where a leg is all ramp its largest speed counts.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias, final

import numpy as np

from geoprint.errors import InputError, LimitError
from geoprint.model import (
    BoolArray,
    FloatArray,
    IntArray,
    JointPath,
    PoseStream,
    Process,
    Robot,
    Slowdown,
    Trajectory,
)
from geoprint.motion.timing.confirmation import is_installed
from geoprint.motion.timing.knots import COINCIDENT_JOINTS, Knots, path_knots
from geoprint.motion.timing.slowdown import Pace, lowered, pace
from geoprint.motion.timing.topp import Motion, confirm_motion, fastest_motion, straight_motion
from geoprint.motion.timing.verification import SAMPLE_TIME, verify

_LOG = logging.getLogger(__name__)

# Motions of the legs of one path: by the first knot and the bytes of the ceilings.
Known: TypeAlias = dict[tuple[int, bytes], Motion]

# Legs that a second solver is asked about until it finds a motion.
MOST_ASKED = 3


def retime(
    joint_path: JointPath,
    robot: Robot,
    *,
    process: Process,
    slower: tuple[Slowdown, ...] = (),
    known: Known | None = None,
) -> Trajectory:
    """Run through a joint path in the shortest time that joints and process allow.

    Args:
        joint_path: p poses with their joints.
        robot: limits and home.
        process: speeds, and the share of the joint speeds from and to home.
        slower: places that are slower for another reason; where the joints hold less, that counts.
        known: motions of legs of this very path and robot that were timed before; what is timed now is added.

    Returns:
        The trajectory, verified by differentiating its own rows; poses in one place are passed at the same time.

    Raises:
        InputError: the joint path is empty.
        LimitError: a limit cannot be kept, or is broken in the result.
        VerificationError: the result does not pass the poses, or toppra, where it is installed, finds lower speeds.
        UsageError: toppra is installed and cannot be imported.
    """
    if joint_path.poses.count == 0:
        raise InputError("the joint path has no poses; there is nothing to time: plan at least one run.")
    knots = path_knots(joint_path, process=process)
    timer = _LegTimer(robot, known if known is not None else {})
    knots, legs, found = _timed(knots, timer, process=process, slower=slower)
    rows = knots.legs
    there = _home_motion(robot.home, knots.joints[0], robot=robot, process=process)
    motions = [*there, *legs, *_home_motion(knots.joints[-1], robot.home, robot=robot, process=process)]
    starts = np.concatenate([[0.0], np.cumsum([motion.duration for motion in motions])])
    pose_times = _passing_times(knots, rows, legs, starts[len(there) :])[knots.places]
    times, joints = _sampled(motions, starts, home=robot.home)
    runs, deposit = _labels(joint_path.poses, pose_times, times)
    trajectory = Trajectory(
        times=times, joints=joints, runs=runs, deposit=deposit, pose_times=pose_times,
        stretched=len({int(knots.runs[last]) for (_, last), leg in zip(rows, legs, strict=True) if leg.stretched}),
        slowest_deposit=found.slowest,
        slowdowns=tuple(sorted([*slower, *found.dips], key=lambda slowdown: (slowdown.run, slowdown.arc))),
        share_at_speed=found.share_at_speed,
        share_on_ramps=found.share_on_ramps,
    )  # fmt: skip
    verify(trajectory, joint_path, robot=robot, process=process)
    return trajectory


def _timed(
    knots: Knots, timer: _LegTimer, *, process: Process, slower: tuple[Slowdown, ...]
) -> tuple[Knots, list[Motion], Pace]:
    """Return the knots with the ceilings kept, the motions of the legs, and how evenly they deposit."""
    first_time = not timer.known
    knots = lowered(knots, slower)
    legs = [timer(knots, first, last) for first, last in knots.legs]
    if first_time and legs and is_installed():
        _confirm_longest(knots, legs, robot=timer.robot)
    return knots, legs, pace(knots, legs, robot=timer.robot, process=process)


def _confirm_longest(knots: Knots, legs: list[Motion], *, robot: Robot) -> None:
    """Let a second solver confirm the leg of the most grid points, or a shorter one if it finds no motion there."""
    longest = sorted(range(len(legs)), key=lambda leg: -legs[leg].grid.size)
    for leg in longest[:MOST_ASKED]:
        first, last = knots.legs[leg]
        lengths, ceilings = knots.lengths_of(first, last), knots.ceilings[first:last]
        if confirm_motion(legs[leg], lengths, ceilings=ceilings, robot=robot):
            return
    _LOG.warning("note: toppra finds no motion along the longest legs, so that no second library confirms the speeds.")


@final
@dataclass(frozen=True, slots=True)
class _LegTimer:
    """Times legs of one path, each with the same ceilings only once."""

    robot: Robot
    known: Known

    def __call__(self, knots: Knots, first: int, last: int) -> Motion:
        """Return the fastest motion of a leg between two knots at rest."""
        ceilings = knots.ceilings[first:last]
        key = (first, ceilings.tobytes())
        if key not in self.known:
            self.known[key] = self._timed(knots, first, last, ceilings=ceilings)
        return self.known[key]

    def _timed(self, knots: Knots, first: int, last: int, *, ceilings: FloatArray) -> Motion:
        try:
            return fastest_motion(
                knots.driven_joints(first, last, response=self.robot.response),
                knots.lengths_of(first, last),
                ceilings=ceilings,
                robot=self.robot,
            )
        except LimitError as error:
            run = int(knots.runs[last])
            raise LimitError(f"run {run + 1}: {error}", run=run) from error


def _home_motion(start: FloatArray, end: FloatArray, *, robot: Robot, process: Process) -> list[Motion]:
    """Return the joint move, or nothing where the arm is there already."""
    if float(np.abs(end - start).max()) <= COINCIDENT_JOINTS:
        return []
    speeds = process.joint_speed_share * robot.speeds
    return [straight_motion(start, end, speeds=speeds, accelerations=robot.accelerations)]


def _passing_times(knots: Knots, rows: list[tuple[int, int]], legs: list[Motion], starts: FloatArray) -> FloatArray:
    """Return when each knot is passed [s]."""
    times = np.full(knots.stops.size, starts[0])
    for (first, last), leg, start in zip(rows, legs, starts, strict=False):
        times[first : last + 1] = start + leg.times_at(knots.lengths_of(first, last))
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
    between = (step >= 0) & (step < poses.count - 1)
    runs = np.where(between, poses.runs[np.clip(step + 1, 0, poses.count - 1)], -1)
    deposit = np.append(poses.laid, False)
    return runs, between & deposit[np.clip(step, 0, poses.count - 1)]
