"""Runs a task by a scenario: to its end, to a moment, through a stop, and on from there or from main."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import cast, final

import numpy as np

from geoprint import transforms
from geoprint.model import BoolArray, IntArray
from geoprint.postprocessor.rapid.language.syntax import Value
from geoprint.postprocessor.rapid.machine.execution import START, Event, Execution, Moves, Scenario
from geoprint.postprocessor.rapid.machine.instructions import begin_data, load
from geoprint.postprocessor.rapid.machine.state import Log, Moving, State, stand_still
from geoprint.postprocessor.rapid.machine.stepping import advance, enter, evaluate_routine
from geoprint.postprocessor.rapid.machine.task import MachineTask
from geoprint.postprocessor.rapid.machine.values import IDENTITY, Fault


def execute(task: MachineTask, scenario: Scenario) -> Execution:
    """Run a program to its end.

    Raises:
        VerificationError: the scenario names what the task does not have.
    """
    controller = Controller(task, scenario)
    controller.run_until(np.inf)
    return controller.execution()


@final
class Controller:
    """A controller with a program in it, which can be stopped, copied and started again at any moment.

    Time stands still while the program does: a stop takes none, and what was to come goes on behind it.

    Args:
        task: its modules.
        scenario: what happens around it.
    """

    __slots__ = ("state",)

    def __init__(self, task: MachineTask, scenario: Scenario, *, started: State | None = None) -> None:
        if started is not None:
            self.state = started
            return
        self.state = State(task, _lowered(scenario), task.arm)
        state = self.state
        state.data = list(task.blank.data)
        state.signals = dict.fromkeys(task.declared.signals, 0.0) | {
            name.lower(): value for name, value in scenario.signals.items()
        }
        state.log.seen = [bytearray(len(routine.steps)) for routine in task.routines]
        for file in task.files:
            if file in task.resident:
                load(state, file)
        self._begin()

    def copy(self) -> Controller:
        """Return the same again; neither changes with the other."""
        return Controller(self.state.task, self.state.scenario, started=self.state.copy())

    def run_until(self, moment: float) -> None:
        """Execute up to a moment of the program's own time [s]."""
        state = self.state
        advance(state, moment)
        if state.ended == "end":
            state.clock = max(state.clock, state.motion.end)
            state.fire(np.inf)
        elif state.ended == "runs":
            state.fire(moment)
        else:
            state.fire(state.clock)
            state.pending.clear()

    def stop_at(self, moment: float, event: Event = "Stop") -> None:
        """Run up to a moment and stop there: the arm stands, and the routines that are tied to the event run."""
        self.run_until(moment)
        state = self.state
        if state.ended != "runs":
            return
        clock, state.clock = state.clock, min(moment, state.clock)
        self._event(event)
        state.clock = clock

    def power_failure(self, signals: Mapping[str, float] | None = None) -> None:
        """Lose the power and get it back: outputs take their values of then, 0 where none are given."""
        state = self.state
        state.signals = dict.fromkeys(state.signals, 0.0) | dict(signals or {})
        self._event("PowerOn")

    def go_on(self) -> None:
        """Start again where the program stood, and run to the end."""
        state = self.state
        # The program is ahead of the arm, which stands.
        clock, state.clock = state.clock, min(state.until, state.clock)
        self._event("Restart")
        if state.ended == "runs":
            state.clock = clock
            self.run_until(np.inf)
        else:
            state.pending.clear()

    def from_main(self, scenario: Scenario) -> None:
        """Let the program begin anew where the arm stands now, with what a person has changed since.

        Variables begin anew, persistents stay, and modules that the program has loaded are gone [ABBRapid].

        Args:
            scenario: its data are set, over what is; its answers are given; the arm and the outputs stay as they are.
        """
        state = self.state
        stand_still(state)
        state.frames.clear()
        state.ended, state.reason, state.file, state.line = "runs", "", "", 0
        state.scenario = replace(_lowered(scenario), signals=state.scenario.signals)
        state.answered = 0
        state.loading.clear()
        for file in sorted(state.loaded - state.task.resident):
            state.loaded -= {file}
            for slot in state.task.slots_of(file):
                state.data[slot] = state.task.blank.data[slot]
        state.routines = {name: one for name, one in state.routines.items() if one.file in state.loaded}
        for file in state.loaded:
            begin_data(state, file, variables_only=True)
        self._set(state.scenario.data)
        clock = min(state.until, state.clock)
        state.clock, state.motion.end, state.motion.entry = clock, clock, clock
        state.motion.displacement, state.motion.modes = IDENTITY, START
        self._begin()

    def note_from_here(self) -> None:
        """Forget what happened so far, so that the execution tells only of what follows."""
        log = Log()
        log.seen = [bytearray(len(each)) for each in self.state.log.seen]
        self.state.log = log
        self.state.frame = self.state.mode = None

    def execution(self) -> Execution:
        """Return what happened so far."""
        state = self.state
        return Execution(
            ended=state.ended, reason=state.reason, file=state.file, line=state.line,
            seconds=float(min(max(state.clock, state.motion.end), max(state.until, 0.0))),
            files=state.task.files, moves=_moves(state), switchings=tuple(state.log.switchings),
            texts=tuple(state.log.texts), questions=tuple(state.log.questions), calls=tuple(state.log.calls),
            statements=_statements(state), loaded=state.loaded,
            data={name: _plain(state.data[datum.slot]) for name, datum in state.task.declared.data.items()},
            signals=dict(state.signals), corners_missed=tuple(state.log.missed),
        )  # fmt: skip

    def _begin(self) -> None:
        state = self.state
        self._event("Reset")
        self._event("Start")
        entry = state.routines.get(state.scenario.entry.lower())
        if entry is None:
            state.ended, state.reason = "error", f"there is no procedure {state.scenario.entry}"
            state.file, state.line = state.task.files[-1] if state.task.files else "", 1
        elif state.ended == "runs":
            enter(state, entry, [])

    def _event(self, event: Event) -> None:
        state = self.state
        for name in state.scenario.ties.get(event, ()):
            routine = state.routines.get(name.lower())
            if routine is None:
                state.end("error", f"the event {event} is tied to {name}, which no loaded module has")
                return
            clock, line = state.clock, state.motion.end
            try:
                evaluate_routine(state, routine, [])
            except Fault as error:
                state.end("error", f"{error.name}: {error.what}, in {name} at {event}")
            # Time stands still.
            state.clock, state.motion.end = clock, line

    def _set(self, data: Mapping[str, Value]) -> None:
        for name, value in data.items():
            datum = self.state.task.declared.data.get(name.lower())
            if datum is not None:
                self.state.data[datum.slot] = value


