"""The knots of the path that is timed, and straight moves between waypoints that it stays on."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple, final

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import LimitError
from geoprint.geometry import in_words
from geoprint.model import BoolArray, FloatArray, IntArray, JointPath, PoseStream, Process, Targets, Trajectory, frozen
from geoprint.robot.arm import Arm
from geoprint.robot.controller import apexes, rounded_deviations
from geoprint.robot.reach import bead_steps, tip_lengths, tool_poses, turns

# The knots of the path that is timed: the poses, one a place, with the length that is passed and its speed limits.


METRES_PER_MILLIMETRE = 1e-3

# Turning counts as length along the path, so that a tool that turns on the spot moves on: a radian is as long as this
# [m]. A joint at its top speed passes the length about as fast as a tip that prints.
METRES_PER_RADIAN = 0.01

# Where the tip's travel is at least this share of the length on every step of a leg that prints, it alone is the
# length. Then a tip at constant speed is a constant speed along the path, with no share to be off by.
SMALLEST_TIP_SHARE = 0.01

# Neighbouring poses closer than this [m] are one place, and their joints must agree to this [rad]; a larger difference
# would show in the accelerations.
COINCIDENT_KNOTS = 1e-9
COINCIDENT_JOINTS = 1e-8

# What an arm rounds within its response [mm], and what each of its joints turns less there [rad]: far below what it
# repeats. Where a joint turns by an angle within the response, the mean of its motion lies its distance from the tip
# [mm] times the square of that, over 24, beside the path: so far away it is about, in the arm and in the wrist.
MOST_ROUNDED = 0.004
MOST_TURNED = 3e-4
LEVERS = np.array([500.0, 500.0, 500.0, 150.0, 150.0, 150.0])
LEVERS.setflags(write=False)


@final
@frozen
class Knots:
    """The poses without those that coincide with the one before, and the steps between them.

    Attributes:
        joints: (n, 6) [rad].
        stops: (n,) where the tool comes to rest; the first and the last one among them.
        runs: (n,) run.
        tips: (n, 3) [mm].
        arcs: (n,) arc length from the start of the run or travel [mm].
        lengths: (n,) path parameter from the first knot [m].
        ceilings: (n - 1,) largest growth of the path parameter on each step [m/s].
        bead_shares: (n - 1,) length of bead by path parameter; on travel that of the tip.
        deposit: (n - 1,) whether the step deposits.
        places: (p,) knot of each pose.
        rows: (n,) pose of each; of a via point the pose before, and the share of the move behind it.
    """

    joints: FloatArray
    stops: BoolArray
    runs: IntArray
    tips: FloatArray
    arcs: FloatArray
    lengths: FloatArray
    ceilings: FloatArray
    bead_shares: FloatArray
    deposit: BoolArray
    places: IntArray
    rows: FloatArray

    @property
    def starts(self) -> FloatArray:
        """(n - 1,) row from which the move to each next knot goes on: of poses in one place the last."""
        return np.maximum(self.rows[:-1], np.ceil(self.rows[1:]) - 1.0)

    @property
    def legs(self) -> list[tuple[int, int]]:
        """First and last knot of each leg, the path from rest to rest."""
        return list(pairwise(np.flatnonzero(self.stops).tolist()))

    def lengths_of(self, first: int, last: int) -> FloatArray:
        """Return the path parameter of a leg's knots, from 0 [m]."""
        return self.lengths[first : last + 1] - self.lengths[first]

    def driven_joints(self, first: int, last: int, *, response: float) -> FloatArray:
        """Return the joints at a leg's knots as an arm drives them that prints: what bends sooner than it responds.

        Each is the mean over the length that is passed within the response, which rounds what no drive follows: an edge
        of the mesh, the corner of a polygon. Towards the stops, and where it would round more than it may, it is less.

        Args:
            first: knot of the leg.
            last: knot of the leg.
            response: time in which the arm answers [s].
        """
        from scipy.interpolate import CubicSpline

        rows = slice(first, last + 1)
        joints, lengths = self.joints[rows], self.lengths_of(first, last)
        if not self.deposit[first:last].any():
            return joints
        ceilings = self.ceilings[first:last]
        half = 0.5 * response * np.minimum(np.append(ceilings, np.inf), np.insert(ceilings, 0, np.inf))
        half = np.minimum(half, np.minimum(lengths, lengths[-1] - lengths))
        both = np.hstack([joints, self.tips[rows]])
        total, wide = CubicSpline(lengths, both).antiderivative(), half > COINCIDENT_KNOTS
        moved = np.zeros_like(both)
        before, behind = (lengths - half)[wide], (lengths + half)[wide]
        moved[wide] = (total(behind) - total(before)) / (behind - before)[:, None] - both[wide]
        turned, shifted = np.abs(moved[:, :-3]).max(axis=1), np.linalg.norm(moved[:, -3:], axis=1)
        passed = total.derivative()
        within = (passed(lengths + half) - passed(lengths - half))[:, :-3]
        shifted += (LEVERS * within**2).max(axis=1) / 24.0
        # Smoothly bounded: a sudden bound would bend the joints where it begins.
        far = np.maximum(turned / MOST_TURNED, shifted / MOST_ROUNDED)
        return joints + moved[:, :-3] / (1.0 + far[:, None] ** 4) ** 0.25


