"""Valve, material, lamp and vacuum in time, as a program switches them that was executed.

A program says when or where it switches, and the planned motion of the tip when it is there; the stated lags say when
the material follows. Nothing of this comes from what the writer wanted: only what was executed, the times of the
targets and the motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np

from geoprint.errors import VerificationError
from geoprint.model import FloatArray, Signals, freeze_arrays, frozen
from geoprint.postprocessor.execution import Switched, refusal
from geoprint.postprocessor.orders import Orders, TipsAt

# How far from the ends of a deposit the material may begin and end [mm].
LARGEST_ERROR = 0.5
# How much longer than its lead and tail the lamp may be on without material [s]: a tip at 20 mm/s goes 0.5 mm in it.
LAMP_TOLERANCE = 0.025
# How long it may be dark while there is material, lead or tail [s].
DARK_TOLERANCE = 0.005
# How long valve and vacuum may be on together where one follows the other [s]: the motion is looked at more often.
VACUUM_TOLERANCE = 0.005
# The motion is looked at so often [s].
_STEP = 0.001


@final
@frozen
class Timeline:
    """What flows and shines when: d deposits, l times that the lamp is on.

    Attributes:
        runs: (d,) run of each deposit, from 0.
        deposits: (d, 2) when each deposit begins and ends [s].
        material: (d, 2) when material begins and ends to flow [s].
        lamp: (l, 2) when the lamp is on [s].
        errors: (d, 2) how far from the ends of the deposit the tip is when the material begins and ends [mm].
        lamp_alone: longest time that the lamp is on beyond material, lead and tail [s].
        lamp_dark: longest time that it is not on although there is material, lead or tail [s].
        vacuum: (v, 2) when the vacuum draws material back [s].
        vacuum_against: longest time that it does so while the valve is commanded to be open [s].
    """

    runs: FloatArray
    deposits: FloatArray
    material: FloatArray
    lamp: FloatArray
    errors: FloatArray
    lamp_alone: float
    lamp_dark: float
    vacuum: FloatArray
    vacuum_against: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self, runs="float: d", deposits="float: d 2", material="float: d 2", lamp="float: l 2", errors="float: d 2",
            vacuum="float: v 2",
        )  # fmt: skip


def timeline(switched: Sequence[Switched], orders: Orders, *, signals: Signals, tips_at: TipsAt) -> Timeline:
    """Simulate the outputs of a program that is set to deposit.

    Args:
        switched: what it switches, printing.
        orders: times of the targets and where material is to be deposited.
        signals: names and lags.
        tips_at: the tip's motion as it was timed.

    Raises:
        VerificationError: an output is not switched on and off in turns, but for a lamp that is switched on again, or
            the valve not once each for each deposit.
    """
    valve = _spans(switched, signal=signals.dispenser)
    lamp = _spans(switched, signal=signals.uv_lamp, again=True)
    vacuum = np.empty((0, 2)) if signals.vacuum is None else _spans(switched, signal=signals.vacuum)
    ends = np.array(orders.deposits, dtype=np.int64).reshape(-1, 2)
    deposits = orders.times[ends]
    if len(valve) != len(deposits):
        raise VerificationError(
            f"the valve opens {len(valve)} times, but the plan deposits otherwise ({len(deposits)}). Do not "
            "run this program: write it again from its plan."
        )
    material = valve + np.array([signals.valve_open, signals.valve_close])
    errors = np.linalg.norm(tips_at(material.ravel()) - orders.tips[ends.ravel()], axis=1).reshape(-1, 2)
    wanted = material + np.array([-signals.uv_lead, signals.uv_tail])
    allowed = wanted.copy()
    # The arm that waits for the lamp after the last deposit waits from its end on, which the material may not reach.
    allowed[-1:, 1] = np.maximum(allowed[-1:, 1], deposits[-1:, 1] + signals.uv_tail)
    return Timeline(
        runs=orders.runs[ends[:, 0]].astype(np.float64),
        deposits=deposits,
        material=material,
        lamp=lamp,
        errors=errors,
        lamp_alone=_longest_alone(lamp, allowed),
        lamp_dark=_longest_alone(wanted, lamp),
        vacuum=vacuum,
        vacuum_against=_longest_both(valve, vacuum),
    )


def check_timeline(found: Timeline) -> None:
    """Check that material flows on exactly the deposits under the lamp, and lamp and vacuum are never on for nothing.

    Raises:
        VerificationError: one of them is off by more than allowed.
    """
    if found.errors.max(initial=0.0) > LARGEST_ERROR:
        deposit, end = np.unravel_index(int(found.errors.argmax()), found.errors.shape)
        raise VerificationError(
            f"run {found.runs[deposit] + 1:.0f}: the material {('begins', 'ends')[int(end)]} {found.errors.max():.2f} "
            f"mm from where it should, allowed is {LARGEST_ERROR} mm; measure the lags of [signals], or plan again.",
            run=int(found.runs[deposit]),
            error_mm=float(found.errors.max()),
        )
    if found.lamp_alone > LAMP_TOLERANCE:
        raise VerificationError(
            f"the lamp is on for {found.lamp_alone:.3f} s without material, lead or tail; plan again.",
            seconds=found.lamp_alone,
        )
    if found.lamp_dark > DARK_TOLERANCE:
        raise VerificationError(
            f"the lamp is dark for {found.lamp_dark:.3f} s while material flows, or in its lead or tail; plan again.",
            seconds=found.lamp_dark,
        )
    if found.vacuum_against > VACUUM_TOLERANCE:
        raise VerificationError(
            f"the vacuum draws for {found.vacuum_against:.3f} s while the valve is open; plan again.",
            seconds=found.vacuum_against,
        )


def moment_on(target: int, distance: float, orders: Orders, tips_at: TipsAt, *, from_start: bool) -> float:
    """Return when the tip is somewhere on its move to a target, by the clock of the motion [s].

    Args:
        target: index.
        distance: from the end of the move, or from its start [mm].
        orders: times and places of the targets.
        tips_at: the tip's motion as it was timed.
        from_start: whether the distance counts from the start.
    """
    if target == 0:
        return float(orders.times[0])
    first, last = float(orders.times[target - 1]), float(orders.times[target])
    moments = np.linspace(first, last, max(int(np.ceil((last - first) / _STEP)), 1) + 1)
    origin = orders.tips[target - 1] if from_start else orders.tips[target]
    distances = np.linalg.norm(tips_at(moments) - origin, axis=1)
    if not from_start:
        distances, moments = distances[::-1], moments[::-1]
    return float(np.interp(distance, np.maximum.accumulate(distances), moments))


def _spans(switched: Sequence[Switched], *, signal: str, again: bool = False) -> FloatArray:
    """Return (k, 2) when an output is switched on and off [s]; whether it may be switched on again while it is on."""
    own = sorted((each for each in switched if each.signal == signal.lower()), key=lambda each: each.time)
    own = [each for k, each in enumerate(own) if not (again and k and each.on and own[k - 1].on)]
    for number, each in enumerate(own):
        if each.on != (number % 2 == 0):
            what = f"{signal.lower()} is switched {'on' if each.on else 'off'} although it is so already"
            raise refusal(each.file, each.line, what)
    if len(own) % 2:
        raise refusal(own[-1].file, own[-1].line, f"{signal.lower()} is never switched off again")
    return np.array([each.time for each in own]).reshape(-1, 2)


def _longest_both(some: FloatArray, others: FloatArray) -> float:
    """Return the longest time that one of the (k, 2) and one of the (m, 2) spans have in common [s]."""
    starts = np.maximum(some[:, None, 0], others[None, :, 0])
    return float((np.minimum(some[:, None, 1], others[None, :, 1]) - starts).max(initial=0.0))


def _longest_alone(some: FloatArray, others: FloatArray) -> float:
    """Return the longest stretch of (m, 2) spans that none of (k, 2) others, in their order, covers [s]."""
    longest = 0.0
    for on, off in some.tolist():
        reached = on
        for start, end in others.tolist():
            if start >= off:
                break
            if end <= reached:
                continue
            longest = max(longest, start - reached)
            reached = max(reached, end)
        longest = max(longest, off - reached)
    return longest
