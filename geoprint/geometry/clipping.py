"""Cutting a surface along the zero line of a function, drawing lines into its triangles, and its landmarks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from geoprint.errors import InputError
from geoprint.geometry.operators import doubled_area_vectors, face_areas, nearest_middle, reaching
from geoprint.geometry.points import closest, closest_in_triangles, positions, triple
from geoprint.geometry.topology import boundary_half_edges, component_labels, edges, half_edges, used_vertices
from geoprint.model import (
    BoolArray,
    FloatArray,
    IntArray,
    Rounded,
    Surface,
    SurfacePoints,
    freeze_arrays,
    frozen,
    recorded,
)

# Cutting a piece out of a surface: along the zero line of a function through its triangles, or by whole faces.


# A cut that passes a vertex closer than this share of its height over the far sides of its triangles takes the vertex
# along instead of leaving a sliver beside it: so far no triangle turns over.
SNAP_SHARE = 0.08
# How far what rids a cut of slivers may move the surface [mm]: less than half of what a part may lie off its file.
FLAT_ENOUGH = 0.004
# Distances of places a metre off are rounded to less than this [mm].
ROUNDING = 1e-9


def clipped(surface: Surface, bounds: FloatArray) -> Surface:
    """Keep the part of a surface on which functions are not positive, cutting through triangles.

    The functions are linear in each triangle, so that the new rim is straight in each; what is left of a triangle
    becomes one or two. Where the rim passes very close to a vertex, the vertex slides along its edge onto the rim.

    Args:
        surface: n vertices, manifold.
        bounds: (n, k) values of k functions at the vertices; the part lies where all of them are at most 0.

    Returns:
        The part, in as many pieces as it falls into, wound as before.

    Raises:
        InputError: nothing is left, or a value is not finite.
    """
    if bounds.shape[:1] != (len(surface.vertices),) or not np.isfinite(bounds).all():
        raise InputError(f"{surface.name} can only be cut where finite values are given at all of its vertices.")
    # Columns after the position are carried along: a later cut finds its values at the vertices an earlier one made.
    carried = np.column_stack([surface.vertices, bounds])
    faces = surface.faces
    for column in range(3, carried.shape[1]):
        carried, faces = _cut(carried, faces, column)
        if len(faces) == 0:
            raise InputError(f"{surface.name} has no part within the given bounds; check their place and size in mm.")
    used, named = _compact(faces, count=len(carried))
    return Surface(vertices=carried[used, :3], faces=named, name=surface.name)


def part_of(surface: Surface, kept: BoolArray) -> Surface:
    """Return some of the faces with the vertices they use, both in their order.

    Args:
        surface: m faces.
        kept: (m,) which faces, at least one.
    """
    used, named = _compact(surface.faces[kept], count=len(surface.vertices))
    return Surface(vertices=surface.vertices[used], faces=named, name=surface.name)


def piece_at(surface: Surface, xyz: FloatArray) -> Surface:
    """Return the edge-connected piece of a surface that is nearest to a (3,) position [mm]."""
    labels = component_labels(surface)
    if not labels.any():
        return surface
    nearest, _ = closest_once(surface, xyz[None, :])
    return part_of(surface, labels == labels[nearest.faces[0]])


def faces_within(surface: Surface, centre: FloatArray, *, radius: float) -> BoolArray:
    """Return (m,) which faces may reach into a ball about a (3,) position: all that do, and few others."""
    return reaching(surface.vertices, surface.faces, centre, radius)


def closest_once(surface: Surface, xyz: FloatArray) -> tuple[SurfacePoints, FloatArray]:
    """Return what `closest` does for places that lie together and are asked for once.

    Only the faces about them are sorted: what is closest to a place in a ball about the middle of all lies no farther
    from that place than whatever point of the surface is nearest to the middle.
    """
    if not np.isfinite(xyz).all():
        # It refuses them, in its own words.
        return closest(surface, xyz)
    centre = 0.5 * (xyz.min(axis=0) + xyz.max(axis=0))
    spread = float(np.linalg.norm(xyz - centre, axis=1).max())
    nearest = nearest_middle(surface.vertices, surface.faces, centre)
    near = faces_within(surface, centre, radius=2.0 * spread + nearest + ROUNDING)
    found, distances = closest(part_of(surface, near), xyz)
    return SurfacePoints(np.flatnonzero(near)[found.faces], found.weights), distances


def _cut(carried: FloatArray, faces: IntArray, column: int) -> tuple[FloatArray, IntArray]:
    """Cut at the zero of one column; vertices that the result does not use are left in place."""
    carried = _snapped(carried, faces, column)
    values = carried[:, column]
    pairs = edges(faces)
    pairs = pairs[np.sign(values[pairs]).prod(axis=1) < 0]
    new = _crossings(carried, pairs, column)
    keys = pairs[:, 0] * len(carried) + pairs[:, 1]

    def on_edge(a: IntArray, b: IntArray) -> IntArray:
        low, high = np.minimum(a, b), np.maximum(a, b)
        return len(carried) + np.searchsorted(keys, low * len(carried) + high)

    grown = np.concatenate([carried, new])
    signs = np.sign(values[faces])
    pieces = [faces[(signs <= 0).all(axis=1)]]
    below, above = (signs < 0).sum(axis=1), (signs > 0).sum(axis=1)
    a, b, c = _led_by(faces, signs, (below == 1) & (above == 2), sign=-1).T
    pieces.append(np.column_stack([a, on_edge(a, b), on_edge(a, c)]))
    a, b, c = _led_by(faces, signs, (below == 2) & (above == 1), sign=1).T
    pieces.append(_quadrangles(grown, b, c, on_edge(c, a), on_edge(a, b)))
    a, b, c = _led_by(faces, signs, (below == 1) & (above == 1), sign=-1).T
    # Led by the one below; of the others one is above and one on the cut, in either order.
    third: BoolArray = values[b] == 0
    cut = on_edge(a, c * third + b * ~third)
    pieces.append(np.column_stack([a, np.where(third, b, cut), np.where(third, cut, c)]))
    return grown, np.concatenate(pieces)


def _snapped(carried: FloatArray, faces: IntArray, column: int) -> FloatArray:
    """Slide vertices that the cut passes very closely along their edge onto it, where the surface is flat enough."""
    values = carried[:, column]
    pairs = edges(faces)
    pairs = pairs[np.sign(values[pairs]).prod(axis=1) < 0]
    lengths = np.linalg.norm(carried[pairs[:, 1], :3] - carried[pairs[:, 0], :3], axis=1)
    ends = np.concatenate([pairs, pairs[:, ::-1]])
    shares = values[ends[:, 0]] / (values[ends[:, 0]] - values[ends[:, 1]])
    slides = shares * np.concatenate([lengths, lengths])
    near = np.flatnonzero(slides < SNAP_SHARE * _least_heights(carried[:, :3], faces)[ends[:, 0]])
    # The last assignment wins: the nearest crossing of each vertex.
    near = near[np.argsort(-slides[near], kind="stable")]
    result = carried.copy()
    start, end, share = ends[near, 0], ends[near, 1], shares[near, None]
    result[start] = (1 - share) * carried[start] + share * carried[end]
    result[start, column] = 0.0
    leaves = _lifts(carried[:, :3], result[:, :3], faces) > FLAT_ENOUGH
    result[leaves] = carried[leaves]
    return result


def _lifts(before: FloatArray, after: FloatArray, faces: IntArray) -> FloatArray:
    """Return how far each of (n, 3) vertices that were moved is off the plane of a face around it at most [mm]."""
    normals = doubled_area_vectors(before, faces)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    lifts = np.abs(np.einsum("mx,mkx->mk", normals, (after - before)[faces]))
    most = np.zeros(len(before))
    np.maximum.at(most, faces.ravel(), lifts.ravel())
    return most


def _least_heights(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the (n,) smallest distance of each vertex from the line through the far side of one of its faces."""
    corners = vertices[faces]
    doubled = np.linalg.norm(doubled_area_vectors(vertices, faces), axis=1)
    far = np.linalg.norm(corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]], axis=2)
    heights = doubled[:, None] / np.maximum(far, np.finfo(np.float64).tiny)
    least = np.full(len(vertices), np.inf)
    np.minimum.at(least, faces.ravel(), heights.ravel())
    return least


