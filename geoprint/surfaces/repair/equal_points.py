"""Points that are equal to the last bit, found through a hash table: sorting millions of them takes seconds."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geoprint.kernels import inner, njit
from geoprint.model import FloatArray, IntArray

BitArray: TypeAlias = NDArray[np.uint64]

# Odd numbers without pattern: the coordinates of a grid, too, spread over the table. Of 2^64 / golden ratio [Knuth1998,
# sec. 6.4] and two of its like.
FACTORS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)
NEGATIVE_ZERO = np.uint64(1 << 63)
# Places for each point in the table: with half of them free a search ends after a few.
PLACES_PER_POINT = 2


def first_equal(points: FloatArray) -> IntArray:
    """Return for each of (k, 3) finite points the first one that is equal to it.

    Examples:
        >>> first_equal(np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 3.0], [-0.0, 1.0, 2.0]]))
        array([0, 1, 0])
    """
    return _first_equal(np.ascontiguousarray(points).view(np.uint64), PLACES_PER_POINT * len(points))


@njit
def _first_equal(bits: BitArray, room: int) -> IntArray:
    size = 1
    while size < room:
        size *= 2
    table = np.full(size, -1, np.int32)
    found = np.empty(bits.shape[0], np.int64)
    mask = np.uint64(size - 1)
    for point in range(bits.shape[0]):
        x, y, z = unsigned(bits[point, 0]), unsigned(bits[point, 1]), unsigned(bits[point, 2])
        mixed = x * FACTORS[0] ^ y * FACTORS[1] ^ z * FACTORS[2]
        mixed ^= mixed >> np.uint64(32)
        place = (mixed * FACTORS[0] >> np.uint64(16)) & mask
        while True:
            other = int(table[place])
            if other < 0:
                table[place], found[point] = point, point
                break
            u, v, w = unsigned(bits[other, 0]), unsigned(bits[other, 1]), unsigned(bits[other, 2])
            if x == u and y == v and z == w:
                found[point] = other
                break
            place = (place + np.uint64(1)) & mask
    return found


@inner
def unsigned(bits: np.uint64) -> np.uint64:
    """Return the bits of a number, without the sign where it is a zero: the two zeros are equal."""
    return np.uint64(0) if bits == NEGATIVE_ZERO else bits
