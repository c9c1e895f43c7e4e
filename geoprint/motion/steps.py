"""The steps between neighbouring poses of a stream: how far the tip goes and the tool turns."""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray, PoseStream


def tip_ways(poses: PoseStream) -> FloatArray:
    """Return the (p - 1,) straight ways of the tip [mm]."""
    return np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)


def turns(poses: PoseStream) -> FloatArray:
    """Return the (p - 1,) angles by which the tool turns [rad]; exact for small ones too."""
    quaternions = poses.quaternions
    apart = np.linalg.norm(np.diff(quaternions, axis=0), axis=1)
    opposite = np.linalg.norm(quaternions[1:] + quaternions[:-1], axis=1)
    return 4.0 * np.arcsin(np.minimum(apart, opposite) / 2.0)
