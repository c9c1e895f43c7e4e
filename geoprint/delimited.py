"""Delimited text: tables as spreadsheets, scripts and mesh programs write them, read row by row.

Columns are parted by tabs, semicolons, bars, commas or blanks. Text is UTF-8 or UTF-16, with or without a byte order
mark. Decimals begin with a point or a comma, but not by both in one file. A header names the columns, in any order and
among others; a comment right above the numbers may be it. Lines that begin with # are comments. What cannot be told
for certain is refused with its line.
"""

from __future__ import annotations

import codecs
import csv
import logging
import math
import re
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, islice, pairwise
from pathlib import Path
from typing import NoReturn, final

import numpy as np

from geoprint.errors import InputError, how_many
from geoprint.model import FloatArray, Reading, frozen, reading

# Letters of one line, and bytes of a file that a person or a script of one's own has written.
MOST_LINE = 1_000_000
MOST_BYTES = 1_000_000
# Nobody draws, touches or measures more rows, and a longer file is another one.
MOST_ROWS = 10_000
# A larger coordinate [mm] is a typing error or another unit.
FARTHEST = 1_000_000.0
PARTED_BY = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", " ": "blanks"}
# Rows by which the layout is told; letters of the file that an error shows, and of a column's name that count.
SAMPLE = 200
SHOWN, _SHOWN_KINDS = 60, 200
# Bytes by which the encoding is told.
_HEAD = 4096

_LOG = logging.getLogger(__name__)

NUMBER = re.compile(r"[-+]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][-+]?\d+)?")
# Blanks with a number on either side part columns.
_THOUSANDS = re.compile(r"[-+]?\d{1,3}(?:[.,]\d+)+")
_BETWEEN_NUMBERS = re.compile(r"\d +[-+.\d]")
# What a spreadsheet writes for a formula that failed; it begins as a comment does.
_FORMULA_ERROR = re.compile(r"#(?:N/A|[A-Z0/]{1,20}[!?])")

_UNITS = ("mm", "cm", "um", "inch", "in", "m")
_COORDINATES = {
    axis: frozenset({
        axis, f"points:{i}", f"points_{i}", f"p{axis}", f"pos_{axis}", f"pos{axis}", f"position_{axis}",
        f"position.{axis}", f"pos.{axis}", f"{axis}_pos", f"{axis}pos", f"{axis}_position", f"coord_{axis}",
        f"{axis}_coord", f"{axis}_coordinate", f"point_{axis}", f"{axis}_coordinates",
    })
    for i, axis in enumerate("xyz")
}  # fmt: skip
# Other names of a column, in lower case; quaternions have their scalar first.
ALIASES: Mapping[str, frozenset[str]] = {
    **_COORDINATES,
    "name": frozenset({"name", "point", "label", "point_name", "pointname"}),
    "q1": frozenset({"q1", "qw"}),
    "q2": frozenset({"q2", "qx"}),
    "q3": frozenset({"q3", "qy"}),
    "q4": frozenset({"q4", "qz"}),
}
_LENGTHS = frozenset({"x", "y", "z", "thickness", "width"})


def encoding_of(head: bytes) -> str:
    """Return the encoding of a text that begins so."""
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    even, odd = head[0:_HEAD:2], head[1:_HEAD:2]
    # Half of the bytes of numbers in UTF-16 are zero.
    if len(odd) > 1 and odd.count(0) > 0.9 * len(odd) and not even.count(0):
        return "utf-16-le"
    if len(even) > 1 and even.count(0) > 0.9 * len(even) and not odd.count(0):
        return "utf-16-be"
    return "utf-8-sig"


def text_lines(
    path: Path, *, most_bytes: int = MOST_BYTES, most_line: int = MOST_LINE, what: str = "a table"
) -> Iterator[tuple[int, str]]:
    """Yield number and text of each line of a file, one at a time, whatever ends its lines.

    Args:
        path: of the file.
        most_bytes: that it may have.
        most_line: letters that a line may have.
        what: it is, for messages.

    Raises:
        InputError: it cannot be read, is larger than allowed, or holds something else than text.
    """
    try:
        # Reading a pipe or a device might never end.
        if path.exists() and not path.is_file():
            raise InputError(f"`{path}` cannot be read as {what}: it is no plain file; give a file of text.")
        if (size := path.stat().st_size) > most_bytes:
            raise InputError(f"{path.name} has {size:,} bytes, {what} has at most {most_bytes:,}; give another file.")
        with path.open("rb") as raw:
            encoding = encoding_of(raw.read(_HEAD))
        # A name may be in any character set, numbers are the same in all.
        with path.open(encoding=encoding, errors="replace") as stream:
            for number, line in enumerate(iter(lambda: stream.readline(most_line + 1), ""), start=1):
                if len(line) > most_line:
                    refuse(path.name, number, f"it is longer than {most_line} bytes, which no program writes")
                if "\0" in line:
                    refuse(path.name, number, "it holds a zero byte, so it is not text; export it as text")
                yield number, line.rstrip("\r\n").lstrip("\ufeff") if number == 1 else line.rstrip("\r\n")
    except OSError as error:
        raise InputError(f"`{path}` cannot be read as {what} ({error.strerror}); give a file of text.") from error


