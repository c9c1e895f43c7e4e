"""Contracting edges that are much shorter than the others, and trimming: crumbs that cuts and marching cubes leave."""

from __future__ import annotations

import numpy as np

from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.surfaces.clipping import part_of
from geoprint.surfaces.operators import doubled_area_vectors, edge_lengths, face_areas
from geoprint.surfaces.topology import boundary_half_edges, edges, half_edges, used_vertices

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
    over. The end on the border stays where it is, else the one of the smaller index. The shortest edges go first.

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
        flat = 2.0 * face_areas(surface) < FLAT_SHARE * lengths.max(axis=1) ** 2
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


def _current(merged: dict[int, int], vertex: int) -> int:
    """Return what a vertex has become."""
    while vertex in merged:
        vertex = merged[vertex]
    return vertex
