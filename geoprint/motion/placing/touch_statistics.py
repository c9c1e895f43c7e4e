"""What the residuals of touched points say: how far a touch strays, how far the fit may be off, and which point is odd.

A fit by least squares with six unknowns, linear near its solution: the 3 k coordinates of the touches are
y = f(x) + e with e independent and alike in every coordinate. Then the residuals' sum of squares over its degrees of
freedom, 3 k - 6, estimates the noise's variance, and errors of the fit over that estimate follow Student's and Fisher's
distributions, which know how little four points say about their own noise.
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.special import chdtrc, chdtri, fdtrc, fdtri

from geoprint.model import FloatArray, IntArray, comparable, freeze_arrays, frozen

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
