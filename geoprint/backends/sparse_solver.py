"""A direct solver for the sparse symmetric positive definite systems of meshes: factorise once, solve often.

SciPy's SuperLU on an order of our own. Its built-in orders are made for unsymmetric matrices and leave several times
more fill on a mesh than nested dissection [George1973], which cuts the mesh in half again and again and eliminates
the cut last; on coordinates the cut is a median and needs no graph partitioner.
"""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from geoprint.errors import FieldError
from geoprint.model import BoolArray, FloatArray, IntArray

# Blocks of this many unknowns are no longer cut: their fill is cheaper than the bookkeeping.
LEAF_SIZE = 96


@final
class SymmetricSolver:
    """Solves A x = b for one sparse symmetric positive definite A and many b.

    Args:
        matrix: (n, n) sparse, symmetric positive definite.
        order: (n,) a permutation of the unknowns, in which they are eliminated, as `nested_dissection` returns it;
            only time and memory depend on it, not the result.

    Raises:
        FieldError: the matrix is singular.
    """

    def __init__(self, matrix: csc_array, *, order: IntArray) -> None:
        self._order = order
        ordered = csc_array(matrix[self._order][:, self._order])
        try:
            self._factor = splu(ordered, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError as error:
            raise FieldError(
                f"the linear system of {matrix.shape[0]} unknowns is singular ({error}); part of the surface has no "
                "connection to the seed or degenerate triangles: check the mesh, or choose another seed."
            ) from error

    def solve(self, right_hand_side: FloatArray) -> FloatArray:
        """Return the (n,) solution for an (n,) right-hand side."""
        solution = np.empty_like(right_hand_side)
        solution[self._order] = self._factor.solve(right_hand_side[self._order])
        return solution


def nested_dissection(matrix: csc_array, *, coordinates: FloatArray) -> IntArray:
    """Order the unknowns of a mesh matrix so that its factor stays sparse.

    Args:
        matrix: (n, n) sparse, symmetric in structure.
        coordinates: (n, 3) position of each unknown.

    Returns:
        (n,) a permutation of 0 ... n - 1, separators after the halves they part.
    """
    count = matrix.shape[0]
    starts, neighbours = matrix.indptr.astype(np.int64), matrix.indices
    in_upper_half = np.zeros(count, dtype=np.bool_)
    blocks = [np.arange(count)]
    backwards: list[IntArray] = []
    while blocks:
        block = blocks.pop()
        if block.size <= LEAF_SIZE:
            backwards.append(block)
            continue
        here = coordinates[block]
        axis = int(np.argmax(np.ptp(here, axis=0)))
        halves = np.argpartition(here[:, axis], block.size // 2)
        lower, upper = block[halves[: block.size // 2]], block[halves[block.size // 2 :]]
        in_upper_half[upper] = True
        cut = _touches(lower, in_upper_half, starts=starts, neighbours=neighbours)
        in_upper_half[upper] = False
        backwards.append(lower[cut])
        blocks.extend((lower[~cut], upper))
    return np.concatenate(backwards[::-1])


def _touches(rows: IntArray, marked: BoolArray, *, starts: IntArray, neighbours: NDArray[np.int32]) -> BoolArray:
    """Tell for each row whether one of its neighbours is marked."""
    lengths = starts[rows + 1] - starts[rows]
    ends: IntArray = np.cumsum(lengths)
    entries = np.arange(int(ends[-1])) + np.repeat(starts[rows] - (ends - lengths), lengths)
    touches = np.zeros(rows.size, dtype=np.bool_)
    touches[np.repeat(np.arange(rows.size), lengths)[marked[neighbours[entries]]]] = True
    return touches
