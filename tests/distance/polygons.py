"""Plane regions with corners of both kinds and holes, triangulated irregularly, and slow exact distances to them."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

from geoprint.geometry import even_points
from geoprint.model import FloatArray, Surface


def segments_of(*loops: FloatArray) -> FloatArray:
    """Return the (s, 2, 2) segments of closed loops of (k, 2) corners, the first not repeated."""
    return np.concatenate([np.stack([loop, np.roll(loop, -1, axis=0)], axis=1) for loop in loops])


def slow_distances(points: FloatArray, segments: FloatArray) -> FloatArray:
    """Return the (k,) distance of points to the nearest segment, segment by segment."""
    best = np.full(len(points), np.inf)
    for start, end in segments:
        along, away = end - start, points - start
        square = float(along @ along)
        share = np.clip(away @ along / square, 0.0, 1.0) if square > 0 else np.zeros(len(points))
        best = np.minimum(best, np.hypot(*(away - share[:, None] * along).T))
    return best


def surrounded(points: FloatArray, segments: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Tell which points loops surround an odd number of times: by counting crossings of a ray to the right."""
    crossings = np.zeros(len(points), dtype=np.int64)
    for (x0, y0), (x1, y1) in segments:
        spans = (y0 > points[:, 1]) != (y1 > points[:, 1])
        x = x0 + (points[:, 1] - y0) / (y1 - y0 if y1 != y0 else 1.0) * (x1 - x0)
        crossings += spans & (x > points[:, 0])
    return crossings % 2 == 1


def star(corners: int, *, radius: float, seed: int, centre: tuple[float, float] = (0.0, 0.0)) -> FloatArray:
    """Return the corners of a random star-shaped polygon, counter-clockwise, between 0.5 and 1 radius from a centre."""
    rng = np.random.default_rng(seed)
    angles = 2 * np.pi * (np.arange(corners) + rng.uniform(-0.4, 0.4, corners)) / corners
    reach = rng.uniform(0.5, 1.0, corners) * radius
    return np.array(centre) + np.column_stack([np.cos(angles), np.sin(angles)]) * reach[:, None]


def triangulated(*loops: FloatArray, width: float, seed: int = 0) -> Surface:
    """Return the region inside the first loop and outside the others at z = 0, its triangles about a width wide."""
    segments = segments_of(*loops)
    rim = np.concatenate(
        [
            even_points(np.vstack([loop, loop[:1]])[i : i + 2], step=width / 2)[:-1]
            for loop in loops
            for i in range(len(loop))
        ]
    )
    low, high = rim.min(axis=0), rim.max(axis=0)
    grid = np.stack(np.meshgrid(*(np.arange(a, b, width) for a, b in zip(low, high, strict=True))), axis=-1).reshape(
        -1, 2
    )
    grid += np.random.default_rng(seed).uniform(-0.25, 0.25, grid.shape) * width
    inner = grid[surrounded(grid, segments) & (slow_distances(grid, segments) > 0.5 * width)]
    flat = np.vstack([rim, inner])
    faces = Delaunay(flat).simplices
    faces = faces[surrounded(flat[faces].mean(axis=1), segments)]
    a, b, c = (flat[faces[:, corner]] for corner in range(3))
    turned = (b - a)[:, 0] * (c - a)[:, 1] < (b - a)[:, 1] * (c - a)[:, 0]
    faces[turned] = faces[turned][:, ::-1]
    return Surface(np.column_stack([flat, np.zeros(len(flat))]), faces.astype(np.int64), name="polygon")


LETTER = np.array([[0.0, 0], [30, 0], [30, 12], [13, 14], [12, 31], [0, 28]])
LETTER_HOLES = (np.array([[4.0, 4], [4, 8], [8, 9], [9, 4]]), np.array([[3.5, 18], [6, 23], [8.5, 18]]))
