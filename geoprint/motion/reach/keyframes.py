"""Keyframes along a stream, and the smooth course of a value between them.

Every pose has a *place* on a scale on which keyframe i stands at i. The scale grows with the path, faster where
keyframes shall be denser. Values between keyframes are a uniform cubic B-spline [DeBoor1978] whose coefficients are
the keyframes' values: twice continuously differentiable along the scale, and never outside the hull of the four
keyframes around a place. What all four keep (a cone) is kept everywhere between; a staircase becomes a ramp.
"""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.model import BoolArray, FloatArray, PoseStream, frozen
from geoprint.motion.reach.pose_samples import STEP, TURN_STEP, tip_lengths, tool_poses, turns

# Turning counts as path too, so that a tool that turns on the spot gets keyframes: a radian is as long as this [mm].
LEVER = 10.0
# Samples of the path (`pose_samples`) to a keyframe.
SAMPLES_PER_KEYFRAME = 10


@final
@frozen
class Keyframes:
    """k keyframes of p poses.

    Attributes:
        Ts_base_tool: (k, 4, 4) poses of the path [mm].
        deposit: (k,) whether material is laid at the keyframe.
        steps: (k - 1,) length of path from each keyframe to the next [mm], turning counted.
        places: (p,) of the poses, from 0 to k - 1.
    """

    Ts_base_tool: FloatArray
    deposit: BoolArray
    steps: FloatArray
    places: FloatArray

    @property
    def lengths(self) -> FloatArray:
        """(k,) length of path from the first keyframe [mm]."""
        return np.append(0.0, np.cumsum(self.steps))

    @property
    def count(self) -> int:
        """Number of keyframes k."""
        return int(self.deposit.size)


def path_lengths(poses: PoseStream) -> FloatArray:
    """Return the (p,) lengths of path from the first pose [mm], turning counted."""
    return np.append(0.0, np.cumsum(np.hypot(tip_lengths(poses), LEVER * turns(poses))))


def keyframe_rate(poses: PoseStream) -> float:
    """Return the usual number of keyframes a millimetre of path; 0 where nothing moves."""
    samples = np.ceil(np.maximum(tip_lengths(poses) / STEP, turns(poses) / TURN_STEP)).sum()
    length = float(path_lengths(poses)[-1])
    return float(samples / SAMPLES_PER_KEYFRAME / length) if length > 0.0 else 0.0


def keyframes_of(poses: PoseStream, *, T_base_work: FloatArray, rates: FloatArray) -> Keyframes:
    """Set keyframes along a stream, the first at its first pose and the last at its last.

    Args:
        poses: p poses, one at least.
        T_base_work: (4, 4) where the part stands [mm].
        rates: (p,) wanted keyframes a millimetre of path at each pose; what lies between is interpolated.
    """
    lengths = path_lengths(poses)
    scale = np.append(0.0, np.cumsum((rates[1:] + rates[:-1]) / 2.0 * np.diff(lengths)))
    if not scale[-1] > 0.0:
        return _at_rest(poses, T_base_work=T_base_work)
    count = int(np.ceil(scale[-1]))
    places = scale * (count / scale[-1])
    places[-1] = count
    targets = np.arange(count + 1, dtype=np.float64)
    rows = np.clip(np.searchsorted(places, targets, side="right") - 1, 0, poses.count - 2)
    gaps = places[rows + 1] - places[rows]
    shares = np.divide(targets - places[rows], gaps, out=np.zeros(count + 1), where=gaps > 0.0).clip(0.0, 1.0)
    commanded = tool_poses(poses, T_base_work=T_base_work)
    laid = poses.laid
    return Keyframes(
        Ts_base_tool=transforms.interpolate_poses(commanded[rows], commanded[rows + 1], shares),
        deposit=laid[rows] | ((shares == 0.0) & laid[np.maximum(rows - 1, 0)]),
        steps=np.diff(lengths[rows] + shares * (lengths[rows + 1] - lengths[rows])),
        places=places,
    )


def thinned(frames: Keyframes, *, count: int) -> Keyframes:
    """Return at most so many keyframes, evenly chosen, the first and the last among them."""
    rows = np.unique(np.linspace(0, frames.count - 1, min(frames.count, count)).round().astype(np.int64))
    return replace(
        frames,
        Ts_base_tool=frames.Ts_base_tool[rows],
        deposit=frames.deposit[rows],
        steps=np.diff(frames.lengths[rows]),
    )


def smoothed(values: FloatArray, places: FloatArray) -> FloatArray:
    """Return the (p, d) values of a uniform cubic B-spline with (k, d) coefficients at (p,) places.

    Beyond its ends the first and the last coefficient go on.

    Examples:
        >>> smoothed(np.array([[0.0], [0.0], [6.0], [0.0], [0.0]]), np.array([0.0, 1.0, 2.0]))[:, 0]
        array([0., 1., 4.])
    """
    last = len(values) - 1
    before = np.minimum(np.floor(places).astype(np.int64), max(last - 1, 0))
    t = places - before
    weights = (
        (1.0 - t) ** 3,
        3.0 * t**3 - 6.0 * t**2 + 4.0,
        -3.0 * t**3 + 3.0 * t**2 + 3.0 * t + 1.0,
        t**3,
    )
    result = np.zeros((places.size, values.shape[1]))
    for offset, weight in zip((-1, 0, 1, 2), weights, strict=True):
        result += weight[:, None] / 6.0 * values[np.clip(before + offset, 0, last)]
    return result


def _at_rest(poses: PoseStream, *, T_base_work: FloatArray) -> Keyframes:
    """Return the one keyframe of a tool that does not move."""
    return Keyframes(
        Ts_base_tool=tool_poses(poses, T_base_work=T_base_work)[:1],
        deposit=poses.deposit[:1],
        steps=np.empty(0),
        places=np.zeros(poses.count),
    )
