"""A photographed print held against its plan: how wide each run is, how far beside it, and what is wrong where.

A photograph shows no height, so it cannot tell beads that are flatter all over from ones with more material: what is
usual in the print is stated beside the plan, and a run or a stretch is at fault by how it differs from that. Blur, tone
curve and slant move all edges of a photograph alike, so that widths compare even where none is known in mm. Corners and
places where lines join are no faults: edges there are not those of one straight bead.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias, final

import numpy as np
from scipy import ndimage

from geoprint.errors import InputError, percent
from geoprint.inspection.against_plan import PART_SHARE, WITHIN_STRETCH, PlannedRuns, PrintShift, parts_of, print_shift
from geoprint.inspection.beads import BeadLine
from geoprint.inspection.camera import Camera
from geoprint.inspection.measured import MeasuredStretches
from geoprint.inspection.on_part import SetDistances, apart
from geoprint.inspection.profiles import aside_of
from geoprint.model import BoolArray, FloatArray, IntArray, freeze_arrays, frozen

# Gaps shorter than this, over the spacing, are where a stretch ends beside one.
SHORTEST_GAP_SHARE = 0.3
# A stretch wider than this, over the median of its run, is a blob; narrower than the other, thin; each over so much of
# the spacing at least.
BLOB, THIN, SHORTEST_SHARE = 1.3, 0.7, 0.3
# A blob that touches the next bead shows no edge over so many stretches from each of its ends.
TOUCHES = 3
# A run wider or narrower than is usual in the print by this share, a quarter of its volume, is so over its whole
# length, where that is more than so many standard deviations. Of fewer runs nobody knows which one is at fault.
WHOLE_RUN, SIGNIFICANT, FEWEST_RUNS = 0.12, 2.0, 3
# A run or a part of one is measured where so many of its stretches are.
FEWEST_MEASURED = 3
# Widths compare where noise leaves them known to this share (standard deviation).
COMPARED = 0.15
# Edges that are known worse than this, over the width, are not given (standard deviation), neither are those of beads
# whose flanks are darker than this, over their middle: nobody sees where they end.
WORST_EDGES, LEAST_FLANK = 0.02, 0.25
# A flank is seen where the sight is less aslant than this share of what it falls off by at its foot: else the far edge
# of a bead hides behind its crest.
FLANK_SHARE = 0.7
# A run that bends within so many widths of its bead closes in on itself.
TIGHTEST = 1.0
# Edges that are good by themselves among bad ones are so by chance: of so many stretches around most must be good.
AROUND = 7
# Beads of fewer pixels have no width, since each edge wanders by a fifth of one; a lens in focus blurs by less than the
# other [pixels].
FEWEST_ACROSS, IN_FOCUS = 14.0, 1.5
# A print whose beads are white by this share is overexposed; beads whose blur is this share of their width blurred.
OVEREXPOSED, BLURRED = 0.3, 0.1

WholeRun: TypeAlias = Literal["too wide", "too narrow"]


@final
@dataclass(frozen=True, slots=True)
class RunEstimate:
    """A mean over a run, with its standard deviation [mm]."""

    value: float
    deviation: float


@final
@frozen
class Held:
    """A print, held against its plan.

    Attributes:
        plan: in stretches.
        measured: what the photograph shows of these.
        judged: (k,) which of these the camera sees.
        seen: (k,) on which of these material lies.
        sized: (k,) of which width and offset are known; neither corners nor joints nor what is too uncertain.
        widths: (k,) 0 where they are not [mm].
        offsets: (k,) of the middle, to the left of the run as seen from outside; likewise [mm].
        planned: (k,) width that the flow asks for at the height of the layer [mm].
        relative: (k,) width over the planned one, over what is usual in the print, where widths compare; else 0.
        pose_deviation: of all offsets together, by how well the camera is placed [mm].
        strays: share of the beads farther than the reach from their runs.
        reach: how far from a run its material may lie [mm].
        apart: of the plan, there, and of the print, back, as far as the camera sees [mm].
    """

    plan: PlannedRuns
    measured: MeasuredStretches
    judged: BoolArray
    seen: BoolArray
    sized: BoolArray
    widths: FloatArray
    offsets: FloatArray
    planned: FloatArray
    relative: FloatArray
    pose_deviation: float
    strays: float
    reach: float
    apart: SetDistances

    def __post_init__(self) -> None:
        freeze_arrays(
            self, judged="bool: k", seen="bool: k", sized="bool: k", widths="float: k", offsets="float: k",
            planned="float: k", relative="float: k",
        )  # fmt: skip

    @property
    def even(self) -> FloatArray:
        """(k,) widths over the planned ones, 0 where they are not known."""
        return self.widths / self.planned

    @property
    def usual(self) -> float:
        """Width over the planned one that is usual in the print: the median by length; NaN where nothing is known."""
        return float(np.median(self.even[self.sized])) if self.sized.any() else float("nan")

    def width(self, run: int) -> RunEstimate | None:
        """Return the mean width of a run, None where too little of it is known."""
        return self._mean(run, self.widths, 0)

    def offset(self, run: int) -> RunEstimate | None:
        """Return the mean offset of a run, None where too little of it is known."""
        return self._mean(run, self.offsets, 1)

    def share(self, run: int) -> RunEstimate | None:
        """Return the width of a run over the planned one, over what is usual; None where too little of it compares."""
        rows = self._compared(run)
        if rows.size < FEWEST_MEASURED:
            return None
        widths = self.measured.lefts[rows] - self.measured.rights[rows]
        value = float(np.median(self.relative[rows]))
        return RunEstimate(value, value * float(np.median(self.measured.deviations[rows, 0] / widths)))

    @property
    def comparable(self) -> list[int]:
        """Runs whose widths compare."""
        return [run for run in np.unique(self.plan.runs).tolist() if self._compared(run).size >= FEWEST_MEASURED]

    def whole(self, run: int) -> WholeRun | None:
        """Return what is wrong with a run over its whole length."""
        share = self.share(run)
        if share is None or len(self.comparable) < FEWEST_RUNS:
            return None
        if abs(share.value - 1.0) < max(WHOLE_RUN, SIGNIFICANT * share.deviation):
            return None
        return "too wide" if share.value > 1.0 else "too narrow"

    @property
    def shift(self) -> PrintShift | None:
        """By how much the whole print lies beside its plan; None where it does not."""
        which, plan = self.sized, self.plan
        return print_shift(
            aside_of(plan)[which], self.offsets[which], plan.runs[which], lengths=plan.lengths[which],
            spacing=plan.spacing, deviation=float(np.hypot(self.pose_deviation, self.measured.common[1])),
        )  # fmt: skip

    def gaps(self, run: int) -> list[tuple[float, float]]:
        """Return start and end [mm of arc] of the stretches of a run that are judged and bare."""
        rows = np.flatnonzero(self.plan.runs == run)
        shortest = SHORTEST_GAP_SHARE * self.plan.spacing
        return self._stretches(rows, self.judged[rows] & ~self.seen[rows], shortest=shortest)

    def blobs(self, run: int) -> list[tuple[float, float]]:
        """Return start and end [mm of arc] where a run is much wider than planned, beside the rest."""
        rows = np.flatnonzero(self.plan.runs == run)
        wide = self.relative[rows] > BLOB * self._usual(run)
        within = ndimage.binary_closing(np.pad(wide, TOUCHES), iterations=TOUCHES)[TOUCHES:-TOUCHES]
        wide |= within & self.seen[rows] & (self.relative[rows] == 0.0)
        return self._stretches(rows, wide, shortest=SHORTEST_SHARE * self.plan.spacing)

    def thin(self, run: int) -> list[tuple[float, float]]:
        """Return start and end [mm of arc] where a run is much narrower than planned, beside the rest."""
        rows = np.flatnonzero(self.plan.runs == run)
        narrow = (self.relative[rows] > 0.0) & (self.relative[rows] < THIN * self._usual(run))
        bare = self.judged[rows] & ~self.seen[rows]
        # The end of a bead beside a gap is a part of it.
        narrow &= ~ndimage.binary_dilation(bare, iterations=2)
        return self._stretches(rows, narrow, shortest=SHORTEST_SHARE * self.plan.spacing)

    def estimate(self, rows: IntArray, values: FloatArray, which: int) -> RunEstimate:
        """Return the mean over stretches: of the width (0) or the offset (1), with what stays of its uncertainty.

        What the light on beads leaves open is alike along a run, so that no mean takes it away.
        """
        lengths = self.plan.lengths[rows]
        mean = float((lengths * values[rows]).sum() / lengths.sum())
        own = float(np.median(self.measured.deviations[rows, which]))
        common = float(self.measured.common[which])
        pose = self.pose_deviation if which else 0.0
        return RunEstimate(mean, float(np.sqrt(own**2 + common**2 + pose**2)))

    def _mean(self, run: int, values: FloatArray, which: int) -> RunEstimate | None:
        rows = self._sized(run)
        return self.estimate(rows, values, which) if rows.size >= FEWEST_MEASURED else None

    def _sized(self, run: int) -> IntArray:
        return np.flatnonzero((self.plan.runs == run) & self.sized)

    def _compared(self, run: int) -> IntArray:
        return np.flatnonzero((self.plan.runs == run) & (self.relative > 0.0))

    def _usual(self, run: int) -> float:
        share = self.share(run)
        return float("nan") if share is None else share.value

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
        planned: (k,) width that the flow asks for at the height of the layer, in the mean [mm].
        widths: k of the bead, None where too little of it is known.
        offsets: k of its middle to the left of the run, as seen from outside, likewise.
    """

    runs: IntArray
    starts: FloatArray
    ends: FloatArray
    planned: FloatArray
    widths: tuple[RunEstimate | None, ...]
    offsets: tuple[RunEstimate | None, ...]

    def __post_init__(self) -> None:
        freeze_arrays(self, runs="int: k", starts="float: k", ends="float: k", planned="float: k")


