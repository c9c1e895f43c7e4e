"""What a registered scan shows of a print: how thick it is over its part, run by run and place by place.

The height of a point is its distance from the part. A scan has holes, and its points are denser here than there, on
crests more than between them perhaps. So nowhere is a mean of heights taken: what is averaged is by how much points lie
above what the plan, with the width of bead that was found, has at the same places.
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint import transforms
from geoprint.appraisal.scanned.deposit import PlannedDeposit
from geoprint.appraisal.scanned.registering import Registration
from geoprint.appraisal.scanned.target import even_pieces, spread_over
from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.surfaces import closest, face_areas, normals

# A point belongs to the part where it lies no farther beside its foot than this share of its height, and the noise.
ASIDE_SHARE, ASIDE_NOISE = 0.5, 3.0
# Heights beyond this, over the highest that is planned, are something else.
HIGHEST = 3.0
# Material belongs to a run within this of it, over the spacing.
STRIP_SHARE = 0.5
# The crest of a bead is within this of its middle, over its width.
CREST_SHARE = 0.12
# Fewer points tell nothing of a part of a run, or of a cell of the surface.
LEAST_POINTS, LEAST_CELL_POINTS = 8, 3
# Residuals of neighbouring points are alike: so many count as one.
ALIKE_POINTS = 2.0
# Cells of the surface are so large, over the spacing; and no more than these.
CELL_SHARE, MOST_CELLS = 0.8, 4_000
# Pieces by which the area of cells, and what is planned on them, is found: for each cell, and in all. A mean over 600
# of them is right to 0.003 mm.
PLACES_A_CELL, MOST_PLACES = 600, 300_000
# A cell is to be covered where the plan has, and is covered where the scan shows, so much of the layer's height.
COVERED_SHARE = 0.25
# The part is bare where the plan has less than this of the layer's height.
BARE_SHARE = 0.02


@final
@frozen
class MeasuredParts:
    """What lies on k parts of runs, each about two spacings long.

    Attributes:
        runs: (k,) as poses.csv counts them.
        starts: (k,) arc length at which each begins [mm].
        ends: (k,) arc length at which it ends [mm].
        places: (k, 3) its middle, on the part [mm].
        seen: (k,) whether the scan shows enough of it; where not, the others are 0.
        ratios: (k,) volume over the planned one.
        ratio_deviations: (k,) standard deviation of that.
        offsets: (k,) of the bead's middle to the left of the run, as seen from outside [mm].
        offset_deviations: (k,) standard deviation of that [mm].
        crests: (k,) height of the bead over the part [mm].
        crest_deviations: (k,) standard deviation of that [mm].
    """

    runs: IntArray
    starts: FloatArray
    ends: FloatArray
    places: FloatArray
    seen: BoolArray
    ratios: FloatArray
    ratio_deviations: FloatArray
    offsets: FloatArray
    offset_deviations: FloatArray
    crests: FloatArray
    crest_deviations: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, runs="int: k", starts="float: k", ends="float: k", places="float: k 3", seen="bool: k",
            ratios="float: k", ratio_deviations="float: k", offsets="float: k", offset_deviations="float: k",
            crests="float: k", crest_deviations="float: k",
        )  # fmt: skip


@final
@frozen
class MeasuredCells:
    """How thick the print is on c cells that the part is cut into.

    Attributes:
        places: (c, 3) their middles [mm].
        areas: (c,) [mm2].
        planned: (c,) mean thickness by the plan [mm].
        seen: (c,) whether the scan shows enough of it.
        thickness: (c,) mean thickness by the scan; 0 where it is not seen [mm].
        deviations: (c,) standard deviation of that [mm].
        slopes: (c, 6) by how much the thickness changes as the scan turns [1/rad] and shifts.
    """

    places: FloatArray
    areas: FloatArray
    planned: FloatArray
    seen: BoolArray
    thickness: FloatArray
    deviations: FloatArray
    slopes: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, places="float: c 3", areas="float: c", planned="float: c", seen="bool: c", thickness="float: c",
            deviations="float: c", slopes="float: c 6",
        )  # fmt: skip


@final
@frozen
class MeasuredPrint:
    """A print by a scan of it.

    Attributes:
        registration: where the scan was taken.
        points: that lie on the part.
        bare: share of these over what the plan leaves bare.
        parts: of the runs.
        cells: of the surface.
        height: of the layer [mm].
        volume: that is planned [mm3].
    """

    registration: Registration
    points: int
    bare: float
    parts: MeasuredParts
    cells: MeasuredCells
    height: float
    volume: float


@final
@frozen
class _Points:
    """Points over the part: feet, normals, heights, and what the plan has there."""

    feet: FloatArray
    up: FloatArray
    heights: FloatArray
    planned: FloatArray
    slopes: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, feet="float: k 3", up="float: k 3", heights="float: k", planned="float: k", slopes="float: k 3"
        )


def measured_print(
    points: FloatArray, registration: Registration, surface: Surface, deposit: PlannedDeposit, *, name: str = "scan"
) -> MeasuredPrint:
    """Measure a print by a scan that is laid onto its part.

    Args:
        points: (k, 3) of the scan, in its own coordinates [mm].
        registration: where it was taken.
        surface: of the part.
        deposit: that is planned.
        name: of the scan, for messages.

    Raises:
        InputError: the scan shows no run of the plan.
    """
    over = _over(points, registration, surface, deposit)
    parts = _parts(over, registration, deposit)
    if not parts.seen.any():
        raise InputError(
            f"`{name}` shows no run of the plan: of {len(points)} points {len(over.heights)} lie over the part, and "
            f"fewer than {LEAST_POINTS} along every part of a run; scan closer, or check that it is of this print."
        )
    cells = _cells(over, registration, surface, deposit)
    bare = float((over.planned < BARE_SHARE * deposit.height).mean())
    return MeasuredPrint(registration, len(over.heights), bare, parts, cells, deposit.height, deposit.volume)


def _over(points: FloatArray, found: Registration, surface: Surface, deposit: PlannedDeposit) -> _Points:
    """Return the points that lie over the part."""
    here = transforms.apply(found.T_work_scan, points)
    feet, away = closest(surface, here)
    places, up = feet.xyz(surface), normals(surface, feet)
    off = here - places
    straight = (off * up).sum(axis=1)
    aside = np.linalg.norm(off - straight[:, None] * up, axis=1)
    material = deposit.at(places, up, spread=found.spread, offset=found.offset)
    highest = HIGHEST * float(material.heights[:, 0].max(initial=0.0)) + ASIDE_NOISE * found.noise
    kept = (aside <= ASIDE_SHARE * np.abs(straight) + ASIDE_NOISE * found.noise) & (away <= highest)
    return _Points(
        places[kept], up[kept], (np.sign(straight) * away)[kept], material.heights[kept, 0], material.slopes[kept, 0]
    )


def _parts(over: _Points, found: Registration, deposit: PlannedDeposit) -> MeasuredParts:
    """Return what the points show of the parts of runs."""
    runs, numbers = deposit.runs, deposit.parts
    count = int(numbers.max()) + 1
    away, stretch = deposit.nearest(over.feet)
    near = away <= STRIP_SHARE * deposit.spacing
    own, stretch, away = numbers[stretch[near]], stretch[near], away[near]
    over = _Points(over.feet[near], over.up[near], over.heights[near], over.planned[near], over.slopes[near])

    def summed(values: FloatArray) -> FloatArray:
        return np.bincount(own, values, minlength=count).astype(np.float64)

    points, planned = summed(np.ones(own.size)), summed(over.planned)
    seen = (points >= LEAST_POINTS) & (planned > 0.0)
    whole = np.where(seen, planned, 1.0)
    ratios = np.where(seen, summed(over.heights) / whole, 0.0)
    left = deposit.lefts[stretch]
    # A bead that lies to the left by d is as high as the planned one is d to the right: higher by - d times its slope.
    rising = (over.slopes * left).sum(axis=1)
    rest = over.heights - ratios[own] * over.planned
    steep = np.maximum(summed(rising**2) * np.maximum(ratios, COVERED_SHARE), 1e-12)
    spread = ALIKE_POINTS * summed(rest**2) / np.maximum(points, 1.0)
    ups, lefts = (_pose_variance(over.feet, each, own, count, found) for each in (over.up, left))
    crest = np.abs(away - abs(found.offset)) <= CREST_SHARE * deposit.width
    crests = np.bincount(own[crest], minlength=count)
    high = np.bincount(own[crest], over.heights[crest], minlength=count) / np.maximum(crests, 1)
    starts, ends, places = _stretched(deposit, count)
    return MeasuredParts(
        runs=runs.runs[np.unique(numbers, return_index=True)[1]],
        starts=starts,
        ends=ends,
        places=places,
        seen=seen,
        ratios=ratios,
        ratio_deviations=np.where(seen, np.sqrt(spread * points + ups * points**2) / whole, 0.0),
        offsets=np.where(seen, found.offset - summed(rest * rising) / steep, 0.0),
        offset_deviations=np.where(seen, np.sqrt(spread * summed(rising**2) / steep**2 + lefts), 0.0),
        crests=np.where(seen, high, 0.0),
        crest_deviations=np.where(seen, np.sqrt(spread / np.maximum(crests, 1) + ups), 0.0),
    )


def _stretched(deposit: PlannedDeposit, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return where each part of a run starts and ends [mm of arc], and the stretch in its middle."""
    runs, numbers = deposit.runs, deposit.parts
    firsts = np.unique(numbers, return_index=True)[1]
    lasts = np.append(firsts[1:], len(numbers)) - 1
    middles = runs.places[(firsts + lasts) // 2]
    return (
        runs.arcs[firsts] - 0.5 * runs.lengths[firsts],
        runs.arcs[lasts] + 0.5 * runs.lengths[lasts],
        middles.reshape(count, 3),
    )


def _pose_variance(
    places: FloatArray, directions: FloatArray, own: IntArray, count: int, found: Registration
) -> FloatArray:
    """Return the (count,) variance of the mean, over what each owns, of moves along directions by an unsure pose."""
    means = _means(found.along(places, directions), own, count)
    return np.einsum("ki,ij,kj->k", means, found.covariance, means)


def _means(rows: FloatArray, own: IntArray, count: int) -> FloatArray:
    per = np.maximum(np.bincount(own, minlength=count), 1)
    return np.column_stack([np.bincount(own, column, minlength=count) / per for column in rows.T])


def _cells(over: _Points, found: Registration, surface: Surface, deposit: PlannedDeposit) -> MeasuredCells:
    """Return how thick the print is on cells of the surface."""
    areas = face_areas(surface)
    count = int(np.clip(float(areas.sum()) / (CELL_SHARE * deposit.spacing) ** 2, 1, MOST_CELLS))
    middles = spread_over(areas, count).xyz(surface)
    tree = KDTree(middles)
    pieces, sizes = even_pieces(areas, min(PLACES_A_CELL * count, MOST_PLACES))
    places = pieces.xyz(surface)
    owners = np.asarray(tree.query(places)[1])
    material = deposit.at(places, normals(surface, pieces), spread=found.spread, offset=found.offset)
    per: FloatArray = np.bincount(owners, sizes, minlength=count).astype(np.float64)
    planned = np.bincount(owners, sizes * material.heights[:, 0], minlength=count) / np.maximum(per, 1e-12)
    own = np.asarray(tree.query(over.feet)[1])
    points = np.bincount(own, minlength=count)
    seen = points >= LEAST_CELL_POINTS
    # As much more than planned as all that was laid: so the part of a cell that a hole leaves stands for it best.
    off = over.heights - found.level * over.planned
    above = np.bincount(own, off, minlength=count) / np.maximum(points, 1)
    scatter = np.bincount(own, (off - above[own]) ** 2, minlength=count) / np.maximum(points - 1, 1)
    slopes = _means(found.along(over.feet, over.up), own, count)
    pose = np.einsum("ki,ij,kj->k", slopes, found.covariance, slopes)
    deviations = np.sqrt(ALIKE_POINTS * scatter / np.maximum(points, 1) + pose)
    return MeasuredCells(
        middles, per, planned, seen, np.where(seen, found.level * planned + above, 0.0),
        np.where(seen, deviations, 0.0), slopes,
    )  # fmt: skip
