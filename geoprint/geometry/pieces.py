"""Surfaces of several components: put together, taken apart; polylines and the length along them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.geometry.clipping import part_of
from geoprint.geometry.topology import component_labels, used_vertices
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfaceCurves, SurfacePoints, freeze_arrays, frozen

# Polylines in space: length along them, even points on them, and the straight distance to them.


# Nearest pieces that are looked at first: a piece's middle may be a little farther than another's and its end nearer.
CANDIDATES = 12
# Of so few pieces all are looked at: to sort them takes longer.
FEW = 48


# A length that is a whole number of steps but for this share of one is cut into so many: a descent from the dry run is
# as long as ten, and whoever reads targets back, rounded to 1e-6 mm, finds the same.
STEP_ROUNDING = 1e-5


def whole_steps(lengths: FloatArray | float, *, step: float = 1.0) -> IntArray:
    """Return into how many even parts lengths are cut, none of them longer than a step; into one at least.

    Args:
        lengths: of any shape, in the unit of the step.
        step: largest part.

    Examples:
        >>> whole_steps(np.array([0.0, 2.5, 3.0000000001]))
        array([1, 3, 3])
    """
    return np.maximum(np.ceil(np.asarray(lengths) / step - STEP_ROUNDING), 1.0).astype(np.int64)


def arc_lengths(points: FloatArray) -> FloatArray:
    """Return (k,) length along a polyline of (k, 3) points from its start [mm].

    Examples:
        >>> arc_lengths(np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0], [3.0, 4.0, 1.0]]))
        array([0., 5., 6.])
    """
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def even_points(points: FloatArray, *, step: float) -> FloatArray:
    """Return points along a polyline at even distances of at most one step, ends included.

    Args:
        points: (k, 3) corners, k >= 2.
        step: [mm].

    Returns:
        (j, 3) points, j >= 2.

    Examples:
        >>> even_points(np.array([[0.0, 0, 0], [3, 0, 0]]), step=1.6)[:, 0]
        array([0. , 1.5, 3. ])
    """
    arcs = arc_lengths(points)
    stations: FloatArray = np.linspace(0.0, float(arcs[-1]), int(whole_steps(arcs[-1], step=step)) + 1)
    return np.column_stack([np.interp(stations, arcs, points[:, i]) for i in range(points.shape[1])])


@final
class PolylineDistance:
    """Answers how far points are from a set of polylines.

    Args:
        lines: (k, 3) corners of each, k >= 2.
        step: the lines are cut into pieces of at most this length [mm] to find the near ones; it sets speed, not
            accuracy: about a twentieth of the usual distance is quickest.
    """

    def __init__(self, lines: Sequence[FloatArray], *, step: float) -> None:
        cut = [_cut(line, step=step) for line in lines]
        self._starts = np.vstack([line[:-1] for line in cut])
        self._along = np.vstack([np.diff(line, axis=0) for line in cut])
        self._tree = KDTree(self._starts + 0.5 * self._along) if len(self._starts) > FEW else None
        self._reach = 0.5 * float(np.linalg.norm(self._along, axis=1).max())

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the (k,) straight distance from each of (k, 3) points to the nearest polyline [mm]."""
        if self._tree is None:
            return _to_segments(points, self._starts, self._along)
        distances = np.empty(len(points))
        open_points, count = np.arange(len(points)), CANDIDATES
        while open_points.size:
            count = min(count, len(self._starts))
            middles, near = self._tree.query(points[open_points], k=count)
            near, horizon = (np.reshape(each, (open_points.size, -1)) for each in (near, middles))
            best = _to_segments(points[open_points], self._starts[near], self._along[near])
            # No piece beyond the horizon of middles reaches closer than the best so far.
            settled = (horizon[:, -1] - self._reach >= best) | (count == len(self._starts))
            distances[open_points[settled]] = best[settled]
            open_points, count = open_points[~settled], 2 * count
        return distances


def _to_segments(points: FloatArray, starts: FloatArray, along: FloatArray) -> FloatArray:
    """Return the (k,) distance of (k, 3) points from the nearest of segments: (s, 3) for all or (k, s, 3) for each."""
    away = points[:, None] - starts
    squared = np.maximum((along**2).sum(axis=-1), np.finfo(np.float64).tiny)
    share = np.clip((away * along).sum(axis=-1) / squared, 0.0, 1.0)
    return np.sqrt(((away - share[..., None] * along) ** 2).sum(axis=-1).min(axis=1))


def _cut(points: FloatArray, *, step: float) -> FloatArray:
    """Return the corners of a polyline with as many points between each two that no piece is longer than a step."""
    sides = np.diff(points, axis=0)
    parts = whole_steps(np.linalg.norm(sides, axis=1), step=step)
    if (parts == 1).all():
        return points
    side = np.repeat(np.arange(int(parts.size)), parts)
    shares = (np.arange(side.size) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[side]
    return np.vstack([points[side] + shares[:, None] * sides[side], points[-1:]])


# Surfaces in several pieces: put together, taken apart, and curves numbered as on one piece or as on the whole.


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
    return SurfaceCurves(curves.points[rows], offsets, curves.closed[chosen])


def all_curves(parts: Sequence[SurfaceCurves]) -> SurfaceCurves:
    """Return the curves of several sets on one surface as one set, in their order."""
    starts = np.cumsum([0, *(part.points.faces.size for part in parts)])
    return SurfaceCurves(
        SurfacePoints.chained([part.points for part in parts]),
        np.concatenate([[0], *(part.offsets[1:] + start for part, start in zip(parts, starts, strict=False))]),
        np.concatenate([part.closed for part in parts]),
    )


def middle_of(surface: Surface) -> FloatArray:
    """Return the (3,) vertex that is nearest to the mean of all: a place on the surface to find it by [mm]."""
    away = np.linalg.norm(surface.vertices - surface.vertices.mean(axis=0), axis=1)
    return surface.vertices[int(away.argmin())]
