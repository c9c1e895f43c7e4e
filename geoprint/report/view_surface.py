"""A surface coarse enough to be drawn in a browser, whose vertices are vertices of the original."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.surfaces import boundary_half_edges, face_areas, half_edges

# Faces per cell that clustering a flat piece leaves: two triangles a grid cell, more where the grid cuts slantwise.
FACES_PER_CELL = 2.2
# Kinds of vertices that are kept apart: eight octants that they face, inside and on the border.
KINDS = 16
# Faces with less area, over that of a cell's side, are lines but for rounding.
FLAT_SHARE = 1e-9
# Cells grow by this factor until few enough faces are left.
GROWTH = 1.12


@final
@frozen
class ViewSurface:
    """A surface to look at.

    Attributes:
        surface: at most as many faces as asked for.
        vertices: (n,) which vertex of the original each of its vertices is: values[vertices] are the values on it.
    """

    surface: Surface
    vertices: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, vertices="int: n")


def view_surface(surface: Surface, *, faces: int = 100_000) -> ViewSurface:
    """Return the surface, thinned to be drawn: not to be measured.

    All vertices in a cell of a grid become the one nearest to their mean. Vertices of the border become one of the
    border, and sides of a thin wall that face different directions stay apart, so that neither is pulled in.

    Args:
        surface: any.
        faces: most faces it may have.

    Returns:
        The surface itself where it is small enough, else a coarser one.
    """
    if len(surface.faces) <= faces:
        return ViewSurface(surface, np.arange(len(surface.vertices)))
    cell = float(np.sqrt(FACES_PER_CELL * face_areas(surface).sum() / faces))
    kinds = _kinds(surface)
    while True:
        coarse = _clustered(surface, kinds, cell=cell)
        if len(coarse.surface.faces) <= faces:
            return coarse
        cell *= GROWTH


def shading_normals(surface: Surface) -> FloatArray:
    """Return (n, 3) unit normals for drawing; zero where faces cancel each other or none is there."""
    corners = surface.vertices[surface.faces]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.zeros_like(surface.vertices)
    for corner in range(3):
        np.add.at(total, surface.faces[:, corner], doubled)
    lengths = np.linalg.norm(total, axis=1, keepdims=True)
    return total / np.where(lengths > 0.0, lengths, 1.0)


def _kinds(surface: Surface) -> IntArray:
    """Return a number for each vertex; only equal ones may be merged: on the border or not, and facing alike."""
    octants: IntArray = (shading_normals(surface) > 0.0).astype(np.int64) @ np.array([1, 2, 4])
    border = half_edges(surface.faces)[boundary_half_edges(surface.faces)]
    octants[np.unique(border)] += KINDS // 2
    return octants


def _clustered(surface: Surface, kinds: IntArray, *, cell: float) -> ViewSurface:
    places = np.floor((surface.vertices - surface.vertices.min(axis=0)) / cell).astype(np.int64)
    keys = np.ravel_multi_index((*places.T, kinds), (*(places.max(axis=0) + 1), KINDS))
    _, clusters, counts = np.unique(keys, return_inverse=True, return_counts=True)
    means = np.column_stack([np.bincount(clusters, surface.vertices[:, axis]) / counts for axis in range(3)])
    away = np.linalg.norm(surface.vertices - means[clusters], axis=1)
    # The first vertex of each cluster when sorted by cluster, then by distance from its mean.
    order = np.lexsort([away, clusters])
    chosen = order[np.searchsorted(clusters[order], np.arange(len(counts)))]
    faces = clusters[surface.faces]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    faces = _without_folds(faces[whole])
    # Three vertices on a line show nothing, and have no normal.
    faces = faces[face_areas(Surface(surface.vertices[chosen], faces)) > FLAT_SHARE * cell**2]
    used, faces = np.unique(faces, return_inverse=True)
    return ViewSurface(Surface(surface.vertices[chosen[used]], faces.reshape(-1, 3), name=surface.name), chosen[used])


def _without_folds(faces: IntArray) -> IntArray:
    """Return each triangle once; those with the same corners cancel where they are turned against each other."""
    ordered = np.sort(faces, axis=1)
    count = int(faces.max()) + 1
    keys = np.ravel_multi_index(tuple(ordered.T), (count, count, count))
    _, first, which = np.unique(keys, return_index=True, return_inverse=True)
    # A triangle is turned as its sorted corners are, or against them.
    smallest = np.take_along_axis(faces, ((np.argmin(faces, axis=1)[:, None] + [[0, 1, 2]]) % 3), axis=1)
    turned = np.where(smallest[:, 1] < smallest[:, 2], 1, -1)
    net = np.bincount(which, turned)
    kept = ordered[first]
    return np.where(net[:, None] > 0, kept, kept[:, [0, 2, 1]])[net != 0]
