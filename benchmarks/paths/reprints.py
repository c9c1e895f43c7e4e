"""Prints of a plan, made without geoprint's sampler: errors on the points of the path, and the layer simulated again.

Nothing of `geoprint.metrics` enters. Each print moves the points of every run by errors that are drawn for these points
themselves (what strays along a run, and how far the arm is off over the part, by the Cholesky factors of covariances),
lays them back onto the disc or dome that the part is, and gives each run a flow of its own. The volume then spreads
over the part as heat does, on cells of a polar grid, exactly in time and by Fourier's modes around the pole; nothing
leaves over the rim.
"""

from __future__ import annotations

from typing import NamedTuple, final

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from geoprint.model import ACCURACY_LENGTH, FloatArray, IntArray, PoseStream, PrintErrors, Surface

# Of the covariance's diagonal, so that it has a Cholesky factor.
JITTER = 1e-9
# Standard deviation of the spread over the spacing, as design and guide have it.
SPREAD = 0.6
# Rings of cells of the polar grid to a spacing, cells around the pole, and stretches of path to a spacing.
ROWS_PER_SPACING, TURNS, STRETCHES_PER_SPACING = 8, 96, 8


class Shape(NamedTuple):
    """What a part is exactly; its pole is the origin.

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

    def polar(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far points on it are from its pole [mm], and where around it [rad]."""
        out = np.hypot(points[:, 0], points[:, 1])
        if np.isfinite(self.radius):
            out = self.radius * np.arctan2(out, points[:, 2] - self.centre[2])
        return out, np.arctan2(points[:, 1], points[:, 0])

    def around(self, reach: FloatArray) -> FloatArray:
        """Return the radius of the circle so far from the pole [mm]."""
        return reach if np.isinf(self.radius) else self.radius * np.sin(reach / self.radius)


class Lines(NamedTuple):
    """What is deposited.

    Attributes:
        points: (n, 3) of all runs [mm].
        runs: (n,) run of each, from 0.
        arcs: (n,) along its run [mm].
        tool: (n, 3, 2) the tool's x and y axes.
        before: (k,) point before the middle of each short stretch.
        shares: (k,) of the way to the next point.
        pieces: (k,) stretches between the same two points.
    """

    points: FloatArray
    runs: IntArray
    arcs: FloatArray
    tool: FloatArray
    before: IntArray
    shares: FloatArray
    pieces: IntArray


