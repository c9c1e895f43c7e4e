"""The cheapest climb of a ladder: at each rung one candidate of rotation and lean, all on one branch of the inverse.

A rung is a keyframe of the stream. Its candidates are attitudes of the nozzle: turns about it and leans from the
attitude of the path. The cost of a climb is

    sum over rungs of (place cost) * (length of path at the rung)  +  sum over steps of |joint motion|^2 / (length)

which is the integral of a place cost plus the squared joint rates along the path, so that it hardly depends on how many
rungs there are; `costs` says what counts. What cannot be used costs `FAILURE` and is not excluded, so that the best
climb is found where none is whole.

Dynamic programming [Bellman1957]: inverse kinematics and steps are worked out where they are needed and forgotten; one
small integer a state is kept, the step back from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from geoprint.kernels import inner, njit
from geoprint.model import BoolArray, FloatArray, IntArray
from geoprint.robot.arm import BRANCHES, JOINTS, solve_either
from geoprint.robot.reach.costs import Terms, place_cost, step_cost
from geoprint.robot.reach.keyframes import Keyframes

# A climb that costs this much fails somewhere, however short; one that holds never does.
FAILED = 1e7

# From which candidate of the rung before each state is reached.
StepBack: TypeAlias = NDArray[np.int16]


class Rungs(NamedTuple):
    """Keyframes and the candidates at each, as the kernels take them: k rungs, n candidates altogether.

    Attributes:
        Ts_base_tool: (k, 4, 4) poses, neither turned nor leaned [mm].
        deposit: (k,) whether the wrist singularity is refused, and borders of quadrants count.
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


def turning(frames: Keyframes, rotations: FloatArray, leans: FloatArray) -> Rungs:
    """Return a ladder of (k, r) turns at keyframes that lean by (k, 2)."""
    each = rotations.shape[1]
    return Rungs(
        Ts_base_tool=frames.Ts_base_tool,
        deposit=frames.deposit,
        steps=frames.steps,
        candidates=np.column_stack([rotations.reshape(-1), np.repeat(leans, each, axis=0)]),
        offsets=each * np.arange(len(rotations) + 1, dtype=np.int64),
        extra=np.zeros(rotations.size),
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
    Ts_foot_tool = terms.T_foot_base @ rungs.Ts_base_tool
    states = np.empty((2, int(np.diff(rungs.offsets).max()), BRANCHES, JOINTS + 1))
    _sweep(rungs, Ts_foot_tool, rungs.lengths, terms, branches, states, back, costs, choices)
    return Climbed(costs, choices)


@njit
def _sweep(
    rungs: Rungs,
    Ts_foot_tool: FloatArray,
    lengths: FloatArray,
    terms: Terms,
    branches: BoolArray,
    states: FloatArray,
    back: StepBack,
    costs: FloatArray,
    choices: IntArray,
) -> None:
    """Fill back (n, 8), costs (8,) and choices (8, k); states (2, c, 8, 7) hold joints and costs of two rungs."""
    count = rungs.deposit.size
    T = np.empty((4, 4))
    for rung in range(count):
        first, end = rungs.offsets[rung], rungs.offsets[rung + 1]
        here, before = states[rung % 2], states[(rung + 1) % 2]
        for candidate in range(first, end):
            state = here[candidate - first]
            state[:, 6] = np.inf
            if rungs.extra[candidate] == np.inf:
                continue
            _end_pose(Ts_foot_tool[rung], rungs.candidates[candidate], terms.T_tool_end, T)
            solve_either(T, terms.lengths, state)
            for branch in range(BRANCHES):
                if not branches[branch]:
                    continue
                place = rungs.extra[candidate] + place_cost(state[branch], rungs.deposit[rung], terms)
                if rung == 0:
                    state[branch, 6] = place * lengths[0]
                    continue
                start = rungs.offsets[rung - 1]
                least = _best_step(rungs, terms, start, candidate, rung, branch, before, state, back)
                state[branch, 6] = least + place * lengths[rung]
    for branch in range(BRANCHES):
        _retrace(rungs.offsets, states[(count - 1) % 2], branch, back, costs, choices)


@inner
def _best_step(
    rungs: Rungs,
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
    attitude, length = rungs.candidates[candidate], rungs.steps[rung - 1]
    count = rungs.offsets[rung] - start
    alike = min(candidate - rungs.offsets[rung], count - 1)
    for index in range(count):
        other = (alike + index) % count
        cost = before[other, branch, 6]
        cost += terms.turning * _squared_turn(attitude, rungs.candidates[start + other]) / length
        if cost >= least:
            continue
        cost += step_cost(before[other, branch], state[branch], length, terms)
        if cost < least:
            least = cost
            back[candidate, branch] = other
    return least


@inner
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


@inner
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


@inner
def _squared_turn(one: FloatArray, other: FloatArray) -> float:
    return (one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2 + (one[2] - other[2]) ** 2
