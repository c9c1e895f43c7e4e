"""Compiles the statements of a routine to steps, between any two of which the state can be copied."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, cast, final

from geoprint.postprocessor.rapid.language.syntax import (
    Assignment,
    Call,
    Component,
    Connect,
    Element,
    Expression,
    For,
    Goto,
    If,
    Label,
    Leave,
    Name,
    Routine,
    Series,
    Statement,
    Test,
    Value,
    While,
)
from geoprint.postprocessor.rapid.machine.calls import binder, by_reference, late_call
from geoprint.postprocessor.rapid.machine.expressions import compiled, operand, reference
from geoprint.postprocessor.rapid.machine.instructions import INSTRUCTIONS
from geoprint.postprocessor.rapid.machine.move_calls import (
    MOVES,
    compile_instruction,
    compile_move,
    compile_series,
    compile_trigger,
)
from geoprint.postprocessor.rapid.machine.state import ELEMENTS, State, elements, kept
from geoprint.postprocessor.rapid.machine.stepping import NODES, RoutineCode, Scope, Step, enter, leave, raise_on
from geoprint.postprocessor.rapid.machine.values import array_of, fault, initial, unknown

if TYPE_CHECKING:
    from geoprint.postprocessor.rapid.machine.task import MachineTask


# Instructions that define a trigger, and do nothing else.
_TRIGGERS = frozenset({"triggio", "triggequip", "triggspeed"})


@final
class _Place:
    """A step that is jumped to, whose number is known later."""

    __slots__ = ("step",)

    def __init__(self) -> None:
        self.step = -1


def compile_routine(routine: Routine, code: RoutineCode, task: MachineTask) -> None:
    """Fill the code of a routine.

    Raises:
        VerificationError: it does what this machine does not know.
    """
    scope = Scope(task.declared, code.file)
    compiler = _Compiler(code, scope, task)
    for parameter in routine.parameters:
        scope.add(parameter.name, parameter.kind, by_reference=by_reference(parameter))
    for datum in routine.data:
        sizes = tuple(int(cast("float", compiled(size, scope).run(task.blank))) for size in datum.sizes)
        first = cast("Value", array_of(initial(scope.kind(datum.kind), task.declared.records), sizes))
        run = _constant(first) if datum.value is None else _kept(compiled(datum.value, scope).run)
        code.setup.append((scope.add(datum.name, datum.kind), run))
    if routine.undo or routine.backward:
        unknown(code.file, routine.line, f"{routine.name} has an UNDO or BACKWARD clause, which is not executed here")
    code.weight = scope.weigh()
    compiler.body(routine.body)
    compiler.emit(lambda state: leave(state, None), -routine.last_line)
    for handler in routine.handlers:
        errors = tuple(compiled(error, scope).run for error in handler.errors)
        code.weight += 1 + scope.weigh()
        code.handlers.append((errors, len(code.steps)))
        compiler.body(handler.body)
        compiler.emit(lambda state: leave(state, None), -routine.last_line)
    compiler.finish()
    code.size = scope.size
    code.weight += scope.size // NODES


def _constant(value: Value) -> Callable[[State], Value]:
    return lambda _: value


def _kept(run: Callable[[State], Value]) -> Callable[[State], Value]:
    return lambda state: kept(state, run(state))


@final
class _Compiler:
    """Appends steps to a routine."""

    def __init__(self, code: RoutineCode, scope: Scope, task: MachineTask) -> None:
        self._code, self._scope, self._task = code, scope, task
        self._labels: dict[str, _Place] = {}
        self._asked: list[tuple[int, str]] = []
        self._makers: Mapping[type, Callable[[Any], None]] = {
            Call: self._call, Series: self._series, Assignment: self._assignment, If: self._if, Test: self._test,
            For: self._for, While: self._while, Leave: self._leave, Goto: self._goto, Label: self._mark,
            Connect: self._connect,
        }  # fmt: skip

    def emit(self, step: Step, line: int) -> None:
        """Append a step; a negative line is that of a step that belongs to no statement of its own."""
        self._code.steps.append(step)
        self._code.lines.append(line)
        self._code.weights.append(1 + self._scope.weigh())
        self._code.after.append(-1)

    def finish(self) -> None:
        """Check that every label exists, and seal the moves."""
        for line, name in self._asked:
            if self._labels[name].step < 0:
                unknown(self._scope.file, line, f"there is no label {name}")
        if self._code.batches is not None:
            self._code.batches.seal()

    def body(self, statements: tuple[Statement, ...]) -> None:
        """Append statements, and note for each of their steps what comes behind the statement."""
        for statement in statements:
            first = len(self._code.steps)
            self._makers[type(statement)](statement)
            after = len(self._code.steps)
            for step in range(first, after):
                if self._code.after[step] < 0:
                    self._code.after[step] = after

    def _goto(self, statement: Goto) -> None:
        self._asked.append((statement.line, statement.label.lower()))
        self._jump(self._label(statement.label), statement.line)

    def _mark(self, statement: Label) -> None:
        self._here(self._label(statement.name))

    def _connect(self, statement: Connect) -> None:
        unknown(self._scope.file, statement.line, "CONNECT ties an interrupt, which this machine does not know")

    def _label(self, name: str) -> _Place:
        return self._labels.setdefault(name.lower(), _Place())

    def _here(self, place: _Place) -> None:
        place.step = len(self._code.steps)

    def _jump(self, place: _Place, line: int) -> None:
        def jump(state: State) -> None:
            state.frames[-1].pc = place.step

        self.emit(jump, line)

    def _unless(self, condition: Expression, place: _Place, line: int) -> None:
        """Append a jump that is taken where a condition does not hold."""
        run = operand(condition, self._scope).run

        def test(state: State) -> None:
            if not run(state):
                state.frames[-1].pc = place.step

        self.emit(test, line)

    def _if(self, statement: If) -> None:
        end = _Place()
        for condition, inner in statement.branches:
            otherwise = _Place()
            self._unless(condition, otherwise, condition.line)
            self.body(inner)
            self._jump(end, -statement.line)
            self._here(otherwise)
        self.body(statement.otherwise)
        self._here(end)

    def _test(self, statement: Test) -> None:
        subject, slot = operand(statement.subject, self._scope).run, self._scope.add("", "")
        end = _Place()
        compared = sum(len(values) for values, _ in statement.cases)

        def keep(state: State) -> None:
            state.local[slot] = value = subject(state)
            if type(value) is tuple:
                state.steps += elements(value) * compared // ELEMENTS

        self.emit(keep, statement.line)
        for values, inner in statement.cases:
            otherwise = _Place()
            cases = [operand(value, self._scope).run for value in values]

            def test(state: State, cases: list[Callable[[State], Value]] = cases, place: _Place = otherwise) -> None:
                if all(case(state) != state.local[slot] for case in cases):
                    state.frames[-1].pc = place.step

            self.emit(test, values[0].line)
            self.body(inner)
            self._jump(end, -statement.line)
            self._here(otherwise)
        self.body(statement.default)
        self._here(end)

    def _for(self, statement: For) -> None:
        scope = self._scope
        first, last = operand(statement.first, scope).run, operand(statement.last, scope).run
        step = None if statement.step is None else operand(statement.step, scope).run
        hidden = scope.locals.get(statement.variable.lower())
        slot = scope.add(statement.variable, "num")
        end_slot, step_slot = scope.add("", "num"), scope.add("", "num")

        def begin(state: State) -> None:
            low, high = cast("float", first(state)), cast("float", last(state))
            by = (1.0 if high >= low else -1.0) if step is None else cast("float", step(state))
            state.local[slot], state.local[end_slot], state.local[step_slot] = low, high, by

        self.emit(begin, statement.line)
        again, end = _Place(), _Place()
        self._here(again)

        def test(state: State) -> None:
            now, high, by = (cast("float", state.local[each]) for each in (slot, end_slot, step_slot))
            if (now > high) if by > 0.0 else (now < high):
                state.frames[-1].pc = end.step

        self.emit(test, -statement.line)
        self.body(statement.body)

        def following(state: State) -> None:
            state.local[slot] = cast("float", state.local[slot]) + cast("float", state.local[step_slot])
            state.frames[-1].pc = again.step

        self.emit(following, -statement.line)
        self._here(end)
        if hidden is None:
            del scope.locals[statement.variable.lower()]
        else:
            scope.locals[statement.variable.lower()] = hidden

    def _while(self, statement: While) -> None:
        again, end = _Place(), _Place()
        self._here(again)
        self._unless(statement.condition, end, statement.line)
        self.body(statement.body)
        self._jump(again, -statement.line)
        self._here(end)

    def _leave(self, statement: Leave) -> None:
        value = None if statement.value is None else operand(statement.value, self._scope).run
        code = self._code

        def back(state: State) -> None:
            leave(state, None if value is None else kept(state, value(state)))

        def end(state: State) -> None:
            state.end("exit", "EXIT")

        def raised(state: State) -> None:
            raise_on(state, None if value is None else cast("float", value(state)))

        def again(state: State) -> None:
            frame = state.frames[-1]
            if frame.failed < 0:
                fault("ERR_ILLRAISE", "RETRY is outside an error handler")
            frame.pc, frame.failed = frame.failed, -1

        def behind(state: State) -> None:
            frame = state.frames[-1]
            if frame.failed < 0:
                fault("ERR_ILLRAISE", "TRYNEXT is outside an error handler")
            frame.pc, frame.failed = code.after[frame.failed], -1

        steps = {"RETURN": back, "EXIT": end, "RAISE": raised, "RETRY": again, "TRYNEXT": behind}
        self.emit(steps[statement.verb], statement.line)

    def _assignment(self, statement: Assignment) -> None:
        target, run = statement.target, operand(statement.value, self._scope).run
        local = self._scope.locals.get(target.name.lower()) if isinstance(target, Name) else None
        if local is None or local.by_reference:
            self._assign_far(statement, run)
            return
        slot = local.slot

        def assign(state: State) -> None:
            state.local[slot] = kept(state, run(state))

        self.emit(assign, statement.line)

    def _assign_far(self, statement: Assignment, run: Callable[[State], Value]) -> None:
        """Append an assignment to a part of something, to a datum of a module, or to what was handed over."""
        target = statement.target
        find = reference(target, self._scope)
        whole = target
        while not isinstance(whole, Name):
            whole = cast("Name | Component | Element", whole.of)
        own = whole.name.lower() in self._scope.locals
        datum = None if own else self._scope.datum(whole.name)
        if datum is not None and datum.storage == "CONST":
            unknown(self._scope.file, statement.line, f"{whole.name} is a constant, but a value is assigned to it")
        name = whole.name.lower()

        def assign(state: State) -> None:
            value = kept(state, run(state))
            if own or name not in state.scenario.held:
                find(state).put(state, value)

        self.emit(assign, statement.line)

    def _call(self, statement: Call) -> None:
        if statement.late is not None:
            run = compiled(statement.late, self._scope).run
            self.emit(late_call(statement, run, self._scope), statement.line)
            return
        name = statement.name.lower()
        routine = self._scope.routine(name)
        if routine is not None:
            self._own_call(statement, routine)
        elif name in MOVES:
            compile_move(statement, self._scope, code=self._code, task=self._task, emit=self.emit)
        elif name in _TRIGGERS:
            compile_trigger(statement, self._scope, code=self._code, task=self._task, emit=self.emit)
        elif name in INSTRUCTIONS:
            self.emit(compile_instruction(statement, self._scope), statement.line)
        else:
            unknown(self._scope.file, statement.line, f"{statement.name} is not an instruction that this machine knows")

    def _series(self, series: Series) -> None:
        if all(
            name in MOVES and self._scope.routine(name) is None for name in {one.name.lower() for one in series.kinds()}
        ):
            compile_series(series, self._scope, code=self._code, task=self._task, emit=self.emit)
            return
        for call in series.calls():
            self._call(call)

    def _own_call(self, statement: Call, routine: RoutineCode) -> None:
        bind = binder(routine, statement.arguments, self._scope, line=statement.line)

        def call(state: State) -> None:
            if routine.file not in state.loaded:
                fault("ERR_REFUNKPRC", f"{routine.name} is called, but {routine.file} is not loaded")
            enter(state, routine, bind(state))

        self.emit(call, statement.line)
