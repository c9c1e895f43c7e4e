r"""Parses RAPID expressions and arguments.

From weakest to strongest: OR and XOR; NOT and AND; comparisons; + and -; * / DIV MOD; sign. `NOT a AND b` denies both,
as in the kernel's grammar, where NOT stands before a term of ANDs; behind AND it denies what is compared next.
"""

from __future__ import annotations

from geoprint.export.rapid.language.cursor import Cursor
from geoprint.export.rapid.language.syntax import (
    Aggregate,
    Argument,
    Binary,
    Component,
    Element,
    Expression,
    FunctionCall,
    Literal,
    Name,
    Unary,
    Value,
)

_OR = frozenset({"OR", "XOR"})
_COMPARISONS = frozenset({"=", "<>", "<", ">", "<=", ">="})
# Operands of one sum or product; whoever writes more can split it.
_MOST_OPERANDS = 20_000
_SUMS = frozenset({"+", "-"})
_PRODUCTS = frozenset({"*", "/", "DIV", "MOD"})
_LITERALS = frozenset({"number", "string", "numbers"})
_TRUTHS = frozenset({"TRUE", "FALSE"})
_GOES_ON = frozenset({"(", ".", "{"})


def expression(cursor: Cursor) -> Expression:
    """Parse an expression.

    Raises:
        VerificationError: there is none.
    """
    left = _term(cursor)
    while cursor.kind in _OR:
        line, operator = cursor.line, cursor.kind
        cursor.step()
        left = Binary(line, operator, left, _term(cursor))
    return left


def arguments(cursor: Cursor, closing: str) -> tuple[Argument, ...]:
    """Parse the arguments of a call up to what closes them, which is left standing.

    Raises:
        VerificationError: they are not RAPID.
    """
    found: list[Argument] = []
    cursor.take(",")
    while cursor.kind != closing:
        if found and not cursor.take(",") and cursor.kind != "\\":
            cursor.need(closing, "an argument")
        found.append(_option(cursor) if cursor.kind == "\\" else _required(cursor))
    return tuple(found)


def expressions(cursor: Cursor, closing: str) -> tuple[Expression, ...]:
    """Parse one or more expressions with commas between them, and step over what closes them.

    Raises:
        VerificationError: they are not RAPID.
    """
    found = [expression(cursor)]
    while cursor.take(","):
        found.append(expression(cursor))
    cursor.need(closing, "an expression")
    return tuple(found)


def reference(cursor: Cursor, name: str, line: int) -> Expression:
    """Parse what follows a name: components and elements."""
    found: Expression = Name(line, name)
    while cursor.kind in {".", "{"}:
        at = cursor.line
        if cursor.take("."):
            found = Component(at, found, cursor.name("a component"))
        else:
            cursor.step()
            found = Element(at, found, expressions(cursor, "}"))
    return found


def _required(cursor: Cursor) -> Argument:
    line = cursor.line
    value = expression(cursor)
    if isinstance(value, Name) and cursor.take(":="):
        return Argument(line, value.name, expression(cursor), optional=False)
    return Argument(line, "", value, optional=False)


def _option(cursor: Cursor) -> Argument:
    line = cursor.line
    cursor.step()
    name = cursor.name("an optional argument")
    if cursor.take(":="):
        return Argument(line, name, expression(cursor), optional=True)
    if cursor.take("?"):
        return Argument(line, name, None, optional=True, forwarded=cursor.name("an optional parameter"))
    return Argument(line, name, None, optional=True)


def _term(cursor: Cursor) -> Expression:
    line = cursor.line
    if cursor.take("NOT"):
        return Unary(line, "NOT", _term(cursor))
    left = _comparison(cursor)
    while cursor.kind == "AND":
        line = cursor.line
        cursor.step()
        left = Binary(line, "AND", left, _comparison(cursor))
    return left


def _comparison(cursor: Cursor) -> Expression:
    line = cursor.line
    if cursor.take("NOT"):
        return Unary(line, "NOT", _comparison(cursor))
    left = _sum(cursor)
    if cursor.kind in _COMPARISONS:
        line, operator = cursor.line, cursor.kind
        cursor.step()
        return Binary(line, operator, left, _sum(cursor))
    return left


def _sum(cursor: Cursor) -> Expression:
    left, count = _product(cursor), 0
    while cursor.kind in _SUMS:
        line, operator, count = cursor.line, cursor.kind, count + 1
        if count > _MOST_OPERANDS:
            cursor.refuse(f"more than {_MOST_OPERANDS} operands stand in one sum or product")
        cursor.step()
        left = Binary(line, operator, left, _product(cursor))
    return left


def _product(cursor: Cursor) -> Expression:
    # Most operands have no sign.
    left, count = _primary(cursor) if cursor.kind == "name" else _signed(cursor), 0
    while cursor.kind in _PRODUCTS:
        line, operator, count = cursor.line, cursor.kind, count + 1
        if count > _MOST_OPERANDS:
            cursor.refuse(f"more than {_MOST_OPERANDS} operands stand in one sum or product")
        cursor.step()
        left = Binary(line, operator, left, _signed(cursor))
    return left


def _signed(cursor: Cursor) -> Expression:
    if cursor.kind not in _SUMS:
        return _primary(cursor)
    line, operator = cursor.line, cursor.kind
    cursor.step()
    operand = _signed(cursor)
    if isinstance(operand, Literal) and isinstance(operand.value, float):
        return Literal(line, -operand.value if operator == "-" else operand.value)
    return Unary(line, operator, operand)


def _primary(cursor: Cursor) -> Expression:
    line = cursor.line
    if cursor.kind == "name":
        return _of_name(cursor, line)
    if cursor.kind in _LITERALS:
        return Literal(line, cursor.value())
    if cursor.kind in _TRUTHS:
        truth = cursor.kind == "TRUE"
        cursor.step()
        return Literal(line, truth)
    if cursor.take("["):
        return _aggregate(line, () if cursor.take("]") else expressions(cursor, "]"))
    if not cursor.take("("):
        cursor.refuse(f"a value is missing: found {cursor.shown()}")
    inner = expression(cursor)
    cursor.need(")", "an expression")
    return inner


def _of_name(cursor: Cursor, line: int) -> Expression:
    name = cursor.name("a datum")
    # Most names are alone.
    if cursor.kind not in _GOES_ON:
        return Name(line, name)
    if not cursor.take("("):
        return reference(cursor, name, line)
    found = arguments(cursor, ")")
    cursor.step()
    return FunctionCall(line, name, found)


def _aggregate(line: int, parts: tuple[Expression, ...]) -> Expression:
    values: list[Value] = [part.value for part in parts if isinstance(part, Literal)]
    return Literal(line, tuple(values)) if len(values) == len(parts) else Aggregate(line, parts)