def photographed_parts(held: Held) -> PhotographedParts:
    """Return the mean width and offset along parts of runs, the same parts as scans are measured by."""
    plan = held.plan
    parts, half = parts_of(plan, long=PART_SHARE * plan.spacing), 0.5 * plan.lengths
    firsts = np.flatnonzero(np.diff(parts, prepend=-1))
    lasts = np.append(firsts[1:], parts.size) - 1
    sized = [first + np.flatnonzero(held.sized[first : last + 1]) for first, last in zip(firsts, lasts, strict=True)]
    widths, offsets = (
        tuple(held.estimate(rows, values, which) if rows.size >= FEWEST_MEASURED else None for rows in sized)
        for which, values in enumerate((held.widths, held.offsets))
    )
    return PhotographedParts(
        plan.runs[firsts], plan.arcs[firsts] - half[firsts], plan.arcs[lasts] + half[lasts],
        np.bincount(parts, held.planned) / np.bincount(parts), widths, offsets,
    )  # fmt: skip


def held_against(
    plan: PlannedRuns,
    measured: MeasuredStretches,
    *,
    visible: BoolArray,
    height: float,
    pose_deviation: float = 0.0,
    reach: float | None = None,
) -> Held:
    """Hold a print against its plan.

    Args:
        plan: in stretches.
        measured: what a photograph shows of these.
        visible: (k,) which stretches the camera sees.
        height: of the layer [mm].
        pose_deviation: of places on the part, by how well the camera is placed [mm].
        reach: how far from a run its material may lie [mm]; half the spacing if not given.

    Raises:
        InputError: none of the material lies within reach of the plan.
    """
    within = 0.5 * plan.spacing if reach is None else reach
    widths, offsets = measured.lefts - measured.rights, 0.5 * (measured.lefts + measured.rights)
    # Where a crest is seen before the edge of its bead, nobody sees what lies under it.
    usual = float(np.median(widths[measured.edged])) if measured.edged.any() else np.inf
    visible = visible & (measured.sights * 2.0 * height <= usual)
    there = measured.edged & visible
    near = there & (np.abs(offsets) <= within)
    if there.any() and not near.any():
        raise InputError(
            f"no material lies within {within:.3g} mm of a run of the plan, the nearest is "
            f"{float(np.abs(offsets[there]).min()):.3g} mm away. Check the fiducials, or allow more with `--reach`.",
            nearest_mm=float(np.abs(offsets[there]).min()),
        )
    seen = measured.present & visible & (near | ~there)
    usual = float(np.median(widths[near])) if near.any() else 0.0
    unsure = np.hypot(measured.deviations[:, 0], measured.common[0])
    sized = near & measured.lone & (unsure <= WORST_EDGES * usual) & (measured.flanks >= LEAST_FLANK)
    sized &= ~_aslant(measured, widths, height=height)
    sized &= (plan.radii >= TIGHTEST * usual) & (measured.optics.blur * measured.scale <= BLURRED * usual)
    sized &= _mostly(sized, plan)
    shifts = np.where(near, offsets, 0.0)[:, None] * aside_of(plan)
    # As finely as the plan: the same shares of each stretch one after the other.
    middles = plan.finely(seen) + np.tile(shifts[seen], (len(WITHIN_STRETCH), 1))
    return Held(
        plan, measured, visible, seen, sized, np.where(sized, widths, 0.0), np.where(sized, offsets, 0.0),
        plan.flows / height, _relative(plan, measured, near & measured.lone), pose_deviation,
        float((there & ~near).sum() / max(int(there.sum()), 1)), within, apart(plan.finely(visible), middles),
    )  # fmt: skip


