"""A surface as its edge lengths alone, and edge flips on them: better triangles without touching the surface.

The distance along a surface depends on lengths only. An intrinsic triangulation keeps, for every triangle, the
lengths of its sides and what lies across them; its edges may be any straight lines along the surface between vertices,
not only those of the mesh. Two triangles that share an edge unfold into a plane; replacing the edge by the other
diagonal of that quadrilateral changes neither the surface nor its vertices. Flipping until every edge is locally
Delaunay ends after finitely many flips [Bobenko2007] and leaves cotangent weights that are nowhere negative.
"""

from __future__ import annotations

from math import cos, pi, sin, sqrt
from typing import final

import numpy as np

from geoprint.errors import InputError, MeshError, UsageError
from geoprint.geometry.halfedges import BORDER, matched, next_half, previous_half
from geoprint.geometry.operators import side_lengths
from geoprint.kernels import inner, njit
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen

# By how much opposite angles must exceed a half turn [rad] before an edge is flipped: on a grid, where they make one,
# rounding does not decide.
ANGLE_TOLERANCE = 1e-6

# A side may exceed the sum of the two others by this share of it: rounding of lengths in a triangle without area.
LENGTH_TOLERANCE = 1e-9


@final
@frozen
class IntrinsicTriangulation:
    """Triangles given by their side lengths, glued along their sides.

    Two corners of a triangle may be the same vertex, and a triangle may be its own neighbour: around a vertex with
    little angle left, the tip of a sharp cone, that is what straight edges do.

    Attributes:
        corners: (m, 3) vertex at each corner, counter-clockwise seen from outside.
        lengths: (m, 3) length of the side from corner i to corner i + 1 [mm], positive.
        twins: (m, 3) half-edge 3 f + i on the other side of that side; -1 on the border.
        vertex_count: n, vertices that no triangle uses included.
    """

    corners: IntArray
    lengths: FloatArray
    twins: IntArray
    vertex_count: int

    def __post_init__(self) -> None:
        freeze_arrays(self, corners="int: m 3", lengths="float: m 3", twins="int: m 3")
        if self.corners.size and (self.corners.min() < 0 or self.corners.max() >= self.vertex_count):
            raise InputError(
                f"a corner refers to vertex {self.corners.max()}, but there are {self.vertex_count} vertices, "
                "numbered from 0."
            )
        _require_twins(self.twins)
        _require_triangles(self.lengths)


