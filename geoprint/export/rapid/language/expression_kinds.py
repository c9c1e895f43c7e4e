"""Judges expressions: every name means something, operators and parts have what they need, and what kind results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from geoprint.export.rapid.language.calls import judge_arguments
from geoprint.export.rapid.language.context import Context
from geoprint.export.rapid.language.kinds import (
    BOOL,
    CONFIGURED,
    DNUM,
    NUM,
    NUMBER,
    STRING,
    Kind,
    fits,
    kind_of_literal,
)
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
    Parameter,
    Routine,
    Unary,
)

_NUMERIC = {NUM, DNUM, NUMBER}
_POS, _ORIENT = Kind("pos"), Kind("orient")
_LOGICAL = frozenset({"AND", "OR", "XOR"})
_EQUALITY = frozenset({"=", "<>"})
_ORDER = frozenset({"<", ">", "<=", ">="})
_COMPARED = _EQUALITY | _ORDER
# What the operators make of two values other than numbers.
_TABLE = {
    ("+", STRING, STRING): STRING,
    ("+", _POS, _POS): _POS,
    ("-", _POS, _POS): _POS,
    ("*", _POS, _POS): _POS,
    ("*", _ORIENT, _ORIENT): _ORIENT,
    **{("*", _POS, one): _POS for one in (NUM, NUMBER)},
    **{("*", one, _POS): _POS for one in (NUM, NUMBER)},
    **{("/", _POS, one): _POS for one in (NUM, NUMBER)},
}


def judge(expression: Expression, here: Context, *, wanted: Kind | None = None, what: str = "") -> Kind | None:
    """Judge an expression and return its kind, None where it is not known.

    Args:
        expression: to judge.
        here: where it stands.
        wanted: the kind that it must have; None where any will do.
        what: for whom, for messages.
    """
    if isinstance(expression, Literal):
        if why := here.kinds.misfit(expression.value, wanted):
            here.say(expression.line, f"{why}, wanted for {what}" if what else why)
        return wanted if isinstance(expression.value, tuple) else kind_of_literal(expression)
    if isinstance(expression, Aggregate):
        _judge_aggregate(expression, here, wanted)
        return wanted
    if isinstance(expression, Name) and wanted is not None and wanted.name in CONFIGURED:
        found = _configured(expression, here)
    else:
        found = _kind(expression, here)
    if not fits(found, wanted) and found is not None and wanted is not None:
        here.say(expression.line, f"{what or 'this'} wants a {wanted.shown()}, found a {found.shown()}")
    return found


def _kind(expression: Expression, here: Context) -> Kind | None:
    return _KINDS[type(expression)](expression, here)


def _literal(literal: Literal, _: Context) -> Kind | None:
    return kind_of_literal(literal)


def _aggregate(aggregate: Aggregate, here: Context) -> None:
    _judge_aggregate(aggregate, here, None)


def _name(name: Name, here: Context) -> Kind | None:
    known = here.known.get(name.name)
    if known is not None:
        return known
    found = _found(name, here)
    if found is not None:
        here.known[name.name] = found
    return found


def _found(name: Name, here: Context) -> Kind | None:
    symbol = here.find(name.name)
    if symbol is None:
        here.miss(name.line, name.name)
        return None
    if symbol.role in {"routine", "type", "module"}:
        here.say(name.line, f"{name.name} is a {symbol.role}, and a value is wanted")
        return None
    if isinstance(symbol.node, Parameter) and symbol.node.kind.lower() == "switch":
        here.say(name.line, f"{name.name} is a switch, which has no value: ask Present({name.name})")
        return None
    return here.kinds.of_symbol(symbol)


def _configured(name: Name, here: Context) -> Kind | None:
    """Judge a name in the place of a signal or another thing of the controller's configuration."""
    if here.find(name.name) is None and here.names.signals is None:
        here.assume(name.name)
        return None
    return _name(name, here)


def _component(component: Component, here: Context) -> Kind | None:
    of = _kind(component.of, here)
    if of is None:
        return None
    parts = here.kinds.components(of)
    found = dict(parts or ())
    if component.name.lower() not in found:
        here.say(component.line, f"a {of.shown()} has no component {component.name}")
        return None
    return found[component.name.lower()]


def _element(element: Element, here: Context) -> Kind | None:
    for index in element.indices:
        judge(index, here, wanted=NUM, what="an index")
    of = _kind(element.of, here)
    if of is None:
        return None
    if of.dimensions != len(element.indices):
        here.say(element.line, f"{len(element.indices)} indices are given to a {of.shown()}")
        return None
    return of._replace(dimensions=0)


def _function(call: FunctionCall, here: Context) -> Kind | None:
    symbol = here.find(call.name)
    if symbol is None:
        here.miss(call.line, call.name)
    elif symbol.role not in {"routine", "known"}:
        here.say(call.line, f"{call.name} is no function")
    elif isinstance(symbol.node, Routine) and symbol.node.kind != "FUNC":
        here.say(call.line, f"{call.name} is a {symbol.node.kind}, and a function is wanted")
    elif call.name.lower() == "present":
        _present(call, here)
        return BOOL
    elif isinstance(symbol.node, Routine):
        judge_arguments(call.line, call.arguments, symbol, here, judge=judge)
        return here.kinds.of_symbol(symbol)
    judge_parts(call.arguments, here)
    return None