def _crossings(carried: FloatArray, pairs: IntArray, column: int) -> FloatArray:
    """Return the rows of new vertices where a column is 0 on each of (e, 2) edges."""
    first, second = carried[pairs[:, 0]], carried[pairs[:, 1]]
    share = (first[:, column] / (first[:, column] - second[:, column]))[:, None]
    new = (1 - share) * first + share * second
    new[:, column] = 0.0
    return new


def _led_by(faces: IntArray, signs: FloatArray, chosen: BoolArray, *, sign: int) -> IntArray:
    """Return the chosen faces, turned so that their one corner of a sign comes first."""
    lead = np.argmax(signs[chosen] == sign, axis=1)
    return np.take_along_axis(faces[chosen], (lead[:, None] + np.arange(3)) % 3, axis=1)


def _quadrangles(carried: FloatArray, a: IntArray, b: IntArray, c: IntArray, d: IntArray) -> IntArray:
    """Return two triangles of each quadrangle a b c d, divided along its shorter diagonal."""
    points = carried[:, :3]
    by_a = np.linalg.norm(points[c] - points[a], axis=1) <= np.linalg.norm(points[d] - points[b], axis=1)
    first = np.where(by_a[:, None], np.column_stack([a, b, c]), np.column_stack([a, b, d]))
    second = np.where(by_a[:, None], np.column_stack([a, c, d]), np.column_stack([b, c, d]))
    return np.concatenate([first, second])


