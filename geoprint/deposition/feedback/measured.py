"""What was measured along the runs of a print, and within what its flow can be set."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, IntArray, comparable, freeze_arrays, frozen

# Less volume than this, over the wanted one, is a gap: no flow mends a valve that is clogged.
MISSING = 0.25


@final
@comparable
class FlowBounds:
    """Within what a cell can change what flows.

    Attributes:
        least: flow over the wanted one; positive, at most 1.
        most: likewise, at least 1.
        earliest: by how much the valve may be commanded earlier [mm of path]; not negative.
        latest: by how much later [mm]; not negative.
    """

    least: float
    most: float
    earliest: float
    latest: float

    def __post_init__(self) -> None:
        if not (0.0 < self.least <= 1.0 <= self.most < np.inf and min(self.earliest, self.latest) >= 0.0):
            raise InputError(
                f"bounds of a flow are about 1 and those of a valve about 0, found {self.least:g} to {self.most:g} and "
                f"{self.earliest:g} mm earlier to {self.latest:g} mm later."
            )


@final
@frozen
class MeasuredRuns:
    """What lies on k parts of runs, in the order in which they were printed.

    Attributes:
        runs: (k,) of the plan.
        starts: (k,) arc length at which each begins [mm].
        ends: (k,) arc length at which it ends [mm].
        seen: (k,) whether it was measured; where not, ratio and deviation are 0.
        ratios: (k,) volume over the wanted one.
        deviations: (k,) standard deviation of that, by what differs from part to part.
        factors: (k,) flow that was commanded for this print, over the wanted one.
        common: standard deviation of the ratio that all parts share, as that of a scan's height.
        opened: by how much the valve was opened earlier than the cell says [mm].
        shut: by how much it was shut earlier than the cell says [mm].
    """

    runs: IntArray
    starts: FloatArray
    ends: FloatArray
    seen: BoolArray
    ratios: FloatArray
    deviations: FloatArray
    factors: FloatArray
    common: float = 0.0
    opened: float = 0.0
    shut: float = 0.0

    def __post_init__(self) -> None:
        freeze_arrays(
            self, runs="int: k", starts="float: k", ends="float: k", seen="bool: k", ratios="float: k",
            deviations="float: k", factors="float: k",
        )  # fmt: skip
        same = self.runs[1:] == self.runs[:-1]
        ordered = bool((self.ends > self.starts).all() and (self.starts[1:] >= self.starts[:-1])[same].all())
        if not ordered or np.unique(self.runs).size != 1 + np.count_nonzero(~same):
            raise InputError(
                "parts of runs are given run after run, each from its start to its end; found another order."
            )
        if self.common < 0.0 or (self.deviations < 0.0).any() or (self.factors <= 0.0).any():
            raise InputError(
                "deviations of what was measured are not negative, and flows that were commanded positive."
            )

    @property
    def usable(self) -> BoolArray:
        """(k,) which tell of the flow: seen, and no gap."""
        return self.seen & (self.ratios >= MISSING)

    @property
    def lengths(self) -> FloatArray:
        """(k,) of the parts [mm]."""
        return self.ends - self.starts

    @property
    def middles(self) -> FloatArray:
        """(k,) arc length of their middles [mm]."""
        return 0.5 * (self.starts + self.ends)

    @property
    def error(self) -> float:
        """Root mean square of how far the volume is off the wanted one, over what is seen; by length."""
        if not self.seen.any():
            return 0.0
        off = (self.ratios - 1.0)[self.seen]
        return float(np.sqrt(np.average(off**2, weights=self.lengths[self.seen])))
