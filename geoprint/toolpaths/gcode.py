"""Paths as G-code: straight moves (G0, G1) in absolute or relative coordinates, mm or inches.

Deposited is what the extruder does: where E grows along a move. Where no E is written, it is what M-codes switch on and
off (M3 or M4 and M5, M101 and M103, or those that are named); and where there are none, G1 deposits and G0 travels.
Whatever else a slicer writes is stepped over.
"""

from __future__ import annotations

import math
import re
from array import array
from pathlib import Path
from typing import final

from geoprint.errors import UsageError
from geoprint.toolpaths.path_file import PathFile, Point, Recorder, lines_of, number_of, refuse

TITLE = "G-code"
# Codes that are read; other lines change nothing that counts here.
_MOVES = frozenset({"G0", "G1"})
_ARCS = frozenset({"G2", "G3", "G5"})
_SETTINGS = frozenset({"G20", "G21", "G28", "G90", "G91", "G92", "M82", "M83"})
_SWITCHES = {"M3": True, "M4": True, "M5": False, "M101": True, "M103": False}
_MM_PER_INCH = 25.4
_COMMENT = re.compile(r"\([^)]*\)|;.*")
_WORD = re.compile(r"\s*([A-Za-z])\s*([-+]?(?:\d+\.?\d*|\.\d+)?)")
_FIRST = re.compile(r"(?:N\s*\d+\s*)?([A-Za-z])\s*0*(\d*)(?!\.?\d)", re.IGNORECASE)
# Coordinates alone go on as the last move did.
_MODAL = re.compile(r"(?:N\s*\d+\s*)?[XYZ]\s*[-+.\d]", re.IGNORECASE)
_LOOKS = re.compile(r"^\s*(?:N\d+\s*)?G0*(?:[0-3]|2[018]|9[0-2])(?=\s|$|[XYZEF;(])", re.IGNORECASE | re.MULTILINE)
_NAMED = re.compile(r"(M\d+)/(M\d+)", re.IGNORECASE)
_BITS = {"E": 1, "M": 2, "G1": 4}


def is_gcode(head: str) -> bool:
    """Return whether a text holds a line of G-code that moves or sets coordinates."""
    return _LOOKS.search(head) is not None


def read_gcode(path: Path, *, deposit: str | None) -> PathFile:
    """Read the deposited runs of G-code.

    Args:
        path: of the file.
        deposit: M-codes that switch on and off, as M3/M5; None to tell by what the file holds.

    Raises:
        UsageError: what deposits is not named so.
        InputError: it cannot be read, or moves as is not known here; names its line.
    """
    head = _Head(path.name, deposit)
    for number, line in lines_of(path):
        text = _COMMENT.sub("", line).partition("*")[0].strip()
        if text and text != "%":
            head.execute(number, text)
    return head.file(named=deposit is not None)


