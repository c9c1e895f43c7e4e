"""Trees over vertices and faces, and the closed walks over faces that they leave: around and through each handle.

A tree over the vertices along edges, and one over the faces that crosses none of these edges: what edges neither of
them uses are two for each handle of the surface. Crossing such an edge and going back within the tree of faces makes a
closed walk that cannot be drawn together to a point [Crane2010].
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order

from geoprint.errors import MeshError
from geoprint.fields.connection import Connection
from geoprint.kernels import njit
from geoprint.model import BoolArray, FloatArray, IntArray, freeze_arrays, frozen


@final
@frozen
class FaceTree:
    """All faces of a connected surface, from the first one outwards.

    Attributes:
        order: (m,) faces, each after the one that it is entered from.
        entries: (m,) the half-edge of that other face over which each is entered; -1 for the first.
        left: (2 g,) half-edges that close a walk each, two for each of g handles.
    """

    order: IntArray
    entries: IntArray
    left: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, order="int: m", entries="int: m", left="int: l")

    def carried(self, first: float, steps: FloatArray) -> FloatArray:
        """Return (m,) values, the first face's given, that rise by (3 m,) steps over each half-edge of the tree."""
        return _carried(self.order, self.entries, steps, first)

    def walks(self, over: Connection) -> list[tuple[IntArray, IntArray]]:
        """Return the closed walk of each edge that is left: (k,) half-edges crossed, and (k,) +1 or, back, -1.

        Half-edges that a walk crosses in both directions do not appear.
        """
        found: list[tuple[IntArray, IntArray]] = []
        for half in self.left.tolist():
            home, back = self._from_first(half // 3), self._from_first(int(over.twins[half]) // 3)
            out, away = np.setdiff1d(home, back), np.setdiff1d(back, home)
            signs = np.concatenate([np.ones(out.size + 1, dtype=np.int64), np.full(away.size, -1)])
            found.append((np.concatenate([[half], out, away]), signs))
        return found

    def _from_first(self, face: int) -> IntArray:
        """Return the half-edges over which the tree goes from the first face to another."""
        crossed: list[int] = []
        while (entry := int(self.entries[face])) >= 0:
            crossed.append(entry)
            face = entry // 3
        return np.array(crossed, dtype=np.int64)


def face_tree(over: Connection, node: IntArray) -> FaceTree:
    """Return a tree over the faces of a connected surface, and what it leaves beside a tree over the vertices.

    Args:
        over: of a surface in one piece.
        node: (n,) number of each vertex, from 0; those of a rim have one number, as if it were drawn together.

    Raises:
        MeshError: the surface is in several pieces.
    """
    inner = over.inner
    first, last = node[over.starts[inner]], node[over.ends[inner]]
    count = int(node.max()) + 1
    graph = csr_array((np.ones(inner.size, dtype=np.int8), (first, last)), shape=(count, count))
    _, before = breadth_first_order(graph, 0, directed=False)
    # Of several edges between two nodes one is in the tree.
    reached = np.where(before[last] == first, last, np.where(before[first] == last, first, -1))
    nodes, place = np.unique(reached, return_index=True)
    shut = np.zeros(over.twins.size, dtype=np.bool_)
    trunk = inner[place[nodes >= 0]]
    shut[trunk] = shut[over.twins[trunk]] = True
    order, entries = _spread(over.twins, shut)
    if order.min() < 0:
        raise MeshError("a tree over faces reaches only one piece of a surface; take its pieces one by one.")
    used = entries[entries >= 0]
    shut[used] = shut[over.twins[used]] = True
    return FaceTree(order, entries, inner[~shut[inner]])


@njit
def _spread(twins: IntArray, shut: BoolArray) -> tuple[IntArray, IntArray]:
    """Return (m,) faces in the order in which they are reached without crossing what is shut, and their entries.

    Faces that are not reached are missing: the order ends in -1.
    """
    count = twins.size // 3
    order, entries = np.full(count, -1), np.full(count, -1)
    seen = np.zeros(count, np.bool_)
    seen[0], order[0], held = True, 0, 1
    for place in range(count):
        face = order[place]
        if face < 0:
            break
        for half in range(3 * face, 3 * face + 3):
            twin = twins[half]
            if twin >= 0 and not shut[half] and not seen[twin // 3]:
                seen[twin // 3], entries[twin // 3], order[held] = True, half, twin // 3
                held += 1
    return order, entries


@njit
def _carried(order: IntArray, entries: IntArray, steps: FloatArray, first: float) -> FloatArray:
    """Return (m,) values that rise by a step over each entry."""
    values = np.empty(order.size)
    for face in order:
        entry = entries[face]
        values[face] = first if entry < 0 else values[entry // 3] + steps[entry]
    return values
