"""Executes what a program must refuse, and a stop in the middle: each ends before any motion towards the part.

The arm far from home and a refused question, a speed or first run out of range, a work object that is not the planned
one: none of them may lead the tool along a run. A stop while the valve is open shuts off at once, and whoever goes on
is told at the next run, and not later, where to begin again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import cast

import numpy as np

from geoprint.export.rapid.language.syntax import Value
from geoprint.export.rapid.machine import Controller, Execution, MachineTask, Scenario, execute
from geoprint.export.rapid.made import Made
from geoprint.export.rapid.text import Place, refuse

# Farther from home than the guard lets pass unasked [degrees], and from the planned work object [mm].
_FAR_DEG = 10.0
_SHIFT = 5.0


def refusals(task: MachineTask, printing: Scenario, *, runs: int) -> list[tuple[str, Execution]]:
    """Execute what must be refused.

    Args:
        task: the program.
        printing: how it prints.
        runs: how many it has.

    Returns:
        Each case in words, and what happened.

    Raises:
        VerificationError: one of them moves the tool along a run, or does not end by itself.
    """
    work = _shifted(task)
    cases: dict[str, Mapping[str, Value]] = {
        "speed 0": {"geoDryRun": True, "geoSpeedPct": 0.0},
        "speed 101": {"geoDryRun": True, "geoSpeedPct": 101.0},
        "first run 0": {"geoFirstRun": 0.0},
        f"first run {runs + 1}": {"geoFirstRun": float(runs + 1)},
        **({} if work is None else {f"work object {_SHIFT:g} mm off": {"wGeoPart": work}}),
    }
    scenarios = {name: replace(printing, data={**printing.data, **data}) for name, data in cases.items()}
    for axis in range(len(printing.joints)):
        joints = list(printing.joints)
        joints[axis] += math.radians(_FAR_DEG)
        scenarios[f"axis {axis + 1} far from home, and Stop"] = replace(printing, joints=tuple(joints), answers=(5.0,))
    found: list[tuple[str, Execution]] = []
    for name, scenario in scenarios.items():
        execution = execute(task, scenario)
        if execution.ended != "exit" or execution.moves.count:
            place = Place(execution.file or task.files[-1], max(execution.line, 1))
            refuse(place, f"{name}: the program must refuse before it moves, and it does not")
        found.append((name, execution))
    return [*found, *_untilted(task, printing)]


def _untilted(task: MachineTask, printing: Scenario) -> list[tuple[str, Execution]]:
    """Execute a start while the table is not where it must be, and somebody says so; nothing where none is asked for.

    Raises:
        VerificationError: the tool moves farther than home, or the program does not end by itself.
    """
    if not printing.answers:
        return []
    execution = execute(task, replace(printing, answers=(5.0,)))
    if execution.ended != "exit" or execution.moves.along_path.size:
        place = Place(execution.file or task.files[-1], max(execution.line, 1))
        refuse(place, "the table is not there, and Stop: the program must refuse before it moves on, and it does not")
    return [("the table is not there, and Stop", execution)]


def stopped(task: MachineTask, made: Made, *, valve: str) -> list[tuple[str, Execution]]:
    """Execute a start far from home, a stop in the middle of the first deposit, and a start where it stood.

    Args:
        task: the program.
        made: what it does when it prints.
        valve: the output that lets material flow.

    Returns:
        The case in words and what happened; nothing where no module brings the routine that a stop runs, or nothing is
        ever switched on but in thought.

    Raises:
        VerificationError: an output is on behind the stop, or the program prints on without a word.
    """
    on = [
        each
        for each in made.execution.switchings
        if each.signal == valve.lower() and each.value > 0.0 and each.move >= 0
    ]
    scenario = made.scenario
    if not on or scenario.held or "Stop" not in scenario.ties:
        return []
    away = tuple(angle + math.radians(_FAR_DEG) for angle in scenario.joints)
    controller = Controller(task, replace(scenario, joints=away, answers=(1.0, *scenario.answers)))
    moves = made.execution.moves
    rows = np.flatnonzero(moves.begins >= on[0].time)
    # From elsewhere the first motion takes another time: it is stopped as long behind its own first switching.
    controller.run_until(_late(controller, on[0].signal) + 0.5 * float((moves.ends - moves.begins)[rows[0]]))
    controller.stop_at(controller.state.until, "Stop")
    lit = {name: value for name, value in controller.state.signals.items() if value}
    place = Place(task.declared.routines[scenario.ties["Stop"][0].lower()].file, 1)
    if lit:
        refuse(place, f"behind a stop {', '.join(lit)} is still on")
    controller.go_on()
    execution = controller.execution()
    later = [each for each in execution.switchings if each.time > controller.state.clock]
    if execution.ended != "exit" or later:
        refuse(place, "stopped while it deposits, the program goes on printing instead of telling where to begin again")
    return [("stopped in the first deposit, and gone on", execution)]


def _late(controller: Controller, signal: str) -> float:
    """Return when an output is first switched on, without moving the controller itself."""
    other = controller.copy()
    step, moment = 1.0, other.state.clock
    while other.state.ended == "runs":
        moment = max(moment + step, other.state.clock)
        other.run_until(moment)
        for each in other.state.log.switchings:
            if each.signal == signal and each.value > 0.0 and each.move >= 0:
                return each.time
    return moment


def _shifted(task: MachineTask) -> Value | None:
    """Return the work object of the program, moved."""
    datum = task.declared.data.get("wgeopart")
    if datum is None:
        return None
    slot = next(run for slot, _, _, run in task.first_values(datum.file) if slot == datum.slot)
    held, fixed, unit, ((x, y, z), turn), part = cast(
        "tuple[Value, Value, Value, tuple[tuple[float, float, float], Value], Value]", slot(task.blank)
    )
    return held, fixed, unit, ((x + _SHIFT, y, z), turn), part
