"""Exact distance to the nearest of many segments, from pixels of a grid or from points: numba kernels.

The distance transform of a binary image knows whole pixels only; its border is a staircase that would reach the paths.
Here the border stays the polygon that it is. The grid is cut into four again and again, and a square passes on to its
quarters only those segments that can be the nearest of one of its points: with the nearest segment at distance d from
the middle of a square whose points lie within r of it, none beyond d + 2 r. Nothing is guessed, so the result is the
minimum over all segments, to rounding.

Where only some distances are asked for, as along level curves, a square that none of them can reach is left out whole:
over its points the distance differs from that at its middle by r at the most.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from geoprint.kernels import inner, uncounted, writable
from geoprint.model import FloatArray, IntArray

ByteArray: TypeAlias = NDArray[np.uint8]

# What is known of a pixel, added up: whether it is wanted; others say on which sides of a cut it lies.
WANTED = 1
# Squares of this many pixels a side without a wanted pixel are left out.
TILE = 8
# A pixel matters to a level that passes through one of the four cells about it: no corner of them is farther away.
CELL_REACH = sqrt(2.0)
# Every distance is asked for.
ALL = np.empty(0)
# Points are sorted into a grid of about so many to a pixel.
POINTS_PER_PIXEL = 2.0


def point_distances(segments: FloatArray, points: FloatArray) -> FloatArray:
    """Return the (k,) distance of (k, 2) points to the nearest of (s, 2, 2) segments, in their unit.

    Examples:
        >>> point_distances(np.array([[[0.0, 0.5], [3.0, 0.5]]]), np.array([[1.0, 2.0], [6.0, 4.5]]))
        array([1.5, 5. ])
    """
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    pixel = float(size.max()) / max(np.sqrt(len(points) / POINTS_PER_PIXEL), 1.0)
    pixel = pixel if pixel > 0.0 else 1.0
    scaled = (points - low) / pixel
    columns, rows = np.rint(scaled).astype(np.int64).T
    shape = int(rows.max()) + 1, int(columns.max()) + 1
    pixels = rows * shape[1] + columns
    order = np.argsort(pixels, kind="stable")
    counts = np.bincount(pixels, minlength=shape[0] * shape[1])
    offsets = np.concatenate([[0], np.cumsum(counts)])
    distances = np.empty(len(points))
    held = (counts > 0).astype(np.uint8).reshape(shape)
    everywhere = counted_everywhere((segments - low) / pixel)
    _measure_points(_whole_image(everywhere, held, 0, ALL, spread=1.0), offsets, scaled[order], distances)
    return distances[np.argsort(order)] * pixel


class CountedSegments(NamedTuple):
    """CountedSegments as the kernels read them.

    Attributes:
        lines: (s, 6) start, step to the end, and that step over its squared length.
        sides: (s,) marks of pixels, one of which a pixel must have for a segment to count there; 0 counts everywhere,
            and at least one segment does.
    """

    lines: FloatArray
    sides: ByteArray


def counted(segments: FloatArray, sides: ByteArray) -> CountedSegments:
    """Return (s, 2, 2) segments that count where the marks of the pixels say."""
    along: FloatArray = segments[:, 1] - segments[:, 0]
    squares = (along**2).sum(axis=1)
    return CountedSegments(
        np.hstack([segments[:, 0], along, along / np.where(squares > 0.0, squares, 1.0)[:, None]]), writable(sides)
    )


def counted_everywhere(segments: FloatArray) -> CountedSegments:
    """Return (s, 2, 2) segments that count for all pixels."""
    return counted(segments, np.zeros(len(segments), dtype=np.uint8))


class Search(NamedTuple):
    """Squares of pixels that wait, each with the segments that can be the nearest there.

    Attributes:
        segments: of all of them.
        pixels: (rows, columns) marks of the pixels to visit.
        first: row of the whole image that is the first of these.
        asked: (l,) rising distances in pixels that are asked for; `ALL` for any.
        spread: 0 where points are the centres of pixels, 1 where they lie anywhere in them.
        near: lists of segments: those of nested squares follow one another.
        squares: as long, for squared distances.
        waiting: row, column, size, and where the list of the square around begins and ends; a stack.
    """

    segments: CountedSegments
    pixels: ByteArray
    first: int
    asked: FloatArray
    spread: float
    near: IntArray
    squares: FloatArray
    waiting: IntArray


def measure_pixels(
    segments: CountedSegments, pixels: ByteArray, first: int, asked: FloatArray, distances: FloatArray
) -> None:
    """Write the distances of the centres of wanted pixels, of all about which one of those asked for can pass.

    With the centres of the outside pixels as segments without length it is the exact Euclidean distance transform of
    the binary image.

    Args:
        segments: in pixels; the centre of pixel (row, column) is at x = column, y = row.
        pixels: (rows, columns) marks.
        first: row of the image that is the first of these.
        asked: (l,) rising distances, or `ALL`.
        distances: (rows, columns) in pixels, changed in place.
    """
    _measure_pixels(_whole_image(segments, pixels, first, asked, spread=0.0), distances)


@uncounted
def _measure_pixels(search: Search, distances: FloatArray) -> None:
    """Write the distances of the centres of wanted pixels."""
    top = 1
    while True:
        top = next_pixel(search, top)
        if top < 0:
            return
        row, column = search.waiting[top, 0], search.waiting[top, 1]
        distances[row, column] = distance_to(search, top, float(column), float(row + search.first))


@uncounted
def _measure_points(search: Search, offsets: IntArray, points: FloatArray, distances: FloatArray) -> None:
    """Write the distances of points in pixels.

    Args:
        search: of the pixels that hold points.
        offsets: (rows * columns + 1,) where the points of each pixel begin.
        points: (k, 2), pixel after pixel.
        distances: (k,), changed in place.
    """
    top = 1
    while True:
        top = next_pixel(search, top)
        if top < 0:
            return
        pixel = search.waiting[top, 0] * search.pixels.shape[1] + search.waiting[top, 1]
        for point in range(offsets[pixel], offsets[pixel + 1]):
            distances[point] = distance_to(search, top, points[point, 0], points[point, 1])


def _whole_image(
    segments: CountedSegments, pixels: ByteArray, first: int, asked: FloatArray, *, spread: float
) -> Search:
    """Return the search in which one square around the image waits, with all segments."""
    size, depth = 1, 1
    while size < max(pixels.shape):
        size, depth = 2 * size, depth + 1
    count = len(segments.lines)
    near = np.empty((depth + 1) * count, dtype=np.int64)
    near[:count] = np.arange(count)
    waiting = np.empty((4 * depth, 5), dtype=np.int64)
    waiting[0] = 0, 0, size, 0, count
    return Search(segments, writable(pixels), first, asked, spread, near, np.empty(near.size), waiting)


@inner
def next_pixel(search: Search, top: int) -> int:
    """Cut waiting squares until one is a wanted pixel.

    Args:
        search: changed in place.
        top: how many squares wait.

    Returns:
        How many still wait behind the pixel, which is in that place of the stack; -1 when all were visited.
    """
    waiting = search.waiting
    while top > 0:
        top -= 1
        row, column, size, _, last = waiting[top]
        if not holds_wanted(search.pixels, row, column, size):
            continue
        if size == 1:
            return top
        half = size // 2
        end = keep_near(search, top)
        if end < 0:
            continue
        for quarter in range(4):
            waiting[top, 0], waiting[top, 1] = row + half * (quarter // 2), column + half * (quarter % 2)
            waiting[top, 2], waiting[top, 3], waiting[top, 4] = half, last, end
            top += 1
    return -1


@inner
def holds_wanted(pixels: ByteArray, row: int, column: int, size: int) -> bool:
    """Return whether a square reaches into the image and, if it is a tile or a pixel, holds a wanted pixel."""
    if row >= pixels.shape[0] or column >= pixels.shape[1]:
        return False
    if size not in (1, TILE):
        return True
    for below in range(row, min(row + size, pixels.shape[0])):
        for beside in range(column, min(column + size, pixels.shape[1])):
            if pixels[below, beside] & WANTED:
                return True
    return False


@inner
def keep_near(search: Search, place: int) -> int:
    """List the segments that can be the nearest of a point in a waiting square, behind the list that it came with.

    Returns:
        Where the new list ends; -1 where no distance that is asked for passes by the square.
    """
    row, column, size, first, last = search.waiting[place]
    x, y = column + 0.5 * (size - 1), row + search.first + 0.5 * (size - 1)
    radius = (size - 1 + search.spread) * sqrt(0.5)
    least = np.inf
    for known in range(first, last):
        line = search.near[known]
        search.squares[known] = square_to(search.segments.lines, line, x, y)
        if search.segments.sides[line] == 0:
            least = min(least, search.squares[known])
    farthest = (sqrt(least) + 2.0 * radius) ** 2
    end, nearest = last, least
    for known in range(first, last):
        if search.squares[known] <= farthest:
            nearest = min(nearest, search.squares[known])
            search.near[end] = search.near[known]
            end += 1
    reach = radius + CELL_REACH
    if search.asked.size and not holds_between(search.asked, sqrt(nearest) - reach, sqrt(least) + reach):
        return -1
    return end


@inner
def holds_between(rising: FloatArray, low: float, high: float) -> bool:
    """Tell whether one of (l,) rising numbers lies between two."""
    following, end = 0, rising.size
    while following < end:
        middle = (following + end) // 2
        if rising[middle] < low:
            following = middle + 1
        else:
            end = middle
    return bool(following < rising.size and rising[following] <= high)


@inner
def distance_to(search: Search, place: int, x: float, y: float) -> float:
    """Return the distance of a point to the nearest segment in the list of a waiting square."""
    least = np.inf
    marks = search.pixels[search.waiting[place, 0], search.waiting[place, 1]]
    for known in range(search.waiting[place, 3], search.waiting[place, 4]):
        line = search.near[known]
        if search.segments.sides[line] == 0 or search.segments.sides[line] & marks:
            least = min(least, square_to(search.segments.lines, line, x, y))
    return sqrt(least)


@inner
def square_to(lines: FloatArray, line: int, x: float, y: float) -> float:
    """Return the squared distance of a point to a segment."""
    across, up = x - lines[line, 0], y - lines[line, 1]
    share = min(1.0, max(0.0, across * lines[line, 4] + up * lines[line, 5]))
    across -= share * lines[line, 2]
    up -= share * lines[line, 3]
    return across * across + up * up
