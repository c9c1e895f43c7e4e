"""How much of the surface the path covers once, twice or not at all, and how wide the strip of each stretch is.

The surface is cut into small triangles. In each of them the distance to the nearest stretch of path falls to one side,
and the distance to the nearest other stretch to the other side, both at a rate of one: the shares of the triangle that
belong to this stretch, that are far from both and that are near both follow from the two distances at its middle, the
first of them, which sets the flow, with the directions too. So shares are far finer than the triangles. Distances run
over the surface.
"""

from __future__ import annotations

from typing import NamedTuple, final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from geoprint.metrics.deposited import Samples
from geoprint.metrics.oracle import (
    ANY,
    Ask,
    ComplexArray,
    FlatMesh,
    GeodesicDistance,
    Places,
    SmallTriangles,
    SurfacePath,
    positive_shares,
    small_triangles,
    spatial,
)
from geoprint.metrics.spacing import APART, SpacingAt, shares_at
from geoprint.model import GAP_SHARE, OVERLAP_SHARE, BoolArray, FloatArray, IntArray, freeze_arrays, frozen

# How wide the strip of surface is that lies nearest to each stretch of path: what the flow should follow.


# The width of a strip is its mean over this share of the spacing to both sides along the path: flow follows no faster.
WIDTH_SHARE = 0.5
# Ends of runs that lie so near to each other are one place, as where a run is split at a corner [mm].
ONE_PLACE = 1e-4


def strip_widths(
    samples: Samples,
    runs: IntArray,
    arcs: FloatArray,
    areas: FloatArray,
    *,
    points: FloatArray,
    closed: BoolArray,
    spacing: float,
) -> tuple[FloatArray, FloatArray]:
    """Return the width of the strip around each sample.

    Args:
        samples: k samples along r runs.
        runs: (j,) to which run pieces of the surface are nearest.
        arcs: (j,) and where along it [mm].
        areas: (j,) how large they are [mm2].
        points: (k, 3) where the samples lie [mm].
        closed: (r,) whether each run is closed.
        spacing: wanted [mm].

    Returns:
        (k,) widths over the spacing, means over half a spacing to both sides, and the (k,) length of path that each
        sample stands for [mm].
    """
    strips = _strips(samples, runs, arcs, areas, points=points, closed=closed)
    return _widths(samples, strips, closed=closed, spacing=spacing)


def _strips(
    samples: Samples, runs: IntArray, arcs: FloatArray, areas: FloatArray, *, points: FloatArray, closed: BoolArray
) -> FloatArray:
    """Return the (k,) area nearest to each sample: each piece of it is shared by the samples before and after."""
    first = np.searchsorted(samples.runs, np.arange(closed.size))
    gaps = np.searchsorted(samples.runs, np.arange(closed.size), side="right") - first - 1
    steps = samples.arcs[first + gaps] / gaps
    position = np.clip(arcs / steps[runs], 0.0, gaps[runs])
    before = np.minimum(position.astype(np.int64), gaps[runs] - 1)
    share = position - before
    count = samples.runs.size
    result = np.asarray(np.bincount(first[runs] + before, areas * (1.0 - share), minlength=count), dtype=np.float64)
    result += np.bincount(first[runs] + before + 1, areas * share, minlength=count)
    ends = np.concatenate([first, first + gaps])
    place = _places(points[ends], closed=closed)
    result[ends] = (np.bincount(place, result[ends]) / np.bincount(place))[place]
    return result


