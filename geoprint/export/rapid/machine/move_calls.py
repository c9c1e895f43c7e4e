"""Compiles instructions that move: to steps of their own, or, with a constant target, to rows of a batch."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, cast

from geoprint.export.rapid.language.syntax import Call, Expression, Literal, Name, Value
from geoprint.export.rapid.machine.batches import Batches
from geoprint.export.rapid.machine.calls import options_of, positional
from geoprint.export.rapid.machine.code import Evaluate, RoutineCode, Scope, Step
from geoprint.export.rapid.machine.execution import VERBS
from geoprint.export.rapid.machine.expressions import compiled
from geoprint.export.rapid.machine.moves import Order, run_joints, run_line
from geoprint.export.rapid.machine.state import State
from geoprint.export.rapid.machine.values.faults import unknown
from geoprint.export.rapid.machine.values.predefined import PREDEFINED
from geoprint.export.rapid.machine.values.records import stored

if TYPE_CHECKING:
    from geoprint.export.rapid.machine.task import MachineTask

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
# A robtarget: place, attitude, configuration, other axes.
_TARGET_SHAPE = [3, 4, 4, 6]
# Names of the arguments of a move as it is mostly written.
_PLAIN = ["", "", "", "", "WObj"]
Emit = Callable[[Step, int], None]


def compile_move(call: Call, scope: Scope, *, code: RoutineCode, task: MachineTask, emit: Emit) -> None:
    """Append the step of a move.

    Raises:
        VerificationError: it has another form, or an option that this machine does not know.
    """
    name = call.name.lower()
    if name == "movel" and code.batches is not None and _repeats(call, code, code.batches):
        emit(code.batches.run, call.line)
        return
    wanted, found = MOVES[name], positional(call.arguments)
    if len(found) != len(wanted):
        unknown(scope.file, call.line, f"{call.name} is given {len(found)} arguments, and takes {len(wanted)}")
    known = {*_OPTIONS, *(("noeoffs",) if name == "moveabsj" else ())}
    known |= set(_TRIGGERS if name.startswith("trigg") else ())
    for argument in call.arguments:
        if argument.optional and argument.name.lower() not in known:
            unknown(scope.file, call.line, f"the option {argument.name} is none that this machine knows here")
    parts = dict(zip(wanted, found, strict=True))
    given = {each.name.lower(): each.value for each in call.arguments if each.optional and each.value is not None}
    parts["work"] = given.get("wobj") or Name(call.line, "wobj0")
    if name == "movel" and not (given.keys() - {"wobj"}) and _batched(parts, scope):
        _add(call, parts, scope, code, task)
        emit(cast("Batches", code.batches).run, call.line)
        return
    order = Order(
        _VERBS[name], task.file_number(scope.file), call.line,
        task.name_number(_word(parts["tool"])), task.name_number(_word(parts["work"])),
    )  # fmt: skip
    run = {part: _evaluated(expression, scope) for part, expression in parts.items()}
    options = options_of(
        tuple(each for each in call.arguments if each.name.lower() in {"t", "v"}), scope, frozenset({"t", "v"})
    )
    if name == "moveabsj":
        emit(_joints_step(order, run, options), call.line)
        return
    triggers = [run["trigger"]] if "trigger" in run else []
    triggers += [compiled(given[each], scope).run for each in _TRIGGERS if given.get(each) is not None]
    emit(_line_step(order, run, options, triggers), call.line)


def _repeats(call: Call, code: RoutineCode, batches: Batches) -> bool:
    """Add a move to a constant target with names that a move before it has had; False if it is none."""
    first, *others = [argument.value for argument in call.arguments]
    if not isinstance(first, Literal) or not isinstance(first.value, tuple):
        return False
    shape = [len(part) if isinstance(part, tuple) else 0 for part in first.value]
    if shape != _TARGET_SHAPE or [argument.name for argument in call.arguments] != _PLAIN:
        return False
    names = tuple([other.name.lower() for other in others if isinstance(other, Name)])
    return batches.again(len(code.steps), call.line, first.value, names)


def _evaluated(expression: Expression, scope: Scope) -> Evaluate:
    if isinstance(expression, Literal):
        value = stored(expression.value)
        return lambda _: value
    return compiled(expression, scope).run


def _word(expression: Expression) -> str:
    return expression.name.lower() if isinstance(expression, Name) else "a value"


def _batched(parts: Mapping[str, Expression], scope: Scope) -> bool:
    """Whether a target is constant, and all else data of modules or of the controller."""
    target = parts["target"]
    if not isinstance(target, Literal) or not isinstance(target.value, tuple):
        return False
    shape = [len(part) if isinstance(part, tuple) else 0 for part in target.value]
    names = [parts[part] for part in ("speed", "zone", "tool", "work")]
    return shape == _TARGET_SHAPE and all(
        isinstance(each, Name)
        and each.name.lower() not in scope.locals
        and (scope.datum(each.name) is not None or each.name.lower() in PREDEFINED)
        for each in names
    )


def _add(call: Call, parts: Mapping[str, Expression], scope: Scope, code: RoutineCode, task: MachineTask) -> None:
    if code.batches is None:
        code.batches = Batches(file=task.file_number(scope.file), verb=_VERBS["movel"])
    words = {part: _word(parts[part]) for part in ("speed", "zone", "tool", "work")}
    looks = {part: task.look(word, scope) for part, word in words.items()}
    code.batches.add(
        len(code.steps), call.line, cast("Literal", parts["target"]).value,
        speed=(words["speed"], looks["speed"]), zone=(words["zone"], looks["zone"]),
        held=(words["tool"], looks["tool"], task.name_number(words["tool"])),
        work=(words["work"], looks["work"], task.name_number(words["work"])),
    )  # fmt: skip


def _line_step(
    order: Order, run: Mapping[str, Evaluate], options: Callable[[State], Mapping[str, Value]], triggers: list[Evaluate]
) -> Step:
    target, speed, zone, tool, work = (run[part] for part in ("target", "speed", "zone", "tool", "work"))
    through = run.get("through")

    def step(state: State) -> None:
        run_line(
            state, order, stored(target(state)), speed=speed(state), zone=zone(state), tool=tool(state),
            work=work(state), options=options(state), through=None if through is None else through(state),
            triggers=tuple([cast("Any", trigger(state)) for trigger in triggers]),
        )  # fmt: skip

    return step


def _joints_step(order: Order, run: Mapping[str, Evaluate], options: Callable[[State], Mapping[str, Value]]) -> Step:
    target, speed, zone, tool = (run[part] for part in ("target", "speed", "zone", "tool"))

    def step(state: State) -> None:
        run_joints(
            state, order, target(state), speed=speed(state), zone=zone(state), tool=tool(state), options=options(state)
        )

    return step
