"""How much of the surface the path covers once, twice or not at all, and how wide the strip of each stretch is.

The surface is cut into small triangles. In each of them the distance to the nearest stretch of path falls one way, and
the distance to the nearest other stretch falls the other way, both at a rate of one: the shares of the triangle that
belong to this stretch, that are far from both and that are near both follow from the two distances at its middle. So
shares are far finer than the triangles. Distances run over the surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from geoprint.model import BoolArray, FloatArray, IntArray
from geoprint.model.arrays import freeze_arrays
from geoprint.quality.deposited import Samples
from geoprint.quality.geodesic import Ask, GeodesicDistance
from geoprint.quality.triangles import Mesh, Places, smallest_pieces

# Surface farther than this share of the spacing from every run is a gap.
GAP_SHARE = 0.55
# Surface nearer than this share of the spacing to two stretches is overlapped.
OVERLAP_SHARE = 0.45
# Stretches of one run are two when they are farther apart along it than this many spacings.
APART = 2.0
# Sides of the small triangles over the spacing.
TRIANGLE_SHARE = 0.25
# The width of a strip is its mean over this share of the spacing to both sides along the path: flow follows no faster.
WIDTH_SHARE = 0.5


@final
@dataclass(frozen=True, slots=True, eq=False)
class Coverage:
    """What the path does to the area.

    Attributes:
        area: of the surface [mm2].
        gap: share of it farther than 0.55 spacings from every run.
        overlap: share of it within 0.45 spacings of two stretches more than two spacings apart along the path.
        widths: (k,) width of the strip nearest to the path at each sample, over the spacing.
        width_cv: its coefficient of variation along the path.
        unknown: share of the area for which the budget of work did not suffice; it counts in none of the others.
    """

    area: float
    gap: float
    overlap: float
    widths: FloatArray
    width_cv: float
    unknown: float

    def __post_init__(self) -> None:
        freeze_arrays(self, widths="float: k")


def coverage(mesh: Mesh, distance: GeodesicDistance, samples: Samples, *, spacing: float) -> Coverage:
    """Measure how the path covers the surface.

    Args:
        mesh: m triangles.
        distance: to the path.
        samples: k samples along all runs of the path, for the widths.
        spacing: wanted [mm].
    """
    places, areas = smallest_pieces(mesh, edge_length=TRIANGLE_SHARE * spacing)
    nearest = distance(places, Ask.anything(places.faces.size))
    known = np.isfinite(nearest.distances)
    places, sizes = Places(places.faces[known], places.flat[known]), areas[known]
    own, runs, arcs = nearest.distances[known], nearest.runs[known], nearest.arcs[known]
    across = np.sqrt(sizes)
    limits = np.maximum(own, OVERLAP_SHARE * spacing) + across
    second = distance(places, Ask.elsewhere(runs, arcs, clear=APART * spacing, limits=limits))
    other = second.distances
    gap = _overlap_of(across, GAP_SHARE * spacing - own, other - GAP_SHARE * spacing)
    overlap = _overlap_of(across, other - OVERLAP_SHARE * spacing, OVERLAP_SHARE * spacing - own)
    here = _overlap_of(across, np.full(own.size, -np.inf), 0.5 * (other - own))
    there = np.isfinite(other)
    strips = _strips(
        samples,
        np.concatenate([runs, second.runs[there]]),
        np.concatenate([arcs, second.arcs[there]]),
        np.concatenate([sizes * here, (sizes * (1.0 - here))[there]]),
        closed=distance.closed,
    )
    area = float(areas.sum())
    widths, weights = _widths(samples, strips, closed=distance.closed, spacing=spacing)
    mean = np.average(widths, weights=weights)
    return Coverage(
        area=area,
        gap=float(sizes @ gap) / area,
        overlap=float(sizes @ overlap) / area,
        widths=widths,
        width_cv=float(np.sqrt(np.average((widths - mean) ** 2, weights=weights)) / mean),
        unknown=1.0 - float(sizes.sum()) / area,
    )


def _overlap_of(across: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return which share of [-across / 2, across / 2] lies in [low, high]."""
    return np.maximum(np.minimum(high, 0.5 * across) - np.maximum(low, -0.5 * across), 0.0) / across


def _strips(samples: Samples, runs: IntArray, arcs: FloatArray, areas: FloatArray, *, closed: BoolArray) -> FloatArray:
    """Return the (k,) area nearest to each sample: each piece of it is shared by the samples before and after."""
    first = np.searchsorted(samples.runs, np.arange(closed.size))
    gaps = np.searchsorted(samples.runs, np.arange(closed.size), side="right") - first - 1
    steps = samples.arcs[first + gaps] / gaps
    position = np.clip(arcs / steps[runs], 0.0, gaps[runs])
    before = np.minimum(position.astype(np.int64), gaps[runs] - 1)
    share = position - before
    result = np.bincount(first[runs] + before, areas * (1.0 - share), minlength=samples.runs.size)
    result += np.bincount(first[runs] + before + 1, areas * share, minlength=samples.runs.size)
    # Both ends of a closed run are one place.
    start, end = first[closed], (first + gaps)[closed]
    result[start] = result[end] = 0.5 * (result[start] + result[end])
    return result


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
