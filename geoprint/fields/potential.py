"""Functions at the vertices with given sources, the same all along each rim: what fields turn by comes from them.

A function u whose cotangent Laplacian gives each vertex its source, linear in each face, has a gradient whose flow out
of any region about a vertex is that source. A field that turns along its lines by as much as the gradient flows across
them turns by the source around every vertex, and has the least squared gradient of all that do. A rim counts as one
vertex, because only the sum along it is given.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np
from scipy.sparse import coo_array, csc_array

from geoprint.backends.sparse_solver import SymmetricSolver, nested_dissection
from geoprint.fields.connection import Connection
from geoprint.model import FloatArray, IntArray, Surface
from geoprint.surfaces import cotangent_laplacian


def nodes_of(surface: Surface, groups: Sequence[IntArray]) -> IntArray:
    """Return (n,) numbers of the vertices, from 0: those of a group have its number, all others one each.

    Args:
        surface: n vertices; those that no face uses belong to the first group.
        groups: vertices, at least one group, none in two.
    """
    node = np.full(len(surface.vertices), -1, dtype=np.int64)
    used = np.zeros(node.size, dtype=np.bool_)
    used[surface.faces] = True
    node[~used] = 0
    for number, group in enumerate(groups):
        node[group] = number
    alone = np.flatnonzero(node < 0)
    node[alone] = len(groups) + np.arange(alone.size)
    return node


@final
class Potential:
    """Answers which function has given sources; factorised here, for many of them.

    Args:
        surface: n vertices, in one piece.
        over: its connection.
        node: (n,) number of each vertex, as `nodes_of` returns it. The function is 0 at number 0, whose source is
            what the others leave.

    Raises:
        FieldError: the system is singular.
    """

    def __init__(self, surface: Surface, over: Connection, *, node: IntArray) -> None:
        self._over, self._node, self._count = over, node, int(node.max()) + 1
        whole = coo_array(cotangent_laplacian(surface))
        summed = (whole.data, (node[whole.row], node[whole.col]))
        matrix = csc_array(coo_array(summed, shape=(self._count, self._count)))[1:, 1:]
        # A rim stands where its last vertex is.
        places = np.empty((self._count, 3))
        places[node] = surface.vertices
        self._solver = None
        if self._count > 1:
            inner = csc_array(matrix)
            self._solver = SymmetricSolver(inner, order=nested_dissection(inner, coordinates=places[1:]))

    def rises(self, sources: FloatArray) -> FloatArray:
        """Return (3 m,) by how much the function of (n,) sources, summed over each number, rises along half-edges."""
        values = np.zeros(self._count)
        if self._solver is not None:
            summed = np.bincount(self._node, sources, minlength=self._count).astype(np.float64)
            values[1:] = self._solver.solve(summed[1:])
        at = values[self._node]
        return at[self._over.ends] - at[self._over.starts]


def flow(over: Connection, rises: FloatArray) -> FloatArray:
    """Return what flows across lines between the middles of faces on both sides of half-edges.

    The lines are straight from the middle of a face to that of the side and on to the middle of the next face. What
    flows across those around a vertex adds up to its part of the cotangent Laplacian.

    Args:
        over: of a surface of m faces.
        rises: (3 m,) along half-edges, that add up to 0 around each face.

    Returns:
        (3 m,) what flows out of the vertex that each half-edge ends in; 0 on the rim.
    """
    along = (over.weights * rises).reshape(-1, 3)
    # Out of the third of a face about each corner: across a line from the middle of one side to that of the other.
    out = np.roll(along, 1, axis=1) - along
    # From the middle of the face to that of each side; the three add up to nothing.
    half = ((np.roll(out, -1, axis=1) - out) / 3).ravel()
    return np.where(over.twins < 0, 0.0, half - half[over.twins])
