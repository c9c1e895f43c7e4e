"""Smooth vertex normals (Phong): interpolated over the facets of a part, up to its creases."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.geometry.creases import creases, edges_alone, juts_out
from geoprint.geometry.halfedges import next_halves
from geoprint.geometry.operators import corner_cotangents, face_areas, face_normals, mean_directions, vertex_normals
from geoprint.geometry.points import closest, closest_in_triangles
from geoprint.geometry.topology import connected_nodes, half_edges, twins
from geoprint.model import FloatArray, Surface, freeze_arrays, frozen

# Farther from where faces meet at an angle than this a part is flat on purpose [mm]. Within half of it normals are
# interpolated fully: the coarsest meshes of hearts have edges of 4 mm, no place of them is farther than 1.2 mm.
FLAT = 5.0
# Faces meet at an angle when their normals differ by more [rad]: what a file rounds is less.
LEAST_BEND = 1e-3


@final
@frozen
class SmoothNormals:
    """Unit normals of a refined surface, smooth across the facets of its part.

    Attributes:
        vertices: (n, 3) at its vertices; at a crease the normals of both sides turn into each other within one edge.
        corners: (m, 3, 3) at the corners of its faces; at a crease that juts out each side has its own.
    """

    vertices: FloatArray
    corners: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, vertices="float: n 3", corners="float: m 3 3")


def smooth_normals(surface: Surface, part: Surface) -> SmoothNormals:
    """Return the unit normals of a refined surface, smooth across the facets of its part.

    The normals of a refined mesh itself turn all at once at the edges of the part's facets, and a tool that follows
    them stops and starts there. Here they are interpolated over each facet between the normals of its corners
    [Phong1975], which turn evenly. Those of a corner are means over faces that meet at no crease. Farther than `FLAT`
    from all edges at which the part bends, the normal is that of its facet.

    Args:
        surface: n vertices and m faces on the part, as `refine` made it.
        part: manifold, its faces with area.

    Raises:
        MeshError: the part is not manifold, a face has no area, or a vertex no normal.
    """
    own, other = face_normals(part), twins(part.faces)
    beside = own[np.where(other < 0, np.arange(other.size), other) // 3]
    bent = np.linalg.norm(np.repeat(own, 3, axis=0) - beside, axis=1) > LEAST_BEND
    if not bent.any():
        at_vertices = vertex_normals(surface)
        return SmoothNormals(at_vertices, at_vertices[surface.faces])
    places = surface.vertices[surface.faces]
    parents = np.repeat(closest(part, places.mean(axis=1))[0].faces, 3)
    weights, _ = closest_in_triangles(places.reshape(-1, 3), part.vertices[part.faces][parents])
    turned = np.einsum("kc,kcx->kx", weights, _corner_normals(part, own)[parents])
    away = closest(edges_alone(part, bent), surface.vertices)[1][surface.faces.ravel(), None]
    share = np.clip(2.0 - 2.0 * away / FLAT, 0.0, 1.0)
    mixed = share * turned + (1.0 - share) * own[parents]
    at_vertices = mean_directions(surface, np.repeat(face_areas(surface), 3)[:, None] * mixed)
    at_corners, sides = at_vertices[surface.faces], half_edges(surface.faces)
    sharp, outwards = creases(surface, shortest=0.0)[0] & (twins(surface.faces) >= 0), juts_out(surface)
    split = np.isin(surface.faces, sides[sharp & outwards]) & ~np.isin(surface.faces, sides[sharp & ~outwards])
    at_corners[split] = (mixed / np.linalg.norm(mixed, axis=1, keepdims=True)).reshape(-1, 3, 3)[split]
    return SmoothNormals(at_vertices, at_corners)


def _corner_normals(part: Surface, own: FloatArray) -> FloatArray:
    """Return the (m, 3, 3) unit normal of each corner of each face, from the faces about it up to the creases.

    Faces count by their angle there [Baerentzen2005]: however a strip is cut into triangles, those at a point of its
    side have half a turn together.

    Args:
        part: m faces.
        own: (m, 3) their normals.
    """
    here = np.flatnonzero(~creases(part, shortest=0.0)[0])
    other = twins(part.faces)
    # The corners of two faces at the start of a half-edge; its twin gives those at its end.
    fans = connected_nodes(here, next_halves(other[here]), nodes=other.size)
    weighted = np.arctan2(1.0, corner_cotangents(part)).reshape(-1, 1) * np.repeat(own, 3, axis=0)
    sums = np.column_stack([np.bincount(fans, weighted[:, axis]) for axis in range(3)])
    lengths = np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    return (sums / lengths)[fans].reshape(-1, 3, 3)
