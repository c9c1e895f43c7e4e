"""A program with its plan, ready to be tried: what is executed, and what the plan says must come of it."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeAlias, cast, final

import numpy as np

from geoprint import transforms
from geoprint.config import packaged_cell_text
from geoprint.model import BoolArray, Cell, FloatArray, IntArray
from geoprint.postprocessor import Orders, TipsAt
from geoprint.postprocessor.rapid.controller_files import controller_files
from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.language.syntax import Value
from geoprint.postprocessor.rapid.machine import (
    Controller,
    Execution,
    MachineTask,
    Scenario,
    Switching,
    compile_task,
    execute,
)
from geoprint.postprocessor.rapid.machine.execution import Event
from geoprint.results import Plan
from geoprint.robot.arm import Arm
from geoprint.robot.controller import LIFT
from geoprint.robot.timing import tips_at

CELL = "irb120-bent45"
LAGS = {"valve_open_s": 0.05, "valve_close_s": 0.08, "uv_lead_s": 0.02, "uv_tail_s": 0.03}
RESIDENT = "GeoResident.sys"
TIES: Mapping[Event, tuple[str, ...]] = {
    "Stop": ("GeoResidentStopped",),
    "QStop": ("GeoResidentStopped",),
    "Start": ("GeoResidentStarted",),
    "Restart": ("GeoResidentRestarted",),
    "Reset": ("GeoResidentReset",),
    "PowerOn": ("GeoResidentPowered",),
}
# Switchings nearer to each other than this [s] are one.
SAME_MOMENT = 1e-4
# The ramp of a run is over after this [s], looked at so often, or where the tip has this share of its highest speed.
RAMP_TIME, RAMP_SAMPLES, RAMP_SHARE = 0.15, 301, 0.995
# What a person sets to print.
PRINT: Mapping[str, Value] = {"geoDryRun": False, "geoSpeedPct": 100.0, "geoFirstRun": 1.0}


@final
@dataclass(frozen=True, slots=True)
class Span:
    """An output that was on: when, and where the tip was then, in base coordinates [mm]; None where no move carried it.

    Attributes:
        on: number of the switching.
        began: where it was switched on.
        ended: where it was switched off.
    """

    on: int
    began: FloatArray | None
    ended: FloatArray | None


@final
@dataclass(frozen=True)
class Subject:
    """A program and its plan.

    Attributes:
        modules: text of each module by file, the resident among them.
        orders: of the plan.
        cell: outputs and home.
        tips: the planned motion in the work frame.
        T_base_work: where the part stands.
        arm: that moves.
        seen: whether each statement, by module, line and number, was executed so far; filled as the program is tried.
    """

    modules: Mapping[str, str]
    orders: Orders
    cell: Cell
    tips: TipsAt
    T_base_work: FloatArray
    arm: Arm = field(repr=False)
    seen: dict[tuple[str, int, int], bool] = field(default_factory=dict[tuple[str, int, int], bool], repr=False)

    @property
    def runs(self) -> int:
        """How many runs there are."""
        return int(self.orders.runs[-1]) + 1

    @cached_property
    def task(self) -> MachineTask:
        """All modules, compiled."""
        return self.task_without(())

    def task_without(self, files: Collection[str]) -> MachineTask:
        """Return the modules but some, compiled."""
        parsed = [parse_module(file, text) for file, text in self.modules.items() if file not in files]
        signals = self.cell.signals
        kinds = {name: "signaldo" for name in (signals.dispenser, signals.uv_lamp, signals.vacuum) if name}
        kinds |= {signals.flow: "signalao"} if signals.flow else {}
        at_once = [module.file for module in parsed if not module.file.startswith("GeoPath")]
        return compile_task(parsed, at_once=at_once, signals=kinds, arm=self.arm)

    def execute(self, scenario: Scenario) -> Execution:
        """Run the program to its end."""
        found = execute(self.task, scenario)
        self.note(found)
        return found

    def note(self, found: Execution) -> None:
        """Note which statements were executed."""
        for file, (lines, seen) in found.statements.items():
            for number, (line, done) in enumerate(zip(lines.tolist(), seen.tolist(), strict=True)):
                self.seen[file, line, number] = done or self.seen.get((file, line, number), False)

    def never(self) -> dict[str, str]:
        """Return module and line, and the text, of what was never executed whole."""
        places = {(file, line) for (file, line, _), done in self.seen.items() if not done}
        return {f"{file} {line}": self.modules[file].split("\n")[line - 1].strip() for file, line in sorted(places)}

    def changed(self, modules: Mapping[str, str]) -> Subject:
        """Return the same plan with other texts of some modules."""
        return replace(self, modules={**self.modules, **modules})

    def scenario(
        self,
        data: Mapping[str, Value] | None = None,
        *,
        answers: tuple[float, ...] = (),
        off_home: FloatArray | None = None,
    ) -> Scenario:
        """Return how it is run: switches as set, the operator's answers, and how far the arm is from home [rad]."""
        joints = self.cell.robot.home + (0.0 if off_home is None else off_home)
        return Scenario(
            data={} if data is None else data, answers=answers, joints=tuple(joints.tolist()), ties=TIES,
            watched=frozenset({"geoenter"}),
        )  # fmt: skip

    def openings(self, *, first_run: int = 1) -> FloatArray:
        """Return (d, 2, 3) where the valve must open and shut for the deposits from a run on, in base coordinates."""
        signals, orders = self.cell.signals, self.orders
        ends = [(first, last) for first, last in orders.deposits if orders.runs[first] + 1 >= first_run]
        moments = self._flowing(orders.times[np.array(ends, dtype=np.int64).reshape(-1, 2)])
        moments = moments - np.array([signals.valve_open, signals.valve_close])
        return transforms.apply(self.T_base_work, self.tips(moments.ravel())).reshape(-1, 2, 3)

    def _flowing(self, spans: FloatArray) -> FloatArray:
        """Return (d, 2) when material must begin and end in (d, 2) spans of deposit [s].

        A valve that only opens and shuts waits as long as the tip is behind one that would have its speed at once.
        """
        if self.cell.signals.mode == "analog":
            return spans
        waits = np.zeros(spans.shape)
        for row, (first, last) in enumerate(spans.tolist()):
            since = np.linspace(0.0, min(RAMP_TIME, (last - first) / 2.0), RAMP_SAMPLES)
            for end, moments in enumerate((first + since, last - since)):
                steps = np.linalg.norm(np.diff(self.tips(moments), axis=0), axis=1)
                # A dip behind the ramp is none of it.
                up = int((steps >= RAMP_SHARE * steps.max()).argmax()) + 1
                waits[row, end] = max(since[up] - steps[:up].sum() / steps[up - 1] * since[1], 0.0)
        return spans + waits * np.array([1.0, -1.0])

    def lit(self, *, first_run: int = 1) -> BoolArray:
        """Tell for each deposit from a run on whether the lamp goes on for it, or is still on from the one before."""
        signals, orders = self.cell.signals, self.orders
        ends = [pair for pair in orders.deposits if orders.runs[pair[0]] + 1 >= first_run]
        begins, stops = self._flowing(orders.times[np.array(ends, dtype=np.int64).reshape(-1, 2)]).T
        return np.insert(begins[1:] - signals.uv_lead - stops[:-1] - signals.uv_tail > SAME_MOMENT, 0, values=True)

    def targets(self) -> FloatArray:
        """Return (t, 3) where the tip must be at each target, in base coordinates."""
        return transforms.apply(self.T_base_work, self.orders.tips)


