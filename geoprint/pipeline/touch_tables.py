"""Tables that a person fills in at the robot: points by name, and poses in which the tip touched one point.

CSV in UTF-8 with commas; the first row names the columns, lines that start with # are comments:

    name,x,y,z                  points: mm; a name may come again where a point was touched more than once
    x,y,z,q1,q2,q3,q4           poses of the flange in the base frame: mm and a unit quaternion, its scalar first, as
                                the pendant shows them for tool0 in the base's coordinates; or
    j1,j2,j3,j4,j5,j6           the joint angles in degrees
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import FloatArray, Robot
from geoprint.model.arrays import freeze_arrays
from geoprint.motion.arm import Arm
from geoprint.pipeline.number_tables import numbers_of, require_columns, rows_of
from geoprint.transforms import rigid, rotation_of

POINT_COLUMNS = ("name", "x", "y", "z")
POSE_COLUMNS = ("x", "y", "z", "q1", "q2", "q3", "q4")
JOINT_COLUMNS = ("j1", "j2", "j3", "j4", "j5", "j6")

# A quaternion that was read off a pendant with four decimals has length 1 within this.
UNIT_TOLERANCE = 1e-3


@final
@dataclass(frozen=True, slots=True, eq=False)
class NamedPoints:
    """Points as a table lists them.

    Attributes:
        file: name of the table.
        names: k of them.
        places: (k, 3) [mm].
    """

    file: str
    names: tuple[str, ...]
    places: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, places="float: k 3")


def read_points(path: Path) -> NamedPoints:
    """Read a table of named points.

    Raises:
        InputError: it cannot be read, or a row or column is not as described; says which.
    """
    rows = rows_of(path)
    require_columns(path, rows[0][1], [POINT_COLUMNS])
    names = tuple(cells[0] for _, cells in rows[1:])
    for (number, _), name in zip(rows[1:], names, strict=True):
        if not name or not name.isprintable():
            raise InputError(f"{path.name}, row {number}, column name: found {name!r}, needed is a printable name.")
    numbers = [numbers_of(path, number, cells[1:], POINT_COLUMNS[1:]) for number, cells in rows[1:]]
    return NamedPoints(path.name, names, np.array(numbers).reshape(-1, 3))


def read_flange_poses(path: Path, *, robot: Robot) -> FloatArray:
    """Read the (k, 4, 4) poses of the flange in the base frame from a table of poses or of joint angles.

    Args:
        path: the table.
        robot: the arm whose joint angles may be listed.

    Raises:
        InputError: it cannot be read, or a row or column is not as described; says which.
    """
    rows = rows_of(path)
    columns = require_columns(path, rows[0][1], [POSE_COLUMNS, JOINT_COLUMNS])
    values = np.array([numbers_of(path, number, cells, columns) for number, cells in rows[1:]]).reshape(
        -1, len(columns)
    )
    if columns == JOINT_COLUMNS:
        return Arm(robot, T_flange_tool=np.eye(4)).flange_poses(np.radians(values))
    lengths = np.linalg.norm(values[:, 3:], axis=1)
    for (number, _), length in zip(rows[1:], lengths, strict=True):
        if abs(length - 1.0) > UNIT_TOLERANCE:
            raise InputError(
                f"{path.name}, row {number}, columns q1 to q4: the quaternion has length {length:.4f}, needed is 1 "
                f"within {UNIT_TOLERANCE:g}; copy all four numbers as the pendant shows them.",
                row=number,
            )
    return rigid(rotation_of(values[:, 3:]), values[:, :3])
