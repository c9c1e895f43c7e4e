"""The conformal energy of a map to the plane and the maps of least energy [Levy2002] [Mullen2008, section 2]."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.sparse import coo_array, csc_array

from geoprint.backends.sparse_solver import ComplexArray, SymmetricSolver, nested_dissection, picked
from geoprint.model import FloatArray, IntArray, Surface
from geoprint.surfaces import cotangent_laplacian


def conformal_energy(surface: Surface, loops: tuple[IntArray, ...]) -> csc_array:
    """Return the Hermitian (n, n) matrix E for which conj(z) E z is the conformal energy of a map z = u + iv.

    It is Dirichlet's energy less the area of the image, which only the border enters: holes need no cut, because
    their loops enclose the area that is missing. It is zero exactly where all angles are kept.

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


def turning_pull(start: IntArray, end: IntArray, *, lengths: FloatArray, turn: float, unknowns: int) -> ComplexArray:
    """Return the vector c for which conj(c) z is how far the image of a line goes along one that turns evenly.

    Each chord of the image counts by its part along the direction that the line has there. A loop that turns by
    2 pi has the first Fourier coefficient of its image counted, up to a factor.

    Args:
        start: (l,) unknown at the start of each edge of the line.
        end: (l,) unknown at its end.
        lengths: (l,) length of each edge [mm].
        turn: by how much the direction turns from the start of the line to its end [rad].
        unknowns: their number n.

    Returns:
        (n,) vector c; conj(c) z stays when z is moved as a whole.
    """
    middles = (np.cumsum(lengths) - 0.5 * lengths) / lengths.sum()
    directions = np.exp(1j * turn * middles)
    result: ComplexArray = np.zeros(unknowns, dtype=np.complex128)
    np.add.at(result, end, directions)
    np.add.at(result, start, -directions)
    return result


@final
class PinnedMap:
    """The map of least energy that sends one unknown to 0 and another to 1, and maps of least energy under a pull.

    Args:
        energy: (n, n) as `conformal_energy` returns it.
        coordinates: (n, 3) position of each unknown, for the order of elimination alone.
        pins: (2,) the unknown at 0 and the one at 1.

    Raises:
        FieldError: the system is singular.
    """

    def __init__(self, energy: csc_array, *, coordinates: FloatArray, pins: IntArray) -> None:
        self._free = np.setdiff1d(np.arange(len(coordinates)), pins)
        inner = picked(energy, self._free)
        self._solver = SymmetricSolver(inner, order=nested_dissection(inner, coordinates=coordinates[self._free]))
        image: ComplexArray = np.zeros(len(coordinates), dtype=np.complex128)
        image[pins[1]] = 1.0
        image[self._free] = self._solver.solve(-np.asarray(energy @ image)[self._free])
        # E z is zero at the free unknowns, so that one row of it is the energy; what is below zero is rounding.
        force: ComplexArray = np.asarray(energy[[pins[1]]] @ image, dtype=np.complex128)
        self._energy = max(float(force[0].real), 0.0)
        self.image = image

    def pulled(self, pull: ComplexArray) -> ComplexArray:
        """Return the map z of least energy among those of one value of conj(pull) z, whatever the pins.

        It is a sum of the pinned map p and of the response q to the pull with both pins at 0; that the energy is
        least is one linear equation for their shares, conj(conj(pull) p) to conj(p) E p. Where p keeps all angles its
        energy is zero, and it is the answer.

        Args:
            pull: (n,) complex; conj(pull) z must not change when the whole map is moved.

        Returns:
            (n,) images, the first pin at 0; turn and scale are left open.
        """
        response = np.zeros_like(self.image)
        response[self._free] = self._solver.solve(pull[self._free])
        return np.conj(np.vdot(pull, self.image)) * self.image + self._energy * response