def _mostly(good: BoolArray, plan: PlannedRuns) -> BoolArray:
    """Return (k,) whether most stretches around each one of a run are good."""
    result = np.zeros_like(good)
    for run in np.unique(plan.runs).tolist():
        own = plan.runs == run
        result[own] = ndimage.uniform_filter1d(good[own].astype(np.float64), AROUND, mode="nearest") > 0.5
    return result


def _relative(plan: PlannedRuns, measured: MeasuredStretches, there: BoolArray) -> FloatArray:
    """Return (k,) widths over what the flow asks for, over the median of those of runs; 0 where they do not compare."""
    widths = np.where(there, measured.lefts - measured.rights, 1.0)
    there = there & (measured.deviations[:, 0] <= COMPARED * widths)
    ratios = widths / plan.flows
    runs = [there & (plan.runs == run) for run in np.unique(plan.runs).tolist()]
    medians = [float(np.median(ratios[own])) for own in runs if int(own.sum()) >= FEWEST_MEASURED]
    return np.where(there, ratios / float(np.median(medians)), 0.0) if medians else np.zeros(plan.runs.size)


def doubts(held: Held) -> list[str]:
    """Return what a person should know before the figures are trusted, as sentences without a full stop."""
    found = held.measured
    measurable = found.lone & found.edged & held.judged
    said: list[str] = []
    if found.darker:
        said.append("beads are darker than what they lie on")
    if found.white > OVEREXPOSED:
        said.append(f"{percent(found.white)} of the beads is white: their light there is left out; expose less")
    unknown = 1.0 - float(held.sized.sum() / max(int(measurable.sum()), 1))
    if unknown > 0.1:
        said.append(
            f"width and offset are omitted for {percent(unknown)} of the straight and separate beads, whose edges are "
            f"uncertain by more than {percent(WORST_EDGES)} of a width: {_why_unknown(held, measurable & ~held.sized)}"
        )
    alone = 1.0 - float(((held.relative > 0.0) & measurable).sum() / max(int(measurable.sum()), 1))
    if alone > 0.1:
        said.append(
            f"widths are too noisy to compare for {percent(alone)} of the straight and separate beads, so only gaps "
            "count there: go nearer, or expose more"
        )
    bent = float((held.judged & ~found.lone).sum() / max(int(held.judged.sum()), 1))
    if bent > 0.1:
        said.append(f"only gaps are judged along {percent(bent)} of the plan, at corners and joints")
    if len(held.comparable) < FEWEST_RUNS:
        said.append(_too_few(held))
    if found.alike:
        said.append(f"the plan looks the same if the picture is {found.alike}")
    return said


