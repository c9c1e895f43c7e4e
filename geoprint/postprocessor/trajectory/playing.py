"""Plays a joint trajectory, and holds its motion and its switchings against the plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import VerificationError, how_many
from geoprint.model import Cell, FloatArray, IntArray
from geoprint.postprocessor.execution import Executed, Switched, refusal
from geoprint.postprocessor.expected import expected_waits
from geoprint.postprocessor.interface import Execution, RobotProgram
from geoprint.postprocessor.orders import Event, Orders, TipsAt
from geoprint.postprocessor.timeline import moment_on
from geoprint.postprocessor.trajectory.reading import TABLE, Samples, read_outputs, read_samples
from geoprint.robot.arm import Arm, chain_of
from geoprint.robot.arm.urdf import urdf_of

# The tip that is played lies on the plan, and the joints are those of the plan, to this [mm, rad].
MOST_MOTION, MOST_JOINTS = 1e-3, 1e-5
# An output switches when the plan has it, to this [s].
MOST_DELAY = 2e-3
# A joint turns no faster than its limit but for this share: speeds of samples are differences over milliseconds.
SPEED_SHARE = 1e-3
# Below this speed [mm/s] a place says nothing about the time.
_MOVING = 1.0
_NOT_KNOWN = ("how a controller follows between samples, and how late it switches outputs",)


@final
class Clock:
    """The player's clock: that of the planned motion, and the waits that come before."""

    def __init__(self, orders: Orders, waiting: FloatArray) -> None:
        at = np.flatnonzero(waiting > 0.0)
        # Rows are a millisecond apart; the arm rests at the one nearest to its target.
        self.rests: FloatArray = np.round(orders.times[at], 3)
        self.lengths: FloatArray = waiting[at]
        self.waited: FloatArray = np.cumsum(waiting)

    def played(self, times: FloatArray) -> FloatArray:
        """Return when moments of the motion are played; where it rests, when the rest begins."""
        before = np.append(0.0, np.cumsum(self.lengths))
        return times + before[np.searchsorted(self.rests, times - 5e-4)]

    def planned(self, time: float) -> float:
        """Return the moment of the motion at which something is played; what ends a rest comes so much later."""
        before = np.append(0.0, np.cumsum(self.lengths))
        ends = self.rests + before[1:]
        return time - float(before[np.searchsorted(ends, time - 1.5e-3)])


def read_back(files: Mapping[str, str], program: RobotProgram, cell: Cell) -> tuple[Samples, tuple[Switched, ...]]:
    """Return the samples of a joint trajectory, and what it switches by the clock of its player.

    Raises:
        VerificationError: a file is missing or holds something else.
    """
    chain = chain_of(urdf_of(cell.robot), name=cell.robot.model, flange=cell.robot.flange)
    samples = read_samples(files, names=chain.names, base=chain.base)
    return samples, read_outputs(files, withheld=bool(program.placement.missing))


def tips_of(joints: FloatArray, program: RobotProgram, cell: Cell) -> FloatArray:
    """Return the (k, 3) tips in the work frame that (k, 6) joints have [mm]."""
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    T_work_base = transforms.inverse(program.placement.T_base_work)
    return transforms.apply(T_work_base, arm.tool_poses(joints)[:, :3, 3])


def execution_of(files: Mapping[str, str], program: RobotProgram, cell: Cell, events: tuple[Event, ...]) -> Execution:
    """Play files, and hold them against the motion and the switchings of the plan."""
    try:
        samples, switched = read_back(files, program, cell)
    except VerificationError as error:
        return Execution((error,))
    orders, waiting = program.orders, expected_waits(program.orders, cell.signals)
    clock = Clock(orders, waiting)
    findings, motion, move_time, run_time = _motion(samples, program, cell, clock)
    found = tuple(Switched(clock.planned(each.time), each.signal, each.on, each.file, each.line) for each in switched)
    wrong, outputs = _switching(switched, found, events, program, cell, waited=clock.waited)
    count = samples.times.size
    starts = np.clip(np.searchsorted(samples.times, clock.played(orders.times)), 0, count - 1)
    rows = 4 * count + len(switched)
    executed = Executed(
        ("as written, by cubic segments",), rows, rows, (), motion, move_time, run_time, outputs, _NOT_KNOWN
    )
    return Execution((*findings, *wrong), executed, found, tuple((TABLE, int(row) + 2) for row in starts.tolist()))


