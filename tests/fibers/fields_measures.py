"""What tests measure of a field by other means than the field itself, from its unit vectors in space alone."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from geoprint.fibers import DirectionField, Singularities
from geoprint.geometry import boundary_loops, face_normals
from geoprint.model import BoolArray, FloatArray, IntArray, Surface


def singularities(*found: tuple[int, float]) -> Singularities:
    """Return singularities of pairs of vertex and index."""
    pairs = sorted(found)
    return Singularities(
        np.array([vertex for vertex, _ in pairs], dtype=np.int64), np.array([index for _, index in pairs], dtype=float)
    )


def inner_vertices(surface: Surface) -> IntArray:
    """Return the vertices that lie on no rim."""
    rims = boundary_loops(surface)
    return np.setdiff1d(surface.faces, np.concatenate(rims) if rims else np.empty(0, dtype=np.int64)).astype(np.int64)


def turns_around(field: DirectionField) -> Mapping[int, float]:
    """Return the index of every vertex inside: its fan is unfolded, and each face takes the direction next to the last.

    Right where the field turns by less than half a period over each side.
    """
    surface, vectors, normals = field.surface, field.directions()[:, 0], face_normals(field.surface)
    ahead = {
        (int(face[corner]), int(face[(corner + 1) % 3])): (number, corner)
        for number, face in enumerate(surface.faces)
        for corner in range(3)
    }
    places = {start: place for (start, _), place in ahead.items()}
    found: dict[int, float] = {}
    for vertex in inner_vertices(surface).tolist():
        number, corner = places[vertex]
        first, polar, seen = number, 0.0, list[float]()
        while True:
            face = surface.faces[number]
            spoke, other = surface.vertices[face[[(corner + 1) % 3, (corner + 2) % 3]]] - surface.vertices[vertex]
            seen.append(polar + _angle(spoke, vectors[number], normals[number]))
            polar += _angle(spoke, other, normals[number])
            number, corner = ahead[vertex, int(face[(corner + 2) % 3])]
            if number == first:
                break
        turned = sum(_nearest(after - before, field.period) for before, after in pairwise([*seen, seen[0] + polar]))
        found[vertex] = (turned + 2 * np.pi - polar) / (2 * np.pi)
    return found


def off(field: DirectionField, wanted: FloatArray, kept: BoolArray | None = None) -> FloatArray:
    """Return by how much the direction nearest to (m, 3) wanted vectors is off in each face that is kept [rad]."""
    unit = wanted / np.linalg.norm(wanted, axis=1)[:, None]
    cosines = np.einsum("mnx,mx->mn", field.directions(), unit).max(axis=1)
    angles = np.arccos(np.clip(cosines, -1.0, 1.0))
    return angles if kept is None else angles[kept]


def off_turned(field: DirectionField, wanted: FloatArray, kept: BoolArray | None = None) -> FloatArray:
    """Return the same once the whole field is turned by the one angle that brings it nearest [rad]."""
    normals = face_normals(field.surface)
    tangent = wanted - np.einsum("mx,mx->m", wanted, normals)[:, None] * normals
    angles = np.array([_angle(*each) for each in zip(tangent, field.directions()[:, 0], normals, strict=True)])
    powers = np.exp(1j * field.symmetry * angles)
    powers = powers if kept is None else powers[kept]
    return np.abs(np.angle(powers / powers.mean())) / field.symmetry


def _angle(first: FloatArray, second: FloatArray, normal: FloatArray) -> float:
    """Return the angle from one vector to another, counter-clockwise about a normal [rad]."""
    return float(np.arctan2(np.dot(normal, np.cross(first, second)), np.dot(first, second)))


def _nearest(angle: float, period: float) -> float:
    return angle - period * round(angle / period)
