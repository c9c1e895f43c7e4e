"""Lines drawn with known middles and widths, and simulated prints of a plate."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from geoprint.model import FloatArray, PoseStream

BACK, FORE = 0.3, 0.8


def drawn(size: tuple[int, int], lines: list[tuple[FloatArray, float]], *, noise: float = 0.0) -> FloatArray:
    """Return (h, w) grey values: polylines (k, 2) of pixels, each with its width, edges smooth over a pixel.

    Ends are round: half a width longer than the polyline.
    """
    cover = np.zeros((size[1], size[0]))
    for corners, width in lines:
        reach = 0.5 + width / 2.0
        for start, end in pairwise(corners):
            # Beyond its reach a line covers nothing.
            first = np.clip(np.floor(np.minimum(start, end) - reach), 0.0, size).astype(np.int64)
            last = np.clip(np.ceil(np.maximum(start, end) + reach) + 1.0, 0.0, size).astype(np.int64)
            there = slice(first[1], last[1]), slice(first[0], last[0])
            rows, columns = np.mgrid[there]
            off, ahead = np.stack([columns, rows], axis=-1) - start, end - start
            share = np.clip(off @ ahead / max(float(ahead @ ahead), 1e-12), 0.0, 1.0)
            away = np.linalg.norm(off - share[..., None] * ahead, axis=-1)
            cover[there] = np.maximum(cover[there], np.clip(reach - away, 0.0, 1.0))
    grey = BACK + (FORE - BACK) * cover
    return np.clip(grey + noise * np.random.default_rng(7).standard_normal(grey.shape), 0.0, 1.0)


def straight(*ends: float) -> FloatArray:
    """Return the line from (u, v) to (u, v)."""
    return np.array(ends, dtype=np.float64).reshape(-1, 2)


def stream(runs: list[FloatArray], *, flow: float) -> PoseStream:
    """Return the poses that deposit runs of (k, 3) points on z = 0, with nothing between them."""
    points = np.vstack(runs)
    count = len(points)
    numbers = np.repeat(np.arange(len(runs)), [len(run) for run in runs])
    down = np.tile([0.0, 1.0, 0.0, 0.0], (count, 1))
    return PoseStream(
        tips=points + np.array([0.0, 0.0, 0.5]),
        quaternions=down,
        normals=np.tile([0.0, 0.0, 1.0], (count, 1)),
        runs=numbers,
        levels=numbers,
        layers=np.zeros(count, dtype=np.int64),
        deposit=np.ones(count, dtype=np.bool_),
        stops=np.zeros(count, dtype=np.bool_),
        arcs=np.zeros(count),
        flow=np.full(count, flow),
        standoff=0.5,
    )


def rows_on_plate(
    *, first: float = 5.0, spacing: float = 4.0, count: int = 6, length: float = 30.0
) -> list[FloatArray]:
    """Return straight runs along x on a plate, from the lowest y on."""
    along = np.linspace(5.0, 5.0 + length, 31)
    return [np.column_stack([along, np.full(31, first + spacing * k), np.zeros(31)]) for k in range(count)]
