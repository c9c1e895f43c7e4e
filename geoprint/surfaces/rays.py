"""Where straight lines of sight first meet a surface."""

from __future__ import annotations

from math import inf
from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.kernels import inner, njit
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfacePoints, freeze_arrays, frozen
from geoprint.surfaces.box_tree import DEPTH, BoxTree, box_tree

# A ray that misses a triangle by less than this share of it goes through it: so none slips through between two.
SEAM = 1e-9


@final
@frozen
class RayHits:
    """Where rays first meet a surface.

    Attributes:
        met: (k,) whether each of k rays meets it.
        points: (j,) where, of those j that do, in their order.
        distances: (j,) from where they start, over the length of their directions [mm].
    """

    met: BoolArray
    points: SurfacePoints
    distances: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, met="bool: k", distances="float: j")


@final
class RayTree:
    """A surface that many bundles of rays are sent to: its boxes are sorted once."""

    def __init__(self, surface: Surface) -> None:
        self._corners = surface.vertices[surface.faces]
        self._tree = box_tree(self._corners)

    def first_hits(self, starts: FloatArray, directions: FloatArray) -> RayHits:
        """Return where rays first meet the surface, as `first_hits` does.

        Args:
            starts: (k, 3) places where rays start [mm].
            directions: (k, 3) where they go; not zero.

        Raises:
            InputError: starts or directions are not finite, or not as many.
        """
        if starts.shape != directions.shape or starts.ndim != 2 or starts.shape[1] != 3:
            raise InputError(f"rays need (k, 3) starts and directions, found {starts.shape} and {directions.shape}.")
        if not (np.isfinite(starts).all() and np.isfinite(directions).all()):
            raise InputError("rays need finite starts and directions.")
        faces, weights, distances = _first_triangles(starts, directions, self._corners, self._tree)
        met = faces >= 0
        points = np.clip(weights[met], 0.0, 1.0)
        return RayHits(met, SurfacePoints(faces[met], points / points.sum(axis=1, keepdims=True)), distances[met])


def first_hits(surface: Surface, starts: FloatArray, directions: FloatArray) -> RayHits:
    """Return where rays first meet a surface, from whichever side [Moeller1997].

    Args:
        surface: m faces.
        starts: (k, 3) places where rays start [mm].
        directions: (k, 3) where they go; not zero.

    Raises:
        InputError: starts or directions are not finite, or not as many.
    """
    return RayTree(surface).first_hits(starts, directions)


@njit
def _first_triangles(
    starts: FloatArray, directions: FloatArray, corners: FloatArray, tree: BoxTree
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return the (k,) first triangle of each ray or -1, its (k, 3) barycentric weights and (k,) distances."""
    found, weights, distances = np.full(len(starts), -1), np.zeros((len(starts), 3)), np.full(len(starts), inf)
    waiting = np.empty(DEPTH, np.int64)
    for ray in range(len(starts)):
        start, ahead = starts[ray], directions[ray]
        waiting[0], count = 0, 1
        while count > 0:
            count -= 1
            box = waiting[count]
            if _enters(tree.boxes[box], start, ahead) >= distances[ray]:
                continue
            first = tree.halves[box]
            if first >= 0:
                # The nearer half is looked at first: what lies behind it is then seldom needed.
                near, far = first, first + 1
                if _enters(tree.boxes[far], start, ahead) < _enters(tree.boxes[near], start, ahead):
                    near, far = far, near
                waiting[count], waiting[count + 1] = far, near
                count += 2
                continue
            for triangle in tree.order[tree.firsts[box] : tree.lasts[box]]:
                distance, second, third = _through(corners[triangle], start, ahead)
                if distance < distances[ray]:
                    distances[ray], found[ray] = distance, triangle
                    weights[ray, 0], weights[ray, 1], weights[ray, 2] = 1.0 - second - third, second, third
    return found, weights, distances


@inner
def _enters(box: FloatArray, start: FloatArray, ahead: FloatArray) -> float:
    """Return the distance at which a ray enters a box (6,), infinite where it does not; 0 from inside."""
    near, far = 0.0, inf
    for k in range(3):
        if ahead[k] == 0.0:
            if start[k] < box[k] or start[k] > box[3 + k]:
                return inf
            continue
        one, other = (box[k] - start[k]) / ahead[k], (box[3 + k] - start[k]) / ahead[k]
        near, far = max(near, min(one, other)), min(far, max(one, other))
    return near if near <= far * (1.0 + SEAM) else inf


@inner
def _through(triangle: FloatArray, start: FloatArray, ahead: FloatArray) -> tuple[float, float, float]:
    """Return at which distance a ray goes through a triangle (3, 3), infinite if it does not, and two weights there."""
    ax, ay, az = triangle[1, 0] - triangle[0, 0], triangle[1, 1] - triangle[0, 1], triangle[1, 2] - triangle[0, 2]
    bx, by, bz = triangle[2, 0] - triangle[0, 0], triangle[2, 1] - triangle[0, 1], triangle[2, 2] - triangle[0, 2]
    px, py, pz = ahead[1] * bz - ahead[2] * by, ahead[2] * bx - ahead[0] * bz, ahead[0] * by - ahead[1] * bx
    volume = ax * px + ay * py + az * pz
    if volume == 0.0:
        return inf, 0.0, 0.0
    x, y, z = start[0] - triangle[0, 0], start[1] - triangle[0, 1], start[2] - triangle[0, 2]
    second = (x * px + y * py + z * pz) / volume
    qx, qy, qz = y * az - z * ay, z * ax - x * az, x * ay - y * ax
    third = (ahead[0] * qx + ahead[1] * qy + ahead[2] * qz) / volume
    distance = (bx * qx + by * qy + bz * qz) / volume
    if second < -SEAM or third < -SEAM or second + third > 1.0 + SEAM or distance < 0.0:
        return inf, 0.0, 0.0
    return distance, second, third
