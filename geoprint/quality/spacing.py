"""Distance from every level of a path to the level outside it, over the surface; and what it shall be at a place."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias, final

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import VerificationError
from geoprint.model import BoolArray, FloatArray, IntArray, freeze_arrays, frozen
from geoprint.quality.deposited import Samples
from geoprint.quality.oracle import Ask, FlatMesh, GeodesicDistance, Places, SurfacePath, spatial
from geoprint.surfaces import PolylineDistance

# Returns the (k,) distance wanted to the neighbouring path at (k, 3) places on a part [mm].
SpacingAt: TypeAlias = Callable[[FloatArray], FloatArray]
# Samples per spacing along each run.
SAMPLES_PER_SPACING = 4
# Triangles are halved down to this many spacings first, so that none holds too many runs to look through.
LARGEST_TRIANGLE = 2.0
# Stretches of one run are two when they are farther apart along it than this many spacings.
APART = 2.0
# A sample within this share of the spacing is even.
EVEN = 0.05
# Pieces per spacing into which runs are cut to find the nearest one in space; then the distance to the piece is exact.
PIECES_PER_SPACING = 20
# A way over the surface may come out shorter than a straight line by rounding [mm].
ROUNDING = 1e-6


@final
@frozen
class SpacingFigures:
    """The spacing of samples over the wanted one; of no ratio the figures are not a number.

    Attributes:
        ratios: (k,) of the samples that have one; 1 is ideal.
        none: share of the samples that have no neighbour within three spacings.
        oblique: share that has one only obliquely, at an open end, or behind the path's own bend.
        unknown: share for which the budget of work did not suffice.
    """

    ratios: FloatArray
    none: float = 0.0
    oblique: float = 0.0
    unknown: float = 0.0

    def __post_init__(self) -> None:
        freeze_arrays(self, ratios="float: k")

    @property
    def measured(self) -> bool:
        """Whether there is a spacing at all."""
        return self.ratios.size > 0

    @property
    def mean(self) -> float:
        """Mean of the ratios."""
        return float(self.ratios.mean()) if self.measured else float("nan")

    @property
    def cv(self) -> float:
        """Coefficient of variation of the ratios: standard deviation over mean."""
        return float(self.ratios.std() / self.ratios.mean()) if self.measured else float("nan")

    @property
    def within_5_percent(self) -> float:
        """Share of the ratios within 5 % of the wanted spacing."""
        return float((np.abs(self.ratios - 1.0) <= EVEN).mean()) if self.measured else float("nan")

    def percentile(self, share: float) -> float:
        """Return a percentile of the ratios, share in percent."""
        return float(np.percentile(self.ratios, share)) if self.measured else float("nan")


@final
@frozen
class OuterDistance:
    """How far samples are from the level outside.

    Attributes:
        distances: (k,) length of the shortest way that was found; infinity where none was [mm].
        bounds: (k,) no way is shorter; equal to the distance where that is exact [mm].
        straight: (k,) distance through the air, to the runs cut into short even pieces [mm].
        runs: (k,) run to which the way leads, -1 where there is none.
        arcs: (k,) where on it the way ends [mm]; NaN for none.
    """

    distances: FloatArray
    bounds: FloatArray
    straight: FloatArray
    runs: IntArray
    arcs: FloatArray

    @property
    def exact(self) -> BoolArray:
        """(k,) whether the distance is exact."""
        return self.bounds >= self.distances


def outer_distance(
    mesh: FlatMesh, path: SurfacePath, distance: GeodesicDistance, samples: Samples, *, spacing: float
) -> OuterDistance:
    """Return the distance of samples of every level but the first to the nearest run of the level before.

    Where the budget of work does not suffice, a way towards the point that is nearest in space bounds the distance
    from above, and the straight distance from below.

    Args:
        mesh: m triangles.
        path: r runs.
        distance: to the path.
        samples: k samples along runs, none of the first level.
        spacing: wanted [mm].

    Raises:
        VerificationError: a way over the surface came out shorter than the straight line.
    """
    levels = np.unique(path.levels)
    outer = levels[np.searchsorted(levels, path.levels[samples.runs]) - 1]
    straight, least, aims = _in_space(mesh, path, samples, outer, step=spacing / PIECES_PER_SPACING)
    found = distance(samples.places, Ask.level(outer))
    distances, bounds = found.distances.copy(), found.bounds.copy()
    runs, arcs = found.runs.copy(), found.arcs.copy()
    left = np.flatnonzero(~found.complete)
    if left.size:
        ways = distance(samples.some(left).places, Ask.level(outer[left], aims=aims[left]))
        nearer = ways.distances < distances[left]
        for values, of_ways in ((distances, ways.distances), (runs, ways.runs), (arcs, ways.arcs)):
            values[left] = np.where(nearer, of_ways, values[left])
        bounds[left] = np.minimum(np.maximum(bounds[left], least[left]), distances[left])
    short = least - distances
    if short.max(initial=-np.inf) > ROUNDING:
        x, y, z = spatial(mesh, samples.places)[np.argmax(short)]
        raise VerificationError(
            f"the distance over the surface at ({x:.3f}, {y:.3f}, {z:.3f}) mm is {short.max():.3g} mm shorter than the "
            "straight one, which is impossible: this is a defect of geoprint; report it with the part."
        )
    return OuterDistance(distances, bounds, straight, runs, arcs)


def meeting_share(path: SurfacePath, distance: GeodesicDistance, samples: Samples, *, spacing: float) -> float:
    """Return the share of samples within one spacing of another stretch of their own level.

    There two fronts meet, near the medial axis of the surface, where level curves have corners and fields err most.
    Of no samples it is 0.

    Args:
        path: r runs.
        distance: to the path.
        samples: k samples along runs.
        spacing: wanted [mm].
    """
    levels, limits = path.levels[samples.runs], np.full(samples.runs.size, spacing)
    ask = Ask.elsewhere(levels, samples.runs, samples.arcs, clear=APART * spacing, limits=limits)
    return float(np.isfinite(distance(samples.places, ask).distances).sum() / max(samples.runs.size, 1))


def _in_space(
    mesh: FlatMesh, path: SurfacePath, samples: Samples, levels: IntArray, *, step: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the straight distance of samples to (k,) levels, what it is at least, and about where it leads."""
    lines, middles = path.lines(mesh), path.middles(mesh)
    points = spatial(mesh, samples.places)
    halves = 0.5 * np.abs(path.ends - path.starts)
    distances, least, nearest = np.zeros(len(points)), np.zeros(len(points)), np.zeros_like(points)
    for level in np.unique(levels):
        asking, pieces = np.flatnonzero(levels == level), np.flatnonzero(path.levels[path.runs] == level)
        to_level = PolylineDistance([lines[run] for run in np.flatnonzero(path.levels == level)], step=step)
        distances[asking] = to_level(points[asking])
        away, which = KDTree(middles[pieces]).query(points[asking])
        least[asking] = away - halves[pieces].max()
        nearest[asking] = middles[pieces[which]]
    return distances, least, nearest


