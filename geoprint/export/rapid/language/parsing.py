"""Parses a RAPID module as people write it: its head, types, data and routines.

Case, line ends, layout and comments are free; what an editor or a controller puts before the module (`%%%` with version
and language, a byte order mark) is stepped over. A module whose text is encoded (NOVIEW) is refused in words.
"""

from __future__ import annotations

import re
from typing import cast

from geoprint.export.rapid.language.cursor import Cursor
from geoprint.export.rapid.language.expressions import expression, expressions
from geoprint.export.rapid.language.places import Place, refusal
from geoprint.export.rapid.language.statements import body
from geoprint.export.rapid.language.syntax import (
    Alias,
    Datum,
    Expression,
    Handler,
    Module,
    Parameter,
    RecordType,
    Routine,
    RoutineKind,
    Statement,
    Storage,
)
from geoprint.export.rapid.language.tokens import TOO_DEEP

_HEADER = re.compile(r"\A\s*%%%.*?%%%", re.DOTALL)
_ATTRIBUTES = frozenset({"SYSMODULE", "NOVIEW", "NOSTEPIN", "VIEWONLY", "READONLY"})
_STORAGES = frozenset({"VAR", "PERS", "CONST"})
_ROUTINES = frozenset({"PROC", "FUNC", "TRAP"})
_TYPES = frozenset({"RECORD", "ALIAS"})
_DECLARATIONS = _STORAGES | _ROUTINES | _TYPES | {"LOCAL", "TASK", "ENDMODULE"}


def parse_module(file: str, text: str, *, whole_calls: bool = True) -> Module:
    """Parse the text of one module.

    Args:
        file: its name, for errors.
        text: the text.
        whole_calls: whether instructions behind an aggregate of numbers are read in one piece; the same module, faster.

    Raises:
        VerificationError: it is not RAPID; line and reason are named.
    """
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n").rstrip("\x1a\0\n\t ")
    text = _HEADER.sub(lambda header: "\n" * header[0].count("\n"), text, count=1) if _HEADER.match(text) else text
    lines = text.split("\n")
    cursor = Cursor(file, lines, whole_calls=whole_calls)
    try:
        return _module(file, cursor, lines=len(lines))
    except RecursionError as error:
        raise refusal(Place(file, cursor.line), TOO_DEEP) from error


def _module(file: str, cursor: Cursor, *, lines: int) -> Module:
    cursor.need("MODULE", "the begin of the file")
    name = cursor.name("a module")
    attributes = _attributes(cursor)
    if "NOVIEW" in attributes and cursor.kind not in _DECLARATIONS:
        cursor.refuse(f"module {name} is encoded (NOVIEW), so that nobody can read what it does")
    types: list[RecordType | Alias] = []
    data: list[Datum] = []
    routines: list[Routine] = []
    while cursor.kind != "ENDMODULE":
        local = cursor.take("LOCAL")
        cursor.take("TASK")
        if cursor.kind in _STORAGES:
            data.append(_datum(cursor, local=local))
        elif cursor.kind in _ROUTINES:
            routines.append(_routine(cursor, local=local))
        elif cursor.kind in _TYPES:
            types.append(_type(cursor, local=local))
        else:
            cursor.refuse(f"a declaration or ENDMODULE is missing: found {cursor.shown()}")
    cursor.step()
    if not cursor.ended:
        cursor.refuse(f"text stands behind ENDMODULE: found {cursor.shown()}")
    return Module(file, name, attributes, tuple(types), tuple(data), tuple(routines), tuple(cursor.comments), lines)


def _attributes(cursor: Cursor) -> tuple[str, ...]:
    found: list[str] = []
    if cursor.take("("):
        while not found or cursor.take(","):
            if cursor.kind not in _ATTRIBUTES:
                cursor.refuse(f"{cursor.shown()} is no attribute of a module")
            found.append(cursor.kind)
            cursor.step()
        cursor.need(")", "the attributes of a module")
    return tuple(found)


