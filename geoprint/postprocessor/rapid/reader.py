"""Reads the modules of a program for verification, without its writer, and compares their data with the plan's.

The language itself is read by `language`; here stands what a program of geoprint keeps besides: one statement a line,
printable ASCII, lines and modules that a controller's editor opens, an error handler in every routine of the path.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias, cast, final

import numpy as np

from geoprint.model import FloatArray
from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.language.syntax import (
    Assignment,
    Call,
    Datum,
    Expression,
    Leave,
    Literal,
    Module,
    Name,
    Place,
    Routine,
    Statement,
    Value,
    each_kind,
    refuse as refuse,
)

# What verification reads of a program's text, as values: places, data and comments. Names are in lower case.


Listed: TypeAlias = "float | int | bool | str | list[Listed] | None"


@final
@dataclass(frozen=True, slots=True)
class Declaration:
    """A datum of a module: storage is PERS, CONST or VAR, kind its RAPID type; one without a literal has no value."""

    place: Place
    storage: str
    kind: str
    value: Listed


@final
@dataclass(frozen=True, slots=True)
class RapidText:
    """What the modules say: their syntax, data by name, and the comments of each module."""

    modules: tuple[Module, ...]
    declarations: Mapping[str, Declaration]
    comments: Mapping[str, tuple[str, ...]]


# No limit is documented; public programs that load stay below this, and so does every line of geoprint.
LINE_LENGTH = 250
MODULE_LINES = 15000
# A number that has lost its point.
_LEADING_ZERO = re.compile(r"(?:[\[,(=]|(?<!E)-)0\d")
# Where a routine begins, where it defines a trigger, and which triggers a move pulls.
_ROUTINE = re.compile(r"\s*PROC ", re.IGNORECASE)
_DEFINED = re.compile(r"\s*Trigg(?:IO|Speed) (\w+),", re.IGNORECASE)
_PULLED = re.compile(r"\s*TriggL .*,vGeo\d+,(\w+)[,\\]", re.IGNORECASE)
# A wait for the arm to rest, and a move at whose end it does.
_WAITS = re.compile(r"\s*WaitTime\\InPos", re.IGNORECASE)
_RESTS = re.compile(r"\s*(?:MoveL|TriggL) .*,fine,tGeoNozzle", re.IGNORECASE)
_FURTHER = re.compile(r"\\T\d:=(\w+)", re.IGNORECASE)
# Of what a run consists, and what calls the runs.
_RUN = re.compile(r"GeoRun\d+", re.IGNORECASE)
_MOVES = frozenset({"movel", "triggl"})
_IN_RUN = _MOVES | {"geoenter", "triggio", "triggspeed"}
_TIMED = frozenset({"t", "v"})
_IN_MAIN = frozenset({"geobegin", "geoend", "geoforget", "startload", "waitload", "unload"})
# Where a run keeps the target of a move whose line would be too long.
_TARGET = "geotarget"
# Kinds of data that are a module's own word: what a controller makes of them no program reads.
_OPAQUE = frozenset({"triggdata", "loadsession"})
# Half of the fourth decimal on each axis is 0.00005 mm.
POSITION_TOLERANCE = 1e-4
# A frame's rotation has a lever arm of some 100 mm: 1e-7 there is 0.01 um.
_ROTATION_TOLERANCE = 1e-7
# Unit length of a quaternion of rounded components.
UNIT_TOLERANCE = 1e-7


def read_modules(modules: Sequence[tuple[str, str]]) -> RapidText:
    """Read module texts.

    Args:
        modules: file name and text of each module.

    Raises:
        VerificationError: a text is not RAPID, or not in the form in which geoprint writes it.
    """
    parsed: list[Module] = []
    for name, text in modules:
        check_form(name, text)
        parsed.append(parse_module(name, text))
    return read_text(parsed)


def read_text(modules: Sequence[Module]) -> RapidText:
    """Return what modules that were parsed say; that no name is declared twice is the symbol table's to check."""
    declarations = {datum.name.lower(): _declaration(module, datum) for module in modules for datum in module.data}
    comments = {module.file: tuple(text for _, text in module.comments) for module in modules}
    return RapidText(tuple(modules), declarations, comments)


