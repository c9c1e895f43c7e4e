"""Geodesic distance by a front that carries its direction, marched over an intrinsic triangulation.

Fast marching [Kimmel1998] sweeps a surface from the source outwards, each vertex once, and finds its distance through
the triangles around it. Here every vertex also knows where its shortest line comes from, which is the gradient of the
distance: along an edge the distance is then a cubic instead of a straight line, and curved fronts keep their shape. On
triangles whose worst edges are flipped first the result lies within a few thousandths of an edge length of the exact
distance on the polyhedron.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, TypeAlias, final

import numpy as np

from geoprint.distance.fast_marching_kernels import (
    SEED_FIRST_EDGE,
    SEED_LAST_EDGE,
    SEED_VERTEX,
    Front,
    MarchingMesh,
    crossing_shares,
    march,
    measure_corners,
    settle,
    slopes_at,
)
from geoprint.distance.fast_marching_windows import see_from_border, see_from_pieces, see_from_vertices
from geoprint.distance.interface import Accuracy, level_distances, linear_edge_length
from geoprint.distance.intrinsic import IntrinsicTriangulation, delaunay, intrinsic_triangulation
from geoprint.distance.isolines import isolines
from geoprint.errors import FieldError
from geoprint.geometry import closest, edge_lengths, half_edges, in_words, positions
from geoprint.geometry.halfedges import next_halves
from geoprint.model import (
    BoolArray,
    Contours,
    FloatArray,
    IntArray,
    ScalarField,
    Source,
    Surface,
    SurfaceCurves,
    SurfacePoints,
    frozen,
)

# Corners of level curves that lie just beyond a triangle: the curve pokes through its third side and comes back.
#
# Both ends of that side are on the same side of the level, so that tracing sees no crossing there.


# A piece with an end nearer to the third side than this barycentric weight lies on it.
TOUCHING = 1e-6


def tips_beyond(
    surface: Surface, faces: IntArray, *, first: FloatArray, corners: FloatArray, last: FloatArray
) -> tuple[IntArray, SurfacePoints]:
    """Lead pieces of level curves to corners beyond the third side of their triangle, and back.

    The triangle on the other side is unfolded, and the curve continues straight into it.

    Args:
        surface: m faces, consistently wound.
        faces: (k,) triangle of each piece, which runs from one of its sides to another.
        first: (k, 3) barycentric weights of the piece's start.
        corners: (k, 3) of the corner to reach, one of them negative.
        last: (k, 3) of the piece's end.

    Returns:
        The (j,) piece that each new point belongs to, ascending, and the points in their order along it: on going out
        through the side, the corner, and on coming back. Corners beyond the next triangle too are left out of it, and
        pieces whose third side is border, or that touch it, get nothing.
    """
    opposite = np.argmin(corners, axis=1)
    twins = _half_edges_beyond(surface, faces, (opposite + 1) % 3)
    each = np.arange(faces.size)
    apart = np.minimum(first[each, opposite], last[each, opposite]) > TOUCHING
    leads = np.flatnonzero((twins >= 0) & apart)
    faces, opposite, twins = faces[leads], opposite[leads], twins[leads]
    # Corners in the order start of the side, end of the side, apex; the twin runs from the end to the start.
    here = np.column_stack([(opposite + 1) % 3, (opposite + 2) % 3, opposite])
    there = np.column_stack([(twins + 1) % 3, twins % 3, (twins + 2) % 3])
    corners = np.take_along_axis(corners[leads], here, axis=1)
    into, back = (_where_crossed(np.take_along_axis(point[leads], here, axis=1), corners) for point in (first, last))
    tips = _unfolded(_triangles(surface, faces, here), _triangles(surface, twins // 3, there), corners)
    weights = np.stack([_arranged(into, there), _arranged(tips, there), _arranged(back, here)], axis=1)
    found = np.column_stack([twins // 3, twins // 3, faces])
    kept = np.ones(found.shape, dtype=np.bool_)
    kept[:, 1] = tips.min(axis=1) >= 0.0
    return np.repeat(leads, kept.sum(axis=1)), SurfacePoints(found[kept], weights[kept])


def _half_edges_beyond(surface: Surface, faces: IntArray, sides: IntArray) -> IntArray:
    """Return the half-edge 3 f + i on the other side of each side of a face, -1 on the border."""
    starts, ends = surface.faces[faces, sides], surface.faces[faces, (sides + 1) % 3]
    near = np.zeros(len(surface.vertices), dtype=np.bool_)
    near[starts] = near[ends] = True
    around = np.flatnonzero(np.count_nonzero(near[surface.faces], axis=1) >= 2)
    base = len(surface.vertices)
    tails, heads = half_edges(surface.faces[around]).T
    keys = tails * base + heads
    order = np.argsort(keys)
    wanted = ends * base + starts
    place = order[np.minimum(np.searchsorted(keys[order], wanted), order.size - 1)]
    return np.where(keys[place] == wanted, 3 * around[place // 3] + place % 3, -1)


def _where_crossed(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the (k, 3) weights of where the lines from points to corners cross the side opposite to the last one."""
    share = points[:, 2] / (points[:, 2] - corners[:, 2])
    end = points[:, 1] + share * (corners[:, 1] - points[:, 1])
    return np.column_stack([1.0 - end, end, np.zeros(end.size)])


