"""Refinement: the same polyhedral surface with shorter edges."""

from __future__ import annotations

import math

import numpy as np

from geoprint.errors import InputError, ResourceError
from geoprint.geometry.operators import face_areas
from geoprint.geometry.topology import half_edges, numbered_pairs, twins
from geoprint.model import BoolArray, FloatArray, IntArray, Surface

# Better triangles without new vertices: flipping edges inside the planar faces that a mesh was refined from.


# An edge is flipped if the cotangents opposite to it sum to less than minus this: rounding does not decide.
COTANGENT_TOLERANCE = 1e-9


def flipped_inside(vertices: FloatArray, faces: IntArray, parents: IntArray) -> IntArray:
    """Flip edges between pieces of one planar face until they are locally Delaunay.

    An edge is flipped if the angles opposite to it sum to more than a half turn and the other diagonal is shorter.
    The surface stays exactly as it is, because both pieces lie in the plane of their common parent.

    Args:
        vertices: (n, 3) positions.
        faces: (m, 3), at most two at an edge.
        parents: (m,) the face that each one is a piece of; pieces with parent -1 are left alone.

    Returns:
        (m, 3) faces; each one is still a piece of its parent.
    """
    result = faces.copy()
    active = np.flatnonzero(parents >= 0)
    while active.size:
        chosen = _independent_flips(vertices, result[active], parents[active])
        left, right = active[chosen[:, 0] // 3], active[chosen[:, 1] // 3]
        a, b, c = (result[left, (chosen[:, 0] + shift) % 3] for shift in range(3))
        d = result[right, (chosen[:, 1] + 2) % 3]
        result[left], result[right] = np.column_stack([a, d, c]), np.column_stack([d, b, c])
        # What a flip changes stays inside its parent.
        touched = np.zeros(int(parents.max()) + 1, dtype=np.bool_)
        touched[parents[left]] = True
        active = active[touched[parents[active]]]
    return result


def _independent_flips(vertices: FloatArray, faces: IntArray, parents: IntArray) -> IntArray:
    """Return (k, 2) half-edges and their twins to flip, the most obtuse first, each face in one flip at most."""
    other = twins(faces)
    half = np.flatnonzero(other > np.arange(other.size))
    half = half[parents[half // 3] == parents[other[half] // 3]]
    a, b, c = (vertices[faces[half // 3, (half + shift) % 3]] for shift in range(3))
    d = vertices[faces[other[half] // 3, (other[half] + 2) % 3]]
    opposite = _cotangents(a - c, b - c) + _cotangents(a - d, b - d)
    shorter = np.linalg.norm(d - c, axis=1) < np.linalg.norm(b - a, axis=1)
    wanted = np.flatnonzero((opposite < -COTANGENT_TOLERANCE) & shorter)
    rank = np.empty(wanted.size, dtype=np.int64)
    rank[np.argsort(opposite[wanted], kind="stable")] = np.arange(wanted.size)
    pairs = np.column_stack([half[wanted], other[half[wanted]]])
    first = np.full(len(faces), wanted.size)
    np.minimum.at(first, pairs // 3, rank[:, None])
    return pairs[(first[pairs // 3] == rank[:, None]).all(axis=1)]


def _cotangents(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return (k,) the cotangent of the angle between (k, 3) vectors."""
    crossed = np.linalg.norm(np.cross(first, second), axis=1)
    return np.einsum("kx,kx->k", first, second) / np.maximum(crossed, np.finfo(np.float64).tiny)


# Faces of the largest mesh that is worth planning on: a million take the heat method about 1.4 GB.
FACE_LIMIT = 5_000_000
# Edges longer than this times the wanted length are halved, so that lengths end in [1/sqrt(2), sqrt(2)] of it.
LONGEST_EDGE = math.sqrt(2.0)
# Equilateral triangles on the square of their side.
FACES_PER_SQUARE = 4.0 / math.sqrt(3.0)
# Relative; lengths that differ by rounding alone are treated alike, so that a part is cut the same when rotated.
LENGTH_TOLERANCE = 1e-9
# A face whose height is below this share of its longest side (angles of 14 degrees) is cut across.
THIN_FACE = 0.25


def refine(surface: Surface, *, edge_length: float) -> Surface:
    """Halve edges until none is longer than sqrt(2) * edge_length.

    Every edge above the bound gets its midpoint; a face with one, two or three such edges is cut into two, three or
    four, with the shorter diagonal where there is a choice; and again, until no edge is above the bound. Thin faces
    (angles below 14 degrees, as in the long strips of CAD exports) have their sides halved first and are then cut
    across by edge flips, instead of into ever thinner needles.

    Long edges come out between 1/sqrt(2) and sqrt(2) times edge_length, depending on what halving makes of them; the
    mean is 0.8 to 1.2 times edge_length on scanned parts. A mesh that is finer is not coarsened.

    Every new vertex lies on the surface given, which therefore keeps its shape, area, boundary, winding and topology.

    Args:
        surface: n vertices, m faces, at most two at an edge.
        edge_length: wanted [mm], above 0.

    Returns:
        The finer surface; vertices 0 to n - 1 are those given, the pieces of a face follow each other.

    Raises:
        InputError: edge_length is not a positive, finite number.
        ResourceError: more than FACE_LIMIT faces would be needed.
        MeshError: an edge of a thin face has more than two faces.
    """
    if not (edge_length > 0 and math.isfinite(edge_length)):
        raise InputError(f"edge_length must be a positive number of mm, found {edge_length}.", edge_length=edge_length)
    bound = LONGEST_EDGE * edge_length * (1 + LENGTH_TOLERANCE)
    _check_expected(surface, edge_length=edge_length)
    vertices, faces, parents = surface.vertices, surface.faces, np.arange(len(surface.faces))
    thin = _thin_faces(surface)
    while True:
        long = _long_sides(vertices, faces, bound=bound)
        if not long.size:
            return Surface(vertices=vertices, faces=faces, name=surface.name)
        ends, edge = numbered_pairs(half_edges(faces)[long])
        halved = ~_waiting_edges(edge, parents[long // 3], thin)
        midpoint = np.full(faces.size, -1)
        midpoint[long] = np.where(halved, len(vertices) + np.cumsum(halved) - 1, -1)[edge]
        midpoint = midpoint.reshape(-1, 3)
        marked = midpoint >= 0
        _check_count(surface, len(faces) + int(marked.sum()), edge_length=edge_length)
        vertices = np.concatenate([vertices, vertices[ends[halved]].mean(axis=1)])
        faces = _split(vertices, faces, marked, midpoint)
        parents = np.repeat(parents, 1 + marked.sum(axis=1))
        faces = flipped_inside(vertices, faces, np.where(thin[parents], parents, -1))


def halved(surface: Surface, ends: IntArray) -> Surface:
    """Halve some edges, and cut the faces beside them in two, three or four.

    Args:
        surface: n vertices, at most two faces at an edge.
        ends: (k, 2) vertices of each edge, each edge once.

    Returns:
        The finer surface; its last k vertices are the midpoints in the order of the edges.
    """
    count = len(surface.vertices)
    sides = half_edges(surface.faces)
    low, high = sides.min(axis=1), sides.max(axis=1)
    keys: IntArray = low * count + high
    chosen: IntArray = ends.min(axis=1) * count + ends.max(axis=1)
    order = np.argsort(chosen)
    found = order[np.minimum(np.searchsorted(chosen[order], keys), len(ends) - 1)]
    midpoint = np.where(chosen[found] == keys, count + found, -1).reshape(-1, 3)
    vertices = np.concatenate([surface.vertices, surface.vertices[ends].mean(axis=1)])
    return Surface(vertices, _split(vertices, surface.faces, midpoint >= 0, midpoint), surface.name)


def _long_sides(vertices: FloatArray, faces: IntArray, *, bound: float) -> IntArray:
    """Return the half-edges longer than the bound, ascending."""
    corners = vertices[faces]
    along = (np.roll(corners, -1, axis=1) - corners).reshape(-1, 3)
    return np.flatnonzero(np.einsum("kx,kx->k", along, along) > bound**2)


def _thin_faces(surface: Surface) -> BoolArray:
    """Return (m,) whether each face is much longer than high."""
    corners = surface.vertices[surface.faces]
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    return 2 * face_areas(surface) < THIN_FACE * longest**2


def _waiting_edges(edge: IntArray, owner: IntArray, thin: BoolArray) -> BoolArray:
    """Return which long edges inside thin faces must not be halved yet, because the face's own sides are still long.

    Args:
        edge: (k,) the edge of each long side, of e edges.
        owner: (k,) the given face in which the side's face lies.
        thin: for each face given.

    Returns:
        (e,) whether to leave the edge for now.
    """
    count = int(edge.max()) + 1
    of_thin = thin[owner]
    edge, owner = edge[of_thin], owner[of_thin]
    # Edges with one side in a thin face are on its border already; those between two of them are as well.
    inside = np.bincount(edge, minlength=count) == 2
    any_owner = np.zeros(count, dtype=np.int64)
    any_owner[edge] = owner
    inside[edge[owner != any_owner[edge]]] = False
    unfinished = np.zeros(thin.size, dtype=np.bool_)
    unfinished[owner[~inside[edge]]] = True
    return inside & unfinished[any_owner]


def _split(vertices: FloatArray, faces: IntArray, marked: BoolArray, midpoint: IntArray) -> IntArray:
    """Cut every face at the midpoints of its marked sides.

    Args:
        vertices: positions, midpoints included.
        faces: (m, 3).
        marked: (m, 3) whether the side from corner i to corner i + 1 is halved.
        midpoint: (m, 3) the vertex at its middle; anything where it is not.

    Returns:
        The new faces, wound as before, the pieces of a face next to each other.
    """
    count = marked.sum(axis=1)
    # Turned so that a single marked side is side 0 and a single unmarked side is side 2.
    turn = np.select([count == 1, count == 2], [np.argmax(marked, axis=1), (np.argmin(marked, axis=1) + 1) % 3], 0)
    order = (turn[:, None] + np.arange(3)) % 3
    corner, middle = np.take_along_axis(faces, order, axis=1), np.take_along_axis(midpoint, order, axis=1)
    pieces, parents = [faces[count == 0]], [np.flatnonzero(count == 0)]
    for number, cut in ((1, _in_two), (2, _in_three), (3, _in_four)):
        chosen = np.flatnonzero(count == number)
        pieces.append(cut(vertices, corner[chosen], middle[chosen]).reshape(-1, 3))
        parents.append(np.repeat(chosen, number + 1))
    return np.concatenate(pieces)[np.argsort(np.concatenate(parents), kind="stable")]


def _in_two(_vertices: FloatArray, corner: IntArray, middle: IntArray) -> IntArray:
    """Side 0 is halved: join its midpoint to the opposite corner. Returns (k, 2, 3)."""
    a, b, c = corner.T
    m = middle[:, 0]
    return _triangles((a, m, c), (m, b, c))


def _in_three(vertices: FloatArray, corner: IntArray, middle: IntArray) -> IntArray:
    """Sides 0 and 1 are halved: cut off corner 1 and the rest along its shorter diagonal. Returns (k, 3, 3)."""
    a, b, c = corner.T
    m, n = middle[:, 0], middle[:, 1]
    from_a = np.linalg.norm(vertices[n] - vertices[a], axis=1)
    from_c = np.linalg.norm(vertices[m] - vertices[c], axis=1)
    by_a = (from_a <= from_c * (1 + LENGTH_TOLERANCE))[:, None, None]
    return np.where(by_a, _triangles((m, b, n), (a, m, n), (a, n, c)), _triangles((m, b, n), (m, n, c), (a, m, c)))


def _in_four(_vertices: FloatArray, corner: IntArray, middle: IntArray) -> IntArray:
    """All sides are halved: four similar triangles. Returns (k, 4, 3)."""
    a, b, c = corner.T
    m, n, o = middle.T
    return _triangles((a, m, o), (m, b, n), (o, n, c), (m, n, o))


def _triangles(*triples: tuple[IntArray, IntArray, IntArray]) -> IntArray:
    return np.stack([np.column_stack(triple) for triple in triples], axis=1)


def _check_expected(surface: Surface, *, edge_length: float) -> None:
    """Refuse before any work what must end in too many faces: by area, or by the length of the faces' sides."""
    by_area, by_sides = _expected_faces(surface, edge_length=edge_length)
    _check_count(surface, max(by_area, by_sides), edge_length=edge_length)


def _expected_faces(surface: Surface, *, edge_length: float) -> tuple[float, float]:
    """Return how many equilateral triangles cover the surface, and how many pieces the sides of its faces need."""
    corners = surface.vertices[surface.faces]
    perimeters = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).sum()
    by_area = FACES_PER_SQUARE * float(face_areas(surface).sum()) / edge_length**2
    return by_area, float(perimeters) / (LONGEST_EDGE * edge_length) - 2 * len(surface.faces)


def _check_count(surface: Surface, faces: float, *, edge_length: float) -> None:
    if faces <= FACE_LIMIT or faces <= len(surface.faces):
        return
    by_area, by_sides = _expected_faces(surface, edge_length=edge_length)
    # Twice the expected count leaves room for uneven triangles.
    possible = edge_length * max(math.sqrt(2 * by_area / FACE_LIMIT), 2 * by_sides / FACE_LIMIT)
    raise ResourceError(
        f"{surface.name}: an edge length of {edge_length:g} mm needs more than the limit of {FACE_LIMIT:,} faces; "
        f"{possible:.2g} mm is possible. Choose a wider spacing, or cut out a smaller part.",
        edge_length=edge_length,
        possible_edge_length=possible,
        limit=FACE_LIMIT,
    )
