"""Paths as a table: a row a point, its columns named in the first row: x, y, z, and if there are several runs, run.

Columns stand in any order and among others, parted by commas, semicolons, tabs or blanks. A column `deposit` says with
0 which rows are travel, as in the poses.csv of geoprint. Lines that begin with # are comments.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from geoprint.errors import InputError
from geoprint.toolpaths.path_file import PathFile, Recorder, lines_of, number_of, refuse

TITLE = "table"
_COLUMN = re.compile(r"(?:points[:_])?([xyz012])(?:[ _]*[\[(]?mm[\])]?)?")
_OTHER_UNIT = re.compile(r"[xyz][ _]*[\[(/](?:cm|m|in|um|inch)[\])]?")
_FLAGS = {"0": False, "1": True, "0.0": False, "1.0": True, "false": False, "true": True}
_AXES = ("x", "y", "z")
# As many letters of a line as an error shows.
_SHOWN = 60


def is_table(head: str) -> bool:
    """Return whether a text begins with a row that names the columns x, y and z."""
    first = next((line for line in head.splitlines() if line.strip() and not _is_comment(line)), "")
    return set(_AXES) <= set(_columns(_cells(first.lstrip("\ufeff"), _separator(first))))


def read_table(path: Path, *, deposit: str | None) -> PathFile:
    """Read the runs of a table.

    Args:
        path: of the file.
        deposit: not used: the table says itself what deposits.

    Raises:
        InputError: it cannot be read, or a row is not as the header says; names its line.
    """
    del deposit
    recorder, columns, separator, width = Recorder(path.name), dict[str, int](), ",", 0
    last: str | None = None
    for number, line in lines_of(path):
        if not line.strip() or _is_comment(line):
            continue
        if not columns:
            separator = _separator(line)
            cells = _cells(line, separator)
            columns, width = _header(path.name, number, cells), len(cells)
            continue
        cells = _cells(line, separator)
        if len(cells) != width:
            refuse(path.name, number, f"found {len(cells)} cells, but the header names {width} columns")
        x, y, z = (number_of(path.name, number, axis, _dotted(cells[columns[axis]], separator)) for axis in _AXES)
        run = cells[columns["run"]] if "run" in columns else ""
        if not run and "run" in columns:
            refuse(path.name, number, "the cell of column run is empty, needed is a number or a name")
        if "deposit" in columns and not _flag(path.name, number, cells[columns["deposit"]]):
            recorder.count(number)
            last = None
        elif run == last:
            recorder.point(number, (x, y, z))
        else:
            recorder.begin(number, (x, y, z))
            last = run
    if not columns:
        raise InputError(f"{path.name} is empty; its first row must name the columns, such as x,y,z,run.")
    told = "its column deposit" if "deposit" in columns else "nothing: all of it deposits"
    return recorder.file(title=TITLE, deposit=told)


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith("#") or line.lower().startswith("sep=")


def _separator(line: str) -> str | None:
    """Return what parts the columns of a header; None for blanks."""
    return next((sign for sign in "\t;," if sign in line), None)


def _cells(line: str, separator: str | None) -> list[str]:
    return [cell.strip().strip('"') for cell in line.split(separator)]


def _columns(cells: list[str]) -> dict[str, int]:
    """Return the place of each column that is known by its name."""
    found: dict[str, int] = {}
    for place, cell in enumerate(cells):
        match = _COLUMN.fullmatch(cell.lower())
        name = match[1].translate(str.maketrans("012", "xyz")) if match else cell.lower()
        if name in {*_AXES, "run", "deposit"}:
            found.setdefault(name, place)
    return found


def _header(name: str, number: int, cells: list[str]) -> Mapping[str, int]:
    other = next((cell for cell in cells if _OTHER_UNIT.fullmatch(cell.lower())), None)
    if other is not None:
        refuse(name, number, f"column {other!r} is in another unit, paths are read in mm")
    found = _columns(cells)
    if not set(_AXES) <= set(found):
        shown = ", ".join(cells)[:_SHOWN]
        refuse(name, number, f"the first row must name the columns x, y and z, found {shown!r}")
    return found


def _dotted(cell: str, separator: str | None) -> str:
    """Return a number with a decimal point, which may be a comma where commas part nothing."""
    return cell.replace(",", ".") if separator != "," and "." not in cell else cell


def _flag(name: str, number: int, cell: str) -> bool:
    if cell.lower() not in _FLAGS:
        refuse(name, number, f"column deposit is {cell[:_SHOWN]!r}, needed is 0 or 1")
    return _FLAGS[cell.lower()]
