"""A direct solver for the sparse symmetric positive definite systems of meshes: factorise once, solve often.

SciPy's SuperLU on an order of our own, or CHOLMOD where the user has scikit-sparse 0.5 or newer, which geoprint does
not require because a part of it is GPL. SuperLU's built-in orders are made for unsymmetric matrices and leave several
times more fill on a mesh than nested dissection [George1973], which cuts the mesh in half again and again and
eliminates the cut last; on coordinates the cut is a median and needs no graph partitioner.
"""

from __future__ import annotations

from typing import Protocol, TypeAlias, TypeVar, final, overload

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from geoprint.errors import FieldError
from geoprint.kernels import inner, njit, writable
from geoprint.model import FloatArray, IntArray
from geoprint.threads import single_threaded_blas

# Blocks of this many unknowns are no longer cut: nothing is left to save.
LEAF_SIZE = 8
# Axes along which a block measures less than this share of its longest one are not tried for a cut.
SHORT_AXIS = 0.5
# Marks of the halves of a block; 0 is outside it.
LOWER, UPPER = 1, 2

# Where the neighbours of each unknown start, and the neighbours.
Graph: TypeAlias = tuple[NDArray[np.int32], NDArray[np.int32]]
SideArray: TypeAlias = NDArray[np.int8]
ComplexArray: TypeAlias = NDArray[np.complex128]
# Solutions are of the kind of their right-hand side: complex where the matrix is.
Values = TypeVar("Values", FloatArray, ComplexArray)


class Factor(Protocol):
    """A factorised matrix."""

    @overload
    def solve(self, b: FloatArray, /) -> FloatArray: ...
    @overload
    def solve(self, b: ComplexArray, /) -> ComplexArray: ...


@final
class SymmetricSolver:
    """Solves A x = b for one sparse positive definite A, symmetric or, if complex, Hermitian, and many b.

    Args:
        matrix: (n, n) sparse, symmetric or Hermitian, positive definite.
        order: (n,) a permutation of the unknowns, in which they are eliminated, as `nested_dissection` returns it;
            only time and memory depend on it, not the result.

    Raises:
        FieldError: the matrix is singular.
    """

    def __init__(self, matrix: csc_array, *, order: IntArray) -> None:
        self._order = order
        self._factor = factorised(picked(matrix, order))

    def solve(self, right_hand_side: Values) -> Values:
        """Return the (n,) solution for an (n,) right-hand side, complex if and only if the matrix is."""
        solution = np.empty_like(right_hand_side)
        solution[self._order] = self._factor.solve(right_hand_side[self._order])
        return solution


def factorised(matrix: csc_array) -> Factor:
    """Factorise with CHOLMOD where it is installed, otherwise as `superlu`.

    Raises:
        FieldError: the matrix is singular.
    """
    try:
        from sksparse.cholmod import CholmodError, cho_factor
    except ImportError:
        return superlu(matrix)
    try:
        return cho_factor(matrix)
    except CholmodError as error:
        raise _singular(matrix, error) from error


def superlu(matrix: csc_array) -> Factor:
    """Factorise with SciPy alone, unknowns in the order in which they come, pivots on the diagonal.

    Raises:
        FieldError: the matrix is singular.
        MemoryError: memory ran out, which SuperLU says in several words, of which SciPy knows one.
    """
    try:
        with single_threaded_blas():
            return splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError as error:
        if "singular" not in str(error):
            raise MemoryError(str(error)) from error
        raise _singular(matrix, error) from error


def picked(matrix: csc_array, chosen: IntArray) -> csc_array:
    """Return the (k, k) rows and columns of (n, n) that (k,) different numbers choose, in their order."""
    starts, rows, entries = _picked(_graph(matrix), chosen)
    return csc_array((matrix.data[entries], rows, starts), shape=(chosen.size, chosen.size))


@njit
def _picked(graph: Graph, chosen: IntArray) -> tuple[NDArray[np.int32], NDArray[np.int32], IntArray]:
    """Return where columns start, and the rows and numbers of their entries; only each column is looked through."""
    starts, rows = graph
    places = np.full(starts.size - 1, -1, np.int32)
    for k in range(chosen.size):
        places[chosen[k]] = k
    new_starts, new_rows = np.empty(chosen.size + 1, np.int32), np.empty(rows.size, np.int32)
    entries = np.empty(rows.size, np.int64)
    count = 0
    for k in range(chosen.size):
        new_starts[k] = count
        for entry in range(starts[chosen[k]], starts[chosen[k] + 1]):
            if places[rows[entry]] >= 0:
                new_rows[count], entries[count] = places[rows[entry]], entry
                count += 1
    new_starts[chosen.size] = count
    return new_starts, new_rows[:count].copy(), entries[:count].copy()


def _graph(matrix: csc_array) -> Graph:
    """Return where the columns of a matrix start and the rows of its entries, as loops are compiled for them."""
    return matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32)


def _singular(matrix: csc_array, error: Exception) -> FieldError:
    return FieldError(
        f"the linear system of {matrix.shape[0]} unknowns is singular ({error}). Check the mesh for degenerate "
        "triangles and for parts not connected to the source."
    )