@final
class Layer:
    """Answers how much the thickness varies of the layer that lines leave on a disc or a dome.

    Args:
        shape: that it lies on.
        reach: of the part from its pole [mm].
        spacing: [mm].
    """

    def __init__(self, shape: Shape, *, reach: float, spacing: float) -> None:
        self._shape, self._reach = shape, reach
        self._rows = round(ROWS_PER_SPACING * reach / spacing)
        self._step = step = reach / self._rows
        edges = shape.around(np.linspace(0.0, reach, self._rows + 1))
        middles = shape.around(np.linspace(0.5 * step, reach - 0.5 * step, self._rows))
        turn = 2.0 * np.pi / TURNS
        self._areas = areas = np.repeat((middles * turn * step)[:, None], TURNS, axis=1)
        # Flow between neighbours of a row of cells: the edge between them over their distance.
        radial = (edges * turn / step)[1:-1]
        across = np.zeros((self._rows, self._rows))
        rows = np.arange(self._rows - 1)
        across[rows, rows + 1] = across[rows + 1, rows] = radial
        across -= np.diag(across.sum(axis=1))
        around = step / (middles * turn)
        time = 0.5 * (SPREAD * spacing) ** 2
        modes = np.arange(TURNS // 2 + 1)
        kept = 2.0 - 2.0 * np.cos(turn * modes)
        self._spread = np.stack([expm(time * (across - np.diag(around * less)) / areas[:, :1]) for less in kept])

    def cv(self, lines: Lines, points: FloatArray, flow: FloatArray) -> float:
        """Return the coefficient of variation for (n, 3) points and the (r,) flow of each run."""
        along = points[lines.before + 1] - points[lines.before]
        places = self._shape.onto(points[lines.before] + lines.shares[:, None] * along)
        volumes = flow[lines.runs[lines.before]] * np.linalg.norm(along, axis=1) / lines.pieces
        out, around = self._shape.polar(places)
        row = np.clip(out / self._step - 0.5, 0.0, self._rows - 1.0)
        turn = (around / (2.0 * np.pi) * TURNS - 0.5) % TURNS
        first, left = row.astype(np.int64), turn.astype(np.int64)
        put = np.zeros((self._rows, TURNS))
        for more_row, weight_row in ((0, first + 1.0 - row), (1, row - first)):
            for more_turn, weight_turn in ((0, left + 1.0 - turn), (1, turn - left)):
                cell = np.minimum(first + more_row, self._rows - 1), (left + more_turn) % TURNS
                np.add.at(put, cell, volumes * weight_row * weight_turn)
        modes = np.fft.rfft(put / self._areas, axis=1)
        thickness = np.fft.irfft(np.einsum("mij,jm->im", self._spread, modes), n=TURNS, axis=1)
        mean = np.average(thickness, weights=self._areas)
        return float(np.sqrt(np.average((thickness - mean) ** 2, weights=self._areas)) / mean)


def lines_of(poses: PoseStream, shape: Shape, *, spacing: float) -> Lines:
    """Return the deposited lines of a stream, cut into short stretches."""
    rows = np.flatnonzero(poses.deposit)
    points, (_, runs) = shape.onto(poses.surface_points[rows]), np.unique(poses.runs[rows], return_inverse=True)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    within = np.flatnonzero(np.diff(runs) == 0)
    arcs = np.zeros(rows.size)
    for run in range(int(runs.max()) + 1):
        here = np.flatnonzero(runs == run)
        arcs[here[1:]] = np.cumsum(steps[here[:-1]])
    counts = np.ceil(steps[within] / spacing * STRETCHES_PER_SPACING).astype(np.int64)
    pieces = np.repeat(counts, counts)
    rank = np.arange(pieces.size) - np.repeat(np.cumsum(counts) - counts, counts)
    tool = Rotation.from_quat(poses.quaternions[rows], scalar_first=True).as_matrix()[:, :, :2]
    return Lines(points, runs, arcs, tool, np.repeat(within, counts), (rank + 0.5) / pieces, pieces)


def reprinted(lines: Lines, errors: PrintErrors, layer: Layer, *, prints: int, rng: np.random.Generator) -> FloatArray:
    """Return the coefficient of variation of the thickness of each of many prints."""
    count = int(lines.runs.max()) + 1
    factors = [_factor(lines.arcs[lines.runs == run, None], errors.correlation) for run in range(count)]
    factors.append(_factor(lines.points, ACCURACY_LENGTH))
    found = [
        layer.cv(lines, _printed(lines, errors, factors, rng), 1.0 + rng.normal(0.0, errors.run_flow, count))
        for _ in range(prints)
    ]
    return np.array(found)


def planned_cv(lines: Lines, layer: Layer) -> float:
    """Return that of the plan itself."""
    return layer.cv(lines, lines.points, np.ones(int(lines.runs.max()) + 1))


def _factor(places: FloatArray, length: float) -> FloatArray:
    away = ((places[:, None] - places[None, :]) ** 2).sum(axis=2) / length**2
    return np.asarray(np.linalg.cholesky(np.exp(-0.5 * away) + JITTER * np.eye(len(places))), dtype=np.float64)


def _printed(lines: Lines, errors: PrintErrors, factors: list[FloatArray], rng: np.random.Generator) -> FloatArray:
    """Return where the points of one print are."""
    centre = lines.points.mean(axis=0)
    moved = np.array(lines.points + rng.normal(0.0, errors.placement, 3), dtype=np.float64)
    moved += np.asarray(np.cross(rng.normal(0.0, errors.placement_turn, 3), lines.points - centre), dtype=np.float64)
    moved += lines.tool @ rng.normal(0.0, errors.needle_runout, 2)
    moved += errors.accuracy_deviation * factors[-1] @ rng.standard_normal(lines.points.shape)
    for run, factor in enumerate(factors[:-1]):
        here = lines.runs == run
        moved[here] += rng.normal(0.0, errors.run_deviation, 3)
        moved[here] += errors.path_deviation * factor @ rng.standard_normal((factor.shape[0], 3))
    return moved


STANDOFF = 0.3
# Points of a ring, and rows and columns of the mesh, over the spacing.
STEP = 0.25


def shape_of(radius: float) -> Shape:
    """Return a dome with its pole at the origin; a plane where the radius is infinite."""
    return Shape(np.array([0.0, 0.0, 0.0 if np.isinf(radius) else -radius]), radius)


def surface(shape: Shape, *, reach: float, step: float) -> Surface:
    """Return a mesh of all that is nearer to the pole than `reach` [mm], with edges of about a step [mm]."""
    rows = np.linspace(0.0, reach, round(reach / step) + 1)[1:]
    turns = round(2.0 * np.pi * reach / step / 2.0)
    vertices = np.vstack([[0.0, 0.0, 0.0], *(ring(shape, reach=row, points=turns) for row in rows)])
    along = np.arange(turns)
    following = (along + 1) % turns
    faces = [np.column_stack([np.zeros(turns, dtype=np.int64), 1 + along, 1 + following])]
    for row in range(1, rows.size):
        inner, outer = 1 + (row - 1) * turns, 1 + row * turns
        faces += [
            np.column_stack([inner + along, outer + along, outer + following]),
            np.column_stack([inner + along, outer + following, inner + following]),
        ]
    return Surface(vertices, np.vstack(faces), name="rings")


def rings(shape: Shape, *, count: int, spacing: float) -> PoseStream:
    """Return a stream of closed rings, the outermost first, the innermost half a spacing from the pole.

    The tool's z axis points into the surface, its x axis stays as near to that of space as that allows.
    """
    reaches = spacing * (np.arange(count)[::-1] + 0.5)
    lines = [ring(shape, reach=reach, points=max(round(2 * np.pi * reach / spacing / STEP), 12)) for reach in reaches]
    lines = [np.vstack([line, line[:1]]) for line in lines]
    counts, points = [len(line) for line in lines], np.vstack(lines)
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    if np.isfinite(shape.radius):
        normals = (points - shape.centre) / shape.radius
    x_axes = np.array([1.0, 0.0, 0.0]) - normals[:, :1] * normals
    x_axes /= np.linalg.norm(x_axes, axis=1, keepdims=True)
    attitudes: FloatArray = np.asarray(
        np.stack([x_axes, np.cross(-normals, x_axes), -normals], axis=2), dtype=np.float64
    )
    return PoseStream(
        tips=points + STANDOFF * normals,
        quaternions=Rotation.from_matrix(attitudes).as_quat(scalar_first=True),
        normals=normals,
        runs=np.repeat(np.arange(count), counts),
        levels=np.repeat(np.arange(count), counts),
        layers=np.zeros(len(points), dtype=np.int64),
        deposit=np.ones(len(points), dtype=np.bool_),
        stops=np.zeros(len(points), dtype=np.bool_),
        arcs=np.concatenate([np.arange(k, dtype=np.float64) for k in counts]),
        flow=np.ones(len(points)),
        standoff=STANDOFF,
    )


def ring(shape: Shape, *, reach: float, points: int) -> FloatArray:
    """Return points at a distance from the pole along the shape [mm]."""
    turn = 2.0 * np.pi * np.arange(points) / points
    out, down = reach, 0.0
    if np.isfinite(shape.radius):
        out, down = shape.radius * np.sin(reach / shape.radius), shape.radius * (np.cos(reach / shape.radius) - 1.0)
    return np.column_stack([out * np.cos(turn), out * np.sin(turn), np.full(points, down)])