def path_knots(joint_path: JointPath, *, process: Process) -> Knots:
    """Return the knots of a joint path.

    The path parameter is hypot(travel of the tip, turn of the tool * 10 mm per radian), so that a tool that turns on
    the spot moves along too; on legs that print it is the travel of the tip, unless the tool all but turns on the spot
    there. The speed on deposit, and on the leads, is that of the bead: over a bulge the tip has to be faster.

    Args:
        joint_path: p poses, p > 0.
        process: speeds.

    Raises:
        LimitError: the joints jump where the tool stands still.
    """
    poses = joint_path.poses
    rows = np.append(np.arange(poses.count, dtype=np.float64), joint_path.via_rows)
    order = np.argsort(rows, kind="stable")
    rows, joints = rows[order], np.concatenate([joint_path.joints, joint_path.via_joints])[order]
    before, behind = np.floor(rows).astype(np.int64), np.ceil(rows).astype(np.int64)
    shares, step = np.diff(rows), before[:-1]
    passed = tip_lengths(poses)[step] * shares * METRES_PER_MILLIMETRE
    steps = np.hypot(passed, turns(poses)[step] * shares * METRES_PER_RADIAN)
    moved = steps > COINCIDENT_KNOTS
    places = np.concatenate([[0], np.cumsum(moved)])
    first = np.flatnonzero(np.concatenate([[True], moved]))
    _refuse_jump(joint_path, np.abs(joints - joints[first][places]), before)
    places_of_poses = places[rows == before]
    stops = np.isin(np.arange(first.size), np.concatenate([[0, first.size - 1], places_of_poses[poses.stops]]))
    deposit = poses.deposited[step][moved]
    printing = poses.printing[step][moved]
    speeds = np.where(printing, process.speed, process.travel_speed) * METRES_PER_MILLIMETRE
    beads = (bead_steps(poses)[step] * shares)[moved] * METRES_PER_MILLIMETRE
    passed, steps = passed[moved], steps[moved]
    steps = np.where(_tip_alone(passed / steps, printing, stops), passed, steps)
    with np.errstate(divide="ignore"):
        ceilings = speeds / (beads / steps)
    missing = (behind - rows)[first]
    behind = behind[first]
    return Knots(
        joints=joints[first],
        stops=stops,
        runs=poses.runs[behind],
        tips=poses.tips[behind] - missing[:, None] * (poses.tips[behind] - poses.tips[before[first]]),
        arcs=poses.arcs[behind] - missing * np.append(0.0, tip_lengths(poses))[behind],
        lengths=np.concatenate([[0.0], np.cumsum(steps)]),
        ceilings=ceilings,
        bead_shares=beads / steps,
        deposit=deposit,
        places=places_of_poses,
        rows=rows[first],
    )


def _tip_alone(shares: FloatArray, printing: BoolArray, stops: BoolArray) -> BoolArray:
    """Return for each step whether its leg prints and nowhere turns nearly on the spot."""
    if shares.size == 0:
        return printing
    starts = np.flatnonzero(stops)[:-1]
    suited = np.minimum.reduceat(printing & (shares >= SMALLEST_TIP_SHARE), starts)
    return np.repeat(suited, np.diff(np.append(starts, shares.size)))


def _refuse_jump(joint_path: JointPath, differences: FloatArray, rows: IntArray) -> None:
    at, joint = np.unravel_index(int(differences.argmax()), differences.shape)
    found, pose = float(differences[at, joint]), rows[at]
    if found > COINCIDENT_JOINTS:
        run = int(joint_path.poses.runs[pose])
        raise LimitError(
            f"run {run + 1}, pose {pose}: joint {joint + 1} jumps by {found:.3g} rad while the tool stands still, "
            f"allowed is {COINCIDENT_JOINTS:g} rad. Keep the whole path on one branch.",
            run=run, joint=int(joint) + 1, found_rad=found, allowed_rad=COINCIDENT_JOINTS,
        )  # fmt: skip


