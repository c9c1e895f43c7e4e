"""The phase of stripes: one complex number a vertex, whose argument rises by one turn from row to row [Knöppel2015].

The number at the far end of a side is wanted to be that at the near end, turned by how many rows lie between. The sum
of the squares of what is missed, with the weights of the cotangents, is least for the smallest eigenvector of a matrix
of turns, which inverse iteration finds. Its numbers are small where rows cannot be wanted ones and say little there: so
the iteration goes on with numbers that are made one long after each step, until ends of rows stand where they cost
least. At last, between the ends, the phase is a number of rows that rises along each side, and a linear system makes
the least of what its slopes miss.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
from scipy.sparse import coo_array, csc_array

from geoprint.backends.sparse_solver import SymmetricSolver
from geoprint.model import FloatArray, IntArray
from geoprint.patterns.fibres.evened import LEAN_PRICE, Slopes
from geoprint.patterns.fibres.net import ComplexArray, LineNet, rim_sides, surface_points
from geoprint.patterns.fibres.senses import Senses
from geoprint.surfaces import diagonal_matrix, sum_around_vertices

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
