"""A program with its plan, ready to be tried: what is executed, and what the plan says must come of it."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.config import packaged_cell_text
from geoprint.export import Orders, TipsAt
from geoprint.export.rapid import controller_files
from geoprint.export.rapid.language.parsing import parse_module
from geoprint.export.rapid.language.syntax import Value
from geoprint.export.rapid.machine import Execution, MachineTask, Scenario, Switching, compile_task, execute
from geoprint.export.rapid.machine.scenario import Event
from geoprint.model import BoolArray, Cell, FloatArray, IntArray
from geoprint.motion.arm import Arm
from geoprint.motion.timing import tips_at
from geoprint.results import Plan

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
