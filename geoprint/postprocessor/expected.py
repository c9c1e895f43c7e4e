"""What targets and switching of a program must be, for whoever checks one: by deposits, motion and lags alone."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from geoprint.errors import VerificationError
from geoprint.model import FloatArray, Signals
from geoprint.postprocessor.orders import Event, Orders, Output, TipsAt

# Moves shorter than this [mm] turn the tool; the tip's speed means nothing there.
TURN_ON_THE_SPOT = 1e-3
# The largest zone that is asked for, and how much higher the path is driven dry [mm].
LARGEST_ZONE, LIFT = 0.3, 20.0
# Joints from the inverse agree with those of the trajectory between its rows to this [rad], and by so much more for
# each mm that a target stands outside of a bend.
JOINT_TOLERANCE, JOINTS_PER_MM = 1e-3, 0.03


def largest_zones(orders: Orders) -> FloatArray:
    """Return (t,) the zone of each target by its neighbours and runs alone [mm]."""
    distances = np.linalg.norm(np.diff(orders.tips, axis=0), axis=1)
    nearer = np.minimum(np.append(distances, 0.0), np.append(0.0, distances))
    borders = np.diff(orders.runs) != 0
    stops = np.append(borders, np.True_) | np.append(np.True_, borders)
    return np.where(stops | (nearer < TURN_ON_THE_SPOT), 0.0, np.minimum(nearer / 2.0, LARGEST_ZONE))


def corner_middles(orders: Orders) -> FloatArray:
    """Return (t, 3) the middle of the parabola about each target, with the zone that its neighbours give [mm].

    Where a deposit begins or ends at rest there is none.
    """
    steps = np.diff(orders.tips, axis=0)
    along = steps / np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), TURN_ON_THE_SPOT)
    at_rest = (np.diff(orders.deposited.astype(np.int8), prepend=0) != 0) & (orders.zones == 0.0)
    zones = np.where(at_rest, 0.0, largest_zones(orders))[1:-1, None]
    entries, exits = orders.tips[1:-1] - zones * along[:-1], orders.tips[1:-1] + zones * along[1:]
    middles = orders.tips.copy()
    middles[1:-1] = (entries + 2.0 * orders.tips[1:-1] + exits) / 4.0
    return middles


def joint_tolerances(orders: Orders) -> FloatArray:
    """Return (t,) how far joints at the targets may be off those of the trajectory as it passes them [rad]."""
    beside = np.linalg.norm(corner_middles(orders) - orders.tips, axis=1)
    return JOINT_TOLERANCE + JOINTS_PER_MM * beside


# The writer has its own words for this (`postprocessor.switching`), and nothing here is made of them: a fault in one of
# the two shows as a difference. The rule is stated once, for both:
#
# - Where an output makes the flow follow the speed, material is wanted from the first to the last target of a deposit.
#   A valve that only opens and shuts lets the same volume through in every second: its material begins so much later,
#   and ends so much sooner, as the tip on its ramp falls behind one that has its speed at once.
# - The valve is commanded so much before as it lags. The lamp is lit from its lead before the material to its tail
#   behind it, without a pause where these overlap; each run lights it anew, so that printing can begin there. The
#   vacuum draws whenever the valve is commanded to be shut between two runs, and until the path ends.
# - The arm waits where each deposit begins, while a flow settles that is not even at once, and no ramp is taken off
#   there; and at the lift behind the last deposit, where the lamp has to shine longer than that took. That is the first
#   rest, or where a deposit ends in motion the second, behind the end of its lead-out. In the motion's own time, which
#   these times are, waits take none: what begins with a wait is switched on the move before it, what ends with it on
#   the move behind it.
# - A switching that falls on a target is made there, else on the move during which it is due.


# Moments nearer than this are one [s].
_INSTANT = 1e-4
# A ramp is looked at so often, and for so long at most [s].
_SAMPLE, _LONGEST_RAMP = 0.004, 0.152
# It is over at this share of the print's speed, or where the speed rises by less than as much from sample to sample.
_AT_SPEED = 0.99
# The valve waits no longer than the print takes for this [mm].
_LONGEST_WAIT = 1.0
# When which output is switched on, or off.
_Due: TypeAlias = tuple[float, Output, bool]


def expected_events(orders: Orders, *, signals: Signals, tips_at: TipsAt, speed: float) -> tuple[Event, ...]:
    """Return where the outputs must switch, in the order of the path.

    Args:
        orders: targets and their times.
        signals: mode and lags.
        tips_at: the tip's motion as it was timed.
        speed: of the print [mm/s].

    Raises:
        VerificationError: a lag is longer than the motion that is there for it, or the arm has to wait where it does
            not rest.
    """
    rests = expected_waits(orders, signals)
    passed = np.flatnonzero((rests > 0.0) & (orders.zones > 0.0))
    if passed.size:
        raise VerificationError(
            f"target {passed[0] + 1}: the arm has to wait there for {rests[passed[0]]:.2f} s, but the plan passes it "
            f"with a zone of {orders.zones[passed[0]]:g} mm; plan again."
        )
    material = _material(orders, signals, tips_at, speed=speed)
    valve = material - np.array([signals.valve_open, signals.valve_close])
    lamp = material + np.array([-signals.uv_lead, signals.uv_tail])
    if (shining := np.flatnonzero(rests * ~orders.deposited)).size:
        lamp[-1, 1] = orders.times[shining[0]]
    _check_room(orders, signals, material=material, valve=valve, lamp=lamp)
    shut = np.column_stack([valve[:, 1], np.append(valve[1:, 0], orders.times[-1])])
    # Of what switches on the same move, in the order in which a program names it.
    due = [
        *_in_turns(valve, "dispenser"),
        *(() if signals.vacuum is None else _in_turns(shut, "vacuum")),
        *_lit(material, lamp),
    ]
    tips = tips_at(np.array([moment for moment, _, _ in due]))
    events = [_on_path(orders, each, tip=tip, rests=rests) for each, tip in zip(due, tips, strict=True)]
    return tuple(sorted(events, key=lambda event: (event.target, not event.from_start)))


def expected_waits(orders: Orders, signals: Signals) -> FloatArray:
    """Return (t,) how long the arm has to wait at each target [s].

    Args:
        orders: targets and their times.
        signals: lags.
    """
    begins = orders.deposited & ~np.insert(orders.deposited[:-1], 0, np.False_)
    rests = np.where(begins, signals.settle, 0.0)
    ends = 1 + int(np.flatnonzero(orders.deposited)[-1]) if begins.any() else orders.count
    still = np.flatnonzero((orders.zones == 0.0) & (np.arange(orders.count) > ends))[:-1]
    if begins.any() and orders.zones[ends] > 0.0:
        still = still[1:]
    if still.size:
        rests[still[0]] = np.clip(signals.uv_tail - (orders.times[still[0]] - orders.times[ends]), 0.0, None)
    return rests


def _in_turns(spans: FloatArray, output: Output) -> Iterator[_Due]:
    """Yield the switching of an output that is on during (k, 2) spans [s]."""
    for begins, ends in spans.tolist():
        yield begins, output, True
        yield ends, output, False


def _material(orders: Orders, signals: Signals, tips_at: TipsAt, *, speed: float) -> FloatArray:
    """Return (d, 2) when material is to begin and end to flow [s]."""
    spans: FloatArray = orders.times[np.array(orders.deposits, dtype=np.int64).reshape(-1, 2)]
    if signals.mode == "analog":
        return spans
    waits = [
        [_wait(tips_at, begin, sign=1.0, half=(end - begin) / 2.0, speed=speed),
         -_wait(tips_at, end, sign=-1.0, half=(end - begin) / 2.0, speed=speed)]
        for begin, end in spans.tolist()
    ]  # fmt: skip
    if signals.settle > 0.0:
        waits = [[0.0, wait] for _, wait in waits]
    return spans + np.array(waits).reshape(-1, 2)


def _wait(tips_at: TipsAt, end: float, *, sign: float, half: float, speed: float) -> float:
    """Return how long the valve waits at one end of a deposit, which lasts twice as long as `half` [s]."""
    samples = int(np.floor(min(_LONGEST_RAMP, half) / _SAMPLE + 0.5)) + 1
    since: FloatArray = _SAMPLE * np.arange(samples, dtype=np.float64)
    way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(tips_at(end + sign * since), axis=0), axis=1)))
    if way[-1] == 0.0:
        return 0.0
    speeds = np.diff(way) / _SAMPLE
    rising = np.append(speeds[:-1] < _AT_SPEED * speeds[1:], np.False_)
    up = np.flatnonzero((speeds > 0.0) & ((speeds >= _AT_SPEED * speed) | ~rising))
    top = int(up[0])
    # Where it rises until the middle of the run, the run is too short for the speed of the print.
    held = speed if top == speeds.size - 1 else min(float(speeds[top]), speed)
    return min(max(float(since[top] - way[top] / held), 0.0), _LONGEST_WAIT / speed)


def _lit(material: FloatArray, lamp: FloatArray) -> Iterator[_Due]:
    """Yield when the lamp is switched."""
    last = len(lamp) - 1
    for run, (begins, ends) in enumerate(lamp.tolist()):
        before = -np.inf if run == 0 else float(material[run - 1, 1])
        yield max(begins, before), "uv_lamp", True
        if run == last or float(lamp[run + 1, 0]) - ends > _INSTANT:
            yield ends, "uv_lamp", False


def _check_room(orders: Orders, signals: Signals, *, material: FloatArray, valve: FloatArray, lamp: FloatArray) -> None:
    """Check that each lag has motion to fall on."""
    begin, end = float(orders.times[0]), float(orders.times[-1])
    for (first, last), (opens, shuts) in zip(material.tolist(), valve.tolist(), strict=True):
        if shuts <= opens:
            raise VerificationError(
                f"signals.valve_close_s is {signals.valve_close:g} s, but a run at {first:.1f} s takes only "
                f"{last - first:.2f} s: the valve would close before it opens; plan again."
            )
    since = np.append(begin, material[:-1, 1])
    early = np.flatnonzero(valve[:, 0] < since - _INSTANT)
    if early.size:
        raise VerificationError(
            f"signals.valve_open_s is {signals.valve_open:g} s, but the approach to the run at "
            f"{material[early[0], 0]:.1f} s takes {material[early[0], 0] - since[early[0]]:.2f} s. The valve would "
            "open in the previous run: plan again."
        )
    if lamp[0, 0] < begin - _INSTANT or lamp[-1, 1] > end + _INSTANT:
        raise VerificationError(
            f"signals.uv_lead_s and uv_tail_s are {signals.uv_lead:g} and {signals.uv_tail:g} s, longer than the first "
            "approach or the last retract; plan again."
        )


def _on_path(orders: Orders, due: _Due, *, tip: FloatArray, rests: FloatArray) -> Event:
    """Return the move that switches at a moment, and where on it: on from a target on, off up to one."""
    moment, output, on = due
    times = orders.times
    behind = int(np.searchsorted(times, moment))
    near = min((k for k in (behind - 1, behind) if 0 <= k < times.size), key=lambda k: abs(float(times[k]) - moment))
    if abs(float(times[near]) - moment) > _INSTANT:
        left, whole = (float(np.linalg.norm(orders.tips[behind] - each)) for each in (tip, orders.tips[behind - 1]))
        return Event(behind, min(left, whole), from_start=False, output=output, on=on)
    leaves = on
    if rests[near] > 0.0:
        # Of a settling flow what begins, of a lamp at the lift what ends.
        leaves = not on and not orders.deposited[near]
    if leaves or near == 0:
        leaving = int(np.searchsorted(times, float(times[near]) + _INSTANT))
        return Event(leaving, 0.0, from_start=True, output=output, on=on)
    return Event(near, 0.0, from_start=False, output=output, on=on)
