"""The points of a drawn curve, out of whatever a spreadsheet or a mesh program writes as a table."""

from __future__ import annotations

from pathlib import Path

from geoprint.delimited import read_columns

CURVE_COLUMNS = ("x", "y", "z")


def read_curve(path: Path | str) -> list[list[float]]:
    """Read the points of a curve [mm], in order.

    Raises:
        InputError: it cannot be read, or its header, separators, decimals or one of its rows is wrong; says which.
    """
    return read_columns(path, [CURVE_COLUMNS], what="points").numbers.tolist()
