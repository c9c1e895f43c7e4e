"""Clear of the borders of quadrants on deposit: the turn of an axial nozzle, and constant turns of a bent one.

RAPID's configuration data count quarter turns of axes 1, 4 and 6. Where an axis sweeps over a border it crosses it; the
ladder lets it cross where least is deposited. But a path that one constant turn keeps clear is kept clear, whatever the
ladder finds cheaper, as long as the arm is comfortable with that turn.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from geoprint import transforms
from geoprint.model import BoolArray, FloatArray, Robot
from geoprint.robot.arm import (
    BORDER_MARGIN,
    BRANCHES,
    JOINTS,
    QUARTER_TURN,
    Arm,
    about_nozzle,
    border_distances,
    bordered_joints,
)
from geoprint.robot.reach.costs import COMFORTABLE_LIMIT, QUADRANT_NEAR, Terms
from geoprint.robot.reach.keyframes import Keyframes, angle_margins, thinned
from geoprint.robot.reach.ladder import climb, turning

# Constant turns that are looked at, and keyframes on which most are found not clear.
STILL_TURNS = 120
JUDGED_RUNGS = 30
# Of what the rates of the joints allow, so much is used; and what keeps a Jacobian invertible [mm, 1].
FRAME_SHARE = 0.8
NEARLY_SINGULAR = 1e-9
# Turns of an axial nozzle to either side of the one nearest to home: finer than any margin [rad].
AXIAL_STEP = float(np.radians(0.5))


def near_border(joints: FloatArray, arm: Arm) -> BoolArray:
    """Return whether axis 1, 4 or 6 of (..., 6) joint angles [rad] is within `BORDER_MARGIN` of a border, if any is."""
    if not bordered_joints(arm):
        return np.zeros(joints.shape[:-1], dtype=np.bool_)
    return np.any(border_distances(joints) < BORDER_MARGIN, axis=-1)


def still_turns(frames: Keyframes, arm: Arm, terms: Terms, *, branch: int) -> Iterator[float]:
    """Yield constant turns about the nozzle [rad] that keep deposit clear of borders at keyframes, the cheapest first.

    All of them keep the arm as far from its limits, from the stretched arm and on deposit from the smallest wrist angle
    as is comfortable.
    """
    few = thinned(frames, count=JUDGED_RUNGS)
    turns = 2.0 * np.pi * (np.arange(STILL_TURNS) / STILL_TURNS - 0.5)
    turns = turns[_are_clear(few, arm, turns=turns, branch=branch)]
    only, still = np.arange(BRANCHES) == branch, np.zeros((few.count, 2))
    costs = [
        climb(turning(few, np.full((few.count, 1), turn), still), terms, branches=only).costs[branch] for turn in turns
    ]
    for turn in turns[np.argsort(costs, kind="stable")]:
        if _are_clear(frames, arm, turns=turn[None], branch=branch)[0]:
            yield float(turn)


def frame_room(joints: FloatArray, arm: Arm, *, extent: FloatArray, T_base_work: FloatArray) -> float:
    """Return how far the frame of a part may lie off until an axis comes to a border of its quadrants [mm].

    So much the part's middle may shift in any direction, while it turns about any axis through it by that over the
    radius. The inverse of the Jacobian tells how far that turns axes 1, 4 and 6; it changes on the way, so that
    `FRAME_SHARE` of what it allows is returned. For an arm without such borders the limits of all joints count instead.

    Args:
        joints: (t, 6) at the targets [rad].
        arm: with its tool.
        extent: (2, 3) lowest and highest coordinates of the part in the work frame [mm].
        T_base_work: (4, 4) frame of the part.
    """
    bordered = list(bordered_joints(arm))
    middle = transforms.apply(T_base_work, extent.mean(axis=0)[None])[0]
    radius = float(np.linalg.norm(extent[1] - extent[0]) / 2.0)
    # Where the arm is singular no rate is finite, and next to no room is left.
    rates = np.linalg.inv(arm.jacobians(joints) + NEARLY_SINGULAR * np.eye(JOINTS))[:, bordered or slice(None)]
    shifts, turns = rates[..., :3], rates[..., 3:]
    low, high = arm.robot.limits.T
    levers = arm.tool_poses(joints)[:, None, :3, 3] - middle
    most = np.linalg.norm(shifts, axis=2) + np.linalg.norm(turns + np.cross(levers, shifts), axis=2) / radius
    room = border_distances(joints) if bordered else np.minimum(joints - low, high - joints)
    return FRAME_SHARE * float((room / most).min())


def axial_weights(joints: FloatArray, arm: Arm, *, deposit: BoolArray) -> FloatArray:
    """Return (s,) how much it counts that joint 6 of an axial nozzle is near a border at (s, 6) joint angles [rad].

    On deposit it counts once, and once more where axes 1 and 4 are clear; on travel it does not count, nor for an arm
    without such borders.
    """
    if not bordered_joints(arm):
        return np.zeros(len(joints))
    others = np.any(border_distances(joints)[:, :2] < BORDER_MARGIN, axis=1)
    return np.where(deposit, np.where(others, 1.0, 2.0), 0.0)


def axial_rotation(joint_6: FloatArray, robot: Robot, *, weights: FloatArray) -> float:
    """Return how far to turn joint 6 of a whole stream: inside its range, clear of borders, and nearest to home.

    Args:
        joint_6: (s,) continuous angles [rad].
        robot: limits and home.
        weights: (s,) of nearness to borders.

    Returns:
        The turn [rad], by which least is near a border, and of such the nearest to home; where the stream
        needs more than the whole range its middle is put on that of the range, and where no angle is known it is zero.
    """
    if not joint_6.size:
        return 0.0
    low, high = float(joint_6.min()), float(joint_6.max())
    least, most = robot.limits[5, 0] - low, robot.limits[5, 1] - high
    if least > most:
        return float(least + most) / 2.0
    nearest = np.clip(robot.home[5] - (low + high) / 2.0, least, most)
    slots = round(QUARTER_TURN / AXIAL_STEP)
    steps = np.arange(-slots, slots + 1)
    steps = steps[np.argsort(np.abs(steps), kind="stable")]
    turns = nearest + AXIAL_STEP * steps
    steps, turns = steps[(turns >= least) & (turns <= most)], turns[(turns >= least) & (turns <= most)]
    slot = np.floor((joint_6 + nearest) / AXIAL_STEP).astype(np.int64) % slots
    counts = np.bincount(slot, weights=weights, minlength=slots)
    # What is in slot i is turned by k steps into slot i + k, which is near a border among the first or the last ones.
    reach = int(np.ceil(QUADRANT_NEAR / AXIAL_STEP))
    near = counts[(np.arange(-reach, reach) - steps[:, None]) % slots].sum(axis=1)
    return float(turns[int(near.argmin())])


def _are_clear(frames: Keyframes, arm: Arm, *, turns: FloatArray, branch: int) -> BoolArray:
    """Return which of (t,) constant turns are comfortable at all keyframes, and clear of borders on deposit."""
    commanded = frames.Ts_base_tool @ about_nozzle(turns)[:, None]
    joints = arm.solutions(commanded.reshape(-1, 4, 4))[:, branch].reshape(turns.size, -1, JOINTS)
    clear: BoolArray = np.all(border_distances(joints[:, frames.deposit]) >= QUADRANT_NEAR, axis=(1, 2))
    margins = angle_margins(joints[clear], arm, deposit=frames.deposit)
    clear[clear] = np.all(margins >= COMFORTABLE_LIMIT, axis=(1, 2))
    return clear