def _too_few(held: Held) -> str:
    """Return that nobody can tell which run is at fault over its whole length, and of two whether one of them is."""
    shares = [share for share in map(held.share, held.comparable) if share is not None]
    said = (
        "no run is said to be too wide or too narrow over its whole length, since that takes "
        f"{FEWEST_RUNS} runs whose widths compare, found {len(shares)}"
    )
    if len(shares) < 2:
        return said
    wide, narrow = (pick(shares, key=lambda share: share.value) for pick in (max, min))
    more, sure = wide.value / narrow.value - 1.0, float(np.hypot(wide.deviation, narrow.deviation))
    if more < max(WHOLE_RUN, SIGNIFICANT * sure):
        return said
    return f"{said}; beside the plan one of these is {percent(more)} wider than the other, so one is at fault"


def _aslant(measured: MeasuredStretches, widths: FloatArray, *, height: float) -> BoolArray:
    """Return where the far edge of a bead, a parabola of this height, may hide behind its crest."""
    return np.asarray(measured.sights * 4.0 * height > FLANK_SHARE * widths)


def _why_unknown(held: Held, unknown: BoolArray) -> str:
    """Return the commonest reason for which edges are not known, and what to do."""
    found, plan = held.measured, held.plan
    widths = found.lefts - found.rights
    usual, blur = float(np.median(widths[found.edged])), found.optics.blur
    across, blurred = usual / found.scale, blur * found.scale > BLURRED * usual
    if blurred and blur > IN_FOCUS:
        return f"the picture is blurred by {blur:.2g} pixels, and beads are {across:.0f} wide; focus, or go nearer"
    if blurred or across < FEWEST_ACROSS:
        return f"beads are only {across:.0f} pixels wide; go nearer, or photograph a part of the print"
    if found.white > OVEREXPOSED:
        return "beads are overexposed; expose less"
    aslant = _aslant(found, widths, height=float(np.median(plan.flows / held.planned)))
    dark = ~aslant & (found.flanks < LEAST_FLANK)
    tone = (
        "blur and tone curve are not known well enough; show the rim of the part on another ground"
        if found.common[0] > WORST_EDGES * usual
        else "edges are noisy or lie among such; expose more, or go nearer"
    )
    shares = {
        "beads are seen at an angle, with one edge hidden behind the crest; look straight down on them": aslant,
        "one flank of the beads is as dark as what they lie on; light the print from where the camera stands": dark,
        tone: ~aslant & ~dark,
    }
    return max(shares, key=lambda why: int((shares[why] & unknown).sum()))


def bead_lines(held: Held, camera: Camera) -> tuple[BeadLine, ...]:
    """Return the beads along the runs, as the photograph shows them, the longest first.

    Args:
        held: a print.
        camera: that took the photograph.
    """
    plan, found = held.plan, held.measured
    there = held.seen & found.edged
    aside = aside_of(plan)
    lines: list[BeadLine] = []
    for run in np.unique(plan.runs).tolist():
        own = np.flatnonzero((plan.runs == run) & held.judged)
        if own.size < 2 or not there[own].any():
            continue
        lefts, rights = (np.where(there, values, 0.0)[own, None] * aside[own] for values in (found.lefts, found.rights))
        places = plan.places[own]
        middles, left, right = (camera.seen(places + off) for off in (0.5 * (lefts + rights), lefts, rights))
        lines.append(BeadLine(middles, left, right, there[own], closed=False))
    return tuple(sorted(lines, key=lambda line: -line.length))