def refuse(name: str, line: int, reason: str, *, column: str = "") -> NoReturn:
    """Raise the error that names a line of a file, perhaps a column, and what is wrong there.

    Raises:
        InputError: always.
    """
    where = f"{name}, line {line}, column {column}" if column else f"{name}, line {line}"
    raise InputError(f"{where}: {reason}.", line=line)


@final
class Delimited:
    """A table, row by row; its layout follows from its first rows.

    Args:
        name: of the file.
        lines: of it, with their numbers.
        what: it is, for messages.

    Attributes:
        name: of the file.
        separator: of the columns.
        header: names of the columns as written; None where there is no header.
        header_line: its line, or that of the first row.
        width: columns.
        doubled: whether a blank row stands behind every row, so that none of them means a break.
        skipped: comments and blank rows so far.

    Raises:
        InputError: it cannot be read, or is empty.
    """

    __slots__ = (
        "_commas", "_lines", "_plain_commas", "_points", "_thousands", "doubled", "header", "header_line", "name",
        "separator", "skipped", "width",
    )  # fmt: skip

    def __init__(self, name: str, lines: Iterator[tuple[int, str]], *, what: str) -> None:
        self.name = name
        self.skipped = Counter[str]()
        sample = list(islice(lines, SAMPLE))
        self._lines = chain(sample, lines)
        kept = [(number, line) for number, line in sample if line.strip() and not is_comment(line)]
        if not kept:
            raise InputError(f"{self.name} is empty, as {what}; its first row must name the columns, such as x,y,z.")
        self.separator = separator_of([line for _, line in kept])
        self.width = 0
        self.header_line, first = kept[0][0], self.cells(*kept[0])
        while first and not first[-1]:
            first.pop()
        self.width = len(first)
        headed = not any(NUMBER.fullmatch(cell.replace("\N{MINUS SIGN}", "-")) for cell in first)
        self.header: tuple[str, ...] | None = tuple(first) if headed else self._commented(sample)
        above = [line for number, line in sample if number < self.header_line and line.strip()]
        if headed:
            self.skipped["comments"] = len(above)
            self._lines = chain([each for each in sample if each[0] > self.header_line], lines)
        self.doubled = self._is_doubled(sample)
        # Lines in which numbers have points, commas, and commas that may mark thousands.
        self._points = self._commas = self._thousands = 0
        self._plain_commas = False

    def _commented(self, sample: Iterable[tuple[int, str]]) -> tuple[str, ...] | None:
        """Return the names of columns that the last comment above the rows gives, as numpy writes them."""
        comments = [line.lstrip(" #") for number, line in sample if number < self.header_line and line.strip()]
        if not comments or '"' in comments[-1]:
            return None
        names = tuple(cell.strip() for cell in self._split(comments[-1]))
        named = {"x", "y", "z"} <= {column_named(name)[0] for name in names}
        return names if named and len(names) == self.width else None

    def _is_doubled(self, sample: Sequence[tuple[int, str]]) -> bool:
        blank = [not line.strip(" \t;,|") for number, line in sample if number > self.header_line]
        while blank and blank[-1]:
            blank.pop()
        rows = blank.count(False)
        single = not any(a == b for a, b in pairwise(blank))
        return rows > 2 and single

    def rows(self, needed: Iterable[int]) -> Iterator[tuple[int, list[str], bool]]:
        """Yield line and cells of each row, and whether a blank row parts it from the row before.

        Args:
            needed: places of the columns that are used; a row may end behind the last of them.

        Raises:
            InputError: a row has fewer cells, or more than there are columns.
        """
        least = max(needed) + 1
        begun = broken = False
        for number, line in self._lines:
            if is_comment(line):
                self.skipped["comments"] += bool(line.strip())
                if not line.strip():
                    self.skipped["blank rows"] += 1
                    broken = begun and not self.doubled
                continue
            cells = self.cells(number, line)
            if not cells:
                self.skipped["blank rows"] += 1
                broken = begun and not self.doubled
                continue
            if not least <= len(cells) <= self.width or (self.header is None and len(cells) != self.width):
                names = f"the header names {self.width} columns"
                wanted = f"without a header there are {self.width}" if self.header is None else names
                also = "; decimal commas need semicolons or tabs between columns" if self.separator == "," else ""
                found = f"found {how_many(len(cells), 'cell')} separated by {PARTED_BY[self.separator]}"
                refuse(self.name, number, f"{found}, but {wanted}{also}")
            yield number, cells, broken
            begun, broken = True, False
        if self._thousands and not self._plain_commas:
            refuse(
                self.name, self._thousands, "a comma before three digits may mark thousands or decimals; export it "
                "with decimal points and without marks between thousands",
            )  # fmt: skip

    def cells(self, number: int, line: str) -> list[str]:
        """Return the cells of a line without empty ones behind the last column; none of a row that is blank.

        Raises:
            InputError: its quotes do not match.
        """
        try:
            cells = [cell.strip() for cell in self._split(line.strip(" "))]
        except csv.Error as error:
            raise InputError(
                f"{self.name}, line {number} cannot be read as a row of a table ({error}); check its quotes.",
                line=number,
            ) from error
        while cells and not cells[-1] and (len(cells) > self.width or not any(cells)):
            cells.pop()
        return cells

    def _split(self, line: str) -> list[str]:
        if '"' in line:
            return next(csv.reader([line], delimiter=self.separator, skipinitialspace=True, strict=True))
        return line.split() if self.separator == " " else line.split(self.separator)

    def number(self, line: int, column: str, cell: str, *, farthest: float = FARTHEST, unit: str = " of mm") -> float:
        """Return the number in a cell.

        Raises:
            InputError: it is no finite number of a sensible size, or nobody can say what its point or comma means.
        """
        value = math.nan
        if NUMBER.fullmatch(cell := cell.replace("\N{MINUS SIGN}", "-")):
            if "," in cell:
                self._decimal(line, cell)
                cell = cell.replace(",", ".")
            elif "." in cell and not self._points:
                self._points = line
                self._check_decimals()
            value = float(cell)
        elif "." in cell and "," in cell and _THOUSANDS.fullmatch(cell):
            self._points = self._commas = line
            self._check_decimals()
        if not abs(value) <= farthest:
            refuse(
                self.name, line, f"found {cell[:SHOWN]!r}, needed is a number{unit} between -{farthest:,.0f} and "
                f"{farthest:,.0f}, such as -12.5 or -12,5", column=column,
            )  # fmt: skip
        return value

    def _decimal(self, line: int, cell: str) -> None:
        """Note a decimal comma."""
        if not self._commas:
            self._commas = line
            self._check_decimals()
        if self.separator == ",":
            if re.fullmatch(r"[-+]?\d+,\d{3}", cell):
                self._thousands = self._thousands or line
            else:
                self._plain_commas = True

    def _check_decimals(self) -> None:
        if self._points and self._commas:
            raise InputError(
                f"{self.name} has decimal points in line {self._points} and decimal commas in line {self._commas}, so "
                "1.234 may mean a thousand. Export it with one kind and without thousands separators."
            )

    def unused(self, used: Iterable[int]) -> dict[str, int]:
        """Return how many columns are not used, by their kind with their names; empty where all are."""
        places = set(used)
        names = [name or "?" for place, name in enumerate(self.header or ()) if place not in places]
        return {f"unused columns ({', '.join(names)})": len(names)} if names else {}


