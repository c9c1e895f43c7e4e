"""Where a scan was taken: laid onto its part from far to near, with what the pose is worth.

From a start, the calibrated pose or the scan as it stands, open3d brings it near (`registration_worker`). A print
repeats itself from run to run, so what is found may be a run beside: places around it are tried as well. From the best
of them pose, volume and width of the beads are adjusted together (`adjusting`). A scanner that is not calibrated gives
a print a scale: where one fits that is off by more than chance and `LEAST_SCALE`, the scan is taken with it.
"""

from __future__ import annotations

import importlib.util
from io import BytesIO
from pathlib import Path
from typing import final

import numpy as np
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError, percent
from geoprint.geometry import closest, mean_normal
from geoprint.geometry.native import missing, run_worker
from geoprint.inspection import registration_worker
from geoprint.inspection.scan_target import NARROWEST, WIDEST, PlannedDeposit, ScanTarget
from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen

# The last step of a registration: pose and spread of the material together, by robust least squares.
#
# A point of the scan should lie as high over its foot as material lies there: with h its height along the normal,
#
#     h - level * H - wider * W - left * O = 0,
#
# H the height of the planned material, W and O by how much it is more for wider beads and for beads that lie more to
# the left. How much is deposited, how wide and how far beside its path is unknown until it is measured, so it is
# estimated beside the pose [Chen1992]; else a print that is too thick would lift the scan off its part. So is how
# much more or less lies on each part of a run, with a standard deviation that is estimated, too: else a run that is
# thick on one side would tilt it; and, where that is asked for, the scale. What is left is weighted as [Beaton1974]
# says. The covariance of what is found is that of least squares with errors that are the more alike the nearer they
# are [Conley1999]: noise of neighbouring points is not, but what the plan does not know of a bead is. What is left
# is smaller than these errors, because the fit has taken up a part of them, and all but all of those that are alike
# over much of the scan. So each neighbourhood counts with what it would pull if the fit had been made without it
# [Bell2002]; and residuals that count less move the fit more than their weights say, by the slope of Tukey's
# function [Huber1964].


# Beyond so many standard deviations a residual counts nothing; so 95 % of the precision is left for normal ones.
TUKEY = 4.685
# Standard deviation of normal numbers over the median of their sizes.
MAD_FACTOR = 1.4826
# A foot is on the part where it lies within so many distances of its places; else the point is beside it.
BESIDE = 4.0
# What is known of level, width, offset [mm] and scale without a scan, and how well (standard deviations).
EXPECTED, PRIOR = np.array([1.0, 0.0, 0.0, 1.0]), np.array([0.5, 0.3, 0.2, 0.05])
# Poses move no point by more than this between the last two steps [mm].
SETTLED = 1e-5
# A direction in which the pose is less sure than this, as the farthest point moves [mm], is not fixed.
LOOSE = 0.3
# Blocks of surface, over the spacing of the plan; over the size of a bare part. Errors are alike about so many of them.
BLOCK_SHARE, BARE_BLOCK_SHARE = 1.0, 0.02
ALIKE_BLOCKS = 2.5
# What is deposited on a part of a run differs from that of the others at least and at most so much (deviation).
LEAST_DEVIATION, MOST_DEVIATION = 0.01, 0.3
# Parameters: turn and shift, then level, wider and left, and scale where it is asked for.
POSE, FIXED_SCALE, FREE_SCALE = 6, 9, 10
# What is known of a direction that nothing fixes, over what is known of the surest one.
NOTHING = 1e-12
# Nobody measures better than this [mm].
LEAST_NOISE = 1e-4
# A neighbourhood fixes no more of a direction than this share, where its pull without it is asked for; and residuals
# move the fit by no less than this share of their weights.
MOST_LEVERAGE, LEAST_SLOPE = 0.9, 0.3


