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

from geoprint.errors import InputError, LimitError, VerificationError
from geoprint.geometry import in_words
from geoprint.model import BoolArray, FloatArray, IntArray, JointPath, PoseStream, Process, Robot, Slowdown, Trajectory
from geoprint.robot.reach import bead_steps, tip_lengths, turns
from geoprint.robot.timing.confirmation import is_installed
from geoprint.robot.timing.knots import COINCIDENT_JOINTS, MOST_TURNED, Knots, path_knots
from geoprint.robot.timing.slowdown import SpeedProfile, lowered, speed_profile
from geoprint.robot.timing.topp import Motion, confirm_motion, fastest_motion, straight_motion

# Whether a trajectory keeps what it promises, judged by its written rows alone.


SAMPLE_TIME = 1e-3  # between rows of a trajectory [s]

# The trajectory is written with 9 decimals. Differentiated from there it may exceed a limit by this share: rounding
# costs 0.002 rad/s2, the time parameterisation 0.8 %.
DECIMALS = 9
LIMIT_TOLERANCE = 0.01

# The spline may leave the joint limits between poses that keep them by no more than this [rad].
ANGLE_TOLERANCE = 1e-4

# Joints read off linearly between two rows at the time of a pose miss it by a * dt^2 / 8 = 3e-6 rad at 25 rad/s2.
PASSING_TOLERANCE = 1e-5

# Rows may be off their even times by rounding [s].
TIME_TOLERANCE = 1e-9

# Length of path [mm] about a place whose steps a message says the turn of: what a bend looks like to a reader.
BEND_LENGTH = 1.0

# Steps of the tip shorter than this [mm] take no time.
COINCIDENT = 1e-6


def verify(trajectory: Trajectory, joint_path: JointPath, *, robot: Robot, process: Process) -> None:
    """Check a trajectory by its rows alone, rounded as they are written.

    Speeds and accelerations are first and second differences of the rows, with the arm at rest at home before the
    first row and after the last one; so they also tell a jump, or a start or end that is not at rest. A limit counts
    as kept within 1 %.

    Args:
        trajectory: to check.
        joint_path: what it must pass.
        robot: limits and home.
        process: largest speeds, of the bead on deposit; they are compared with the mean from pose to pose.

    Raises:
        LimitError: a joint leaves its range, or is too fast or accelerated too much; the tip is too fast; the
            trajectory does not start and end at home.
        VerificationError: its rows are not a millisecond apart, or it does not pass a pose at its time.
    """
    _refuse_uneven_rows(trajectory.times)
    joints = np.round(trajectory.joints, DECIMALS)
    for row, word in ((0, "starts"), (-1, "ends")):
        _refuse_away(np.abs(joints[row] - robot.home), word)
    padded = np.vstack([robot.home, joints, robot.home])
    rates = np.diff(padded, axis=0) / SAMPLE_TIME
    changes = np.diff(rates, axis=0) / SAMPLE_TIME
    centre = robot.limits.mean(axis=1)
    half = np.ptp(robot.limits, axis=1) / 2.0
    for found, allowed, tolerance, what, unit in (
        (joints - centre, half, ANGLE_TOLERANCE, "is off the middle of its range by", "rad"),
        (rates, robot.speeds, LIMIT_TOLERANCE * robot.speeds, "turns at", "rad/s"),
        (changes, robot.accelerations, LIMIT_TOLERANCE * robot.accelerations, "accelerates at", "rad/s2"),
    ):
        _refuse_excess(found, trajectory, joint_path.poses, allowed=allowed, tolerance=tolerance, what=what, unit=unit)
    _refuse_fast_tip(trajectory, joint_path.poses, process=process)
    _refuse_missed_pose(trajectory, joint_path)


def _refuse_uneven_rows(times: FloatArray) -> None:
    off = np.abs(times - np.arange(times.size) * SAMPLE_TIME)
    if off.max() > TIME_TOLERANCE:
        row = int(off.argmax())
        raise VerificationError(
            f"row {row} of the trajectory is at {times[row]:.9g} s, but rows are {SAMPLE_TIME:g} s apart from 0; time "
            "the path again.",
            row=row, found_s=float(times[row]), allowed_s=row * SAMPLE_TIME,
        )  # fmt: skip


def _refuse_away(differences: FloatArray, word: str) -> None:
    joint = int(differences.argmax())
    found = float(differences[joint])
    if found > 10.0**-DECIMALS:
        raise LimitError(
            f"the trajectory {word} with joint {joint + 1} {found:.3g} rad away from home, allowed is rounding only; "
            "let it start and end at the cell's home.",
            joint=joint + 1, found_rad=found, allowed_rad=10.0**-DECIMALS,
        )  # fmt: skip


