"""The motion as the controller runs it: straight moves between waypoints (targets), rounded in zones."""

from __future__ import annotations

from dataclasses import replace
from typing import Never

import numpy as np

from geoprint import transforms
from geoprint.errors import InputError, ReachError
from geoprint.geometry import whole_steps
from geoprint.model import ControllerPath, FloatArray, IntArray, JointPath, Targets
from geoprint.robot.arm import JOINTS, Arm
from geoprint.robot.controller.targets import required_poses
from geoprint.robot.reach import LARGEST_JUMP, TURN_STEP, tool_poses

# What the controller may do where it rounds a target: the triangle that its corner path stays in.
#
# A target with a zone is a fly-by point [ABBRapid, zonedata]: at the edge of the zone, `zone` before the target, the
# tip leaves the straight line for a parabola that joins the next line as far behind the target; a zone is never
# larger than half the distance to the nearer neighbour, and the controller may make it smaller where the tool turns
# much. The attitude blends over the same stretch, because the program gives both zones the same size, and is at its
# end what it would be without a zone. So, whatever the controller does there, every point of tool and arm stays
# within the triangle of its places at the zone's entry, at the target and at the zone's exit: for the parabola, for
# one of a smaller zone, and for the corner itself.
#
# The checked path passes the *middle* of each triangle, halfway between the target and the middle of the chord from
# entry to exit, where the parabola has its apex. With straight lines from middle to middle, no point of the
# triangles or of the lines between the targets is farther from the path than the target is from the middle, falling
# linearly to the next one: in coordinates along the chord (a, from -1 to 1) and from chord to target (b, from 0 to 1
# - |a|), the path runs at b = 1/2 - |a|/2 or below. What a point of the tool may be off there, the *rounding*, is
# added to what the check inflates.


# The controller makes larger zones smaller than this share of the distance to a neighbour.
LARGEST_SHARE = 0.5
# Targets nearer than this [mm] have no line between them that a zone could lie on.
COINCIDENT = 1e-9


def triangle_middles(Ts_base_tool: FloatArray, zones: FloatArray) -> FloatArray:
    """Return where the checked path passes each target.

    Args:
        Ts_base_tool: (t, 4, 4) targets [mm].
        zones: (t,) radius of the zone of each [mm]; 0 where the tool stops, first and last among them.

    Returns:
        (t, 4, 4) the middle of each triangle; the target itself where its zone is 0, and at both ends.

    Examples:
        >>> corner = np.tile(np.eye(4), (3, 1, 1))
        >>> corner[:, :2, 3] = [[0, 0], [4, 0], [4, 4]]
        >>> triangle_middles(corner, np.array([0.0, 1.0, 0.0]))[1, :3, 3]
        array([3.75, 0.25, 0.  ])
    """
    middles = Ts_base_tool.copy()
    lengths = np.linalg.norm(np.diff(Ts_base_tool[:, :3, 3], axis=0), axis=1)
    inner = 1 + np.flatnonzero((zones[1:-1] > 0.0) & (np.minimum(lengths[:-1], lengths[1:]) > COINCIDENT))
    before, at, behind = Ts_base_tool[inner - 1], Ts_base_tool[inner], Ts_base_tool[inner + 1]
    entries = transforms.interpolate_poses(at, before, np.minimum(zones[inner] / lengths[inner - 1], LARGEST_SHARE))
    exits = transforms.interpolate_poses(at, behind, np.minimum(zones[inner] / lengths[inner], LARGEST_SHARE))
    halves = np.full(len(inner), 0.5)
    middles[inner] = transforms.interpolate_poses(at, transforms.interpolate_poses(entries, exits, halves), halves)
    return middles


# A joint path whose poses stand where the targets are written.


def written_path(joint_path: JointPath, targets: Targets, arm: Arm) -> JointPath:
    """Return a joint path in which the poses of moved targets stand where these are written, with the joints there.

    Args:
        joint_path: p poses with their joints, and the branch.
        targets: that are written.
        arm: with its tool.

    Raises:
        ReachError: a target is out of reach on the branch.
    """
    rows = targets.poses[targets.moved]
    if not rows.size:
        return joint_path
    tips, joints = joint_path.poses.tips.copy(), joint_path.joints.copy()
    tips[rows] = targets.places
    poses = replace(joint_path.poses, tips=tips)
    found = arm.solutions(tool_poses(poses, T_base_work=joint_path.T_base_work)[rows])[:, joint_path.branch]
    missing = np.isnan(found).any(axis=1)
    if missing.any():
        at = int(missing.argmax())
        run = int(poses.runs[rows[at]])
        raise ReachError(
            f"run {run + 1}: the target beside the path at {targets.places[at].round(2).tolist()} mm is out of reach; "
            "move or turn the part.",
            run=run,
        )
    joints[rows] += transforms.wrapped(found - joints[rows])
    return replace(joint_path, poses=poses, joints=joints)