def check_form(name: str, text: str) -> None:
    """Check the form of a module's text: its frame, and each line's length, characters and statement.

    Raises:
        VerificationError: it is another.
    """
    lines = text.split("\n")
    if len(lines) - 1 > MODULE_LINES:
        refuse(Place(name, MODULE_LINES + 1), f"a module has at most {MODULE_LINES} lines, found {len(lines) - 1}")
    match = re.fullmatch(r"MODULE ([A-Za-z_]\w*)", lines[0], re.ASCII | re.IGNORECASE)
    if match is None or f"{match[1]}.mod" != name:
        refuse(Place(name, 1), f"a module begins with MODULE and the name of its file, found {lines[0][:60]!r}")
    if [line.upper() for line in lines[-2:]] != ["ENDMODULE", ""]:
        refuse(Place(name, len(lines)), "ENDMODULE is missing at the end")
    for number, line in enumerate(lines[1:-2], start=2):
        check_line(line, Place(name, number))
        if not line:
            refuse(Place(name, number), "an empty line, which geoprint never writes")
        if line.count(";") > 1 and not line.lstrip().startswith("!"):
            refuse(Place(name, number), "more than one statement stands in the line, which geoprint never writes")
        if _WAITS.match(line) and not _RESTS.match(lines[number - 2]):
            refuse(Place(name, number), "a wait may only follow a move to a fine point")
    for match in _LEADING_ZERO.finditer(text):
        number = text.count("\n", 0, match.start()) + 1
        if not lines[number - 1].lstrip().startswith("!"):
            refuse(Place(name, number), f"{match[0][1:]}... is not a number as geoprint writes it")
    _check_triggers(name, lines)


def _check_triggers(name: str, lines: list[str]) -> None:
    """Check that each routine defines the triggers that it pulls: whoever resumes there has executed none before."""
    defined: set[str] = set()
    for number, line in enumerate(lines, start=1):
        if _ROUTINE.match(line):
            defined.clear()
        if match := _DEFINED.match(line):
            defined.add(match[1].lower())
        elif match := _PULLED.match(line):
            missing = [pulled for pulled in (match[1], *_FURTHER.findall(line)) if pulled.lower() not in defined]
            if missing:
                refuse(Place(name, number), f"{missing[0]} is used, but this routine has not defined it before")


def check_line(line: str, place: Place) -> None:
    """Check what holds for every line of a module: length and characters.

    Raises:
        VerificationError: it is too long, or not printable ASCII.
    """
    if len(line) > LINE_LENGTH:
        refuse(place, f"a line has at most {LINE_LENGTH} characters, found {len(line)}")
    if not line.isascii() or not line.isprintable():
        refuse(place, "only printable ASCII is allowed")


def check_routines(module: Module) -> None:
    """Check the routines of a module of the path: every one shuts off at an error and lets its caller know.

    What is loaded from the start is called by its name; only a module that is loaded later is called by a text.

    Raises:
        VerificationError: one does not.
    """
    own = {routine.name.lower() for routine in module.routines}
    for routine in module.routines:
        _check_handler(module, routine)
        for statement in each_kind(routine.body):
            if isinstance(statement, Call):
                _check_call(module, statement, own)


def check_statements(module: Module) -> None:
    """Check that a module of the path holds nothing but its runs and what calls them, and these nothing that does more.

    Raises:
        VerificationError: a statement belongs to neither.
    """
    own = frozenset(routine.name.lower() for routine in module.routines)
    for routine in module.routines:
        known = _IN_RUN if _RUN.fullmatch(routine.name) else _IN_MAIN | own
        for statement in (*each_kind(routine.body), *routine.undo, *routine.backward):
            place = Place(module.file, statement.line)
            if not _belongs(statement, known):
                said = statement.name if isinstance(statement, Call) else "a statement of this kind"
                refuse(place, f"{said} belongs neither to a path nor to what calls its runs")
            for option in _timed(statement):
                refuse(place, f"\\{option} gives the move another time or speed than its speeddata")


def _timed(statement: Statement) -> Iterator[str]:
    """Yield what gives a move another time than its path and its speeddata do."""
    if isinstance(statement, Call) and statement.name.lower() in _MOVES:
        yield from (each.name for each in statement.arguments if each.optional and each.name.lower() in _TIMED)


def _belongs(statement: Statement, known: frozenset[str]) -> bool:
    """Tell whether a statement is one of those of which a path consists: nothing between its moves does more."""
    if isinstance(statement, Assignment):
        target = statement.target
        return known is _IN_RUN and isinstance(target, Name) and target.name.lower() == _TARGET
    if isinstance(statement, Call) and statement.name.lower() == "waittime":
        # Where and how long, its execution shows.
        return known is _IN_RUN and any(argument.name.lower() == "inpos" for argument in statement.arguments)
    return isinstance(statement, Call) and (statement.name.lower() in known or statement.late is not None)


def _check_call(module: Module, call: Call, own: set[str]) -> None:
    if isinstance(call.late, Literal) and str(call.late.value).lower() in own:
        refuse(Place(module.file, call.line), f"{call.late.value} is called by % although it is always loaded")
    if call.name.lower() == "triggl":
        numbers = [argument.name.upper() for argument in call.arguments if argument.name[:1].upper() == "T"]
        if numbers != [f"T{k}" for k in range(2, len(numbers) + 2)]:
            refuse(Place(module.file, call.line), "the triggers are not numbered one after the other")


