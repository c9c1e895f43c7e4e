"""Where a surface passes through itself: pairs of triangles that cross or lie on each other.

A tree of boxes over the triangles in Morton order [Lauterbach2009] gives the candidates, and two triangles cross where
an edge of one passes through the other.

Two libraries find them too, PyMeshLab and libigl through CGAL, both under the GPL, which nothing here needs to run.
Neither takes a depth, so that their answers differ where faces touch within rounding: CGAL lists 3 pairs of a pig and 2
of a bunny, this none and 10. On 200,000 faces PyMeshLab takes 0.8 of the processor time of this and libigl 2.4 times as
much, on most meshes of up to 20,000 faces 0.3 to 0.9 and 0.2 to 1.2 (`python -m benchmarks.readers.crossings`).
"""

from __future__ import annotations

import numpy as np

from geoprint.kernels import inner, njit
from geoprint.model import FloatArray, IntArray, Surface

# Pairs of triangles whose boxes overlap that are looked at, per triangle: a good mesh has about 10, one on which they
# are many more is made of needles that all pass by each other.
CANDIDATES_PER_FACE = 500
# Pairs that are listed; a surface that crosses itself more often is no better known by more of them.
MOST_PAIRS = 10_000
# Triangles in a leaf of the tree: fewer make it deeper, more compare more boxes.
LEAF = 4
# Bits of a Morton code along each axis.
MORTON_BITS = 20


def crossings(surface: Surface, *, depth: float) -> tuple[IntArray, bool]:
    """Find the pairs of triangles that cross, or lie on each other, by more than a depth.

    Triangles that only touch, or have a corner or an edge in common and part there, do not cross.

    Args:
        surface: any triangles.
        depth: how far an edge must pass through the other triangle's plane on both sides; two triangles closer than
            this all over lie on each other [mm].

    Returns:
        (k, 2) faces that cross or lie on each other, the smaller first, rows ascending, MOST_PAIRS at most; and whether
        every pair of faces was looked at: where not, there may be more of them.
    """
    corners = surface.vertices[surface.faces]
    order = _morton_order(corners.mean(axis=1))
    count = len(order)
    faces, corners = surface.faces[order], np.ascontiguousarray(corners[order])
    lows, highs = corners.min(axis=1) - depth, corners.max(axis=1) + depth
    node_lows, node_highs = _boxes(lows, highs)
    found, complete = _search(
        faces, corners, _unit_normals(corners), lows, highs, node_lows, node_highs, depth,
        CANDIDATES_PER_FACE * count, MOST_PAIRS,
    )  # fmt: skip
    pairs = np.sort(order[found], axis=1)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))], complete


def _morton_order(points: FloatArray) -> IntArray:
    """Return the order of (k, 3) points along a Morton curve through their bounding box."""
    low = points.min(axis=0)
    span = float(np.ptp(points, axis=0).max())
    cells = ((points - low) / (span or 1.0) * (2**MORTON_BITS - 1)).astype(np.uint64)
    code = np.zeros(len(points), dtype=np.uint64)
    for axis in range(3):
        spread = cells[:, axis]
        # Two free bits between each two of its own.
        for shift, mask in (
            (32, 0x1F00000000FFFF),
            (16, 0x1F0000FF0000FF),
            (8, 0x100F00F00F00F00F),
            (4, 0x10C30C30C30C30C3),
            (2, 0x1249249249249249),
        ):
            spread = (spread | (spread << np.uint64(shift))) & np.uint64(mask)
        code |= spread << np.uint64(axis)
    return np.argsort(code, kind="stable").astype(np.int64)


def _unit_normals(corners: FloatArray) -> FloatArray:
    """Return the (m, 3) unit normals of (m, 3, 3) triangles, zero where there is none."""
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return doubled / np.maximum(np.linalg.norm(doubled, axis=1), np.finfo(np.float64).tiny)[:, None]


