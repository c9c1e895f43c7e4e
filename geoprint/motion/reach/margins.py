"""How far joint angles are from what is refused: joint limits, the stretched arm, the wrist singularity."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint import transforms
from geoprint.model import BoolArray, FloatArray, Robot, comparable
from geoprint.motion.arm import JOINTS, Arm, singularity_distances, wrist_angles

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
