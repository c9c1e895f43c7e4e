"""Routines as lists of steps, and their execution: the loop, errors and handlers, calls within expressions."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias, final

import numpy as np

from geoprint.postprocessor.rapid.language.syntax import Parameter, Value
from geoprint.postprocessor.rapid.machine.execution import Called
from geoprint.postprocessor.rapid.machine.state import Frame, Missing, Reference, Slot, State
from geoprint.postprocessor.rapid.machine.values import Components, Fault, fault

if TYPE_CHECKING:
    from geoprint.postprocessor.rapid.machine.batches import Batches


# What routines become: flat lists of steps with jumps; and the names that can be seen where one is compiled.


# Names, numbers and operators that are computed in about the time of a step.
NODES = 8
Step: TypeAlias = Callable[[State], None]
Evaluate: TypeAlias = Callable[[State], Value]


@final
@dataclass(frozen=True, slots=True)
class Code:
    """An expression that was compiled.

    Attributes:
        kind: its type in lower case; empty for an aggregate, whose type is that of where it goes.
        run: gives its value.
    """

    kind: str
    run: Evaluate


@final
@dataclass(frozen=True, slots=True)
class Local:
    """A routine's own datum or parameter: its slot, type, and whether the slot holds a reference."""

    slot: int
    kind: str
    by_reference: bool


@final
@dataclass(frozen=True, slots=True)
class Global:
    """A module's datum: its slot, type, storage, module, and whether that is loaded from the start."""

    slot: int
    kind: str
    storage: str
    file: str
    resident: bool


@final
class RoutineCode:
    """A routine as steps.

    Attributes:
        number: in the task.
        name: as written.
        file: of its module.
        kind: PROC, FUNC or TRAP.
        returns: type of its value in lower case.
        parameters: in order.
        local: whether only its module sees it.
        steps: what is done, in order.
        lines: of each step; negative for one that belongs to no statement of its own.
        weights: how many steps each counts for: what it computes besides counts too.
        after: for each step the one behind its statement.
        handlers: error numbers that a handler takes, and its first step.
        setup: gives its own data their first values.
        size: slots of its frame.
        weight: how many steps it counts for to enter it, or to look for the handler of an error.
        batches: its moves to constant targets.
        word: its name in lower case.
    """

    __slots__ = (
        "after", "batches", "file", "handlers", "kind", "lines", "local", "name", "number", "parameters", "returns",
        "setup", "size", "steps", "weight", "weights", "word",
    )  # fmt: skip

    def __init__(
        self, number: int, name: str, file: str, *, kind: str, returns: str, parameters: tuple[Parameter, ...],
        local: bool,
    ) -> None:  # fmt: skip
        self.number = number
        self.name, self.file, self.kind, self.returns = name, file, kind, returns.lower()
        self.parameters, self.local, self.word = parameters, local, name.lower()
        self.steps: list[Step] = []
        self.lines, self.weights = array("i"), array("i")
        self.after = array("i")
        self.handlers: list[tuple[tuple[Evaluate, ...], int]] = []
        self.setup: list[tuple[int, Evaluate]] = []
        self.size = self.weight = 0
        self.batches: Batches | None = None

    def line_of(self, step: int) -> int:
        """Return where a step stands."""
        return abs(self.lines[step])


@final
@dataclass(frozen=True, slots=True)
class Declared:
    """All that the modules of a task declare, by name in lower case.

    Modules in a folder of the controller's disk see one another and those outside of folders, which call them by their
    names only: so two folders may declare the same, as long as one is forgotten before the other is loaded.

    Attributes:
        data: of all modules outside of folders, by name.
        own_data: LOCAL ones, by file and name; those of the modules in a folder, by folder and name.
        routines: by name.
        own_routines: as `own_data`.
        records: components of each record type.
        aliases: types by another name.
        signals: type of each signal of the controller.
    """

    data: dict[str, Global] = field(default_factory=dict[str, Global])
    own_data: dict[tuple[str, str], Global] = field(default_factory=dict[tuple[str, str], Global])
    routines: dict[str, RoutineCode] = field(default_factory=dict[str, RoutineCode])
    own_routines: dict[tuple[str, str], RoutineCode] = field(default_factory=dict[tuple[str, str], RoutineCode])
    records: dict[str, Components] = field(default_factory=dict[str, Components])
    aliases: dict[str, str] = field(default_factory=dict[str, str])
    signals: Mapping[str, str] = field(default_factory=dict[str, str])


@final
class Scope:
    """The names that can be seen where an expression stands, and how much was compiled since a step was emitted."""

    __slots__ = ("declared", "file", "folder", "locals", "named", "nodes", "size")

    def __init__(self, declared: Declared, file: str) -> None:
        self.declared = declared
        self.file = file
        self.folder = file.rpartition("/")[0]
        self.locals: dict[str, Local] = {}
        # What was compiled of names that no routine declares.
        self.named: dict[str, Code] = {}
        self.size = self.nodes = 0

    def weigh(self) -> int:
        """Return how many steps what was compiled since this was asked last counts for, besides its own."""
        nodes, self.nodes = self.nodes, 0
        return nodes // NODES

    def add(self, name: str, kind: str, *, by_reference: bool = False) -> int:
        """Declare a datum of the routine, or a hidden one under an empty name, and return its slot."""
        slot, self.size = self.size, self.size + 1
        if name:
            self.locals[name.lower()] = Local(slot, self.kind(kind), by_reference)
        return slot

    def kind(self, name: str) -> str:
        """Return a type by its own name, in lower case."""
        name = name.lower()
        return self.declared.aliases.get(name, name)

    def datum(self, name: str) -> Global | None:
        """Return the module's datum of a name."""
        name = name.lower()
        own = self.declared.own_data
        return own.get((self.file, name)) or own.get((self.folder, name)) or self.declared.data.get(name)

    def routine(self, name: str) -> RoutineCode | None:
        """Return the routine of a name, whether its module is loaded or not."""
        name = name.lower()
        own = self.declared.own_routines
        return own.get((self.file, name)) or own.get((self.folder, name)) or self.declared.routines.get(name)


# Executes steps: the loop, errors and their handlers, and routines called from within an expression.


# Routines that call one another deeper than this call themselves.
_DEEPEST = 200


def advance(state: State, until: float) -> None:
    """Execute until the program waits beyond a moment, or ends; outputs switch up to that moment."""
    state.until = until
    frames, pending, seen = state.frames, state.pending, state.log.seen
    most = state.scenario.most_steps
    while state.clock <= until and state.ended == "runs" and len(frames) > state.base:
        if pending:
            state.fire(state.clock)
        frame = frames[-1]
        pc = frame.pc
        routine = frame.routine
        frame.pc = pc + 1
        seen[routine.number][pc] = 1
        state.steps += routine.weights[pc]
        if state.steps > most:
            state.end("error", f"the program has made {most} steps and does not end")
            return
        try:
            routine.steps[pc](state)
        except Fault as error:
            _handle(state, error)


def enter(state: State, routine: RoutineCode, arguments: list[Slot]) -> None:
    """Begin to execute a routine, whose arguments were bound."""
    if len(state.frames) >= _DEEPEST:
        state.end("error", f"calls are nested deeper than {_DEEPEST}")
        return
    if routine.word in state.watched:
        _note(state, routine, arguments)
    state.steps += routine.weight
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
    state.steps += frame.routine.weight
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
            fault("ERR_ILLRAISE", "RAISE without a number is outside an error handler")
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
    state.log.calls.append(Called(routine.word, values, state.clock, state.log.count, file, line))
