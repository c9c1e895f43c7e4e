"""A simulated dispenser that errs as dispensers do: beads where the tip goes, of what valve and flow let through."""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np
from scipy import ndimage

from geoprint.errors import InputError
from geoprint.geometry import closest, normals
from geoprint.model import Dispensing, FloatArray, IntArray, PoseStream, Surface, comparable
from geoprint.simulation.deposited import STEP_SHARE, DepositedBeads, Faults, deposited_beads, landed, with_faults

# A simulated dispenser that errs as dispensers do: what it deposits of the flow that it is commanded along its runs.
#
# Air above the material yields, the more of it the emptier the syringe is: the flow reaches its value over a length
# of the run. Rest makes the material thick, and flowing thins it again. It is more viscous than thought. The valve
# follows late. And what lies there slumps, downhill and apart.


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
) -> DepositedBeads:
    """Deposit the beads of a plan as a dispenser does.

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
    beads = deposited_beads(poses, surface, height=height, faults=faults, random=random)
    shares = np.ones(len(beads.arcs))
    deposited, whole = 0.0, float(_volumes(beads).sum())
    for number in np.unique(beads.runs).tolist():
        own = np.flatnonzero(beads.runs == number)
        lag = plant.air_lag + plant.air_growth * min(deposited / max(whole, 1e-12), 1.0)
        shares[own] = _shares(beads.arcs[own], beads.areas[own], plant, lag=lag, valve=valve)
        deposited += float((_volumes(beads)[own] * shares[own]).sum())
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


def _volumes(beads: DepositedBeads) -> FloatArray:
    """Return the (k,) volume of the bead from each place to the next of its run [mm3]."""
    steps = np.append(np.where(beads.runs[1:] == beads.runs[:-1], np.diff(beads.arcs), 0.0), 0.0)
    return beads.areas * steps


def _slid(beads: DepositedBeads, surface: Surface, *, by: float) -> FloatArray:
    """Return the (k, 3) places that beads run to, downhill along the surface."""
    if by == 0.0:
        return beads.places
    up = normals(surface, closest(surface, beads.places)[0])
    down = np.array([0.0, 0.0, -1.0]) + up[:, 2:] * up
    return np.asarray(closest(surface, beads.places + by * down)[0].xyz(surface))


# What a program deposits that was executed: beads where its tip goes, of what its valve and its flow let through.
#
# A valve that only opens and shuts lets through a volume a second, so that a slower tip deposits more; an output that
# follows the speed lets through a volume a length. Both follow their commands late. What comes while the tip stands
# still, or travels, comes to lie as well, below it.


# A bead is as wide as its volume is over so many of its widths (standard deviation of its smoothing).
SPREAD_SHARE = 0.5
# A place with less than this share of the wanted volume has no material: rounding of sums.
LEAST_SHARE = 1e-6
# Moments in which the tip rests are distinguished by so little of a length [mm].
REST = 1e-9
# A flow that rises evenly does so in so many steps.
RISING = 16
# Where nothing moves below a tip that does, its places count as this share of its steps apart.
LEAST_STEP = 0.05


@final
@comparable
class Dispenser:
    """What gives the material.

    Attributes:
        rate: volume a second while the valve is open and no output sets a flow [mm3/s].
        opens: time from the command to open until material flows [s].
        shuts: time from the command to shut until it flows no more [s].
        follows: time from a new flow being set until it flows [s].
        settles: time after `opens` in which the flow rises evenly to the rate [s].
    """

    rate: float
    opens: float = 0.0
    shuts: float = 0.0
    follows: float = 0.0
    settles: float = 0.0

    def __post_init__(self) -> None:
        if self.rate <= 0.0 or min(self.opens, self.shuts, self.follows, self.settles) < 0.0:
            raise InputError(
                f"a dispenser has a positive rate and no negative lags, found {self.rate:g} mm3/s and "
                f"{self.opens:g}, {self.shuts:g}, {self.follows:g} and {self.settles:g} s."
            )


def dispensed_beads(
    program: Dispensing,
    surface: Surface,
    dispenser: Dispenser,
    *,
    height: float,
    faults: Faults,
    random: np.random.Generator,
) -> DepositedBeads:
    """Deposit what a program commands, each bead as wide as the volume over the height, with faults.

    More volume than the plan wants makes a bead wider and higher alike, as does `deposited_beads`.

    Args:
        program: its path and its commands.
        surface: that it was planned on.
        dispenser: what follows the commands.
        height: of the layer [mm].
        faults: what goes wrong besides.
        random: of the noise.

    Raises:
        InputError: the plan wants nothing anywhere, the program deposits nothing, or a broken run is missing.
    """
    numbers = np.unique(program.runs[program.wanted > 0.0]).tolist()
    strange = [each.run for each in faults.breaks if each.run not in numbers]
    if not numbers or strange:
        raise InputError(
            f"breaks are of runs that deposit: there are {len(numbers)}"
            + (f", from {numbers[0]} to {numbers[-1]}, found run {strange[0]}." if strange else ".")
        )
    deposited = faults.volume * let_through(program, dispenser)
    usual = float(program.wanted[program.wanted > 0.0].mean())
    runs = [
        _run(program, deposited, number, surface, usual=usual, height=height, faults=faults, random=random)
        for number in np.unique(program.runs).tolist()
    ]
    places, ahead, widths, areas, arcs, owners = (np.concatenate(parts) for parts in zip(*runs, strict=True))
    if not widths.any():
        raise InputError("the program deposits nothing: its valve never opens on its path, or its flow is 0 there.")
    beads = DepositedBeads(places, np.zeros_like(places), ahead, widths, areas, arcs, owners.astype(np.int64), height)
    return landed(beads, surface, faults=faults)


def let_through(program: Dispensing, dispenser: Dispenser) -> FloatArray:
    """Return the (k,) volume that comes from each moment of a program to the next [mm3]; nothing from the last.

    Args:
        program: k moments.
        dispenser: what follows its commands.
    """
    lags = np.where(program.valve_open, dispenser.opens, dispenser.shuts)
    # A flow that rises evenly is the mean of valves that open one after the other.
    shares = (np.arange(RISING) + 0.5) / RISING if dispenser.settles > 0.0 else np.zeros(1)
    steps = [program.valve_times + lags + share * dispenser.settles * program.valve_open for share in shares]
    opened = np.mean([_held_for(when, program.valve_open.astype(np.float64), program.times) for when in steps], axis=0)
    if not program.flow_times.size:
        return np.append(dispenser.rate * opened, 0.0)
    took = np.diff(program.times)
    flows = _held_for(program.flow_times + dispenser.follows, program.flows, program.times)
    # The mean flow over a step of time, times the length of the step in which the valve was open.
    means, shares = (np.divide(each, took, out=np.zeros_like(took), where=took > 0.0) for each in (flows, opened))
    return np.append(means * shares * np.linalg.norm(np.diff(program.tips, axis=0), axis=1), 0.0)


def _held_for(when: FloatArray, values: FloatArray, times: FloatArray) -> FloatArray:
    """Return (k - 1,) the sum over time between neighbouring moments of a value that is held until it changes.

    It is 0 before the first change; changes that would come before an earlier one come with it.
    """
    when = np.maximum.accumulate(when)
    knots = np.concatenate([[-np.inf], when, [np.inf]])
    held = np.concatenate([[0.0], values])
    until = np.concatenate([[0.0, 0.0], np.cumsum(np.diff(when) * values[:-1])]) if when.size else np.zeros(1)
    place = np.searchsorted(knots, times, side="right") - 1
    begun = np.where(place > 0, times - np.where(place > 0, knots[place], 0.0), 0.0)
    return np.diff(until[place] + held[place] * begun)


def _run(
    program: Dispensing,
    volumes: FloatArray,
    number: int,
    surface: Surface,
    *,
    usual: float,
    height: float,
    faults: Faults,
    random: np.random.Generator,
) -> tuple[FloatArray, ...]:
    """Return finely placed points below what the tip does in one run, as `DepositedBeads` has them, with its number."""
    own = np.flatnonzero(program.runs == number)
    tips, amounts, wanted, arcs = _cut(program, volumes, own, step=STEP_SHARE * usual / height)
    places = closest(surface, tips)[0].xyz(surface)
    # Where the tip goes on and the place below it does not, as at the rim of a part.
    steps = np.maximum(np.linalg.norm(np.diff(places, axis=0), axis=1), LEAST_STEP * np.diff(arcs))
    below = np.concatenate([[0.0], np.cumsum(steps)])
    below -= float(np.interp(0.0, arcs, below))
    ahead: FloatArray = np.asarray(np.gradient(places, axis=0))
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-12)
    flows = np.where(wanted > 0.0, wanted, usual)
    shares = _areas(amounts, below) / flows
    there = shares > LEAST_SHARE
    spread = SPREAD_SHARE / STEP_SHARE
    near = ndimage.gaussian_filter1d(np.where(there, shares, 0.0), spread, mode="constant")
    near /= np.maximum(ndimage.gaussian_filter1d(there.astype(np.float64), spread, mode="constant"), 1e-12)
    widths = np.where(there, faults.width_scale * np.sqrt(near) * flows / height, 0.0)
    # On travel, where nothing is wanted and nothing lies, is no bead.
    bead = np.flatnonzero((wanted > 0.0) | there)
    places, ahead, widths, below, amounts = (each[bead] for each in (places, ahead, widths, below, amounts * there))
    areas = _areas(amounts, below)
    if widths.any():
        widths, areas = with_faults(widths, areas, below, run=number, faults=faults, random=random)
    return places, ahead, widths, areas, below, np.full(bead.size, float(number))


def _areas(amounts: FloatArray, arcs: FloatArray) -> FloatArray:
    """Return the (k,) cross-section of (k,) volumes [mm3] that lie at (k,) arcs, each halfway to its neighbours."""
    if arcs.size < 2:
        return np.zeros(arcs.size)
    steps = np.diff(arcs)
    return np.asarray(2.0 * amounts / (np.append(steps, 0.0) + np.insert(steps, 0, 0.0)))


def _cut(
    program: Dispensing, volumes: FloatArray, own: IntArray, *, step: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return (n, 3) tips at even steps along a run, the (n,) volume about each, flow that is wanted there and arcs."""
    arcs = program.arcs[own]
    # A rest is a length of nothing: what comes in it is deposited in one place.
    rising = np.append(arcs, arcs[-1]) + REST * np.arange(own.size + 1)
    passed = np.concatenate([[0.0], np.cumsum(volumes[own])])
    count = max(2, int(np.ceil((rising[-1] - rising[0]) / step)) + 1)
    nodes: FloatArray = np.linspace(float(rising[0]), float(rising[-1]), count)
    edges = np.concatenate([nodes[:1], 0.5 * (nodes[1:] + nodes[:-1]), nodes[-1:]])
    columns: list[FloatArray] = [np.interp(nodes, rising[:-1], column) for column in program.tips[own].T]
    tips: FloatArray = np.column_stack(columns)
    wanted = program.wanted[own][np.minimum(np.searchsorted(rising, nodes), own.size - 1)]
    return tips, np.diff(np.interp(edges, rising, passed)), wanted, nodes
