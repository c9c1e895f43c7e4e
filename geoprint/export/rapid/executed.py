"""Executes a program dry, printing, and resumed, and says how far what it did lies from the plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias, final

import numpy as np

from geoprint import transforms
from geoprint.errors import VerificationError
from geoprint.export.orders import Event, Orders
from geoprint.export.rapid.language.places import Place, refusal
from geoprint.export.rapid.language.syntax import Module, Series
from geoprint.export.rapid.machine import NOT_KNOWN, Switching
from geoprint.export.rapid.machine.corners import rounded_lengths
from geoprint.export.rapid.made import Made, dry, make, printing, task_of
from geoprint.export.rapid.refusals import refusals, stopped
from geoprint.export.rapid.text import refuse
from geoprint.export.rapid.verify_outputs import verify_dry
from geoprint.model import BoolArray, Cell, FloatArray, IntArray, Placement, comparable
from geoprint.motion.arm import Arm

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
class Executed:
    """What was executed of a program, in figures.

    Attributes:
        scenarios: how it was run, in words.
        statements: how many lines of its modules hold some.
        executed: how many of these were executed, each statement in at least one scenario.
        not_executed: file and line of the others, and what alone leads there.
        motion: how far a target lies from where the plan has it, at most [mm].
        move_time: by how much a move takes longer or shorter than planned, at most [s]; corners are passed as their
            parabolas are long, ramps are left out.
        run_time: the same of the moves of a run, as a share of its time, at most.
        outputs: how far an output switches from where the plan has it, at most [mm].
        not_known: what no simulation knows.
    """

    scenarios: tuple[str, ...]
    statements: int
    executed: int
    not_executed: tuple[tuple[str, int, str], ...]
    motion: float
    move_time: float
    run_time: float
    outputs: float
    not_known: tuple[str, ...] = NOT_KNOWN


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
            f"the moves of a run take {executed.run_time:.1%} of their planned time more or less, allowed are "
            f"{MOST_RUN_TIME:.0%}",
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
    for file, (lines, _) in made.execution.statements.items():
        seen: BoolArray = np.logical_or.reduce([statements[file][1] for _, statements in ran])
        left = np.unique(lines[~seen])
        count, done = count + np.unique(lines).size, done + np.unique(lines).size - left.size
        missed |= {(file, line, _ERROR if (file, line) in handled else _ELSE) for line in left.tolist()}
    motion, move_time, run_time = deviations(made, orders, placement=placement)
    outputs = switching_deviation(made, events) if made.count == orders.count else np.inf
    return Executed(
        tuple(name for name, _ in ran), count, done, tuple(sorted(missed)), motion, move_time, run_time, outputs
    )


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
