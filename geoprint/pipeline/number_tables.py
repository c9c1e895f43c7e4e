"""Tables of numbers that a person writes: CSV in UTF-8 with commas, a first row that names the columns, # comments."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from geoprint.errors import InputError

# Nobody touches or picks more points by hand, and a longer file is another one.
MOST_ROWS = 10_000
MOST_BYTES = 1_000_000
# A larger coordinate [mm] is a typing error or another unit: no arm of this kind reaches two metres.
FARTHEST = 10_000.0


def rows_of(path: Path) -> list[tuple[int, list[str]]]:
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


def require_columns(path: Path, found: Sequence[str], allowed: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """Return the columns that a first row names.

    Raises:
        InputError: they are none of those allowed.
    """
    columns = tuple(cell.lower() for cell in found)
    if columns not in allowed:
        wanted = " or ".join(",".join(names) for names in allowed)
        raise InputError(f"{path.name}: the first row must name the columns {wanted}, found {','.join(found)[:60]!r}.")
    return columns


def numbers_of(path: Path, number: int, cells: Sequence[str], columns: Sequence[str]) -> list[float]:
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
