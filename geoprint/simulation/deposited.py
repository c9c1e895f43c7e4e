"""What a plan deposits on its part: beads along the deposited poses, with errors put in."""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np
from scipy import ndimage

from geoprint.errors import InputError
from geoprint.geometry import closest, normals
from geoprint.model import FloatArray, IntArray, PoseStream, Surface, comparable, freeze_arrays, frozen

# Places along a bead are at most this far apart, over its mean width: its edge is round to a thousandth of that.
STEP_SHARE = 0.04
# Noise along a bead is alike over so many of its widths (standard deviation of its smoothing).
ALIKE_SHARE = 1.0


@final
@comparable
class Break:
    """A stretch without material.

    Attributes:
        run: of the plan, counted as in poses.csv.
        start: arc length from the start of the run [mm].
        end: where material begins again [mm].
    """

    run: int
    start: float
    end: float


@final
@comparable
class Faults:
    """What goes wrong in a print.

    Attributes:
        offset: by which all beads lie to the left of their paths, as seen from outside [mm].
        width_scale: width over what the flow asks for.
        width_noise: standard deviation of the width along a bead, over its mean.
        breaks: stretches without material.
        flow: volume that is set, over that of the plan.
        viscosity: of the material, over what the flow was set for: at the same pressure as much less of it flows.
        lag: length of each run before its material begins [mm].
    """

    offset: float = 0.0
    width_scale: float = 1.0
    width_noise: float = 0.0
    breaks: tuple[Break, ...] = ()
    flow: float = 1.0
    viscosity: float = 1.0
    lag: float = 0.0

    def __post_init__(self) -> None:
        if self.width_scale <= 0.0 or self.width_noise < 0.0:
            raise InputError(
                f"a print has a positive width and no negative noise, found {self.width_scale:g} times the width and "
                f"a noise of {self.width_noise:g}."
            )
        if min(self.flow, self.viscosity) <= 0.0 or self.lag < 0.0:
            raise InputError(
                f"a print has a positive flow and viscosity and no negative lag, found {self.flow:g}, "
                f"{self.viscosity:g} and {self.lag:g} mm."
            )

    @property
    def volume(self) -> float:
        """What is deposited over what the plan asks for."""
        return self.flow / self.viscosity


@final
@frozen
class DepositedBeads:
    """Beads on a part, as places along their middles.

    Attributes:
        places: (k, 3) on the surface, run after run [mm].
        normals: (k, 3) outward unit normals there.
        ahead: (k, 3) unit directions of the runs.
        widths: (k,) 0 where there is no material [mm].
        areas: (k,) of the cross-section: volume deposited per length [mm2].
        arcs: (k,) arc length of the plan from the start of the run [mm].
        runs: (k,) of the plan.
        height: of their crest over the surface [mm].
    """

    places: FloatArray
    normals: FloatArray
    ahead: FloatArray
    widths: FloatArray
    areas: FloatArray
    arcs: FloatArray
    runs: IntArray
    height: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self, places="float: k 3", normals="float: k 3", ahead="float: k 3", widths="float: k", areas="float: k",
            arcs="float: k", runs="int: k",
        )  # fmt: skip

    @property
    def volumes(self) -> FloatArray:
        """(k,) volume of the length of bead that each place stands for [mm3]."""
        steps = np.where(self.runs[1:] == self.runs[:-1], np.diff(self.arcs), 0.0)
        return np.asarray(self.areas * 0.5 * (np.append(steps, 0.0) + np.insert(steps, 0, 0.0)))


