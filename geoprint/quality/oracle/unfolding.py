"""Exact shortest distance over triangles, unfolded outwards from a point: the numba kernels.

From the point the surface is laid flat triangle by triangle, as far as straight lines reach: a window is an edge and
the cone of lines that cross it [Mitchell1987]. A cone is split at the corner that it meets behind the edge and never
merged [Chen1990]; windows are taken by rising distance [Surazhsky2005], so that the search ends as soon as none is
nearer than what was found. Shortest paths turn at vertices with more than a full angle around them (half on the
border), into the wedge that no straight line reaches: from there the search goes on. Whatever is found is the length
of a path on the surface, and when the search ends by itself that of the shortest.
"""

from __future__ import annotations

from cmath import phase, rect
from math import inf, pi

from geoprint.kernels import inlined, inner, uncounted
from geoprint.quality.oracle.horizon import ANY, POINT, Goal, Horizon, Segments, add, cross, pop
from geoprint.quality.oracle.triangles import FlatMesh
from geoprint.surfaces.halfedges import next_half, previous_half

# Lines within this angle [rad] of a cone belong to it: what lies on the line between two cones is not lost between
# them, and the length of a path that bends by so little is the shortest to 16 digits.
CONE_TOLERANCE = 1e-9
# A point nearer to a corner than this share of the triangle's side starts at the corner.
CORNER_TOLERANCE = 1e-9
# A point starts this share of the span to the middle of its face farther inside: from exactly on an edge, the lines
# through that edge fill half a turn, a cone without sides.
INWARDS = 1e-12


@uncounted
def search(
    mesh: FlatMesh, horizon: Horizon, segments: Segments, goal: Goal, number: int, face: int, place: complex,
    limit: float,
) -> float:  # fmt: skip
    """Find the nearest segment from a point.

    Args:
        mesh: m triangles.
        horizon: left with what was found; nothing where best[0] is still the limit.
        segments: what to look for.
        goal: which of them.
        number: of this search, another one each time.
        face: the point's face.
        place: where the point is in its plane [mm].
        limit: what lies farther is not looked for [mm].

    Returns:
        A lower bound of the distance: the distance itself, or the limit where nothing is nearer, or less where the
        horizon's room did not suffice.
    """
    horizon.counts[0], horizon.counts[1] = 0, 0
    horizon.found[0], horizon.found[1], horizon.found[2] = -1, -1, -1
    horizon.best[0], horizon.best[1] = limit, 0.0
    begin(mesh, horizon, segments, goal, number, face, place)
    return spread(mesh, horizon, segments, goal, number)


@inner
def spread(mesh: FlatMesh, horizon: Horizon, segments: Segments, goal: Goal, number: int) -> float:
    """Take windows by rising distance until none is nearer than what was found; return as `search` does."""
    while horizon.counts[1] > 0:
        bound = horizon.keys[0]
        if bound >= horizon.best[0]:
            break
        item = pop(horizon)
        if horizon.halves[item] < 0:
            turn(mesh, horizon, segments, goal, number, item)
        else:
            cross_face(mesh, horizon, segments, goal, number, item)
        if horizon.counts[0] >= horizon.counts[2]:
            return bound
    return horizon.best[0]


@inner
def begin(
    mesh: FlatMesh, horizon: Horizon, segments: Segments, goal: Goal, number: int, face: int, place: complex
) -> None:
    """Look around in the face of the point, and through its three edges."""
    half = 3 * face
    longest = max(mesh.halves[half], mesh.halves[half + 1], mesh.halves[half + 2])
    for i in range(3):
        if abs(mesh.corners[half + i] - place) < CORNER_TOLERANCE * longest:
            horizon.visited[mesh.starts[half + i]] = number
            item = add(mesh, horizon, goal, -1 - (half + i), 0j, 0j, 0j, 0j, 0.0, POINT, 0.0)
            fan(mesh, horizon, segments, goal, number, first_around(mesh, half + i), 0.0, inf, 0.0, item)
            return
    place += INWARDS * ((mesh.corners[half] + mesh.corners[half + 1] + mesh.corners[half + 2]) / 3.0 - place)
    see(horizon, segments, goal, face, -place, 1.0 + 0j, 0j, 0j, 0.0, POINT)
    for i in range(3):
        corner, end = mesh.corners[half + i] - place, mesh.corners[next_half(half + i)] - place
        look(mesh, horizon, goal, mesh.twins[half + i], end, corner, corner, end, 0.0, POINT)
        meet(mesh, horizon, goal, number, half + i, corner, end - corner, 0.0, POINT)


