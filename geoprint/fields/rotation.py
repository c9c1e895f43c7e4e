"""Turning a field smoothly towards what is preferred, by a continuous angle: its singularities stay where they are.

The angle f, linear in each triangle, makes the least of the integral of |grad f|^2 and of the weighted squares of what
is left to the wishes. Of the n directions each wish takes the nearest; as f grows others may be nearer, and the same
system is solved for them, which makes less of the sum each time and so comes to an end.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array

from geoprint.backends.sparse_solver import SymmetricSolver, nested_dissection
from geoprint.fields.connection import principal
from geoprint.fields.preferences import Wishes
from geoprint.model import FloatArray, Surface
from geoprint.surfaces import cotangent_laplacian, diagonal_matrix


def leant(surface: Surface, angles: FloatArray, wishes: Wishes, *, symmetry: int) -> FloatArray:
    """Return by how much a field turns in each face towards what is wished; 0 where nothing is.

    Args:
        surface: m faces, in one piece.
        angles: (m,) of one direction of the field in each face [rad].
        wishes: on this surface.
        symmetry: n, of the directions in a face.

    Returns:
        (m,) angles [rad].
    """
    if wishes.weights.sum() <= 0.0:
        return np.zeros(angles.size)
    period, count, vertices = 2 * np.pi / symmetry, wishes.faces.size, len(surface.vertices)
    where = np.repeat(np.arange(count), 3), surface.faces[wishes.faces].ravel()
    means = csc_array((np.full(3 * count, 1 / 3), where), shape=(count, vertices))
    pulls = csc_array(means.T @ diagonal_matrix(wishes.weights))
    # A vertex that no face uses stays at 0.
    unused = np.bincount(surface.faces.ravel(), minlength=vertices) == 0
    matrix = csc_array(cotangent_laplacian(surface) + pulls @ means + diagonal_matrix(unused.astype(np.float64)))
    solver = SymmetricSolver(matrix, order=nested_dissection(matrix, coordinates=surface.vertices))
    left = wishes.angles - angles[wishes.faces]
    # The one turn of the whole that all wishes together are nearest to.
    whole = float(np.angle(np.sum(wishes.weights * np.exp(1j * symmetry * left)))) / symmetry
    wanted = _nearest(left, np.full(count, whole), period=period)
    while True:
        at = solver.solve(np.asarray(pulls @ wanted, dtype=np.float64))
        lean = at[surface.faces].mean(axis=1)
        nearer = _nearest(left, lean[wishes.faces], period=period)
        if np.allclose(nearer, wanted):
            return lean
        wanted = nearer


def _nearest(left: FloatArray, lean: FloatArray, *, period: float) -> FloatArray:
    """Return (k,) angles that wishes leave, of those a period apart the one nearest to how far the field leans."""
    return lean + principal(left - lean, period=period)
