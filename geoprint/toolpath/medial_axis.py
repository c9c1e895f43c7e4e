"""The medial axis: level curves fitted where fronts meet, so that no seam stays open or is covered twice."""

from __future__ import annotations

from itertools import pairwise
from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.geometry import arc_lengths, normals, positions, whole_steps
from geoprint.model import (
    GAP_SHARE,
    OVERLAP_SHARE,
    BoolArray,
    Contours,
    FloatArray,
    IntArray,
    Surface,
    freeze_arrays,
    frozen,
)

# Level curves as strands: samples a quarter of a spacing apart that know which side is inwards.


# Distance of samples over the spacing, and fewest samples of a strand.
STEP_SHARE = 0.25
FEWEST_SAMPLES = 4


@final
@frozen
class Strands:
    """Level curves sampled evenly, one strand a curve.

    Attributes:
        places: (k, 3) samples, strand after strand; of a closed one the first is not repeated [mm].
        normals: (k, 3) outward unit normals of the surface.
        inward: (k, 3) unit vectors on the surface, square to the strand, towards larger distance.
        arcs: (k,) arc length from the start of the strand [mm].
        strand: (k,) which strand a sample lies on.
        levels: (k,) level of the strand.
        offsets: (c + 1,) strand i has the samples from `offsets[i]` to before `offsets[i + 1]`.
        closed: (c,) whether each is closed.
        lengths: (c,) of each [mm].
        spacing: of the levels [mm].
    """

    places: FloatArray
    normals: FloatArray
    inward: FloatArray
    arcs: FloatArray
    strand: IntArray
    levels: IntArray
    offsets: IntArray
    closed: BoolArray
    lengths: FloatArray
    spacing: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self, places="float: k 3", normals="float: k 3", inward="float: k 3", arcs="float: k", strand="int: k",
            levels="int: k", offsets="int: o", closed="bool: c", lengths="float: c",
        )  # fmt: skip

    @property
    def count(self) -> int:
        """Number of strands c."""
        return int(self.closed.size)

    def rows(self, strand: int) -> slice:
        """Return the rows of a strand's samples."""
        return slice(int(self.offsets[strand]), int(self.offsets[strand + 1]))

    def further(self, rows: IntArray, steps: int) -> IntArray:
        """Return the rows so many samples further along their strands; at the ends of an open one it ends."""
        strand = self.strand[rows]
        first, size = self.offsets[strand], np.diff(self.offsets)[strand]
        place = rows - first + steps
        return first + np.where(self.closed[strand], place % size, np.clip(place, 0, size - 1))


def strands_of(surface: Surface, contours: Contours) -> Strands:
    """Sample level curves.

    Args:
        surface: what they lie on.
        contours: c curves.

    Returns:
        As many strands.
    """
    places, outward = positions(surface, contours.curves.points), normals(surface, contours.curves.points)
    parts = list[tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]]()
    for number in range(contours.curves.count):
        held = slice(*contours.curves.offsets[number : number + 2])
        closed = bool(contours.curves.closed[number])
        parts.append(_sampled(places[held], outward[held], closed=closed, step=STEP_SHARE * contours.spacing))
    sizes = [len(part[0]) for part in parts]
    return Strands(
        places=np.concatenate([part[0] for part in parts]),
        normals=np.concatenate([part[1] for part in parts]),
        inward=np.concatenate([part[2] for part in parts]),
        arcs=np.concatenate([part[3] for part in parts]),
        strand=np.repeat(np.arange(len(parts)), sizes),
        levels=np.repeat(contours.levels, sizes),
        offsets=np.concatenate([[0], np.cumsum(sizes)]),
        closed=contours.curves.closed,
        lengths=np.array([part[4] for part in parts]),
        spacing=contours.spacing,
    )


