"""Geodesic distance by a front that carries its direction, marched over an intrinsic triangulation.

Fast marching [Kimmel1998] sweeps a surface from the seed outwards, each vertex once, and finds its distance through
the triangles around it. Here every vertex also knows where its shortest line comes from, which is the gradient of the
distance: along an edge the distance is then a cubic instead of a straight line, and curved fronts keep their shape. On
triangles whose worst edges are flipped first the result lies within a few thousandths of an edge length of the exact
distance on the polyhedron.
"""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np

from geoprint.backends.interface import Accuracy
from geoprint.backends.intrinsic import IntrinsicTriangulation, delaunay, intrinsic_triangulation
from geoprint.backends.isolines import isolines
from geoprint.backends.levels import level_distances, linear_edge_length
from geoprint.backends.marching.edge_crossings import crossing_shares, slopes_at
from geoprint.backends.marching.front import (
    SEED_FIRST_EDGE,
    SEED_LAST_EDGE,
    SEED_VERTEX,
    Front,
    MarchingMesh,
    measure_corners,
)
from geoprint.backends.marching.kernels import march, settle
from geoprint.backends.marching.ridge_corners import with_ridge_corners
from geoprint.backends.marching.seed_pieces import SeedPieces, seed_pieces
from geoprint.backends.marching.seed_windows import see_from_border, see_from_pieces, see_from_vertices
from geoprint.errors import FieldError
from geoprint.model import Contours, FloatArray, IntArray, ScalarField, Seed, Surface
from geoprint.surfaces import edge_lengths, in_words
from geoprint.surfaces.halfedges import next_halves

# Edges are flipped where the angles opposite to them sum to a half turn and this much more [rad]. Slivers must go; on
# good triangles every flip makes two obtuse triangles less obtuse but costs more accuracy than it brings.
FLIP_MARGIN = 0.26
# Improvements below this share of the mean side are not made: they are rounding.
SMALLEST_IMPROVEMENT = 1e-9
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
    """The `fast-marching` backend: any topology, any seed, any triangles.

    Args:
        surface: manifold and consistently wound, its triangles a few times smaller than the wanted spacing.

    Raises:
        MeshError: the surface is not so, or has an edge without length.
    """

    title: ClassVar[str] = "fast marching on the mesh"
    summary: ClassVar[str] = "Sweeps a front over the surface that carries the direction of the shortest ways."
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

    def distance(self, seed: Seed) -> ScalarField:
        """Return the geodesic distance from the seed at the vertices of the surface [mm].

        Raises:
            FieldError: the seed touches every vertex, or does not reach a part of the surface.
            InputError: the seed does not lie on this surface.
        """
        front = self._march(seed)[1]
        return ScalarField(front.distances)

    def contours(self, seed: Seed, *, spacing: float) -> Contours:
        """Return the level curves at (k + 1/2) * spacing from the seed [mm].

        Raises:
            FieldError: as `distance`, or the surface is so small that not even the first level lies on it.
            UsageError: the spacing is not positive.
        """
        mesh, front = self._march(seed)
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

    def _march(self, seed: Seed) -> tuple[MarchingMesh, Front]:
        pieces = seed_pieces(self._surface, seed, rim=self._rim)
        mesh = self._mesh
        if pieces.faces.size:
            whole = intrinsic_triangulation(self._surface)
            mesh = half_edge_mesh(flipped_apart_from(whole, np.unique(pieces.faces), margin=FLIP_MARGIN))
        front = seeded_front(mesh, pieces)
        march(mesh, front, SMALLEST_IMPROVEMENT * float(mesh.lengths.mean()), MEETING_SLOPES)
        for _ in range(SETTLING_PASSES):
            settle(mesh, front, np.argsort(front.distances), MEETING_SLOPES)
        self._require_reached(front)
        return mesh, front

    def _require_reached(self, front: Front) -> None:
        if not front.distances.max() > 0.0:
            raise FieldError(
                "every vertex of the surface belongs to the seed, so there is no distance to compute: refine the mesh "
                "or choose a smaller spacing."
            )
        missed = np.flatnonzero(np.isinf(front.distances))
        if missed.size:
            place = in_words(self._surface.vertices[missed[0]])
            raise FieldError(
                f"{missed.size} of {front.distances.size} vertices of {self._surface.name} have no connection to the "
                f"seed, the first at {place}: give a seed on every part "
                "of the surface, or remove what is not wanted.",
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


def seeded_front(mesh: MarchingMesh, pieces: SeedPieces) -> Front:
    """Return the front as it leaves the seed: what is seen from it directly is settled."""
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
