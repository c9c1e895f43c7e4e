"""Which causes measured volumes have, by how much likelier they are with each than without.

The logarithm of volume over the wanted one, but for what the program itself does, is taken as a sum of causes, each a
Gaussian process of mean zero: a prior that shrinks towards no change, by how unsure the measurement is [Rasmussen2006,
ch. 2]. A cause comes in where the best of its sizes makes what was measured likelier by `SIGNIFICANT`, the strongest
one first; so noise alone brings in none.
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from geoprint.deposition.feedback.measured import MeasuredRuns
from geoprint.model import FloatArray, IntArray, freeze_arrays, frozen
from geoprint.threads import single_threaded_blas

# Gain of the log-likelihood that a cause needs [nats]: noise alone gives it once in 15 000 times (chi-squared of 16).
SIGNIFICANT = 8.0
# What no measurement of a volume knows better, over it: the shape of a bead, the part of a run that a point belongs to.
KNOWN = 0.005
# Changes along a run are alike over so many parts; the drift over a print over this share of it.
ALIKE_PARTS, ALIKE_SHARE = 3.0, 0.25
# Sizes that are tried (standard deviation): of a flow (logarithm), and of a lag [mm].
FLOWS, LAGS = (0.03, 0.1, 0.3), (0.1, 0.3, 1.0)
CONSTANT, DRIFT, ALONG, OPENING, SHUTTING = "constant", "drift", "along runs", "opening", "shutting"
# What differs from part to part by chance: the next print has its own, and to take that of the last out doubles it.
SCATTER = "scatter"
# What a flow mends, and what the times of a valve do.
FLOW_CAUSES, VALVE_CAUSES = (CONSTANT, DRIFT, ALONG), (OPENING, SHUTTING)


@final
@frozen
class Cause:
    """A cause of errors.

    Attributes:
        name: of it.
        pattern: (k, k) covariance of what it makes of k parts, for a size of 1.
        size: standard deviation.
        gain: of the log-likelihood, when it came in [nats].
    """

    name: str
    pattern: FloatArray
    size: float
    gain: float

    def __post_init__(self) -> None:
        freeze_arrays(self, pattern="float: k k")

    @property
    def covariance(self) -> FloatArray:
        """(k, k) of what it makes."""
        return self.size**2 * self.pattern


@final
@frozen
class Evidence:
    """What measured volumes say of their causes.

    Attributes:
        causes: that are significant and come again in the next print, the strongest first.
        weights: (k,) by which the covariance of a cause is multiplied to give its mean; 0 where nothing was measured.
        left: (k,) standard deviation of the sum of the causes that stays unknown.
        scatter: standard deviation of what differs from part to part by chance, where that is significant, else 0.
    """

    causes: tuple[Cause, ...]
    weights: FloatArray
    left: FloatArray
    scatter: float

    def __post_init__(self) -> None:
        freeze_arrays(self, weights="float: k", left="float: k")

    def mean(self, *names: str) -> FloatArray:
        """Return (k,) what causes of these names make, as far as is known: the logarithm of the volume."""
        there = [each.covariance @ self.weights for each in self.causes if each.name in names]
        return np.sum(there, axis=0) if there else np.zeros(self.weights.size)


def evidence_of(measured: MeasuredRuns) -> Evidence:
    """Return the causes of what was measured that are significant."""
    # Matrices of a few hundred rows: threads wait longer for each other than they work, and sum in another order.
    with single_threaded_blas():
        return _significant(measured)


def first_and_last(measured: MeasuredRuns) -> tuple[FloatArray, FloatArray]:
    """Return (k,) what a millimetre by which runs begin later, and end later, makes of the volume of their parts.

    It is a share of a run's first or last part, negative and positive; 0 elsewhere.
    """
    new = np.append(True, measured.runs[1:] != measured.runs[:-1])
    old = np.append(new[1:], True)
    return np.where(new, -1.0 / measured.lengths, 0.0), np.where(old, 1.0 / measured.lengths, 0.0)


def _significant(measured: MeasuredRuns) -> Evidence:
    used = np.flatnonzero(measured.usable)
    seen = np.log(measured.errors[used])
    own = measured.deviations[used] / measured.ratios[used]
    same = measured.runs[used, None] == measured.runs[used]
    noise = np.diag(own**2 + KNOWN**2) + measured.by_run**2 * same + measured.common**2
    patterns = _patterns(measured)
    causes: list[Cause] = []
    covariance, reached = noise, _likelihood(seen, noise)
    while used.size:
        tried = [
            Cause(name, pattern, size, _likelihood(seen, covariance + size**2 * pattern[np.ix_(used, used)]) - reached)
            for name, (pattern, sizes) in patterns.items()
            if name not in {cause.name for cause in causes}
            for size in sizes
        ]
        best = max(tried, key=lambda cause: cause.gain, default=None)
        if best is None or best.gain < SIGNIFICANT:
            break
        causes.append(best)
        covariance = covariance + best.covariance[np.ix_(used, used)]
        reached += best.gain
    return _known(tuple(causes), seen, covariance, used=used, count=measured.runs.size)


def _patterns(measured: MeasuredRuns) -> dict[str, tuple[FloatArray, tuple[float, ...]]]:
    """Return the pattern of each cause, and its sizes."""
    first, last = first_and_last(measured)
    reached = np.cumsum(measured.lengths) - 0.5 * measured.lengths
    apart = np.abs(reached[:, None] - reached)
    alike = ALIKE_PARTS * float(measured.lengths.mean())
    same = measured.runs[:, None] == measured.runs
    return {
        CONSTANT: (np.ones_like(apart), FLOWS),
        OPENING: (np.outer(first, first), LAGS),
        SHUTTING: (np.outer(last, last), LAGS),
        DRIFT: (np.exp(-apart / (ALIKE_SHARE * float(measured.lengths.sum()))), FLOWS),
        ALONG: (np.where(same, np.exp(-apart / alike), 0.0), FLOWS),
        SCATTER: (np.eye(apart.shape[0]), FLOWS),
    }


def _likelihood(seen: FloatArray, covariance: FloatArray) -> float:
    """Return the log-likelihood but for a constant."""
    if not seen.size:
        return 0.0
    factor = cho_factor(covariance, lower=True)
    return -0.5 * float(seen @ cho_solve(factor, seen)) - float(np.log(np.diag(factor[0])).sum())


def _known(
    causes: tuple[Cause, ...], seen: FloatArray, covariance: FloatArray, *, used: IntArray, count: int
) -> Evidence:
    """Return what is known of the sum of causes once they are chosen."""
    weights, left = np.zeros(count), np.zeros(count)
    scatter = sum(cause.size for cause in causes if cause.name == SCATTER)
    causes = tuple(cause for cause in causes if cause.name != SCATTER)
    if not causes:
        return Evidence(causes, weights, left, scatter)
    factor = cho_factor(covariance, lower=True)
    weights[used] = cho_solve(factor, seen)
    together: FloatArray = np.sum([cause.covariance for cause in causes], axis=0)
    solved: FloatArray = cho_solve(factor, together[used])
    told = (together[:, used] * solved.T).sum(axis=1)
    return Evidence(causes, weights, np.sqrt(np.maximum(np.diag(together) - told, 0.0)), scatter)
