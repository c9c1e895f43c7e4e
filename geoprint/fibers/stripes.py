"""Stripes: strokes that are level curves of a phase, as even as the field lets them be."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array
from scipy.sparse.csgraph import dijkstra

from geoprint.distance.sparse_solver import SymmetricSolver, nested_dissection
from geoprint.fibers.net import ComplexArray, LineNet, Senses, rim_sides, senses_of, surface_points
from geoprint.fibers.placement import SHORTEST, DepositedStroke
from geoprint.geometry import diagonal_matrix, sum_around_vertices
from geoprint.kernels import njit
from geoprint.model import BoolArray, FloatArray, IntArray, Surface

# How fast rows shall follow one another across the lines of a field, so that few of them have to end.
#
# Rows one spacing apart that follow lines exactly end or begin wherever the lines part or come together. Where their
# distance may differ a little from the spacing, and their direction from the lines, most of these ends are not
# needed. What costs least, in the squares of both and a price for each end, has a dual that is an obstacle problem:
# a membrane over the surface, held at the rim, that the divergence of the lines lifts and that may rise no higher
# than the price. The slope of it is what rows differ by; rows end only where it touches. Where the wanted spacing
# differs from place to place, all of this is over the spacing there: rows then end where it demands them to as well.


# What an end costs, in spacings: the membrane's greatest height. Twice as much leaves half of the ends and takes rows
# by half as far again from their spacing.
END_PRICE = 0.4
# A lean [rad] costs as many times what the same share of the spacing does: two degrees are as bad as 7 %.
LEAN_PRICE = 4.0
# Steps of the splitting of the obstacle problem at most, how far each goes beyond what it finds [Boyd2011, sec. 3.4.3],
# and the share of its height within which the membrane then stands still.
STEPS, RELAXATION, STILL = 50, 1.7, 1e-4
# Lines that part by less than this [1 / mm] lift nothing: the spring of the splitting has to have some strength.
LEAST_LIFT = 1e-4


class Slopes(NamedTuple):
    """Slopes of what is linear in each face, along its line and to the left of that.

    Attributes:
        surface: n vertices, m faces.
        areas: (m,) of faces [mm2].
        along: (m, 3) of what is 1 at each corner [1 / mm].
        across: (m, 3) [1 / mm].
        senses: of the faces at their corners.
        order: (n,) in which unknowns at vertices are eliminated.
    """

    surface: Surface
    areas: FloatArray
    along: FloatArray
    across: FloatArray
    senses: Senses
    order: IntArray

    def of(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the (m,) slopes along and across of what has (n,) values in the senses of vertices."""
        corners = values[self.surface.faces] * self.senses.corners
        return (self.along * corners).sum(axis=1), (self.across * corners).sum(axis=1)

    def stiffness(self, *, along: FloatArray, across: FloatArray) -> csc_array[np.float64]:
        """Return (n, n) the sum of squared slopes over the faces, with (m,) weights of the two."""
        first, second = self.along * self.senses.corners, self.across * self.senses.corners
        each = (
            (self.areas * along)[:, None, None] * first[:, :, None] * first[:, None]
            + (self.areas * across)[:, None, None] * second[:, :, None] * second[:, None]
        )  # fmt: skip
        return _assembled(self.surface, each)

    def pull(self, *, along: FloatArray, across: FloatArray) -> FloatArray:
        """Return (n,) sums over the faces of (m,) values times the slopes of what is 1 at each vertex."""
        each = self.along * (self.areas * along)[:, None] + self.across * (self.areas * across)[:, None]
        each *= self.senses.corners
        at = self.surface.faces.ravel()
        return np.bincount(at, each.ravel(), minlength=len(self.surface.vertices)).astype(np.float64)


def slopes_of(surface: Surface, net: LineNet, senses: Senses) -> Slopes:
    """Return the slopes on a surface with lines."""
    areas = net.corners[:, 1].real * net.corners[:, 2].imag / 2
    opposite = np.roll(net.corners, -2, axis=1) - np.roll(net.corners, -1, axis=1)
    # Against the line of each face.
    turned = 1j * opposite / (2 * areas[:, None]) * net.lines.conj()[:, None]
    order = nested_dissection(_assembled(surface, np.ones((areas.size, 3, 3))), coordinates=surface.vertices)
    return Slopes(surface, areas, turned.real, turned.imag, senses, order)


