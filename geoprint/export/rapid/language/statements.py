"""Parses RAPID statements: assignments, calls, branches, loops and what leaves a routine."""

from __future__ import annotations

from typing import cast

from geoprint.export.rapid.language.cursor import Cursor
from geoprint.export.rapid.language.expressions import arguments, expression, expressions, reference
from geoprint.export.rapid.language.syntax import (
    Assignment,
    Call,
    Connect,
    Expression,
    For,
    Goto,
    If,
    Label,
    Leave,
    Reference,
    Statement,
    Test,
    While,
)

# What ends a body of statements.
_ENDS = frozenset(
    {"ENDPROC", "ENDFUNC", "ENDTRAP", "ENDMODULE", "ENDIF", "ENDFOR", "ENDWHILE", "ENDTEST", "end"}
    | {"ELSE", "ELSEIF", "CASE", "DEFAULT", "ERROR", "UNDO", "BACKWARD"}
)
_LEAVING = frozenset({"RETURN", "EXIT", "RETRY", "TRYNEXT", "RAISE"})
# These may bring a value.
_BRINGING = frozenset({"RETURN", "RAISE"})


def body(cursor: Cursor) -> tuple[Statement, ...]:
    """Parse statements up to a word that ends a body, which is left standing.

    Raises:
        VerificationError: they are not RAPID.
    """
    found: list[Statement] = []
    while cursor.kind not in _ENDS:
        found.append(cursor.call() if cursor.kind == "call" else statement(cursor))
    return tuple(found)


def statement(cursor: Cursor) -> Statement:
    """Parse one statement.

    Raises:
        VerificationError: there is none.
    """
    line, kind = cursor.line, cursor.kind
    if kind == "call":
        return cursor.call()
    if kind == "name":
        return _named(cursor)
    if kind in {"VAR", "PERS", "CONST"}:
        cursor.refuse(f"{kind} declares a datum behind a statement; RAPID wants a routine's data first")
    if kind in {"IF", "TEST", "FOR", "WHILE"}:
        cursor.step()
        return {"IF": _if, "TEST": _test, "FOR": _for, "WHILE": _while}[kind](cursor, line)
    found: Statement
    if kind in _LEAVING:
        cursor.step()
        value = expression(cursor) if kind in _BRINGING and cursor.kind != ";" else None
        found = Leave(line, kind, value)  # pyright: ignore[reportArgumentType]
    elif cursor.take("GOTO"):
        found = Goto(line, cursor.name("a label"))
    elif cursor.take("CONNECT"):
        target = _reference(cursor)
        cursor.need("WITH", "the interrupt of CONNECT")
        found = Connect(line, target, cursor.name("a trap"))
    elif cursor.take("%"):
        late = expression(cursor)
        cursor.need("%", "the name of a late call")
        found = Call(line, "", late, arguments(cursor, ";"))
    else:
        cursor.refuse(f"{cursor.shown()} begins no statement")
    cursor.need(";", kind)
    return found


def _named(cursor: Cursor) -> Statement:
    """Parse what begins with a name: a label, an assignment or a call."""
    line = cursor.line
    name = cursor.name("a routine")
    if cursor.take(":"):
        return Label(line, name)
    found: Statement
    if cursor.kind in {":=", ".", "{"}:
        target = cast("Reference", reference(cursor, name, line))
        cursor.need(":=", name)
        found = Assignment(line, target, expression(cursor))
    else:
        found = Call(line, name, None, arguments(cursor, ";"))
    cursor.need(";", name)
    return found


def _reference(cursor: Cursor) -> Reference:
    line = cursor.line
    return cast("Reference", reference(cursor, cursor.name("a datum"), line))


def _if(cursor: Cursor, line: int) -> If:
    condition = expression(cursor)
    if not cursor.take("THEN"):
        return If(line, ((condition, (statement(cursor),)),), ())
    branches: list[tuple[Expression, tuple[Statement, ...]]] = [(condition, body(cursor))]
    while cursor.take("ELSEIF"):
        condition = expression(cursor)
        cursor.need("THEN", "the condition of ELSEIF")
        branches.append((condition, body(cursor)))
    otherwise = body(cursor) if cursor.take("ELSE") else ()
    _close(cursor, "ENDIF", f"IF of line {line}")
    return If(line, tuple(branches), otherwise)


def _test(cursor: Cursor, line: int) -> Test:
    subject = expression(cursor)
    cases: list[tuple[tuple[Expression, ...], tuple[Statement, ...]]] = []
    while cursor.take("CASE"):
        values = expressions(cursor, ":")
        cases.append((values, body(cursor)))
    default: tuple[Statement, ...] = ()
    if cursor.take("DEFAULT"):
        cursor.need(":", "DEFAULT")
        default = body(cursor)
    _close(cursor, "ENDTEST", f"TEST of line {line}")
    return Test(line, subject, tuple(cases), default)


def _for(cursor: Cursor, line: int) -> For:
    variable = cursor.name("a loop's variable")
    cursor.need("FROM", "the variable of FOR")
    first = expression(cursor)
    cursor.need("TO", "the first value of FOR")
    last = expression(cursor)
    step = expression(cursor) if cursor.take("STEP") else None
    cursor.need("DO", "the last value of FOR")
    inner = body(cursor)
    _close(cursor, "ENDFOR", f"FOR of line {line}")
    return For(line, variable, first, last, step, inner)


def _while(cursor: Cursor, line: int) -> While:
    condition = expression(cursor)
    cursor.need("DO", "the condition of WHILE")
    inner = body(cursor)
    _close(cursor, "ENDWHILE", f"WHILE of line {line}")
    return While(line, condition, inner)


def _close(cursor: Cursor, word: str, opened: str) -> None:
    if not cursor.take(word):
        cursor.refuse(f"{word} is missing for the {opened}: found {cursor.shown()}")
