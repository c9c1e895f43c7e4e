"""Where the tip is in the flange frame, from poses in which it touches one fixed point."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import FloatArray, freeze_arrays, frozen
from geoprint.motion.placing.touch_statistics import TouchStatistics, touch_statistics

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
            f"the tip touched its point in {count} poses; at least {FEWEST_POSES} are needed, because three fit "
            "wherever they were: turn the tool in another direction and touch again.",
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
            f"the orientations leave the tip open along ({x:.2f}, {y:.2f}, {z:.2f}) of the flange: in all poses that "
            f"direction stays the same within {np.degrees(np.arcsin(swing)):.1f} degrees, needed are "
            f"{np.degrees(np.arcsin(SMALLEST_SWING)):.0f}; tilt the tool about two axes, by 30 degrees or more.",
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
            f"pose {worst + 1} of {len(statistics.misses)} has the tip {statistics.misses[worst]:.2f} mm from where "
            f"the others put it, allowed are {LARGEST_MISS:g} mm: check its numbers, or touch the point again.",
            pose=worst + 1,
            miss_mm=float(statistics.misses[worst]),
        )
