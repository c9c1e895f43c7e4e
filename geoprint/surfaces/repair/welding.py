"""Joining rim vertices that coincide: what an STL file, a seam or a cut has torn apart is one surface again."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import FloatArray, IntArray
from geoprint.surfaces.repair.equal_points import first_equal
from geoprint.surfaces.topology import boundary_half_edges, connected_nodes, edge_keys, edges, half_edges, used_vertices
from geoprint.surfaces.triangle_sizes import side_lengths

# Rim vertices closer than this share of the bounding box's diagonal are one: 0.01 mm for a part of 40 mm, which is
# what rounding leaves between the corners of STL triangles and far below a bead.
WELD_SHARE = 2.5e-4
# But never farther apart than this share of the median edge, so that a fine mesh keeps its own detail.
WELD_EDGE_SHARE = 0.05


def weld_tolerance(vertices: FloatArray, faces: IntArray) -> float:
    """Return the distance [mm] below which rim vertices are one.

    Args:
        vertices: (n, 3) positions [mm].
        faces: (m, 3), at least one.
    """
    used = vertices[used_vertices(faces)]
    median_edge = float(np.median(side_lengths(vertices, faces)))
    diagonal = float(np.linalg.norm(used.max(axis=0) - used.min(axis=0)))
    return min(WELD_SHARE * diagonal, WELD_EDGE_SHARE * median_edge)


def welded(vertices: FloatArray, faces: IntArray) -> IntArray:
    """Return faces whose coincident rim vertices are one: each is replaced by the smallest index of its group.

    Vertices inside the surface, or at the two ends of an edge, are never joined. The exact round comes first because
    it turns most corners of an STL file into inner vertices, which the round with a tolerance then leaves alone.

    Args:
        vertices: (n, 3) positions [mm].
        faces: (m, 3).
    """
    if len(faces) == 0:
        return faces
    rim = _rim(faces)
    if rim.size == 0:
        return faces
    exact = _renamed(faces, rim, rim[first_equal(vertices[rim])], count=len(vertices))
    rim = _rim(exact)
    if rim.size == 0:
        return exact
    near = rim[KDTree(vertices[rim]).query_pairs(weld_tolerance(vertices, exact), output_type="ndarray")]
    if near.size == 0:
        return exact
    known = edge_keys(edges(exact), vertices=len(vertices))
    near = near[~np.isin(edge_keys(near, vertices=len(vertices)), known)]
    labels = connected_nodes(*near.T, nodes=len(vertices))
    _, first = np.unique(labels, return_index=True)
    return first[labels][exact]


def _rim(faces: IntArray) -> IntArray:
    """Return the vertices on edges that have one face, ascending."""
    return used_vertices(half_edges(faces)[boundary_half_edges(faces)])


def _renamed(faces: IntArray, old: IntArray, new: IntArray, *, count: int) -> IntArray:
    names = np.arange(count)
    names[old] = new
    return names[faces]
