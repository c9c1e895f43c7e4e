"""A field of directions, and what is measured of it: its singularities and how it turns against the rims.

The carriers are the faces: one direction in each, and by how much it turns over each side. Singularities are then
vertices, which is where they are asked for and where a printed path can be kept away from; a streamline is straight in
each face, and whoever follows it needs no interpolation that is undefined at a singularity. Directions at vertices
would be smooth across edges, but need rescaled angles at every vertex, and their singularities lie somewhere in faces.

By how much the field turns over a side is kept and not guessed from the two directions: around a vertex of six faces a
cross field of index 1 turns by more over each side than the eighth of a turn up to which guessing is right.
"""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.errors import InputError, UsageError
from geoprint.fields.connection import Connection, connection, face_axes, principal
from geoprint.model import FloatArray, IntArray, Surface, SurfacePoints, freeze_arrays, frozen
from geoprint.surfaces import boundary_loops

# How many directions a field may have in each face: a vector, a line in both directions, a cross.
SYMMETRIES = (1, 2, 4)
# Directions may disagree with what a field turns by over a side by rounding alone [rad].
ANGLE_TOLERANCE = 1e-6


@final
@frozen
class Singularities:
    """Vertices around which a field turns, and how often.

    Attributes:
        vertices: (k,) ascending, none twice.
        indices: (k,) turns of the field, counter-clockwise, as one goes around each once counter-clockwise: 1 where it
            circles or points away, -1 at a saddle; multiples of 1 / n for n directions.
    """

    vertices: IntArray
    indices: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, vertices="int: k", indices="float: k")
        if (np.diff(self.vertices) <= 0).any():
            raise InputError("Singularities.vertices must ascend, each vertex once; add up the indices at one vertex.")


@final
@frozen
class DirectionField:
    """n directions in each face of a surface, evenly around: a vector (1), a line in both directions (2), a cross (4).

    Attributes:
        surface: m faces, manifold and consistently wound.
        symmetry: n, one of SYMMETRIES.
        angles: (m,) of one direction of each face from the face's first side, counter-clockwise seen from outside
            [rad].
        turning: (m, 3) by how much the field turns against a direction that passes straight over the side from corner i
            to corner i + 1 into the next face [rad]; the opposite from the other side, and 0 on the rim.
        axes: (m, 2, 3) unit vectors around and up an axis, between which helix angles count, positive where a line
            rises along the first; zero where nothing tells them. None where the field has no axis.
    """

    surface: Surface
    symmetry: int
    angles: FloatArray
    turning: FloatArray
    axes: FloatArray | None = None

    def __post_init__(self) -> None:
        check_symmetry(self.symmetry)
        axes = {} if self.axes is None else {"axes": "float: m 2 3"}
        faces = freeze_arrays(self, angles="float: m", turning="float: m 3", **axes)["m"]
        if faces != len(self.surface.faces):
            raise InputError(f"{self.surface.name} has {len(self.surface.faces)} faces, but the field has {faces}.")
        over, turning = connection(self.surface), self.turning.ravel()
        inner = over.inner
        apart = np.abs(turning[inner] + turning[over.twins[inner]]).max(initial=0.0)
        missed = np.abs(principal(_ahead(over, self.angles, turning)[inner], period=self.period)).max(initial=0.0)
        beyond = np.abs(turning[over.twins < 0]).max(initial=0.0)
        off = float(max(apart, missed, beyond))
        if off > ANGLE_TOLERANCE:
            raise InputError(
                f"by what a field on {self.surface.name} turns over a side does not lead to the direction beyond: off "
                f"by {off:.3g} rad; `nearest_field` makes a field of directions alone.",
                off=off,
            )

    @property
    def period(self) -> float:
        """Angle between neighbouring directions in a face [rad]."""
        return 2 * np.pi / self.symmetry

    def directions(self) -> FloatArray:
        """Return the (m, n, 3) unit vectors of all faces, counter-clockwise from that of the face's angle."""
        along, across = face_axes(self.surface)
        angles = self.angles[:, None] + self.period * np.arange(self.symmetry)
        return np.cos(angles)[:, :, None] * along[:, None] + np.sin(angles)[:, :, None] * across[:, None]

    def at(self, points: SurfacePoints) -> FloatArray:
        """Return the (k, n, 3) unit vectors at points: those of their faces.

        Raises:
            InputError: a point names a face that the surface does not have.
        """
        points.corners(self.surface)
        return self.directions()[points.faces]

    def matching(self) -> IntArray:
        """Return (m, 3) by how many the directions are numbered on over each side, from 0 to n - 1.

        Direction j of a face goes on in the face beyond as direction j + matching, modulo n; 0 on the rim.
        """
        over, turning = connection(self.surface), self.turning.ravel()
        steps = np.rint(_ahead(over, self.angles, turning) / self.period).astype(np.int64) % self.symmetry
        return np.where(over.twins < 0, 0, steps).reshape(-1, 3)

    def singularities(self) -> Singularities:
        """Return every vertex inside around which the field turns, measured face by face around all of them.

        The indices of all and the `turnings` of the rims add up to the Euler characteristic.
        """
        over = connection(self.surface)
        turns = self._turns(over)
        turns[over.starts[over.twins < 0]] = 0.0
        counts = np.rint(turns * self.symmetry).astype(np.int64)
        vertices = np.flatnonzero(counts)
        return Singularities(vertices, counts[vertices] / self.symmetry)

    def turnings(self) -> FloatArray:
        """Return (l,) how many turns the field falls behind each rim as one goes along it, the surface on the left.

        0 where it follows the rim or crosses it at one angle; 1 for the rim of a disc in a field that is the same
        everywhere, -1 for that of a hole in it. In the order of `boundary_loops`, multiples of 1 / n.

        Raises:
            MeshError: as `boundary_loops`.
        """
        turns = self._turns(connection(self.surface))
        found = np.array([turns[loop].sum() for loop in boundary_loops(self.surface)])
        # Nothing is added so that no turning prints as -0.
        return np.rint(found * self.symmetry) / self.symmetry + 0.0

    def _turns(self, over: Connection) -> FloatArray:
        """Return (n,) turns of the field around vertices; around those of the rim the part that is inside."""
        return (over.curvature + over.around_vertices(self.turning.ravel())) / (2 * np.pi)


def nearest_field(surface: Surface, angles: FloatArray, *, symmetry: int) -> DirectionField:
    """Return the field of given directions that turns by as little as it can over each side.

    Args:
        surface: m faces, manifold and consistently wound.
        angles: (m,) of one direction of each face from the face's first side [rad].
        symmetry: n, of the directions in a face.

    Raises:
        UsageError: the symmetry is not one of SYMMETRIES.
        MeshError: as `connection`.
    """
    check_symmetry(symmetry)
    over = connection(surface)
    ahead = _ahead(over, angles, np.zeros(over.twins.size))[over.inner]
    turning = over.antisymmetric(-principal(ahead, period=2 * np.pi / symmetry))
    return DirectionField(surface, symmetry, angles, turning.reshape(-1, 3))


def check_symmetry(symmetry: int) -> None:
    """Check how many directions a field shall have.

    Raises:
        UsageError: not so many.
    """
    if symmetry not in SYMMETRIES:
        raise UsageError(f"a field has 1 direction (vector), 2 (line) or 4 (cross) in each face, not {symmetry}.")


def _ahead(over: Connection, angles: FloatArray, turning: FloatArray) -> FloatArray:
    """Return (3 m,) by how much a direction that passes over each side and turns is ahead of that beyond [rad]."""
    mine = np.repeat(angles, 3)
    return mine + over.transport + turning - mine[over.twins]