def subject_of(plan: Plan) -> Subject:
    """Return the program of a plan that has one part of the robot."""
    robot, cell = plan.robot[0], plan.workpiece.cell
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    modules = {name: text for name, text in robot.program.modules if not name.endswith(".pgf")}
    loading = any(name.startswith("GeoPath") for name in modules)
    resident = controller_files(cell, placement=robot.placement, loading=loading)[RESIDENT]
    trajectory, T_base_work = robot.trajectory, robot.placement.T_base_work
    tips = tips_at(trajectory.times, trajectory.joints, arm, T_base_work=T_base_work)
    return Subject({**modules, RESIDENT: resident}, robot.orders, cell, tips, T_base_work, arm)


def spans(found: Execution, signal: str | None, *, after: int = 0) -> list[Span]:
    """Return when an output was on, of the switchings after a number; what switches nothing is left out."""
    level, began = 0.0, (0, None)
    found_spans: list[Span] = []
    for number, each in enumerate(found.switchings[after:], start=after):
        if each.signal != (signal or "").lower() or each.value == level:
            continue
        if level == 0.0:
            began = (number, _place(found, each))
        elif each.value == 0.0:
            found_spans.append(Span(*began, _place(found, each)))
        level = each.value
    return [*found_spans, Span(*began, None)] if level else found_spans