def _assembled(surface: Surface, each: FloatArray) -> csc_array[np.float64]:
    """Return the (n, n) sum of (m, 3, 3) matrices of the corners of faces."""
    faces, count = surface.faces, len(surface.vertices)
    places = np.repeat(faces, 3, axis=1).ravel(), np.tile(faces, (1, 3)).ravel()
    return csc_array(coo_array((each.ravel(), places), shape=(count, count)))


def evened(slopes: Slopes, rim: BoolArray, *, spacings: FloatArray) -> ComplexArray:
    """Return the (m,) slopes that rows shall have: along the line of each face, as imaginary part across [1 / mm].

    Args:
        slopes: on a surface in one piece.
        rim: (n,) which vertices lie on it.
        spacings: (m,) wanted distance of rows [mm].
    """
    held = rim | slopes.senses.odd
    if held.all():
        return np.asarray(1j / spacings, dtype=np.complex128)
    # Heights are over a usual spacing.
    usual = float(np.median(spacings))
    denser = usual / spacings
    free = diagonal_matrix(np.where(held, 0.0, 1.0))
    stiffness = csc_array(free @ slopes.stiffness(along=denser**2, across=denser**2 / LEAN_PRICE) @ free)
    lift = np.where(held, 0.0, slopes.pull(along=denser, across=0.0 * denser))
    areas = np.maximum(sum_around_vertices(slopes.surface, slopes.areas / 3), np.finfo(float).tiny)
    # An end costs the square of the spacing there.
    squares = sum_around_vertices(slopes.surface, slopes.areas / 3 * spacings**2) / areas
    limit = END_PRICE * np.maximum(squares, np.finfo(float).tiny) / usual
    # As stiff a spring as lifts of a usual size press the membrane by an eighth of its greatest height.
    spring = areas * max(float(np.median(np.abs(lift[~held] / areas[~held]))), LEAST_LIFT) * 8.0 / limit
    matrix = csc_array(stiffness + diagonal_matrix(np.where(held, 1.0, spring)))
    solver = SymmetricSolver(matrix, order=slopes.order)
    height, push = np.zeros(len(rim)), np.zeros(len(rim))
    for _ in range(STEPS):
        membrane = solver.solve(lift + np.where(held, 0.0, spring * (height - push)))
        beyond, before = height + RELAXATION * (membrane - height), height
        height = np.clip(beyond + push, -limit, limit)
        push += beyond - height
        if (np.abs(height - before) < STILL * limit).all():
            break
    along, across = slopes.of(height)
    evener: ComplexArray = np.empty(spacings.size, dtype=np.complex128)
    evener.real, evener.imag = denser * across / LEAN_PRICE / spacings, (1.0 - denser * along) / spacings
    return evener


# The phase of stripes: one complex number a vertex, whose argument rises by one turn from row to row [Knöppel2015].
#
# The number at the far end of a side is wanted to be that at the near end, turned by how many rows lie between. The
# sum of the squares of what is missed, with the weights of the cotangents, is least for the smallest eigenvector of
# a matrix of turns, which inverse iteration finds. Its numbers are small where rows cannot be wanted ones and say
# little there: so the iteration goes on with numbers that are made one long after each step, until ends of rows
# stand where they cost least. At last, between the ends, the phase is a number of rows that rises along each side,
# and a linear system makes the least of what its slopes miss.


# So far does one step of the iteration carry what numbers say of one another: first over the whole surface, in roots of
# its area, then so many spacings.
FAR_REACH, REACH = 10.0, 2.0
# Steps with numbers as long as they come, and made one long.
INVERSE_STEPS, UNIT_STEPS = 10, 20
# Rows are drawn to half a spacing from the rim as if it were this many spacings of surface away.
RIM_DEPTH = 4.0
# Where lines follow the rim to less than this cosine, rows run out over it and nothing is drawn.
RIM_COSINE = 0.9
# A vertex lies on no row: at least this share of a row off the nearest, so that rounding never decides on which side.
OFF_ROW = 1e-9
# What holds the level of a phase that nothing else does, over the areas of vertices: far below all slopes.
HELD = 1e-9

# What keeps a number real and a vertex at its level, over weights of cotangents: none can pull against it.
STIFF = 1e9

# A face, and a place in its plane.
Place: TypeAlias = tuple[int, complex]