def intrinsic_triangulation(surface: Surface) -> IntrinsicTriangulation:
    """Return the triangulation of a surface as it is, by its lengths.

    Args:
        surface: at most two faces at an edge, consistently wound.

    Raises:
        MeshError: an edge has more than two faces, two faces at an edge are wound against each other, or an edge has
            no length.
    """
    corners, starts = surface.faces.copy(), surface.faces.ravel()
    twins = matched(corners.ravel(), len(surface.vertices))
    # Beside an edge that is wound in one sense its half-edges run against each other.
    clashes = np.flatnonzero((twins < BORDER) | ((twins >= 0) & (starts[twins] == starts)))
    if clashes.size:
        clash = clashes[0]
        first, second = corners[clash // 3, clash % 3], corners[clash // 3, (clash + 1) % 3]
        raise MeshError(
            f"{surface.name}: the edge between vertices {first} and {second} has more than two faces, or two with "
            "opposite winding. Prepare the surface first.",
            face=int(clash // 3),
        )
    lengths = side_lengths(surface.vertices, surface.faces)
    if lengths.min() <= 0.0:
        face = int(np.argmin(lengths.min(axis=1)))
        raise MeshError(
            f"{surface.name}: face {face} at {surface.vertices[corners[face, 0]].tolist()} has two corners at the "
            "same point: prepare the surface first, which merges them.",
            face=face,
        )
    return _frozen(corners, lengths, twins.reshape(-1, 3), vertex_count=len(surface.vertices))


def delaunay(
    triangulation: IntrinsicTriangulation, *, margin: float = ANGLE_TOLERANCE, widest: float = 0.0
) -> IntrinsicTriangulation:
    """Flip edges until none demands it.

    An edge demands it when the angles opposite to it sum to more than a half turn plus `margin`, and the larger of
    them is wider than `widest`. With the defaults the result is Delaunay: unique but for four vertices on a circle.
    Border edges stay. An edge with the same triangle on both sides is Delaunay and stays too [Bobenko2007, sec. 2];
    every edge that demands a flip has two triangles that unfold into a convex quadrilateral, so that it can be
    flipped [Sharp2019, sec. 3].

    Args:
        triangulation: m triangles.
        margin: angle [rad] from ANGLE_TOLERANCE to below pi / 2. Larger ones leave mildly bad edges as they are.
        widest: angle [rad] from 0 to below pi. Only edges opposite to a wider one are flipped; every edge that is
            not Delaunay lies opposite to one of at least pi / 2.

    Returns:
        The same surface with the same vertices and number of triangles.

    Raises:
        UsageError: an angle is outside its range.
    """
    if not ANGLE_TOLERANCE <= margin < pi / 2:
        raise UsageError(f"margin is {margin} rad; it must be at least {ANGLE_TOLERANCE:g} and below pi / 2.")
    if not 0.0 <= widest < pi:
        raise UsageError(f"widest is {widest} rad; it must be at least 0 and below pi.")
    corners, lengths, twins = triangulation.corners.copy(), triangulation.lengths.copy(), triangulation.twins.copy()
    _flip_all(corners.ravel(), lengths.ravel(), twins.ravel(), sin(margin), cos(widest))
    return _frozen(corners, lengths, twins, vertex_count=triangulation.vertex_count)


def doubled_areas(triangulation: IntrinsicTriangulation) -> FloatArray:
    """Return twice the (m,) area [mm2] of each triangle, by Heron's formula with sorted sides [Kahan2014]."""
    c, b, a = np.sort(triangulation.lengths, axis=1).T
    product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c))
    return np.sqrt(np.maximum(product, 0.0)) / 2


def _frozen(corners: IntArray, lengths: FloatArray, twins: IntArray, *, vertex_count: int) -> IntrinsicTriangulation:
    """Hand over arrays that nobody else holds, without another copy."""
    for array in (corners, lengths, twins):
        array.setflags(write=False)
    return IntrinsicTriangulation(corners, lengths, twins, vertex_count)


def _require_twins(twins: IntArray) -> None:
    flat = twins.ravel()
    inner = np.flatnonzero(flat >= 0)
    if flat.size and (flat.min() < -1 or flat.max() >= flat.size or (flat[flat[inner]] != inner).any()):
        raise InputError("the twin of the twin of a half-edge must be itself, and -1 must mark the border.")


def _require_triangles(lengths: FloatArray) -> None:
    if lengths.size and lengths.min() <= 0.0:
        raise InputError(f"every side must have a positive length; the shortest is {lengths.min():g} mm.")
    first, second, third = lengths.T
    longest = np.maximum(np.maximum(first, second), third)
    excess = 2.0 * longest - (first + second + third)
    if (excess > LENGTH_TOLERANCE * longest).any():
        face = int(np.argmax(excess))
        raise InputError(f"the sides of triangle {face}, {lengths[face].tolist()} mm, do not close to a triangle.")


@njit
def _flip_all(
    corners: IntArray, lengths: FloatArray, twins: IntArray, sine_of_margin: float, cosine_of_widest: float
) -> int:
    """Flip edges in place until none demands it, and count the flips.

    The stack holds each half-edge at most once. A flip renames half-edges, so that an entry may then mean another
    edge; the four sides around a flip are pushed under their new names, so that no edge is missed.
    """
    stack = np.empty(corners.size, np.int64)
    stacked = np.zeros(corners.size, np.bool_)
    size = 0
    # From the end, so that the first edges come first: neighbours in the numbering are then warm in the cache.
    for half in range(corners.size - 1, -1, -1):
        if twins[half] > half:
            stack[size], stacked[half] = half, True
            size += 1
    flips = 0
    while size > 0:
        size -= 1
        half = int(stack[size])
        stacked[half] = False
        if _demands_flip(half, lengths, twins, sine_of_margin, cosine_of_widest):
            face, other = half - half % 3, twins[half] - twins[half] % 3
            _flip(half, corners, lengths, twins)
            flips += 1
            for side in (face + 1, face + 2, other + 1, other + 2):
                size = _push(stack, stacked, size, side)
    return flips


