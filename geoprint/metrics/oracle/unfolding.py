"""Exact shortest distance over triangles, unfolded outwards from a point: plane coordinates and numba kernels."""

from __future__ import annotations

from cmath import phase, rect
from math import inf, pi, sqrt
from typing import NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from geoprint.geometry import boundary_half_edges, twins
from geoprint.geometry.halfedges import next_half, previous_half
from geoprint.kernels import inlined, inner, uncounted, writable
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfacePoints

# Triangles flattened one by one: the plane coordinates in which geodesics are unfolded.
#
# Half-edges are numbered as `geometry.halfedges` says. Points of the plane are complex numbers, so that laying a
# triangle beside another is one multiplication.


ComplexArray: TypeAlias = NDArray[np.complex128]

# An angle larger than the straight one by this [rad] turns geodesics; less is rounding.
ANGLE_TOLERANCE = 1e-12


class FlatMesh(NamedTuple):
    """A triangle mesh as its flat triangles and how they join.

    Attributes:
        starts: (3 m,) vertex at which each half-edge starts.
        twins: (3 m,) half-edge on the other side, -1 on the border.
        corners: (3 m,) where each half-edge starts, in the plane of its face; corner 0 of a face is at 0 [mm].
        apexes: (3 m,) the opposite corner, as a multiple of the half-edge from its start.
        angles: (3 m,) angle of the face where the half-edge starts [rad].
        totals: (n,) sum of the angles at each vertex [rad].
        turns: (n,) whether a shortest path may turn at the vertex: more than 2 pi inside, than pi on the border.
        middles: (3 m, 3) middle of each half-edge in space [mm].
        halves: (3 m,) half of its length [mm].
        origins: (m, 3) corner 0 of each face in space [mm].
        axes: (m, 2, 3) unit vectors of the face's plane coordinates in space.
    """

    starts: IntArray
    twins: IntArray
    corners: ComplexArray
    apexes: ComplexArray
    angles: FloatArray
    totals: FloatArray
    turns: BoolArray
    middles: FloatArray
    halves: FloatArray
    origins: FloatArray
    axes: FloatArray


class Places(NamedTuple):
    """Points on a mesh.

    Attributes:
        faces: (k,) face of each.
        flat: (k,) where it is in the plane of that face [mm].
    """

    faces: IntArray
    flat: ComplexArray

    def some(self, part: slice | IntArray | BoolArray) -> Places:
        """Return some of them."""
        return Places(self.faces[part], self.flat[part])


def flat_mesh(surface: Surface) -> FlatMesh:
    """Flatten every triangle of a surface.

    Args:
        surface: m faces, none without area, at most two at an edge.

    Raises:
        MeshError: an edge has more than two faces.
    """
    corners = surface.vertices[surface.faces]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    length = np.linalg.norm(first, axis=1)
    along = first / length[:, None]
    share = np.einsum("mx,mx->m", second, along)
    across = second - share[:, None] * along
    height = np.linalg.norm(across, axis=1)
    flat: ComplexArray = np.column_stack([np.zeros(len(corners)), length, share + 1j * height]).astype(np.complex128)
    following, last = np.roll(flat, -1, axis=1), np.roll(flat, -2, axis=1)
    apexes = (last - flat) / (following - flat)
    starts = surface.faces.ravel()
    sums = np.bincount(starts, np.angle(apexes).ravel(), minlength=len(surface.vertices))
    totals = np.asarray(sums, dtype=np.float64)
    straight = np.full(totals.size, 2 * np.pi)
    straight[starts[boundary_half_edges(surface.faces)]] = np.pi
    return FlatMesh(
        starts=np.ascontiguousarray(starts),
        twins=twins(surface.faces),
        corners=flat.ravel(),
        apexes=apexes.ravel(),
        angles=np.angle(apexes).ravel(),
        totals=totals,
        turns=totals > straight + ANGLE_TOLERANCE,
        middles=(0.5 * (corners + np.roll(corners, -1, axis=1))).reshape(-1, 3),
        halves=0.5 * np.abs(following - flat).ravel(),
        origins=np.ascontiguousarray(corners[:, 0]),
        axes=np.stack([along, across / height[:, None]], axis=1),
    )


def flat_places(mesh: FlatMesh, points: SurfacePoints) -> Places:
    """Return points of the surface in the planes of their faces."""
    flat = (points.weights * mesh.corners.reshape(-1, 3)[points.faces]).sum(axis=1)
    return Places(writable(points.faces), flat)