def _compact(faces: IntArray, *, count: int) -> tuple[IntArray, IntArray]:
    """Return the vertices that faces use, and the faces in terms of these."""
    used = used_vertices(faces)
    names = np.zeros(count, dtype=np.int64)
    names[used] = np.arange(used.size)
    return used, names[faces]


# Drawing points and lines into the triangles of a surface, so that points become vertices and lines edges.


# What comes nearer to a vertex than this share of an edge, or to an edge than this share of a triangle's height, is
# taken to lie on it: a hundredth of what a printer sees on a millimetre's edge, and no triangle becomes thinner.
NEAR_SHARE = 1e-3


@final
@frozen
class SurfaceLine:
    """A line over a surface, straight in each triangle, as the vertices it passes and the edges it crosses in turn.

    Attributes:
        edges: (c, 2) vertices; both the same where the line passes through a vertex. It starts and ends in one.
            Neighbours have a triangle in common, and no triangle is crossed twice.
        shares: (c,) where each edge is crossed, from 0 at its first vertex to 1 at its second.
        length: [mm].
    """

    edges: IntArray
    shares: FloatArray
    length: float

    def __post_init__(self) -> None:
        freeze_arrays(self, edges="int: c 2", shares="float: c")

    def places(self, surface: Surface) -> FloatArray:
        """Return the (c, 3) places of the crossings [mm]."""
        starts, ends = surface.vertices[self.edges[:, 0]], surface.vertices[self.edges[:, 1]]
        return starts + self.shares[:, None] * (ends - starts)


def with_vertex(surface: Surface, xyz: FloatArray) -> tuple[Surface, int]:
    """Make the point of a surface nearest to a position one of its vertices.

    Args:
        surface: n vertices; none moves.
        xyz: (3,) position on the surface, up to rounding [mm].

    Returns:
        The same polyhedral surface and the vertex: a new one, the last, or one that was there within NEAR_SHARE.
    """
    near = np.flatnonzero(faces_within(surface, xyz, radius=0.0))
    corners = surface.vertices[surface.faces[near]]
    weights, squares = closest_in_triangles(np.repeat(xyz[None, :], len(near), axis=0), corners)
    best = int(np.argmin(squares))
    held = weights[best] > NEAR_SHARE
    support = surface.faces[near[best]][held].tolist()
    if len(support) == 1:
        return surface, support[0]
    share = weights[best][held] / weights[best][held].sum()
    vertices = np.vstack([surface.vertices, share @ surface.vertices[support]])
    faces = _starred(surface.faces, support, len(surface.vertices))
    return Surface(vertices=vertices, faces=faces, name=surface.name), len(surface.vertices)


def inscribed(surface: Surface, line: SurfaceLine) -> tuple[Surface, IntArray]:
    """Divide the triangles that a line crosses so that the line consists of edges.

    Args:
        surface: n vertices; none moves, those at the crossings follow.
        line: on it.

    Returns:
        The same polyhedral surface, divided faces last, and the (c,) vertices of the line.
    """
    count = len(surface.vertices)
    new = np.flatnonzero(line.edges[:, 0] != line.edges[:, 1])
    chain = line.edges[:, 0].copy()
    chain[new] = count + np.arange(new.size)
    beside = np.isin(surface.faces, line.edges[new]).any(axis=1)
    divided = surface.faces[beside]
    # Dividing one edge after the other leaves an edge from each crossing to the next: the first division of a triangle
    # joins the crossing to the far corner, the second divides the half that holds it.
    for edge, vertex in zip(line.edges[new].tolist(), chain[new].tolist(), strict=True):
        divided = _starred(divided, edge, vertex)
    vertices = np.vstack([surface.vertices, line.places(surface)[new]])
    faces = np.concatenate([surface.faces[~beside], divided])
    return Surface(vertices=vertices, faces=faces, name=surface.name), chain


def _starred(faces: IntArray, support: Sequence[int], vertex: int) -> IntArray:
    """Divide the faces about a vertex inside a face (three supporting corners) or on an edge (two).

    Each face that has all supporting corners becomes as many faces, in which the vertex replaces one of them.
    """
    holding = np.all([(faces == corner).any(axis=1) for corner in support], axis=0)
    held = faces[holding]
    return np.concatenate([faces[~holding], *(np.where(held == corner, vertex, held) for corner in support)])


# Landmarks: places by which a person finds the way on a surface, each with the outward normal there.


