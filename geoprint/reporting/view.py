"""A part as it is drawn: from which sides, coarse enough for a browser, with beads as ribbons."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.geometry import boundary_half_edges, face_areas, face_normals, half_edges, vertex_normals
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen

# From which sides a part is drawn so that its whole surface is seen: one for most parts, several for wrapped ones.


# Surface that turns farther away from the reader than this [cosine of the angle] is too foreshortened to be read.
READABLE = 0.35
# A further side is drawn while it shows at least this share of the area anew; so many are enough for any part.
WORTH_A_SIDE = 0.08
MOST_SIDES = 4
# Directions in question, around the part and so far above or below its horizon [rad].
AROUND = 8
ELEVATIONS = (0.0, 0.6, -0.6)
# Cells along the longer side of the grid in which the foremost face hides those behind it.
CELLS = 60


def views(surface: Surface, upright: FloatArray) -> tuple[FloatArray, ...]:
    """Return (3, 3) rotations to the sides from which a part is drawn: x to the right, y up, z towards the reader.

    The first is from above; each further one is that of the directions around that shows most of what no one before it
    shows.

    Args:
        surface: the part.
        upright: (3, 3) rotation to the view from above.
    """
    areas = face_areas(surface) / face_areas(surface).sum()
    candidates = [_from(upright, azimuth, elevation) for elevation in ELEVATIONS for azimuth in _azimuths()]
    candidates.append(np.diag([1.0, -1.0, -1.0]) @ upright)
    shown = [readable(surface, R_view_work) for R_view_work in candidates]
    chosen, seen = [upright], readable(surface, upright)
    while len(chosen) < MOST_SIDES:
        gains = [float(areas[faces & ~seen].sum()) for faces in shown]
        best = int(np.argmax(gains))
        if gains[best] < WORTH_A_SIDE:
            break
        chosen.append(candidates[best])
        seen |= shown[best]
    return tuple(chosen)


def _azimuths() -> list[float]:
    return [turn * (2.0 * np.pi / AROUND) for turn in range(AROUND)]


def _from(upright: FloatArray, azimuth: float, elevation: float) -> FloatArray:
    """Return the view of whoever stands around an upright part and looks at its middle."""
    c, s, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    towards, right = np.array([c * ce, s * ce, se]), np.array([-s, c, 0.0])
    return np.stack([right, np.cross(towards, right), towards]) @ upright


def readable(surface: Surface, R_view_work: FloatArray) -> BoolArray:
    """Tell which faces turn towards the reader and lie behind no other, to about the size of a cell."""
    seen = surface.vertices @ R_view_work.T
    middles = seen[surface.faces].mean(axis=1)
    low, high = seen.min(axis=0), seen.max(axis=0)
    cell = float((high - low)[:2].max()) / CELLS
    samples = np.concatenate([seen, middles])
    columns = ((samples[:, :2] - low[:2]) / cell).astype(np.int64)
    keys = columns[:, 0] * (CELLS + 2) + columns[:, 1]
    foremost = np.full((CELLS + 2) ** 2, -np.inf)
    np.maximum.at(foremost, keys, samples[:, 2])
    facing = face_normals(surface) @ R_view_work[2] > READABLE
    # Within a cell a readable face rises by at most its slope.
    return facing & (middles[:, 2] >= foremost[keys[len(seen) :]] - cell / READABLE)


# A surface coarse enough to be drawn in a browser, whose vertices are vertices of the original.


# Faces per cell that clustering a flat piece leaves: two triangles a grid cell, more where the grid cuts slantwise.
FACES_PER_CELL = 2.2
# Kinds of vertices that are kept apart: eight octants that they face, inside and on the border.
KINDS = 16
# Faces with less area, over that of a cell's side, are lines but for rounding.
FLAT_SHARE = 1e-9
# Cells grow by this factor until few enough faces are left.
GROWTH = 1.12


@final
@frozen
class ViewSurface:
    """A surface to look at.

    Attributes:
        surface: at most as many faces as asked for.
        vertices: (n,) which vertex of the original each of its vertices is: values[vertices] are the values on it.
    """

    surface: Surface
    vertices: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, vertices="int: n")


def view_surface(surface: Surface, *, faces: int = 100_000) -> ViewSurface:
    """Return the surface, thinned to be drawn: not to be measured.

    All vertices in a cell of a grid become the one nearest to their mean. Vertices of the border become one of the
    border, and sides of a thin wall that face different directions stay apart, so that neither is pulled in.

    Args:
        surface: any.
        faces: most faces it may have.

    Returns:
        The surface itself where it is small enough, else a coarser one.
    """
    if len(surface.faces) <= faces:
        return ViewSurface(surface, np.arange(len(surface.vertices)))
    cell = float(np.sqrt(FACES_PER_CELL * face_areas(surface).sum() / faces))
    kinds = _kinds(surface)
    while True:
        coarse = _clustered(surface, kinds, cell=cell)
        if len(coarse.surface.faces) <= faces:
            return coarse
        cell *= GROWTH


def shading_normals(surface: Surface) -> FloatArray:
    """Return (n, 3) unit normals for drawing; zero where faces cancel each other or none is there."""
    corners = surface.vertices[surface.faces]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.zeros_like(surface.vertices)
    for corner in range(3):
        np.add.at(total, surface.faces[:, corner], doubled)
    lengths = np.linalg.norm(total, axis=1, keepdims=True)
    return total / np.where(lengths > 0.0, lengths, 1.0)


def _kinds(surface: Surface) -> IntArray:
    """Return a number for each vertex; only equal ones may be merged: on the border or not, and facing alike."""
    octants: IntArray = (shading_normals(surface) > 0.0).astype(np.int64) @ np.array([1, 2, 4])
    border = half_edges(surface.faces)[boundary_half_edges(surface.faces)]
    octants[np.unique(border)] += KINDS // 2
    return octants


def _clustered(surface: Surface, kinds: IntArray, *, cell: float) -> ViewSurface:
    places = np.floor((surface.vertices - surface.vertices.min(axis=0)) / cell).astype(np.int64)
    keys = np.ravel_multi_index((*places.T, kinds), (*(places.max(axis=0) + 1), KINDS))
    _, clusters, counts = np.unique(keys, return_inverse=True, return_counts=True)
    means = np.column_stack([np.bincount(clusters, surface.vertices[:, axis]) / counts for axis in range(3)])
    away = np.linalg.norm(surface.vertices - means[clusters], axis=1)
    # The first vertex of each cluster when sorted by cluster, then by distance from its mean.
    order = np.lexsort([away, clusters])
    chosen = order[np.searchsorted(clusters[order], np.arange(len(counts)))]
    faces = clusters[surface.faces]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    faces = _without_folds(faces[whole])
    # Three vertices on a line show nothing, and have no normal.
    faces = faces[face_areas(Surface(surface.vertices[chosen], faces)) > FLAT_SHARE * cell**2]
    faces = with_normals(surface.vertices[chosen], faces)
    used, faces = np.unique(faces, return_inverse=True)
    return ViewSurface(Surface(surface.vertices[chosen[used]], faces.reshape(-1, 3), name=surface.name), chosen[used])


def with_normals(vertices: FloatArray, faces: IntArray) -> IntArray:
    """Return faces without those around a vertex at which they cancel: a fan folded flat onto itself shows nothing.

    Args:
        vertices: (n, 3) places [mm].
        faces: (m, 3).
    """
    while True:
        lengths: FloatArray = np.linalg.norm(shading_normals(Surface(vertices, faces)), axis=1)
        kept = (lengths[faces] > 0.0).all(axis=1)
        if kept.all():
            return faces
        faces = faces[kept]


def _without_folds(faces: IntArray) -> IntArray:
    """Return each triangle once; those with the same corners cancel where they are turned against each other."""
    ordered = np.sort(faces, axis=1)
    count = int(faces.max()) + 1
    keys = np.ravel_multi_index(tuple(ordered.T), (count, count, count))
    _, first, which = np.unique(keys, return_index=True, return_inverse=True)
    # A triangle is turned as its sorted corners are, or against them.
    smallest = np.take_along_axis(faces, ((np.argmin(faces, axis=1)[:, None] + [[0, 1, 2]]) % 3), axis=1)
    turned = np.where(smallest[:, 1] < smallest[:, 2], 1, -1)
    net = np.bincount(which, turned)
    kept = ordered[first]
    return np.where(net[:, None] > 0, kept, kept[:, [0, 2, 1]])[net != 0]


# Beads as they lie on a part: ribbons of their width on the surface, whose foreshortening is that of the part.


def bead_sides(
    surface: Surface, places: FloatArray, offsets: IntArray, *, width: float | FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the sides of beads whose middles run through given places.

    Args:
        surface: that they lie on.
        places: (k, 3) samples, run after run [mm].
        offsets: (r + 1,) where each run starts among them.
        width: of the beads, one for all or (k,) one a sample [mm].

    Returns:
        (k, 3) left and (k, 3) right side as seen from outside along the run [mm].
    """
    before, after = np.arange(len(places)) - 1, np.arange(len(places)) + 1
    before[offsets[:-1]], after[offsets[1:] - 1] = offsets[:-1], offsets[1:] - 1
    along = places[after] - places[before]
    across = np.cross(normals_at(surface, places), along)
    lengths = np.linalg.norm(across, axis=1, keepdims=True)
    half = 0.5 * np.reshape(width, (-1, 1)) * across / np.where(lengths > 0.0, lengths, 1.0)
    return places + half, places - half


def squares_on(surface: Surface, places: FloatArray, *, side: float) -> FloatArray:
    """Return (j, 4, 3) squares on a surface about (j, 3) places, turned as they come [mm]."""
    normals = normals_at(surface, places)
    # Any direction that is not along the normal serves.
    helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, helper)
    first *= 0.5 * side / np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normals, first)
    corners = [first + second, second - first, -first - second, first - second]
    return places[:, None] + np.stack(corners, axis=1)


def normals_at(surface: Surface, places: FloatArray) -> FloatArray:
    """Return the (k, 3) normals of the vertices nearest to (k, 3) places."""
    _, nearest = KDTree(surface.vertices).query(places)
    return vertex_normals(surface)[np.asarray(nearest, dtype=np.int64)]