@inlined
def cross_face(mesh: FlatMesh, horizon: Horizon, segments: Segments, goal: Goal, number: int, item: int) -> None:
    """Lay the face behind a window flat, look for segments in the cone, and through its two other edges."""
    half, before = int(horizon.halves[item]), float(horizon.before[item])
    start, end = complex(horizon.starts[item]), complex(horizon.ends[item])
    right, left = complex(horizon.rights[item]), complex(horizon.lefts[item])
    face = half // 3
    following, last = next_half(half), previous_half(half)
    apex = start + (end - start) * mesh.apexes[half]
    scale = (end - start) / (mesh.corners[following] - mesh.corners[half])
    see(horizon, segments, goal, face, start - scale * mesh.corners[half], scale, right, left, before, item)
    from_right, from_left = cross(right, apex), cross(apex, left)
    if from_right >= -CONE_TOLERANCE * abs(right) * abs(apex) and from_left >= -CONE_TOLERANCE * abs(left) * abs(apex):
        meet(mesh, horizon, goal, number, last, apex, start - apex, before, item)
    if from_right > 0.0:
        look(
            mesh, horizon, goal, mesh.twins[following], apex, end, right, apex if from_left > 0.0 else left, before,
            item,
        )  # fmt: skip
    if from_left > 0.0:
        look(
            mesh, horizon, goal, mesh.twins[last], start, apex, apex if from_right > 0.0 else right, left, before, item
        )


@inner
def turn(mesh: FlatMesh, horizon: Horizon, segments: Segments, goal: Goal, number: int, item: int) -> None:
    """Go on from a vertex into the directions that are at least a straight angle away from where the path came from."""
    half = -1 - horizon.halves[item]
    vertex = mesh.starts[half]
    if horizon.visited[vertex] == number:
        return
    horizon.visited[vertex] = number
    before = horizon.before[item] + abs(horizon.starts[item])
    back = phase(-horizon.starts[item] / horizon.ends[item])
    angle = min(max(back, 0.0), float(mesh.angles[half]))
    total = float(mesh.totals[vertex])
    first = first_around(mesh, half)
    if mesh.twins[first] >= 0:
        fan(mesh, horizon, segments, goal, number, half, angle + pi, angle + total - pi, before, item)
        return
    around = first
    while around != half:
        angle += float(mesh.angles[around])
        around = mesh.twins[previous_half(around)]
    if angle >= pi:
        fan(mesh, horizon, segments, goal, number, first, 0.0, angle - pi, before, item)
    if angle + pi <= total:
        fan(mesh, horizon, segments, goal, number, first, angle + pi, total, before, item)


@inner
def fan(
    mesh: FlatMesh, horizon: Horizon, segments: Segments, goal: Goal, number: int, half: int, low: float, high: float,
    before: float, item: int,
) -> None:  # fmt: skip
    """Look from a vertex through the faces around it, between two angles counted leftwards from a half-edge there."""
    first, angle = half, 0.0
    side = 2.0 * mesh.halves[half] + 0j
    while True:
        width, apex = mesh.angles[half], side * mesh.apexes[half]
        face = half // 3
        following, last = next_half(half), previous_half(half)
        if angle + width >= low:
            right = side if low <= angle else side * rect(1.0, low - angle)
            left = apex if high >= angle + width else side * rect(1.0, high - angle)
            scale = side / (mesh.corners[following] - mesh.corners[half])
            see(horizon, segments, goal, face, -scale * mesh.corners[half], scale, right, left, before, item)
            look(mesh, horizon, goal, mesh.twins[following], apex, side, right, left, before, item)
            if angle >= low - CONE_TOLERANCE:
                meet(mesh, horizon, goal, number, following, side, apex - side, before, item)
            if angle + width <= high + CONE_TOLERANCE:
                meet(mesh, horizon, goal, number, last, apex, -apex, before, item)
        angle += width
        half, side = mesh.twins[last], apex
        if angle > high or half < 0 or half == first:
            return


