"""One motion: what is timed stays on the straight moves that the controller is commanded, all along.

Between two poses the tip goes straight and the tool turns at a constant rate, for that is what the controller is
commanded. The timed path is a spline of the joints through the poses. Where the tool turns by several degrees from one
pose to the next, or long steps follow short ones, it swings out by up to millimetres; there it has to pass places of
the move itself as well.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from geoprint import transforms
from geoprint.errors import LimitError
from geoprint.model import FloatArray, JointPath, PoseStream, Process, Targets, Trajectory
from geoprint.motion.arm import Arm
from geoprint.motion.controller import apexes, rounded_deviations
from geoprint.motion.reach import tool_poses
from geoprint.motion.timing.knots import Knots, path_knots
from geoprint.surfaces import in_words

# Where the spline is farther than this [mm] from the straight move between two poses, or turned farther from it [rad],
# it has to pass another place of the move. Targets leave poses out that are 0.01 mm and 0.1 degrees off their moves.
STRAIGHT_TOLERANCE = 0.006
TURN_TOLERANCE = float(np.radians(0.06))
# Largest distance [mm] of the timed path from the moves that are written, their zones included, and largest turn [rad].
LARGEST_OFF = 0.02
LARGEST_TURN = float(np.radians(0.2))
# Rows of a trajectory from one that is compared with the moves to the next.
EVERY = 4
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


class OffMoves(NamedTuple):
    """How far a timed motion is at most from the moves that are written: mm, and rad."""

    distance: float
    turn: float


def held_straight(joint_path: JointPath, arm: Arm, *, process: Process) -> JointPath:
    """Return a joint path with via points wherever the spline through it would be off the moves without them.

    Args:
        joint_path: p poses with their joints, without via points.
        arm: that follows it, with its tool.
        process: speeds.

    Returns:
        The same poses; along all moves between them the timed path is within 0.006 mm and 0.06 degrees.

    Raises:
        LimitError: no via points help.
    """
    rounds = 0
    while True:
        knots = path_knots(joint_path, process=process)
        found = strays(knots, joint_path, arm)
        far = np.flatnonzero((found.tips > STRAIGHT_TOLERANCE) | (found.turns > TURN_TOLERANCE))
        if not far.size:
            return joint_path
        if rounds == MOST_ROUNDS:
            break
        rounds += 1
        joint_path = _with_vias(joint_path, (knots.starts[far] + knots.rows[far + 1]) / 2.0, arm)
    worst = int(far[found.tips[far].argmax()])
    pose = int(knots.starts[worst])
    raise LimitError(
        f"run {knots.runs[worst + 1] + 1}: between two poses at {in_words(joint_path.poses.tips[pose])} the joints "
        f"leave the straight move by {found.tips[worst]:.3g} mm and {np.degrees(found.turns[worst]):.3g} degrees, "
        f"allowed are {STRAIGHT_TOLERANCE:g} mm and 0.06 degrees; where the surface has a fold or a step there, smooth "
        "it (`geoprint remesh --smooth`).",
        run=int(knots.runs[worst + 1]), found_mm=float(found.tips[worst]), allowed_mm=STRAIGHT_TOLERANCE,
    )  # fmt: skip


def off_moves(trajectory: Trajectory, written: JointPath, targets: Targets, arm: Arm) -> OffMoves:
    """Return how far a timed motion is from the moves that are written, with their rounded corners, all along them.

    The attitude is compared where no corner is rounded.

    Args:
        trajectory: from home to home.
        written: p poses with their joints, at the targets as the program names them.
        targets: t of them.
        arm: that follows it, with its tool.

    Raises:
        LimitError: it is more than 0.02 mm or 0.2 degrees.
    """
    times, stands = (
        trajectory.pose_times[targets.poses],
        tool_poses(written.poses, T_base_work=np.eye(4))[targets.poses],
    )
    rows = np.flatnonzero((trajectory.times > times[0]) & (trajectory.times < times[-1]))[::EVERY]
    passed = transforms.inverse(written.T_base_work) @ arm.tool_poses(trajectory.joints[rows])
    move = np.clip(np.searchsorted(times, trajectory.times[rows], side="right") - 1, 0, times.size - 2)
    places = stands[:, :3, 3]
    order = np.argsort(np.concatenate([times, trajectory.times[rows]]), kind="stable")
    tips = np.concatenate([apexes(places, targets.zones), passed[:, :3, 3]])[order]
    tip_off = rounded_deviations(tips, np.flatnonzero(order < times.size), places, targets.zones)
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    along = np.einsum("ij,ij->i", passed[:, :3, 3] - places[move], np.diff(places, axis=0)[move]) / np.maximum(
        lengths[move], COINCIDENT
    )
    straight = (along > targets.zones[move]) & (along < lengths[move] - targets.zones[move + 1])
    move, share = move[straight], along[straight] / lengths[move[straight]]
    meant = transforms.interpolate_poses(stands[move], stands[move + 1], share)[:, :3, :3]
    turned = transforms.rotation_angle(np.swapaxes(meant, 1, 2) @ passed[straight][:, :3, :3])
    found = OffMoves(float(tip_off.max(initial=0.0)), float(turned.max(initial=0.0)))
    if found.distance > LARGEST_OFF or found.turn > LARGEST_TURN:
        at = int(tip_off.argmax()) if found.distance > LARGEST_OFF else int(move[turned.argmax()])
        raise LimitError(
            f"run {int(written.poses.runs[targets.poses[at + 1]]) + 1}: at {in_words(places[at])} the timed path is "
            f"{found.distance:.3g} mm and {np.degrees(found.turn):.3g} degrees from the move that is written, allowed "
            f"are {LARGEST_OFF:g} mm and 0.2 degrees; where the surface has a fold or a step there, smooth it "
            "(`geoprint remesh --smooth`).",
            run=int(written.poses.runs[targets.poses[at + 1]]), found_mm=found.distance, allowed_mm=LARGEST_OFF,
        )  # fmt: skip
    return found


def strays(knots: Knots, joint_path: JointPath, arm: Arm) -> Strays:
    """Return how far the spline that is timed is off the straight moves between poses.

    Args:
        knots: n knots of the joint path.
        joint_path: p poses with their joints.
        arm: that follows it, with its tool.
    """
    from scipy.interpolate import CubicSpline

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
