"""Measured flow: a small table of lines that were weighed, or whose width and height were measured.

A CSV file with one of two headings, one row a line that was laid:

    pressure_kpa,duration_s,mass_g                 valve open for so long, weighed
    pressure_kpa,speed_mm_s,width_mm,height_mm     a straight line, its section taken as a circular segment

Every value is a number above 0. Rows that begin with # are comments.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import final

import numpy as np

from geoprint.deposition.bead import segment_area
from geoprint.errors import InputError
from geoprint.model import PASCAL_PER_KPA, FloatArray, freeze_arrays, frozen

WEIGHED = ("pressure_kpa", "duration_s", "mass_g")
GAUGED = ("pressure_kpa", "speed_mm_s", "width_mm", "height_mm")
# More rows than a person measures; a larger file is another one.
MOST_ROWS = 10_000
MILLIGRAMS_PER_GRAM = 1000.0


@final
@frozen
class MeasuredFlow:
    """Flow at several pressures.

    Attributes:
        pressures: (k,) [Pa].
        flows: (k,) [mm3/s].
    """

    pressures: FloatArray
    flows: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, pressures="float: k", flows="float: k")


def read_measured_flow(path: Path | str, *, density: float) -> MeasuredFlow:
    """Read a table of measured lines.

    Args:
        path: the CSV file.
        density: of the material [g/cm3].

    Raises:
        InputError: the file cannot be read, or has another heading or a value that is not a number above 0; the
            sentence names row and column.
    """
    path = Path(path)
    try:
        # Reading a pipe or a device might never end.
        if path.exists() and not path.is_file():
            raise InputError(f"`{path}` is no plain file; give a CSV file.")
        with path.open(newline="", encoding="utf-8-sig") as file:
            counted = ((number, row) for number, row in enumerate(csv.reader(file), 1) if _counts(row))
            rows = list(islice(counted, MOST_ROWS + 2))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"`{path}` cannot be read as a table ({error}); give a CSV file.") from error
    heading = tuple(cell.strip() for cell in rows[0][1]) if rows else ()
    if heading not in {WEIGHED, GAUGED}:
        raise InputError(
            f"{path.name}: the first row must be `{','.join(WEIGHED)}` or `{','.join(GAUGED)}`, found "
            f"`{','.join(heading)[:100]}`."
        )
    if not 2 <= len(rows) <= MOST_ROWS + 1:
        raise InputError(f"{path.name} must have 1 to {MOST_ROWS} rows below its heading.")
    columns = dict(zip(heading, _values(rows[1:], heading, name=path.name).T, strict=True))
    return MeasuredFlow(columns["pressure_kpa"] * PASCAL_PER_KPA, _flows(columns, density=density))


def _counts(row: Sequence[str]) -> bool:
    return any(cell.strip() for cell in row) and not row[0].lstrip().startswith("#")


def _values(rows: Sequence[tuple[int, list[str]]], heading: Sequence[str], *, name: str) -> FloatArray:
    """Return (k, columns) numbers."""
    result = np.empty((len(rows), len(heading)))
    for place, (number, row) in enumerate(rows):
        if len(row) != len(heading):
            raise InputError(f"{name}, row {number}: {len(row)} values, but the heading names {len(heading)} columns.")
        for column, (title, cell) in enumerate(zip(heading, row, strict=True)):
            result[place, column] = _number(cell, where=f"{name}, row {number}, column {title}")
    return result


def _number(cell: str, *, where: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not (np.isfinite(value) and value > 0.0):
        raise InputError(f"{where}: `{cell.strip()[:40]}` is not a number above 0.")
    return value


def _flows(columns: dict[str, FloatArray], *, density: float) -> FloatArray:
    if "mass_g" not in columns:
        sections = [
            segment_area(width, height=height)
            for width, height in zip(columns["width_mm"].tolist(), columns["height_mm"].tolist(), strict=True)
        ]
        return columns["speed_mm_s"] * np.array(sections)
    # g/cm3 is mg/mm3.
    return columns["mass_g"] * MILLIGRAMS_PER_GRAM / density / columns["duration_s"]
