"""Keyframes and samples along a stream of poses, and how far joint angles are from what is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.geometry import whole_steps
from geoprint.model import BoolArray, FloatArray, IntArray, PoseStream, Robot, comparable, frozen
from geoprint.robot.arm import JOINTS, Arm, singularity_distances, wrist_angles

# Poses of a stream and places on the straight moves between them, where the arm has to follow.


# Between poses farther apart than this [mm, rad] the straight move is sampled in between.
STEP = 2.0
TURN_STEP = float(np.radians(1.0))
# Over so much of the tip's path it is asked how much longer or shorter the bead is [mm].
BEAD_WINDOW = 1.0


@final
@frozen
class PoseSamples:
    """Poses and places on the straight moves between them: s samples of p poses.

    Attributes:
        Ts_base_tool: (s, 4, 4) [mm], not turned about the nozzle.
        T_base_work: (4, 4).
        runs: (s,) run.
        deposit: (s,) whether material is deposited on one side of the sample at least.
        starts: (p,) sample of each pose.
    """

    Ts_base_tool: FloatArray
    T_base_work: FloatArray
    runs: IntArray
    deposit: BoolArray
    starts: IntArray


def tool_poses(poses: PoseStream, *, T_base_work: FloatArray) -> FloatArray:
    """Return (p, 4, 4) T_base_tool [mm] that a pose stream commands."""
    return T_base_work @ transforms.rigid(transforms.rotation_of(poses.quaternions), poses.tips)


def sample_poses(poses: PoseStream, *, T_base_work: FloatArray) -> PoseSamples:
    """Return the poses of a stream, of one pose at least, and places between those that lie far apart.

    Args:
        poses: p poses in the work frame.
        T_base_work: (4, 4) where the part stands [mm].

    Returns:
        The samples, in the order of motion.
    """
    commanded = tool_poses(poses, T_base_work=T_base_work)
    steps = whole_steps(np.maximum(tip_lengths(poses) / STEP, turns(poses) / TURN_STEP))
    starts = np.concatenate([[0], np.cumsum(steps)])
    rows = np.repeat(np.arange(poses.count - 1), steps)
    shares = (np.arange(rows.size) - starts[rows]) / steps[rows]
    Ts_base_tool = commanded[np.append(rows, poses.count - 1)]
    inner = np.flatnonzero(shares > 0.0)
    before = rows[inner]
    Ts_base_tool[inner] = transforms.interpolate_poses(commanded[before], commanded[before + 1], shares[inner])
    deposited = poses.deposit.copy()
    deposited[1:] |= poses.deposit[:-1] & (poses.runs[1:] == poses.runs[:-1])
    inside = np.where(shares > 0.0, poses.deposit[rows] & deposited[rows + 1], deposited[rows])
    return PoseSamples(
        Ts_base_tool=Ts_base_tool,
        T_base_work=T_base_work,
        runs=np.concatenate([poses.runs[rows], poses.runs[-1:]]),
        deposit=np.concatenate([inside, deposited[-1:]]),
        starts=starts,
    )


def keyframes(Ts_base_tool: FloatArray, *, count: int) -> IntArray:
    """Return ascending rows of poses: `count` taken evenly, and those that reach farthest and lean most.

    Farthest and most are meant along each axis of the base frame.
    """
    total = len(Ts_base_tool)
    evenly = np.linspace(0, total - 1, min(total, count)).round().astype(np.int64)
    columns = np.hstack([Ts_base_tool[:, :3, 3], Ts_base_tool[:, :3, 2]])
    return np.unique(np.concatenate([evenly, columns.argmin(axis=0), columns.argmax(axis=0)]))


def tip_lengths(poses: PoseStream) -> FloatArray:
    """Return the (p - 1,) lengths of the tip's straight steps [mm]."""
    return np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)


def bead_steps(poses: PoseStream) -> FloatArray:
    """Return the (p - 1,) lengths that the steps of the tip have on the surface [mm]; on travel those of the tip.

    The tip goes farther than its bead over a bulge, and less far in a hollow. How much is taken over a millimetre about
    each step: the normals of triangles jump from step to step, and a speed must not.
    """
    steps, beads = tip_lengths(poses), poses.bead_lengths
    found = steps.copy()
    deposited = poses.deposited
    edges = np.flatnonzero(np.diff(np.concatenate([[False], deposited, [False]]).astype(np.int8)))
    for first, last in edges.reshape(-1, 2).tolist():
        passed, left = (np.append(0.0, np.cumsum(each[first:last])) for each in (steps, beads))
        middles = (passed[1:] + passed[:-1]) / 2.0
        low, high = np.maximum(middles - BEAD_WINDOW / 2.0, 0.0), np.minimum(middles + BEAD_WINDOW / 2.0, passed[-1])
        moved = high > low
        share = np.interp(high, passed, left) - np.interp(low, passed, left)
        found[first:last] *= np.divide(share, high - low, out=np.ones_like(share), where=moved)
    return found


