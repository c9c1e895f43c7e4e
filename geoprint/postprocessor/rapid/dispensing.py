"""What an executed program commands along its path, in time: where its tip is, and what it tells valve and flow.

The machine says when each move to a target begins and ends, by the speeds in the program, and when an output is told
something. Ramps no speed data hold: within a move the tip goes as it was timed, stretched or shortened to the time that
the program gives the move, and shifted with the targets that it names. For a program that does as planned that is the
planned motion; of one that somebody has changed it shows the change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from geoprint import transforms
from geoprint.errors import VerificationError, how_many
from geoprint.model import Dispensing, FloatArray, IntArray, Placement, Signals
from geoprint.postprocessor.execution import Switched
from geoprint.postprocessor.orders import Orders, TipsAt, dispensing_along
from geoprint.postprocessor.rapid.executed import move_times
from geoprint.postprocessor.rapid.language.syntax import Place, refuse
from geoprint.postprocessor.rapid.machine import Switching
from geoprint.postprocessor.rapid.made import Made
from geoprint.postprocessor.timeline import moment_on

# The motion is looked at so often [s].
_STEP = 0.001
# Moves shorter than this turn the tool on the spot [mm].
_ON_THE_SPOT = 1e-6


def dispensing_of(made: Made, orders: Orders, *, signals: Signals, placement: Placement, tips_at: TipsAt) -> Dispensing:
    """Return where the tip of a program is when, and what it commands.

    Args:
        made: what it did, printing.
        orders: the targets of its plan.
        signals: names of the outputs, and what the flow's value means.
        placement: where the part stands; where nobody knows, targets count in the work object.
        tips_at: the tip's motion as it was timed.

    Raises:
        VerificationError: it has not as many targets as its plan, so that nobody knows the ramps of its moves, or
            sets a flow that does not follow the speed.
    """
    if made.count != orders.count:
        raise VerificationError(
            f"the program moves to {how_many(made.count, 'target')} along its path, targets.csv has {orders.count}. "
            "Timing is known only for planned moves: restore them, or plan again.",
            targets=made.count,
            planned=orders.count,
        )
    valve_name = signals.dispenser.lower()
    moves, shares = _moments(orders.times)
    begins, ends = _clock(made)
    times = begins[moves] + shares * (ends - begins)[moves]
    tips = _tips(made, orders, moves, shares, placement=placement, tips_at=tips_at)
    runs = made.runs[moves] - 1
    starts = np.searchsorted(moves, np.arange(orders.count + 1))

    def moment(each: Switching) -> float:
        """Return when an output is told something, by the motion of the move that carries it."""
        row = int(np.searchsorted(made.rows, each.move))
        if each.move < 0 or row == 0 or row >= made.count or made.rows[row] != each.move:
            return _by_clock(made, each.time, begins, ends)
        own = slice(starts[row], starts[row + 1])
        return _passed(each, times[own], tips[own])

    valve = sorted((moment(each), each.value > 0.0) for each in made.execution.switchings if each.signal == valve_name)
    flow = sorted(_flows(made, moment, signals=signals, until=float(times[-1])))
    return dispensing_along(orders, times=times, tips=tips, moves=moves, runs=runs, valve=valve, flow=flow)


def switched_of(made: Made, orders: Orders, *, tips_at: TipsAt) -> tuple[Switched, ...]:
    """Return what a program switches along its path, target by target; flows are left out.

    The machine says at which place of which move an output switches; no speed data hold the ramps of the tip, which the
    planned motion has.

    Args:
        made: what it did, printing.
        orders: times of the targets.
        tips_at: the tip's motion as it was timed.
    """
    moves = made.execution.moves
    # What switches at a move's start does so behind the wait before it, of which the motion's own time knows nothing.
    waited = np.append(0.0, moves.begins[made.rows[1:]] - moves.ends[made.rows[:-1]])
    return tuple(
        Switched(
            moment_on(target, each.distance, orders, tips_at, from_start=each.from_start)
            + float(waited[target]) * each.from_start,
            each.signal,
            each.value > 0.0,
            each.file,
            each.line,
        )
        for target, some in sorted(made.switchings.items())
        for each in some
        if not each.flow
    )


def _moments(times: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return target that each moment's move leads to, and the share of the move's time that has passed, both (k,).

    Each move has both of its ends, so that a rest between two moves is a time in which nothing moves.
    """
    counts = np.maximum(np.ceil(np.diff(times) / _STEP), 1.0).astype(np.int64) + 1
    moves = np.repeat(np.arange(1, times.size), counts)
    ranks = np.arange(moves.size) - np.repeat(np.cumsum(counts) - counts, counts)
    return moves, ranks / np.repeat(counts - 1, counts)