def is_comment(line: str) -> bool:
    """Return whether a line says nothing; `sep=;` is for the spreadsheet."""
    text = line.lstrip()
    said = text.startswith("#") and _FORMULA_ERROR.match(text) is None
    return said or not text or text.lower().startswith("sep=")


def separator_of(lines: Sequence[str]) -> str:
    """Return what parts the columns: the first of tab, semicolon, bar, blanks between numbers, and comma there is.

    Args:
        lines: the first ones that are no comments: a header and rows, or rows.
    """
    for separator in "\t;|":
        if all(separator in line for line in lines[:2]):
            return separator
    commas = any("," in line for line in lines[1:] or lines)
    return " " if any(_BETWEEN_NUMBERS.search(line.replace('"', "")) for line in lines) or not commas else ","


def column_named(name: str) -> tuple[str, str]:
    """Return what a column is, by `ALIASES`, in lower case as written if by none, and its unit if it says one."""
    whole = name.strip().lower()[:SHOWN]
    for unit in _UNITS:
        for end in (f"[{unit}]", f"({unit})", f"/{unit}", f"_{unit}", f" {unit}"):
            base = whole.removesuffix(end).rstrip(" _")
            if whole.endswith(end) and (known := _ALIASED.get(base)) in _LENGTHS:
                return known, unit
    return _ALIASED.get(whole, whole), ""


