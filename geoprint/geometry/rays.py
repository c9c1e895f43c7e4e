"""Rays: where straight lines of sight first meet a surface, and the tree of boxes that finds closest triangles."""

from __future__ import annotations

from math import inf
from typing import NamedTuple, TypeAlias, final

import numpy as np

from geoprint.errors import InputError
from geoprint.kernels import inner, njit
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfacePoints, freeze_arrays, frozen

# A tree of boxes about triangles, in which the triangle that is closest to a position is found without the others.
#
# Numba is loaded with this module, so that `points` asks for it only when it is needed.


Offset: TypeAlias = tuple[float, float, float]

# Triangles of a leaf: so few are tried faster than they are divided.
LEAF = 4
# Deeper than any tree of halves: each level halves what a memory can hold.
DEPTH = 64


class BoxTree(NamedTuple):
    """Boxes, each about the triangles of a stretch of an order, and about the two boxes that halve it.

    Attributes:
        order: (m,) triangles.
        boxes: (b, 6) lowest x, y, z and highest of each box; the first is about all.
        firsts: (b,) where the stretch of each begins in the order,
        lasts: (b,) and before where it ends.
        halves: (b,) the first of two boxes one after the other that halve it, or -1 of a leaf.
    """

    order: IntArray
    boxes: FloatArray
    firsts: IntArray
    lasts: IntArray
    halves: IntArray


@njit
def box_tree(corners: FloatArray) -> BoxTree:
    """Return the tree of (m, 3, 3) corners of triangles, m >= 1: each box is halved across its longest side."""
    count = corners.shape[0]
    order, middles = np.empty(count, np.int64), np.empty(count)
    for triangle in range(count):
        order[triangle] = triangle
    boxes = np.empty((2 * count, 6))
    firsts, lasts, halves = np.zeros(2 * count, np.int64), np.zeros(2 * count, np.int64), np.full(2 * count, -1)
    lasts[0] = count
    made, box = 1, 0
    while box < made:
        first, last = firsts[box], lasts[box]
        axis, longest = 0, -1.0
        for k in range(3):
            low, high, least, most = inf, -inf, inf, -inf
            for triangle in order[first:last]:
                a, b, c = corners[triangle, 0, k], corners[triangle, 1, k], corners[triangle, 2, k]
                low, high = min(low, a, b, c), max(high, a, b, c)
                least, most = min(least, a + b + c), max(most, a + b + c)
            boxes[box, k], boxes[box, 3 + k] = low, high
            if most - least > longest:
                axis, longest = k, most - least
        if last - first > LEAF:
            for triangle in order[first:last]:
                middles[triangle] = corners[triangle, 0, axis] + corners[triangle, 1, axis] + corners[triangle, 2, axis]
            middle = (first + last) // 2
            halve(middles, order[first:last], middle - first)
            halves[box] = made
            firsts[made], lasts[made], firsts[made + 1], lasts[made + 1] = first, middle, middle, last
            made += 2
        box += 1
    return BoxTree(order, boxes[:made].copy(), firsts[:made].copy(), lasts[:made].copy(), halves[:made].copy())


