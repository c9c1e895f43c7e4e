"""Taking noise off a surface: what is smaller than a wavelength goes, what is larger stays.

The positions x that minimise |x - x0|^2 + (w / 2 pi)^4 |Laplacian x|^2 are those of a Butterworth filter: a ripple of
wavelength w keeps half of its height, one of w / 2 a seventeenth, one of 4 w all but 0.4 %. That is implicit fairing
with the squared Laplacian [Desbrun1999], which leaves the curvature of the part in place where the Laplacian alone
would shrink it.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, Surface
from geoprint.surfaces.operators import cotangent_laplacian, diagonal_matrix, lumped_mass
from geoprint.surfaces.remesh.creases import creases
from geoprint.surfaces.topology import boundary_loops, half_edges, twins

# Ripples to smooth away where voxels left terraces, in heights of their steps: less leaves them, more takes away walls
# that are two voxels thick. Nothing then moves by more than this share of a step.
TERRACE_WAVELENGTH = 4.0
TERRACE_SHARE = 0.5


def smooth(surface: Surface, *, wavelength: float) -> Surface:
    """Return a surface without ripples that are shorter than a wavelength.

    Rims are smoothed along themselves in the same manner, which rounds their corners, and the surface then up to them.
    Creases that are longer than the wavelength stay where they are.

    Args:
        surface: manifold, consistently wound, without faces that have no area.
        wavelength: of the ripple that keeps half of its height [mm], above 0.

    Returns:
        The surface with the same faces and other vertices.

    Raises:
        InputError: the wavelength is not a positive, finite number.
        MeshError: the surface is not manifold, or a face has no area.
    """
    if not (wavelength > 0 and math.isfinite(wavelength)):
        raise InputError(f"wavelength must be a positive number of mm, found {wavelength}.", wavelength=wavelength)
    sharp = creases(surface, shortest=wavelength).sides & (twins(surface.faces) >= 0)
    held = np.zeros(len(surface.vertices), dtype=np.bool_)
    held[half_edges(surface.faces)[sharp]] = True
    vertices = surface.vertices.copy()
    for loop in boundary_loops(surface):
        vertices[loop] = _smooth_loop(vertices[loop], held[loop], wavelength=wavelength)
        held[loop] = True
    vertices = _filtered(vertices, ~held, cotangent_laplacian(surface), lumped_mass(surface), wavelength=wavelength)
    return Surface(vertices=vertices, faces=surface.faces, name=surface.name)


def _smooth_loop(points: FloatArray, held: BoolArray, *, wavelength: float) -> FloatArray:
    """Return (l, 3) points of a closed curve without its ripples, some of them held."""
    count = len(points)
    here, ahead = np.arange(count), (np.arange(count) + 1) % count
    lengths = np.linalg.norm(points[ahead] - points, axis=1)
    inverse = 1.0 / np.maximum(lengths, np.finfo(np.float64).tiny)
    rows, columns = np.concatenate([here, ahead, here, ahead]), np.concatenate([here, ahead, ahead, here])
    values = np.concatenate([inverse, inverse, -inverse, -inverse])
    stiffness = csc_array((values, (rows, columns)), shape=(count, count))
    return _filtered(points, ~held, stiffness, (lengths + np.roll(lengths, 1)) / 2, wavelength=wavelength)


def _filtered(
    points: FloatArray, free: BoolArray, stiffness: csc_array[np.float64], masses: FloatArray, *, wavelength: float
) -> FloatArray:
    """Return points without ripples; those that are not free are held, and their own Laplacian does not count."""
    if not free.any():
        return points
    rows = stiffness[free]
    weights = (wavelength / (2.0 * math.pi)) ** 4 / masses[free]
    system = (diagonal_matrix(masses) + rows.T @ diagonal_matrix(weights) @ rows).tocsr()[free]
    right = masses[free, None] * points[free] - system[:, ~free] @ points[~free]
    result = points.copy()
    # Symmetric and positive definite: no pivoting, which would destroy the order that keeps the factor sparse.
    factor = splu(
        system[:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    result[free] = factor.solve(right)
    return result
