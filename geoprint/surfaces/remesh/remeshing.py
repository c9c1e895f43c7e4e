"""Remeshing: another mesh of the same surface, with triangles as even as they come [Botsch2004].

Long edges are halved, short ones collapsed, edges flipped until they are Delaunay, and vertices moved to the middle of
their neighbourhood along the surface and back onto the surface as it was; all of it several times. Rim and creases
are curves that keep their place: their vertices stay on them, and corners where they are.

Of the free libraries gpytoolbox alone does this; it keeps every vertex of a rim, and so the thin triangles there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from geoprint.errors import InputError, ResourceError
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.surfaces.operators import (
    doubled_area_vectors,
    face_areas,
    face_normals,
    sum_around_vertices,
    vertex_normals,
)
from geoprint.surfaces.points import closest, positions
from geoprint.surfaces.remesh.creases import INSIDE, ON_CREASE, ON_RIM, creases, edges_alone
from geoprint.surfaces.remesh.refine import FACE_LIMIT, FACES_PER_SQUARE
from geoprint.surfaces.remesh.remeshing_kernels import LEAST_COSINE, collapse, flip, split
from geoprint.surfaces.topology import half_edges, twins, used_vertices

# Edges beyond these shares of the wanted length are halved and collapsed: both bring them nearer to it [Botsch2004].
LONGEST, SHORTEST = 4.0 / 3.0, 4.0 / 5.0
# Rounds of all steps; more change little.
ROUNDS = 10
# Passes over the edges in one round, until none is flipped.
MOST_FLIPS = 8
# Rounding of a cosine.
COSINE_ROUNDING = 1e-9


class _Mesh(NamedTuple):
    """A mesh in work; see `remeshing_kernels`.

    Attributes:
        vertices: (n, 3) positions [mm].
        kinds: (n,) as `creases` gives them.
        starts: (3 m,) vertex at which each half-edge begins.
        twins: (3 m,) its other side.
        curves: (3 m,) whether it lies on a rim or crease.
    """

    vertices: FloatArray
    kinds: IntArray
    starts: IntArray
    twins: IntArray
    curves: BoolArray


def remesh(surface: Surface, *, edge_length: float) -> Surface:
    """Return a mesh of the same surface with edges of about one length, finer or coarser.

    Edges come out between 4/5 and 4/3 of the length, but for what rims and creases demand. Topology and winding stay;
    every vertex lies on the surface given, and those of rims and creases on these.

    Args:
        surface: manifold, consistently wound, without faces that have no area.
        edge_length: wanted [mm], above 0.

    Returns:
        The other mesh.

    Raises:
        InputError: edge_length is not a positive, finite number.
        ResourceError: more than FACE_LIMIT faces would be needed.
        MeshError: the surface is not manifold, or a face has no area.
    """
    if not (edge_length > 0 and math.isfinite(edge_length)):
        raise InputError(f"edge_length must be a positive number of mm, found {edge_length}.", edge_length=edge_length)
    expected = FACES_PER_SQUARE * float(face_areas(surface).sum()) / edge_length**2
    if expected > FACE_LIMIT:
        raise ResourceError(
            f"{surface.name}: an edge length of {edge_length:g} mm needs about {expected:,.0f} faces, at most "
            f"{FACE_LIMIT:,} are made; choose a longer one.",
            faces=expected,
            limit=FACE_LIMIT,
        )
    kept = creases(surface, shortest=edge_length)
    mesh = _Mesh(
        surface.vertices.copy(),
        kept.kinds.copy(),
        surface.faces.ravel().copy(),
        twins(surface.faces),
        kept.sides.copy(),
    )
    curves = _curves(surface, mesh)
    for _ in range(ROUNDS):
        mesh = _split(mesh, longest=LONGEST * edge_length)
        mesh = _collapsed(mesh, shortest=SHORTEST * edge_length, longest=LONGEST * edge_length)
        _flip_all(mesh)
        mesh = _relaxed(mesh, surface, curves)
    _flip_all(mesh)
    return Surface(vertices=mesh.vertices, faces=mesh.starts.reshape(-1, 3), name=surface.name)


def _lengths(mesh: _Mesh) -> FloatArray:
    """Return the (3 m,) length of each half-edge."""
    ends = mesh.vertices[half_edges(mesh.starts.reshape(-1, 3))]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


def _once(mesh: _Mesh) -> BoolArray:
    """Return which half-edges stand for their edge."""
    return (mesh.twins < 0) | (np.arange(mesh.twins.size) < mesh.twins)


def _split(mesh: _Mesh, *, longest: float) -> _Mesh:
    """Halve long edges, the longest first, until there are none."""
    while True:
        lengths = _lengths(mesh)
        chosen = np.flatnonzero((lengths > longest) & _once(mesh))
        if not chosen.size:
            return mesh
        chosen = chosen[np.argsort(-lengths[chosen], kind="stable")]
        room = 6 * chosen.size
        starts = np.concatenate([mesh.starts, np.full(room, -1)])
        other = np.concatenate([mesh.twins, np.full(room, -1)])
        curves = np.concatenate([mesh.curves, np.zeros(room, dtype=np.bool_)])
        halved = split(chosen, starts, other, curves, len(mesh.vertices), len(mesh.starts) // 3)
        middles = mesh.vertices[half_edges(mesh.starts.reshape(-1, 3))[halved]].mean(axis=1)
        kinds = np.where(mesh.curves[halved], np.where(mesh.twins[halved] < 0, ON_RIM, ON_CREASE), INSIDE)
        used = starts >= 0
        mesh = _Mesh(
            np.concatenate([mesh.vertices, middles]), np.concatenate([mesh.kinds, kinds]),
            starts[used], other[used], curves[used],
        )  # fmt: skip


def _collapsed(mesh: _Mesh, *, shortest: float, longest: float) -> _Mesh:
    """Collapse short edges, the shortest first."""
    lengths = _lengths(mesh)
    chosen = np.flatnonzero((lengths < shortest) & _once(mesh))
    chosen = chosen[np.argsort(lengths[chosen], kind="stable")]
    left = collapse(chosen, mesh.starts, mesh.twins, mesh.curves, mesh.vertices, mesh.kinds, shortest, longest)
    kept = np.repeat(left, 3)
    starts = mesh.starts[kept]
    used = used_vertices(starts)
    vertex_names, side_names = np.empty(len(mesh.vertices), dtype=np.int64), np.full(kept.size, -1)
    vertex_names[used], side_names[kept] = np.arange(used.size), np.arange(starts.size)
    other = mesh.twins[kept]
    other = np.where(other < 0, -1, side_names[other])
    return _Mesh(mesh.vertices[used], mesh.kinds[used], vertex_names[starts], other, mesh.curves[kept])


def _flip_all(mesh: _Mesh) -> None:
    """Flip edges in place until none gains by it."""
    for _ in range(MOST_FLIPS):
        if flip(mesh.starts, mesh.twins, mesh.curves, mesh.vertices) == 0:
            return


def _curves(surface: Surface, mesh: _Mesh) -> tuple[tuple[int, Surface], ...]:
    """Return rim and creases, those that are there, with the kind of their vertices."""
    kinds = ((ON_RIM, mesh.twins < 0), (ON_CREASE, mesh.curves & (mesh.twins >= 0)))
    return tuple((kind, edges_alone(surface, chosen)) for kind, chosen in kinds if chosen.any())


def _relaxed(mesh: _Mesh, surface: Surface, curves: tuple[tuple[int, Surface], ...]) -> _Mesh:
    """Move vertices to the middle of their neighbourhood along the surface, and onto the surface and curves given."""
    now = Surface(vertices=mesh.vertices, faces=mesh.starts.reshape(-1, 3))
    wanted = mesh.vertices.copy()
    inside, between = mesh.kinds == INSIDE, _between_neighbours(mesh)
    normals = vertex_normals(now)
    step = _centroids(now) - mesh.vertices
    step -= np.einsum("nx,nx->n", step, normals)[:, None] * normals
    points, _ = closest(surface, (mesh.vertices + step)[inside])
    wanted[inside] = positions(surface, points)
    # Near another sheet of a thin wall the nearest point may lie on its other side.
    astray = np.einsum("nx,nx->n", face_normals(surface)[points.faces], normals[inside]) <= 0.0
    wanted[np.flatnonzero(inside)[astray]] = mesh.vertices[inside][astray]
    for kind, curve in curves:
        along = mesh.kinds == kind
        wanted[along] = positions(curve, closest(curve, between[along])[0])
    return mesh._replace(vertices=_without_turns(now, wanted))


def _centroids(surface: Surface) -> FloatArray:
    """Return the (n, 3) area-weighted mean of the centroids of the faces around each vertex."""
    areas = face_areas(surface)
    weighted = areas[:, None] * surface.vertices[surface.faces].mean(axis=1)
    sums = np.column_stack([sum_around_vertices(surface, weighted[:, axis]) for axis in range(3)])
    return sums / sum_around_vertices(surface, areas)[:, None]


def _between_neighbours(mesh: _Mesh) -> FloatArray:
    """Return (n, 3) the mean of the two neighbours of each vertex along its curve; of others, nonsense."""
    pairs = half_edges(mesh.starts.reshape(-1, 3))[mesh.curves & _once(mesh)]
    total = np.zeros_like(mesh.vertices)
    np.add.at(total, pairs[:, 0], mesh.vertices[pairs[:, 1]])
    np.add.at(total, pairs[:, 1], mesh.vertices[pairs[:, 0]])
    return total / 2.0


def _without_turns(before: Surface, wanted: FloatArray) -> FloatArray:
    """Return new positions of the vertices, the old ones wherever a face would turn far otherwise."""
    vertices, old = wanted.copy(), doubled_area_vectors(before.vertices, before.faces)
    lengths = np.linalg.norm(old, axis=1)
    while True:
        new = doubled_area_vectors(vertices, before.faces)
        cosines = np.einsum("mx,mx->m", old, new)
        # A face back where it was passes for certain.
        turned = cosines < (LEAST_COSINE - COSINE_ROUNDING) * lengths * np.linalg.norm(new, axis=1)
        turned |= (cosines <= 0.0) & (lengths > 0.0)
        moved = turned[:, None] & (vertices[before.faces] != before.vertices[before.faces]).any(axis=2)
        if not moved.any():
            return vertices
        back = before.faces[moved]
        vertices[back] = before.vertices[back]