def spatial(mesh: FlatMesh, places: Places) -> FloatArray:
    """Return the (k, 3) positions of places in space [mm]."""
    plane = np.column_stack([places.flat.real, places.flat.imag])
    return mesh.origins[places.faces] + np.einsum("kp,kpx->kx", plane, mesh.axes[places.faces])


class SmallTriangles(NamedTuple):
    """Small triangles that together are the surface.

    Attributes:
        middles: of the k triangles.
        areas: (k,) [mm2].
        extents: (k,) how far each reaches in any direction: a strip that wide has the same mean square distance from
            its middle [mm].
        scales: (k,) size of each over that of its face; negative for those that are turned by half a turn.
    """

    middles: Places
    areas: FloatArray
    extents: FloatArray
    scales: FloatArray

    def some(self, which: IntArray | BoolArray) -> SmallTriangles:
        """Return some of them."""
        middles = Places(self.middles.faces[which], self.middles.flat[which])
        return SmallTriangles(middles, self.areas[which], self.extents[which], self.scales[which])

    def corners(self, mesh: FlatMesh) -> ComplexArray:
        """Return the (k, 3) corners seen from the middles, in the planes of their faces [mm]."""
        whole = mesh.corners.reshape(-1, 3)
        about = whole - whole.mean(axis=1, keepdims=True)
        return self.scales[:, None] * about[self.middles.faces]


def small_triangles(mesh: FlatMesh, *, edge_length: float) -> SmallTriangles:
    """Cut every face into equal similar triangles with sides of at most `edge_length` [mm]."""
    halves = mesh.halves.reshape(-1, 3)
    cuts = np.maximum(np.ceil(2 * halves.max(axis=1) / edge_length), 1).astype(np.int64)
    corners = mesh.corners.reshape(-1, 3)
    areas = 0.5 * (corners[:, 1].real * corners[:, 2].imag) / cuts**2
    # The mean square distance of a triangle from its middle is a 36th of the sum of its squared sides, in both
    # directions together; that of a strip is a 12th of its squared width, in one.
    extents = np.sqrt((4 * halves**2).sum(axis=1) / 6) / cuts
    faces: list[IntArray] = []
    flat: list[ComplexArray] = []
    scales: list[FloatArray] = []
    for cut in np.unique(cuts):
        chosen = np.flatnonzero(cuts == cut)
        weights, upright = _middle_weights(int(cut))
        middles = corners[chosen] @ weights.T
        faces.append(np.repeat(chosen, middles.shape[1]))
        flat.append(middles.ravel())
        scales.append(np.tile(np.where(upright, 1.0, -1.0) / float(cut), chosen.size))
    where = np.concatenate(faces)
    middles = Places(where, np.concatenate(flat))
    return SmallTriangles(middles, areas[where], extents[where], np.concatenate(scales))


def _middle_weights(cut: int) -> tuple[FloatArray, BoolArray]:
    """Return the (cut^2, 3) barycentric weights of the middles of a face's small triangles, and which are upright."""
    i, j = (index.ravel() for index in np.meshgrid(np.arange(cut), np.arange(cut), indexing="ij"))
    upright, turned = i + j < cut, i + j < cut - 1
    second = np.concatenate([i[upright] + 1 / 3, i[turned] + 2 / 3]) / cut
    third = np.concatenate([j[upright] + 1 / 3, j[turned] + 2 / 3]) / cut
    return np.column_stack([1.0 - second - third, second, third]), np.arange(second.size) < upright.sum()


def positive_shares(values: FloatArray) -> FloatArray:
    """Return which share of a triangle's area a linear function is positive on.

    Args:
        values: (k, 3) at the corners.

    Examples:
        >>> positive_shares(np.array([[-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [0.0, 0.0, 0.0]]))
        array([0.75, 0.25, 1.  ])
    """
    ordered: FloatArray = np.sort(values, axis=1)
    low, middle, high = ordered[:, 0], ordered[:, 1], ordered[:, 2]
    # The corner that is alone on its side of the line cuts off a triangle that is similar in two sides.
    alone = np.where(middle < 0.0, high, low)
    others = np.where(middle < 0.0, (low - high) * (middle - high), (middle - low) * (high - low))
    corner = np.divide(alone**2, others, out=np.zeros_like(alone), where=others > 0.0)
    return np.where(middle < 0.0, np.where(high > 0.0, corner, 0.0), np.where(low < 0.0, 1.0 - corner, 1.0))


