"""How fast rows shall follow one another across the lines of a field, so that few of them have to end.

Rows one spacing apart that follow lines exactly end or begin wherever the lines part or come together. Where their
distance may differ a little from the spacing, and their direction from the lines, most of these ends are not needed.
What costs least, in the squares of both and a price for each end, has a dual that is an obstacle problem: a membrane
over the surface, held at the rim, that the divergence of the lines lifts and that may rise no higher than the price.
The slope of it is what rows differ by; rows end only where it touches. Where the wanted spacing differs from place to
place, all of this is over the spacing there: rows then end where it demands them to as well.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csc_array

from geoprint.backends.sparse_solver import SymmetricSolver, nested_dissection
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.patterns.fibres.net import ComplexArray, LineNet
from geoprint.patterns.fibres.senses import Senses
from geoprint.surfaces import diagonal_matrix, sum_around_vertices

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
