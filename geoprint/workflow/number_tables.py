"""Tables that a person writes: touched points by name, poses in which the tip touched one point.

Columns stand in any order and among others, as `geoprint.delimited` reads them:

    x,y,z,thickness             places on the part and how thick what is printed over it shall be there: mm
    x,y,z,width                 places on the part and how wide fibres shall be there: mm
    name,x,y,z                  points: mm; a name may come again where a point was touched more than once
    x,y,z,q1,q2,q3,q4           poses of the flange in the base frame: mm and a unit quaternion, its scalar first, as
                                the pendant shows them for tool0 in the base's coordinates; or
    j1,j2,j3,j4,j5,j6           the joint angles in degrees

A pose of one row, in the second of these forms, is also how a scan is told to stand in the part's coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from geoprint.delimited import Columns, read_columns, refuse
from geoprint.errors import InputError, how_many
from geoprint.geometry import closest, in_words
from geoprint.model import FloatArray, Reading, Robot, Surface
from geoprint.model.values import freeze_arrays
from geoprint.robot.arm import Arm
from geoprint.transforms import rigid, rotation_of

POINT_COLUMNS = ("name", "x", "y", "z")
POSE_COLUMNS = ("x", "y", "z", "q1", "q2", "q3", "q4")
THICKNESS, WIDTH = "thickness", "width"
JOINT_COLUMNS = ("j1", "j2", "j3", "j4", "j5", "j6")
# A quaternion that was read off a pendant with four decimals has length 1 within this.
UNIT_TOLERANCE = 1e-3
# A larger coordinate [mm] is a typing error or another unit: no arm of this kind reaches two metres.
FARTHEST = 10_000.0
# Points of a table may lie off the part by this [mm]: what is read off a screen is rounded.
TABLE_TOLERANCE = 1.0


@final
@dataclass(frozen=True, slots=True, eq=False)
class NamedPoints:
    """Points as a table lists them.

    Attributes:
        file: name of the table.
        names: k of them.
        places: (k, 3) [mm].
        reading: what was used, skipped and assumed.
    """

    file: str
    names: tuple[str, ...]
    places: FloatArray
    reading: Reading

    def __post_init__(self) -> None:
        freeze_arrays(self, places="float: k 3")


def read_points(path: Path | str) -> NamedPoints:
    """Read a table of named points.

    Raises:
        InputError: it cannot be read, or a row or column is not as described; says which.
    """
    found = read_columns(path, [POINT_COLUMNS], what="points", texts=True, farthest=FARTHEST)
    for line, name in zip(found.lines, found.texts, strict=True):
        if not name or not name.isprintable():
            refuse(Path(path).name, line, f"found {name!r}, needed is a printable name", column="name")
    return NamedPoints(Path(path).name, found.texts, found.numbers, found.reading)


def read_thicknesses(path: Path | str) -> tuple[FloatArray, FloatArray]:
    """Read a table of thicknesses over a part.

    Returns:
        (k, 3) places and (k,) thickness there [mm], k >= 1.

    Raises:
        InputError: it cannot be read, a row or column is not as described, or a thickness is below 0; says which.
    """
    return _lengths_over(path, THICKNESS)


def read_widths(path: Path | str) -> tuple[FloatArray, FloatArray]:
    """Read a table of widths over a part.

    Returns:
        (k, 3) places and (k,) width there [mm], k >= 1.

    Raises:
        InputError: as `read_thicknesses`, or a width is 0.
    """
    places, values = _lengths_over(path, WIDTH)
    if values.min() == 0.0:
        x, y, z = places[int(values.argmin())].tolist()
        raise InputError(f"{Path(path).name}: the width at ({x:g}, {y:g}, {z:g}) mm is 0 mm, needed is more.")
    return places, values


def check_on_part(places: FloatArray, part: Surface, *, name: str) -> None:
    """Check that the (k, 3) points of a table lie on a part.

    Raises:
        InputError: one lies off it; says which.
    """
    _, away = closest(part, places)
    if away.max() > TABLE_TOLERANCE:
        worst = int(away.argmax())
        raise InputError(
            f"{name}: the point {in_words(places[worst])} is {away[worst]:.3g} mm off {part.name}, allowed are "
            f"{TABLE_TOLERANCE:g} mm: give points on the part, in its coordinates and in mm.",
            distance=float(away[worst]),
        )


def _lengths_over(path: Path | str, name: str) -> tuple[FloatArray, FloatArray]:
    """Return (k, 3) places and the (k,) lengths of that name there [mm].

    Raises:
        InputError: as `read_thicknesses`.
    """
    path = Path(path)
    found = read_columns(path, [("x", "y", "z", name)], what="places", farthest=FARTHEST)
    if not found.lines:
        raise InputError(f"{path.name} has a header but no rows: add one row for each point.")
    places, values = found.numbers[:, :3], found.numbers[:, 3]
    for line, value in zip(found.lines, values.tolist(), strict=True):
        if value < 0.0:
            refuse(path.name, line, f"found {value:g} mm, needed is 0 or more", column=name)
    once = np.unique(places, axis=0, return_index=True)[1]
    if len(once) < len(places):
        line = found.lines[int(np.setdiff1d(np.arange(len(places)), once)[0])]
        refuse(path.name, line, "this point is in the table twice; keep one row for each")
    return places, values


def read_flange_poses(path: Path | str, *, robot: Robot) -> FloatArray:
    """Read the (k, 4, 4) poses of the flange in the base frame from a table of poses or of joint angles.

    Args:
        path: the table.
        robot: the arm whose joint angles may be listed.

    Raises:
        InputError: it cannot be read, or a row or column is not as described; says which.
    """
    # Six or seven numbers without names may be anything.
    found = read_columns(
        path, [POSE_COLUMNS, JOINT_COLUMNS], what="poses", bare=False, farthest=FARTHEST, unit=" of mm or degrees"
    )
    if found.names == JOINT_COLUMNS:
        return Arm(robot, T_flange_tool=np.eye(4)).flange_poses(np.radians(found.numbers))
    return _poses(path, found)


def read_pose(path: Path | str) -> FloatArray:
    """Read the (4, 4) pose of a frame from a table of one row: x,y,z,q1,q2,q3,q4 [mm].

    Raises:
        InputError: it cannot be read, or is not as described; says which.
    """
    found = read_columns(path, [POSE_COLUMNS], what="poses", bare=False, farthest=FARTHEST)
    if len(found.lines) != 1:
        raise InputError(
            f"{Path(path).name} holds {how_many(len(found.lines), 'pose')}, needed is one: a row below "
            f"{','.join(POSE_COLUMNS)}."
        )
    return _poses(path, found)[0]


def _poses(path: Path | str, found: Columns) -> FloatArray:
    """Return the (k, 4, 4) poses of places and quaternions.

    Raises:
        InputError: a quaternion has another length than 1.
    """
    lengths = np.linalg.norm(found.numbers[:, 3:], axis=1)
    for line, length in zip(found.lines, lengths, strict=True):
        if abs(length - 1.0) > UNIT_TOLERANCE:
            refuse(
                Path(path).name, line, f"the quaternion has length {length:.4f}, needed is 1 within "
                f"{UNIT_TOLERANCE:g}; copy all four numbers as the pendant shows them", column="q1 to q4",
            )  # fmt: skip
    return rigid(rotation_of(found.numbers[:, 3:]), found.numbers[:, :3])
