"""Normals along which a run is lifted to its stand-off: the surface's, and smoothed where those would fold the line.

The tip stands at the stand-off along the normal. In a crease that bends over a shorter radius than the stand-off,
neighbouring normals cross: the tip runs back while the run goes on, and the tool turns on the spot, which no speed
allows. There the surface is too fine for the tip, and its normals are averaged along the run until the tip runs on.
"""

from __future__ import annotations

import numpy as np

from geoprint.errors import FieldError
from geoprint.geometry import SHARP, SmoothNormals, arc_lengths, closest, normals, positions, smooth_normals
from geoprint.model import FloatArray, IntArray, PoseStream, Surface, Toolpath, frozen

# The tip advances along each step of its run by at least this share of the step. With a half, a turning normal moves
# the tip back by no more than half a step: it turns by at most one radian a stand-off that the tip travels, as fast as
# around a sharp edge, where the tip drives a circle.
LEAST_ADVANCE = 0.5
# The Gaussian window in a crease: its standard deviation in stand-offs where it is tried first, by how much it grows
# while the tip does not advance, and by how much it shrinks per length of run away from there.
FIRST_DEVIATION = 0.5
GROWTH = 1.25
TAPER = 0.5
# Over windows so many times as long as run and stand-off all weigh the same: what does not advance then never does.
LONGEST_WINDOW = 100.0
# A mean of unit normals shorter than this has no direction: they cancel out.
SHORTEST_MEAN = 1e-3
# Steps shorter than this [mm] have no direction.
SHORTEST = 1e-9
# Cosine of normals that are the same but for rounding.
ALIKE = 1.0 - 1e-9


@frozen
class CrossedCreases:
    """Poses on deposit in creases too narrow for the stand-off, where the tip is lifted along smoothed normals.

    Attributes:
        poses: (j,) rows of the stream, rising.
        distances: (j,) from the tip to the nearest place of the surface [mm].
        count: how often a run crosses one: stretches of these poses farther apart than a stand-off.
    """

    poses: IntArray
    distances: FloatArray
    count: int


def outward_normals(toolpath: Toolpath, surface: Surface, smooth: SmoothNormals, *, standoff: float) -> FloatArray:
    """Return the (k, 3) unit normals of the points of runs: of the side that they lie on.

    Where a run goes over a crease all the same, they turn from one side to the other within one edge of the mesh. Where
    an open run ends in a bend tighter than the stand-off, as at an edge that is all but sharp, they turn no more there.

    Args:
        toolpath: on the surface.
        surface: what is printed on.
        smooth: its normals.
        standoff: height of the tip over the surface [mm].
    """
    curves = toolpath.curves
    outward, turning = (normals(surface, curves.points, given=each) for each in (smooth.corners, smooth.vertices))
    run = np.repeat(np.arange(curves.count), np.diff(curves.offsets))
    apart = np.einsum("kx,kx->k", outward, turning) < ALIKE
    stretch = np.cumsum(np.append(True, (apart[1:] != apart[:-1]) | (run[1:] != run[:-1])))
    over = (stretch[1:] == stretch[:-1]) & (np.einsum("kx,kx->k", outward[1:], outward[:-1]) < np.cos(SHARP))
    outward = np.where(np.isin(stretch, stretch[1:][over])[:, None] | ~apart[:, None], turning, outward)
    places, closed = positions(surface, curves.points), curves.closed
    for begin, end in zip(curves.offsets[:-1][~closed].tolist(), curves.offsets[1:][~closed].tolist(), strict=True):
        for rows in (slice(begin, end), slice(end - 1, begin - 1 if begin else None, -1)):
            _hold(outward[rows], places[rows], standoff=standoff)
    return outward


def _hold(outward: FloatArray, places: FloatArray, *, standoff: float) -> None:
    """Hold the normals at the start of a run, if it lies in a bend that juts out and is tighter than the stand-off."""
    held = min(int(np.searchsorted(arc_lengths(places), standoff)), len(places) - 1)
    turned = outward[0] - outward[held]
    if outward[0] @ outward[held] < np.cos(SHARP / 2.0) and turned @ (places[0] - places[held]) > 0.0:
        outward[:held] = outward[held]


