"""How well a pose is known that was fitted to an outline: least squares whose errors are alike along it.

What is left of a fit is alike over stretches of the outline, so its covariance is that of blocks of it that are the
more alike the nearer they are [Conley1999]. Each block counts with what it would pull if the fit had been made without
it [Bell2002], and residuals that count less move the fit more than their weights say, by the slope of Tukey's function
[Huber1964]. Errors of the edge itself, which a fit takes up and leaves nothing of, are added.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import t as student

from geoprint.model import FloatArray, IntArray

# Of [Beaton1974], and from a median to a standard deviation; no edge is found better than this [pixels].
TUKEY, MAD, LEAST_NOISE = 4.685, 1.4826, 0.02
# An outline is cut into so many blocks; they are alike over so many (standard deviation).
BLOCKS, ALIKE_BLOCKS = 72, 2.0
# A block fixes no more of a direction than this share, where its pull without it is asked for; and residuals move the
# fit by no less than this share of their weights.
MOST_LEVERAGE, LEAST_SLOPE = 0.9, 0.3
# The steepest place of an edge is off where the edge is by this (standard deviation) [coarse pixels]: all along an
# outline by one amount, and by another on each of so many stretches.
EDGE_BIAS, STRETCHES = 0.05, 12
# Directions are fixed by no less than this share of the best fixed one; what nothing fixes becomes very uncertain.
LEAST_FIXED = 1e-10
# A covariance from so few blocks that are on their own is no better known than its degrees of freedom: 95 of 100 lie
# within so many standard deviations, of Student's t.
FITTED = 6
WITHIN_95 = float(student.ppf(0.975, BLOCKS / (float(np.sqrt(2.0 * np.pi)) * ALIKE_BLOCKS) - FITTED))


def robust_weights(off: FloatArray) -> FloatArray:
    """Return the (k,) weights of residuals [pixels]: 1 at none, 0 far beyond their spread [Beaton1974]."""
    return (1.0 - _ratios(off) ** 2) ** 2


def covariance_of(off: FloatArray, slopes: FloatArray, order: IntArray, *, count: int, unit: float) -> FloatArray:
    """Return the (6, 6) covariance of what was fitted.

    Args:
        off: (k,) residuals at the end of the fit [pixels].
        slopes: (k, 6) of them with what was fitted.
        order: (k,) place of each in the closed outline, from 0 to the count.
        count: of places of the outline.
        unit: pixels that were one where the part was looked for.
    """
    weights = robust_weights(off)
    scale: FloatArray = 1.0 / np.sqrt(np.maximum((weights[:, None] * slopes**2).sum(axis=0), 1e-300))
    rows = slopes * scale
    weighted = rows * weights[:, None]
    sizes, axes = np.linalg.eigh(weighted.T @ rows)
    sizes = np.maximum(sizes, LEAST_FIXED * sizes[-1])
    # In units in which all residuals together fix each direction to 1.
    to_unit: FloatArray = axes / np.sqrt(sizes)
    pulled = _pulled(off, rows @ to_unit, order * BLOCKS // count, weights)
    stretches = order * STRETCHES // count
    leaning = np.array([weighted[stretches == stretch].sum(axis=0) for stretch in range(STRETCHES)])
    biases = np.vstack([leaning.sum(axis=0), leaning]) @ to_unit
    inner = pulled + (EDGE_BIAS * unit) ** 2 * biases.T @ biases
    return scale[:, None] * (to_unit @ inner @ to_unit.T) * scale


def _pulled(off: FloatArray, rows: FloatArray, blocks: IntArray, weights: FloatArray) -> FloatArray:
    """Return the (6, 6) covariance of the sum of all pulls, in units in which the weighted rows fix all to 1."""
    weighted = rows * weights[:, None]
    pulls, fixed = np.zeros((BLOCKS, 6)), np.zeros((BLOCKS, 6, 6))
    np.add.at(pulls, blocks, weighted * off[:, None])
    np.add.at(fixed, blocks, np.einsum("ki,kj->kij", weighted, rows))
    gaps = np.abs(np.arange(BLOCKS)[:, None] - np.arange(BLOCKS))
    alike = np.exp(-0.5 * (np.minimum(gaps, BLOCKS - gaps) / ALIKE_BLOCKS) ** 2)
    shares, directions = np.linalg.eigh(np.einsum("gh,hij->gij", alike, fixed))
    own = np.einsum("gji,gj->gi", directions, pulls) / (1.0 - np.clip(shares, 0.0, MOST_LEVERAGE))
    without = np.einsum("gij,gj->gi", directions, own)
    u = _ratios(off)
    # Of r (1 - u^2)^2 with r: (1 - u^2) (1 - 5 u^2).
    slope = max(float(((1.0 - u**2) * (1.0 - 5.0 * u**2)).sum() / weights.sum()), LEAST_SLOPE)
    variances, principal = np.linalg.eigh(without.T @ alike @ without / slope**2)
    # Nothing is known better than if all residuals erred on their own.
    return (principal * np.maximum(variances, _noise(off) ** 2)) @ principal.T


def _noise(off: FloatArray) -> float:
    return max(MAD * float(np.median(np.abs(off))), LEAST_NOISE)


def _ratios(off: FloatArray) -> FloatArray:
    """Return the (k,) residuals over what is too far, at most 1."""
    return np.minimum(np.abs(off) / (TUKEY * _noise(off)), 1.0)
