"""Compiles expressions to functions of the state; what they name is looked up once, here."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from typing import Any, cast

from geoprint.postprocessor.rapid.language.kinds import STRING_LENGTH
from geoprint.postprocessor.rapid.language.syntax import (
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
from geoprint.postprocessor.rapid.machine.calls import binder, options_of, positional
from geoprint.postprocessor.rapid.machine.functions import FUNCTION_OPTIONS, FUNCTIONS
from geoprint.postprocessor.rapid.machine.state import ELEMENTS, MISSING, Missing, Reference, State, elements
from geoprint.postprocessor.rapid.machine.stepping import NODES, Code, Evaluate, Local, Scope, evaluate_routine
from geoprint.postprocessor.rapid.machine.values import ARITHMETIC, PREDEFINED, fault, times, unknown

# Functions that compute where the arm is, and for how much one counts.
_OF_ARM = frozenset({"cjointt", "crobt", "cpos"})
_WEIGHT_OF_ARM = 80 * NODES
_COMPARISONS: dict[str, Callable[[Any, Any], Any]] = {
    "=": operator.eq, "<>": operator.ne, "<": operator.lt, ">": operator.gt, "<=": operator.le, ">=": operator.ge,
}  # fmt: skip


def compiled(expression: Expression, scope: Scope) -> Code:
    """Compile an expression.

    Raises:
        VerificationError: it names or does what this machine does not know.
    """
    scope.nodes += 1
    return _MAKERS[type(expression)](expression, scope)


def operand(expression: Expression, scope: Scope) -> Code:
    """Compile an expression whose value is computed with: of a signal the value that it has now."""
    code = compiled(expression, scope)
    if not code.kind.startswith("signal"):
        return code
    name = code.run
    return Code("num", lambda state: state.signals.get(cast("str", name(state)), 0.0))


def reference(expression: Expression, scope: Scope) -> Callable[[State], Reference]:
    """Compile what is handed over itself, or assigned to.

    Raises:
        VerificationError: it is no datum.
    """
    if isinstance(expression, Component | Element):
        inner = reference(expression.of, scope)
        place = _path(expression, scope)

        def part(state: State) -> Reference:
            whole = inner(state)
            return Reference(whole.frame, whole.slot, whole.path + place(state, whole))

        return part
    if not isinstance(expression, Name):
        unknown(scope.file, expression.line, "a value is passed where a variable is needed")
    local = scope.locals.get(expression.name.lower())
    if local is not None:
        slot = local.slot
        if local.by_reference:
            return lambda state: _present(state.local[slot], expression.name)
        return lambda state: Reference(len(state.frames) - 1, slot)
    datum = scope.datum(expression.name)
    if datum is None:
        unknown(scope.file, expression.line, f"{expression.name} is unknown to this machine")
    found = Reference(-1, datum.slot)
    return lambda _: found


def _present(value: object, name: str) -> Reference:
    if isinstance(value, Missing):
        fault("ERR_NOTPRES", f"{name} is used, but was left out")
    return cast("Reference", value)


def _literal(expression: Literal, _: Scope) -> Code:
    value = expression.value
    kind = "bool" if isinstance(value, bool) else "string" if isinstance(value, str) else ""
    return Code("num" if isinstance(value, float) else kind, lambda _: value)


def _aggregate(expression: Aggregate, scope: Scope) -> Code:
    parts = [compiled(part, scope).run for part in expression.parts]
    return Code("", lambda state: tuple([part(state) for part in parts]))


def _name(expression: Name, scope: Scope) -> Code:
    name = expression.name.lower()
    local = scope.locals.get(name)
    if local is not None:
        return _own(local, expression.name)
    if name not in scope.named:
        scope.named[name] = _of_all(expression, scope)
    return scope.named[name]


def _of_all(expression: Name, scope: Scope) -> Code:
    """Return what a name gives that no routine declares."""
    name = expression.name.lower()
    datum = scope.datum(name)
    if datum is not None:
        at = datum.slot
        known: Evaluate = lambda state: cast("Value", state.data[at])  # noqa: E731
        return Code(datum.kind, known if datum.resident else Reference(-1, at).get)
    if name == "errno":
        return Code("num", lambda state: state.error.number if state.error is not None else 0.0)
    if name in PREDEFINED:
        kind, value = PREDEFINED[name]
        return Code(kind, lambda _: value)
    if name not in scope.declared.signals:
        unknown(scope.file, expression.line, f"{expression.name} is unknown to this machine as data or signal")
    return Code(scope.declared.signals[name], lambda _: name)


def _own(local: Local, name: str) -> Code:
    """Return the value of a routine's own datum, or of what was handed over in its place."""
    slot = local.slot
    if local.by_reference:
        return Code(local.kind, lambda state: _present(state.local[slot], name).get(state))

    def own(state: State) -> Value:
        value = state.local[slot]
        if value is MISSING:
            fault("ERR_NOTPRES", f"{name} is used, but was left out")
        return cast("Value", value)

    return Code(local.kind, own)


