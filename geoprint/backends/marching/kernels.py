"""Front marching on triangles given by their side lengths: the numba kernels that spread a distance."""

from __future__ import annotations

from math import atan2, cos, inf, pi, sin, sqrt

from geoprint.backends.marching.front import (
    BESIDE_SEED,
    SEED_FIRST_EDGE,
    SEED_LAST_EDGE,
    SEED_VERTEX,
    SEEN_FROM_SEED,
    Front,
    MarchingMesh,
    arrive,
    border_bearing,
    pop_nearest,
)
from geoprint.kernels import inlined, inner, uncounted
from geoprint.model import IntArray
from geoprint.surfaces.halfedges import next_half, previous_half

# A line that bends may beat such an arrival, but not by the error of marching near a point: this share of it.
SEEN_MARGIN = 0.05

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
            improve(mesh, front, next_half(half), tolerance, meeting)
            improve(mesh, front, previous_half(half), tolerance, meeting)
            half = mesh.twins[previous_half(half)]
            if half < 0 or half == mesh.first[vertex]:
                break
    return count


@uncounted
def settle(mesh: MarchingMesh, front: Front, order: IntArray, meeting: float) -> None:
    """Find every distance anew from what its neighbours know in the end.

    While the front marches, an edge may offer an arrival before the direction at its farther end is final; such an
    arrival can be too small, and stays. Here it goes.

    Args:
        mesh: m triangles.
        front: as marching left it; changed in place.
        order: (n,) vertices by rising distance.
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
                    best, origin = offer, mesh.bearings[half] + angle * mesh.stretch[vertex]
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
