"""One motion along a whole stream: joint angles that are continuous and inside the limits, or what fails where."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint import transforms
from geoprint.model import FloatArray, IntArray, Robot, frozen
from geoprint.motion.arm import JOINTS, Arm, wrist_angles
from geoprint.motion.reach.margins import limit_margins
from geoprint.motion.reach.pose_samples import PoseSamples
from geoprint.motion.reach.reach_map import Failures, Reason, wrist_distances

# A joint that turns by more than this [rad] from one sample to the next has flipped: at 5 degrees from the wrist
# singularity it turns by 12 degrees.
LARGEST_JUMP = float(np.radians(20.0))


@final
@frozen
class Followed:
    """A motion along all samples of a stream.

    Attributes:
        branch: of the inverse kinematics.
        joints: (s, 6) [rad]; NaN where out of reach; continuous and inside the limits where nothing fails.
        failures: of each sample.
    """

    branch: int
    joints: FloatArray
    failures: Failures

    @property
    def complete(self) -> bool:
        """Whether nothing fails."""
        return not self.failures.reasons.any()


def follow(samples: PoseSamples, arm: Arm, *, branch: int, minimum_wrist_angle: float) -> Followed:
    """Follow one branch along all samples.

    A flip is looked for where every sample can be served, a winding where none flips: before, neither means anything.

    Args:
        samples: of the stream.
        arm: with its tool.
        branch: of the inverse kinematics, 0 to 7.
        minimum_wrist_angle: smallest |q5| on deposit [rad].
    """
    joints = arm.solutions(samples.Ts_base_tool)[:, branch]
    failures = _unusable(joints, samples, arm, minimum_wrist_angle=minimum_wrist_angle)
    if not failures.reasons.any():
        joints = np.unwrap(joints, axis=0)
        failures = _jumps(joints)
    if not failures.reasons.any():
        joints = _wound(joints, arm.robot)
        failures = _windings(joints, arm.robot)
    return Followed(branch, joints, failures)


def whole_turns(joints: FloatArray, robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Return the least and most whole turns (..., 6) that keep continuous joints (..., s, 6) inside the limits.

    Where least exceeds most, none does.
    """
    low, high = joints.min(axis=-2), joints.max(axis=-2)
    turn = 2.0 * np.pi
    return np.ceil((robot.limits[:, 0] - low) / turn), np.floor((robot.limits[:, 1] - high) / turn)


def _unusable(joints: FloatArray, samples: PoseSamples, arm: Arm, *, minimum_wrist_angle: float) -> Failures:
    """Return where a solution is missing, or beyond a limit, or on deposit too near the wrist singularity."""
    limits, rows = arm.robot.limits, np.arange(len(joints))
    margins = limit_margins(joints, arm.robot)
    missing = np.isnan(margins.min(axis=1))
    worst = np.where(missing[:, None], 0.0, margins).argmin(axis=1)
    beyond = ~missing & (margins[rows, worst] < 0.0)
    wrist = wrist_angles(joints, arm=arm)
    singular = ~missing & ~beyond & samples.deposit & (wrist < minimum_wrist_angle)
    distances, reach = wrist_distances(samples.Ts_base_tool, arm)
    middle = limits.mean(axis=1)[worst]
    angles = middle + transforms.wrapped(joints[rows, worst] - middle)
    conditions = [missing, beyond, singular]
    return Failures(
        reasons=np.select(conditions, [Reason.OUT_OF_REACH, Reason.JOINT_LIMIT, Reason.WRIST], 0).astype(np.int64),
        joints=np.select(conditions, [np.zeros_like(worst), worst + 1, np.full_like(worst, 5)], 0),
        found=np.select(conditions, [distances, angles, wrist], 0.0),
        allowed=np.stack(
            [
                np.select(conditions, [reach[0], limits[worst, 0], minimum_wrist_angle], 0.0),
                np.select(conditions, [reach[1], limits[worst, 1], np.pi], 0.0),
            ],
            axis=1,
        ),
    )


def _jumps(joints: FloatArray) -> Failures:
    """Return the samples to which a joint turns too far at once."""
    jumps = np.abs(np.diff(joints, axis=0, prepend=joints[:1]))
    joint = jumps.argmax(axis=1)
    return _failing(
        jumps.max(axis=1), joint, low=np.zeros(JOINTS), high=np.full(JOINTS, LARGEST_JUMP), reason=Reason.FLIP
    )


def _windings(joints: FloatArray, robot: Robot) -> Failures:
    """Return the samples of a continuous path at which a joint has turned out of its limits."""
    low, high = robot.limits.T
    joint = np.maximum(low - joints, joints - high).argmax(axis=1)
    found = joints[np.arange(len(joints)), joint]
    return _failing(found, joint, low=low, high=high, reason=Reason.WINDING)


def _failing(found: FloatArray, joint: IntArray, *, low: FloatArray, high: FloatArray, reason: Reason) -> Failures:
    failing = (found < low[joint]) | (found > high[joint])
    allowed = np.stack([low[joint], high[joint]], axis=1)
    return Failures(
        reasons=np.where(failing, int(reason), int(Reason.REACHED)),
        joints=np.where(failing, joint + 1, 0),
        found=np.where(failing, found, 0.0),
        allowed=np.where(failing[:, None], allowed, 0.0),
    )


def _wound(joints: FloatArray, robot: Robot) -> FloatArray:
    """Shift each joint of a continuous path by whole turns: inside its limits, as near to home as possible.

    Where no whole turn keeps all of it inside, as much of it as possible stays inside.
    """
    turn = 2.0 * np.pi
    low, high = joints.min(axis=0), joints.max(axis=0)
    least, most = whole_turns(joints, robot)
    home = np.rint((robot.home - (low + high) / 2.0) / turn)
    middle = np.rint((robot.limits.mean(axis=1) - (low + high) / 2.0) / turn)
    shift: FloatArray = np.where(least > most, middle, np.minimum(np.maximum(home, least), most))
    return joints + turn * shift