def nested_dissection(matrix: csc_array, *, coordinates: FloatArray) -> IntArray:
    """Order the unknowns of a mesh matrix so that its factor stays sparse.

    A block is cut at the median along one axis; of the axes along which it is long, the one with the fewest unknowns
    in the cut is taken, and of the two sides of the cut the smaller.

    Args:
        matrix: (n, n) sparse, symmetric in structure.
        coordinates: (n, 3) position of each unknown.

    Returns:
        (n,) a permutation of 0 ... n - 1, separators after the halves they part.
    """
    return _dissected(_graph(matrix), writable(coordinates))


@njit
def _dissected(graph: Graph, coordinates: FloatArray) -> IntArray:
    """Cut blocks, each a range of the order, until they are leaves."""
    size = coordinates.shape[0]
    order, block, side = np.empty(size, np.int64), np.empty(size, np.int64), np.empty(size, np.int8)
    here = np.empty(size)
    for vertex in range(size):
        order[vertex], side[vertex] = vertex, 0
    # Each block leaves two smaller ones, so that the stack never holds more blocks than there are unknowns.
    blocks = np.empty((size + 1, 2), np.int64)
    blocks[0, 0], blocks[0, 1] = 0, size
    count = 1
    while count > 0:
        count -= 1
        low, high = blocks[count, 0], blocks[count, 1]
        if high - low <= LEAF_SIZE:
            continue
        for place in range(low, high):
            block[place] = order[place]
        axis, cut_side = _best_cut(block, low, high, side, here, graph, coordinates)
        if axis >= 0:
            _mark_halves(block, low, high, side, here, coordinates, axis)
            middle, end = _arrange(order, block, low, high, side, cut_side, graph)
            blocks[count, 0], blocks[count, 1] = low, middle
            blocks[count + 1, 0], blocks[count + 1, 1] = middle, end
            count += 2
        for place in range(low, high):
            side[order[place]] = 0
    return order


@inner
def _best_cut(
    block: IntArray, low: int, high: int, side: SideArray, here: FloatArray, graph: Graph, coordinates: FloatArray
) -> tuple[int, int]:
    """Return the axis with the smallest cut and the side to take it from; axis -1 where nothing can be cut."""
    widest = 0.0
    for axis in range(coordinates.shape[1]):
        widest = max(widest, _extent(block, low, high, coordinates, axis))
    best, best_side, fewest = -1, LOWER, high - low
    for axis in range(coordinates.shape[1]):
        if _extent(block, low, high, coordinates, axis) <= SHORT_AXIS * widest:
            continue
        _mark_halves(block, low, high, side, here, coordinates, axis)
        for cut_side in (LOWER, UPPER):
            size = 0
            for place in range(low, high):
                size += side[block[place]] == cut_side and _crosses(block[place], side, graph)
            if size < fewest:
                best, best_side, fewest = axis, cut_side, size
    return best, best_side


@inner
def _extent(block: IntArray, low: int, high: int, coordinates: FloatArray, axis: int) -> float:
    """Return how long a block is along an axis."""
    least, most = np.inf, -np.inf
    for place in range(low, high):
        value = coordinates[block[place], axis]
        least, most = min(least, value), max(most, value)
    return most - least


@inner
def _mark_halves(
    block: IntArray, low: int, high: int, side: SideArray, here: FloatArray, coordinates: FloatArray, axis: int
) -> None:
    """Mark what lies below the median as lower and the rest as upper.

    Where so many lie at the median that nothing is below it, only what is above it is the upper half.
    """
    least = np.inf
    for place in range(low, high):
        here[place] = coordinates[block[place], axis]
        least = min(least, here[place])
    median = _ranked(here, low, high - 1, low + (high - low) // 2)
    for place in range(low, high):
        value = coordinates[block[place], axis]
        side[block[place]] = LOWER if value < median or value == least else UPPER


@inner
def _ranked(values: FloatArray, first: int, last: int, rank: int) -> float:
    """Return what would stand at a place if the values from the first to the last were sorted [Knuth1998, sec. 5.2.2].

    They are rearranged as quicksort does it. NumPy's partition would be compiled for seconds.
    """
    while first < last:
        pivot = values[(first + last) // 2]
        i, j = first, last
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i, j = i + 1, j - 1
        if rank <= j:
            last = j
        elif rank >= i:
            first = i
        else:
            break
    return values[rank]


@inner
def _crosses(vertex: int, side: SideArray, graph: Graph) -> bool:
    """Tell whether an unknown has a neighbour on the other side of the cut."""
    starts, neighbours = graph
    crossing = False
    for entry in range(starts[vertex], starts[vertex + 1]):
        crossing |= side[neighbours[entry]] == 3 - side[vertex]
    return crossing


@inner
def _arrange(
    order: IntArray, block: IntArray, low: int, high: int, side: SideArray, cut_side: int, graph: Graph
) -> tuple[int, int]:
    """Write the lower half, the upper half and the cut into the order; return where the first and second end.

    What the block holds is lost.
    """
    lower, upper, last = low, 0, high
    for place in range(low, high):
        vertex = block[place]
        if side[vertex] == cut_side and _crosses(vertex, side, graph):
            last -= 1
            order[last] = vertex
        elif side[vertex] == LOWER:
            order[lower] = vertex
            lower += 1
        else:
            block[low + upper] = vertex
            upper += 1
    for place in range(upper):
        order[lower + place] = block[low + place]
    return lower, last
