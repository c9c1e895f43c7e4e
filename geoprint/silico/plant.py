"""A dispenser in silico that errs as dispensers do: what it lays of the flow that it is commanded along its runs.

Air above the material yields, the more of it the emptier the syringe is: the flow reaches its value over a length of
the run. Rest makes the material thick, and flowing thins it again. It is more viscous than thought. The valve follows
late. And what lies there slumps, downhill and apart.
"""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import FloatArray, PoseStream, Surface, comparable
from geoprint.silico.laid import Faults, LaidBeads, laid_beads
from geoprint.surfaces import closest, normals


@final
@comparable
class Plant:
    """What a dispenser does.

    Attributes:
        viscosity: of the material, over what the flow was set for: as much less of it flows.
        valve_lag: length of a run over which the valve opens late, and shuts late: what still comes lies on its end
            [mm].
        air_lag: length over which the flow approaches its value, of a full syringe [mm].
        air_growth: by how much that length grows until the plan is printed [mm].
        thickening: share by which the material is thicker after rest.
        thinning: length of flow over which that goes away [mm].
        slump: share by which beads run apart, and of the layer's height by which they run downhill on a vertical wall.
        noise: standard deviation of the width along a bead, over its mean.
    """

    viscosity: float = 1.0
    valve_lag: float = 0.0
    air_lag: float = 0.0
    air_growth: float = 0.0
    thickening: float = 0.0
    thinning: float = 1.0
    slump: float = 0.0
    noise: float = 0.0

    def __post_init__(self) -> None:
        least = min(self.valve_lag, self.air_lag, self.air_growth, self.thickening, self.slump, self.noise)
        if least < 0.0 or min(self.viscosity, self.thinning) <= 0.0:
            raise InputError(
                f"a plant has a positive viscosity and length of thinning and nothing negative, found "
                f"{self.viscosity:g}, {self.thinning:g} mm and {least:g}."
            )


@final
@comparable
class ValveTimes:
    """When the valve is commanded.

    Attributes:
        opening: by how much before a run begins [mm].
        shutting: by how much before it ends [mm].
    """

    opening: float = 0.0
    shutting: float = 0.0


def plant_beads(
    poses: PoseStream,
    surface: Surface,
    plant: Plant,
    *,
    height: float,
    valve: ValveTimes,
    random: np.random.Generator,
) -> LaidBeads:
    """Lay the beads of a plan as a dispenser does.

    Args:
        poses: of the plan, with the flow that is commanded.
        surface: that it was planned on.
        plant: the dispenser.
        height: of the layer [mm].
        valve: when it is commanded.
        random: of the noise.

    Raises:
        InputError: nothing is deposited.
    """
    faults = Faults(width_noise=plant.noise, width_scale=1.0 + plant.slump, viscosity=plant.viscosity)
    beads = laid_beads(poses, surface, height=height, faults=faults, random=random)
    shares = np.ones(len(beads.arcs))
    laid, whole = 0.0, float(_volumes(beads).sum())
    for number in np.unique(beads.runs).tolist():
        own = np.flatnonzero(beads.runs == number)
        lag = plant.air_lag + plant.air_growth * min(laid / max(whole, 1e-12), 1.0)
        shares[own] = _shares(beads.arcs[own], beads.areas[own], plant, lag=lag, valve=valve)
        laid += float((_volumes(beads)[own] * shares[own]).sum())
    areas = beads.areas * shares
    slid = _slid(beads, surface, by=plant.slump * height)
    widths = beads.widths * np.sqrt(shares)
    return replace(beads, places=slid, areas=areas, widths=widths)


def _shares(arcs: FloatArray, commanded: FloatArray, plant: Plant, *, lag: float, valve: ValveTimes) -> FloatArray:
    """Return the (k,) volume along one run over the commanded one.

    What comes before a run begins, and after it ends, lies folded back on its first and last stretch.
    """
    begin, end = plant.valve_lag - valve.opening, float(arcs[-1]) + plant.valve_lag - valve.shutting
    step = float(arcs[-1]) / max(arcs.size - 1, 1)
    before: FloatArray = -step * np.arange(int(np.ceil(max(-begin, 0.0) / step)), 0, -1, dtype=np.float64)
    still = max(end - float(arcs[-1]), 0.0)
    after: FloatArray = float(arcs[-1]) + step * np.arange(1, 1 + int(np.ceil(still / step)), dtype=np.float64)
    times = np.concatenate([before, arcs, after])
    flow = _reached(np.interp(times, arcs, commanded), np.maximum(times - begin, 0.0), lag=lag)
    flow /= 1.0 + plant.thickening * np.exp(-np.maximum(times - begin, 0.0) / plant.thinning)
    flow[(times < begin) | (times > end)] = 0.0
    where = np.abs(times)
    where = np.where(where > arcs[-1], 2.0 * arcs[-1] - where, where)
    places = np.clip(np.rint(where / step).astype(np.int64), 0, arcs.size - 1)
    return np.bincount(places, flow, minlength=arcs.size) / np.maximum(commanded, 1e-12)


def _reached(commanded: FloatArray, flowing: FloatArray, *, lag: float) -> FloatArray:
    """Return the flow that approaches the commanded one over a length, from nothing where the valve opens."""
    if lag <= 0.0:
        return commanded
    result = np.zeros_like(commanded)
    for k in range(1, commanded.size):
        kept = np.exp(-(flowing[k] - flowing[k - 1]) / lag)
        result[k] = kept * result[k - 1] + (1.0 - kept) * commanded[k]
    return result


def _volumes(beads: LaidBeads) -> FloatArray:
    """Return the (k,) volume of the bead from each place to the next of its run [mm3]."""
    steps = np.append(np.where(beads.runs[1:] == beads.runs[:-1], np.diff(beads.arcs), 0.0), 0.0)
    return beads.areas * steps


def _slid(beads: LaidBeads, surface: Surface, *, by: float) -> FloatArray:
    """Return the (k, 3) places that beads run to, downhill along the surface."""
    if by == 0.0:
        return beads.places
    up = normals(surface, closest(surface, beads.places)[0])
    down = np.array([0.0, 0.0, -1.0]) + up[:, 2:] * up
    return np.asarray(closest(surface, beads.places + by * down)[0].xyz(surface))
