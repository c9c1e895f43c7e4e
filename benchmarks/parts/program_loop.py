"""Prints of written programs by a plant, measured along their runs as a scan or a photograph does, and corrected.

Programs are of a plate and a slow arm: a valve lets more through where the arm is slow, an output that follows the
speed does not. What they deposit is executed, as `geoprint appraise` does. The plant errs in ways that the corrector's
model lacks. What is measured is the truth with the noise that is stated beside it: how well scans and photographs are
measured other benchmarks say.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal, final

import numpy as np

import geoprint
from benchmarks.parts.closed_loop import BOUNDS, plant_of
from geoprint.appraisal.scanned import PlannedDeposit
from geoprint.config import packaged_cell_text
from geoprint.deposition.feedback import MeasuredRuns, corrected
from geoprint.model import FloatArray, IntArray, frozen
from geoprint.pipeline.appraised.executing import printed_program
from geoprint.pipeline.appraised.given import PlannedPrint, read_plan
from geoprint.pipeline.feeding.printed import LEAST_EDGES, POWER_DEVIATION, SPREADING, VOLUME_POWER
from geoprint.silico import LaidBeads, Plant, ValveTimes, plant_beads

Mode = Literal["io", "analog"]
Measure = Literal["scan", "photograph"]
PLATE = Path(__file__).parents[2] / "data" / "plate.ply"
SPACING = 2.5
# Accelerations of the packaged arm, and of one that is slow at corners.
QUICK, SLOW = "[687.5, 687.5, 687.5, 1145.9, 1145.9, 1432.4]", "[100, 100, 100, 160, 160, 200]"
ANALOG = 'mode = "analog"\nflow = "aoFlow"\nflow_per_mm3_s = 0.1'
# Deviation of each part of a run by a scan, what all share, and of a width in a photograph [mm].
DEVIATION, COMMON, WIDTH_DEVIATION = 0.03, 0.015, 0.02
# Widths in the photograph are of beads that stand apart: over the flow over the layer's height.
APART = 0.5


@final
@frozen
class Programmed:
    """A program of the plate.

    Attributes:
        plan: its bundle, as read.
        runs: (k,) of parts of runs.
        starts: (k,) arc length at which each begins [mm].
        ends: (k,) arc length at which it ends [mm].
        deposited: (k,) volume that it deposits, as executed, over the wanted one.
    """

    plan: PlannedPrint
    runs: IntArray
    starts: FloatArray
    ends: FloatArray
    deposited: FloatArray


@cache
def programmed(mode: Mode) -> Programmed:
    """Return the program of the plate for a cell of this mode."""
    with TemporaryDirectory() as scratch:
        cell, folder = Path(scratch, "cell.toml"), Path(scratch, "plan")
        text = packaged_cell_text("irb120-bent45").replace(QUICK, SLOW)
        cell.write_text(text.replace('mode = "io"', ANALOG) if mode == "analog" else text, encoding="utf-8")
        job = geoprint.job_of(
            surface=PLATE, unit="mm", spacing=SPACING, backend="heat", place="demo", on_slowdown="follow",
            accept_flow=True, cell=cell,
        )  # fmt: skip
        geoprint.save_plan(geoprint.plan(job), folder)
        plan = read_plan(folder)
        deposit = PlannedDeposit(plan.poses, spacing=plan.spacing, height=plan.height)
        arcs, half = deposit.runs.arcs, 0.5 * deposit.runs.lengths
        firsts = np.flatnonzero(np.diff(deposit.parts, prepend=-1))
        lasts = np.append(firsts[1:], deposit.parts.size) - 1
        runs, starts, ends = deposit.runs.runs[firsts], arcs[firsts] - half[firsts], arcs[lasts] + half[lasts]
        printed = printed_program(folder, plan, runs=runs, starts=starts, ends=ends)
    return Programmed(plan, runs, starts, ends, printed.deposited)


def deviations(modes: tuple[Mode, ...], *, seed: int, by: Measure = "scan") -> Iterator[FloatArray]:
    """Yield print after print the (r,) volume of its runs off the wanted one, over it.

    Args:
        modes: of the cells, one a print. What another dispenser printed is not fed back, as `geoprint plan` refuses.
        seed: of the dispenser, and of the noise.
        by: how prints are measured.
    """
    random, plant = np.random.default_rng([seed, 4]), plant_of(seed)
    before: Mode | None = None
    factors, valve = np.ones(0), ValveTimes()
    for mode in modes:
        made = programmed(mode)
        if mode != before:
            factors, valve = np.ones(made.runs.size), ValveTimes()
        printed = _printed(made, factors, valve, plant, random)
        laid, wanted = _volumes(made, printed), _volumes(made, _printed(made, None, ValveTimes(), Plant(), random))
        own = np.unique(made.runs, return_inverse=True)[1]
        yield np.bincount(own, laid) / np.bincount(own, wanted) - 1.0
        measured = _measured(made, laid / wanted, factors, valve, by=by, random=random)
        found = corrected(measured, bounds=replace(BOUNDS, even=mode == "io"))
        factors, valve, before = found.factors, ValveTimes(found.opening, found.shutting), mode


def changed(seed: int, *, mode: Mode, by: Measure) -> bool:
    """Say whether a print that is as its program deposits it changes the next one, by noise of the measurement."""
    made, random = programmed(mode), np.random.default_rng([seed, 5])
    measured = _measured(made, made.deposited, np.ones(made.runs.size), ValveTimes(), by=by, random=random)
    found = corrected(measured, bounds=replace(BOUNDS, even=mode == "io"))
    return bool(found.changes) or bool((found.factors != 1.0).any())


def _printed(
    made: Programmed, factors: FloatArray | None, valve: ValveTimes, plant: Plant, random: np.random.Generator
) -> LaidBeads:
    """Return what a plant deposits of a program; without factors what its paths want."""
    poses = made.plan.poses
    flow = poses.flow.copy()
    if factors is not None:
        middles = 0.5 * (made.starts + made.ends)
        for number in np.unique(made.runs).tolist():
            own, there = made.runs == number, poses.runs == number
            flow[there] *= np.interp(poses.arcs[there], middles[own], (factors * made.deposited)[own])
    return plant_beads(
        replace(poses, flow=flow), made.plan.surface, plant, height=made.plan.height, valve=valve, random=random
    )


def _volumes(made: Programmed, beads: LaidBeads) -> FloatArray:
    """Return the (k,) volume on each part."""
    result = np.zeros(made.runs.size)
    for number in np.unique(made.runs).tolist():
        own, there = made.runs == number, beads.runs == number
        which = np.clip(np.searchsorted(made.starts[own], beads.arcs[there], side="right") - 1, 0, int(own.sum()) - 1)
        result[own] = np.bincount(which, beads.volumes[there], minlength=int(own.sum()))
    return result


def _measured(
    made: Programmed, shares: FloatArray, factors: FloatArray, valve: ValveTimes, *, by: Measure,
    random: np.random.Generator,
) -> MeasuredRuns:  # fmt: skip
    """Return what is measured of a print that has these shares of the wanted volume.

    A photograph sees widths, which here go with the root of the volume, so that the assumed power is too small.
    """
    if by == "scan":
        noise = DEVIATION * random.standard_normal(shares.size) + COMMON * random.standard_normal()
        ratios, own_noise = np.maximum(shares + noise, 0.0), np.full(shares.size, DEVIATION)
        uncertain = (COMMON, 0.0, 0.0)
    else:
        wide = APART * SPACING
        own = np.unique(made.runs, return_inverse=True)[1]
        shift = 0.5 * LEAST_EDGES * random.standard_normal(int(own.max()) + 1)[own]
        widths = wide * np.sqrt(shares) + shift + WIDTH_DEVIATION * random.standard_normal(shares.size)
        ratios = (widths / np.median(widths)) ** VOLUME_POWER
        own_noise = VOLUME_POWER * ratios * WIDTH_DEVIATION / widths
        uncertain = (VOLUME_POWER * SPREADING, VOLUME_POWER * LEAST_EDGES / wide, POWER_DEVIATION / VOLUME_POWER)
    return MeasuredRuns(
        made.runs, made.starts, made.ends, np.ones(shares.size, dtype=np.bool_), ratios, own_noise, factors,
        factors * made.deposited, *uncertain, opened=valve.opening, shut=valve.shutting,
    )  # fmt: skip
