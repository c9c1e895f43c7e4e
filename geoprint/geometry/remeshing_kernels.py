"""The steps of remeshing on half-edges: splitting, flipping and collapsing edges [Botsch2004].

A mesh in work is three arrays over half-edges, numbered as in `topology`: half-edge h = 3 f + i begins at vertex
starts[h], its other side is twins[h] (-1 on the rim), and curves[h] says whether its edge lies on a curve that is
kept. The kernels change them in place; only `remeshing` calls them.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from geoprint.geometry.creases import CORNER, INSIDE, LEAST_RIM
from geoprint.geometry.halfedges import next_half, previous_half
from geoprint.kernels import inner, njit
from geoprint.model import BoolArray, FloatArray, IntArray

# Faces around a vertex beyond which its edges are left alone: a good vertex has six.
MOST_AROUND = 64
# No face turns by more than 60 degrees in one step.
LEAST_COSINE = 0.5
# An edge is flipped if the cotangents opposite to it sum to less than minus this: rounding does not decide.
COTANGENT_TOLERANCE = 1e-6

Vector = tuple[float, float, float]


@njit
def split(
    chosen: IntArray, starts: IntArray, twins: IntArray, curves: BoolArray, vertices: int, faces: int
) -> IntArray:
    """Halve edges, the first chosen first, at most one of each face.

    Args:
        chosen: half-edges, one of each edge.
        starts: with room for two more faces behind the first `faces` for each chosen edge; and so the others.
        twins: (3 m,) other side of each half-edge, with the same room.
        curves: (3 m,) whether it lies on a curve that is kept, with the same room.
        vertices: number of vertices so far; the new ones follow.
        faces: number of faces so far.

    Returns:
        (k,) the half-edges that were halved, in the order of the new vertices, at which they end now.
    """
    # New faces count as touched.
    touched = np.ones(starts.size // 3, dtype=np.bool_)
    touched[:faces] = False
    done, count = np.empty(chosen.size, dtype=np.int64), 0
    for index in range(chosen.size):
        side = int(chosen[index])
        other = int(twins[side])
        if touched[side // 3] or (other >= 0 and touched[other // 3]):
            continue
        touched[side // 3] = True
        middle = vertices + count
        behind = 3 * faces
        faces += 1
        starts[behind], starts[behind + 1] = middle, starts[next_half(side)]
        starts[behind + 2] = starts[previous_half(side)]
        _set(behind + 1, int(twins[next_half(side)]), bool(curves[next_half(side)]), twins, curves)
        starts[next_half(side)] = middle
        _set(next_half(side), behind + 2, False, twins, curves)
        _set(behind, -1, bool(curves[side]), twins, curves)
        if other >= 0:
            touched[other // 3] = True
            before = 3 * faces
            faces += 1
            starts[before], starts[before + 1] = starts[other], middle
            starts[before + 2] = starts[previous_half(other)]
            _set(before + 2, int(twins[previous_half(other)]), bool(curves[previous_half(other)]), twins, curves)
            starts[other] = middle
            _set(previous_half(other), before + 1, False, twins, curves)
            _set(before, behind, bool(curves[side]), twins, curves)
        done[count] = side
        count += 1
    return done[:count]


@njit
def flip(starts: IntArray, twins: IntArray, curves: BoolArray, vertices: FloatArray) -> int:
    """Flip the edges off the curves whose opposite angles sum to more than a half turn; return how many.

    An edge stays where a face would turn far, or where its opposite corners are joined already.
    """
    count = 0
    outgoing = _outgoing(starts, len(vertices))
    ring = np.empty(MOST_AROUND, dtype=np.int64)
    for side in range(starts.size):
        other = int(twins[side])
        if other < side or curves[side]:
            continue
        after, before, other_after, other_before = (
            next_half(side),
            previous_half(side),
            next_half(other),
            previous_half(other),
        )
        a, b, c, d = int(starts[side]), int(starts[other]), int(starts[before]), int(starts[other_before])
        around = _ring(int(outgoing[c]), twins, ring)
        if around < 0 or not _flip_gains(vertices, a, b, c, d) or _among(d, ring[:around], starts, twins):
            continue
        # The outer sides move on: two within their face, two to the other face.
        twin, curve = int(twins[after]), bool(curves[after])
        other_twin, other_curve = int(twins[other_after]), bool(curves[other_after])
        _set(after, int(twins[before]), bool(curves[before]), twins, curves)
        _set(other_after, int(twins[other_before]), bool(curves[other_before]), twins, curves)
        _set(before, other_twin, other_curve, twins, curves)
        _set(other_before, twin, curve, twins, curves)
        starts[side], starts[after], starts[before] = d, c, a
        starts[other], starts[other_after], starts[other_before] = c, d, b
        outgoing[a], outgoing[b], outgoing[c], outgoing[d] = before, other_before, after, other_after
        count += 1
    return count


@njit
def collapse(
    chosen: IntArray, starts: IntArray, twins: IntArray, curves: BoolArray, vertices: FloatArray, kinds: IntArray,
    shortest: float, longest: float,
) -> BoolArray:  # fmt: skip
    """Collapse short edges onto one of their ends, the first chosen first, wherever the surface stays a manifold.

    An edge goes, with the faces beside it, if its ends have no common neighbour but the corners of these faces (the
    link condition [Dey1999]), no face turns far, and no edge that comes out is long. Curves are shortened along
    themselves alone, and their corners stay.

    Args:
        chosen: half-edges.
        starts: (3 m,) vertex at which each half-edge begins.
        twins: (3 m,) its other side.
        curves: (3 m,) whether it lies on a curve that is kept.
        vertices: (n, 3) positions [mm].
        kinds: (n,) as `creases` gives them.
        shortest: an edge must be shorter to go [mm]; others may have grown meanwhile.
        longest: edge that may come out [mm].

    Returns:
        (m,) whether each face is left.
    """
    left = np.ones(starts.size // 3, dtype=np.bool_)
    outgoing = _outgoing(starts, len(vertices))
    ring = np.empty(MOST_AROUND, dtype=np.int64)
    for index in range(chosen.size):
        for side in (int(chosen[index]), int(twins[chosen[index]])):
            if side < 0 or not left[side // 3]:
                continue
            lost, kept = int(starts[side]), int(starts[next_half(side)])
            if _distance(vertices, lost, kept) >= shortest or kinds[lost] == CORNER:
                continue
            if (kinds[lost] != INSIDE and not curves[side]) or _on_small_rim(side, twins):
                continue
            around = _ring(side, twins, ring)
            if (
                around < 0
                or not _link_holds(side, ring[:around], starts, twins, outgoing)
                or not _stays_in_shape(ring[:around], kept, starts, vertices, longest)
            ):
                continue
            _remove(side, ring[:around], starts, twins, curves, outgoing, left)
            break
    return left


@inner
def _set(side: int, twin: int, curve: bool, twins: IntArray, curves: BoolArray) -> None:
    """Make two half-edges the sides of one edge, or one the rim."""
    twins[side], curves[side] = twin, curve
    if twin >= 0:
        twins[twin], curves[twin] = side, curve


@njit
def _outgoing(starts: IntArray, vertices: int) -> IntArray:
    """Return a half-edge that begins at each vertex, or -1."""
    outgoing = np.full(vertices, -1, dtype=np.int64)
    for side in range(starts.size):
        outgoing[starts[side]] = side
    return outgoing


@inner
def _ring(first: int, twins: IntArray, ring: IntArray) -> int:
    """Put the half-edges that begin at the vertex of one of them into a buffer; return how many, -1 if too many."""
    count, side = 0, first
    while True:
        if count == ring.size:
            return -1
        ring[count] = side
        count += 1
        side = twins[previous_half(side)]
        if side == first:
            return count
        if side < 0:
            break
    side = twins[first]
    while side >= 0:
        if count == ring.size:
            return -1
        ring[count] = next_half(side)
        count += 1
        side = twins[next_half(side)]
    return count


@inner
def _on_small_rim(side: int, twins: IntArray) -> bool:
    """Return whether an edge is on a rim of no more than LEAST_RIM edges."""
    if twins[side] >= 0:
        return False
    here = side
    for _ in range(LEAST_RIM):
        here = next_half(here)
        while twins[here] >= 0:
            here = next_half(int(twins[here]))
        if here == side:
            return True
    return False


@inner
def _among(vertex: int, ring: IntArray, starts: IntArray, twins: IntArray) -> bool:
    """Return whether a vertex is a neighbour of that of a ring."""
    for side in ring:
        before = previous_half(side)
        if starts[next_half(side)] == vertex or (twins[before] < 0 and starts[before] == vertex):
            return True
    return False


@njit
def _link_holds(side: int, ring: IntArray, starts: IntArray, twins: IntArray, outgoing: IntArray) -> bool:
    """Return whether collapsing an edge leaves a manifold."""
    other_ring = np.empty(MOST_AROUND, dtype=np.int64)
    around = _ring(int(outgoing[starts[next_half(side)]]), twins, other_ring)
    if around < 0:
        return False
    common = 0
    for spoke in other_ring[:around]:
        before = previous_half(spoke)
        if _among(int(starts[next_half(spoke)]), ring, starts, twins):
            common += 1
        if twins[before] < 0 and _among(int(starts[before]), ring, starts, twins):
            common += 1
    if common != (1 if twins[side] < 0 else 2):
        return False
    for here in (side, int(twins[side])):
        if here < 0:
            continue
        # The opposite corner loses a face: a fan keeps one on the rim, three inside.
        around = _ring(previous_half(here), twins, other_ring)
        on_rim = False
        for spoke in other_ring[: max(around, 0)]:
            on_rim = on_rim or twins[spoke] < 0 or twins[previous_half(spoke)] < 0
        if around < (2 if on_rim else 4):
            return False
    return True


@inner
def _stays_in_shape(ring: IntArray, kept: int, starts: IntArray, vertices: FloatArray, longest: float) -> bool:
    """Return whether the faces of a ring neither turn far nor get long edges where its vertex becomes another."""
    for side in ring:
        lost, second, third = int(starts[side]), int(starts[next_half(side)]), int(starts[previous_half(side)])
        if kept in (second, third):
            continue
        if _distance(vertices, kept, second) > longest or _distance(vertices, kept, third) > longest:
            return False
        if not _agree(_normal(vertices, lost, second, third), _normal(vertices, kept, second, third)):
            return False
    return True


@inner
def _remove(
    side: int, ring: IntArray, starts: IntArray, twins: IntArray, curves: BoolArray, outgoing: IntArray, left: BoolArray
) -> None:
    """Collapse an edge onto its end."""
    kept = starts[next_half(side)]
    for spoke in ring:
        starts[spoke] = kept
    for here in (side, int(twins[side])):
        if here < 0:
            continue
        after, before = next_half(here), previous_half(here)
        inner, outer = int(twins[after]), int(twins[before])
        curve = bool(curves[after]) or bool(curves[before])
        corner = starts[before]
        if inner >= 0:
            _set(inner, outer, curve, twins, curves)
        elif outer >= 0:
            _set(outer, -1, curve, twins, curves)
        left[here // 3] = False
        beyond = inner if inner >= 0 else outer
        # One of the outer sides begins at the corner, the other at the end that is kept, whichever is left.
        if starts[beyond] == corner:
            outgoing[corner], outgoing[kept] = beyond, next_half(beyond)
        else:
            outgoing[kept], outgoing[corner] = beyond, next_half(beyond)


@inner
def _flip_gains(vertices: FloatArray, a: int, b: int, c: int, d: int) -> bool:
    """Return whether edge a b opposite to c and d is better replaced by c d, and its faces agree then."""
    if _cotangent(vertices, c, a, b) + _cotangent(vertices, d, a, b) >= -COTANGENT_TOLERANCE:
        return False
    one, other = _normal(vertices, a, b, c), _normal(vertices, b, a, d)
    old = (one[0] + other[0], one[1] + other[1], one[2] + other[2])
    return _agree(old, _normal(vertices, d, c, a)) and _agree(old, _normal(vertices, c, d, b))


@inner
def _agree(old: Vector, new: Vector) -> bool:
    """Return whether a normal is not turned far; neither need have length 1."""
    length = sqrt(_dot(new, new))
    return length > 0.0 and _dot(old, new) >= LEAST_COSINE * sqrt(_dot(old, old)) * length


@inner
def _cotangent(vertices: FloatArray, apex: int, a: int, b: int) -> float:
    """Return the cotangent of the angle at an apex."""
    crossed = _normal(vertices, apex, a, b)
    return _dot(_step(vertices, apex, a), _step(vertices, apex, b)) / max(sqrt(_dot(crossed, crossed)), 1e-300)


@inner
def _normal(vertices: FloatArray, a: int, b: int, c: int) -> Vector:
    """Return twice the area vector of a triangle."""
    x, y, z = _step(vertices, a, b)
    u, v, w = _step(vertices, a, c)
    return y * w - z * v, z * u - x * w, x * v - y * u


@inner
def _distance(vertices: FloatArray, a: int, b: int) -> float:
    step = _step(vertices, b, a)
    return sqrt(_dot(step, step))


@inner
def _step(vertices: FloatArray, a: int, b: int) -> Vector:
    return vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2]


@inner
def _dot(one: Vector, other: Vector) -> float:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
