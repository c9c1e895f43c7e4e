"""The smoothest field, which has the singularities that suit it: globally optimal directions [Knöppel2013].

A field of n directions is a complex number in each tangent plane, the n-th power of any of them. Its integral of the
squared gradient is least for the smallest eigenvector of a Hermitian matrix or, where directions are preferred, for the
solution of one linear system: nothing is searched, and singularities come where they cost least.

The carriers here are the sides of triangles: both faces beside one see it in their own plane, so that a field is linear
in each flat face and passes over sides without any rescaled angle. These elements of Crouzeix and Raviart keep the
matrix positive for all triangles, obtuse ones too, and a field that turns nowhere but at cones costs nothing. The face
has the mean of its sides [Crouzeix1973].
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from geoprint.backends.sparse_solver import ComplexArray, SymmetricSolver, nested_dissection
from geoprint.errors import FieldError
from geoprint.fields.connection import Connection, connection
from geoprint.fields.direction_field import DirectionField, check_symmetry, nearest_field
from geoprint.fields.preferences import Preference, Wishes, all_wishes
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.surfaces import diagonal_matrix, face_areas, pieces
from geoprint.threads import single_threaded_blas

# What is added to the matrix so that it has an inverse, over the inverse of the area: far below the second eigenvalue
# of any part, which is of the order of the inverse of its longest extent squared.
SHIFT = 1e-3
# How many vectors are held to find the smallest, and how exact it is: to a thousandth of a degree.
HELD, ACCURACY = 8, 1e-6


def smoothest_field(surface: Surface, *, symmetry: int, preferences: Sequence[Preference] = ()) -> DirectionField:
    """Return the field of least gradient, leaning to what is preferred, with the singularities that this takes.

    A piece of the surface without any preference has the field of least gradient of all, up to one turn of the whole
    piece, which is open; of several equally smooth ones, as on a sphere, it has any. What is least is the
    gradient of numbers that may be short where directions differ around them; the field has their directions alone.

    Args:
        surface: n vertices, manifold and consistently wound.
        symmetry: directions in a face: 1, 2 or 4.
        preferences: that the field leans to.

    Raises:
        UsageError: the symmetry is another.
        FieldError: the system is singular, or no smallest eigenvector is found.
        MeshError: as `connection`.
    """
    check_symmetry(symmetry)
    wishes = all_wishes(surface, preferences, symmetry=symmetry)
    angles = np.empty(len(surface.faces))
    for piece in pieces(surface):
        sides = _Sides(piece.surface, connection(piece.surface), symmetry=symmetry)
        own = wishes.on(piece)
        values = sides.leaning(own) if own.weights.any() else sides.smallest()
        angles[piece.faces] = np.angle(sides.in_faces(values)) / symmetry
    return nearest_field(surface, angles, symmetry=symmetry)


@final
class _Sides:
    """Fields on the sides of triangles: their matrix, and the least of them.

    Args:
        surface: m faces with e sides in all, in one piece.
        over: its connection.
        symmetry: n; values are n-th powers of directions, against that of the first half-edge of their side.
    """

    def __init__(self, surface: Surface, over: Connection, *, symmetry: int) -> None:
        self._surface, self._symmetry = surface, symmetry
        self._side, first = _numbered(over)
        turned = over.directions + np.where(first, 0.0, np.pi)
        # (m, 3) what turns the value of a side into the plane of the face.
        self._into = np.exp(1j * symmetry * turned).reshape(-1, 3)
        self._mass = np.bincount(self._side.ravel(), np.repeat(face_areas(surface) / 3, 3))
        self._middles = np.empty((self._mass.size, 3))
        self._middles[self._side.ravel()] = (surface.vertices[over.starts] + surface.vertices[over.ends]) / 2
        self._stiffness = self._assembled(_elements(over), np.arange(len(surface.faces)))

    def smallest(self) -> ComplexArray:
        """Return the (e,) values of the field of least gradient among those of one size."""
        root = np.sqrt(self._mass)
        scale = diagonal_matrix(1.0 / root)
        matrix = csc_array(scale @ self._stiffness @ scale)
        if root.size <= HELD:
            return np.asarray(np.linalg.eigh(matrix.toarray())[1][:, 0] / root, dtype=np.complex128)
        shift = SHIFT / float(self._mass.sum())
        solver = self._solver(csc_array(matrix + shift * diagonal_matrix(np.ones(root.size))))
        inverse = LinearOperator(matrix.shape, matvec=solver.solve, dtype=np.complex128)
        start = root.astype(np.complex128)
        try:
            with single_threaded_blas():
                _, vectors = eigsh(matrix, 1, sigma=-shift, OPinv=inverse, v0=start, ncv=HELD, tol=ACCURACY)
        except ArpackError as error:
            raise FieldError(
                f"no smoothest field is found on {self._surface.name} ({error}): check the mesh for triangles without "
                "height, or give a preference."
            ) from error
        return vectors[:, 0] / root

    def leaning(self, wishes: Wishes) -> ComplexArray:
        """Return the (e,) values of the field that makes the least of its gradient and what it misses of wishes."""
        each = np.repeat(wishes.weights / 9, 9).reshape(-1, 3, 3)
        matrix = csc_array(self._stiffness + self._assembled(each, wishes.faces))
        wanted = wishes.weights * np.exp(1j * self._symmetry * wishes.angles)
        pull: ComplexArray = np.zeros(self._mass.size, dtype=np.complex128)
        np.add.at(pull, self._side[wishes.faces], np.conj(self._into[wishes.faces]) * wanted[:, None] / 3)
        return self._solver(matrix).solve(pull)

    def in_faces(self, values: ComplexArray) -> ComplexArray:
        """Return the (m,) values in the middles of the faces, against the first side of each."""
        return (self._into * values[self._side]).mean(axis=1)

    def _assembled(self, elements: FloatArray, faces: IntArray) -> csc_array:
        """Return the (e, e) sum of (t, 3, 3) real matrices of the sides of (t,) faces, in the planes of these."""
        into, side = self._into[faces], self._side[faces]
        values = np.conj(into)[:, :, None] * elements * into[:, None, :]
        rows, columns = np.repeat(side, 3, axis=1).ravel(), np.tile(side, (1, 3)).ravel()
        count = self._mass.size
        return csc_array(coo_array((values.ravel(), (rows, columns)), shape=(count, count)))

    def _solver(self, matrix: csc_array) -> SymmetricSolver:
        return SymmetricSolver(matrix, order=nested_dissection(matrix, coordinates=self._middles))


def _elements(over: Connection) -> FloatArray:
    """Return (m, 3, 3) the integrals of grad psi_i . grad psi_j, with psi_i 1 in the middle of side i and linear.

    psi_i is 1 - 2 phi of the corner opposite to side i, so that they are four times those of the corners, which the
    cotangents make up.
    """
    weights = over.weights.reshape(-1, 3)
    elements = np.empty((len(weights), 3, 3))
    for side in range(3):
        following, before = (side + 1) % 3, (side + 2) % 3
        elements[:, side, side] = 4.0 * (weights[:, following] + weights[:, before])
        # Between two sides lies the corner that the third is opposite to.
        elements[:, side, following] = elements[:, following, side] = -4.0 * weights[:, before]
    return elements


def _numbered(over: Connection) -> tuple[IntArray, BoolArray]:
    """Return (m, 3) the number of each side, and (3 m,) whether a half-edge is the first of its side."""
    first = (over.twins < 0) | (over.twins > np.arange(over.twins.size))
    number = np.cumsum(first) - 1
    number[~first] = number[over.twins[~first]]
    return number.reshape(-1, 3), first
