"""Polylines in space, such as the paths of any planner before anything is known of the surface that they cover."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model.arrays import FloatArray, IntArray, freeze_arrays
from geoprint.model.surface import check_offsets
from geoprint.model.values import frozen


@final
@frozen
class Polylines:
    """Runs of straight lines from point to point, stored end to end.

    Attributes:
        points: (k, 3) corners, run after run [mm].
        offsets: (r + 1,) run i is `points[offsets[i]:offsets[i + 1]]`; each has two points or more.
    """

    points: FloatArray
    offsets: IntArray

    def __post_init__(self) -> None:
        sizes = freeze_arrays(self, points="float: k 3", offsets="int: o")
        check_offsets(self.offsets, curves=self.count, points=sizes["k"])
        if np.diff(self.offsets).min(initial=2) < 2:
            raise InputError("every run of Polylines needs two points or more.")

    @property
    def count(self) -> int:
        """Number of runs r."""
        return int(self.offsets.size) - 1

    @property
    def runs(self) -> IntArray:
        """(k,) run of each point, from 0."""
        return np.repeat(np.arange(self.count), np.diff(self.offsets))