def _sampled(
    line: FloatArray, outward: FloatArray, *, closed: bool, step: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
    """Return places, normals, inward directions and arcs of even samples along a polyline (n, 3), and its length."""
    arcs = arc_lengths(line)
    length = float(arcs[-1])
    count = max(int(whole_steps(length, step=step)), FEWEST_SAMPLES)
    even: FloatArray = np.linspace(0.0, length, count + 1)[: count if closed else count + 1]
    places, up = interpolated(even, arcs, line), _unit(interpolated(even, arcs, outward))
    before, behind = (np.roll(places, 1, axis=0), np.roll(places, -1, axis=0)) if closed else _ends_repeated(places)
    return places, up, _unit(np.cross(up, behind - before)), even, length


def interpolated(at: FloatArray, arcs: FloatArray, values: FloatArray) -> FloatArray:
    """Return vectors (n, 3) that are linear along an arc, at (k,) places of it."""
    return np.column_stack([np.interp(at, arcs, values[:, axis]) for axis in range(3)])


def _ends_repeated(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.vstack([places[:1], places[:-1]]), np.vstack([places[1:], places[-1:]])


def _unit(vectors: FloatArray) -> FloatArray:
    """Return vectors (k, 3) of length 1; those of no length stay."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)


# What lies beside a strand on its inner side: the strand that faces it across a ridge, or the next level.
#
# A ridge is where fronts meet: there the distance has its largest values, and the strands of one level face each
# other. InnerNeighbours are found through the air; within two spacings that is the distance over the surface but for
# folds and thin walls, which normals tell.


# Two strands face each other across at most so many spacings: between them no level has room.
FACING_REACH = 2.1
# The next level is nearer than so many spacings.
NEXT_REACH = 1.3
# Least cosine between the line to a neighbour and the inward direction: it lies ahead.
AHEAD = 0.8
# Least cosine between inward directions, or the opposite of one, of strands side by side; and between the normals of
# two that face each other, or are two sides of a finger.
ALIKE = 0.7


@final
@frozen
class InnerNeighbours:
    """The inner neighbours of strands with k samples.

    Attributes:
        facing: (k,) sample that faces each across a ridge, -1 for none.
        half: (k,) half the distance to it, 0 for none [mm].
        inside: (k,) sample of the next level inside, -1 for none, or where a strand that faces is nearer.
    """

    facing: IntArray
    half: FloatArray
    inside: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, facing="int: k", half="float: k", inside="int: k")

    @property
    def on_ridge(self) -> BoolArray:
        """(k,) whether a sample faces another one across a ridge."""
        return self.facing >= 0


def neighbours(strands: Strands, *, reach: float = FACING_REACH) -> InnerNeighbours:
    """Find the inner neighbour of each sample of the strands; two that face are no more than `reach` spacings apart."""
    facing, across = _facing(strands, reach=reach)
    inside, away = _inside(strands)
    ridge = (facing >= 0) & (across < away)
    return InnerNeighbours(np.where(ridge, facing, -1), np.where(ridge, 0.5 * across, 0.0), np.where(ridge, -1, inside))


def _facing(strands: Strands, *, reach: float) -> tuple[IntArray, FloatArray]:
    """Return the nearest sample of the same level that faces each, -1 for none, and the (k,) distance to it [mm]."""
    count = strands.levels.size
    found, away = np.full(count, -1), np.full(count, np.inf)
    for level in np.unique(strands.levels):
        rows = np.flatnonzero(strands.levels == level)
        pairs = KDTree(strands.places[rows]).query_pairs(reach * strands.spacing, output_type="ndarray")
        first, second = rows[np.vstack([pairs, pairs[:, ::-1]])].T
        length, ahead, behind = _seen(strands, first, second)
        alike = np.einsum("kx,kx->k", strands.inward[first], strands.inward[second])
        facing = (ahead > AHEAD * length) & (behind > AHEAD * length) & (alike < -ALIKE)
        # Beyond a thin wall or a sharp fold normals differ.
        facing &= np.einsum("kx,kx->k", strands.normals[first], strands.normals[second]) > ALIKE
        first, second, length = first[facing], second[facing], length[facing]
        # The nearest one of each is written last.
        farthest_first = np.argsort(-length, kind="stable")
        found[first[farthest_first]] = second[farthest_first]
        away[first[farthest_first]] = length[farthest_first]
    return found, away


def _inside(strands: Strands) -> tuple[IntArray, FloatArray]:
    """Return the nearest sample of the next level where it lies inwards of each, -1 for none, and its distance [mm]."""
    count = strands.levels.size
    found, away = np.full(count, -1), np.full(count, np.inf)
    for level in np.unique(strands.levels):
        rows, following = (np.flatnonzero(strands.levels == number) for number in (level, level + 1))
        if not following.size:
            continue
        reach = NEXT_REACH * strands.spacing
        distances, nearest = KDTree(strands.places[following]).query(strands.places[rows], distance_upper_bound=reach)
        reached = np.isfinite(distances)
        first, second = rows[reached], following[np.asarray(nearest, dtype=np.int64)[reached]]
        length, ahead, _ = _seen(strands, first, second)
        alike = np.einsum("kx,kx->k", strands.inward[first], strands.inward[second])
        beside = (ahead > AHEAD * length) & (alike > ALIKE)
        found[first[beside]], away[first[beside]] = second[beside], length[beside]
    return found, away


def _seen(strands: Strands, first: IntArray, second: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the lengths of lines between samples, and their parts along the inward directions at either end [mm]."""
    line = strands.places[second] - strands.places[first]
    ahead = np.einsum("kx,kx->k", line, strands.inward[first])
    return np.linalg.norm(line, axis=1), ahead, -np.einsum("kx,kx->k", line, strands.inward[second])


# Ridges from end to end: lines of samples, each with the one that faces it, through the tips of the levels between.


# From one sample to the next the one that faces goes on by at most so many spacings, or the ridge branches there.
LARGEST_STEP = 1.25
# Beyond the tip of the next level a ridge goes on within so many spacings; and where nothing is between, within these.
PAST_TIP = 1.6
PAST_GAP = 1.0
# At a tip strands of the level outside are so far apart, over two spacings, and those of the level inside so near.
WIDE, NARROW = 0.6, 0.5
# Where nothing is between, half the distance across differs by less than so many spacings.
LIKE = 0.3
# A ridge does not turn back where it goes on: the cosine between the directions in which two ends leave their pieces,
# over so many samples, is at most this.
TURNING_BACK, DIRECTION_SAMPLES = 0.5, 4


def ridges(strands: Strands, beside: InnerNeighbours) -> list[IntArray]:
    """Return the ridges: for each the rows of samples in order along it, of one of the two strands that face.

    Args:
        strands: with k samples.
        beside: their neighbours.
    """
    pieces = _pieces(strands, beside)
    return _joined(pieces, strands, beside)


def middles(rows: IntArray, places: FloatArray, beside: InnerNeighbours) -> FloatArray:
    """Return the (n, 3) middles between samples and those that face them [mm].

    Args:
        rows: n samples on a ridge.
        places: (k, 3) of all samples [mm].
        beside: their neighbours.
    """
    return 0.5 * (places[rows] + places[beside.facing[rows]])


def stretches(chosen: BoolArray, *, closed: bool) -> list[IntArray]:
    """Return the indices of each unbroken row of True, in order; round the end of a closed line.

    Examples:
        >>> [each.tolist() for each in stretches(np.array([True, False, True, True]), closed=True)]
        [[2, 3, 0]]
    """
    if chosen.all():
        return [np.arange(chosen.size)] if chosen.size else []
    start = int(np.argmin(chosen)) if closed else 0
    turned = np.roll(chosen, -start).astype(np.int64)
    steps = np.diff(np.concatenate([[0], turned, [0]]))
    bounds = zip(np.flatnonzero(steps == 1).tolist(), np.flatnonzero(steps == -1).tolist(), strict=True)
    return [(np.arange(first, behind) + start) % chosen.size for first, behind in bounds]


def _pieces(strands: Strands, beside: InnerNeighbours) -> list[IntArray]:
    """Return unbroken pieces of ridges, the longest first, none of which is seen from both sides."""
    found = list[IntArray]()
    for strand in range(strands.count):
        held = strands.rows(strand)
        for stretch in stretches(beside.on_ridge[held], closed=bool(strands.closed[strand])):
            rows = stretch + held.start
            opposite = strands.places[beside.facing[rows]]
            jumps = np.linalg.norm(np.diff(opposite, axis=0), axis=1) > LARGEST_STEP * strands.spacing
            # Round the tip of a level a strand faces itself: its ridge runs to the tip once, and not back.
            jumps |= np.diff(_is_behind(rows, beside.facing[rows]).astype(np.int64)) > 0
            found += np.split(rows, np.flatnonzero(jumps) + 1)
    taken = np.zeros(strands.levels.size, dtype=bool)
    kept = list[IntArray]()
    for rows in sorted(found, key=len, reverse=True):
        for stretch in stretches(~taken[rows], closed=False):
            if stretch.size < 2:
                continue
            own = rows[stretch]
            for side in (own, beside.facing[own]):
                for step in (-1, 0, 1):
                    taken[strands.further(side, step)] = True
            kept.append(own)
    return kept


def _is_behind(rows: IntArray, facing: IntArray) -> BoolArray:
    """Return whether each of some rows comes after what it faces among them; not where it faces none of them."""
    order = dict(zip(rows.tolist(), range(rows.size), strict=True))
    return np.array([order.get(faced, rows.size) < own for own, faced in enumerate(facing.tolist())], dtype=np.bool_)


def _joined(pieces: list[IntArray], strands: Strands, beside: InnerNeighbours) -> list[IntArray]:
    """Join pieces end to end, nearest first. End 2 i is where piece i starts, end 2 i + 1 where it ends."""
    partner = dict[int, int]()
    for first, second in _nearest_first(pieces, strands, beside):
        if first not in partner and second not in partner and not _is_joined(first, second, partner):
            partner[first], partner[second] = second, first
    done, lines = set[int](), list[IntArray]()
    for start in range(2 * len(pieces)):
        if start in partner or start // 2 in done:
            continue
        ends = _from(start, partner)
        done.update(end // 2 for end in ends)
        lines.append(np.concatenate([pieces[end // 2][:: -1 if end % 2 else 1] for end in ends]))
    return lines


def _from(start: int, partner: dict[int, int]) -> list[int]:
    """Return the ends at which each piece is entered, from a free end on."""
    ends = [start]
    while ends[-1] ^ 1 in partner:
        ends.append(partner[ends[-1] ^ 1])
    return ends


def _is_joined(first: int, second: int, partner: dict[int, int]) -> bool:
    """Return whether two free ends belong to one line already."""
    return _from(first, partner)[-1] ^ 1 == second


def _nearest_first(pieces: list[IntArray], strands: Strands, beside: InnerNeighbours) -> list[tuple[int, int]]:
    """Return pairs of ends between which a ridge goes on, the nearest first."""
    if not pieces:
        return []
    rows = np.concatenate([piece[[0, -1]] for piece in pieces])
    places, levels, halves = middles(rows, strands.places, beside), strands.levels[rows], beside.half[rows]
    spacing, number = strands.spacing, np.arange(rows.size) // 2
    away = np.linalg.norm(places[:, None] - places, axis=2)
    tip = (levels[:, None] + 1 == levels) & (halves[:, None] > WIDE * spacing) & (halves < NARROW * spacing)
    gap = (levels[:, None] == levels) & (np.abs(halves[:, None] - halves) < LIKE * spacing)
    near = (tip & (away < PAST_TIP * spacing)) | (gap & (away < PAST_GAP * spacing))
    outwards = np.concatenate([_outwards(piece, strands, beside) for piece in pieces])
    near &= outwards @ outwards.T <= TURNING_BACK
    first, second = np.nonzero(near & (number[:, None] != number))
    order = np.argsort(away[first, second], kind="stable")
    return list(zip(first[order].tolist(), second[order].tolist(), strict=True))


def _outwards(piece: IntArray, strands: Strands, beside: InnerNeighbours) -> FloatArray:
    """Return the (2, 3) unit vectors in which a piece of a ridge starts and ends, both away from it."""
    line = middles(piece, strands.places, beside)
    reach = min(DIRECTION_SAMPLES, len(line) - 1)
    vectors = np.stack([line[0] - line[reach], line[-1] - line[-1 - reach]])
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), np.finfo(np.float64).tiny)


def steps_along(line: FloatArray, *, spacing: float) -> FloatArray:
    """Return the length that each of (n, 3) places along a line stands for [spacings]; over joints no more than one."""
    ahead = np.linalg.norm(np.diff(line, axis=0), axis=1)
    pairs = list(pairwise(np.concatenate([[0.0], np.minimum(ahead, spacing), [0.0]]).tolist()))
    return np.maximum(0.5 * np.sum(pairs, axis=1) / spacing, 0.5 * STEP_SHARE)


# How many beads fill the width across a ridge: as many as fit, but no change of their number for a short stretch.
#
# The work in the plane that deposits beads of varying width through the middle of a shape changes their number where
# that costs least [Kuipers2020]; along a line that is a shortest path over its places and numbers.


# A change of the number costs as much as half a spacing squared of surface that is missed.
CHANGE = 0.5


def bead_counts(widths: FloatArray, fewest: IntArray, lengths: FloatArray) -> IntArray:
    """Return how many beads lie across a ridge at each of n places along it.

    Args:
        widths: (n,) across the ridge from rim to rim [spacings].
        fewest: (n,) one bead less than the level curves that cross there.
        lengths: (n,) that each place stands for [spacings].

    Returns:
        (n,) numbers, positive, from the fewest to two more.
    """
    numbers = np.arange(max(int(fewest.min()), 1), int(fewest.max()) + 3)
    more = numbers - fewest[:, None]
    costs = np.where((more >= 0) & (more <= 2), _waste(widths[:, None], numbers) * lengths[:, None], np.inf)
    change = CHANGE * np.abs(numbers[:, None] - numbers)
    total, came_from = costs[0], np.zeros(costs.shape, dtype=np.int64)
    for place in range(1, len(costs)):
        arriving = total[:, None] + change
        came_from[place] = arriving.argmin(axis=0)
        total = arriving.min(axis=0) + costs[place]
    best = np.empty(len(costs), dtype=np.int64)
    best[-1] = total.argmin()
    for place in range(len(costs) - 1, 0, -1):
        best[place - 1] = came_from[place][best[place]]
    return numbers[best]


def _waste(widths: FloatArray, numbers: IntArray) -> FloatArray:
    """Return what a number of beads misses or deposits twice of a width, and the square of what they are off by."""
    # The middle between two beads is half a bead away from both: beads a tenth wider or narrower do neither.
    bead = widths / numbers
    missed = numbers * np.maximum(bead - 2.0 * GAP_SHARE, 0.0)
    twice = (numbers - 1) * np.maximum(2.0 * OVERLAP_SHARE - bead, 0.0)
    return missed + twice + (widths - numbers) ** 2


# Tips of corners drawn outwards: between the tip of a sharp corner and the corner outside of it a gap stays open.
#
# Level curves turn by the same angle on a ridge that they cross. With half the angle b between the two sides of a
# corner tips lie w / sin(b) apart along the ridge, and the place between them that is farthest from both is w / (1 +
# sin(b)) from either. A tip that reaches x farther out leaves (w - x sin(b)) / (1 + sin(b)).


# Half of the stretch over which a corner turns, over the spacing.
HALF_CORNER = 0.5
# Corners that turn less leave next to nothing open.
LEAST_TURN = np.radians(60.0)
# A tip reaches no farther than so many spacings: a longer finger would be deposited twice, or cut at its sharp end.
MOST_REACH = 0.15
# Nothing is open outside of a tip where a bead is within so many spacings of the place as far outside of it.
SERVED = 0.6
# Half of the foot of the finger, over the spacing.
FOOT = 0.6


def drawn_out(strands: Strands, places: FloatArray, beads: FloatArray) -> FloatArray:
    """Return the (k, 3) places of samples with the tips of convex corners drawn outwards [mm].

    Args:
        strands: k samples; those of the outermost level stay, outside of them is the rim.
        places: (k, 3) where the samples are now [mm].
        beads: (j, 3) places along beads on ridges; tips with one outside of them stay [mm].
    """
    result = places.copy()
    deposited = KDTree(beads) if len(beads) else None
    for strand in range(strands.count):
        held = strands.rows(strand)
        if strands.levels[held.start] > 0:
            closed = bool(strands.closed[strand])
            moves = _reaches(places[held], strands.normals[held], deposited, closed=closed, spacing=strands.spacing)
            result[held] += moves
    return result


def _reaches(
    line: FloatArray, normals: FloatArray, deposited: KDTree | None, *, closed: bool, spacing: float
) -> FloatArray:
    """Return how far each place of a strand (n, 3) is to move; nowhere with a bead outside of it [mm]."""
    moved = np.zeros_like(line)
    half = round(HALF_CORNER / STEP_SHARE)
    if len(line) < 4 * half:
        return moved
    ahead = np.roll(line, -1, axis=0) - line
    steps = np.linalg.norm(ahead, axis=1, keepdims=True)
    ahead = np.divide(ahead, steps, out=np.zeros_like(ahead), where=steps > 0.0)
    # A corner is where narrow windows turn as much as wide ones.
    windows = [_turns(ahead, normals, half=each, closed=closed) for each in range(half + 1)]
    turns, sharpness = windows[-1], np.sum(windows, axis=0)
    arcs, length = np.cumsum(steps[:, 0]) - steps[:, 0], float(steps.sum())
    while turns.max() > LEAST_TURN:
        tip = int(np.where(turns > LEAST_TURN, sharpness, -np.inf).argmax())
        away = np.abs(arcs - arcs[tip])
        away = np.minimum(away, length - away) if closed else away
        outwards = np.roll(ahead, half + 1, axis=0)[tip] - np.roll(ahead, -half, axis=0)[tip]
        foot = np.clip(1.0 - away / (FOOT * spacing), 0.0, 1.0)
        outwards /= np.linalg.norm(outwards)
        if deposited is None or deposited.query(line[tip] + SERVED * spacing * outwards)[0] > SERVED * spacing:
            moved += _reach(turns[tip]) * spacing * foot[:, None] * outwards
        turns = np.where(away < spacing, 0.0, turns)
    return moved


def _turns(ahead: FloatArray, normals: FloatArray, *, half: int, closed: bool) -> FloatArray:
    """Return the (n,) angles by which a strand turns towards the inside within so many samples to both sides [rad].

    Args:
        ahead: (n, 3) directions from each sample to the next.
        normals: (n, 3) of the surface.
        half: samples to either side.
        closed: whether the strand is.
    """
    before, behind = np.roll(ahead, half + 1, axis=0), np.roll(ahead, -half, axis=0)
    turns = np.arctan2(np.einsum("nx,nx->n", np.cross(before, behind), normals), np.einsum("nx,nx->n", before, behind))
    if not closed:
        turns[: half + 1] = turns[-half - 1 :] = 0.0
    return turns


def _reach(turn: float) -> float:
    """Return how far a tip is to reach so that nothing stays open outside of it [spacings]."""
    sine = max(np.cos(0.5 * turn), 1e-3)
    return float(np.clip((1.0 - GAP_SHARE * (1.0 + sine)) / sine, 0.0, MOST_REACH))
