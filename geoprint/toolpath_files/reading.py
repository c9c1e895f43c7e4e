"""Toolpaths of any format, distinguished by content: tables, bundles, G-code, APT and RAPID."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Protocol, final

from geoprint.delimited import (
    NUMBER,
    PARTED_BY,
    SAMPLE,
    SHOWN,
    Delimited,
    column_named,
    encoding_of,
    is_comment,
    places_of,
    separator_of,
)
from geoprint.errors import InputError
from geoprint.model import Reading, reading
from geoprint.toolpath_files import apt, gcode, rapid
from geoprint.toolpath_files.path_file import PathFile, Recorder, lines_of, refuse

# Paths as a table: a row a point, with columns x, y, z, and usually one for the run and one for the deposit.
#
# Columns stand in any order and among others, under their usual names, as `geoprint.delimited` reads them. Without a
# header there are three columns, x y z. Where no column tells the runs apart, a blank row ends a run.


TABLE_TITLE = "table"
AXES = ("x", "y", "z")
# Names of the columns that tell runs apart, in the order in which they are asked; the first that is there counts.
RUNS = (
    "run", "run_id", "runid", "path_id", "pathid", "path", "path_index", "path_number", "path_no", "toolpath",
    "toolpath_id", "stroke", "stroke_id", "bead", "bead_id", "polyline", "polyline_id", "curve", "curve_id", "contour",
    "contour_id", "trajectory", "trajectory_id", "pass", "pass_id", "track", "track_id", "line_id", "seam", "seam_id",
    "segment", "segment_id",
)  # fmt: skip
# Those that part runs besides: numbers of runs may begin anew in each.
GROUPS = ("layer", "layer_id", "layer_index", "layer_number", "part", "part_id", "object", "object_id")
# Those that say whether a row deposits, and those that say that it travels.
DEPOSITS = (
    "deposit", "deposits", "deposition", "deposit_on", "is_deposit", "is_deposition", "depositing", "extruder_on",
    "extruder", "extrude", "extruding", "is_extruding", "extrusion_on", "extrusion", "print", "printing", "is_print",
    "is_printing", "print_on", "dispense", "dispensing", "dispense_on", "dispenser", "dispenser_on", "valve",
    "valve_on", "glue", "glue_on", "tool_on", "process", "process_on", "on", "active", "laser", "laser_on", "arc_on",
    "weld", "welding", "spray", "spray_on", "pump", "pump_on",
)  # fmt: skip
TRAVELS = ("travel", "is_travel", "travelling", "traveling", "rapid", "is_rapid", "air", "air_move", "jump")
_ON = frozenset({"1", "true", "yes", "on", "t", "y", "open"})
_OFF = frozenset({"0", "false", "no", "off", "f", "n", "closed"})


def is_table(head: str) -> bool:
    """Return whether a text begins with a row, or a comment above numbers, that names x, y and z, or with numbers."""
    lines = head.lstrip("\ufeff").splitlines()[:2000]
    # What the end of the head cuts through is no line.
    kept = [line for line in lines if not is_comment(line)][:SAMPLE]
    if not kept:
        return False
    separator = separator_of(kept)
    cells = [cell.strip().strip('"') for cell in (kept[0].split() if separator == " " else kept[0].split(separator))]
    if set(AXES) <= {column_named(cell)[0] for cell in cells}:
        return True
    return len(cells) >= len(AXES) and all(_is_number(cell) for cell in cells)


def _is_number(cell: str) -> bool:
    return NUMBER.fullmatch(cell.replace("\N{MINUS SIGN}", "-")) is not None


def read_table(path: Path, *, deposit: str | None) -> PathFile:
    """Read the runs of a table.

    Args:
        path: of the file.
        deposit: name of the column that says what deposits; where it names none, the usual ones are asked.

    Raises:
        InputError: it cannot be read, or a row is not as the header says; names its line.
    """
    table = Delimited(path.name, lines_of(path), what="a file of toolpaths")
    columns = _Columns(table, deposit)
    recorder = Recorder(path.name)
    last: tuple[str, ...] | None = None
    breaks = 0
    for number, cells, broken in table.rows([*columns.axes, *columns.keys, *columns.flags]):
        x, y, z = (table.number(number, axis, cells[place]) for axis, place in zip(AXES, columns.axes, strict=True))
        run = tuple([cells[place] for place in columns.keys])
        if not all(run):
            named = columns.name(columns.keys[run.index("")])
            refuse(path.name, number, f"the cell of column {named} is empty, needed is a number or a name")
        if broken and not columns.keys:
            breaks += 1
            last = None
        if not columns.deposits(number, cells):
            recorder.count(number)
            last = None
        elif run == last:
            recorder.point(number, (x, y, z))
        else:
            recorder.begin(number, (x, y, z))
            last = run
    return recorder.file(title=TABLE_TITLE, deposit=columns.record, reading=columns.reading(recorder.read, breaks))


@final
class _Columns:
    """Which columns of a table are used, and for what.

    Attributes:
        axes: places of x, y and z.
        keys: places of the columns that tell runs apart.
        flags: place of the column that says what deposits; empty where none does.
        record: how deposit is distinguished from travel, in words.
    """

    def __init__(self, table: Delimited, deposit: str | None) -> None:
        self._table = table
        self.axes, self.keys, self.flags = [0, 1, 2], list[int](), list[int]()
        self._on, self._off, self.record = _ON, _OFF, "nothing: all of it deposits"
        if table.header is None:
            if table.width != len(AXES):
                refuse(
                    table.name, table.header_line,
                    f"found {table.width} cells separated by {PARTED_BY[table.separator]} and no header; "
                    "name the columns in the first row, such as x,y,z,run"
                )  # fmt: skip
            return
        places = places_of(table, AXES)
        if set(places) != set(AXES):
            shown = ", ".join(table.header)[:SHOWN]
            refuse(table.name, table.header_line, f"the first row must name the columns x, y and z, found {shown!r}")
        self.axes = [places[axis] for axis in AXES]
        self.keys = [*self._first(RUNS), *self._first(GROUPS)]
        own = self._first((deposit.strip().lower(),)) if deposit else []
        travels = [] if own else self._first(TRAVELS)
        self.flags = own or self._first(DEPOSITS) or travels
        if self.flags:
            self.record = f"its column {self.name(self.flags[0])}"
        if self.flags and self.flags == travels:
            self._on, self._off = _OFF, _ON

    def _first(self, names: Sequence[str]) -> list[int]:
        """Return the place of the column that has the first of some names, or nothing."""
        written = [name.lower().replace(" ", "_").replace("-", "_") for name in self._table.header or ()]
        return next(([written.index(name)] for name in names if name in written), list[int]())

    def name(self, place: int) -> str:
        """Return the name of a column."""
        return (self._table.header or ())[place][:SHOWN]

    def deposits(self, number: int, cells: Sequence[str]) -> bool:
        """Return whether a row deposits.

        Raises:
            InputError: its cell says neither yes nor no.
        """
        if not self.flags:
            return True
        said = cells[self.flags[0]].lower().removesuffix(".0")
        if said not in _ON | _OFF:
            refuse(
                self._table.name, number, f"column {self.name(self.flags[0])} is {cells[self.flags[0]][:SHOWN]!r}, "
                "needed is 0 or 1"
            )  # fmt: skip
        return said in self._on

    def reading(self, points: int, breaks: int) -> Reading:
        """Return what was used, skipped and assumed."""
        unused = self._table.unused([*self.axes, *self.keys, *self.flags])
        assumed = list[str]()
        if self._table.header is None:
            assumed.append("columns x, y, z, as no header names them")
        if breaks:
            assumed.append(f"a run ends at each of {breaks} blank rows")
        record = [f"runs by the column {self.name(place)}" for place in self.keys[:1]]
        return reading(used={"points": points}, skipped=dict(self._table.skipped) | unused, assumed=[*record, *assumed])


# Paths of a bundle that geoprint wrote: its poses.csv, on the surface.


BUNDLE_TITLE = "bundle"
POSES = "poses.csv"


def read_bundle(path: Path, *, deposit: str | None) -> PathFile:
    """Read the deposited runs of a bundle.

    Args:
        path: of its folder.
        deposit: not used: the bundle says itself what deposits.

    Raises:
        InputError: its poses.csv cannot be read; names the line.
    """
    del deposit
    return replace(read_table(path / POSES, deposit=None), name=path.name, format=BUNDLE_TITLE)


# One entry for all formats: which one a file has is seen from its content.


# Bytes at the beginning of a file by which its format is recognised; slicers begin with long comments and pictures.
HEAD = 400_000


class PathReader(Protocol):
    """Reads a file of one format."""

    def __call__(self, path: Path, *, deposit: str | None) -> PathFile:
        """Return its deposited runs; `deposit` names what deposits, where the format asks for it."""
        ...


# Of each format whether the beginning of a text is of it, and its reader, in the order that they are asked in; a module
# of RAPID may hold in a comment what looks like another.
FORMATS: Mapping[str, tuple[Callable[[str], bool], PathReader]] = MappingProxyType(
    {
        rapid.TITLE: (rapid.is_rapid, rapid.read_rapid),
        TABLE_TITLE: (is_table, read_table),
        apt.TITLE: (apt.is_apt, apt.read_apt),
        gcode.TITLE: (gcode.is_gcode, gcode.read_gcode),
    }
)


def read_paths(path: Path | str, *, deposit: str | None = None, dialect: str | None = None) -> PathFile:
    """Read the deposited runs of a file of toolpaths, or of a bundle's folder.

    Args:
        path: of a table (x, y, z, run), G-code, APT or CLS, a RAPID module or a folder of them, or a bundle.
        deposit: what deposits, where the file does not tell: M-codes as M3/M5, an axis that extrudes as A, or
            the name of an output.
        dialect: of G-code, one of `gcode_codes.DIALECTS`; None to guess it. Other formats have none.

    Raises:
        UsageError: what deposits is named where nothing asks for it, or not named where it must be.
        InputError: the file cannot be read, is of no known format, or a line is wrong; names it.
    """
    path = Path(path)
    if path.is_dir():
        if (path / POSES).is_file():
            return read_bundle(path, deposit=deposit)
        if rapid.modules_in(path):
            return rapid.read_rapid(path, deposit=deposit)
        raise InputError(f"`{path}` holds neither a {POSES} nor modules (.mod); give a bundle or a file.")
    if not path.exists():
        raise InputError(f"`{path}` does not exist; check the name and the folder.")
    # Reading a pipe or a device might never end.
    if not path.is_file():
        raise InputError(f"`{path}` is no plain file; give a file of toolpaths.")
    try:
        with path.open("rb") as stream:
            data = stream.read(HEAD)
    except OSError as error:
        raise InputError(f"`{path}` cannot be read ({error.strerror}); give a file of toolpaths.") from error
    head = data.decode(encoding_of(data), errors="replace")
    for is_such, read in FORMATS.values():
        if is_such(head):
            if read is gcode.read_gcode:
                return gcode.read_gcode(path, deposit=deposit, dialect=dialect)
            return read(path, deposit=deposit)
    raise InputError(
        f"{path.name}, line 1: unknown format of toolpaths. Known are tables whose first row names x, y and z, "
        "G-code, APT or CLS (GOTO/), RAPID modules and bundles of geoprint."
    )
