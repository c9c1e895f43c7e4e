"""Reading clouds of points from lines of text: with a header or without, and with any usual separator."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, final

import numpy as np

from geoprint.delimited import Delimited, column_named, encoding_of, is_comment
from geoprint.errors import InputError
from geoprint.model import FloatArray

# Normals in a file have length 1 but for rounding in text.
NORMAL_LENGTH = (0.98, 1.02)
# Scanners' programs mark comments so, tables with #.
_COMMENT = "//"
_NORMALS = (("nx", "ny", "nz"), ("normalx", "normaly", "normalz"), ("normal_x", "normal_y", "normal_z"))
_WHAT = "a cloud of points"


@final
@dataclass(frozen=True, slots=True, eq=False)
class PointCloud:
    """Points of a scan.

    Attributes:
        points: (k, 3) positions in the file's unit.
        normals: (k, 3) unit normals, outward; or None where the file has none.
        skipped: what else the file holds, by kind.
        assumed: what the file leaves open, and what it was taken for.
        unit: of the positions where the file says it, else empty.
    """

    points: FloatArray
    normals: FloatArray | None
    skipped: Mapping[str, int] = field(default_factory=dict[str, int])
    assumed: tuple[str, ...] = ()
    unit: str = ""


class _Columns(NamedTuple):
    """Which columns are the positions and the normals, if any, and the unit that they say."""

    points: tuple[int, ...]
    normals: tuple[int, ...]
    unit: str


def read_point_text(data: bytes, *, name: str) -> PointCloud:
    """Read lines of x y z, with a normal behind where these are six numbers and the last three have length 1.

    Numbers are parted as those of tables (`delimited`). A header names the columns; without one the first three are
    the position. Other columns (colours, intensities) are skipped, so are empty lines and comments (# or //). A line of
    one whole number says how many points follow.

    Raises:
        InputError: the lines do not have at least three numbers each, equally many; the header names no position; or
            fewer or more points follow than a line says.
    """
    lines = list(enumerate(data.decode(encoding_of(data), errors="replace").lstrip("\ufeff").splitlines(), start=1))
    # A comment of either kind may be the header.
    lines = [
        (number, f"#{line.lstrip()[2:]}" if line.lstrip().startswith(_COMMENT) else line) for number, line in lines
    ]
    rows, promised = _counts(lines)
    table = Delimited(name, iter(rows), what=_WHAT)
    columns = _columns(table.header, table.width, name=name)
    kept = [line for number, line in rows if number >= table.header_line and not is_comment(line)]
    values = _values(
        kept if table.header is None or not _names_first(table, rows) else kept[1:], table, rows, name=name
    )
    _check_counts(promised, len(values), name=name)
    normals = unit_normals(values[:, columns.normals]) if columns.normals else None
    used = {*columns.points, *(columns.normals if normals is not None else ())}
    skipped: Counter[str] = Counter(table.unused(used))
    if table.header is None:
        skipped["unused columns"] = table.width - len(used)
    skipped["comments and empty lines"] = sum(is_comment(line) for _, line in rows)
    decimals = table.separator != "," and any("," in line for line in kept[1:2])
    assumed = ("decimal commas",) if decimals else ()
    return PointCloud(values[:, columns.points], normals, skipped, assumed, columns.unit)


def unit_normals(columns: FloatArray) -> FloatArray | None:
    """Return normals normalised, or None where the columns are something else."""
    lengths = np.linalg.norm(columns, axis=1, keepdims=True)
    shortest, longest = NORMAL_LENGTH
    if not ((lengths >= shortest) & (lengths <= longest)).all():
        return None
    return columns / lengths


def _counts(lines: list[tuple[int, str]]) -> tuple[list[tuple[int, str]], list[tuple[int, int]]]:
    """Return the lines without those that count points, and of these how many points stand before, and the number."""
    kept: list[tuple[int, str]] = []
    promised: list[tuple[int, int]] = []
    points = 0
    for number, line in lines:
        if line.strip().isdecimal():
            promised.append((points, int(line)))
        else:
            kept.append((number, line))
            points += not is_comment(line)
    return kept, promised


def _check_counts(promised: list[tuple[int, int]], rows: int, *, name: str) -> None:
    """Refuse a line that says how many points follow where others do."""
    ends = [*(place for place, _ in promised[1:]), rows]
    for (place, count), end in zip(promised, ends, strict=bool(promised)):
        if end - place != count:
            raise InputError(
                f"`{name}` says that {count} points follow, and {end - place} do; it is cut off or damaged, so copy or "
                "export it again.",
                promised=count,
                found=end - place,
            )


def _names_first(table: Delimited, rows: Sequence[tuple[int, str]]) -> bool:
    """Return whether the header is a line of its own, and not a comment."""
    return any(
        number == table.header_line and table.cells(number, line) == list(table.header or ()) for number, line in rows
    )


def _columns(header: Sequence[str] | None, width: int, *, name: str) -> _Columns:
    """Return which columns are used, by the header where there is one."""
    if header is None:
        if width < 3:
            raise InputError(f"`{name}` has {width} numbers a line; points need x y z, so export them so.")
        return _Columns((0, 1, 2), (3, 4, 5) if width == 6 else (), "")
    known = [column_named(each) for each in header]
    names = [each for each, _ in known]
    units = {unit for each, unit in known if each in {"x", "y", "z"}}
    if any(names.count(axis) != 1 for axis in "xyz") or len(units) != 1:
        raise InputError(
            f"`{name}` has the columns {', '.join(header)[:200]}; points need one each of x, y and z in one unit, so "
            "name or export them so."
        )
    normals = next((tuple(map(names.index, each)) for each in _NORMALS if set(each) <= set(names)), ())
    unit = units.pop()
    return _Columns(tuple(map(names.index, "xyz")), normals, "in" if unit == "inch" else unit)


def _values(texts: list[str], table: Delimited, rows: Sequence[tuple[int, str]], *, name: str) -> FloatArray:
    """Return the numbers of the lines, (k, width)."""
    if table.separator != ",":
        texts = [text.replace(",", ".") for text in texts]
    try:
        delimiter = None if table.separator == " " else table.separator
        values = np.loadtxt(texts, dtype=np.float64, ndmin=2, comments=None, delimiter=delimiter)
    except ValueError:
        values = np.empty((0, 0))
    if values.shape == (len(texts), table.width) and texts:
        return values
    # The reader of tables takes empty cells and names the line that it cannot take.
    found = list(_slowly(table, rows))
    if not found:
        raise InputError(f"`{name}` holds no lines of points; export them as x y z.")
    return np.array(found, dtype=np.float64)


def _slowly(table: Delimited, rows: Sequence[tuple[int, str]]) -> Iterator[list[float]]:
    """Yield the numbers of each line of a table."""
    again = Delimited(table.name, iter(rows), what=_WHAT)
    for number, cells, _ in again.rows(range(again.width)):
        yield [again.number(number, str(place + 1), cell, farthest=np.inf, unit="") for place, cell in enumerate(cells)]
