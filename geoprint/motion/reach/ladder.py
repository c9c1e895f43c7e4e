"""The cheapest climb of a ladder: at each rung one candidate of rotation and lean, all on one branch of the inverse.

A rung is a keyframe of the stream. Its candidates are attitudes of the nozzle: turns about it and leans from the
attitude of the path. The cost of a climb is

    sum over rungs of (place cost) * (length of path at the rung)  +  sum over steps of |joint motion|^2 / (length)

which is the integral of a place cost plus the squared joint rates along the path, so that it hardly depends on how many
rungs there are. Joint rates count relative to the joint's top speed at the tip speed `REFERENCE_SPEED`; a place
costs (comfortable / margin)^2 for the nearest joint limit and for each singularity. What cannot be used costs `FAILURE`
and is not excluded, so that the best climb is found where none is whole.

Dynamic programming [Bellman1957]: inverse kinematics and steps are worked out where they are needed and forgotten; one
small integer a state is kept, the step back from it.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import NamedTuple, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.kernels import njit
from geoprint.model import BoolArray, FloatArray, IntArray, SearchWeights
from geoprint.motion.arm import BRANCHES, JOINTS, Arm, solve_pose

# Tip speed [mm/s] at which a joint rate becomes a share of the joint's top speed.
REFERENCE_SPEED = 20.0
# Margins at which a place costs 1 for each: from the nearest joint limit, of the wrist, of the elbow [rad], and of the
# wrist centre from axis 1 [mm].
COMFORTABLE_LIMIT = float(np.radians(10.0))
COMFORTABLE_WRIST = float(np.radians(15.0))
COMFORTABLE_ELBOW = float(np.radians(15.0))
COMFORTABLE_SHOULDER = 50.0
# A margin is worth no less than this share of the comfortable one: on the singularity itself the cost stays finite.
SMALLEST_SHARE = 0.03
# What a millimetre costs where the arm cannot be: more than any motion that it can make ...
FAILURE = 1e9
# ... and so many times that, where there is no solution at all; beyond a limit it grows with every radian.
UNREACHED = 5.0
# A climb that costs this much fails somewhere, however short; one that holds never does.
FAILED = 1e7
# What a step costs in which a joint turns too far to have taken the shorter turn [rad].
FLIP = 1e5
FLIP_ANGLE = float(np.radians(90.0))
# What turning about the nozzle or leaning by a radian a millimetre costs in itself [mm]: a radian on 100 mm costs
# 0.1/mm. Every turn starts and ends, and that costs the joints accelerations which they need for the path.
TURNING = 1000.0


# From which candidate of the rung before each state is reached.
StepBack: TypeAlias = NDArray[np.int16]


@final
@dataclass(frozen=True, slots=True, eq=False)
class Rungs:
    """Keyframes and the candidates at each: k rungs, n candidates altogether.

    Attributes:
        Ts_base_tool: (k, 4, 4) poses, neither turned nor leaned [mm].
        deposit: (k,) whether the wrist singularity is refused.
        steps: (k - 1,) length of path from each rung to the next [mm].
        candidates: (n, 3) turn about the nozzle, and lean about the x and y axes of the tool before it turns [rad].
        offsets: (k + 1,) first candidate of each rung; each has one at least.
        extra: (n,) what a candidate costs besides [1/mm]; infinite where it is not allowed.
    """

    Ts_base_tool: FloatArray
    deposit: BoolArray
    steps: FloatArray
    candidates: FloatArray
    offsets: IntArray
    extra: FloatArray

    @property
    def lengths(self) -> FloatArray:
        """(k,) length of path that each rung stands for [mm]; a single rung stands for 1 mm."""
        if not self.steps.size:
            return np.ones(1)
        return (np.append(self.steps, 0.0) + np.append(0.0, self.steps)) / 2.0


class Terms(NamedTuple):
    """What the costs are made of, as the kernels take it: lengths in mm, angles in rad.

    Joints count as the closed form counts them, whatever the conventions of the arm's URDF are.
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


@final
@dataclass(frozen=True, slots=True, eq=False)
class Climbed:
    """The cheapest climbs of a ladder.

    Attributes:
        costs: (8,) of each branch; infinite where it was not asked for.
        choices: (8, k) candidate of each rung, counted from the rung's first.
    """

    costs: FloatArray
    choices: IntArray

    @property
    def holds(self) -> BoolArray:
        """(8,) whether the cheapest climb of each branch fails at no rung."""
        return self.costs < FAILED


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
    )


def climb(rungs: Rungs, terms: Terms, *, branches: BoolArray) -> Climbed:
    """Find the cheapest climb on each branch; of equal ones the first.

    Args:
        rungs: of the ladder.
        terms: of the costs.
        branches: (8,) which branches to look at.
    """
    back = np.zeros((len(rungs.candidates), BRANCHES), dtype=np.int16)
    costs = np.full(BRANCHES, np.inf)
    choices = np.zeros((BRANCHES, len(rungs.deposit)), dtype=np.int64)
    ladder = _Ladder(
        terms.T_foot_base @ rungs.Ts_base_tool,
        rungs.deposit,
        rungs.steps,
        rungs.lengths,
        rungs.candidates,
        rungs.offsets,
        rungs.extra,
    )
    widest = int(np.diff(rungs.offsets).max())
    _sweep(ladder, terms, branches, np.empty((2, widest, BRANCHES, JOINTS + 1)), back, costs, choices)
    return Climbed(costs, choices)


class _Ladder(NamedTuple):
    """`Rungs` as the kernels take them."""

    Ts_foot_tool: FloatArray
    deposit: BoolArray
    steps: FloatArray
    lengths: FloatArray
    candidates: FloatArray
    offsets: IntArray
    extra: FloatArray


