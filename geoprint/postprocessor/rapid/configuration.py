"""Configuration data of the targets of a program, held against the inverse kinematics and the planned motion.

What the program says is judged by what it was not made of: joints that reach its targets, printed, lifted for the dry
run, and where the frame lies off by as much as it may.
"""

from __future__ import annotations

from itertools import product
from typing import NoReturn

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import VerificationError
from geoprint.model import BoolArray, Cell, FloatArray, IntArray
from geoprint.postprocessor.expected import JOINT_TOLERANCE, LIFT, joint_tolerances
from geoprint.postprocessor.orders import Orders
from geoprint.postprocessor.rapid.made import Made
from geoprint.postprocessor.tables import TrajectoryTable
from geoprint.robot.arm import Arm, border_distances, configuration_data
from geoprint.robot.timing.moments import joints_at

# An angle this near to a multiple of 90 degrees [rad] may count for either quadrant.
_QUADRANT_TOLERANCE = 1e-6
# Axes 1, 4 and 6, whose quadrants configuration data count.
_AXES = (0, 3, 5)


def configurations(orders: Orders, cell: Cell) -> tuple[IntArray, IntArray]:
    """Return (t, 4) the configuration data cf1, cf4, cf6, cfx of each target, printed and in the dry run."""
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    return configuration_data(orders.joints, arm=arm), configuration_data(orders.lifted_joints, arm=arm)


def check_configuration(made: Made, orders: Orders, table: TrajectoryTable, arm: Arm, T_base_work: FloatArray) -> None:
    """Check that the inverse kinematics of the written targets has the written configuration, on the planned motion.

    Raises:
        VerificationError: one has another, or lies off the planned motion.
    """
    found = arm.solutions(T_base_work @ _frames(made))
    planned = joints_at(table.times, table.joints, orders.times)
    wound = found + 2.0 * np.pi * np.rint((planned[:, None] - found) / (2.0 * np.pi))
    misses = np.abs(wound - planned[:, None]).max(axis=2)
    nearest = np.nanargmin(np.where(np.isnan(misses), np.inf, misses), axis=1)
    rows = np.arange(made.count)
    off = ~(misses[rows, nearest] <= joint_tolerances(orders))
    if off.any():
        _refuse(made, int(np.argmax(off)), "no inverse kinematic solution is on the planned motion")
    _check_data(made, wound[rows, nearest], made.configurations.astype(np.int64), arm=arm, how="")


def check_lifted(made: Made, lifted: Made, orders: Orders, arm: Arm, T_base_work: FloatArray) -> None:
    """Check the same of the dry run: the targets lifted, on the branch on which it begins.

    Raises:
        VerificationError: a lifted target has another configuration, or is out of reach.
    """
    lift = transforms.rigid(np.eye(3), np.array([0.0, 0.0, LIFT]))
    solutions = arm.solutions(lift @ T_base_work @ _frames(made))
    misses = np.abs(transforms.wrapped(solutions[0] - orders.lifted)).max(axis=1)
    branch = int(np.nanargmin(np.where(np.isnan(misses), np.inf, misses)))
    found = solutions[:, branch]
    missing = np.isnan(found).any(axis=1)
    if missing.any():
        _refuse(made, int(np.argmax(missing)), "lifted for the dry run, it is out of reach")
    if not misses[branch] <= JOINT_TOLERANCE:
        _refuse(made, 0, "lifted for the dry run it is not where targets.csv has its joints")
    joints: FloatArray = np.unwrap(found, axis=0)
    joints = joints + 2.0 * np.pi * np.rint((orders.lifted - joints[0]) / (2.0 * np.pi))
    _check_data(made, joints, lifted.configurations.astype(np.int64), arm=arm, how="lifted for the dry run, ")


def check_frame(made: Made, orders: Orders, table: TrajectoryTable, arm: Arm, T_base_work: FloatArray) -> None:
    """Check that no target leaves its quadrants where the part lies off by as much as setup.json says it may.

    It is shifted along each axis and turned about each one through its middle, both at once, to either side.

    Raises:
        VerificationError: one does.
    """
    if not np.isfinite(orders.frame):
        raise VerificationError(
            "setup.json lacks the tolerance of the frame; write the plan again", file="setup.json", line=1
        )
    low, high = orders.extent
    centre, turn = transforms.apply(T_base_work, (low + high)[None] / 2.0)[0], orders.frame / np.linalg.norm(high - low)
    planned = joints_at(table.times, table.joints, orders.times)
    solutions = arm.solutions(T_base_work @ _frames(made))
    wound = solutions + 2.0 * np.pi * np.rint((planned[:, None] - solutions) / (2.0 * np.pi))
    misses = np.abs(wound - planned[:, None]).max(axis=2)
    branches = np.nanargmin(np.where(np.isnan(misses), np.inf, misses), axis=1)
    rows, signed = np.arange(made.count), np.vstack([np.eye(3), -np.eye(3)])
    stands = wound[rows, branches]
    for shift, axis in product(signed, signed):
        turned = Rotation.from_rotvec(2.0 * turn * axis).as_matrix()
        moved = transforms.rigid(turned, centre + orders.frame * shift - turned @ centre)
        joints = arm.solutions(moved @ T_base_work @ _frames(made))[rows, branches]
        joints = stands + transforms.wrapped(joints - stands)
        left = ~(np.abs(joints - stands)[:, _AXES] < border_distances(stands) + _QUADRANT_TOLERANCE).all(axis=1)
        if left.any():
            row = int(np.argmax(left))
            _refuse(made, row, f"an axis leaves its quadrant where the frame lies {orders.frame:.3g} mm off")


def _check_data(made: Made, joints: FloatArray, said: IntArray, *, arm: Arm, how: str) -> None:
    """Compare the configuration data of (t, 6) joints with what the (t, 4) written ones say."""
    below, above = (configuration_data(joints + sign * _QUADRANT_TOLERANCE, arm=arm) for sign in (-1.0, 1.0))
    wrong: BoolArray = ((said != below) & (said != above)).any(axis=1)
    if wrong.any():
        row = int(np.argmax(wrong))
        _refuse(
            made,
            row,
            f"{how}the inverse kinematics gives the configuration {above[row].tolist()}, found {said[row].tolist()}",
        )


def _refuse(made: Made, row: int, what: str) -> NoReturn:
    place = made.place(row)
    raise VerificationError(f"target {row + 1}: {what}", module=place.module, line=place.line)


def _frames(made: Made) -> FloatArray:
    """Return (t, 4, 4) the tool at the targets in the work frame."""
    return transforms.rigid(transforms.rotation_of(made.turns), made.places)
