"""What a millimetre at a place and a step between two cost: joint rates, limits, singularities, quadrants.

Joint rates count relative to the joint's top speed at the tip speed `REFERENCE_SPEED`; a place costs
(comfortable / margin)^2 for the nearest joint limit and for each singularity, and on deposit `QUADRANT` for each axis
that is near a border of its quadrants. What cannot be used costs `FAILURE` and is not excluded.
"""

from __future__ import annotations

import math
from dataclasses import astuple
from typing import NamedTuple

import numpy as np

from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.kernels import inner
from geoprint.model import BoolArray, FloatArray, IntArray, SearchWeights
from geoprint.motion.arm import BORDERED, JOINTS, Arm

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
        quadrants=np.array(BORDERED[:2] if arm.sense_of_turn else BORDERED),
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
    if deposit and abs(joints[4]) < terms.minimum_wrist_angle:
        return FAILURE
    _, a2, _, _, c2, c3, _ = terms.lengths
    bend = _wrapped(joints[2] + math.atan2(c3, -a2))
    ahead = terms.lengths[0] + c2 * math.sin(joints[1]) + math.hypot(a2, c3) * math.sin(joints[1] + bend)
    singular = _discomfort(abs(joints[4]) / COMFORTABLE_WRIST)
    singular += _discomfort(min(abs(bend), math.pi - abs(bend)) / COMFORTABLE_ELBOW)
    singular += _discomfort(abs(ahead) / COMFORTABLE_SHOULDER)
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
