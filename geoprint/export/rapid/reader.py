"""A reader of the RAPID that geoprint writes, made to distrust it: it shares no code with the writer.

It knows a small part of the language, one statement a line, and refuses everything else by module, line and reason:
what it does not understand, nobody has checked. Data literals are decoded by the JSON scanner, whose brackets and
numbers are the same (`9E9` included); names are compared without regard to case, as RAPID does.
"""

from __future__ import annotations

import json
import re
from typing import NoReturn, cast, final

from geoprint.export.rapid.text import (
    Call,
    Declaration,
    FlowAt,
    Loading,
    LoadVerb,
    Move,
    MoveVerb,
    Place,
    Procedure,
    RapidText,
    Statement,
    SwitchAt,
    Value,
    refuse,
)

# Limits of the RAPID kernel.
NAME_LENGTH = 32
STRING_LENGTH = 80
# No limit is documented; public programs that load stay below this, and so does every line of geoprint.
LINE_LENGTH = 250
MODULE_LINES = 15000
# A RAPID num is single precision.
_LARGEST_NUM = 3.4e38
_NUMERIC = {int, float}
# The value that every trigger writes which switches on; the guard keeps it 0 in a dry run.
_ON = "geoOn"

_WORD = r"[A-Za-z_][A-Za-z0-9_]*"
_NUM = r"-?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?(?:E[+-]?[0-9]+)?"
_FILE = r"diskhome\\File:=\"([A-Za-z0-9]+\.mod)\""
# A target whose axes stand in other quadrants when it is lifted goes through the guard, with the configuration of then.
_TARGET = r"(?:(\[[^;]*\])|GeoAloft\((\[[^;()]*\]\]),(\[[^;()\[\]]*\])\))"
_MOVE = re.compile(
    rf"(MoveL|TriggL) {_TARGET},({_WORD}),(?:({_WORD}(?:\\T[2-8]:={_WORD})*),)?({_WORD}),({_WORD})"
    rf"(?:\\WObj:=({_WORD}))?;"
)
_SWITCH = re.compile(rf"TriggIO ({_WORD}),({_NUM})(\\Start)?\\DOp:=({_WORD}),({_ON}|0);")
_FLOW = re.compile(
    rf"TriggSpeed ({_WORD}),({_NUM})(\\Start)?,({_NUM}),({_WORD}),(?:({_NUM})\*{_ON}|0)(?:\\DipLag:=({_NUM}))?;"
)
_CALL = re.compile(rf"(?:({_WORD})|%\"({_WORD})\"%)(?: (?:({_NUM})|\"([^\"]*)\"))?;")
_LOAD = re.compile(rf"StartLoad\\Dynamic,{_FILE},geoLoading;|WaitLoad geoLoading;|UnLoad {_FILE};")
_DECLARATION = re.compile(rf"(PERS|CONST) ({_WORD}) ({_WORD}):=(.*);")
_VARIABLE = re.compile(rf"VAR (triggdata|loadsession) ({_WORD});")
_PROCEDURE = re.compile(rf"PROC ({_WORD})\(\)")
_MODULE = re.compile(rf"MODULE ({_WORD})")
_TOKEN = re.compile(r'"[^"]*"|[A-Za-z_][A-Za-z0-9_]*')
_ROBTARGET_SHAPE = [3, 4, 4, 6]
# The error handler of every procedure, and its end.
_HANDLER = ("ERROR", "GeoSafe;", "RAISE;", "ENDPROC")


def read_modules(modules: tuple[tuple[str, str], ...]) -> RapidText:
    """Read module texts into data and procedures.

    Args:
        modules: file name and text of each module.

    Raises:
        VerificationError: a line is not RAPID as this reader knows it.
    """
    return joined(tuple(read_module(name, text) for name, text in modules))


def read_module(name: str, text: str) -> RapidText:
    """Read the text of one module.

    Raises:
        VerificationError: a line is not RAPID as this reader knows it.
    """
    reader = _ModuleReader(name, text)
    declarations = {word.lower(): declaration for word, declaration in reader.declarations}
    procedures = {word.lower(): Procedure(place, tuple(body)) for place, word, body in reader.procedures}
    return RapidText(declarations, procedures, {name: tuple(reader.comments)})


def joined(modules: tuple[RapidText, ...]) -> RapidText:
    """Return what several modules say together; that no name is declared twice is `rapid_names`' to check."""
    declarations: dict[str, Declaration] = {}
    procedures: dict[str, Procedure] = {}
    comments: dict[str, tuple[str, ...]] = {}
    for module in modules:
        declarations |= module.declarations
        procedures |= module.procedures
        comments |= module.comments
    return RapidText(declarations, procedures, comments)


