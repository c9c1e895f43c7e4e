"""Level curves of an image by marching squares [Lorensen1987]: all levels in one pass, over the cells that they cross.

A library that draws one level after the other looks at every cell for each; here each cell is looked at once, and
cells of which a corner is unknown, such as those that no level can reach, are left out.

A value that equals a level counts as below it. In the two ambiguous cells, where the corners alternate, the mean of the
four decides: it is the value in the middle of the cell. The boundary of a cell, walked counter-clockwise, comes down
through a level where a piece of its curve enters and goes up where it leaves, so that larger values lie on its left.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import final

import numpy as np

from geoprint.kernels import inner, njit
from geoprint.model import BoolArray, FloatArray, IntArray, frozen

# Sides of a cell, counter-clockwise: each goes from one corner to the next, the first from the lowest row and column.
LOWER, RIGHT, UPPER, LEFT = 0, 1, 2, 3
# Sides in the order in which pieces that enter by them are told.
TOLD = np.array([LOWER, LEFT, RIGHT, UPPER])
# Columns of a table of pieces: the level, the edges by which a piece enters its cell and leaves it, and whether these
# are the right and the upper one.
AT_LEVEL, ENTERED, LEFT_BY, AT_CORNER = 0, 1, 2, 3
# Rows for which such a table has room at first.
FIRST_ROOM = 1024


@final
@frozen
class Band:
    """Neighbouring rows of an image; the last row of one band is the first of the next.

    Attributes:
        first: row of the image that is the first.
        values: (rows, columns); NaN where nothing is known.
    """

    first: int
    values: FloatArray


def level_lines(bands: Iterable[Band], *, levels: FloatArray) -> list[list[FloatArray]]:
    """Return the level curves of an image, larger values on their left.

    Args:
        bands: all of its rows, from the first on; one is looked at after the other.
        levels: (l,) rising.

    Returns:
        For each level its (k, 2) polylines, column and row of each corner, in the order of the rows in which they
        begin. A closed one repeats its first point and begins in the lowest row that it visits; others begin and end
        at an edge beyond which nothing is known.
    """
    found = [cell_pieces(band.values, band.first, levels) for band in bands]
    numbers, places = (np.concatenate(parts) for parts in zip(*found, strict=True))
    # Pieces of a level stay in the order of their cells.
    order = np.argsort(numbers[:, AT_LEVEL], kind="stable")
    ends = np.cumsum(np.bincount(numbers[:, AT_LEVEL], minlength=levels.size))
    return [_joined(numbers[part], places[part]) for part in np.split(order, ends[:-1])]


def _joined(numbers: IntArray, places: FloatArray) -> list[FloatArray]:
    """Join the pieces of one level, as `cell_pieces` lists them, head to tail."""
    entered, left = numbers[:, ENTERED], numbers[:, LEFT_BY]
    order = np.argsort(entered)
    following = np.append(order, -1)[np.searchsorted(entered[order], left)]
    following[entered[following] != left] = -1
    chain, offsets, closed = chained(following, numbers[:, AT_CORNER] > 0)
    lines: list[FloatArray] = []
    for begin, end, whole in zip(offsets[:-1].tolist(), offsets[1:].tolist(), closed.tolist(), strict=True):
        line = np.empty((end - begin + 1, 2))
        line[:-1] = places[chain[begin:end], :2]
        line[-1] = line[0] if whole else places[chain[end - 1], 2:]
        lines.append(line)
    return lines


@njit
def chained(following: IntArray, corner: BoolArray) -> tuple[IntArray, IntArray, BoolArray]:
    """Order pieces along their lines.

    Args:
        following: (k,) the piece that goes on where each ends, or -1.
        corner: (k,) pieces at one of which a closed line begins; each has some.

    Returns:
        (k,) pieces, line after line; (c + 1,) where each line begins; (c,) which are closed. Lines come in the order
        of the pieces with which they begin.
    """
    begins, free = np.ones(following.size, np.bool_), np.ones(following.size, np.bool_)
    for piece in following:
        if piece >= 0:
            begins[piece] = False
    for first in np.flatnonzero(begins):
        piece = first
        while piece >= 0:
            free[piece] = False
            piece = following[piece]
    order, offsets = np.empty(following.size, np.int64), np.zeros(following.size + 1, np.int64)
    closed = np.zeros(following.size, np.bool_)
    count = lines = 0
    for first in range(following.size):
        if begins[first] or (free[first] and corner[first]):
            piece = first
            while piece >= 0 and (begins[first] or free[piece]):
                free[piece] = False
                order[count] = piece
                count += 1
                piece = following[piece]
            closed[lines] = not begins[first]
            lines += 1
            offsets[lines] = count
    return order, offsets[: lines + 1], closed[:lines]


@njit
def cell_pieces(values: FloatArray, first: int, levels: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the pieces of all level curves in the cells of a band, row by row.

    Args:
        values: (rows, columns); NaN where nothing is known.
        first: row of the image that is the first.
        levels: (l,) rising.

    Returns:
        The (k, 4) table of pieces, and (k, 4) column and row of their first and last points.
    """
    numbers, places = np.empty((FIRST_ROOM, 4), np.int64), np.empty((FIRST_ROOM, 4))
    cell, count, level = np.empty(4), 0, 0
    for row in range(values.shape[0] - 1):
        for column in range(values.shape[1] - 1):
            cell[0], cell[1] = values[row, column], values[row, column + 1]
            cell[2], cell[3] = values[row + 1, column + 1], values[row + 1, column]
            low, high = min(cell[0], cell[1], cell[2], cell[3]), max(cell[0], cell[1], cell[2], cell[3])
            if not low < high or np.isnan(cell[0] + cell[1] + cell[2] + cell[3]):
                continue
            # The first level that is not below all corners, from that of the cell before.
            while level < levels.size and levels[level] < low:
                level += 1
            while level > 0 and levels[level - 1] >= low:
                level -= 1
            passing = level
            while passing < levels.size and levels[passing] < high:
                if count + 2 > len(places):
                    numbers, places = np.concatenate((numbers, numbers)), np.concatenate((places, places))
                place = row + first, column, values.shape[1]
                added = cross(cell, levels[passing], place, numbers[count:], places[count:])
                numbers[count : count + added, AT_LEVEL] = passing
                count, passing = count + added, passing + 1
    return numbers[:count].copy(), places[:count].copy()


