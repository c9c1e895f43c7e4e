"""What a plan deposits, as short stretches of its runs: what a print is held against."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy import ndimage

from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, IntArray, PoseStream, freeze_arrays, frozen

# Stretches of a run are so long, over the spacing of the plan: shorter than any fault that matters.
STRETCH_SHARE = 0.2
# Distances are measured from so many places of a stretch, by shares of its length from its middle.
WITHIN_STRETCH = (-0.5, -0.25, 0.0, 0.25, 0.5)
# Ends and middle of a stretch, by shares of its length from there, and their weights in its mean.
SIMPSON = ((-0.5, 1.0 / 6.0), (0.0, 4.0 / 6.0), (0.5, 1.0 / 6.0))
# Parts of a run that are judged, over the spacing, and how many at most.
PART_SHARE, MOST_PARTS = 2.0, 2000
# A print is shifted where one shift explains so much of the squares of its offsets, is as large as this, over the
# spacing, and so many standard deviations. What runs hardly show of a direction, over the best, they do not show.
EXPLAINED, NOTABLE_SHIFT, SURE_SHIFT, SHOWN_DIRECTION = 0.5, 0.05, 3.0, 0.05
# What bends within more than this is straight [mm].
STRAIGHT_RADIUS = 1000.0


@final
@frozen
class PlannedRuns:
    """What a plan deposits, as the middles of short stretches.

    Attributes:
        places: (k, 3) means of them, on the surface but for how it bends within one [mm].
        normals: (k, 3) outward unit normals.
        ahead: (k, 3) unit directions of the runs.
        arcs: (k,) arc length from the start of the run [mm].
        lengths: (k,) of the stretches [mm].
        radii: (k,) within which the run bends there, at most a metre [mm].
        flows: (k,) volume that is deposited per length [mm2].
        runs: (k,) as poses.csv counts them.
        spacing: between neighbouring runs [mm].
    """

    places: FloatArray
    normals: FloatArray
    ahead: FloatArray
    arcs: FloatArray
    lengths: FloatArray
    radii: FloatArray
    flows: FloatArray
    runs: IntArray
    spacing: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self, places="float: k 3", normals="float: k 3", ahead="float: k 3", arcs="float: k", lengths="float: k",
            radii="float: k", flows="float: k", runs="int: k",
        )  # fmt: skip

    def finely(self, which: BoolArray) -> FloatArray:
        """Return places along some of the stretches, their ends among them [mm]."""
        places, reach = self.places[which], (self.lengths[:, None] * self.ahead)[which]
        return np.concatenate([places + share * reach for share in WITHIN_STRETCH])


def planned_runs(poses: PoseStream, *, spacing: float) -> PlannedRuns:
    """Return what a pose stream deposits, cut into stretches.

    Args:
        poses: of the plan.
        spacing: of neighbouring runs [mm].

    Raises:
        InputError: nothing is deposited.
    """
    rows = np.flatnonzero(poses.deposit)
    numbers = np.unique(poses.runs[rows])
    if not numbers.size:
        raise InputError("the plan has no deposit to compare a print with.")
    cut = [_cut(poses.surface_points[own], poses.normals[own], poses.flow[own], step=STRETCH_SHARE * spacing)
           for own in (rows[poses.runs[rows] == number] for number in numbers)]  # fmt: skip
    runs = np.repeat(numbers, [len(each[0]) for each in cut])
    return PlannedRuns(*(np.concatenate(each) for each in zip(*cut, strict=True)), runs=runs, spacing=spacing)


def _cut(points: FloatArray, up: FloatArray, flow: FloatArray, *, step: float) -> tuple[FloatArray, ...]:
    """Return places, normals, directions, arcs, lengths, radii and flows of a run's stretches, each about a step."""
    reached: FloatArray = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    whole = float(reached[-1])
    count = max(1, round(whole / step))
    length = whole / count
    arcs: FloatArray = (np.arange(count, dtype=np.float64) + 0.5) * length
    before, ahead = (_at(arcs + shift * length, reached, points) for shift in (-0.25, 0.25))
    along = _unit(ahead - before)
    # A straight stretch about its middle would lie outside of a run that bends: by Simpson's rule this is its mean.
    parts = [share * _at(arcs + shift * length, reached, points) for shift, share in SIMPSON]
    middles: FloatArray = np.sum(parts, axis=0)
    return (
        middles, _unit(_at(arcs, reached, up)), along, arcs, np.full(count, length),
        _radii(along, length), np.interp(arcs, reached, flow),
    )  # fmt: skip


