"""Curves on a surface resampled along their arc, with the step and the chord error both bounded."""

from __future__ import annotations

import numpy as np

from geoprint.geometry import arc_lengths, closest, positions, whole_steps
from geoprint.model import FloatArray, IntArray, Surface, SurfacePoints
from geoprint.transforms import EQUAL

# An even sample this share of a step away from a kept corner is dropped: it would only make the gaps uneven.
CROWDED_SHARE = 0.25
# What is this share longer or shorter than a bound is not, and points are equally far from a chord within the second
# share: rounding decides nothing.
ROUNDING, EQUALLY_FAR = 1e-6, 0.05
# Pieces of a curve shorter than this [mm] are rounding, not path.
SHORTEST_PIECE = 1e-9
# Weights that miss a sum of 1 by more than this belong to a point outside the triangle.
WHOLE = 1e-9
# No step is longer than this times the one before or after it, or than this times a length [mm] far below a bead.
GRADING = 2.0
SHORTEST_GRADED = 0.02


def resample(surface: Surface, points: SurfacePoints, *, step: float, chord_error: float) -> SurfacePoints:
    """Resample one curve: even samples along the arc, and where the curve bends too fast its own points as well.

    Args:
        surface: what the curve lies on.
        points: (k,) points of the curve, k >= 2; a closed one repeats its first point.
        step: largest distance along the curve between neighbouring samples [mm].
        chord_error: largest distance of the curve's points from the resampled polyline [mm].

    Returns:
        Points on the curve; the first and the last point are kept.
    """
    places = positions(surface, points)
    arcs = arc_lengths(places)
    real = np.concatenate([[True], np.diff(arcs) > SHORTEST_PIECE])
    places, arcs, index = places[real], arcs[real], np.flatnonzero(real)
    samples = _sample_arcs(places, arcs, step=step, chord_error=chord_error)
    piece = np.clip(np.searchsorted(arcs, samples, side="right") - 1, 0, max(arcs.size - 2, 0))
    share = (samples - arcs[piece]) / np.maximum(arcs[np.minimum(piece + 1, arcs.size - 1)] - arcs[piece], 1e-300)
    following = index[np.minimum(piece + 1, arcs.size - 1)]
    return interpolate(surface, points, index[piece], following, np.clip(share, 0.0, 1.0))


def graded(samples: FloatArray) -> FloatArray:
    """Halve every step between (k,) ascending samples that is longer than `GRADING` times a neighbouring one.

    Joints are splined through the samples, and a spline swings out on a long step beside a short one that bends.

    Examples:
        >>> graded(np.array([0.0, 1.0, 1.25]))
        array([0.  , 0.5 , 1.  , 1.25])
    """
    while True:
        steps = np.diff(samples)
        smaller = np.minimum(np.append(steps[1:], np.inf), np.insert(steps[:-1], 0, np.inf))
        long = steps > GRADING * (1.0 + ROUNDING) * np.maximum(smaller, SHORTEST_GRADED)
        if not long.any():
            return samples
        samples = np.sort(np.append(samples, 0.5 * (samples[:-1] + samples[1:])[long]))


def interpolate(
    surface: Surface, points: SurfacePoints, first: IntArray, second: IntArray, shares: FloatArray
) -> SurfacePoints:
    """Return points between pairs of surface points.

    Inside a common triangle that is exact. Where a pair has none, the chord's point is projected to the surface; its
    ends stay what they are.

    Args:
        surface: m faces.
        points: (k,) points.
        first: (j,) index of the point each result starts from.
        second: (j,) index of the point it goes towards.
        shares: (j,) share of the distance, in [0, 1].

    Returns:
        (j,) points.
    """
    ahead, ahead_sum = _carried(surface, points, source=second, target=first)
    back, back_sum = _carried(surface, points, source=first, target=second)
    in_first, in_second = ahead_sum >= 1.0 - WHOLE, back_sum >= 1.0 - WHOLE
    use_back = (~in_first & in_second)[:, None]
    start = np.where(use_back, back, points.weights[first])
    end = np.where(use_back, points.weights[second], ahead)
    faces = np.where(use_back[:, 0], points.faces[second], points.faces[first])
    weights = (1.0 - shares)[:, None] * start + shares[:, None] * end
    at_start, at_end = shares == 0.0, shares == 1.0
    faces[at_start], weights[at_start] = points.faces[first[at_start]], points.weights[first[at_start]]
    faces[at_end], weights[at_end] = points.faces[second[at_end]], points.weights[second[at_end]]
    apart = ~(in_first | in_second | at_start | at_end)
    if apart.any():
        places = positions(surface, points)
        chord = places[first[apart]] + shares[apart, None] * (places[second[apart]] - places[first[apart]])
        landed, _ = closest(surface, chord)
        faces[apart], weights[apart] = landed.faces, landed.weights
    return SurfacePoints(faces, weights / weights.sum(axis=1, keepdims=True))


