"""Exact distance to the nearest of many segments, from every pixel of a grid or from points: numba kernels.

The distance transform of a binary image knows whole pixels only; its border is a staircase that would reach the paths.
Here the border stays the polygon that it is. The grid is cut into four again and again, and a square passes on to its
quarters only those segments that can be the nearest of one of its points: with the nearest segment at distance d from
the middle of a square whose points lie within r of it, none beyond d + 2 r. Nothing is guessed, so the result is the
minimum over all segments, to rounding.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from geoprint.kernels import njit
from geoprint.model import BoolArray, FloatArray, IntArray

# Squares of this many pixels a side without a wanted pixel are left out.
TILE = 8
# Points are sorted into a grid of about so many to a pixel.
POINTS_PER_PIXEL = 2.0


def grid_distances(segments: FloatArray, wanted: BoolArray) -> FloatArray:
    """Return the distance of pixel centres to the nearest segment.

    With the centres of the outside pixels as segments without length it is the exact Euclidean distance transform of
    the binary image.

    Args:
        segments: (s, 2, 2) x and y of both ends in pixels, s >= 1; the centre of pixel (row, column) is at
            x = column, y = row. A segment without length is a point.
        wanted: (rows, columns) pixels to measure.

    Returns:
        (rows, columns) distances in pixels, 0 where they are not wanted.

    Examples:
        >>> grid_distances(np.array([[[0.0, 0.5], [3.0, 0.5]]]), np.ones((3, 2), dtype=np.bool_))
        array([[0.5, 0.5], [0.5, 0.5], [1.5, 1.5]])
    """
    distances = np.zeros(wanted.shape)
    measure_pixels(_lines(segments), wanted, distances)
    return distances


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
    lines = _lines((segments - low) / pixel)
    measure_points(lines, (counts > 0).reshape(shape), offsets, scaled[order], distances)
    return distances[np.argsort(order)] * pixel


def _lines(segments: FloatArray) -> FloatArray:
    """Return (s, 6): start, step to the end, and that step over its squared length."""
    along: FloatArray = segments[:, 1] - segments[:, 0]
    squares = (along**2).sum(axis=1)
    return np.hstack([segments[:, 0], along, along / np.where(squares > 0.0, squares, 1.0)[:, None]])


class Search(NamedTuple):
    """Squares of pixels that wait, each with the segments that can be the nearest there.

    Attributes:
        lines: (s, 6) segments.
        wanted: (rows, columns) pixels to visit.
        spread: 0 where points are the centres of pixels, 1 where they lie anywhere in them.
        near: lists of segments: those of nested squares follow one another.
        squares: as long, for squared distances.
        waiting: row, column, size, and where the list of the square around begins and ends; a stack.
    """

    lines: FloatArray
    wanted: BoolArray
    spread: float
    near: IntArray
    squares: FloatArray
    waiting: IntArray


@njit(cache=True, error_model="numpy")
def measure_pixels(lines: FloatArray, wanted: BoolArray, distances: FloatArray) -> None:
    """Write the distances of the centres of the wanted pixels.

    Args:
        lines: (s, 6) segments.
        wanted: (rows, columns).
        distances: (rows, columns), changed in place.
    """
    search = whole_image(lines, wanted, 0.0)
    top = next_pixel(search, 1)
    while top >= 0:
        row, column = search.waiting[top, 0], search.waiting[top, 1]
        distances[row, column] = distance_to(search, top, float(column), float(row))
        top = next_pixel(search, top)


@njit(cache=True, error_model="numpy")
def measure_points(
    lines: FloatArray, wanted: BoolArray, offsets: IntArray, points: FloatArray, distances: FloatArray
) -> None:
    """Write the distances of points in pixels.

    Args:
        lines: (s, 6) segments.
        wanted: (rows, columns) pixels that hold points.
        offsets: (rows * columns + 1,) where the points of each pixel begin.
        points: (k, 2), pixel after pixel.
        distances: (k,), changed in place.
    """
    search = whole_image(lines, wanted, 1.0)
    top = next_pixel(search, 1)
    while top >= 0:
        pixel = search.waiting[top, 0] * wanted.shape[1] + search.waiting[top, 1]
        for point in range(offsets[pixel], offsets[pixel + 1]):
            distances[point] = distance_to(search, top, points[point, 0], points[point, 1])
        top = next_pixel(search, top)


@njit(cache=True, error_model="numpy")
def whole_image(lines: FloatArray, wanted: BoolArray, spread: float) -> Search:
    """Return the search in which one square around the image waits, with all segments."""
    size, depth = 1, 1
    while size < max(wanted.shape):
        size, depth = 2 * size, depth + 1
    count = lines.shape[0]
    near = np.empty((depth + 1) * count, dtype=np.int64)
    near[:count] = np.arange(count)
    waiting = np.empty((4 * depth, 5), dtype=np.int64)
    waiting[0] = np.array([0, 0, size, 0, count])
    return Search(lines, wanted, spread, near, np.empty(near.size), waiting)


@njit(cache=True, error_model="numpy")
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
        if not holds_wanted(search.wanted, row, column, size):
            continue
        if size == 1:
            return top
        half = size // 2
        end = keep_near(search, top)
        for quarter in range(4):
            waiting[top, 0], waiting[top, 1] = row + half * (quarter // 2), column + half * (quarter % 2)
            waiting[top, 2], waiting[top, 3], waiting[top, 4] = half, last, end
            top += 1
    return -1


@njit(cache=True, error_model="numpy")
def holds_wanted(wanted: BoolArray, row: int, column: int, size: int) -> bool:
    """Return whether a square reaches into the image and, if it is a tile or a pixel, holds a wanted pixel."""
    if row >= wanted.shape[0] or column >= wanted.shape[1]:
        return False
    if size not in (1, TILE):
        return True
    return bool(wanted[row : row + size, column : column + size].any())


@njit(cache=True, error_model="numpy")
def keep_near(search: Search, place: int) -> int:
    """List the segments that can be the nearest of a point in a waiting square, behind the list that it came with.

    Returns:
        Where the new list ends.
    """
    row, column, size, first, last = search.waiting[place]
    x, y, radius = column + 0.5 * (size - 1), row + 0.5 * (size - 1), (size - 1 + search.spread) * sqrt(0.5)
    least = np.inf
    for known in range(first, last):
        search.squares[known] = square_to(search.lines, search.near[known], x, y)
        least = min(least, search.squares[known])
    reach = (sqrt(least) + 2.0 * radius) ** 2
    end = last
    for known in range(first, last):
        if search.squares[known] <= reach:
            search.near[end] = search.near[known]
            end += 1
    return end


@njit(cache=True, error_model="numpy")
def distance_to(search: Search, place: int, x: float, y: float) -> float:
    """Return the distance of a point to the nearest segment in the list of a waiting square."""
    least = np.inf
    for known in range(search.waiting[place, 3], search.waiting[place, 4]):
        least = min(least, square_to(search.lines, search.near[known], x, y))
    return sqrt(least)


@njit(cache=True, error_model="numpy")
def square_to(lines: FloatArray, line: int, x: float, y: float) -> float:
    """Return the squared distance of a point to a segment."""
    across, up = x - lines[line, 0], y - lines[line, 1]
    share = min(1.0, max(0.0, across * lines[line, 4] + up * lines[line, 5]))
    across -= share * lines[line, 2]
    up -= share * lines[line, 3]
    return across * across + up * up
