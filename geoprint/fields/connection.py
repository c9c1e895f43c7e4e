"""How directions pass from triangle to triangle: the two unfold into a plane about the side between them.

A direction in a face is an angle from the face's first side, counter-clockwise seen from outside. Passing over a side
adds a fixed angle to it, the transport. Carried once around a vertex a direction comes back turned by the angle that
is missing there to a full turn, the Gaussian curvature of the vertex [Crane2010].
"""

from __future__ import annotations

from functools import lru_cache
from typing import final

import numpy as np

from geoprint.backends.intrinsic import intrinsic_triangulation
from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.surfaces import corner_cotangents, face_normals, half_edges
from geoprint.surfaces.halfedges import BORDER

# Surfaces whose connection is kept: a field is made, checked and measured on the same one.
SURFACES_KEPT = 1


@final
@frozen
class Connection:
    """The angles between the sides of faces, and from face to face.

    Attributes:
        twins: (3 m,) the half-edge across the side of each; -1 on the rim.
        starts: (3 m,) the vertex at which each half-edge starts.
        ends: (3 m,) the one at which it ends.
        directions: (3 m,) its angle from the first side of its face [rad].
        transport: (3 m,) what is added to an angle on passing over it to the other face [rad]; 0 on the rim.
        weights: (3 m,) half the cotangent of the angle opposite to it in its face.
        curvature: (n,) what is missing to a full turn at a vertex inside, to half a turn on the rim; 0 where no
            face is [rad].
    """

    twins: IntArray
    starts: IntArray
    ends: IntArray
    directions: FloatArray
    transport: FloatArray
    weights: FloatArray
    curvature: FloatArray

    def __post_init__(self) -> None:
        halves = dict.fromkeys(("directions", "transport", "weights"), "float: h")
        freeze_arrays(self, twins="int: h", starts="int: h", ends="int: h", curvature="float: n", **halves)

    @property
    def inner(self) -> IntArray:
        """(e,) the first half-edge of each edge between two faces, ascending."""
        return np.flatnonzero(self.twins > np.arange(self.twins.size))

    def antisymmetric(self, inner_values: FloatArray) -> FloatArray:
        """Return (3 m,) values that are (e,) given ones at `inner`, the opposite at their twins and 0 on the rim."""
        values, inner = np.zeros(self.twins.size), self.inner
        values[inner], values[self.twins[inner]] = inner_values, -inner_values
        return values

    def around_vertices(self, halves: FloatArray) -> FloatArray:
        """Return (n,) sums of what (3 m,) half-edges carry over, counter-clockwise around each vertex."""
        # The side over which one leaves a face, counter-clockwise about a corner, ends in that corner.
        return np.bincount(self.ends, halves, minlength=self.curvature.size).astype(np.float64)


@lru_cache(maxsize=SURFACES_KEPT)
def connection(surface: Surface) -> Connection:
    """Return how directions pass over the sides of a surface.

    Args:
        surface: n vertices, m faces, manifold and consistently wound.

    Raises:
        MeshError: an edge has more than two faces, or two that are wound against each other; a face has no area.
    """
    twins = intrinsic_triangulation(surface).twins.ravel()
    cotangents = corner_cotangents(surface)
    angles = np.arctan2(1.0, cotangents)
    directions = np.column_stack([np.zeros(len(angles)), np.pi - angles[:, 1], np.pi + angles[:, 0]]).ravel()
    inside = twins != BORDER
    starts, ends = half_edges(surface.faces).T
    around = np.bincount(starts, angles.ravel(), minlength=len(surface.vertices)).astype(np.float64)
    whole = np.where(around > 0.0, 2 * np.pi, 0.0)
    # On the rim as many half-edges without a face beyond start as end.
    whole[starts[~inside]] = np.pi
    return Connection(
        twins=twins,
        starts=starts,
        ends=ends,
        directions=directions,
        transport=np.where(inside, directions[twins] + np.pi - directions, 0.0),
        # The corner opposite to the side from corner i to corner i + 1 is corner i + 2.
        weights=np.roll(cotangents, 1, axis=1).ravel() / 2,
        curvature=whole - around,
    )


def face_axes(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Return (m, 3) unit vectors along the first side of each face and, counter-clockwise, across it.

    Raises:
        MeshError: a face has no area.
    """
    corners = surface.vertices[surface.faces]
    first: FloatArray = corners[:, 1] - corners[:, 0]
    along: FloatArray = first / np.linalg.norm(first, axis=1)[:, None]
    return along, np.cross(face_normals(surface), along)


def angles_in_faces(surface: Surface, faces: IntArray, vectors: FloatArray) -> FloatArray:
    """Return (k,) angles of (k, 3) vectors, projected into (k,) faces, from the first sides of these [rad].

    Raises:
        MeshError: a face has no area.
    """
    along, across = (axis[faces] for axis in face_axes(surface))
    return np.arctan2(np.einsum("kx,kx->k", vectors, across), np.einsum("kx,kx->k", vectors, along))


def principal(angles: FloatArray, *, period: float) -> FloatArray:
    """Return angles less whole periods: above minus half a period, up to half a period [rad].

    Examples:
        >>> principal(np.array([0.0, 3.0, 4.0, -2.0]), period=4.0)
        array([ 0., -1.,  0.,  2.])
    """
    return angles - period * np.ceil(angles / period - 0.5)
