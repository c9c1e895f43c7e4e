"""Calibration: where the part stands from touched points, where the tool's tip is, and how well both are known."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.special import chdtrc, chdtri, fdtrc, fdtri

from geoprint import transforms
from geoprint.errors import ClearanceError, InputError, how_many
from geoprint.model import FloatArray, IntArray, Placement, TouchedPoints, comparable, freeze_arrays, frozen
from geoprint.robot.placing.placement import fit_touched_points

# What the residuals of touched points say: how far a touch strays, how far the fit may be off, and which point is
# odd.
#
# A fit by least squares with six unknowns, linear near its solution: the 3 k coordinates of the touches are y = f(x)
# + e with e independent and alike in every coordinate. Then the residuals' sum of squares over its degrees of
# freedom, 3 k - 6, estimates the noise's variance, and errors of the fit over that estimate follow Student's and
# Fisher's distributions, which know how little four points say about their own noise.


# Unknowns of a fit: three lengths and three more lengths or angles.
UNKNOWNS = 6

# Bounds hold for this share of calibrations.
CONFIDENCE = 0.95

# A point is called odd where chance alone would make any of the points look so in this share of calibrations, and a
# noise that was given is not believed where chance alone would leave residuals so large in it.
ODD_LEVEL = 0.01

# Touches without which the fit gains at least this share of what it gains without the oddest may each be the bad one.
ALIKE_SHARE = 0.5

# No touch is better than the arm repeats, whatever few residuals say [mm]: 0.01 mm for the IRB 120, by its maker.
LEAST_NOISE = 0.01

# A direction in which a touch decides its own fit by more than all but this share cannot be judged by the others.
OWN_SHARE = 1e-6


@final
@comparable
class Noise:
    """How far a touch strays.

    Attributes:
        deviation: standard deviation of each coordinate [mm].
        degrees_of_freedom: behind the deviation; infinite where it is given and not estimated.
    """

    deviation: float
    degrees_of_freedom: float

    @property
    def given(self) -> bool:
        """Whether somebody stated it; else it is estimated from the residuals."""
        return bool(np.isinf(self.degrees_of_freedom))

    @property
    def interval(self) -> tuple[float, float]:
        """What the true deviation lies between in 95 of 100 calibrations [mm]."""
        if self.given:
            return self.deviation, self.deviation
        tail = (1.0 - CONFIDENCE) / 2.0
        low, high = (float(chdtri(self.degrees_of_freedom, share)) for share in (tail, 1.0 - tail))
        squares = self.degrees_of_freedom * self.deviation**2
        return float(np.sqrt(squares / low)), float(np.sqrt(squares / high))

    def factor(self, dimensions: FloatArray | float) -> FloatArray:
        """Return how many standard deviations an error keeps within in 95 of 100 calibrations.

        Args:
            dimensions: of the error; 1 for one direction (Student's t), 3 for a vector whose components are alike.

        Returns:
            sqrt(d F) with Fisher's F of d and the noise's degrees of freedom; with chi-square where it is given.
        """
        if self.given:
            return np.sqrt(chdtri(dimensions, 1.0 - CONFIDENCE))
        return np.sqrt(dimensions * fdtri(dimensions, self.degrees_of_freedom, CONFIDENCE))

    def radius(self, cofactors: FloatArray) -> FloatArray:
        """Return the length that error vectors keep within in 95 of 100 calibrations.

        A sum of squares with unequal variances is taken for chi-square with the dimensions that give it the right
        variance [Satterthwaite1946]: exact for one direction and for equal variances, between them within half a
        per cent of the 95.

        Args:
            cofactors: (..., 3, 3) covariances at a noise of 1.

        Returns:
            (...) lengths in the unit of the deviation.
        """
        trace = np.trace(cofactors, axis1=-2, axis2=-1)
        dimensions = trace**2 / (cofactors**2).sum(axis=(-2, -1))
        return self.deviation * np.sqrt(trace / dimensions) * self.factor(dimensions)


@final
@frozen
class TouchStatistics:
    """What k residuals of a fit say.

    Attributes:
        residuals: (k, 3) touched less fitted [mm].
        cofactor: (6, 6) covariance of the unknowns at a noise of 1 mm.
        noise: of a touch, as given, or estimated where nobody gave it or where the residuals contradict what was given.
        misses: (k,) distance of each touch from where the others put it [mm].
        chances: (k,) chance that any of k good touches looks as odd as this one.
        odd: indices of the touches to repeat, oddest first: what chance explains in fewer than one of a hundred
            calibrations. A bad touch makes others look odd too, so only those are named without which the fit gains at
            least half as much as without the oddest; several on a square, whose corners show a warp alike.
        excess: chance of residuals this large at the noise given, or None where nobody gave it.
    """

    residuals: FloatArray
    cofactor: FloatArray
    noise: Noise
    misses: FloatArray
    chances: FloatArray
    odd: tuple[int, ...]
    excess: float | None

    def __post_init__(self) -> None:
        freeze_arrays(self, residuals="float: k 3", cofactor="float: 6 6", misses="float: k", chances="float: k")

    @property
    def rms(self) -> float:
        """Root mean square of the residuals' lengths [mm]."""
        return float(np.sqrt((self.residuals**2).sum(axis=1).mean()))


def touch_statistics(residuals: FloatArray, jacobians: FloatArray, *, noise: float | None) -> TouchStatistics:
    """Judge a fit by its residuals.

    Each touch is judged by the fit without it: the drop of the sum of squares when its three coordinates are left out,
    over the noise that the others show, follows Fisher's distribution (externally studentised residuals of a block)
    [Cook1982]; all k chances together are held to one level (Bonferroni).

    Args:
        residuals: (k, 3) touched less fitted [mm]; k at least 4.
        jacobians: (k, 3, 6) derivative of the fitted points by the unknowns, which together determine all of them.
        noise: standard deviation of each coordinate of a touch [mm], or None to estimate it.

    Returns:
        The statistics; with the estimated noise where the residuals are larger than the one given explains, so that
        nobody can state uncertainty away.
    """
    count = len(residuals)
    freedom = 3 * count - UNKNOWNS
    total = float((residuals**2).sum())
    normal = np.einsum("kij,kil->jl", jacobians, jacobians)
    cofactor = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    shares, axes = np.linalg.eigh(np.eye(3) - np.einsum("kia,ab,kjb->kij", jacobians, cofactor, jacobians))
    judged = shares > OWN_SHARE
    along = np.where(judged, np.einsum("kij,ki->kj", axes, residuals), 0.0)
    shares = np.where(judged, shares, 1.0)
    drops = (along**2 / shares).sum(axis=1)
    excess = None if noise is None else float(chdtrc(freedom, total / noise**2))
    if noise is None or (excess is not None and excess < ODD_LEVEL):
        believed = Noise(max(float(np.sqrt(total / freedom)), LEAST_NOISE), freedom)
        chances = _odd_chances(drops, judged.sum(axis=1), total=total, freedom=freedom)
    else:
        believed = Noise(noise, np.inf)
        chances = np.asarray(chdtrc(np.maximum(judged.sum(axis=1), 1), drops / noise**2), dtype=np.float64)
    chances = np.minimum(count * chances, 1.0)
    return TouchStatistics(
        residuals=residuals,
        cofactor=cofactor,
        noise=believed,
        misses=np.sqrt(((along / shares) ** 2).sum(axis=1)),
        chances=chances,
        odd=_odd(drops, chances),
        excess=excess,
    )


def _odd(drops: FloatArray, chances: FloatArray) -> tuple[int, ...]:
    """Return the touches that look odd and explain at least half as much as the one that explains most."""
    order = np.argsort(-drops, kind="stable")
    return tuple(int(k) for k in order if chances[k] < ODD_LEVEL and drops[k] >= ALIKE_SHARE * drops[order[0]])


def _odd_chances(drops: FloatArray, dimensions: IntArray, *, total: float, freedom: int) -> FloatArray:
    """Return the chance of each drop of the sum of squares, against the noise that the other touches show."""
    counted = np.maximum(dimensions, 1)
    rest = freedom - counted
    # What rounding leaves of a perfect fit is not noise: the others are taken to stray at least as the arm does.
    others = np.maximum(total - drops, rest * LEAST_NOISE**2)
    return np.asarray(fdtrc(counted, rest, (drops / counted) / (others / rest)), dtype=np.float64)


# How well touched points say where the part stands: the fit's uncertainty there, and which point to touch next.
#
# An error of the fit is a small shift and a small turn about the middle of the touched points. Their covariance
# follows from where the points are and how far a touch strays, and carried to a place of the part it is the
# uncertainty of the print there [Fitzpatrick2001]: least in the middle of the fixture, larger the farther from it.
# Errors that all touches share are not in it: a wrong tool centre point, a model whose points are not where they are
# on the fixture, and where the part stands on its fixture.
#
# Places and directions are in the robot's base frame.


# A surface that may lie higher or lower than this share of the stand-off [95 % bound] is worth a warning: the bead then
# varies by a third in height. Above the whole stand-off the tip may scratch the part, and nothing is planned.
NOTABLE_SHARE = 1.0 / 3.0


@final
@frozen
class FixtureCalibration:
    """A fitted fixture frame and how well its points determine it.

    Attributes:
        points: what was fitted.
        placement: the fit.
        statistics: of the residuals in the base frame; its unknowns are the shift [mm] and the turn [rad] of the
            fixture about the centre, along and about the base's axes.
        centre: (3,) middle of the fitted points [mm].
    """

    points: TouchedPoints
    placement: Placement
    statistics: TouchStatistics
    centre: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, centre="float: 3")

    @property
    def covariance(self) -> FloatArray:
        """(6, 6) covariance of the shift [mm] and the turn [rad] about the centre."""
        return self.statistics.noise.deviation**2 * self.statistics.cofactor


