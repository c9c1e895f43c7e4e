"""A surface slit open along a line of edges, so that a number that rises by one round it has one value a vertex."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from geoprint.model import BoolArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.surfaces import connected_nodes, edge_keys, edges, half_edges, twins


@frozen
class Slit:
    """A surface of n vertices and m faces, slit open: the same faces in their order, with c vertices.

    Attributes:
        faces: (m, 3) vertices of the slit surface.
        origins: (c,) vertex of the whole surface that each of its vertices is.
        left: (c,) whether it is the copy on the left of the line.
    """

    faces: IntArray
    origins: IntArray
    left: BoolArray

    def __post_init__(self) -> None:
        freeze_arrays(self, faces="int: m 3", origins="int: c", left="bool: c")


def line_between(surface: Surface, start: int, ends: IntArray) -> IntArray:
    """Return the (k,) vertices of the shortest line along edges from a vertex to the nearest of some others."""
    sides = edges(surface.faces)
    lengths = np.linalg.norm(surface.vertices[sides[:, 1]] - surface.vertices[sides[:, 0]], axis=1)
    count = len(surface.vertices)
    graph = coo_array((lengths, (sides[:, 0], sides[:, 1])), shape=(count, count)).tocsr()
    away, before = dijkstra(graph, directed=False, indices=np.array([start]), return_predecessors=True)
    line = [int(ends[away[0, ends].argmin()])]
    while line[-1] != start:
        line.append(int(before[0, line[-1]]))
    return np.array(line[::-1], dtype=np.int64)


def slit_along(surface: Surface, line: IntArray) -> Slit:
    """Return a surface slit open along a line of edges; its ends stay one vertex unless they lie on the border."""
    count = len(surface.vertices)
    halves, other = half_edges(surface.faces), twins(surface.faces)
    ahead = np.column_stack([line[:-1], line[1:]])
    on_line = np.isin(edge_keys(halves, vertices=count), edge_keys(ahead, vertices=count))
    half = np.flatnonzero((other >= 0) & ~on_line)
    following = half - half % 3 + (half + 1) % 3
    beyond = other[half] - other[half] % 3 + (other[half] + 1) % 3
    corner = connected_nodes(
        np.concatenate([half, following]), np.concatenate([beyond, other[half]]), nodes=halves.shape[0]
    )
    vertices = int(corner.max()) + 1
    origins = np.zeros(vertices, dtype=np.int64)
    origins[corner] = surface.faces.ravel()
    beside = np.flatnonzero(np.isin(halves[:, 0] * count + halves[:, 1], ahead[:, 0] * count + ahead[:, 1]))
    left = np.zeros(vertices, dtype=np.bool_)
    left[corner[beside]] = True
    left[corner[beside - beside % 3 + (beside + 1) % 3]] = True
    left &= np.bincount(origins, minlength=count)[origins] > 1
    return Slit(corner.reshape(-1, 3), origins, left)
