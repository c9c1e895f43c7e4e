"""Via points: where a spline of the joints would leave the straight moves between poses, it is held to them.

Between two poses the tip goes straight and the tool turns at a constant rate, for that is what the controller is
commanded. The timed path is a spline of the joints through the poses. Where the tool turns by several degrees from one
pose to the next, or long steps follow short ones, it swings out by up to millimetres; there it has to pass places of
the move itself as well.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from geoprint import transforms
from geoprint.errors import LimitError
from geoprint.model import FloatArray, JointPath, PoseStream, Process
from geoprint.motion.arm import Arm
from geoprint.motion.reach import tool_poses
from geoprint.motion.timing.knots import Knots, path_knots
from geoprint.surfaces import in_words

# Largest distance of the timed path from the straight move between two poses [mm], and from its attitude [rad].
STRAIGHT_TOLERANCE = 0.01
TURN_TOLERANCE = float(np.radians(0.1))
# Where the spline is looked at, as shares of the way from one knot to the next.
SHARES = (0.25, 0.5, 0.75)
# Each round halves the moves on which it is too far off: after so many they are a thousandth as long.
MOST_ROUNDS = 10
# Steps of the tip below this [mm] are turns on the spot.
COINCIDENT = 1e-6


class Strays(NamedTuple):
    """How far a spline through knots is off the straight moves, at the worst place on the way to each next knot.

    Attributes:
        tips: (n - 1,) [mm].
        turns: (n - 1,) [rad].
    """

    tips: FloatArray
    turns: FloatArray


def held_straight(joint_path: JointPath, arm: Arm, *, process: Process) -> JointPath:
    """Return a joint path with via points wherever the spline through it would be off the moves without them.

    Args:
        joint_path: p poses with their joints, without via points.
        arm: that follows it, with its tool.
        process: speeds.

    Returns:
        The same poses; along all moves the timed path is within 0.01 mm and 0.1 degrees of them.

    Raises:
        LimitError: no via points help.
    """
    for _ in range(MOST_ROUNDS):
        knots = path_knots(joint_path, process=process)
        found = strays(knots, joint_path, arm)
        far = np.flatnonzero((found.tips > STRAIGHT_TOLERANCE) | (found.turns > TURN_TOLERANCE))
        if not far.size:
            return joint_path
        joint_path = _with_vias(joint_path, (knots.starts[far] + knots.rows[far + 1]) / 2.0, arm)
    worst = far[found.tips[far].argmax()]
    pose = int(knots.starts[worst])
    raise LimitError(
        f"run {knots.runs[worst + 1] + 1}: between two poses at {in_words(joint_path.poses.tips[pose])} the joints "
        f"leave the straight move by {found.tips[worst]:.3g} mm and {np.degrees(found.turns[worst]):.3g} degrees, "
        f"allowed are {STRAIGHT_TOLERANCE:g} mm and 0.1 degrees; where the surface has a fold or a step there, smooth "
        "it (`geoprint remesh --smooth`).",
        run=int(knots.runs[worst + 1]), found_mm=float(found.tips[worst]), allowed_mm=STRAIGHT_TOLERANCE,
    )  # fmt: skip


def strays(knots: Knots, joint_path: JointPath, arm: Arm) -> Strays:
    """Return how far the spline that is timed is off the straight moves between poses.

    Args:
        knots: n knots of the joint path.
        joint_path: p poses with their joints.
        arm: that follows it, with its tool.
    """
    count = knots.lengths.size - 1
    joints = np.empty((count, len(SHARES), knots.joints.shape[1]))
    for first, last in knots.legs:
        lengths = knots.lengths_of(first, last)
        at = lengths[:-1, None] + np.array(SHARES) * np.diff(lengths)[:, None]
        joints[first:last] = CubicSpline(lengths, knots.joints[first : last + 1])(at)
    T_work_base = transforms.inverse(joint_path.T_base_work)
    found = T_work_base @ arm.tool_poses(joints.reshape(-1, knots.joints.shape[1]))
    rows = (knots.starts[:, None] + np.array(SHARES) * (knots.rows[1:] - knots.starts)[:, None]).ravel()
    moves = _on_moves(joint_path.poses, rows, found[:, :3, 3])
    tips = np.linalg.norm(found[:, :3, 3] - moves[:, :3, 3], axis=1)
    turned = transforms.rotation_angle(np.swapaxes(moves[:, :3, :3], 1, 2) @ found[:, :3, :3])
    return Strays(*(each.reshape(count, len(SHARES)).max(axis=1) for each in (tips, turned)))


def _on_moves(poses: PoseStream, rows: FloatArray, tips: FloatArray) -> FloatArray:
    """Return (k, 4, 4) the place nearest to a tip on the move that each row is on; on the spot that of the row."""
    steps = rows.astype(np.int64)
    start, along = poses.tips[steps], poses.tips[steps + 1] - poses.tips[steps]
    squares = np.einsum("ij,ij->i", along, along)
    nearest = np.einsum("ij,ij->i", tips - start, along) / np.where(squares > 0.0, squares, 1.0)
    shares = np.clip(np.where(squares > COINCIDENT**2, nearest, rows - steps), 0.0, 1.0)
    ends = tool_poses(poses, T_base_work=np.eye(4))
    return transforms.interpolate_poses(ends[steps], ends[steps + 1], shares)


def _with_vias(joint_path: JointPath, rows: FloatArray, arm: Arm) -> JointPath:
    """Return a joint path that passes other places of its moves as well."""
    steps = rows.astype(np.int64)
    ends = tool_poses(joint_path.poses, T_base_work=joint_path.T_base_work)
    places = transforms.interpolate_poses(ends[steps], ends[steps + 1], rows - steps)
    between = (1.0 - (rows - steps))[:, None] * joint_path.joints[steps]
    between += (rows - steps)[:, None] * joint_path.joints[steps + 1]
    joints = between + transforms.wrapped(arm.solutions(places)[:, joint_path.branch] - between)
    order = np.argsort(all_rows := np.append(joint_path.via_rows, rows))
    return replace(
        joint_path, via_rows=all_rows[order], via_joints=np.concatenate([joint_path.via_joints, joints])[order]
    )
