"""The share of a turn at every vertex: rising by one round the middle, and hardly changing from turn to turn.

Turns whose distance is d and that rise by one spacing w where a share t rises by one lie w (1 + w dt/dn) apart along
the gradient of d. So t minimises the integral of (dt/dn)^2 + ALONG (dt/ds)^2: the first makes the spacing even, the
second shares the rise out along the turn. It is one sparse system, whose seam drops out: t may jump by one across it.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csc_array

from geoprint.backends.sparse_solver import SymmetricSolver, nested_dissection
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.patterns.spiral.slits import Slit
from geoprint.surfaces import face_areas, face_normals, gradient

# Weight of an even rise along the turns over an even distance between them.
ALONG = 0.02


def turns(
    surface: Surface, slit: Slit, distance: FloatArray, *, held: tuple[IntArray, FloatArray], loose: IntArray
) -> FloatArray:
    """Return the (c,) share of a turn at the vertices of a slit surface, one more on the left of the slit.

    Args:
        surface: n vertices, before it was slit.
        slit: of it.
        distance: (n,) from the seed [mm].
        held: vertices on the right of the slit, or off it, at which the share is given, and the shares.
        loose: vertices that it turns about: their triangles do not count.
    """
    count = len(surface.vertices)
    stiffness = _stiffness(surface, slit, distance, apart=np.isin(surface.faces, loose))
    size = slit.origins.size
    fold = csc_array((np.ones(size), (np.arange(size), slit.origins)), (size, count))
    jump = slit.left.astype(np.float64)
    matrix, right = csc_array(fold.T @ stiffness @ fold), -(fold.T @ (stiffness @ jump))
    vertices, shares = held
    found = np.zeros(count)
    found[vertices] = shares
    free = np.setdiff1d(np.arange(count), np.union1d(vertices, loose))
    right = right - matrix @ found
    inner = csc_array(matrix[free][:, free])
    order = nested_dissection(inner, coordinates=surface.vertices[free])
    found[free] = SymmetricSolver(inner, order=order).solve(right[free])
    whole = found[slit.origins] + jump
    for vertex in loose.tolist():
        around = slit.faces[(surface.faces == vertex).any(axis=1)]
        others = np.setdiff1d(around, np.flatnonzero(slit.origins == vertex))
        whole[slit.origins == vertex] = whole[others].mean()
    return whole


def _stiffness(surface: Surface, slit: Slit, distance: FloatArray, *, apart: BoolArray) -> csc_array:
    """Return the (c, c) matrix of the integral, over the faces without a corner that is apart."""
    down = gradient(surface, distance)
    normal = face_normals(surface)
    length = np.linalg.norm(down, axis=1)
    across = down / np.maximum(length, 1e-12)[:, None]
    along = np.cross(normal, across)
    areas = face_areas(surface)
    corners = surface.vertices[surface.faces]
    opposite = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    hats = np.cross(normal[:, None, :], opposite) / (2.0 * areas)[:, None, None]
    rise = np.einsum("mcx,mx->mc", hats, across), np.einsum("mcx,mx->mc", hats, along)
    local = np.einsum("ma,mb->mab", rise[0], rise[0]) + ALONG * np.einsum("ma,mb->mab", rise[1], rise[1])
    local *= np.where(apart.any(axis=1), 0.0, areas)[:, None, None]
    rows, columns = np.repeat(slit.faces, 3, axis=1), np.tile(slit.faces, 3)
    shape = (slit.origins.size, slit.origins.size)
    return csc_array(coo_array((local.ravel(), (rows.ravel(), columns.ravel())), shape=shape))