def lifting_normals(places: FloatArray, outward: FloatArray, *, closed: bool, standoff: float) -> FloatArray:
    """Return the normals along which the samples of one run are lifted so that the tip always advances.

    Where the tip advances at least half as far as the run anyway, they are the normals of the surface to the last bit.
    Elsewhere each is the Gaussian mean of the normals along the run, over a window that is widest in the crease and
    closes away from it.

    Args:
        places: (k, 3) samples of the run on the surface [mm], k >= 2.
        outward: (k, 3) unit normals of the surface there.
        closed: whether the run ends where it starts; then the window runs across the seam.
        standoff: height of the tip over the surface [mm].

    Returns:
        (k, 3) unit vectors.

    Raises:
        FieldError: no window helps, because the normals of the run point at each other all around, as in a narrow pipe.
    """
    arcs = arc_lengths(places)
    length = float(arcs[-1])
    deviations, lifted = np.zeros(len(places)), outward
    while (stuck := np.flatnonzero(advances(places, lifted, standoff=standoff) < LEAST_ADVANCE)).size:
        ends = np.union1d(stuck, stuck + 1)
        wider = np.maximum(FIRST_DEVIATION * standoff, GROWTH * deviations[ends])
        away = _farther_than(arcs, arcs[ends], around=length if closed else np.inf)
        deviations = np.maximum(deviations, (wider - TAPER * away).max(axis=1))
        means = _means(outward, arcs, deviations, closed=closed)
        lengths = np.linalg.norm(means, axis=1, keepdims=True)
        if lengths.min() < SHORTEST_MEAN or deviations.max() > LONGEST_WINDOW * (length + standoff):
            x, y, z = places[stuck[0]]
            raise FieldError(
                f"around ({x:z.2f}, {y:z.2f}, {z:z.2f}) mm the part is too hollow for a tip {standoff:g} mm above it. "
                "Cut the hollow out of the part, fill it, or lower the stand-off.",
                place=(float(x), float(y), float(z)),
            )
        lifted = np.where(deviations[:, None] > 0.0, means / lengths, outward)
    return lifted


def advances(places: FloatArray, outward: FloatArray, *, standoff: float) -> FloatArray:
    """Return how far the tip advances along each step of a run, as a share of the step: below 0 where it goes back.

    Args:
        places: (k, 3) samples on the surface [mm].
        outward: (k, 3) unit vectors along which they are lifted.
        standoff: how far [mm].

    Returns:
        (k - 1,) shares; 1 on a plane, and where a step has no length.
    """
    steps, turned = np.diff(places, axis=0), np.diff(outward, axis=0)
    squares = np.einsum("ij,ij->i", steps, steps)
    shares = 1.0 + standoff * np.einsum("ij,ij->i", steps, turned) / np.maximum(squares, SHORTEST**2)
    return np.where(squares > SHORTEST**2, shares, 1.0)


def creases(poses: PoseStream, toolpath: Toolpath, surface: Surface, part: Surface) -> CrossedCreases:
    """Return where a stream left the normals of the surface, and measure the tip's distance there.

    Args:
        poses: made of the toolpath.
        toolpath: on the surface.
        surface: what is printed on.
        part: that it was refined from.
    """
    rows, smooth = np.flatnonzero(poses.deposit), smooth_normals(surface, part)
    wanted = outward_normals(toolpath, surface, smooth, standoff=poses.standoff)
    rows = rows[(poses.normals[rows] != wanted).any(axis=1)]
    if rows.size == 0:
        return CrossedCreases(rows, np.zeros(0), 0)
    apart = (np.diff(poses.runs[rows]) > 0) | (np.diff(poses.arcs[rows]) > poses.standoff)
    return CrossedCreases(rows, closest(surface, poses.tips[rows])[1], 1 + int(np.count_nonzero(apart)))


def _farther_than(arcs: FloatArray, others: FloatArray, *, around: float) -> FloatArray:
    """Return the (k, j) distances along the run [mm]; `around` is the length of a closed one."""
    apart = np.abs(arcs[:, None] - others)
    return np.minimum(apart, around - apart)


def _means(outward: FloatArray, arcs: FloatArray, deviations: FloatArray, *, closed: bool) -> FloatArray:
    """Return the (k, 3) means of normals along the run, each over its own deviation [mm]; 0 leaves it alone."""
    shares = np.gradient(arcs) + SHORTEST
    shares[[0, -1]] /= 2.0
    rows = np.flatnonzero(deviations > 0.0)
    apart = _farther_than(arcs[rows], arcs, around=float(arcs[-1]) if closed else np.inf)
    weights = np.exp(-0.5 * (apart / deviations[rows, None]) ** 2) * shares
    means = outward.copy()
    means[rows] = weights @ outward / weights.sum(axis=1, keepdims=True)
    return means
