"""What a program makes of its path when it is executed: the moves of its runs, and what switches along them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import numpy as np

from geoprint.model import Cell, FloatArray, IntArray, Placement, TiltTurn, comparable, freeze_arrays
from geoprint.postprocessor.orders import Orders
from geoprint.postprocessor.rapid.language.syntax import Module, Place, refuse
from geoprint.postprocessor.rapid.machine import (
    Event,
    Execution,
    MachineTask,
    Scenario,
    Switching,
    compile_task,
    execute,
)
from geoprint.robot.arm import Arm

# Routines of the resident module that the controller's configuration ties to its events.
TIES: Mapping[Event, tuple[str, ...]] = {
    "Stop": ("GeoResidentStopped",),
    "QStop": ("GeoResidentStopped",),
    "Start": ("GeoResidentStarted",),
    "Restart": ("GeoResidentRestarted",),
    "Reset": ("GeoResidentReset",),
    "PowerOn": ("GeoResidentPowered",),
}
# Calls of the guard that are noted: what begins, enters each run, and ends.
BEGIN, ENTER, END = "geobegin", "geoenter", "geoend"
# The value that every trigger writes which switches on; the guard keeps it 0 in a dry run.
_ON = "geoOn"
# A dry run is driven at another speed than a print, so that a program that sets its own shows [%].
_DRY_PCT = 50.0


@final
@comparable
class Made:
    """The path of one execution: t targets.

    Attributes:
        execution: all of it.
        rows: (t,) which of its moves are the path's.
        runs: (t,) run in which each is made, from 1; 0 before any.
        scenario: how the program was run.
    """

    execution: Execution
    rows: IntArray
    runs: IntArray
    scenario: Scenario

    def __post_init__(self) -> None:
        freeze_arrays(self, rows="int: t", runs="int: t")

    @property
    def count(self) -> int:
        """How many targets."""
        return int(self.rows.size)

    @property
    def places(self) -> FloatArray:
        """(t, 3) targets in the work object [mm]."""
        return self.execution.moves.places[self.rows]

    @property
    def turns(self) -> FloatArray:
        """(t, 4) attitudes of the targets."""
        return self.execution.moves.turns[self.rows]

    @property
    def configurations(self) -> FloatArray:
        """(t, 4) configurations of the targets."""
        return self.execution.moves.configurations[self.rows]

    @property
    def switchings(self) -> Mapping[int, tuple[Switching, ...]]:
        """What each move switches, by target, in the order in which it was asked for."""
        switchings = self.execution.switchings
        moves = np.array([each.move for each in switchings], dtype=np.int64)
        targets = np.searchsorted(self.rows, moves)
        carried = np.isin(moves, self.rows)
        found: dict[int, list[Switching]] = {}
        for each, target, along in zip(switchings, targets.tolist(), carried.tolist(), strict=True):
            if along:
                found.setdefault(target, []).append(each)
        return {target: tuple(sorted(some, key=lambda one: one.line)) for target, some in found.items()}

    def place(self, target: int) -> Place:
        """Return where the move to a target stands."""
        moves, row = self.execution.moves, int(self.rows[target])
        return Place(self.execution.files[int(moves.files[row])], int(moves.lines[row]))


def task_of(modules: Sequence[Module], *, cell: Cell, arm: Arm) -> MachineTask:
    """Compile a program for the cell's controller; modules of GeoPath are loaded as it runs.

    Raises:
        VerificationError: it does what the machine does not know.
    """
    at_once = [module.file for module in modules if not module.file.startswith("GeoPath")]
    return compile_task(modules, at_once=at_once, signals=signals_of(cell), arm=arm)


def signals_of(cell: Cell) -> dict[str, str]:
    """Return the type of each output of a cell and of the mechanical unit of its table, by its name."""
    signals = cell.signals
    found = {signals.dispenser: "signaldo", signals.uv_lamp: "signaldo"}
    if signals.vacuum is not None:
        found[signals.vacuum] = "signaldo"
    if signals.flow is not None:
        found[signals.flow] = "signalao"
    if isinstance(cell.table, TiltTurn) and cell.table.unit is not None:
        found[cell.table.unit] = "mecunit"
    return found


def dry(cell: Cell, *, placement: Placement, tables: int = 1) -> Scenario:
    """Return how a program is run dry, at half of the planned speed, with the arm at home; as `printing`."""
    data = {"geoDryRun": True, "geoFirstRun": 1.0, "geoSpeedPct": _DRY_PCT}
    return _scenario(cell, data, held={}, answers=_answers(placement, tables))


def printing(cell: Cell, *, placement: Placement, first: int = 1, tables: int = 1) -> Scenario:
    """Return how a program prints from a run on; where its placement is not known, what it would do if it could.

    Args:
        cell: outputs and home.
        placement: where the part stands; in an attitude of a table somebody has to say that the table is there.
        first: run that is printed first.
        tables: how often that is asked.
    """
    held = {_ON: 1.0} if placement.missing else {}
    data = {"geoDryRun": False, "geoFirstRun": float(first)}
    return _scenario(cell, data, held=held, answers=_answers(placement, tables))


def _answers(placement: Placement, tables: int) -> tuple[float, ...]:
    """Return the answers of somebody who brings the table to each attitude; none where the part stands still."""
    return () if placement.table is None else (1.0,) * tables


def _scenario(
    cell: Cell, data: dict[str, bool | float], *, held: dict[str, float], answers: tuple[float, ...]
) -> Scenario:
    return Scenario(
        data={"geoSpeedPct": 100.0, **data},
        held=dict(held),
        answers=answers,
        joints=tuple(cell.robot.home.tolist()),
        ties=TIES,
        watched=frozenset({BEGIN, ENTER, END}),
    )


def make(task: MachineTask, scenario: Scenario, *, orders: Orders | None = None) -> Made:
    """Execute a program, and return its path.

    Args:
        task: the program.
        scenario: how it is run.
        orders: so many runs it must make, in order; None where nothing is asked of it.

    Raises:
        VerificationError: it does not run to its end, or not run by run.
    """
    execution = execute(task, scenario)
    rows = execution.moves.along_path
    entered = [call for call in execution.calls if call.routine == ENTER]
    firsts = np.array([call.moves for call in entered], dtype=np.int64)
    numbers = np.array([0.0, *(_number(call.arguments) for call in entered)])
    runs = numbers[np.searchsorted(firsts, rows, side="right")].astype(np.int64)
    if orders is not None:
        _check_calls(execution, runs=int(orders.runs[-1]) + 1)
    if execution.ended != "end":
        refuse(
            Place(execution.file, max(execution.line, 1)), f"the program does not run to its end: {execution.reason}"
        )
    return Made(execution, rows, runs, scenario)


def _number(arguments: Sequence[object]) -> float:
    return float(arguments[0]) if arguments and isinstance(arguments[0], float) else 0.0


def _check_calls(execution: Execution, *, runs: int) -> None:
    """Check that the guard is asked to begin, to enter each run in turn, and to end, each once and in this order."""
    wanted = [(BEGIN, runs), *((ENTER, run) for run in range(1, runs + 1)), (END, runs)]
    for call, (routine, number) in zip(execution.calls, wanted, strict=False):
        if (call.routine, _number(call.arguments)) != (routine, float(number)):
            said = f"{call.routine} {_number(call.arguments):g}"
            refuse(Place(call.file, call.line), f"{said} is called where {routine} {number} must be")
    if len(execution.calls) > len(wanted):
        call = execution.calls[len(wanted)]
        refuse(Place(call.file, call.line), "the program goes on after its end")
    if len(execution.calls) < len(wanted) and execution.ended == "end":
        routine, number = wanted[len(execution.calls)]
        place = Place(execution.file, max(execution.line, 1))
        refuse(place, f"the program ends without {routine} {number}")