def _clock(made: Made) -> tuple[FloatArray, FloatArray]:
    """Return (t,) when the move to each target begins and ends: as executed, but sooner where corners are rounded."""
    moves = made.execution.moves
    rests = np.maximum(moves.begins[made.rows][1:] - moves.ends[made.rows][:-1], 0.0)
    first, took = float(moves.ends[made.rows][0]), move_times(made)
    ends = first + np.concatenate([[0.0], np.cumsum(rests + took)])
    return np.concatenate([moves.begins[made.rows][:1], ends[1:] - took]), ends


def _by_clock(made: Made, time: float, begins: FloatArray, ends: FloatArray) -> float:
    """Return when the program does by itself what it does at a time of the machine."""
    moves = made.execution.moves
    there = np.column_stack([moves.begins[made.rows], moves.ends[made.rows]]).ravel()
    here = np.column_stack([begins, ends]).ravel()
    beyond = max(time - float(there[-1]), 0.0) + min(time - float(there[0]), 0.0)
    return float(np.interp(time, there, here)) + beyond


def _tips(
    made: Made, orders: Orders, moves: IntArray, shares: FloatArray, *, placement: Placement, tips_at: TipsAt
) -> FloatArray:
    """Return (k, 3) where the tip is: as it was timed, shifted by what its targets differ from those of the plan."""
    timed = tips_at(orders.times[moves - 1] + shares * np.diff(orders.times)[moves - 1])
    gone = np.linalg.norm(timed - orders.tips[moves - 1], axis=1)
    left = np.linalg.norm(orders.tips[moves] - timed, axis=1)
    whole = gone + left
    passed = np.divide(gone, whole, out=shares.copy(), where=whole > _ON_THE_SPOT)[:, None]
    targets = made.places
    if not placement.missing:
        targets = transforms.apply(transforms.inverse(placement.T_base_work), made.execution.moves.tips(made.rows))
    shifts = targets - orders.tips
    return timed + (1.0 - passed) * shifts[moves - 1] + passed * shifts[moves]


def _flows(
    made: Made, moment: Callable[[Switching], float], *, signals: Signals, until: float
) -> Iterator[tuple[float, float]]:
    """Yield when a flow is set, and to which volume per length [mm3/mm]; none where no output sets it.

    Raises:
        VerificationError: it is set to a volume per time while the tip is on its path.
    """
    name = (signals.flow or "").lower()
    begin = float(made.execution.moves.begins[made.rows[0]])
    for each in made.execution.switchings:
        if signals.sets_flow and each.signal == name:
            if not each.flow and each.value != 0.0 and begin < each.time < until:
                refuse(Place(each.file, each.line), f"{each.signal} is set to {each.value:g} here, whatever the speed")
            value = each.value / signals.flow_per_mm3_s if each.flow else 0.0
            yield moment(each), value


def _passed(each: Switching, times: FloatArray, tips: FloatArray) -> float:
    """Return when the tip passes the place of a switching within a move, or leads it by so long as the move has."""
    away = np.linalg.norm(tips - (tips[0] if each.from_start else tips[-1]), axis=1)
    away, moments = (away, times) if each.from_start else (away[::-1], times[::-1])
    passed = float(np.interp(each.distance, np.maximum.accumulate(away), moments))
    return float(np.clip(passed - (each.lag if each.flow else 0.0), times[0], times[-1]))
