"""The freedom of a round nozzle: it may turn about its axis, and lean; and when turning it helps nothing.

A pose of the path is turned and leaned in the tool's own frame: R = R_path @ exp((x, y, 0)) @ Rz(turn). The tip stays.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import FloatArray, PoseStream

# A nozzle whose axis misses that of the flange by no more than this [mm, sine] lies on it: rounding of a cell file.
AXIAL_OFFSET = 1e-3
AXIAL_TILT = 1e-5


def is_axial(T_end_tool: FloatArray) -> bool:
    """Say whether turning about the nozzle moves joint 6 only: the tool's z axis lies on that of joint 6.

    Args:
        T_end_tool: (4, 4) tool in a frame whose z axis is that of joint 6: the flange's of any usual arm [mm].
    """
    offset, axis = np.hypot(*T_end_tool[:2, 3]), np.hypot(*T_end_tool[:2, 2])
    return bool(offset <= AXIAL_OFFSET and axis <= AXIAL_TILT)


def about_nozzle(rotations: FloatArray) -> FloatArray:
    """Return (k, 4, 4) turns [rad] about the tool's z axis."""
    return transforms.rigid(Rotation.from_rotvec(rotations[:, None] * [0.0, 0.0, 1.0]).as_matrix(), np.zeros(3))


def turned(poses: PoseStream, *, rotations: FloatArray, leans: FloatArray) -> PoseStream:
    """Return poses that lean and turn about the nozzle; signs of the quaternions stay continuous along the stream.

    Args:
        poses: p poses of the path.
        rotations: (p,) about the nozzle [rad].
        leans: (p, 2) about the x and y axes of the tool of the path [rad].
    """
    lean = np.column_stack([leans, np.zeros(poses.count)])
    turn = np.column_stack([np.zeros((poses.count, 2)), rotations])
    attitudes = Rotation.from_quat(poses.quaternions, scalar_first=True)
    attitudes = attitudes * Rotation.from_rotvec(lean) * Rotation.from_rotvec(turn)
    return replace(poses, quaternions=attitudes.as_quat(scalar_first=True))


def tilts(poses: PoseStream) -> FloatArray:
    """Return the (p,) angles between nozzle and surface normal [rad]; exact for small ones too."""
    axes = -transforms.rotation_of(poses.quaternions)[:, :, 2]
    across = np.linalg.norm(np.cross(axes, poses.normals), axis=1)
    return np.arctan2(across, np.einsum("ij,ij->i", axes, poses.normals))