def read_program_file(name: str, text: str) -> tuple[str, ...]:
    """Return the modules that a .pgf file lists.

    Raises:
        VerificationError: it is not the small XML that a controller reads.
    """
    lines = text.split("\n")
    frame = [lines[0], *lines[1:2], *lines[-2:]]
    if frame != ['<?xml version="1.0" encoding="ISO-8859-1" ?>', "<Program>", "</Program>", ""]:
        refuse(Place(name, 1), "this is no list of modules")
    listed: list[str] = []
    for number, line in enumerate(lines[2:-2], start=3):
        match = re.fullmatch(r"\t<Module>([A-Za-z0-9]+\.mod)</Module>", line)
        if match is None:
            refuse(Place(name, number), f"{line[:60]!r} names no module")
        listed.append(match[1])
    return tuple(listed)


def check_line(line: str, place: Place) -> None:
    """Check what holds for every line of a module: length and characters.

    Raises:
        VerificationError: it is too long, or not printable ASCII.
    """
    if len(line) > LINE_LENGTH:
        refuse(place, f"a line has at most {LINE_LENGTH} characters, found {len(line)}")
    if not line.isascii() or not line.isprintable():
        refuse(place, "only printable ASCII is allowed")


@final
class _ModuleReader:
    """Reads one module line by line: header, data, then procedures."""

    def __init__(self, name: str, text: str) -> None:
        self.declarations: list[tuple[str, Declaration]] = []
        self.procedures: list[tuple[Place, str, list[Statement]]] = []
        self.comments: list[str] = []
        self._body: list[Statement] | None = None
        # How many lines of the error handler of the procedure were read.
        self._handled = 0
        lines = text.split("\n")
        self._check_frame(name, lines)
        for number, line in enumerate(lines[1:-2], start=2):
            place = Place(name, number)
            check_line(line, place)
            code = line.strip(" ")
            if code.startswith("!"):
                self.comments.append(code)
            elif self._body is None:
                self._outside(code, place)
            else:
                self._inside(code, place, self._body)
        if self._body is not None:
            refuse(Place(name, len(lines) - 1), "ENDPROC is missing")

    @staticmethod
    def _check_frame(name: str, lines: list[str]) -> None:
        if len(lines) - 1 > MODULE_LINES:
            refuse(Place(name, MODULE_LINES + 1), f"a module has at most {MODULE_LINES} lines, found {len(lines) - 1}")
        match = _MODULE.fullmatch(lines[0])
        if match is None or f"{match[1]}.mod" != name:
            refuse(Place(name, 1), f"a module begins with MODULE and the name of its file, found {lines[0][:60]!r}")
        _check_name(match[1], Place(name, 1))
        if lines[-2:] != ["ENDMODULE", ""]:
            refuse(Place(name, len(lines)), "ENDMODULE is missing at the end")

    def _outside(self, code: str, place: Place) -> None:
        procedure = _PROCEDURE.fullmatch(code)
        variable = _VARIABLE.fullmatch(code)
        declaration = _DECLARATION.fullmatch(code)
        if procedure:
            _check_name(procedure[1], place)
            self._body, self._handled = [], 0
            self.procedures.append((place, procedure[1], self._body))
        elif variable is None and declaration is None:
            refuse(place, _why(code))
        elif self.procedures:
            refuse(place, "data is declared after a procedure; RAPID wants data first")
        elif variable:
            _check_name(variable[2], place)
            self.declarations.append((variable[2], Declaration(place, "VAR", variable[1], None)))
        elif declaration:
            storage, kind, name, literal = declaration.groups()
            _check_name(name, place)
            value = _decode(_TOKEN.sub(lambda word: _json_word(word[0], place), literal), place)
            self.declarations.append((name, Declaration(place, storage, kind, value)))

    def _inside(self, code: str, place: Place, body: list[Statement]) -> None:
        if not self._handled and code != _HANDLER[0]:
            if code == _HANDLER[-1]:
                refuse(place, "the procedure has no error handler, so that an error would leave the outputs on")
            body.append(_statement(code, place))
            return
        if code != _HANDLER[self._handled]:
            refuse(place, f"the error handler must go on with {_HANDLER[self._handled]}, found {code[:60]!r}")
        self._handled += 1
        if self._handled == len(_HANDLER):
            self._body = None


