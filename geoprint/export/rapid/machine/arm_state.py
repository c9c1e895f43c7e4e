"""Where the arm is at a moment: its joints and its tip, from the moves that were made."""

from __future__ import annotations

import math
from typing import cast

import numpy as np

from geoprint import transforms
from geoprint.export.rapid.machine.state import Moving, State
from geoprint.export.rapid.machine.values.poses import Pose, between, compose, inverted
from geoprint.model import FloatArray


def flange_matrix(tip: Pose, tool: Pose) -> FloatArray:
    """Return the (4, 4) pose of the flange where a tool's tip is [mm]."""
    place, turn = compose(tip, inverted(tool))
    return transforms.rigid(transforms.rotation_of(np.array([turn]))[0], np.array(place))


def poses_of_matrices(Ts: FloatArray) -> list[Pose]:
    """Return (k, 4, 4) transforms as poses."""
    rows = zip(Ts[:, :3, 3].tolist(), transforms.quaternion_of(Ts[:, :3, :3]).tolist(), strict=True)
    return [cast("Pose", (tuple(place), tuple(turn))) for place, turn in rows]


def tip_of(motion: Moving, state: State, tool: Pose) -> Pose:
    """Return the tip of a tool where the arm is at the end of its last move, in base coordinates."""
    if motion.tip is not None:
        return motion.tip if motion.tool == tool else compose(compose(motion.tip, inverted(motion.tool)), tool)
    joints = cast("tuple[float, ...]", motion.joints)
    return compose(poses_of_matrices(state.arm.flange_poses(np.array([joints])))[0], tool)


def joints_of(motion: Moving, state: State) -> tuple[float, ...]:
    """Return the joints at the end of the last move: the solution nearest to the last ones that were known [rad].

    Where the arm does not reach, the last known ones stand: whether it can follow the targets is judged elsewhere, from
    the arm's own side.
    """
    if motion.joints is not None:
        return motion.joints
    tip = cast("Pose", motion.tip)
    flange = flange_matrix(tip, motion.tool)
    found = state.arm.solutions((flange @ state.arm.T_flange_tool)[None])[0]
    found = found[~np.isnan(found).any(axis=1)]
    if not len(found):
        return motion.near
    near = np.array(motion.near)
    wound = found + 2.0 * math.pi * np.rint((near - found) / (2.0 * math.pi))
    best = wound[int(np.abs(wound - near).max(axis=1).argmin())]
    return tuple(best.tolist())


def stand_still(state: State) -> None:
    """Let the arm stand where it is at this moment: what it has not yet gone of its moves is forgotten."""
    state.motion = _at(state, min(state.until, state.motion.end))
    state.pending.clear()


def joints_now(state: State) -> tuple[float, ...]:
    """Return the joints at the present moment [rad]."""
    return joints_of(_at(state, state.clock), state)


def tip_now(state: State) -> Pose:
    """Return the tip of the tool that moved last at the present moment, in base coordinates."""
    motion = _at(state, state.clock)
    return tip_of(motion, state, motion.tool)


def _at(state: State, moment: float) -> Moving:
    """Return the motion as if it had ended at a moment; corners are taken as they are programmed."""
    motion = state.motion.copy()
    if moment >= motion.end:
        return motion
    motion.end = moment
    for leg in reversed(motion.legs):
        if leg.begin <= moment:
            share = min((moment - leg.begin) / max(leg.end - leg.begin, 1e-12), 1.0)
            if leg.joints is not None:
                start, end = leg.joints
                motion.joints = tuple(a + share * (b - a) for a, b in zip(start, end, strict=True))
                motion.tip = None
            elif leg.tips is not None:
                motion.tip, motion.joints = between(*leg.tips, share), None
            break
    return motion
