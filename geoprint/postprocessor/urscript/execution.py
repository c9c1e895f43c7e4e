"""Executes URScript frame by frame: threads, moves, outputs and questions, as the URScript manual describes them.

The controller runs at 500 Hz: in each frame of 2 ms every thread that can go on does so, until it uses physical time by
a move, `sync` or `sleep` or waits for another thread; one that only computes ends in an error [URScript, Threads]. A
move with a blend lets its thread go on when the blend begins [URManual]. Outputs that a program has assigned a run
state go low when it ends, however it ends [URScript, Module ioconfiguration]. Nothing here is shared with what writes.

An expression becomes a function of the machine and of local variables. A block becomes a generator, which yields where
its thread waits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import cast

from geoprint.model import FloatArray
from geoprint.postprocessor.execution import refusal
from geoprint.postprocessor.urscript.functions import BLOCKING, SIGNATURES, blocking, bound, instant
from geoprint.postprocessor.urscript.language import (
    Call,
    Constant,
    Expression,
    Items,
    Name,
    Operation,
    Routine,
    Script,
    Statement,
)
from geoprint.postprocessor.urscript.log import (
    Called,
    HaltError,
    Locals,
    Log,
    ReturnError,
    Run,
    Scenario,
    Thread,
    Value,
    Wait,
)
from geoprint.postprocessor.urscript.machine import CompiledCall, Evaluated, Machine, Step
from geoprint.postprocessor.urscript.poses import Pose

# A program that lasts longer than this has no end [s].
_LONGEST = 48.0 * 3600.0
# A thread that has made so many statements in a frame only computes.
_MOST_STATEMENTS = 20000


def execute(script: Script, scenario: Scenario, flange: Callable[[FloatArray], FloatArray]) -> Log:
    """Execute a program from its first statement to its end.

    Args:
        script: that was read.
        scenario: how it is run.
        flange: (k, 6) joints [rad] to (k, 4, 4) poses of the flange in the base frame [mm].

    Raises:
        VerificationError: it does what the controller refuses or this machine does not know; the line is named.
    """
    machine = Machine(script, scenario, flange)
    main = machine.thread
    main.run = _run_routine(machine, script.main, main, {})
    machine.threads.append(main)
    frame = 0
    try:
        while machine.threads and machine.threads[0] is main:
            machine.now = frame * scenario.frame
            if machine.now >= scenario.stops_at:
                machine.log.ended = "stopped"
                break
            if machine.now > _LONGEST:
                raise machine.refused("the program has no end")
            for thread in list(machine.threads):
                _go_on(machine, thread)
            frame += 1
        else:
            machine.log.ended = "end"
    except HaltError:
        machine.log.ended = "halt"
    if machine.pending is not None and machine.log.ended == "end":
        raise machine.refused("a blend has no move behind it", line=machine.pending[2].line)
    machine.log.time = machine.now
    for output, state in machine.run_states.items():
        if state in {1, 3} and machine.outputs.get(output, False):
            machine.outputs[output] = False
    machine.log.lit = tuple(sorted(output for output, on in machine.outputs.items() if on))
    return machine.log


def _go_on(machine: Machine, thread: Thread) -> None:
    if thread.run is None or (thread.waits is not None and not thread.waits()):
        return
    machine.thread, thread.statements = thread, 0
    try:
        thread.waits = next(thread.run)
    except StopIteration:
        thread.run = None
        machine.threads.remove(thread)
    except ReturnError:
        raise machine.refused("a value is returned to nobody") from None
    except RecursionError:
        raise machine.refused("functions call one another without end") from None


def _run_routine(machine: Machine, routine: Routine, thread: Thread, local: Locals) -> Run:
    """Run a routine in a thread, and return its value."""
    thread.stack.append(routine.line)
    if len(thread.stack) > 50:
        raise machine.refused("functions call one another without end")
    try:
        yield from _block(_steps(machine, routine), machine, thread, local)
    except ReturnError as returned:
        return returned.value
    finally:
        thread.stack.pop()
    return None


def _steps(machine: Machine, routine: Routine) -> list[Step]:
    """Return the statements of a routine, compiled once."""
    if routine.name not in machine.compiled:
        machine.compiled[routine.name] = [_compiled(each, machine) for each in routine.body]
    return machine.compiled[routine.name]


def _start(machine: Machine, name: str) -> Thread:
    """Start a thread."""
    routine = machine.routines.get(name)
    if routine is None or not routine.is_thread:
        raise machine.refused(f"there is no thread {name}")
    thread = Thread(name)
    thread.run = _run_routine(machine, routine, thread, {})
    machine.threads.append(thread)
    return thread


def _call(machine: Machine, call: CompiledCall, local: Locals) -> Run:
    """Call a function of the program, or one of the manual that takes time."""
    values, named = call.values(machine, local)
    if call.name in SIGNATURES:
        arguments = bound(machine, call.name, values, named)
        return (yield from blocking(machine, call.name, arguments))
    routine = machine.routines.get(call.name)
    if routine is None or routine.is_thread:
        raise machine.refused(f"there is no function {call.name}")
    if named or len(values) != len(routine.arguments):
        raise machine.refused(f"{call.name} takes {len(routine.arguments)} arguments")
    thread = machine.thread
    machine.log.calls.append(Called(machine.now, call.name, tuple(values), thread.line(), thread.name))
    return (yield from _run_routine(machine, routine, thread, dict(zip(routine.arguments, values, strict=True))))


def _compiled(statement: Statement, machine: Machine) -> Step:
    """Compile a statement, with those within it.

    Raises:
        VerificationError: it starts a thread that nobody can join.
    """
    value, call = statement.value, None
    if statement.kind == "call":
        assert isinstance(value, Call)  # noqa: S101
        call = _compiled_call(value)
        if value.starts:
            raise refusal(machine.script.file, statement.line, "a thread is started that nobody can join")
    return Step(
        statement.kind, statement.line, statement.scope, statement.name,
        None if value is None or call is not None else _evaluated(value), call,
        [_compiled(each, machine) for each in statement.body],
        [_compiled(each, machine) for each in statement.otherwise],
    )  # fmt: skip


def _compiled_call(call: Call) -> CompiledCall:
    return CompiledCall(
        call.name,
        tuple(_evaluated(each) for each in call.arguments),
        tuple((name, _evaluated(each)) for name, each in call.named),
    )


def _block(steps: list[Step], machine: Machine, thread: Thread, local: Locals) -> Run:
    """Run statements one after another."""
    lines, stack = machine.log.lines, thread.stack
    for step in steps:
        stack[-1] = step.line
        lines.add(step.line)
        thread.statements += 1
        if thread.statements > _MOST_STATEMENTS:
            raise machine.refused("a thread computes without an end: it needs sync() or sleep()")
        kind = step.kind
        if kind == "set":
            assert step.value is not None  # noqa: S101
            _assign(machine, step, step.value(machine, local), local)
        elif kind == "call":
            assert step.call is not None  # noqa: S101
            name = step.call.name
            if name in SIGNATURES and name not in BLOCKING:
                instant(machine, name, bound(machine, name, *step.call.values(machine, local)))
            else:
                yield from _call(machine, step.call, local)
        else:
            yield from _controlled(step, machine, thread, local)


def _controlled(step: Step, machine: Machine, thread: Thread, local: Locals) -> Run:
    """Run a statement that decides what follows."""
    kind = step.kind
    if kind == "while":
        assert step.value is not None  # noqa: S101
        while _truth(machine, step.value(machine, local)):
            yield from _block(step.body, machine, thread, local)
            thread.stack[-1] = step.line
            thread.statements += 1
            if thread.statements > _MOST_STATEMENTS:
                raise machine.refused("a thread computes without an end: it needs sync() or sleep()")
    elif kind == "if":
        assert step.value is not None  # noqa: S101
        chosen = step.body if _truth(machine, step.value(machine, local)) else step.otherwise
        yield from _block(chosen, machine, thread, local)
    elif kind == "return":
        raise ReturnError(None if step.value is None else step.value(machine, local))
    elif kind == "halt":
        raise HaltError
    else:
        other = local.get(step.name, machine.variables.get(step.name))
        if not isinstance(other, Thread):
            raise machine.refused(f"{step.name} is no thread")
        if kind == "join":
            yield lambda: other.run is None
        elif other.run is not None:
            other.run = None
            machine.threads.remove(other)
    return None


def _truth(machine: Machine, value: Value) -> bool:
    if not isinstance(value, bool):
        raise machine.refused("a condition must be True or False")
    return value


def _assign(machine: Machine, step: Step, value: Value, local: Locals) -> None:
    name = step.name
    if name in machine.routines or name in SIGNATURES or name in {"True", "False"}:
        raise machine.refused(f"{name} is a function")
    if step.scope == "global":
        if name in machine.held:
            value = machine.held[name]
        elif name in machine.settings and name not in machine.variables:
            value = machine.settings[name]
        machine.variables[name] = value
    elif step.scope == "local" or name in local:
        local[name] = value
    else:
        raise machine.refused(f"{name} is neither global nor local here")


def _evaluated(expression: Expression) -> Evaluated:
    """Return a function of machine and local variables that has the value of an expression."""
    if isinstance(expression, Constant):
        return _constant(expression.value)
    if isinstance(expression, Name):
        return _named(expression.name)
    if isinstance(expression, Items):
        return _items(expression)
    if isinstance(expression, Operation):
        return _operation(expression)
    return _call_value(expression)


def _constant(constant: Value) -> Evaluated:
    def value(machine: Machine, local: Locals) -> Value:
        del machine, local
        return constant

    return value


def _named(name: str) -> Evaluated:
    def value(machine: Machine, local: Locals) -> Value:
        if name in local:
            return local[name]
        if name not in machine.variables:
            raise machine.refused(f"{name} has no value here")
        return machine.variables[name]

    return value


def _items(expression: Items) -> Evaluated:
    items = [_evaluated(each) for each in expression.items]
    if not expression.is_pose:
        return lambda machine, local: [each(machine, local) for each in items]
    if all(isinstance(each, Constant) for each in expression.items) and len(items) == 6:
        numbers = [cast("Constant", each).value for each in expression.items]
        if all(isinstance(each, (int, float)) and not isinstance(each, bool) for each in numbers):
            return _constant(Pose(float(cast("float", each)) for each in numbers))

    def value(machine: Machine, local: Locals) -> Value:
        found = [each(machine, local) for each in items]
        if len(found) != 6 or any(isinstance(each, bool) or not isinstance(each, (int, float)) for each in found):
            raise machine.refused("a pose has six numbers")
        return Pose(float(cast("float", each)) for each in found)

    return value


_NUMBERS: Mapping[str, Callable[[float, float], float | bool]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
}


def _operation(expression: Operation) -> Evaluated:
    sign = expression.sign
    operands = [_evaluated(each) for each in expression.operands]
    first, last = operands[0], operands[-1]
    if sign == "-" and len(operands) == 1:
        return _arithmetic(lambda a, b: a - b, _constant(0), first)
    if sign in _NUMBERS:
        return _arithmetic(_NUMBERS[sign], first, last)
    others: Mapping[str, Evaluated] = {
        "not": lambda machine, local: not _truth(machine, first(machine, local)),
        "and": lambda machine, local: _truth(machine, first(machine, local)) and _truth(machine, last(machine, local)),
        "or": lambda machine, local: _truth(machine, first(machine, local)) or _truth(machine, last(machine, local)),
        "==": lambda machine, local: first(machine, local) == last(machine, local),
        "!=": lambda machine, local: first(machine, local) != last(machine, local),
        "[": _item(first, last),
    }
    if sign not in others:
        return _unknown(sign)
    return others[sign]


def _unknown(sign: str) -> Evaluated:
    def value(machine: Machine, local: Locals) -> Value:
        del local
        raise machine.refused(f"{sign} is not of the subset")

    return value


def _item(values: Evaluated, place: Evaluated) -> Evaluated:
    def value(machine: Machine, local: Locals) -> Value:
        found, index = values(machine, local), place(machine, local)
        if not isinstance(found, (list, Pose)) or isinstance(index, bool) or index not in range(len(found)):
            raise machine.refused("there is no such item")
        return found[cast("int", index)]

    return value


def _arithmetic(operation: Callable[[float, float], float | bool], left: Evaluated, right: Evaluated) -> Evaluated:
    def value(machine: Machine, local: Locals) -> Value:
        a, b = left(machine, local), right(machine, local)
        for each in (a, b):
            if isinstance(each, bool) or not isinstance(each, (int, float)):
                raise machine.refused("a number must stand here")
        try:
            return operation(cast("float", a), cast("float", b))
        except ZeroDivisionError:
            raise machine.refused("a division by 0") from None

    return value


def _call_value(expression: Call) -> Evaluated:
    call = _compiled_call(expression)
    if expression.starts:
        return lambda machine, _: _start(machine, call.name)

    def value(machine: Machine, local: Locals) -> Value:
        if call.name in BLOCKING:
            raise machine.refused(f"{call.name} has no value")
        if call.name in SIGNATURES:
            return instant(machine, call.name, bound(machine, call.name, *call.values(machine, local)))
        return _at_once(machine, _call(machine, call, local))

    return value


def _at_once(machine: Machine, run: Iterator[Wait]) -> Value:
    try:
        next(run)
    except StopIteration as ended:
        return cast("Value", ended.value)
    raise machine.refused("a function within an expression takes time")