def _statement(code: str, place: Place) -> Statement:
    move = _MOVE.fullmatch(code)
    if move:
        return _move(move, place)
    switch = _SWITCH.fullmatch(code)
    if switch:
        name, distance, start, signal, value = switch.groups()
        _check_name(name, place)
        _check_name(signal, place)
        return SwitchAt(place, name.lower(), float(distance), start is not None, signal.lower(), value == _ON)
    flow = _FLOW.fullmatch(code)
    if flow:
        name, distance, start, lag, signal, scale, dip = flow.groups()
        _check_name(name, place)
        _check_name(signal, place)
        numbers = [float(text or 0.0) for text in (distance, lag, scale, dip)]
        return FlowAt(
            place, name.lower(), numbers[0], start is not None, numbers[1], signal.lower(), numbers[2], numbers[3]
        )
    load = _LOAD.fullmatch(code)
    if load:
        verb = re.split(r"[ \\]", code, maxsplit=1)[0]
        return Loading(place, cast("LoadVerb", verb), load[1] or load[2] or "")
    call = _CALL.fullmatch(code)
    if call is None:
        refuse(place, _why(code))
    name, late, number, text = call.groups()
    _check_name(name or late, place)
    if text is not None and len(text) > STRING_LENGTH:
        refuse(place, f"a string has at most {STRING_LENGTH} characters, found {len(text)}")
    return Call(place, (name or late).lower(), text if number is None else float(number), late is not None)


def _move(move: re.Match[str], place: Place) -> Move:
    verb, alone, target, lifted, speed, triggers, zone, tool, work = move.groups(default="")
    names = re.split(r"\\T[2-8]:=", triggers) if triggers else []
    if (verb == "TriggL") != bool(names):
        refuse(place, "TriggL needs a trigger, and MoveL takes none")
    if re.findall(r"\\T([2-8])", triggers) != [str(k) for k in range(2, len(names) + 1)]:
        refuse(place, "the triggers are not numbered one after the other")
    for name in (speed, zone, tool, work or tool, *names):
        _check_name(name, place)
    pulled = tuple(name.lower() for name in names)
    numbers = _robtarget(alone or target, place)
    aloft = _configuration(lifted, place) if lifted else numbers[7:11]
    return Move(
        place, cast("MoveVerb", verb), numbers, aloft, speed.lower(), pulled, zone.lower(), tool.lower(), work.lower()
    )


def _robtarget(literal: str, place: Place) -> tuple[float, ...]:
    """Return the 17 numbers of a robtarget: position, quaternion, configuration, external axes."""
    value = _decode(literal, place)
    parts = value if isinstance(value, list) else []
    shape = [len(part) if isinstance(part, list) else 0 for part in parts]
    if shape != _ROBTARGET_SHAPE:
        refuse(place, f"a robtarget has groups of {_ROBTARGET_SHAPE} numbers, found {shape}")
    position, quaternion, configuration, axes = cast("list[list[Value]]", parts)
    numbers = [*position, *quaternion, *configuration, *axes]
    # All at once: this is done for every target.
    if not {*map(type, numbers)} <= _NUMERIC or max(map(abs, cast("list[float]", numbers))) > _LARGEST_NUM:
        refuse(place, f"{literal[:60]!r} holds something that is no number that a controller can hold")
    return tuple(cast("list[float]", numbers))


def _configuration(literal: str, place: Place) -> tuple[float, ...]:
    """Return the four numbers of a confdata."""
    value = _decode(literal, place)
    if not isinstance(value, list) or len(value) != 4 or not {*map(type, value)} <= _NUMERIC:
        refuse(place, f"{literal[:60]!r} is no configuration of four numbers")
    return tuple(cast("list[float]", value))


def _refuse_constant(word: str) -> NoReturn:
    raise ValueError(f"{word} is no RAPID number")


_DECODER = json.JSONDecoder(parse_constant=_refuse_constant)


def _decode(literal: str, place: Place) -> Value:
    try:
        return cast("Value", _DECODER.decode(literal))
    except ValueError as error:
        refuse(place, f"broken literal {literal[:60]!r}: {error}")


def _json_word(word: str, place: Place) -> str:
    """Turn a word of a declaration's literal into JSON: only TRUE, FALSE, exponents and short strings occur."""
    if word in {"TRUE", "FALSE"}:
        return word.lower()
    if word.startswith('"') and len(word) - 2 > STRING_LENGTH:
        refuse(place, f"a string has at most {STRING_LENGTH} characters, found {len(word) - 2}")
    if not word.startswith('"') and not re.fullmatch(r"E[0-9]*", word):
        refuse(place, f"{word[:40]!r} is no literal")
    return word


def _check_name(name: str, place: Place) -> None:
    if len(name) > NAME_LENGTH:
        refuse(place, f"a name has at most {NAME_LENGTH} characters, {name!r} has {len(name)}")


def _why(code: str) -> str:
    """Say what is wrong with a line that matched no statement."""
    if not code:
        return "an empty line, which geoprint never writes"
    if not code.endswith(";") and not re.match(r"PROC|MODULE|END|ERROR", code):
        return f"the semicolon is missing after {code[-30:]!r}"
    return f"{code[:60]!r} is no statement of a geoprint program"
