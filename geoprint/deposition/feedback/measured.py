"""What was printed and measured along the runs of a print, and within what its flow can be set.

An error of the program is none of the material. What a program deposits on its cell is known before it is printed: its
valve follows late, and lets through more where the tip is slow. So a print is held against what its own program
deposits, as it was executed; what is left is of dispenser and material, and is what the next program can take out.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import PASCAL_PER_KPA, BoolArray, Cell, FloatArray, IntArray, comparable, freeze_arrays, frozen

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
        even: whether one flow is set for the whole print, as a valve does that only opens and shuts.
    """

    least: float
    most: float
    earliest: float
    latest: float
    even: bool = False

    def __post_init__(self) -> None:
        if not (0.0 < self.least <= 1.0 <= self.most < np.inf and min(self.earliest, self.latest) >= 0.0):
            raise InputError(
                f"bounds of a flow are about 1 and those of a valve about 0, found {self.least:g} to {self.most:g} and "
                f"{self.earliest:g} mm earlier to {self.latest:g} mm later."
            )


@final
@frozen
class PrintedProgram:
    """What was printed: a program of r runs on its cell, cut into k parts.

    Attributes:
        plan: name of the bundle.
        part: name of the part's file.
        digest: SHA-256 of that file.
        executed: whether its program was executed; else its paths deposit what they ask for.
        dispenser: what doses on its cell, as `dispenser_of` has it.
        speed: of the print [mm/s].
        opened: by how much the valve was opened earlier than the cell says [mm].
        shut: by how much it was shut earlier than the cell says [mm].
        runs: (r,) of the plan.
        lengths: (r,) [mm].
        middles: (r, 3) of the runs, halfway along them [mm].
        owners: (k,) run of each part.
        factors: (k,) flow that was commanded for each part of a run, over the wanted one.
        deposited: (k,) volume that the program deposits there by the cell's lags and rate, over the wanted one.
    """

    plan: str
    part: str
    digest: str
    executed: bool
    dispenser: Mapping[str, float | str]
    speed: float
    opened: float
    shut: float
    runs: IntArray
    lengths: FloatArray
    middles: FloatArray
    owners: IntArray
    factors: FloatArray
    deposited: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self,
            runs="int: r",
            lengths="float: r",
            middles="float: r 3",
            owners="int: k",
            factors="float: k",
            deposited="float: k",
        )


def dispenser_of(cell: Cell) -> Mapping[str, float | str]:
    """Return what doses on a cell, by the keys of its file: prints of two dispensers say nothing of each other."""
    signals, pressure = cell.signals, cell.process.pressure
    found: dict[str, float | str] = {
        "signals.mode": signals.mode,
        "signals.valve_open_s": signals.valve_open,
        "signals.valve_close_s": signals.valve_close,
        "nozzle.inner_diameter_mm": cell.tool.inner_diameter,
    }
    if signals.mode == "analog":
        found |= {"signals.flow_per_mm3_s": signals.flow_per_mm3_s, "signals.flow_lag_s": signals.flow_lag}
    else:
        found |= {"signals.settle_ms": 1000.0 * signals.settle}
    if pressure is not None:
        found["process.pressure_kpa"] = pressure / PASCAL_PER_KPA
    return {key: value if isinstance(value, str) else round(value, 6) for key, value in found.items()}


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
        deposited: (k,) volume that its program deposits, as it was executed, over the wanted one.
        common: standard deviation of the ratio that all parts share, as that of a scan's height.
        by_run: standard deviation of the ratio that the parts of one run share, as of what lies beside it in a picture.
        scale: standard deviation of how much larger or smaller all deviations from 1 are, over what they are.
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
    deposited: FloatArray
    common: float = 0.0
    by_run: float = 0.0
    scale: float = 0.0
    opened: float = 0.0
    shut: float = 0.0

    def __post_init__(self) -> None:
        freeze_arrays(
            self, runs="int: k", starts="float: k", ends="float: k", seen="bool: k", ratios="float: k",
            deviations="float: k", factors="float: k", deposited="float: k",
        )  # fmt: skip
        same = self.runs[1:] == self.runs[:-1]
        ordered = bool((self.ends > self.starts).all() and (self.starts[1:] >= self.starts[:-1])[same].all())
        if not ordered or np.unique(self.runs).size != 1 + np.count_nonzero(~same):
            raise InputError(
                "parts of runs are given run after run, each from its start to its end; found another order."
            )
        if (
            min(self.common, self.by_run, self.scale) < 0.0
            or (self.deviations < 0.0).any()
            or (self.factors <= 0.0).any()
        ):
            raise InputError(
                "deviations of what was measured are not negative, and flows that were commanded positive."
            )

    @property
    def usable(self) -> BoolArray:
        """(k,) which say something of the flow: seen, no gap, and something was to be there."""
        return self.seen & (self.ratios >= MISSING) & (self.deposited >= MISSING)

    @property
    def errors(self) -> FloatArray:
        """(k,) volume over the wanted one, but for what the program itself does; 0 where nothing is usable."""
        own = np.divide(self.factors, self.deposited, out=np.zeros(self.runs.size), where=self.usable)
        return np.asarray(self.ratios * own)

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
        """Root mean square of how far the volume is off the wanted one, but for what the program does; by length."""
        there = self.usable
        if not there.any():
            return 0.0
        return float(np.sqrt(np.average((self.errors - 1.0)[there] ** 2, weights=self.lengths[there])))
