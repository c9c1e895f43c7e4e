"""The angle of paths to the lines of a field, and how much of what is deposited overhangs."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.model import (
    FloatArray,
    FollowedLines,
    IntArray,
    PoseStream,
    Surface,
    SurfaceCurves,
    freeze_arrays,
    frozen,
)
from geoprint.transforms import angles_between

# The angle of paths to the lines of a field, and about the axis between which helix angles count.


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


# How much of what is deposited overhangs: where gravity pulls a bead off the surface that it lies on, or along it.


# Places that are kept where beads overhang most.
WORST_PLACES = 5


@final
@frozen
class Overhang:
    """What of a deposit overhangs.

    Attributes:
        critical: angle beyond which a bead overhangs [rad].
        length: deposited length that overhangs [mm].
        share: of the deposited length; 0 where nothing is deposited.
        largest: angle [rad]; 0 where nothing is deposited.
        rows: (w,) poses at which the worst stretches overhang most, at most five, the worst first.
        angles: (w,) of these [rad].
    """

    critical: float
    length: float
    share: float
    largest: float
    rows: IntArray
    angles: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, rows="int: w", angles="float: w")


def overhang(poses: PoseStream, *, up: FloatArray, critical: float) -> Overhang:
    r"""Measure what overhangs of what is deposited.

    The angle of overhang is the one between the outward normal n of the surface on which the bead lies and up, against
    gravity g. The bead lies on level ground at 0, on a wall at 90 and below a ceiling at 180 degrees:

             up                    n    up
             ^                      \   |
             | n                     \ a|
             |                        \ |
         ____o____  bead               \|
                                        o  bead
           a = 0                     __/
             |                    __/     a > critical: it overhangs
             v g               __/
                                  surface

    A step from one pose to the next overhangs where it is steeper than the critical angle at either of its ends. It is
    deposited in the attitude of the pose that ends it: a table that tilts does so before.

    Args:
        poses: p of them; only what is deposited counts.
        up: (3,) unit direction in the work frame that points up, or (p, 3) the one while each pose is printed.
        critical: angle of the material, in (0, pi / 2) [rad].

    Returns:
        The figures. A worst place is the steepest of neighbouring poses of one run that overhang; the earlier one
        among equals.
    """
    deposited = np.flatnonzero(poses.deposited)
    ups = np.broadcast_to(up, poses.normals.shape)
    ends = [angles_between(poses.normals[deposited + step], ups[deposited + 1]) for step in (0, 1)]
    lengths = np.linalg.norm(poses.tips[deposited + 1] - poses.tips[deposited], axis=1)
    length, total = float(lengths[np.maximum(*ends) > critical].sum()), float(lengths.sum())
    angles = np.zeros(poses.count)
    for step in (0, 1):
        np.maximum.at(angles, deposited + step, ends[step])
    rows = _worst(angles, poses.runs, critical=critical)
    return Overhang(
        critical, length, length / total if total else 0.0, float(angles.max(initial=0.0)), rows, angles[rows]
    )


def _worst(angles: FloatArray, runs: IntArray, *, critical: float) -> IntArray:
    """Return the pose of the largest angle of each stretch that overhangs, of the worst ones."""
    over = np.flatnonzero(angles > critical)
    breaks = np.flatnonzero((np.diff(over) > 1) | (np.diff(runs[over]) > 0)) + 1
    steepest = [int(rows[np.argmax(angles[rows])]) for rows in np.split(over, breaks) if rows.size]
    return np.array(sorted(steepest, key=lambda row: (-angles[row], row))[:WORST_PLACES], dtype=np.int64)