def _path(expression: Component | Element, scope: Scope) -> Callable[[State, Reference], tuple[int, ...]]:
    of = compiled(expression.of, scope)
    if isinstance(expression, Component):
        index = _component(expression, of, scope)
        return lambda _, __: (index,)
    indices = [compiled(each, scope).run for each in expression.indices]

    def path(state: State, whole: Reference) -> tuple[int, ...]:
        return _checked([index(state) for index in indices], whole.get(state))

    return path


def _checked(indices: list[Value], array: Value) -> tuple[int, ...]:
    """Return indices from 0, all within an array."""
    places: list[int] = []
    for index in indices:
        if not isinstance(index, float) or not index.is_integer() or not 1 <= index <= len(cast("tuple[Value]", array)):
            fault("ERR_OUTOFBND", f"there is no element {index} of {len(cast('tuple[Value]', array))}")
        places.append(int(index) - 1)
        array = cast("tuple[Value, ...]", array)[places[-1]]
    return tuple(places)


def _component(expression: Component, of: Code, scope: Scope) -> int:
    names = [name.lower() for name, _ in scope.declared.records.get(of.kind, ())]
    if expression.name.lower() not in names:
        unknown(scope.file, expression.line, f"a {of.kind or 'value'} has no component {expression.name}")
    return names.index(expression.name.lower())


def _part(expression: Component | Element, scope: Scope) -> Code:
    of = compiled(expression.of, scope)
    run = of.run
    if isinstance(expression, Component):
        index = _component(expression, of, scope)
        kind = scope.kind(scope.declared.records[of.kind][index][1])
        return Code(kind, lambda state: cast("tuple[Value, ...]", run(state))[index])
    indices = [compiled(each, scope).run for each in expression.indices]

    def element(state: State) -> Value:
        value = run(state)
        for place in _checked([index(state) for index in indices], value):
            value = cast("tuple[Value, ...]", value)[place]
        return value

    return Code(of.kind, element)


def _function(expression: FunctionCall, scope: Scope) -> Code:
    name = expression.name.lower()
    routine = scope.routine(name)
    if routine is not None:
        bind = binder(routine, expression.arguments, scope, line=expression.line)

        def call(state: State) -> Value:
            if routine.file not in state.loaded:
                fault("ERR_REFUNKFUN", f"{routine.name} is called, but {routine.file} is not loaded")
            return cast("Value", evaluate_routine(state, routine, bind(state)))

        return Code(scope.kind(routine.returns), call)
    if name in {"present", "dim"}:
        return _of_argument(name, expression.arguments, scope)
    if name not in FUNCTIONS:
        unknown(scope.file, expression.line, f"{expression.name} is not a function that this machine knows")
    kind, function = FUNCTIONS[name]
    values = [operand(each, scope).run for each in positional(expression.arguments)]
    scope.nodes += _WEIGHT_OF_ARM if name in _OF_ARM else NODES
    if name in {"doutput", "aoutput", "testdi"}:
        values = [compiled(each, scope).run for each in positional(expression.arguments)]
    options = options_of(expression.arguments, scope, FUNCTION_OPTIONS.get(name, frozenset()))

    def compute(state: State) -> Value:
        return function(state, [value(state) for value in values], options(state))

    return Code(kind, compute)


