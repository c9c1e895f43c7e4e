"""Runs that touch end to end are one stretch: a contour that is split at a corner is not its own neighbour."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import FloatArray, IntArray, frozen
from geoprint.quality.oracle import FlatMesh, Places, Stretches, SurfacePath, spatial

# Ends of runs nearer than this share of the spacing touch, if no third one is there.
TOUCHING_SHARE = 0.05


@frozen
class JoinedRuns:
    """The runs of a path as stretches.

    Attributes:
        of: (r,) stretch of each run.
        firsts: (r,) where along its stretch a run starts [mm].
        signs: (r,) 1 where it leads on along its stretch, -1 where it leads back.
        segments: the same for the segments of the path.
    """

    of: IntArray
    firsts: FloatArray
    signs: IntArray
    segments: Stretches

    def arcs(self, runs: IntArray, arcs: FloatArray) -> FloatArray:
        """Return where along their stretches (k,) arc lengths of (k,) runs lie [mm]."""
        return self.firsts[runs] + self.signs[runs] * arcs


def joined(mesh: FlatMesh, path: SurfacePath, *, spacing: float) -> JoinedRuns:
    """Join the runs of a path that touch end to end.

    Args:
        mesh: m triangles.
        path: r runs on it.
        spacing: wanted [mm].
    """
    partners = _partners(mesh, path, reach=TOUCHING_SHARE * spacing)
    count = path.lengths.size
    of, firsts = np.full(count, -1), np.zeros(count)
    signs = np.ones(count, dtype=np.int64)
    lengths: list[float] = []
    closed: list[bool] = []
    # Open ends first, so that a chain is walked from one of them; what is left over is closed.
    for begin in sorted(range(2 * count), key=lambda end: end in partners):
        if of[begin // 2] >= 0:
            continue
        total, end = 0.0, begin
        while end >= 0 and of[end // 2] < 0:
            run, last = divmod(end, 2)
            of[run], signs[run] = len(lengths), 1 - 2 * last
            firsts[run] = total + last * path.lengths[run]
            total += path.lengths[run]
            end = partners.get(end ^ 1, -1)
        lengths.append(total)
        closed.append(end >= 0)
    return JoinedRuns(of, firsts, signs, _segments(path, of, firsts, signs, partners, lengths=lengths, closed=closed))


def _partners(mesh: FlatMesh, path: SurfacePath, *, reach: float) -> dict[int, int]:
    """Return which end touches which: run i starts at end 2 i and ends at end 2 i + 1."""
    first = np.searchsorted(path.runs, np.arange(path.lengths.size))
    last = np.searchsorted(path.runs, np.arange(path.lengths.size), side="right") - 1
    starts = spatial(mesh, Places(path.faces[first], path.starts[first]))
    ends = spatial(mesh, Places(path.faces[last], path.ends[last]))
    places = np.stack([starts, ends], axis=1).reshape(-1, 3)
    pairs = KDTree(places).query_pairs(reach, output_type="ndarray")
    touched = np.bincount(pairs.ravel(), minlength=len(places))
    alone: list[list[int]] = pairs[(touched[pairs] == 1).all(axis=1)].tolist()
    return {one: other for a, b in alone for one, other in ((a, b), (b, a))}


def _segments(
    path: SurfacePath, of: IntArray, firsts: FloatArray, signs: IntArray, partners: dict[int, int], *,
    lengths: list[float], closed: list[bool],
) -> Stretches:  # fmt: skip
    run = path.runs
    halves = 0.5 * np.abs(path.ends - path.starts)
    loops = np.where(closed, lengths, np.inf)
    open_ends = np.array([end not in partners for end in range(2 * of.size)], dtype=np.bool_).reshape(-1, 2)
    begins, stops = np.diff(run, prepend=-1) != 0, np.diff(run, append=-1) != 0
    return Stretches(
        stretches=of[run],
        arcs=firsts[run] + signs[run] * (path.arcs + halves),
        loops=loops[of[run]],
        open_starts=begins & open_ends[run, 0],
        open_ends=stops & open_ends[run, 1],
    )
