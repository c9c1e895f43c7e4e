"""What a registered scan shows of a print: how thick it is over its part, run by run and place by place.

The height of a point is its distance from the part. A scan has holes, and its points are denser here than there, on
crests more than between them perhaps. So nowhere is a mean of heights taken: what is averaged is by how much points lie
above what the plan, with the width of bead that was found, has at the same places.

The crest of a run is where a parabola across its bead, of whatever width, is highest over that. How sure it is follows
from parts of the run drawn anew, since neighbouring points err alike [Kunsch1989].
"""

from __future__ import annotations

from functools import partial
from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint import transforms
from geoprint.errors import InputError
from geoprint.geometry import closest, face_areas, normals
from geoprint.inspection.scan_registration import Registration
from geoprint.inspection.scan_target import PlannedDeposit, even_pieces, spread_over
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen

# A point belongs to the part where it lies no farther beside its foot than this share of its height, and the noise.
ASIDE_SHARE, ASIDE_NOISE = 0.5, 3.0
# Heights beyond this, over the highest that is planned, are something else.
HIGHEST = 3.0
# Material belongs to a run within this of it, over the spacing.
STRIP_SHARE = 0.5
# A bead is a parabola within this of its middle, over half its width: well inside of its foot, where noise rounds it.
CREST_SHARE = 0.6
# Fewer points tell nothing of a part of a run, of a cell of the surface, or of a crest.
LEAST_POINTS, LEAST_CELL_POINTS, LEAST_CREST_POINTS = 8, 3, 3
# Parts of runs are drawn anew so many times; a run of fewer parts than this errs as those of all runs do.
DRAWN, FEW_PARTS = 500, 5
# Within this many standard deviations to either side are 95 of 100 normal numbers.
TWO_SIDED = 1.96
# A part of a run with less than this of its volume is a gap, and has no crest.
BARE_RATIO = 0.25
# Residuals of neighbouring points are alike: so many count as one.
ALIKE_POINTS = 2.0
# Cells of the surface are so large, over the spacing; and no more than these.
CELL_SHARE, MOST_CELLS = 0.8, 4_000
# Pieces by which the area of cells, and what is planned on them, is found: for each cell, and in all. A mean over 600
# of them is right to 0.003 mm.
PLACES_A_CELL, MOST_PLACES = 600, 300_000
# Points that all lie as far from the middle, but for this share of it (squared), tell no bend.
LEVEL_SHARE = 1e-6
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
        lefts: (k, 3) unit direction to the left of the run there, as seen from outside.
        seen: (k,) whether the scan shows enough of it; where not, the others are 0.
        crested: (k,) whether it shows the crest of a bead there; where not, crests and their deviations are 0.
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
    lefts: FloatArray
    seen: BoolArray
    crested: BoolArray
    ratios: FloatArray
    ratio_deviations: FloatArray
    offsets: FloatArray
    offset_deviations: FloatArray
    crests: FloatArray
    crest_deviations: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, runs="int: k", starts="float: k", ends="float: k", places="float: k 3",
            lefts="float: k 3", seen="bool: k", crested="bool: k", ratios="float: k", ratio_deviations="float: k",
            offsets="float: k", offset_deviations="float: k", crests="float: k", crest_deviations="float: k",
        )  # fmt: skip


