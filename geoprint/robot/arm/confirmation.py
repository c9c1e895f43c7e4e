"""Where the library Pinocchio finds the links of an arm: a second forward kinematics, asked where it is installed."""

from __future__ import annotations

import importlib.util
from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np

from geoprint.errors import UsageError, VerificationError
from geoprint.model import FloatArray, Robot
from geoprint.robot.arm.urdf import JOINTS, MILLIMETRES_PER_METRE, urdf_of

if TYPE_CHECKING:
    import pinocchio


# Poses found by two calculations differ by rounding only [m, and the same number for entries of a rotation].
AGREEMENT = 1e-9
# What a plan says of its kinematics where no second library confirms them.
UNCONFIRMED_KINEMATICS = "the kinematics, by a second library: pin is not installed"


def unconfirmed_kinematics() -> tuple[str, ...]:
    """Return what a plan is to say of its kinematics where no second library confirms them."""
    return () if _is_installed() else (UNCONFIRMED_KINEMATICS,)


def confirm(robot: Robot, *, joints: FloatArray, Ts_base_link: FloatArray, Ts_base_flange: FloatArray) -> None:
    """Compare poses with those that Pinocchio finds from the same URDF, where it is installed.

    Args:
        robot: the arm.
        joints: (k, 6) joint angles [rad].
        Ts_base_link: (k, 6, 4, 4) frames of the links 1 to 6 at these angles [mm].
        Ts_base_flange: (k, 4, 4) frames of the flange [mm].

    Raises:
        VerificationError: Pinocchio finds others.
        UsageError: Pinocchio is installed and cannot be imported, or cannot read the URDF.
    """
    if not _is_installed():
        return
    found = _frames_of_pinocchio(robot, joints)
    away = np.abs(in_metres(np.concatenate([Ts_base_link, Ts_base_flange[:, None]], axis=1) - found))
    if not float(away.max()) <= AGREEMENT:
        row, frame = np.unravel_index(int(away.max(axis=(2, 3)).argmax()), away.shape[:2])
        raise VerificationError(
            f"Pinocchio finds {'the flange' if frame == JOINTS else f'link {frame + 1}'} of the {robot.model} "
            f"{float(away.max()):.3g} m away at the joint angles {np.degrees(joints[row]).round(1).tolist()} degrees, "
            f"allowed are {AGREEMENT:g}; please report it with the URDF."
        )


def in_metres(poses: FloatArray) -> FloatArray:
    """Return differences of (..., 4, 4) poses with their lengths in metres, of the size of rotations."""
    scaled = poses.copy()
    scaled[..., :3, 3] /= MILLIMETRES_PER_METRE
    return scaled


def _is_installed() -> bool:
    return importlib.util.find_spec("pinocchio") is not None


def _frames_of_pinocchio(robot: Robot, joints: FloatArray) -> FloatArray:
    """Return (k, 7, 4, 4) frames of the links 1 to 6 and of the flange [mm]."""
    try:
        library = import_module("pinocchio")
    except ImportError as error:
        raise UsageError(
            f"pin is installed but cannot be imported ({error}). Run 'pip install --force-reinstall pin', or "
            "uninstall it: plans then state that their kinematics are not confirmed."
        ) from error
    try:
        model: pinocchio.Model = library.buildModelFromXML(urdf_of(robot))
    except (RuntimeError, ValueError) as error:
        raise UsageError(f"the URDF {robot.model} cannot be read by Pinocchio ({error}); correct it.") from error
    if model.nq != JOINTS:
        raise UsageError(
            f"the URDF {robot.model} has {model.nq} coordinates for Pinocchio, needed are six; correct it."
        )
    data, flange = model.createData(), model.getFrameId(robot.flange, library.FrameType.BODY)
    frames = np.empty((len(joints), JOINTS + 1, 4, 4))
    for row, angles in enumerate(np.ascontiguousarray(joints, dtype=np.float64)):
        library.framesForwardKinematics(model, data, angles)
        for joint in range(JOINTS):
            frames[row, joint] = data.oMi[joint + 1].homogeneous
        frames[row, JOINTS] = data.oMf[flange].homogeneous
    frames[..., :3, 3] *= MILLIMETRES_PER_METRE
    return frames