def _type(cursor: Cursor, *, local: bool) -> RecordType | Alias:
    line = cursor.line
    if cursor.take("ALIAS"):
        of = cursor.name("a type")
        alias = Alias(line, cursor.name("a type"), of, local)
        cursor.need(";", "ALIAS")
        return alias
    cursor.step()
    name = cursor.name("a record")
    components: list[tuple[str, str]] = []
    while not cursor.take("ENDRECORD"):
        kind = cursor.name("a component's type")
        components.append((kind, cursor.name("a component")))
        cursor.need(";", "a component")
    return RecordType(line, name, tuple(components), local)


def _datum(cursor: Cursor, *, local: bool) -> Datum:
    line = cursor.line
    storage = cast("Storage", cursor.kind)
    cursor.step()
    kind = cursor.name("a type")
    name = cursor.name("a datum")
    sizes: tuple[Expression, ...] = ()
    if cursor.take("{"):
        sizes = expressions(cursor, "}")
    value = expression(cursor) if cursor.take(":=") else None
    cursor.need(";", name)
    return Datum(line, name, storage, kind, sizes, value, local)


def _routine(cursor: Cursor, *, local: bool) -> Routine:
    line = cursor.line
    kind = cast("RoutineKind", cursor.kind)
    cursor.step()
    returns = cursor.name("a type") if kind == "FUNC" else ""
    name = cursor.name("a routine")
    parameters = _parameters(cursor) if cursor.take("(") else ()
    data: list[Datum] = []
    while cursor.kind in _STORAGES:
        if cursor.kind == "PERS":
            cursor.refuse(f"{name} declares a PERS; only a module can")
        data.append(_datum(cursor, local=False))
    statements = body(cursor)
    clauses: dict[str, tuple[Statement, ...]] = {}
    handlers: list[Handler] = []
    while cursor.kind in {"ERROR", "UNDO", "BACKWARD"}:
        clause, at = cursor.kind, cursor.line
        cursor.step()
        if clause == "ERROR":
            errors = expressions(cursor, ")") if cursor.take("(") else ()
            handlers.append(Handler(at, errors, body(cursor)))
        elif clause in clauses:
            cursor.refuse(f"{name} has a second {clause}")
        else:
            clauses[clause] = body(cursor)
    last = cursor.line
    if not cursor.take(f"END{kind}"):
        cursor.refuse(f"END{kind} is missing for {kind} {name} of line {line}: found {cursor.shown()}")
    undo, backward = clauses.get("UNDO", ()), clauses.get("BACKWARD", ())
    return Routine(
        line, last, name, kind, returns, parameters, tuple(data), statements, tuple(handlers), undo, backward, local
    )


def _parameters(cursor: Cursor) -> tuple[Parameter, ...]:
    """Parse the parameters of a routine and step over the bracket behind them."""
    found: list[Parameter] = []
    group = -1
    optional = False
    while not cursor.take(")"):
        if cursor.take("|"):
            # Without a backslash of its own it is as optional as the one before.
            optional = cursor.take("\\") or optional
        else:
            if found and not cursor.take(",") and cursor.kind != "\\":
                cursor.refuse(f"a comma is missing between parameters: found {cursor.shown()}")
            optional = cursor.take("\\")
            group += 1
        found.append(_parameter(cursor, group=group, optional=optional))
    return tuple(found)


def _parameter(cursor: Cursor, *, group: int, optional: bool) -> Parameter:
    line = cursor.line
    mode = cursor.kind if cursor.kind in {"VAR", "PERS", "INOUT"} else ""
    if mode:
        cursor.step()
    kind = cursor.name("a parameter's type")
    name = cursor.name("a parameter")
    dimensions = 0
    if cursor.take("{"):
        dimensions = 1
        cursor.need("*", "the bracket of an array")
        while cursor.take(","):
            cursor.need("*", "a comma")
            dimensions += 1
        cursor.need("}", "the dimensions of an array")
    return Parameter(line, name, kind, mode, optional, group, dimensions)
