"""Where on the path the outputs switch, so that what lags behind them happens where the plan wants it.

The valve is told to open so long before the material has to flow as it takes to open, and to close likewise. A valve
that only opens and shuts would give a run too much that begins or ends at rest, while the tip comes up to its speed and
while it brakes: material begins and ends by so much nearer to the middle of the run that the volume on these ramps is
right in sum; with a lead-in and a lead-out as long as the ramps that is nothing. The lamp
leads and trails the material. Where the cell has a vacuum, it draws the material back from when the valve is told to
close until it is told to open again, or the last lift ends, so that nothing oozes on travel. A flow that has to settle
does so while the arm waits at the start of the run: it is even when the tip begins to move, and no ramp is taken off
there. Where the lamp has to shine longer than the last lift takes, the arm waits at its end (`waits`). All times are
those of the motion, which has no waits: what is due in one is switched before it, or where it ends. Each moment is
turned into a place: the move on which the trajectory is at that moment, and the distance of the tip from the end of
that move. A place is what `TriggIO` switches at, in step with the robot's own motion. Its form by time is not used,
because it counts from the end of a move only and cannot reach beyond the braking there; nor is `TriggEquip`, whose lag
is a time that the controller turns into a place by itself, while here the trajectory says where the tip is then, on its
ramps too. How exactly a controller switches near a stop is to be measured on it, and belongs into the lags of the cell.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from geoprint.errors import UsageError
from geoprint.model import FloatArray, Signals
from geoprint.postprocessor.orders import Event, Orders, Output, TipsAt
from geoprint.robot.timing import ramp_delays

# A moment nearer than this to that of a target [s] is that of the target: a tenth of what a controller resolves.
SAME_MOMENT = 1e-4


def switching_events(orders: Orders, *, signals: Signals, tips_at: TipsAt, speed: float) -> tuple[Event, ...]:
    """Return where the outputs switch, in the order of the path.

    Where the lamp would go off after the next material already wants it on, it stays on. Every output that a run needs
    is switched on by a move of that run, so that printing can begin at any run.

    Args:
        orders: targets and their times.
        signals: the lags.
        tips_at: the tip's motion as it was timed.
        speed: of the print [mm/s].

    Raises:
        UsageError: a lag is longer than the motion that is there for it.
    """
    moments = _moments(orders, signals, tips_at, speed=speed)
    tips = tips_at(np.array([moment for moment, _, _ in moments]))
    waiting = waits(orders, signals)
    events = [
        _placed(orders, moment, tip, waiting, output=output, on=on)
        for (moment, output, on), tip in zip(moments, tips, strict=True)
    ]
    return tuple(sorted(events, key=lambda event: (event.target, not event.from_start)))


def waits(orders: Orders, signals: Signals) -> FloatArray:
    """Return (t,) how long the arm waits at each target [s]: for a flow to settle, at the last lift for the lamp."""
    waiting = np.zeros(orders.count)
    waiting[[first for first, _ in orders.deposits]] = signals.settle
    lifted = _lifted(orders)
    if lifted is not None:
        since = float(orders.times[lifted] - orders.times[orders.deposits[-1][1]])
        waiting[lifted] = max(signals.uv_tail - since, 0.0)
    return waiting


def _lifted(orders: Orders) -> int | None:
    """Return the target behind the last deposit, and its lead-out, where the arm rests lifted, or None without any."""
    ended = orders.deposits[-1][1] if orders.deposits else orders.count - 1
    rests = ended + 1 + np.flatnonzero(orders.zones[ended + 1 : -1] == 0.0)
    # What ends in motion rests first where its lead-out ends.
    rests = rests[int(orders.zones[ended] > 0.0) :]
    return int(rests[0]) if rests.size else None


def _moments(orders: Orders, signals: Signals, tips_at: TipsAt, *, speed: float) -> list[tuple[float, Output, bool]]:
    """Return time, output and value of each switching."""
    spans = [(float(orders.times[first]), float(orders.times[last])) for first, last in orders.deposits]
    flowing = spans if signals.mode == "analog" else [_within_ramps(span, tips_at, speed=speed) for span in spans]
    if signals.settle > 0.0:
        flowing = [(start, end) for (start, _), (_, end) in zip(spans, flowing, strict=True)]
    valve = [(start - signals.valve_open, end - signals.valve_close) for start, end in flowing]
    lamp = [(start - signals.uv_lead, end + signals.uv_tail) for start, end in flowing]
    lifted = _lifted(orders)
    if lifted is not None and waits(orders, signals)[lifted] > 0.0:
        lamp[-1] = (lamp[-1][0], float(orders.times[lifted]))
    _check_spans(orders, signals, spans=flowing, valve=valve, lamp=lamp)
    outputs: list[tuple[Output, list[tuple[float, float]]]] = [("dispenser", valve)]
    if signals.vacuum is not None:
        openings = [*(opens for opens, _ in valve[1:]), float(orders.times[-1])]
        outputs.append(("vacuum", [(closes, opens) for (_, closes), opens in zip(valve, openings, strict=True)]))
    switched: list[tuple[float, Output, bool]] = [
        (moment, output, on)
        for output, pairs in outputs
        for pair in pairs
        for moment, on in zip(pair, (True, False), strict=True)
    ]
    return switched + _lamp_moments(flowing, lamp)


def _within_ramps(span: tuple[float, float], tips_at: TipsAt, *, speed: float) -> tuple[float, float]:
    """Return when material that flows evenly begins and ends, so that the ramps of a run do not get too much [s]."""
    begins, ends = ramp_delays(span, tips_at, speed=speed)
    return span[0] + begins, span[1] - ends


def _lamp_moments(
    spans: list[tuple[float, float]], lamp: list[tuple[float, float]]
) -> list[tuple[float, Output, bool]]:
    """Return the switching of the lamp: on for every deposit and after the one before, off where it does not stay on.

    It is switched on again where it is on already, so that it also shines for whoever begins to print at that run.
    """
    ends = [-np.inf, *(end for _, end in spans[:-1])]
    following = [*(start for start, _ in lamp[1:]), np.inf]
    moments: list[tuple[float, Output, bool]] = []
    for (start, end), before, after in zip(lamp, ends, following, strict=True):
        moments.append((max(start, before), "uv_lamp", True))
        if after - end > SAME_MOMENT:
            moments.append((end, "uv_lamp", False))
    return moments


def _check_spans(
    orders: Orders,
    signals: Signals,
    *,
    spans: list[tuple[float, float]],
    valve: list[tuple[float, float]],
    lamp: list[tuple[float, float]],
) -> None:
    for (start, end), (opens, closes) in zip(spans, valve, strict=True):
        if closes <= opens:
            raise UsageError(
                f"signals.valve_close_s is {signals.valve_close:g} s, but a run at {start:.1f} s takes only "
                f"{end - start:.2f} s: the valve would close before it opens. Omit such short runs with a wider "
                "spacing, or print slower."
            )
    for (_, end), (start, _) in pairwise([(0.0, float(orders.times[0])), *spans]):
        if start - signals.valve_open < end - SAME_MOMENT:
            raise UsageError(
                f"signals.valve_open_s is {signals.valve_open:g} s, longer than the approach to a run at {start:.1f} "
                "s: the valve would open in the previous run. Raise retract_mm or lower travel_speed_mm_s."
            )
    if lamp[0][0] < orders.times[0] - SAME_MOMENT or lamp[-1][1] > orders.times[-1] + SAME_MOMENT:
        raise UsageError(
            f"signals.uv_lead_s and uv_tail_s are {signals.uv_lead:g} and {signals.uv_tail:g} s, but the first "
            f"approach takes {spans[0][0] - orders.times[0]:.2f} s and the last retract "
            f"{orders.times[-1] - spans[-1][1]:.2f} s. Shorten them, or raise retract_mm."
        )


def _placed(orders: Orders, moment: float, tip: FloatArray, waiting: FloatArray, *, output: Output, on: bool) -> Event:
    """Turn a moment into a place on a move; at a target, on the move that leaves it, or for switching off, arrives.

    Where the arm waits it is the other way round: what is switched on shines or flows in the wait, and the lamp that it
    waits for goes off behind it.
    """
    nearest = int(np.argmin(np.abs(orders.times - moment)))
    if abs(float(orders.times[nearest]) - moment) <= SAME_MOMENT:
        waits_for_it = waiting[nearest] > 0.0 and (on or output == "uv_lamp")
        at_start = on != waits_for_it or nearest == 0
        following = int(np.searchsorted(orders.times, float(orders.times[nearest]) + SAME_MOMENT))
        target = following if at_start else nearest
        return Event(target, 0.0, from_start=at_start, output=output, on=on)
    target = int(np.searchsorted(orders.times, moment))
    distance = float(np.linalg.norm(orders.tips[target] - tip))
    length = float(np.linalg.norm(orders.tips[target] - orders.tips[target - 1]))
    return Event(target, min(distance, length), from_start=False, output=output, on=on)
