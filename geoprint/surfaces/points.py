"""Positions, normals and closest points: the one place where points on a surface become coordinates and back."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import InputError, MeshError
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfacePoints
from geoprint.surfaces.operators import vertex_normals

# Triangles asked for at first; doubled for the points that are not settled by them.
FIRST_CANDIDATES = 8
# Point-triangle pairs worked on at a time: about 300 MB of intermediate arrays.
PAIRS_AT_A_TIME = 500_000
# Triangles of one search tree differ in size by at most this factor, so that one large triangle does not widen
# the search among small ones.
SIZE_CLASS_FACTOR = 2.0
# Surfaces whose triangles are kept sorted: curves are resampled one by one, on the same surface.
SURFACES_KEPT = 2
# Where the mean of three unit normals is shorter, they cancel out and its direction means nothing.
SHORTEST_MEAN_NORMAL = 1e-3


def positions(surface: Surface, points: SurfacePoints) -> FloatArray:
    """Return the (k, 3) positions [mm] of points on a surface.

    Raises:
        InputError: a point names a face that the surface does not have.
    """
    return points.xyz(surface)


def normals(surface: Surface, points: SurfacePoints) -> FloatArray:
    """Return the (k, 3) outward unit normals at points: the barycentric mean of the vertex normals, normalised.

    They vary continuously over the surface, also across edges.

    Raises:
        InputError: a point names a face that the surface does not have.
        MeshError: a vertex has no normal, or three vertex normals cancel out at a point.
    """
    corners = vertex_normals(surface)[points.corners(surface)]
    mean = np.einsum("kc,kcx->kx", points.weights, corners)
    lengths = np.linalg.norm(mean, axis=1)
    if lengths.min(initial=1.0) < SHORTEST_MEAN_NORMAL:
        face = int(points.faces[np.argmin(lengths)])
        raise MeshError(
            f"{surface.name}: the normals at the corners of face {face} cancel out, so it has no outside; "
            "smooth the surface there or use a finer mesh.",
            face=face,
        )
    return mean / lengths[:, None]


def vertex_points(surface: Surface, vertices: IntArray) -> SurfacePoints:
    """Return vertices as points on a surface.

    Args:
        surface: n vertices.
        vertices: (k,) vertex indices.

    Returns:
        (k,) points, each in the incident face of the smallest index, with all its weight on one corner.

    Raises:
        InputError: a vertex does not exist or no face uses it.
    """
    corner_of = np.full(len(surface.vertices), -1, dtype=np.int64)
    flat = surface.faces.ravel()
    # Later assignments win, so that reversed order leaves the first corner of each vertex.
    corner_of[flat[::-1]] = np.arange(flat.size)[::-1]
    if vertices.size and (vertices.min() < 0 or vertices.max() >= corner_of.size):
        raise InputError(f"{surface.name} has vertices 0 to {corner_of.size - 1}, asked for {vertices.max()}.")
    corners = corner_of[vertices]
    if corners.min(initial=0) < 0:
        lost = int(vertices[np.argmin(corners)])
        raise InputError(f"{surface.name}: vertex {lost} belongs to no face, so it is not on the surface.", vertex=lost)
    return SurfacePoints(faces=corners // 3, weights=np.eye(3)[corners % 3])


def closest(surface: Surface, xyz: FloatArray) -> tuple[SurfacePoints, FloatArray]:
    """Return the closest points of a surface, exact up to rounding.

    Triangles are sought by their centres in one k-d tree for each class of sizes; those whose centre is farther than
    the best distance plus their own radius are left out. A point is settled once the next centre is farther than the
    best distance plus the largest radius of the class: no triangle beyond can be closer.

    Args:
        surface: m faces.
        xyz: (k, 3) positions [mm].

    Returns:
        (k,) points on the surface and their (k,) distances [mm]. Of equally close triangles any one is returned.

    Raises:
        InputError: xyz does not have shape (k, 3) or is not finite.
    """
    if xyz.ndim != 2 or xyz.shape[1] != 3 or not np.isfinite(xyz).all():
        raise InputError(f"closest points need finite positions of shape (k, 3), found shape {xyz.shape}.")
    search = _Search(surface, xyz)
    for alike in _size_classes(surface):
        search.among(alike)
    weights = np.clip(search.weights, 0.0, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    return SurfacePoints(faces=search.faces, weights=weights), np.sqrt(search.squares)


class _Alike(NamedTuple):
    """Similarly large triangles: their indices, their centres in a tree, and how far each reaches from its own [mm]."""

    members: IntArray
    tree: KDTree
    radii: FloatArray


class _Search:
    """The best triangle found so far for each of k positions; lives only inside `closest`."""

    def __init__(self, surface: Surface, xyz: FloatArray) -> None:
        self.corners = surface.vertices[surface.faces]
        self.xyz = xyz
        self.faces = np.zeros(len(xyz), dtype=np.int64)
        self.weights = np.tile([1.0, 0.0, 0.0], (len(xyz), 1))
        self.squares = np.full(len(xyz), np.inf)

    def among(self, alike: _Alike) -> None:
        """Improve the best by similarly large triangles."""
        members, tree, radii = alike
        radius = float(radii.max())
        open_points = np.arange(len(self.xyz))
        seen, wanted = 0, min(FIRST_CANDIDATES, len(members))
        while open_points.size and seen < len(members):
            reach = np.empty(open_points.size)
            step = max(1, PAIRS_AT_A_TIME // wanted)
            for first in range(0, open_points.size, step):
                block = open_points[first : first + step]
                ranks = np.arange(seen + 1, wanted + 1)
                answer = tree.query(self.xyz[block], k=ranks)
                distances, found = np.asarray(answer[0]), np.asarray(answer[1], dtype=np.int64)
                # The triangle of the nearest centre comes first: it rules out most of the others.
                for tried in (slice(0, 1), slice(1, None)):
                    near = distances[:, tried] - radii[found[:, tried]] < np.sqrt(self.squares[block])[:, None]
                    self._improve(block[np.nonzero(near)[0]], members[found[:, tried][near]])
                reach[first : first + step] = distances[:, -1]
            open_points = open_points[reach - radius < np.sqrt(self.squares[open_points])]
            seen, wanted = wanted, min(2 * wanted, len(members))

    def _improve(self, points: IntArray, candidates: IntArray) -> None:
        """Set the best of points given (p,) points, each as often as it has candidate faces, and (p,) these faces."""
        weights, squares = closest_in_triangles(self.xyz[points], self.corners[candidates])
        order = np.lexsort((squares, points))
        best = order[np.diff(points[order], prepend=-1) != 0]
        best = best[squares[best] < self.squares[points[best]]]
        rows = points[best]
        self.faces[rows], self.weights[rows], self.squares[rows] = candidates[best], weights[best], squares[best]


def closest_in_triangles(points: FloatArray, corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the closest point of one triangle to one position, pair by pair.

    The foot of the perpendicular, where it falls into the triangle, else the closest point of the three sides; a
    triangle without area is its sides.

    Args:
        points: (k, 3) positions [mm].
        corners: (k, 3, 3) corners of the triangles [mm].

    Returns:
        (k, 3) barycentric weights and (k,) squared distances [mm2].
    """
    along = corners[:, [1, 2, 0]] - corners
    squares = np.einsum("kcx,kcx->kc", along, along)
    shares = np.einsum("kcx,kcx->kc", points[:, None, :] - corners, along) / np.where(squares > 0, squares, 1.0)
    shares = np.clip(shares, 0.0, 1.0)
    offsets = corners + shares[:, :, None] * along - points[:, None, :]
    side_squares = np.einsum("kcx,kcx->kc", offsets, offsets)
    pair, side = np.arange(len(points)), np.argmin(side_squares, axis=1)
    weights = np.zeros((len(points), 3))
    weights[pair, side] = 1.0 - shares[pair, side]
    weights[pair, (side + 1) % 3] = shares[pair, side]
    feet, inside = _perpendicular_feet(points, corners)
    offset = np.einsum("kc,kcx->kx", feet, corners) - points
    best = side_squares[pair, side]
    best[inside] = np.einsum("kx,kx->k", offset[inside], offset[inside])
    return np.where(inside[:, None], feet, weights), best


