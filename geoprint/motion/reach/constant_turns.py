"""A constant turn about the nozzle for arms without a closed form, whose inverse is too slow for the ladder."""

from __future__ import annotations

from collections.abc import Iterator
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.model import BoolArray, FloatArray, PoseStream
from geoprint.motion.arm import BRANCHES, JOINTS, Arm, about_nozzle
from geoprint.motion.reach.attitude_search import Attitudes
from geoprint.motion.reach.lean_room import laying
from geoprint.motion.reach.margins import usable
from geoprint.motion.reach.pose_samples import tool_poses

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
        holds = usable(each, arm, deposit=laying(poses)[rows], minimum_wrist_angle=minimum_wrist_angle)
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
