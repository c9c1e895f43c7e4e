"""Drawing points and lines into the triangles of a surface, so that points become vertices and lines edges."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np

from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.surfaces.clipping import faces_within
from geoprint.surfaces.points import closest_in_triangles

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
