"""Paths along a field, and what is measured of them by other means than those that drew them."""

from __future__ import annotations

from collections import defaultdict
from itertools import combinations

import numpy as np

from geoprint.distance import BACKENDS
from geoprint.fibers import DirectionField
from geoprint.fibers.fields import face_axes
from geoprint.fibers.pattern import FibrePattern
from geoprint.geometry import boundary_loops, boundary_source, point_source
from geoprint.model import FloatArray, IntArray, Paths, Surface, SurfaceCurves


def paths_along(field: DirectionField, *, spacing: float, laying: str) -> Paths:
    """Return the paths along a field, from the rim or, where there is none, from the first vertex."""
    surface = field.surface
    rim = bool(boundary_loops(surface))
    source = boundary_source(surface) if rim else point_source(surface, surface.vertices[0], tolerance=1)
    pattern = FibrePattern(field=lambda _: field, laying=laying)
    return pattern.paths(surface, source, backend=BACKENDS["heat"](surface), spacing=spacing)


def crossings(surface: Surface, curves: SurfaceCurves) -> int:
    """Return how often pieces of curves cross within a triangle; neighbours along a curve do not count.

    Each piece lies in the triangle of its first point, as those of traced streamlines do.
    """
    faces, starts, ends = _pieces(surface, curves)
    held: defaultdict[int, list[int]] = defaultdict(list)
    for piece, face in enumerate(faces.tolist()):
        held[face].append(piece)
    pairs = [pair for pieces in held.values() for pair in combinations(pieces, 2) if pair[1] - pair[0] > 1]
    if not pairs:
        return 0
    first, second = np.array(pairs).T
    apart = [
        _side(starts[one], ends[one], starts[other]) * _side(starts[one], ends[one], ends[other]) < 0.0
        for one, other in ((first, second), (second, first))
    ]
    return int((apart[0] & apart[1]).sum())


def off_field(field: DirectionField, curves: SurfaceCurves) -> tuple[FloatArray, FloatArray]:
    """Return the angle between each piece of curves and the nearest line of its triangle [rad], and its length [mm]."""
    surface = field.surface
    faces, starts, ends = _pieces(surface, curves)
    along, lengths = ends - starts, np.linalg.norm(ends - starts, axis=1)
    turned = np.arctan2(along[:, 1], along[:, 0]) - field.angles[faces]
    return np.abs(np.angle(np.exp(1j * field.symmetry * turned))) / field.symmetry, lengths


def lines(surface: Surface, paths: Paths) -> list[FloatArray]:
    """Return the (k, 3) places of each stroke [mm]."""
    return [paths.curves.xyz(surface, curve) for curve in range(paths.curves.count)]


def _pieces(surface: Surface, curves: SurfaceCurves) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return the triangle of each piece, and where it starts and ends in its plane [mm]."""
    xyz = curves.points.xyz(surface)
    last = np.zeros(len(xyz), dtype=np.bool_)
    last[curves.offsets[1:] - 1] = True
    kept = np.flatnonzero(~last)
    faces = curves.points.faces[kept]
    along, across = (axis[faces] for axis in face_axes(surface))
    corner = surface.vertices[surface.faces[faces, 0]]
    flat = [
        np.column_stack([np.einsum("kx,kx->k", places - corner, axis) for axis in (along, across)])
        for places in (xyz[kept], xyz[kept + 1])
    ]
    off = xyz[kept + 1] - corner - flat[1][:, :1] * along - flat[1][:, 1:] * across
    assert np.linalg.norm(off, axis=1).max(initial=0.0) < 1e-9, "a piece leaves its triangle"
    return faces, flat[0], flat[1]


def _side(start: FloatArray, end: FloatArray, place: FloatArray) -> FloatArray:
    """Return on which side of lines places lie: positive on the left."""
    along, away = end - start, place - start
    return along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0]