def _carried(
    surface: Surface, points: SurfacePoints, *, source: IntArray, target: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Express source points by the corners of the target points' faces; the weights sum to 1 where they lie in it."""
    corners, other_corners = surface.faces[points.faces[target]], surface.faces[points.faces[source]]
    same = (corners[:, :, None] == other_corners[:, None, :]).astype(np.float64)
    weights = np.einsum("jab,jb->ja", same, points.weights[source])
    return weights, weights.sum(axis=1)


def _sample_arcs(places: FloatArray, arcs: FloatArray, *, step: float, chord_error: float) -> FloatArray:
    """Choose where to sample: even arcs first, then the farthest point of every piece whose chord errs too much."""
    length = float(arcs[-1])
    even: FloatArray = np.linspace(0.0, length, int(whole_steps(length, step=step)) + 1)
    kept = np.zeros(arcs.size, dtype=np.bool_)
    kept[[0, -1]] = True
    while True:
        samples = _merge(even, arcs[kept], crowded=CROWDED_SHARE * step)
        worst = _worst_points(places, arcs, samples, chord_error=chord_error)
        worst = worst[~kept[worst]]
        if worst.size == 0:
            return samples
        kept[worst] = True


def _merge(even: FloatArray, kept: FloatArray, *, crowded: float) -> FloatArray:
    """Join both sets, leaving out even samples too near to a kept one where the gap stays within one even step."""
    right = np.clip(np.searchsorted(kept, even), 1, kept.size - 1)
    gap = np.minimum(np.abs(even - kept[right - 1]), np.abs(kept[right] - even))
    near = gap < crowded
    step = even[1] - even[0]
    samples = np.unique(np.concatenate([even[~near], kept]))
    wide = np.diff(samples) > step * (1 + ROUNDING)
    middles = 0.5 * (samples[:-1] + samples[1:])[wide]
    return np.sort(np.concatenate([samples, middles]))


def _worst_points(places: FloatArray, arcs: FloatArray, samples: FloatArray, *, chord_error: float) -> IntArray:
    """Return for every sampled piece that errs too much the index of the curve's point farthest from its chord.

    Of those that are about equally far the one in the middle is taken, which is the same one whatever rounding does.
    """
    corners = np.column_stack([np.interp(samples, arcs, places[:, i]) for i in range(3)])
    piece = np.clip(np.searchsorted(samples, arcs, side="right") - 1, 0, samples.size - 2)
    start, along = corners[piece], corners[piece + 1] - corners[piece]
    length_squared = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
    share = np.clip(np.einsum("ij,ij->i", places - start, along) / length_squared, 0.0, 1.0)
    error = np.linalg.norm(places - start - share[:, None] * along, axis=1)
    largest = np.zeros(samples.size - 1)
    np.maximum.at(largest, piece, error)
    far = np.flatnonzero((error > (1.0 - EQUALLY_FAR) * largest[piece]) & (largest[piece] > chord_error))
    aside = np.abs(arcs[far] - 0.5 * (samples[:-1] + samples[1:])[piece[far]])
    order = np.lexsort((np.round(aside / EQUAL), piece[far]))
    return far[order[np.flatnonzero(np.diff(piece[far[order]], prepend=-1))]]
