"""Executes the program of a stack from home to home, cut into layers and held to their own programs."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeAlias, final

import numpy as np

from geoprint.errors import how_many
from geoprint.model import BoolArray, Cell, FloatArray, IntArray, Placement, comparable
from geoprint.postprocessor.execution import StackProof
from geoprint.postprocessor.rapid.language.syntax import Module, Place, Value, refuse
from geoprint.postprocessor.rapid.machine import (
    Called,
    Controller,
    Execution,
    MachineTask,
    Moves,
    Scenario,
    Switching,
    compile_task,
    execute,
)
from geoprint.postprocessor.rapid.made import BEGIN, dry, printing, signals_of, task_of
from geoprint.postprocessor.rapid.settings import unit_of
from geoprint.postprocessor.rapid.templates import driving_unit
from geoprint.robot.arm import Arm

# Cuts the execution of a stack into its layers, and compares one with the execution of that layer's own program.


# Numbers of a move that are those of its text, so that nothing but equality will do; and what they are in words.
_WRITTEN = {
    "verbs": "instruction", "places": "position", "turns": "attitude", "configurations": "configuration",
    "other_axes": "external axis", "speeds": "speed", "zones": "zone",
}  # fmt: skip
# What the controller does at its events is no layer's: it comes before the first one, at the same moment.
_RESIDENT = ".sys"
# A move takes the same time in both, but for the rounding of the clock that counts on [s].
_TIME_TOLERANCE = 1e-6


@final
@comparable
class Part:
    """What was executed of one layer, from the call that begins it to the one that begins the next.

    Attributes:
        execution: that it is a part of.
        folder: of its modules; empty for a program by itself.
        first: its first move.
        count: how many moves it makes.
        begin: when it is begun [s].
        end: when the arm is home again [s].
        calls: of watched routines.
        switchings: with their moves counted from its first.
    """

    execution: Execution
    folder: str
    first: int
    count: int
    begin: float
    end: float
    calls: tuple[Called, ...]
    switchings: tuple[Switching, ...]

    @property
    def rows(self) -> IntArray:
        """Which moves of the execution are its own."""
        return np.arange(self.first, self.first + self.count)

    @property
    def runs(self) -> int:
        """How many runs it says that it has."""
        given = self.calls[0].arguments[0] if self.calls[0].arguments else None
        return int(given) if isinstance(given, float) else 0

    def place(self, row: int) -> Place:
        """Return where one of its moves stands."""
        moves = self.execution.moves
        if not self.count:
            return Place(self.calls[0].file, self.calls[0].line)
        at = self.first + min(row, self.count - 1)
        return Place(self.execution.files[int(moves.files[at])], int(moves.lines[at]))


def parts_of(execution: Execution) -> list[Part]:
    """Return the layers of an execution, in the order in which they were begun."""
    begun = [call for call in execution.calls if call.routine == BEGIN]
    edges = [*((call.moves, call.time) for call in begun), (execution.moves.count, np.inf)]
    parts: list[Part] = []
    for call, (first, begin), (last, behind) in zip(begun, edges, edges[1:], strict=False):
        switchings = tuple(
            replace(each, move=each.move - first if each.move >= 0 else -1)
            for each in execution.switchings
            if begin <= each.time < behind and not each.file.endswith(_RESIDENT)
        )
        ends = execution.moves.ends[first:last]
        parts.append(
            Part(
                execution, folder=call.file.rpartition("/")[0], first=first, count=last - first, begin=begin,
                end=float(ends[-1]) if ends.size else begin,
                calls=tuple(each for each in execution.calls if begin <= each.time < behind), switchings=switchings,
            )
        )  # fmt: skip
    return parts


def state_of(switchings: Iterable[Switching], moment: float) -> dict[str, float]:
    """Return the value of each output at a moment; what was never switched is left out."""
    return {each.signal: each.value for each in switchings if each.time <= moment and not each.flow}


def compare_part(part: Part, own: Part, *, course: str) -> None:
    """Check that a layer of a stack moves and switches as its own program does, number by number.

    Args:
        part: of the stack's execution.
        own: of the execution of its own program, run likewise.
        course: how the stack is run, for the message.

    Raises:
        VerificationError: it does not; the first line that differs is named.
    """
    said = f"{course}: {part.folder}"
    if part.count != own.count:
        refuse(part.place(own.count), f"{said} makes {how_many(part.count, 'move')}, its own program {own.count}")
    for name, words in _WRITTEN.items():
        _same(part, _column(part, name), _column(own, name), f"{said}: the {words}")
    _same_names(part, own, said)
    along = np.intersect1d(part.execution.moves.along_path, part.rows)
    alike = np.intersect1d(own.execution.moves.along_path, own.rows)
    frames = [_frames(each.execution.moves, rows) for each, rows in ((part, along), (own, alike))]
    _same(part, frames[0], frames[1], f"{said}: the frame", rows=along - part.first)
    times = [_durations(each.execution.moves, rows) for each, rows in ((part, along), (own, alike))]
    slow = np.flatnonzero(np.abs(times[0] - times[1]) > _TIME_TOLERANCE)
    if slow.size:
        row = int(along[slow[0]]) - part.first
        refuse(part.place(row), f"{said}: a move takes another time than in its own program")
    _same_calls(part, own, said)
    _same_switchings(part, own, said)


def _column(part: Part, name: str) -> FloatArray:
    """Return (n, ...) what moves of a part have of one kind, as numbers."""
    return getattr(part.execution.moves, name)[part.rows].astype(np.float64)


def _same(part: Part, found: FloatArray, wanted: FloatArray, what: str, *, rows: IntArray | None = None) -> None:
    differs = np.flatnonzero((found != wanted).reshape(len(found), -1).any(axis=1))
    if differs.size:
        row = int(differs[0])
        refuse(
            part.place(row if rows is None else int(rows[row])),
            f"{what} is {found[row].tolist()}, its own program has {wanted[row].tolist()}",
        )


def _same_names(part: Part, own: Part, said: str) -> None:
    """Check the tools and work objects, whose numbers are each execution's own."""
    found, wanted = (_named(each) for each in (part, own))
    for row, (one, other) in enumerate(zip(found, wanted, strict=True)):
        if one != other:
            words, own_words = (" in ".join(each) for each in (one, other))
            refuse(part.place(row), f"{said}: the move is made with {words}, in its own program with {own_words}")