@final
@frozen
class Adjusted:
    """A pose with its covariance.

    Attributes:
        T_work_scan: (4, 4) turns coordinates of the scan into those of the part, and scales them [mm].
        middle: (3,) about which turns are meant, in the part's coordinates [mm].
        covariance: (n, n) of turn about the middle [rad], shift [mm] and shares; n is 9, or 10 with the scale.
        loose: (j, 6) unit directions of turn (times the radius of the scan) and shift that the scan does not fix.
        shares: (4,) level, wider and left; scale by which the scan's coordinates are multiplied.
        noise: standard deviation of a point about the model, across its slope [mm].
        used: share of the points that count.
    """

    T_work_scan: FloatArray
    middle: FloatArray
    covariance: FloatArray
    loose: FloatArray
    shares: FloatArray
    noise: float
    used: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self, T_work_scan="float: 4 4", middle="float: 3", covariance="float: n n", loose="float: j 6",
            shares="float: 4",
        )  # fmt: skip


@final
@frozen
class _PointRows:
    """What a scan says at a pose: a row for each point that is on the part.

    Attributes:
        rows: (k, n) how residuals change with the parameters.
        residuals: (k,) heights above the model [mm].
        sizes: (k,) how much longer a residual is than the distance from the sloping surface.
        deposited: (k,) height of the model [mm].
        parts: (k,) part of a run that each is over.
        blocks: (k, 3) block of surface.
        middle: (3,) of all points [mm].
        points: how many there are, beside the part too.
    """

    rows: FloatArray
    residuals: FloatArray
    sizes: FloatArray
    deposited: FloatArray
    parts: IntArray
    blocks: IntArray
    middle: FloatArray
    points: int


@final
@frozen
class _NormalEquations:
    """Normal equations, in which turns are lengths at the radius of the scan.

    Attributes:
        matrix: (n, n).
        gradient: (n,).
        prior: (n,) what of the diagonal of the matrix is known without a scan.
        pulls: (k, n) what each point pulls.
        inner: (k, n) weighted rows from which the parts of runs are eliminated.
        rows: (k, n) likewise as they are: together with the inner ones they make the matrix.
        slope: of the residuals' function over their weights, on average.
        noise: standard deviation of a point [mm].
        used: share of the points that count.
    """

    matrix: FloatArray
    gradient: FloatArray
    prior: FloatArray
    pulls: FloatArray
    inner: FloatArray
    rows: FloatArray
    slope: float
    noise: float
    used: float


def adjusted(
    points: FloatArray, target: ScanTarget, *, start: FloatArray, steps: int, scaling: bool = False
) -> Adjusted:
    """Return the pose nearest to a start at which a scan fits its part.

    Args:
        points: (k, 3) of the scan, in its own coordinates [mm].
        target: that it is laid onto.
        start: (4, 4) T_work_scan, a scale in it too [mm].
        steps: at most.
        scaling: whether the scan's scale is estimated as well.
    """
    pose = start
    shares = np.append(EXPECTED[:-1], np.cbrt(np.linalg.det(start[:3, :3])))
    radius = float(np.linalg.norm(points - points.mean(axis=0), axis=1).max())
    units = np.ones(FREE_SCALE if scaling else FIXED_SCALE)
    units[[0, 1, 2, *range(FIXED_SCALE, len(units))]] = 1.0 / radius
    for _ in range(steps):
        found = _rows(points, target, pose, shares, scaling=scaling)
        change = units * _step(_equations(found, shares, units))[0]
        larger = 1.0 + float(change[FIXED_SCALE:].sum())
        turn: FloatArray = larger * Rotation.from_rotvec(change[:3]).as_matrix()
        pose = transforms.rigid(turn, found.middle + change[3:POSE] - turn @ found.middle) @ pose
        shares = np.append(shares[:-1] + change[POSE:FIXED_SCALE], shares[-1] * larger)
        if np.abs(change[3:POSE]).max() + radius * (np.abs(change[:3]).max() + abs(larger - 1.0)) < SETTLED:
            break
    found = _rows(points, target, pose, shares, scaling=scaling)
    final_ones = _equations(found, shares, units)
    covariance = _covariance(final_ones, found.blocks) * units[:, None] * units
    return Adjusted(pose, found.middle, covariance, _step(final_ones)[1], shares, final_ones.noise, final_ones.used)


