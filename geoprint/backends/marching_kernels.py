"""Front marching on triangles given by their side lengths: numba kernels on plain half-edge arrays.

Half-edge 3 f + i runs along face f from its corner i to its corner i + 1 (mod 3), and stands for that corner too.
Directions at a vertex are bearings: angles [rad] counter-clockwise from its first half-edge, stretched at a vertex
inside the surface so that a full turn is 2 pi whatever angles meet there [Polthier1998]. On the border the first
half-edge is the one along the border, and nothing is stretched.
"""

from __future__ import annotations

from math import acos, atan2, cos, inf, pi, sin, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit

from geoprint.model import FloatArray, IntArray

# Marks of a vertex, added up. A seed vertex has distance 0; along border edges of the seed the front starts parallel.
SEED_VERTEX = 1
SEED_FIRST_EDGE = 2
SEED_LAST_EDGE = 4
# A corner of a triangle that holds a piece of the seed inside: between it and the next corner the distance has a
# valley, through which nothing is marched.
BESIDE_SEED = 8
# The arrival was computed along a straight line from the seed.
SEEN_FROM_SEED = 16
# A line that bends may beat such an arrival, but not by the error of marching near a point: this share of it.
SEEN_MARGIN = 0.05

# Newton's method for the point on an edge stops at steps of this share of the edge: twice its digits hold for the
# distance, whose derivative vanishes there.
NEWTON_STEP = 1e-5
NEWTON_ROUNDS = 6
# The largest single step, as a share of the edge: a cubic has regions where Newton's method overshoots.
LARGEST_STEP = 0.5


class Mesh(NamedTuple):
    """Half-edge arrays of m triangles and n vertices.

    Attributes:
        corners: (3 m,) vertex that each half-edge starts from.
        lengths: (3 m,) length [mm].
        twins: (3 m,) half-edge on the other side of the edge; -1 on the border.
        angles: (3 m,) angle of the corner [rad], not stretched.
        bearings: (3 m,) bearing of the half-edge at the vertex it starts from [rad].
        stretch: (n,) bearing by angle: 2 pi by the sum of angles inside, 1 on the border.
        first: (n,) first half-edge of each vertex; -1 where no triangle uses it.
    """

    corners: IntArray
    lengths: FloatArray
    twins: IntArray
    angles: FloatArray
    bearings: FloatArray
    stretch: FloatArray
    first: IntArray


class Front(NamedTuple):
    """What is known of the distance so far, and the vertices from which it still has to spread.

    Attributes:
        distances: (n,) [mm], infinite where nothing has arrived.
        origins: (n,) bearing back to where the shortest line to the vertex comes from [rad].
        marks: (n,) sum of the marks of the vertex.
        heap: (n,) binary heap of waiting vertices, the nearest first.
        places: (n,) place of each vertex in the heap, -1 outside.
        waiting: (1,) number of vertices in the heap.
    """

    distances: FloatArray
    origins: FloatArray
    marks: IntArray
    heap: IntArray
    places: IntArray
    waiting: IntArray


