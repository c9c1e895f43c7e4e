"""A joint path whose poses stand where the targets are written."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geoprint import transforms
from geoprint.errors import ReachError
from geoprint.model import JointPath, Targets
from geoprint.motion.arm import Arm, configuration_data
from geoprint.motion.reach import tool_poses


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
    configuration = joint_path.configuration.copy()
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
    configuration[rows] = configuration_data(joints[rows], arm=arm)
    return replace(joint_path, poses=poses, joints=joints, configuration=configuration)
