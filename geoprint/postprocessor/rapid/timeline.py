"""When a program switches its outputs: at which place of which move, and when the planned motion is there."""

from __future__ import annotations

import numpy as np

from geoprint.postprocessor.execution import Switched
from geoprint.postprocessor.orders import Orders, TipsAt
from geoprint.postprocessor.rapid.machine import Switching
from geoprint.postprocessor.rapid.made import Made

# The motion is looked at so often [s].
_STEP = 0.001


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
            _moment(each, target, orders, tips_at) + float(waited[target]) * each.from_start,
            each.signal,
            each.value > 0.0,
            each.file,
            each.line,
        )
        for target, some in sorted(made.switchings.items())
        for each in some
        if not each.flow
    )


def _moment(trigger: Switching, index: int, orders: Orders, tips_at: TipsAt) -> float:
    """Return when the tip is where the trigger switches, on the move to a target."""
    if index == 0:
        return float(orders.times[0])
    first, last = float(orders.times[index - 1]), float(orders.times[index])
    moments = np.linspace(first, last, max(int(np.ceil((last - first) / _STEP)), 1) + 1)
    origin = orders.tips[index - 1] if trigger.from_start else orders.tips[index]
    distances = np.linalg.norm(tips_at(moments) - origin, axis=1)
    if not trigger.from_start:
        distances, moments = distances[::-1], moments[::-1]
    return float(np.interp(trigger.distance, np.maximum.accumulate(distances), moments))