@njit(cache=True, error_model="numpy")
def measure_corners(
    corners: IntArray, lengths: FloatArray, twins: IntArray, vertex_count: int
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Return angles, bearings, stretch and first half-edges, as `Mesh` holds them."""
    angles = np.empty(corners.size)
    first = np.full(vertex_count, -1)
    sums = np.zeros(vertex_count)
    for half in range(corners.size):
        right, left, across = lengths[half], lengths[before(half)], lengths[after(half)]
        cosine = (right * right + left * left - across * across) / (2.0 * right * left)
        angles[half] = acos(min(1.0, max(-1.0, cosine)))
        vertex = corners[half]
        sums[vertex] += angles[half]
        if twins[half] < 0 or first[vertex] < 0:
            first[vertex] = half
    bearings = np.zeros(corners.size)
    stretch = np.ones(vertex_count)
    for vertex in range(vertex_count):
        half = first[vertex]
        if half < 0:
            continue
        if twins[half] >= 0:
            stretch[vertex] = 2.0 * pi / sums[vertex]
        angle = 0.0
        while True:
            bearings[half] = angle * stretch[vertex]
            angle += angles[half]
            half = twins[before(half)]
            if half < 0 or half == first[vertex]:
                break
    return angles, bearings, stretch, first


@njit(cache=True, error_model="numpy")
def march(mesh: Mesh, front: Front, tolerance: float, meeting: float) -> int:
    """Spread the distance from the waiting vertices until nothing changes.

    The nearest waiting vertex leaves the heap and offers its distance to the triangles around it; a vertex that
    improves later comes back. So the result does not hang on the order where triangles are obtuse.

    Args:
        mesh: m triangles.
        front: changed in place; the waiting vertices are the seed.
        tolerance: smaller improvements are not made [mm].
        meeting: where the slopes at both ends of an edge rise towards each other by more than this, two fronts meet
            on it.

    Returns:
        How many vertices left the heap.
    """
    count = 0
    while front.waiting[0] > 0:
        vertex = pop_nearest(front)
        count += 1
        half = mesh.first[vertex]
        while True:
            improve(mesh, front, after(half), vertex, tolerance, meeting)
            improve(mesh, front, before(half), vertex, tolerance, meeting)
            half = mesh.twins[before(half)]
            if half < 0 or half == mesh.first[vertex]:
                break
    return count


@njit(cache=True, error_model="numpy", inline="always")
def improve(mesh: Mesh, front: Front, corner: int, nearest: int, tolerance: float, meeting: float) -> None:
    """Offer the vertex at a corner the shortest line through its triangle, from the edge opposite to it.

    Args:
        mesh: m triangles.
        front: changed in place.
        corner: half-edge that starts from the vertex.
        nearest: which end of the opposite edge has just left the heap; no waiting vertex is nearer.
        tolerance: smaller improvements are not made [mm].
        meeting: as for `march`.
    """
    vertex = mesh.corners[corner]
    known = front.distances[vertex]
    edge, last = after(corner), before(corner)
    start, end = mesh.corners[edge], mesh.corners[last]
    # An edge farther than the vertex on both ends cannot lower it.
    if known > min(front.distances[start], front.distances[end]) and not front.marks[vertex] & (SEED_VERTEX | BESIDE_SEED):
        if front.distances[start] == inf:
            offer, share = front.distances[end] + mesh.lengths[last], 1.0
        elif front.distances[end] == inf:
            offer, share = front.distances[start] + mesh.lengths[corner], 0.0
        else:
            offer, share = through_edge(mesh, front, corner, known, meeting)
        if front.marks[vertex] & SEEN_FROM_SEED:
            tolerance = max(tolerance, SEEN_MARGIN * known)
        if offer < known - tolerance:
            angle = crossing_angle(mesh.lengths[edge], mesh.lengths[corner], mesh.lengths[last], share)
            arrive(front, vertex, offer, mesh.bearings[corner] + angle * mesh.stretch[vertex])


@njit(cache=True, error_model="numpy", inline="always")
def arrive(front: Front, vertex: int, distance: float, origin: float) -> None:
    """Set a smaller distance of a vertex and let it wait for its turn."""
    front.distances[vertex] = distance
    front.origins[vertex] = origin
    if front.places[vertex] < 0:
        front.heap[front.waiting[0]] = vertex
        front.places[vertex] = front.waiting[0]
        front.waiting[0] += 1
    rise(front, front.places[vertex])


@njit(cache=True, error_model="numpy", inline="always")
def through_edge(mesh: Mesh, front: Front, corner: int, known: float, meeting: float) -> tuple[float, float]:
    """Return the shortest arrival at a corner through its opposite edge, and where it crosses the edge.

    On the edge, s in [0, 1] from start to end, the distance is H(s): the cubic with the values and slopes of both
    ends. The arrival is the smallest H(s) + r(s), r the length of the straight line from there to the corner. Where
    the slopes say that two fronts meet on the edge, each is continued straight from its end and the smaller arrival
    counts: a cubic would smear the ridge between them.

    Returns:
        Distance [mm], no sharp one where it cannot beat `known`; s.
    """
    edge, last = after(corner), before(corner)
    length, start, end = mesh.lengths[edge], mesh.corners[edge], mesh.corners[last]
    # The corner seen from the start of the edge: `along` it and `away` from it.
    along, away = apex(length, mesh.lengths[corner], mesh.lengths[last])
    low, high = front.distances[start], front.distances[end]
    first = slope(mesh, front, start, mesh.bearings[edge])
    second = -slope(mesh, front, end, mesh.bearings[last] + mesh.angles[last] * mesh.stretch[end])
    if first - second > meeting:
        share = planar_share(along, away, first, length)
        arrival = low + share * length * first + reach(along, away, length, share)
        other = planar_share(along, away, second, length)
        other_arrival = high - (1.0 - other) * length * second + reach(along, away, length, other)
        if other_arrival < arrival:
            arrival, share = other_arrival, other
    else:
        climb = high - low
        share = planar_share(along, away, climb / length, length)
        arrival = low + share * climb + reach(along, away, length, share)
        bulge, last_bulge = first * length - climb, climb - second * length
        # The cubic differs from the line by at most a quarter of this.
        if arrival - 0.25 * (abs(bulge) + abs(last_bulge)) < known:
            share = cubic_share(share, along, away, length, climb, bulge, last_bulge)
            arrival = low + share * climb + reach(along, away, length, share)
            arrival += share * (1.0 - share) * (bulge * (1.0 - share) + last_bulge * share)
    return arrival, share


@njit(cache=True, error_model="numpy", inline="always")
def apex(length: float, right: float, left: float) -> tuple[float, float]:
    """Return how far along a side from its start, and how far away from it, the opposite corner is [mm].

    Args:
        length: the side.
        right: from its start to the corner.
        left: from its end to the corner.
    """
    along = 0.5 * (length + (right - left) * (right + left) / length)
    return along, sqrt(max(right * right - along * along, 0.0))


@njit(cache=True, error_model="numpy", inline="always")
def reach(along: float, away: float, length: float, share: float) -> float:
    """Return the distance from a point on an edge to the opposite corner [mm]."""
    offset = share * length - along
    return sqrt(offset * offset + away * away)


@njit(cache=True, error_model="numpy")
def crossing_angle(length: float, right: float, left: float, share: float) -> float:
    """Return the angle at a corner between its sides to the start and to a point of the opposite edge [rad]."""
    along, away = apex(length, right, left)
    return abs(atan2(share * length * away, away * away - along * (share * length - along)))


@njit(cache=True, error_model="numpy", inline="always")
def planar_share(along: float, away: float, gradient: float, length: float) -> float:
    """Return where the shortest line crosses an edge on which the distance is linear."""
    if gradient >= 1.0:
        return 0.0
    if gradient <= -1.0:
        return 1.0
    return min(1.0, max(0.0, (along - away * gradient / sqrt(1.0 - gradient * gradient)) / length))


@njit(cache=True, error_model="numpy", inline="always")
def cubic_share(
    share: float, along: float, away: float, length: float, climb: float, first: float, last: float
) -> float:
    """Return where the shortest line crosses an edge on which the distance is cubic, by Newton's method.

    The distance is the linear one plus s (1 - s) (first (1 - s) + last s).
    """
    for _ in range(NEWTON_ROUNDS):
        offset = share * length - along
        ray = reach(along, away, length, share)
        if ray == 0.0:
            break
        one, other = 1.0 - share, share
        descent = climb + first * one * (1.0 - 3.0 * share) + last * other * (2.0 - 3.0 * share)
        descent += length * offset / ray
        bend = first * (6.0 * share - 4.0) + last * (2.0 - 6.0 * share)
        bend += length * length * away * away / (ray * ray * ray)
        if bend <= 0.0:
            break
        step = min(LARGEST_STEP, max(-LARGEST_STEP, -descent / bend))
        following = min(1.0, max(0.0, share + step))
        moved = abs(following - share)
        share = following
        if moved < NEWTON_STEP:
            break
    return share


@njit(cache=True, error_model="numpy", inline="always")
def slope(mesh: Mesh, front: Front, vertex: int, bearing: float) -> float:
    """Return the derivative of the distance at a vertex in a direction, per mm.

    On the seed it is 1, but less than a quarter turn from a seeded border edge the sine of the angle to that edge.
    """
    marks = front.marks[vertex]
    if not marks & SEED_VERTEX:
        return -cos(bearing - front.origins[vertex])
    steepest = 1.0
    if marks & SEED_FIRST_EDGE and bearing < 0.5 * pi:
        steepest = sin(bearing)
    if marks & SEED_LAST_EDGE:
        remaining = border_bearing(mesh, vertex) - bearing
        if remaining < 0.5 * pi:
            steepest = min(steepest, sin(remaining))
    return max(steepest, 0.0)


@njit(cache=True, error_model="numpy")
def border_bearing(mesh: Mesh, vertex: int) -> float:
    """Return the bearing of the last edge of a border vertex: the sum of its angles [rad]."""
    half = mesh.first[vertex]
    while mesh.twins[before(half)] >= 0:
        half = mesh.twins[before(half)]
    return mesh.bearings[half] + mesh.angles[half]


@njit(cache=True, error_model="numpy", inline="always")
def pop_nearest(front: Front) -> int:
    """Take the nearest vertex out of the heap."""
    heap, places = front.heap, front.places
    nearest = heap[0]
    places[nearest] = -1
    front.waiting[0] -= 1
    count = front.waiting[0]
    if count > 0:
        heap[0] = heap[count]
        places[heap[0]] = 0
        sink(front, count)
    return nearest


@njit(cache=True, error_model="numpy", inline="always")
def rise(front: Front, place: int) -> None:
    """Move the vertex at a place of the heap up to where it belongs."""
    heap, places, keys = front.heap, front.places, front.distances
    vertex = heap[place]
    while place > 0:
        parent = (place - 1) >> 1
        if keys[heap[parent]] <= keys[vertex]:
            break
        heap[place] = heap[parent]
        places[heap[place]] = place
        place = parent
    heap[place] = vertex
    places[vertex] = place


@njit(cache=True, error_model="numpy", inline="always")
def sink(front: Front, count: int) -> None:
    """Move the vertex at the top of a heap of `count` down to where it belongs."""
    heap, places, keys = front.heap, front.places, front.distances
    vertex, place = heap[0], 0
    while 2 * place + 1 < count:
        child = 2 * place + 1
        if child + 1 < count and keys[heap[child + 1]] < keys[heap[child]]:
            child += 1
        if keys[heap[child]] >= keys[vertex]:
            break
        heap[place] = heap[child]
        places[heap[place]] = place
        place = child
    heap[place] = vertex
    places[vertex] = place


@njit(cache=True, error_model="numpy", inline="always")
def after(half: int) -> int:
    """Return the next half-edge of the same triangle."""
    return half + 1 if half % 3 < 2 else half - 2


@njit(cache=True, error_model="numpy", inline="always")
def before(half: int) -> int:
    """Return the half-edge of the same triangle that ends where this one starts."""
    return half - 1 if half % 3 > 0 else half + 2
