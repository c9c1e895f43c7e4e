"""Tables that a person writes: touched points by name, poses in which the tip touched one point.

CSV in UTF-8 with commas; the first row names the columns, lines that start with # are comments:

    x,y,z,thickness             places on the part and how thick what is printed over it shall be there: mm
    x,y,z,width                 places on the part and how wide fibres shall be there: mm
    name,x,y,z                  points: mm; a name may come again where a point was touched more than once
    x,y,z,q1,q2,q3,q4           poses of the flange in the base frame: mm and a unit quaternion, its scalar first, as
                                the pendant shows them for tool0 in the base's coordinates; or
    j1,j2,j3,j4,j5,j6           the joint angles in degrees

A pose of one row, in the second of these forms, is also how a scan is told to stand in the part's coordinates.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import FloatArray, Robot
from geoprint.model.arrays import freeze_arrays
from geoprint.motion.arm import Arm
from geoprint.transforms import rigid, rotation_of

POINT_COLUMNS = ("name", "x", "y", "z")
POSE_COLUMNS = ("x", "y", "z", "q1", "q2", "q3", "q4")
THICKNESS, WIDTH = "thickness", "width"
JOINT_COLUMNS = ("j1", "j2", "j3", "j4", "j5", "j6")
# A quaternion that was read off a pendant with four decimals has length 1 within this.
UNIT_TOLERANCE = 1e-3
# Nobody touches or picks more points by hand, and a longer file is another one.
MOST_ROWS = 10_000
MOST_BYTES = 1_000_000
# A larger coordinate [mm] is a typing error or another unit: no arm of this kind reaches two metres.
FARTHEST = 10_000.0


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


def read_points(path: Path | str) -> NamedPoints:
    """Read a table of named points.

    Raises:
        InputError: it cannot be read, or a row or column is not as described; says which.
    """
    rows = _rows_of(path := Path(path))
    _require_columns(path, rows[0][1], [POINT_COLUMNS])
    names = tuple(cells[0] for _, cells in rows[1:])
    for (number, _), name in zip(rows[1:], names, strict=True):
        if not name or not name.isprintable():
            raise InputError(f"{path.name}, row {number}, column name: found {name!r}, needed is a printable name.")
    numbers = [_numbers_of(path, number, cells[1:], POINT_COLUMNS[1:]) for number, cells in rows[1:]]
    return NamedPoints(path.name, names, np.array(numbers).reshape(-1, 3))


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


def _lengths_over(path: Path | str, name: str) -> tuple[FloatArray, FloatArray]:
    """Return (k, 3) places and the (k,) lengths of that name there [mm].

    Raises:
        InputError: as `read_thicknesses`.
    """
    rows = _rows_of(path := Path(path))
    columns = _require_columns(path, rows[0][1], [("x", "y", "z", name)])
    if not rows[1:]:
        raise InputError(f"{path.name} names columns but holds no place: add a row for each.")
    values = np.array([_numbers_of(path, number, cells, columns) for number, cells in rows[1:]])
    for (number, _), value in zip(rows[1:], values[:, 3].tolist(), strict=True):
        if value < 0.0:
            raise InputError(
                f"{path.name}, row {number}, column {name}: found {value:g} mm, needed is 0 or more.", row=number
            )
    repeated = np.unique(values[:, :3], axis=0, return_index=True)[1]
    if len(repeated) < len(values):
        row = rows[1 + int(np.setdiff1d(np.arange(len(values)), repeated)[0])][0]
        raise InputError(f"{path.name}, row {row}: this place is in the table twice; keep one row for each.", row=row)
    return values[:, :3], values[:, 3]


def read_flange_poses(path: Path | str, *, robot: Robot) -> FloatArray:
    """Read the (k, 4, 4) poses of the flange in the base frame from a table of poses or of joint angles.

    Args:
        path: the table.
        robot: the arm whose joint angles may be listed.

    Raises:
        InputError: it cannot be read, or a row or column is not as described; says which.
    """
    rows = _rows_of(path := Path(path))
    columns = _require_columns(path, rows[0][1], [POSE_COLUMNS, JOINT_COLUMNS])
    values = np.array([_numbers_of(path, number, cells, columns) for number, cells in rows[1:]]).reshape(
        -1, len(columns)
    )
    if columns == JOINT_COLUMNS:
        return Arm(robot, T_flange_tool=np.eye(4)).flange_poses(np.radians(values))
    return _poses(path, [number for number, _ in rows[1:]], values)


def read_pose(path: Path | str) -> FloatArray:
    """Read the (4, 4) pose of a frame from a table of one row: x,y,z,q1,q2,q3,q4 [mm].

    Raises:
        InputError: it cannot be read, or is not as described; says which.
    """
    rows = _rows_of(path := Path(path))
    _require_columns(path, rows[0][1], [POSE_COLUMNS])
    if len(rows) != 2:
        raise InputError(
            f"{path.name} holds {len(rows) - 1} poses, needed is one: a row below {','.join(POSE_COLUMNS)}."
        )
    number, cells = rows[1]
    return _poses(path, [number], np.array([_numbers_of(path, number, cells, POSE_COLUMNS)]))[0]


def _poses(path: Path, numbers: Sequence[int], values: FloatArray) -> FloatArray:
    """Return the (k, 4, 4) poses of (k, 7) places and quaternions.

    Raises:
        InputError: a quaternion has another length than 1.
    """
    lengths = np.linalg.norm(values[:, 3:], axis=1)
    for number, length in zip(numbers, lengths, strict=True):
        if abs(length - 1.0) > UNIT_TOLERANCE:
            raise InputError(
                f"{path.name}, row {number}, columns q1 to q4: the quaternion has length {length:.4f}, needed is 1 "
                f"within {UNIT_TOLERANCE:g}; copy all four numbers as the pendant shows them.",
                row=number,
            )
    return rigid(rotation_of(values[:, 3:]), values[:, :3])


def _rows_of(path: Path) -> list[tuple[int, list[str]]]:
    """Return the rows that are neither empty nor comments, with their line numbers; at least the header's.

    Raises:
        InputError: it cannot be read as CSV, is empty or too long.
    """
    try:
        # Reading a pipe or a device might never end.
        if path.exists() and not path.is_file():
            raise InputError(f"`{path}` is no plain file; give a table in CSV.")
        if path.stat().st_size > MOST_BYTES:
            raise InputError(f"{path.name} is larger than a megabyte: that is no table of points that a person chose.")
        text = path.read_text(encoding="utf-8-sig")
        rows = [(number, line) for number, line in enumerate(text.splitlines(), start=1)]
        kept = [(number, line) for number, line in rows if line.strip() and not line.lstrip().startswith("#")]
        cells = [(number, [cell.strip() for cell in next(csv.reader([line], strict=True))]) for number, line in kept]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"`{path}` cannot be read as a table ({error}); it must be CSV in UTF-8.") from error
    if not cells:
        raise InputError(f"{path.name} is empty; its first row must name the columns, such as name,x,y,z.")
    if len(cells) > MOST_ROWS:
        raise InputError(f"{path.name} has {len(cells)} rows, at most {MOST_ROWS} are read.")
    return cells


def _require_columns(path: Path, found: Sequence[str], allowed: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """Return the columns that a first row names.

    Raises:
        InputError: they are none of those allowed.
    """
    columns = tuple(cell.lower() for cell in found)
    if columns not in allowed:
        wanted = " or ".join(",".join(names) for names in allowed)
        raise InputError(f"{path.name}: the first row must name the columns {wanted}, found {','.join(found)[:60]!r}.")
    return columns


def _numbers_of(path: Path, number: int, cells: Sequence[str], columns: Sequence[str]) -> list[float]:
    """Return the numbers of one row.

    Raises:
        InputError: there are more or fewer cells than columns, or one is no finite number of a sensible size.
    """
    if len(cells) != len(columns):
        raise InputError(
            f"{path.name}, row {number}: found {len(cells)} numbers, needed are {len(columns)} ({', '.join(columns)}).",
            row=number,
        )
    values: list[float] = []
    for column, cell in zip(columns, cells, strict=True):
        try:
            value = float(cell)
        except ValueError:
            value = np.nan
        if not abs(value) <= FARTHEST:
            raise InputError(
                f"{path.name}, row {number}, column {column}: found {cell[:60]!r}, needed is a number between "
                f"-{FARTHEST:g} and {FARTHEST:g} (mm or degrees).",
                row=number,
                column=column,
            )
        values.append(value)
    return values
