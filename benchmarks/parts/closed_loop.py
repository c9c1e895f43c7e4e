"""A loop of prints in silico: laid by a plant, scanned, measured against what was wanted, and corrected."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, cached_property, partial
from typing import final

import numpy as np

from benchmarks.parts.print_scans import (
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
from geoprint.appraisal.scanned import COVERED_SHARE, PlannedDeposit, measured_print, registered
from geoprint.deposition.feedback import Correction, FlowBounds, MeasuredRuns, corrected
from geoprint.model import FloatArray
from geoprint.silico import LaidBeads, Plant, Sensor, ValveTimes, looking_at, plant_beads, scanned
from geoprint.surfaces import face_areas, mean_normal

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
    def told(self) -> Correction:
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
    up, middle = mean_normal(surface), surface.vertices.mean(axis=0)
    view = looking_at(
        middle, place=middle + AWAY * up / np.linalg.norm(up), focal=FOCAL * rays / RAYS, size=(rays, rays)
    )
    deposit = PlannedDeposit(poses, spacing=SPACING, height=HEIGHT)
    places, wanted = wanted_thickness(side)
    covered = wanted >= COVERED_SHARE * HEIGHT

    def correction(beads: LaidBeads, factors: Correction | None, valve: ValveTimes) -> Correction:
        """Return what a scan tells of beads that were laid with these factors and times."""
        scan = scanned(surface, beads, Sensor(view, NOISE, MISSING), T_work_scan=np.eye(4), random=random)
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
        factors = made.told
        valve = ValveTimes(factors.opening, factors.shutting)


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
