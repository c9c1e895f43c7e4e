"""Fast marching on triangles given by their side lengths: the numba kernels, up to where levels cross edges."""

from __future__ import annotations

from math import acos, atan2, cos, inf, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from geoprint.geometry.halfedges import next_half, previous_half
from geoprint.kernels import inlined, inner, njit, uncounted
from geoprint.model import FloatArray, IntArray

# What front marching works on: half-edge arrays, the state of the front, and the heap of vertices that wait.
#
# Half-edges are numbered as `geometry.halfedges` says. Directions at a vertex are bearings: angles [rad]
# counter-clockwise from its first half-edge, stretched at a vertex inside the surface so that a full turn is 2 pi
# whatever angles meet there [Polthier1998]. On the border the first half-edge is the one along the border, and
# nothing is stretched.
#
# Small kernels are inlined into the loops that call them, and those loops count no references (`uncounted`).


# Marks of a vertex, added up. A source vertex has distance 0; along its border edges the front starts parallel.
SEED_VERTEX = 1
SEED_FIRST_EDGE = 2
SEED_LAST_EDGE = 4
# A corner of a triangle that holds a piece of the source inside: between it and the next corner the distance has a
# valley, through which nothing is marched.
BESIDE_SEED = 8
# The arrival was computed along a straight line from the source.
SEEN_FROM_SEED = 16


class MarchingMesh(NamedTuple):
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


