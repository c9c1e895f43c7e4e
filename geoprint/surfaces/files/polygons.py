"""Polygons of mesh files cut into triangles: convex ones into fans, others by their ears.

A polygon of n corners always becomes n - 2 triangles, corners in line with their neighbours among them: its edges stay
those of the faces next to it.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from geoprint.errors import InputError
from geoprint.model import FloatArray, IntArray
from geoprint.surfaces.files.mesh_file import check_indices
from geoprint.surfaces.operators import doubled_area_vectors

# The triangles of a polygon cover its area, seen along its normal, but for this share.
AREA_TOLERANCE = 1e-6


class Triangles(NamedTuple):
    """The triangles of polygons.

    Attributes:
        faces: (m, 3) vertex indices, polygon by polygon.
        polygon: (m,) which polygon each comes from.
        concave: how many polygons are not convex.
    """

    faces: IntArray
    polygon: IntArray
    concave: int


def triangulated(vertices: FloatArray, sizes: IntArray, corners: IntArray, *, name: str) -> Triangles:
    """Cut polygons into triangles.

    Args:
        vertices: (n, 3).
        sizes: (p,) corners of each polygon, 3 or more.
        corners: vertex indices of all polygons, end to end.
        name: of the file.

    Raises:
        InputError: a corner is no vertex, or a polygon crosses itself.
    """
    starts = np.cumsum(sizes) - sizes
    polygon = np.repeat(np.arange(sizes.size), sizes - 2)
    places = np.arange(polygon.size) - np.repeat(np.cumsum(sizes - 2) - (sizes - 2), sizes - 2)
    first = starts[polygon]
    faces = np.column_stack([corners[first], corners[first + places + 1], corners[first + places + 2]])
    check_indices(faces, vertices=len(vertices), name=name)
    if polygon.size == sizes.size:
        return Triangles(faces, polygon, 0)
    with np.errstate(invalid="ignore", over="ignore"):  # the caller refuses what is not finite
        areas = doubled_area_vectors(vertices, faces)
        total = np.column_stack([np.bincount(polygon, areas[:, axis]) for axis in range(3)])
        # A fan whose triangles do not all face to the same side would overlap itself.
        turned = np.bincount(polygon, np.einsum("mx,mx->m", areas, total[polygon]) < 0) > 0
        # The halves of a bow tie outweigh each other.
        turned |= np.linalg.norm(total, axis=1) < AREA_TOLERANCE * np.bincount(polygon, np.linalg.norm(areas, axis=1))
    overlapping = np.flatnonzero(turned)
    for number, row in zip(overlapping.tolist(), np.searchsorted(polygon, overlapping).tolist(), strict=True):
        ring = corners[starts[number] : starts[number] + sizes[number]]
        cut = _by_ears(vertices[ring], total[number])
        if cut is None:
            raise InputError(
                f"`{name}`: a polygon of {ring.size} corners crosses itself, the first at "
                f"{vertices[ring[0]].tolist()}; triangulate the mesh in the program that made it.",
                polygon=number,
            )
        faces[row : row + ring.size - 2] = ring[cut]
    return Triangles(faces, polygon, overlapping.size)


def _by_ears(ring: FloatArray, normal: FloatArray) -> IntArray | None:
    """Return (k - 2, 3) triangles of (k, 3) corners, or None where they do not make one polygon.

    Args:
        ring: corners in their order.
        normal: of the polygon, of any length above 0.
    """
    import mapbox_earcut  # here, because few files need it

    length = float(np.linalg.norm(normal))
    if not (np.isfinite(ring).all() and length > 0.0):
        return None
    across = np.eye(3)[np.argmin(np.abs(normal))]
    first = np.cross(normal, across)
    first /= np.linalg.norm(first)
    flat = np.ascontiguousarray(np.column_stack([ring @ first, ring @ np.cross(normal / length, first)]))
    flat -= flat[0]
    ends = np.array([len(ring)], dtype=np.uint32)
    ears = np.asarray(mapbox_earcut.triangulate_float64(flat, ends), dtype=np.int64).reshape(-1, 3)
    if len(ears) == 0:
        return None
    # Corners in line with their neighbours make no ear; they get triangles without area.
    kept = np.unique(ears)
    flats = [
        (before, between, between + 1)
        for before, after in pairwise([*kept.tolist(), int(kept[0]) + len(ring)])
        for between in range(before + 1, after)
    ]
    cut = np.concatenate([ears, np.array(flats, dtype=np.int64).reshape(-1, 3) % len(ring)])
    a, b, c = (flat[cut[:, corner]] for corner in range(3))
    doubled = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    # The library winds its triangles its own way.
    if doubled.sum() < 0.0:
        cut[: len(ears)] = cut[: len(ears), ::-1]
        doubled[: len(ears)] *= -1.0
    allowed = AREA_TOLERANCE * length
    sound = len(cut) == len(ring) - 2 and doubled.min() >= -allowed
    return cut if sound and abs(doubled.sum() - length) <= allowed and _bounded_by(cut, len(ring)) else None


def _bounded_by(cut: IntArray, corners: int) -> bool:
    """Return whether triangles meet edge to edge, and leave just the edges of the ring."""
    halves = {(int(one), int(other)) for face in cut for one, other in zip(face, np.roll(face, -1), strict=True)}
    open_ = {(one, other) for one, other in halves if (other, one) not in halves}
    return len(halves) == 3 * len(cut) and open_ == {(at, (at + 1) % corners) for at in range(corners)}