@inner
def first_around(mesh: FlatMesh, half: int) -> int:
    """Return the rightmost half-edge that starts at the same vertex on the border, or the one given inside."""
    around = half
    while mesh.twins[around] >= 0:
        around = next_half(mesh.twins[around])
        if around == half:
            break
    return around


@inlined
def see(
    horizon: Horizon, segments: Segments, goal: Goal, face: int, origin: complex, scale: complex,
    right: complex, left: complex, before: float, item: int,
) -> None:  # fmt: skip
    """Keep the nearest segment of a face within a cone; a side of 0 does not bound it."""
    for k in range(segments.first[face], segments.first[face + 1]):
        if goal.label != ANY and segments.labels[k] != goal.label:
            continue
        if segments.runs[k] == goal.run:
            apart = abs(segments.arcs[k] - goal.arc)
            if min(apart, segments.loops[k] - apart) <= goal.clear:
                continue
        start, along = origin + scale * segments.starts[k], scale * segments.along[k]
        low, high = within(cross(right, start), cross(right, along), 0.0, 1.0, abs(right) * (abs(start) + abs(along)))
        low, high = within(cross(start, left), cross(along, left), low, high, abs(left) * (abs(start) + abs(along)))
        if low > high:
            continue
        squared = along.real**2 + along.imag**2
        share = low
        if squared > 0.0:
            share = min(max(-(start.real * along.real + start.imag * along.imag) / squared, low), high)
        nearest = start + share * along
        if before + abs(nearest) < horizon.best[0]:
            horizon.best[0], horizon.best[1], horizon.seen[0] = before + abs(nearest), share, nearest
            horizon.found[0], horizon.found[1], horizon.found[2] = k, item, face


@inlined
def within(value: float, slope: float, low: float, high: float, scale: float) -> tuple[float, float]:
    """Return the part of [low, high] in which value + slope * t is not negative, up to the tolerance of cones."""
    allowed = -CONE_TOLERANCE * scale
    if value + slope * low < allowed and value + slope * high < allowed:
        return 1.0, 0.0
    if value + slope * low < allowed:
        low = -value / slope
    elif value + slope * high < allowed:
        high = -value / slope
    return low, high


@inlined
def look(
    mesh: FlatMesh, horizon: Horizon, goal: Goal, half: int, start: complex, end: complex, right: complex,
    left: complex, before: float, item: int,
) -> None:  # fmt: skip
    """Add the window over an edge, unless it is the border or nothing behind it can be nearer than what was found."""
    if half < 0:
        return
    along = end - start
    low, high = 0.0, 1.0
    if cross(left, along) != 0.0:
        low = min(max(-cross(left, start) / cross(left, along), 0.0), 1.0)
    if cross(right, along) != 0.0:
        high = min(max(-cross(right, start) / cross(right, along), 0.0), 1.0)
    share = -(start.real * along.real + start.imag * along.imag) / (along.real**2 + along.imag**2)
    nearest = start + min(max(share, min(low, high)), max(low, high)) * along
    add(mesh, horizon, goal, half, start, end, right, left, before, item, abs(nearest))


@inner
def meet(
    mesh: FlatMesh, horizon: Horizon, goal: Goal, number: int, half: int, place: complex, along: complex, before: float,
    item: int,
) -> None:  # fmt: skip
    """Add the turn at the vertex where a half-edge starts, if paths can turn there and none did before."""
    vertex = mesh.starts[half]
    if mesh.turns[vertex] and horizon.visited[vertex] != number:
        add(mesh, horizon, goal, -1 - half, place, along, 0j, 0j, before, item, abs(place))
