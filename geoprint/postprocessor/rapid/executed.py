"""Executes a program dry, printing and resumed, and says how far it lies from the plan."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias, cast, final

import numpy as np

from geoprint import transforms
from geoprint.errors import VerificationError, how_many, percent
from geoprint.model import BoolArray, Cell, FloatArray, IntArray, Placement, Signals, comparable
from geoprint.postprocessor.execution import Executed, NotExecuted
from geoprint.postprocessor.orders import Event, Orders
from geoprint.postprocessor.rapid.language.syntax import Module, Place, Series, Value, refusal, refuse
from geoprint.postprocessor.rapid.machine import (
    NOT_KNOWN,
    Controller,
    Execution,
    MachineTask,
    Scenario,
    Switching,
    execute,
)
from geoprint.postprocessor.rapid.machine.moves import rounded_lengths
from geoprint.postprocessor.rapid.made import Made, dry, make, printing, task_of
from geoprint.postprocessor.rapid.reader import Listed, compare
from geoprint.robot.arm import Arm

# Compares what a program switches as it is executed with where the plan switches, and with nothing in a dry run.


# Distance of a switching from where the plan has it [mm].
_PLACE_TOLERANCE = 2e-4
# A flow is written anew where it has changed by 1 % of what was written last, and to six digits.
_FLOW_SHARE = 0.0102


def verify_dry(made: Made) -> None:
    """Check that a dry run never switches anything on.

    Raises:
        VerificationError: it does.
    """
    for each in made.execution.switchings:
        if each.value != 0.0:
            refuse(Place(each.file, each.line), f"{each.signal} is switched to {each.value:g} here in a dry run")


def verify_switching(made: Made, events: tuple[Event, ...], *, signals: Signals) -> None:
    """Check that each move switches the outputs that the plan switches there, and no others.

    Raises:
        VerificationError: one switches elsewhere, otherwise, or not at all.
    """
    outputs = {"dispenser": signals.dispenser, "uv_lamp": signals.uv_lamp, "vacuum": signals.vacuum or ""}
    names = {output: name.lower() for output, name in outputs.items()}
    planned: dict[int, list[Event]] = {}
    for event in events:
        planned.setdefault(event.target, []).append(event)
    switched = made.switchings
    for index in sorted(switched.keys() | planned.keys()):
        found = [each for each in switched.get(index, ()) if not each.flow]
        wanted = planned.get(index, [])
        if len(found) != len(wanted):
            refuse(
                made.place(index),
                f"{how_many(len(found), 'output')} to switch in the move here, the plan has {len(wanted)}",
            )
        for trigger, event in zip(found, wanted, strict=True):
            place = Place(trigger.file, trigger.line)
            said = (trigger.signal, trigger.value, trigger.from_start)
            if said != (names[event.output], float(event.on), event.from_start):
                refuse(place, f"{trigger.signal} switches here, the plan switches the {event.output} otherwise")
            if abs(trigger.distance - event.distance) > _PLACE_TOLERANCE:
                refuse(
                    place,
                    f"{trigger.signal} switches {trigger.distance:g} mm away, the plan has {event.distance:.4f} mm",
                )


def verify_flow(made: Made, orders: Orders, *, signals: Signals) -> None:
    """Check that the output of the flow is what each stretch needs by 1 %, and 0 from the end of each deposit.

    Raises:
        VerificationError: it is not.
    """
    scale = signals.flow_per_mm3_s if signals.sets_flow else 0.0
    current = 0.0
    switched = made.switchings
    for index in range(made.count):
        ends = False
        for trigger in (each for each in switched.get(index, ()) if each.flow):
            place = Place(trigger.file, trigger.line)
            if trigger.signal != (signals.flow or "").lower() or not signals.sets_flow:
                refuse(place, f"{trigger.signal} is not an output for a flow that follows the speed")
            ends = trigger.value == 0.0
            lags: Listed = [signals.flow_lag, 0.0 if ends else signals.flow_lag]
            compare([trigger.lag, trigger.dip_lag], lags, tolerance=1e-6, place=place, what="the lag of the flow")
            if trigger.distance != 0.0 or trigger.from_start == ends:
                refuse(place, "a flow changes at the start of a move, and ends at the end of one")
            current = current if ends else trigger.value
        deposited = index > 0 and bool(orders.deposited[index - 1])
        wanted = scale * float(orders.flow[index - 1]) if deposited else 0.0
        if abs(current - wanted) > _FLOW_SHARE * wanted:
            refuse(made.place(index), f"the flow in the move here is {current:g} a mm/s, the plan has {wanted:g}")
        if deposited and scale > 0.0 and ends == bool(orders.deposited[index]):
            refuse(made.place(index), "the flow ends where the plan goes on, or goes on where the plan ends")
        current = 0.0 if ends else current


# Executes what a program must refuse, and a stop in the middle: each ends before any motion towards the part.
#
# The arm far from home and a refused question, a speed or first run out of range, a work object that is not the
# planned one: none of them may lead the tool along a run. A stop while the valve is open shuts off at once, and
# whoever goes on is told at the next run, and not later, where to begin again.


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
        refuse(place, f"after a stop {', '.join(lit)} is still on")
    controller.go_on()
    execution = controller.execution()
    later = [each for each in execution.switchings if each.time > controller.state.clock]
    if execution.ended != "exit" or later:
        refuse(place, "stopped while it deposits, the program goes on printing instead of saying where to resume")
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


# Executes a program dry, printing, and resumed, and says how far what it did lies from the plan.


# Moves shorter than this [mm] turn the tool; their speed is that of the turning.
_TURN_ON_THE_SPOT = 1e-3
# A move takes its length over its speed, or longer where it turns the tool: by so much more it is by rounding only.
_BY_SPEED = 1.0 + 1e-9
# How far targets and switchings may lie from the plan's [mm].
MOST_MOTION, MOST_OUTPUTS = 1e-3, 0.05
# How much longer or shorter than planned a move, and all moves of a run together, may take [s, share].
MOST_MOVE_TIME, MOST_RUN_TIME = 0.02, 0.05
# Where a program begins, for what none of its lines alone has done.
_ENTRY = Place("GeoPrint.mod", 1)
# What alone leads to statements that no scenario executes.
_ERROR = "an error that the controller raises"
_ELSE = "a stop, a refusal or an answer that no scenario brings here"
# How a program was run, in words, and lines of its statements with whether each was executed, for each module. The
# executions themselves are large.
_Ran: TypeAlias = tuple[str, Mapping[str, tuple[IntArray, BoolArray]]]


@final
@comparable
class Proof:
    """The executions of a program, and what they say.

    Attributes:
        dry: the dry run.
        printing: from the first run on; where its placement is not known, what it would do if it could.
        executed: figures.
        wrong: what it does not refuse, or goes on with behind a stop, and figures beyond what is allowed.
    """

    dry: Made
    printing: Made
    executed: Executed
    wrong: tuple[VerificationError, ...]


def prove(
    modules: Sequence[Module],
    orders: Orders,
    *,
    cell: Cell,
    placement: Placement,
    events: tuple[Event, ...],
) -> Proof:
    """Execute a program dry, printing, resumed at a run in the middle and at the last, and where it must refuse.

    Args:
        modules: all of its modules, and those that stay on the controller, parsed.
        orders: the targets.
        cell: tool, home and outputs.
        placement: where the part stands.
        events: where the outputs switch.

    Raises:
        VerificationError: it does what the machine does not know, does not run to its end run by run, switches
            something on in a dry run, or resumed does something else than when it prints.
    """
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    task = task_of(modules, cell=cell, arm=arm)
    runs = int(orders.runs[-1]) + 1
    lifted = make(task, dry(cell, placement=placement), orders=orders)
    verify_dry(lifted)
    made = make(task, printing(cell, placement=placement), orders=orders)
    ran: list[_Ran] = [("dry", lifted.execution.statements), ("printing", made.execution.statements)]
    for first in sorted({runs // 2 + 1, runs} - {1}):
        resumed = make(task, printing(cell, placement=placement, first=first), orders=orders)
        _check_resumed(resumed, made, first=first, known=not placement.missing)
        ran.append((f"resumed at run {first}", resumed.execution.statements))
    wrong: list[VerificationError] = []
    for case in (
        lambda: refusals(task, made.scenario, runs=runs),
        lambda: stopped(task, made, valve=cell.signals.dispenser),
    ):
        try:
            ran += [(name, execution.statements) for name, execution in case()]
        except VerificationError as error:
            wrong.append(error)
    executed = _figures(made, orders, ran, modules, placement=placement, events=events)
    return Proof(lifted, made, executed, (*wrong, *beyond(executed)))


def beyond(executed: Executed) -> tuple[VerificationError, ...]:
    """Return what lies farther from the plan than allowed; what is missing altogether is found target by target."""
    found = (
        ("a target", executed.motion, MOST_MOTION),
        ("a switching", executed.outputs, MOST_OUTPUTS),
    )
    return tuple(
        refusal(_ENTRY, f"{what}, executed, lies {distance:.4f} mm from the plan's, allowed are {most:g} mm")
        for what, distance, most in found
        if most < distance < np.inf
    )


def check_times(executed: Executed) -> None:
    """Check that a program takes as long as it was timed: a valve that is open longer deposits more.

    Raises:
        VerificationError: a move, or the moves of a run together, take longer or shorter by more than allowed.
    """
    if MOST_MOVE_TIME < executed.move_time < np.inf:
        refuse(
            _ENTRY,
            f"a move takes {executed.move_time:.4f} s more or less than planned, allowed are {MOST_MOVE_TIME:g} s",
        )
    if MOST_RUN_TIME < executed.run_time < np.inf:
        refuse(
            _ENTRY,
            f"the moves of a run take {percent(executed.run_time, 1)} of their planned time more or less, allowed are "
            f"{percent(MOST_RUN_TIME)}",
        )


def _check_resumed(resumed: Made, whole: Made, *, first: int, known: bool) -> None:
    """Check that a program that is resumed prints from that run on what it prints anyway, and nothing before."""
    rows = np.flatnonzero(whole.runs < first)
    behind = int(rows[-1]) + 1 if rows.size else 0
    found, wanted = resumed.switchings, whole.switchings
    for target in sorted(found.keys() | wanted.keys()):
        if target >= resumed.count:
            continue
        some, others = found.get(target, ()), wanted.get(target, ())
        values = [each.value for each in some]
        if known and target < behind and any(values):
            refuse(resumed.place(target), f"resumed at run {first}, something is switched on before that run")
        if target >= behind and [*map(_asked, some)] != [*map(_asked, others)]:
            refuse(resumed.place(target), f"resumed at run {first}, other outputs switch here than when it prints")


def _asked(switching: Switching) -> tuple[object, ...]:
    return switching.signal, switching.value, switching.distance, switching.from_start, switching.lag, switching.dip_lag


def _figures(
    made: Made,
    orders: Orders,
    ran: Sequence[_Ran],
    modules: Sequence[Module],
    *,
    placement: Placement,
    events: tuple[Event, ...],
) -> Executed:
    handled = {
        (module.file, line)
        for module in modules
        for routine in module.routines
        for handler in routine.handlers
        for statement in handler.body
        for line in (statement.lines if isinstance(statement, Series) else (statement.line,))
    }
    missed: set[tuple[str, int, str]] = set()
    count = done = 0
    for file, (written, _) in made.execution.statements.items():
        seen: BoolArray = np.logical_or.reduce([statements[file][1] for _, statements in ran])
        left = np.unique(written[~seen])
        count, done = count + np.unique(written).size, done + np.unique(written).size - left.size
        missed |= {(file, line, _ERROR if (file, line) in handled else _ELSE) for line in left.tolist()}
    motion, move_time, run_time = deviations(made, orders, placement=placement)
    outputs = switching_deviation(made, events) if made.count == orders.count else np.inf
    lines: dict[tuple[str, str], list[int]] = {}
    for file, line, reason in sorted(missed):
        lines.setdefault((file, reason), []).append(line)
    left_out = tuple(NotExecuted(file, tuple(some), reason) for (file, reason), some in lines.items())
    names = tuple(name for name, _ in ran)
    return Executed(names, count, done, left_out, motion, move_time, run_time, outputs, NOT_KNOWN)


def switching_deviation(made: Made, events: tuple[Event, ...]) -> float:
    """Return how far an output switches from where the plan has it, at most [mm]; infinite where one is missing."""
    found = [each for _, some in sorted(made.switchings.items()) for each in some if not each.flow]
    if len(found) != len(events):
        return np.inf
    return max((abs(one.distance - event.distance) for one, event in zip(found, events, strict=True)), default=0.0)


def deviations(made: Made, orders: Orders, *, placement: Placement) -> tuple[float, float, float]:
    """Return how far motion and times lie from the plan's at most: mm, s of a move, share of a run's time."""
    if made.count != orders.count:
        return np.inf, np.inf, np.inf
    moves = made.execution.moves
    tips = transforms.apply(placement.T_base_work, orders.tips)
    # Where the program only runs dry it lifts the path: what it would do is one frame higher.
    found = transforms.apply(placement.T_base_work, made.places)
    if not placement.missing:
        found = moves.tips(made.rows)
    motion = float(np.linalg.norm(found - tips, axis=1).max(initial=0.0))
    planned, took = np.diff(orders.times), move_times(made)
    moving = moves.lengths[made.rows[1:]] > _TURN_ON_THE_SPOT
    off = np.where(moving, took - planned, 0.0)
    same_run = made.runs[1:]
    sums = [np.bincount(same_run, weights=np.where(moving, each, 0.0)) for each in (off, planned)]
    shares = np.abs(sums[0]) / np.where(sums[1] > 0.0, sums[1], np.inf)
    return motion, float(np.abs(off).max(initial=0.0)), float(shares.max(initial=0.0))


def move_times(made: Made) -> FloatArray:
    """Return how long each move takes to the next target, from corner to corner [s].

    The tip keeps its speed where the controller rounds a corner, so that it needs the less time the more that cuts off.
    """
    moves, rows = made.execution.moves, made.rows[1:]
    lengths, took = moves.lengths[rows], (moves.ends - moves.begins)[rows]
    passed = rounded_lengths(made.places, moves.zones[made.rows])
    by_speed = (took * moves.speeds[rows] <= lengths * _BY_SPEED) & (lengths > _TURN_ON_THE_SPOT)
    return np.where(by_speed, took * passed / np.where(by_speed, lengths, 1.0), took)
