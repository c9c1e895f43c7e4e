"""Surfaces in several pieces: put together, taken apart, and curves numbered as on one piece or as on the whole."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np

from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfaceCurves, SurfacePoints, freeze_arrays, frozen
from geoprint.surfaces.clipping import part_of
from geoprint.surfaces.topology import component_labels, used_vertices


@final
@frozen
class Piece:
    """One edge-connected piece of a whole surface.

    Attributes:
        surface: the piece by itself.
        faces: (m,) which face of the whole each of its faces is, ascending.
        vertices: (n,) which vertex of the whole each of its vertices is, ascending.
    """

    surface: Surface
    faces: IntArray
    vertices: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, faces="int: m", vertices="int: n")

    def holds(self, curves: SurfaceCurves) -> BoolArray:
        """Return (c,) whether each of some curves on the whole lies on this piece."""
        return np.isin(curves.points.faces[curves.offsets[:-1]], self.faces)

    def own(self, curves: SurfaceCurves) -> SurfaceCurves:
        """Return those curves on the whole that lie on this piece, in its own numbering."""
        held = some_curves(curves, np.flatnonzero(self.holds(curves)))
        faces = np.searchsorted(self.faces, held.points.faces)
        return SurfaceCurves(SurfacePoints(faces, held.points.weights), held.offsets, held.closed)

    def on_whole(self, curves: SurfaceCurves) -> SurfaceCurves:
        """Return curves on this piece in the numbering of the whole."""
        points = SurfacePoints(self.faces[curves.points.faces], curves.points.weights)
        return SurfaceCurves(points, curves.offsets, curves.closed)


def pieces(surface: Surface) -> tuple[Piece, ...]:
    """Return the edge-connected pieces of a surface, in the order of their first faces."""
    labels = component_labels(surface)
    if not labels.any():
        return (Piece(surface, np.arange(len(surface.faces)), np.arange(len(surface.vertices))),)
    return tuple(
        Piece(
            part_of(surface, labels == label),
            np.flatnonzero(labels == label),
            used_vertices(surface.faces[labels == label]),
        )
        for label in range(int(labels.max()) + 1)
    )


def united(surfaces: Sequence[Surface]) -> Surface:
    """Return several surfaces as one, vertices and faces in their order, named after the first; nothing is joined."""
    first, *others = surfaces
    if not others:
        return first
    starts = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])
    return Surface(
        vertices=np.concatenate([surface.vertices for surface in surfaces]),
        faces=np.concatenate([surface.faces + start for surface, start in zip(surfaces, starts, strict=False)]),
        name=first.name,
    )


def some_curves(curves: SurfaceCurves, chosen: IntArray) -> SurfaceCurves:
    """Return curves by their index, in the order of the indices."""
    lengths = np.diff(curves.offsets)[chosen]
    offsets = np.concatenate([[0], np.cumsum(lengths)])
    rows = np.arange(int(offsets[-1])) + np.repeat(curves.offsets[:-1][chosen] - offsets[:-1], lengths)
    return SurfaceCurves(
        SurfacePoints(curves.points.faces[rows], curves.points.weights[rows]), offsets, curves.closed[chosen]
    )


def all_curves(parts: Sequence[SurfaceCurves]) -> SurfaceCurves:
    """Return the curves of several sets on one surface as one set, in their order."""
    starts = np.cumsum([0, *(part.points.faces.size for part in parts)])
    return SurfaceCurves(
        SurfacePoints(
            np.concatenate([part.points.faces for part in parts]),
            np.concatenate([part.points.weights for part in parts]),
        ),
        np.concatenate([[0], *(part.offsets[1:] + start for part, start in zip(parts, starts, strict=False))]),
        np.concatenate([part.closed for part in parts]),
    )


def middle_of(surface: Surface) -> FloatArray:
    """Return the (3,) vertex that is nearest to the mean of all: a place on the surface to find it by [mm]."""
    away = np.linalg.norm(surface.vertices - surface.vertices.mean(axis=0), axis=1)
    return surface.vertices[int(away.argmin())]