def _rows(
    points: FloatArray, target: ScanTarget, T_work_scan: FloatArray, shares: FloatArray, *, scaling: bool
) -> _PointRows:
    """Return what a scan says at a pose."""
    here = transforms.apply(T_work_scan, points)
    middle: FloatArray = here.mean(axis=0)
    _, which = target.nearest(here)
    off, up = here - target.places[which], target.normals[which]
    high = (off * up).sum(axis=1)
    aside = off - high[:, None] * up
    on = np.linalg.norm(aside, axis=1) < BESIDE * target.apart
    here, up, high, aside, which = here[on], up[on], high[on], aside[on], which[on]
    slopes = target.material.slopes[which]
    heights = target.material.heights[which] + np.einsum("ksx,kx->ks", slopes, aside)
    across = up - np.einsum("s,ksx->kx", shares[:-1], slopes)
    deposited = heights @ shares[:-1]
    deposit = target.deposit
    block = BARE_BLOCK_SHARE * target.size if deposit is None else BLOCK_SHARE * deposit.spacing
    turned = np.cross(here - middle, across).astype(np.float64)
    scaled = ((here - middle) * across).sum(axis=1, keepdims=True)
    return _PointRows(
        rows=np.column_stack([turned, across, -heights, *([scaled] if scaling else [])]),
        residuals=high - deposited,
        sizes=np.linalg.norm(across, axis=1),
        deposited=deposited,
        parts=target.parts[which],
        blocks=np.floor(here / block).astype(np.int64),
        middle=middle,
        points=len(points),
    )


def _equations(found: _PointRows, shares: FloatArray, units: FloatArray) -> _NormalEquations:
    """Return the normal equations; what lies on each part of a run is eliminated from them."""
    rows, residuals = found.rows * units, found.residuals
    ratios = np.abs(residuals / found.sizes)
    noise = max(MAD_FACTOR * float(np.median(ratios)) if ratios.size else 0.0, LEAST_NOISE)
    u = np.minimum(ratios / (TUKEY * noise), 1.0)
    weights = (1.0 - u**2) ** 2 / (found.sizes * noise) ** 2
    most = int(found.parts.max(initial=0)) + 1

    def summed(values: FloatArray) -> FloatArray:
        return np.bincount(found.parts, values, minlength=most).astype(np.float64)

    stiff = summed(weights * found.deposited**2)
    stiff = stiff + _deviation(summed(weights * found.deposited * residuals), stiff) ** -2.0
    taken = np.column_stack([summed(weights * found.deposited * row) / stiff for row in rows.T])
    eliminated = rows - found.deposited[:, None] * taken[found.parts]
    pulls = eliminated * (weights * residuals)[:, None]
    count = rows.shape[1]
    away = (shares - EXPECTED)[: count - POSE] / units[POSE:]
    known = np.zeros(count)
    known[POSE:] = (PRIOR[: count - POSE] / units[POSE:]) ** -2.0
    gradient: FloatArray = pulls.sum(axis=0)
    gradient[POSE:] += known[POSE:] * away
    inner = eliminated * weights[:, None]
    matrix = inner.T @ rows
    matrix[np.diag_indices(count)] += known
    # Of r (1 - u^2)^2 with r: (1 - u^2) (1 - 5 u^2).
    slope = float(((1.0 - u**2) * (1.0 - 5.0 * u**2)).sum()) / max(float(((1.0 - u**2) ** 2).sum()), NOTHING)
    used = float((u < 1.0).sum()) / found.points
    return _NormalEquations(matrix, gradient, known, pulls, inner, rows, max(slope, LEAST_SLOPE), noise, used)


