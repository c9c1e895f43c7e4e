"""The path: ordered runs on the surface, and the stream of tool poses that prints them."""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model.surface import SurfaceCurves
from geoprint.model.values import BoolArray, FloatArray, IntArray, freeze_arrays, frozen

# Quaternions are normalised when made; beyond this they are something else.
QUATERNION_TOLERANCE = 1e-9


@final
@frozen
class Toolpath:
    """The runs in the order in which they are printed, each resampled along its arc.

    Attributes:
        curves: one curve a run; a closed one starts and ends at its seam.
        levels: (c,) contour level of each run.
        layers: (c,) layer of each run.
        spacing: distance between neighbouring levels, the least where it differs [mm].
        dropped_runs: how many were too short to be worth a start, left out: those shorter than one spacing or than the
            equipment can deposit, and what the pattern dropped.
        dropped_length: their length [mm].
        dropped_area: what they would have filled, length by width [mm2].
        fillets: (f, 3) corners of runs that were rounded [mm].
        splits: (g, 3) where runs were split: at corners that no arc can round at speed, and at creases [mm].
        rows: (k,) row that each of the k points lies on, as the pattern counts them; those of a contour are its level.
        spacings: (k,) distance wanted there to the neighbouring row [mm].
    """

    curves: SurfaceCurves
    levels: IntArray
    layers: IntArray
    spacing: float
    dropped_runs: int
    dropped_length: float
    dropped_area: float
    fillets: FloatArray
    splits: FloatArray
    rows: FloatArray
    spacings: FloatArray

    def __post_init__(self) -> None:
        sizes = freeze_arrays(
            self, levels="int: c", layers="int: c", fillets="float: f 3", splits="float: g 3", rows="float: k",
            spacings="float: k",
        )  # fmt: skip
        if sizes["c"] != self.curves.count:
            raise InputError("a toolpath needs one level and one layer a run.")
        if sizes["k"] != self.curves.points.faces.size:
            raise InputError("a toolpath needs one row and one spacing a point.")


@final
@frozen
class PoseStream:
    """Every pose of the tool in the work frame, deposit and travel, in the order of motion.

    Between neighbouring rows the tool moves in a straight line and turns at a constant rate (slerp). The rows of the
    travel that leads to run r carry r; the last retract carries the last run. Run 0 starts with its approach.

    Attributes:
        tips: (p, 3) tip of the nozzle [mm].
        quaternions: (p, 4) attitude of the tool frame, w x y z; its z axis points out of the nozzle.
        normals: (p, 3) outward unit normal of the surface below the tip, smoothed in creases too narrow for the
            stand-off, and held before edges that are all but sharp (on travel: of the run's end nearby).
        runs: (p,) run each pose belongs to, not falling.
        levels: (p,) contour level, or where a run has no whole one the whole part of its row; -1 on travel.
        layers: (p,) layer.
        deposit: (p,) whether material is deposited from this pose to the next one of the same run.
        stops: (p,) whether the tool comes to rest here: ends of runs, or of the leads before and behind them, corners
            of travel.
        arcs: (p,) arc length from the start of the run [mm]; on travel, and on a lead, from its start.
        flow: (p,) volume to deposit per length of path [mm3/mm], 0 on travel.
        standoff: height of the tip over the surface on deposit [mm].
    """

    tips: FloatArray
    quaternions: FloatArray
    normals: FloatArray
    runs: IntArray
    levels: IntArray
    layers: IntArray
    deposit: BoolArray
    stops: BoolArray
    arcs: FloatArray
    flow: FloatArray
    standoff: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self, tips="float: p 3", quaternions="float: p 4", normals="float: p 3", runs="int: p", levels="int: p",
            layers="int: p", deposit="bool: p", stops="bool: p", arcs="float: p", flow="float: p",
        )  # fmt: skip
        for name in ("quaternions", "normals"):
            lengths = np.linalg.norm(getattr(self, name), axis=1)
            if np.abs(lengths - 1.0).max(initial=0.0) > QUATERNION_TOLERANCE:
                raise InputError(f"{name} of the poses must have unit length.")
        if self.runs.size and np.diff(self.runs).min(initial=0) < 0:
            raise InputError("the run numbers of the poses must not fall: runs are printed in their order.")

    @property
    def count(self) -> int:
        """Number of poses p."""
        return int(self.runs.size)

    @property
    def deposited(self) -> BoolArray:
        """(p - 1,) whether material is deposited between each pose and the next."""
        return self.deposit[1:] & self.deposit[:-1] & (self.runs[1:] == self.runs[:-1])

    @property
    def printing(self) -> BoolArray:
        """(p - 1,) whether a step moves as the print does, `printing_steps`."""
        return printing_steps(self.stops, self.deposited)

    @property
    def stops_while_laying(self) -> int:
        """How often the tool comes to rest in the middle of a deposit."""
        return int((self.deposited[1:] & self.deposited[:-1] & self.stops[1:-1]).sum())

    @property
    def surface_points(self) -> FloatArray:
        """(p, 3) point of the surface below each depositing tip; the tip itself on travel [mm]."""
        return self.tips - np.where(self.deposit, self.standoff, 0.0)[:, None] * self.normals

    @property
    def bead_lengths(self) -> FloatArray:
        """(p - 1,) length on the surface from each depositing pose to the next [mm]."""
        lengths: FloatArray = np.linalg.norm(np.diff(self.surface_points, axis=0), axis=1)
        return lengths

    def between(self, first: int, behind: int) -> PoseStream:
        """Return the poses from row `first` to before row `behind`."""
        return self.taken(slice(first, behind))

    def taken(self, rows: slice | IntArray) -> PoseStream:
        """Return some of the poses, in their order."""
        return replace(
            self, tips=self.tips[rows], quaternions=self.quaternions[rows], normals=self.normals[rows],
            runs=self.runs[rows], levels=self.levels[rows], layers=self.layers[rows], deposit=self.deposit[rows],
            stops=self.stops[rows], arcs=self.arcs[rows], flow=self.flow[rows],
        )  # fmt: skip


def printing_steps(stops: BoolArray, deposited: BoolArray) -> BoolArray:
    """Return which steps have the speed of the print: from rest to rest about a deposit, its leads among them.

    Args:
        stops: (p,) where the tool comes to rest.
        deposited: (p - 1,) whether material is deposited from each place to the next.

    Returns:
        (p - 1,) flags.
    """
    legs = np.cumsum(stops)[:-1]
    return np.bincount(legs, deposited).astype(np.bool_)[legs]
