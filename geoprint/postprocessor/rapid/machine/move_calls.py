"""Compiles instructions that move: to steps of their own, or, with a constant target, to rows of a batch."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, cast

from geoprint.errors import how_many
from geoprint.postprocessor.rapid.language.syntax import (
    Aggregate,
    Binary,
    Call,
    Expression,
    FunctionCall,
    Literal,
    Name,
    Series,
    Value,
)
from geoprint.postprocessor.rapid.machine.batches import Batches
from geoprint.postprocessor.rapid.machine.calls import options_of, positional
from geoprint.postprocessor.rapid.machine.execution import VERBS
from geoprint.postprocessor.rapid.machine.expressions import compiled, operand, reference
from geoprint.postprocessor.rapid.machine.instructions import INSTRUCTIONS
from geoprint.postprocessor.rapid.machine.moves import Order, run_joints, run_line
from geoprint.postprocessor.rapid.machine.state import Slot, State
from geoprint.postprocessor.rapid.machine.stepping import NODES, Evaluate, RoutineCode, Scope, Step
from geoprint.postprocessor.rapid.machine.values import PREDEFINED, stored, unknown

if TYPE_CHECKING:
    from geoprint.postprocessor.rapid.machine.task import MachineTask


# Compiles instructions that do not move the arm.


def compile_instruction(call: Call, scope: Scope) -> Step:
    """Return the step of an instruction.

    Raises:
        VerificationError: it is given what this machine does not know.
    """
    instruction = INSTRUCTIONS[call.name.lower()]
    arguments = positional(call.arguments)
    if len(arguments) != instruction.takes:
        unknown(scope.file, call.line, f"{call.name} is given {how_many(len(arguments), 'argument')}")
    makers = [
        reference(argument, scope)
        if place in instruction.references
        else compiled(argument, scope).run
        if place in instruction.signals
        else operand(argument, scope).run
        for place, argument in enumerate(arguments)
    ]
    options, run = options_of(call.arguments, scope, instruction.options), instruction.run
    scope.nodes += NODES
    return lambda state: run(state, [make(state) for make in makers], options(state))


# What stands where among the arguments that are not optional.
MOVES: Mapping[str, tuple[str, ...]] = {
    "movel": ("target", "speed", "zone", "tool"),
    "movej": ("target", "speed", "zone", "tool"),
    "movec": ("through", "target", "speed", "zone", "tool"),
    "moveabsj": ("target", "speed", "zone", "tool"),
    "triggl": ("target", "speed", "trigger", "zone", "tool"),
    "triggj": ("target", "speed", "trigger", "zone", "tool"),
    "triggc": ("through", "target", "speed", "trigger", "zone", "tool"),
}
_VERBS = {verb.lower(): number for number, verb in enumerate(VERBS)}
_TRIGGERS = tuple(f"t{k}" for k in range(2, 9))
_OPTIONS = frozenset({"wobj", "t", "v"})
# What a move looks up in data.
_LOOKED = ("speed", "zone", "tool", "wobj")
# A robtarget: place, attitude, configuration, other axes.
_TARGET_SHAPE = [3, 4, 4, 6]
_SINGLES = struct.Struct("<17f")
# For how many steps a move counts that has a step of its own: of the tip, and of the joints.
_TIP, _ALL_JOINTS = 10, 400
Emit = Callable[[Step, int], None]


def compile_move(call: Call, scope: Scope, *, code: RoutineCode, task: MachineTask, emit: Emit) -> None:
    """Append the step of a move.

    Raises:
        VerificationError: it has another form, or an option that this machine does not know.
    """
    name = call.name.lower()
    numbers = _numbers(call)
    form = None if numbers is None else _form(call, scope, code, task)
    if form is not None and numbers is not None and code.batches is not None:
        code.batches.extend(numbers)
        code.batches.add(len(code.steps), call.line, form)
        emit(code.batches.run, call.line)
        return
    wanted, found = MOVES[name], positional(call.arguments)
    if len(found) != len(wanted):
        unknown(
            scope.file, call.line, f"{call.name} is given {how_many(len(found), 'argument')}, and takes {len(wanted)}"
        )
    known = {*_OPTIONS, *(("noeoffs",) if name == "moveabsj" else ())}
    known |= set(_TRIGGERS if name.startswith("trigg") else ())
    for argument in call.arguments:
        if argument.optional and argument.name.lower() not in known:
            unknown(scope.file, call.line, f"the option {argument.name} is unknown to this machine here")
    parts = dict(zip(wanted, found, strict=True))
    given = {each.name.lower(): each.value for each in call.arguments if each.optional and each.value is not None}
    parts["work"] = given.get("wobj") or Name(call.line, "wobj0")
    order = Order(
        _VERBS[name], task.file_number(scope.file), call.line,
        task.name_number(_word(parts["tool"])), task.name_number(_word(parts["work"])),
    )  # fmt: skip
    run = {part: _evaluated(expression, scope) for part, expression in parts.items()}
    if isinstance(parts["target"], FunctionCall | Aggregate | Binary):
        run["target"] = _kept(run["target"]) if name == "moveabsj" else _rounded(run["target"])
    options = options_of(
        tuple(each for each in call.arguments if each.name.lower() in {"t", "v"}), scope, frozenset({"t", "v"})
    )
    scope.nodes += NODES * (_ALL_JOINTS if name == "moveabsj" else _TIP)
    if name == "moveabsj":
        emit(_joints_step(order, run, options), call.line)
        return
    triggers = [run["trigger"]] if "trigger" in run else []
    triggers += [compiled(given[each], scope).run for each in _TRIGGERS if given.get(each) is not None]
    emit(_line_step(order, run, options, triggers), call.line)


def compile_series(series: Series, scope: Scope, *, code: RoutineCode, task: MachineTask, emit: Emit) -> None:
    """Append the steps of a series of moves.

    Raises:
        VerificationError: one has another form, or an option that this machine does not know.
    """
    forms = {form: _form(series.shapes[form], scope, code, task) for form in set(series.forms)}
    batches = code.batches
    if batches is None or None in forms.values():
        for call in series.calls():
            compile_move(call, scope, code=code, task=task, emit=emit)
        return
    run, first = batches.run, len(code.steps)
    for step, (line, form) in enumerate(zip(series.lines, series.forms, strict=True), start=first):
        batches.add(step, line, cast("int", forms[form]))
        emit(run, line)
    batches.extend(series.numbers)


def compile_trigger(call: Call, scope: Scope, *, code: RoutineCode, task: MachineTask, emit: Emit) -> None:
    """Append the step of an instruction that defines a trigger, which may stand between the moves of a batch.

    Raises:
        VerificationError: it is given what this machine does not know.
    """
    first = call.arguments[0].value if call.arguments else None
    datum = scope.datum(first.name) if isinstance(first, Name) else None
    numbers: list[Slot] = []
    form = (call.name.lower(), *[(each.name, _slots(each.value, numbers, scope)) for each in call.arguments])
    if datum is None or datum.kind != "triggdata" or any(each[1] is None for each in form[1:]):
        emit(compile_instruction(call, scope), call.line)
        return
    if code.batches is None:
        code.batches = Batches(file=task.file_number(scope.file))
    code.batches.define(len(code.steps))
    run = code.batches.definitions.get(form)
    if run is None:
        run = code.batches.definitions[form] = _definition(call, scope)
    emit(partial(_define, run, numbers), call.line)


def _define(run: Step, numbers: list[Slot], state: State) -> None:
    """Define a trigger with numbers in the place of a routine's own data."""
    kept, state.local = state.local, numbers
    try:
        run(state)
    finally:
        state.local = kept


