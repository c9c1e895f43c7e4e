"""How far two sets of lines lie apart: the paper's Hausdorff distance, and what that single number hides."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import InputError
from geoprint.model import FloatArray, comparable


@final
@comparable
class Directed:
    """Distances from every point of one set to the nearest one of another, in the unit of both.

    Attributes:
        largest: their supremum.
        p95: their 95th percentile.
        mean: of them all.
    """

    largest: float
    p95: float
    mean: float


@final
@comparable
class SetDistances:
    """How far two sets of points lie apart.

    Attributes:
        there: from the first to the second: large where the first has what the second lacks.
        back: from the second to the first.
    """

    there: Directed
    back: Directed

    @property
    def hausdorff(self) -> float:
        """max(sup inf d, sup inf d), the paper's eq. 3 [Huttenlocher1993]."""
        return max(self.there.largest, self.back.largest)

    @property
    def p95(self) -> float:
        """The larger of both 95th percentiles: a Hausdorff distance that a twentieth of each set cannot spoil."""
        return max(self.there.p95, self.back.p95)

    @property
    def mean(self) -> float:
        """The mean of both means."""
        return 0.5 * (self.there.mean + self.back.mean)


def apart(first: FloatArray, second: FloatArray) -> SetDistances:
    """Measure how far two sets of points lie apart.

    Args:
        first: (n, d) points, such as the middles of the beads of one photograph.
        second: (m, d) points of another.

    Raises:
        InputError: a set is empty, as the distance from nothing is not defined, or the dimensions differ.
    """
    if not (first.size and second.size) or first.shape[1:] != second.shape[1:]:
        raise InputError(
            f"distances need two sets of points with as many coordinates, found {first.shape} and {second.shape}."
        )
    return SetDistances(_directed(first, second), _directed(second, first))


def _directed(source: FloatArray, target: FloatArray) -> Directed:
    distances = np.asarray(KDTree(target).query(source)[0])
    return Directed(float(distances.max()), float(np.percentile(distances, 95.0)), float(distances.mean()))
