"""A surface with a border flattened by the least squares conformal map [Levy2002], holes and all."""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array

from geoprint.backends.overlap import refuse_overlaps, signed_areas
from geoprint.backends.sparse_solver import SymmetricSolver, nested_dissection
from geoprint.errors import FieldError
from geoprint.model import FloatArray, IntArray, Surface
from geoprint.surfaces import boundary_loops, cotangent_laplacian, describe, euler_characteristic, face_areas

__all__ = ["conformal_chart", "farthest_pair", "pinned_map", "signed_areas"]

ComplexArray = NDArray[np.complex128]


def conformal_chart(surface: Surface) -> Surface:
    """Flatten a disc, an annulus or a disc with more holes by the map that comes nearest to keeping angles.

    With u + iv as one complex number a vertex, the conformal energy is a Hermitian form: Dirichlet's energy less the
    area of the image, which only the border enters [Mullen2008, section 2]. Holes need no cut: their loops enclose
    the area that is missing. A disc is pinned at two far vertices of its border, as in [Levy2002]. With holes two pins
    do not settle the map: on a band about a cylinder z and 1/z are both conformal, and a sum of them folds. There the
    longest loop, as a function of its arc length, has its first harmonic fixed instead, which asks it to go round
    once, counter-clockwise. Either way it is one sparse positive definite system. The chart is scaled so that its
    area is the surface's, which makes chart lengths right on average.

    Args:
        surface: one component without handle, one boundary loop or more.

    Returns:
        The chart [mm]: the same faces, in the same order, on vertices (u, v, 0), counter-clockwise. Any loop may lie
        outside, the others are holes in it.

    Raises:
        FieldError: the surface is closed, has a handle or several components; or its chart overlaps itself, because
            triangles are flipped or collapsed, holes turned inside out, or border segments cross.
    """
    loops = boundary_loops(surface)
    _require_planar(surface, loops)
    pins = farthest_pair(surface, loops[0])
    image = pinned_map(surface, pins=pins) if len(loops) == 1 else _once_around(surface, loops, pins)
    flat = np.column_stack([image.real, image.imag])
    refuse_overlaps(surface, flat, loops)
    scale = np.sqrt(face_areas(surface).sum() / signed_areas(flat, surface.faces).sum())
    return Surface(np.column_stack([scale * flat, np.zeros(len(flat))]), surface.faces, name=surface.name)


def pinned_map(surface: Surface, *, pins: IntArray) -> ComplexArray:
    """Return the least squares conformal map with one vertex at 0 and another at 1 [Levy2002].

    Args:
        surface: n vertices, at least one boundary loop.
        pins: (2,) the vertex at 0 and the one at 1.

    Returns:
        (n,) images u + iv; nothing is checked.

    Raises:
        FieldError: the system is singular.
    """
    return _Pinned(conformal_energy(surface, boundary_loops(surface)), surface.vertices, pins).image


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


def conformal_energy(surface: Surface, loops: tuple[IntArray, ...]) -> csc_array:
    """Return the Hermitian (n, n) matrix E for which conj(z) E z is the conformal energy of the map z.

    It is the integral of |dz / d conj(w)|^2 over the surface, up to a factor: zero exactly where all angles are kept.

    Args:
        surface: n vertices.
        loops: all its boundary loops, the surface on their left.
    """
    start, end = np.concatenate(loops), np.concatenate([np.roll(loop, -1) for loop in loops])
    entries = np.concatenate([np.full(start.size, -0.25j), np.full(start.size, 0.25j)])
    where = np.concatenate([start, end]), np.concatenate([end, start])
    count = len(surface.vertices)
    enclosed = coo_array((entries, where), shape=(count, count))
    return csc_array(0.5 * cotangent_laplacian(surface) - csc_array(enclosed))


def _once_around(surface: Surface, loops: tuple[IntArray, ...], pins: IntArray) -> ComplexArray:
    """Return the (n,) images of least energy for which the longest loop has a given first harmonic.

    The map is a sum of the pinned one, p, and of the response q with both pins at 0 to a pull on the loop. With the
    pull c, that is conj(c) z = first harmonic of z, the least energy under conj(c) z = 1 is at a multiple of
    conj(conj(c) p) p + (conj(p) E p) q: a linear equation in two unknowns, solved by hand. Where p keeps all angles
    its energy is zero, and it is the answer.
    """
    pinned = _Pinned(conformal_energy(surface, loops), surface.vertices, pins)
    pull = _first_harmonic(surface, loops[0])
    response = pinned.response(pull)
    return np.conj(np.vdot(pull, pinned.image)) * pinned.image + pinned.energy * response


def _first_harmonic(surface: Surface, loop: IntArray) -> ComplexArray:
    """Return the (n,) vector c for which conj(c) z is the first Fourier coefficient of z along a loop.

    The chords of the image are weighted by their turned directions, so that moving the image leaves it as it is.
    """
    ends = np.roll(loop, -1)
    lengths = np.linalg.norm(surface.vertices[ends] - surface.vertices[loop], axis=1)
    middles = (np.cumsum(lengths) - 0.5 * lengths) / lengths.sum()
    turned = np.exp(2j * np.pi * middles)
    result = np.zeros(len(surface.vertices), dtype=np.complex128)
    result[ends] += turned
    result[loop] -= turned
    return result


class _Pinned:
    """The factorised energy with two vertices held, and the map that sends them to 0 and 1."""

    def __init__(self, energy: csc_array, coordinates: FloatArray, pins: IntArray) -> None:
        self._free = np.setdiff1d(np.arange(len(coordinates)), pins)
        rows = energy[self._free]
        inner = csc_array(rows[:, self._free])
        self._solver = SymmetricSolver(inner, order=nested_dissection(inner, coordinates=coordinates[self._free]))
        image: ComplexArray = np.zeros(len(coordinates), dtype=np.complex128)
        image[pins[1]] = 1.0
        image[self._free] = self._solver.solve(-np.asarray(rows @ image))
        self.image = image
        # E z is zero at the free vertices, so that one row of it is the energy; what is below zero is rounding.
        force: ComplexArray = np.asarray(energy[[pins[1]]] @ image, dtype=np.complex128)
        self.energy = max(float(force[0].real), 0.0)

    def response(self, pull: ComplexArray) -> ComplexArray:
        """Return the (n,) map z with both pins at 0 and E z = pull at the other vertices."""
        result = np.zeros_like(self.image)
        # The solver takes what the matrix is made of, complex numbers here; its annotation knows real ones alone.
        result[self._free] = self._solver.solve(cast("FloatArray", pull[self._free]))
        return result


def _require_planar(surface: Surface, loops: tuple[IntArray, ...]) -> None:
    """Refuse what no plane has room for: one component with b >= 1 loops and Euler characteristic 2 - b is planar."""
    if loops and euler_characteristic(surface) == 2 - len(loops) and describe(surface)[0].isalpha():
        return
    raise FieldError(
        f"{surface.name} ({describe(surface)}) cannot be flattened without a cut; the backend 'lscm' needs one "
        "component with a border and without handles: give a smaller open patch, or use `--backend heat`, which plans "
        "on any surface."
    )
