"""The joint axes of an arm as lines in space at zero angles: all that its kinematics consist of."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.model import FloatArray, freeze_arrays, frozen


@final
@frozen
class Screws:
    """Six axes of rotation and the flange, all joints at zero, in the base frame.

    Attributes:
        points: (6, 3) a point on each axis [mm].
        directions: (6, 3) unit vectors about which joints turn positively.
        T_base_flange: (4, 4) where the flange is [mm].
    """

    points: FloatArray
    directions: FloatArray
    T_base_flange: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, points="float: 6 3", directions="float: 6 3", T_base_flange="float: 4 4")

    def nearest(self, one: int, other: int) -> FloatArray:
        """Return the (3,) point on one axis, numbered from 0, that is nearest to another.

        On parallel axes every point is as near: the one beside the other's own point is returned.
        """
        p, d = self.points[one], self.directions[one]
        q, e = self.points[other], self.directions[other]
        across = np.cross(d, e)
        squared = float(across @ across)
        if squared < PARALLEL**2:
            return p + ((q - p) @ d) * d
        return p + (np.cross(q - p, e) @ across) / squared * d

    def distance(self, axis: int, point: FloatArray) -> float:
        """Return how far a (3,) point is from an axis [mm]."""
        away = point - self.points[axis]
        return float(np.linalg.norm(away - (away @ self.directions[axis]) * self.directions[axis]))


# Sine of the angle below which two axes count as parallel when a common point is asked for: it would lie far away, in a
# place that says nothing about the arm.
PARALLEL = 1e-3