def tips(found: Execution, *, after: int = 0) -> tuple[IntArray, FloatArray]:
    """Return the moves along the path after a number, and (k, 3) the tip at their targets, in base coordinates."""
    rows = found.moves.along_path
    rows = rows[rows >= after]
    return rows, found.moves.Ts_base_tip(rows)[:, :3, 3]


def _place(found: Execution, switching: Switching) -> FloatArray | None:
    """Return where on its straight move a switching is, in base coordinates."""
    moves, move = found.moves, switching.move
    if move < 1 or not np.isin([move - 1, move], moves.along_path).all():
        return None
    start, end = moves.Ts_base_tip(np.array([move - 1, move]))[:, :3, 3]
    length = float(np.linalg.norm(end - start))
    along = switching.distance if switching.from_start else length - switching.distance
    return start + (end - start) * (along / length if length else 0.0)


def cell_with_lags() -> str:
    """Return the text of a packaged cell whose outputs lag: without lags a timeline shows nothing."""
    text = packaged_cell_text(CELL)
    for name, value in LAGS.items():
        text = re.sub(rf"# {name} = .*", f"{name} = {value}", text)
    return text


# How far from where the plan says an output may switch, and how far a target may lie off [mm].
OFF_PLACE = 0.05
OFF_TARGET = 0.001
# The clock leaves ramps out, so that the lamp may seem late by this [s].
OFF_TIME = 0.02
# What the operator answers: the first key goes on, the fifth stops.
GO_ON, STOP = 1.0, 5.0
Promise: TypeAlias = Callable[[Subject], Iterator[str]]


def dry(subject: Subject) -> Iterator[str]:
    """In a dry run no output is ever on, and every target is passed, lifted."""
    every: tuple[dict[str, Value], ...] = (
        {}, {"geoSpeedPct": 100.0}, {"geoSpeedPct": 100.0, "geoFirstRun": float(subject.runs)},
    )  # fmt: skip
    for set_to in every:
        found = subject.execute(subject.scenario(set_to))
        record = f"dry with {set_to}"
        yield from _ends(found, "end", record)
        yield from _nothing_on(found, record)
        yield from _passes(found, subject.targets() + np.array([0.0, 0.0, LIFT]), record)


def speed(subject: Subject) -> Iterator[str]:
    """`geoSpeedPct` slows every move between home and home by its share."""
    at = [subject.execute(subject.scenario({"geoSpeedPct": pct})).moves for pct in (100.0, 20.0)]
    # What comes before and after has speeds of its own: home at first, priming, the final exposure.
    full, slow = ((moves.ends - moves.begins)[moves.along_path[0] - 1 : moves.along_path[-1] + 2] for moves in at)
    if len(full) != len(slow) or not np.allclose(slow, 5.0 * full, rtol=1e-3):
        yield "a dry run at 20 % does not take five times as long"


def prints(subject: Subject) -> Iterator[str]:
    """A print lays every run once, where the plan has it, under the lamp, and ends with all outputs off."""
    found = subject.execute(subject.scenario(PRINT))
    yield from _ends(found, "end", "print")
    yield from _passes(found, subject.targets(), "print")
    yield from _lays(found, subject, first_run=1, record="print")
    if any(found.signals.values()):
        yield "print: an output is on at the end"