# The motion as the controller will run it: what is checked is this, not what was planned.


# The joints at a target, from the inverse, agree with those of the joint path to this [rad]: both are the same closed
# form, and rounding grows by 1 / sin of the wrist angle only. A target so near to a quarter turn may count as either.
SAME_JOINTS = 1e-6

# Steps of a joint move are cut so that they stay below the largest one by this factor: equal steps of the joints are
# not quite equal steps of the tip.
STEP_MARGIN = 0.95


def controller_path(joint_path: JointPath, targets: Targets, arm: Arm, *, step: float = 0.5) -> ControllerPath:
    """Follow the written targets as the controller does, and check that it can.

    From home all joints move together to the first target; from target to target the tip moves in a straight line
    while the tool turns at a constant rate (slerp), with the joints from the inverse on the program's branch at every
    sample; all joints move together back home. Samples are at most `step` of tip movement apart; on straight moves
    the tool, on joint moves each joint, turns by at most one degree between them.

    Where a target has a zone the rows pass the middle of the triangle that its corner path stays in (`zones`), and say
    how far the joints at the target itself are from there; along the lines this falls linearly to the next target.

    Args:
        joint_path: p poses with their joints, and the branch.
        targets: the poses that are written.
        arm: with its tool.
        step: largest movement of the tip between neighbouring rows [mm], positive.

    Returns:
        The rows. The row that passes a target belongs to the move that leaves it; the last one deposits nothing.

    Raises:
        InputError: the step is not positive, or the targets leave out a pose that they must name.
        ReachError: on the straight line between targets the branch ends, a joint leaves its limits or jumps, or a
            target is reached with other joints than the joint path has there.
    """
    _refuse_incomplete(joint_path, targets, step=step)
    joint_path = written_path(joint_path, targets, arm)
    lines = _sampled_lines(joint_path, targets, arm, step=step)
    there = _joint_move(arm.robot.home, lines.joints[0], arm, step=step)[:-1]
    back = _joint_move(lines.joints[-1], arm.robot.home, arm, step=step)[1:]
    sizes = (len(there), len(lines.joints), len(back))
    exact = [np.zeros((size, JOINTS)) for size in sizes]
    return ControllerPath(
        joints=np.concatenate([there, lines.joints, back]),
        runs=np.concatenate([np.full(sizes[0], -1), lines.runs, np.full(sizes[2], -1)]),
        deposit=np.concatenate([np.zeros(sizes[0], np.bool_), lines.deposit, np.zeros(sizes[2], np.bool_)]),
        rounding=np.concatenate([exact[0], lines.rounding, exact[2]]),
        step=step,
    )


def there_and_back(joints: FloatArray, arm: Arm, *, step: float) -> ControllerPath:
    """Follow a joint move from home to other joints and back, which deposits nothing.

    Args:
        joints: (6,) [rad].
        arm: with its tool.
        step: largest movement of the tip between neighbouring rows [mm], positive.
    """
    there = _joint_move(arm.robot.home, joints, arm, step=step)
    rows = np.concatenate([there, there[-2::-1]])
    return ControllerPath(
        joints=rows,
        runs=np.full(len(rows), -1),
        deposit=np.zeros(len(rows), np.bool_),
        rounding=np.zeros_like(rows),
        step=step,
    )


def _sampled_lines(joint_path: JointPath, targets: Targets, arm: Arm, *, step: float) -> ControllerPath:
    """Return samples of the straight moves alone; what is rounded counts from the joints where no corner is."""
    poses, chosen = joint_path.poses, targets.poses
    commanded = tool_poses(poses, T_base_work=joint_path.T_base_work)[chosen]
    passed = triangle_middles(commanded, targets.zones)
    start, end = passed[:-1], passed[1:]
    moves = np.linalg.norm(end[:, :3, 3] - start[:, :3, 3], axis=1)
    turns = transforms.rotation_angle(np.swapaxes(start[:, :3, :3], 1, 2) @ end[:, :3, :3])
    steps = np.maximum(moves / step, turns / TURN_STEP)
    counts = whole_steps(steps)
    places = np.concatenate([[0], np.cumsum(counts)])
    rows = np.repeat(np.arange(counts.size), counts)
    shares = (np.arange(rows.size) - places[rows]) / counts[rows]
    between = transforms.interpolate_poses(start[rows], end[rows], shares)
    runs = np.append(poses.runs[chosen[1:]][rows], poses.runs[-1])
    joints = _followed(np.concatenate([between, passed[-1:]]), runs, joint_path, arm)
    off = transforms.wrapped(arm.solutions(commanded)[:, joint_path.branch] - joints[places])
    _refuse_other_solutions(joints[places] + off, joint_path, targets)
    rounding = off[rows] + shares[:, None] * (off[rows + 1] - off[rows])
    deposit = poses.deposited[chosen[:-1]][rows]
    return ControllerPath(joints, runs, np.append(deposit, np.False_), np.concatenate([rounding, off[-1:]]), step)