class Phase(NamedTuple):
    """Rows on a surface: at a corner the share of a row, and along each side how many are passed.

    Attributes:
        shares: (m, 3) at the corners of faces, in the sense of the face: what is to add to whole rows, from 0 to 1
            without both.
        passed: (m, 3) rows that are passed along the side from corner i to corner i + 1, in the sense of the face;
            their sum round a face is the number of rows that end in it.
    """

    shares: FloatArray
    passed: IntArray


class WantedPhase(NamedTuple):
    """What the phase shall have.

    Attributes:
        slopes: (m,) along the line of each face, and as imaginary part across [1 / mm].
        sides: (m, 3) rows along each side, in the sense of the face; the same from both faces.
    """

    slopes: ComplexArray
    sides: FloatArray


def target_of(net: LineNet, slopes: ComplexArray) -> WantedPhase:
    """Return the target with (m,) slopes in the faces, along sides the mean of those of both faces."""
    sides = np.roll(net.corners, -1, axis=1) - net.corners
    rows = (np.conj(slopes * net.lines)[:, None] * sides).real.ravel()
    inside = np.flatnonzero(net.twins >= 0)
    beyond = net.twins[inside]
    means = rows.copy()
    # From beyond the side runs back.
    means[inside] = (rows[inside] - net.signs[inside] * rows[beyond]) / 2
    return WantedPhase(slopes, means.reshape(-1, 3))


def phase_of(slopes: Slopes, net: LineNet, target: WantedPhase, *, through: Place | None) -> Phase:
    """Return the phase that comes nearest to a target.

    Args:
        slopes: on a surface in one piece.
        net: of the same.
        target: to come near to.
        through: where a row shall pass, if senses agree all over; None draws rows to half a spacing from the rim.

    Raises:
        FieldError: the surface has triangles without height.
    """
    senses, faces = slopes.senses, slopes.surface.faces
    shares = np.angle(_numbers(slopes, target, spacing=float(np.median(net.spacings)))) / (2 * np.pi)
    # Half a row from both of its sides, whatever the sense.
    shares[senses.odd] = 0.0
    steps = _apart(shares, faces, senses)
    steps += np.rint(target.sides - steps)
    weights = np.where(np.abs(steps.sum(axis=1)) < 0.5, net.spacings**2, 0.0)
    along, across = _slopes_of_steps(slopes, steps)
    missed = target.slopes - (along + 1j * across)
    stiffness = slopes.stiffness(along=LEAN_PRICE * weights, across=weights)
    pull = slopes.pull(along=LEAN_PRICE * weights * missed.real, across=weights * missed.imag)
    areas = sum_around_vertices(slopes.surface, slopes.areas / 3)
    # A vertex without a face stays where it is, and one that has no sense half a row from all.
    hold = np.where(senses.odd, STIFF, np.where(areas > 0.0, HELD * areas, 1.0))
    held = csc_array(stiffness + diagonal_matrix(hold))
    lift = SymmetricSolver(held, order=slopes.order).solve(pull)
    if through is not None:
        lift += _level_through(slopes, net, shares + lift, steps + _apart(lift, faces, senses), through)
    elif (drawn := _drawn_to_rim(slopes, net)).any():
        lift += _common_level(senses, shares + lift, drawn)
        short = np.rint(shares + lift) - (shares + lift)
        lift += SymmetricSolver(csc_array(held + diagonal_matrix(drawn)), order=slopes.order).solve(drawn * short)
    return _whole(slopes, shares + lift, steps + _apart(lift, faces, senses))


def _numbers(slopes: Slopes, target: WantedPhase, *, spacing: float) -> ComplexArray:
    """Return the (n,) numbers whose turns along sides come nearest to those of a target."""
    turns, odd = _turns(slopes, target), slopes.senses.odd
    areas = np.maximum(sum_around_vertices(slopes.surface, slopes.areas / 3), np.finfo(float).tiny)
    order = np.repeat(2 * slopes.order, 2) + np.tile([0, 1], areas.size)
    numbers = np.ones(areas.size, dtype=np.complex128)
    step = _step(turns, areas, reach=FAR_REACH * np.sqrt(areas.sum()), order=order)
    for _ in range(INVERSE_STEPS):
        numbers = step(numbers)
        numbers /= np.sqrt(np.mean(np.abs(numbers) ** 2))
    # The opposite numbers miss as little: no row shall pass through most of what has no sense.
    if numbers[odd].real.sum() < 0.0:
        numbers = -numbers
    step = _step(turns, np.where(odd, STIFF, areas), reach=REACH * spacing, order=order)
    for _ in range(UNIT_STEPS):
        numbers = np.where(odd, 1.0, numbers / np.maximum(np.abs(numbers), np.finfo(float).tiny))
        numbers = step(numbers)
    return numbers


