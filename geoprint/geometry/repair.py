"""Preparing a mesh: what can be repaired without guessing is repaired and recorded; the rest is refused."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from itertools import pairwise
from typing import Annotated, Any, TypeAlias, cast, final, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from geoprint.errors import MeshError, how_many
from geoprint.geometry.crossings import crossings
from geoprint.geometry.manifold import check_connected, check_edges, split_vertices, turned_faces
from geoprint.geometry.operators import face_areas, side_lengths, signed_volume, thinness
from geoprint.geometry.points import in_words, triple
from geoprint.geometry.topology import (
    boundary_half_edges,
    boundary_loops,
    component_labels,
    connected_nodes,
    edge_keys,
    edges,
    half_edges,
    kind_of,
    loop_length,
    turned_over,
    used_vertices,
)
from geoprint.kernels import inner, njit
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, comparable, frozen

# What was repaired on a mesh, counted once: repairs of several steps add up, and each kind is named in its place.


@final
@comparable
class Repairs:
    """How often each kind of repair was made, and where that matters the place.

    What stands in an annotation is said behind the number wherever a person meets it. Faces without area are those
    before and after welding; a duplicate one has the corners of an earlier one, however it is wound.
    """

    welded_vertices: Annotated[int, "vertices joined to others that coincide"] = 0
    dropped_degenerate_faces: Annotated[int, "faces without area dropped"] = 0
    dropped_duplicate_faces: Annotated[int, "duplicate faces dropped"] = 0
    dropped_unreferenced_vertices: Annotated[int, "vertices that no face uses dropped"] = 0
    dropped_debris_faces: Annotated[int, "faces of specks dropped"] = 0
    debris_places: Annotated[tuple[tuple[float, ...], ...], "a corner of each speck [mm]"] = ()
    junction_faces: Annotated[int, "faces added where vertices lie on edges (T-junctions)"] = 0
    flipped_faces: Annotated[int, "faces turned for one winding"] = 0
    split_vertices: Annotated[int, "vertices split where fans of faces touch"] = 0
    filled_holes: Annotated[tuple[tuple[float, ...], ...], "middle of each hole that was closed [mm]"] = ()

    def __add__(self, later: Repairs) -> Repairs:
        """Return these and later ones as one."""
        return Repairs(*(getattr(self, field.name) + getattr(later, field.name) for field in fields(self)))

    def changes(self) -> tuple[str, ...]:
        """Return a phrase for each kind of change, with its number and where it matters its place."""
        places = {"dropped_debris_faces": f", at {_places(self.debris_places)}"}
        counted = [
            (getattr(self, name), what + places.get(name, "")) for name, kind, what in described(Repairs) if kind is int
        ]
        holes = (len(self.filled_holes), f"holes closed, at {_places(self.filled_holes)}")
        return tuple(f"{count} {what}" for count, what in (*counted, holes) if count)


def described(kind: type) -> Iterator[tuple[str, Any, str]]:
    """Return name, type and description of the fields that have one in their annotation, in their order."""
    for name, hint in get_type_hints(kind, include_extras=True).items():
        if get_origin(hint) is Annotated:
            yield name, *get_args(hint)


def _places(places: tuple[tuple[float, ...], ...]) -> str:
    """Return the first places in words, and how many more there are."""
    shown = ", ".join(in_words(place) for place in places[:3])
    return f"{shown} and {len(places) - 3} more" if len(places) > 3 else shown


# Points that are equal to the last bit, found through a hash table: sorting millions of them takes seconds.


BitArray: TypeAlias = NDArray[np.uint64]

# Odd numbers without pattern: the coordinates of a grid, too, spread over the table. Of 2^64 / golden ratio [Knuth1998,
# sec. 6.4] and two of its like.
FACTORS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)
NEGATIVE_ZERO = np.uint64(1 << 63)
# Places for each point in the table: with half of them free a search ends after a few.
PLACES_PER_POINT = 2


def first_equal(points: FloatArray) -> IntArray:
    """Return for each of (k, 3) finite points the first one that is equal to it.

    Examples:
        >>> first_equal(np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 3.0], [-0.0, 1.0, 2.0]]))
        array([0, 1, 0])
    """
    return _first_equal(np.ascontiguousarray(points).view(np.uint64), PLACES_PER_POINT * len(points))


@njit
def _first_equal(bits: BitArray, room: int) -> IntArray:
    size = 1
    while size < room:
        size *= 2
    table = np.full(size, -1, np.int32)
    found = np.empty(bits.shape[0], np.int64)
    mask = np.uint64(size - 1)
    for point in range(bits.shape[0]):
        x, y, z = unsigned(bits[point, 0]), unsigned(bits[point, 1]), unsigned(bits[point, 2])
        mixed = x * FACTORS[0] ^ y * FACTORS[1] ^ z * FACTORS[2]
        mixed ^= mixed >> np.uint64(32)
        place = (mixed * FACTORS[0] >> np.uint64(16)) & mask
        while True:
            other = int(table[place])
            if other < 0:
                table[place], found[point] = point, point
                break
            u, v, w = unsigned(bits[other, 0]), unsigned(bits[other, 1]), unsigned(bits[other, 2])
            if x == u and y == v and z == w:
                found[point] = other
                break
            place = (place + np.uint64(1)) & mask
    return found


@inner
def unsigned(bits: np.uint64) -> np.uint64:
    """Return the bits of a number, without the sign where it is a zero: the two zeros are equal."""
    return np.uint64(0) if bits == NEGATIVE_ZERO else bits


# Joining rim vertices that coincide: what an STL file, a seam or a cut has torn apart is one surface again.


# Rim vertices closer than this share of the bounding box's diagonal are one: 0.01 mm for a part of 40 mm, which is
# what rounding leaves between the corners of STL triangles and far below a bead.
WELD_SHARE = 2.5e-4
# But never farther apart than this share of the median edge, so that a fine mesh keeps its own detail.
WELD_EDGE_SHARE = 0.05


def weld_tolerance(vertices: FloatArray, faces: IntArray) -> float:
    """Return the distance [mm] below which rim vertices are one.

    Args:
        vertices: (n, 3) positions [mm].
        faces: (m, 3), at least one.
    """
    used = vertices[used_vertices(faces)]
    median_edge = float(np.median(side_lengths(vertices, faces)))
    diagonal = float(np.linalg.norm(used.max(axis=0) - used.min(axis=0)))
    return min(WELD_SHARE * diagonal, WELD_EDGE_SHARE * median_edge)


def welded(vertices: FloatArray, faces: IntArray) -> IntArray:
    """Return faces whose coincident rim vertices are one: each is replaced by the smallest index of its group.

    Vertices inside the surface, or at the two ends of an edge, are never joined. The exact round comes first because
    it turns most corners of an STL file into inner vertices, which the round with a tolerance then leaves alone.

    Args:
        vertices: (n, 3) positions [mm].
        faces: (m, 3).
    """
    if len(faces) == 0:
        return faces
    rim = _rim(faces)
    if rim.size == 0:
        return faces
    exact = _renamed(faces, rim, rim[first_equal(vertices[rim])], count=len(vertices))
    rim = _rim(exact)
    if rim.size == 0:
        return exact
    near = rim[KDTree(vertices[rim]).query_pairs(weld_tolerance(vertices, exact), output_type="ndarray")]
    if near.size == 0:
        return exact
    known = edge_keys(edges(exact), vertices=len(vertices))
    near = near[~np.isin(edge_keys(near, vertices=len(vertices)), known)]
    labels = connected_nodes(*near.T, nodes=len(vertices))
    _, first = np.unique(labels, return_index=True)
    return first[labels][exact]


def _rim(faces: IntArray) -> IntArray:
    """Return the vertices on edges that have one face, ascending."""
    return used_vertices(half_edges(faces)[boundary_half_edges(faces)])


def _renamed(faces: IntArray, old: IntArray, new: IntArray, *, count: int) -> IntArray:
    names = np.arange(count)
    names[old] = new
    return names[faces]


# Closing small holes: a missing triangle is put back, a larger hole is closed where somebody asks for it.


# A hole that one triangle closes is a missing triangle if that triangle has at most this share of the area; the rim
# of a small triangular part has more.
MISSING_SHARE = 0.01


def fill_holes(
    surface: Surface, loops: tuple[IntArray, ...], *, longest: float | None
) -> tuple[Surface, tuple[tuple[float, ...], ...]]:
    """Close holes with triangles between the vertices of their rims; the longest rim of an open surface stays.

    Args:
        surface: manifold, consistently wound.
        loops: as `topology.boundary_loops` gives them.
        longest: holes whose rim is up to this long [mm] are closed by the triangles of least area
            [Barequet1995]; None closes those alone that lack a single small triangle, where there is no choice.

    Returns:
        The surface with the new faces behind the others, and the middle of each hole that was closed [mm].
    """
    if longest is None:
        limit = MISSING_SHARE * float(face_areas(surface).sum())
        chosen = [loop for loop in loops if loop.size == 3 and _area(surface.vertices[loop]) <= limit]
    else:
        chosen = [loop for loop in loops[1:] if loop_length(surface.vertices, loop) <= longest]
    if not chosen:
        return surface, ()
    lids = [_lid(surface.vertices, loop) for loop in chosen]
    closed = Surface(vertices=surface.vertices, faces=np.concatenate([surface.faces, *lids]), name=surface.name)
    return closed, tuple(tuple(surface.vertices[loop].mean(axis=0).tolist()) for loop in chosen)


def _area(corners: FloatArray) -> float:
    return float(np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]))) / 2


def _lid(vertices: FloatArray, loop: IntArray) -> IntArray:
    """Return the triangles of least total area that close a loop, wound as its surface.

    Each stretch of the rim from corner i to corner j is closed best by some triangle i, k, j between the best lids of
    its two sides: found for short stretches first.
    """
    # The rim runs with the surface on its left, so that the lid runs in the opposite direction.
    rim = loop[::-1]
    points, count = vertices[rim], loop.size
    cost, split = np.zeros((count, count)), np.zeros((count, count), dtype=np.int64)
    for span in range(2, count):
        for i in range(count - span):
            j = i + span
            middle = np.arange(i + 1, j)
            areas = np.linalg.norm(np.cross(points[middle] - points[i], points[j] - points[i]), axis=1)
            total = cost[i, middle] + cost[middle, j] + areas
            best = int(np.argmin(total))
            cost[i, j], split[i, j] = total[best], middle[best]
    faces: list[tuple[int, int, int]] = []
    waiting = [(0, count - 1)]
    while waiting:
        i, j = waiting.pop()
        if j - i >= 2:
            k = int(split[i, j])
            faces.append((int(rim[i]), int(rim[k]), int(rim[j])))
            waiting += [(i, k), (k, j)]
    return np.array(faces, dtype=np.int64)


# T-junctions: rim vertices that lie on an edge they do not belong to, and cutting that edge there.
#
# A program that splits a triangle but not its neighbour leaves a slit without width. The surface has no gap, only
# its connectivity does; cutting the neighbour at the vertex closes it and moves nothing.


# A face is cut at one of its edges a round; more rounds than this are needed only where cutting makes new junctions.
MOST_ROUNDS = 10


def split_junctions(surface: Surface, *, tolerance: float) -> tuple[Surface, int]:
    """Cut each rim edge at the rim vertices that lie on it.

    Args:
        surface: with coincident rim vertices joined.
        tolerance: distance from the edge, and from its ends, that counts as on it [mm].

    Returns:
        The surface, whose cut faces are the last, and how many faces the cuts added.

    Raises:
        MeshError: cutting makes new junctions again and again; how many are left, and the first of them.
    """
    before, cuts = len(surface.faces), 0
    while True:
        sides, vertices, reached = _junctions(surface, tolerance=tolerance)
        if sides.size == 0:
            return surface, len(surface.faces) - before
        if cuts == MOST_ROUNDS:
            raise _endless(surface, np.unique(vertices))
        cuts += 1
        # One edge of a face at a time, the vertices on it in the order in which the half-edge meets them.
        first = sides == _first_side(sides)
        surface = _cut(surface, sides[first], vertices[first], reached[first])


def _endless(surface: Surface, vertices: IntArray) -> MeshError:
    """Return the refusal of a surface in which cutting edges does not come to an end."""
    place = surface.vertices[vertices[0]]
    return MeshError(
        f"{surface.name}: {how_many(vertices.size, 'vertex', 'vertices')} lie on an edge that they do not belong to "
        f"(T-junctions), the first at {in_words(place)}. Cutting the edges there makes new ones: remesh the part "
        "there.",
        vertices=int(vertices.size),
        place=triple(place),
    )


def _first_side(sides: IntArray) -> IntArray:
    """Return for each of k half-edges the first among them of the same face."""
    faces = sides // 3
    first = np.full(int(faces.max()) + 1, np.iinfo(np.int64).max)
    np.minimum.at(first, faces, sides)
    return first[faces]


def _cut(surface: Surface, sides: IntArray, vertices: IntArray, reached: FloatArray) -> Surface:
    """Cut faces into fans from the corner opposite to a half-edge, at the vertices that lie on it."""
    order = np.lexsort((reached, sides))
    sides, vertices = sides[order], vertices[order]
    fans: list[tuple[int, int, int]] = []
    for side in np.unique(sides).tolist():
        a, b, c = (int(surface.faces[side // 3, (side + shift) % 3]) for shift in range(3))
        stops = [a, *vertices[sides == side].tolist(), b]
        fans += [(start, stop, c) for start, stop in pairwise(stops) if start != stop]
    kept = np.delete(surface.faces, np.unique(sides // 3), axis=0)
    faces = np.concatenate([kept, np.array(fans, dtype=np.int64).reshape(-1, 3)])
    return Surface(vertices=surface.vertices, faces=faces, name=surface.name)


def _junctions(surface: Surface, *, tolerance: float) -> tuple[IntArray, IntArray, FloatArray]:
    """Return the half-edges on which a foreign rim vertex lies, that vertex, and how far along it is [mm]."""
    sides = boundary_half_edges(surface.faces)
    if sides.size == 0:
        return sides, sides, np.empty(0)
    rim = half_edges(surface.faces)[sides]
    start, along = surface.vertices[rim[:, 0]], surface.vertices[rim[:, 1]] - surface.vertices[rim[:, 0]]
    length = np.linalg.norm(along, axis=1)
    vertices = used_vertices(rim)
    tree = KDTree(surface.vertices[vertices])
    near = cast("list[list[int]]", tree.query_ball_point(start + along / 2, length / 2 + tolerance))
    side = np.repeat(np.arange(sides.size), [len(found) for found in near])
    vertex = vertices[np.concatenate([np.asarray(found, dtype=np.int64) for found in near])]
    offset = surface.vertices[vertex] - start[side]
    reached = np.einsum("kx,kx->k", offset, along[side]) / length[side]
    aside = np.linalg.norm(offset - (reached / length[side])[:, None] * along[side], axis=1)
    on_edge = (aside <= tolerance) & (reached > tolerance) & (reached < length[side] - tolerance)
    # The third corner of the edge's own face is only the tip of a flat triangle.
    own = (surface.faces[sides[side] // 3] == vertex[:, None]).any(axis=1)
    found = on_edge & ~own
    return sides[side[found]], vertex[found], reached[found]


# A face whose height is below this share of its longest side has no usable normal in double precision.
DEGENERATE_SHARE = 1e-9
# A piece with less than this share of the area of the largest is a speck that a program left behind.
DEBRIS_SHARE = 1e-3
# Edges of the rim that a missing triangle leaves.
SINGLE_TRIANGLE = 3


@final
@frozen
class Joined:
    """A mesh whose coincident rim vertices are one, without faces that have no area or are there twice.

    Attributes:
        surface: with all vertices of the file.
        tolerance: distance below which vertices count as one [mm].
        repairs: what was joined and dropped.
    """

    surface: Surface
    tolerance: float
    repairs: Repairs


@final
@comparable
class PreparationReport:
    """What `prepare` changed, and what it found; `topology.describe` names the topology."""

    repairs: Repairs
    crossings_checked: Annotated[bool, "whether every pair of faces was looked at for crossing"]
    vertices: Annotated[int, "number of vertices left after preparing"]
    faces: Annotated[int, "number of faces left after preparing"]
    topology: Annotated[str, "topology of the prepared surface in words"]
    boundary_lengths: Annotated[tuple[float, ...], "length of each rim, the longest first [mm]"]
    area: Annotated[float, "area of the prepared surface [mm2]"]
    mean_edge: Annotated[float, "mean length of an edge [mm]"]


def prepare(surface: Surface, *, longest_hole: float | None = None) -> tuple[Surface, PreparationReport]:
    """Make a mesh from a file one that can be planned on, or say what prevents it.

    In this order: faces without area are dropped; rim vertices that coincide are joined, exactly first and then within
    a tolerance (vertices inside the surface or at the two ends of an edge are never joined); faces that lost their area
    and duplicate faces are dropped; edges are cut at rim vertices that lie on them; specks beside the part are dropped;
    the winding is made consistent, keeping that of most faces; a vertex in which several fans of faces touch is given
    to each of them; missing triangles are put back; a closed surface is turned outward. Vertices that no face uses go.
    It does not refine, and no vertex moves but to one it is joined to.

    Args:
        surface: as loaded.
        longest_hole: holes whose rim is up to this long [mm] are closed too; None closes those of one triangle alone.

    Returns:
        The surface, with vertices and faces in their former order, new and cut ones last, and what was done.

    Raises:
        MeshError: nothing is left, an edge has more than two faces, the surface has one side only, several pieces
            (those that touch in a vertex alone are separate), or passes through itself; the message says how many and
            where.
    """
    return repair(join(surface), longest_hole=longest_hole)


def join(surface: Surface) -> Joined:
    """Join rim vertices that coincide, and drop faces without area and duplicate ones: the first steps of `prepare`.

    Raises:
        MeshError: nothing is left.
    """
    solid = surface.faces[~_degenerate(surface.vertices, surface.faces)]
    joined = welded(surface.vertices, solid)
    whole = joined[~_degenerate(surface.vertices, joined)]
    single = whole[_first_of_each(whole)]
    if len(single) == 0:
        raise MeshError(f"{surface.name}: every face is degenerate ({len(surface.faces)}); export the mesh again.")
    return Joined(
        surface=replace(surface, faces=single),
        tolerance=weld_tolerance(surface.vertices, single),
        repairs=Repairs(
            welded_vertices=int(used_vertices(solid).size - used_vertices(joined).size),
            dropped_degenerate_faces=len(surface.faces) - len(whole),
            dropped_duplicate_faces=len(whole) - len(single),
            dropped_unreferenced_vertices=int(len(surface.vertices) - used_vertices(surface.faces).size),
        ),
    )


def repair(joined: Joined, *, longest_hole: float | None = None) -> tuple[Surface, PreparationReport]:
    """Return what `prepare` returns, from its first steps on."""
    cut, junction_faces = split_junctions(joined.surface, tolerance=joined.tolerance)
    part, labels, debris_places = _without_debris(cut)
    turned, fans = _wound(part, labels)
    loops = boundary_loops(fans)
    filled, holes = fill_holes(fans, loops, longest=longest_hole)
    loops = boundary_loops(filled) if holes else loops
    inverted = not loops and signed_volume(filled) < 0
    prepared = turned_over(filled) if inverted else filled
    topology, boundary_lengths, mean_edge = _sizes(prepared, loops)
    repairs = Repairs(
        dropped_debris_faces=len(cut.faces) - len(part.faces),
        debris_places=debris_places,
        junction_faces=junction_faces,
        flipped_faces=int((~turned if inverted else turned).sum()),
        split_vertices=len(fans.vertices) - len(part.vertices),
        filled_holes=holes,
    )
    report = PreparationReport(
        repairs=joined.repairs + repairs,
        crossings_checked=_check_crossings(prepared, depth=joined.tolerance),
        vertices=len(prepared.vertices),
        faces=len(prepared.faces),
        topology=topology,
        boundary_lengths=boundary_lengths,
        area=float(face_areas(prepared).sum()),
        mean_edge=mean_edge,
    )
    return prepared, report


def stays_open(surface: Surface) -> bool:
    """Tell whether preparing a surface in one piece, joined before, leaves a border, without preparing it.

    A rim goes where its vertices lie on each other's edges, or where it is that of a single triangle.

    Raises:
        MeshError: as `prepare`, where cutting edges does not end.
    """
    cut, _ = split_junctions(surface, tolerance=weld_tolerance(surface.vertices, surface.faces))
    rim = half_edges(cut.faces)[boundary_half_edges(cut.faces)]
    rims = connected_nodes(rim[:, 0], rim[:, 1], nodes=len(cut.vertices))[rim[:, 0]]
    return bool((np.bincount(rims) > SINGLE_TRIANGLE).any())


def _without_debris(surface: Surface) -> tuple[Surface, IntArray, tuple[tuple[float, ...], ...]]:
    """Return the surface without specks and unused vertices, the piece of each face, and a corner of each speck."""
    labels = component_labels(surface)
    areas = np.bincount(labels, face_areas(surface))
    specks = np.flatnonzero(areas < DEBRIS_SHARE * areas.max())
    _, first = np.unique(labels, return_index=True)
    places = tuple(triple(surface.vertices[surface.faces[first[speck], 0]]) for speck in specks)
    kept = ~np.isin(labels, specks)
    faces = surface.faces[kept]
    used = used_vertices(faces)
    names = np.zeros(len(surface.vertices), dtype=np.int64)
    names[used] = np.arange(used.size)
    part = Surface(vertices=surface.vertices[used], faces=names[faces], name=surface.name)
    return part, labels[kept], places


def _wound(surface: Surface, labels: IntArray) -> tuple[BoolArray, Surface]:
    """Return which faces were turned for a consistent winding, and the surface so wound, each fan apart."""
    check_edges(surface)
    turned = turned_faces(surface)
    check_connected(surface, labels)
    wound = replace(surface, faces=np.where(turned[:, None], surface.faces[:, ::-1], surface.faces))
    return turned, split_vertices(wound)


def _sizes(surface: Surface, loops: tuple[IntArray, ...]) -> tuple[str, tuple[float, ...], float]:
    """Return topology, lengths of the borders and mean edge of a connected manifold, without numbering its edges again.

    Each inner edge has two half-edges, each border edge one.
    """
    lengths = tuple(loop_length(surface.vertices, loop) for loop in loops)
    edge_count = (3 * len(surface.faces) + sum(loop.size for loop in loops)) // 2
    total = float(side_lengths(surface.vertices, surface.faces).ravel().sum()) + sum(lengths)
    euler = len(surface.vertices) - edge_count + len(surface.faces)
    return kind_of(euler, loops=len(loops)), lengths, total / (2 * edge_count)


def _check_crossings(surface: Surface, *, depth: float) -> bool:
    """Refuse a surface that passes through itself; return whether all of it was looked at."""
    pairs, complete = crossings(surface, depth=depth)
    if len(pairs):
        place = surface.vertices[surface.faces[pairs[0, 0]]].mean(axis=0)
        number = f"{len(pairs)}" if complete else f"at least {len(pairs)}"
        raise MeshError(
            f"{surface.name} intersects itself: {number} pairs of faces cross or overlap, the first at "
            f"{in_words(place)}. Cut or remesh the part there.",
            pairs=len(pairs),
            place=triple(place),
        )
    return complete


def _degenerate(vertices: FloatArray, faces: IntArray) -> BoolArray:
    """Return (m,) whether a face has no area: a corner twice, or a height lost in rounding."""
    doubled, squares = thinness(vertices, faces)
    return doubled <= DEGENERATE_SHARE * squares


def _first_of_each(faces: IntArray) -> IntArray:
    """Return the first of each set of faces with the same corners, ascending."""
    corners = np.sort(faces, axis=1)
    order = np.lexsort((corners[:, 2], corners[:, 1], corners[:, 0]))
    ordered = corners[order]
    starts = np.concatenate([np.ones(min(len(order), 1), dtype=np.bool_), (ordered[1:] != ordered[:-1]).any(axis=1)])
    return np.sort(order[starts])