def _spread_of(equations: _NormalEquations, blocks: IntArray) -> FloatArray:
    """Return the (n, n) covariance of the sum of all pulls, which are alike where their (k, 3) blocks are near."""
    _, firsts, members = np.unique(blocks, axis=0, return_index=True, return_inverse=True)
    members = members.ravel()

    def summed(columns: FloatArray) -> FloatArray:
        sums = [np.bincount(members, column, minlength=len(firsts)) for column in columns.T]
        return np.column_stack(sums).astype(np.float64)

    places = blocks[firsts].astype(np.float64)
    alike = np.exp(-0.5 * cdist(places, places, "sqeuclidean") / ALIKE_BLOCKS**2)
    products = np.stack([summed(equations.inner * row[:, None]) for row in equations.rows.T], axis=2)
    near = np.einsum("gh,hij->gij", alike, 0.5 * (products + products.transpose(0, 2, 1)))
    # In units in which all of them together fix each direction to 1.
    sizes, axes = np.linalg.eigh(0.5 * (equations.matrix + equations.matrix.T))
    sizes = np.maximum(sizes, NOTHING * sizes[-1])
    root, to_unit = axes * np.sqrt(sizes), axes / np.sqrt(sizes)
    fixed, directions = np.linalg.eigh(to_unit.T @ near @ to_unit)
    own = np.einsum("gji,gj->gi", directions, summed(equations.pulls) @ to_unit)
    without = own / (1.0 - np.clip(fixed, 0.0, MOST_LEVERAGE))
    pulls = np.einsum("gij,gj->gi", directions, without) @ root.T
    return pulls.T @ alike @ pulls


