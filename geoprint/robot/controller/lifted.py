"""The path of a dry run: the same motion, higher, with a descent to each run for whoever resumes there.

A program that runs dry drives `LIFT` above the part, with the zones of the print. One that resumes at a later run
drives the runs before it dry, and comes straight down to the first target of the run that it prints. Both are checked
before the program is written. Where runs end and begin the tool stops, so that no corner is rounded on the descents.
"""

from __future__ import annotations

import numpy as np

from geoprint import transforms
from geoprint.errors import InputError, ReachError
from geoprint.model import BoolArray, FloatArray, IntArray, JointPath, PoseStream, Targets
from geoprint.robot.arm import Arm
from geoprint.robot.controller.interpolation import written_path
from geoprint.robot.reach import tool_poses

# How much higher a dry run is, along the base's z axis [mm].
LIFT = 20.0
# Whoever comes down to a run has the joints of the print there to this [rad].
SAME_JOINTS = 1e-6
# A dry run is checked at steps of this size [mm]: what is that far from everything needs no finer ones.
LIFTED_STEP = 2.0


def lifted_path(joint_path: JointPath, targets: Targets, arm: Arm) -> tuple[JointPath, Targets]:
    """Return a dry run through the targets of a path, with the descents and ascents before each run but the first.

    Args:
        joint_path: p poses with their joints, and the branch.
        targets: the poses that are written.
        arm: with its tool.

    Returns:
        The path, which deposits nothing, and targets that name all its poses, with their zones and speeds.

    Raises:
        InputError: the tool does not stop where a run begins or ends.
        ReachError: the branch ends along the path, or comes down to a run with other joints than the print has there.
    """
    joint_path = written_path(joint_path, targets, arm)
    poses, chosen = joint_path.poses, targets.poses
    _refuse_rounded_ends(poses.runs[chosen], targets.zones)
    lift = transforms.inverse(joint_path.T_base_work)[:3, :3] @ np.array([0.0, 0.0, LIFT])
    rows, raised = _course(poses.runs[chosen])
    picked = chosen[rows]
    stream = _stream(poses, picked, tips=poses.tips[picked] + np.where(raised[:, None], lift, 0.0))
    found = arm.solutions(tool_poses(stream, T_base_work=joint_path.T_base_work))[:, joint_path.branch]
    missing = np.isnan(found).any(axis=1)
    if missing.any():
        row = int(np.argmax(missing))
        raise ReachError(
            f"run {stream.runs[row] + 1}: {LIFT:g} mm above the part, at the height of the dry run, the tip is out of "
            f"reach at {stream.tips[row].round(1).tolist()} mm. Move the part lower or nearer.",
            run=int(stream.runs[row]),
        )
    joints: FloatArray = np.unwrap(found, axis=0)
    joints = joints + 2.0 * np.pi * np.rint((joint_path.joints[0] - joints[0]) / (2.0 * np.pi))
    _refuse_other_joints(np.abs(joints - joint_path.joints[picked])[~raised], runs=stream.runs[~raised])
    path = JointPath(
        poses=stream,
        joints=joints,
        branch=joint_path.branch,
        rotations=joint_path.rotations[picked],
        leans=joint_path.leans[picked],
        T_base_work=joint_path.T_base_work,
    )
    every = np.arange(picked.size)
    return path, Targets(poses=every, zones=targets.zones[rows], speeds=targets.speeds[rows])


def lifted_joints(lifted: JointPath, joint_path: JointPath, targets: Targets) -> FloatArray:
    """Return (t, 6) the joints at each target where it is lifted [rad].

    Args:
        lifted: the dry run through the targets, from `lifted_path`.
        joint_path: p poses with their joints.
        targets: t of these that are written.
    """
    rows, raised = _course(joint_path.poses.runs[targets.poses])
    found: FloatArray = np.empty((targets.poses.size, 6))
    found[rows[raised]] = lifted.joints[raised]
    return found


def _refuse_other_joints(differences: FloatArray, *, runs: IntArray) -> None:
    """Refuse descents, one a row of (k, 6) differences [rad], that do not end with the joints of the print."""
    if differences.max(initial=0.0) > SAME_JOINTS:
        row, joint = np.unravel_index(int(differences.argmax()), differences.shape)
        raise ReachError(
            f"run {runs[row] + 1}: resuming there, the arm comes down with joint {joint + 1} off the planned angle by "
            f"{np.degrees(differences[row, joint]):.3g} degrees; move or turn the part.",
            run=int(runs[row]),
        )


def _refuse_rounded_ends(runs: IntArray, zones: FloatArray) -> None:
    changes = np.flatnonzero(np.diff(runs) != 0)
    rounded = (zones[changes] > 0.0) | (zones[changes + 1] > 0.0)
    if rounded.any():
        run = int(runs[changes[int(np.argmax(rounded))] + 1])
        raise InputError(
            f"the program does not stop at the start of run {run + 1} or at the end of the previous run, where "
            "printing may resume. Thin the stream again.",
            run=run,
        )


def _course(runs: IntArray) -> tuple[IntArray, BoolArray]:
    """Return the targets in the order of the dry run, and which of them are raised: all but the ends of descents."""
    firsts = np.flatnonzero(np.diff(runs) != 0) + 1
    last = firsts - 1
    rows = np.insert(np.arange(runs.size), np.repeat(firsts, 2), np.column_stack([firsts, last]).ravel())
    raised = np.ones(rows.size, dtype=np.bool_)
    raised[firsts + 2 * np.arange(firsts.size)] = False
    return rows, raised


def _stream(poses: PoseStream, rows: IntArray, *, tips: FloatArray) -> PoseStream:
    nothing = np.zeros(rows.size)
    return PoseStream(
        tips=tips,
        quaternions=transforms.same_sign(poses.quaternions[rows]),
        normals=poses.normals[rows],
        runs=np.maximum.accumulate(poses.runs[rows]),
        levels=np.full(rows.size, -1),
        layers=poses.layers[rows],
        deposit=np.zeros(rows.size, dtype=np.bool_),
        stops=poses.stops[rows],
        arcs=nothing,
        flow=nothing,
        standoff=poses.standoff,
    )