@final
@frozen
class Uncertainty:
    """How far the fit may be off at one place; of a turn all lengths are angles [rad].

    Attributes:
        place: (3,) [mm].
        direction: (3,) unit vector along which it is meant, or about which for a turn; its sign means nothing.
        deviation: standard deviation along the direction [mm].
        bound: what the error keeps within in 95 of 100 calibrations [mm]: along the direction where one was asked for,
            else the length of the error in all directions.
    """

    place: FloatArray
    direction: FloatArray
    deviation: float
    bound: float

    def __post_init__(self) -> None:
        freeze_arrays(self, place="float: 3", direction="float: 3")


def calibrate_fixture(points: TouchedPoints) -> FixtureCalibration:
    """Fit the fixture's frame and judge the fit.

    Args:
        points: four or more; their noise is estimated where it is not given.

    Raises:
        InputError: fewer than four points, points on a line or listed mirrored, or one that does not fit the others.

    Examples:
        Corners of a square of edge 100 mm, touched within 0.2 mm: the middle is known to 0.2 mm / sqrt(4).

        >>> corners = np.array([[-50.0, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]])
        >>> points = TouchedPoints(model=corners, touched=corners, T_fixture_work=np.eye(4), noise=0.2)
        >>> worst = position_uncertainty(calibrate_fixture(points), np.zeros((1, 3)))
        >>> round(worst.deviation, 3), round(worst.bound, 3)
        (0.1, 0.28)
    """
    placement = fit_touched_points(points)
    fitted = transforms.apply(placement.T_base_fixture, points.model)
    centre = fitted.mean(axis=0)
    statistics = touch_statistics(points.touched - fitted, _motions(fitted, centre), noise=points.noise)
    return FixtureCalibration(points, placement, statistics, centre)


