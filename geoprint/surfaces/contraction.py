"""Contracting edges that are much shorter than the others: crumbs that marching cubes and cuts leave behind."""

from __future__ import annotations

import numpy as np

from geoprint.model import BoolArray, IntArray, Surface
from geoprint.surfaces.operators import edge_lengths
from geoprint.surfaces.topology import boundary_half_edges, edges, half_edges, used_vertices

# Edges below this share of the median are contracted: twice the distance at which rim vertices count as one, so that
# preparing joins none that are meant to be apart.
SHORT_SHARE = 0.1


def contracted(surface: Surface) -> Surface:
    """Contract edges shorter than SHORT_SHARE of the median edge, wherever the surface stays a manifold.

    An edge goes, with the faces beside it, when its ends have no common neighbour but the corners of these faces (the
    link condition [Dey1999]), and when it does not run across the surface from border to border. The end on the
    border stays where it is, else the one of the smaller index. The shortest edges go first.

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
    faces = _contract(surface.faces, pairs[short[np.argsort(lengths[short], kind="stable")]], on_rim)
    used = used_vertices(faces)
    names = np.zeros(len(surface.vertices), dtype=np.int64)
    names[used] = np.arange(used.size)
    return Surface(vertices=surface.vertices[used], faces=names[faces], name=surface.name)


def _contract(faces: IntArray, pairs: IntArray, on_rim: BoolArray) -> IntArray:
    """Return the faces left after contracting pairs of vertices in turn, where that is allowed."""
    corners = faces.tolist()
    touched = set(pairs.ravel().tolist())
    around: dict[int, set[int]] = {vertex: set() for vertex in touched}
    for face in np.flatnonzero(np.isin(faces, pairs).any(axis=1)).tolist():
        for vertex in corners[face]:
            if vertex in touched:
                around[vertex].add(face)
    merged: dict[int, int] = {}
    gone: set[int] = set()
    for first, second in pairs.tolist():
        kept, lost = _current(merged, first), _current(merged, second)
        if on_rim[lost] and not on_rim[kept]:
            kept, lost = lost, kept
        beside = around[kept] & around[lost]
        if kept == lost or not _may_go(corners, around, kept, lost, on_rim):
            continue
        for face in around[lost] - beside:
            corners[face] = [kept if vertex == lost else vertex for vertex in corners[face]]
        for face in beside:
            for vertex in set(corners[face]) & around.keys():
                around[vertex].discard(face)
        around[kept] |= around[lost] - beside
        gone |= beside
        merged[lost] = kept
    left = [face for index, face in enumerate(corners) if index not in gone]
    return np.array(left, dtype=np.int64)


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


def _current(merged: dict[int, int], vertex: int) -> int:
    """Return what a vertex has become."""
    while vertex in merged:
        vertex = merged[vertex]
    return vertex