def _definition(call: Call, scope: Scope) -> Step:
    """Return the step of an instruction whose numbers are taken from the routine's own data."""
    inner = Scope(scope.declared, scope.file)
    arguments = [
        each if each.value is None else replace(each, value=_slotted(each.value, inner)) for each in call.arguments
    ]
    return compile_instruction(replace(call, arguments=tuple(arguments)), inner)


def _slots(value: Expression | None, numbers: list[Slot], scope: Scope) -> object:
    """Return the form of a value that is computed of data of modules and numbers alone, and gather these; else None."""
    scope.nodes += 1
    if isinstance(value, Name):
        return None if value.name.lower() in scope.locals else value.name.lower()
    if isinstance(value, Binary):
        left, right = _slots(value.left, numbers, scope), _slots(value.right, numbers, scope)
        return None if left is None or right is None else (value.operator, left, right)
    if isinstance(value, Literal) and isinstance(value.value, float):
        numbers.append(value.value)
        return 0
    return () if value is None else None


def _slotted(value: Expression, inner: Scope) -> Expression:
    """Return such a value with a name of the routine's own data in the place of each number."""
    if isinstance(value, Binary):
        left = _slotted(value.left, inner)
        return replace(value, left=left, right=_slotted(value.right, inner))
    if isinstance(value, Literal):
        name = f"{inner.size}"
        inner.add(name, "num")
        return Name(value.line, name)
    return value


