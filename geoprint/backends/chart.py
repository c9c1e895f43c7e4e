"""A disc-shaped surface flattened by the least squares conformal map [Levy2002]."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csc_array

from geoprint.backends.sparse_solver import SymmetricSolver, nested_dissection
from geoprint.errors import FieldError
from geoprint.model import FloatArray, IntArray, Surface
from geoprint.surfaces import boundary_loops, cotangent_laplacian, describe, euler_characteristic, face_areas

# Chart triangles with less than this share of the mean chart area count as collapsed.
COLLAPSED_SHARE = 1e-9


def conformal_chart(surface: Surface) -> Surface:
    """Flatten a disc by the map that comes nearest to keeping angles.

    With u + iv as one complex number a vertex, the conformal energy is a Hermitian form: Dirichlet's energy less the
    area of the image, which only the border enters [Mullen2008, section 2]. Two far vertices of the border are
    pinned, which leaves one sparse positive definite system; then the chart is scaled so that its area is the
    surface's, which makes chart lengths right on average.

    Args:
        surface: a disc: one component, one boundary loop, no handle.

    Returns:
        The chart [mm]: the same faces, in the same order, on vertices (u, v, 0), counter-clockwise.

    Raises:
        FieldError: the surface is not a disc, or chart triangles are flipped or collapsed.
    """
    loops = boundary_loops(surface)
    if len(loops) != 1 or euler_characteristic(surface) != 1:
        raise FieldError(
            f"{surface.name} ({describe(surface)}) cannot be flattened without a cut; the backend 'lscm' "
            "needs a disc: use `--backend heat`, which plans on any surface."
        )
    pins = farthest_pair(surface, loops[0])
    energy = csc_array(0.5 * cotangent_laplacian(surface) - _area_form(loops[0], count=len(surface.vertices)))
    free = np.setdiff1d(np.arange(len(surface.vertices)), pins)
    image = np.zeros(len(surface.vertices), dtype=np.complex128)
    image[pins[1]] = 1.0
    rows = energy[free]
    inner = csc_array(rows[:, free])
    solver = SymmetricSolver(inner, order=nested_dissection(inner, coordinates=surface.vertices[free]))
    image[free] = solver.solve(-np.asarray(rows[:, pins] @ image[pins]))
    flat = np.column_stack([image.real, image.imag, np.zeros(image.size)])
    areas = signed_areas(flat, surface.faces)
    _refuse_flips(surface, areas)
    return Surface(flat * np.sqrt(face_areas(surface).sum() / areas.sum()), surface.faces, name=surface.name)


def farthest_pair(surface: Surface, loop: IntArray) -> IntArray:
    """Return two vertices of a loop that are far apart, whatever the numbering.

    From the vertex farthest from the loop's mean the search goes to the farthest vertex again and again until the
    distance no longer grows.

    Args:
        surface: n vertices.
        loop: (l,) vertices, l >= 2.

    Returns:
        (2,) vertices.
    """
    places = surface.vertices[loop]
    here = int(np.argmax(np.linalg.norm(places - places.mean(axis=0), axis=1)))
    reach = 0.0
    while True:
        distances = np.linalg.norm(places - places[here], axis=1)
        there = int(np.argmax(distances))
        if distances[there] <= reach:
            return np.array([loop[there], loop[here]])
        here, reach = there, float(distances[there])


def signed_areas(flat: FloatArray, faces: IntArray) -> FloatArray:
    """Return the (m,) areas of triangles in the plane, positive where they are counter-clockwise [mm2].

    Examples:
        >>> signed_areas(np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 1]]))
        array([ 1., -1.])
    """
    a, b, c = (flat[faces[:, corner], :2] for corner in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def _area_form(loop: IntArray, *, count: int) -> csc_array:
    """Return the Hermitian (n, n) matrix A for which conj(z) A z is the signed area that the loop's image encloses."""
    start, end = loop, np.roll(loop, -1)
    entries = np.concatenate([np.full(loop.size, -0.25j), np.full(loop.size, 0.25j)])
    where = np.concatenate([start, end]), np.concatenate([end, start])
    return csc_array(coo_array((entries, where), shape=(count, count)))


def _refuse_flips(surface: Surface, areas: FloatArray) -> None:
    bad = areas <= COLLAPSED_SHARE * abs(areas.mean())
    if bad.any():
        place = surface.vertices[surface.faces[int(np.argmax(bad))]].mean(axis=0)
        raise FieldError(
            f"{int(bad.sum())} of {areas.size} triangles of {surface.name} are flipped or collapsed in the chart, the "
            f"first at ({place[0]:.2f}, {place[1]:.2f}, {place[2]:.2f}) mm: the flattened part would overlap itself. "
            "Use `--backend heat`, or a smaller patch."
        )
