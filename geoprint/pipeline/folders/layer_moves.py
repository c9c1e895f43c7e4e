"""The table's motion from one layer to the next: from the last attitude of the one to the first of the other.

A layer is planned by itself, as if the table came to its first attitude from rest. In the program of all layers it
comes from where the layer below has left it, so that this motion is proven here, with all that lies on the part then.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import final

import numpy as np

from geoprint.config import Job
from geoprint.errors import naming
from geoprint.export.rapid.stacks import OwnProgram
from geoprint.model import frozen
from geoprint.motion.machine import table_machine
from geoprint.pipeline.tilting import move_clearance, sweep_seconds
from geoprint.pipeline.workpiece import read_part


@final
@frozen
class LayerMove:
    """How the table comes to a layer.

    Attributes:
        kept: distance that is kept from the arm at home [mm].
        seconds: from the last attitude of the layer below [s].
        from_rest: from rest, as it is planned and told for the layer by itself [s].
    """

    kept: float
    seconds: float
    from_rest: float


def layer_moves(jobs: Sequence[Job], own: Sequence[OwnProgram]) -> tuple[LayerMove, ...]:
    """Return how a table comes to each layer but the lowest; nothing where the part stands still.

    Args:
        jobs: of each layer, the lowest first.
        own: the programs of all attitudes, in the order of printing.

    Raises:
        ClearanceError: the table cannot be proven to keep clear of the arm at home; the sentence names the layer.
        GeoprintError: as `read_part`, and as `move_clearance`.
    """
    between = [(one, other) for one, other in pairwise(own) if one.layer != other.layer]
    return tuple(_move(jobs[other.layer - 1], one, other) for one, other in between if other.cell.table is not None)


def _move(job: Job, one: OwnProgram, other: OwnProgram) -> LayerMove:
    part = read_part(job)
    with naming(f"layer {other.layer}, which comes upon layer {one.layer} without a rest of the table"):
        kept = move_clearance(
            other.cell,
            before=one.placement,
            stands=other.placement,
            surfaces=(part.base,) if part.body is None else (part.base, part.body),
            place=part.place,
            to=f"attitude 1 of layer {other.layer}",
        )
    before, after, noun = one.placement.table, other.placement.table, other.cell.table
    assert before is not None  # noqa: S101  # As `move_clearance` has asked.
    assert after is not None  # noqa: S101  # As above.
    assert noun is not None  # noqa: S101  # As above.
    table = table_machine(noun)
    rest, last, first = np.eye(4)[None], before.T_table_plate[None], after.T_table_plate[None]
    (seconds,) = sweep_seconds(other.cell, table, Ts_from=last, Ts_to=first)
    (from_rest,) = sweep_seconds(other.cell, table, Ts_from=rest, Ts_to=first)
    return LayerMove(kept, seconds, from_rest)
