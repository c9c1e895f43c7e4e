"""Moves between runs: lift off along the nozzle, cross as low as part and body allow, come down along the nozzle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np

from geoprint.model import FloatArray, IntArray, Surface, Tool, freeze_arrays, frozen
from geoprint.surfaces import arc_lengths

# Travel is sampled this finely [mm], so that the joints' spline follows the straight line.
TRAVEL_STEP = 1.0
# Points of part and body by which a crossing is planned are about this far apart [mm]: well below what it keeps.
TERRAIN_STEP = 1.0
# Faces that are cut into points at a time, so that a body of millions of them takes little memory.
FACES_AT_A_TIME = 100_000
# A crossing keeps this share of the retract height from everything.
KEPT_SHARE = 0.5
# A tool that leans farther than this from upright [cosine] is planned as if it leant no more.
LEAST_UPRIGHT = 0.3
# Shorter means of two unit vectors have no direction.
LEAST_LENGTH = 1e-6


@final
@frozen
class Terrain:
    """What travel passes over, and the outline of the tool that passes.

    Attributes:
        points: (n, 3) of part and body in the work frame, TERRAIN_STEP apart [mm].
        up: (3,) unit vector away from the table.
        needle_radius: [mm].
        cone_heights: (2,) where the cone begins and ends, over the tip [mm].
        barrel_radius: [mm].
        kept: distance that a crossing keeps from all points [mm]; infinite: it goes over everything.
    """

    points: FloatArray
    up: FloatArray
    needle_radius: float
    cone_heights: tuple[float, float]
    barrel_radius: float
    kept: float

    def __post_init__(self) -> None:
        freeze_arrays(self, points="float: n 3", up="float: 3")

    @property
    def top(self) -> float:
        """Highest coordinate of all points along `up` [mm]."""
        return float((self.points @ self.up).max())

    def lift(self, tip: FloatArray, axis: FloatArray) -> float:
        """Return how far a tip has to go up so that needle, cone and barrel keep their distance [mm], or less than 0.

        A point at a distance d from the tool's axis may be as high over the tip as the tool is as thick as d there, but
        for the kept distance, which is taken off both.

        Args:
            tip: (3,) [mm].
            axis: (3,) unit vector from the tip into the tool.
        """
        if not np.isfinite(self.kept):
            return np.inf
        offsets = self.points - tip
        heights: FloatArray = offsets @ axis
        aside: FloatArray = np.linalg.norm(offsets - heights[:, None] * axis, axis=1) - self.kept
        free: FloatArray = np.interp(aside, [self.needle_radius, self.barrel_radius], self.cone_heights)
        free[aside <= self.needle_radius] = 0.0
        needed: FloatArray = (heights - free + self.kept)[aside <= self.barrel_radius]
        return float(needed.max(initial=-np.inf)) / max(float(axis @ self.up), LEAST_UPRIGHT)


def terrain_points(surfaces: Sequence[Surface]) -> FloatArray:
    """Return (m, 3) points of part and, where there is one, body by which travel over them is planned [mm]."""
    return _apart(np.concatenate([_points(surface) for surface in surfaces]))


def terrain(points: FloatArray, *, beside: FloatArray, tool: Tool, up: FloatArray, kept: float) -> Terrain:
    """Return what travel passes over.

    Args:
        points: as `terrain_points`.
        beside: (b, 3) corners of what else stands there [mm].
        tool: that passes.
        up: (3,) unit vector away from the table.
        kept: distance to keep [mm]; infinite to go over everything.
    """
    return Terrain(
        points=_apart(np.concatenate([points, beside])),
        up=up,
        needle_radius=tool.needle_diameter / 2,
        cone_heights=(tool.needle_length, tool.needle_length + tool.cone_length),
        barrel_radius=tool.barrel_diameter / 2,
        kept=kept,
    )


def crossing(start: FloatArray, end: FloatArray, *, axes: FloatArray, terrain: Terrain, retract: float) -> FloatArray:
    """Return the corners of the travel between two lifted points: the lowest one that does not bob.

    It runs over the straight line on the ground, like a string over the heights that the tool needs there while it
    turns from one attitude to the other, and at most over everything.

    Args:
        start: (3,) lifted end of the last run [mm].
        end: (3,) lifted start of the next one [mm].
        axes: (2, 3) unit vectors from the tip into the tool, at both.
        terrain: what is to be kept clear.
        retract: height of lifted points over the surface [mm].

    Returns:
        (c, 3) corners, c >= 2; first is start, last is end. Two where the straight line is free.
    """
    line, _ = sampled_polyline(np.stack([start, end]))
    shares = np.linspace(0.0, 1.0, len(line))
    turned = axes[0] + shares[:, None] * (axes[1] - axes[0])
    lengths: FloatArray = np.linalg.norm(turned, axis=1)
    turned /= np.maximum(lengths, np.finfo(np.float64).tiny)[:, None]
    top = terrain.top
    most = np.array([over(tip, up=terrain.up, retract=retract, top=top) for tip in line])
    highest = (most - line) @ terrain.up
    lifts = np.array([terrain.lift(tip, axis) for tip, axis in zip(line, turned, strict=True)])
    # In the middle between opposite attitudes the tool may lie in any direction.
    lifts = np.where(lengths > LEAST_LENGTH, np.minimum(lifts, highest), highest)
    lifts[[0, -1]] = 0.0
    if np.isfinite(terrain.kept):
        rows = _string_over(shares, lifts)
        return line[rows] + lifts[rows, None] * terrain.up
    return np.stack([start, most[0], most[-1], end])


def over(point: FloatArray, *, up: FloatArray, retract: float, top: float) -> FloatArray:
    """Return the (3,) place straight above a point from where everything is below by two retract heights [mm]."""
    return point + max(top + 2.0 * retract - float(point @ up), 0.0) * up


def sampled_polyline(corners: FloatArray, *, step: float = TRAVEL_STEP) -> tuple[FloatArray, IntArray]:
    """Sample a polyline evenly between its corners, corners included.

    Args:
        corners: (c, 3) [mm], c >= 2.
        step: largest distance between neighbouring samples [mm].

    Returns:
        (k, 3) samples, and (c,) the rows of the corners among them.
    """
    arcs = arc_lengths(corners)
    counts = np.maximum(np.ceil(np.diff(arcs) / step).astype(np.int64), 1)
    rows = np.concatenate([[0], np.cumsum(counts)])
    pieces = np.repeat(np.arange(counts.size), counts)
    share = (np.arange(int(rows[-1])) - rows[pieces]) / counts[pieces]
    samples = corners[pieces] + share[:, None] * (corners[pieces + 1] - corners[pieces])
    return np.vstack([samples, corners[-1:]]), rows


def _string_over(shares: FloatArray, heights: FloatArray) -> IntArray:
    """Return the rows at which a string bends that is stretched over heights from the first to the last."""
    rows: list[int] = []
    for row in range(len(shares)):
        while len(rows) > 1:
            (x, y), (u, v) = ((shares[k] - shares[rows[-2]], heights[k] - heights[rows[-2]]) for k in (rows[-1], row))
            if y * u > v * x:
                break
            rows.pop()
        rows.append(row)
    return np.array(rows)


def _apart(points: FloatArray) -> FloatArray:
    """Return the first of (n, 3) points in each cell of a grid, in the order of the cells."""
    cells = np.floor(points / TERRAIN_STEP)
    # Several times as fast as NumPy's unique rows.
    order = np.lexsort(cells.T[::-1])
    other = np.append(np.True_, (np.diff(cells[order], axis=0) != 0.0).any(axis=1))
    return points[order[other]]


def _points(surface: Surface) -> FloatArray:
    """Return points on every face of a surface, about TERRAIN_STEP apart."""
    blocks = range(0, len(surface.faces), FACES_AT_A_TIME)
    return np.concatenate([
        surface.vertices,
        *(_inner_points(surface.vertices[surface.faces[first : first + FACES_AT_A_TIME]]) for first in blocks),
    ])  # fmt: skip


def _inner_points(triangles: FloatArray) -> FloatArray:
    """Return points between the corners of (m, 3, 3) triangles, about TERRAIN_STEP apart from one another and these."""
    found, rest = [np.empty((0, 3))], triangles
    while len(rest):
        sides = np.linalg.norm(rest - np.roll(rest, -1, axis=1), axis=2).max(axis=1)
        rest = rest[sides > TERRAIN_STEP]
        a, b, c = rest[:, 0], rest[:, 1], rest[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        found += [ab, bc, ca]
        rest = np.concatenate(
            [np.stack(three, axis=1) for three in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    return np.concatenate(found)