def _lowered(scenario: Scenario) -> Scenario:
    return replace(
        scenario,
        data={name.lower(): value for name, value in scenario.data.items()},
        held={name.lower(): value for name, value in scenario.held.items()},
    )


def _plain(value: object) -> Value | None:
    return cast("Value", value) if isinstance(value, float | bool | str | tuple) else None


def _moves(state: State) -> Moves:
    rows = state.log.rows()
    whole = rows[:, [0, 1, 2, 22, 23, 24, 28]].astype(np.int64)
    whole.setflags(write=False)
    frames = list(state.log.frames) or [IDENTITY]
    rotations = transforms.rotation_of(np.array([turn for _, turn in frames]))
    return Moves(
        files=whole[:, 0], lines=whole[:, 1], verbs=whole[:, 2], places=rows[:, 3:6], turns=rows[:, 6:10],
        configurations=rows[:, 10:14], other_axes=rows[:, 14:20], speeds=rows[:, 20], zones=rows[:, 21],
        tools=whole[:, 3], works=whole[:, 4], frames=whole[:, 5], begins=rows[:, 25], ends=rows[:, 26],
        lengths=rows[:, 27], names=tuple(state.task.words), modes=whole[:, 6],
        settings=tuple(state.log.modes),
        Ts_base_target=transforms.rigid(rotations, np.array([place for place, _ in frames])),
    )  # fmt: skip


def _statements(state: State) -> dict[str, tuple[IntArray, BoolArray]]:
    """Return for each module the lines of its statements, and whether each was executed."""
    found: dict[str, tuple[IntArray, BoolArray]] = {}
    for file in state.task.files:
        routines = [routine for routine in state.task.routines if routine.file == file]
        lines = np.concatenate([np.empty(0, np.int64), *(np.array(each.lines, np.int64) for each in routines)])
        seen = b"".join(bytes(state.log.seen[each.number]) for each in routines)
        counted = lines > 0
        found[file] = lines[counted], np.frombuffer(seen, np.uint8).astype(np.bool_)[counted]
    return found


__all__ = ["Controller", "Moving", "execute"]
