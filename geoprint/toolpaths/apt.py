"""Paths as APT or a cutter location source (CLS): GOTO, RAPID, FEDRAT, UNITS; what else stands there is stepped over.

What RAPID leads to is travel, everything else deposits. A tool axis behind the coordinates is not needed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from geoprint.toolpaths.path_file import PathFile, Point, Recorder, lines_of, number_of, refuse

TITLE = "APT"
_LOOKS = re.compile(
    r"^\s*(?:\d+\s+)?(?:GOTO|FROM|FEDRAT|UNITS|TOOL PATH|LOADTL|PARTNO|MULTAX)\s*(?:/|$)", re.IGNORECASE | re.MULTILINE
)
_STATEMENT = re.compile(r"\s*([A-Za-z][A-Za-z ]*?)\s*(?:/\s*(.*))?$")
_UNITS = {"MM": 1.0, "MILLIMETER": 1.0, "MILLIMETERS": 1.0, "INCH": 25.4, "INCHES": 25.4, "IN": 25.4, "CM": 10.0}
_CURVED = frozenset({"CIRCLE", "ARCSLP", "MOVARC", "NURBS"})
_RELATIVE = frozenset({"GODLTA", "GOBACK", "GOFWD", "GOLFT", "GORGT", "GOUP", "GODOWN"})
# Lines that one statement may take up.
_MOST_CONTINUED = 100


def is_apt(head: str) -> bool:
    """Return whether a text holds statements of APT."""
    return _LOOKS.search(head) is not None


def read_apt(path: Path, *, deposit: str | None) -> PathFile:
    """Read the runs of APT.

    Args:
        path: of the file.
        deposit: not used: RAPID tells.

    Raises:
        InputError: it cannot be read, or moves as is not known here; names its line.
    """
    del deposit
    recorder, scale = Recorder(path.name), 1.0
    place: Point | None = None
    travels = False
    for number, text in _statements(path):
        match = _STATEMENT.match(text)
        word, said = (match[1].upper(), match[2]) if match else ("", None)
        if word in _CURVED | _RELATIVE:
            refuse(path.name, number, f"{word} is not read; export straight moves to points (GOTO)")
        elif word == "UNITS":
            unit = (said or "").strip().upper()
            if unit not in _UNITS:
                refuse(path.name, number, f"UNITS/{unit[:20]} is no unit; MM, CM and INCHES are read")
            scale = _UNITS[unit]
        elif word == "RAPID":
            travels = True
        elif word in {"GOTO", "FROM"}:
            there = _point(path.name, number, said, scale=scale)
            if word == "GOTO" and place is not None and not travels:
                recorder.line(number, place, there)
            else:
                recorder.count(number)
            place, travels = there, False
    return recorder.file(title=TITLE, deposit="all but what RAPID leads to")


def _statements(path: Path) -> Iterator[tuple[int, str]]:
    """Yield number and text of each statement: `$$` begins a comment, a `$` at the end goes on in the next line."""
    kept, first = list[str](), 0
    for number, line in lines_of(path):
        text = line.partition("$$")[0].rstrip()
        first = first if kept else number
        if len(kept) > _MOST_CONTINUED:
            refuse(path.name, first, f"a statement goes on over more than {_MOST_CONTINUED} lines")
        if text.endswith("$"):
            kept.append(text[:-1])
            continue
        whole = "".join([*kept, text])
        kept = []
        if _is_read(whole):
            yield first, whole
    if kept:
        refuse(path.name, first, "the file ends within a statement that goes on ($)")


def _is_read(text: str) -> bool:
    word = text.partition("/")[0].strip().upper()
    return word in {"GOTO", "FROM", "RAPID", "UNITS"} | _CURVED | _RELATIVE


def _point(name: str, number: int, said: str | None, *, scale: float) -> Point:
    cells = [cell.strip() for cell in (said or "").split(",")]
    if len(cells) not in {3, 6}:
        refuse(name, number, f"a point has 3 numbers, or 6 with the tool's axis, found {len(cells)}")
    for cell in cells[3:]:
        number_of(name, number, "the tool's axis", cell)
    x, y, z = (number_of(name, number, axis, cell, scale=scale) for axis, cell in zip("xyz", cells, strict=False))
    return x, y, z
