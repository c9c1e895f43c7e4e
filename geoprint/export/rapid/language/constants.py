"""Judges declared data: types exist, constants are constant, PERS begin with literals, arrays have sizes."""

from __future__ import annotations

from collections.abc import Sequence

from geoprint.export.rapid.language.context import Context
from geoprint.export.rapid.language.expression_kinds import judge
from geoprint.export.rapid.language.kinds import NUM
from geoprint.export.rapid.language.syntax import (
    Aggregate,
    Binary,
    Component,
    Datum,
    Element,
    Expression,
    FunctionCall,
    Literal,
    Name,
    Unary,
)


def judge_data(data: Sequence[Datum], here: Context, *, closed: bool) -> None:
    """Judge data of a module or a routine."""
    for datum in data:
        judge_type(datum.kind, datum.line, here)
        for size in datum.sizes:
            judge(size, here, wanted=NUM, what="the size of an array")
            _judge_constant(size, f"the size of {datum.name}", here)
        if datum.value is not None:
            _judge_value(datum, datum.value, here)
        elif datum.storage == "CONST":
            here.say(datum.line, f"{datum.name} is a CONST without a value")
        elif datum.storage == "PERS" and closed:
            here.say(datum.line, f"{datum.name} is a PERS without a value to begin with")


def judge_type(name: str, line: int, here: Context) -> None:
    """Judge the name of a type where one is used."""
    symbol = here.names.find(name, file=here.file, inner={})
    if symbol is None:
        here.miss(line, name)
    elif symbol.role not in {"type", "known"}:
        here.say(line, f"{name} is no type")


def _judge_value(datum: Datum, value: Expression, here: Context) -> None:
    kind = here.kinds.of_type(datum.kind, file=here.file, dimensions=len(datum.sizes))
    if isinstance(value, Literal):
        sizes = tuple(_number(size) for size in datum.sizes)
        if why := here.kinds.misfit(value.value, kind, sizes):
            here.say(value.line, f"{datum.name}: {why}")
        return
    judge(value, here, wanted=kind, what=datum.name)
    if datum.storage == "PERS":
        here.say(datum.line, f"{datum.name} is a PERS, and begins with a literal only")
    else:
        _judge_constant(value, datum.name, here)


def _number(size: Expression) -> int | None:
    return int(size.value) if isinstance(size, Literal) and isinstance(size.value, float) else None


def _judge_constant(expression: Expression, what: str, here: Context) -> None:
    """Judge that nothing in an expression can change."""
    match expression:
        case Aggregate():
            for part in expression.parts:
                _judge_constant(part, what, here)
        case Binary():
            _judge_constant(expression.left, what, here)
            _judge_constant(expression.right, what, here)
        case Unary():
            _judge_constant(expression.operand, what, here)
        case Component() | Element():
            _judge_constant(expression.of, what, here)
        case FunctionCall():
            here.say(expression.line, f"{what} is to be constant, and {expression.name} is a function")
        case Name():
            symbol = here.find(expression.name)
            if symbol is not None and isinstance(symbol.node, Datum) and symbol.node.storage != "CONST":
                here.say(expression.line, f"{what} is to be constant, and {expression.name} is a {symbol.node.storage}")
        case Literal():
            pass
