"""One motion along a whole stream: what steps between attitudes cost, and joint angles that are continuous."""

from __future__ import annotations

import math
from dataclasses import astuple
from typing import NamedTuple, final

import numpy as np

from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.kernels import inner
from geoprint.model import BoolArray, FloatArray, IntArray, Robot, SearchWeights, frozen
from geoprint.robot.arm import JOINTS, Arm, bordered_joints, singular_terms, wrist_angles
from geoprint.robot.reach.keyframes import PoseSamples, limit_margins
from geoprint.robot.reach.reach_map import Failures, Reason, wrist_distances

# What a millimetre at a place and a step between two cost: joint rates, limits, singularities, quadrants.
#
# Joint rates count relative to the joint's top speed at the tip speed `REFERENCE_SPEED`; a place costs (comfortable
# / margin)^2 for the nearest joint limit and for each singularity, and on deposit `QUADRANT` for each axis that is
# near a border of its quadrants. What cannot be used costs `FAILURE` and is not excluded.


# Tip speed [mm/s] at which a joint rate becomes a share of the joint's top speed.
REFERENCE_SPEED = 20.0
# Margins at which a place costs 1 for each: from the nearest joint limit, of the wrist, of the elbow [rad], and of the
# wrist centre from axis 1 [mm].
COMFORTABLE_LIMIT = float(np.radians(10.0))
COMFORTABLE_WRIST = float(np.radians(15.0))
COMFORTABLE_ELBOW = float(np.radians(15.0))
COMFORTABLE_SHOULDER = 50.0
# What a millimetre of deposit costs with an axis nearer to a border of its quadrants than the first angle; from the
# second on it costs nothing [rad]. The first is `BORDER_MARGIN` and what the turn changes between keyframes.
QUADRANT = 1.0
QUADRANT_NEAR = float(np.radians(1.3))
QUADRANT_CLEAR = float(np.radians(2.6))
# A margin is worth no less than this share of the comfortable one: on the singularity itself the cost stays finite.
SMALLEST_SHARE = 0.03
# What a millimetre costs where the arm cannot be: more than any motion that it can make ...
FAILURE = 1e9
# ... and so many times that, where there is no solution at all; beyond a limit it grows with every radian.
UNREACHED = 5.0
# What a step costs in which a joint turns too far to have taken the shorter turn [rad].
FLIP = 1e5
FLIP_ANGLE = float(np.radians(90.0))
# What turning about the nozzle or leaning by a radian a millimetre costs in itself [mm]: a radian on 100 mm costs
# 0.1/mm. Every turn starts and ends, and that costs the joints accelerations which they need for the path.
TURNING = 1000.0


class Terms(NamedTuple):
    """What the costs are made of, as the kernels take it: lengths in mm, angles in rad.

    Joints count as the closed form counts them, whatever the conventions of the arm's URDF are. `quadrants` says which
    joints have borders that turning about the nozzle may keep away from.
    """

    T_foot_base: FloatArray
    T_tool_end: FloatArray
    lengths: FloatArray
    limits: FloatArray
    rates: FloatArray
    wraps: BoolArray
    turning: float
    limit_weight: float
    singularity_weight: float
    minimum_wrist_angle: float
    quadrants: IntArray


def cost_terms(arm: Arm, *, weights: SearchWeights, minimum_wrist_angle: float) -> Terms:
    """Return what the costs are made of for an arm with its tool.

    Raises:
        UsageError: the arm's inverse has no closed form.
    """
    inverse = arm.closed_form
    if inverse is None:
        raise UsageError(
            f"the ladder needs the closed form of the inverse, which the arm has not: {arm.no_closed_form}."
        )
    return Terms(
        T_foot_base=transforms.inverse(inverse.T_base_foot),
        T_tool_end=np.ascontiguousarray(transforms.inverse(inverse.T_end_flange @ arm.T_flange_tool)),
        lengths=np.array(astuple(inverse.lengths)),
        limits=np.sort(inverse.offsets[:, None] + inverse.signs[:, None] * arm.robot.limits, axis=1),
        rates=math.sqrt(weights.motion) * REFERENCE_SPEED / arm.robot.speeds,
        wraps=np.ptp(arm.robot.limits, axis=1) >= 2.0 * np.pi,
        turning=weights.motion * TURNING,
        limit_weight=weights.limits,
        singularity_weight=weights.singularities,
        minimum_wrist_angle=minimum_wrist_angle,
        # Joint 6 of an axial nozzle is turned by itself afterwards (`quadrants`).
        quadrants=np.array(bordered_joints(arm)[: 2 if arm.sense_of_turn else None], dtype=np.int64),
    )


@inner
def place_cost(joints: FloatArray, deposit: bool, terms: Terms) -> float:  # noqa: FBT001  (numba takes no keywords)
    """Return what a millimetre costs at (6,) joint angles."""
    margin = np.inf
    for joint in range(JOINTS):
        low, high = terms.limits[joint]
        off = _wrapped(joints[joint] - (low + high) / 2.0)
        margin = min(margin, (high - low) / 2.0 - abs(off))
    if math.isnan(joints[0]):
        return UNREACHED * FAILURE
    if margin < 0.0:
        return FAILURE * (1.0 - margin)
    shoulder, elbow, wrist = singular_terms(joints, terms.lengths)
    if deposit and wrist < terms.minimum_wrist_angle:
        return FAILURE
    singular = _discomfort(wrist / COMFORTABLE_WRIST)
    singular += _discomfort(elbow / COMFORTABLE_ELBOW)
    singular += _discomfort(shoulder / COMFORTABLE_SHOULDER)
    cost = terms.limit_weight * _discomfort(margin / COMFORTABLE_LIMIT) + terms.singularity_weight * singular
    return cost + _quadrant_cost(joints, terms.quadrants) if deposit else cost


@inner
def _quadrant_cost(joints: FloatArray, bordered: IntArray) -> float:
    """Return what a millimetre of deposit costs for joints that are near a border of their quadrants."""
    total = 0.0
    for joint in bordered:
        quarters = float(joints[int(joint)]) / (0.5 * math.pi)
        off = abs(quarters - math.floor(quarters + 0.5)) * (0.5 * math.pi)
        total += min(max((QUADRANT_CLEAR - off) / (QUADRANT_CLEAR - QUADRANT_NEAR), 0.0), 1.0)
    return QUADRANT * total


@inner
def step_cost(start: FloatArray, end: FloatArray, length: float, terms: Terms) -> float:
    """Return what the joint motion of a step costs; nothing where one end cannot be reached."""
    total = 0.0
    for joint in range(JOINTS):
        moved = end[joint] - start[joint]
        if terms.wraps[joint]:
            moved = _wrapped(moved)
        total += (terms.rates[joint] * moved) ** 2
        if abs(moved) > FLIP_ANGLE:
            total += FLIP * length
    return 0.0 if math.isnan(total) else total / length


@inner
def _discomfort(share: float) -> float:
    share = max(share, SMALLEST_SHARE)
    return 1.0 / (share * share)


@inner
def _wrapped(angle: float) -> float:
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


# One motion along a whole stream: joint angles that are continuous and inside the limits, or what fails where.


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