def places_of(table: Delimited, wanted: Sequence[str]) -> dict[str, int]:
    """Return the place of each wanted column that a header names; a name that comes twice counts where it is first.

    Raises:
        InputError: one is in another unit than mm.
    """
    found: dict[str, int] = {}
    for place, name in enumerate(table.header or ()):
        known, unit = (name.lower(), "") if name.lower() in wanted else column_named(name)
        if known not in wanted:
            continue
        if unit not in {"", "mm"}:
            refuse(table.name, table.header_line, f"column {name!r} is in another unit ({unit}), it is read in mm")
        found.setdefault(known, place)
    return found


@final
@frozen
class Columns:
    """The columns of a small table.

    Attributes:
        names: of them.
        lines: k, where each row stands.
        texts: k, the cells of the first column where that holds names; else empty.
        numbers: (k, columns) of the others.
        reading: what was used, skipped and assumed.
    """

    names: tuple[str, ...]
    lines: tuple[int, ...]
    texts: tuple[str, ...]
    numbers: FloatArray
    reading: Reading


def read_columns(
    path: Path | str, layouts: Sequence[tuple[str, ...]], *, what: str, bare: bool = True, texts: bool = False,
    farthest: float = FARTHEST, unit: str = " of mm",
) -> Columns:  # fmt: skip
    """Read the columns of a table that a person writes.

    Args:
        path: of the file.
        layouts: names of the columns that are wanted; the first of which all are there is read.
        what: the rows are, in the plural.
        bare: whether a table without a header may have the columns of the first layout.
        texts: whether the first column holds names instead of numbers.
        farthest: most that a number may be, whatever its sign.
        unit: of the numbers, for messages.

    Columns that are not used are named in a note.

    Raises:
        InputError: it cannot be read, or its header, decimals or one of its rows is wrong; says which.
    """
    path = Path(path)
    table = Delimited(path.name, text_lines(path, what=f"a table of {what}"), what=f"a table of {what}")
    names, places = _layout(table, layouts, bare=bare)
    lines, said, numbers = array("q"), list[str](), array("d")
    for number, cells, _ in table.rows(places):
        if len(lines) >= MOST_ROWS:
            raise InputError(f"{path.name} has more than {MOST_ROWS} rows, which is the most; leave out rows.")
        lines.append(number)
        if texts:
            said.append(cells[places[0]])
        for name, place in list(zip(names, places, strict=True))[texts:]:
            numbers.append(table.number(number, name, cells[place], farthest=farthest, unit=unit))
    if table.header is None and not lines:
        raise InputError(f"{path.name} holds no {what}.")
    values = np.frombuffer(numbers, dtype=np.float64).reshape(-1, len(names) - texts).copy()
    values.setflags(write=False)
    bare_said = [] if table.header else [f"columns {','.join(names)}, as no header names them"]
    unused = table.unused(places)
    for kind in unused:
        shown = "".join(sign if sign.isprintable() else "?" for sign in kind[:_SHOWN_KINDS])
        _LOG.warning("note: %s: skipped: %s; used: %s.", path.name, shown, ", ".join(names))
    record = reading(used={what: len(lines)}, skipped=dict(table.skipped) | unused, assumed=bare_said)
    return Columns(names, tuple(lines), tuple(said), values, record)


def _layout(table: Delimited, layouts: Sequence[tuple[str, ...]], *, bare: bool) -> tuple[tuple[str, ...], list[int]]:
    """Return the names of a table's columns and their places."""
    if table.header is None:
        if bare and table.width == len(layouts[0]):
            return layouts[0], list(range(table.width))
        refuse(
            table.name, table.header_line,
            f"found {table.width} cells separated by {PARTED_BY[table.separator]} and no header; name the columns "
            f"{' or '.join(','.join(names) for names in layouts)} in the first row"
            + ("; decimal commas need semicolons or tabs between columns" if table.separator == "," else ""),
        )  # fmt: skip
    for names in layouts:
        found = places_of(table, names)
        if set(found) == set(names):
            return names, [found[name] for name in names]
    wanted = " or ".join(",".join(names) for names in layouts)
    shown = ",".join(table.header)[:SHOWN]
    also = f", or leave the header out of a table with {how_many(len(layouts[0]), 'column')}" if bare else ""
    refuse(
        table.name, table.header_line, f"the first row must name the columns {wanted}, found {shown!r}; name them{also}"
    )


_ALIASED = {alias: known for known, aliases in ALIASES.items() for alias in aliases} | {
    name: name for name in ("thickness", "width")
}
