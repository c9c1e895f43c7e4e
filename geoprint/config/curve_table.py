"""The points of a drawn curve, out of whatever a spreadsheet or a mesh program writes as a table.

A header names the columns x, y and z, in any order and among others; without one there are three columns. They are
parted by commas, semicolons, tabs or blanks, and decimals begin with a point or a comma, but not by both in one file.
Lines that begin with # are comments. What cannot be told for certain is refused with its line.
"""

from __future__ import annotations

import codecs
import csv
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

from geoprint.config.strict import check_plain
from geoprint.errors import InputError

CURVE_COLUMNS = ("x", "y", "z")
# A larger coordinate [mm] is a typing error or another unit.
FARTHEST = 1_000_000.0
# Nobody draws more points, and a longer file is another one.
MOST_ROWS = 10_000
PARTED_BY = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}
NUMBER = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?")
# Blanks with a number on either side part columns.
BETWEEN_NUMBERS = re.compile(r"\d +[-+.\d]")
# What a spreadsheet writes for a formula that failed; it begins as a comment does.
FORMULA_ERROR = re.compile(r"#(N/A|[A-Z0/]+[!?])")
# Names of columns: `X [mm]`, `y_mm`, `Points:2` of ParaView.
COLUMN = re.compile(r"(?:points[:_])?([xyz012])(?:[ _]*[\[(/]?(mm|cm|m|in|um|inch)[\])]?)?")

# A row's line in the file and its cells.
_Row: TypeAlias = tuple[int, list[str]]


def read_curve(path: Path | str) -> list[list[float]]:
    """Read the points of a curve [mm], in order.

    Raises:
        InputError: it cannot be read, or its header, separators, decimals or one of its rows is wrong; says which.
    """
    path = Path(path)
    separator, rows = _rows(path)
    number, first = rows[0]
    headed = _is_header(first)
    places = _places(path, number, first) if headed else [0, 1, 2]
    points: list[_Row] = []
    for line, cells in rows[headed:]:
        if len(cells) > len(first) or len(cells) <= max(places) or (not headed and len(cells) != 3):
            wanted = f"the header names {len(first)} columns" if headed else "without a header there are three: x y z"
            also = "; decimal commas need semicolons or tabs between columns" if separator == "," else ""
            raise InputError(
                f"{path.name}, line {line}: found {len(cells)} cells parted by {PARTED_BY[separator]}, but "
                f"{wanted}{also}.",
                row=line,
            )
        points.append((line, [cells[place] for place in places]))
    _check_decimals(path, points, separator=separator)
    return [
        [_coordinate(path, line, *pair) for pair in zip(CURVE_COLUMNS, cells, strict=True)] for line, cells in points
    ]


def _rows(path: Path) -> tuple[str, list[_Row]]:
    """Return what parts the columns, and the rows that are neither empty nor comments; at least one."""
    try:
        check_plain(path)
        data = path.read_bytes()
    except (OSError, ValueError) as error:
        raise InputError(f"`{path}` cannot be read as a table of points ({error}); give a CSV file.") from error
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    # A name may be in any character set, numbers are the same in all.
    text = data.decode("utf-16" if wide else "utf-8", errors="replace").replace("\N{MINUS SIGN}", "-")
    lines = [(number, line.strip(" ")) for number, line in enumerate(text.lstrip("\ufeff").splitlines(), start=1)]
    kept = [(number, line) for number, line in lines if not _is_comment(line)]
    separator = _separator([line for _, line in kept])
    rows = [(number, _cells(path, number, line, separator)) for number, line in kept]
    rows = [(number, cells) for number, cells in rows if cells]
    if not rows:
        raise InputError(f"{path.name} holds no points; write a line x,y,z (mm) for each point of the curve.")
    if len(rows) > MOST_ROWS:
        raise InputError(f"{path.name} has {len(rows)} rows, at most {MOST_ROWS} are read; leave out points.")
    return separator, rows


def _is_comment(line: str) -> bool:
    """Return whether a line says nothing of points; `sep=;` is for the spreadsheet."""
    said = line.startswith("#") and FORMULA_ERROR.match(line) is None
    return said or not line.strip() or line.lower().startswith("sep=")


def _separator(lines: Sequence[str]) -> str:
    """Return what parts the columns: the first of tab, semicolon, blanks between numbers, and comma that is there."""
    for separator in "\t;":
        if any(separator in line for line in lines):
            return separator
    commas = any("," in line for line in lines[1:] or lines)
    return " " if any(BETWEEN_NUMBERS.search(line) for line in lines) or not commas else ","


def _cells(path: Path, number: int, line: str, separator: str) -> list[str]:
    """Return the cells of a line without the empty ones at its end."""
    try:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True))
    except csv.Error as error:
        raise InputError(
            f"{path.name}, line {number} cannot be read ({error}); check its quotes.", row=number
        ) from error
    cells = [cell.strip() for cell in cells]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _is_header(cells: Sequence[str]) -> bool:
    return not any(NUMBER.fullmatch(cell) for cell in cells)


def _places(path: Path, number: int, names: Sequence[str]) -> list[int]:
    """Return which columns hold x, y and z."""
    found: dict[str, int] = {}
    for place, name in enumerate(names):
        match = COLUMN.fullmatch(name.lower())
        if match is None:
            continue
        if match[2] not in {None, "mm"}:
            raise InputError(f"{path.name}, line {number}: column {name!r} is in {match[2]}, a curve is read in mm.")
        found.setdefault(match[1].translate(str.maketrans("012", "xyz")), place)
    if set(found) != set(CURVE_COLUMNS):
        raise InputError(
            f"{path.name}, line {number}: the header must name the columns x, y and z, found "
            f"{', '.join(names)[:60]!r}; name them, or leave the header out of a table with three columns.",
            row=number,
        )
    return [found[column] for column in CURVE_COLUMNS]


def _check_decimals(path: Path, rows: Sequence[_Row], *, separator: str) -> None:
    """Refuse a table of which nobody can say what a point or a comma in a number means."""
    points, commas = ([line for line, cells in rows if any(sign in cell for cell in cells)] for sign in ".,")
    if points and commas:
        raise InputError(
            f"{path.name} has decimal points in line {points[0]} and decimal commas in line {commas[0]}, so that 1.234 "
            "may be a thousand; export it with one of them and without marks between thousands."
        )
    behind = [cell.partition(",")[2] for _, cells in rows for cell in cells if "," in cell]
    if separator == "," and behind and all(len(digits) == 3 for digits in behind):
        raise InputError(
            f"{path.name}, line {commas[0]}: a comma before three digits may mark thousands or decimals; export "
            "it with decimal points and without marks between thousands."
        )


def _coordinate(path: Path, number: int, column: str, cell: str) -> float:
    """Return the number in a cell."""
    value = float(cell.replace(",", ".")) if NUMBER.fullmatch(cell) else math.nan
    if not abs(value) <= FARTHEST:
        raise InputError(
            f"{path.name}, line {number}, column {column}: found {cell[:60]!r}, needed is a number of mm between "
            f"-{FARTHEST:,.0f} and {FARTHEST:,.0f}, such as -12.5 or -12,5.",
            row=number,
            column=column,
        )
    return value
