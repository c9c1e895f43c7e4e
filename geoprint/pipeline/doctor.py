"""Versions, and positive controls: kinematics and collision check are made to prove themselves on this machine."""

from __future__ import annotations

import platform

import numpy as np

from geoprint.account.part_report import installed_version
from geoprint.config import load_cell
from geoprint.errors import VerificationError
from geoprint.motion.arm import Arm
from geoprint.motion.collision import arm_control, collision_control
from geoprint.transforms import inverse, rotation_angle

PACKAGES = (
    "geoprint",
    "numpy",
    "scipy",
    "trimesh",
    "pin",
    "toppra",
    "python-fcl",
    "pydantic",
    "matplotlib",
)
# Kinematics must come back to where they started within these [mm, rad].
POSITION_TOLERANCE = 1e-6
ANGLE_TOLERANCE = 1e-8
CONTROL_POSES = 1000


def examine() -> tuple[str, ...]:
    """Return a line for every package and every control.

    Raises:
        VerificationError: a control failed: do not trust programs made on this machine.
    """
    versions = tuple(f"{name:<20}{installed_version(name)}" for name in PACKAGES)
    controls = (kinematics_control(), collision_control(), arm_control(load_cell(None).robot.model))
    return (f"{'python':<20}{platform.python_version()}", *versions, *controls)


def kinematics_control() -> str:
    """Send random joint angles through forward and inverse kinematics and back.

    Raises:
        VerificationError: a solution does not lead back to its pose, or the known one is not among the eight.
    """
    robot = load_cell(None).robot
    arm = Arm(robot, T_flange_tool=load_cell(None).tool.T_flange_tool)
    joints = np.random.default_rng(0).uniform(robot.limits[:, 0], robot.limits[:, 1], (CONTROL_POSES, 6))
    wanted = arm.tool_poses(joints)
    solutions = arm.solutions(wanted)
    exists = np.isfinite(solutions).all(axis=2)
    found = arm.tool_poses(solutions[exists])
    wanted = np.repeat(wanted, exists.sum(axis=1), axis=0)
    position = float(np.linalg.norm(found[:, :3, 3] - wanted[:, :3, 3], axis=1).max())
    angle = float(rotation_angle(inverse(found)[:, :3, :3] @ wanted[:, :3, :3]).max())
    away = np.abs(np.angle(np.exp(1j * (solutions - joints[:, None])))).max(axis=2)
    missed = int((np.nanmin(away, axis=1) > ANGLE_TOLERANCE).sum())
    if position > POSITION_TOLERANCE or angle > ANGLE_TOLERANCE or missed:
        raise VerificationError(
            f"kinematics control failed: inverse solutions miss their pose by {position:.3g} mm and {angle:.3g} rad, "
            f"{missed} of {CONTROL_POSES} known joint vectors are not found; reinstall numba."
        )
    return (
        f"kinematics control passed: {int(exists.sum())} inverse solutions of {CONTROL_POSES} poses lead back within "
        f"{position:.1e} mm and {angle:.1e} rad"
    )