def turns(poses: PoseStream) -> FloatArray:
    """Return the (p - 1,) angles by which the tool turns [rad]; exact for small ones too."""
    quaternions = poses.quaternions
    apart = np.linalg.norm(np.diff(quaternions, axis=0), axis=1)
    opposite = np.linalg.norm(quaternions[1:] + quaternions[:-1], axis=1)
    return 4.0 * np.arcsin(np.minimum(apart, opposite) / 2.0)


# Keyframes along a stream, and the smooth course of a value between them.
#
# Every pose has a *place* on a scale on which keyframe i stands at i. The scale grows with the path, faster where
# keyframes shall be denser. Values between keyframes are a uniform cubic B-spline [DeBoor1978] whose coefficients
# are the keyframes' values: twice continuously differentiable along the scale, and never outside the hull of the
# four keyframes around a place. What all four keep (a cone) is kept everywhere between; a staircase becomes a ramp.


# Turning counts as path too, so that a tool that turns on the spot gets keyframes: a radian is as long as this [mm].
LEVER = 10.0
# Samples of the path (`pose_samples`) to a keyframe.
SAMPLES_PER_KEYFRAME = 10


@final
@frozen
class Keyframes:
    """k keyframes of p poses.

    Attributes:
        Ts_base_tool: (k, 4, 4) poses of the path [mm].
        deposit: (k,) whether material is deposited at the keyframe.
        steps: (k - 1,) length of path from each keyframe to the next [mm], turning counted.
        places: (p,) of the poses, from 0 to k - 1.
    """

    Ts_base_tool: FloatArray
    deposit: BoolArray
    steps: FloatArray
    places: FloatArray

    @property
    def lengths(self) -> FloatArray:
        """(k,) length of path from the first keyframe [mm]."""
        return np.append(0.0, np.cumsum(self.steps))

    @property
    def count(self) -> int:
        """Number of keyframes k."""
        return int(self.deposit.size)


def path_lengths(poses: PoseStream) -> FloatArray:
    """Return the (p,) lengths of path from the first pose [mm], turning counted."""
    return np.append(0.0, np.cumsum(np.hypot(tip_lengths(poses), LEVER * turns(poses))))


def keyframe_rate(poses: PoseStream) -> float:
    """Return the usual number of keyframes a millimetre of path; 0 where nothing moves."""
    samples = np.ceil(np.maximum(tip_lengths(poses) / STEP, turns(poses) / TURN_STEP)).sum()
    length = float(path_lengths(poses)[-1])
    return float(samples / SAMPLES_PER_KEYFRAME / length) if length > 0.0 else 0.0


def keyframes_of(poses: PoseStream, *, T_base_work: FloatArray, rates: FloatArray) -> Keyframes:
    """Set keyframes along a stream, the first at its first pose and the last at its last.

    Args:
        poses: p poses, one at least.
        T_base_work: (4, 4) where the part stands [mm].
        rates: (p,) wanted keyframes a millimetre of path at each pose; what lies between is interpolated.
    """
    lengths = path_lengths(poses)
    scale = np.append(0.0, np.cumsum((rates[1:] + rates[:-1]) / 2.0 * np.diff(lengths)))
    if not scale[-1] > 0.0:
        return _at_rest(poses, T_base_work=T_base_work)
    count = int(whole_steps(scale[-1]))
    places = scale * (count / scale[-1])
    places[-1] = count
    targets = np.arange(count + 1, dtype=np.float64)
    rows = np.clip(np.searchsorted(places, targets, side="right") - 1, 0, poses.count - 2)
    gaps = places[rows + 1] - places[rows]
    shares = np.divide(targets - places[rows], gaps, out=np.zeros(count + 1), where=gaps > 0.0).clip(0.0, 1.0)
    commanded = tool_poses(poses, T_base_work=T_base_work)
    deposited = poses.deposited
    return Keyframes(
        Ts_base_tool=transforms.interpolate_poses(commanded[rows], commanded[rows + 1], shares),
        deposit=deposited[rows] | ((shares == 0.0) & deposited[np.maximum(rows - 1, 0)]),
        steps=np.diff(lengths[rows] + shares * (lengths[rows + 1] - lengths[rows])),
        places=places,
    )


def thinned(frames: Keyframes, *, count: int) -> Keyframes:
    """Return at most so many keyframes, evenly chosen, the first and the last among them."""
    rows = np.unique(np.linspace(0, frames.count - 1, min(frames.count, count)).round().astype(np.int64))
    return replace(
        frames,
        Ts_base_tool=frames.Ts_base_tool[rows],
        deposit=frames.deposit[rows],
        steps=np.diff(frames.lengths[rows]),
    )