def _unfolded(here: FloatArray, there: FloatArray, corners: FloatArray) -> FloatArray:
    """Return weights in the triangles there of places beyond the first side of the triangles here.

    Args:
        here: (k, 3, 3) start and end of the side, and apex.
        there: (k, 3, 3) start and end of the same side, and the apex on its other side.
        corners: (k, 3) weights here, the last negative.

    Returns:
        (k, 3) weights; negative where the place lies beyond that triangle too.
    """
    foot, height = _foot_and_height(here)
    far_foot, far_height = _foot_and_height(there)
    apex = -corners[:, 2] * height / far_height
    end = corners[:, 1] + corners[:, 2] * foot - apex * far_foot
    return np.column_stack([1.0 - end - apex, end, apex])


def _foot_and_height(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where the foot of each apex lies, as a share of the line from start to end, and its height [mm]."""
    side, slant = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    foot = np.einsum("kx,kx->k", slant, side) / np.einsum("kx,kx->k", side, side)
    return foot, np.linalg.norm(slant - foot[:, None] * side, axis=1)


def _triangles(surface: Surface, faces: IntArray, order: IntArray) -> FloatArray:
    """Return (k, 3, 3) corners of faces in the given order."""
    return surface.vertices[np.take_along_axis(surface.faces[faces], order, axis=1)]


def _arranged(weights: FloatArray, order: IntArray) -> FloatArray:
    """Return weights, given for corners in an order, for the corners as the face has them."""
    result = np.empty_like(weights)
    np.put_along_axis(result, order, weights, axis=1)
    return result


# Corners of level curves on ridges, where two fronts meet inside a triangle.
#
# A level curve that is straight in each triangle cuts such a corner off by up to a triangle's width. The slopes
# along the edges where it enters and leaves say in which directions it really runs there; the two lines meet on the
# ridge.


# Smaller turns within one triangle [rad] are the curvature of a front rather than the meeting of two.
LEAST_TURN = 0.2
# A point with a smaller barycentric weight on an edge lies at its end, where the edge does not say the direction.
VERTEX_WEIGHT = 1e-6

EdgeSlopes: TypeAlias = Callable[[IntArray, FloatArray], tuple[FloatArray, FloatArray]]


def with_ridge_corners(surface: Surface, curves: SurfaceCurves, *, edge_slopes: EdgeSlopes) -> SurfaceCurves:
    """Insert the corners that level curves have inside triangles.

    Args:
        surface: m faces.
        curves: level curves of a distance, larger values on their left; every point on an edge and, but for the last
            of an open curve, in the face that the curve crosses next.
        edge_slopes: given (k, 2) edges and (k,) shares of their length, returns the (k,) derivatives of the
            distance along them, per mm, and (k,) positive where it rises to the left of the edge, negative where to the
            right, and 0 where that is not known.

    Returns:
        The same curves with more points. Only turns to the left are ridges. A corner may lie beyond the third side of
        its triangle, where the curve pokes through; one beyond a vertex is left out.
    """
    points = curves.points
    first = np.setdiff1d(np.arange(points.faces.size), curves.offsets[1:] - 1)
    faces = points.faces[first]
    places = positions(surface, points)
    edges, shares, on_edge = _edges_of(surface, points)
    slopes, sides = edge_slopes(edges, shares)
    corners = surface.vertices[surface.faces[faces]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    chords = places[first + 1] - places[first]
    entering, leaving = (
        _directions(surface.vertices[edges[at]], slopes[at], sides[at], normals, chords) for at in (first, first + 1)
    )
    turn = _dot(np.cross(entering, leaving), normals)
    is_ridge = on_edge[first] & on_edge[first + 1] & (turn > np.sin(LEAST_TURN))
    steps = np.divide(_dot(np.cross(chords, leaving), normals), turn, out=np.zeros_like(turn), where=is_ridge)
    weights = _weights(corners, normals, places[first] + steps[:, None] * entering)
    is_ridge &= steps > 0.0
    inside = np.flatnonzero(is_ridge & (weights.min(axis=1) >= 0.0))
    outside = np.flatnonzero(is_ridge & (np.count_nonzero(weights < 0.0, axis=1) == 1))
    piece, tips = tips_beyond(
        surface,
        faces[outside],
        first=points.weights[first[outside]],
        corners=weights[outside],
        last=_weights(corners[outside], normals[outside], places[first[outside] + 1]),
    )
    before = np.concatenate([first[inside], first[outside][piece]]) + 1
    order = np.argsort(before, kind="stable")
    added_faces = np.concatenate([faces[inside], tips.faces])[order]
    added_weights = np.concatenate([weights[inside], tips.weights])[order]
    return _inserted(curves, before[order], SurfacePoints(added_faces, added_weights))


def _edges_of(surface: Surface, points: SurfacePoints) -> tuple[IntArray, FloatArray, BoolArray]:
    """Return (k, 2) ends of the edge of each point, its (k,) share from the first, and (k,) whether it is between."""
    opposite = np.argmin(points.weights, axis=1)
    row = np.arange(len(points.faces))
    start, end = (opposite + 1) % 3, (opposite + 2) % 3
    corners = surface.faces[points.faces]
    shares = points.weights[row, end]
    between = (points.weights[row, start] > VERTEX_WEIGHT) & (shares > VERTEX_WEIGHT)
    return np.column_stack([corners[row, start], corners[row, end]]), shares, between


def _directions(
    ends: FloatArray, slopes: FloatArray, sides: FloatArray, normals: FloatArray, chords: FloatArray
) -> FloatArray:
    """Return the (k, 3) unit directions of level curves at edges.

    Two have the slope; it is the one with the larger values on its left, or where the side of those is not known the
    one along the chord.
    """
    along = ends[:, 1] - ends[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(normals, along)
    steep = np.clip(slopes, -1.0, 1.0)[:, None]
    rest = np.sqrt(1.0 - steep * steep)
    # The gradient turned clockwise.
    candidates = np.stack([rest * along - steep * across, -rest * along - steep * across])
    along_chord = _dot(candidates[0], chords) - _dot(candidates[1], chords)
    rising_left = np.where(sides == 0.0, along_chord, sides) >= 0.0
    return candidates[np.where(rising_left, 0, 1), np.arange(len(slopes))]


def _weights(corners: FloatArray, normals: FloatArray, places: FloatArray) -> FloatArray:
    """Return the (k, 3) barycentric weights of places in the planes of triangles."""
    following, last = np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1)
    doubled = np.cross(following - places[:, None], last - places[:, None])
    parts: FloatArray = np.einsum("kcx,kx->kc", doubled, normals)
    return parts / parts.sum(axis=1, keepdims=True)


def _inserted(curves: SurfaceCurves, before: IntArray, points: SurfacePoints) -> SurfaceCurves:
    """Insert points, each before the point of the given index."""
    faces = np.insert(curves.points.faces, before, points.faces)
    weights = np.insert(curves.points.weights, before, points.weights, axis=0)
    offsets = curves.offsets + np.searchsorted(before, curves.offsets, side="left")
    return SurfaceCurves(SurfacePoints(faces, weights), offsets, curves.closed)


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.einsum("kx,kx->k", first, second)


# Where a source runs: along border edges, through vertices and inside triangles.


# Barycentric weights below this are rounding: the point lies on the opposite side, or at the corner that is left.
WEIGHT_ROUNDING = 1e-9
# A chord that leaves its triangle is halved this often; what is then still across an edge is left open, and the
# distance, which the open ends are part of, hardly notices.
HALVINGS = 14


@final
@frozen
class SourcePieces:
    """A source cut into what one vertex, one border edge or one triangle holds.

    Attributes:
        vertices: (v,) vertices that the source goes through, ascending; the ends of border edges are among them.
        border: (b,) start vertices of the border half-edges that the source follows, ascending.
        faces: (k,) triangle of each straight piece inside a triangle or along a side that is not border.
        starts: (k, 3) barycentric weights of the piece's start.
        ends: (k, 3) of its end; the same as its start for a point.
    """

    vertices: IntArray
    border: IntArray
    faces: IntArray
    starts: FloatArray
    ends: FloatArray


def source_pieces(surface: Surface, source: Source, *, rim: IntArray) -> SourcePieces:
    """Cut a source into pieces.

    Two neighbouring points of a curve with no triangle in common are joined along the surface below their chord.

    Args:
        surface: m faces.
        source: curves and points on it.
        rim: (b, 2) start and end vertex of the border half-edges.

    Raises:
        InputError: a point names a face that the surface does not have.
    """
    points = _rounded(surface, source.curves.points)
    is_end = np.zeros(points.faces.size, dtype=np.bool_)
    is_end[source.curves.offsets[1:] - 1] = True
    first = np.flatnonzero(~is_end)
    at_vertex, vertex = _at_vertices(surface, points)
    border = _border_edges(rim, vertex[first], vertex[first + 1])
    # A chord from a vertex to itself is a point.
    inner = first[(border < 0) & ~((vertex[first] >= 0) & (vertex[first] == vertex[first + 1]))]
    faces, starts, ends = _inside(surface, points[inner], points[inner + 1])
    alone = ~at_vertex
    faces = np.concatenate([faces, points.faces[alone]])
    starts, ends = np.concatenate([starts, points.weights[alone]]), np.concatenate([ends, points.weights[alone]])
    return SourcePieces(np.unique(vertex[at_vertex]), np.unique(border[border >= 0]), faces, starts, ends)


def _rounded(surface: Surface, points: SurfacePoints) -> SurfacePoints:
    """Return points whose weights are 0 where they are rounding."""
    positions(surface, points)  # refuses faces that do not exist
    weights = np.where(points.weights < WEIGHT_ROUNDING, 0.0, points.weights)
    return SurfacePoints(points.faces, weights / weights.sum(axis=1, keepdims=True))


def _at_vertices(surface: Surface, points: SurfacePoints) -> tuple[BoolArray, IntArray]:
    """Return (k,) whether each point is a vertex, and which one, else -1."""
    at_vertex = np.count_nonzero(points.weights, axis=1) == 1
    vertex = surface.faces[points.faces, np.argmax(points.weights, axis=1)]
    return at_vertex, np.where(at_vertex, vertex, -1)


def _border_edges(rim: IntArray, starts: IntArray, ends: IntArray) -> IntArray:
    """Return the start of the border half-edge between two vertices, whichever direction it has, else -1."""
    # The last place stands for "no vertex" and follows nothing.
    following = np.full(max(int(ends.max(initial=0)), int(rim.max(initial=0)), int(starts.max(initial=0))) + 2, -1)
    following[rim[:, 0]] = rim[:, 1]
    known = (starts >= 0) & (ends >= 0)
    forwards, backwards = known & (following[starts] == ends), known & (following[ends] == starts)
    return np.where(forwards, starts, np.where(backwards, ends, -1))


def _inside(surface: Surface, first: SurfacePoints, last: SurfacePoints) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return triangle, start and end weights of the pieces that join pairs of points; chords are halved to fit."""
    found: list[tuple[IntArray, FloatArray, FloatArray]] = []
    for _ in range(HALVINGS):
        faces = _common_faces(surface, first, last)
        fits = np.flatnonzero(faces >= 0)
        starts, ends = (_weights_in(surface, points[fits], faces[fits]) for points in (first, last))
        found.append((faces[fits], starts, ends))
        open_chords = np.flatnonzero(faces < 0)
        if open_chords.size == 0:
            break
        first, last = first[open_chords], last[open_chords]
        crossing, crosses = _on_shared_edge(surface, first, last)
        middle = _rounded(surface, closest(surface, (positions(surface, first) + positions(surface, last)) / 2)[0])
        middle = SurfacePoints(
            np.where(crosses, crossing.faces, middle.faces),
            np.where(crosses[:, None], crossing.weights, middle.weights),
        )
        first, last = _joined(first, middle), _joined(middle, last)
    faces, starts, ends = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return faces, starts, ends


def _on_shared_edge(surface: Surface, first: SurfacePoints, last: SurfacePoints) -> tuple[SurfacePoints, BoolArray]:
    """Return where straight lines cross the edges between neighbouring triangles, unfolded, and which lines do.

    Args:
        surface: m faces.
        first: (k,) where each line starts.
        last: (k,) where it ends.

    Returns:
        (k,) points on the edges; (k,) whether the triangles share an edge that the line crosses between its ends.
        Elsewhere the point has no meaning.
    """
    corners, others = surface.faces[first.faces], surface.faces[last.faces]
    same = corners[:, :, None] == others[:, None, :]
    neighbours = np.count_nonzero(same, axis=(1, 2)) == 2
    opposite, beyond = np.argmin(same.any(axis=2), axis=1), np.argmin(same.any(axis=1), axis=1)
    row: IntArray = np.arange(int(opposite.size))
    start, end = (opposite + 1) % 3, (opposite + 2) % 3
    ends = surface.vertices[corners[row, start]], surface.vertices[corners[row, end]]
    place, height = _along_and_away(*ends, positions(surface, first))
    far_place, far_height = _along_and_away(*ends, positions(surface, last))
    total = height + far_height
    share = place + np.divide(height, total, out=np.zeros_like(total), where=total > 0.0) * (far_place - place)
    inside = first.weights[row, opposite] > 0.0
    crosses = neighbours & inside & (last.weights[row, beyond] > 0.0) & (share >= 0.0) & (share <= 1.0)
    weights = np.zeros(first.weights.shape)
    kept = np.clip(share, 0.0, 1.0)
    weights[row, start], weights[row, end] = 1.0 - kept, kept
    return SurfacePoints(first.faces, weights), crosses


def _along_and_away(start: FloatArray, end: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how far places lie along segments, as a share of them, and how far from their lines [mm]."""
    along, slant = end - start, places - start
    share = np.einsum("kx,kx->k", slant, along) / np.einsum("kx,kx->k", along, along)
    return share, np.linalg.norm(slant - share[:, None] * along, axis=1)


def _joined(first: SurfacePoints, last: SurfacePoints) -> SurfacePoints:
    return SurfacePoints(np.concatenate([first.faces, last.faces]), np.concatenate([first.weights, last.weights]))


def _common_faces(surface: Surface, first: SurfacePoints, last: SurfacePoints) -> IntArray:
    """Return a triangle that holds both points of each pair, -1 where none does."""
    first_corners, last_corners = surface.faces[first.faces], surface.faces[last.faces]
    first_used, last_used = first.weights > 0.0, last.weights > 0.0
    same = first_corners[:, :, None] == last_corners[:, None, :]
    holds_last = (same.any(axis=1) | ~last_used).all(axis=1)
    holds_first = (same.any(axis=2) | ~first_used).all(axis=1)
    result = np.where(holds_last, first.faces, np.where(holds_first, last.faces, -1))
    unsettled = np.flatnonzero(result < 0)
    if unsettled.size == 0:
        return result
    needed = [
        frozenset([*a[use_a].tolist(), *b[use_b].tolist()])
        for a, use_a, b, use_b in zip(
            first_corners[unsettled],
            first_used[unsettled],
            last_corners[unsettled],
            last_used[unsettled],
            strict=True,
        )
    ]
    # Neither point's own triangle holds the other: an edge between two vertices, or a third triangle.
    face_of = _faces_by_corners(surface, frozenset[int]().union(*needed))
    result[unsettled] = [face_of.get(corners, -1) for corners in needed]
    return result


def _faces_by_corners(surface: Surface, vertices: frozenset[int]) -> dict[frozenset[int], int]:
    """Return a face for every pair and triple of corners among the faces around some vertices."""
    around = np.flatnonzero(np.isin(surface.faces, list(vertices)).any(axis=1))
    result: dict[frozenset[int], int] = {}
    for face, (a, b, c) in zip(around.tolist(), surface.faces[around].tolist(), strict=True):
        for corners in ((a, b, c), (a, b), (b, c), (c, a)):
            result.setdefault(frozenset(corners), face)
    return result


def _weights_in(surface: Surface, points: SurfacePoints, faces: IntArray) -> FloatArray:
    """Return the barycentric weights of points in other triangles that hold them."""
    same = surface.faces[faces][:, :, None] == surface.faces[points.faces][:, None, :]
    return np.einsum("kij,kj->ki", same.astype(np.float64), points.weights)


# Edges are flipped where the angles opposite to them sum to a half turn and this much more [rad]. Slivers must go; on
# good triangles every flip makes two obtuse triangles less obtuse but costs more accuracy than it brings.
FLIP_MARGIN = 0.26
# Improvements below this share of the mean side are not made: they are rounding. Of lines that arrive from two sides
# and whose lengths differ by less than the larger share, as at the middle of a symmetric part, the same one counts.
SMALLEST_IMPROVEMENT, EQUAL_ARRIVALS = 1e-9, 1e-7
# Where the slopes at both ends of an edge rise towards each other by more than this, two fronts meet on it. Less,
# and the curvature of a front passes for a ridge; more, and shallow ridges are smeared.
MEETING_SLOPES = 0.15
# Longest useful edges: as a share of the spacing, and of the mean edge of the part. A part is flat inside its faces, so
# that fronts bend no faster than over its edges; a distance that carries its gradient follows them with eight pieces.
LONGEST_SHARE = 1 / 2
LONGEST_PART_SHARE = 1 / 8
# Passes that find all distances anew after marching. One takes away what offers with unsettled directions left behind;
# after two a planar front is exact over thousands of triangles.
SETTLING_PASSES = 2


@final
class FastMarching:
    """The `fast-marching` backend: any topology, any source, any triangles.

    Args:
        surface: manifold and consistently wound, its triangles a few times smaller than the wanted spacing.

    Raises:
        MeshError: the surface is not so, or has an edge without length.
    """

    title: ClassVar[str] = "fast marching on the mesh"
    summary: ClassVar[str] = "Sweeps a front over the surface, with the direction of the shortest paths."
    accuracy: ClassVar[Accuracy] = Accuracy.NEARLY_EXACT

    def __init__(self, surface: Surface) -> None:
        self._surface = surface
        self._mesh = half_edge_mesh(delaunay(intrinsic_triangulation(surface), margin=FLIP_MARGIN))
        border = np.flatnonzero(self._mesh.twins < 0)
        self._rim = np.column_stack([self._mesh.corners[border], self._mesh.corners[next_halves(border)]])

    @staticmethod
    def edge_length(part: Surface, *, spacing: float) -> float:
        """Return how long edges may be for even contours at a spacing [mm].

        On a part much coarser than the spacing they may be twice as long as for a distance that is linear in each
        triangle.
        """
        longest = min(LONGEST_SHARE * spacing, LONGEST_PART_SHARE * float(edge_lengths(part).mean()))
        return max(linear_edge_length(spacing=spacing), longest)

    def distance(self, source: Source) -> ScalarField:
        """Return the geodesic distance from the source at the vertices of the surface [mm].

        Raises:
            FieldError: the source touches every vertex, or does not reach a part of the surface.
            InputError: the source does not lie on this surface.
        """
        front = self._march(source)[1]
        return ScalarField(front.distances)

    def contours(self, source: Source, *, spacing: float) -> Contours:
        """Return the level curves at (k + 1/2) * spacing from the source [mm].

        Raises:
            FieldError: as `distance`, or the surface is so small that not even the first level lies on it.
            UsageError: the spacing is not positive.
        """
        mesh, front = self._march(source)
        field = ScalarField(front.distances)
        levels = level_distances(field, spacing=spacing)

        def edge_shares(edges: IntArray, values: FloatArray) -> FloatArray:
            return crossing_shares(mesh, front, edges, self._lengths(edges), values, MEETING_SLOPES)

        def edge_slopes(edges: IntArray, shares: FloatArray) -> tuple[FloatArray, FloatArray]:
            return slopes_at(mesh, front, edges, self._lengths(edges), shares, MEETING_SLOPES)

        curves, curve_levels = isolines(self._surface, field, levels=levels, edge_shares=edge_shares)
        curves = with_ridge_corners(self._surface, curves, edge_slopes=edge_slopes)
        return Contours(curves, curve_levels, spacing, field)

    def _lengths(self, edges: IntArray) -> FloatArray:
        ends = self._surface.vertices[edges]
        return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)

    def _march(self, source: Source) -> tuple[MarchingMesh, Front]:
        pieces = source_pieces(self._surface, source, rim=self._rim)
        mesh = self._mesh
        if pieces.faces.size:
            whole = intrinsic_triangulation(self._surface)
            mesh = half_edge_mesh(flipped_apart_from(whole, np.unique(pieces.faces), margin=FLIP_MARGIN))
        front = source_front(mesh, pieces)
        side = float(mesh.lengths.mean())
        march(mesh, front, SMALLEST_IMPROVEMENT * side, MEETING_SLOPES)
        for _ in range(SETTLING_PASSES):
            order = np.argsort(np.rint(front.distances / (EQUAL_ARRIVALS * side)), kind="stable")
            settle(mesh, front, order, EQUAL_ARRIVALS * side, MEETING_SLOPES)
        self._require_reached(front)
        return mesh, front

    def _require_reached(self, front: Front) -> None:
        if not front.distances.max() > 0.0:
            raise FieldError(
                "every vertex of the surface belongs to the source, so there is no distance to compute: choose a "
                "smaller spacing."
            )
        missed = np.flatnonzero(np.isinf(front.distances))
        if missed.size:
            place = in_words(self._surface.vertices[missed[0]])
            raise FieldError(
                f"{missed.size} of {front.distances.size} vertices of {self._surface.name} have no connection to the "
                f"source, the first at {place}. Put a source on every part of the surface, or remove what is not "
                "wanted.",
                vertex=int(missed[0]),
            )


def half_edge_mesh(triangulation: IntrinsicTriangulation) -> MarchingMesh:
    """Return a triangulation as the kernels read it."""
    corners, twins = triangulation.corners.ravel(), triangulation.twins.ravel()
    lengths = triangulation.lengths.ravel()
    return MarchingMesh(corners, lengths, twins, *measure_corners(corners, lengths, twins, triangulation.vertex_count))


def flipped_apart_from(
    triangulation: IntrinsicTriangulation, faces: IntArray, *, margin: float
) -> IntrinsicTriangulation:
    """Flip edges as `delaunay`, but leave some triangles as they are, under their numbers.

    They are cut out, which makes their sides border, and sewn in again.

    Args:
        triangulation: m triangles of a mesh, as it is: no two edges between the same two vertices.
        faces: (k,) triangles to keep.
        margin: as for `delaunay` [rad].
    """
    cut = triangulation.twins.copy()
    kept = (3 * faces[:, None] + np.arange(3)).ravel()
    kept = kept[cut.ravel()[kept] >= 0]
    cut.ravel()[cut.ravel()[kept]] = -1
    cut.ravel()[kept] = -1
    opened = IntrinsicTriangulation(triangulation.corners, triangulation.lengths, cut, triangulation.vertex_count)
    flipped = delaunay(opened, margin=margin)
    starts, ends = flipped.corners.ravel(), np.roll(flipped.corners, -1, axis=1).ravel()
    sewn = flipped.twins.copy()
    border = np.flatnonzero(sewn.ravel() < 0)
    keys = starts[border] * triangulation.vertex_count + ends[border]
    order = np.argsort(keys)
    # The seam of a half-edge from a to b is the border half-edge from b to a, which flips may have renamed.
    wanted = ends[kept] * triangulation.vertex_count + starts[kept]
    seam = border[order[np.searchsorted(keys[order], wanted)]]
    sewn.ravel()[kept], sewn.ravel()[seam] = seam, kept
    return IntrinsicTriangulation(flipped.corners, flipped.lengths, sewn, triangulation.vertex_count)


def source_front(mesh: MarchingMesh, pieces: SourcePieces) -> Front:
    """Return the front as it leaves the source: what is seen from it directly is settled."""
    count = mesh.first.size
    front = Front(
        distances=np.full(count, np.inf),
        origins=np.zeros(count),
        marks=np.zeros(count, dtype=np.int64),
        heap=np.empty(count, dtype=np.int64),
        places=np.full(count, -1),
        waiting=np.array([pieces.vertices.size]),
    )
    front.distances[pieces.vertices] = 0.0
    front.marks[pieces.vertices] = SEED_VERTEX
    front.heap[: pieces.vertices.size] = pieces.vertices
    front.places[pieces.vertices] = np.arange(pieces.vertices.size)
    ends = mesh.corners[next_halves(mesh.first[pieces.border])]
    front.marks[pieces.border] |= SEED_FIRST_EDGE
    front.marks[ends] |= SEED_LAST_EDGE
    both = SEED_FIRST_EDGE | SEED_LAST_EDGE
    as_points = pieces.vertices[front.marks[pieces.vertices] & both != both]
    see_from_vertices(mesh, front, as_points)
    if as_points.size or pieces.faces.size:
        # What is seen from a point is nearer still where it lies square to the border beside it.
        see_from_border(mesh, front, mesh.first[pieces.border])
    see_from_pieces(mesh, front, pieces.faces, pieces.starts, pieces.ends)
    return front