@final
class _Head:
    """Where the head of a printer is, and the moves that it has made; lives while a file is read."""

    def __init__(self, name: str, deposit: str | None) -> None:
        self._name = name
        self._recorder = Recorder(name)
        self._switches = dict(_SWITCHES) if deposit is None else _named(deposit)
        self._scale = 1.0
        self._relative = self._relative_e = self._on = False
        self._place: list[float | None] = [None, None, None]
        # What the file's coordinates lie off by, since a G92.
        self._shift = [0.0, 0.0, 0.0]
        self._e = 0.0
        self._modal = ""
        # Moves: line, start and end; and whether E grows, a switch is on, and it is a G1.
        self._moves, self._lines, self._flags = array("d"), array("q"), array("B")

    def execute(self, number: int, text: str) -> None:
        """Execute a line."""
        first = _FIRST.match(text)
        code = f"{first[1].upper()}{first[2] or '0'}" if first else ""
        if self._modal and _MODAL.match(text):
            code = self._modal
        elif code in _ARCS:
            refuse(self._name, number, f"{code} is an arc, and only straight moves are read; export lines (G1)")
        elif code in self._switches:
            self._on = self._switches[code]
            return
        elif code not in _MOVES | _SETTINGS:
            return
        words = self._words(number, text)
        if code in _MOVES:
            self._modal = code
            self._move(number, code, words)
        else:
            self._set(code, words)

    def _words(self, number: int, text: str) -> dict[str, float | None]:
        """Return the number behind each letter of a line, in mm where it is a length."""
        found: dict[str, float | None] = {}
        place = 0
        while place < len(text):
            match = _WORD.match(text, place)
            if match is None:
                if not text[place:].strip():
                    break
                refuse(self._name, number, f"{text[place:].strip()[:40]!r} is no word of G-code")
            letter, place = match[1].upper(), match.end()
            if letter in "XYZE" and letter in found:
                refuse(self._name, number, f"{letter} stands in it twice")
            found[letter] = None
            if match[2] not in {"", "+", "-"}:
                scale = self._scale if letter in "XYZE" else 1.0
                found[letter] = number_of(self._name, number, letter, match[2], scale=scale)
        return found

    def _set(self, code: str, words: dict[str, float | None]) -> None:
        match code:
            case "G20" | "G21":
                self._scale = _MM_PER_INCH if code == "G20" else 1.0
            case "G90" | "G91":
                self._relative = self._relative_e = code == "G91"
            case "M82" | "M83":
                self._relative_e = code == "M83"
            case "G28":
                for axis in [axis for axis in "XYZ" if axis in words] or "XYZ":
                    self._place["XYZ".index(axis)] = 0.0
            case _:
                self._rename(words)

    def _rename(self, words: dict[str, float | None]) -> None:
        """Give the place where the head is other coordinates (G92)."""
        self._e = words.get("E") or 0.0
        for i, axis in enumerate("XYZ"):
            if axis in words:
                value = words[axis] or 0.0
                here = self._place[i]
                self._shift[i] = 0.0 if here is None else value - here
                self._place[i] = value if here is None else here

    def _move(self, number: int, code: str, words: dict[str, float | None]) -> None:
        start, end = list(self._place), list(self._place)
        for i, axis in enumerate("XYZ"):
            if axis not in words:
                continue
            value = words[axis]
            if value is None:
                refuse(self._name, number, f"{axis} has no number")
            here = self._place[i]
            if self._relative and here is None:
                refuse(self._name, number, f"it moves {axis} by a distance, but from where nothing before has said")
            end[i] = (here or 0.0) + value if self._relative else value - self._shift[i]
        grows = False
        if "E" in words:
            value = words["E"]
            if value is None:
                refuse(self._name, number, "E has no number")
            after = self._e + value if self._relative_e else value
            grows, self._e = after > self._e, after
        self._place = end
        if end == start:
            return
        self._recorder.count(number)
        flags = _BITS["E"] * grows + _BITS["M"] * self._on + _BITS["G1"] * (code == "G1")
        if flags:
            self._keep(number, start, end, flags)

    def _keep(self, number: int, start: list[float | None], end: list[float | None], flags: int) -> None:
        """Note a move that may deposit; coordinates that nothing has said yet are not a number."""
        unknown = float("nan")
        self._moves.extend(unknown if value is None else value for value in (*start, *end))
        self._lines.append(number)
        self._flags.append(flags)

    def file(self, *, named: bool) -> PathFile:
        """Return the moves that deposit as runs."""
        seen = 0
        for flags in self._flags:
            seen |= flags
        bit, told = _BITS["G1"], "G1, while G0 travels"
        if named or (seen & _BITS["M"] and not seen & _BITS["E"]):
            bit, told = _BITS["M"], "M-codes"
        elif seen & _BITS["E"]:
            bit, told = _BITS["E"], "growing E"
        moves = Recorder(self._name)
        for i, flags in enumerate(self._flags):
            if not flags & bit:
                continue
            numbers = self._moves[6 * i : 6 * i + 6]
            if any(math.isnan(value) for value in numbers[3:]):
                refuse(self._name, self._lines[i], "it deposits before all of X, Y and Z have a value")
            start: Point = (numbers[0], numbers[1], numbers[2])
            # The first move comes from nobody knows where.
            if any(math.isnan(value) for value in start):
                continue
            moves.line(self._lines[i], start, (numbers[3], numbers[4], numbers[5]))
        moves.read = self._recorder.read
        return moves.file(title=TITLE, deposit=told)


def _named(deposit: str) -> dict[str, bool]:
    match = _NAMED.fullmatch(deposit.strip())
    if match is None or match[1].upper() == match[2].upper():
        raise UsageError(
            f"`--deposit {deposit}` names no two M-codes; for G-code write what switches on and what off, as M3/M5."
        )
    return {match[1].upper(): True, match[2].upper(): False}