def _numbers(call: Call) -> list[float] | None:
    """Return the numbers of the target of a move, or None where it is none that is written out."""
    first = call.arguments[0].value if call.arguments else None
    if not isinstance(first, Literal) or not isinstance(first.value, tuple):
        return None
    shape = [len(part) if isinstance(part, tuple) else 0 for part in first.value]
    if shape != _TARGET_SHAPE:
        return None
    return [number for part in cast("tuple[tuple[float, ...], ...]", first.value) for number in part]


def _form(call: Call, scope: Scope, code: RoutineCode, task: MachineTask) -> int | None:
    """Return the number of the form of a move to a target that is written out, or None where it goes in no batch."""
    verb = call.name.lower()
    names = (verb, *[f"{each.name} {_word(each.value)}".lower() for each in call.arguments[1:]])
    known = None if code.batches is None else code.batches.form(names)
    if known is not None:
        return known
    parts = _parts(call, scope)
    if parts is None:
        return None
    if code.batches is None:
        code.batches = Batches(file=task.file_number(scope.file))
    look = {each: (parts[each], task.look(parts[each], scope)) for each in _LOOKED}
    pulled = [Name(call.line, parts[each]) for each in ("trigger", *_TRIGGERS) if each in parts]
    return code.batches.add_form(
        names, _VERBS[verb], speed=look["speed"], zone=look["zone"],
        held=(*look["tool"], task.name_number(parts["tool"])), work=(*look["wobj"], task.name_number(parts["wobj"])),
        pulled=tuple([compiled(name, scope).run for name in pulled]),
    )  # fmt: skip


def _parts(call: Call, scope: Scope) -> dict[str, str] | None:
    """Return the names of a straight move by their places, or None where they are not all data of modules."""
    wanted = {"movel": MOVES["movel"], "triggl": MOVES["triggl"]}.get(call.name.lower(), ())[1:]
    options = {"wobj", *(_TRIGGERS if "trigger" in wanted else ())}
    waiting = list(wanted)
    parts: dict[str, str] = {}
    for argument in call.arguments[1:]:
        place = argument.name.lower() if argument.optional else waiting.pop(0) if waiting else ""
        named = argument.optional == bool(argument.name) and (place in options or not argument.optional)
        if not place or not named or place in parts or not isinstance(argument.value, Name):
            return None
        parts[place] = argument.value.name.lower()
    parts.setdefault("wobj", "wobj0")
    known = [(each in _LOOKED and word in PREDEFINED) or scope.datum(word) is not None for each, word in parts.items()]
    own = any(word in scope.locals for word in parts.values())
    return None if waiting or not wanted or own or not all(known) else parts


def _evaluated(expression: Expression, scope: Scope) -> Evaluate:
    if isinstance(expression, Literal):
        value = stored(expression.value)
        return lambda _: value
    return compiled(expression, scope).run


def _kept(run: Evaluate) -> Evaluate:
    """Return what rounds a value that no datum holds."""
    return lambda state: stored(run(state))


def _rounded(run: Evaluate) -> Evaluate:
    """Return what rounds a robtarget that no datum holds, at once."""

    def rounded(state: State) -> Value:
        place, turn, configuration, axes = target = cast("tuple[tuple[float, ...], ...]", run(state))
        try:
            numbers = _SINGLES.unpack(_SINGLES.pack(*place, *turn, *configuration, *axes))
        except OverflowError:
            # Its part says which.
            return stored(target)
        return numbers[:3], numbers[3:7], numbers[7:11], numbers[11:]

    return rounded


def _word(expression: Expression | None) -> str:
    return expression.name.lower() if isinstance(expression, Name) else "a value"


def _line_step(
    order: Order, run: Mapping[str, Evaluate], options: Callable[[State], Mapping[str, Value]], triggers: list[Evaluate]
) -> Step:
    target, speed, zone, tool, work = (run[part] for part in ("target", "speed", "zone", "tool", "work"))
    through = run.get("through")

    def step(state: State) -> None:
        run_line(
            state, order, target(state), speed=speed(state), zone=zone(state), tool=tool(state),
            work=work(state), options=options(state), through=None if through is None else through(state),
            triggers=tuple([cast("Any", trigger(state)) for trigger in triggers]) if triggers else (),
        )  # fmt: skip

    return step


def _joints_step(order: Order, run: Mapping[str, Evaluate], options: Callable[[State], Mapping[str, Value]]) -> Step:
    target, speed, zone, tool = (run[part] for part in ("target", "speed", "zone", "tool"))

    def step(state: State) -> None:
        run_joints(
            state, order, target(state), speed=speed(state), zone=zone(state), tool=tool(state), options=options(state)
        )

    return step
