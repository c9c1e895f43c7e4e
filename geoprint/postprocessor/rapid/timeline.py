"""When a program switches its outputs: at which place of which move, and when the planned motion is there."""

from __future__ import annotations

import numpy as np

from geoprint.postprocessor.execution import Switched
from geoprint.postprocessor.orders import Orders, TipsAt
from geoprint.postprocessor.rapid.made import Made
from geoprint.postprocessor.timeline import moment_on


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