@njit
def measure_corners(
    corners: IntArray, lengths: FloatArray, twins: IntArray, vertex_count: int
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Return angles, bearings, stretch and first half-edges, as `MarchingMesh` holds them."""
    angles = np.empty(corners.size)
    first = np.full(vertex_count, -1)
    sums = np.zeros(vertex_count)
    for half in range(corners.size):
        right, left, across = lengths[half], lengths[previous_half(half)], lengths[next_half(half)]
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
            half = twins[previous_half(half)]
            if half < 0 or half == first[vertex]:
                break
    return angles, bearings, stretch, first


@inlined
def arrive(front: Front, vertex: int, distance: float, origin: float) -> None:
    """Set a smaller distance of a vertex and let it wait for its turn."""
    front.distances[vertex] = distance
    front.origins[vertex] = origin
    if front.places[vertex] < 0:
        front.heap[front.waiting[0]] = vertex
        front.places[vertex] = front.waiting[0]
        front.waiting[0] += 1
    rise(front, front.places[vertex])


@inlined
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


@inlined
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


@inlined
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


@inner
def border_bearing(mesh: MarchingMesh, vertex: int) -> float:
    """Return the bearing of the last edge of a border vertex: the sum of its angles [rad]."""
    half = int(mesh.first[vertex])
    while mesh.twins[previous_half(half)] >= 0:
        half = int(mesh.twins[previous_half(half)])
    return mesh.bearings[half] + mesh.angles[half]


# Front marching on triangles given by their side lengths: the numba kernels that spread a distance.


# A line that bends may beat such an arrival, but not by the error of marching near a point: this share of it.
SEEN_MARGIN = 0.05

# Arrivals whose directions have a larger cosine between them are one line, of which the shorter reading is better.
SAME_LINE = 1.0 - 1e-6

# Newton's method for the point on an edge stops at steps of this share of the edge: twice its digits hold for the
# distance, whose derivative vanishes there.
NEWTON_STEP = 1e-5
NEWTON_ROUNDS = 6
# The largest single step, as a share of the edge: a cubic has regions where Newton's method overshoots.
LARGEST_STEP = 0.5
# The direction of arrival follows from the slope within the edge: that of the cubic amplifies errors from step to step
# until they fill the front, the mean of the slopes at both ends damps them but drifts off curved fronts. Half of each:
# over 3000 triangles a planar front then stays within 0.03 edges, against 0.3 with the cubic alone.
CUBIC_TRUST = 0.5


@uncounted
def march(mesh: MarchingMesh, front: Front, tolerance: float, meeting: float) -> int:
    """Spread the distance from the waiting vertices until nothing changes.

    The nearest waiting vertex leaves the heap, and the edges of the triangles around it offer their distance to the
    corners opposite to them; a vertex that improves later comes back. An edge with one end still farther than the
    corner offers too: the shortest line may cross it near its other end.

    Args:
        mesh: m triangles.
        front: changed in place; the waiting vertices are the source.
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
            improve(mesh, front, next_half(half), tolerance, meeting)
            improve(mesh, front, previous_half(half), tolerance, meeting)
            half = mesh.twins[previous_half(half)]
            if half < 0 or half == mesh.first[vertex]:
                break
    return count


@uncounted
def settle(mesh: MarchingMesh, front: Front, order: IntArray, tolerance: float, meeting: float) -> None:
    """Find every distance anew from what its neighbours know in the end.

    While the front marches, an edge may offer an arrival before the direction at its farther end is final; such an
    arrival can be too small, and stays. Here it goes.

    Args:
        mesh: m triangles.
        front: as marching left it; changed in place.
        order: (n,) vertices by rising distance.
        tolerance: of arrivals from two sides that differ by less the first counts [mm].
        meeting: as for `march`.
    """
    for k in range(order.size):
        vertex = int(order[k])
        if front.marks[vertex] & (SEED_VERTEX | BESIDE_SEED | SEEN_FROM_SEED) or front.distances[vertex] == inf:
            continue
        best, origin, known = inf, 0.0, front.distances[vertex]
        half = int(mesh.first[vertex])
        while True:
            edge, last = next_half(half), previous_half(half)
            if known > min(front.distances[mesh.corners[edge]], front.distances[mesh.corners[last]]):
                offer, share = through_edge(mesh, front, half, best, meeting)
                if offer < best:
                    angle = crossing_angle(mesh.lengths[edge], mesh.lengths[half], mesh.lengths[last], share)
                    bearing = mesh.bearings[half] + angle * mesh.stretch[vertex]
                    if offer < best - tolerance or cos(bearing - origin) > SAME_LINE:
                        best, origin = offer, bearing
            half = int(mesh.twins[last])
            if half < 0 or half == mesh.first[vertex]:
                break
        if best < inf:
            front.distances[vertex], front.origins[vertex] = best, origin


@inlined
def improve(mesh: MarchingMesh, front: Front, corner: int, tolerance: float, meeting: float) -> None:
    """Offer the vertex at a corner the shortest line through its triangle, from the edge opposite to it.

    Args:
        mesh: m triangles.
        front: changed in place.
        corner: half-edge that starts from the vertex.
        tolerance: smaller improvements are not made [mm].
        meeting: as for `march`.
    """
    vertex = int(mesh.corners[corner])
    known = front.distances[vertex]
    edge, last = next_half(corner), previous_half(corner)
    start, end = int(mesh.corners[edge]), int(mesh.corners[last])
    # An edge farther than the vertex on both ends cannot lower it.
    if known > min(front.distances[start], front.distances[end]) and not front.marks[vertex] & (
        SEED_VERTEX | BESIDE_SEED
    ):
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


@inlined
def through_edge(mesh: MarchingMesh, front: Front, corner: int, known: float, meeting: float) -> tuple[float, float]:
    """Return the shortest arrival at a corner through its opposite edge, and where it crosses the edge.

    On the edge, s in [0, 1] from start to end, the distance is H(s): the cubic with the values and slopes of both
    ends. The arrival is the smallest H(s) + r(s), r the length of the straight line from there to the corner. Where
    the slopes say that two fronts meet on the edge, each is continued straight from its end and the smaller arrival
    counts: a cubic would smear the ridge between them.

    Returns:
        Distance [mm], no sharp one where it cannot beat `known`; s.
    """
    edge, last = next_half(corner), previous_half(corner)
    length, start, end = mesh.lengths[edge], int(mesh.corners[edge]), int(mesh.corners[last])
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


@inlined
def apex(length: float, right: float, left: float) -> tuple[float, float]:
    """Return how far along a side from its start, and how far away from it, the opposite corner is [mm].

    Args:
        length: the side.
        right: from its start to the corner.
        left: from its end to the corner.
    """
    along = 0.5 * (length + (right - left) * (right + left) / length)
    return along, sqrt(max(right * right - along * along, 0.0))


@inlined
def reach(along: float, away: float, length: float, share: float) -> float:
    """Return the distance from a point on an edge to the opposite corner [mm]."""
    offset = share * length - along
    return sqrt(offset * offset + away * away)


@inner
def crossing_angle(length: float, right: float, left: float, share: float) -> float:
    """Return the angle at a corner between its sides to the start and to a point of the opposite edge [rad]."""
    along, away = apex(length, right, left)
    return abs(atan2(share * length * away, away * away - along * (share * length - along)))


@inlined
def planar_share(along: float, away: float, gradient: float, length: float) -> float:
    """Return where the shortest line crosses an edge on which the distance is linear."""
    if gradient >= 1.0:
        return 0.0
    if gradient <= -1.0:
        return 1.0
    return min(1.0, max(0.0, (along - away * gradient / sqrt(1.0 - gradient * gradient)) / length))


@inlined
def cubic_share(
    share: float, along: float, away: float, length: float, climb: float, first: float, last: float
) -> float:
    """Return where the shortest line crosses an edge on which the distance is cubic, by Newton's method.

    The distance is the linear one plus s (1 - s) (first (1 - s) + last s). Its slope is taken in part from the slopes
    at both ends alone (CUBIC_TRUST); near the smallest arrival a shift changes it in second order only.
    """
    for _ in range(NEWTON_ROUNDS):
        offset = share * length - along
        ray = reach(along, away, length, share)
        if ray == 0.0:
            break
        rest = 1.0 - share
        descent = climb + first * rest - last * share + CUBIC_TRUST * 3.0 * share * rest * (last - first)
        descent += length * offset / ray
        bend = CUBIC_TRUST * 3.0 * (1.0 - 2.0 * share) * (last - first) - first - last
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


@inlined
def slope(mesh: MarchingMesh, front: Front, vertex: int, bearing: float) -> float:
    """Return the derivative of the distance at a vertex in a direction, per mm.

    On the source it is 1, but less than a quarter turn from a seeded border edge the sine of the angle to that edge.
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


# Where levels cross the edges of a mesh, given the marched front: a numba kernel.
#
# A straight line between the two values on an edge misses the level by up to the edge's squared length by eight
# radii of the front. The front knows its slopes at both ends, and the cubic through values and slopes hits it.


# Half-edges whose length differs by more than this share from the edge's are another line between its ends.
SAME_LENGTH = 1e-9
# Halvings of the bracket: the share is exact to 1e-12.
HALVINGS = 40


@njit
def crossing_shares(
    mesh: MarchingMesh, front: Front, edges: IntArray, lengths: FloatArray, levels: FloatArray, meeting: float
) -> FloatArray:
    """Return where levels cross edges.

    Args:
        mesh: the triangles that were marched.
        front: as marching left it.
        edges: (k, 2) vertices of the edges; they need not be edges of the triangles.
        lengths: (k,) of the edges [mm].
        levels: (k,) values between those at the ends of the edge [mm].
        meeting: as for `march`.

    Returns:
        (k,) shares of the edge from the first vertex. Along lines that no triangle has as a side the distance is taken
        as linear.
    """
    shares = np.empty(levels.size)
    for k in range(levels.size):
        start, end = int(edges[k, 0]), int(edges[k, 1])
        low, high = front.distances[start], front.distances[end]
        first, last = edge_slopes(mesh, front, start, end, lengths[k])
        if first - last > meeting * lengths[k]:
            shares[k] = ridge_crossing(low, high, first, last, levels[k])
        else:
            shares[k] = cubic_crossing(low, high, first, last, levels[k])
    return shares


@njit
def slopes_at(
    mesh: MarchingMesh, front: Front, edges: IntArray, lengths: FloatArray, shares: FloatArray, meeting: float
) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of the distance along edges, at shares of their length, and where it rises across.

    The other arguments are those of `crossing_shares`.

    Returns:
        (k,) derivatives, per mm; (k,) positive where the distance rises to the left of the edge, negative where to the
        right, and 0 where the front does not know.
    """
    slopes, sides = np.empty(shares.size), np.empty(shares.size)
    for k in range(shares.size):
        start, end = int(edges[k, 0]), int(edges[k, 1])
        low, high = front.distances[start], front.distances[end]
        first, last = edge_slopes(mesh, front, start, end, lengths[k])
        first_side, last_side = edge_sides(mesh, front, start, end, lengths[k])
        share, rest = shares[k], 1.0 - shares[k]
        sides[k] = first_side if share < 0.5 else last_side
        if first - last > meeting * lengths[k]:
            on_first = low + share * first < high - rest * last
            slopes[k] = (first if on_first else last) / lengths[k]
            sides[k] = first_side if on_first else last_side
        else:
            climb = high - low
            change = (first - climb) * rest * (1.0 - 3.0 * share) + (climb - last) * share * (2.0 - 3.0 * share)
            slopes[k] = (climb + change) / lengths[k]
    return slopes, sides


@inner
def edge_slopes(mesh: MarchingMesh, front: Front, start: int, end: int, length: float) -> tuple[float, float]:
    """Return the derivatives of the distance by the share of an edge, at its start and its end.

    Both are the difference of the distances where the edge is no side of a triangle.
    """
    half = half_edge_between(mesh, start, end, length)
    if half >= 0:
        first, last = slopes_along(mesh, front, half)
        return first * length, last * length
    half = half_edge_between(mesh, end, start, length)
    if half >= 0:
        last, first = slopes_along(mesh, front, half)
        return -first * length, -last * length
    climb = front.distances[end] - front.distances[start]
    return climb, climb


@inner
def edge_sides(mesh: MarchingMesh, front: Front, start: int, end: int, length: float) -> tuple[float, float]:
    """Return whether the distance rises to the left (positive) or right of an edge, at its start and its end.

    Both are 0 where the edge is no side of a triangle.
    """
    half = half_edge_between(mesh, start, end, length)
    if half >= 0:
        return sides_along(mesh, front, half)
    half = half_edge_between(mesh, end, start, length)
    if half >= 0:
        last, first = sides_along(mesh, front, half)
        return -first, -last
    return 0.0, 0.0


@inner
def half_edge_between(mesh: MarchingMesh, start: int, end: int, length: float) -> int:
    """Return the half-edge of a length from one vertex to another, -1 where there is none."""
    half = mesh.first[start]
    while True:
        if mesh.corners[next_half(half)] == end and abs(mesh.lengths[half] - length) <= SAME_LENGTH * length:
            return half
        half = mesh.twins[previous_half(half)]
        if half < 0 or half == mesh.first[start]:
            return -1


@inner
def slopes_along(mesh: MarchingMesh, front: Front, half: int) -> tuple[float, float]:
    """Return the slopes of the distance along a half-edge at its start and its end, per mm."""
    start, following = mesh.corners[half], next_half(half)
    end = mesh.corners[following]
    first = slope(mesh, front, start, mesh.bearings[half])
    back = mesh.bearings[following] + mesh.angles[following] * mesh.stretch[end]
    return first, -slope(mesh, front, end, back)


@inner
def sides_along(mesh: MarchingMesh, front: Front, half: int) -> tuple[float, float]:
    """Return the derivatives of the distance to the left of a half-edge at its start and its end; 0 on the source."""
    start, following = mesh.corners[half], next_half(half)
    end = mesh.corners[following]
    back = mesh.bearings[following] + mesh.angles[following] * mesh.stretch[end]
    first = 0.0 if front.marks[start] & SEED_VERTEX else sin(mesh.bearings[half] - front.origins[start])
    last = 0.0 if front.marks[end] & SEED_VERTEX else -sin(back - front.origins[end])
    return first, last


@inner
def ridge_crossing(low: float, high: float, first: float, last: float, level: float) -> float:
    """Return where a level between the values at 0 and 1 is crossed from the lower one up to the ridge."""
    share = (level - low) / (high - low)
    if high > low and first > 0.0:
        share = (level - low) / first
    elif high < low and last < 0.0:
        share = 1.0 + (level - high) / last
    return min(1.0, max(0.0, share))


@inner
def cubic_crossing(low: float, high: float, first: float, last: float, level: float) -> float:
    """Return where the cubic with the given values and slopes at 0 and 1 takes a level between the values."""
    rising = high > low
    left, right = 0.0, 1.0
    for _ in range(HALVINGS):
        share = 0.5 * (left + right)
        rest = 1.0 - share
        value = low + share * (high - low)
        value += share * rest * ((first - (high - low)) * rest + ((high - low) - last) * share)
        if (value < level) == rising:
            left = share
        else:
            right = share
    return 0.5 * (left + right)
