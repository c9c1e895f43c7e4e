"""What was deposited on the surface: runs as paths over its triangles, samples along them, runs that touch joined."""

from __future__ import annotations

from typing import NamedTuple, final

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import FieldError
from geoprint.geometry import arc_lengths, closest, whole_steps
from geoprint.metrics.oracle import FlatMesh, Places, SurfacePath, flat_places, spatial, trace
from geoprint.model import BoolArray, FloatArray, IntArray, PoseStream, Surface, frozen

# Runs that touch end to end become one stretch: a contour that is cut, at a corner or anywhere, is one line.


# Ends of runs nearer than this share of the spacing are one place: they touch first, whatever ends near them, so that
# a piece shorter than the next share is joined too.
SAME_SHARE = 1e-6
# Ends of runs nearer than this share of the spacing touch, if no third one is there.
TOUCHING_SHARE = 0.05
# The ends of one run touch only where it is this many times as long as they are apart.
LONGER = 4.0


@final
@frozen
class JoinedRuns:
    """The r runs of a path as the s stretches of another, which lies in the same place.

    Attributes:
        path: of the stretches.
        of: (r,) stretch of each run.
        firsts: (r,) where along its stretch a run starts [mm].
        signs: (r,) 1 where it leads on along its stretch, -1 where it leads back.
        lengths: (r,) of the runs [mm].
    """

    path: SurfacePath
    of: IntArray
    firsts: FloatArray
    signs: IntArray
    lengths: FloatArray

    def runs_at(self, stretches: IntArray, arcs: FloatArray) -> IntArray:
        """Return the run on which (k,) arc lengths of (k,) stretches lie [mm]."""
        begins = np.minimum(self.firsts, self.firsts + self.signs * self.lengths)
        order = np.lexsort((begins, self.of))
        longest = float(self.path.lengths.max()) + 1.0
        keys = self.of[order] * longest + begins[order]
        return order[np.maximum(np.searchsorted(keys, stretches * longest + arcs, side="right") - 1, 0)]


