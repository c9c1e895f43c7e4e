"""Whether a trajectory keeps what it promises, judged by its written rows alone."""

from __future__ import annotations

import numpy as np

from geoprint.errors import LimitError, VerificationError
from geoprint.model import FloatArray, JointPath, PoseStream, Process, Robot, Trajectory
from geoprint.motion.reach import bead_steps, tip_lengths, turns
from geoprint.motion.timing.knots import MOST_TURNED
from geoprint.surfaces import in_words

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
        f"{where}, {time:.3f} s: joint {joint + 1} {what} {amount:.4g} {unit}, allowed is {allowed[joint]:.4g} {unit}; "
        "where the surface has a fold or a step there, smooth it (`geoprint remesh --smooth`), else lower the process "
        "speeds.",
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
    allowed = np.where(poses.laid, process.speed, process.travel_speed)
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
    # Where the arm deposits it rounds the path within its response.
    rounded = np.insert(poses.laid, 0, np.False_) & np.append(poses.laid, np.False_) & ~poses.stops
    allowed = PASSING_TOLERANCE + np.where(rounded, MOST_TURNED, 0.0)
    misses = np.abs(passed - joint_path.joints)
    pose, joint = np.unravel_index(int((misses / allowed[:, None]).argmax()), misses.shape)
    found, run = float(misses[pose, joint]), int(poses.runs[pose])
    if found > allowed[pose]:
        raise VerificationError(
            f"run {run + 1}: the trajectory passes pose {pose} with joint {joint + 1} off by {found:.3g} rad, allowed "
            f"is {allowed[pose]:g} rad; please report this as a defect of geoprint.",
            run=run, pose=int(pose), joint=int(joint) + 1, found_rad=found, allowed_rad=float(allowed[pose]),
        )  # fmt: skip