def _motion(
    samples: Samples, program: RobotProgram, cell: Cell, clock: Clock
) -> tuple[list[VerificationError], float, float, float]:
    """Return what is wrong with a motion, and how far it lies from the plan's: mm, s of a move, share of a run."""
    table, orders = program.motion, program.orders
    moments = clock.played(table.times)
    # Within each rest, too: nothing moves there.
    resting = clock.played(clock.rests) + 0.5 * clock.lengths
    at = np.searchsorted(table.times, clock.rests - 5e-4)
    every: FloatArray = np.concatenate([moments, resting])
    played, speeds = samples.played(every)
    planned = np.concatenate([table.joints, table.joints[at]])
    off = tips_of(played, program, cell) - tips_of(planned, program, cell)
    away = np.linalg.norm(off, axis=1)
    turned = np.abs(played - planned).max(axis=1)
    fast = (np.abs(speeds) / cell.robot.speeds).max(axis=1)
    ends = float(moments[-1])
    lines: IntArray = 1 + np.searchsorted(samples.times, every)
    findings = [
        refusal(TABLE, int(lines[row]), what)
        for wrong, row, what in (
            (away.max() > MOST_MOTION, int(away.argmax()), f"the tip lies {away.max():.4f} mm from the plan's"),
            (turned.max() > MOST_JOINTS, int(turned.argmax()), f"a joint is {turned.max():.2g} rad from the plan's"),
            (fast.max() > 1.0 + SPEED_SHARE, int(fast.argmax()), f"a joint turns at {fast.max():.3f} of its limit"),
        )
        if wrong
    ]
    if abs(float(samples.times[-1]) - ends) > MOST_DELAY:
        findings.append(refusal(TABLE, samples.times.size + 1, f"it ends at {samples.times[-1]:g} s, not {ends:g} s"))
    tips = tips_of(table.joints, program, cell)
    velocity = np.gradient(tips, table.times, axis=0)
    square = (velocity**2).sum(axis=1)
    late = np.where(square > _MOVING**2, -(off[: square.size] * velocity).sum(axis=1) / np.maximum(square, 1e-9), 0.0)
    passed = np.interp(orders.times, table.times, late)
    lengths, runs = np.diff(orders.times), orders.runs[1:]
    sums = [np.bincount(runs, weights=each) for each in (np.diff(passed), lengths)]
    shares = np.abs(sums[0]) / np.where(sums[1] > 0.0, sums[1], np.inf)
    return findings, float(away.max()), float(np.abs(np.diff(passed)).max(initial=0.0)), float(shares.max(initial=0.0))


def _switching(
    played: Sequence[Switched],
    found: Sequence[Switched],
    events: Sequence[Event],
    program: RobotProgram,
    cell: Cell,
    *,
    waited: FloatArray,
) -> tuple[list[VerificationError], float]:
    """Return what is wrong with the switchings, and how far the tip is from where the plan has one [mm]."""
    orders, signals, tips_at = program.orders, cell.signals, program.tips_at
    names = {"dispenser": signals.dispenser, "uv_lamp": signals.uv_lamp, "vacuum": signals.vacuum or ""}
    file = played[0].file if played else "outputs.csv"
    findings: list[VerificationError] = []
    farthest = 0.0
    for output, name in names.items():
        own = [k for k, each in enumerate(played) if each.signal == name.lower()]
        wanted = [_due(event, orders, tips_at, waited) for event in events if event.output == output]
        if len(own) != len(wanted):
            findings.append(
                refusal(file, 1, f"{name or output} switches {how_many(len(own), 'time')}, planned are {len(wanted)}")
            )
            farthest = np.inf
            continue
        for k, (moment, before, on) in zip(own, sorted(wanted), strict=True):
            each, late = played[k], played[k].time - moment - before
            if each.on != on or abs(late) > MOST_DELAY:
                what = f"{name} is switched {'on' if each.on else 'off'} {1e3 * late:+.2f} ms off the plan"
                findings.append(refusal(each.file, each.line, what))
            there, wanted_there = tips_at(np.array([min(found[k].time, moment + late), moment]))
            farthest = max(farthest, float(np.linalg.norm(there - wanted_there)))
    known = {name.lower() for name in names.values() if name}
    strange = [each for each in played if each.signal not in known]
    findings += [refusal(each.file, each.line, f"{each.signal} is no output of the cell") for each in strange]
    return findings, farthest


def _due(event: Event, orders: Orders, tips_at: TipsAt, waited: FloatArray) -> tuple[float, float, bool]:
    """Return when the motion is where an event switches, what was waited for before [s], and whether it is on then."""
    moment = moment_on(event.target, event.distance, orders, tips_at, from_start=event.from_start)
    return moment, float(waited[max(event.target - 1, 0)]), event.on
