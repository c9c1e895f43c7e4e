"""A surface and the lines of a field on it as plain arrays, each face laid in its own plane, for the loops here.

In the plane of a face its first corner is 0 and its first side lies along the real axis, as the angles of a
`DirectionField` count. Passing over a side turns and shifts a place into the plane of the face beyond.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from geoprint.fields import DirectionField
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfacePoints
from geoprint.surfaces import twins

ComplexArray: TypeAlias = NDArray[np.complex128]


class LineNet(NamedTuple):
    """Triangles in their planes, how they are joined, and a line in each.

    Attributes:
        corners: (m, 3) [mm].
        twins: (3 m,) the half-edge across the side of each; -1 on the rim.
        turns: (3 m,) unit numbers that turn a vector over each side into the face beyond; 1 on the rim.
        shifts: (3 m,) what a turned place is moved by then [mm].
        lines: (m,) unit vectors.
        signs: (3 m,) 1 where the line of a face goes on beyond the side as that face's vector, -1 as its opposite.
        singular: (m,) whether the field turns around a corner of the face.
        spacings: (m,) wanted distance of neighbouring strokes [mm].
    """

    corners: ComplexArray
    twins: IntArray
    turns: ComplexArray
    shifts: ComplexArray
    lines: ComplexArray
    signs: FloatArray
    singular: BoolArray
    spacings: FloatArray


def net_of(field: DirectionField, *, spacings: FloatArray) -> LineNet:
    """Return the net of a field of vectors or of lines.

    Args:
        field: on m faces.
        spacings: (m,) wanted distance of neighbouring strokes in each [mm].

    Raises:
        MeshError: the surface is no manifold.
    """
    surface = field.surface
    corners, across = flat_corners(surface), twins(surface.faces).ravel()
    inside = np.flatnonzero(across >= 0)
    beyond = across[inside]
    ends = np.roll(corners, -1, axis=1).ravel()
    sides = ends - corners.ravel()
    turns, shifts = np.ones(across.size, dtype=np.complex128), np.zeros(across.size, dtype=np.complex128)
    turns[inside] = -sides[beyond] / sides[inside]
    turns[inside] /= np.abs(turns[inside])
    # Where a side ends that beyond starts.
    shifts[inside] = corners.ravel()[beyond] - turns[inside] * ends[inside]
    singular: BoolArray = np.zeros(len(surface.vertices), dtype=np.bool_)
    singular[field.singularities().vertices] = True
    odd = field.matching().ravel() * 2 == field.symmetry
    return LineNet(
        corners=corners,
        twins=across,
        turns=turns,
        shifts=shifts,
        lines=np.exp(1j * field.angles),
        signs=np.where(odd, -1.0, 1.0),
        singular=singular[surface.faces].max(axis=1),
        spacings=spacings,
    )


def flat_corners(surface: Surface) -> ComplexArray:
    """Return the (m, 3) corners of the faces in their own planes [mm]."""
    corners = surface.vertices[surface.faces]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    length = np.linalg.norm(first, axis=1)
    along = np.einsum("mx,mx->m", first, second) / length
    up = np.linalg.norm(np.cross(first, second), axis=1) / length
    flat = np.zeros((len(length), 3), dtype=np.complex128)
    flat[:, 1], flat[:, 2] = length, along + 1j * up
    return flat


def surface_points(net: LineNet, faces: IntArray, places: ComplexArray) -> SurfacePoints:
    """Return (k,) places in the planes of (k,) faces as points of the surface."""
    base, tip = net.corners[faces, 1].real, net.corners[faces, 2]
    third = places.imag / tip.imag
    second = (places.real - third * tip.real) / base
    weights = np.clip(np.column_stack([1.0 - second - third, second, third]), 0.0, 1.0)
    return SurfacePoints(faces, weights / weights.sum(axis=1, keepdims=True))


def places_of(net: LineNet, points: SurfacePoints) -> ComplexArray:
    """Return (k,) the places of points in the planes of their faces [mm]."""
    found: ComplexArray = (points.weights * net.corners[points.faces]).sum(axis=1)
    return found


def rim_sides(net: LineNet) -> tuple[IntArray, ComplexArray, ComplexArray]:
    """Return the (b,) half-edges of the rim, and where each starts and ends in the plane of its face [mm]."""
    halves = np.flatnonzero(net.twins < 0)
    return halves, net.corners.ravel()[halves], np.roll(net.corners, -1, axis=1).ravel()[halves]
