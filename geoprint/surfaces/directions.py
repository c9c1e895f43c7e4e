"""Directions over a surface that are found again by whoever asks: counted from an axis of the part's coordinates."""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray, Surface
from geoprint.surfaces.operators import mean_normal
from geoprint.transforms import smallest_rotation

# Where the mean normal is so nearly the x axis, as a cosine, the y axis stands in for it.
LEANING = 0.9


def direction_across(surface: Surface, *, angle: float) -> FloatArray:
    """Return the (3,) unit vector across the mean normal of a surface, at an angle.

    Args:
        surface: whose mean normal counts; the z axis stands in for that of a surface that has none, as a closed one.
        angle: counter-clockwise seen from outside [rad], from the x axis of the part's coordinates as it is seen along
            the mean normal, or from the y axis where the mean normal is within 26 degrees of x or -x.
    """
    upright = mean_normal(surface)
    upright = upright / np.linalg.norm(upright) if upright.any() else np.array([0.0, 0.0, 1.0])
    across = np.eye(3)[0 if abs(upright[0]) < LEANING else 1]
    across -= (across @ upright) * upright
    across /= np.linalg.norm(across)
    return np.cos(angle) * across + np.sin(angle) * np.cross(upright, across)


def upright_of(part: Surface) -> FloatArray:
    """Return the (3, 3) smallest rotation that turns a part's mean normal up; none where it has no mean normal."""
    mean = mean_normal(part)
    length = float(np.linalg.norm(mean))
    if length < np.finfo(np.float64).eps:
        return np.eye(3)
    return smallest_rotation(mean / length, np.array([[0.0, 0.0, 1.0]]))[0]