def begins_where_stated(subject: Subject) -> Iterator[str]:
    """`geoFirstRun := r` prints r to the last run, all of it and nothing else; what is before is driven lifted."""
    for run in sorted({2, (subject.runs + 1) // 2, subject.runs} & set(range(2, subject.runs + 1))):
        record = f"from run {run}"
        found = subject.execute(subject.scenario({**PRINT, "geoFirstRun": float(run)}))
        yield from _ends(found, "end", record)
        lift = np.where((subject.orders.runs + 1 < run)[:, None], np.array([0.0, 0.0, LIFT]), 0.0)
        yield from _passes(found, subject.targets() + lift, record)
        yield from _lays(found, subject, first_run=run, record=record)
        # The motion towards the part is that of the dry run.
        towards = found.moves.along_path[0] - 1
        joints = np.append(found.moves.places[towards], found.moves.turns[towards, :3])
        if np.abs(joints - subject.orders.lifted).max() > 1e-5:
            yield f"{record}: the first motion is not the lifted one"


def stops(subject: Subject, *, seed: int = 0, count: int = 40) -> Iterator[str]:
    """A stop leaves all off; then it refuses with the run, or goes on as planned; from main it resumes."""
    random = np.random.default_rng(seed)
    whole = Controller(subject.task, subject.scenario(PRINT))
    seconds = subject.execute(subject.scenario(PRINT)).seconds
    for number, moment in enumerate(np.sort(random.uniform(0.0, seconds, count)).tolist()):
        whole.run_until(moment)
        one = whole.copy()
        record = f"stop {number} at {moment:.3f} s"
        on = any(one.execution().signals.values())
        if number % 4 == 3:
            one.power_failure()
        else:
            one.stop_at(moment, "Stop" if number % 2 else "QStop")
        stopped = one.execution()
        if any(stopped.signals.values()):
            yield f"{record}: an output stays on"
        if stopped.ended != "runs":
            if stopped.ended == "error":
                yield f"{record}: ends by {stopped.reason}"
            continue
        yield from _after(one, stopped, subject, on=on, again=number // 4 % 3, record=record)


def refuses(subject: Subject) -> Iterator[str]:
    """What is set wrong, missing or refused ends before any motion towards the part."""
    wrong: dict[str, Mapping[str, Value]] = {
        "geoSpeedPct 0": {"geoSpeedPct": 0.0},
        "geoSpeedPct 101": {"geoSpeedPct": 101.0},
        "geoFirstRun 0": {"geoFirstRun": 0.0},
        "geoFirstRun beyond": {"geoFirstRun": subject.runs + 1.0},
        "work object shifted": {"wGeoPart": _moved(subject, shift=1.0)},
        "work object turned": {"wGeoPart": _moved(subject, turn_deg=1.0)},
    }
    for record, data in wrong.items():
        for found in (subject.execute(subject.scenario(set_to)) for set_to in (data, {**PRINT, **data})):
            yield from _ends(found, "exit", record)
            yield from _stays(found, record)
    nearly = {"wGeoPart": _moved(subject, shift=0.2 * float(subject.cell.process.standoff) / 10.0)}
    yield from _ends(subject.execute(subject.scenario(nearly)), "end", "work object hardly shifted")
    yield from _far_from_home(subject)
    yield from _slow(subject)
    yield from _without_resident(subject)


def _far_from_home(subject: Subject) -> Iterator[str]:
    """An arm far from home is asked about, and a refusal ends it there."""
    for axis in range(6):
        far = np.zeros(6)
        far[axis] = np.radians(6.0)
        for answers, ending in (((), "waits"), ((STOP,), "exit")):
            found = subject.execute(subject.scenario(PRINT, answers=answers, off_home=far))
            record = f"axis {axis + 1} far from home, answers {answers}"
            yield from _ends(found, ending, record)
            yield from _stays(found, record)
        found = subject.execute(subject.scenario(answers=(GO_ON,), off_home=-far))
        yield from _ends(found, "end", f"axis {axis + 1} far from home, moved there")
        if not found.questions:
            yield f"axis {axis + 1} far from home on the other side: nothing is asked"
        if subject.execute(subject.scenario(off_home=far * 0.6)).questions:
            yield f"axis {axis + 1} near home: a question is asked"


def _slow(subject: Subject) -> Iterator[str]:
    """A print below its speed lays nothing where the flow does not follow the speed."""
    if subject.cell.signals.mode == "analog":
        return
    set_slow = subject.scenario({**PRINT, "geoSpeedPct": 25.0})
    turned_down = replace(subject.scenario(PRINT), override=50.0)
    for record, scenario in (("print at 25 %", set_slow), ("print with an override of 50 %", turned_down)):
        found = subject.execute(scenario)
        yield from _ends(found, "exit", record)
        yield from _stays(found, record)
    yield from _turned_down(subject)


def _turned_down(subject: Subject) -> Iterator[str]:
    """Where somebody turns the override down in the first run, the second is not begun."""
    if subject.runs < 2:
        return
    entered = [call.time for call in subject.execute(subject.scenario(PRINT)).calls]
    one = Controller(subject.task, subject.scenario(PRINT))
    one.run_until((entered[0] + entered[1]) / 2.0)
    one.state.scenario = replace(one.state.scenario, override=50.0)
    one.run_until(np.inf)
    found = one.execution()
    subject.note(found)
    yield from _ends(found, "exit", "override turned down")
    if len(_carried(found, subject.cell.signals.dispenser, alone=subject.cell.purge is not None)) != 1:
        yield "override turned down: the second run is printed, or the first is not"
    if not any(text.endswith("run 2") for _, text in found.texts):
        yield "override turned down: it does not say where to begin again"


def _without_resident(subject: Subject) -> Iterator[str]:
    """Without the resident, or with another one, nothing moves."""
    alone = replace(subject.scenario(PRINT), ties={})
    found = execute(subject.task_without({RESIDENT}), alone)
    yield from _ends(found, "exit", "no resident")
    yield from _stays(found, "no resident")
    if not any("GeoResident" in text for _, text in found.texts):
        yield "no resident: nothing names it"
    for constant in ("nGeoResident", "nGeoOutputs"):
        text = subject.modules[RESIDENT].replace(f"{constant}:=", f"{constant}:=1+")
        found = execute(subject.changed({RESIDENT: text}).task, subject.scenario(PRINT))
        yield from _ends(found, "exit", f"another {constant}")
        yield from _stays(found, f"another {constant}")
    paths = {file for file in subject.modules if file.startswith("GeoPath")}
    if paths:
        found = subject.execute(replace(subject.scenario(PRINT), disk=frozenset(paths - {"GeoPath1.mod"})))
        yield from _ends(found, "error", "a missing module")
        yield from _stays(found, "a missing module")


def _after(
    one: Controller, stopped: Execution, subject: Subject, *, on: bool, again: int, record: str
) -> Iterator[str]:
    """Start again after a stop: where it stood, or from main to print on, or from main to run dry."""
    switched, moved = len(stopped.switchings), stopped.moves.count
    run = int(cast("float", stopped.calls[-1].arguments[0])) if stopped.calls else 0
    deposited = len(_carried(stopped, subject.cell.signals.dispenser, alone=subject.cell.purge is not None))
    if again == 0:
        one.go_on()
        found = one.execution()
        subject.note(found)
        if found.ended == "exit":
            if found.moves.count > moved or spans(found, subject.cell.signals.dispenser, after=switched):
                yield f"{record}: it refuses, but goes on first"
            if not any(f"run {max(run, 1)}" in text for _, text in found.texts):
                yield f"{record}: it refuses without the run {run}"
            return
        yield from _ends(found, "end", record)
        if on and not any("final exposure short" in text for _, text in found.texts):
            yield f"{record}: an output was on, and it goes on"
        yield from _lays(found, subject, first_run=1, record=record, skip=deposited, after=switched)
        return
    resumed: dict[str, Value] = {**PRINT, "geoFirstRun": float(max(run, 1))}
    set_to = resumed if again == 1 else {"geoDryRun": True}
    one.from_main(subject.scenario(set_to, answers=(GO_ON, GO_ON)))
    one.run_until(np.inf)
    found = one.execution()
    subject.note(found)
    yield from _ends(found, "end", f"{record}, from main")
    if again == 1:
        yield from _lays(found, subject, first_run=max(run, 1), record=f"{record}, from main", after=switched)
        unfinished = stopped.moves.along_path.size < subject.orders.count
        if on and unfinished and "Is the nozzle clean, the part right?" not in found.questions:
            yield f"{record}: nobody is asked about the run that was cut short"
    elif any(each.value for each in found.switchings[switched:]):
        yield f"{record}: an output is switched on in the dry run after it"


def _ends(found: Execution, ending: str, record: str) -> Iterator[str]:
    if found.ended != ending:
        reason = found.reason or "no reason"
        yield f"{record}: ends by {found.ended} ({reason}; {found.file} {found.line}), not {ending}"


def _nothing_on(found: Execution, record: str) -> Iterator[str]:
    on = [each for each in found.switchings if each.value != 0.0]
    if on:
        yield f"{record}: {on[0].signal} is on at {on[0].time:.3f} s ({on[0].file}, line {on[0].line})"


def _stays(found: Execution, record: str) -> Iterator[str]:
    """Nothing moves and nothing is switched on."""
    if found.moves.count:
        yield f"{record}: the arm moves {found.moves.count} times"
    yield from _nothing_on(found, record)


def _passes(found: Execution, wanted: FloatArray, record: str) -> Iterator[str]:
    """The moves along the path lead to (t, 3) places in base coordinates, in order."""
    _, places = tips(found)
    if len(places) != len(wanted):
        yield f"{record}: {len(places)} targets, not {len(wanted)}"
    elif (off := np.linalg.norm(places - wanted, axis=1)).max() > OFF_TARGET:
        yield f"{record}: target {int(off.argmax()) + 1} lies {off.max():.4f} mm off"


def _lays(
    found: Execution, subject: Subject, *, first_run: int, record: str, skip: int = 0, after: int = 0
) -> Iterator[str]:
    """The valve opens and shuts once for each deposit from a run on, where the plan has it, under the lamp."""
    signals = subject.cell.signals
    planned = subject.openings(first_run=first_run)[skip:]
    deposited = _carried(found, signals.dispenser, after=after, alone=subject.cell.purge is not None)
    if len(deposited) != len(planned):
        yield f"{record}: the valve opens {len(deposited)} times, not {len(planned)}"
        return
    lit = _carried(found, signals.uv_lamp, after=after, alone=subject.cell.flood is not None)
    for number, (span, (begins, ends)) in enumerate(zip(deposited, planned, strict=True), start=1):
        for what, place, at in (("opens", span.began, begins), ("shuts", span.ended, ends)):
            off = np.inf if place is None else float(np.linalg.norm(place - at))
            if off > OFF_PLACE:
                yield f"{record}: the valve {what} {off:.3f} mm off in deposit {number}"
        flows = found.switchings[span.on].time + signals.valve_open
        if not any(found.switchings[light.on].time <= flows + OFF_TIME for light in lit):
            yield f"{record}: deposit {number} is laid without light"
    wanted = subject.lit(first_run=first_run)[skip:].sum()
    if len(lit) != wanted:
        yield f"{record}: the lamp is on {len(lit)} times, not {wanted}"


def _carried(found: Execution, signal: str, *, after: int = 0, alone: bool) -> list[Span]:
    """Return when an output was on; without what no move carried, where the cell primes or floods standing still."""
    return [span for span in spans(found, signal, after=after) if not (alone and span.began is None)]


def _moved(subject: Subject, *, shift: float = 0.0, turn_deg: float = 0.0) -> Value:
    """Return the work object as if the part were shifted [mm] and turned about its middle, both in base coordinates."""
    data = subject.execute(subject.scenario({"geoSpeedPct": 0.0})).data
    part = cast("tuple[Value, ...]", data["wgeopart"])
    place, turn = (np.array(each, dtype=np.float64) for each in cast("tuple[Value, Value]", part[3]))
    middle = transforms.apply(subject.T_base_work, np.array(data["geomiddle"], dtype=np.float64))
    half = np.radians(turn_deg) / 2.0
    about = transforms.rotation_of(np.array([np.cos(half), np.sin(half), 0.0, 0.0]))
    T = transforms.rigid(about @ transforms.rotation_of(turn), about @ (place - middle) + middle + [shift, 0.0, 0.0])
    moved = (tuple(T[:3, 3].tolist()), tuple(transforms.quaternion_of(T[:3, :3]).tolist()))
    return (*part[:3], moved, part[4])


PROMISES: Mapping[str, Promise] = {
    "dry": dry,
    "speed": speed,
    "prints": prints,
    "begins where told": begins_where_stated,
    "stops": stops,
    "refuses": refuses,
}
