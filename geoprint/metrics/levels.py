"""Distance accuracy: how far contours lie from the distance they promise, and from the level outside them."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.geometry import closest, positions
from geoprint.metrics.deposited import Samples, deposited_rows
from geoprint.metrics.oracle import (
    WINDOWS_IN_ALL,
    Ask,
    FlatMesh,
    GeodesicDistance,
    Places,
    SurfacePath,
    flat_places,
    spatial,
    trace,
)
from geoprint.metrics.spacing import (
    SAMPLES_PER_SPACING,
    JudgedSurface,
    SpacingFigures,
    cut_evenly,
    meeting_share,
    outer_distance,
)
from geoprint.model import (
    Count,
    FloatArray,
    IntArray,
    Place,
    PoseStream,
    Rounded,
    Source,
    Surface,
    SurfaceCurves,
    Table,
    freeze_arrays,
    frozen,
    recorded,
    table_of,
)

# How far each level of paths lies from the level outside it, over the surface.
#
# For exact level sets of an exact distance every point of level k is one spacing away from level k - 1. A run that
# goes through several levels, as a spiral does and rows joined by turns, has no level as a whole.


# Samples nearer together than this many spacings are one of the worst places.
WORST_APART = 2.0


@final
@recorded("LevelRecord")
class LevelSpacing:
    """The spacing of one level to the one outside.

    Attributes:
        level: number of the level.
        mean: mean distance to the level outside, over the spacing.
        cv: standard deviation of the distance to the level outside, over its mean.
        worst: distance to the level outside, over the spacing, where that is farthest from 1.
    """

    level: Count
    mean: Rounded
    cv: Rounded
    worst: Rounded


@final
@recorded("WorstPlaceRecord", place="place_mm")
class WorstPlace:
    """A place where the spacing is far from wanted.

    Attributes:
        place: point on the surface, x, y, z [mm].
        level: number of the level of the run there.
        ratio: distance to the level outside, over the spacing.
    """

    place: Place
    level: Count
    ratio: Rounded


@final
@frozen
class LevelSpacings:
    """Distances to the level outside, over the spacing: 1 is ideal. With a single level k is 0, and they are NaN.

    Attributes:
        places: (k, 3) samples along the runs of every level but the first, run after run [mm].
        offsets: (r + 1,) samples of stretch i are `places[offsets[i]:offsets[i + 1]]`; a run, or a part of one.
        runs: (k,) run of the stream that each sample lies on.
        levels: (k,) level of each sample.
        ratios: (k,) distance of each sample to the nearest run of the level before, over the spacing.
        bounds: (k,) lower bound of the ratio; equal to it where it is exact.
        straight: (k,) the same ratio through the air; less where the surface bends within a spacing.
        unreached: samples from which no way over the surface to the level outside was found; they are left out above.
        meeting: share of the samples within one spacing of another stretch of their own level, where fronts meet.
    """

    places: FloatArray
    offsets: IntArray
    runs: IntArray
    levels: IntArray
    ratios: FloatArray
    bounds: FloatArray
    straight: FloatArray
    unreached: int
    meeting: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self, places="float: k 3", offsets="int: o", runs="int: k", levels="int: k", ratios="float: k",
            bounds="float: k", straight="float: k",
        )  # fmt: skip

    @property
    def figures(self) -> SpacingFigures:
        """Mean, variation and percentiles of the ratios."""
        return SpacingFigures(self.ratios)

    @property
    def bounded(self) -> float:
        """Share of samples whose ratio is not exact but lies between its bound and what is given."""
        return float((self.bounds < self.ratios).mean()) if self.ratios.size else 0.0

    @property
    def largest_doubt(self) -> float:
        """Largest difference between a ratio and its lower bound."""
        return float((self.ratios - self.bounds).max(initial=0.0))

    def table(self) -> Table:
        """Return a row for each level but the outermost, which has no neighbour.

        Its columns are level, samples, and mean, cv and worst of the spacing to the level outside, over the wanted one:
        1, 0 and 1 are ideal.
        """
        levels, samples = np.unique(self.levels, return_counts=True)
        mean, cv, worst = np.array([(each.mean, each.cv, each.worst) for each in self.by_level()]).reshape(-1, 3).T
        return table_of({"level": levels, "samples": samples, "mean": mean, "cv": cv, "worst": worst})

    def by_level(self) -> tuple[LevelSpacing, ...]:
        """Return the spacing of every level to the one outside."""
        found: list[LevelSpacing] = []
        for level in np.unique(self.levels):
            here = SpacingFigures(self.ratios[self.levels == level])
            worst = here.ratios[np.argmax(np.abs(here.ratios - 1.0))]
            found.append(LevelSpacing(int(level), here.mean, here.cv, float(worst)))
        return tuple(found)

    def worst(self, count: int, *, spacing: float) -> tuple[WorstPlace, ...]:
        """Return the places whose ratio is farthest from 1, each at least two spacings [mm] from the others."""
        remaining = np.argsort(-np.abs(self.ratios - 1.0), kind="stable")
        found: list[WorstPlace] = []
        while remaining.size and len(found) < count:
            first = remaining[0]
            x, y, z = self.places[first].tolist()
            found.append(WorstPlace((x, y, z), int(self.levels[first]), float(self.ratios[first])))
            away = np.linalg.norm(self.places[remaining] - self.places[first], axis=1)
            remaining = remaining[away > WORST_APART * spacing]
        return tuple(found)


def levelled(poses: PoseStream) -> bool:
    """Return whether every deposited run of a stream keeps to one level."""
    rows = deposited_rows(poses)
    runs, levels = poses.runs[rows], poses.levels[rows]
    return bool((np.diff(levels)[np.diff(runs) == 0] == 0).all())


def level_spacings(
    mesh: FlatMesh, path: SurfacePath, distance: GeodesicDistance, samples: Samples, *, runs: IntArray, spacing: float
) -> LevelSpacings:
    """Measure from every level but the first to the one outside.

    Args:
        mesh: m triangles.
        path: r runs on it, each of one level.
        distance: to the path.
        samples: along all of its runs.
        runs: (r,) what they are called.
        spacing: wanted [mm].
    """
    chosen = samples.some(np.flatnonzero(path.levels[samples.runs] > path.levels.min()))
    outer = outer_distance(mesh, path, distance, chosen, spacing=spacing)
    reached = np.isfinite(outer.distances)
    measured = chosen.some(reached)
    return LevelSpacings(
        places=spatial(mesh, measured.places),
        offsets=np.append(np.flatnonzero(np.diff(measured.runs, prepend=-1)), measured.runs.size),
        runs=runs[measured.runs],
        levels=path.levels[measured.runs],
        ratios=outer.distances[reached] / spacing,
        bounds=outer.bounds[reached] / spacing,
        straight=outer.straight[reached] / spacing,
        unreached=int((~reached).sum()),
        meeting=meeting_share(path, distance, measured, spacing=spacing),
    )


# How far contours lie from the distance that they promise: level k at k + 1/2 spacings from the source.
#
# This is a property of the backend, and tells backends apart. How even a print is, `evenness` says: paths that are
# fitted to the width where fronts meet leave their distance on purpose.


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
    judged: JudgedSurface,
    source: Source,
    curves: SurfaceCurves,
    promised: FloatArray,
    *,
    surface: Surface,
    spacing: float,
    windows: int = WINDOWS_IN_ALL,
) -> DistanceErrors:
    """Measure how far curves lie from where they promise to lie.

    Args:
        judged: the part over which ways lead.
        source: where distance is zero.
        curves: with k points in all.
        promised: (k,) distance from the source at which each point promises to lie [mm].
        surface: the part with the triangles that source and curves were made on.
        spacing: between neighbouring curves [mm].
        windows: budget of work.

    Raises:
        FieldError: neighbouring points of the source have no connection over the part.
    """
    fine, mesh = judged
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


def _source_path(mesh: FlatMesh, places: Places, source: Source) -> SurfacePath:
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