def _refuse_excess(
    found: FloatArray,
    trajectory: Trajectory,
    poses: PoseStream,
    *,
    allowed: FloatArray,
    tolerance: FloatArray | float,
    what: str,
    unit: str,
) -> None:
    excess = np.abs(found) - (allowed + tolerance)
    row, joint = np.unravel_index(int(excess.argmax()), excess.shape)
    if excess[row, joint] <= 0.0:
        return
    at = min(int(row), trajectory.times.size - 1)
    run, time = int(trajectory.runs[at]), float(trajectory.times[at])
    where = f"run {run + 1}{_bend(trajectory, poses, time=time)}" if run >= 0 else "the motion from or to home"
    amount = float(np.abs(found[row, joint]))
    raise LimitError(
        f"{where}, {time:.3f} s: joint {joint + 1} {what} {amount:.4g} {unit}, allowed is {allowed[joint]:.4g} "
        f"{unit}. If the surface has a fold or step there, smooth it (`geoprint remesh --smooth`); otherwise lower "
        "the process speeds.",
        run=run, joint=int(joint) + 1, time_s=time, found=amount, allowed=float(allowed[joint]),
    )  # fmt: skip


def _bend(trajectory: Trajectory, poses: PoseStream, *, time: float) -> str:
    """Return where the tip is at a time, and how far the tool turns over the steps about there."""
    pose = min(int(np.searchsorted(trajectory.pose_times, time)), poses.count - 1)
    arcs = np.concatenate([[0.0], np.cumsum(tip_lengths(poses))])
    near = np.flatnonzero((arcs[:-1] <= arcs[pose] + BEND_LENGTH / 2.0) & (arcs[1:] >= arcs[pose] - BEND_LENGTH / 2.0))
    turned, length = np.degrees(turns(poses)[near].sum()), arcs[near[-1] + 1] - arcs[near[0]]
    return f" at tip {in_words(poses.tips[pose])}, where the tool turns by {turned:.0f} degrees within {length:.2g} mm"


def _refuse_fast_tip(trajectory: Trajectory, poses: PoseStream, *, process: Process) -> None:
    passed = bead_steps(poses)
    allowed = np.where(poses.printing, process.speed, process.travel_speed)
    excess = passed - (1.0 + LIMIT_TOLERANCE) * allowed * np.diff(trajectory.pose_times)
    if excess.max(initial=0.0) <= COINCIDENT:
        return
    step = int(excess.argmax())
    run, time = int(poses.runs[step + 1]), float(trajectory.pose_times[step])
    raise LimitError(
        f"run {run + 1}, {time:.3f} s: {passed[step]:.3g} mm are passed from pose {step} to the next in "
        f"{trajectory.pose_times[step + 1] - time:.4g} s, allowed are {allowed[step]:g} mm/s; time the path again.",
        run=run, time_s=time, length_mm=float(passed[step]), allowed_mm_s=float(allowed[step]),
    )  # fmt: skip


def _refuse_missed_pose(trajectory: Trajectory, joint_path: JointPath) -> None:
    last = trajectory.times.size - 1
    row = np.clip(np.searchsorted(trajectory.times, trajectory.pose_times, side="right") - 1, 0, max(last - 1, 0))
    share = ((trajectory.pose_times - trajectory.times[row]) / SAMPLE_TIME)[:, None]
    passed = (1.0 - share) * trajectory.joints[row] + share * trajectory.joints[np.minimum(row + 1, last)]
    poses = joint_path.poses
    # Where the arm prints it rounds the path within its response.
    rounded = np.insert(poses.printing, 0, np.False_) & ~poses.stops
    allowed = PASSING_TOLERANCE + np.where(rounded, MOST_TURNED, 0.0)
    misses = np.abs(passed - joint_path.joints)
    pose, joint = np.unravel_index(int((misses / allowed[:, None]).argmax()), misses.shape)
    found, run = float(misses[pose, joint]), int(poses.runs[pose])
    if found > allowed[pose]:
        raise VerificationError(
            f"run {run + 1}: the trajectory passes pose {pose} with joint {joint + 1} off by {found:.3g} rad, allowed "
            f"is {allowed[pose]:g} rad. Please report this as a defect of geoprint.",
            run=run, pose=int(pose), joint=int(joint) + 1, found_rad=found, allowed_rad=float(allowed[pose]),
        )  # fmt: skip


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
        raise InputError("the joint path has no poses: plan at least one run.")
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
) -> tuple[Knots, list[Motion], SpeedProfile]:
    """Return the knots with the ceilings kept, the motions of the legs, and how evenly they deposit."""
    first_time = not timer.known
    knots = lowered(knots, slower)
    legs = [timer(knots, first, last) for first, last in knots.legs]
    if first_time and legs and is_installed():
        _confirm_longest(knots, legs, robot=timer.robot)
    return knots, legs, speed_profile(knots, legs, robot=timer.robot, process=process)


def _confirm_longest(knots: Knots, legs: list[Motion], *, robot: Robot) -> None:
    """Let a second solver confirm the leg of the most grid points, or a shorter one if it finds no motion there."""
    longest = sorted(range(len(legs)), key=lambda leg: -legs[leg].grid.size)
    for leg in longest[:MOST_ASKED]:
        first, last = knots.legs[leg]
        lengths, ceilings = knots.lengths_of(first, last), knots.ceilings[first:last]
        if confirm_motion(legs[leg], lengths, ceilings=ceilings, robot=robot):
            return
    _LOG.warning(
        "note: toppra finds no motion along the longest legs, so the speeds are not confirmed by a second library."
    )


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
    deposit = np.append(poses.deposited, False)
    return runs, between & deposit[np.clip(step, 0, poses.count - 1)]