# One motion: what is timed stays on the straight moves that the controller is commanded, all along.
#
# Between two poses the tip goes straight and the tool turns at a constant rate, for that is what the controller is
# commanded. The timed path is a spline of the joints through the poses. Where the tool turns by several degrees from
# one pose to the next, or long steps follow short ones, it swings out by up to millimetres; there it has to pass
# places of the move itself as well.


# Where the spline is farther than this [mm] from the straight move between two poses, or turned farther from it [rad],
# it has to pass another place of the move. Targets leave poses out that are 0.01 mm and 0.1 degrees off their moves.
STRAIGHT_TOLERANCE = 0.006
TURN_TOLERANCE = float(np.radians(0.06))
# Largest distance [mm] of the timed path from the moves that are written, their zones included, and largest turn [rad].
LARGEST_OFF = 0.02
LARGEST_TURN = float(np.radians(0.2))
# Rows of a trajectory from one that is compared with the moves to the next.
EVERY = 4
# For the place of a move that is nearest by tip and attitude, so many are tried to either side of that which is nearest
# by the tip, up to so far from it [mm].
SHIFTS, FARTHEST = 20, 0.02
# Where the spline is looked at, as shares of the way from one knot to the next.
SHARES = (0.25, 0.5, 0.75)
# Each round halves the moves on which it is too far off: after so many they are a thousandth as long.
MOST_ROUNDS = 10
# Steps of the tip below this [mm] are turns on the spot.
COINCIDENT = 1e-6


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
        tips, turned = strays(knots, joint_path, arm)
        far = np.flatnonzero((tips > STRAIGHT_TOLERANCE) | (turned > TURN_TOLERANCE))
        if not far.size:
            return joint_path
        if rounds == MOST_ROUNDS:
            break
        rounds += 1
        joint_path = _with_vias(joint_path, (knots.starts[far] + knots.rows[far + 1]) / 2.0, arm)
    worst = int(far[tips[far].argmax()])
    pose = int(knots.starts[worst])
    raise LimitError(
        f"run {knots.runs[worst + 1] + 1}: at {in_words(joint_path.poses.tips[pose])} the joints leave the straight "
        f"move by {tips[worst]:.3g} mm and {np.degrees(turned[worst]):.3g} degrees, allowed are "
        f"{STRAIGHT_TOLERANCE:g} mm and 0.06 degrees. If the surface has a fold or step there, smooth it (`geoprint "
        "remesh --smooth`).",
        run=int(knots.runs[worst + 1]), found_mm=float(tips[worst]), allowed_mm=STRAIGHT_TOLERANCE,
    )  # fmt: skip


def off_moves(trajectory: Trajectory, written: JointPath, targets: Targets, arm: Arm) -> OffMoves:
    """Return how far a timed motion is from the moves that are written, with their rounded corners, all along them.

    The attitude is compared where no corner is rounded, with that of the place of the move that is nearest by both:
    where the tool turns nearly on the spot, a micrometre along the move is degrees.

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
    move, along = move[straight], along[straight]
    tips, turned = _off_straight(passed[straight], stands[move], stands[move + 1], along / lengths[move])
    found = OffMoves(float(max(tip_off.max(initial=0.0), tips.max(initial=0.0))), float(turned.max(initial=0.0)))
    if found.distance > LARGEST_OFF or found.turn > LARGEST_TURN:
        at = int(tip_off.argmax()) if found.distance > LARGEST_OFF else int(move[turned.argmax()])
        raise LimitError(
            f"run {int(written.poses.runs[targets.poses[at + 1]]) + 1}: at {in_words(places[at])} the timed path is "
            f"{found.distance:.3g} mm and {np.degrees(found.turn):.3g} degrees from the written move, allowed are "
            f"{LARGEST_OFF:g} mm and 0.2 degrees. If the surface has a fold or step there, smooth it (`geoprint "
            "remesh --smooth`).",
            run=int(written.poses.runs[targets.poses[at + 1]]), found_mm=found.distance, allowed_mm=LARGEST_OFF,
        )  # fmt: skip
    return found


def _off_straight(
    passed: FloatArray, starts: FloatArray, ends: FloatArray, shares: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return how far poses are from the place on their moves that is nearest by both [mm], and how far turned [rad].

    Of distance and turn, each by its tolerance, the larger is least there.

    Args:
        passed: (k, 4, 4) poses [mm].
        starts: (k, 4, 4) of the move of each.
        ends: (k, 4, 4) likewise.
        shares: (k,) of the move where its tip is nearest.
    """
    meant = transforms.interpolate_poses(starts, ends, shares)
    aside = np.linalg.norm(passed[:, :3, 3] - meant[:, :3, 3], axis=1)
    lengths = np.linalg.norm(ends[:, :3, 3] - starts[:, :3, 3], axis=1)
    turns_off = _rotation_vectors(meant, passed)
    rates = _rotation_vectors(starts, ends) / np.maximum(lengths, COINCIDENT)[:, None]
    along, shifts = (shares * lengths)[:, None], FARTHEST * np.linspace(-1.0, 1.0, 2 * SHIFTS + 1)
    shifts = np.clip(along + shifts, 0.0, lengths[:, None]) - along
    tips = np.hypot(aside[:, None], shifts)
    turned = np.linalg.norm(turns_off[:, None] - shifts[:, :, None] * rates[:, None], axis=2)
    best = np.maximum(tips / STRAIGHT_TOLERANCE, turned / TURN_TOLERANCE).argmin(axis=1)[:, None]
    return np.take_along_axis(tips, best, axis=1)[:, 0], np.take_along_axis(turned, best, axis=1)[:, 0]