@final
@frozen
class MeasuredCrests:
    """How high the beads of r runs are over the part, in the mean along each.

    Attributes:
        runs: (r,) as poses.csv counts them, ascending.
        seen: (r,) whether the scan shows enough of its crest; where not, the others are 0.
        heights: (r,) [mm].
        deviations: (r,) standard deviation of that [mm].
    """

    runs: IntArray
    seen: BoolArray
    heights: FloatArray
    deviations: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, runs="int: r", seen="bool: r", heights="float: r", deviations="float: r")


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
        crests: of the runs.
        cells: of the surface.
        height: of the layer [mm].
        volume: that is planned [mm3].
    """

    registration: Registration
    points: int
    bare: float
    parts: MeasuredParts
    crests: MeasuredCrests
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


@final
@frozen
class _Crest:
    """Points about the crests of runs, summed over each of k parts.

    Attributes:
        runs: (k,) which of the runs each part is of, from 0.
        counts: (k,) of its points.
        middles: (k,) height that is planned over the middle of the bead [mm].
        sums: (k, 5) of 1, x, x^2, y and x y over its points, with x the square of the distance from the middle and y
            the height over the run's share of the planned one.
        squares: (k,) sum of y^2.
        poses: (k, 6) sums of what the heights change by as the pose does.
    """

    runs: IntArray
    counts: IntArray
    middles: FloatArray
    sums: FloatArray
    squares: FloatArray
    poses: FloatArray


def measured_print(
    points: FloatArray,
    registration: Registration,
    surface: Surface,
    deposit: PlannedDeposit,
    *,
    random: np.random.Generator,
    name: str = "scan",
) -> MeasuredPrint:
    """Measure a print by a scan that is laid onto its part.

    Args:
        points: (k, 3) of the scan, in its own coordinates [mm].
        registration: where it was taken.
        surface: of the part.
        deposit: that is planned.
        random: draws parts of runs anew, for how sure their crests are.
        name: of the scan, for messages.

    Raises:
        InputError: the scan shows no run of the plan.
    """
    over = _over(points, registration, surface, deposit)
    parts, crests = _parts(over, registration, deposit, random=random)
    if not parts.seen.any():
        raise InputError(
            f"`{name}` shows no run of the plan. {len(over.heights)} of {len(points)} points lie over the part, and "
            f"fewer than {LEAST_POINTS} along every stretch. Scan closer, or check that it shows this print."
        )
    cells = _cells(over, registration, surface, deposit)
    bare = float((over.planned < BARE_SHARE * deposit.height).mean())
    return MeasuredPrint(registration, len(over.heights), bare, parts, crests, cells, deposit.height, deposit.volume)


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


def _parts(
    over: _Points, found: Registration, deposit: PlannedDeposit, *, random: np.random.Generator
) -> tuple[MeasuredParts, MeasuredCrests]:
    """Return what the points show of the parts of runs, and of the crests of these."""
    runs, numbers = deposit.runs, deposit.parts
    count = int(numbers.max()) + 1
    away, stretch = deposit.nearest(over.feet)
    near = away <= STRIP_SHARE * deposit.spacing
    own, stretch = numbers[stretch[near]], stretch[near]
    over = _Points(over.feet[near], over.up[near], over.heights[near], over.planned[near], over.slopes[near])

    summed = partial(_summed, own, count)
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
    offsets = np.where(seen, found.offset - summed(rest * rising) / steep, 0.0)
    of_parts = runs.runs[np.unique(numbers, return_index=True)[1]]
    crest = _crest(over, found, deposit, stretch, of_parts, ratios=ratios, beads=seen & (ratios >= BARE_RATIO))
    crests, heights, deviations = _crests(crest, found, np.unique(of_parts), random=random)
    crested = seen & (crest.counts >= LEAST_CREST_POINTS) & crests.seen[crest.runs]
    starts, ends, middles = _stretched(deposit)
    return MeasuredParts(
        runs=of_parts,
        starts=starts,
        ends=ends,
        places=runs.places[middles],
        lefts=deposit.lefts[middles],
        seen=seen,
        crested=crested,
        ratios=ratios,
        ratio_deviations=np.where(seen, np.sqrt(spread * points + ups * points**2) / whole, 0.0),
        offsets=offsets,
        offset_deviations=np.where(seen, np.sqrt(spread * summed(rising**2) / steep**2 + lefts), 0.0),
        crests=np.where(crested, heights, 0.0),
        crest_deviations=np.where(crested, deviations, 0.0),
    ), crests


def _summed(rows: IntArray, count: int, values: FloatArray) -> FloatArray:
    """Return (count,) sums of values over those that have the same row."""
    return np.bincount(rows, values, minlength=count).astype(np.float64)


def _crest(
    over: _Points,
    found: Registration,
    deposit: PlannedDeposit,
    stretch: IntArray,
    of_parts: IntArray,
    *,
    ratios: FloatArray,
    beads: BoolArray,
) -> _Crest:
    """Return the sums over points about the crest of each part that has a bead.

    Args:
        over: points along runs.
        found: where the scan was taken.
        deposit: that is planned.
        stretch: (j,) of which each point is.
        of_parts: (k,) run of each part.
        ratios: (k,) volume of parts over the planned one.
        beads: (k,) which of them have a bead.
    """
    runs, count = deposit.runs, of_parts.size
    _, row = np.unique(of_parts, return_inverse=True)
    weights = np.where(beads, np.bincount(deposit.parts, runs.lengths, minlength=count), 0.0)
    lengths = np.maximum(np.bincount(row, weights), 1e-12)
    share = np.bincount(row, weights * ratios) / lengths
    half = 0.5 * found.spread * deposit.width
    aside = ((over.feet - runs.places[stretch]) * deposit.lefts[stretch]).sum(axis=1) - found.offset
    along = ((over.feet - runs.places[stretch]) * runs.ahead[stretch]).sum(axis=1)
    own = deposit.parts[stretch]
    # A bead of less volume is narrower.
    reach = CREST_SHARE * half * np.minimum(np.sqrt(share), 1.0)
    # What lies before a run's beginning or behind its end is no crest.
    within = (np.abs(aside) <= reach[row[own]]) & (np.abs(along) <= runs.lengths[stretch]) & beads[own]
    own, x = own[within], aside[within] ** 2
    y = over.heights[within] - share[row[own]] * over.planned[within]
    summed = partial(_summed, own, count)
    middles = deposit.at(
        runs.places + found.offset * deposit.lefts, runs.normals, spread=found.spread, offset=found.offset
    ).heights[:, 0]
    mean = np.bincount(deposit.parts, runs.lengths * middles) / np.bincount(deposit.parts, runs.lengths)
    return _Crest(
        runs=row,
        counts=np.bincount(own, minlength=count),
        middles=share[row] * mean,
        sums=np.column_stack([summed(each) for each in (np.ones(own.size), x, x**2, y, x * y)]),
        squares=summed(y**2),
        poses=np.column_stack([summed(column) for column in found.along(over.feet[within], over.up[within]).T]),
    )


def _crests(
    crest: _Crest, found: Registration, numbers: IntArray, *, random: np.random.Generator
) -> tuple[MeasuredCrests, FloatArray, FloatArray]:
    """Return the crests of runs, and (k,) heights and standard deviations of those of their parts [mm]."""
    from scipy.stats import t

    count = numbers.size
    per_run = [np.bincount(crest.runs, column, minlength=count) for column in crest.sums.T]
    sums: FloatArray = np.column_stack(per_run).astype(np.float64)
    solved = _parabolas(sums)
    # What the parabola of its run leaves of each part.
    n, x, xx = crest.sums[:, :3].T
    high, bent = solved[crest.runs].T
    left = np.column_stack([crest.sums[:, :3], crest.sums[:, 3] - high * n - bent * x,
                            crest.sums[:, 4] - high * x - bent * xx])  # fmt: skip
    showing = np.flatnonzero(crest.counts)
    seen = (sums[:, 0] >= LEAST_CREST_POINTS) & (np.bincount(crest.runs[showing], minlength=count) > 0)
    heights, deviations, sure = np.zeros(count), np.zeros(count), np.zeros(count)
    for run in np.flatnonzero(seen).tolist():
        own = showing[crest.runs[showing] == run]
        pool = own if own.size >= FEW_PARTS else showing
        drawn = random.integers(pool.size, size=(DRAWN, own.size))
        off = _parabolas(left[pool][drawn].sum(axis=1)).std(axis=0)
        # Of few parts the mean takes up a share of what they are off, and how much that is, is not well known.
        few = max(pool.size - 1, 1)
        wider = np.sqrt(pool.size / few) * float(t.ppf(0.975, few)) / TWO_SIDED
        pose = crest.poses[own].sum(axis=0) / sums[run, 0]
        lengths = crest.middles[crest.runs == run]
        heights[run] = lengths.mean() + solved[run, 0]
        deviations[run] = np.sqrt((wider * off[0]) ** 2 + pose @ found.covariance @ pose)
        sure[run] = off[1]
    per = np.maximum(n, 1.0)
    scatter = crest.squares - 2.0 * (high * crest.sums[:, 3] + bent * crest.sums[:, 4])
    scatter += high**2 * n + 2.0 * high * bent * x + bent**2 * xx
    noise = np.bincount(crest.runs, np.maximum(scatter, 0.0), minlength=count) / np.maximum(sums[:, 0] - 2.0, 1.0)
    poses = np.einsum("ki,ij,kj->k", crest.poses / per[:, None], found.covariance, crest.poses / per[:, None])
    spread = np.sqrt(ALIKE_POINTS * noise[crest.runs] / per + (sure[crest.runs] * x / per) ** 2 + poses)
    return (
        MeasuredCrests(numbers, seen, heights, deviations),
        crest.middles + (crest.sums[:, 3] - bent * x) / per,
        spread,
    )


def _parabolas(sums: FloatArray) -> FloatArray:
    """Return (j, 2) height and bend of the parabolas of least squares; a level line where nothing tells a bend.

    Args:
        sums: (j, 5) of 1, x, x^2, y and x y.
    """
    n, x, xx, y, xy = sums.T
    mean, level = x / np.maximum(n, 1.0), y / np.maximum(n, 1.0)
    spread = xx - x * mean
    record = spread > LEVEL_SHARE * xx
    bend = np.where(record, (xy - x * level) / np.where(record, spread, 1.0), 0.0)
    return np.column_stack([level - bend * mean, bend])


def _stretched(deposit: PlannedDeposit) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return where each part of a run starts and ends [mm of arc], and the number of the stretch in its middle."""
    runs, numbers = deposit.runs, deposit.parts
    firsts = np.unique(numbers, return_index=True)[1]
    lasts = np.append(firsts[1:], len(numbers)) - 1
    starts, ends = runs.arcs[firsts] - 0.5 * runs.lengths[firsts], runs.arcs[lasts] + 0.5 * runs.lengths[lasts]
    return starts, ends, (firsts + lasts) // 2


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
    # As much more than planned as all that was deposited: so the part of a cell that a hole leaves stands for it best.
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
