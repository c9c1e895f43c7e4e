"""Runs faired: a level curve trembles from edge to edge of the mesh it was traced on, and no bead needs that.

Where a distance is interpolated along edges of different directions, its level curve leaves the true one to either side
by a hundredth of the spacing and more. That costs no evenness, but a controller cannot follow it at speed: each of its
waves is a bend as tight as a corner. A Gaussian window, applied to what it left out as well, takes waves as short as an
edge away and keeps bends: it leaves a circle by the fourth power of the window over the third of the radius.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from geoprint.model import FloatArray, Surface, SurfacePoints
from geoprint.paths.resample import ROUNDING
from geoprint.surfaces import arc_lengths, closest, positions

# Standard deviation of the window in mean edges of the triangles passed, and its bound as a share of the spacing.
WINDOW_EDGES = 1.0
LARGEST_SHARE = 0.2
# No place is moved by more than this share of the spacing: a corner stays one, and is rounded later.
MOST_MOVED_SHARE = 1.0 / 50.0
# Even samples for each standard deviation of the window, so many on each run at least.
SAMPLES_PER_WINDOW = 2
FEWEST_SAMPLES = 8
# The window ends at so many standard deviations.
WINDOW_END = 4.0


def faired(surface: Surface, runs: list[SurfacePoints], *, closed: list[bool], spacing: float) -> list[SurfacePoints]:
    """Return runs without what they tremble, evenly sampled on the surface.

    Args:
        surface: what the runs lie on.
        runs: points of each; a closed one repeats its first point.
        closed: whether each is.
        spacing: distance between neighbouring runs [mm].

    Returns:
        As many runs; an open one keeps its ends. No place is farther than a 50th of the spacing from its run, but for
        what the surface curves in between.
    """
    if not runs:
        return []
    drawn = [
        _without_tremor(
            positions(surface, points),
            closed=ring,
            window=min(WINDOW_EDGES * _mean_edge(surface, points), LARGEST_SHARE * spacing),
            most=MOST_MOVED_SHARE * spacing,
        )
        for points, ring in zip(runs, closed, strict=True)
    ]
    landed, _ = closest(surface, np.concatenate(drawn))
    ends = np.cumsum([len(places) for places in drawn])[:-1]
    parts = map(SurfacePoints, np.split(landed.faces, ends), np.split(landed.weights, ends))
    return [_with_ends(part, run, closed=ring) for part, run, ring in zip(parts, runs, closed, strict=True)]


def _mean_edge(surface: Surface, points: SurfacePoints) -> float:
    """Return the mean edge of the triangles that points lie on [mm]."""
    corners = surface.vertices[surface.faces[points.faces]]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())


def _without_tremor(places: FloatArray, *, closed: bool, window: float, most: float) -> FloatArray:
    """Return even places along a polyline (k, 3), moved by at most so much to where a window puts them [mm]."""
    arcs = arc_lengths(places)
    length = float(arcs[-1])
    count = max(int(np.ceil(length / window * SAMPLES_PER_WINDOW - ROUNDING)), FEWEST_SAMPLES)
    deviation = window / length * count
    even: FloatArray = np.linspace(0.0, length, count + 1)
    line = np.column_stack([np.interp(even, arcs, places[:, i]) for i in range(3)])
    once = _windowed(line, deviation, closed=closed)
    moved = 2.0 * once - _windowed(once, deviation, closed=closed) - line
    # Smoothly bounded: a sudden bound would bend the run where it begins.
    far = np.linalg.norm(moved, axis=1, keepdims=True) / most
    return line + moved / (1.0 + far**4) ** 0.25


def _windowed(line: FloatArray, deviation: float, *, closed: bool) -> FloatArray:
    """Return the mean of even places (n, 3) in a Gaussian window of so many samples; the ends of an open line stay."""
    if closed:
        around = gaussian_filter1d(line[:-1], deviation, axis=0, mode="wrap", truncate=WINDOW_END)
        return np.vstack([around, around[:1]])
    reach = min(int(np.ceil(WINDOW_END * deviation)), len(line) - 1)
    # Beyond its ends the line goes on as it came, turned half about them.
    longer = np.vstack([2.0 * line[0] - line[reach:0:-1], line, 2.0 * line[-1] - line[-2 : -2 - reach : -1]])
    return gaussian_filter1d(longer, deviation, axis=0, truncate=WINDOW_END)[reach : reach + len(line)]


def _with_ends(points: SurfacePoints, run: SurfacePoints, *, closed: bool) -> SurfacePoints:
    """Return the points of an open run with its own ends, of a closed one with its first point as the last."""
    ends, last = (points, 0) if closed else (run, -1)
    return SurfacePoints(
        np.concatenate([ends.faces[:1], points.faces[1:-1], ends.faces[[last]]]),
        np.concatenate([ends.weights[:1], points.weights[1:-1], ends.weights[[last]]]),
    )