def deposited_beads(
    poses: PoseStream, surface: Surface, *, height: float, faults: Faults, random: np.random.Generator
) -> DepositedBeads:
    """Deposit the beads of a plan, each as wide as its flow over the height, with faults.

    More volume makes a bead wider and higher alike; spreading makes it wider and as much lower.

    Args:
        poses: of the plan; only deposit counts.
        surface: that it was planned on.
        height: of the layer [mm].
        faults: what goes wrong.
        random: of the noise.

    Raises:
        InputError: nothing is deposited, or a break is of a run that is not there.
    """
    numbers = np.unique(poses.runs[poses.deposit]).tolist()
    strange = [each.run for each in faults.breaks if each.run not in numbers]
    if not numbers or strange:
        raise InputError(
            f"breaks are of runs that deposit: there are {len(numbers)}"
            + (f", from {numbers[0]} to {numbers[-1]}, found run {strange[0]}." if strange else ".")
        )
    runs = [_run(poses, number, height=height, faults=faults, random=random) for number in numbers]
    places, ahead, widths, areas, arcs = (np.concatenate(parts) for parts in zip(*runs, strict=True))
    numbered = np.repeat(numbers, [len(run[0]) for run in runs])
    return landed(
        DepositedBeads(places, np.zeros_like(places), ahead, widths, areas, arcs, numbered, height),
        surface,
        faults=faults,
    )


def landed(beads: DepositedBeads, surface: Surface, *, faults: Faults) -> DepositedBeads:
    """Return beads where they come to lie: on the surface, shifted aside by what the faults shift them.

    Args:
        beads: whose places are near the surface, and whose normals are not known yet.
        surface: that they fall onto, each place where it is nearest.
        faults: what goes wrong.
    """
    up = normals(surface, closest(surface, beads.places)[0])
    aside = np.cross(up, beads.ahead)
    aside /= np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-12)
    places, _ = closest(surface, beads.places + faults.offset * aside)
    return replace(beads, places=places.xyz(surface), normals=normals(surface, places))


def _run(
    poses: PoseStream, number: int, *, height: float, faults: Faults, random: np.random.Generator
) -> tuple[FloatArray, ...]:
    """Return finely placed points along one run as planned, directions, widths and areas as printed, and arcs."""
    rows = np.flatnonzero(poses.deposit & (poses.runs == number))
    corners, flow = poses.surface_points[rows], poses.flow[rows]
    reached = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    wide = faults.width_scale * float(np.sqrt(faults.volume)) * flow / height
    step = STEP_SHARE * float(wide.mean())
    length = float(reached[-1])
    arcs: FloatArray = np.linspace(0.0, length, max(2, int(np.ceil(length / step)) + 1))
    places: FloatArray = np.column_stack([np.interp(arcs, reached, corners[:, axis]) for axis in range(3)])
    ahead: FloatArray = np.asarray(np.gradient(places, axis=0))
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-12)
    shape = with_faults(
        np.interp(arcs, reached, wide), np.interp(arcs, reached, faults.volume * flow), arcs, run=number, faults=faults,
        random=random,
    )  # fmt: skip
    return places, ahead, *shape, arcs


def with_faults(
    widths: FloatArray,
    areas: FloatArray,
    arcs: FloatArray,
    *,
    run: int,
    faults: Faults,
    random: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """Return (k,) widths and areas of a bead with noise, and bare where its material lags or breaks off.

    Args:
        widths: (k,) without either, 0 where there is no material [mm].
        areas: (k,) likewise [mm2].
        arcs: (k,) from where the run begins, at even steps [mm].
        run: its number.
        faults: what goes wrong.
        random: of the noise.
    """
    if faults.width_noise > 0.0:
        alike = ALIKE_SHARE * float(widths[widths > 0.0].mean()) / float(arcs[1] - arcs[0])
        noise: FloatArray = ndimage.gaussian_filter1d(random.standard_normal(arcs.size), alike)
        # About the mean of the bead: on a run of few widths what is alike would be the mean itself.
        noise -= noise.mean()
        more = np.maximum(1.0 + faults.width_noise * noise / max(float(noise.std()), 1e-12), 0.0)
        widths, areas = widths * more, areas * more**2
    bare = (arcs >= 0.0) & (arcs < faults.lag)
    for each in faults.breaks:
        if each.run == run:
            bare |= (arcs >= each.start) & (arcs <= each.end)
    return np.where(bare, 0.0, widths), np.where(bare, 0.0, areas)