def shares_at(mesh: FlatMesh, places: Places, wanted: SpacingAt | None, *, spacing: float) -> FloatArray:
    """Return the (k,) spacing wanted at k places over a usual one [mm]; 1 where it is the same everywhere."""
    return np.ones(places.faces.size) if wanted is None else wanted(spatial(mesh, places)) / spacing


def laid_area(mesh: FlatMesh, path: SurfacePath, wanted: SpacingAt | None, *, spacing: float) -> float:
    """Return how much a path covers where it is as wide as the wanted spacing [mm2]."""
    if wanted is None:
        return float(path.lengths.sum()) * spacing
    middles = Places(path.faces, 0.5 * (path.starts + path.ends))
    return float(np.abs(path.ends - path.starts) @ wanted(spatial(mesh, middles)))


def cut_evenly(lengths: FloatArray, *, step: float) -> tuple[IntArray, FloatArray, IntArray]:
    """Cut (k,) lengths into even pieces of at most a step, at least one each [mm].

    Returns:
        Of which length each piece is, where in it its middle lies as a share, and how many pieces each length has.
    """
    counts = np.maximum(np.ceil(lengths / step), 1).astype(np.int64)
    owner = np.repeat(np.arange(lengths.size), counts)
    rank = np.arange(owner.size) - np.repeat(np.cumsum(counts) - counts, counts)
    return owner, (rank + 0.5) / counts[owner], counts
