"""Makes the orders of a plan: once, before any text is written, and only where the targets serve the whole stream."""

from __future__ import annotations

import numpy as np

from geoprint.errors import InputError
from geoprint.model import FloatArray, IntArray, JointPath, Placement, PoseStream, Targets, Trajectory
from geoprint.postprocessor.orders import Orders

# Below this a controller knows no speed [mm/s].
SMALLEST_SPEED = 0.01
# Times are those of targets.csv, so that whoever reads it finds the same places of switching [s].
TIME_DECIMALS = 6
# uframe and oframe must be the placement that the joint path was computed for.
_SAME_PLACEMENT = 1e-6


def orders_of(
    joint_path: JointPath,
    targets: Targets,
    trajectory: Trajectory,
    *,
    placement: Placement,
    lifted_joints: FloatArray,
    extent: FloatArray,
    frame: float = np.inf,
) -> Orders:
    """Return the orders of a plan.

    Args:
        joint_path: poses and joint angles, with the targets where they are written.
        targets: which poses are written, how fast, how rounded.
        trajectory: when each pose is passed.
        placement: where the part stands; the joint path must have been computed for it.
        lifted_joints: (t, 6) at the targets of the dry run [rad].
        extent: (2, 3) lowest and highest coordinates of the part in the work frame [mm].
        frame: as `Orders` [mm].

    Raises:
        InputError: the targets do not serve the whole stream, stand elsewhere than the joint path has them or are
            none where a deposit begins or ends, or the placement is another one.
    """
    _check_placement(joint_path, placement)
    poses, chosen = joint_path.poses, targets.poses
    _check_targets(poses, targets)
    deposited = np.append(poses.deposited, np.False_)[chosen]
    return Orders(
        poses=chosen,
        tips=poses.tips[chosen],
        quaternions=poses.quaternions[chosen],
        joints=joint_path.joints[chosen],
        zones=targets.zones,
        speeds=targets.speeds,
        runs=poses.runs[chosen],
        deposited=deposited,
        flow=np.where(deposited, _mean_flow(poses, chosen), 0.0),
        times=np.round(trajectory.pose_times[chosen], TIME_DECIMALS),
        lifted_joints=lifted_joints,
        extent=extent,
        duration=trajectory.duration,
        frame=frame,
    )


def _check_placement(joint_path: JointPath, placement: Placement) -> None:
    difference = float(np.abs(joint_path.T_base_work - placement.T_base_work).max())
    if difference > _SAME_PLACEMENT:
        raise InputError(
            f"the joint path was computed for another placement of the part (frames differ by {difference:.3g}); "
            "compute it again for this one.",
            difference=difference,
        )


def _mean_flow(poses: PoseStream, chosen: IntArray) -> FloatArray:
    """Return (t,) the volume from each target to the next over the length that the tip moves between them.

    What is to be deposited is planned by the length on the surface, and the controller sets it by the speed of the tip,
    which moves farther where it stands over a surface that bulges.
    """
    steps, deposited = (
        np.linalg.norm(np.diff(places, axis=0), axis=1) for places in (poses.tips, poses.surface_points)
    )
    volume = np.append(0.0, np.cumsum(deposited * (poses.flow[1:] + poses.flow[:-1]) / 2.0))[chosen]
    lengths = np.diff(np.append(0.0, np.cumsum(steps))[chosen])
    return np.append(np.where(lengths > 0.0, np.diff(volume) / np.where(lengths > 0.0, lengths, 1.0), 0.0), 0.0)


def _check_targets(poses: PoseStream, targets: Targets) -> None:
    chosen = targets.poses
    if not chosen.size or chosen[0] != 0 or chosen[-1] != poses.count - 1 or (np.diff(chosen) <= 0).any():
        raise InputError(
            f"targets must rise from pose 0 to pose {poses.count - 1}, the first and the last of the stream; "
            "thin the stream again."
        )
    if targets.speeds.min() < SMALLEST_SPEED or targets.zones.min() < 0.0:
        raise InputError(
            f"targets need speeds of at least {SMALLEST_SPEED} mm/s and zones of at least 0 mm, found "
            f"{targets.speeds.min():g} mm/s and {targets.zones.min():g} mm; thin the stream again."
        )
    if (poses.tips[chosen[targets.moved]] != targets.places).any():
        raise InputError(
            "the joint path has the poses as planned, but some targets stand beside them; give the path as it is "
            "written, from `written_path`."
        )
    after, before = np.append(poses.deposited, np.False_), np.insert(poses.deposited, 0, np.False_)
    named = np.zeros(poses.count, dtype=np.bool_)
    named[chosen] = True
    wrong = np.flatnonzero((poses.deposit & ~after & ~before) | ((after ^ before) & ~named))
    if wrong.size:
        raise InputError(
            f"pose {wrong[0]} of run {poses.runs[wrong[0]] + 1} begins or ends a deposit, but is no target (or is "
            "alone in its deposit): thin the stream again.",
            pose=int(wrong[0]),
        )