# Vertices within this share of the part's size of the outermost one are as far out: a flat end has many.
LEVEL_SHARE = 1e-6
# Pieces of a surface that get a place each, the largest first.
MOST_PIECES = 5
INSIDE = "farthest from the border"


@final
@recorded("LandmarkRecord", place="place_mm")
class Landmark:
    """A place on a surface.

    Attributes:
        name: what is there.
        place: (3,) [mm].
        normal: (3,) outward unit normal.
    """

    name: str
    place: tuple[Rounded, ...]
    normal: tuple[Rounded, ...]


def extremes(surface: Surface) -> tuple[Landmark, ...]:
    """Return the lowest and highest place along each axis; of a flat end that nearest to its middle.

    An axis along which the surface has no extent is left out.
    """
    used = surface.vertices[np.unique(surface.faces)]
    low, high = used.min(axis=0), used.max(axis=0)
    level = LEVEL_SHARE * float(np.linalg.norm(high - low))
    found: list[Landmark] = []
    for axis, letter in enumerate("xyz"):
        if high[axis] - low[axis] <= level:
            continue
        for name, end in (("lowest", low[axis]), ("highest", high[axis])):
            ends = used[np.abs(used[:, axis] - end) <= level]
            middle = ends.mean(axis=0)
            points, _ = closest_once(surface, middle[None])
            if abs(positions(surface, points)[0, axis] - end) > level:
                # Several ends, or a ring: between them the surface is not at its end.
                nearest = ends[np.argmin(np.linalg.norm(ends - middle, axis=1))]
                points, _ = closest_once(surface, nearest[None])
            corner = int(np.argmax(points.weights[0]))
            at_vertex = points.weights[0, corner] > 1.0 - LEVEL_SHARE
            faces = (
                (surface.faces == surface.faces[points.faces[0], corner]).any(axis=1)
                if at_vertex
                else np.arange(len(surface.faces)) == points.faces[0]
            )
            found.append(Landmark(f"{name} {letter}", triple(positions(surface, points)[0]), _normal(surface, faces)))
    return tuple(found)


def farthest_inside(surface: Surface, faces: BoolArray, *, name: str) -> Landmark:
    """Return the vertex of some faces that is farthest from their border along edges; the highest where they have none.

    Args:
        surface: with m faces.
        faces: (m,) which of them, at least one.
        name: of the place.
    """
    part = part_of(surface, faces)
    border = np.unique(half_edges(part.faces)[boundary_half_edges(part.faces)])
    depth = part.vertices[:, 2]
    if border.size:
        first, second = edges(part.faces).T
        lengths = np.linalg.norm(part.vertices[first] - part.vertices[second], axis=1)
        links = coo_array((lengths, (first, second)), shape=(len(part.vertices), len(part.vertices))).tocsr()
        depth = dijkstra(links, directed=False, indices=border, min_only=True)
        # A closed piece among others is reached from no border.
        depth = np.where(np.isfinite(depth), depth, 0.0)
    vertex = int(np.argmax(depth))
    return Landmark(name, triple(part.vertices[vertex]), _normal(part, (part.faces == vertex).any(axis=1)))


def landmarks(surface: Surface, *, regions: Mapping[str, BoolArray]) -> tuple[Landmark, ...]:
    """Return the extremes, the place of each piece that is farthest from its border, and one of each region.

    Args:
        surface: manifold, m faces.
        regions: (m,) which faces lie in each, by its name; at least one.
    """
    labels = component_labels(surface)
    several = bool(labels.any())
    found = [*extremes(surface)]
    if several or boundary_half_edges(surface.faces).size:
        largest = np.argsort(-np.bincount(labels, face_areas(surface)), kind="stable")[:MOST_PIECES]
        found += [
            farthest_inside(surface, labels == piece, name=f"{INSIDE} of piece {number}" if several else INSIDE)
            for number, piece in enumerate(largest, start=1)
        ]
    return (*found, *(farthest_inside(surface, own, name=name) for name, own in regions.items()))


def _normal(surface: Surface, faces: BoolArray) -> tuple[float, ...]:
    """Return the unit mean of some faces' normals, weighted by area."""
    corners = surface.vertices[surface.faces[faces]]
    whole: FloatArray = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    length = float(np.linalg.norm(whole))
    return triple(whole / length if length > 0.0 else whole)


def middle_face(surface: Surface, faces: IntArray, *, name: str) -> Landmark:
    """Return the middle of the one of some faces that is nearest to the mean of all; they need not hang together."""
    middles = surface.vertices[surface.faces[faces]].mean(axis=1)
    nearest = int(np.argmin(np.linalg.norm(middles - middles.mean(axis=0), axis=1)))
    own = np.zeros(len(surface.faces), dtype=np.bool_)
    own[faces[nearest]] = True
    return Landmark(name, triple(middles[nearest]), _normal(surface, own))
