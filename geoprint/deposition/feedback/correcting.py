"""The correction that follows from what was measured: flow along runs, and when the valve opens and shuts.

What is significant of a print is taken out of the next one, on top of what was commanded already, within bounds. Where
nothing is, all stays as it was commanded.
"""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.deposition.feedback.evidence import (
    FLOW_CAUSES,
    OPENING,
    SHUTTING,
    Evidence,
    evidence_of,
    first_and_last,
)
from geoprint.deposition.feedback.measured import FlowBounds, MeasuredRuns
from geoprint.model import FloatArray, IntArray, comparable, freeze_arrays, frozen


@final
@comparable
class FlowChange:
    """A cause of errors that is taken out.

    Attributes:
        name: constant, drift, along runs, opening or shutting.
        least: of what it made: volume over the wanted one, or of opening and shutting how late they are [mm].
        most: likewise.
        gain: of the log-likelihood [nats].
    """

    name: str
    least: float
    most: float
    gain: float


@final
@frozen
class Correction:
    """What the next print changes.

    Attributes:
        runs: (k,) of parts of runs.
        middles: (k,) arc length of their middles [mm].
        factors: (k,) flow to command, over the wanted one, within the bounds.
        opening: by how much earlier than the cell says the valve opens [mm].
        shutting: by how much earlier it shuts [mm].
        changes: causes that are taken out; none where nothing is significant.
        gaps: parts with hardly any material, which no flow mends.
        bounded: parts at which a bound holds the flow.
        found: root mean square error of the volume that was measured, over the wanted one.
        expected: what of that is expected of the next print, by the causes that are known.
    """

    runs: IntArray
    middles: FloatArray
    factors: FloatArray
    opening: float
    shutting: float
    changes: tuple[FlowChange, ...]
    gaps: int
    bounded: int
    found: float
    expected: float

    def __post_init__(self) -> None:
        freeze_arrays(self, runs="int: k", middles="float: k", factors="float: k")

    def at(self, runs: IntArray, arcs: FloatArray) -> FloatArray:
        """Return the (p,) factor of the flow at places of runs: straight between middles of parts, even at ends.

        Args:
            runs: (p,) that each place is of; of a run that has no parts the factor is 1.
            arcs: (p,) arc length from its start [mm].
        """
        result = np.ones(runs.size)
        for number in np.unique(self.runs).tolist():
            own, there = self.runs == number, runs == number
            result[there] = np.interp(arcs[there], self.middles[own], self.factors[own])
        return result


def corrected(measured: MeasuredRuns, *, bounds: FlowBounds) -> Correction:
    """Return the correction of a print, from what was measured of it.

    Args:
        measured: along its runs.
        bounds: of the cell.
    """
    evidence = evidence_of(measured)
    wanted = measured.factors * np.exp(-evidence.mean(*FLOW_CAUSES))
    # One flow for all: the volume of the whole print is right.
    within = np.full_like(wanted, 1.0 / np.average(1.0 / wanted, weights=measured.lengths)) if bounds.even else wanted
    held = np.clip(within, bounds.least, bounds.most)
    factors = held if evidence.causes else measured.factors
    late, long = _lag(evidence, measured, OPENING), _lag(evidence, measured, SHUTTING)
    opening, shutting = (
        float(np.clip(before + lag, -bounds.latest, bounds.earliest))
        for before, lag in ((measured.opened, late), (measured.shut, long))
    )
    return Correction(
        runs=measured.runs,
        middles=measured.middles,
        factors=factors,
        opening=opening,
        shutting=shutting,
        changes=tuple(_change(evidence, measured, each.name, each.gain) for each in evidence.causes),
        gaps=int((measured.seen & ~measured.usable).sum()),
        bounded=int((held != within).sum()) if evidence.causes else 0,
        found=measured.error,
        expected=_expected(evidence, measured, np.log(factors / wanted)),
    )


def _lag(evidence: Evidence, measured: MeasuredRuns, name: str) -> float:
    """Return by how much the valve is late at one end of the runs [mm]."""
    first, last = first_and_last(measured)
    side = first if name == OPENING else last
    sizes = [cause.size for cause in evidence.causes if cause.name == name]
    return float(sum(size**2 * float(side @ evidence.weights) for size in sizes))


def _change(evidence: Evidence, measured: MeasuredRuns, name: str, gain: float) -> FlowChange:
    if name in FLOW_CAUSES:
        made = np.exp(evidence.mean(name))
        return FlowChange(name, float(made.min()), float(made.max()), gain)
    lag = _lag(evidence, measured, name)
    return FlowChange(name, lag, lag, gain)


def _expected(evidence: Evidence, measured: MeasuredRuns, held: FloatArray) -> float:
    """Return the error that is expected of the next print: what stays unknown of the causes, and what bounds hold."""
    if not evidence.causes:
        return measured.error
    there = measured.usable
    if not there.any():
        return 0.0
    scaled = measured.scale * evidence.mean(*FLOW_CAUSES)
    unknown = evidence.left**2 + held**2 + evidence.scatter**2 + scaled**2
    return float(np.sqrt(np.average(unknown[there], weights=measured.lengths[there])))