def _boxes(lows: FloatArray, highs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the boxes of a complete binary tree over runs of LEAF triangles; node i has children 2 i and 2 i + 1."""
    leaves = 1 << max(int(-(-len(lows) // LEAF)) - 1, 0).bit_length()
    node_lows, node_highs = np.full((2 * leaves, 3), np.inf), np.full((2 * leaves, 3), -np.inf)
    starts = np.arange(0, len(lows), LEAF)
    node_lows[leaves : leaves + starts.size] = np.minimum.reduceat(lows, starts, axis=0)
    node_highs[leaves : leaves + starts.size] = np.maximum.reduceat(highs, starts, axis=0)
    first = leaves
    while first > 1:
        first //= 2
        children = slice(2 * first, 4 * first)
        node_lows[first : 2 * first] = node_lows[children].reshape(-1, 2, 3).min(axis=1)
        node_highs[first : 2 * first] = node_highs[children].reshape(-1, 2, 3).max(axis=1)
    return node_lows, node_highs


@njit
def _search(  # noqa: C901, PLR0917  (one loop; numba calls cost no less than branches)
    faces: IntArray, corners: FloatArray, normals: FloatArray, lows: FloatArray, highs: FloatArray,
    node_lows: FloatArray, node_highs: FloatArray, depth: float, budget: int, most: int,
) -> tuple[IntArray, bool]:  # fmt: skip
    """Return the crossing pairs among triangles in tree order, and whether the budget of candidates was enough.

    The tree is compared with itself from the root: where two boxes overlap, their children are compared.
    """
    leaves = len(node_lows) // 2
    found, pairs = np.empty((most, 2), dtype=np.int64), 0
    # Each level leaves three pairs behind at most, and 2^40 leaves fit no memory.
    stack = np.empty((128, 2), dtype=np.int64)
    stack[0, 0], stack[0, 1], height = 1, 1, 1
    while height > 0:
        height -= 1
        node, other = stack[height, 0], stack[height, 1]
        if not _overlap(node_lows, node_highs, node, node_lows, node_highs, other):
            continue
        if node < leaves:
            for first in range(2 * node, 2 * node + 2):
                for second in range(first if node == other else 2 * other, 2 * other + 2):
                    stack[height, 0], stack[height, 1] = first, second
                    height += 1
            continue
        start, stop = (node - leaves) * LEAF, min((node - leaves + 1) * LEAF, len(faces))
        other_start, other_stop = (other - leaves) * LEAF, min((other - leaves + 1) * LEAF, len(faces))
        for i in range(start, stop):
            for j in range(max(other_start, i + 1), other_stop):
                if not _overlap(lows, highs, i, lows, highs, j):
                    continue
                budget -= 1
                if budget < 0 or pairs == most:
                    return found[:pairs], False
                if _cross(faces, corners, normals, i, j, depth):
                    found[pairs, 0], found[pairs, 1] = i, j
                    pairs += 1
    return found[:pairs], True


@inner
def _overlap(  # noqa: PLR0917
    lows: FloatArray, highs: FloatArray, i: int, other_lows: FloatArray, other_highs: FloatArray, j: int
) -> bool:
    """Return whether box i and box j of another list have a point in common."""
    return (
        lows[i, 0] <= other_highs[j, 0]
        and other_lows[j, 0] <= highs[i, 0]
        and lows[i, 1] <= other_highs[j, 1]
        and other_lows[j, 1] <= highs[i, 1]
        and lows[i, 2] <= other_highs[j, 2]
        and other_lows[j, 2] <= highs[i, 2]
    )


@inner
def _cross(  # noqa: PLR0917
    faces: IntArray, corners: FloatArray, normals: FloatArray, i: int, j: int, depth: float
) -> bool:
    """Return whether triangle i crosses triangle j or lies on it."""
    low, high = _heights(corners, normals, i, j)
    low_other, high_other = _heights(corners, normals, j, i)
    if max(-low, high, -low_other, high_other) <= depth:
        return not (_parted(corners, normals, i, j, depth) or _parted(corners, normals, j, i, depth))
    through, through_other = low < -depth and high > depth, low_other < -depth and high_other > depth
    if not (through or through_other):
        return False
    shared = 0
    for k in range(3):
        for m in range(3):
            shared += faces[i, k] == faces[j, m]
    # Two planes with a common edge meet there alone.
    return shared < 2 and (
        (through and _pierces(corners, normals, i, j, depth))
        or (through_other and _pierces(corners, normals, j, i, depth))
    )


@inner
def _heights(corners: FloatArray, normals: FloatArray, i: int, j: int) -> tuple[float, float]:
    """Return the lowest and the highest that a corner of triangle i stands over the plane of triangle j."""
    low, high = np.inf, -np.inf
    for k in range(3):
        height = 0.0
        for axis in range(3):
            height += normals[j, axis] * (corners[i, k, axis] - corners[j, 0, axis])
        low, high = min(low, height), max(high, height)
    return low, high


@inner
def _pierces(corners: FloatArray, normals: FloatArray, i: int, j: int, depth: float) -> bool:
    """Return whether an edge of triangle i passes through triangle j."""
    u, v, w = normals[j, 0], normals[j, 1], normals[j, 2]
    for side in range(3):
        start, end, origin = corners[i, side], corners[i, (side + 1) % 3], corners[j, 0]
        above = (start[0] - origin[0]) * u + (start[1] - origin[1]) * v + (start[2] - origin[2]) * w
        below = (end[0] - origin[0]) * u + (end[1] - origin[1]) * v + (end[2] - origin[2]) * w
        if not (min(above, below) < -depth and max(above, below) > depth):
            continue
        share = above / (above - below)
        x, y, z = (
            start[0] + (end[0] - start[0]) * share,
            start[1] + (end[1] - start[1]) * share,
            start[2] + (end[2] - start[2]) * share,
        )
        inside = True
        for k in range(3):
            first, second = corners[j, k], corners[j, (k + 1) % 3]
            a, b, c = second[0] - first[0], second[1] - first[1], second[2] - first[2]
            # Into the triangle: its normal times the edge.
            in_x, in_y, in_z = v * c - w * b, w * a - u * c, u * b - v * a
            inside = inside and in_x * (x - first[0]) + in_y * (y - first[1]) + in_z * (z - first[2]) > 0.0
        if inside:
            return True
    return False


@inner
def _parted(corners: FloatArray, normals: FloatArray, i: int, j: int, depth: float) -> bool:
    """Return whether all of triangle j lies beyond an edge of i, or inside by no more than a depth; both are flat."""
    u, v, w = normals[i, 0], normals[i, 1], normals[i, 2]
    for k in range(3):
        start = corners[i, k]
        end = corners[i, (k + 1) % 3]
        x, y, z = end[0] - start[0], end[1] - start[1], end[2] - start[2]
        # Into the triangle: its normal times the edge, as long as the edge.
        in_x, in_y, in_z = v * z - w * y, w * x - u * z, u * y - v * x
        reach = -np.inf
        for m in range(3):
            corner = corners[j, m]
            reach = max(
                reach, in_x * (corner[0] - start[0]) + in_y * (corner[1] - start[1]) + in_z * (corner[2] - start[2])
            )
        if reach <= depth * np.sqrt(x * x + y * y + z * z):
            return True
    return False
