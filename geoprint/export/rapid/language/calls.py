r"""Judges the arguments of a call against the parameters of its routine: number, order, names, groups, kind and mode.

Arguments stand in the order of the parameters. Of parameters that exclude each other (`\A | \B`, or two that one value
may fill) one is given at most; one that stands without a backslash must be given.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from geoprint.export.rapid.language.context import Context
from geoprint.export.rapid.language.kinds import CONFIGURED, LARGEST_NUM, Kind
from geoprint.export.rapid.language.names import Symbol
from geoprint.export.rapid.language.syntax import (
    Argument,
    Assignment,
    Binary,
    Call,
    Component,
    Datum,
    Element,
    Expression,
    FunctionCall,
    Literal,
    Name,
    Parameter,
    Routine,
)


class _ExpressionJudge(Protocol):
    def __call__(
        self, expression: Expression, here: Context, *, wanted: Kind | None = None, what: str = ""
    ) -> Kind | None: ...


def judge_arguments(
    line: int, arguments: Sequence[Argument], symbol: Symbol, here: Context, *, judge: _ExpressionJudge
) -> None:
    """Judge the arguments of a call.

    Args:
        line: of the call.
        arguments: that it hands over.
        symbol: the routine.
        here: where the call stands.
        judge: for expressions.
    """
    routine = symbol.node
    if not isinstance(routine, Routine):
        return
    name = routine.name
    matched = _matched(name, arguments, routine, here)
    given = {parameter.group for _, parameter in matched}
    for parameter in routine.parameters:
        if not parameter.optional and parameter.group not in given and len(matched) == len(arguments):
            given.add(parameter.group)
            here.say(line, f"{name} is not given its argument {parameter.name}")
    for argument, parameter in matched:
        _judge_one(argument, parameter, symbol, here, judge=judge)


def _matched(
    name: str, arguments: Sequence[Argument], routine: Routine, here: Context
) -> list[tuple[Argument, Parameter]]:
    """Return each argument with its parameter, as far as they have one."""
    found: list[tuple[Argument, Parameter]] = []
    last = last_required = -1
    for argument in arguments:
        parameter = _parameter_of(argument, routine.parameters, last_required)
        if parameter is None:
            what = f"\\{argument.name}" if argument.optional else argument.name or "a further argument"
            here.say(argument.line, f"{name} takes no {what}")
            continue
        if any(other.group == parameter.group for _, other in found):
            here.say(argument.line, f"{name} is given {parameter.name} beside what it excludes, or twice")
        elif parameter.group < last:
            here.say(argument.line, f"{name} takes {parameter.name} before the arguments in front of it")
        last = max(last, parameter.group)
        last_required = last_required if parameter.optional else max(last_required, parameter.group)
        found.append((argument, parameter))
    return found


def _parameter_of(argument: Argument, parameters: Sequence[Parameter], last: int) -> Parameter | None:
    if argument.name:
        word = argument.name.lower()
        return next((one for one in parameters if one.name.lower() == word and one.optional == argument.optional), None)
    return next((one for one in parameters if not one.optional and one.group > last), None)


def _judge_one(
    argument: Argument, parameter: Parameter, symbol: Symbol, here: Context, *, judge: _ExpressionJudge
) -> None:
    routine = symbol.node
    what = f"{parameter.name} of {symbol.name}"
    is_switch = parameter.kind.lower() == "switch"
    if argument.forwarded:
        _judge_forwarded(argument, parameter, what, here)
        return
    if is_switch or argument.value is None:
        if (argument.value is None) != is_switch:
            here.say(argument.line, f"{what} {'is a switch and takes no value' if is_switch else 'wants a value'}")
        return
    # One value may fill one of several parameters: as the first of the kind that fits.
    rivals = [parameter]
    if not argument.name and isinstance(routine, Routine):
        rivals = [one for one in routine.parameters if one.group == parameter.group]
    kinds = [here.kinds.of_type(one.kind, file=symbol.file, dimensions=one.dimensions) for one in rivals]
    wanted = kinds[0] if len(kinds) == 1 else None
    found = judge(argument.value, here, wanted=wanted, what=what)
    if len(kinds) > 1 and found is not None and not any(_alike(found, kind) for kind in kinds):
        here.say(argument.line, f"{what} cannot be a {found.shown()}")
    if parameter.mode:
        _judge_mode(argument, parameter, what, here, is_signal=wanted is not None and wanted.name in CONFIGURED)


def _alike(found: Kind, wanted: Kind | None) -> bool:
    if wanted is None or wanted.name == "anytype" or found == wanted:
        return True
    return found.name == "number" and wanted.name in {"num", "dnum"} and not wanted.dimensions


def _judge_forwarded(argument: Argument, parameter: Parameter, what: str, here: Context) -> None:
    given = here.inner.get(argument.forwarded.lower())
    node = given.node if given else None
    if not isinstance(node, Parameter) or not node.optional:
        here.say(argument.line, f"{argument.forwarded} is no optional parameter here, and {what} is to be given on")
    elif (node.kind.lower() == "switch") != (parameter.kind.lower() == "switch"):
        here.say(argument.line, f"{what} is a {parameter.kind}, and {argument.forwarded} is a {node.kind}")


def form_of(statement: Call | Assignment) -> object:
    """Return what statements have in common that differ in numbers only; None for more than names, sums and calls.

    Long sums are judged as fast as they are compared.
    """
    if isinstance(statement, Assignment):
        target, value = _form_of(statement.target), _form_of(statement.value)
        return None if target is None or value is None else (":=", target, value)
    parts = _forms_of(statement.arguments)
    return None if parts is None or statement.late is not None else (statement.name, *parts)


def _forms_of(arguments: Sequence[Argument]) -> list[object] | None:
    parts = [(each.name, each.optional, each.forwarded, _form_of(each.value)) for each in arguments]
    return None if any(part[3] is None for part in parts) else [*parts]


def _form_of(value: Expression | None) -> object:
    if isinstance(value, Name):
        return value.name
    if isinstance(value, FunctionCall):
        parts = _forms_of(value.arguments)
        return None if parts is None else (value.name, "()", *parts)
    if isinstance(value, Binary) and not isinstance(value.left, Binary):
        left, right = _form_of(value.left), _form_of(value.right)
        return None if left is None or right is None else (value.operator, left, right)
    if isinstance(value, Literal):
        return 0 if isinstance(value.value, float) and abs(value.value) <= LARGEST_NUM else None
    return () if value is None else None


def root_of(expression: Expression) -> Name | None:
    """Return the name of the datum whose part this is, or None where it is no part of a datum."""
    while isinstance(expression, Component | Element):
        expression = expression.of
    return expression if isinstance(expression, Name) else None


def _judge_mode(argument: Argument, parameter: Parameter, what: str, here: Context, *, is_signal: bool) -> None:
    """Judge what is handed over by reference."""
    value = argument.value
    root = None if value is None or isinstance(value, Literal) else root_of(value)
    if root is None:
        here.say(argument.line, f"{what} is handed over by reference, and this is no datum")
        return
    symbol = here.find(root.name)
    node = symbol.node if symbol else None
    if symbol is None or (is_signal and symbol.role == "signal"):
        return
    storage = node.storage if isinstance(node, Datum) else ""
    mode = node.mode if isinstance(node, Parameter) else ""
    if symbol.role == "loop" or (storage == "CONST" and not is_signal):
        here.say(argument.line, f"{what} is handed over by reference, and {root.name} never changes")
    elif parameter.mode == "PERS" and (storage == "VAR" or (isinstance(node, Parameter) and mode in {"", "VAR"})):
        here.say(argument.line, f"{what} wants a PERS, and {root.name} is none")
    elif parameter.mode == "VAR" and (storage == "PERS" or mode == "PERS"):
        here.say(argument.line, f"{what} wants a VAR, and {root.name} is a PERS")
