"""Level curves that come near to themselves: where both sides of a finger or a neck are one bead, one bead is drawn.

Two beads w spacings apart cover a strip 0.9 - w wide twice; one bead between them leaves w - 0.2 open beside it. Below
0.55 spacings one bead is the more even one, and no tool has to turn on the spot at the tip of a finger.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfaceCurves
from geoprint.patterns.middle.lines import landed
from geoprint.patterns.middle.ridges import stretches
from geoprint.patterns.middle.strands import interpolated
from geoprint.surfaces import all_curves, arc_lengths, some_curves

# Two sides of a curve nearer than this are one bead [spacings]; of a short curve, nearer than this share of its length,
# for a small round ring is not narrow.
NARROW, NARROW_SHARE = 0.6, 0.2
# Sides lie more than this apart along the curve [spacings]; of a short curve, more than this share of its length.
APART, APART_SHARE = 2.0, 0.4
# What is left beyond two sides is the tip of a finger, or the end of an open curve, and no curve of its own, where it
# is not longer than this [spacings].
TIP = 3.0
# Distance of samples [spacings]; a length that is a whole number of them but for rounding has that many.
STEP, ROUNDING = 0.05, 1e-6
# Pairs of samples that are so many samples apart, along either side, belong to the same two sides.
SAME_SIDES = 3.0
# A bead between two sides keeps this distance from the curve that closes across its end. Where one along a finger would
# be shorter than this, and no run of its own, the ring begins with it [spacings].
CLEAR, SHORT = 0.5, 1.0


class Parted(NamedTuple):
    """What curves became.

    Attributes:
        curves: c of them; none comes near to itself.
        origins: (c,) which curve each was, or was a part of.
        drawn: (c,) whether it was drawn anew.
    """

    curves: SurfaceCurves
    origins: IntArray
    drawn: BoolArray


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


def parted(surface: Surface, curves: SurfaceCurves, *, spacing: float) -> Parted:
    """Return curves without fingers and necks that are too narrow for two beads.

    A finger is cut off where its sides are 0.6 spacings apart, and a bead is drawn along its middle to its tip; where
    that would be shorter than a spacing, the ring starts at the tip, goes round, and ends that far from itself. A ring
    with a neck becomes two, with a bead along the neck; what is narrow everywhere becomes one bead. An open curve whose
    end comes near to its own side ends there.

    Args:
        surface: what they lie on.
        curves: open and closed ones.
        spacing: distance between neighbouring curves [mm].
    """
    found = [
        _parts(_Part(curves.xyz(surface, curve), bool(curves.closed[curve])), spacing=spacing)
        for curve in range(curves.count)
    ]
    whole = [curve for curve, parts in enumerate(found) if parts is None]
    drawn = [(curve, part) for curve, parts in enumerate(found) for part in parts or ()]
    if not drawn:
        return Parted(curves, np.arange(curves.count), np.zeros(curves.count, dtype=np.bool_))
    lines = landed(surface, [part.line for _, part in drawn])
    every = all_curves([some_curves(curves, np.array(whole, dtype=np.int64)), lines])
    origins = np.array([*whole, *(curve for curve, _ in drawn)], dtype=np.int64)
    order = np.argsort(origins, kind="stable")
    return Parted(some_curves(every, order), origins[order], order >= len(whole))


def _parts(curve: _Part, *, spacing: float) -> list[_Part] | None:
    """Return what a curve becomes; None where it stays as it is."""
    waiting, done = [curve], list[_Part]()
    while waiting:
        part = waiting.pop()
        pieces = None if part.between else _cut(part, spacing=spacing)
        waiting += pieces or ()
        done += [part] if pieces is None else []
    return None if len(done) == 1 and done[0] is curve else done


def _cut(part: _Part, *, spacing: float) -> list[_Part] | None:
    """Return what a curve becomes where it is cut at its longest two sides; None where it has none."""
    arcs = arc_lengths(part.line)
    count = int(np.ceil(float(arcs[-1]) / (STEP * spacing) - ROUNDING))
    if count < 2:
        return None
    outline = _Outline(part.line, arcs, part.closed, 0.0, count)
    pairs = _near(outline, spacing=spacing)
    if not len(pairs):
        return None
    if part.closed:
        start = _wide(pairs, count)
        outline, pairs = outline._replace(start=start * outline.step), np.sort((pairs - start) % count, axis=1)
    cut = _ring_cut if part.closed else _open_cut
    return cut(outline, _longest(pairs), spacing=spacing)


def _near(outline: _Outline, *, spacing: float) -> IntArray:
    """Return the (j, 2) pairs of samples that are near to each other but not along the curve."""
    length, count = float(outline.arcs[-1]), outline.size
    narrow, apart = min(NARROW * spacing, NARROW_SHARE * length), min(APART * spacing, APART_SHARE * length)
    places = outline.at(np.arange(count if outline.closed else count + 1, dtype=np.float64))
    pairs = KDTree(places).query_pairs(narrow, output_type="ndarray")
    along = np.abs(pairs[:, 1] - pairs[:, 0])
    along = np.minimum(along, count - along) if outline.closed else along
    return pairs[along * outline.step > apart]


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
    even: FloatArray = np.linspace(0.0, float(arcs[-1]), int(np.ceil(arcs[-1] / (STEP * spacing) - ROUNDING)) + 1)
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