# What a search over unfolded triangles looks for and carries along: segments of curves, windows and their heap.


# What `Goal.label` is where every segment counts.
ANY = -1
# The parent of what the point sees itself. For a literal integer numba compiles all that take it once more.
POINT = cast("int", np.int64(-1))


class Segments(NamedTuple):
    """Straight segments of curves, each in one face, sorted by face.

    Attributes:
        first: (m + 1,) segments of face f are first[f] to first[f + 1].
        starts: (p,) where each starts in the plane of its face [mm].
        along: (p,) the way to its end [mm].
        labels: (p,) what is asked for.
        runs: (p,) the run each belongs to.
        arcs: (p,) arc length of its middle within the run [mm].
        loops: (p,) length of the run where it is closed, else infinity [mm].
    """

    first: IntArray
    starts: ComplexArray
    along: ComplexArray
    labels: IntArray
    runs: IntArray
    arcs: FloatArray
    loops: FloatArray


class Goal(NamedTuple):
    """What a search looks for.

    Attributes:
        label: only segments with it count, or `ANY`.
        run: segments of this run nearer along it than `clear` to `arc` do not count; -1 for none.
        arc: [mm].
        clear: [mm].
        aimed: whether to search towards a place first.
        x: that place in space [mm].
        y: likewise.
        z: likewise.
    """

    label: int
    run: int
    arc: float
    clear: float
    aimed: bool
    x: float
    y: float
    z: float


class Horizon(NamedTuple):
    """The windows and turns of one search; changed in place.

    Attributes:
        halves: (c,) half-edge over which a window looks, into the face on its left; of a turn -1 - the half-edge that
            starts at its vertex.
        parents: (c,) window or turn that each comes from, -1 where that is the point itself.
        starts: (c,) start of the edge as seen from the source at 0; of a turn its vertex [mm].
        ends: (c,) end of the edge; of a turn its half-edge, from the vertex [mm].
        rights: (c,) right side of the cone.
        lefts: (c,) left side of the cone.
        before: (c,) length of the path to the source [mm].
        keys: (c,) heap of least distances [mm].
        items: (c,) what they belong to.
        counts: how many windows there are; how many wait in the heap; how many are allowed.
        visited: (n,) number of the last search that turned at each vertex.
        least: (3 m,) how far every half-edge is at least from whatever is looked for [mm]; 0 where nobody knows.
        found: nearest segment so far, and the window and the face in which it is seen.
        best: its distance [mm], and the share of the segment at which it is nearest.
        seen: where it is nearest, from the source of that window [mm].
    """

    halves: IntArray
    parents: IntArray
    starts: ComplexArray
    ends: ComplexArray
    rights: ComplexArray
    lefts: ComplexArray
    before: FloatArray
    keys: FloatArray
    items: IntArray
    counts: IntArray
    visited: IntArray
    least: FloatArray
    found: IntArray
    best: FloatArray
    seen: ComplexArray


def empty_horizon(mesh: FlatMesh, *, windows: int, least: FloatArray | None = None) -> Horizon:
    """Return room for searches of so many windows, and what is known of the way behind every half-edge."""
    return Horizon(
        halves=np.zeros(windows, dtype=np.int64),
        parents=np.zeros(windows, dtype=np.int64),
        starts=np.zeros(windows, dtype=np.complex128),
        ends=np.zeros(windows, dtype=np.complex128),
        rights=np.zeros(windows, dtype=np.complex128),
        lefts=np.zeros(windows, dtype=np.complex128),
        before=np.zeros(windows),
        keys=np.zeros(windows),
        items=np.zeros(windows, dtype=np.int64),
        counts=np.array([0, 0, windows]),
        visited=np.full(mesh.totals.size, -1),
        least=np.zeros(mesh.starts.size) if least is None else least,
        found=np.zeros(3, dtype=np.int64),
        best=np.zeros(2),
        seen=np.zeros(1, dtype=np.complex128),
    )