def _step(
    turns: csc_array[np.float64], areas: FloatArray, *, reach: float, order: IntArray
) -> Callable[[ComplexArray], ComplexArray]:
    """Return what carries (n,) numbers so far [mm] over the surface, turned as sides demand."""
    # Real and imaginary parts side by side.
    weights = np.repeat(areas, 2)
    solver = SymmetricSolver(csc_array(turns * reach**2 + diagonal_matrix(weights)), order=order)
    return lambda numbers: solver.solve(weights * numbers.view(np.float64)).view(np.complex128)


def _turns(slopes: Slopes, target: WantedPhase) -> csc_array[np.float64]:
    """Return the (2 n, 2 n) matrix of the weighted squares of what numbers miss along the sides of faces.

    Where both ends of a side have opposite senses, the number at one is the conjugate of what it is for the other, so
    that real and imaginary parts are unknowns of their own.
    """
    senses, faces = slopes.senses, slopes.surface.faces
    # What has no sense is a real number.
    stiff = np.where(senses.odd, STIFF, 0.0)
    dots = slopes.areas[:, None] * (
        slopes.along * np.roll(slopes.along, -1, axis=1) + slopes.across * np.roll(slopes.across, -1, axis=1)
    )
    weights = -dots.ravel()
    near, far = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    turns = 2 * np.pi * (target.sides * senses.corners).ravel()
    same = senses.along.ravel()
    imaginary = 2 * np.arange(stiff.size) + 1
    blocks = [(imaginary, imaginary, stiff)]
    blocks += [(2 * end + part, 2 * end + part, weights) for end in (near, far) for part in (0, 1)]
    shares: list[tuple[int, int, FloatArray]] = [
        (0, 0, np.cos(turns)), (0, 1, -np.sin(turns)), (1, 0, same * np.sin(turns)), (1, 1, same * np.cos(turns))
    ]  # fmt: skip
    for far_part, near_part, share in shares:
        blocks.append((2 * far + far_part, 2 * near + near_part, -weights * share))
        blocks.append((2 * near + near_part, 2 * far + far_part, -weights * share))
    rows, columns, values = (np.concatenate(part) for part in zip(*blocks, strict=True))
    count = 2 * senses.odd.size
    return csc_array(coo_array((values, (rows, columns)), shape=(count, count)))


def _apart(values: FloatArray, faces: IntArray, senses: Senses) -> FloatArray:
    """Return (m, 3) by how much (n,) values rise along each side, in the sense of the face."""
    ends = values[faces] * senses.corners
    return np.roll(ends, -1, axis=1) - ends


