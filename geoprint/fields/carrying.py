"""A field carried from a surface to one that lies over it: the lines of every layer are those of the first one.

Along the straight line from a place to its foot, which is normal to both surfaces, a direction keeps itself: that is
parallel transport along the gradient of the distance. What is left is that the triangles at both ends are not quite
parallel, and there the smallest rotation between their normals carries over.

How a field turns over a side is read off directions well where it turns little. Around a singularity it does not, and
reading spreads its index over vertices beside it: there indices are gathered again at the vertex that lies above.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from geoprint.errors import InputError
from geoprint.fields.connection import angles_in_faces, connection, face_axes
from geoprint.fields.direction_field import DirectionField, nearest_field
from geoprint.model import FloatArray, IntArray, Surface, SurfacePoints
from geoprint.surfaces import boundary_half_edges, edge_lengths, face_normals, vertex_normals

# A singularity's index is spread over vertices at most so many edges of the level beside it, or of the surface below
# where these are longer, and the vertex above it lies no farther from where it must be.
SPREAD = 3.0
# Lines over a hollow meet lines from elsewhere. Where normals oppose each other by more than this cosine, feet lie on
# the wrong side of a surface, and no rotation is the smallest.
OPPOSITE = -0.99


def carried_field(
    field: DirectionField, level: Surface, *, feet: SurfacePoints, turned: FloatArray | float = 0.0
) -> DirectionField:
    """Return a field of a surface as it is on a level of the distance from it, turned there.

    Every face has the direction at its foot, linear between the middles of faces. The field above turns around the
    vertices over singularities with their indices, and around no others, except where feet part: over the crease of a
    hollow it jumps as they do. A singularity has no vertex above where the level is cut off.

    Args:
        field: on the surface below.
        level: m faces, its outside away from the surface below.
        feet: (m,) of the middles of its faces, on the surface below.
        turned: (m,) or one for all: what directions are then turned by, counter-clockwise seen from outside [rad]; it
            varies little from face to face.

    Raises:
        InputError: there are not as many feet as faces, or the level faces the surface below.
        MeshError: as `connection`.
    """
    count = len(level.faces)
    if feet.faces.size != count:
        raise InputError(f"{level.name} has {count} faces, but {feet.faces.size} feet are given: give that of each.")
    upright, above = face_normals(field.surface)[feet.faces], face_normals(level)
    cosines = np.einsum("mx,mx->m", upright, above)
    if cosines.min(initial=1.0) < OPPOSITE:
        face = int(np.argmin(cosines))
        raise InputError(
            f"face {face} of {level.name} looks at {field.surface.name} below it: turn the level over.", face=face
        )

    def raised(along: FloatArray) -> FloatArray:
        """Return (m, 3) vectors after the smallest rotation that takes one normal to the other."""
        share = np.einsum("mx,mx->m", along, above) / (1.0 + cosines)
        return along - share[:, None] * (upright + above)

    angles = angles_in_faces(level, np.arange(count), raised(_directions(field, feet))) + turned
    found = _gathered(field, nearest_field(level, angles, symmetry=field.symmetry))
    if field.axes is None:
        return found
    axes = field.axes[feet.faces]
    return replace(found, axes=np.stack([raised(axes[:, 0]), raised(axes[:, 1])], axis=1))


def _directions(field: DirectionField, points: SurfacePoints) -> FloatArray:
    """Return (k, 3) unit vectors at points: those in the middles of faces, and linear in between.

    In the middle of a side a field has done half of what it turns by over it.
    """
    # The side from corner i to corner i + 1 is opposite to corner i + 2; a function that is 1 in its middle and 0 in
    # those of the other two is a third in the middle of the face.
    shares = 1.0 - 2.0 * points.weights[:, [2, 0, 1]] - 1.0 / 3.0
    turned = np.einsum("kc,kc->k", shares, field.turning[points.faces]) / 2.0
    angles = (field.angles[points.faces] + turned)[:, None]
    along, across = (axis[points.faces] for axis in face_axes(field.surface))
    return np.cos(angles) * along + np.sin(angles) * across


def _gathered(below: DirectionField, found: DirectionField) -> DirectionField:
    """Return a field with the indices beside places above singularities moved there; its directions stay."""
    level, wanted = found.surface, below.singularities()
    reach = SPREAD * max(float(np.median(edge_lengths(each))) for each in (below.surface, level))
    counts = np.zeros(len(level.vertices))
    for vertex, index in zip(wanted.vertices.tolist(), wanted.indices.tolist(), strict=True):
        above = _above(below.surface, vertex, level, reach=reach)
        if above is not None:
            counts[above] += index
    places = np.flatnonzero(counts)
    read = found.singularities()
    counts[read.vertices] -= read.indices
    missing = np.rint(found.symmetry * counts).astype(np.int64)
    missing[places] = 0
    if not (places.size and missing.any()):
        return found
    away, onwards, _ = dijkstra(
        _inner_edges(level), directed=False, indices=places, min_only=True, return_predecessors=True, limit=reach
    )
    moved = np.flatnonzero((missing != 0) & np.isfinite(away))
    shifts = _shifts(level, moved, missing[moved], onwards.astype(np.int64))
    return DirectionField(level, found.symmetry, found.angles, found.turning + found.period * shifts)


def _above(below: Surface, vertex: int, level: Surface, *, reach: float) -> int | None:
    """Return the vertex inside a level that lies over one below; None where it is cut off."""
    place, upright = below.vertices[vertex], vertex_normals(below)[vertex]
    inside = np.zeros(len(level.vertices), dtype=np.bool_)
    inside[level.faces] = True
    inside[level.faces.ravel()[boundary_half_edges(level.faces)]] = False
    candidates = np.flatnonzero(inside)
    away = level.vertices[candidates] - place
    aside = np.linalg.norm(away - (away @ upright)[:, None] * upright, axis=1)
    # Where a level lies twice over a place the nearer sheet is meant.
    height = np.linalg.norm(away, axis=1)
    near = np.flatnonzero(aside < reach)
    if not near.size:
        return None
    sheet = near[height[near] < height[near].min() + reach]
    return int(candidates[sheet[np.argmin(aside[sheet])]])


def _inner_edges(surface: Surface) -> csr_array:
    """Return the (n, n) lengths of edges between two faces [mm]."""
    over, count = connection(surface), len(surface.vertices)
    starts, ends = over.starts[over.inner], over.ends[over.inner]
    lengths = np.linalg.norm(surface.vertices[starts] - surface.vertices[ends], axis=1)
    return csr_array(coo_array((lengths, (starts, ends)), shape=(count, count)))


def _shifts(surface: Surface, starts: IntArray, amounts: IntArray, onwards: IntArray) -> FloatArray:
    """Return (m, 3) whole periods over sides that give vertices what they miss, and take it where their paths end.

    A field that turns by a period more over a half-edge has one n-th of an index more at the vertex where that ends,
    and one less where it starts.

    Args:
        surface: m faces.
        starts: (k,) vertices.
        amounts: (k,) n-th parts of an index that are missing there.
        onwards: (n,) the next vertex on the path of each; below 0 where it ends.
    """
    over = connection(surface)
    shifts = np.zeros(over.twins.size)
    for start, amount in zip(starts.tolist(), amounts.tolist(), strict=True):
        vertex = start
        while (ahead := int(onwards[vertex])) >= 0:
            half = np.flatnonzero((over.starts == ahead) & (over.ends == vertex))[0]
            shifts[half] += amount
            shifts[over.twins[half]] -= amount
            vertex = ahead
    return shifts.reshape(-1, 3)