def _named(part: Part) -> list[tuple[str, str]]:
    moves, rows = part.execution.moves, part.rows
    names = moves.names
    return [(names[tool], names[work]) for tool, work in zip(moves.tools[rows], moves.works[rows], strict=True)]


def _frames(moves: Moves, rows: IntArray) -> FloatArray:
    return moves.Ts_base_target[moves.frames[rows]]


def _durations(moves: Moves, rows: IntArray) -> FloatArray:
    return moves.ends[rows] - moves.begins[rows]


def _same_calls(part: Part, own: Part, said: str) -> None:
    found, wanted = ([(call.routine, call.arguments) for call in each.calls] for each in (part, own))
    if found != wanted:
        call = part.calls[min(_first_other(found, wanted), len(part.calls) - 1)]
        refuse(Place(call.file, call.line), f"{said}: its runs follow one another otherwise than in its own program")


def _same_switchings(part: Part, own: Part, said: str) -> None:
    """Check that all outputs are given the same values, in the same order, at the same places of the same moves."""
    found, wanted = (_bare(each.switchings) for each in (part, own))
    if found == wanted:
        return
    if not part.switchings:
        refuse(part.place(0), f"{said} switches nothing, its own program does")
    each = part.switchings[min(_first_other(found, wanted), len(part.switchings) - 1)]
    refuse(Place(each.file, each.line), f"{said}: {each.signal} switches here otherwise than in its own program")


def _first_other(found: Sequence[object], wanted: Sequence[object]) -> int:
    """Return the place of the first that differs, or where the shorter one ends."""
    pairs = enumerate(zip(found, wanted, strict=False))
    return next((k for k, (one, other) in pairs if one != other), min(len(found), len(wanted)))


def _bare(switchings: Sequence[Switching]) -> list[Switching]:
    """Return switchings without when they come and where they stand."""
    return [replace(each, time=0.0, file="", line=0) for each in switchings]


# Executes the program of a stack from home to home, and holds each layer to what its own program does by itself.
#
# It is run dry, printing, begun at a layer and at a run in the middle, ended before the last layer, where it must
# refuse, and stopped in a layer and begun again. In each of them every number of every move and switching must be
# the one that the layer's own program, executed alone, has there.


_MAIN = "GeoStack.mod"
_ENTRY = Place(_MAIN, 1)
# What a guard shows behind a stop, before the line that must name the layer.
_CUT_SHORT = "The last print was stopped in run"
# What it shows before an attitude of a table, with its number: of one that a person moves, and of one that it drives.
_ASKED, _DRIVEN = "Bring the table to attitude", "The table will drive to attitude"
# How it was run, in words, and lines of GeoStack's statements with whether each was executed.
_Ran: TypeAlias = tuple[str, IntArray, BoolArray]


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
                refuse(
                    part.place(0),
                    f"{course.name}: nothing asks before the table comes to attitude {number}",
                )

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