@njit(cache=True, error_model="numpy")
def _sweep(
    ladder: _Ladder,
    terms: Terms,
    branches: BoolArray,
    states: FloatArray,
    back: StepBack,
    costs: FloatArray,
    choices: IntArray,
) -> None:
    """Fill back (n, 8), costs (8,) and choices (8, k); states (2, c, 8, 7) hold joints and costs of two rungs."""
    count = ladder.deposit.size
    T = np.empty((4, 4))
    for rung in range(count):
        first, end = ladder.offsets[rung], ladder.offsets[rung + 1]
        here, before = states[rung % 2], states[(rung + 1) % 2]
        for candidate in range(first, end):
            state = here[candidate - first]
            state[:, 6] = np.inf
            if ladder.extra[candidate] == np.inf:
                continue
            _end_pose(ladder.Ts_foot_tool[rung], ladder.candidates[candidate], terms.T_tool_end, T)
            solve_pose(T, terms.lengths, state)
            for branch in range(BRANCHES):
                if not branches[branch]:
                    continue
                place = ladder.extra[candidate] + _place_cost(state[branch], ladder.deposit[rung], terms)
                if rung == 0:
                    state[branch, 6] = place * ladder.lengths[0]
                    continue
                start = ladder.offsets[rung - 1]
                least = _best_step(ladder, terms, start, candidate, rung, branch, before, state, back)
                state[branch, 6] = least + place * ladder.lengths[rung]
    for branch in range(BRANCHES):
        _retrace(ladder.offsets, states[(count - 1) % 2], branch, back, costs, choices)


@njit(cache=True, error_model="numpy")
def _best_step(
    ladder: _Ladder,
    terms: Terms,
    start: int,
    candidate: int,
    rung: int,
    branch: int,
    before: FloatArray,
    state: FloatArray,
    back: StepBack,
) -> float:
    """Return the least cost of coming to a candidate, and note from which of the rung before.

    The one that is numbered alike comes first: it mostly turns least, and what turns far is too dear then at a glance.
    """
    least = np.inf
    attitude, length = ladder.candidates[candidate], ladder.steps[rung - 1]
    count = ladder.offsets[rung] - start
    alike = min(candidate - ladder.offsets[rung], count - 1)
    for index in range(count):
        other = (alike + index) % count
        cost = before[other, branch, 6]
        cost += terms.turning * _squared_turn(attitude, ladder.candidates[start + other]) / length
        if cost >= least:
            continue
        cost += _step_cost(before[other, branch], state[branch], length, terms)
        if cost < least:
            least = cost
            back[candidate, branch] = other
    return least


@njit(cache=True, error_model="numpy")
def _retrace(
    offsets: IntArray, last: FloatArray, branch: int, back: StepBack, costs: FloatArray, choices: IntArray
) -> None:
    """Fill the cost and the choices of one branch from the cheapest state of the last rung back."""
    count = offsets.size - 1
    for candidate in range(offsets[count] - offsets[count - 1]):
        if last[candidate, branch, 6] < costs[branch]:
            costs[branch] = last[candidate, branch, 6]
            choices[branch, count - 1] = candidate
    if costs[branch] == np.inf:
        return
    for rung in range(count - 1, 0, -1):
        choices[branch, rung - 1] = back[offsets[rung] + choices[branch, rung], branch]


@njit(cache=True, error_model="numpy")
def _place_cost(joints: FloatArray, deposit: bool, terms: Terms) -> float:  # noqa: FBT001  (numba takes no keywords)
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
    return terms.limit_weight * _discomfort(margin / COMFORTABLE_LIMIT) + terms.singularity_weight * singular


@njit(cache=True, error_model="numpy")
def _step_cost(start: FloatArray, end: FloatArray, length: float, terms: Terms) -> float:
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


@njit(cache=True, error_model="numpy")
def _end_pose(T: FloatArray, candidate: FloatArray, T_tool_end: FloatArray, out: FloatArray) -> None:
    """Fill (4, 4) out with the end of an arm whose tool leans by (x, y) and turns, as `turned` has it."""
    turn, x, y = candidate
    angle = math.hypot(x, y)
    sine = math.sin(angle) / angle if angle > 0.0 else 1.0
    less = (1.0 - math.cos(angle)) / (angle * angle) if angle > 0.0 else 0.5
    cosine_turn, sine_turn = math.cos(turn), math.sin(turn)
    for row in range(3):
        a, b, c = T[row, 0], T[row, 1], T[row, 2]
        leaned_x = a * (1.0 - less * y * y) + b * less * x * y - c * sine * y
        leaned_y = a * less * x * y + b * (1.0 - less * x * x) + c * sine * x
        along = a * sine * y - b * sine * x + c * math.cos(angle)
        turned_x, turned_y = (
            cosine_turn * leaned_x + sine_turn * leaned_y,
            cosine_turn * leaned_y - sine_turn * leaned_x,
        )
        for column in range(4):
            out[row, column] = (
                turned_x * T_tool_end[0, column] + turned_y * T_tool_end[1, column] + along * T_tool_end[2, column]
            )
        out[row, 3] += T[row, 3]


@njit(cache=True)
def _squared_turn(one: FloatArray, other: FloatArray) -> float:
    return (one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2 + (one[2] - other[2]) ** 2


@njit(cache=True)
def _discomfort(share: float) -> float:
    share = max(share, SMALLEST_SHARE)
    return 1.0 / (share * share)


@njit(cache=True)
def _wrapped(angle: float) -> float:
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)
