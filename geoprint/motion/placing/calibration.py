"""How well touched points say where the part stands: the fit's uncertainty there, and which point to touch next.

An error of the fit is a small shift and a small turn about the middle of the touched points. Their covariance follows
from where the points are and how far a touch strays, and carried to a place of the part it is the uncertainty of the
print there [Fitzpatrick2001]: least in the middle of the fixture, larger the farther from it. Errors that all touches
share are not in it: a wrong tool centre point, a model whose points are not where they are on the fixture, and where
the part stands on its fixture.

Places and directions are in the robot's base frame.
"""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import ClearanceError
from geoprint.model import FloatArray, Placement, TouchedPoints, comparable, freeze_arrays, frozen
from geoprint.motion.placing.placement import fit_touched_points
from geoprint.motion.placing.touch_statistics import Noise, TouchStatistics, touch_statistics

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


@final
@comparable
class NextTouch:
    """The candidate that a further touch should take.

    Attributes:
        candidate: its index.
        deviation: largest standard deviation that is left afterwards at the same noise [mm].
        bound: what the error keeps within there in 95 of 100 calibrations [mm].
    """

    candidate: int
    deviation: float
    bound: float


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


def next_touch(calibration: FixtureCalibration, candidates: FloatArray, *, places: FloatArray) -> NextTouch:
    """Return the candidate whose touch lowers the largest standard deviation at the places most; the first of equals.

    Args:
        calibration: as it is.
        candidates: (m, 3) points that could be touched, again or anew [mm].
        places: (k, 3) where the uncertainty matters [mm].
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
    return NextTouch(best, left.deviation, left.bound)


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
            f"the touched points leave open where {part} stands: at ({x:.1f}, {y:.1f}, {z:.1f}) mm in the base frame "
            f"its surface may lie {uncertainty.bound:.2f} mm off along its normal (95 % bound), allowed is the "
            f"stand-off of {standoff:g} mm; `geoprint calibrate --part` says which point to touch next.",
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
