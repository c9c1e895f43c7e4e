"""The knots of the path that is timed: the poses, one a place, with the length that is passed and its speed limits."""

from __future__ import annotations

from itertools import pairwise
from typing import final

import numpy as np

from geoprint.errors import LimitError
from geoprint.model import BoolArray, FloatArray, IntArray, JointPath, Process, frozen
from geoprint.motion.reach import bead_steps, tip_lengths, turns

METRES_PER_MILLIMETRE = 1e-3

# Turning counts as length along the path, so that a tool that turns on the spot moves on: a radian is as long as this
# [m]. A joint at its top speed passes the length about as fast as a tip that prints.
METRES_PER_RADIAN = 0.01

# Where the tip's travel is at least this share of the length on every step of a leg that lays material, it alone is the
# length. Then a tip at constant speed is a constant speed along the path, with no share to be off by.
SMALLEST_TIP_SHARE = 0.01

# Neighbouring poses closer than this [m] are one place, and their joints must agree to this [rad]; a larger difference
# would show in the accelerations.
COINCIDENT = 1e-9
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
        """Return the joints at a leg's knots as an arm drives them that deposits: what bends sooner than it responds.

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
        if not self.deposit[first:last].all():
            return joints
        ceilings = self.ceilings[first:last]
        half = 0.5 * response * np.minimum(np.append(ceilings, np.inf), np.insert(ceilings, 0, np.inf))
        half = np.minimum(half, np.minimum(lengths, lengths[-1] - lengths))
        both = np.hstack([joints, self.tips[rows]])
        total, wide = CubicSpline(lengths, both).antiderivative(), half > COINCIDENT
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
    the spot moves along too; on legs that only lay material it is the travel of the tip, unless the tool all but
    turns on the spot there. The speed on deposit is that of the bead: over a bulge the tip has to be faster.

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
    moved = steps > COINCIDENT
    places = np.concatenate([[0], np.cumsum(moved)])
    first = np.flatnonzero(np.concatenate([[True], moved]))
    _refuse_jump(joint_path, np.abs(joints - joints[first][places]), before)
    stops = np.zeros(first.size, dtype=np.bool_)
    own = np.flatnonzero(rows == before)
    np.logical_or.at(stops, places[own], poses.stops)
    stops[[0, -1]] = True
    deposit = poses.laid[step][moved]
    speeds = np.where(deposit, process.speed, process.travel_speed) * METRES_PER_MILLIMETRE
    beads = (bead_steps(poses)[step] * shares)[moved] * METRES_PER_MILLIMETRE
    passed, steps = passed[moved], steps[moved]
    steps = np.where(_tip_alone(passed / steps, deposit, stops), passed, steps)
    with np.errstate(divide="ignore"):
        ceilings = speeds / (beads / steps)
    missing = (behind - rows)[first]
    behind = behind[first]
    lengths = np.append(0.0, tip_lengths(poses))[behind]
    return Knots(
        joints=joints[first],
        stops=stops,
        runs=poses.runs[behind],
        tips=poses.tips[behind] - missing[:, None] * (poses.tips[behind] - poses.tips[before[first]]),
        arcs=poses.arcs[behind] - missing * lengths,
        lengths=np.concatenate([[0.0], np.cumsum(steps)]),
        ceilings=ceilings,
        bead_shares=beads / steps,
        deposit=deposit,
        places=places[own],
        rows=rows[first],
    )


def _tip_alone(shares: FloatArray, deposit: BoolArray, stops: BoolArray) -> BoolArray:
    """Return for each step whether its leg deposits all along and nowhere turns nearly on the spot."""
    if shares.size == 0:
        return deposit
    starts = np.flatnonzero(stops)[:-1]
    suited = np.minimum.reduceat(deposit & (shares >= SMALLEST_TIP_SHARE), starts)
    return np.repeat(suited, np.diff(np.append(starts, shares.size)))


def _refuse_jump(joint_path: JointPath, differences: FloatArray, rows: IntArray) -> None:
    at, joint = np.unravel_index(int(differences.argmax()), differences.shape)
    found, pose = float(differences[at, joint]), rows[at]
    if found > COINCIDENT_JOINTS:
        run = int(joint_path.poses.runs[pose])
        raise LimitError(
            f"run {run + 1}, pose {pose}: joint {joint + 1} jumps by {found:.3g} rad where the tool stands still, "
            f"allowed is {COINCIDENT_JOINTS:g} rad; keep the whole path on one branch.",
            run=run, joint=int(joint) + 1, found_rad=found, allowed_rad=COINCIDENT_JOINTS,
        )  # fmt: skip
