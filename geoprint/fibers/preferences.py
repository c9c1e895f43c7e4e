"""What a field is to lean to: drawn strokes, one direction in space, the rim, principal curvature.

Each preference becomes wishes: a direction in some faces, with weights that add up to the weight of the preference. A
field then makes the least of the integral of its squared gradient plus the weighted mean of its squared deviation,
which both have no unit: a weight means the same on a fine and a coarse mesh, and on a small and a large part. A few
make a field lean, hundreds make it follow as far as singularities let it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Protocol, final

import numpy as np

from geoprint.errors import FieldError, InputError, UsageError
from geoprint.fibers.fields import angles_in_faces, face_axes
from geoprint.geometry import (
    Piece,
    boundary_half_edges,
    closest,
    edge_lengths,
    even_points,
    face_areas,
    face_normals,
    gradient,
    half_edges,
    vertex_normals,
)
from geoprint.model import FloatArray, IntArray, Surface, SurfaceCurves, freeze_arrays, frozen

# Pieces of a stroke are so long [edges], so that only faces whose corners it cuts off are left out.
PIECE_SHARE = 0.2
# What is not longer than this share of what it could be has no direction in a face: rounding decides it.
DIRECTIONLESS = 1e-9


@final
@frozen
class Wishes:
    """Directions that are preferred in some faces.

    Attributes:
        faces: (k,) which; one may come several times.
        angles: (k,) from the first side of the face [rad].
        weights: (k,) not negative.
    """

    faces: IntArray
    angles: FloatArray
    weights: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, faces="int: k", angles="float: k", weights="float: k")
        if self.weights.min(initial=0.0) < 0.0:
            raise InputError("Wishes.weights must not be negative.")

    def on(self, piece: Piece) -> Wishes:
        """Return those in the faces of one piece of the surface, in its numbering."""
        held = np.isin(self.faces, piece.faces)
        return Wishes(np.searchsorted(piece.faces, self.faces[held]), self.angles[held], self.weights[held])


class Preference(Protocol):
    """Says which directions are preferred where."""

    def wishes(self, surface: Surface, *, symmetry: int) -> Wishes:
        """Return what is wished on a surface of a field of so many directions; the weights add up to its weight.

        Raises:
            UsageError: it means nothing to a field of so many directions.
            FieldError: it means nothing anywhere on this surface.
        """
        ...


def all_wishes(surface: Surface, preferences: Sequence[Preference], *, symmetry: int) -> Wishes:
    """Return the wishes of all preferences together."""
    found = [preference.wishes(surface, symmetry=symmetry) for preference in preferences]
    return Wishes(
        np.concatenate([np.zeros(0, dtype=np.int64), *(each.faces for each in found)]),
        np.concatenate([np.zeros(0), *(each.angles for each in found)]),
        np.concatenate([np.zeros(0), *(each.weights for each in found)]),
    )


@final
@frozen
class AlongStroke:
    """The direction of drawn curves, where they pass.

    Attributes:
        curves: on the surface, each of two points or more.
        weight: of the mean over their length; positive.
    """

    curves: SurfaceCurves
    weight: float = 100.0

    def __post_init__(self) -> None:
        _check_weight(self.weight)

    def wishes(self, surface: Surface, *, symmetry: int) -> Wishes:  # noqa: ARG002  (a curve has a sense)
        """Return the directions of the curves in the faces that they cross, weighted by length there.

        Raises:
            FieldError: no curve has a length within the surface.
        """
        step = PIECE_SHARE * float(np.median(edge_lengths(surface)))
        lines = [self.curves.xyz(surface, curve) for curve in range(self.curves.count)]
        cut = [even_points(line, step=step) for line in lines if len(line) > 1]
        if not cut:
            raise FieldError(f"every line drawn on {surface.name} has one point: a direction needs two.")
        along = np.concatenate([np.diff(line, axis=0) for line in cut])
        middles = np.concatenate([(line[1:] + line[:-1]) / 2 for line in cut])
        return _wishes(surface, closest(surface, middles)[0].faces, along, weight=self.weight, what="no stroke")


@final
@frozen
class AlongDirection:
    """One direction in space, projected onto the surface.

    Attributes:
        direction: (3,) of any length but 0, in the part's coordinates.
        weight: of the mean over the area, faces across the direction counting less; positive.
    """

    direction: FloatArray
    weight: float = 10.0

    def __post_init__(self) -> None:
        freeze_arrays(self, direction="float: 3")
        _check_weight(self.weight)
        if not self.direction.any():
            raise InputError("a direction must have a length; (1, 0, 0) is the part's x axis.")

    def wishes(self, surface: Surface, *, symmetry: int) -> Wishes:  # noqa: ARG002  (a direction has a sense)
        """Return the projection in every face, weighted by area and the square of its length.

        Raises:
            FieldError: the direction is normal to the whole surface.
        """
        faces = np.arange(len(surface.faces))
        unit = self.direction / np.linalg.norm(self.direction)
        across = face_normals(surface)
        tangent = unit - (across @ unit)[:, None] * across
        # A wish counts as its vector is long: area times the projected length squared.
        longs = (face_areas(surface) * np.linalg.norm(tangent, axis=1))[:, None] * tangent
        return _wishes(surface, faces, longs, weight=self.weight, what=f"nothing along {self.direction.tolist()}")


@final
@frozen
class AlongRim:
    """The direction of the rims, the surface on the left.

    Attributes:
        weight: of the mean over their length; positive.
    """

    weight: float = 100.0

    def __post_init__(self) -> None:
        _check_weight(self.weight)

    def wishes(self, surface: Surface, *, symmetry: int) -> Wishes:  # noqa: ARG002  (a rim has a sense)
        """Return the directions of the rim's sides in their faces, weighted by length.

        Raises:
            FieldError: the surface is closed.
        """
        halves = boundary_half_edges(surface.faces)
        if halves.size == 0:
            raise FieldError(f"{surface.name} is closed and has no rim to follow: remove that preference.")
        starts, ends = half_edges(surface.faces)[halves].T
        along = surface.vertices[ends] - surface.vertices[starts]
        return _wishes(surface, halves // 3, along, weight=self.weight, what="no rim")


@final
@frozen
class AlongCurvature:
    """A principal direction of curvature, where the two principal curvatures differ.

    Attributes:
        of: the largest or the smallest curvature; a convex part seen from outside has positive ones, so that on a
            cylinder the largest runs around it and the smallest along it.
        weight: of the mean over the area, weighted by how much the curvatures differ; positive.
    """

    of: Literal["largest", "smallest"]
    weight: float = 10.0

    def __post_init__(self) -> None:
        _check_weight(self.weight)
        if self.of not in {"largest", "smallest"}:
            raise UsageError(
                f"a principal direction is that of the `largest` or the `smallest` curvature, not {self.of!r}."
            )

    def wishes(self, surface: Surface, *, symmetry: int) -> Wishes:
        """Return the principal direction of every face, weighted by area and difference of curvature.

        The curvature of a face is the gradient of the vertices' normals, made symmetric.

        Raises:
            UsageError: the field is one of vectors, but a principal direction has no sense.
            FieldError: the surface is flat.
        """
        if symmetry == 1:
            raise UsageError(
                "a principal direction of curvature has no sense, so a field of vectors cannot follow it: make a "
                "field of 2 or 4 directions."
            )
        normals = vertex_normals(surface)
        along, across = face_axes(surface)
        slopes = np.stack([gradient(surface, normals[:, axis]) for axis in range(3)], axis=1)
        bends = [
            [np.einsum("mx,mxy,my->m", one, slopes, other) for other in (along, across)] for one in (along, across)
        ]
        differing, mixed = (bends[0][0] - bends[1][1]) / 2, (bends[0][1] + bends[1][0]) / 2
        angles = np.arctan2(mixed, differing) / 2 + (0.0 if self.of == "largest" else np.pi / 2)
        longs = face_areas(surface) * np.hypot(differing, mixed)
        vectors = longs[:, None] * (np.cos(angles)[:, None] * along + np.sin(angles)[:, None] * across)
        if longs.sum() <= DIRECTIONLESS * np.sqrt(face_areas(surface).sum()):
            raise FieldError(f"{surface.name} is flat and has no principal directions of curvature to follow.")
        return _wishes(surface, np.arange(len(angles)), vectors, weight=self.weight, what="no curvature")


def _wishes(surface: Surface, faces: IntArray, vectors: FloatArray, *, weight: float, what: str) -> Wishes:
    """Return wishes along (k, 3) vectors in faces, weighted by their lengths within these."""
    upright = face_normals(surface)[faces]
    tangent = vectors - np.einsum("kx,kx->k", vectors, upright)[:, None] * upright
    lengths = np.linalg.norm(tangent, axis=1)
    if lengths.sum() <= DIRECTIONLESS * np.linalg.norm(vectors, axis=1).sum():
        raise FieldError(
            f"{what} lies within {surface.name} but is perpendicular to it everywhere, so it has no direction there."
        )
    return Wishes(faces, angles_in_faces(surface, faces, vectors), weight * lengths / lengths.sum())


def _check_weight(weight: float) -> None:
    if not 0.0 < weight < np.inf:
        raise UsageError(
            f"the weight of a preference is {weight}; it must be positive: remove preferences that should not count."
        )
