"""A print held against its plan: what lies along each run, how wide, how far beside it, and what is missing.

Every place of a bead belongs to the nearest place of the plan, if that is within reach. Along a run the places that
belong to a stretch of it are its material; a stretch that the camera sees and nothing belongs to is a gap.
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree

from geoprint.appraisal.distances import SetDistances, apart
from geoprint.appraisal.on_part import PlacedBeads
from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, IntArray, PoseStream, freeze_arrays, frozen

# Stretches of a run are so long, over the spacing of the plan: shorter than any fault that matters.
STRETCH_SHARE = 0.2
# Distances are measured from so many places of a stretch, by shares of its length from its middle.
WITHIN_STRETCH = (-0.5, -0.25, 0.0, 0.25, 0.5)
# Ends and middle of a stretch, by shares of its length from there, and their weights in its mean.
SIMPSON = ((-0.5, 1.0 / 6.0), (0.0, 4.0 / 6.0), (0.5, 1.0 / 6.0))
# Material lies on a stretch where it lies on so much of it.
COVERED_SHARE = 0.5
# A bead that rounds a corner of its run leaves out no more of it than this, over the spacing.
LONGEST_PASS_SHARE = 1.5
# Gaps shorter than this, over the spacing, are where two stretches part the places of one bead.
SHORTEST_GAP_SHARE = 0.3
# A bead wider than this, over the median of its run, is a blob; narrower than the other, thin.
BLOB, THIN = 1.3, 0.7
# Where a plan lays next to nothing, widths are over this share of its usual flow.
LEAST_SHARE = 0.2
# A run that bends within this many widths of its bead closes in on itself, and is no line in a photograph; a corner,
# which turns by less than a half circle as wide as the spacing, is one.
TIGHTEST = 2.0
# Parts of a run that are judged, over the spacing, and how many at most.
PART_SHARE, MOST_PARTS = 2.0, 2000
# A part is seen where so much of it, and so many of its stretches, show material; so many of these are alike, and no
# mean is known better than this [mm].
SEEN_SHARE, LEAST_STRETCHES, ALIKE_STRETCHES, LEAST_DEVIATION = 0.5, 3, 4.0, 0.01
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
        flows: (k,) volume that is laid per length [mm2].
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


@final
@frozen
class Held:
    """A print, held against its plan.

    Attributes:
        plan: in stretches.
        judged: (k,) which of these the camera sees, and the run does not bend too tightly to be told apart.
        seen: (k,) on which of these material lies.
        widths: (k,) of it, 0 where there is none [mm].
        offsets: (k,) of its middle, to the left of the run as seen from outside; 0 where there is none [mm].
        strays: (j, 3) places of beads that are no run's [mm].
        reach: how far from a run its material may lie [mm].
        apart: of the plan, there, and of the print, back, as far as the camera sees [mm].
    """

    plan: PlannedRuns
    judged: BoolArray
    seen: BoolArray
    widths: FloatArray
    offsets: FloatArray
    strays: FloatArray
    reach: float
    apart: SetDistances

    def __post_init__(self) -> None:
        freeze_arrays(
            self, judged="bool: k", seen="bool: k", widths="float: k", offsets="float: k", strays="float: j 3"
        )

    @property
    def even(self) -> FloatArray:
        """(k,) widths over what share of the usual flow the plan lays there: those of a bead as wide as it shall be."""
        return self.widths / np.maximum(self.plan.flows / np.median(self.plan.flows), LEAST_SHARE)

    def gaps(self, run: int) -> list[tuple[float, float]]:
        """Return start and end [mm of arc] of the stretches of a run that are judged and bare."""
        rows = np.flatnonzero(self.plan.runs == run)
        shortest = SHORTEST_GAP_SHARE * self.plan.spacing
        return self._stretches(rows, self.judged[rows] & ~self.seen[rows], shortest=shortest)

    def blobs(self, run: int) -> list[tuple[float, float]]:
        """Return start and end [mm of arc] where a run is much wider than planned, beside the rest."""
        rows = np.flatnonzero(self.plan.runs == run)
        return self._stretches(rows, self.even[rows] > BLOB * self._usual(rows))

    def thin(self, run: int) -> list[tuple[float, float]]:
        """Return start and end [mm of arc] where a run is much narrower than planned, beside the rest."""
        rows = np.flatnonzero(self.plan.runs == run)
        return self._stretches(rows, self.seen[rows] & (self.even[rows] < THIN * self._usual(rows)))

    def _usual(self, rows: IntArray) -> float:
        there = self.even[rows][self.seen[rows]]
        return float(np.median(there)) if there.size else np.inf

    def _stretches(self, rows: IntArray, marked: BoolArray, *, shortest: float = 0.0) -> list[tuple[float, float]]:
        labels, count = ndimage.label(marked)
        half = 0.5 * self.plan.lengths[rows]
        arcs = self.plan.arcs[rows]
        found: list[tuple[float, float]] = []
        for number in range(1, count + 1):
            members = np.flatnonzero(labels == number)
            first, last = int(members[0]), int(members[-1])
            start, end = float(arcs[first] - half[first]), float(arcs[last] + half[last])
            if end - start >= shortest:
                found.append((start, end))
        return found


@final
@frozen
class PhotographedParts:
    """What a photograph shows of k parts of runs, each about two spacings long.

    Attributes:
        runs: (k,) as poses.csv counts them.
        starts: (k,) arc length at which each begins [mm].
        ends: (k,) arc length at which it ends [mm].
        seen: (k,) whether enough of it is seen; where not, what is measured is 0.
        widths: (k,) of the bead, in the mean [mm].
        width_deviations: (k,) standard deviation of that [mm].
        flows: (k,) volume that is laid per length by the plan, in the mean [mm2].
        offsets: (k,) of the bead's middle to the left of the run, as seen from outside [mm].
        offset_deviations: (k,) standard deviation of that [mm].
    """

    runs: IntArray
    starts: FloatArray
    ends: FloatArray
    seen: BoolArray
    widths: FloatArray
    width_deviations: FloatArray
    flows: FloatArray
    offsets: FloatArray
    offset_deviations: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, runs="int: k", starts="float: k", ends="float: k", seen="bool: k", widths="float: k",
            width_deviations="float: k", flows="float: k", offsets="float: k", offset_deviations="float: k",
        )  # fmt: skip


def photographed_parts(held: Held) -> PhotographedParts:
    """Return the mean width and offset along parts of runs, each of the stretches that show material."""
    plan = held.plan
    parts = parts_of(plan, long=PART_SHARE * plan.spacing)
    firsts = np.flatnonzero(np.diff(parts, prepend=-1))
    lasts, count = np.append(firsts[1:], parts.size) - 1, firsts.size
    there, half = np.bincount(parts[held.seen], minlength=count), 0.5 * plan.lengths
    seen = there >= np.maximum(SEEN_SHARE * np.bincount(parts), LEAST_STRETCHES)

    def mean(values: FloatArray) -> tuple[FloatArray, FloatArray]:
        middle = np.bincount(parts[held.seen], values[held.seen], minlength=count) / np.maximum(there, 1)
        off = np.bincount(parts[held.seen], ((values - middle[parts]) ** 2)[held.seen], minlength=count)
        spread = np.sqrt(off / np.maximum(there - 1, 1))
        # Neighbouring stretches are alike.
        deviation = np.maximum(spread / np.sqrt(np.maximum(there / ALIKE_STRETCHES, 1.0)), LEAST_DEVIATION)
        return np.where(seen, middle, 0.0), np.where(seen, deviation, 0.0)

    return PhotographedParts(
        plan.runs[firsts], plan.arcs[firsts] - half[firsts], plan.arcs[lasts] + half[lasts], seen,
        *mean(held.widths), np.bincount(parts, plan.flows) / np.bincount(parts), *mean(held.offsets),
    )  # fmt: skip


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
        raise InputError("the plan deposits nothing, so that no print can be held against it.")
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


def held_against(plan: PlannedRuns, placed: PlacedBeads, *, visible: BoolArray, reach: float | None = None) -> Held:
    """Hold a print against its plan.

    Args:
        plan: in stretches.
        placed: beads of a photograph on the part.
        visible: (k,) which stretches the camera sees.
        reach: how far from a run its material may lie [mm]; half the spacing if not given.

    Raises:
        InputError: the camera sees nothing of the plan, or none of the material lies within reach of it.
    """
    within = 0.5 * plan.spacing if reach is None else reach
    if not visible.any():
        raise InputError("the camera sees no run of the plan; check the fiducials, and that the plan is of this part.")
    found, owners = KDTree(plan.places).query(placed.middles)
    distances, nearest = np.asarray(found), np.asarray(owners)
    owned = distances <= within
    if not owned.any():
        raise InputError(
            f"no material lies within {within:.3g} mm of a run of the plan, the nearest is {distances.min():.3g} mm "
            "away; check the fiducials, or allow more with `--reach`.",
            nearest_mm=float(distances.min()),
        )
    judged = visible & (plan.radii >= TIGHTEST * float(np.median(placed.widths[owned])))
    if not judged.any():
        raise InputError(
            f"the runs in sight all bend within {TIGHTEST:g} widths of their bead, so that no line can be told apart; "
            "print thinner, or larger."
        )
    there, widths, offsets = _material(plan, placed, nearest, owned)
    seen = there & judged
    return Held(
        plan, judged, seen, np.where(seen, widths, 0.0), np.where(seen, offsets, 0.0), placed.middles[~owned], within,
        apart(plan.finely(judged), placed.middles),
    )  # fmt: skip


def _material(
    plan: PlannedRuns, placed: PlacedBeads, nearest: IntArray, owned: BoolArray
) -> tuple[BoolArray, FloatArray, FloatArray]:
    """Return on which (k,) stretches material lies, how wide, and how far to the left [mm]."""
    count = len(plan.places)
    own = nearest[owned]
    aside = np.cross(plan.normals, plan.ahead)
    sideways = ((placed.middles[owned] - plan.places[own]) * aside[own]).sum(axis=1)
    per = np.maximum(np.bincount(own, minlength=count), 1)
    widths = np.bincount(own, placed.widths[owned], minlength=count) / per
    offsets = np.bincount(own, sideways, minlength=count) / per
    there = np.bincount(own, placed.steps[owned], minlength=count) > COVERED_SHARE * plan.lengths
    on_both_sides = np.zeros((2, count), dtype=np.bool_)
    for first, last in _passed(plan, placed, nearest, owned):
        on_both_sides[0, first] = on_both_sides[1, last] = True
        there[first + 1 : last] = True
        for values in (widths, offsets):
            values[first : last + 1] = np.linspace(values[first], values[last], last - first + 1)
    return there | on_both_sides.all(axis=0), widths, offsets


def _passed(plan: PlannedRuns, placed: PlacedBeads, nearest: IntArray, owned: BoolArray) -> list[tuple[int, int]]:
    """Return each two stretches of a run, the lower first, from one of which a bead goes straight on to the other.

    Between them it passes what it is nearest to nowhere, as at a corner; such stretches, and those that it goes on from
    in both directions, it covers however little of it is nearest to them.
    """
    before, behind = nearest[:-1], nearest[1:]
    jump = np.abs(behind - before)
    longest = round(LONGEST_PASS_SHARE / STRETCH_SHARE)
    joined = placed.joined & owned[:-1] & owned[1:] & (plan.runs[before] == plan.runs[behind])
    rows = np.flatnonzero(joined & (jump > 0) & (jump <= longest))
    pairs = np.sort(np.column_stack([before[rows], behind[rows]]), axis=1)
    return [(int(first), int(last)) for first, last in np.unique(pairs, axis=0)]


def _unit(rows: FloatArray) -> FloatArray:
    return rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-12)
