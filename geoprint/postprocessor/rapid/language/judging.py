"""Judges expressions, calls and statements: names mean something, kinds fit, jumps land."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

from geoprint.errors import how_many
from geoprint.postprocessor.rapid.language.context import Context
from geoprint.postprocessor.rapid.language.kinds import (
    BOOL,
    CONFIGURED,
    DNUM,
    LARGEST_NUM,
    NUM,
    NUMBER,
    STRING,
    Kind,
    fits,
    kind_of_literal,
)
from geoprint.postprocessor.rapid.language.names import Symbol
from geoprint.postprocessor.rapid.language.syntax import (
    Aggregate,
    Argument,
    Assignment,
    Binary,
    Call,
    Component,
    Connect,
    Datum,
    Element,
    Expression,
    For,
    FunctionCall,
    Goto,
    If,
    Label,
    Leave,
    Literal,
    Name,
    Parameter,
    Routine,
    Series,
    Statement,
    Test,
    Unary,
    While,
)

# Judges the arguments of a call against the parameters of its routine: number, order, names, groups, kind and mode.
#
# Arguments stand in the order of the parameters. Of parameters that exclude each other (`\A | \B`, or two that one
# value may fill) one is given at most; one that stands without a backslash must be given.


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
            here.say(line, f"{name} lacks the argument {parameter.name}")
    for argument, parameter in matched:
        _judge_argument(argument, parameter, symbol, here, judge=judge)


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
            here.say(argument.line, f"{name} is given {parameter.name} twice, or together with what excludes it")
        elif parameter.group < last:
            here.say(argument.line, f"{name} takes {parameter.name} further ahead among its arguments")
        last = max(last, parameter.group)
        last_required = last_required if parameter.optional else max(last_required, parameter.group)
        found.append((argument, parameter))
    return found


def _parameter_of(argument: Argument, parameters: Sequence[Parameter], last: int) -> Parameter | None:
    if argument.name:
        word = argument.name.lower()
        return next((one for one in parameters if one.name.lower() == word and one.optional == argument.optional), None)
    return next((one for one in parameters if not one.optional and one.group > last), None)


def _judge_argument(
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
            here.say(argument.line, f"{what} {'is a switch and takes no value' if is_switch else 'needs a value'}")
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
        here.say(argument.line, f"{argument.forwarded} is not an optional parameter here, and {what} is to receive it")
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
        here.say(argument.line, f"{what} is passed by reference, so it must be a variable")
        return
    symbol = here.find(root.name)
    node = symbol.node if symbol else None
    if symbol is None or (is_signal and symbol.role == "signal"):
        return
    storage = node.storage if isinstance(node, Datum) else ""
    mode = node.mode if isinstance(node, Parameter) else ""
    if symbol.role == "loop" or (storage == "CONST" and not is_signal):
        here.say(argument.line, f"{what} is passed by reference, but {root.name} never changes")
    elif parameter.mode == "PERS" and (storage == "VAR" or (isinstance(node, Parameter) and mode in {"", "VAR"})):
        here.say(argument.line, f"{what} needs a PERS, but {root.name} is not one")
    elif parameter.mode == "VAR" and (storage == "PERS" or mode == "PERS"):
        here.say(argument.line, f"{what} needs a VAR, but {root.name} is a PERS")


# Judges expressions: every name means something, operators and parts have what they need, and what kind results.


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
            here.say(expression.line, f"{why}, needed for {what}" if what else why)
        return wanted if isinstance(expression.value, tuple) else kind_of_literal(expression)
    if isinstance(expression, Aggregate):
        _judge_aggregate(expression, here, wanted)
        return wanted
    if isinstance(expression, Name) and wanted is not None and wanted.name in CONFIGURED:
        found = _configured(expression, here)
    else:
        found = _kind(expression, here)
    if not fits(found, wanted) and found is not None and wanted is not None:
        here.say(expression.line, f"{what or 'this'} needs a {wanted.shown()}, found a {found.shown()}")
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
        here.say(name.line, f"{name.name} is a {symbol.role}; a value is needed here")
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
        here.say(element.line, f"a {of.shown()} is given {how_many(len(element.indices), 'index', 'indices')}")
        return None
    return of._replace(dimensions=0)


def _function(call: FunctionCall, here: Context) -> Kind | None:
    symbol = here.find(call.name)
    if symbol is None:
        here.miss(call.line, call.name)
    elif symbol.role not in {"routine", "known"}:
        here.say(call.line, f"{call.name} is not a function")
    elif isinstance(symbol.node, Routine) and symbol.node.kind != "FUNC":
        here.say(call.line, f"{call.name} is a {symbol.node.kind}; a function is needed here")
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
        here.say(call.line, "Present takes one parameter of its routine")
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
            here.say(aggregate.line, f"a {wanted.shown()} has {how_many(len(components), 'component')}, found {found}")
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
        here.say(unary.line, f"{unary.operator} cannot be applied to a {kind.shown()}")
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
            here.say(binary.line, f"a {left.shown()} cannot be compared with a {right.shown()}")
        return BOOL
    if left is None or right is None:
        return BOOL if operator in _ORDER else None
    found = _TABLE.get((operator, left, right))
    if found is None:
        here.say(binary.line, f"{operator} cannot be applied to a {left.shown()} and a {right.shown()}")
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


# Judges the statements of routines: conditions, assignments, calls, jumps and what leaves a routine.


_INTERRUPT = Kind("num")


def judge_body(statements: Sequence[Statement], here: Context) -> None:
    """Judge statements, and those within them."""
    for statement in statements:
        match statement:
            case Call():
                _once(statement, here)
            case Series():
                _series(statement, here)
            case Assignment():
                _once(statement, here)
            case If() | Test() | For() | While():
                _compound(statement, here)
            case Leave():
                _leave(statement, here)
            case Goto() | Label():
                _jump(statement, here)
            case Connect():
                _connect(statement, here)


def labels_in(statements: Iterable[Statement]) -> list[Label]:
    """Return the labels among statements and those within them."""
    found: list[Label] = []
    for statement in statements:
        match statement:
            case Label():
                found.append(statement)
            case If():
                for _, body in statement.branches:
                    found += labels_in(body)
                found += labels_in(statement.otherwise)
            case Test():
                for _, body in statement.cases:
                    found += labels_in(body)
                found += labels_in(statement.default)
            case For() | While():
                found += labels_in(statement.body)
            case _:
                pass
    return found


def _compound(statement: If | Test | For | While, here: Context) -> None:
    match statement:
        case If():
            for condition, body in statement.branches:
                judge(condition, here, wanted=BOOL, what="IF")
                judge_body(body, here)
            judge_body(statement.otherwise, here)
        case Test():
            _test(statement, here)
        case For():
            for bound in (statement.first, statement.last, statement.step):
                if bound is not None:
                    judge(bound, here, wanted=NUM, what="FOR")
            judge_body(statement.body, here.within_loop(statement.variable, statement.line))
        case While():
            judge(statement.condition, here, wanted=BOOL, what="WHILE")
            judge_body(statement.body, here)


def _test(test: Test, here: Context) -> None:
    subject = judge(test.subject, here)
    wanted = NUM if subject is not None and subject.name.startswith("signal") else subject
    for values, body in test.cases:
        for value in values:
            judge(value, here, wanted=wanted, what="CASE")
        judge_body(body, here)
    judge_body(test.default, here)


def _assignment(assignment: Assignment, here: Context) -> None:
    target = judge(assignment.target, here)
    root = root_of(assignment.target)
    symbol = here.find(root.name) if root else None
    if symbol is not None and root is not None:
        if isinstance(symbol.node, Datum) and symbol.node.storage == "CONST":
            here.say(assignment.line, f"{root.name} is a CONST, but a value is assigned to it")
        elif symbol.role in {"loop", "signal"}:
            here.say(assignment.line, f"no value can be assigned to {root.name}, which is a {symbol.role}")
    judge(assignment.value, here, wanted=target, what="the assignment")


def _once(statement: Call | Assignment, here: Context) -> None:
    """Judge a call or an assignment, or leave it where one that differs in numbers only was judged before."""
    form = None if here.inner else form_of(statement)
    if form is None:
        _judge_one(statement, here)
    elif form not in here.sound:
        if _is_sound(statement, here):
            here.sound.add(form)
        else:
            _judge_one(statement, here)


def _judge_one(statement: Call | Assignment, here: Context) -> None:
    if isinstance(statement, Assignment):
        _assignment(statement, here)
    else:
        _call(statement, here)


def _call(call: Call, here: Context) -> None:
    if call.late is not None:
        judge(call.late, here, wanted=STRING, what="a late call")
        if not isinstance(call.late, Literal) or not isinstance(call.late.value, str):
            judge_parts(call.arguments, here)
            return
    name = call.late.value if isinstance(call.late, Literal) else call.name
    # A late call may name the module, too.
    name = str(name).rpartition(":")[2]
    symbol = here.find(name)
    if symbol is None:
        here.miss(call.line, name)
    elif symbol.role not in {"routine", "known"}:
        here.say(call.line, f"{name} is not a procedure")
    elif isinstance(symbol.node, Routine) and symbol.node.kind != "PROC":
        here.say(call.line, f"{name} is a {symbol.node.kind}; a procedure is needed here")
    elif isinstance(symbol.node, Routine):
        judge_arguments(call.line, call.arguments, symbol, here, judge=judge)
        return
    judge_parts(call.arguments, here)


def _series(series: Series, here: Context) -> None:
    """Judge one call of each form; where something is wrong with one, or a number is too large, all of them."""
    sound: set[object] = set() if here.inner else here.sound
    forms = {form for form in set(series.forms) if form not in sound}
    wrong = [form for form in sorted(forms) if not _is_sound(series.shapes[form], here)]
    if wrong or max(series.numbers) > LARGEST_NUM or min(series.numbers) < -LARGEST_NUM:
        for call in series.calls():
            _call(call, here)
    else:
        sound.update(forms)


def _is_sound(statement: Call | Assignment, here: Context) -> bool:
    """Whether nothing is wrong with a statement."""
    wrong: list[str] = []

    def note(_: int, what: str) -> None:
        wrong.append(what)

    _judge_one(statement, replace(here, say=note, miss=note))
    return not wrong


def _leave(leave: Leave, here: Context) -> None:
    routine = here.routine
    if leave.verb in {"RETRY", "TRYNEXT"} and not here.handling:
        here.say(leave.line, f"{leave.verb} is outside an error handler")
    elif leave.verb == "RAISE":
        if leave.value is not None:
            judge(leave.value, here, wanted=NUM, what="RAISE")
        elif not here.handling:
            here.say(leave.line, "RAISE without a number is outside an error handler")
    elif leave.verb == "RETURN" and routine is not None:
        if routine.kind != "FUNC" and leave.value is not None:
            here.say(leave.line, f"{routine.name} is a {routine.kind} and returns no value")
        elif routine.kind == "FUNC" and leave.value is None:
            here.say(leave.line, f"{routine.name} is a function, but RETURN has no value")
        elif leave.value is not None:
            wanted = here.kinds.of_type(routine.returns, file=here.file)
            judge(leave.value, here, wanted=wanted, what=f"RETURN of {routine.name}")


def _jump(statement: Goto | Label, here: Context) -> None:
    if isinstance(statement, Goto) and statement.label.lower() not in here.labels:
        here.say(statement.line, f"GOTO {statement.label}: no such label in this routine")


def _connect(connect: Connect, here: Context) -> None:
    kind = judge(connect.interrupt, here)
    if not fits(kind, _INTERRUPT) and kind is not None:
        here.say(connect.line, f"CONNECT needs an intnum, found a {kind.shown()}")
    trap = here.find(connect.trap)
    if trap is None:
        here.miss(connect.line, connect.trap)
    elif trap.role != "known" and (not isinstance(trap.node, Routine) or trap.node.kind != "TRAP"):
        here.say(connect.line, f"{connect.trap} is not a trap")
