"""Faces that lean from the level that they shall lie on: edges turned until they follow it, and crumbs at the rim."""

from __future__ import annotations

import numpy as np

from geoprint.layers.feet import Ground
from geoprint.model import FloatArray, IntArray, Surface
from geoprint.surfaces import boundary_loops, component_labels, face_areas, part_of
from geoprint.surfaces.halfedges import next_halves
from geoprint.surfaces.operators import doubled_area_vectors
from geoprint.surfaces.repair.holes import fill_holes
from geoprint.surfaces.repair.manifold import split_vertices
from geoprint.surfaces.topology import edge_keys, half_edges, twins

# Faces lean from the level by no more than the angle of this cosine.
LEAST_COSINE = 0.4
# Faces of less area [mm2] have no side: what their normal says is rounding.
LEAST_AREA = 1e-10
# Rounds of turning edges; most folds are gone after one.
ROUNDS = 20
# The cosine must become larger by this much.
LEAST_GAIN = 1e-6


def cosines(ground: Ground, vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return (m,) the cosine between the normal of each face and what stands upright on the part, or 0."""
    middles: FloatArray = vertices[faces].mean(axis=1)
    across = doubled_area_vectors(vertices, faces)
    upright = middles - ground.feet(middles).places
    doubled = np.linalg.norm(across, axis=1)
    lengths = doubled * np.linalg.norm(upright, axis=1)
    sided = (doubled > 2.0 * LEAST_AREA) & (lengths > 0.0)
    found: FloatArray = np.einsum("kx,kx->k", across, upright)
    return np.divide(found, lengths, out=np.zeros_like(found), where=sided)


def unfolded(ground: Ground, surface: Surface) -> Surface:
    """Return a surface with edges turned where that makes the faces beside them lean less from the level.

    Only what leans is looked at: as in a crease, where an edge from sheet to sheet becomes one along it.
    """
    faces = surface.faces.copy()
    lean = cosines(ground, surface.vertices, faces)
    for _ in range(ROUNDS):
        turned = _turned(ground, surface.vertices, faces, lean)
        if not turned:
            break
        lean[turned] = cosines(ground, surface.vertices, faces[turned])
    return Surface(surface.vertices, faces, surface.name)


def _turned(ground: Ground, vertices: FloatArray, faces: IntArray, lean: FloatArray) -> list[int]:
    """Turn edges of faces that lean, each face once, in place; return which faces were turned."""
    found = np.flatnonzero(lean <= LEAST_COSINE)
    if not found.size:
        return []
    other = twins(faces)
    halves: IntArray = (3 * found[:, None] + np.arange(3)).ravel()
    halves = halves[other[halves] >= 0]
    across = other[halves]
    start, stop = faces.ravel()[halves], faces.ravel()[next_halves(halves)]
    left, right = (faces.ravel()[next_halves(next_halves(sides))] for sides in (halves, across))
    pairs = [np.column_stack(corners) for corners in ((start, right, left), (right, stop, left))]
    after = np.minimum(*(cosines(ground, vertices, each) for each in pairs))
    gain = after - np.minimum(lean[halves // 3], lean[across // 3])
    keys = edge_keys(np.column_stack([left, right]), vertices=len(vertices))
    linked = np.isin(keys, edge_keys(half_edges(faces), vertices=len(vertices)))
    turned: list[int] = []
    made: set[int] = set()
    for index in np.argsort(-gain, kind="stable"):
        if gain[index] <= LEAST_GAIN:
            break
        beside, key = (int(halves[index]) // 3, int(across[index]) // 3), int(keys[index])
        if not (linked[index] or left[index] == right[index] or key in made or set(beside) & set(turned)):
            faces[beside[0]], faces[beside[1]] = pairs[0][index], pairs[1][index]
            turned.extend(beside)
            made.add(key)
    return turned


def laid_flat(ground: Ground, surface: Surface) -> Surface:
    """Return a surface in which no face has turned over: what turning edges leaves is drawn to the middle of its ring.

    That is the last resort, off the level by as much as faces there are long; it meets a few vertices in a crease.
    """
    for _ in range(ROUNDS):
        over = cosines(ground, surface.vertices, surface.faces) <= 0.0
        if not over.any():
            break
        moved = np.unique(surface.faces[over])
        sides = half_edges(surface.faces)
        links = np.unique(np.concatenate([sides, sides[:, ::-1]]), axis=0)
        links = links[np.isin(links[:, 0], moved)]
        middles = np.zeros_like(surface.vertices)
        np.add.at(middles, links[:, 0], surface.vertices[links[:, 1]])
        vertices = surface.vertices.copy()
        counts = np.bincount(links[:, 0], minlength=len(vertices))[moved]
        vertices[moved] = middles[moved] / counts[:, None]
        surface = unfolded(ground, Surface(vertices, surface.faces, surface.name))
    return surface


def trimmed(ground: Ground, surface: Surface, *, hole: float) -> Surface:
    """Return a surface without the faces along its rim that lean from the level.

    Args:
        ground: the part.
        surface: near a level.
        hole: a rim up to this length [mm] is none of the part's: pieces so small are left out, holes closed.
    """
    while True:
        lean = cosines(ground, surface.vertices, surface.faces) <= LEAST_COSINE
        crumbs = lean & (twins(surface.faces).reshape(-1, 3) < 0).any(axis=1)
        if not crumbs.any():
            break
        surface = split_vertices(part_of(surface, ~crumbs))
    labels = component_labels(surface)
    large = np.bincount(labels, face_areas(surface)) > hole**2 / (4.0 * np.pi)
    if large.any():
        surface = part_of(surface, large[labels])
    return fill_holes(surface, boundary_loops(surface), longest=hole)[0]