def joined(mesh: FlatMesh, path: SurfacePath, *, spacing: float) -> JoinedRuns:
    """Join the runs of a path that touch end to end.

    Args:
        mesh: m triangles.
        path: r runs on it.
        spacing: wanted [mm].
    """
    partners = _partners(mesh, path, spacing=spacing)
    count = path.lengths.size
    of, firsts = np.full(count, -1), np.zeros(count)
    signs = np.ones(count, dtype=np.int64)
    lengths: list[float] = []
    closed: list[bool] = []
    order: list[int] = []
    # Open ends first, so that a chain is walked from one of them; what is left over is closed.
    for begin in sorted(range(2 * count), key=lambda end: end in partners):
        if of[begin // 2] >= 0:
            continue
        total, end = 0.0, begin
        while end >= 0 and of[end // 2] < 0:
            run, last = divmod(end, 2)
            order.append(run)
            of[run], signs[run] = len(lengths), 1 - 2 * last
            firsts[run] = total + last * path.lengths[run]
            total += path.lengths[run]
            end = partners.get(end ^ 1, -1)
        lengths.append(total)
        closed.append(end >= 0)
    whole = np.array(lengths, dtype=np.float64)
    return JoinedRuns(
        _stretches(path, order, of, firsts, signs, lengths=whole, closed=np.array(closed, dtype=np.bool_)),
        of, firsts, signs, path.lengths,
    )  # fmt: skip


def _partners(mesh: FlatMesh, path: SurfacePath, *, spacing: float) -> dict[int, int]:
    """Return which end touches which: run i starts at end 2 i and ends at end 2 i + 1."""
    first = np.searchsorted(path.runs, np.arange(path.lengths.size))
    last = np.searchsorted(path.runs, np.arange(path.lengths.size), side="right") - 1
    starts = spatial(mesh, Places(path.faces[first], path.starts[first]))
    ends = spatial(mesh, Places(path.faces[last], path.ends[last]))
    places = np.stack([starts, ends], axis=1).reshape(-1, 3)
    tree, least = KDTree(places), LONGER * TOUCHING_SHARE * spacing
    free, found = np.ones(len(places), dtype=np.bool_), list[list[int]]()
    for share in (SAME_SHARE, TOUCHING_SHARE):
        pairs = tree.query_pairs(share * spacing, output_type="ndarray")
        own = pairs[:, 0] // 2 == pairs[:, 1] // 2
        pairs = pairs[(~own | (path.lengths[pairs[:, 0] // 2] > least)) & free[pairs].all(axis=1)]
        touched = np.bincount(pairs.ravel(), minlength=len(places))
        pairs = pairs[(touched[pairs] == 1).all(axis=1)]
        free[pairs] = False
        found += pairs.tolist()
    return {one: other for a, b in found for one, other in ((a, b), (b, a))}


def _stretches(
    path: SurfacePath, order: list[int], of: IntArray, firsts: FloatArray, signs: IntArray, *,
    lengths: FloatArray, closed: BoolArray,
) -> SurfacePath:  # fmt: skip
    """Return the segments of all runs along their stretches; those of a run that leads back turn round."""
    first = np.searchsorted(path.runs, np.arange(of.size))
    last = np.searchsorted(path.runs, np.arange(of.size), side="right")
    along_runs: list[IntArray] = [np.arange(first[run], last[run])[:: int(signs[run])] for run in order]
    taken: IntArray = np.concatenate(along_runs)
    runs = path.runs[taken]
    back = signs[runs] < 0
    starts, ends = path.starts[taken], path.ends[taken]
    # A run that leads back begins, along its stretch, with the end of its last segment.
    along = np.where(back, path.arcs[taken] + np.abs(ends - starts), path.arcs[taken])
    return SurfacePath(
        faces=path.faces[taken],
        starts=np.where(back, ends, starts),
        ends=np.where(back, starts, ends),
        runs=of[runs],
        arcs=np.maximum(firsts[runs] + signs[runs] * along, 0.0),
        lengths=lengths,
        levels=path.levels[np.array([order[int(i)] for i in np.flatnonzero(np.diff(of[order], prepend=-1))])],
        closed=closed,
    )


# What was deposited, laid onto the surface: runs as paths over its triangles, and samples along them.


# Poses farther from the surface than this share of the spacing were planned on another one.
OFF_SURFACE_SHARE = 0.1
# The ends of a closed run coincide up to this share of the spacing.
CLOSED_SHARE = 1e-6


class Samples(NamedTuple):
    """Places along runs.

    Attributes:
        places: k of them, run after run.
        runs: (k,) run of each.
        arcs: (k,) arc length from the start of the run [mm].
    """

    places: Places
    runs: IntArray
    arcs: FloatArray

    def some(self, which: IntArray | BoolArray) -> Samples:
        """Return some of them."""
        places = Places(self.places.faces[which], self.places.flat[which])
        return Samples(places, self.runs[which], self.arcs[which])


def deposited_path(
    poses: PoseStream, surface: Surface, mesh: FlatMesh, *, spacing: float
) -> tuple[SurfacePath, FloatArray]:
    """Lay the deposited runs of two points or more onto the surface.

    Args:
        poses: the stream; only depositing rows count.
        surface: what they lie on.
        mesh: the same surface flattened.
        spacing: [mm].

    Returns:
        The path, and the distance of its points from the surface [mm].

    Raises:
        FieldError: the path does not lie on this surface.
    """
    rows = deposited_rows(poses)
    numbers, runs = np.unique(poses.runs[rows], return_inverse=True)
    ends = np.flatnonzero(np.diff(runs, append=-1))
    starts = np.concatenate([[0], ends[:-1] + 1]) if numbers.size else ends
    points = poses.surface_points[rows]
    landed, misses = closest(surface, points)
    if misses.max(initial=0.0) > OFF_SURFACE_SHARE * spacing:
        worst = int(np.argmax(misses))
        raise FieldError(
            f"the path is {misses[worst]:.3g} mm away from {surface.name} in run {poses.runs[rows[worst]] + 1}, "
            f"allowed are {OFF_SURFACE_SHARE * spacing:.3g} mm. Measure a path on the surface that it was planned on.",
            distance_mm=float(misses[worst]),
        )
    gaps = np.linalg.norm(points[ends] - points[starts], axis=1)
    path = trace(
        mesh,
        flat_places(mesh, landed),
        runs=runs,
        levels=poses.levels[rows[starts]],
        closed=gaps <= CLOSED_SHARE * spacing,
    )
    return path, misses


def deposited_rows(poses: PoseStream) -> IntArray:
    """Return the rows of a stream that deposit along a run of two points or more."""
    rows = np.flatnonzero(poses.deposit)
    counts = np.bincount(poses.runs[rows], minlength=1)
    return rows[counts[poses.runs[rows]] > 1]


def at_poses(poses: PoseStream, stretches: JoinedRuns, samples: Samples, values: FloatArray) -> FloatArray:
    """Return values given at samples of a path at the poses that it was made of, linear between the samples.

    Args:
        poses: the p poses of `deposited_path`.
        stretches: of what it returned.
        samples: k samples along all of them.
        values: (k,).

    Returns:
        (p,) values; 0 where nothing is deposited.
    """
    rows = deposited_rows(poses)
    _, runs = np.unique(poses.runs[rows], return_inverse=True)
    points, result = poses.surface_points[rows], np.zeros(poses.count)
    for run, stretch in enumerate(stretches.of):
        here, there = runs == run, samples.runs == stretch
        shares = arc_lengths(points[here])
        along = stretches.firsts[run] + stretches.signs[run] * stretches.lengths[run] * shares / shares[-1]
        result[rows[here]] = np.interp(along, samples.arcs[there], values[there])
    return result


def sampled(path: SurfacePath, *, step: float) -> Samples:
    """Return samples along every run at even distances of at most one step, ends included.

    Args:
        path: r runs.
        step: [mm].
    """
    counts = whole_steps(path.lengths, step=step) + 1
    runs = np.repeat(np.arange(counts.size), counts)
    rank = np.arange(runs.size) - np.repeat(np.cumsum(counts) - counts, counts)
    arcs = path.lengths[runs] * rank / np.repeat(counts - 1, counts)
    return Samples(path.at(runs, arcs), runs, arcs)
