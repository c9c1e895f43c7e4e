"""Points on a surface: positions, normals, closest points, places in messages, directions from an axis."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from geoprint.errors import FieldError, InputError, MeshError
from geoprint.geometry.operators import mean_normal, vertex_normals
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfacePoints
from geoprint.transforms import smallest_rotation

if TYPE_CHECKING:
    from geoprint.geometry.rays import BoxTree


# Places of a mesh in messages: as words, and as numbers that an error or a report can carry.


def in_words(position: Iterable[float]) -> str:
    """Return a position [mm] as messages show it; zero has no sign.

    Examples:
        >>> import numpy as np
        >>> in_words(np.array([-0.001, -2.5, 0.125]))
        '(0.00, -2.50, 0.12) mm'
    """
    return f"({', '.join(f'{each:z.2f}' for each in position)}) mm"


def triple(position: FloatArray) -> tuple[float, ...]:
    """Return a position as plain numbers."""
    return tuple(position.tolist())


# Positions, normals and closest points: the one place where points on a surface become coordinates and back.


# Surfaces whose triangles are kept sorted: curves are resampled one by one on one surface, and measured on two others.
SURFACES_KEPT = 3
# Where the mean of three unit normals is shorter, they cancel out and its direction means nothing.
SHORTEST_MEAN_NORMAL = 1e-3


def positions(surface: Surface, points: SurfacePoints) -> FloatArray:
    """Return the (k, 3) positions [mm] of points on a surface.

    Raises:
        InputError: a point names a face that the surface does not have.
    """
    return points.xyz(surface)


def normals(surface: Surface, points: SurfacePoints, *, given: FloatArray | None = None) -> FloatArray:
    """Return the (k, 3) outward unit normals at points: the barycentric mean of those at the corners, normalised.

    Those of vertices vary continuously over the surface, also across edges.

    Args:
        surface: with n vertices.
        points: on it.
        given: unit normals, (n, 3) of its vertices or (m, 3, 3) of the corners of its faces; None: `vertex_normals`.

    Raises:
        InputError: a point names a face that the surface does not have.
        MeshError: a vertex has no normal, or three vertex normals cancel out at a point.
    """
    given = vertex_normals(surface) if given is None else given
    corners = given[points.corners(surface) if given.ndim == 2 else points.faces]
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
    from geoprint.geometry.rays import nearest_triangles
    from geoprint.kernels import writable

    corners, tree = _sorted_triangles(surface)
    faces = nearest_triangles(writable(xyz), corners, tree)
    weights, squares = closest_in_triangles(xyz, corners[faces])
    weights = np.clip(weights, 0.0, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    return SurfacePoints(faces=faces, weights=weights), np.sqrt(squares)


# A place may miss a surface by this [mm]: what is read off a screen is rounded.
PLACE_TOLERANCE = 1.0


def on_surface(
    surface: Surface, places: FloatArray, *, what: str, tolerance: float = PLACE_TOLERANCE
) -> tuple[SurfacePoints, FloatArray]:
    """Return what `closest` does of places that are meant to be on a surface.

    Args:
        surface: m faces.
        places: (k, 3) [mm].
        what: a place is called, with its number, from 1, for `{}`.
        tolerance: largest distance from the surface at which a place is still meant to be on it [mm].

    Raises:
        FieldError: a place is farther from the surface than that.
    """
    points, away = closest(surface, places)
    worst = int(np.argmax(away))
    if away[worst] > tolerance:
        raise FieldError(
            f"{what.format(worst + 1)}, {in_words(places[worst])}, lies {away[worst]:.3g} mm off {surface.name}, at "
            f"most {tolerance:g} mm is allowed; the nearest point of its surface is "
            f"{in_words(positions(surface, points)[worst])}.",
            distance=float(away[worst]),
            tolerance=tolerance,
        )
    return points, away


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
def _sorted_triangles(surface: Surface) -> tuple[FloatArray, BoxTree]:
    """Return the (m, 3, 3) corners of the triangles and the tree of them; of the same surface only once."""
    from geoprint.geometry.rays import box_tree

    corners = surface.vertices[surface.faces]
    return corners, box_tree(corners)


# Directions over a surface that are found again by whoever asks: counted from an axis of the part's coordinates.


# Where the mean normal is so nearly the x axis, as a cosine, the y axis stands in for it.
LEANING = 0.9


def direction_across(surface: Surface, *, angle: float) -> FloatArray:
    """Return the (3,) unit vector across the mean normal of a surface, at an angle.

    Args:
        surface: whose mean normal counts; the z axis stands in for that of a surface that has none, as a closed one.
        angle: counter-clockwise seen from outside [rad], from the x axis of the part's coordinates as it is seen along
            the mean normal, or from the y axis where the mean normal is within 26 degrees of x or -x.
    """
    upright = mean_normal(surface)
    upright = upright / np.linalg.norm(upright) if upright.any() else np.array([0.0, 0.0, 1.0])
    across = np.eye(3)[0 if abs(upright[0]) < LEANING else 1]
    across -= (across @ upright) * upright
    across /= np.linalg.norm(across)
    return np.cos(angle) * across + np.sin(angle) * np.cross(upright, across)


def upright_of(part: Surface) -> FloatArray:
    """Return the (3, 3) smallest rotation that turns a part's mean normal up; none where it has no mean normal."""
    mean = mean_normal(part)
    length = float(np.linalg.norm(mean))
    if length < np.finfo(np.float64).eps:
        return np.eye(3)
    return smallest_rotation(mean / length, np.array([[0.0, 0.0, 1.0]]))[0]