def _larger(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the (n, n) covariance that is the larger of two in every direction in which they differ.

    That of residuals which are alike is too small where they are alike over much of the scan, since what they share is
    fitted away: nothing is known better than it would be if all points erred on their own.
    """
    sizes, axes = np.linalg.eigh(0.5 * (one + one.T))
    sizes = np.maximum(sizes, NOTHING * sizes[-1])
    root: FloatArray = axes * np.sqrt(sizes)
    to_unit: FloatArray = axes / np.sqrt(sizes)
    shares, directions = np.linalg.eigh(to_unit.T @ other @ to_unit)
    there = root @ directions
    return (there * np.maximum(shares, 1.0)) @ there.T


def _deviation(pulls: FloatArray, stiff: FloatArray) -> float:
    """Return the standard deviation of what lies on parts of runs, beyond what noise makes of it."""
    known = stiff > LEAST_DEVIATION * stiff.max(initial=0.0)
    if not known.any():
        return LEAST_DEVIATION
    found = pulls[known] / stiff[known]
    variance = float((found**2 - 1.0 / stiff[known]).mean())
    return float(np.clip(np.sqrt(max(variance, 0.0)), LEAST_DEVIATION, MOST_DEVIATION))


def _step(equations: _NormalEquations) -> tuple[FloatArray, FloatArray]:
    """Return the (n,) step to the minimum, and the (j, 6) directions that are not fixed and stay as they are."""
    matrix = equations.matrix
    # The pose alone: what the shares cannot take up.
    rest = np.linalg.solve(matrix[POSE:, POSE:], matrix[POSE:, :POSE])
    sure, axes = np.linalg.eigh(matrix[:POSE, :POSE] - matrix[:POSE, POSE:] @ rest)
    fixed = sure > LOOSE**-2.0
    count = len(matrix)
    free = np.zeros((count, int(fixed.sum()) + count - POSE))
    free[:POSE, : POSE - count] = axes[:, fixed]
    free[POSE:, POSE - count :] = np.eye(count - POSE)
    step: FloatArray = -free @ np.linalg.solve(free.T @ matrix @ free, free.T @ equations.gradient)
    return step, np.asarray(axes[:, ~fixed].T)


def _covariance(equations: _NormalEquations, blocks: IntArray) -> FloatArray:
    """Return the (n, n) covariance; in directions that are not fixed that of `LOOSE`."""
    spread = _spread_of(equations, blocks) / equations.slope**2 + np.diag(equations.prior)
    pulled = _larger(equations.matrix, spread)
    sure, axes = np.linalg.eigh(0.5 * (equations.matrix + equations.matrix.T))
    inverse = (axes / np.maximum(sure, LOOSE**-2.0)) @ axes.T
    lost = axes[:, sure <= LOOSE**-2.0]
    return inverse @ pulled @ inverse + LOOSE**2 * lost @ lost.T


# Points of scan and part that open3d lays onto each other, that places around are tried with, and that are adjusted.
NEAR_POINTS, NEAR_PLACES, TRIED_POINTS, ADJUSTED_POINTS = 6_000, 30_000, 2_500, 40_000
# From how far points are drawn, step by step [mm]: ten millimetres and five degrees off is what a start may be.
REACHES = np.array([15.0, 4.0])
# Radius of features over the size of the part.
FEATURE_SHARE = 0.12
# Places around, over the spacing: a run beside, and between.
AROUND = (-1.0, -0.5, 0.0, 0.5, 1.0)
TRIED_STEPS, ADJUSTED_STEPS = 6, 40
# Times, at most, that the deposit is asked for anew over the feet of the scan, with the width and offset found.
FOOT_ROUNDS = 4
# Width (logarithm) and offset [mm] of the beads change by no more from round to round, and are found within the other.
MOST_CHANGE, SETTLED_CHANGE = 0.3, 0.003
# Less volume than this, over the planned one, tells nothing of width and offset.
LEAST_LEVEL = 0.1
# What facets of the part, whose normals turn between them, leave of a pose that noise alone would know better [mm].
SYSTEMATIC = 0.002
# A scan lies on its part where at least so many of its points do.
LEAST_USED = 0.2
# Noise beyond this share of the layer's height, or of the part's size where nothing is planned, is no fit.
MOST_NOISE_SHARE, MOST_BARE_NOISE_SHARE = 0.5, 0.02
# A scale is taken where it is off by so many standard deviations, and by so much: thermal and other errors are less.
# No scanner is off by more than the third; with more a scan may lie a run beside, and beyond the last it fits nowhere.
SURE_SCALE, LEAST_SCALE, MOST_SCALE, ABSURD_SCALE = 3.0, 0.002, 0.03, 0.1
SEED = 24


@final
@frozen
class Registration:
    """Where a scan was taken, and what that is worth.

    Attributes:
        T_work_scan: (4, 4) turns coordinates of the scan into those of the part, and scales them [mm].
        middle: (3,) of the scan, in the part's coordinates; turns are about it [mm].
        covariance: (6, 6) of turn [rad] and shift [mm].
        loose: (j, 6) unit directions of turn, times the radius of the scan, and shift that nothing fixes.
        level: volume that is deposited over the planned one, as far as the pose tells.
        spread: width of the beads over that which their flow asks for.
        offset: by which all beads lie to the left of their paths, as seen from outside [mm].
        noise: standard deviation of a point [mm].
        used: share of the points that lie on the part.
        scale: by which the scan's coordinates are multiplied, in T_work_scan too; 1 unless it is surely another.
        scale_deviation: standard deviation of it; 0 where it is 1.
    """

    T_work_scan: FloatArray
    middle: FloatArray
    covariance: FloatArray
    loose: FloatArray
    level: float
    spread: float
    offset: float
    noise: float
    used: float
    scale: float = 1.0
    scale_deviation: float = 0.0

    def __post_init__(self) -> None:
        freeze_arrays(self, T_work_scan="float: 4 4", middle="float: 3", covariance="float: 6 6", loose="float: j 6")

    @property
    def scaled(self) -> bool:
        """Whether the scan is not true to scale."""
        return self.scale_deviation > 0.0

    @property
    def shift_deviation(self) -> float:
        """Standard deviation of where the middle of the scan is, along the worst direction [mm]."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance[3:, 3:])[-1]))

    @property
    def turn_deviation(self) -> float:
        """Standard deviation of the turn about the worst axis [rad]."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance[:3, :3])[-1]))

    def along(self, places: FloatArray, directions: FloatArray) -> FloatArray:
        """Return the (k, 6) by which places move along directions as the pose turns and shifts.

        Args:
            places: (k, 3) in the part's coordinates [mm].
            directions: (k, 3) unit vectors.
        """
        return np.column_stack([np.cross(places - self.middle, directions), directions])


def registered(
    points: FloatArray,
    surface: Surface,
    deposit: PlannedDeposit | None,
    *,
    start: FloatArray,
    features: bool = False,
    name: str = "scan",
) -> Registration:
    """Lay a scan onto its part.

    Args:
        points: (k, 3) of the scan, in its own coordinates [mm].
        surface: of the part.
        deposit: that is planned on it; None where nothing is.
        start: (4, 4) T_work_scan about where it was taken: up to ten millimetres and five degrees off [mm].
        features: whether features of both are looked for as well, for parts that have some.
        name: of the scan, for messages.

    Raises:
        InputError: the scan does not lie on the part from there.
        UsageError: open3d is not installed.
        ResourceError: it takes too long or too much memory.
    """
    if importlib.util.find_spec("open3d") is None:
        raise missing("open3d", extra="scan", work="laying scans onto parts")
    target = ScanTarget(surface, deposit)
    few = _some(points, TRIED_POINTS)
    ended = _near(points, target, start, features=features, name=name)
    places = [pose for near in ended for pose in _around(near, target)]
    many = _some(points, ADJUSTED_POINTS)
    best, fitted = _settled(many, target, _best(few, target, places, scaling=False), scaling=False)
    if deposit is not None:
        fits = best.used >= LEAST_USED and best.noise <= MOST_NOISE_SHARE * deposit.height
        start, near = (best.T_work_scan, fitted) if fits else (_best(few, target, places, scaling=True), target)
        tried = adjusted(many, near, start=start, steps=ADJUSTED_STEPS, scaling=True)
        if max(LEAST_SCALE, SURE_SCALE * _scale_deviation(tried)) < _scale_error(tried) < ABSURD_SCALE:
            best, fitted = _settled(many, near, tried.T_work_scan, scaling=True)
    _check(best, fitted, name=name)
    radius = float(np.linalg.norm(points - points.mean(axis=0), axis=1).max())
    left = SYSTEMATIC**2 * np.array([radius**-2.0] * 3 + [1.0] * 3)
    covariance = best.covariance[:POSE, :POSE] + left * np.eye(POSE)
    return Registration(
        best.T_work_scan, best.middle, covariance, best.loose, float(best.shares[0]), fitted.spread, fitted.offset,
        best.noise, best.used, float(best.shares[-1]), _scale_deviation(best),
    )  # fmt: skip


def _best(points: FloatArray, target: ScanTarget, places: list[FloatArray], *, scaling: bool) -> FloatArray:
    """Return the pose of the best fit that is found in a few steps from any of some places."""
    tried = [adjusted(points, target, start=pose, steps=TRIED_STEPS, scaling=scaling) for pose in places]
    return min(tried, key=lambda each: _misfit(each, printed=target.deposit is not None)).T_work_scan


def _settled(
    points: FloatArray, target: ScanTarget, start: FloatArray, *, scaling: bool
) -> tuple[Adjusted, ScanTarget]:
    """Return how a scan fits, and its part with the deposit over the feet of the scan, as wide and far beside."""
    surface, deposit = target.surface, target.deposit
    best = adjusted(points, target, start=start, steps=ADJUSTED_STEPS, scaling=scaling)
    for _ in range(FOOT_ROUNDS):
        wider, beside = _changes(best, printed=deposit is not None)
        spread, offset = float(np.clip(target.spread * np.exp(wider), NARROWEST, WIDEST)), target.offset + beside
        feet, _ = closest(surface, transforms.apply(best.T_work_scan, points))
        target = ScanTarget(surface, deposit, spread=spread, offset=offset, below=feet)
        best = adjusted(points, target, start=best.T_work_scan, steps=ADJUSTED_STEPS, scaling=scaling)
        if max(np.abs(_changes(best, printed=deposit is not None))) < SETTLED_CHANGE:
            break
    return best, target


def _scale_error(found: Adjusted) -> float:
    """Return how far a scan is from being true to scale."""
    return abs(float(found.shares[-1]) - 1.0)


def _scale_deviation(found: Adjusted) -> float:
    """Return the standard deviation of the scale, 0 where it was not asked for."""
    return float(np.sqrt(np.diagonal(found.covariance)[FIXED_SCALE:].sum()))


def _changes(found: Adjusted, *, printed: bool) -> tuple[float, float]:
    """Return by how much wider (logarithm) and farther to the left [mm] beads are than those that were fitted."""
    if not printed:
        return 0.0, 0.0
    shares = np.clip(found.shares[1:3] / max(float(found.shares[0]), LEAST_LEVEL), -MOST_CHANGE, MOST_CHANGE)
    return float(shares[0]), float(shares[1])


def _near(points: FloatArray, target: ScanTarget, start: FloatArray, *, features: bool, name: str) -> list[FloatArray]:
    """Return the poses that open3d finds, from the start and from features."""
    raised = target.places + target.material.heights[:, :1] * target.normals
    few = np.random.default_rng(SEED).permutation(len(raised))[:NEAR_PLACES]
    given = BytesIO()
    np.savez(
        given, scan=_some(points, NEAR_POINTS), places=raised[few], normals=target.normals[few], starts=start[None],
        reaches=REACHES, feature=FEATURE_SHARE * target.size if features else 0.0,
    )  # fmt: skip
    written = run_worker(
        Path(registration_worker.__file__), [], data=given.getvalue(), work="fitted to its part", name=name
    )
    poses: FloatArray = np.load(BytesIO(written), allow_pickle=False)
    return list(poses)


def _misfit(tried: Adjusted, *, printed: bool) -> float:
    """Return how badly a scan fits; not at all where beads stand in valleys, as negative material, or it shrinks."""
    upside_down = printed and float(tried.shares[0]) < LEAST_LEVEL
    return (
        float("inf") if upside_down or _scale_error(tried) > ABSURD_SCALE else tried.noise / max(tried.used, LEAST_USED)
    )


def _around(pose: FloatArray, target: ScanTarget) -> list[FloatArray]:
    """Return poses beside one, shifted along the part by shares of the spacing."""
    if target.deposit is None:
        return [pose]
    up = mean_normal(target.surface)
    axes = np.linalg.svd(up[None] / max(float(np.linalg.norm(up)), 1e-12))[2][1:]
    found: list[FloatArray] = []
    for first in AROUND:
        for second in AROUND:
            moved = pose.copy()
            moved[:3, 3] += target.deposit.spacing * (first * axes[0] + second * axes[1])
            found.append(moved)
    return found


def _some(points: FloatArray, count: int) -> FloatArray:
    """Return at most so many points, the same ones each time."""
    if len(points) <= count:
        return points
    return points[np.sort(np.random.default_rng(SEED).permutation(len(points))[:count])]


def _check(found: Adjusted, target: ScanTarget, *, name: str) -> None:
    """Refuse a pose at which the scan does not lie on its part."""
    deposit = target.deposit
    most = MOST_BARE_NOISE_SHARE * target.size if deposit is None else MOST_NOISE_SHARE * deposit.height
    if found.used < LEAST_USED:
        raise InputError(
            f"`{name}` does not match {target.surface.name}: {percent(found.used)} of its points lie on it, at least "
            f"{percent(LEAST_USED)} must. Cut away other objects, check the unit, or give its pose with `--pose`.",
            used=found.used,
        )
    if found.noise > most:
        raise InputError(
            f"`{name}` is {found.noise:.3g} mm off {target.surface.name} at its best fit, at most {most:.3g} mm are "
            "allowed. Check part, print and unit, or give its pose with `--pose`.",
            noise_mm=found.noise,
        )
    if _scale_error(found) > MOST_SCALE:
        raise InputError(
            f"`{name}` fits {target.surface.name} only when scaled by {found.shares[-1]:.3f}, at most "
            f"{percent(MOST_SCALE)} can be a scanner's error. Check its unit, and that it shows this part and print.",
            scale=float(found.shares[-1]),
        )