def position_uncertainty(calibration: FixtureCalibration, places: FloatArray) -> Uncertainty:
    """Return the uncertainty at the worst of (k, 3) places, along its worst direction."""
    noise = calibration.statistics.noise
    cofactors = _carried(calibration.statistics.cofactor, _motions(places, calibration.centre))
    worst = int(np.argmax(np.linalg.eigvalsh(cofactors)[:, -1]))
    return _uncertainty(cofactors[worst], noise, place=places[worst])


def turn_uncertainty(calibration: FixtureCalibration) -> Uncertainty:
    """Return the uncertainty of the fixture's attitude, about its worst axis [rad]."""
    return _uncertainty(calibration.statistics.cofactor[3:, 3:], calibration.statistics.noise, place=calibration.centre)


def normal_uncertainty(calibration: FixtureCalibration, places: FloatArray, *, normals: FloatArray) -> Uncertainty:
    """Return the uncertainty along the surface's normal where it is largest.

    Args:
        calibration: where the part stands.
        places: (k, 3) on the part's surface [mm].
        normals: (k, 3) unit normals there.
    """
    along = np.column_stack([normals, np.cross(places - calibration.centre, normals)])
    variances = np.einsum("ki,ij,kj->k", along, calibration.statistics.cofactor, along)
    worst = int(np.argmax(variances))
    deviation = calibration.statistics.noise.deviation * float(np.sqrt(variances[worst]))
    bound = deviation * float(calibration.statistics.noise.factor(1.0))
    return Uncertainty(places[worst], normals[worst], deviation, bound)