def _places(ends: FloatArray, *, closed: BoolArray) -> IntArray:
    """Return the place of each of the 2 r ends, starts before ends: those at one place share what is nearest to it.

    Which of them is nearer, rounding alone would decide. Both ends of a closed run are one place.
    """
    around = np.flatnonzero(closed)
    near: IntArray = KDTree(ends).query_pairs(ONE_PLACE, output_type="ndarray").astype(np.int64)
    one: IntArray = np.concatenate([near[:, 0], around])
    other: IntArray = np.concatenate([near[:, 1], around + closed.size])
    links = coo_array((np.ones(one.size), (one, other)), shape=(ends.shape[0], ends.shape[0]))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _widths(
    samples: Samples, strips: FloatArray, *, closed: BoolArray, spacing: float
) -> tuple[FloatArray, FloatArray]:
    """Return the (k,) mean widths around each sample, over the spacing, and the (k,) length that each stands for."""
    run = samples.runs
    first = np.searchsorted(run, np.arange(closed.size))
    gaps = (np.searchsorted(run, np.arange(closed.size), side="right") - first - 1)[run]
    rank = np.arange(run.size) - first[run]
    steps = samples.arcs[first[run] + gaps] / gaps
    lengths = np.where((rank == 0) | (rank == gaps), 0.5 * steps, steps)
    area, length = np.zeros(run.size), np.zeros(run.size)
    reach = np.maximum(np.round(WIDTH_SHARE * spacing / steps), 1).astype(np.int64)
    # A closed run shorter than the reach to both sides is taken once around.
    reach = np.minimum(reach, np.maximum((gaps - 1) // 2, 1))
    for shift in range(-int(reach.max()), int(reach.max()) + 1):
        place = np.where(closed[run], (rank + shift) % gaps, rank + shift)
        valid = (abs(shift) <= reach) & (place >= 0) & (place <= gaps)
        index = first[run] + np.clip(place, 0, gaps)
        # The ends of a closed run hold half of their strip each.
        whole = np.where(closed[run] & (place == 0), 2.0, 1.0)
        area += np.where(valid, whole * strips[index], 0.0)
        length += np.where(valid, whole * lengths[index], 0.0)
    return area / length / spacing, lengths


# Surface farther than this many spacings from every run belongs to no strip: no bead reaches it.
REACH = 1.0
# Sides of the small triangles over the spacing.
TRIANGLE_SHARE = 0.25
# Middles of triangles that share an edge are nearer together than this share of the side that they are cut to.
NEIGHBOURS_SHARE = 0.7
# So many small triangles, taken at random, are enough for any surface.
MOST_TRIANGLES = 1_000_000


@final
@frozen
class Coverage:
    """What the path does to the area.

    Attributes:
        area: of the surface [mm2].
        gap: share of it farther than 0.55 spacings from every run.
        overlap: share of it within 0.45 spacings of two stretches more than two spacings apart along the path.
        widths: (k,) width of the strip nearest to the path at each sample, over the spacing.
        width_cv: its coefficient of variation along the path.
        hole: area of the largest connected gap [mm2].
        unknown: share of the area for which the budget of work did not suffice; the others are shares of the rest.
        places: (j, 3) middles of the small triangles that were judged [mm].
        gaps: (j,) whether each is farther than 0.55 spacings from every run.
        overlaps: (j,) whether each is within 0.45 spacings of two stretches.
    """

    area: float
    gap: float
    overlap: float
    widths: FloatArray
    width_cv: float
    hole: float
    unknown: float
    places: FloatArray
    gaps: BoolArray
    overlaps: BoolArray

    def __post_init__(self) -> None:
        freeze_arrays(self, widths="float: k", places="float: j 3", gaps="bool: j", overlaps="bool: j")


class _NearestTwo(NamedTuple):
    """For each of j small triangles the nearest stretch of path and the nearest other one, infinitely far for none."""

    triangles: SmallTriangles
    own: FloatArray
    own_runs: IntArray
    own_arcs: FloatArray
    other: FloatArray
    other_runs: IntArray
    other_arcs: FloatArray

    def some(self, which: BoolArray) -> _NearestTwo:
        """Return some of them."""
        return _NearestTwo(
            self.triangles.some(which),
            self.own[which], self.own_runs[which], self.own_arcs[which],
            self.other[which], self.other_runs[which], self.other_arcs[which],
        )  # fmt: skip


def coverage(
    mesh: FlatMesh,
    path: SurfacePath,
    distance: GeodesicDistance,
    samples: Samples,
    *,
    spacing: float,
    wanted: SpacingAt | None = None,
) -> Coverage:
    """Measure how the path covers the surface.

    Args:
        mesh: m triangles.
        path: on it.
        distance: to the path.
        samples: k samples along all runs of the path, for the widths.
        spacing: wanted [mm].
        wanted: what it is at each place, where that differs; gap, overlap and widths are over that then.
    """
    area = 0.5 * float((mesh.corners[1::3].real * mesh.corners[2::3].imag).sum())
    found, areas, unknown = _nearest_two(mesh, distance, spacing=spacing, wanted=wanted)
    local = spacing * shares_at(mesh, found.triangles.middles, wanted, spacing=spacing)
    across, gap, overlap = found.triangles.extents, GAP_SHARE * local, OVERLAP_SHARE * local
    near, both = np.isfinite(found.own), np.isfinite(found.other)
    here = _own_shares(mesh, path, found, both)
    weights = areas / areas.sum()
    widths, lengths = strip_widths(
        samples,
        np.concatenate([found.own_runs[near], found.other_runs[both]]),
        np.concatenate([found.own_arcs[near], found.other_arcs[both]]),
        area * np.concatenate([(weights * here)[near], (weights * (1.0 - here))[both]]),
        points=spatial(mesh, samples.places),
        closed=path.closed,
        spacing=spacing,
    )
    widths = widths / shares_at(mesh, samples.places, wanted, spacing=spacing)
    places = spatial(mesh, found.triangles.middles)
    mean, missed = np.average(widths, weights=lengths), weights * _share(across, gap - found.own, found.other - gap)
    return Coverage(
        area=area,
        gap=float(missed.sum()),
        overlap=float(weights @ _share(across, found.other - overlap, overlap - found.own)),
        widths=widths,
        width_cv=float(np.sqrt(np.average((widths - mean) ** 2, weights=lengths)) / mean),
        hole=_largest_hole(places, area * missed, spacing=spacing),
        unknown=unknown,
        places=places,
        gaps=found.own > gap,
        overlaps=found.other < overlap,
    )


def _nearest_two(
    mesh: FlatMesh, distance: GeodesicDistance, *, spacing: float, wanted: SpacingAt | None
) -> tuple[_NearestTwo, FloatArray, float]:
    """Return the stretches near small triangles, how much area each of these stands for, and the unknown share of it.

    A triangle whose stretches were not found counts with the nearest one whose were: without it the strips about it
    would seem narrower, here more and there less.
    """
    every = small_triangles(mesh, edge_length=TRIANGLE_SHARE * spacing)
    # In random order, so that what a budget leaves out is nowhere in particular.
    order = np.random.default_rng(0).permutation(every.areas.size)
    triangles = every.some(order[:MOST_TRIANGLES])
    local = spacing * shares_at(mesh, triangles.middles, wanted, spacing=spacing)
    own = distance(triangles.middles, distance.narrowed(triangles.middles, Ask.anything(limits=REACH * local)))
    reach = np.maximum(own.distances, OVERLAP_SHARE * local) + triangles.extents
    limits = np.where(np.isfinite(own.distances), reach, 0.0)
    ask = Ask.elsewhere(np.full(limits.size, ANY), own.runs, own.arcs, clear=APART * spacing, limits=limits)
    other = distance(triangles.middles, distance.narrowed(triangles.middles, ask))
    known = own.complete & other.complete
    found = _NearestTwo(triangles, own.distances, own.runs, own.arcs, other.distances, other.runs, other.arcs)
    areas = triangles.areas[known]
    unknown = 1.0 - float(areas.sum() / triangles.areas.sum())
    others = every.some(np.concatenate([order[:MOST_TRIANGLES][~known], order[MOST_TRIANGLES:]]))
    if known.any() and others.areas.size:
        places = [spatial(mesh, some.middles) for some in (triangles.some(known), others)]
        _, nearest = KDTree(places[0]).query(places[1])
        areas = areas + np.bincount(np.asarray(nearest, dtype=np.int64), others.areas, minlength=areas.size)
    return found.some(known), areas, unknown


def _own_shares(mesh: FlatMesh, path: SurfacePath, found: _NearestTwo, both: BoolArray) -> FloatArray:
    """Return which share of each triangle is nearer to its own stretch than to the other, where it has both.

    Across a triangle both distances fall at a rate of one towards the places that they lead to, so half of their
    difference is linear, and its zero cuts the triangle by a line.
    """
    shares, found = np.ones(both.size), found.some(both)
    middles = found.triangles.middles
    towards = [
        _directions(mesh, middles, path.at(runs, arcs))
        for runs, arcs in ((found.own_runs, found.own_arcs), (found.other_runs, found.other_arcs))
    ]
    rise = 0.5 * (towards[0] - towards[1])
    change = np.real(np.conj(rise)[:, None] * found.triangles.corners(mesh))
    shares[both] = positive_shares(0.5 * (found.other - found.own)[:, None] + change)
    return shares


def _directions(mesh: FlatMesh, places: Places, ends: Places) -> ComplexArray:
    """Return the (k,) unit vectors from places towards others in the planes of their faces; 0 where both are one."""
    along = np.einsum("kpx,kx->kp", mesh.axes[places.faces], spatial(mesh, ends) - spatial(mesh, places))
    plane = along[:, 0] + 1j * along[:, 1]
    length = np.abs(plane)
    return np.divide(plane, length, out=np.zeros_like(plane), where=length > 0.0)


def _share(across: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return which share of [-across / 2, across / 2] lies in [low, high]."""
    return np.maximum(np.minimum(high, 0.5 * across) - np.maximum(low, -0.5 * across), 0.0) / across


def _largest_hole(places: FloatArray, missed: FloatArray, *, spacing: float) -> float:
    """Return the area of the largest connected piece farther than 0.55 spacings from every run [mm2].

    Small triangles hang together where their middles are as near as those of neighbours, so that a seam narrower than
    a quarter of a spacing between two pieces does not part them.

    Args:
        places: (j, 3) middles of the small triangles [mm].
        missed: (j,) area of each that is so far away [mm2].
        spacing: wanted [mm].
    """
    bare = np.flatnonzero(missed > 0.0)
    if not bare.size:
        return 0.0
    pairs = KDTree(places[bare]).query_pairs(NEIGHBOURS_SHARE * TRIANGLE_SHARE * spacing, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(bare.size, bare.size))
    _, pieces = connected_components(links, directed=False)
    return float(np.bincount(pieces, missed[bare]).max())
