"""Prints of a plan, made without geoprint's sampler: errors on the points of the path, and the spacing measured again.

Nothing of `geoprint.quality` enters. Each print moves the points of every run by errors that are drawn for these points
themselves (what strays along a run by the Cholesky factor of its covariance), lays them back onto the plane or sphere
that the part is, and measures the distance from samples to the polylines of the level outside by brute force.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.model import FloatArray, IntArray, PoseStream, PrintErrors

SAMPLES_PER_SPACING = 4
# Of the covariance's diagonal, so that it has a Cholesky factor.
JITTER = 1e-9


class Shape(NamedTuple):
    """What a part is exactly.

    Attributes:
        centre: (3,) of the sphere, or any place of the plane z = const [mm].
        radius: of the sphere; infinite for a plane [mm].
    """

    centre: FloatArray
    radius: float

    def onto(self, points: FloatArray) -> FloatArray:
        """Return the closest points on it."""
        away = points - self.centre
        if np.isinf(self.radius):
            return points - np.array([0.0, 0.0, 1.0]) * away[:, 2:]
        return self.centre + away * (self.radius / np.linalg.norm(away, axis=1, keepdims=True))

    def along(self, chords: FloatArray) -> FloatArray:
        """Return the lengths over it of straight lengths."""
        return chords if np.isinf(self.radius) else 2.0 * self.radius * np.arcsin(chords / (2.0 * self.radius))


class Lines(NamedTuple):
    """What is deposited, and where it is sampled.

    Attributes:
        points: (n, 3) of all runs [mm].
        runs: (n,) run of each, from 0.
        levels: (n,) level of each.
        arcs: (n,) along its run [mm].
        tool: (n, 3, 2) the tool's x and y axes.
        before: (k,) point before each sample.
        shares: (k,) of the way to the next point.
    """

    points: FloatArray
    runs: IntArray
    levels: IntArray
    arcs: FloatArray
    tool: FloatArray
    before: IntArray
    shares: FloatArray


def lines_of(poses: PoseStream, shape: Shape, *, spacing: float) -> Lines:
    """Return the deposited lines of a stream, and samples along them."""
    rows = np.flatnonzero(poses.deposit)
    points, (_, runs) = shape.onto(poses.surface_points[rows]), np.unique(poses.runs[rows], return_inverse=True)
    arcs, before, shares = np.zeros(rows.size), list[IntArray](), list[FloatArray]()
    for run in range(int(runs.max()) + 1):
        here = np.flatnonzero(runs == run)
        steps = np.linalg.norm(np.diff(points[here], axis=0), axis=1)
        arcs[here] = np.concatenate([[0.0], np.cumsum(steps)])
        length = float(arcs[here][-1])
        wanted: FloatArray = np.linspace(0.0, length, int(np.ceil(length / spacing * SAMPLES_PER_SPACING)) + 1)
        place: IntArray = np.clip(np.searchsorted(arcs[here], wanted, side="right") - 1, 0, here.size - 2)
        before.append(here[place])
        shares.append((wanted - arcs[here][place]) / steps[place])
    tool = Rotation.from_quat(poses.quaternions[rows], scalar_first=True).as_matrix()[:, :, :2]
    return Lines(points, runs, poses.levels[rows], arcs, tool, np.concatenate(before), np.concatenate(shares))


def reprinted(lines: Lines, errors: PrintErrors, shape: Shape, *, prints: int, rng: np.random.Generator) -> FloatArray:
    """Return the coefficient of variation of the spacing of each of many prints."""
    factors = [_factor(lines.arcs[lines.runs == run], errors) for run in range(int(lines.runs.max()) + 1)]
    return np.array([_cv(_printed(lines, errors, factors, rng), lines, shape) for _ in range(prints)])


def planned_cv(lines: Lines, shape: Shape) -> float:
    """Return that of the plan itself."""
    return _cv(lines.points, lines, shape)


def _factor(arcs: FloatArray, errors: PrintErrors) -> FloatArray:
    away = (arcs[:, None] - arcs[None, :]) / errors.correlation
    return np.asarray(np.linalg.cholesky(np.exp(-0.5 * away**2) + JITTER * np.eye(arcs.size)), dtype=np.float64)


def _printed(lines: Lines, errors: PrintErrors, factors: list[FloatArray], rng: np.random.Generator) -> FloatArray:
    """Return where the points of one print are."""
    centre = lines.points.mean(axis=0)
    moved = np.array(lines.points + rng.normal(0.0, errors.placement, 3), dtype=np.float64)
    moved += np.asarray(np.cross(rng.normal(0.0, errors.placement_turn, 3), lines.points - centre), dtype=np.float64)
    moved += lines.tool @ rng.normal(0.0, errors.needle_runout, 2)
    for run, factor in enumerate(factors):
        here = lines.runs == run
        moved[here] += rng.normal(0.0, errors.run_deviation, 3)
        moved[here] += errors.path_deviation * factor @ rng.standard_normal((factor.shape[0], 3))
    return moved


def _cv(points: FloatArray, lines: Lines, shape: Shape) -> float:
    laid = shape.onto(points)
    places = laid[lines.before] + lines.shares[:, None] * (laid[lines.before + 1] - laid[lines.before])
    levels, inner = lines.levels[lines.before], lines.runs[:-1] == lines.runs[1:]
    found: list[FloatArray] = []
    for level in np.unique(levels)[1:]:
        segments = np.flatnonzero(inner & (lines.levels[:-1] == level - 1))
        found.append(shape.along(_nearest(places[levels == level], laid[segments], laid[segments + 1])))
    distances = np.concatenate(found)
    return float(distances.std() / distances.mean())


def _nearest(places: FloatArray, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Return the distance from (k, 3) places to the nearest of (s, 3) segments."""
    along = ends - starts
    squares = (along**2).sum(axis=1)
    apart = (places**2).sum(axis=1)[:, None] - 2.0 * places @ starts.T + (starts**2).sum(axis=1)
    reach = places @ along.T - (starts * along).sum(axis=1)
    shares = np.clip(reach / np.maximum(squares, 1e-18), 0.0, 1.0)
    nearest = apart - 2.0 * shares * reach + shares**2 * squares
    return np.sqrt(np.maximum(nearest.min(axis=1), 0.0))
