"""A hollow ball of voxels as a wall whose depth is known by formula, and skins within it."""

from __future__ import annotations

import numpy as np

from geoprint.fibers import WallVoxels
from geoprint.model import FloatArray, Surface
from tests import meshes

INNER, OUTER = 15.0, 25.0


def ball_voxels(*, side: float = 1.0, turned: FloatArray | None = None) -> WallVoxels:
    """Return a hollow ball about the origin, cut off by its base where z is 12 mm; its apex is down."""
    count = int(56.0 / side)
    axis = (np.arange(count) - (count - 1) / 2) * side
    affine = np.diag([side, side, side, 1.0])
    affine[:3, 3] = axis[0]
    linear = np.eye(3) if turned is None else turned
    places = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1) @ linear.T
    affine[:3] = linear @ affine[:3]
    away, low = np.linalg.norm(places, axis=-1), places[..., 2] < 12.0
    wall = (away >= INNER) & (away < OUTER)
    return WallVoxels(wall & low, away < INNER, wall & ~low, affine, name="ball")


def skin(radius: float, *, top: float = -2.0) -> Surface:
    """Return the part of a sphere about the origin that is low, away from the base, and over the apex."""
    whole = meshes.sphere(radius=radius, subdivisions=4, jitter_seed=1)
    tops = whole.vertices[whole.faces][:, :, 2]
    return Surface(whole.vertices, whole.faces[(tops.max(axis=1) < top) & (tops.min(axis=1) > -0.7 * radius)])