@inlined
def add(
    mesh: FlatMesh, horizon: Horizon, goal: Goal, half: int, start: complex, end: complex, right: complex,
    left: complex, before: float, parent: int, ahead: float,
) -> int:  # fmt: skip
    """Put a window or a turn into the heap, unless it is too far; return its number."""
    key = before + ahead
    edge = half if half >= 0 else -1 - half
    if key + horizon.least[edge] >= horizon.best[0]:
        return -1
    if goal.aimed:
        x, y, z = mesh.middles[edge, 0] - goal.x, mesh.middles[edge, 1] - goal.y, mesh.middles[edge, 2] - goal.z
        key += max(sqrt(x * x + y * y + z * z) - mesh.halves[edge], 0.0)
    if key >= horizon.best[0] or horizon.counts[0] >= horizon.counts[2]:
        return -1
    item = horizon.counts[0]
    horizon.counts[0] += 1
    horizon.halves[item], horizon.parents[item], horizon.before[item] = half, parent, before
    horizon.starts[item], horizon.ends[item], horizon.rights[item], horizon.lefts[item] = start, end, right, left
    hole = horizon.counts[1]
    horizon.counts[1] += 1
    while hole > 0 and horizon.keys[(hole - 1) // 2] > key:
        horizon.keys[hole], horizon.items[hole] = horizon.keys[(hole - 1) // 2], horizon.items[(hole - 1) // 2]
        hole = (hole - 1) // 2
    horizon.keys[hole], horizon.items[hole] = key, item
    return item


@inlined
def pop(horizon: Horizon) -> int:
    """Take the least out of the heap."""
    item = horizon.items[0]
    horizon.counts[1] -= 1
    count = horizon.counts[1]
    key, last = horizon.keys[count], horizon.items[count]
    hole = 0
    while 2 * hole + 1 < count:
        child = 2 * hole + 1
        if child + 1 < count and horizon.keys[child + 1] < horizon.keys[child]:
            child += 1
        if horizon.keys[child] >= key:
            break
        horizon.keys[hole], horizon.items[hole] = horizon.keys[child], horizon.items[child]
        hole = child
    horizon.keys[hole], horizon.items[hole] = key, last
    return item


@inlined
def cross(first: complex, second: complex) -> float:
    """Return the cross product: positive where the second points to the left of the first."""
    return first.real * second.imag - first.imag * second.real


# Exact shortest distance over triangles, unfolded outwards from a point: the numba kernels.
#
# From the point the surface is flattened triangle by triangle, as far as straight lines reach: a window is an edge
# and the cone of lines that cross it [Mitchell1987]. A cone is split at the corner that it meets behind the edge and
# never merged [Chen1990]; windows are taken by rising distance [Surazhsky2005], so that the search ends as soon as
# none is nearer than what was found. Shortest paths turn at vertices with more than a full angle around them (half
# on the border), into the wedge that no straight line reaches: from there the search goes on. Whatever is found is
# the length of a path on the surface, and when the search ends by itself that of the shortest.


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
    if (from_right >= 0.0 or from_right >= -CONE_TOLERANCE * abs(right) * abs(apex)) and (
        from_left >= 0.0 or from_left >= -CONE_TOLERANCE * abs(left) * abs(apex)
    ):
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
def counts_for(segments: Segments, goal: Goal, k: int) -> bool:
    """Return whether a segment is one that is looked for."""
    if goal.label != ANY and segments.labels[k] != goal.label:
        return False
    apart = abs(segments.arcs[k] - goal.arc)
    return segments.runs[k] != goal.run or min(apart, segments.loops[k] - apart) > goal.clear


@inlined
def see(
    horizon: Horizon, segments: Segments, goal: Goal, face: int, origin: complex, scale: complex,
    right: complex, left: complex, before: float, item: int,
) -> None:  # fmt: skip
    """Keep the nearest segment of a face within a cone; a side of 0 does not bound it."""
    for k in range(segments.first[face], segments.first[face + 1]):
        start, along = origin + scale * segments.starts[k], scale * segments.along[k]
        # No place of a segment is nearer than its start less its length, and that is at most the sum of its parts.
        reach = (horizon.best[0] - before + abs(along.real) + abs(along.imag)) * (1.0 + CONE_TOLERANCE)
        if start.real**2 + start.imag**2 > reach**2 or not counts_for(segments, goal, k):
            continue
        low, high = within(cross(right, start), cross(right, along), 0.0, 1.0, right, start, along)
        low, high = within(cross(start, left), cross(along, left), low, high, left, start, along)
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
def within(
    value: float, slope: float, low: float, high: float, side: complex, start: complex, along: complex
) -> tuple[float, float]:
    """Return the part of [low, high] in which value + slope * t is not negative, up to the tolerance of cones."""
    if value + slope * low >= 0.0 and value + slope * high >= 0.0:
        return low, high
    allowed = -CONE_TOLERANCE * (abs(side) * (abs(start) + abs(along)))
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
