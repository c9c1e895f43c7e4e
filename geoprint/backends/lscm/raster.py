"""A flat region as an image: distance of its pixels to segments, and level curves of the image.

Distances are those to the segments themselves, not to pixels: each is exact, so what reaches the paths of the raster is
the interpolation between pixels alone. Where the distance has a kink, midway between two parts of the border, that
rounds a corner of a level curve by a fraction of a pixel; where it curves with radius r it moves a curve by at most
pixel^2 / (8 r); elsewhere the distance is linear and its curves are exact.
"""

from __future__ import annotations

from typing import final

import contourpy
import numpy as np
from scipy.ndimage import binary_dilation, map_coordinates

from geoprint.backends.lscm.continuation import UNCUT, Continuation
from geoprint.backends.lscm.segment_distance import grid_distances
from geoprint.model import BoolArray, FloatArray, IntArray, freeze_arrays, frozen

# Pixels measured around the region: level curves are followed beyond its border before they are cut there.
MARGIN = 2


@final
@frozen
class DistanceImage:
    """Distances at the centres of square pixels; the centre of (row, column) is at origin + pixel * (column, row).

    Attributes:
        values: (rows, columns) [mm].
        origin: (2,) centre of the first pixel [mm].
        pixel: side of a pixel [mm].
        measured: (rows, columns) pixels of the region and around it; the values of others mean nothing.
    """

    values: FloatArray
    origin: FloatArray
    pixel: float
    measured: BoolArray

    def __post_init__(self) -> None:
        # Half a gigabyte at the most: shared, not copied.
        self.values.setflags(write=False)
        self.measured.setflags(write=False)
        freeze_arrays(self, values="float: r c", origin="float: 2", measured="bool: r c")

    def sample(self, points: FloatArray) -> FloatArray:
        """Return the (k,) bilinearly interpolated distance at (k, 2) points [mm]."""
        columns, rows = ((points - self.origin) / self.pixel).T
        return np.asarray(map_coordinates(self.values, [rows, columns], order=1, mode="nearest"))

    def beside(self, continuation: Continuation, *, rounds: int) -> BoolArray:
        """Return the (rows, columns) measured pixels at the side of a cut that a copy continues."""
        rows, columns = (np.arange(count, dtype=np.float64) for count in self.values.shape)
        x, y = self.origin[0] + self.pixel * columns, self.origin[1] + self.pixel * rows[:, None]
        return self.measured & continuation.beside(x, y, rounds=rounds)

    def contours(self, levels: FloatArray) -> list[list[FloatArray]]:
        """Return the level curves of every level by marching squares [Lorensen1987], larger values on the left.

        A pixel whose value equals a level counts as below it. In the two ambiguous cells, where the corners alternate,
        the mean of the four decides: it is the value in the middle of the cell. Cells with a corner that was not
        measured are left out.

        Args:
            levels: (l,) distances [mm].

        Returns:
            For each level its (k, 2) polylines [mm]; a closed one repeats its first point.
        """
        known = np.ma.masked_array(self.values, ~self.measured)
        generator = contourpy.contour_generator(z=known, name="serial", corner_mask=False)
        return [
            [np.asarray(line, dtype=np.float64) * self.pixel + self.origin for line in generator.lines(float(level))]
            for level in levels
        ]


def region_image(border: FloatArray, *, resolution: int, continuation: Continuation = UNCUT) -> DistanceImage:
    """Return the distance to the border of a region, positive inside, negative outside.

    Args:
        border: (s, 2, 2) x and y of both ends of every segment of its border [mm]; with the sides of the cut, if there
            is one, any number of closed loops. Inside is what an odd number of them surrounds.
        resolution: pixels along the longer side of the region's bounding box.
        continuation: how the region goes on beyond a cut, which is no border.

    Returns:
        The image; outside pixels farther than the margin hold minus the margin. Within the margin of a cut the pixels
        of the region's continuation are inside too.
    """
    outline = np.concatenate([border, continuation.sides])
    low, high = outline.min(axis=(0, 1)), outline.max(axis=(0, 1))
    pixel = float((high - low).max()) / resolution
    origin = low + (0.5 - MARGIN) * pixel
    columns, rows = image_size(high - low, resolution=resolution)
    inside = filled((outline - origin) / pixel, shape=(rows, columns))
    measured = np.asarray(binary_dilation(inside, np.ones((3, 3), dtype=np.bool_), iterations=MARGIN))
    image = DistanceImage(np.full((rows, columns), -MARGIN * pixel), origin, pixel, measured)
    for rounds in continuation.rounds:
        copy = (continuation.moved(outline, rounds=rounds) - origin) / pixel
        inside |= image.beside(continuation, rounds=rounds) & filled(copy, shape=(rows, columns))
    values = seed_image(image, border, continuation=continuation).values
    return DistanceImage(np.where(measured, np.where(inside, values, -values), image.values), origin, pixel, measured)


def seed_image(region: DistanceImage, seed: FloatArray, *, continuation: Continuation = UNCUT) -> DistanceImage:
    """Return the straight distance to (s, 2, 2) segments [mm] on the pixels of a region and its margin.

    The straight line may leave the region, through a hole or across a bay of its border.
    """
    values = grid_distances((seed - region.origin) / region.pixel, region.measured)
    for rounds in continuation.rounds:
        images = (continuation.beyond(seed, rounds=rounds) - region.origin) / region.pixel
        if len(images):
            here = region.beside(continuation, rounds=rounds)
            np.minimum(values, grid_distances(images, here), out=values, where=here)
    values *= region.pixel
    return DistanceImage(values, region.origin, region.pixel, region.measured)


def image_size(size: FloatArray, *, resolution: int) -> tuple[int, int]:
    """Return the columns and rows of the image of a box of a size (2,) [mm], margins included.

    Examples:
        >>> image_size(np.array([40.0, 30.0]), resolution=100)
        (104, 79)
    """
    columns, rows = np.ceil(size * (resolution / size.max())).astype(np.int64) + 2 * MARGIN
    return int(columns), int(rows)


def clipped(line: FloatArray, region: DistanceImage) -> list[FloatArray]:
    """Cut a polyline where it leaves a region.

    Args:
        line: (k, 2) corners [mm]; a closed one repeats its first.
        region: signed distance, as `region_image`.

    Returns:
        The pieces inside, in order and direction of the line; the line itself where it never leaves. Pieces shorter
        than a pixel are left out.
    """
    depth = region.sample(line)
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
        if float(np.linalg.norm(np.diff(piece, axis=0), axis=1).sum()) >= region.pixel:
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