def _followed(Ts_base_tool: FloatArray, runs: IntArray, joint_path: JointPath, arm: Arm) -> FloatArray:
    """Return the joints (s, 6) on the program's branch, wound as the joint path is, inside the limits."""
    found = arm.solutions(Ts_base_tool)[:, joint_path.branch]
    missing = np.isnan(found).any(axis=1)
    if missing.any():
        _refuse("is out of reach on the program's branch", joint_path, Ts_base_tool, runs, at=int(missing.argmax()))
    joints: FloatArray = np.unwrap(found, axis=0)
    joints = joints + 2.0 * np.pi * np.rint((joint_path.joints[0] - joints[0]) / (2.0 * np.pi))
    jumps = np.abs(np.diff(joints, axis=0))
    if jumps.max(initial=0.0) > LARGEST_JUMP:
        row, joint = np.unravel_index(int(jumps.argmax()), jumps.shape)
        angle, allowed, wrist = np.degrees([jumps[row, joint], LARGEST_JUMP, abs(joints[row, 4])])
        what = f"flips: joint {joint + 1} turns by {angle:.0f} degrees at once (joint 5 at {wrist:.1f}), allowed are "
        _refuse(f"{what}{allowed:.0f}", joint_path, Ts_base_tool, runs, at=int(row))
    limits = arm.robot.limits
    outside = np.maximum(limits[:, 0] - joints, joints - limits[:, 1])
    if outside.max() > SAME_JOINTS:
        row, joint = np.unravel_index(int(outside.argmax()), outside.shape)
        angle, low, high = np.degrees([joints[row, joint], *limits[joint]])
        what = f"needs joint {joint + 1} at {angle:.2f} degrees, allowed is {low:.0f} to {high:.0f}"
        _refuse(what, joint_path, Ts_base_tool, runs, at=int(row))
    return joints


def _refuse_incomplete(joint_path: JointPath, targets: Targets, *, step: float) -> None:
    if not step > 0.0:
        raise InputError(f"the step of a controller path must be positive, found {step:g} mm; 0.5 mm is usual.")
    if not (np.diff(targets.poses) > 0).all():
        raise InputError("the targets do not ascend along the poses; thin the stream again.")
    missing = np.setdiff1d(required_poses(joint_path.poses), targets.poses)
    if missing.size:
        raise InputError(
            f"the targets leave out pose {missing[0]} (run {joint_path.poses.runs[missing[0]] + 1}), where the tool "
            "stops, or where the deposit begins or ends; thin the stream again.",
            pose=int(missing[0]),
        )


def _refuse_other_solutions(joints: FloatArray, joint_path: JointPath, targets: Targets) -> None:
    """Refuse targets (t, 6) that the controller reaches with other joints than planned."""
    chosen = targets.poses
    commanded = tool_poses(joint_path.poses, T_base_work=joint_path.T_base_work)[chosen]
    runs = joint_path.poses.runs[chosen]
    differences = np.abs(joints - joint_path.joints[chosen])
    # Where a target has no solution the difference is no number, and not below anything.
    if not differences.max() <= SAME_JOINTS:
        row, joint = np.unravel_index(int(differences.argmax()), differences.shape)
        found = np.degrees(differences[row, joint])
        what = f"is reached with joint {joint + 1} off the planned angle by {found:.3g} degrees"
        _refuse(what, joint_path, commanded, runs, at=int(row))


def _refuse(what: str, joint_path: JointPath, Ts_base_tool: FloatArray, runs: IntArray, *, at: int) -> Never:
    base = Ts_base_tool[at, :3, 3]
    work = transforms.apply(transforms.inverse(joint_path.T_base_work), base[None])[0]
    run = int(runs[at])
    raise ReachError(
        f"run {run + 1}: the straight line of the controller {what} at {work.round(1).tolist()} mm (base "
        f"{base.round(1).tolist()} mm); move or turn the part, or keep more targets there.",
        run=run,
        work_mm=tuple(work.tolist()),
        base_mm=tuple(base.tolist()),
    )


def _joint_move(start: FloatArray, end: FloatArray, arm: Arm, *, step: float) -> FloatArray:
    """Return rows (k, 6) of joint angles from start to end, both included, bounded in tip movement and in turn."""
    count = int(whole_steps(np.abs(end - start).max(), step=TURN_STEP))
    while True:
        rows = start + np.linspace(0.0, 1.0, count + 1)[:, None] * (end - start)
        rows[-1] = end
        places = arm.tool_poses(rows)[:, :3, 3]
        movement = float(np.linalg.norm(np.diff(places, axis=0), axis=1).max())
        if movement <= step:
            return rows
        count = int(np.ceil(count * movement / (STEP_MARGIN * step)))
