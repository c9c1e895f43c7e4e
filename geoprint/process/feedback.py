"""What a print left along its runs, fed back: the flow of the next one, and when its valve opens and shuts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, TypeAlias, cast, final

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from geoprint.errors import InputError
from geoprint.model import (
    PASCAL_PER_KPA,
    BoolArray,
    Cell,
    FloatArray,
    IntArray,
    Rounded,
    comparable,
    freeze_arrays,
    frozen,
    recorded,
)
from geoprint.threads import single_threaded_blas

# What was printed and measured along the runs of a print, and within what its flow can be set.
#
# An error of the program is none of the material. What a program deposits on its cell is known before it is printed:
# its valve follows late, and lets through more where the tip is slow. So a print is held against what its own
# program deposits, as it was executed; what is left is of dispenser and material, and is what the next program can
# take out.


# Less volume than this, over the wanted one, is a gap: no flow fixes a valve that is clogged.
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
                f"bounds of a flow must enclose 1 and those of a valve 0, found {self.least:g} to {self.most:g}, and "
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


# Which causes measured volumes have, by how much likelier they are with each than without.
#
# The logarithm of volume over the wanted one, but for what the program itself does, is taken as a sum of causes,
# each a Gaussian process of mean zero: a prior that shrinks towards no change, by how unsure the measurement is
# [Rasmussen2006, ch. 2]. A cause comes in where the best of its sizes makes what was measured likelier by
# `SIGNIFICANT`, the strongest one first; so noise alone brings in none.


# Gain of the log-likelihood that a cause needs [nats]: noise alone gives it once in 15 000 times (chi-squared of 16).
SIGNIFICANT = 8.0
# What no measurement of a volume knows better, over it: the shape of a bead, the part of a run that a point belongs to.
KNOWN = 0.005
# Changes along a run are alike over so many parts; the drift over a print over this share of it.
ALIKE_PARTS, ALIKE_SHARE = 3.0, 0.25
# Sizes that are tried (standard deviation): of a flow (logarithm), and of a lag [mm].
FLOWS, LAGS = (0.03, 0.1, 0.3), (0.1, 0.3, 1.0)
CauseName: TypeAlias = Literal["constant", "drift", "along runs", "opening", "shutting"]
CONSTANT, DRIFT, ALONG, OPENING, SHUTTING = "constant", "drift", "along runs", "opening", "shutting"
# What differs from part to part by chance: the next print has its own, and to take that of the last out doubles it.
SCATTER = "scatter"
# What a flow corrects, and what the times of a valve do.
FLOW_CAUSES, VALVE_CAUSES = (CONSTANT, DRIFT, ALONG), (OPENING, SHUTTING)


@final
@frozen
class Cause:
    """A cause of errors.

    Attributes:
        name: of it.
        pattern: (k, k) covariance of what it makes of k parts, for a size of 1.
        size: standard deviation.
        gain: of the log-likelihood, when it came in [nats].
    """

    name: str
    pattern: FloatArray
    size: float
    gain: float

    def __post_init__(self) -> None:
        freeze_arrays(self, pattern="float: k k")

    @property
    def covariance(self) -> FloatArray:
        """(k, k) of what it makes."""
        return self.size**2 * self.pattern


@final
@frozen
class Evidence:
    """What measured volumes say of their causes.

    Attributes:
        causes: that are significant and come again in the next print, the strongest first.
        weights: (k,) by which the covariance of a cause is multiplied to give its mean; 0 where nothing was measured.
        left: (k,) standard deviation of the sum of the causes that stays unknown.
        scatter: standard deviation of what differs from part to part by chance, where that is significant, else 0.
    """

    causes: tuple[Cause, ...]
    weights: FloatArray
    left: FloatArray
    scatter: float

    def __post_init__(self) -> None:
        freeze_arrays(self, weights="float: k", left="float: k")

    def mean(self, *names: str) -> FloatArray:
        """Return (k,) what causes of these names make, as far as is known: the logarithm of the volume."""
        there = [each.covariance @ self.weights for each in self.causes if each.name in names]
        return np.sum(there, axis=0) if there else np.zeros(self.weights.size)


def evidence_of(measured: MeasuredRuns) -> Evidence:
    """Return the causes of what was measured that are significant."""
    # Matrices of a few hundred rows: threads wait longer for each other than they work, and sum in another order.
    with single_threaded_blas():
        return _significant(measured)


def first_and_last(measured: MeasuredRuns) -> tuple[FloatArray, FloatArray]:
    """Return (k,) what a millimetre by which runs begin later, and end later, makes of the volume of their parts.

    It is a share of a run's first or last part, negative and positive; 0 elsewhere.
    """
    new = np.append(True, measured.runs[1:] != measured.runs[:-1])
    old = np.append(new[1:], True)
    return np.where(new, -1.0 / measured.lengths, 0.0), np.where(old, 1.0 / measured.lengths, 0.0)


def _significant(measured: MeasuredRuns) -> Evidence:
    used = np.flatnonzero(measured.usable)
    seen = np.log(measured.errors[used])
    own = measured.deviations[used] / measured.ratios[used]
    same = measured.runs[used, None] == measured.runs[used]
    noise = np.diag(own**2 + KNOWN**2) + measured.by_run**2 * same + measured.common**2
    patterns = _patterns(measured)
    causes: list[Cause] = []
    covariance, reached = noise, _likelihood(seen, noise)
    while used.size:
        tried = [
            Cause(name, pattern, size, _likelihood(seen, covariance + size**2 * pattern[np.ix_(used, used)]) - reached)
            for name, (pattern, sizes) in patterns.items()
            if name not in {cause.name for cause in causes}
            for size in sizes
        ]
        best = max(tried, key=lambda cause: cause.gain, default=None)
        if best is None or best.gain < SIGNIFICANT:
            break
        causes.append(best)
        covariance = covariance + best.covariance[np.ix_(used, used)]
        reached += best.gain
    return _known(tuple(causes), seen, covariance, used=used, count=measured.runs.size)


def _patterns(measured: MeasuredRuns) -> dict[str, tuple[FloatArray, tuple[float, ...]]]:
    """Return the pattern of each cause, and its sizes."""
    first, last = first_and_last(measured)
    reached = np.cumsum(measured.lengths) - 0.5 * measured.lengths
    apart = np.abs(reached[:, None] - reached)
    alike = ALIKE_PARTS * float(measured.lengths.mean())
    same = measured.runs[:, None] == measured.runs
    return {
        CONSTANT: (np.ones_like(apart), FLOWS),
        OPENING: (np.outer(first, first), LAGS),
        SHUTTING: (np.outer(last, last), LAGS),
        DRIFT: (np.exp(-apart / (ALIKE_SHARE * float(measured.lengths.sum()))), FLOWS),
        ALONG: (np.where(same, np.exp(-apart / alike), 0.0), FLOWS),
        SCATTER: (np.eye(apart.shape[0]), FLOWS),
    }


def _likelihood(seen: FloatArray, covariance: FloatArray) -> float:
    """Return the log-likelihood but for a constant."""
    if not seen.size:
        return 0.0
    factor = cho_factor(covariance, lower=True)
    return -0.5 * float(seen @ cho_solve(factor, seen)) - float(np.log(np.diag(factor[0])).sum())


def _known(
    causes: tuple[Cause, ...], seen: FloatArray, covariance: FloatArray, *, used: IntArray, count: int
) -> Evidence:
    """Return what is known of the sum of causes once they are chosen."""
    weights, left = np.zeros(count), np.zeros(count)
    scatter = sum(cause.size for cause in causes if cause.name == SCATTER)
    causes = tuple(cause for cause in causes if cause.name != SCATTER)
    if not causes:
        return Evidence(causes, weights, left, scatter)
    factor = cho_factor(covariance, lower=True)
    weights[used] = cho_solve(factor, seen)
    together: FloatArray = np.sum([cause.covariance for cause in causes], axis=0)
    solved: FloatArray = cho_solve(factor, together[used])
    record = (together[:, used] * solved.T).sum(axis=1)
    return Evidence(causes, weights, np.sqrt(np.maximum(np.diag(together) - record, 0.0)), scatter)


# The correction that follows from what was measured: flow along runs, and when the valve opens and shuts.
#
# What is significant of a print is taken out of the next one, on top of what was commanded already, within bounds.
# Where nothing is, all stays as it was commanded.


@final
@recorded("ChangeRecord", name="cause")
class FlowChange:
    """A cause of errors that is taken out.

    Attributes:
        name: cause of the errors: constant, drift, along runs, opening or shutting.
        least: least error by the cause: volume over the wanted one; of opening and shutting their delay in mm.
        most: largest error by the cause: volume over the wanted one; of opening and shutting their delay in mm.
        gain: gain of the log-likelihood by taking the cause into account [nats].
    """

    name: CauseName
    least: Rounded
    most: Rounded
    gain: Rounded


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
        gaps: parts with hardly any material, which no flow fixes.
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
        least, most = float(made.min()), float(made.max())
    else:
        least = most = _lag(evidence, measured, name)
    return FlowChange(cast("CauseName", name), least, most, gain)


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