def _of_argument(name: str, arguments: tuple[Argument, ...], scope: Scope) -> Code:
    first = arguments[0].value
    if name == "dim":
        array, number = compiled(cast("Expression", first), scope).run, positional(arguments)[1]
        place = compiled(number, scope).run

        def size(state: State) -> Value:
            value = array(state)
            for _ in range(int(cast("float", place(state))) - 1):
                value = cast("tuple[Value, ...]", value)[0]
            return float(len(cast("tuple[Value, ...]", value)))

        return Code("num", size)
    local = scope.locals.get(first.name.lower()) if isinstance(first, Name) else None
    if local is None:
        unknown(scope.file, arguments[0].line, "Present must name a parameter of its routine")
    slot = local.slot
    return Code("bool", lambda state: state.local[slot] is not MISSING)


def _unary(expression: Unary, scope: Scope) -> Code:
    code = operand(expression.operand, scope)
    run = code.run
    if expression.operator == "NOT":
        return Code("bool", lambda state: not run(state))
    if expression.operator == "+":
        return code

    def negative(state: State) -> Value:
        value = run(state)
        return tuple(-cast("float", each) for each in value) if isinstance(value, tuple) else -cast("float", value)

    return Code(code.kind, negative)


def _binary(expression: Binary, scope: Scope) -> Code:
    if expression.operator in ARITHMETIC:
        return _arithmetic(expression, scope)
    left, right = operand(expression.left, scope), operand(expression.right, scope)
    one, other = left.run, right.run
    word = expression.operator
    if word == "AND":
        return Code("bool", lambda state: bool(one(state)) and bool(other(state)))
    if word == "OR":
        return Code("bool", lambda state: bool(one(state)) or bool(other(state)))
    if word == "XOR":
        return Code("bool", lambda state: one(state) != other(state))
    compare = _COMPARISONS[word]

    def compared(state: State) -> Value:
        value = one(state)
        if type(value) is tuple:
            state.steps += elements(value) // ELEMENTS
        return compare(value, other(state))

    return Code("bool", compared)


def _arithmetic(expression: Binary, scope: Scope) -> Code:
    """Compile a sum or product; in a long one each operand stands to the right of all before it."""
    within: list[Binary] = []
    first: Expression = expression
    while isinstance(first, Binary) and first.operator in ARITHMETIC:
        within.append(first)
        first = first.left
    code = operand(first, scope)
    start, kind = code.run, code.kind
    rest: list[tuple[Callable[[Any, Any], Value], Evaluate]] = []
    for each in reversed(within):
        right = operand(each.right, scope)
        operation = _operation(each.operator, kind, right.kind)
        rest.append((operation, right.run))
        kind = "pos" if "pos" in {kind, right.kind} else kind or right.kind
    if len(rest) == 1:
        (operation, other) = rest[0]
        return Code(kind, lambda state: operation(start(state), other(state)))

    def compute(state: State) -> Value:
        value = start(state)
        for operation, other in rest:
            value = operation(value, other(state))
        return value

    return Code(kind, compute)


def _operation(word: str, left: str, right: str) -> Callable[[Any, Any], Value]:
    """Return what an operator does with values of two types."""
    if word == "*" and left == right == "orient":
        return times
    return _joined if word == "+" and (left or right) == "string" else ARITHMETIC[word]


def _joined(one: Value, other: Value) -> Value:
    """Return two strings as one.

    Raises:
        Fault: it is longer than a controller's strings are.
    """
    whole = cast("str", one) + cast("str", other)
    if len(whole) > STRING_LENGTH:
        fault("ERR_STRTOOLNG", f"a string has at most {STRING_LENGTH} characters, found {len(whole)}")
    return whole


_MAKERS: Mapping[type, Callable[[Any, Scope], Code]] = {
    Literal: _literal, Aggregate: _aggregate, Name: _name, Component: _part, Element: _part, FunctionCall: _function,
    Unary: _unary, Binary: _binary,
}  # fmt: skip
