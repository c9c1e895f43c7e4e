"""Which turn about the nozzle, and which lean, each pose of a stream gets: the ladder on keyframes, made smooth.

A nozzle on the flange's axis is turned by one angle for the whole stream: turning moves joint 6 only (`quadrants`).
Any other nozzle turns along the path: the best constant turn of a few keyframes is the middle of the range, a coarse
ladder on some keyframes ranks the branches, one on all of them finds the turns of a branch, finer ladders around it
follow. The range ends half a turn from its middle: the tool never winds up.

The nozzle leans only near where the upright one was refused. There keyframes are denser, and each may lean in any
direction within the cone that leaves it room.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

import numpy as np

from geoprint.model import BoolArray, FloatArray, PoseStream
from geoprint.robot.arm import BRANCHES, Arm, branch_of
from geoprint.robot.reach.costs import Terms
from geoprint.robot.reach.keyframes import (
    Keyframes,
    keyframe_rate,
    keyframes_of,
    path_lengths,
    smoothed,
    thinned,
    tool_poses,
)
from geoprint.robot.reach.ladder import Rungs, climb, turning
from geoprint.robot.reach.lean_room import Leaning, candidate_leans, depositing, lean_costs
from geoprint.robot.reach.quadrants import still_turns

# Turns of the coarse ladder, rungs on which the middle of their range is judged, and those that rank the branches.
ROTATIONS = 18
JUDGED_RUNGS = 60
RANKED_RUNGS = 120
# Steps of the finer ladders [rad]; each looks two steps to either side.
FINER_STEPS = tuple(np.radians([8.0, 3.2, 1.3]).tolist())
FINER_OFFSETS = np.arange(-2.0, 3.0)
# Keyframes a millimetre where the nozzle lacks room or a motion fails between them, and how far around these are denser
# than usual [mm].
DENSE_RATE = 1.0
DENSE_LENGTH = 12.0
# Keyframes nearer than this [mm] to a place where the upright nozzle is refused may lean: room for a gentle ramp.
LEAN_LENGTH = 12.0
# Turns that a leaning nozzle may take besides, from that of the upright one [rad].
LEANING_TURNS = np.radians(15.0) * np.arange(-3.0, 4.0)
# The branch of home may cost so many times as much as another one, where the arm reaches everything on both sides.
HOME_WORTH = 2.0
# Branches that are tried with a leaning nozzle, best first.
LEANING_BRANCHES = 2


@final
@dataclass(frozen=True, slots=True, eq=False)
class Attitudes:
    """Turn and lean of each of p poses, for a branch.

    Attributes:
        rotations: (p,) about the nozzle [rad].
        leans: (p, 2) about the x and y axes of the tool of the path [rad].
        branch: of the inverse kinematics.
        holds: whether the arm can be at all keyframes.
    """

    rotations: FloatArray
    leans: FloatArray
    branch: int
    holds: bool


@final
class UprightSearch:
    """Turns about a nozzle that stays as upright as the path has it.

    Args:
        poses: p poses of the path.
        arm: with its tool.
        T_base_work: (4, 4) where the part stands [mm].
        terms: of the costs.

    Attributes:
        branches: those that hold at some keyframes, the cheapest first, or else the cheapest alone.
    """

    __slots__ = ("_T_base_work", "_arm", "_frames", "_poses", "_terms", "_turns", "branches")

    def __init__(self, poses: PoseStream, arm: Arm, *, T_base_work: FloatArray, terms: Terms) -> None:
        self._poses = poses
        self._arm = arm
        self._T_base_work = T_base_work
        self._terms = terms
        usual = np.full(poses.count, keyframe_rate(poses))
        self._frames = keyframes_of(poses, T_base_work=T_base_work, rates=usual)
        self._turns = _coarse_turns(self._frames, arm, terms)
        self.branches = _ranked_branches(self._frames, arm, self._turns, terms)

    def attitudes(self, branch: int, *, dense: BoolArray) -> Attitudes:
        """Return the best turns on a branch; keyframes are denser around (p,) `dense` poses."""
        frames = self._frames
        if dense.any():
            rates = _rates(self._poses, dense=dense)
            frames = keyframes_of(self._poses, T_base_work=self._T_base_work, rates=rates)
        leans = np.zeros((frames.count, 2))
        coarse = turning(frames, np.tile(self._turns, (frames.count, 1)), leans)
        climbed = climb(coarse, self._terms, branches=np.arange(BRANCHES) == branch)
        rotations = coarse.candidates[coarse.offsets[:-1] + climbed.choices[branch], 0]
        holds = bool(climbed.holds[branch])
        return _attitudes(frames, rotations, leans, arm=self._arm, terms=self._terms, branch=branch, holds=holds)

    def still(self, branch: int) -> Iterator[Attitudes]:
        """Yield constant turns that are clear of borders of quadrants on deposit, the cheapest of a branch first."""
        if self._arm.sense_of_turn:
            return
        count = self._poses.count
        for turn in still_turns(self._frames, self._arm, self._terms, branch=branch):
            yield Attitudes(np.full(count, turn), np.zeros((count, 2)), branch, holds=True)


def leaning_attitudes(
    poses: PoseStream,
    arm: Arm,
    *,
    T_base_work: FloatArray,
    terms: Terms,
    leaning: Leaning,
    weight: float,
    upright: Attitudes,
    refused: BoolArray,
) -> Iterator[Attitudes]:
    """Yield turns and leans that avoid what refuses the upright nozzle, the cheapest branch first.

    Args:
        poses: p poses of the path.
        arm: with its tool.
        T_base_work: (4, 4) where the part stands [mm].
        terms: of the costs.
        leaning: how far the nozzle may lean, and what it must not touch.
        weight: of the lean.
        upright: the best attitudes without a lean.
        refused: (p,) where the arm cannot follow those.
    """
    Ts_base_tool = tool_poses(poses, T_base_work=T_base_work)
    lacking = leaning.room.lacking(Ts_base_tool, deposit=depositing(poses))
    wanted = lacking | refused
    if not wanted.any():
        return
    frames = keyframes_of(poses, T_base_work=T_base_work, rates=_rates(poses, dense=lacking))
    free = np.flatnonzero(_distances(frames.lengths, path_lengths(poses)[wanted]) <= LEAN_LENGTH)
    leans = candidate_leans(leaning.max_tilt)
    costs = np.full((frames.count, len(leans)), np.inf)
    costs[:, 0] = 0.0
    costs[free] = lean_costs(
        leans, poses=poses, Ts_base_tool=Ts_base_tool, places=frames.places, rungs=free, leaning=leaning, weight=weight
    )
    kept = np.interp(np.arange(frames.count), frames.places, upright.rotations)
    turns = np.zeros(1) if arm.sense_of_turn else LEANING_TURNS
    rungs = _leaning(frames, kept[:, None] + turns, leans=leans, costs=costs)
    order = [upright.branch, *(branch for branch in range(BRANCHES) if branch != upright.branch)]
    for branch in order[:LEANING_BRANCHES]:
        climbed = climb(rungs, terms, branches=np.arange(BRANCHES) == branch)
        chosen = rungs.candidates[rungs.offsets[:-1] + climbed.choices[branch]]
        holds = bool(climbed.holds[branch])
        yield _attitudes(frames, chosen[:, 0], chosen[:, 1:], arm=arm, terms=terms, branch=branch, holds=holds)


def _attitudes(
    frames: Keyframes, rotations: FloatArray, leans: FloatArray, *, arm: Arm, terms: Terms, branch: int, holds: bool
) -> Attitudes:
    """Refine the turns of keyframes on one branch, and return the smooth attitudes of all poses."""
    only = np.arange(BRANCHES) == branch
    if arm.sense_of_turn:
        rotations = np.zeros(frames.count)
    else:
        for step in FINER_STEPS:
            finer = turning(frames, rotations[:, None] + step * FINER_OFFSETS, leans)
            rotations = finer.candidates[finer.offsets[:-1] + climb(finer, terms, branches=only).choices[branch], 0]
    values = smoothed(np.column_stack([rotations, leans]), frames.places)
    return Attitudes(values[:, 0], values[:, 1:], branch, holds)


def _coarse_turns(frames: Keyframes, arm: Arm, terms: Terms) -> FloatArray:
    """Return the turns of the coarse ladder, around the best constant turn of a few keyframes; of an axial tool one."""
    if arm.sense_of_turn:
        return np.zeros(1)
    turns = 2.0 * np.pi * (np.arange(ROTATIONS) / ROTATIONS - 0.5)
    few, every = thinned(frames, count=JUDGED_RUNGS), np.ones(BRANCHES, dtype=np.bool_)
    still = np.zeros((few.count, 2))
    costs = [climb(turning(few, np.full((few.count, 1), turn), still), terms, branches=every).costs for turn in turns]
    return turns + turns[int(np.min(costs, axis=1).argmin())]


def _ranked_branches(frames: Keyframes, arm: Arm, turns: FloatArray, terms: Terms) -> list[int]:
    """Return the branches that hold on a ladder of fewer rungs, the cheapest first, or else the cheapest alone.

    An arm that turns all the way round about axis 1 reaches everything on both sides at about the same cost: the branch
    of home comes first there unless it costs far more, so that no motion from and to home swings the arm around.
    """
    few = thinned(frames, count=RANKED_RUNGS)
    rungs = turning(few, np.tile(turns, (few.count, 1)), np.zeros((few.count, 2)))
    climbed = climb(rungs, terms, branches=np.ones(BRANCHES, dtype=np.bool_))
    costs = climbed.costs.copy()
    if terms.wraps[0]:
        costs[branch_of(arm.robot.home[None], arm=arm)[0]] /= HOME_WORTH
    order = np.argsort(costs, kind="stable")
    return order[: max(int(climbed.holds.sum()), 1)].tolist()


def _rates(poses: PoseStream, *, dense: BoolArray) -> FloatArray:
    """Return (p,) keyframes a millimetre: more around (p,) dense poses, falling off smoothly to the usual rate."""
    usual = keyframe_rate(poses)
    if not dense.any():
        return np.full(poses.count, usual)
    lengths = path_lengths(poses)
    share = np.clip(2.0 - 2.0 * _distances(lengths, lengths[dense]) / DENSE_LENGTH, 0.0, 1.0)
    return usual + max(DENSE_RATE - usual, 0.0) * share**2 * (3.0 - 2.0 * share)


def _distances(values: FloatArray, ascending: FloatArray) -> FloatArray:
    """Return how far each value is from the nearest of some ascending ones."""
    following = np.searchsorted(ascending, values).clip(0, ascending.size - 1)
    return np.minimum(np.abs(ascending[following] - values), np.abs(ascending[np.maximum(following - 1, 0)] - values))


def _leaning(frames: Keyframes, turns: FloatArray, *, leans: FloatArray, costs: FloatArray) -> Rungs:
    """Return a ladder of (k, r) turns at keyframes, each with those of (l, 2) leans whose (k, l) cost is finite."""
    rung, lean = np.nonzero(np.isfinite(costs))
    return Rungs(
        Ts_base_tool=frames.Ts_base_tool,
        deposit=frames.deposit,
        steps=frames.steps,
        candidates=np.column_stack([turns[rung].reshape(-1), np.repeat(leans[lean], turns.shape[1], axis=0)]),
        offsets=np.append(0, np.cumsum(np.bincount(rung, minlength=frames.count) * turns.shape[1])),
        extra=np.repeat(costs[rung, lean], turns.shape[1]),
    )
