"""What was deposited, laid onto the surface: runs as paths over its triangles, and samples along them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geoprint.errors import FieldError
from geoprint.model import BoolArray, FloatArray, IntArray, PoseStream, Surface
from geoprint.quality.oracle import FlatMesh, Places, SurfacePath, flat_places, trace
from geoprint.quality.stretches import JoinedRuns
from geoprint.surfaces import arc_lengths, closest

# Poses farther from the surface than this share of the spacing were planned on another one.
OFF_SURFACE_SHARE = 0.1
# The ends of a closed run coincide up to this share of the spacing.
CLOSED_SHARE = 1e-6
# A length that is a whole number of steps up to this share of one is cut into so many.
WHOLE_STEPS = 1e-6


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
        mesh: the same surface laid flat.
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
            f"allowed are {OFF_SURFACE_SHARE * spacing:.3g} mm: measure a path on the surface that it was planned on.",
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
    counts = np.maximum(np.ceil(path.lengths / step - WHOLE_STEPS), 1).astype(np.int64) + 1
    runs = np.repeat(np.arange(counts.size), counts)
    rank = np.arange(runs.size) - np.repeat(np.cumsum(counts) - counts, counts)
    arcs = path.lengths[runs] * rank / np.repeat(counts - 1, counts)
    return Samples(path.at(runs, arcs), runs, arcs)
