"""How far contours lie from the distance that they promise: level k at k + 1/2 spacings from the source.

This is a property of the backend, and tells backends apart. How even a print is, `evenness` says: paths that are fitted
to the width where fronts meet leave their distance on purpose.
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import FloatArray, IntArray, Seed, Surface, SurfaceCurves, freeze_arrays, frozen
from geoprint.quality.oracle import (
    WINDOWS_IN_ALL,
    Ask,
    FlatMesh,
    GeodesicDistance,
    Places,
    SurfacePath,
    flat_mesh,
    flat_places,
    spatial,
    trace,
)
from geoprint.quality.spacing import LARGEST_TRIANGLE, SAMPLES_PER_SPACING, cut_evenly
from geoprint.surfaces import closest, positions
from geoprint.surfaces.remesh import refine

# A way that is longer than promised by more than this share and this many spacings takes a second, wider search.
LONGER_SHARE, LONGER_SPACINGS = 0.02, 0.25
# Pieces per spacing into which the source is cut to find how far it is through the air.
PIECES_PER_SPACING = 8


@final
@frozen
class DistanceErrors:
    """How much farther from the source than promised curves lie, by the shortest way over the surface.

    Attributes:
        places: (k, 3) samples at even distances along the curves [mm].
        errors: (k,) distance from the source less the promised one, over the spacing.
        unknown: share of the samples for which the budget of work did not suffice; they are left out above.
    """

    places: FloatArray
    errors: FloatArray
    unknown: float

    def __post_init__(self) -> None:
        freeze_arrays(self, places="float: k 3", errors="float: k")

    @property
    def mean(self) -> float:
        """Mean of the errors, in spacings; 0 of no samples."""
        return float(self.errors.mean()) if self.errors.size else 0.0

    @property
    def deviation(self) -> float:
        """Standard deviation of the errors, in spacings; 0 of no samples."""
        return float(self.errors.std()) if self.errors.size else 0.0

    @property
    def largest(self) -> float:
        """Largest error to either side, in spacings."""
        return float(np.abs(self.errors).max(initial=0.0))


def distance_errors(
    part: Surface,
    source: Seed,
    curves: SurfaceCurves,
    promised: FloatArray,
    *,
    surface: Surface,
    spacing: float,
    windows: int = WINDOWS_IN_ALL,
) -> DistanceErrors:
    """Measure how far curves lie from where they promise to lie.

    Args:
        part: over which ways lead.
        source: where distance is zero.
        curves: with k points in all.
        promised: (k,) distance from the source at which each point promises to lie [mm].
        surface: the part with the triangles that source and curves were made on.
        spacing: between neighbouring curves [mm].
        windows: budget of work.

    Raises:
        FieldError: neighbouring points of the source have no connection over the part.
    """
    mesh = flat_mesh(fine := refine(part, edge_length=LARGEST_TRIANGLE * spacing))
    path = _source_path(mesh, flat_places(mesh, closest(fine, positions(surface, source.curves.points))[0]), source)
    points = np.column_stack([positions(surface, curves.points), promised])
    sampled = _along(points, curves.offsets, step=spacing / SAMPLES_PER_SPACING)
    places, wanted = flat_places(mesh, closest(fine, sampled[:, :3])[0]), sampled[:, 3]
    least = _least(mesh, fine, path, step=spacing / PIECES_PER_SPACING)
    distance = GeodesicDistance(mesh, path, windows=windows)
    limits = (1.0 + LONGER_SHARE) * wanted + LONGER_SPACINGS * spacing
    found = distance(places, Ask.anything(limits=limits), least=least)
    distances, complete = found.distances.copy(), found.complete.copy()
    farther = np.flatnonzero(complete & np.isinf(distances))
    if farther.size:
        found = distance(places.some(farther), Ask.anything(limits=np.full(farther.size, np.inf)), least=least)
        distances[farther], complete[farther] = found.distances, found.complete
    known = complete & np.isfinite(distances)
    return DistanceErrors(
        spatial(mesh, places.some(known)),
        (distances - wanted)[known] / spacing,
        float(1.0 - known.mean()) if known.size else 0.0,
    )


def _source_path(mesh: FlatMesh, places: Places, source: Seed) -> SurfacePath:
    """Connect the (k,) places of a source over the mesh; a point is a run of its own, of no length."""
    sizes = np.diff(source.curves.offsets)
    lines, runs = np.flatnonzero(sizes > 1), np.repeat(np.arange(sizes.size), sizes)
    of_lines = np.repeat(sizes > 1, sizes)
    path = trace(
        mesh, places.some(of_lines), runs=np.searchsorted(lines, runs[of_lines]),
        levels=np.zeros(lines.size, dtype=np.int64), closed=source.curves.closed[lines],
    )  # fmt: skip
    dots, none = places.some(~of_lines), np.zeros(int((~of_lines).sum()))
    return SurfacePath(
        faces=np.append(path.faces, dots.faces),
        starts=np.append(path.starts, dots.flat),
        ends=np.append(path.ends, dots.flat),
        runs=np.append(path.runs, lines.size + np.arange(none.size)),
        arcs=np.append(path.arcs, none),
        lengths=np.append(path.lengths, none),
        levels=np.zeros(sizes.size, dtype=np.int64),
        closed=np.append(path.closed, none > 0.0),
    )


def _along(points: FloatArray, offsets: IntArray, *, step: float) -> FloatArray:
    """Return (s, 4) samples at even distances of at most a step along polylines, none of them an end.

    Args:
        points: (k, 4) of all polylines, end to end; the last column is a number at each [mm].
        offsets: (c + 1,) where each polyline begins.
        step: [mm].
    """
    sides = np.linalg.norm(np.diff(points[:, :3], axis=0), axis=1)
    sides[offsets[1:-1] - 1] = 0.0
    arcs = np.concatenate([[0.0], np.cumsum(sides)])
    starts = arcs[offsets[:-1]]
    owner, shares, _ = cut_evenly((lengths := arcs[offsets[1:] - 1] - starts), step=step)
    at = starts[owner] + shares * lengths[owner]
    return np.column_stack([np.interp(at, arcs, points[:, k]) for k in range(points.shape[1])])


def _least(mesh: FlatMesh, surface: Surface, path: SurfacePath, *, step: float) -> FloatArray:
    """Return how far (3 m,) half-edges are at least from a path through the air: over the surface they are farther."""
    starts, ends = (spatial(mesh, Places(path.faces, flat)) for flat in (path.starts, path.ends))
    owner, shares, _ = cut_evenly(np.linalg.norm(ends - starts, axis=1), step=step)
    middles = starts[owner] + shares[:, None] * (ends - starts)[owner]
    away: FloatArray = np.asarray(KDTree(middles).query(surface.vertices)[0], dtype=np.float64) - 0.5 * step
    # Along an edge distance changes by no more than its length.
    both = away[mesh.starts.reshape(-1, 3)]
    return np.maximum(0.5 * (both + np.roll(both, -1, axis=1)).ravel() - mesh.halves, 0.0)
