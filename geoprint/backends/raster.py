"""A flat region as an image: inside or outside, distance to the border, level curves of the image."""

from __future__ import annotations

from typing import final

import contourpy
import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates

from geoprint.model import BoolArray, FloatArray
from geoprint.surfaces import PolylineDistance

# Empty pixels around the region: the distance transform needs an outside on every side, bilinear sampling one more.
MARGIN = 2


@final
class DistanceImage:
    """Distance of every pixel of a region to its border, by the exact Euclidean distance transform.

    The transform measures to the nearest pixel outside; what that pixel itself lies beyond the true border is taken
    off, so that the staircase of the binary image does not reach the paths.

    Args:
        border: (b, 2) corners of the region's border, a simple polygon [mm].
        resolution: pixels along the longer side of its bounding box.
    """

    def __init__(self, border: FloatArray, *, resolution: int) -> None:
        low, high = border.min(axis=0), border.max(axis=0)
        self.pixel = float((high - low).max()) / resolution
        self._origin = low + (0.5 - MARGIN) * self.pixel
        columns, rows = np.ceil((high - low) / self.pixel).astype(np.int64) + 2 * MARGIN
        inside = filled_polygon((border - self._origin) / self.pixel, shape=(int(rows), int(columns)))
        distance, nearest = distance_transform_edt(inside, return_indices=True)
        touched = np.zeros_like(inside)
        touched[tuple(nearest[:, inside])] = True
        beyond = np.zeros(inside.shape)
        centres = np.argwhere(touched)[:, ::-1] * self.pixel + self._origin
        beyond[touched] = PolylineDistance([np.vstack([border, border[:1]])], step=self.pixel)(centres)
        corrected = np.asarray(distance) * self.pixel - beyond[tuple(nearest)]
        self.values: FloatArray = np.where(inside, np.maximum(corrected, 0.0), 0.0)

    def sample(self, points: FloatArray) -> FloatArray:
        """Return the (k,) bilinearly interpolated distance at (k, 2) points [mm]."""
        columns, rows = ((points - self._origin) / self.pixel).T
        return np.asarray(map_coordinates(self.values, [rows, columns], order=1))

    def contours(self, level: float) -> list[FloatArray]:
        """Return the level curves by marching squares [Lorensen1987], larger values on the left.

        In the two ambiguous cells, where the corners alternate, the mean of the four decides as contourpy does: it is
        the value in the middle of the cell.

        Args:
            level: distance [mm].

        Returns:
            One (k, 2) polyline [mm] a curve; a closed one repeats its first point.
        """
        lines = contourpy.contour_generator(z=self.values, name="serial").lines(level)
        return [self._uphill_left(np.asarray(line, dtype=np.float64) * self.pixel + self._origin) for line in lines]

    def _uphill_left(self, line: FloatArray) -> FloatArray:
        """Turn a polyline so that values are larger on its left, judged along all of it."""
        along = np.diff(line, axis=0)
        left = np.column_stack([-along[:, 1], along[:, 0]])
        lengths = np.sqrt((along**2).sum(axis=1, keepdims=True))
        left *= self.pixel / np.maximum(lengths, np.finfo(np.float64).tiny)
        middles = line[:-1] + 0.5 * along
        rise = self.sample(middles + left) - self.sample(middles - left)
        return line if float(rise.sum()) > 0.0 else line[::-1]


def filled_polygon(corners: FloatArray, *, shape: tuple[int, int]) -> BoolArray:
    """Tell which pixel centres lie inside a polygon, by the even-odd rule.

    Each row of centres is crossed by edges; a centre is inside when an odd number of crossings lies to its left.

    Args:
        corners: (b, 2) x and y in pixels; the centre of pixel (row, column) is at x = column, y = row.
        shape: rows and columns.

    Returns:
        (rows, columns) inside or not; a centre on the lower or left border counts as inside.

    Examples:
        >>> filled_polygon(np.array([[0.5, 0.5], [2.5, 0.5], [2.5, 1.5], [0.5, 1.5]]), shape=(3, 4)).astype(int)
        array([[0, 0, 0, 0], [0, 1, 1, 0], [0, 0, 0, 0]])
    """
    start, end = corners, np.roll(corners, -1, axis=0)
    first = np.ceil(np.minimum(start[:, 1], end[:, 1])).astype(np.int64)
    crossed = np.ceil(np.maximum(start[:, 1], end[:, 1])).astype(np.int64) - first
    edge = np.repeat(np.arange(int(crossed.size)), crossed)
    row = np.arange(edge.size) - np.repeat(np.cumsum(crossed) - crossed - first, crossed)
    share = (row - start[edge, 1]) / (end[edge, 1] - start[edge, 1])
    x = start[edge, 0] + share * (end[edge, 0] - start[edge, 0])
    crossings = np.zeros((shape[0], shape[1] + 1), dtype=np.int64)
    np.add.at(crossings, (row, np.clip(np.ceil(x).astype(np.int64), 0, shape[1])), 1)
    return np.asarray(np.cumsum(crossings, axis=1)[:, :-1] % 2 == 1)