@inner
def _push(stack: IntArray, stacked: BoolArray, size: int, half: int) -> int:
    if stacked[half]:
        return size
    stacked[half] = True
    stack[size] = half
    return size + 1


@inner
def _demands_flip(
    half: int, lengths: FloatArray, twins: IntArray, sine_of_margin: float, cosine_of_widest: float
) -> bool:
    """Tell whether the angles opposite to an edge are too wide, from their sines and cosines."""
    twin = twins[half]
    if twin < 0 or twin // 3 == half // 3:
        return False
    cosine, sine = _opposite_angle(half, lengths)
    twin_cosine, twin_sine = _opposite_angle(twin, lengths)
    if min(cosine, twin_cosine) >= cosine_of_widest:
        return False
    sine_of_sum = sine * twin_cosine + cosine * twin_sine
    cosine_of_sum = cosine * twin_cosine - sine * twin_sine
    # The sum lies between 0 and a full turn; past three quarters of it its sine rises again.
    return sine_of_sum < -sine_of_margin or (sine_of_sum < 0.0 and cosine_of_sum > 0.0)


@inner
def _opposite_angle(half: int, lengths: FloatArray) -> tuple[float, float]:
    """Return cosine and sine of the angle opposite to a side."""
    side, right, left = lengths[half], lengths[next_half(half)], lengths[previous_half(half)]
    scale = 2.0 * right * left
    return (right * right + left * left - side * side) / scale, 2.0 * _doubled_area(side, right, left) / scale


@inner
def _doubled_area(side: float, right: float, left: float) -> float:
    """Return twice the area of a triangle, as `doubled_areas`."""
    a, c = max(side, right, left), min(side, right, left)
    b = max(min(side, right), min(max(side, right), left))
    return sqrt(max((a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c)), 0.0)) / 2


@inner
def _flip(half: int, corners: IntArray, lengths: FloatArray, twins: IntArray) -> None:
    """Replace the edge from u to v, with w on its left and x on its right, by the one from x to w.

    The left triangle becomes x, w, u and the right one w, x, v; the new edge is the first side of both.
    """
    twin = twins[half]
    face, other = half - half % 3, twin - twin % 3
    right, left = next_half(half), previous_half(half)
    twin_right, twin_left = next_half(twin), previous_half(twin)
    u, v, w, x = corners[half], corners[twin], corners[left], corners[twin_left]
    edge, vw, wu, ux, xv = lengths[half], lengths[right], lengths[left], lengths[twin_right], lengths[twin_left]
    # u at the origin, v on the first axis, w above and x below it.
    along = ((wu - ux) * (wu + ux) + (xv - vw) * (xv + vw)) / (2.0 * edge)
    across = (_doubled_area(edge, vw, wu) + _doubled_area(edge, ux, xv)) / edge
    diagonal = sqrt(along * along + across * across)
    old = (left, twin_right, twin_left, right)
    new = (face + 1, face + 2, other + 1, other + 2)
    outside = (twins[left], twins[twin_right], twins[twin_left], twins[right])
    corners[face], corners[face + 1], corners[face + 2] = x, w, u
    corners[other], corners[other + 1], corners[other + 2] = w, x, v
    lengths[face], lengths[face + 1], lengths[face + 2] = diagonal, wu, ux
    lengths[other], lengths[other + 1], lengths[other + 2] = diagonal, xv, vw
    twins[face], twins[other] = other, face
    for k in range(4):
        beyond = outside[k]
        # Where the quadrilateral is glued to itself, its sides have new names on both sides of the seam.
        for j in range(4):
            if outside[k] == old[j]:
                beyond = new[j]
        twins[new[k]] = beyond
        if beyond >= 0:
            twins[beyond] = new[k]
