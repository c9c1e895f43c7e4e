"""The angle of paths to the lines of a field, and about the axis between which helix angles count."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.model import FloatArray, FollowedLines, Surface, SurfaceCurves, frozen

# Shares of the length between which angles are said to lie, and within which paths lie off their lines.
LOW, HIGH = 0.05, 0.95


@final
@frozen
class FibreAngles:
    """How paths run along a field of lines, by their length.

    Attributes:
        off: mean angle to the line of the face below [rad].
        most_off: that which 95 % of the length keeps within [rad].
        helix: mean angle of the paths to the direction around the axis, positive where they rise to the right for who
            looks from outside with the axis up [rad]; None where the lines have no axis.
        spread: helix angles between which 90 % of the length lies [rad]; None where there is none.
    """

    off: float
    most_off: float
    helix: float | None
    spread: tuple[float, float] | None


def fibre_angles(surface: Surface, curves: SurfaceCurves, followed: FollowedLines) -> FibreAngles:
    """Measure the angles of paths on a surface.

    Args:
        surface: m faces.
        curves: on it.
        followed: lines of its faces.
    """
    places = curves.points.xyz(surface)
    starts = np.setdiff1d(np.arange(len(places)), curves.offsets[1:] - 1)
    steps = places[starts + 1] - places[starts]
    lengths: FloatArray = np.linalg.norm(steps, axis=1)
    kept = lengths > 0.0
    steps, lengths = steps[kept], lengths[kept]
    faces = curves.points.faces[starts[kept]]
    along = np.abs(np.einsum("kx,kx->k", steps, followed.directions[faces])) / lengths
    off: FloatArray = np.arccos(np.clip(along, 0.0, 1.0))
    lies = float(np.average(off, weights=lengths)), _reached(off, lengths, HIGH)
    if followed.axes is None:
        return FibreAngles(*lies, None, None)
    around, up = (np.einsum("kx,kx->k", steps, axis) for axis in followed.axes[faces].transpose(1, 0, 2))
    weights: FloatArray = np.where(np.hypot(around, up) > 0.0, lengths, 0.0)
    # Lines have no sense: their angles are taken about the mean of the doubled ones, from which none is far.
    angles = np.arctan2(up, around)
    middle = float(np.angle((weights * np.exp(2j * angles)).sum())) / 2.0
    helix: FloatArray = middle + (angles - middle + np.pi / 2.0) % np.pi - np.pi / 2.0
    spread = _reached(helix, weights, LOW), _reached(helix, weights, HIGH)
    return FibreAngles(*lies, float(np.average(helix, weights=weights)), spread)


def _reached(values: FloatArray, weights: FloatArray, share: float) -> float:
    """Return the smallest value up to which a share of the weight lies."""
    return float(np.quantile(values, share, weights=weights, method="inverted_cdf"))
