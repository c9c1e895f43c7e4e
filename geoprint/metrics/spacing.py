"""Spacing (stepover) of levels of a path, where it was measured, and what errors do to it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias, final

import numpy as np
from scipy.sparse import csr_array, hstack
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from geoprint.errors import VerificationError
from geoprint.geometry import PolylineDistance, refine
from geoprint.metrics.deposited import Samples, deposited_rows
from geoprint.metrics.oracle import Ask, FlatMesh, GeodesicDistance, Places, SurfacePath, flat_mesh, spatial
from geoprint.model import (
    ACCURACY_LENGTH,
    BoolArray,
    FloatArray,
    IntArray,
    PoseStream,
    PrintErrors,
    Surface,
    freeze_arrays,
    frozen,
)

# From where to where spacing was measured, and what an error at either end of a span does to its length.


# Ends nearer than this [mm] have no direction.
SHORTEST = 1e-9


@final
@frozen
class Spans:
    """Spans from k samples to the nearest place of the path beside them: their feet.

    Where the sample moves by d and the foot by e, the distance over the surface between them grows by
    e . beyond - d . towards, in the first order.

    Attributes:
        places: (k, 3) samples [mm].
        feet: (k, 3) where the spans end [mm].
        towards: (k, 3) unit vector in the surface at the sample, along the span.
        beyond: (k, 3) unit vector in the surface at the foot, along the span.
        runs: (k, 2) run of the sample, and of the foot.
        arcs: (k, 2) where they lie along these runs [mm].
        ratios: (k,) length over the surface, over the wanted spacing.
    """

    places: FloatArray
    feet: FloatArray
    towards: FloatArray
    beyond: FloatArray
    runs: IntArray
    arcs: FloatArray
    ratios: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, places="float: k 3", feet="float: k 3", towards="float: k 3", beyond="float: k 3", runs="int: k 2",
            arcs="float: k 2", ratios="float: k",
        )  # fmt: skip

    @property
    def count(self) -> int:
        """Number of spans k."""
        return int(self.ratios.size)

    def some(self, which: IntArray) -> Spans:
        """Return some of them."""
        return Spans(
            self.places[which], self.feet[which], self.towards[which], self.beyond[which], self.runs[which],
            self.arcs[which], self.ratios[which],
        )  # fmt: skip


def no_spans() -> Spans:
    """Return no spans at all, as where there is one level."""
    none, pairs = np.zeros((0, 3)), np.zeros((0, 2))
    return Spans(none, none, none, none, pairs.astype(np.int64), pairs, np.zeros(0))


def joined_spans(one: Spans, other: Spans) -> Spans:
    """Return the spans of both, as of the left and the right of the same path."""
    return Spans(
        *(
            np.concatenate([getattr(one, name), getattr(other, name)])
            for name in ("places", "feet", "towards", "beyond", "runs", "arcs", "ratios")
        )
    )


def spans_to(
    mesh: FlatMesh, path: SurfacePath, samples: Samples, *, runs: IntArray, arcs: FloatArray, ratios: FloatArray
) -> Spans:
    """Return the spans from samples to places of a path.

    Args:
        mesh: m triangles.
        path: r runs on it.
        samples: k samples along runs.
        runs: (k,) run on which each span ends.
        arcs: (k,) where on it [mm].
        ratios: (k,) length of each over the wanted spacing.
    """
    feet = path.at(runs, arcs)
    here, there = spatial(mesh, samples.places), spatial(mesh, feet)
    return Spans(
        places=here,
        feet=there,
        towards=_within(mesh, samples.places, there - here),
        beyond=_within(mesh, feet, there - here),
        runs=np.column_stack([samples.runs, runs]),
        arcs=np.column_stack([samples.arcs, arcs]),
        ratios=ratios,
    )


def spans_to_segments(
    mesh: FlatMesh, path: SurfacePath, samples: Samples, *, segments: IntArray, ratios: FloatArray
) -> Spans:
    """Return the spans from samples to segments of a path, each to its closest point.

    Args:
        mesh: m triangles.
        path: p segments.
        samples: k samples along runs.
        segments: (k,) on which each span ends.
        ratios: (k,) length of each over the wanted spacing.
    """
    faces = path.faces[segments]
    start, end = (spatial(mesh, Places(faces, flat[segments])) for flat in (path.starts, path.ends))
    along = end - start
    squares = np.maximum((along**2).sum(axis=1), SHORTEST**2)
    shares = np.clip(((spatial(mesh, samples.places) - start) * along).sum(axis=1) / squares, 0.0, 1.0)
    arcs = path.arcs[segments] + shares * np.abs(path.ends[segments] - path.starts[segments])
    return spans_to(mesh, path, samples, runs=path.runs[segments], arcs=arcs, ratios=ratios)


def _within(mesh: FlatMesh, places: Places, directions: FloatArray) -> FloatArray:
    """Return directions turned into the faces of places, of unit length; 0 where there is none."""
    axes = mesh.axes[places.faces]
    flat = np.einsum("kp,kpx->kx", np.einsum("kpx,kx->kp", axes, directions), axes)
    lengths = np.linalg.norm(flat, axis=1, keepdims=True)
    return np.where(lengths > SHORTEST, flat / np.maximum(lengths, SHORTEST), 0.0)


# Distance from every level of a path to the level outside it, over the surface; and what it shall be at a place.


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
            f"the surface distance at ({x:z.3f}, {y:z.3f}, {z:z.3f}) mm is {short.max():.3g} mm shorter than the "
            "straight line. This is a defect of geoprint: report it with the part."
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
    found = distance(samples.places, distance.narrowed(samples.places, ask))
    return float(np.isfinite(found.distances).sum() / max(samples.runs.size, 1))


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


class JudgedSurface(NamedTuple):
    """A surface with triangles that are small enough to measure paths on it, and the same flattened."""

    surface: Surface
    mesh: FlatMesh


def judged_surface(surface: Surface, *, spacing: float) -> JudgedSurface:
    """Return a surface with triangles that are small beside the spacing of paths on it [mm]."""
    return JudgedSurface(fine := refine(surface, edge_length=LARGEST_TRIANGLE * spacing), flat_mesh(fine))


def shares_at(mesh: FlatMesh, places: Places, wanted: SpacingAt | None, *, spacing: float) -> FloatArray:
    """Return the (k,) spacing wanted at k places over a usual one [mm]; 1 where it is the same everywhere."""
    return np.ones(places.faces.size) if wanted is None else wanted(spatial(mesh, places)) / spacing


def deposited_area(mesh: FlatMesh, path: SurfacePath, wanted: SpacingAt | None, *, spacing: float) -> float:
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


# What each kind of error does to measured spacings, as linear maps from independent standard normal numbers.
#
# An error of the arm moves a whole run, or strays along it; a wrong placement moves all of the part; a needle that
# is bent moves the tip with the tool; an inaccurate arm moves all paths, those beside one another nearly alike.
# Where sample and foot move alike, the spacing stays.


Sparse: TypeAlias = "csr_array"

# What errors are called, by the keys of the cell.
SOURCES = ("repeatability", "path_repeatability", "placement", "needle_runout", "path_accuracy")
# Numbers that belong to the cell and are alike in all its prints: shift and turn of the part, where the needle's tip
# is, and how far the arm lies off and how that changes along each axis.
OF_CELL = 20
# What strays along a run is white noise, smoothed: nodes so far apart over the correlation length, so many around.
NODE_SHARE = 0.7
NODES_AROUND = 8


def node_counts(spans: Spans, errors: PrintErrors) -> IntArray:
    """Return how many nodes each of r runs has along it."""
    counts = np.full(int(spans.runs.max(initial=-1)) + 1, NODES_AROUND)
    np.maximum.at(counts, spans.runs.ravel(), _first_nodes(spans, errors).ravel() + NODES_AROUND)
    return counts


def strays(spans: Spans, errors: PrintErrors, *, poses: PoseStream | None) -> tuple[Sparse, ...]:
    """Return by how much k spans become longer [mm], linear in normal numbers: a map of k rows for each of `SOURCES`.

    Args:
        spans: k spans between r runs.
        errors: what they are.
        poses: how the tool stands; None where nobody knows, then a bent needle is left out.

    Returns:
        Maps from the shift of each run (3 r), the nodes along all runs (3 a node), a shift and a turn of the part (6),
        the two coordinates of the needle's tip, and the arm's inaccuracy (12).
    """
    count, runs = spans.count, node_counts(spans, errors).size
    whole = _blocks(spans, spans.runs[:, :, None], np.ones((count, 2, 1)), columns=runs)
    nodes, weights = _nodes(spans, errors)
    along = _blocks(spans, nodes, weights, columns=int(node_counts(spans, errors).sum()))
    centre = spans.places.mean(axis=0) if count else np.zeros(3)
    turned = np.cross(spans.feet - centre, spans.beyond) - np.cross(spans.places - centre, spans.towards)
    placed = np.hstack([errors.placement * (spans.beyond - spans.towards), errors.placement_turn * turned])
    needle = np.zeros((count, 2)) if poses is None or not count else _needle(spans, poses)
    return (
        whole * errors.run_deviation,
        along * errors.path_deviation,
        csr_array(placed),
        csr_array(errors.needle_runout * needle),
        _inaccurate(spans, centre) * errors.accuracy_deviation,
    )


def over(maps: tuple[Sparse, ...], lengths: FloatArray) -> tuple[Sparse, ...]:
    """Return maps to spans, each over one of (k,) lengths [mm]."""
    return tuple(csr_array(one.multiply(1.0 / lengths[:, None])) for one in maps)


def together(maps: tuple[Sparse, ...]) -> Sparse:
    """Return the maps of all errors as one."""
    return csr_array(hstack(maps))


def expected_variance(of: Sparse) -> float:
    """Return the mean of the variance over k spans that a map makes of standard normal numbers."""
    rows = max(of.shape[0], 1)
    mean = np.asarray(of.sum(axis=0)) / rows
    return max(float((of.data**2).sum() / rows - (mean**2).sum()), 0.0)


def _first_nodes(spans: Spans, errors: PrintErrors) -> IntArray:
    """Return the (k, 2) first of the nodes around each sample and each foot, along their runs."""
    return np.floor(spans.arcs / (NODE_SHARE * errors.correlation)).astype(np.int64)


def _nodes(spans: Spans, errors: PrintErrors) -> tuple[IntArray, FloatArray]:
    """Return (k, 2, n) nodes around each sample and foot, counted over all runs, and their weights.

    White noise that is smoothed by exp(-(s / length)^2) has the correlation exp(-(s / length)^2 / 2).
    """
    counts = node_counts(spans, errors)
    before = np.cumsum(counts) - counts
    first = _first_nodes(spans, errors)[:, :, None] + np.arange(NODES_AROUND)
    # As many nodes behind a place as before it.
    away = NODE_SHARE * (first - NODES_AROUND // 2 + 1) - spans.arcs[:, :, None] / errors.correlation
    weights = np.exp(-(away**2))
    return before[spans.runs][:, :, None] + first, weights / np.linalg.norm(weights, axis=2, keepdims=True)


def _blocks(spans: Spans, nodes: IntArray, weights: FloatArray, *, columns: int) -> Sparse:
    """Return the map from the three coordinates of every node to the (k,) changes of length.

    Args:
        spans: k spans.
        nodes: (k, 2, n) that move the sample, and the foot.
        weights: (k, 2, n) by how much.
        columns: nodes in all.
    """
    ends = np.stack([-spans.towards, spans.beyond], axis=1)
    values = weights[:, :, :, None] * ends[:, :, None, :]
    places = 3 * nodes[:, :, :, None] + np.arange(3)
    each = int(np.prod(values.shape[1:]))
    starts = np.arange(spans.count + 1) * each
    return csr_array((values.ravel(), places.ravel(), starts), shape=(spans.count, 3 * columns))


def _inaccurate(spans: Spans, centre: FloatArray) -> Sparse:
    """Return the map from a shift and its change along each axis, about a centre; equally large everywhere.

    Two places at a and b from the centre, in lengths, have the correlation (1 + a . b) / |(1, a)| / |(1, b)|.
    """
    away = (np.stack([spans.places, spans.feet], axis=1) - centre) / ACCURACY_LENGTH
    weights = np.concatenate([np.ones((spans.count, 2, 1)), away], axis=2)
    weights /= np.linalg.norm(weights, axis=2, keepdims=True)
    return _blocks(spans, np.broadcast_to(np.arange(4), weights.shape), weights, columns=4)


def _needle(spans: Spans, poses: PoseStream) -> FloatArray:
    """Return (k, 2) by how much spans become longer where the needle's tip is off along the tool's x and y."""
    rows = deposited_rows(poses)
    nearest = KDTree(poses.surface_points[rows])
    attitudes = Rotation.from_quat(poses.quaternions[rows], scalar_first=True).as_matrix()
    here, there = (attitudes[nearest.query(places)[1]][:, :, :2] for places in (spans.places, spans.feet))
    return np.einsum("kxa,kx->ka", there, spans.beyond) - np.einsum("kxa,kx->ka", here, spans.towards)
