"""Staircases: surfaces that a program put around voxels, whose steps are the grid's and not the part's."""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray, Surface
from geoprint.surfaces.operators import face_normals
from geoprint.surfaces.topology import twins

# Normals that differ by less than this in a coordinate are one.
NORMAL_STEP = 0.02
# Around voxels there are few normals, however large the surface, and edges are sharp all over it.
FACES_PER_NORMAL = 40
SHARP_COSINE = 0.9
SHARP_SHARE = 0.12
# Heights closer than this share of the surface's size are those of one tread.
TREAD_SHARE = 1e-4
# Fewer treads in a direction are no stairs, nor are those of which the lowest tenth is lower than this share of a step.
LEAST_TREADS = 3
EVEN_SHARE = 0.98
# Faces of one normal count where they are at least this share of all.
NORMAL_SHARE = 0.02


def terrace_height(surface: Surface) -> float | None:
    """Return how high the steps of a staircase are [mm], or None where the surface is none.

    In whichever direction the grid lies: most of its faces have one of few normals, and those with one of the most
    frequent lie at heights that are a step apart, of which the largest is returned: a slice is thicker than its pixels.

    Args:
        surface: a prepared one.
    """
    normals = face_normals(surface)
    rounded = np.round(normals / NORMAL_STEP).astype(np.int64)
    kinds, kind, counts = np.unique(rounded, axis=0, return_inverse=True, return_counts=True)
    if len(kinds) * FACES_PER_NORMAL > len(surface.faces):
        return None
    across = twins(surface.faces)
    inner = np.flatnonzero(across >= 0)
    cosines = np.einsum("kx,kx->k", normals[inner // 3], normals[across[inner] // 3])
    if float((cosines < SHARP_COSINE).mean()) < SHARP_SHARE:
        return None
    middles = surface.vertices[surface.faces].mean(axis=1)
    tolerance = TREAD_SHARE * float(np.ptp(surface.vertices, axis=0).max())
    steps: list[float] = []
    for which in np.flatnonzero(counts > NORMAL_SHARE * len(normals)):
        faces = kind.ravel() == which
        heights: FloatArray = np.sort(middles[faces] @ normals[faces].mean(axis=0))
        gaps: FloatArray = heights[1:] - heights[:-1]
        gaps = gaps[gaps > tolerance]
        if gaps.size + 1 >= LEAST_TREADS and np.quantile(gaps, 0.1) > EVEN_SHARE * np.median(gaps):
            steps.append(float(np.median(gaps)))
    return max(steps, default=None)