def smoothed(values: FloatArray, places: FloatArray) -> FloatArray:
    """Return the (p, d) values of a uniform cubic B-spline with (k, d) coefficients at (p,) places.

    Beyond its ends the first and the last coefficient go on.

    Examples:
        >>> smoothed(np.array([[0.0], [0.0], [6.0], [0.0], [0.0]]), np.array([0.0, 1.0, 2.0]))[:, 0]
        array([0., 1., 4.])
    """
    last = len(values) - 1
    before = np.minimum(np.floor(places).astype(np.int64), max(last - 1, 0))
    t = places - before
    weights = (
        (1.0 - t) ** 3,
        3.0 * t**3 - 6.0 * t**2 + 4.0,
        -3.0 * t**3 + 3.0 * t**2 + 3.0 * t + 1.0,
        t**3,
    )
    result = np.zeros((places.size, values.shape[1]))
    for offset, weight in zip((-1, 0, 1, 2), weights, strict=True):
        result += weight[:, None] / 6.0 * values[np.clip(before + offset, 0, last)]
    return result


def _at_rest(poses: PoseStream, *, T_base_work: FloatArray) -> Keyframes:
    """Return the one keyframe of a tool that does not move."""
    return Keyframes(
        Ts_base_tool=tool_poses(poses, T_base_work=T_base_work)[:1],
        deposit=poses.deposit[:1],
        steps=np.empty(0),
        places=np.zeros(poses.count),
    )


# How far joint angles are from what is refused: joint limits, the stretched arm, the wrist singularity.


# Below this angle of joint 5, a turn of the tool needs more than 11 times that turn of joints 4 and 6 (1 / sin): it is
# refused on deposit [rad].
MINIMUM_WRIST_ANGLE = float(np.radians(5.0))

# What a margin may be limited by, in the order of `angle_margins`.
LIMITING = (*(f"joint {joint + 1}" for joint in range(JOINTS)), "the wrist singularity", "the stretched arm")


@final
@comparable
class Margin:
    """How much nearer any pose of a stream may come to what is refused.

    Attributes:
        angle: smallest over the poses [rad]; negative where one is refused, minus infinity where one is
            out of reach.
        limiting: what it is nearest to, as text.
        pose: the row where that is.
    """

    angle: float
    limiting: str
    pose: int


def limit_margins(joints: FloatArray, robot: Robot) -> FloatArray:
    """Return how far each joint [rad] of (..., 6) is inside its limits, at the whole turn that suits it best."""
    centre, half = robot.limits.mean(axis=1), np.ptp(robot.limits, axis=1) / 2.0
    return half - np.abs(transforms.wrapped(joints - centre))


def usable(joints: FloatArray, arm: Arm, *, deposit: BoolArray, minimum_wrist_angle: float) -> BoolArray:
    """Return which of (..., s, 6) solutions exist, keep the limits, and on deposit the wrist angle."""
    # Comparisons with NaN are false: a branch that does not exist is not usable.
    within = (limit_margins(joints, arm.robot) >= 0.0).all(axis=-1)
    return within & (~deposit | (wrist_angles(joints, arm=arm) >= minimum_wrist_angle))


def angle_margins(joints: FloatArray, arm: Arm, *, deposit: BoolArray) -> FloatArray:
    """Return how far joint angles are from each of `LIMITING`.

    Args:
        joints: (..., s, 6) [rad].
        arm: its limits and lengths.
        deposit: (s,) whether the wrist singularity counts.

    Returns:
        (..., s, 8) [rad]: from the limits of joints 1 to 6 at the whole turn that suits best, of |q5| above the
        minimum, and from the stretched or folded arm; infinite for the wrist on travel, NaN where `joints` are.
    """
    bend = np.abs(singularity_distances(joints.reshape(-1, JOINTS), arm=arm)[:, 1]).reshape(joints.shape[:-1])
    wrist = np.where(deposit, wrist_angles(joints, arm=arm) - MINIMUM_WRIST_ANGLE, np.inf)
    return np.concatenate(
        [limit_margins(joints, arm.robot), wrist[..., None], np.minimum(bend, np.pi - bend)[..., None]], axis=-1
    )


def smallest_margin(joints: FloatArray, arm: Arm, *, deposit: BoolArray) -> Margin:
    """Return the smallest of the margins of (s, 6) joint angles [rad] on one branch."""
    margins = angle_margins(joints, arm, deposit=deposit)
    missing = np.flatnonzero(np.isnan(margins).any(axis=1))
    if missing.size:
        return Margin(-np.inf, "the arm's reach", int(missing[0]))
    pose, which = np.unravel_index(int(margins.argmin()), margins.shape)
    return Margin(float(margins[pose, which]), LIMITING[which], int(pose))
