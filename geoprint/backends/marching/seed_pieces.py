"""Where a seed runs: along border edges, through vertices and inside triangles."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.model import BoolArray, FloatArray, IntArray, Seed, Surface, SurfacePoints, frozen
from geoprint.surfaces import closest, positions

# Barycentric weights below this are rounding: the point lies on the opposite side, or at the corner that is left.
WEIGHT_ROUNDING = 1e-9
# A chord that leaves its triangle is halved this often; what is then still across an edge is left open, and the
# distance, which the open ends are part of, hardly notices.
HALVINGS = 14


@final
@frozen
class SeedPieces:
    """A seed cut into what one vertex, one border edge or one triangle holds.

    Attributes:
        vertices: (v,) vertices that the seed goes through, ascending; the ends of border edges are among them.
        border: (b,) start vertices of the border half-edges that the seed follows, ascending.
        faces: (k,) triangle of each straight piece inside a triangle or along a side that is not border.
        starts: (k, 3) barycentric weights of the piece's start.
        ends: (k, 3) of its end; the same as its start for a point.
    """

    vertices: IntArray
    border: IntArray
    faces: IntArray
    starts: FloatArray
    ends: FloatArray


def seed_pieces(surface: Surface, seed: Seed, *, rim: IntArray) -> SeedPieces:
    """Cut a seed into pieces.

    Two neighbouring points of a curve with no triangle in common are joined along the surface below their chord.

    Args:
        surface: m faces.
        seed: curves and points on it.
        rim: (b, 2) start and end vertex of the border half-edges.

    Raises:
        InputError: a point names a face that the surface does not have.
    """
    points = _rounded(surface, seed.curves.points)
    is_end = np.zeros(points.faces.size, dtype=np.bool_)
    is_end[seed.curves.offsets[1:] - 1] = True
    first = np.flatnonzero(~is_end)
    at_vertex, vertex = _at_vertices(surface, points)
    border = _border_edges(rim, vertex[first], vertex[first + 1])
    # A chord from a vertex to itself is a point.
    inner = first[(border < 0) & ~((vertex[first] >= 0) & (vertex[first] == vertex[first + 1]))]
    faces, starts, ends = _inside(surface, _picked(points, inner), _picked(points, inner + 1))
    alone = ~at_vertex
    faces = np.concatenate([faces, points.faces[alone]])
    starts, ends = np.concatenate([starts, points.weights[alone]]), np.concatenate([ends, points.weights[alone]])
    return SeedPieces(np.unique(vertex[at_vertex]), np.unique(border[border >= 0]), faces, starts, ends)


def _rounded(surface: Surface, points: SurfacePoints) -> SurfacePoints:
    """Return points whose weights are 0 where they are rounding."""
    positions(surface, points)  # refuses faces that do not exist
    weights = np.where(points.weights < WEIGHT_ROUNDING, 0.0, points.weights)
    return SurfacePoints(points.faces, weights / weights.sum(axis=1, keepdims=True))


def _picked(points: SurfacePoints, index: IntArray) -> SurfacePoints:
    return SurfacePoints(points.faces[index], points.weights[index])


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
        starts, ends = (_weights_in(surface, _picked(points, fits), faces[fits]) for points in (first, last))
        found.append((faces[fits], starts, ends))
        open_chords = np.flatnonzero(faces < 0)
        if open_chords.size == 0:
            break
        first, last = _picked(first, open_chords), _picked(last, open_chords)
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
