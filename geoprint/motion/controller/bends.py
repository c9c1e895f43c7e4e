"""Bends in which targets stand beside the path, or closer than a controller takes: what is listed of them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np

from geoprint.model import Bend, BoolArray, FloatArray, IntArray, PoseStream
from geoprint.motion.controller.choice import TIME_ROUNDING


def bends_of(
    poses: PoseStream, chosen: IntArray, times: FloatArray, *, places: FloatArray, shortest: float
) -> tuple[Bend, ...]:
    """Return the bends with targets beside the path, and the stretches with moves that lay material in less time.

    Args:
        poses: p poses.
        chosen: (t,) of them that are targets.
        times: (p,) when they are passed [s].
        places: (t, 3) where the targets stand [mm].
        shortest: time of a move from which on nothing is said of it [s].
    """
    offsets, durations = np.linalg.norm(places - poses.tips[chosen], axis=1), np.diff(times[chosen])
    close = np.append(poses.laid[chosen[:-1]] & (durations < shortest * (1.0 - TIME_ROUNDING)), np.False_)
    kinds: tuple[tuple[Literal["rounded", "close"], BoolArray], ...] = (("rounded", offsets > 0.0), ("close", close))
    found = [
        _bend(poses, chosen, durations, offsets=offsets, first=first, last=last, kind=kind)
        for kind, flags in kinds
        for first, last in _stretches(flags, poses.runs[chosen])
    ]
    return tuple(sorted(found, key=lambda bend: (bend.run, bend.arc)))


def _stretches(flags: BoolArray, runs: IntArray) -> Iterator[tuple[int, int]]:
    """Yield first and last of each stretch of flags in one run."""
    rows = np.flatnonzero(flags)
    parts = np.split(rows, np.flatnonzero((np.diff(rows) > 1) | (np.diff(runs[rows]) != 0)) + 1)
    return ((int(part[0]), int(part[-1])) for part in parts if part.size)


def _bend(
    poses: PoseStream,
    chosen: IntArray,
    durations: FloatArray,
    *,
    offsets: FloatArray,
    first: int,
    last: int,
    kind: Literal["rounded", "close"],
) -> Bend:
    most = first + int(offsets[first : last + 1].argmax()) if kind == "rounded" else (first + last) // 2
    x, y, z = poses.tips[chosen[most]].tolist()
    return Bend(
        run=int(poses.runs[chosen[most]]),
        kind=kind,
        place=(x, y, z),
        arc=float(poses.arcs[chosen[most]]),
        radius=_radius(poses.tips[chosen[max(most - 1, 0) : most + 2]]),
        targets=last - first + 1,
        offset=float(offsets[first : last + 1].max()),
        shortest=float(durations[max(first - 1, 0) : last + 1].min()),
    )


def _radius(tips: FloatArray) -> float:
    """Return the radius of the circle through three places; infinite where they lie in a line [mm]."""
    sides = np.linalg.norm(tips - np.roll(tips, 1, axis=0), axis=1)
    area = float(np.linalg.norm(np.cross(tips[1] - tips[0], tips[-1] - tips[0])))
    return float(sides.prod()) / (2.0 * area) if len(tips) == 3 and area > 0.0 else float("inf")