def next_touch(
    calibration: FixtureCalibration, candidates: FloatArray, *, places: FloatArray
) -> tuple[int, float, float]:
    """Return the candidate whose touch lowers the largest standard deviation at the places most; the first of equals.

    Args:
        calibration: as it is.
        candidates: (m, 3) points that could be touched, again or anew [mm].
        places: (k, 3) where the uncertainty matters [mm].

    Returns:
        Its index; the largest standard deviation that is left afterwards at the same noise [mm]; and what the error
        keeps within there in 95 of 100 calibrations [mm].
    """
    known = np.linalg.inv(calibration.statistics.cofactor)
    touches = _motions(candidates, calibration.centre)
    cofactors = np.asarray(np.linalg.inv(known + np.swapaxes(touches, 1, 2) @ touches), dtype=np.float64)
    carried = _carried(cofactors, _motions(places, calibration.centre))
    largest = np.linalg.eigvalsh(carried)[..., -1]
    best = int(np.argmin(largest.max(axis=1).round(12)))
    noise = calibration.statistics.noise
    after = Noise(noise.deviation, noise.degrees_of_freedom + 3)
    left = _uncertainty(carried[best, int(np.argmax(largest[best]))], after, place=candidates[best])
    return best, left.deviation, left.bound


def refuse_uncertain(uncertainty: Uncertainty, *, standoff: float, part: str) -> None:
    """Refuse a calibration by which the tip may scratch the part.

    Args:
        uncertainty: along the surface's normal, where it is largest.
        standoff: height of the tip over the surface [mm].
        part: what the message calls it.

    Raises:
        ClearanceError: the 95 % bound of the error is larger than the stand-off.
    """
    if uncertainty.bound > standoff:
        x, y, z = uncertainty.place
        raise ClearanceError(
            f"the touched points leave {part} uncertain: {uncertainty.bound:.2f} mm along its normal at ({x:z.1f}, "
            f"{y:z.1f}, {z:z.1f}) mm in the base frame (95 % bound), allowed are {standoff:g} mm. `geoprint calibrate "
            "--part` says which point to touch next.",
            bound_mm=uncertainty.bound,
            standoff_mm=standoff,
        )


def _uncertainty(cofactor: FloatArray, noise: Noise, *, place: FloatArray) -> Uncertainty:
    variances, axes = np.linalg.eigh(cofactor)
    return Uncertainty(
        place=place,
        direction=axes[:, -1],
        deviation=noise.deviation * float(np.sqrt(variances[-1])),
        bound=float(noise.radius(cofactor)),
    )


def _motions(places: FloatArray, centre: FloatArray) -> FloatArray:
    """Return (k, 3, 6) how places move with a shift and a turn about the centre: v + w x (p - c)."""
    x, y, z = (places - centre).T
    motions = np.zeros((len(places), 3, 6))
    motions[:, :, :3] = np.eye(3)
    motions[:, 0, 4], motions[:, 0, 5] = z, -y
    motions[:, 1, 3], motions[:, 1, 5] = -z, x
    motions[:, 2, 3], motions[:, 2, 4] = y, -x
    return motions


def _carried(cofactor: FloatArray, motions: FloatArray) -> FloatArray:
    """Return (..., k, 3, 3) covariances of k places at a noise of 1 mm, given (..., 6, 6) those of shift and turn."""
    return np.einsum("kia,...ab,kjb->...kij", motions, cofactor, motions)


# Where the tip is in the flange frame, from poses in which it touches one fixed point.


FEWEST_POSES = 4

# A direction of the flange that swings by less than this (root mean square of the sine, 6 degrees) from pose to pose
# carries ten times the noise of a touch into the tip's place along it.
SMALLEST_SWING = 0.1

# A pose that puts the tip farther than this [mm] from where the others do was mistyped or did not touch the point.
LARGEST_MISS = 2.0


