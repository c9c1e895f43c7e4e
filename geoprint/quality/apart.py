"""How far apart stretches lie: each level from the one outside, or without whole levels from stretches on both sides.

A run that goes through several levels, as a spiral does and rows joined by turns, has no level as a whole: what lies
outside of it is itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geoprint.model import BoolArray, FloatArray, IntArray, PoseStream
from geoprint.quality.deposited import Samples, deposited_rows
from geoprint.quality.oracle import FOUND, UNKNOWN, FlatMesh, GeodesicDistance, SurfacePath
from geoprint.quality.sides import SideSpacing, side_spacing
from geoprint.quality.spacing import SpacingAt, meeting_share, outer_distance
from geoprint.quality.spans import Spans, joined_spans, spans_to


class Apart(NamedTuple):
    """What was measured at (k,) samples.

    Attributes:
        kept: (k,) which of the samples along the path they are; on both sides of a path one may come twice.
        offsets: where stretches of neighbouring samples begin, and where the last one ends.
        ratios: (k,) distance over the spacing.
        bounds: (k,) lower bound of it.
        straight: (k,) the same through the air.
        unreached: samples from which no way over the surface was found.
        meeting: share of the samples within one spacing of another stretch of their own level.
        spans: from where to where.
        sides: all that is known of both sides, or None where there are whole levels.
    """

    kept: IntArray
    offsets: IntArray
    ratios: FloatArray
    bounds: FloatArray
    straight: FloatArray
    unreached: int
    meeting: float
    spans: Spans
    sides: SideSpacing | None


def levelled(poses: PoseStream) -> bool:
    """Return whether every deposited run of a stream keeps to one level."""
    rows = deposited_rows(poses)
    runs, levels = poses.runs[rows], poses.levels[rows]
    return bool((np.diff(levels)[np.diff(runs) == 0] == 0).all())


def outwards(
    mesh: FlatMesh, path: SurfacePath, distance: GeodesicDistance, samples: Samples, *, spacing: float
) -> Apart:
    """Measure from every level but the first to the one outside.

    Args:
        mesh: m triangles.
        path: r runs on it, each of one level.
        distance: to the path.
        samples: along all of its runs.
        spacing: wanted [mm].
    """
    inner = np.flatnonzero(path.levels[samples.runs] > path.levels.min())
    chosen = samples.some(inner)
    outer = outer_distance(mesh, path, distance, chosen, spacing=spacing)
    reached = np.isfinite(outer.distances)
    measured, ratios = chosen.some(reached), outer.distances[reached] / spacing
    return Apart(
        kept=inner[reached],
        offsets=np.append(np.flatnonzero(np.diff(measured.runs, prepend=-1)), measured.runs.size),
        ratios=ratios,
        bounds=outer.bounds[reached] / spacing,
        straight=outer.straight[reached] / spacing,
        unreached=int((~reached).sum()),
        meeting=meeting_share(path, distance, measured, spacing=spacing),
        spans=spans_to(mesh, path, measured, runs=outer.runs[reached], arcs=outer.arcs[reached], ratios=ratios),
        sides=None,
    )


def beside(
    mesh: FlatMesh,
    path: SurfacePath,
    samples: Samples,
    *,
    spacing: float,
    windows: int,
    wanted: SpacingAt | None = None,
) -> Apart:
    """Measure to the left and to the right of the path; what has no neighbour squarely beside it is left out.

    Args:
        mesh: m triangles.
        path: r runs on it.
        samples: along all of its runs.
        spacing: wanted [mm].
        windows: budget of work.
        wanted: as `side_spacing`.
    """
    sides = side_spacing(mesh, path, samples, spacing=spacing, windows=windows, wanted=wanted)
    found: BoolArray = sides.kinds == FOUND
    sample, side = np.nonzero(found)
    order = np.lexsort((sample, side))
    kept, side = sample[order], side[order]
    ratios, spans = sides.ratios[kept, side], joined_spans(*sides.spans)
    local = spacing if wanted is None else 0.5 * (wanted(spans.places) + wanted(spans.feet))
    breaks = (np.diff(kept) != 1) | (np.diff(samples.runs[kept]) != 0) | (np.diff(side) != 0)
    return Apart(
        kept=kept,
        offsets=np.concatenate([[0], np.flatnonzero(breaks) + 1, [kept.size]]),
        ratios=ratios,
        bounds=ratios,
        straight=np.linalg.norm(spans.feet - spans.places, axis=1) / local,
        unreached=int((sides.kinds == UNKNOWN).sum()),
        meeting=0.0,
        spans=spans,
        sides=sides,
    )