def _check_handler(module: Module, routine: Routine) -> None:
    place = Place(module.file, routine.last_line)
    if not routine.handlers:
        refuse(place, "the procedure has no error handler: an error would leave the outputs on")
    (handler, *more), wanted = routine.handlers, ("GeoSafe", "RAISE")
    found = [_word(statement) for statement in each_kind(handler.body)]
    if more or handler.errors or found != list(wanted):
        line = next((each.line for each, word in zip(handler.body, wanted, strict=False) if _word(each) != word), 0)
        refuse(Place(module.file, line or handler.line), f"the error handler must be {'; '.join(wanted)}")


def _word(statement: object) -> str:
    if isinstance(statement, Call):
        return "GeoSafe" if statement.name.lower() == "geosafe" else statement.name
    return statement.verb if isinstance(statement, Leave) else "?"


def _declaration(module: Module, datum: Datum) -> Declaration:
    kind = datum.kind.lower()
    value = None if kind in _OPAQUE else _literal(datum.value)
    return Declaration(Place(module.file, datum.line), datum.storage, kind, value)


def _literal(value: Expression | None) -> Listed:
    return _listed(value.value) if isinstance(value, Literal) else None


def _listed(value: Value) -> Listed:
    if isinstance(value, tuple):
        return [_listed(part) for part in cast("tuple[Value, ...]", value)]
    return value


def read_program_file(name: str, text: str) -> tuple[str, ...]:
    """Return the modules that a .pgf file lists.

    Raises:
        VerificationError: it is not the small XML that a controller reads.
    """
    lines = text.split("\n")
    frame = [lines[0], *lines[1:2], *lines[-2:]]
    if frame != ['<?xml version="1.0" encoding="ISO-8859-1" ?>', "<Program>", "</Program>", ""]:
        refuse(Place(name, 1), "this is not a list of modules")
    listed: list[str] = []
    for number, line in enumerate(lines[2:-2], start=3):
        match = re.fullmatch(r"\t<Module>([A-Za-z0-9]+\.mod)</Module>", line)
        if match is None:
            refuse(Place(name, number), f"{line[:60]!r} does not name a module")
        listed.append(match[1])
    return tuple(listed)


def declared(text: RapidText, name: str, *, kind: str, storage: str, place: Place) -> Declaration:
    """Return the declaration of a name.

    Args:
        text: the modules.
        name: any case.
        kind: RAPID type that it must have.
        storage: PERS, CONST or VAR, which it must be.
        place: where it is needed.

    Raises:
        VerificationError: it is not declared so.
    """
    datum = text.declarations.get(name.lower())
    if datum is None or datum.kind != kind:
        refuse(place, f"{name or 'nothing'} is named where a {kind} is needed, but none is declared so")
    if datum.storage != storage:
        refuse(datum.place, f"{name} is not declared {storage}")
    return datum


def compare_frame(found: Listed, planned: FloatArray, *, place: Place, what: str) -> None:
    """Compare a RAPID pose with a (4, 4) transform.

    Raises:
        VerificationError: they differ.
    """
    if not isinstance(found, list) or len(found) != 2:
        refuse(place, f"{what} is not a pose")
    position, quaternion = found
    compare(position, literal(planned[:3, 3]), tolerance=POSITION_TOLERANCE, place=place, what=f"{what} position")
    compare(quaternion, literal(np.zeros(4)), tolerance=1.0, place=place, what=f"{what} quaternion")
    w, x, y, z = np.array(quaternion, dtype=np.float64)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    unit = abs(w * w + x * x + y * y + z * z - 1.0) <= UNIT_TOLERANCE
    if not unit or np.abs(rotation - planned[:3, :3]).max() > _ROTATION_TOLERANCE:
        refuse(place, f"{what} is turned by {quaternion}, which is not the plan's attitude")


def literal(values: FloatArray) -> Listed:
    """Return an array as the nested lists of a literal."""
    return [float(value) for value in values]


def compare(found: Listed, planned: Listed, *, tolerance: float, place: Place, what: str) -> None:
    """Compare nested literals: same form, same words, numbers within the tolerance.

    Raises:
        VerificationError: they differ.
    """
    if isinstance(planned, list):
        if not isinstance(found, list) or len(found) != len(planned):
            refuse(place, f"{what} is {found}, the plan has {planned}")
        for one, other in zip(found, planned, strict=True):
            compare(one, other, tolerance=tolerance, place=place, what=what)
    elif isinstance(planned, bool | str | None) or isinstance(found, bool | str | list | None):
        if type(found) is not type(planned) or found != planned:
            refuse(place, f"{what} is {found}, the plan has {planned}")
    elif not abs(found - planned) <= tolerance:
        refuse(place, f"{what} is {found}, the plan has {planned}")
