"""Measured flow: a small table of lines that were weighed, or whose width and height were measured.

A table (`geoprint.delimited`) with one of two headings, one row a line that was deposited:

    pressure_kpa,duration_s,mass_g                 valve open for so long, weighed
    pressure_kpa,speed_mm_s,width_mm,height_mm     a straight line, its section taken as a circular segment

Every value is a number above 0.
"""

from __future__ import annotations

from pathlib import Path
from typing import final

import numpy as np

from geoprint.delimited import MOST_ROWS, read_columns, refuse
from geoprint.deposition.bead import segment_area
from geoprint.errors import InputError
from geoprint.model import PASCAL_PER_KPA, FloatArray, freeze_arrays, frozen

WEIGHED = ("pressure_kpa", "duration_s", "mass_g")
GAUGED = ("pressure_kpa", "speed_mm_s", "width_mm", "height_mm")
# Nobody measures more, in any of these units.
LARGEST = 1e12
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
    found = read_columns(path, [WEIGHED, GAUGED], what="lines", bare=False, farthest=LARGEST, unit="")
    name = Path(path).name
    if not found.lines:
        raise InputError(f"{name} must have 1 to {MOST_ROWS} rows below its heading.")
    for line, row in zip(found.lines, found.numbers.tolist(), strict=True):
        for column, value in zip(found.names, row, strict=True):
            if not value > 0.0:
                refuse(name, line, f"found {value:g}, needed is a number above 0", column=column)
    columns = dict(zip(found.names, found.numbers.T, strict=True))
    return MeasuredFlow(columns["pressure_kpa"] * PASCAL_PER_KPA, _flows(columns, density=density))


def _flows(columns: dict[str, FloatArray], *, density: float) -> FloatArray:
    if "mass_g" not in columns:
        sections = [
            segment_area(width, height=height)
            for width, height in zip(columns["width_mm"].tolist(), columns["height_mm"].tolist(), strict=True)
        ]
        return columns["speed_mm_s"] * np.array(sections)
    # g/cm3 is mg/mm3.
    return columns["mass_g"] * MILLIGRAMS_PER_GRAM / density / columns["duration_s"]
