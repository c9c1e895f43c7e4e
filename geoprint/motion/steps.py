"""The steps between neighbouring poses of a stream: how far the tip goes, how far the tool turns, what is laid."""

from __future__ import annotations

import numpy as np

from geoprint.model import BoolArray, FloatArray, PoseStream


def tip_ways(poses: PoseStream) -> FloatArray:
    """Return the (p - 1,) straight ways of the tip [mm]."""
    return np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)


def turns(poses: PoseStream) -> FloatArray:
    """Return the (p - 1,) angles by which the tool turns [rad]; exact for small ones too."""
    quaternions = poses.quaternions
    apart = np.linalg.norm(np.diff(quaternions, axis=0), axis=1)
    opposite = np.linalg.norm(quaternions[1:] + quaternions[:-1], axis=1)
    return 4.0 * np.arcsin(np.minimum(apart, opposite) / 2.0)


def deposit_steps(poses: PoseStream) -> BoolArray:
    """Return the (p - 1,) steps on which material is laid: those that join two depositing poses of one run."""
    return poses.deposit[:-1] & poses.deposit[1:] & (poses.runs[1:] == poses.runs[:-1])
