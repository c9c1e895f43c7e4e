"""Checks of a bundle's targets: against its trajectory, against one another, and against the inverse kinematics.

The targets are those of targets.csv; the program is compared with them elsewhere. What both say is judged here by what
neither of them was made of.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from geoprint import transforms
from geoprint.errors import VerificationError
from geoprint.model import BoolArray, FloatArray, PoseStream, Process, Robot
from geoprint.postprocessor import Orders, PosesTable, TipsAt, TrajectoryTable
from geoprint.postprocessor.expected import LIFT, TURN_ON_THE_SPOT, corner_middles, joint_tolerances, largest_zones
from geoprint.robot.arm import Arm
from geoprint.robot.timing.moments import joints_at

# The trajectory passes the targets to this [mm]: it is written in rows of a millisecond.
TRAJECTORY_TOLERANCE = 0.01
# Speeds are written to four digits, half of the last one of 1000 mm/s is [mm/s].
SPEED_TOLERANCE = 0.06
# A straight line between targets is longer than the planned path by at most what their places were rounded by, and the
# trajectory, seen each millisecond, shorter than it by what that cuts off at a corner [mm].
LINE_TOLERANCE = 0.005
CORNER_TOLERANCE = 0.02
# The trajectory is looked at in stretches of so many moments, which bounds the memory.
_STRETCH = 50_000
# A zone of a target on the path cuts its corner by no more than this [mm].
CUT_CORNER = 0.004
# Zones and places are written to six decimals [mm].
ZONE_TOLERANCE = 1e-5
# A tip that moves less than this [mm] from a millisecond before a target to one after it may rest there.
RESTING = 0.02
# Every place that is printed lies in the part's box to this [mm]: corners of paths are rounded by less.
EXTENT_TOLERANCE = 0.5
# The lowest speed that is asked for [mm/s].
SMALLEST_SPEED = 0.1
# Over so much of a bead, and of the tip [mm], its speed is looked at, for from pose to pose it varies with the normals
# of triangles, and so many times the print's it may be.
BEAD_LENGTH, BEAD_TOLERANCE = 1.0, 1.03
_MILLISECOND = 1e-3
# A target stands where its pose is, or its corner passes there, and every deposited pose is passed, to this [mm].
POSE_TOLERANCE, PASSED_TOLERANCE = 0.01, 0.05
# A dry run lifts a target without turning it by more than this, and no joint by so much [rad].
LIFTED_TURN, OTHER_POSTURE = 1e-4, 0.75 * np.pi
# Every pose lies on the written moves, their corners rounded, to this [mm], and to so much of its attitude [degrees].
MOVE_TOLERANCE, MOVE_TURN_DEG = 0.02, 0.2
# Straight pieces that stand for a rounded corner: at 0.3 mm and 30 degrees they are 1 um off the parabola.
_CORNER_SHARES = np.linspace(0.0, 1.0, 9)[:, None]
# Targets have the flow of the poses between them to this share, and volumes of so much [mm3] are as good as nothing.
FLOW_SHARE, SMALLEST_VOLUME = 5e-3, 1e-5
# By rounding of a trajectory's rows its limits may be exceeded by these shares, and angles by so much [rad].
SPEED_SHARE, ACCELERATION_SHARE, ANGLE_TOLERANCE = 1e-3, 0.05, 1e-6


def check_passing(orders: Orders, passed: FloatArray) -> None:
    """Check that the trajectory passes the targets when they say; `passed` (t, 3) is where the tip is then.

    It passes the target itself, or the middle of the corner in which the controller rounds it.

    Raises:
        VerificationError: it does neither.
    """
    misses = np.minimum(*(np.linalg.norm(passed - each, axis=1) for each in (orders.tips, corner_middles(orders))))
    if misses.max() > TRAJECTORY_TOLERANCE:
        target = int(misses.argmax())
        raise VerificationError(
            f"the trajectory passes target {target + 1} {misses.max():.3f} mm off at {orders.times[target]:.3f} s, "
            f"allowed are {TRAJECTORY_TOLERANCE} mm",
            line=int(orders.times[target] * 1000) + 2,
        )


def check_poses(orders: Orders, poses: PoseStream) -> None:
    """Check that the targets are poses of poses.csv: where these are, in their runs, and depositing as these do.

    Raises:
        VerificationError: one is not.
    """
    wanted, chosen = np.append(poses.deposited, np.False_), orders.poses
    if chosen[0] != 0 or chosen[-1] != poses.count - 1:
        raise VerificationError(
            f"the targets go from pose {chosen[0]} to pose {chosen[-1]}, poses.csv from 0 to {poses.count - 1}", line=2
        )
    deposited_there, spans = np.append(0, np.cumsum(wanted)), np.append(np.diff(chosen), 1)
    deposited = deposited_there[np.append(chosen[1:], chosen[-1] + 1)] - deposited_there[chosen]
    tips = poses.tips[chosen]
    misses = np.minimum(*(np.linalg.norm(each - tips, axis=1) for each in (orders.tips, corner_middles(orders))))
    # The flow is that by the length from target to target as these stand, some of them outside of bends.
    places = poses.tips.copy()
    places[chosen] = orders.tips
    steps, beads = np.linalg.norm(np.diff(places, axis=0), axis=1), replace(poses, tips=places).bead_lengths
    lengths, volumes = (
        np.diff(np.append(0.0, np.cumsum(each))[chosen], append=np.nan)
        for each in (steps, beads * (poses.flow[1:] + poses.flow[:-1]) / 2.0)
    )
    flow_off = np.abs(orders.flow * lengths - volumes) > FLOW_SHARE * volumes + SMALLEST_VOLUME
    for wrong, what in (
        (deposited != np.where(orders.deposited, spans, 0), "material is deposited elsewhere than in poses.csv"),
        (orders.runs != poses.runs[chosen], "another run than in poses.csv"),
        (orders.deposited & flow_off, "another flow than in poses.csv"),
        (misses > POSE_TOLERANCE, "it neither stands where its pose is nor has a corner that passes there"),
    ):
        if wrong.any():
            row = int(np.argmax(wrong))
            raise VerificationError(f"target {row + 1}, pose {chosen[row]}: {what}", line=row + 2)


def check_moves(orders: Orders, poses: PoseStream) -> None:
    """Check that the moves from target to target, with their rounded corners, pass every pose of poses.csv.

    Attitudes are compared where no corner is rounded.

    Raises:
        VerificationError: they miss one.
    """
    tips, steps = orders.tips, np.diff(orders.tips, axis=0)
    lengths = np.maximum(np.linalg.norm(steps, axis=1), TURN_ON_THE_SPOT)
    reach = (orders.zones[1:-1, None] * (steps / lengths[:, None])[each] for each in (slice(None, -1), slice(1, None)))
    entries, exits = (tips[1:-1] + sign * zone for sign, zone in zip((-1.0, 1.0), reach, strict=True))
    ahead = _CORNER_SHARES[:, :, None]
    corners = np.repeat(tips[None], len(ahead), axis=0)
    corners[:, 1:-1] = (1.0 - ahead) ** 2 * entries + 2.0 * ahead * (1.0 - ahead) * tips[1:-1] + ahead**2 * exits
    half = len(ahead) // 2
    line = np.concatenate([corners[half:, :-1], corners[: half + 1, 1:]])
    move = np.clip(np.searchsorted(orders.poses, np.arange(poses.count), side="right") - 1, 0, lengths.size - 1)
    misses = np.full(poses.count, np.inf)
    for start, end in pairwise(line[:, move]):
        along = end - start
        squares = np.maximum(np.einsum("ij,ij->i", along, along), np.finfo(np.float64).tiny)
        share = np.clip(np.einsum("ij,ij->i", poses.tips - start, along) / squares, 0.0, 1.0)
        misses = np.minimum(misses, np.linalg.norm(poses.tips - start - share[:, None] * along, axis=1))
    passed = np.einsum("ij,ij->i", poses.tips - tips[move], steps[move]) / lengths[move]
    straight = (passed > orders.zones[move]) & (passed < lengths[move] - orders.zones[move + 1])
    frames = transforms.rigid(transforms.rotation_of(orders.quaternions), tips)
    row = move[straight]
    meant = transforms.interpolate_poses(frames[row], frames[row + 1], passed[straight] / lengths[row])[:, :3, :3]
    turned = np.zeros(poses.count)
    own = transforms.rotation_of(poses.quaternions[straight])
    turned[straight] = np.degrees(transforms.rotation_angle(np.swapaxes(meant, 1, 2) @ own))
    for off, allowed, unit in ((misses, MOVE_TOLERANCE, "mm"), (turned, MOVE_TURN_DEG, "degrees")):
        if off.max() > allowed:
            pose = int(off.argmax())
            raise VerificationError(
                f"the moves pass the pose in row {pose + 1} of poses.csv {off[pose]:.3f} {unit} off, allowed are "
                f"{allowed:g}",
                line=int(move[pose]) + 3,
            )


def check_deposited_path(poses: PoseStream, table: TrajectoryTable, tips: TipsAt) -> None:
    """Check that the trajectory leads the tip past every pose that deposits.

    Raises:
        VerificationError: it misses one.
    """
    wanted = poses.tips[poses.deposit]
    moments = table.times[table.runs >= 0]
    if not len(wanted) or not moments.size:
        return
    passed = [tips(moments[start : start + _STRETCH]) for start in range(0, moments.size, _STRETCH)]
    misses: FloatArray = np.asarray(cKDTree(np.concatenate(passed)).query(wanted)[0], dtype=np.float64)
    if misses.max() > PASSED_TOLERANCE:
        row = int(np.flatnonzero(poses.deposit)[misses.argmax()])
        raise VerificationError(
            f"the trajectory misses the pose in row {row + 1} of poses.csv by {misses.max():.3f} mm, allowed are "
            f"{PASSED_TOLERANCE} mm",
            line=row + 2,
        )


def check_target_joints(orders: Orders, table: TrajectoryTable, arm: Arm, T_base_work: FloatArray) -> None:
    """Check that the joints of targets are those of the trajectory when it passes, and lifted lead above them.

    Raises:
        VerificationError: a target has others.
    """
    planned = joints_at(table.times, table.joints, orders.times)
    off = np.abs(orders.joints - planned).max(axis=1)
    _refuse_joints(off > joint_tolerances(orders), "its joints are not those of trajectory.csv then")
    lifted = transforms.inverse(T_base_work) @ arm.tool_poses(orders.lifted_joints)
    up = transforms.inverse(T_base_work)[:3, :3] @ np.array([0.0, 0.0, LIFT])
    away = np.linalg.norm(lifted[:, :3, 3] - orders.tips - up, axis=1)
    turned = np.abs(lifted[:, :3, :3] - transforms.rotation_of(orders.quaternions)).max(axis=(1, 2))
    # A lift leaves the posture of the arm as it is: another one turns joints by half a turn.
    other = np.abs(orders.lifted_joints - orders.joints).max(axis=1) > OTHER_POSTURE
    wrong = (away > POSE_TOLERANCE) | (turned > LIFTED_TURN) | other
    _refuse_joints(wrong, f"its joints in the dry run do not hold the tool {LIFT:g} mm above it")


def _refuse_joints(wrong: BoolArray, what: str) -> None:
    if wrong.any():
        row = int(np.argmax(wrong))
        raise VerificationError(f"target {row + 1}: {what}; write the plan again.", line=row + 2)


def check_joints(table: TrajectoryTable, robot: Robot, *, process: Process) -> None:
    """Check that the trajectory goes from home to home within the limits of the joints, at both ends at their share.

    Raises:
        VerificationError: it begins or ends elsewhere, or a joint turns too far or fast, or is accelerated too much.
    """
    joints, steps = table.joints, np.diff(table.times)[:, None]
    speeds = np.diff(joints, axis=0) / steps
    accelerations = np.diff(speeds, axis=0) / steps[1:]
    low, high = robot.limits.T
    home = (table.runs[:-1] < 0) & (table.runs[1:] < 0)
    fastest = robot.speeds * np.where(home, process.joint_speed_share, 1.0)[:, None]
    for share, what in (
        (np.maximum(low - joints, joints - high) / ANGLE_TOLERANCE, "turns beyond its limits"),
        (np.abs(speeds) / (fastest * (1.0 + SPEED_SHARE)), "turns faster than it may"),
        (np.abs(accelerations) / (robot.accelerations * (1.0 + ACCELERATION_SHARE)), "is accelerated more than it may"),
        (np.abs(joints[[0, -1]] - robot.home) / ANGLE_TOLERANCE, "does not begin and end at home"),
    ):
        if share.max(initial=0.0) > 1.0:
            row, joint = np.unravel_index(int(share.argmax()), share.shape)
            raise VerificationError(f"axis {int(joint) + 1} {what}", line=int(row) + 2)


def check_speeds(orders: Orders, tips: TipsAt, times: FloatArray, *, process: Process) -> None:
    """Check that the speed of each target is that of the trajectory up to it, and on travel at most the process's.

    The path there is about as long as the straight line between where the targets are passed, or longer, and at most
    as long as that of the trajectory, which swings around corners.

    Args:
        orders: t targets.
        tips: the trajectory.
        times: (k,) of its rows [s].
        process: speeds.

    Raises:
        VerificationError: one is not.
    """
    lines, durations = np.linalg.norm(np.diff(corner_middles(orders), axis=0), axis=1), np.diff(orders.times)
    paths = np.maximum(_path_lengths(orders.times, tips, times), lines)
    planned = np.where(orders.deposited[:-1], process.speed, process.travel_speed)
    with np.errstate(divide="ignore", invalid="ignore"):
        slow, fast = (lines - LINE_TOLERANCE) / durations, (paths + CORNER_TOLERANCE) / durations
    moves = (paths > TURN_ON_THE_SPOT) & (durations > 0.0)
    # What deposits is bounded by the speed of the bead, which `check_bead_speed` looks at.
    most = np.where(orders.deposited[:-1], np.inf, planned)
    lowest = np.where(moves, np.minimum(most, np.maximum(slow - SPEED_TOLERANCE, SMALLEST_SPEED)), planned)
    highest = np.where(moves, np.minimum(most, np.maximum(fast + SPEED_TOLERANCE, SMALLEST_SPEED)), planned)
    lowest, highest = (np.append(process.travel_speed, each) for each in (lowest, highest))
    wrong = ~((orders.speeds >= lowest - ZONE_TOLERANCE) & (orders.speeds <= highest + ZONE_TOLERANCE))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise VerificationError(
            f"target {row + 1} is reached at {orders.speeds[row]:g} mm/s, by trajectory.csv and the process at "
            f"{lowest[row]:.2f} to {highest[row]:.2f}",
            line=row + 2,
        )


def check_bead_speed(orders: Orders, poses: PosesTable, *, process: Process) -> None:
    """Check that nothing is deposited faster than the process says, over a millimetre of bead and more.

    Raises:
        VerificationError: something is.
    """
    for first, last in orders.deposits:
        rows, times = orders.poses[first : last + 1], orders.times[first : last + 1]
        own = slice(rows[0], rows[-1] + 1)
        beads = _averaged_bead(poses.points[own], arcs=poses.arcs[own])[rows - rows[0]]
        ends = np.searchsorted(beads, beads + BEAD_LENGTH)
        starts = np.flatnonzero(ends < beads.size)
        ends = ends[starts]
        speeds = (beads[ends] - beads[starts]) / np.maximum(times[ends] - times[starts], _MILLISECOND)
        if speeds.max(initial=0.0) > BEAD_TOLERANCE * process.speed:
            row = first + int(starts[speeds.argmax()])
            raise VerificationError(
                f"run {orders.runs[row] + 1} deposits at {speeds.max():.2f} mm/s behind target {row + 1}, allowed are "
                f"{process.speed:g}",
                line=row + 2,
            )


def _averaged_bead(points: FloatArray, *, arcs: FloatArray) -> FloatArray:
    """Return (k,) the length of bead [mm], each step as long as a millimetre of the tip about it makes it.

    So a speed is meant: in a crease the tip hardly moves while its bead goes around, and must not jump there.

    Args:
        points: (k, 3) of the bead [mm].
        arcs: (k,) of the tip, rising [mm].
    """
    beads = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    middles = (arcs[1:] + arcs[:-1]) / 2.0
    low, high = ((middles + side * BEAD_LENGTH / 2.0).clip(arcs[0], arcs[-1]) for side in (-1.0, 1.0))
    rates = (np.interp(high, arcs, beads) - np.interp(low, arcs, beads)) / np.maximum(high - low, LINE_TOLERANCE)
    return np.append(0.0, np.cumsum(rates * np.diff(arcs)))


def check_zones(orders: Orders, tips: TipsAt) -> None:
    """Check that each zone is half the distance to the nearer neighbour, at most 0.3 mm, and 0 where the tool stops.

    Or it is so much smaller that it cuts its corner by no more than 0.004 mm. The tool stops at both ends of each run,
    beside turns on the spot, and where the tip rests.

    Raises:
        VerificationError: one is not.
    """
    largest = largest_zones(orders)
    resting = np.linalg.norm(tips(orders.times + _MILLISECOND) - tips(orders.times - _MILLISECOND), axis=1) < RESTING
    along = np.diff(orders.tips, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    cutting = largest.copy()
    bends = np.linalg.norm(np.diff(along, axis=0), axis=1)
    cutting[1:-1] = np.minimum(largest[1:-1], 4.0 * CUT_CORNER / np.maximum(bends, 1e-9))
    kept = (orders.zones == 0.0) & resting
    for each in (largest, cutting):
        kept |= np.abs(orders.zones - each) <= ZONE_TOLERANCE
    if not kept.all():
        row = int(np.argmin(kept))
        raise VerificationError(
            f"target {row + 1} has a zone of {orders.zones[row]:g} mm, by its neighbours {largest[row]:.4f}",
            line=row + 2,
        )


def check_extent(poses: PosesTable, extent: FloatArray) -> None:
    """Check that all that is printed lies in the (2, 3) box of the part, within which the guard asks for the frame.

    Raises:
        VerificationError: a pose does not.
    """
    low, high = extent
    off = np.maximum(low - poses.points, poses.points - high).max(axis=1)
    wrong = poses.deposit & (off > EXTENT_TOLERANCE)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise VerificationError(
            f"row {row + 1} of poses.csv lies {off[row]:.3f} mm outside the part's box of setup.json", line=1
        )


def _path_lengths(moments: FloatArray, tips: TipsAt, times: FloatArray) -> FloatArray:
    """Return (t - 1,) how far the tip goes from each of (t,) moments to the next, by the trajectory's rows [mm]."""
    every = np.union1d(moments, times[(times > moments[0]) & (times < moments[-1])])
    steps = [
        np.linalg.norm(np.diff(tips(every[start : start + _STRETCH + 1]), axis=0), axis=1)
        for start in range(0, every.size - 1, _STRETCH)
    ]
    passed = np.append(0.0, np.cumsum(np.concatenate([np.empty(0), *steps])))
    return np.diff(passed[np.searchsorted(every, moments)])