def _perpendicular_feet(points: FloatArray, corners: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return (k, 3) weights of the feet of perpendiculars, and (k,) whether a foot lies in its triangle."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(first, second)
    square = np.einsum("kx,kx->k", normal, normal)
    scale = np.where(square > 0, square, 1.0)
    offset = points - corners[:, 0]
    along_first = np.einsum("kx,kx->k", np.cross(offset, second), normal) / scale
    along_second = np.einsum("kx,kx->k", np.cross(first, offset), normal) / scale
    weights = np.column_stack([1.0 - along_first - along_second, along_first, along_second])
    return weights, (square > 0) & (weights >= 0.0).all(axis=1)


@lru_cache(maxsize=SURFACES_KEPT)
def _size_classes(surface: Surface) -> tuple[_Alike, ...]:
    """Return the classes of similarly large triangles, the smallest first; of the same surface only once."""
    corners = surface.vertices[surface.faces]
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None, :], axis=2).max(axis=1)
    floor = max(float(radii.max()), np.finfo(np.float64).tiny) * np.finfo(np.float64).eps
    classes = np.floor(np.log(np.maximum(radii, floor)) / np.log(SIZE_CLASS_FACTOR)).astype(np.int64)
    groups = [np.flatnonzero(classes == size) for size in np.unique(classes)]
    return tuple(_Alike(members, KDTree(centres[members]), radii[members]) for members in groups)
