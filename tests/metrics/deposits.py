"""Streams of depositing poses along given lines, for what measures them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geoprint.model import FloatArray, PoseStream

STANDOFF = 0.3


def deposited(lines: Sequence[FloatArray], levels: Sequence[int]) -> PoseStream:
    """Return a stream whose runs lie on (k, 3) lines, one a level; the tool stands straight above them."""
    counts = [len(line) for line in lines]
    points = np.concatenate(lines)
    count = len(points)
    return PoseStream(
        tips=points + np.array([0.0, 0.0, STANDOFF]),
        quaternions=np.tile([0.0, 1.0, 0.0, 0.0], (count, 1)),
        normals=np.tile([0.0, 0.0, 1.0], (count, 1)),
        runs=np.repeat(np.arange(len(lines)), counts),
        levels=np.repeat(np.array(levels), counts),
        layers=np.zeros(count, dtype=np.int64),
        deposit=np.ones(count, dtype=np.bool_),
        stops=np.zeros(count, dtype=np.bool_),
        arcs=np.concatenate([np.arange(k, dtype=np.float64) for k in counts]),
        flow=np.ones(count),
        standoff=STANDOFF,
    )


def straight_line(start: tuple[float, float], end: tuple[float, float], *, points: int = 101) -> FloatArray:
    """Return points of a straight line on the plane z = 0."""
    flat = np.linspace(start, end, points)
    return np.column_stack([flat, np.zeros(points)])


def circle(radius: float, *, height: float = 0.0, points: int = 361) -> FloatArray:
    """Return a closed circle about the z axis that repeats its first point."""
    turn = np.append(np.linspace(0.0, 2 * np.pi, points - 1, endpoint=False), 0.0)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(points, height)])


def rectangle_line(low: tuple[float, float], high: tuple[float, float]) -> FloatArray:
    """Return a closed rectangle on the plane z = 0, counter-clockwise, with points on its sides."""
    corners = [low, (high[0], low[1]), high, (low[0], high[1]), low]
    sides = [straight_line(corners[i], corners[i + 1], points=41)[:-1] for i in range(4)]
    return np.concatenate([*sides, sides[0][:1]])