def _at(arcs: FloatArray, reached: FloatArray, values: FloatArray) -> FloatArray:
    """Return (k, 3) values at arcs, linear between those that are (j, 3) at the arcs reached."""
    return np.column_stack([np.interp(arcs, reached, values[:, axis]).astype(np.float64) for axis in range(3)])


def _radii(ahead: FloatArray, length: float) -> FloatArray:
    """Return (k,) within which a run bends, by its directions in stretches of a length, over those of a half circle."""
    if len(ahead) < 3:
        return np.full(len(ahead), STRAIGHT_RADIUS)
    cosines = np.clip((ahead[1:] * ahead[:-1]).sum(axis=1), -1.0, 1.0)
    turns = ndimage.uniform_filter1d(
        np.arccos(cosines), min(round(np.pi / STRETCH_SHARE), len(cosines)), mode="nearest"
    )
    return np.minimum(length / np.maximum(np.append(turns, turns[-1]), 1e-12), STRAIGHT_RADIUS)


def parts_of(runs: PlannedRuns, *, long: float) -> IntArray:
    """Return the (k,) number of the part of its run that each stretch lies in; parts of one run are equally long.

    Args:
        runs: in stretches.
        long: that parts are about, or longer where there were too many [mm].
    """
    longer = max(long, float(runs.lengths.sum()) / MOST_PARTS)
    _, run = np.unique(runs.runs, return_inverse=True)
    whole = np.bincount(run, runs.lengths)
    counts = np.maximum(np.floor(whole / longer), 1.0).astype(np.int64)
    within = np.minimum((runs.arcs / whole[run] * counts[run]).astype(np.int64), counts[run] - 1)
    return (np.cumsum(counts) - counts)[run] + within


def _unit(rows: FloatArray) -> FloatArray:
    return rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-12)


@final
@frozen
class PrintShift:
    """By how much a whole print lies beside its plan.

    Attributes:
        by: (3,) in the part's coordinates [mm].
        deviation: standard deviation of its length [mm].
    """

    by: FloatArray
    deviation: float

    def __post_init__(self) -> None:
        freeze_arrays(self, by="float: 3")


def print_shift(
    asides: FloatArray, offsets: FloatArray, runs: IntArray, *, lengths: FloatArray, spacing: float, deviation: float
) -> PrintShift | None:
    """Return by how much a whole print is shifted: least squares of offsets over the directions that they are in.

    Beads that all lie to the left of closed runs are not shifted, nor are those that lie to the left of rows and then
    to the right of others; rows in one direction show nothing of a shift along them.

    Args:
        asides: (k, 3) unit directions to the left of runs, as seen from outside.
        offsets: (k,) of beads to the left [mm].
        runs: (k,) that each is of.
        lengths: (k,) of run that each is the mean of [mm].
        spacing: between neighbouring runs [mm].
        deviation: standard deviation of where the part is thought to be [mm].

    Returns:
        None where no shift explains the offsets, or it is small or uncertain.
    """
    if not offsets.size:
        return None
    weights = lengths / lengths.sum()
    normal = (weights[:, None] * asides).T @ asides
    by = np.asarray(np.linalg.pinv(normal, rcond=SHOWN_DIRECTION) @ (asides.T @ (weights * offsets)), dtype=np.float64)
    before, left = float(weights @ offsets**2), float(weights @ (offsets - asides @ by) ** 2)
    # Offsets along one run are alike.
    own = float(np.hypot(np.sqrt(left / np.unique(runs).size), deviation))
    large = float(np.linalg.norm(by)) > max(NOTABLE_SHIFT * spacing, SURE_SHIFT * own)
    return PrintShift(by, own) if large and left < (1.0 - EXPLAINED) * before else None
