"""Contours fitted to the medial axis: as many beads as fill the width, narrow places, and the lines they become."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, final

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from geoprint.geometry import all_curves, arc_lengths, closest, normals, some_curves, whole_steps
from geoprint.model import (
    BoolArray,
    Contours,
    FloatArray,
    IntArray,
    Paths,
    Surface,
    SurfaceCurves,
    freeze_arrays,
    frozen,
)
from geoprint.toolpath.corners import BACKTRACK, unfolded
from geoprint.toolpath.medial_axis import (
    ALIKE,
    FACING_REACH,
    STEP_SHARE,
    InnerNeighbours,
    Strands,
    bead_counts,
    drawn_out,
    interpolated,
    middles,
    neighbours,
    ridges,
    steps_along,
    strands_of,
    stretches,
)

# The paths that fitted strands become: curves as they were traced, curves moved or cut, and beads along ridges.


# Strands that move by less than this stay as they were traced [spacings].
NEGLIGIBLE = 1e-3
# What is left of a curve at the end of a ridge is its tip where it is shorter than this and its ends are so near.
TIP_LENGTH, TIP_WIDTH = 2.0, 0.75
# What is left between merged stretches goes with them where it is shorter than so many samples.
LEAST_LEFT = 4
# The bead along a ridge goes on to a tip within this reach, and closes where its ends are so near [spacings]; what it
# goes on to lies ahead of its end, within this cosine of its direction.
TIP_REACH, CLOSING, AHEAD = 1.2, 1.0, 0.5
# Elsewhere it goes straight on for so many samples while everything else is farther than this [spacings].
STRAIGHT_SAMPLES, ROOM = 4, 0.95


class MovedStrands(NamedTuple):
    """Strands with k samples where they lie now.

    Attributes:
        strands: where they lay.
        places: (k, 3) samples now [mm].
        merged: (k,) whether a bead along the ridge takes the place of this strand and of the one that faces it.
    """

    strands: Strands
    places: FloatArray
    merged: BoolArray


class DepositedLine(NamedTuple):
    """A line of material.

    Attributes:
        line: (n, 3) places [mm]; the last is the first where it is closed.
        level: of it.
    """

    line: FloatArray
    level: int


def strokes_of(surface: Surface, contours: Contours, moved: MovedStrands, beads: list[DepositedLine]) -> Paths:
    """Return what is left of the strands where they lie now, and the beads along ridges, level by level.

    Args:
        surface: what they lie on.
        contours: the curves that the strands were sampled from.
        moved: the strands.
        beads: along ridges; they go on to the tips of what was merged there.
    """
    stays = _staying(moved)
    left, tips = list[DepositedLine](), list[DepositedLine]()
    for strand in np.flatnonzero(~stays).tolist():
        bent = contours.curves.xyz(surface, strand)
        for bead in _left(moved, strand, bent, level=int(contours.levels[strand])):
            if moved.merged[moved.strands.rows(strand)].any() and _is_tip(bead.line, spacing=contours.spacing):
                tips.append(bead)
            else:
                left.append(bead)
    beside = KDTree(moved.places[~moved.merged])
    drawn, reached = left, set[int]()
    for bead in beads:
        ended, used = _to_the_end(bead, tips, beside, spacing=contours.spacing)
        drawn, reached = [*drawn, ended], reached | used
    # No bead goes on to these, so that they stay.
    drawn += [tip for number, tip in enumerate(tips) if number not in reached]
    levels = np.concatenate([contours.levels[stays], np.array([bead.level for bead in drawn], dtype=np.int64)])
    curves = some_curves(contours.curves, np.flatnonzero(stays))
    if drawn:
        curves = all_curves([curves, landed(surface, [bead.line for bead in drawn])])
    order = np.argsort(levels, kind="stable")
    row = np.repeat(levels[order], np.diff(curves.offsets)[order]).astype(np.float64)
    return Paths(some_curves(curves, order), row, np.full(row.size, contours.spacing), np.ones(row.size))


def _staying(moved: MovedStrands) -> BoolArray:
    """Return the (c,) strands that stay as they were traced."""
    strands = moved.strands
    far = np.linalg.norm(moved.places - strands.places, axis=1) > NEGLIGIBLE * strands.spacing
    return np.bincount(strands.strand, far | moved.merged, minlength=strands.count) == 0


def _left(moved: MovedStrands, strand: int, curve: FloatArray, *, level: int) -> list[DepositedLine]:
    """Return what a strand has become: its traced curve (n, 3) moved [mm], or what is not merged of its samples."""
    strands, held = moved.strands, moved.strands.rows(strand)
    closed, merged, places = bool(strands.closed[strand]), moved.merged[held], moved.places[held]
    if merged.any():
        return [
            DepositedLine(places[each], level) for each in stretches(~merged, closed=closed) if each.size >= LEAST_LEFT
        ]
    arcs, moves, own = strands.arcs[held], places - strands.places[held], arc_lengths(curve)
    if closed:
        arcs, moves = np.append(arcs, own[-1]), np.vstack([moves, moves[:1]])
    bent = curve + interpolated(own, arcs, moves)
    return [DepositedLine(np.vstack([bent[:-1], bent[:1]]) if closed else bent, level)]


def _is_tip(line: FloatArray, *, spacing: float) -> bool:
    """Return whether an open line (n, 3) turns round the end of a ridge."""
    across = float(np.linalg.norm(line[0] - line[-1]))
    return 0.0 < across < TIP_WIDTH * spacing and float(arc_lengths(line)[-1]) < TIP_LENGTH * spacing


def _to_the_end(
    bead: DepositedLine, tips: list[DepositedLine], beside: KDTree, *, spacing: float
) -> tuple[DepositedLine, set[int]]:
    """Return a bead that goes on to tips ahead of its ends, or straight on; closed where its ends face each other.

    Args:
        bead: along a ridge.
        tips: of what was merged; in the middle of each it turns round.
        beside: places of all other strands [mm].
        spacing: of the levels [mm].

    Returns:
        The bead, and which tips it reaches.
    """
    line, reached = bead.line, set[int]()
    for _ in range(2):
        found = _tip_ahead(line, tips, spacing=spacing)
        if found is not None:
            line = np.vstack([line, _turn_of(tips[found])])
            reached.add(found)
        line = line[::-1]
    is_long = float(arc_lengths(line)[-1]) > 4.0 * CLOSING * spacing
    near = np.linalg.norm(line[0] - line[-1]) < CLOSING * spacing
    if is_long and near and _is_ahead(line, line[0]) and _is_ahead(line[::-1], line[-1]):
        return DepositedLine(np.vstack([line, line[:1]]), bead.level), reached
    for _ in range(2):
        line = _straight_on(line, beside, spacing=spacing)[::-1]
    return DepositedLine(line, bead.level), reached


def _tip_ahead(line: FloatArray, tips: list[DepositedLine], *, spacing: float) -> int | None:
    """Return which tip is nearest to the end of a line among those that lie ahead of it; None where none does."""
    away = np.array([float(np.linalg.norm(_turn_of(tip) - line[-1])) for tip in tips])
    ahead = [k for k in range(len(tips)) if away[k] < TIP_REACH * spacing and _is_ahead(line, _turn_of(tips[k]))]
    return min(ahead, key=lambda k: away[k], default=None)


def _turn_of(tip: DepositedLine) -> FloatArray:
    return tip.line[len(tip.line) // 2]


def _is_ahead(line: FloatArray, place: FloatArray) -> bool:
    """Return whether a place lies ahead of the end of a line, so that the line goes on to it without turning back."""
    towards = place - line[-1]
    return float(towards @ _direction(line)) >= AHEAD * float(np.linalg.norm(towards))


def _direction(line: FloatArray) -> FloatArray:
    """Return the (3,) unit vector in which a line ends."""
    ahead = line[-1] - line[max(len(line) - 1 - STRAIGHT_SAMPLES, 0)]
    return ahead / max(float(np.linalg.norm(ahead)), 1e-12)


def _straight_on(line: FloatArray, beside: KDTree, *, spacing: float) -> FloatArray:
    """Return a line that goes on from its last place as far as nothing lies beside it, one spacing at most."""
    ahead = _direction(line)
    steps = np.arange(1, STRAIGHT_SAMPLES + 1) * STEP_SHARE * spacing
    away = np.asarray(beside.query(line[-1] + steps[:, None] * ahead)[0])
    near = np.flatnonzero(away <= ROOM * spacing)
    count = int(near[0]) if near.size else STRAIGHT_SAMPLES
    return line if count == 0 else np.vstack([line, line[-1] + steps[count - 1] * ahead])


def landed(surface: Surface, lines: list[FloatArray]) -> SurfaceCurves:
    """Return lines (n, 3) near a surface as curves on it [mm]; one whose last place is its first is closed."""
    landed, _ = closest(surface, np.concatenate(lines))
    offsets = np.concatenate([[0], np.cumsum([len(line) for line in lines])])
    closed = np.array([np.array_equal(line[0], line[-1]) for line in lines])
    return SurfaceCurves(landed, offsets, closed)


# Level curves fitted to the width that is there.
#
# Across a ridge, from rim to rim, the width holds no whole number of spacings. Every strand on it moves to its share
# of that width, by a few hundredths of a spacing near the rim and up to a quarter at the ridge; where one bead more
# fills the width than level curves cross it, that is laid along the ridge, and where one less does, the two strands
# nearest to the ridge are deposited as one. Where fronts meet at more than about 45 degrees nothing of this is done:
# level curves turn there, and tips are drawn into the corner outside (`corners`).


# Beads become at most so much wider or narrower than nominal.
MOST_STRETCHED = 0.2
# What a bead on a ridge goes back by where pieces overlap is left out as far as that moves it by no more [spacings].
OVERLAPPING = 0.5
# A bead on a ridge ends where anything is nearer than this share of what the strands beside it are.
CLEAR_SHARE = 0.9
# Standard deviation of the window in which moves are smoothed along a strand [spacings].
WINDOW = 0.75
# A stretch of ridge shorter than this is not worth a start [spacings].
LEAST_LENGTH = 2.0
# A bead along a ridge is left out where other strands leave less than this clear for it [spacings].
LEAST_CLEAR = 1.0
# A closed curve that is narrower than this on average is a sliver [spacings].
SLIVER_WIDTH = 0.2
# Without slivers the strands about them face each other across so many spacings.
SLIVER_REACH = FACING_REACH + 2.0 * SLIVER_WIDTH
# A bead replaces a sliver whose points are all so near to it [spacings].
REPLACED = 0.6
# Samples whose middles are within so many spacings lie on the same place of a ridge.
SAME_PLACE = 0.5


@final
@frozen
class _Ridge:
    """One ridge: n samples along it, and how many beads share the width at each, 0 where no bead found room."""

    rows: IntArray
    counts: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, rows="int: n", counts="int: n")

    def without(self, stretch: IntArray) -> _Ridge:
        """Return the ridge without the beads of a stretch, where strands stay as they were traced."""
        counts = self.counts.copy()
        counts[stretch] = 0
        return _Ridge(self.rows, counts)

    def odd(self) -> list[IntArray]:
        """Return the stretches of samples where one bead lies on the ridge itself."""
        return stretches(self.counts % 2 == 1, closed=False)

    def bead(
        self, stretch: IntArray, places: FloatArray, tree: KDTree, beside: InnerNeighbours, *, spacing: float
    ) -> DepositedLine | None:
        """Return the bead that lies on such a stretch; None where it is not worth a start.

        Args:
            stretch: one of `odd`.
            places: (k, 3) of all samples now [mm].
            tree: of them.
            beside: their neighbours.
            spacing: of the levels [mm].
        """
        rows, line = self.rows[stretch], middles(self.rows[stretch], places, beside)
        half = 0.5 * np.linalg.norm(places[rows] - places[beside.facing[rows]], axis=1)
        # At either end a third strand may be nearer than the two that face each other.
        clear = np.flatnonzero(tree.query(line)[0] > CLEAR_SHARE * half)
        onwards = line[clear[0] : clear[-1] + 1] if clear.size else line[:0]
        if len(onwards) < 2 or float(arc_lengths(onwards)[-1]) < LEAST_CLEAR * spacing:
            return None
        # Pieces of a ridge overlap where they were joined: the bead does not go back for that.
        onwards = onwards[unfolded(onwards, turn=BACKTRACK, error=OVERLAPPING * spacing)]
        return DepositedLine(onwards, int(self.counts[stretch[0]] - 1) // 2)


def fitted(surface: Surface, contours: Contours) -> Paths:
    """Return paths made of level curves, fitted to the width across each ridge.

    Args:
        surface: what they lie on.
        contours: c curves of a distance; larger values on their left, seen from outside.

    Returns:
        The paths, level by level; beads along a ridge have the level of the strand that would lie there.
    """
    kept = _without_slivers(surface, contours)
    fit = _fit(surface, kept, reach=FACING_REACH if kept is contours else SLIVER_REACH)
    strands, beside, counts, beads = fit.strands, fit.beside, fit.counts, fit.beads
    moved = drawn_out(strands, fit.places, np.concatenate([np.zeros((0, 3)), *(bead.line for bead in beads)]))
    merged = beside.on_ridge & (counts > 0) & (counts < _crossing(strands.levels))
    return strokes_of(surface, kept, MovedStrands(strands, moved, merged), beads)


class _Fit(NamedTuple):
    """Strands with k samples, their neighbours, the (k,) beads across ridges, (k, 3) places [mm], beads on ridges."""

    strands: Strands
    beside: InnerNeighbours
    counts: IntArray
    places: FloatArray
    beads: list[DepositedLine]


def _fit(surface: Surface, contours: Contours, *, reach: float) -> _Fit:
    """Return strands moved to their share of the width, and the beads along ridges."""
    strands = strands_of(surface, contours)
    beside = neighbours(strands, reach=reach)
    found = [_counted(rows, strands, beside) for rows in ridges(strands, beside)]
    while True:
        counts = _on_both_sides(found, strands, beside)
        shared = strands.places + _moves(counts, strands, beside)
        tree, beads, lost = KDTree(shared), list[DepositedLine](), False
        for at, ridge in enumerate(found):
            for stretch in ridge.odd():
                bead = ridge.bead(stretch, shared, tree, beside, spacing=contours.spacing)
                if bead is not None:
                    beads.append(bead)
                else:
                    # No strand makes way for a bead that does not come.
                    found[at], lost = found[at].without(stretch), True
        if not lost:
            return _Fit(strands, beside, counts, shared, beads)


def _without_slivers(surface: Surface, contours: Contours) -> Contours:
    """Return level curves without slivers that a bead along the ridge replaces.

    Where the width across a ridge is hardly more than an odd number of spacings, errors of the distance decide where
    its last level begins: it comes as slivers, a row of them along the ridge, each with tips of its own.
    """
    curves, spacing = contours.curves, contours.spacing
    slivers = np.array(
        [
            bool(curves.closed[each]) and _is_sliver(curves.xyz(surface, each), spacing=spacing)
            for each in range(curves.count)
        ]
    )
    if not slivers.any() or slivers.all():
        return contours
    beads = _fit(surface, _some(contours, ~slivers), reach=SLIVER_REACH).beads
    if not beads:
        return contours
    tree = KDTree(np.vstack([bead.line for bead in beads]))
    for each in np.flatnonzero(slivers).tolist():
        away, _ = tree.query(curves.xyz(surface, each))
        slivers[each] = float(np.max(away)) < REPLACED * spacing
    return _some(contours, ~slivers) if slivers.any() else contours


def _is_sliver(line: FloatArray, *, spacing: float) -> bool:
    """Return whether a closed curve (n, 3) is narrow on average: its area over half of its length [mm]."""
    ring = line[:-1] - line[0]
    area = 0.5 * float(np.linalg.norm(np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)))
    return area < 0.5 * SLIVER_WIDTH * spacing * float(arc_lengths(line)[-1])


def _some(contours: Contours, chosen: BoolArray) -> Contours:
    """Return chosen level curves."""
    return replace(
        contours, curves=some_curves(contours.curves, np.flatnonzero(chosen)), levels=contours.levels[chosen]
    )


def _crossing(levels: IntArray) -> IntArray:
    """Return how many level curves cross a ridge where strands of these levels face each other."""
    return 2 * (levels + 1)


def _counted(rows: IntArray, strands: Strands, beside: InnerNeighbours) -> _Ridge:
    """Return a ridge with the beads across it; where a bead of its own would be too short, it has none."""
    levels = strands.levels[rows]
    widths = 2.0 * (levels + 0.5 + beside.half[rows] / strands.spacing)
    line = middles(rows, strands.places, beside)
    lengths = steps_along(line, spacing=strands.spacing)
    counts = bead_counts(widths, _crossing(levels) - 1, lengths)
    arcs = arc_lengths(line)
    for stretch in stretches(counts % 2 == 1, closed=False):
        if arcs[stretch[-1]] - arcs[stretch[0]] < LEAST_LENGTH * strands.spacing:
            counts[stretch] = _crossing(levels[stretch])
    return _Ridge(rows, counts)


def _on_both_sides(found: list[_Ridge], strands: Strands, beside: InnerNeighbours) -> IntArray:
    """Return the (k,) beads across the ridge at each sample that lies on one, 0 elsewhere and where strands stay.

    Samples that no ridge counts take the number of one on the same place, also next to a stretch where strands stay.
    """
    counts = np.zeros(strands.levels.size, dtype=np.int64)
    for ridge in found:
        counts[ridge.rows] = ridge.counts
    known, rest = np.flatnonzero(counts), np.flatnonzero(beside.on_ridge & (counts == 0))
    if not known.size or not rest.size:
        return counts
    tree = KDTree(middles(known, strands.places, beside))
    away, nearest = tree.query(middles(rest, strands.places, beside))
    nearest = known[nearest]
    same = (away < SAME_PLACE * strands.spacing) & (strands.levels[nearest] == strands.levels[rest])
    counts[rest[same]] = counts[nearest[same]]
    return counts


def _moves(counts: IntArray, strands: Strands, beside: InnerNeighbours) -> FloatArray:
    """Return how far each sample moves so that beads share the width across the ridge inside of it (k, 3) [mm]."""
    stretched = np.ones(counts.size)
    for level in np.unique(strands.levels)[::-1]:
        rows = np.flatnonzero(strands.levels == level)
        ridge, below = rows[counts[rows] > 0], rows[beside.inside[rows] >= 0]
        widths = 2.0 * (level + 0.5 + beside.half[ridge] / strands.spacing)
        stretched[ridge] = np.clip(widths / counts[ridge], 1.0 - MOST_STRETCHED, 1.0 + MOST_STRETCHED)
        stretched[below] = stretched[beside.inside[below]]
    inwards = (strands.levels + 0.5) * (stretched - 1.0) * strands.spacing
    for strand in range(strands.count):
        held = strands.rows(strand)
        mode = "wrap" if strands.closed[strand] else "nearest"
        inwards[held] = gaussian_filter1d(inwards[held], WINDOW / STEP_SHARE, mode=mode)
    return inwards[:, None] * strands.inward


# Level curves that come near to themselves: where both sides of a finger or a neck are one bead, one bead is drawn.
#
# Two beads w spacings apart cover a strip 0.9 - w wide twice; one bead between them leaves w - 0.2 open beside it.
# Below 0.55 spacings one bead is the more even one, and no tool has to turn on the spot at the tip of a finger.


# Two sides of a curve nearer than this are one bead [spacings]; of a short curve, nearer than this share of its length,
# for a small round ring is not narrow.
NARROW, NARROW_SHARE = 0.6, 0.2
# Sides lie more than this apart along the curve [spacings]; of a short curve, more than this share of its length.
APART, APART_SHARE = 2.0, 0.4
# What is left beyond two sides is the tip of a finger, or the end of an open curve, and no curve of its own, where it
# is not longer than this [spacings].
TIP = 3.0
# Distance of samples [spacings]; a length that is a whole number of them but for rounding has that many.
STEP = 0.05
# Pairs of samples that are so many samples apart, along either side, belong to the same two sides.
SAME_SIDES = 3.0
# A bead between two sides keeps this distance from the curve that closes across its end. Where one along a finger would
# be shorter than this, and no run of its own, the ring begins with it [spacings].
CLEAR, SHORT = 0.5, 1.0


class _Part(NamedTuple):
    """A curve (n, 3) [mm]; a closed one ends where it starts. A bead between two sides is not cut again."""

    line: FloatArray
    closed: bool
    between: bool = False


class _Outline(NamedTuple):
    """A curve (n, 3), its (n,) arcs, and `size` even samples of it from arc `start` on [mm].

    Samples of a closed curve are counted on beyond its end.
    """

    line: FloatArray
    arcs: FloatArray
    closed: bool
    start: float
    size: int

    @property
    def step(self) -> float:
        return float(self.arcs[-1]) / self.size

    def at(self, samples: FloatArray) -> FloatArray:
        """Return the (k, 3) places of (k,) samples, which need not be whole [mm]."""
        arcs = self.start + samples * self.step
        return interpolated(np.mod(arcs, self.arcs[-1]) if self.closed else arcs, self.arcs, self.line)

    def between(self, first: float, last: float) -> FloatArray:
        """Return the curve from one sample to another, with its own points [mm]."""
        own = (self.arcs[: -1 if self.closed else None] - self.start) / self.step
        own = np.mod(own, self.size) if self.closed else own
        own = np.sort(np.concatenate([own, own + self.size]) if self.closed else own)
        inside = own[(own > first) & (own < last)]
        return self.at(np.concatenate([[first], inside, [last]]))


class _Sides(NamedTuple):
    """Samples at which two sides of a curve start and end: along the curve first, end, facing, last.

    The curve goes from `first` to `end`, round to `facing`, which faces `end`, and back to `last`, which faces `first`.
    """

    first: int
    end: int
    facing: int
    last: int


def parted(surface: Surface, curves: SurfaceCurves, *, spacing: float) -> tuple[SurfaceCurves, IntArray, BoolArray]:
    """Return curves without fingers and necks that are too narrow for two beads.

    A finger is cut off where its sides are 0.6 spacings apart, and a bead is drawn along its middle to its tip; where
    that would be shorter than a spacing, the ring starts at the tip, goes round, and ends that far from itself. A ring
    with a neck becomes two, with a bead along the neck; what is narrow everywhere becomes one bead. An open curve whose
    end comes near to its own side ends there.

    Args:
        surface: what they lie on.
        curves: open and closed ones.
        spacing: distance between neighbouring curves [mm].

    Returns:
        c curves, none of which comes near to itself; (c,) which curve each was, or was a part of; and (c,) whether it
        was drawn anew.
    """
    found = [
        _parts(_Part(curves.xyz(surface, curve), bool(curves.closed[curve])), surface, spacing=spacing)
        for curve in range(curves.count)
    ]
    whole = [curve for curve, parts in enumerate(found) if parts is None]
    drawn = [(curve, part) for curve, parts in enumerate(found) for part in parts or ()]
    if not drawn:
        return curves, np.arange(curves.count), np.zeros(curves.count, dtype=np.bool_)
    lines = landed(surface, [part.line for _, part in drawn])
    every = all_curves([some_curves(curves, np.array(whole, dtype=np.int64)), lines])
    origins = np.array([*whole, *(curve for curve, _ in drawn)], dtype=np.int64)
    order = np.argsort(origins, kind="stable")
    return some_curves(every, order), origins[order], order >= len(whole)


def _parts(curve: _Part, surface: Surface, *, spacing: float) -> list[_Part] | None:
    """Return what a curve becomes; None where it stays as it is."""
    waiting, done = [curve], list[_Part]()
    while waiting:
        part = waiting.pop()
        pieces = None if part.between else _cut(part, surface, spacing=spacing)
        waiting += pieces or ()
        done += [part] if pieces is None else []
    return None if len(done) == 1 and done[0] is curve else done


def _cut(part: _Part, surface: Surface, *, spacing: float) -> list[_Part] | None:
    """Return what a curve becomes where it is cut at its longest two sides; None where it has none."""
    arcs = arc_lengths(part.line)
    count = int(whole_steps(arcs[-1], step=STEP * spacing))
    if count < 2:
        return None
    outline = _Outline(part.line, arcs, part.closed, 0.0, count)
    pairs = _near(outline, surface, spacing=spacing)
    if not len(pairs):
        return None
    if part.closed:
        start = _wide(pairs, count)
        outline, pairs = outline._replace(start=start * outline.step), np.sort((pairs - start) % count, axis=1)
    cut = _ring_cut if part.closed else _open_cut
    return cut(outline, _longest(pairs), spacing=spacing)


def _near(outline: _Outline, surface: Surface, *, spacing: float) -> IntArray:
    """Return the (j, 2) pairs of samples that are near to each other, but not along the curve or through a wall."""
    length, count = float(outline.arcs[-1]), outline.size
    narrow, apart = min(NARROW * spacing, NARROW_SHARE * length), min(APART * spacing, APART_SHARE * length)
    places = outline.at(np.arange(count if outline.closed else count + 1, dtype=np.float64))
    pairs = KDTree(places).query_pairs(narrow, output_type="ndarray")
    along = np.abs(pairs[:, 1] - pairs[:, 0])
    along = np.minimum(along, count - along) if outline.closed else along
    pairs = pairs[along * outline.step > apart]
    if not len(pairs):
        return pairs
    # Few samples of a curve are near to others.
    samples, ends = np.unique(pairs, return_inverse=True)
    outward = normals(surface, closest(surface, places[samples])[0])[ends.reshape(pairs.shape)]
    return pairs[np.einsum("jx,jx->j", outward[:, 0], outward[:, 1]) > ALIKE]


def _wide(pairs: IntArray, count: int) -> int:
    """Return the sample in the middle of the longest stretch of a closed curve that is near to nothing."""
    free = np.ones(count, dtype=np.bool_)
    free[pairs] = False
    longest = max(stretches(free, closed=True), key=len, default=np.zeros(1, dtype=np.int64))
    return int(longest[longest.size // 2])


def _longest(pairs: IntArray) -> _Sides:
    """Return the longest two sides that (j, 2) pairs of samples belong to."""
    linked = KDTree(pairs).query_pairs(SAME_SIDES, p=np.inf, output_type="ndarray")
    graph = coo_array((np.ones(len(linked)), (linked[:, 0], linked[:, 1])), shape=(len(pairs), len(pairs)))
    _, label = connected_components(graph, directed=False)
    each = [pairs[label == number] for number in range(int(np.max(label)) + 1)]
    own = max(each, key=lambda sides: int(np.ptp(sides, axis=0).sum()))
    (first, facing), (end, last) = own.min(axis=0).tolist(), own.max(axis=0).tolist()
    return _Sides(first, min(end, facing), facing, last)


def _ring_cut(outline: _Outline, sides: _Sides, *, spacing: float) -> list[_Part]:
    """Return what is left of a ring beyond its sides: two rings and the bead between, a lasso, or that bead alone."""
    beyond = (sides.last, sides.first + outline.size), (sides.end, sides.facing)
    is_tip = [(last - first) * outline.step <= TIP * spacing for first, last in beyond]
    tips = [
        outline.at(np.array([0.5 * (first + last)])) if tip else None
        for (first, last), tip in zip(beyond, is_tip, strict=True)
    ]
    rings = [outline.between(*ends) for ends, tip in zip(beyond, is_tip, strict=True) if not tip]
    bead = _middle(outline, sides, *tips)
    if len(rings) == 1 and float(arc_lengths(bead)[-1]) < (CLEAR + SHORT) * spacing:
        return [_Part(_lasso(bead[::-1] if is_tip[1] else bead, rings[0], spacing=spacing), closed=False)]
    return [_Part(np.vstack([ring, ring[:1]]), closed=True) for ring in rings] + _bead(
        outline, sides, *tips, spacing=spacing
    )


def _lasso(bead: FloatArray, ring: FloatArray, *, spacing: float) -> FloatArray:
    """Return a bead (n, 3) that goes on round a ring (k, 3) from its foot, as far as that stays apart from it [mm]."""
    arcs = arc_lengths(ring)
    even: FloatArray = np.linspace(0.0, float(arcs[-1]), int(whole_steps(arcs[-1], step=STEP * spacing)) + 1)
    places = interpolated(even, arcs, ring)
    start = CLEAR * spacing
    behind = even >= 0.5 * even[-1]
    away = np.asarray(KDTree(np.vstack([bead, places[even <= APART * spacing]])).query(places)[0])
    near = np.flatnonzero(behind & (away < NARROW * spacing))
    end = float(even[near[0] - 1]) if near.size else float(even[-1])
    inside = ring[(arcs > start) & (arcs < end)]
    return np.vstack(
        [bead, interpolated(np.array([start]), arcs, ring), inside, interpolated(np.array([end]), arcs, ring)]
    )


def _open_cut(outline: _Outline, sides: _Sides, *, spacing: float) -> list[_Part]:
    """Return what is left of an open curve without its two sides, and the bead between these."""
    longest = TIP * spacing / outline.step
    is_tip = sides.facing - sides.end <= longest
    middle = 0.5 * (sides.end + sides.facing)
    head, tail = sides.first > longest, outline.size - sides.last > longest
    # A sample beyond both sides none is near.
    inner = (middle, middle) if is_tip else (sides.end + 1.0, sides.facing - 1.0)
    if head != tail:
        # One end lies beside its own curve, and ends before that.
        kept = (0.0, inner[1]) if head else (inner[0], float(outline.size))
        return [_Part(outline.between(*kept), closed=False)]
    parts = list[_Part]()
    if not is_tip:
        line = outline.between(*inner)
        parts.append(_Part(np.vstack([line, line[:1]]) if head else line, closed=head))
    if head:
        ends = [outline.between(0.0, sides.first), outline.between(sides.last, outline.size)]
        parts.append(_Part(np.vstack(ends), closed=False))
    before = None if head else outline.at(np.array([0.5 * sides.first, 0.5 * (sides.last + outline.size)])).mean(axis=0)
    after = outline.at(np.array([middle])) if is_tip else None
    return parts + _bead(outline, sides, before, after, spacing=spacing)


def _bead(
    outline: _Outline, sides: _Sides, before: FloatArray | None, after: FloatArray | None, *, spacing: float
) -> list[_Part]:
    """Return the bead between two sides, none where there is no room for it.

    Args:
        outline: the curve.
        sides: of it.
        before: place from which the bead comes, None where a curve closes across its start [mm].
        after: place to which it goes on, likewise [mm].
        spacing: distance between neighbouring curves [mm].
    """
    line = _middle(outline, sides, before, after)
    arcs = arc_lengths(line)
    first, last = (0.0 if end is not None else CLEAR * spacing for end in (before, after))
    last = float(arcs[-1]) - last
    if last - first <= STEP * spacing:
        return []
    inside = (arcs > first) & (arcs < last)
    bead = interpolated(np.concatenate([[first], arcs[inside], [last]]), arcs, line)
    return [_Part(bead, closed=False, between=True)]


def _middle(outline: _Outline, sides: _Sides, before: FloatArray | None, after: FloatArray | None) -> FloatArray:
    """Return the (n, 3) places in the middle between two sides, and those before and after them [mm]."""
    count = max(sides.end - sides.first, sides.last - sides.facing) + 1
    first = outline.at(np.linspace(sides.first, sides.end, count))
    second = outline.at(np.linspace(sides.last, sides.facing, count))
    middle = 0.5 * (first + second)
    return np.vstack([*([] if before is None else [before]), middle, *([] if after is None else [after])])
