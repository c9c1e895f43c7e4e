"""Grey values across the runs of a plan: what the pixels of a photograph show, by how far beside a run they look.

Every pixel looks at a place of the part, and that is nearest to one stretch of the plan: its grey value counts there,
as far to the left of the run as it lies. What looks past the rim of the part counts nowhere, and so does what is nearer
to a neighbour.
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree

from geoprint.geometry import normals
from geoprint.geometry.rays import first_hits
from geoprint.inspection.against_plan import PlannedRuns
from geoprint.inspection.camera import Camera
from geoprint.inspection.on_part import FLATTEST_SIGHT
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen

# Grey values are gathered so finely across a run [pixels], and as far to each side as this, over the spacing.
BIN = 0.5
REACH_SHARE = 0.8
# What lies nearest to a stretch belongs to it by the nearest of so many places of it, by shares of its length.
ALONG = (-0.375, -0.125, 0.125, 0.375)
# What is farther ahead of a run's end than this, over the length of a stretch, is beyond it.
BEYOND_SHARE = 0.6
# Grey values from here on are white, and nobody knows how much more light there was; of which a mean may hold so many.
WHITE, MOST_WHITE = 0.994, 0.01


@final
@frozen
class LookedAt:
    """Pixels that look at the part near a run of the plan.

    Attributes:
        pixels: (p, 2) column and row.
        stretches: (p,) of the plan, which each is nearest to.
        asides: (p,) how far to the left of it, as seen from outside [mm].
        places: (p, 3) of the part [mm].
    """

    pixels: IntArray
    stretches: IntArray
    asides: FloatArray
    places: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, pixels="int: p 2", stretches="int: p", asides="float: p", places="float: p 3")


@final
@frozen
class Profiles:
    """Grey values across stretches of a plan, each in n bins.

    Attributes:
        asides: (k, n) how far to the left of the run, as seen from outside [pixels].
        greys: (k, n) mean of the pixels; 0 where there is none.
        counts: (k, n) of pixels.
        white: (k, n) share of them that is white.
        scales: (k,) pixels for a mm across the run.
    """

    asides: FloatArray
    greys: FloatArray
    counts: FloatArray
    white: FloatArray
    scales: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, asides="float: k n", greys="float: k n", counts="float: k n", white="float: k n", scales="float: k"
        )


def aside_of(plan: PlannedRuns) -> FloatArray:
    """Return (k, 3) unit directions to the left of the runs, as seen from outside."""
    return np.cross(plan.normals, plan.ahead)


def looked_at(plan: PlannedRuns, camera: Camera, surface: Surface, *, size: tuple[int, int]) -> LookedAt:
    """Return the pixels that look at the part near runs of a plan.

    Args:
        plan: in stretches.
        camera: that took the photograph.
        surface: of the part.
        size: width and height of the photograph [pixels].
    """
    reach = REACH_SHARE * plan.spacing
    pixels = _near(plan, camera, size=size, reach=reach)
    toward = camera.directions(pixels.astype(np.float64))
    hits = first_hits(surface, np.broadcast_to(camera.place, toward.shape).copy(), toward)
    steep = np.abs((normals(surface, hits.points) * toward[hits.met]).sum(axis=1)) >= np.sin(FLATTEST_SIGHT)
    pixels, places = pixels[hits.met][steep], hits.points.xyz(surface)[steep]
    steps = plan.lengths[:, None] * plan.ahead
    finely = (plan.places + np.array(ALONG)[:, None, None] * steps).reshape(-1, 3)
    count = len(plan.places)
    nearest = np.asarray(KDTree(finely).query(places)[1])
    stretches = nearest % count
    off = places - finely[nearest]
    forward = (off * plan.ahead[stretches]).sum(axis=1)
    left = (off * aside_of(plan)[stretches]).sum(axis=1)
    part = np.clip(forward, -0.5 * plan.lengths[stretches] / len(ALONG), 0.5 * plan.lengths[stretches] / len(ALONG))
    away = np.sqrt(np.maximum((off**2).sum(axis=1) - forward**2 + (forward - part) ** 2, 0.0))
    beyond = np.abs(forward) > BEYOND_SHARE * plan.lengths[stretches]
    kept = (away <= reach) & ~(beyond & _at_end(plan)[stretches])
    return LookedAt(pixels[kept], stretches[kept], (np.where(left < 0.0, -1.0, 1.0) * away)[kept], places[kept])


def profiles_of(grey: FloatArray, seen: LookedAt, plan: PlannedRuns, camera: Camera) -> Profiles:
    """Return grey values across each stretch of a plan.

    Args:
        grey: (h, w) of the photograph.
        seen: which of its pixels look where.
        plan: in stretches.
        camera: that took it.
    """
    half = 0.05 * plan.spacing * aside_of(plan)
    spans = camera.seen(plan.places + half) - camera.seen(plan.places - half)
    scales = np.linalg.norm(spans, axis=1) / (0.1 * plan.spacing)
    reach = REACH_SHARE * plan.spacing * float(scales.max())
    bins, count = 2 * int(np.ceil(reach / BIN)) + 1, len(plan.places)
    asides = seen.asides * scales[seen.stretches]
    cells = seen.stretches * bins + np.clip(np.rint(asides / BIN).astype(np.int64) + bins // 2, 0, bins - 1)
    values = grey[seen.pixels[:, 1], seen.pixels[:, 0]]

    def summed(what: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(cells, what, minlength=count * bins), dtype=np.float64).reshape(count, bins)

    counts = summed(np.ones(len(cells)))
    per = np.maximum(counts, 1.0)
    return Profiles(
        summed(asides) / per, summed(values) / per, counts, summed((values >= WHITE).astype(np.float64)) / per, scales
    )


def _near(plan: PlannedRuns, camera: Camera, *, size: tuple[int, int], reach: float) -> IntArray:
    """Return the (p, 2) pixels that may look within reach of a run."""
    ahead = (plan.places - camera.place) @ camera.T_camera_work[2, :3] > 0.0
    pixels = camera.seen(plan.places[ahead])
    span = camera.seen(plan.places[ahead] + reach * aside_of(plan)[ahead])
    around = np.linalg.norm(span - pixels, axis=1).max(initial=0.0) + plan.spacing
    marked = np.ones((size[1], size[0]), dtype=np.bool_)
    there = np.rint(pixels).astype(np.int64)
    within = (there >= 0).all(axis=1) & (there < np.array(size)).all(axis=1)
    marked[there[within, 1], there[within, 0]] = False
    if marked.all():
        return np.zeros((0, 2), dtype=np.int64)
    rows, columns = np.nonzero(np.asarray(ndimage.distance_transform_edt(marked)) <= 1.5 * around)
    return np.column_stack([columns, rows])


def _at_end(plan: PlannedRuns) -> BoolArray:
    """Return which (k,) stretches are the first or the last of their run, where it is not closed."""
    turns = np.flatnonzero(np.diff(plan.runs)) + 1
    firsts, lasts = np.concatenate([[0], turns]), np.concatenate([turns, [plan.runs.size]]) - 1
    ends = np.zeros(plan.runs.size, dtype=np.bool_)
    apart = np.linalg.norm(plan.places[firsts] - plan.places[lasts], axis=1)
    loose = apart > 1.5 * plan.lengths[firsts]
    ends[firsts[loose]] = ends[lasts[loose]] = True
    return ends
