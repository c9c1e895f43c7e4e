"""Other triangles over the same surface: remeshing, decimation, smoothing, contraction of short edges."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from geoprint.errors import InputError, ResourceError, how_many
from geoprint.geometry.clipping import FLAT_ENOUGH, part_of
from geoprint.geometry.creases import INSIDE, ON_CREASE, ON_RIM, creases, edges_alone
from geoprint.geometry.native import missing
from geoprint.geometry.operators import (
    cotangent_laplacian,
    diagonal_matrix,
    doubled_area_vectors,
    edge_lengths,
    face_areas,
    face_normals,
    lumped_mass,
    sum_around_vertices,
    vertex_normals,
)
from geoprint.geometry.points import closest, positions
from geoprint.geometry.refine import FACE_LIMIT, FACES_PER_SQUARE
from geoprint.geometry.remeshing_kernels import LEAST_COSINE, collapse, flip, split
from geoprint.geometry.topology import boundary_half_edges, boundary_loops, edges, half_edges, twins, used_vertices
from geoprint.model import BoolArray, FloatArray, IntArray, Surface

# Contracting edges that are much shorter than the others, and trimming: crumbs that cuts and marching cubes leave.


# Edges below this share of the median are contracted: twice the distance at which rim vertices count as one, so that
# preparing joins none that are meant to be apart.
SHORT_SHARE = 0.1
# Faces between two border edges that are lower than this share of the third side (angles of about a degree) go: the
# border moves by less than the height.
FLAT_SHARE = 0.02


def contracted(surface: Surface) -> Surface:
    """Contract edges shorter than SHORT_SHARE of the median edge, wherever the surface stays a manifold.

    An edge goes, with the faces beside it, when its ends have no common neighbour but the corners of these faces (the
    link condition [Dey1999]), when it does not run across the surface from border to border, and when no face turns
    over or gets a corner farther than FLAT_ENOUGH off its plane. The end on the border stays where it is, else the one
    of the smaller index. The shortest edges go first.

    Args:
        surface: manifold.

    Returns:
        The surface with fewer vertices and faces, the others as they were.
    """
    pairs, lengths = edges(surface.faces), edge_lengths(surface)
    short = np.flatnonzero(lengths < SHORT_SHARE * np.median(lengths))
    if short.size == 0:
        return surface
    on_rim = np.zeros(len(surface.vertices), dtype=np.bool_)
    on_rim[half_edges(surface.faces)[boundary_half_edges(surface.faces)]] = True
    faces = _contract(surface, pairs[short[np.argsort(lengths[short], kind="stable")]], on_rim)
    used = used_vertices(faces)
    names = np.zeros(len(surface.vertices), dtype=np.int64)
    names[used] = np.arange(used.size)
    return Surface(vertices=surface.vertices[used], faces=names[faces], name=surface.name)


def trimmed(surface: Surface) -> Surface:
    """Drop flat faces that hang on the surface by their longest side alone, as cuts and contractions leave on the rim.

    Args:
        surface: manifold.

    Returns:
        The surface with fewer faces and the vertices that they use; the others as they were.
    """
    while True:
        rims = boundary_half_edges(surface.faces)
        corners = surface.vertices[surface.faces]
        lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        flat = _is_flat(surface.vertices, surface.faces)
        bare = np.zeros(lengths.shape, dtype=np.bool_)
        bare.ravel()[rims] = True
        longest_held = ~np.take_along_axis(bare, np.argmax(lengths, axis=1)[:, None], axis=1)[:, 0]
        hanging = flat & longest_held & (bare.sum(axis=1) == 2)
        if not hanging.any():
            return surface
        surface = part_of(surface, ~hanging)


def _contract(surface: Surface, pairs: IntArray, on_rim: BoolArray) -> IntArray:
    """Return the faces left after contracting pairs of vertices in turn, where that is allowed."""
    faces, corners = surface.faces, surface.faces.tolist()
    around = _faces_around(faces, pairs)
    merged: dict[int, int] = {}
    gone: set[int] = set()
    for first, second in pairs.tolist():
        kept, lost = _current(merged, first), _current(merged, second)
        if on_rim[lost] and not on_rim[kept]:
            kept, lost = lost, kept
        beside = around[kept] & around[lost]
        if kept == lost or not _may_go(corners, around, kept, lost, on_rim):
            continue
        moved = sorted(around[lost] - beside)
        after = [[kept if vertex == lost else vertex for vertex in corners[face]] for face in moved]
        # Compared with the face as given: several small turns may add up.
        if moved and _turns_over(surface.vertices, faces[moved], np.array(after)):
            continue
        if moved and _leaves(surface.vertices, faces[moved], surface.vertices[kept]):
            continue
        for face, renamed in zip(moved, after, strict=True):
            corners[face] = renamed
        for face in beside:
            for vertex in set(corners[face]) & around.keys():
                around[vertex].discard(face)
        around[kept] |= around[lost] - beside
        gone |= beside
        merged[lost] = kept
    left = [face for index, face in enumerate(corners) if index not in gone]
    return np.array(left, dtype=np.int64)


def _faces_around(faces: IntArray, pairs: IntArray) -> dict[int, set[int]]:
    """Return the faces around each of the vertices that are in pairs."""
    around: dict[int, set[int]] = {vertex: set() for vertex in pairs.ravel().tolist()}
    rows, columns = np.nonzero(np.isin(faces, pairs))
    for face, vertex in zip(rows.tolist(), faces[rows, columns].tolist(), strict=True):
        around[vertex].add(face)
    return around


def _may_go(corners: list[list[int]], around: dict[int, set[int]], kept: int, lost: int, on_rim: BoolArray) -> bool:
    """Return whether the edge between two vertices is still there and its contraction keeps a manifold."""
    beside = around[kept] & around[lost]
    if not beside or (on_rim[kept] and on_rim[lost] and len(beside) == 2):
        return False
    near_kept = {vertex for face in around[kept] for vertex in corners[face]} - {kept, lost}
    near_lost = {vertex for face in around[lost] for vertex in corners[face]} - {kept, lost}
    opposite = {vertex for face in beside for vertex in corners[face]} - {kept, lost}
    # A triangle or a tetrahedron that stands alone must not vanish.
    return near_kept & near_lost == opposite and len(near_kept | near_lost) > len(opposite)


def _turns_over(vertices: FloatArray, before: IntArray, after: IntArray) -> bool:
    """Return whether one of (k, 3) faces would point to the other side, or nowhere, with other corners."""
    old, new = (doubled_area_vectors(vertices, faces) for faces in (before, after))
    return bool((np.einsum("kx,kx->k", old, new) <= 0.0).any())


def _is_flat(vertices: FloatArray, faces: IntArray) -> BoolArray:
    """Return which of (k, 3) faces are so low over their longest side that they have no shape of their own."""
    corners = vertices[faces]
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    return np.linalg.norm(doubled_area_vectors(vertices, faces), axis=1) < FLAT_SHARE * lengths.max(axis=1) ** 2


def _leaves(vertices: FloatArray, faces: IntArray, corner: FloatArray) -> bool:
    """Return whether a (3,) new corner of some of (k, 3) faces is farther than FLAT_ENOUGH off their plane."""
    normals = doubled_area_vectors(vertices, faces)
    lifts = np.abs(np.einsum("kx,kx->k", normals, corner - vertices[faces[:, 0]]))
    return bool((lifts > FLAT_ENOUGH * np.linalg.norm(normals, axis=1)).any())


def _current(merged: dict[int, int], vertex: int) -> int:
    """Return what a vertex has become."""
    while vertex in merged:
        vertex = merged[vertex]
    return vertex


# Remeshing: another mesh of the same surface, with triangles as even as they come [Botsch2004].
#
# Long edges are halved, short ones collapsed, edges flipped until they are Delaunay, and vertices moved to the
# middle of their neighbourhood along the surface and back onto the surface as it was; all of it several times. Rim
# and creases are curves that keep their place: their vertices stay on them, and corners where they are.
#
# Of the free libraries gpytoolbox alone does this; it keeps every vertex of a rim, and so the thin triangles there.


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
    sides, kinds = creases(surface, shortest=edge_length)
    mesh = _Mesh(
        surface.vertices.copy(),
        kinds,
        surface.faces.ravel().copy(),
        twins(surface.faces),
        sides,
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


# Fewer triangles: those are taken away first whose loss changes the surface least [Garland1997].


# How fast the error that is accepted grows: the hearts that were tried stay manifold with this and deviate least.
AGGRESSIVENESS = 6.0
# Rounds after which the error would be larger than any part.
MOST_ROUNDS = 200
# The number of faces is met but for this share.
COUNT_TOLERANCE = 0.02


def decimate(surface: Surface, *, faces: int) -> Surface:
    """Return a surface with fewer triangles, small where it bends and large where it is flat.

    Rims keep all their vertices. The result nearly always is a manifold, but only `prepare` knows.

    Args:
        surface: manifold.
        faces: wanted number, fewer than there are.

    Returns:
        The surface with that many faces, but for COUNT_TOLERANCE.

    Raises:
        InputError: it has no more faces than that, or cannot be brought down to so few.
        UsageError: pyfqmr is not installed.
    """
    if not 0 < faces < len(surface.faces):
        raise InputError(
            f"{surface.name} has {how_many(len(surface.faces), 'face')}, so it cannot be decimated to {faces}: ask "
            "for 1 to that number, or give an edge length.",
            faces=len(surface.faces),
        )
    try:
        from pyfqmr import Simplify
    except ImportError as error:
        raise missing("pyfqmr", extra="scan", work="decimating") from error
    # The error that is accepted is a number without unit: a mean edge of 1 makes it mean the same for every part.
    scale = float(edge_lengths(surface).mean())
    work = Simplify()
    work.setMesh(surface.vertices / scale, surface.faces.astype(np.int32))
    work.simplify_mesh(
        target_count=faces,
        aggressiveness=AGGRESSIVENESS,
        max_iterations=MOST_ROUNDS,
        preserve_border=True,
        verbose=False,
    )
    vertices, found, _ = work.getMesh()
    if abs(len(found) / faces - 1.0) > COUNT_TOLERANCE:
        raise InputError(
            f"{surface.name} can be decimated to {how_many(len(found), 'face')} at least, asked for {faces}, because "
            "its rims keep their vertices. Ask for more faces, or give an edge length.",
            faces=len(found),
        )
    return Surface(vertices=vertices * scale, faces=found.astype(np.int64), name=surface.name)


# Taking noise off a surface: what is smaller than a wavelength goes, what is larger stays.
#
# The positions x that minimise |x - x0|^2 + (w / 2 pi)^4 |Laplacian x|^2 are those of a Butterworth filter: a ripple
# of wavelength w keeps half of its height, one of w / 2 a seventeenth, one of 4 w all but 0.4 %. That is implicit
# fairing with the squared Laplacian [Desbrun1999], which leaves the curvature of the part in place where the
# Laplacian alone would shrink it.


# Ripples to smooth away where voxels left terraces, in heights of their steps: less leaves them, more takes away walls
# that are two voxels thick. Nothing then moves by more than this share of a step.
TERRACE_WAVELENGTH = 4.0
TERRACE_SHARE = 0.5


def smooth(surface: Surface, *, wavelength: float) -> Surface:
    """Return a surface without ripples that are shorter than a wavelength.

    Rims are smoothed along themselves in the same manner, which rounds their corners, and the surface then up to them.
    Creases that are longer than the wavelength stay where they are.

    Args:
        surface: manifold, consistently wound, without faces that have no area.
        wavelength: of the ripple that keeps half of its height [mm], above 0.

    Returns:
        The surface with the same faces and other vertices.

    Raises:
        InputError: the wavelength is not a positive, finite number.
        MeshError: the surface is not manifold, or a face has no area.
    """
    if not (wavelength > 0 and math.isfinite(wavelength)):
        raise InputError(f"wavelength must be a positive number of mm, found {wavelength}.", wavelength=wavelength)
    sharp = creases(surface, shortest=wavelength)[0] & (twins(surface.faces) >= 0)
    held = np.zeros(len(surface.vertices), dtype=np.bool_)
    held[half_edges(surface.faces)[sharp]] = True
    vertices = surface.vertices.copy()
    for loop in boundary_loops(surface):
        vertices[loop] = _smooth_loop(vertices[loop], held[loop], wavelength=wavelength)
        held[loop] = True
    vertices = _filtered(vertices, ~held, cotangent_laplacian(surface), lumped_mass(surface), wavelength=wavelength)
    return Surface(vertices=vertices, faces=surface.faces, name=surface.name)


def _smooth_loop(points: FloatArray, held: BoolArray, *, wavelength: float) -> FloatArray:
    """Return (l, 3) points of a closed curve without its ripples, some of them held."""
    count = len(points)
    here, ahead = np.arange(count), (np.arange(count) + 1) % count
    lengths = np.linalg.norm(points[ahead] - points, axis=1)
    inverse = 1.0 / np.maximum(lengths, np.finfo(np.float64).tiny)
    rows, columns = np.concatenate([here, ahead, here, ahead]), np.concatenate([here, ahead, ahead, here])
    values = np.concatenate([inverse, inverse, -inverse, -inverse])
    stiffness = csc_array((values, (rows, columns)), shape=(count, count))
    return _filtered(points, ~held, stiffness, (lengths + np.roll(lengths, 1)) / 2, wavelength=wavelength)


def _filtered(
    points: FloatArray, free: BoolArray, stiffness: csc_array[np.float64], masses: FloatArray, *, wavelength: float
) -> FloatArray:
    """Return points without ripples; those that are not free are held, and their own Laplacian does not count."""
    if not free.any():
        return points
    rows = stiffness[free]
    weights = (wavelength / (2.0 * math.pi)) ** 4 / masses[free]
    system = (diagonal_matrix(masses) + rows.T @ diagonal_matrix(weights) @ rows).tocsr()[free]
    right = masses[free, None] * points[free] - system[:, ~free] @ points[~free]
    result = points.copy()
    # Symmetric and positive definite: no pivoting, which would destroy the order that keeps the factor sparse.
    factor = splu(
        system[:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    result[free] = factor.solve(right)
    return result