@final
@frozen
class TipCalibration:
    """A fitted tool centre point.

    Attributes:
        tip: (3,) in the flange frame [mm].
        touched: (3,) the fixed point in the base frame [mm].
        statistics: of the residuals in the base frame; its unknowns are the tip and the fixed point [mm].
        direction: (3,) unit vector in the flange frame along which the tip is known least.
        deviation: standard deviation of the tip along it [mm].
        bound: length that the tip's error keeps within in 95 of 100 calibrations [mm].
    """

    tip: FloatArray
    touched: FloatArray
    statistics: TouchStatistics
    direction: FloatArray
    deviation: float
    bound: float

    def __post_init__(self) -> None:
        freeze_arrays(self, tip="float: 3", touched="float: 3", direction="float: 3")


def calibrate_tip(Ts_base_flange: FloatArray, *, noise: float | None = None) -> TipCalibration:
    """Fit the tip that stays at one point while the flange turns about it.

    Every pose says R p + t = q for the tip p in the flange frame and the fixed point q: linear in both, solved by least
    squares. Only turning tells: along a direction of the flange that all poses hold the same, the tip could be
    anywhere.

    Args:
        Ts_base_flange: (k, 4, 4) poses of the flange [mm], four or more.
        noise: standard deviation of each coordinate of a touch [mm], or None to estimate it.

    Raises:
        InputError: too few poses, poses that hardly turn about one axis or any, or one that does not fit the others.
    """
    count = len(Ts_base_flange)
    if count < FEWEST_POSES:
        raise InputError(
            f"the tip touched its point in {how_many(count, 'pose')}; at least {FEWEST_POSES} are needed, because "
            "three always fit. Turn the tool in another direction and touch again.",
            count=count,
        )
    rotations, positions = Ts_base_flange[:, :3, :3], Ts_base_flange[:, :3, 3]
    _require_swing(rotations)
    jacobians = np.concatenate([rotations, np.broadcast_to(-np.eye(3), (count, 3, 3))], axis=2)
    solved = np.linalg.lstsq(jacobians.reshape(-1, 6), -positions.reshape(-1), rcond=None)[0]
    unknowns = np.asarray(solved, dtype=np.float64)
    statistics = touch_statistics(-positions - jacobians @ unknowns, jacobians, noise=noise)
    _require_agreement(statistics)
    variances, axes = np.linalg.eigh(statistics.cofactor[:3, :3])
    return TipCalibration(
        tip=unknowns[:3],
        touched=unknowns[3:],
        statistics=statistics,
        direction=axes[:, -1],
        deviation=statistics.noise.deviation * float(np.sqrt(variances[-1])),
        bound=float(statistics.noise.radius(statistics.cofactor[:3, :3])),
    )


def _require_swing(rotations: FloatArray) -> None:
    """Refuse orientations that leave the tip open along a direction of the flange.

    The directions R v of the flange's v lie about their mean with the mean square 1 - |mean(R) v|^2.

    Raises:
        InputError: one of them hardly swings.
    """
    mean = rotations.mean(axis=0)
    squares, axes = np.linalg.eigh(np.eye(3) - mean.T @ mean)
    swing = float(np.sqrt(max(squares[0], 0.0)))
    if swing < SMALLEST_SWING:
        x, y, z = axes[:, 0]
        raise InputError(
            f"the orientations do not fix the tip along ({x:z.2f}, {y:z.2f}, {z:z.2f}) of the flange: that direction "
            f"varies by only {np.degrees(np.arcsin(swing)):.1f} degrees, needed are "
            f"{np.degrees(np.arcsin(SMALLEST_SWING)):.0f}. Tilt the tool about two axes, by 30 degrees or more.",
            swing_deg=float(np.degrees(np.arcsin(swing))),
        )


def _require_agreement(statistics: TouchStatistics) -> None:
    """Refuse a pose in which the tip was not at the point.

    Raises:
        InputError: it misses where the others put it by more than LARGEST_MISS.
    """
    worst = int(np.argmax(statistics.misses))
    if statistics.misses[worst] > LARGEST_MISS:
        raise InputError(
            f"pose {worst + 1} of {len(statistics.misses)} has the tip {statistics.misses[worst]:.2f} mm from the fit "
            f"of the others, allowed are {LARGEST_MISS:g} mm. Check its numbers, or touch the point again.",
            pose=worst + 1,
            miss_mm=float(statistics.misses[worst]),
        )
