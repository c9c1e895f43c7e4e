"""A loop of simulated prints: laid by a plant, scanned, measured against what was wanted, and corrected."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, cached_property, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal, final

import numpy as np

import geoprint
from benchmarks import DATA
from benchmarks.prints.print_scans import (
    AWAY,
    FOCAL,
    HEIGHT,
    MISSING,
    NOISE,
    RAYS,
    SPACING,
    planned_patch,
    true_thickness,
)
from geoprint.config import packaged_cell_text
from geoprint.geometry import face_areas, mean_normal
from geoprint.inspection.executing import printed_program
from geoprint.inspection.inputs import PlannedPrint, read_plan
from geoprint.inspection.scan_measuring import COVERED_SHARE, measured_print
from geoprint.inspection.scan_registration import registered
from geoprint.inspection.scan_target import PlannedDeposit
from geoprint.model import FloatArray, IntArray, Surface, frozen
from geoprint.process.feedback import Correction, FlowBounds, MeasuredRuns, corrected
from geoprint.simulation import DepositedBeads, Plant, Sensor, ValveTimes, looking_at, plant_beads, scanned
from geoprint.workflow.feedback import LEAST_EDGES, POWER_DEVIATION, SPREADING, VOLUME_POWER

# The flow within which the packaged cells set it, and how far the valve can be commanded earlier and later [mm].
BOUNDS = FlowBounds(0.5, 1.5, 3.0, 0.0)
VISCOSITY, VALVE_LAG, SLUMP = 1.3, 0.5, 0.05
# Of the width along a bead: twice as much of its volume.
WIDTH_NOISE = 0.015


@final
class Print:
    """One print of a loop, which is scanned when somebody asks what that tells.

    Attributes:
        error: root mean square of the thickness over its cells off the wanted one, over the layer's height.
    """

    def __init__(self, error: float, correction: Callable[[], Correction]) -> None:
        self.error = error
        self._correction = correction

    @cached_property
    def record(self) -> Correction:
        """The correction that its scan gives."""
        return self._correction()


def plant_of(seed: int) -> Plant:
    """Return a dispenser with all errors, those that nobody knows drawn from their ranges."""
    random = np.random.default_rng([seed, 1])
    return Plant(
        viscosity=VISCOSITY,
        valve_lag=VALVE_LAG,
        air_lag=random.uniform(0.3, 1.0),
        air_growth=random.uniform(1.0, 3.0),
        thickening=random.uniform(0.1, 0.3),
        thinning=random.uniform(4.0, 12.0),
        slump=SLUMP,
        noise=WIDTH_NOISE,
    )


@cache
def wanted_thickness(side: int | None = None) -> tuple[FloatArray, FloatArray]:
    """Return (c, 3) middles of cells about as large as a spacing, and the (c,) thickness wanted there [mm].

    That is what a dispenser without errors lays.
    """
    surface, poses = planned_patch()
    areas, corners = face_areas(surface), surface.vertices[surface.faces]
    random = np.random.default_rng(0)
    faces = random.choice(len(areas), round(float(areas.sum()) / SPACING**2), p=areas / areas.sum())
    places: FloatArray = np.einsum("kc,kcx->kx", random.dirichlet(np.ones(3), faces.size), corners[faces])
    beads = plant_beads(poses, surface, Plant(), height=HEIGHT, valve=ValveTimes(), random=random)
    return places, true_thickness(places, surface, beads, side=side)


def closed_loop(plant: Plant, *, seed: int, rays: int = RAYS, side: int | None = None) -> Iterator[Print]:
    """Yield print after print, each with what the one before taught.

    Args:
        plant: that prints.
        seed: of the noise of prints and scans.
        rays: lines of sight to either side of a scan.
        side: places of each triangle, along either side, by which the truth is found, where they are not to be SIDE.
    """
    surface, poses = planned_patch()
    random = np.random.default_rng([seed, 2])
    sensor = _sensor_over(surface, rays=rays)
    deposit = PlannedDeposit(poses, spacing=SPACING, height=HEIGHT)
    places, wanted = wanted_thickness(side)
    covered = wanted >= COVERED_SHARE * HEIGHT

    def correction(beads: DepositedBeads, factors: Correction | None, valve: ValveTimes) -> Correction:
        """Return what a scan tells of beads that were laid with these factors and times."""
        scan = scanned(surface, beads, sensor, T_work_scan=np.eye(4), random=random)
        found = registered(scan.points, surface, deposit, start=np.eye(4))
        parts = measured_print(scan.points, found, surface, deposit, random=random).parts
        middles = 0.5 * (parts.starts + parts.ends)
        commanded = np.ones(len(middles)) if factors is None else factors.at(parts.runs, middles)
        measured = MeasuredRuns(
            parts.runs,
            parts.starts,
            parts.ends,
            parts.seen,
            parts.ratios,
            parts.ratio_deviations,
            commanded,
            # A program without lags or ramps deposits what is commanded.
            commanded,
            common=found.shift_deviation / HEIGHT,
            opened=valve.opening,
            shut=valve.shutting,
        )
        return corrected(measured, bounds=BOUNDS)

    factors, valve = None, ValveTimes()
    while True:
        flow = poses.flow if factors is None else poses.flow * factors.at(poses.runs, poses.arcs)
        beads = plant_beads(replace(poses, flow=flow), surface, plant, height=HEIGHT, valve=valve, random=random)
        off = (true_thickness(places, surface, beads, side=side) - wanted)[covered]
        made = Print(float(np.sqrt(np.mean(off**2))) / HEIGHT, partial(correction, beads, factors, valve))
        yield made
        factors = made.record
        valve = ValveTimes(factors.opening, factors.shutting)


def _sensor_over(surface: Surface, *, rays: int) -> Sensor:
    """Return the sensor that looks at the middle of a surface along its mean normal."""
    up, middle = mean_normal(surface), surface.vertices.mean(axis=0)
    view = looking_at(
        middle, place=middle + AWAY * up / np.linalg.norm(up), focal=FOCAL * rays / RAYS, size=(rays, rays)
    )
    return Sensor(view, NOISE, MISSING)


def measured_as_known(off: float, deviation: float, *, common: float, seed: int) -> MeasuredRuns:
    """Return what is measured of the plan on the patch that is laid evenly, with noise as large as is said.

    Args:
        off: of its volume, over the deviation.
        deviation: of each part of a run.
        common: that all share.
        seed: of the noise.
    """
    deposit = PlannedDeposit(planned_patch()[1], spacing=SPACING, height=HEIGHT)
    random = np.random.default_rng([seed, 3])
    first, last = (np.unique(each, return_index=True)[1] for each in (deposit.parts, deposit.parts[::-1]))
    last = deposit.parts.size - 1 - last
    arcs, half = deposit.runs.arcs, 0.5 * deposit.runs.lengths
    noise = deviation * random.standard_normal(first.size) + common * random.standard_normal()
    return MeasuredRuns(
        runs=deposit.runs.runs[first],
        starts=arcs[first] - half[first],
        ends=arcs[last] + half[last],
        seen=np.ones(first.size, dtype=np.bool_),
        ratios=1.0 + off * deviation + noise,
        deviations=np.full(first.size, deviation),
        factors=np.ones(first.size),
        deposited=np.ones(first.size),
        common=common,
    )


Mode = Literal["io", "analog"]
Measure = Literal["scan", "photograph"]
PLATE = DATA / "plate.ply"
PLATE_SPACING = 2.5
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
            surface=PLATE, unit="mm", spacing=PLATE_SPACING, backend="heat", place="demo", on_slowdown="follow",
            accept_flow=True, cell=cell,
        )  # fmt: skip
        geoprint.plan(job).save(folder)
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
        deposited, wanted = _volumes(made, printed), _volumes(made, _printed(made, None, ValveTimes(), Plant(), random))
        own = np.unique(made.runs, return_inverse=True)[1]
        yield np.bincount(own, deposited) / np.bincount(own, wanted) - 1.0
        measured = _measured(made, deposited / wanted, factors, valve, by=by, random=random)
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
) -> DepositedBeads:
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


def _volumes(made: Programmed, beads: DepositedBeads) -> FloatArray:
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
        wide = APART * PLATE_SPACING
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
