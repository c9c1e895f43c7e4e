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

from geoprint import transforms
from geoprint.appraisal.scanned import registration_worker
from geoprint.appraisal.scanned.adjusting import FIXED_SCALE, POSE, Adjusted, adjusted
from geoprint.appraisal.scanned.deposit import NARROWEST, WIDEST, PlannedDeposit
from geoprint.appraisal.scanned.target import ScanTarget
from geoprint.errors import InputError
from geoprint.model import FloatArray, Surface, freeze_arrays, frozen
from geoprint.surfaces import closest, mean_normal
from geoprint.surfaces.conversion import missing
from geoprint.surfaces.files.native import run_worker

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
        level: volume that is laid over the planned one, as far as the pose tells.
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
        Path(registration_worker.__file__), [], data=given.getvalue(), work="laid onto its part", name=name
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
            f"`{name}` does not lie on {target.surface.name}: of its points {found.used:.0%} do, at least "
            f"{LEAST_USED:.0%} must; cut away what is not the part, check the unit, or give its pose with `--pose`.",
            used=found.used,
        )
    if found.noise > most:
        raise InputError(
            f"`{name}` lies {found.noise:.3g} mm off {target.surface.name} where it fits best, at most {most:.3g} mm "
            "is a fit; check that it is of this part and print, its unit, or give its pose with `--pose`.",
            noise_mm=found.noise,
        )
    if _scale_error(found) > MOST_SCALE:
        raise InputError(
            f"`{name}` fits {target.surface.name} only if its coordinates are multiplied by {found.shares[-1]:.3f}, at "
            f"most {MOST_SCALE:.0%} can be a scanner's error; check its unit, and that it is of this part and print.",
            scale=float(found.shares[-1]),
        )
