"""T-junctions: rim vertices that lie on an edge they do not belong to, and cutting that edge there.

A program that splits a triangle but not its neighbour leaves a slit without width. The surface has no gap, only its
connectivity does; cutting the neighbour at the vertex closes it and moves nothing.
"""

from __future__ import annotations

from itertools import pairwise
from typing import cast

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import MeshError
from geoprint.model import FloatArray, IntArray, Surface
from geoprint.surfaces.places import in_words, triple
from geoprint.surfaces.topology import boundary_half_edges, half_edges, used_vertices

# A face is cut at one of its edges a round; more rounds than this are needed only where cutting makes new junctions.
MOST_ROUNDS = 10


def split_junctions(surface: Surface, *, tolerance: float) -> tuple[Surface, int]:
    """Cut each rim edge at the rim vertices that lie on it.

    Args:
        surface: with coincident rim vertices joined.
        tolerance: distance from the edge, and from its ends, that counts as on it [mm].

    Returns:
        The surface, whose cut faces are the last, and how many faces the cuts added.

    Raises:
        MeshError: cutting makes new junctions again and again; how many are left, and the first of them.
    """
    before, cuts = len(surface.faces), 0
    while True:
        sides, vertices, reached = _junctions(surface, tolerance=tolerance)
        if sides.size == 0:
            return surface, len(surface.faces) - before
        if cuts == MOST_ROUNDS:
            raise _endless(surface, np.unique(vertices))
        cuts += 1
        # One edge of a face at a time, the vertices on it in the order in which the half-edge meets them.
        first = sides == _first_side(sides)
        surface = _cut(surface, sides[first], vertices[first], reached[first])


def _endless(surface: Surface, vertices: IntArray) -> MeshError:
    """Return the refusal of a surface in which cutting edges does not come to an end."""
    place = surface.vertices[vertices[0]]
    return MeshError(
        f"{surface.name}: vertices that lie on an edge they do not belong to (T-junctions): {vertices.size}, the first "
        f"at {in_words(place)}; cutting the edges there makes new ones, so remesh the part there.",
        vertices=int(vertices.size),
        place=triple(place),
    )


def _first_side(sides: IntArray) -> IntArray:
    """Return for each of k half-edges the first among them of the same face."""
    faces = sides // 3
    first = np.full(int(faces.max()) + 1, np.iinfo(np.int64).max)
    np.minimum.at(first, faces, sides)
    return first[faces]


def _cut(surface: Surface, sides: IntArray, vertices: IntArray, reached: FloatArray) -> Surface:
    """Cut faces into fans from the corner opposite to a half-edge, at the vertices that lie on it."""
    order = np.lexsort((reached, sides))
    sides, vertices = sides[order], vertices[order]
    fans: list[tuple[int, int, int]] = []
    for side in np.unique(sides).tolist():
        a, b, c = (int(surface.faces[side // 3, (side + shift) % 3]) for shift in range(3))
        stops = [a, *vertices[sides == side].tolist(), b]
        fans += [(start, stop, c) for start, stop in pairwise(stops) if start != stop]
    kept = np.delete(surface.faces, np.unique(sides // 3), axis=0)
    faces = np.concatenate([kept, np.array(fans, dtype=np.int64).reshape(-1, 3)])
    return Surface(vertices=surface.vertices, faces=faces, name=surface.name)


def _junctions(surface: Surface, *, tolerance: float) -> tuple[IntArray, IntArray, FloatArray]:
    """Return the half-edges on which a foreign rim vertex lies, that vertex, and how far along it is [mm]."""
    sides = boundary_half_edges(surface.faces)
    if sides.size == 0:
        return sides, sides, np.empty(0)
    rim = half_edges(surface.faces)[sides]
    start, along = surface.vertices[rim[:, 0]], surface.vertices[rim[:, 1]] - surface.vertices[rim[:, 0]]
    length = np.linalg.norm(along, axis=1)
    vertices = used_vertices(rim)
    tree = KDTree(surface.vertices[vertices])
    near = cast("list[list[int]]", tree.query_ball_point(start + along / 2, length / 2 + tolerance))
    side = np.repeat(np.arange(sides.size), [len(found) for found in near])
    vertex = vertices[np.concatenate([np.asarray(found, dtype=np.int64) for found in near])]
    offset = surface.vertices[vertex] - start[side]
    reached = np.einsum("kx,kx->k", offset, along[side]) / length[side]
    aside = np.linalg.norm(offset - (reached / length[side])[:, None] * along[side], axis=1)
    on_edge = (aside <= tolerance) & (reached > tolerance) & (reached < length[side] - tolerance)
    # The third corner of the edge's own face is only the tip of a flat triangle.
    own = (surface.faces[sides[side] // 3] == vertex[:, None]).any(axis=1)
    found = on_edge & ~own
    return sides[side[found]], vertex[found], reached[found]