@inner
def halve(keys: FloatArray, items: IntArray, middle: int) -> None:
    """Reorder items in place so that no key before the middle is larger than one from it on.

    Around the key halfway, smaller ones are brought to its left and larger ones to its right, and the side that holds
    the middle is divided again [Hoare1961, algorithm 65].

    Args:
        keys: of each item that there may be; finite.
        items: (k,) numbers.
        middle: 0 <= middle < k.
    """
    first, last = 0, items.size - 1
    while first < last:
        pivot = keys[items[(first + last) // 2]]
        left, right = first, last
        while left <= right:
            while keys[items[left]] < pivot:
                left += 1
            while keys[items[right]] > pivot:
                right -= 1
            if left <= right:
                items[left], items[right] = items[right], items[left]
                left += 1
                right -= 1
        if middle <= right:
            last = right
        elif middle >= left:
            first = left
        else:
            return


@njit
def nearest_triangles(points: FloatArray, corners: FloatArray, tree: BoxTree) -> IntArray:
    """Return the (k,) triangle closest to each of (k, 3) points; of equally close ones any.

    What was closest to the point before is tried first: points in an order find theirs sooner.
    """
    found = np.zeros(len(points), np.int64)
    waiting, gaps = np.empty(DEPTH, np.int64), np.empty(DEPTH)
    for point in range(len(points)):
        place = points[point]
        face = found[max(point - 1, 0)]
        best = square_to(corners[face], place)
        waiting[0], gaps[0], count = 0, 0.0, 1
        while count > 0:
            count -= 1
            box = waiting[count]
            if gaps[count] >= best:
                continue
            first = tree.halves[box]
            if first < 0:
                for triangle in tree.order[tree.firsts[box] : tree.lasts[box]]:
                    square = square_to(corners[triangle], place)
                    if square < best:
                        best, face = square, triangle
                continue
            near, far = first, first + 1
            near_gap, far_gap = square_to_box(tree.boxes[near], place), square_to_box(tree.boxes[far], place)
            if near_gap > far_gap:
                near, far, near_gap, far_gap = far, near, far_gap, near_gap
            waiting[count], gaps[count] = far, far_gap
            waiting[count + 1], gaps[count + 1] = near, near_gap
            count += 2
        found[point] = face
    return found


@inner
def square_to_box(box: FloatArray, place: FloatArray) -> float:
    """Return the squared distance of a place from a box (6,) [mm2]; 0 inside."""
    total = 0.0
    for k in range(3):
        gap = max(box[k] - place[k], place[k] - box[3 + k], 0.0)
        total += gap * gap
    return total


@inner
def square_to(triangle: FloatArray, place: FloatArray) -> float:
    """Return the squared distance of a place from a triangle (3, 3) [mm2]; one without area is its sides."""
    abx, aby, abz = triangle[1, 0] - triangle[0, 0], triangle[1, 1] - triangle[0, 1], triangle[1, 2] - triangle[0, 2]
    acx, acy, acz = triangle[2, 0] - triangle[0, 0], triangle[2, 1] - triangle[0, 1], triangle[2, 2] - triangle[0, 2]
    x, y, z = place[0] - triangle[0, 0], place[1] - triangle[0, 1], place[2] - triangle[0, 2]
    nx, ny, nz = aby * acz - abz * acy, abz * acx - abx * acz, abx * acy - aby * acx
    square = nx * nx + ny * ny + nz * nz
    if square > 0.0:
        second = ((y * acz - z * acy) * nx + (z * acx - x * acz) * ny + (x * acy - y * acx) * nz) / square
        third = ((aby * z - abz * y) * nx + (abz * x - abx * z) * ny + (abx * y - aby * x) * nz) / square
        if second >= 0.0 and third >= 0.0 and second + third <= 1.0:
            height = x * nx + y * ny + z * nz
            return height * height / square
    return min(
        square_to_side((abx, aby, abz), (x, y, z)),
        square_to_side((acx, acy, acz), (x, y, z)),
        square_to_side((acx - abx, acy - aby, acz - abz), (x - abx, y - aby, z - abz)),
    )


@inner
def square_to_side(along: Offset, place: Offset) -> float:
    """Return the squared distance of a place from a side, both counted from where the side begins [mm2]."""
    square = along[0] * along[0] + along[1] * along[1] + along[2] * along[2]
    share = (along[0] * place[0] + along[1] * place[1] + along[2] * place[2]) / square if square > 0.0 else 0.0
    share = min(max(share, 0.0), 1.0)
    x, y, z = place[0] - share * along[0], place[1] - share * along[1], place[2] - share * along[2]
    return x * x + y * y + z * z


# Where straight lines of sight first meet a surface.


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