def _rotation_vectors(Ts_from: FloatArray, Ts_to: FloatArray) -> FloatArray:
    """Return the (k, 3) rotation from each of (k, 4, 4) poses to another, in its own frame [rad]."""
    return Rotation.from_matrix(np.swapaxes(Ts_from[:, :3, :3], 1, 2) @ Ts_to[:, :3, :3]).as_rotvec()


def with_bulges(joint_path: JointPath, arm: Arm, *, process: Process) -> JointPath:
    """Return a joint path that says how far the timed path is off behind each pose, at a speed.

    With and without what the arm rounds within its response, which grows with the square of the speed.
    """
    knots, bulges = path_knots(joint_path, process=process), np.zeros((joint_path.poses.count, 2))
    for shares, response in ((SHARES, 0.0), ((0.0, *SHARES), arm.robot.response)):
        found = strays(knots, joint_path, arm, shares=shares, response=response)
        np.maximum.at(bulges, knots.starts.astype(np.int64), np.column_stack(found))
    return replace(joint_path, bulges=bulges)


def strays(
    knots: Knots, joint_path: JointPath, arm: Arm, *, shares: tuple[float, ...] = SHARES, response: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return how far the spline that is timed is at most off the straight moves on the way to each next knot.

    Args:
        knots: n knots of the joint path.
        joint_path: p poses with their joints.
        arm: that follows it, with its tool.
        shares: of the way from one knot to the next, where it is looked at.
        response: time over which the arm rounds on deposit, at the highest speed [s].

    Returns:
        (n - 1,) distances of the tip [mm], and (n - 1,) turns [rad].
    """
    from scipy.interpolate import CubicSpline

    count = knots.lengths.size - 1
    joints = np.empty((count, len(shares), knots.joints.shape[1]))
    for first, last in knots.legs:
        lengths = knots.lengths_of(first, last)
        at = lengths[:-1, None] + np.array(shares) * np.diff(lengths)[:, None]
        joints[first:last] = CubicSpline(lengths, knots.driven_joints(first, last, response=response))(at)
    T_work_base = transforms.inverse(joint_path.T_base_work)
    found = T_work_base @ arm.tool_poses(joints.reshape(-1, knots.joints.shape[1]))
    rows = (knots.starts[:, None] + np.array(shares) * (knots.rows[1:] - knots.starts)[:, None]).ravel()
    tips, turned = _off_straight(found, *_on_moves(joint_path.poses, rows, found[:, :3, 3]))
    tips, turned = (each.reshape(count, len(shares)).max(axis=1) for each in (tips, turned))
    return tips, turned


def _on_moves(poses: PoseStream, rows: FloatArray, tips: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (k, 4, 4) starts and ends of the moves that rows are on, and the share of each that is nearest to a tip.

    On the spot that is the share of the row.
    """
    steps = rows.astype(np.int64)
    start, along = poses.tips[steps], poses.tips[steps + 1] - poses.tips[steps]
    squares = np.einsum("ij,ij->i", along, along)
    nearest = np.einsum("ij,ij->i", tips - start, along) / np.where(squares > 0.0, squares, 1.0)
    shares = np.clip(np.where(squares > COINCIDENT**2, nearest, rows - steps), 0.0, 1.0)
    ends = tool_poses(poses, T_base_work=np.eye(4))
    return ends[steps], ends[steps + 1], shares


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