def _present(call: FunctionCall, here: Context) -> None:
    """Judge the question whether a parameter is given, a switch among them, which has no value."""
    value = call.arguments[0].value if len(call.arguments) == 1 else None
    if not isinstance(value, Name):
        here.say(call.line, "Present asks for one parameter of its routine")
    elif here.find(value.name) is None:
        here.miss(call.line, value.name)


def judge_parts(arguments: tuple[Argument, ...], here: Context) -> None:
    """Judge the arguments of a routine that is not known: only their parts."""
    for argument in arguments:
        # A lone name may be a signal.
        if isinstance(argument.value, Name) and here.find(argument.value.name) is None and here.names.signals is None:
            here.assume(argument.value.name)
        elif argument.value is not None:
            judge(argument.value, here)


def _judge_aggregate(aggregate: Aggregate, here: Context, wanted: Kind | None) -> None:
    parts: tuple[Kind | None, ...] = (None,) * len(aggregate.parts)
    if wanted is not None and wanted.dimensions:
        parts = (wanted._replace(dimensions=wanted.dimensions - 1),) * len(aggregate.parts)
    elif wanted is not None and wanted.name != "anytype":
        components = here.kinds.components(wanted)
        if components is not None and len(components) != len(aggregate.parts):
            found = len(aggregate.parts)
            here.say(aggregate.line, f"a {wanted.shown()} has {len(components)} components, found {found}")
        elif components is not None:
            parts = tuple(kind for _, kind in components)
    for part, kind in zip(aggregate.parts, parts, strict=True):
        judge(part, here, wanted=kind, what="a component")


def _unary(unary: Unary, here: Context) -> Kind | None:
    if unary.operator == "NOT":
        judge(unary.operand, here, wanted=BOOL, what="NOT")
        return BOOL
    kind = _value(_kind(unary.operand, here))
    if kind is not None and kind not in _NUMERIC and kind != _POS:
        here.say(unary.line, f"{unary.operator} has no meaning for a {kind.shown()}")
        return None
    return kind


def _binary(binary: Binary, here: Context) -> Kind | None:
    operator = binary.operator
    if operator in _LOGICAL:
        judge(binary.left, here, wanted=BOOL, what=operator)
        judge(binary.right, here, wanted=BOOL, what=operator)
        return BOOL
    # In a long sum each operand stands to the right of all before it.
    within = [binary]
    while isinstance(inner := within[-1].left, Binary) and inner.operator not in _LOGICAL:
        within.append(inner)
    left, right = _sides(within[-1], here)
    found = _result(within.pop(), left, right, here)
    for outer in reversed(within):
        left = _value(found)
        other = outer.right
        right = judge(other, here, wanted=left) if isinstance(other, Aggregate) else _operand(other, here)
        found = _result(outer, left, right, here)
    return found


def _operand(expression: Expression, here: Context) -> Kind | None:
    return _value(_kind(expression, here))


def _result(binary: Binary, left: Kind | None, right: Kind | None, here: Context) -> Kind | None:
    """Return what an operator makes of values of two kinds."""
    operator = binary.operator
    # Most of what stands in long sums are numbers.
    same = left is NUM and right is NUM
    if same or (left in _NUMERIC and right in _NUMERIC and (left == right or NUMBER in {left, right})):
        return BOOL if operator in _COMPARED else right if left == NUMBER else left
    if operator in _EQUALITY:
        if not fits(left, right) and not fits(right, left) and left is not None and right is not None:
            here.say(binary.line, f"a {left.shown()} is compared with a {right.shown()}")
        return BOOL
    if left is None or right is None:
        return BOOL if operator in _ORDER else None
    found = _TABLE.get((operator, left, right))
    if found is None:
        here.say(binary.line, f"{operator} has no meaning between a {left.shown()} and a {right.shown()}")
        return BOOL if operator in _ORDER else None
    return found


def _sides(binary: Binary, here: Context) -> tuple[Kind | None, Kind | None]:
    """Judge both sides; an aggregate is of the kind of the other side."""
    one, other = binary.left, binary.right
    left = None if isinstance(one, Aggregate) else _operand(one, here)
    right = None if isinstance(other, Aggregate) else _operand(other, here)
    if isinstance(one, Aggregate):
        left = judge(one, here, wanted=right)
    if isinstance(other, Aggregate):
        right = judge(other, here, wanted=left)
    return left, right


def _value(kind: Kind | None) -> Kind | None:
    """Return what a signal is as a value: a number."""
    if kind is None or kind in _NUMERIC:
        return kind
    if kind.name.startswith("signal") and not kind.dimensions:
        return NUM
    return None if kind.name == "anytype" else kind


_KINDS: Mapping[type, Callable[[Any, Context], Kind | None]] = {
    Literal: _literal, Aggregate: _aggregate, Name: _name, Component: _component, Element: _element,
    FunctionCall: _function, Unary: _unary, Binary: _binary,
}  # fmt: skip