@inner
def cross(cell: FloatArray, level: float, place: tuple[int, int, int], numbers: IntArray, places: FloatArray) -> int:
    """Write the pieces of one level in one cell, as `cell_pieces` lists them, and return their number: 1 or 2.

    Args:
        cell: (4,) values at its corners, counter-clockwise from the lowest row and column.
        level: that passes through it.
        place: row and column of its first corner, and columns of the image.
        numbers: rows to fill, but for the level.
        places: rows to fill.
    """
    saddle = (cell[0] > level) == (cell[2] > level) and (cell[1] > level) == (cell[3] > level)
    # Where the middle is high a piece cuts off a low corner: it leaves by the side behind the one by which it enters.
    turn = 1 if not saddle or 0.25 * (cell[0] + cell[1] + cell[3] + cell[2]) > level else 3
    count = 0
    for side in TOLD:
        if cell[side] > level and not cell[(side + 1) % 4] > level:
            other = (side + turn) % 4
            while not (cell[(other + 1) % 4] > level and not cell[other] > level):
                other = (other + turn) % 4
            numbers[count, ENTERED], numbers[count, LEFT_BY] = edge(side, place), edge(other, place)
            numbers[count, AT_CORNER] = (side == RIGHT and other == UPPER) or (side == UPPER and other == RIGHT)
            point_on(cell, (side, (side + 1) % 4), level, place, places[count, :2])
            point_on(cell, ((other + 1) % 4, other), level, place, places[count, 2:])
            count += 1
    return count


@inner
def edge(side: int, place: tuple[int, int, int]) -> int:
    """Return the number of the edge of an image at a side of a cell: even ones go along rows, odd ones across."""
    row, column, columns = place
    pixel = (row + (side == UPPER)) * columns + column + (side == RIGHT)
    return 2 * pixel + (side in (RIGHT, LEFT))


@inner
def point_on(
    cell: FloatArray, ends: tuple[int, int], level: float, place: tuple[int, int, int], point: FloatArray
) -> None:
    """Write column and row of the point between two corners of a cell at which values, linear there, are at a level."""
    high, low = ends
    share = (cell[low] - level) / (cell[low] - cell[high])
    row, column, _ = place
    point[0] = (column + (high in (1, 2))) * share + (column + (low in (1, 2))) * (1.0 - share)
    point[1] = (row + (high >= 2)) * share + (row + (low >= 2)) * (1.0 - share)
