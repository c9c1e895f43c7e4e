"""A flat region as an image: distance transform, and level curves by marching squares [Lorensen1987]."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import final

import numpy as np
from scipy.ndimage import binary_dilation, map_coordinates

from geoprint.distance.lscm_seam import UNCUT, Continuation
from geoprint.distance.segment_distance import ALL, WANTED, ByteArray, counted, measure_pixels
from geoprint.kernels import inner, njit
from geoprint.model import BoolArray, FloatArray, IntArray, freeze_arrays, frozen

# Level curves of an image by marching squares [Lorensen1987]: all levels in one pass, over the cells that they
# cross.
#
# A library that draws one level after the other looks at every cell for each; here each cell is looked at once, and
# cells of which a corner is unknown, such as those that no level can reach, are left out.
#
# A value that equals a level counts as below it. In the two ambiguous cells, where the corners alternate, the mean
# of the four decides: it is the value in the middle of the cell. The boundary of a cell, walked counter-clockwise,
# comes down through a level where a piece of its curve enters and goes up where it leaves, so that larger values lie
# on its left.


# Sides of a cell, counter-clockwise: each goes from one corner to the next, the first from the lowest row and column.
LOWER, RIGHT, UPPER, LEFT = 0, 1, 2, 3
# Sides in the order in which pieces that enter by them are told.
TOLD = np.array([LOWER, LEFT, RIGHT, UPPER])
# Columns of a table of pieces: the level, the edges by which a piece enters its cell and leaves it, and whether these
# are the right and the upper one.
AT_LEVEL, ENTERED, LEFT_BY, AT_CORNER = 0, 1, 2, 3
# Rows for which such a table has room at first.
FIRST_ROOM = 1024


def level_lines(bands: Iterable[tuple[int, FloatArray]], *, levels: FloatArray) -> list[list[FloatArray]]:
    """Return the level curves of an image, larger values on their left.

    Args:
        bands: all of its rows, one band after the other: the row that is the first in it, and its (rows, columns)
            values, NaN where nothing is known. The last row of a band is the first of the next.
        levels: (l,) rising.

    Returns:
        For each level its (k, 2) polylines, column and row of each corner, in the order of the rows in which they
        begin. A closed one repeats its first point and begins in the lowest row that it visits; others begin and end
        at an edge beyond which nothing is known.
    """
    found = [cell_pieces(values, first, levels) for first, values in bands]
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


# A flat region as an image: distance of its pixels to segments, and level curves of the image.
#
# Distances are those to the segments themselves, not to pixels: each is exact, so what reaches the paths of the
# raster is the interpolation between pixels alone. Where the distance has a kink, midway between two parts of the
# border, that rounds a corner of a level curve by a fraction of a pixel; where it curves with radius r it moves a
# curve by at most pixel^2 / (8 r); elsewhere the distance is linear and its curves are exact.
#
# An image holds a byte a pixel and the segments; distances are measured when they are asked for, of those pixels
# alone that matter to the answer, a band of rows after the other.


# Pixels measured around the region: level curves are followed beyond its border before they are cut there.
MARGIN = 2
# Marks of a pixel beside WANTED: it lies in the region or its continuation, and in the half of the chart at the side
# of a cut that the copy one round forward continues, or the one back.
INSIDE = 2
BESIDE = {1: 4, -1: 8}
# Rows of an image that are measured together: a few megabytes.
BAND_ROWS = 128


@final
@frozen
class DistanceImage:
    """Distances at the centres of square pixels; the centre of (row, column) is at origin + pixel * (column, row).

    Attributes:
        marks: (rows, columns) what is known of each pixel, added up; those of the region and around it are `WANTED`.
        origin: (2,) centre of the first pixel [mm].
        pixel: side of a pixel [mm].
        segments: (s, 2, 2) that distance is measured from, columns and rows.
        sides: (s,) the mark of the pixels that a segment counts for, such as an image beyond a cut; 0 for all.
        outside: sign of the distances outside the region: -1 of the distance to its border, else 1.
    """

    marks: ByteArray
    origin: FloatArray
    pixel: float
    segments: FloatArray
    sides: ByteArray
    outside: int

    def __post_init__(self) -> None:
        # Shared, not copied: the marks may be 70 MB.
        self.marks.setflags(write=False)
        self.sides.setflags(write=False)
        freeze_arrays(self, origin="float: 2", segments="float: s 2 2")

    @property
    def measured(self) -> BoolArray:
        """The (rows, columns) pixels of the region and around it."""
        return (self.marks & WANTED) > 0

    @property
    def values(self) -> FloatArray:
        """The (rows, columns) distances [mm]; those of pixels that are not measured are 0, or minus the margin.

        All of them take 8 bytes a pixel: level curves and samples do without.
        """
        return self._filled(self._measured(self.marks, 0, asked=ALL))

    def sample(self, points: FloatArray) -> FloatArray:
        """Return the (k,) bilinearly interpolated distance at (k, 2) points [mm]."""
        columns, rows = ((points - self.origin) / self.pixel).T
        below, left = (
            np.clip(np.floor(along).astype(np.int64), 0, count - 2)
            for along, count in zip((rows, columns), self.marks.shape, strict=True)
        )
        found = np.empty(len(points))
        order = np.argsort(below, kind="stable")
        for first, last in self._bands():
            here = order[slice(*np.searchsorted(below[order], [first, last]))]
            if here.size:
                marks = np.zeros_like(self.marks[first : last + 1])
                for down, right in ((0, 0), (0, 1), (1, 0), (1, 1)):
                    corner = below[here] - first + down, left[here] + right
                    marks[corner] = self.marks[first : last + 1][corner]
                # The kernel is compiled for what nobody writes.
                marks.setflags(write=False)
                values = self._filled(self._measured(marks, first, asked=ALL))
                places = [rows[here] - first, columns[here]]
                found[here] = map_coordinates(values, places, order=1, mode="nearest")
        return found

    def contours(self, levels: FloatArray) -> list[list[FloatArray]]:
        """Return the level curves of every level by marching squares [Lorensen1987], larger values on the left.

        Cells with a corner that was not measured are left out.

        Args:
            levels: (l,) rising distances [mm].

        Returns:
            For each level its (k, 2) polylines [mm], as `level_lines`; a closed one repeats its first point.
        """
        found = level_lines(self._bands_near(levels), levels=levels)
        return [[line * self.pixel + self.origin for line in lines] for lines in found]

    def _bands_near(self, levels: FloatArray) -> Iterator[tuple[int, FloatArray]]:
        """Yield all rows, measured where a level can pass."""
        asked = np.sort(np.abs(levels)) / self.pixel
        for first, last in self._bands():
            yield first, self._measured(self.marks[first : last + 1], first, asked=asked)

    def _bands(self) -> Iterator[tuple[int, int]]:
        """Yield the first and the last row of every band, the last of one being the first of the next."""
        rows = len(self.marks) - 1
        for first in range(0, rows, BAND_ROWS):
            yield first, min(first + BAND_ROWS, rows)

    def _measured(self, marks: ByteArray, first: int, *, asked: FloatArray) -> FloatArray:
        """Return the distances of pixels [mm] with these marks, in rows from the first on; NaN where none is asked for.

        Args:
            marks: (rows, columns).
            first: row of the image.
            asked: (l,) rising distances in pixels.
        """
        values = np.full(marks.shape, np.nan)
        measure_pixels(counted(self.segments, self.sides), marks, first, asked, values)
        values *= self.pixel
        if self.outside < 0:
            np.negative(values, out=values, where=(marks & INSIDE) == 0)
        return values

    def _filled(self, values: FloatArray) -> FloatArray:
        """Put a number where nothing was measured."""
        return np.where(np.isnan(values), -MARGIN * self.pixel if self.outside < 0 else 0.0, values)


def region_image(border: FloatArray, *, resolution: int, continuation: Continuation = UNCUT) -> DistanceImage:
    """Return the distance to the border of a region, positive inside, negative outside.

    Args:
        border: (s, 2, 2) x and y of both ends of every segment of its border [mm]; with the sides of the cut, if there
            is one, any number of closed loops. Inside is what an odd number of them surrounds.
        resolution: pixels along the longer side of the region's bounding box.
        continuation: how the region goes on beyond a cut, which is no border.

    Returns:
        The image. Within the margin of a cut the pixels of the region's continuation are inside too.
    """
    outline = np.concatenate([border, continuation.sides])
    low, high = outline.min(axis=(0, 1)), outline.max(axis=(0, 1))
    pixel = float((high - low).max()) / resolution
    origin = low + (0.5 - MARGIN) * pixel
    columns, rows = image_size(high - low, resolution=resolution)
    inside = filled((outline - origin) / pixel, shape=(rows, columns))
    measured = np.asarray(binary_dilation(inside, np.ones((3, 3), dtype=np.bool_), iterations=MARGIN))
    marks = measured.astype(np.uint8)
    x, y = origin[0] + pixel * np.arange(columns), origin[1] + pixel * np.arange(rows)[:, None]
    for rounds in continuation.rounds:
        beside = measured & continuation.beside(x, y, rounds=rounds)
        copy = (continuation.moved(outline, rounds=rounds) - origin) / pixel
        inside |= beside & filled(copy, shape=(rows, columns))
        marks |= BESIDE[rounds] * beside.astype(np.uint8)
    marks |= INSIDE * inside.astype(np.uint8)
    return _image(marks, origin, pixel, border, continuation=continuation, outside=-1)


def source_image(region: DistanceImage, source: FloatArray, *, continuation: Continuation = UNCUT) -> DistanceImage:
    """Return the straight distance to (s, 2, 2) segments [mm] on the pixels of a region and its margin.

    The straight line may leave the region, through a hole or across a bay of its border.
    """
    return _image(region.marks, region.origin, region.pixel, source, continuation=continuation, outside=1)


def _image(
    marks: ByteArray,
    origin: FloatArray,
    pixel: float,
    segments: FloatArray,
    *,
    continuation: Continuation,
    outside: int,
) -> DistanceImage:
    """Return the distance from segments [mm], and from their images in the copies at a cut for the pixels beside it."""
    parts, sides = [segments], [np.zeros(len(segments), dtype=np.uint8)]
    for rounds in continuation.rounds:
        parts.append(continuation.beyond(segments, rounds=rounds))
        sides.append(np.full(len(parts[-1]), BESIDE[rounds], dtype=np.uint8))
    placed = (np.concatenate(parts) - origin) / pixel
    return DistanceImage(marks, origin, pixel, placed, np.concatenate(sides), outside)


def image_size(size: FloatArray, *, resolution: int) -> tuple[int, int]:
    """Return the columns and rows of the image of a box of a size (2,) [mm], margins included.

    Examples:
        >>> image_size(np.array([40.0, 30.0]), resolution=100)
        (104, 79)
    """
    columns, rows = np.ceil(size * (resolution / size.max())).astype(np.int64) + 2 * MARGIN
    return int(columns), int(rows)


def clipped(line: FloatArray, *, depth: FloatArray, shortest: float) -> list[FloatArray]:
    """Cut a polyline where it leaves a region.

    Args:
        line: (k, 2) corners [mm]; a closed one repeats its first.
        depth: (k,) how deep in the region they lie, negative outside [mm], as `region_image` samples it.
        shortest: pieces below this length [mm] are left out.

    Returns:
        The pieces inside, in order and direction of the line; the line itself where it never leaves.
    """
    inside = depth >= 0.0
    if inside.all():
        return [line]
    if bool((line[0] == line[-1]).all()):
        first = int(np.argmin(inside))
        order = np.append(np.roll(np.arange(len(line) - 1), -first), first)
        line, depth, inside = line[order], depth[order], inside[order]
    enters = np.flatnonzero(~inside[:-1] & inside[1:])
    leaves = np.flatnonzero(inside[:-1] & ~inside[1:])
    share = depth[:-1] / np.where(inside[:-1] != inside[1:], depth[:-1] - depth[1:], 1.0)
    crossings = line[:-1] + share[:, None] * np.diff(line, axis=0)
    begins: IntArray = np.concatenate([[-1] if inside[0] else [], enters]).astype(np.int64)
    ends: IntArray = np.concatenate([leaves, [len(line) - 1] if inside[-1] else []]).astype(np.int64)
    pieces: list[FloatArray] = []
    for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
        before = crossings[begin : begin + 1] if begin >= 0 else line[:0]
        after = crossings[end : end + 1] if end < len(line) - 1 else line[:0]
        piece = np.vstack([before, line[begin + 1 : end + 1], after])
        if float(np.linalg.norm(np.diff(piece, axis=0), axis=1).sum()) >= shortest:
            pieces.append(piece)
    return pieces


def filled(segments: FloatArray, *, shape: tuple[int, int]) -> BoolArray:
    """Tell which pixel centres closed loops surround, by the even-odd rule.

    Each row of centres is crossed by segments; a centre is inside when an odd number of crossings lies to its left.

    Args:
        segments: (s, 2, 2) x and y of both ends in pixels, all segments of closed loops in any order; they may
            reach beyond the image.
        shape: rows and columns.

    Returns:
        (rows, columns) inside or not; a centre on the lower or right border may count as inside.

    Examples:
        >>> corners = np.array([[0.5, 0.5], [2.5, 0.5], [2.5, 1.5], [0.5, 1.5]])
        >>> filled(np.stack([corners, np.roll(corners, -1, axis=0)], axis=1), shape=(3, 4)).astype(int)
        array([[0, 0, 0, 0], [0, 1, 1, 0], [0, 0, 0, 0]])
    """
    start, end = segments[:, 0], segments[:, 1]
    first, last = (
        np.clip(np.ceil(side(start[:, 1], end[:, 1])), 0, shape[0]).astype(np.int64)
        for side in (np.minimum, np.maximum)
    )
    crossed = last - first
    edge = np.repeat(np.arange(int(crossed.size)), crossed)
    row = np.arange(edge.size) - np.repeat(np.cumsum(crossed) - crossed - first, crossed)
    share = (row - start[edge, 1]) / (end[edge, 1] - start[edge, 1])
    x = start[edge, 0] + share * (end[edge, 0] - start[edge, 0])
    crossings = np.zeros((shape[0], shape[1] + 1), dtype=np.bool_)
    column = np.clip(np.ceil(x).astype(np.int64), 0, shape[1])
    np.logical_not.at(crossings, (row, column))
    return np.asarray(np.logical_xor.accumulate(crossings, axis=1)[:, :-1])
