"""Executes steps: the loop, errors and their handlers, and routines called from within an expression."""

from __future__ import annotations

from time import process_time
from typing import TYPE_CHECKING

import numpy as np

from geoprint.export.rapid.language.syntax import Value
from geoprint.export.rapid.machine.execution import Called
from geoprint.export.rapid.machine.state import Frame, Missing, Reference, Slot, State
from geoprint.export.rapid.machine.values.faults import Fault, fault, unknown

if TYPE_CHECKING:
    from geoprint.export.rapid.machine.code import RoutineCode


# Steps between looks at the clock.
_LOOK = 64
# Routines that call one another deeper than this call themselves.
_DEEPEST = 200


def advance(state: State, until: float) -> None:
    """Execute until the program waits beyond a moment, or ends; outputs switch up to that moment."""
    state.until = until
    frames, pending, seen = state.frames, state.pending, state.log.seen
    most, deadline = state.scenario.most_steps, state.deadline
    while state.clock <= until and state.ended == "runs" and len(frames) > state.base:
        if pending:
            state.fire(state.clock)
        frame = frames[-1]
        pc = frame.pc
        routine = frame.routine
        if pc == len(routine.steps):
            leave(state, None)
            continue
        frame.pc = pc + 1
        seen[routine.number][pc] = 1
        state.steps += 1
        if state.steps > most:
            state.end("error", f"the program has made {most} steps and does not end")
            return
        if state.steps % _LOOK == 0 and process_time() > deadline:
            seconds = state.scenario.most_seconds
            unknown(routine.file, routine.line_of(pc), f"the program does not run to its end in {seconds:.2g} s")
        try:
            routine.steps[pc](state)
        except Fault as error:
            _handle(state, error)


def enter(state: State, routine: RoutineCode, arguments: list[Slot]) -> None:
    """Begin to execute a routine, whose arguments were bound."""
    if len(state.frames) >= _DEEPEST:
        state.end("error", f"calls nest deeper than {_DEEPEST}")
        return
    if state.watched and routine.name.lower() in state.watched:
        _note(state, routine, arguments)
    data = arguments + [None] * (routine.size - len(arguments))
    state.frames.append(Frame(routine, data))
    state.local = data
    for slot, evaluate in routine.setup:
        data[slot] = evaluate(state)


def leave(state: State, value: Value | None) -> None:
    """Go back to where the routine was called."""
    frame = state.frames.pop()
    if state.frames:
        state.frames[-1].returned = value
        state.local = state.frames[-1].data
    elif not state.base:
        state.ended, state.file = "end", frame.routine.file
        state.line = frame.routine.line_of(frame.pc - 1)


def evaluate_routine(state: State, routine: RoutineCode, arguments: list[Slot]) -> Value | None:
    """Execute a function, or the routine of an event, to its end, and return its value; time does not stop it.

    Raises:
        Fault: it raises an error that it does not handle.
    """
    base, until = state.base, state.until
    state.base = len(state.frames)
    guard = Frame(routine, []) if not state.frames else None
    if guard is not None:
        # An event finds no program; its routine still needs somebody to return to.
        state.frames.append(guard)
        state.base = 1
    enter(state, routine, arguments)
    try:
        advance(state, np.inf)
    finally:
        state.base, state.until = base, until
    value = state.frames[-1].returned if state.frames else None
    if guard is not None and state.frames and state.frames[0] is guard:
        state.frames.clear()
        state.local = []
    return value


def _handle(state: State, error: Fault) -> None:
    """Hand an error to the nearest handler up the calls; without one it ends the program."""
    frames = state.frames
    if not error.file:
        error.file, error.line = frames[-1].routine.file, frames[-1].routine.line_of(frames[-1].pc - 1)
    while len(frames) > state.base:
        frame = frames[-1]
        # An error in a handler is nobody's to handle [ABBRapid, error recovery].
        start = -1 if frame.failed >= 0 else _handler(state, frame, error.number)
        if start >= 0:
            frame.failed, frame.pc = frame.pc - 1, start
            # Its traceback holds the state, which would hold itself.
            state.error = error.with_traceback(None)
            return
        if frame.failed >= 0 or len(frames) == 1:
            break
        frames.pop()
        state.local = frames[-1].data
    if state.base and len(frames) == state.base:
        raise error
    state.ended, state.reason = "error", f"{error.name}: {error.what}"
    state.file, state.line = error.file, error.line


def _handler(state: State, frame: Frame, number: float) -> int:
    """Return the first step of the handler that takes an error, or -1."""
    for errors, start in frame.routine.handlers:
        if not errors or any(each(state) == number for each in errors):
            return start
    return -1


def raise_on(state: State, number: float | None) -> None:
    """RAISE: an error of its own outside a handler, the present one to the caller's handler within one.

    Raises:
        Fault: that error, where this routine is to handle it itself.
    """
    frame = state.frames[-1]
    if frame.failed < 0:
        if number is None:
            fault("ERR_ILLRAISE", "RAISE without a number stands outside an error handler")
        raise Fault(number, "was raised")
    error = state.error if number is None or state.error is None else Fault(number, "was raised")
    assert error is not None  # noqa: S101  # A handler runs because of one.
    if len(state.frames) == 1:
        state.end("error", f"{error.name}: {error.what}")
        state.file, state.line = error.file or state.file, error.line or state.line
        return
    state.frames.pop()
    state.local = state.frames[-1].data
    raise error


def _note(state: State, routine: RoutineCode, arguments: list[Slot]) -> None:
    caller = state.frames[-1] if state.frames else None
    file, line = (caller.routine.file, caller.routine.line_of(max(caller.pc - 1, 0))) if caller else ("", 0)
    values = tuple(
        None if isinstance(each, Missing) else each.get(state) if isinstance(each, Reference) else each
        for each in arguments
    )
    state.log.calls.append(Called(routine.name.lower(), values, state.clock, state.log.count, file, line))
