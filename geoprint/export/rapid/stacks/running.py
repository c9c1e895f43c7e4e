"""Executes the program of a stack from home to home, and holds each layer to what its own program does by itself.

It is run dry, printing, begun at a layer and at a run in the middle, ended before the last layer, where it must refuse,
and stopped in a layer and begun again. In each of them every number of every move and switching must be the one that
the layer's own program, executed alone, has there.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeAlias, final

import numpy as np

from geoprint.export.rapid.language.syntax import Module, Value
from geoprint.export.rapid.machine import (
    Controller,
    Execution,
    MachineTask,
    Scenario,
    Switching,
    compile_task,
    execute,
)
from geoprint.export.rapid.made import dry, printing, signals_of, task_of
from geoprint.export.rapid.settings import unit_of
from geoprint.export.rapid.stacks.comparing import Part, compare_part, parts_of, state_of
from geoprint.export.rapid.templates import driving_unit
from geoprint.export.rapid.text import Place, refuse
from geoprint.model import BoolArray, Cell, IntArray, Placement, comparable
from geoprint.motion.arm import Arm

_MAIN = "GeoStack.mod"
_ENTRY = Place(_MAIN, 1)
# What a guard shows behind a stop, before the line that must name the layer.
_CUT_SHORT = "The last print was stopped in run"
# What it shows before an attitude of a table, with its number: of one that a person moves, and of one that it drives.
_ASKED, _DRIVEN = "Bring the table to attitude", "The table will drive to attitude"
# How it was run, in words, and lines of GeoStack's statements with whether each was executed.
_Ran: TypeAlias = tuple[str, IntArray, BoolArray]
# The machine's clock is a sum of a hundred thousand moves [s].
_TIME_TOLERANCE = 1e-6


@final
@comparable
class StackProof:
    """What was executed of the program of a stack.

    Attributes:
        scenarios: how it was run, in words.
        refused: likewise, where it ended before anything moved, as it must.
        statements: how many lines of GeoStack hold some.
        executed: how many of these were executed in at least one scenario.
        runs: of each layer, how many.
        seconds: of each layer as it prints, from home to home [s].
    """

    scenarios: tuple[str, ...]
    refused: tuple[str, ...]
    statements: int
    executed: int
    runs: tuple[int, ...]
    seconds: tuple[float, ...]


@final
@dataclass(frozen=True, slots=True)
class _Course:
    """How a stack is run: in words, from which layer on, to which, from which run of the first on, and whether dry."""

    name: str
    first: int
    last: int
    run: int = 1
    dry: bool = False


@final
class StackRun:
    """A stack on the machine, beside the own programs of its layers.

    Args:
        modules: GeoStack, what stays on the controller, and the modules of all layers, in their folders.
        layers: folder and modules of the own program of each layer or attitude, with what stays on the controller.
        ends: numbers of those behind which another layer begins.
        cell: outputs, home and pause.
        placement: whether it is known where the part stands.
    """

    def __init__(
        self, modules: Sequence[Module], layers: Sequence[tuple[str, Sequence[Module]]], *, ends: Collection[int],
        cell: Cell, placement: Placement,
    ) -> None:  # fmt: skip
        self._ends = frozenset(ends)
        self._cell, self._placement, self._unit = cell, placement, unit_of(placement)
        self._arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
        at_once = [module.file for module in modules if "/" not in module.file]
        self._task = compile_task(modules, at_once=at_once, signals=signals_of(cell), arm=self._arm)
        self._folders = [folder for folder, _ in layers]
        # The parts of their executions: dry by layer, printing by layer and first run.
        self._dry: dict[int, Part] = {}
        self._printing: dict[tuple[int, int], Part] = {}
        self._runs: list[int] = []
        for number, (_, own) in enumerate(layers, start=1):
            self._runs.append(self._run_own(number, own))

    @property
    def _one(self) -> str:
        """What a part of the program is called: a layer or an attitude."""
        return self._unit.lower()

    def prove(self) -> StackProof:
        """Execute the stack in all its courses.

        Raises:
            VerificationError: a layer does something else than its own program, or is left out, or comes in another
                order; something is on between layers; the pause is another; a setting that makes no sense is not
                refused; what GeoStack notes does not lead back to the layer that a stop has cut short.
        """
        gaps: Sequence[float] = ()
        printed: list[Part] = []
        # Executions are large: what is kept of each is its name and which lines of GeoStack it has executed.
        ran: list[_Ran] = []
        for course in self._courses():
            execution = execute(self._task, self._scenario(course))
            parts = self._check(course, execution)
            found = [behind.begin - before.end for before, behind in pairwise(parts)]
            if course.dry:
                gaps = found
            elif course.name == "printing":
                self._check_pauses(found, gaps)
                printed = parts
            ran.append((course.name, *execution.statements[_MAIN]))
        ran += self._stopped(printed[-1])
        refused = self._refusals()
        lines = ran[0][1]
        seen: BoolArray = np.logical_or.reduce([each for _, _, each in (*ran, *refused)])
        left, count = np.unique(lines[~seen]).size, np.unique(lines).size
        names, others = (tuple(name for name, _, _ in each) for each in (ran, refused))
        seconds = tuple(part.end - part.begin for part in printed)
        return StackProof(names, others, count, count - left, tuple(self._runs), seconds)

    def _run_own(self, number: int, modules: Sequence[Module]) -> int:
        """Execute a layer's own program as its courses need it, and return how many runs it has."""
        task = task_of(modules, cell=self._cell, arm=self._arm)
        whole = self._alone(task, printing(self._cell, placement=self._placement))
        self._printing[number, 1] = whole
        self._dry[number] = self._alone(task, dry(self._cell, placement=self._placement))
        middle = whole.runs // 2 + 1
        later = printing(self._cell, placement=self._placement, first=middle)
        self._printing[number, middle] = self._alone(task, later)
        return whole.runs

    def _alone(self, task: MachineTask, scenario: Scenario) -> Part:
        execution = execute(task, scenario)
        parts = parts_of(execution)
        if execution.ended != "end" or len(parts) != 1:
            place = Place(execution.file or "GeoPrint.mod", max(execution.line, 1))
            refuse(place, f"the own program of a layer does not run to its end: {execution.reason}")
        return parts[0]

    def _courses(self) -> list[_Course]:
        count = len(self._runs)
        middle = count // 2 + 1
        run = self._runs[middle - 1] // 2 + 1
        resumed = [_Course(f"printing from run {run} of {self._one} {middle} on", middle, count, run)]
        courses = [_Course("dry", 1, count, dry=True), _Course("printing", 1, count)]
        if count > 1:
            courses += [
                _Course(f"printing from {self._one} {middle} on", middle, count),
                _Course(f"printing up to {self._one} {count - 1}", 1, count - 1),
            ]
        return [*courses, *(resumed if run > 1 else ())]

    def _scenario(self, course: _Course) -> Scenario:
        tables = course.last - course.first + 1
        printed = printing(self._cell, placement=self._placement, first=course.run, tables=tables)
        scenario = dry(self._cell, placement=self._placement, tables=tables) if course.dry else printed
        data: dict[str, Value] = {
            f"geoFirst{self._unit}": float(course.first),
            f"geoLast{self._unit}": float(course.last),
        }
        # What it would note if it could print.
        held = scenario.held if not scenario.held else {**scenario.held, "geoStackPrints": True}
        return replace(scenario, data={**scenario.data, **data}, held=held)

    def _check(self, course: _Course, execution: Execution) -> list[Part]:
        """Check that the right layers came in their order, each as its own program, and what is noted behind them."""
        if execution.ended != "end":
            place = Place(execution.file or _MAIN, max(execution.line, 1))
            refuse(place, f"{course.name}: the stack does not run to its end: {execution.reason}")
        parts = parts_of(execution)
        wanted = self._folders[course.first - 1 : course.last]
        found = [part.folder for part in parts]
        if found != wanted:
            refuse(_ENTRY, f"{course.name}: the {self._one}s printed are {found}, planned are {wanted}")
        for number, part in enumerate(parts, start=course.first):
            run = course.run if number == course.first else 1
            own = self._dry[number] if course.dry else self._printing[number, run]
            compare_part(part, own, course=course.name)
        self._check_shut(course.name, execution, parts)
        self._check_asked(course, execution, parts)
        first = f"geofirst{self._one}"
        noted = {first: float(course.first), "geofirstrun": float(course.run)}
        if not course.dry:
            noted = {first: float(course.last + 1), "geofirstrun": 1.0}
        for name, value in noted.items():
            if execution.data[name] != value:
                refuse(_ENTRY, f"{course.name}: {name} is {execution.data[name]} at the end, and should be {value:g}")
        return parts

    def _check_shut(self, name: str, execution: Execution, parts: Sequence[Part]) -> None:
        """Check that every output is 0 as the arm comes home from each layer."""
        for part in parts:
            on = [signal for signal, value in state_of(execution.switchings, part.end).items() if value]
            if on:
                refuse(_ENTRY, f"{name}: behind {part.folder} {', '.join(sorted(on))} is still on")

    def _check_asked(self, course: _Course, execution: Execution, parts: Sequence[Part]) -> None:
        """Check that the table is asked for at home before each attitude, by the attitude's own number."""
        if self._placement.table is None:
            return
        asked = _ASKED if driving_unit(self._cell, self._placement) is None else _DRIVEN
        for number, part in enumerate(parts, start=course.first):
            moves = execution.moves
            along = np.intersect1d(moves.along_path, part.rows)
            first = float(moves.begins[along[0]]) if along.size else np.inf
            said = [text for moment, text in execution.texts if part.begin <= moment <= first]
            if f"{asked} {number}" not in said:
                refuse(part.place(0), f"{course.name}: nobody is asked before the table comes to attitude {number}")

    def _check_pauses(self, found: Sequence[float], dry_gaps: Sequence[float]) -> None:
        for number, (gap, none) in enumerate(zip(found, dry_gaps, strict=True), start=1):
            pause = self._cell.process.layer_pause if number in self._ends else 0.0
            if abs(gap - none - pause) > _TIME_TOLERANCE:
                refuse(
                    _ENTRY,
                    f"the pause behind {self._one} {number} is {gap - none:.3f} s, and should be {pause:g} s",
                )

    def _refusals(self) -> list[_Ran]:
        """Execute what must be refused before anything moves."""
        count = len(self._runs)
        base = self._scenario(self._courses()[1])
        cases: dict[str, Mapping[str, Value]] = {
            f"first {self._one} 0": {f"geoFirst{self._unit}": 0.0},
            f"first {self._one} {count + 1}": {f"geoFirst{self._unit}": float(count + 1)},
            f"last {self._one} {count + 1}": {f"geoLast{self._unit}": float(count + 1)},
            f"last {self._one} 0": {f"geoLast{self._unit}": 0.0},
            f"first run {self._runs[0] + 1}": {"geoFirstRun": float(self._runs[0] + 1)},
        }
        scenarios = {name: replace(base, data={**base.data, **data}) for name, data in cases.items()}
        there = self._task.disk(base)
        missing = f"{self._folders[0]}/GeoPrint.mod"
        scenarios["a module that is not in HOME:"] = replace(base, disk=there - {missing})
        found: list[_Ran] = []
        for name, scenario in scenarios.items():
            execution = execute(self._task, scenario)
            if execution.ended != "exit" or execution.moves.count:
                place = Place(execution.file or _MAIN, max(execution.line, 1))
                refuse(place, f"{name}: the stack must refuse before it moves, and it does not")
            found.append((name, *execution.statements[_MAIN]))
        return found

    def _stopped(self, last: Part) -> list[_Ran]:
        """Execute a stop while the last layer prints, and a start from main behind it: it must be that layer's.

        Nothing is stopped where nothing is switched on but in thought.
        """
        count = len(self._runs)
        whole = _Course("printing", 1, count)
        scenario = self._scenario(whole)
        valve = self._cell.signals.dispenser.lower()
        on = [each for each in last.switchings if each.signal == valve and each.value > 0.0 and each.move >= 0]
        if scenario.held or not on:
            return []
        controller = Controller(self._task, scenario)
        controller.stop_at(_soon(last, on[0]), "Stop")
        lit = [name for name, value in controller.state.signals.items() if value]
        if lit:
            refuse(_ENTRY, f"stopped in {self._one} {count}, {', '.join(lit)} is still on")
        controller.note_from_here()
        # A person moves the arm home slowly, and looks at the nozzle.
        controller.from_main(
            replace(scenario, data={"geoFirstRun": 1.0}, answers=(1.0,) * (2 if self._placement.table is None else 3))
        )
        controller.run_until(np.inf)
        execution = controller.execution()
        name = f"stopped in {self._one} {count}, and begun again from main"
        self._check(_Course(name, count, count), execution)
        texts = [text for _, text in execution.texts]
        said = next((k for k, text in enumerate(texts) if text.startswith(_CUT_SHORT)), len(texts))
        if f"of {self._one} {count}" not in texts[said + 1 : said + 2]:
            refuse(_ENTRY, f"{name}: nothing says in which {self._one} the print was stopped")
        return [(name, *execution.statements[_MAIN])]


def _soon(part: Part, switched: Switching) -> float:
    """Return a moment within the move that follows the first of those that carry material [s]."""
    moves = part.execution.moves
    row = part.first + switched.move + 1
    return float(moves.begins[row] + 0.5 * (moves.ends[row] - moves.begins[row]))
