"""Inverse kinematics of a stream of poses: one branch for all of it, the nozzle turned and leaned as it suits.

`attitude_search` proposes turns and leans on keyframes; here each proposal is followed along every pose and the
straight moves between them, and the first that holds everywhere is taken.

All poses are reached on one of the eight branches, the cheapest that holds along all samples of the stream; the
straight moves between the poses are followed too, so that no flip hides between rows that are far apart. Joint 6, which
can turn more than once, is unwound along the stream; of the whole turns that keep all of it inside the limits the
nearest to home is taken. An arm whose inverse is iteration gets the best of some constant turns, and no lean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import InputError, VerificationError
from geoprint.model import BoolArray, FloatArray, JointPath, PoseStream, SearchWeights
from geoprint.robot.arm import BRANCHES, JOINTS, Arm, about_nozzle, tilts, turned
from geoprint.robot.reach.attitude_search import Attitudes, UprightSearch, leaning_attitudes
from geoprint.robot.reach.costs import Followed, cost_terms, follow
from geoprint.robot.reach.keyframes import (
    MINIMUM_WRIST_ANGLE,
    Margin,
    PoseSamples,
    sample_poses,
    smallest_margin,
    tip_lengths,
    tool_poses,
    usable,
)
from geoprint.robot.reach.lean_room import Leaning, depositing
from geoprint.robot.reach.quadrants import axial_rotation, axial_weights, near_border
from geoprint.robot.reach.reach_map import ReachMap, mapped

# A constant turn about the nozzle for arms without a closed form, whose inverse is too slow for the ladder.


# Turns that are tried, and poses on which they are judged.
TURNS = 12
JUDGED_POSES = 40


@final
class ConstantTurns:
    """The best constant turn about the nozzle for each branch.

    Args:
        poses: p poses of the path.
        arm: with its tool.
        T_base_work: (4, 4) where the part stands [mm].
        minimum_wrist_angle: smallest |q5| on deposit [rad].

    Attributes:
        branches: those that serve most of the judged poses first; of equal ones the one nearest to home.
    """

    __slots__ = ("_count", "_turns", "branches")

    def __init__(self, poses: PoseStream, arm: Arm, *, T_base_work: FloatArray, minimum_wrist_angle: float) -> None:
        self._count = poses.count
        rows = np.unique(np.linspace(0, poses.count - 1, min(poses.count, JUDGED_POSES)).round().astype(np.int64))
        turns = 2.0 * np.pi * np.arange(TURNS) / TURNS
        commanded = tool_poses(poses, T_base_work=T_base_work)[rows] @ about_nozzle(turns)[:, None]
        joints = arm.solutions(commanded.reshape(-1, 4, 4)).reshape(TURNS, rows.size, BRANCHES, JOINTS)
        each = np.swapaxes(joints, 1, 2)
        holds = usable(each, arm, deposit=depositing(poses)[rows], minimum_wrist_angle=minimum_wrist_angle)
        away = np.linalg.norm(transforms.wrapped(each - arm.robot.home), axis=3)
        # No solution is farther from home than this; so the share of served poses counts first.
        farthest = np.pi * np.sqrt(JOINTS)
        merit = holds.sum(axis=2) - np.where(holds, away, 0.0).sum(axis=2) / (rows.size * farthest)
        self._turns: FloatArray = turns[merit.argmax(axis=0)]
        self.branches: list[int] = np.argsort(-merit.max(axis=0), kind="stable").tolist()

    def attitudes(self, branch: int, *, dense: BoolArray) -> Attitudes:  # noqa: ARG002  (there are no keyframes)
        """Return the turn of a branch at every pose; it does not depend on where keyframes are dense."""
        return Attitudes(np.full(self._count, self._turns[branch]), np.zeros((self._count, 2)), branch, holds=False)

    def still(self, branch: int) -> Iterator[Attitudes]:  # noqa: ARG002  (no turn of these is any other)
        """Yield nothing: RAPID counts quadrants, and it is written only for arms with a closed form."""
        return iter(())


# What is counted where the cell says nothing.
EQUAL_WEIGHTS = SearchWeights()

# Turns about the nozzle by which a pose that fails is tried by itself: 5 degrees is finer than any comfortable margin.
TRIED_TURNS = 72

# How often keyframes are set denser where a motion fails between them.
DENSER_ATTEMPTS = 2

# How many constant turns are followed, where keyframes say that they stay clear of the borders of quadrants.
STILL_ATTEMPTS = 3

# Samples asked at a time whether any turn serves them: about 100 MB of arrays.
SAMPLES_AT_A_TIME = 500

# Largest difference between the commanded pose and forward kinematics of the solution [mm, rad].
POSITION_TOLERANCE = 1e-3
ROTATION_TOLERANCE = 1e-5


def reach(
    poses: PoseStream,
    arm: Arm,
    *,
    T_base_work: FloatArray,
    weights: SearchWeights = EQUAL_WEIGHTS,
    leaning: Leaning | None = None,
    refuse: Callable[[PoseStream], None] | None = None,
    minimum_wrist_angle: float = MINIMUM_WRIST_ANGLE,
) -> JointPath:
    """Find joint angles for every pose, continuous and within the limits of `arm.robot`.

    The nozzle is round: a bent one is turned about itself along the path as joint motion, joint limits and
    singularities make it cheapest (`ladder`), one on the flange's axis by a constant angle. On deposit axes 1, 4 and 6
    keep away from the borders of their quadrants where a turn about the nozzle does that, and cross them quickly
    elsewhere. The nozzle stays as upright as the path has it, unless it may lean: then it does, around the places where
    the arm cannot follow or the nozzle lacks room, and nowhere else.

    Args:
        poses: p poses in the work frame.
        arm: with its tool.
        T_base_work: (4, 4) where the part stands [mm].
        weights: of what a motion costs.
        leaning: how far the nozzle may lean and what it must not touch, or None where it may not.
        refuse: asked about poses as soon as they are final, before what takes longer; what it raises is passed on.
        minimum_wrist_angle: smallest |q5| on deposit [rad].

    Returns:
        The joint path; its poses are turned and leaned.

    Raises:
        InputError: the stream is empty.
        ReachError: no motion holds for the whole stream; it tells what the best one loses, and where it fails first.
        VerificationError: a solution does not lead back to its pose, or the nozzle leaves the cone.
    """
    motion = _best_motion(
        poses, arm, T_base_work=T_base_work, weights=weights, leaning=leaning, minimum_wrist_angle=minimum_wrist_angle
    )
    if not motion.followed.complete:
        raise _mapped(motion, arm, minimum_wrist_angle=minimum_wrist_angle).refusal()
    path = _joint_path(motion, T_base_work=T_base_work)
    if refuse is not None:
        refuse(path.poses)
    _confirm(path, arm)
    _confirm_cone(path, poses, leaning=leaning)
    return path


def reach_map(
    poses: PoseStream,
    arm: Arm,
    *,
    T_base_work: FloatArray,
    weights: SearchWeights = EQUAL_WEIGHTS,
    minimum_wrist_angle: float = MINIMUM_WRIST_ANGLE,
) -> ReachMap:
    """Say of every pose whether the motion that `reach` takes without a lean, or else the best, serves it, and why not.

    Args:
        poses: p poses in the work frame.
        arm: with its tool.
        T_base_work: (4, 4) where the part stands [mm].
        weights: of what a motion costs.
        minimum_wrist_angle: smallest |q5| on deposit [rad].

    Returns:
        The map; complete exactly where `reach` succeeds.

    Raises:
        InputError: the stream is empty.
    """
    motion = _best_motion(
        poses, arm, T_base_work=T_base_work, weights=weights, leaning=None, minimum_wrist_angle=minimum_wrist_angle
    )
    return _mapped(motion, arm, minimum_wrist_angle=minimum_wrist_angle)


def reach_margin(
    poses: PoseStream, arm: Arm, *, T_base_work: FloatArray, weights: SearchWeights = EQUAL_WEIGHTS
) -> Margin:
    """Return the smallest margin, along the whole stream, of the motion that `reach` takes, or else of the best one.

    Args:
        poses: p poses in the work frame; the nozzle does not lean from them.
        arm: with its tool.
        T_base_work: (4, 4) where the part stands [mm].
        weights: of what a motion costs.

    Returns:
        The margin; negative where a pose is refused. Flips and windings do not count.

    Raises:
        InputError: the stream is empty.
    """
    motion = _best_motion(
        poses, arm, T_base_work=T_base_work, weights=weights, leaning=None, minimum_wrist_angle=MINIMUM_WRIST_ANGLE
    )
    return smallest_margin(motion.followed.joints, arm, deposit=motion.samples.deposit)


@final
@dataclass(frozen=True, slots=True, eq=False)
class _StreamMotion:
    """Attitudes that were followed: the poses with them, and samples along these."""

    attitudes: Attitudes
    poses: PoseStream
    samples: PoseSamples
    followed: Followed
    arm: Arm

    @property
    def failures(self) -> int:
        """At how many samples it fails."""
        return int(np.count_nonzero(self.followed.failures.reasons))

    @property
    def near(self) -> int:
        """At how many samples on deposit an axis is near a border of its quadrants."""
        return int(near_border(self.followed.joints[self.samples.deposit], self.arm).sum())

    @property
    def refused(self) -> BoolArray:
        """(p,) whether it fails at a pose or on the straight move to it."""
        failing = self.followed.failures.reasons != 0
        return np.logical_or.reduceat(failing, np.append(0, self.samples.starts[:-1] + 1))


def _best_motion(
    poses: PoseStream,
    arm: Arm,
    *,
    T_base_work: FloatArray,
    weights: SearchWeights,
    leaning: Leaning | None,
    minimum_wrist_angle: float,
) -> _StreamMotion:
    """Return the first motion that holds along all samples, or else the one that fails at fewest.

    Among motions that may lean, the one that lacks room at fewest poses comes before the others.
    """
    if poses.count == 0:
        raise InputError("the pose stream is empty: plan at least one run.")

    def motion_with(attitudes: Attitudes) -> _StreamMotion:
        return _followed(poses, arm, attitudes, T_base_work=T_base_work, minimum_wrist_angle=minimum_wrist_angle)

    if arm.closed_form is None:
        constant = ConstantTurns(poses, arm, T_base_work=T_base_work, minimum_wrist_angle=minimum_wrist_angle)
        return _upright(motion_with, constant, count=poses.count)
    terms = cost_terms(arm, weights=weights, minimum_wrist_angle=minimum_wrist_angle)
    upright = _upright(motion_with, UprightSearch(poses, arm, T_base_work=T_base_work, terms=terms), count=poses.count)
    if leaning is None:
        return upright
    proposed = leaning_attitudes(
        poses, arm, T_base_work=T_base_work, terms=terms, leaning=leaning, weight=weights.lean,
        upright=upright.attitudes, refused=upright.refused,
    )  # fmt: skip
    motions = [upright]
    for attitudes in proposed:
        motions.append(motion_with(attitudes))
        # Room does not depend on the branch: another one is of use only to an arm that cannot follow.
        if motions[-1].followed.complete:
            break
    return min(motions, key=lambda motion: (motion.failures, _lacking(motion, leaning, T_base_work=T_base_work)))


def _upright(
    motion_with: Callable[[Attitudes], _StreamMotion], search: UprightSearch | ConstantTurns, *, count: int
) -> _StreamMotion:
    """Return the first motion without a lean that holds along all samples, or else the one that fails at fewest.

    Where a motion of `count` poses fails between keyframes only, they are set denser there before the next branch.
    """
    tried: list[_StreamMotion] = []
    for branch in search.branches:
        dense = np.zeros(count, dtype=np.bool_)
        for _ in range(DENSER_ATTEMPTS + 1):
            tried.append(motion_with(search.attitudes(branch, dense=dense)))
            if tried[-1].followed.complete:
                return _clearest(motion_with, search, tried[-1])
            if not tried[-1].attitudes.holds:
                break
            dense = dense | tried[-1].refused
    return min(tried, key=lambda motion: motion.failures)


def _clearest(
    motion_with: Callable[[Attitudes], _StreamMotion], search: UprightSearch | ConstantTurns, motion: _StreamMotion
) -> _StreamMotion:
    """Return a motion that holds, or, where it comes near a border on deposit, a still one that does not."""
    if motion.near:
        for attitudes in islice(search.still(motion.attitudes.branch), STILL_ATTEMPTS):
            still = motion_with(attitudes)
            if still.followed.complete and not still.near:
                return still
    return motion


def _followed(
    poses: PoseStream, arm: Arm, attitudes: Attitudes, *, T_base_work: FloatArray, minimum_wrist_angle: float
) -> _StreamMotion:
    commanded = turned(poses, rotations=attitudes.rotations, leans=attitudes.leans)
    samples = sample_poses(commanded, T_base_work=T_base_work)
    if arm.sense_of_turn:
        joints = arm.solutions(samples.Ts_base_tool)[:, attitudes.branch]
        known = np.isfinite(joints[:, 5])
        weights = axial_weights(joints[known], arm, deposit=samples.deposit[known])
        turn = axial_rotation(np.unwrap(joints[known, 5]), arm.robot, weights=weights) * arm.sense_of_turn
        attitudes = replace(attitudes, rotations=attitudes.rotations + turn)
        commanded = turned(poses, rotations=attitudes.rotations, leans=attitudes.leans)
        samples = replace(samples, Ts_base_tool=samples.Ts_base_tool @ about_nozzle(np.array([turn]))[0])
    followed = follow(samples, arm, branch=attitudes.branch, minimum_wrist_angle=minimum_wrist_angle)
    return _StreamMotion(attitudes, commanded, samples, followed, arm)


def _joint_path(motion: _StreamMotion, *, T_base_work: FloatArray) -> JointPath:
    joints = motion.followed.joints[motion.samples.starts]
    return JointPath(
        poses=motion.poses,
        joints=joints,
        branch=motion.followed.branch,
        rotations=motion.attitudes.rotations,
        leans=motion.attitudes.leans,
        T_base_work=T_base_work,
    )


def _lacking(motion: _StreamMotion, leaning: Leaning, *, T_base_work: FloatArray) -> int:
    commanded = tool_poses(motion.poses, T_base_work=T_base_work)
    return int(leaning.room.lacking(commanded, deposit=depositing(motion.poses)).sum())


def _mapped(motion: _StreamMotion, arm: Arm, *, minimum_wrist_angle: float) -> ReachMap:
    steps = np.where(motion.poses.deposited, tip_lengths(motion.poses), 0.0) / 2.0
    return mapped(
        motion.followed.failures,
        motion.samples,
        servable=_servable(motion, arm, minimum_wrist_angle=minimum_wrist_angle),
        lengths=np.append(steps, 0.0) + np.append(0.0, steps),
        branch=motion.followed.branch,
    )


def _servable(motion: _StreamMotion, arm: Arm, *, minimum_wrist_angle: float) -> BoolArray:
    """Return for each sample whether any branch and turn about the nozzle serves it by itself."""
    samples = motion.samples
    failing = np.flatnonzero(motion.followed.failures.reasons)
    servable = np.ones(len(samples.deposit), dtype=bool)
    turns = about_nozzle(2.0 * np.pi * np.arange(TRIED_TURNS) / TRIED_TURNS)[:, None]
    for first in range(0, failing.size, SAMPLES_AT_A_TIME):
        rows = failing[first : first + SAMPLES_AT_A_TIME]
        joints = arm.solutions((samples.Ts_base_tool[rows] @ turns).reshape(-1, 4, 4))
        each = np.swapaxes(joints.reshape(TRIED_TURNS, rows.size, BRANCHES, JOINTS), 1, 2)
        holds = usable(each, arm, deposit=samples.deposit[rows], minimum_wrist_angle=minimum_wrist_angle)
        servable[rows] = holds.any(axis=(0, 1))
    return servable


def _confirm(path: JointPath, arm: Arm) -> None:
    commanded = tool_poses(path.poses, T_base_work=path.T_base_work)
    found = arm.tool_poses(path.joints)
    off = np.linalg.norm(found[:, :3, 3] - commanded[:, :3, 3], axis=1)
    turned = transforms.rotation_angle(np.swapaxes(commanded[:, :3, :3], 1, 2) @ found[:, :3, :3])
    worst = int(np.argmax(np.maximum(off / POSITION_TOLERANCE, turned / ROTATION_TOLERANCE)))
    if off[worst] > POSITION_TOLERANCE or turned[worst] > ROTATION_TOLERANCE:
        raise VerificationError(
            f"run {path.poses.runs[worst] + 1}, pose {worst}: forward kinematics misses the commanded pose by "
            f"{off[worst]:.3g} mm and {turned[worst]:.3g} rad, allowed are {POSITION_TOLERANCE:g} mm and "
            f"{ROTATION_TOLERANCE:g} rad. Please report this as a defect of geoprint.",
            pose=worst,
            position_mm=float(off[worst]),
            rotation_rad=float(turned[worst]),
        )


def _confirm_cone(path: JointPath, poses: PoseStream, *, leaning: Leaning | None) -> None:
    """Refuse a lean on deposit that leaves the cone, or makes worse what the path itself has outside."""
    max_tilt = leaning.max_tilt if leaning else 0.0
    excess = tilts(path.poses) - np.maximum(max_tilt, tilts(poses))
    worst = int(np.where(depositing(poses), excess, -np.inf).argmax())
    if depositing(poses)[worst] and excess[worst] > ROTATION_TOLERANCE:
        raise VerificationError(
            f"run {poses.runs[worst] + 1}, pose {worst}: the nozzle leans {np.degrees(excess[worst]):.3g} degrees "
            f"beyond the {np.degrees(max_tilt):g} allowed; please report this as a defect of geoprint.",
            pose=worst,
            excess_rad=float(excess[worst]),
        )