def _slopes_of_steps(slopes: Slopes, steps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (m,) slopes along and across of what rises by (m, 3) steps along the sides of faces."""
    corners = np.column_stack([np.zeros(len(steps)), steps[:, 0], steps[:, 0] + steps[:, 1]])
    return (slopes.along * corners).sum(axis=1), (slopes.across * corners).sum(axis=1)


def _level_through(slopes: Slopes, net: LineNet, values: FloatArray, steps: FloatArray, through: Place) -> FloatArray:
    """Return (n,) what is to add so that a row passes through a place; nothing where senses disagree."""
    senses, (face, place) = slopes.senses, through
    if (senses.along < 0.0).any():
        return np.zeros(values.size)
    weights = surface_points(net, np.array([face]), np.array([place])).weights[0]
    sense, rise = senses.corners[face, 0], weights[1] * steps[face, 0] - weights[2] * steps[face, 2]
    return np.full(values.size, 0.5 - values[slopes.surface.faces[face, 0]] - sense * rise)


def _drawn_to_rim(slopes: Slopes, net: LineNet) -> FloatArray:
    """Return (n,) how strongly vertices are drawn to half a row: those of the rim that lines follow."""
    halves, starts, ends = rim_sides(net)
    lengths = np.abs(ends - starts)
    cosines = np.abs((net.lines[halves // 3] * ((ends - starts) / lengths).conj()).real)
    drawn = np.where(cosines > RIM_COSINE, lengths / 2, 0.0) / (RIM_DEPTH / net.spacings[halves // 3])
    faces, corners = slopes.surface.faces, halves % 3
    both = np.concatenate([faces[halves // 3, corners], faces[halves // 3, (corners + 1) % 3]])
    return np.bincount(both, np.tile(drawn, 2), minlength=slopes.senses.odd.size).astype(np.float64)


def _common_level(senses: Senses, values: FloatArray, drawn: FloatArray) -> FloatArray:
    """Return (n,) the one amount that brings (n,) values nearest to whole numbers; 0 where senses disagree."""
    if (senses.along < 0.0).any():
        return np.zeros(values.size)
    return np.full(values.size, -np.angle(np.sum(drawn * np.exp(2j * np.pi * values))) / (2 * np.pi))


def _whole(slopes: Slopes, values: FloatArray, steps: FloatArray) -> Phase:
    """Return the phase with (n,) values, counted from half a row, that rises by (m, 3) steps along sides."""
    shares = np.clip((values + 0.5) % 1.0, OFF_ROW, 1.0 - OFF_ROW)
    at = shares[slopes.surface.faces]
    corners = np.where(slopes.senses.corners > 0.0, at, 1.0 - at)
    return Phase(corners, np.rint(steps - np.roll(corners, -1, axis=1) + corners).astype(np.int64))


# Rows as level curves of a phase: where it takes whole numbers along the sides of faces, joined straight in each.
#
# In a face in which no row ends the phase is linear, and its level curves are exact and as even as it is. In one in
# which rows end, those that pass it are joined from neighbour to neighbour along its sides, and what has no partner
# ends at the side.


# A side is crossed no nearer to its ends than this share of it: no piece of a row is a point.
FROM_VERTEX = 1e-6


class Chains(NamedTuple):
    """Rows in pieces, one after the other.

    Attributes:
        faces: (s,) in which each piece lies.
        starts: (s,) in the plane of that [mm].
        ends: (s,) [mm].
        offsets: (c + 1,) where the pieces of each row start.
        closed: (c,) 1 where a row ends where it starts.
        sides: (q,) half-edges on which rows cross sides, the first of each side, from its start to its end.
        rows: (q,) which row crosses there.
    """

    faces: IntArray
    starts: ComplexArray
    ends: ComplexArray
    offsets: IntArray
    closed: IntArray
    sides: IntArray
    rows: IntArray


def level_curves(net: LineNet, phase: Phase) -> Chains:
    """Return where rows run, in the order of the sides at which they start, those that end before closed ones."""
    passed = phase.passed.ravel()
    halves = np.arange(passed.size)
    owner = np.where(net.twins < 0, halves, np.minimum(halves, net.twins))
    counts = np.where(owner == halves, np.abs(passed), 0)
    first = (np.cumsum(counts) - counts)[owner]
    shares = _shares(phase, counts)
    whole = phase.passed.sum(axis=1) == 0
    through = _through(phase.passed, np.flatnonzero(whole))
    around = _around(phase.passed, np.flatnonzero(~whole))
    halves_of, ordinals = (np.concatenate([one, other]) for one, other in zip(through, around, strict=True))
    own = owner[halves_of] == halves_of
    numbers = first[halves_of] + np.where(own, ordinals, np.abs(passed[halves_of]) - 1 - ordinals)
    order, turned, offsets, closed = _chained(numbers, int(counts.sum()))
    share = np.where(own, shares[numbers], 1.0 - shares[numbers])
    corners, sides = net.corners.ravel(), (np.roll(net.corners, -1, axis=1) - net.corners).ravel()
    places = corners[halves_of] + share * sides[halves_of]
    ahead = np.where(turned[:, None] > 0, [[0, 1]], [[1, 0]])
    rows = order[:, None]
    row_of = np.full(int(counts.sum()), -1)
    row_of[numbers[order]] = np.repeat(np.arange(closed.size), np.diff(offsets))[:, None]
    # Where rows end on both sides of a crossing nothing is left of it.
    crossing = np.flatnonzero(row_of >= 0)
    return Chains(
        faces=halves_of[order, 0] // 3,
        starts=places[rows, ahead][:, 0],
        ends=places[rows, ahead][:, 1],
        offsets=offsets,
        closed=closed,
        sides=np.repeat(halves, counts)[crossing],
        rows=row_of[crossing],
    )


def _shares(phase: Phase, counts: IntArray) -> FloatArray:
    """Return the share of its side from the start at which each crossing lies, (3 m,) counts of them."""
    begun, over = phase.shares.ravel(), np.roll(phase.shares, -1, axis=1).ravel() + phase.passed.ravel()
    half = np.repeat(np.arange(counts.size), counts)
    ordinal = np.arange(half.size) - np.repeat(np.cumsum(counts) - counts, counts)
    level = np.where(phase.passed.ravel()[half] > 0, ordinal + 1, -ordinal)
    return np.clip((level - begun[half]) / (over - begun)[half], FROM_VERTEX, 1.0 - FROM_VERTEX)


def _through(passed: IntArray, faces: IntArray) -> tuple[IntArray, IntArray]:
    """Return (s, 2) half-edges at both ends of pieces through faces without ends, and which crossing of each it is."""
    steps = passed[faces]
    starts = np.column_stack([np.zeros(len(steps), dtype=np.int64), steps[:, 0], steps[:, 0] + steps[:, 1]])
    least = starts.min(axis=1)
    count = starts.max(axis=1) - least
    row = np.repeat(np.arange(faces.size), count)
    level = least[row] + 1 + np.arange(row.size) - np.repeat(np.cumsum(count) - count, count)
    ends = starts + steps
    low, high = np.minimum(starts, ends)[row], np.maximum(starts, ends)[row]
    # A level between the corners passes exactly two of the sides.
    which, side = np.nonzero((low < level[:, None]) & (level[:, None] <= high))
    at, below, above = level[which], low[which, side], high[which, side]
    ordinals = at - below - 1
    falling = steps[row[which], side] < 0
    ordinals[falling] = (above - at)[falling]
    return (3 * faces[row[which]] + side).reshape(-1, 2), ordinals.reshape(-1, 2)


def _around(passed: IntArray, faces: IntArray) -> tuple[IntArray, IntArray]:
    """Return the same of faces in which rows end: neighbours of opposite sense along the sides, joined inside out."""
    halves, ordinals = list[tuple[int, int]](), list[tuple[int, int]]()
    for face in faces.tolist():
        open_ends = list[tuple[int, int, bool]]()
        for side, count in enumerate(passed[face].tolist()):
            for ordinal in range(abs(count)):
                if open_ends and open_ends[-1][2] != (count > 0):
                    half, other, _ = open_ends.pop()
                    halves.append((half, 3 * face + side))
                    ordinals.append((other, ordinal))
                else:
                    open_ends.append((3 * face + side, ordinal, count > 0))
    return np.array(halves, dtype=np.int64).reshape(-1, 2), np.array(ordinals, dtype=np.int64).reshape(-1, 2)


@njit
def _chained(crossings: IntArray, count: int) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Return pieces in order, 1 where they run on and -1 where back, where rows start, and what is closed.

    Args:
        crossings: (s, 2) at both ends of each piece; each crossing has at most two pieces.
        count: of the crossings.
    """
    pieces = len(crossings)
    held = np.full((count, 2), -1)
    for piece in range(pieces):
        for end in range(2):
            at = crossings[piece, end]
            held[at, 0 if held[at, 0] < 0 else 1] = piece
    order, turned = np.empty(pieces, np.int64), np.empty(pieces, np.int64)
    offsets, closed = np.empty(pieces + 1, np.int64), np.empty(pieces, np.int64)
    used = np.zeros(pieces, np.bool_)
    filled, rows = 0, 0
    for around in range(2):
        for begin in range(count):
            piece = held[begin, 0]
            if piece < 0 or used[piece] or (around == 0 and held[begin, 1] >= 0):
                continue
            offsets[rows], closed[rows] = filled, around
            rows += 1
            at = begin
            while piece >= 0 and not used[piece]:
                used[piece] = True
                ahead = crossings[piece, 0] == at
                order[filled], turned[filled] = piece, 1 if ahead else -1
                filled += 1
                at = crossings[piece, 1] if ahead else crossings[piece, 0]
                piece = held[at, 1] if held[at, 0] == piece else held[at, 0]
    offsets[rows] = filled
    return order, turned, offsets[: rows + 1], closed[:rows]


# Which row a stroke is: how many lie side by side from the first one to it.


# From a row to the next is one, to a vertex between them half of it, and along a side that no row crosses so little
# that it never adds up; a graph has no joints of no length.
NEXT, BETWEEN, NO_ROW = 1.0, 0.5, 1e-9


def rows_of(surface: Surface, net: LineNet, chains: Chains, *, first: Place) -> IntArray:
    """Return (c,) the number of each row, 0 for the one that passes nearest to a place."""
    if not chains.closed.size:
        return np.zeros(0, dtype=np.int64)
    count = len(surface.vertices)
    begun = count + _nearest(surface, net, chains, first)
    away: FloatArray = dijkstra(_neighbours(surface, net, chains), directed=False, indices=[begun], min_only=True)
    return np.floor(away[count:] + BETWEEN).astype(np.int64)


def _neighbours(surface: Surface, net: LineNet, chains: Chains) -> csr_array:
    """Return the graph of n vertices and then c rows, joined where they follow one another along sides."""
    near, far = surface.faces.ravel(), np.roll(surface.faces, -1, axis=1).ravel()
    sides, rows = chains.sides, len(surface.vertices) + chains.rows
    fresh = np.append(True, np.diff(sides) != 0)
    last = np.append(fresh[1:], True)
    inner = np.flatnonzero(~fresh)
    crossed = np.zeros(near.size, dtype=np.bool_)
    crossed[sides] = True
    bare = np.flatnonzero(~(crossed | crossed[net.twins]) & (net.twins >= 0) | ~crossed & (net.twins < 0))
    joints = (
        (near[sides[fresh]], rows[fresh], BETWEEN),
        (far[sides[last]], rows[last], BETWEEN),
        (rows[inner - 1], rows[inner], NEXT),
        (near[bare], far[bare], NO_ROW),
    )
    both = np.concatenate([np.column_stack([one, other]) for one, other, _ in joints])
    cost = np.concatenate([np.full(one.size, length) for one, _, length in joints])
    # The same joint on many sides is one.
    pairs, chosen = np.unique(np.sort(both, axis=1), axis=0, return_index=True)
    count = len(surface.vertices) + chains.closed.size
    return csr_array((cost[chosen], (pairs[:, 0], pairs[:, 1])), shape=(count, count))


def _nearest(surface: Surface, net: LineNet, chains: Chains, first: Place) -> int:
    """Return the row with the piece nearest to a place: in its face, or where there is none by where pieces start."""
    face, place = first
    here = np.flatnonzero(chains.faces == face)
    if here.size:
        along = chains.ends[here] - chains.starts[here]
        share = np.clip(((place - chains.starts[here]) * along.conj()).real / np.abs(along) ** 2, 0.0, 1.0)
        piece = here[np.argmin(np.abs(chains.starts[here] + share * along - place))]
    else:
        begun = surface_points(net, chains.faces, chains.starts).xyz(surface)
        there = surface_points(net, np.array([face]), np.array([place])).xyz(surface)
        piece = np.argmin(np.linalg.norm(begun - there, axis=1))
    return int(np.searchsorted(chains.offsets, piece, side="right") - 1)


def stripes(
    surface: Surface, net: LineNet, *, first: Place, through: bool
) -> tuple[list[DepositedStroke], list[float]]:
    """Return the rows of a phase whose slopes follow the lines of a field, as `deposited_strokes` returns them.

    Args:
        surface: in one piece.
        net: of a field on it.
        first: where rows are counted from.
        through: a row shall pass there; otherwise rows are drawn to half a spacing from the rim.
    """
    senses = senses_of(surface, net)
    slopes = slopes_of(surface, net, senses)
    rim = np.zeros(len(surface.vertices), dtype=np.bool_)
    outer = np.flatnonzero(net.twins < 0)
    rim[surface.faces[outer // 3, outer % 3]] = True
    target = target_of(net, evened(slopes, rim, spacings=net.spacings))
    phase = phase_of(slopes, net, target, through=first if through else None)
    chains = level_curves(net, phase)
    rows = rows_of(surface, net, chains, first=first)
    strokes, dropped = list[DepositedStroke](), list[float]()
    for row, (begin, end) in enumerate(pairwise(chains.offsets.tolist())):
        starts, ends = chains.starts[begin:end], chains.ends[begin:end]
        length = float(np.abs(ends - starts).sum())
        if length < SHORTEST * float(np.median(net.spacings[chains.faces[begin:end]])):
            dropped.append(length)
            continue
        closed = bool(chains.closed[row])
        strokes.append(DepositedStroke(chains.faces[begin:end], starts, ends, closed, int(rows[row]), length))
    return strokes, dropped
