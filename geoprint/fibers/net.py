"""A surface and the lines of a field on it as plain arrays, with the sense of each line at each vertex."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias, final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from geoprint.fibers.fields import DirectionField
from geoprint.geometry import twins
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfacePoints, freeze_arrays, frozen

# A surface and the lines of a field on it as plain arrays, each face laid in its own plane, for the loops here.
#
# In the plane of a face its first corner is 0 and its first side lies along the real axis, as the angles of a
# `DirectionField` count. Passing over a side turns and shifts a place into the plane of the face beyond.


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


# In which of its two senses the line of each face runs at each vertex.
#
# A line has two senses, and a phase that rises across it rises to the other side in the other sense. Each vertex
# chooses the sense of one face beside it, and says of the others which of theirs is the same. Around a vertex with
# half an index there is none: a sense that is carried once around comes back as its opposite.


@final
@frozen
class Senses:
    """How the senses of faces and of vertices agree.

    Attributes:
        corners: (m, 3) 1 where the line of a face has the sense of the vertex at its corner, -1 where the opposite.
        along: (m, 3) 1 where the vertices at both ends of the side from corner i to corner i + 1 have one sense.
        odd: (n,) vertices around which there is no sense.
    """

    corners: FloatArray
    along: FloatArray
    odd: BoolArray

    def __post_init__(self) -> None:
        freeze_arrays(self, corners="float: m 3", along="float: m 3", odd="bool: n")


def senses_of(surface: Surface, net: LineNet) -> Senses:
    """Return the senses of the lines on a surface; each vertex takes that of the first face beside it."""
    halves = np.flatnonzero(net.twins >= 0)
    beyond, corners = net.twins[halves], net.twins.size
    # Each corner in both senses; what is the same over a side is joined.
    here = np.concatenate([halves, _following(halves)])
    there = np.concatenate([_following(beyond), beyond])
    same = np.tile(net.signs[halves] > 0.0, 2)
    joined = np.concatenate([np.where(same, there, there + corners), np.where(same, there + corners, there)])
    places = np.concatenate([here, here + corners]), joined
    graph = csr_array((np.ones(joined.size), places), shape=(2 * corners, 2 * corners))
    label = connected_components(graph, directed=False)[1]
    vertices = surface.faces.ravel()
    first = np.zeros(len(surface.vertices), dtype=np.int64)
    first[vertices[::-1]] = np.arange(corners)[::-1]
    odd = np.zeros(len(surface.vertices), dtype=np.bool_)
    odd[vertices[label[:corners] == label[corners:]]] = True
    agreed = np.where(label[:corners] == label[first[vertices]], 1.0, -1.0).reshape(-1, 3)
    turned = _turned(surface, agreed * np.roll(agreed, -1, axis=1))
    corners_sense = agreed * turned[surface.faces]
    return Senses(corners_sense, corners_sense * np.roll(corners_sense, -1, axis=1), odd)


def _turned(surface: Surface, along: FloatArray) -> FloatArray:
    """Return (n,) -1 for vertices that take the other sense, so that all have one where the whole surface has one."""
    count = len(surface.vertices)
    here, there = surface.faces.ravel(), np.roll(surface.faces, -1, axis=1).ravel()
    same = along.ravel() > 0.0
    joined = np.concatenate([np.where(same, there, there + count), np.where(same, there + count, there)])
    places = np.concatenate([here, here + count]), joined
    graph = csr_array((np.ones(joined.size), places), shape=(2 * count, 2 * count))
    label = connected_components(graph, directed=False)[1]
    return np.where(label[:count] == label[surface.faces[0, 0]], 1.0, -1.0)


def _following(halves: IntArray) -> IntArray:
    """Return the next half-edge of the same face, which starts where each ends."""
    return halves - halves % 3 + (halves + 1) % 3
