"""What an executed script commands along its path, in time: where its tip is, and when its valve is open."""

from __future__ import annotations

import numpy as np

from geoprint import transforms
from geoprint.errors import VerificationError
from geoprint.model import Cell, Dispensing
from geoprint.postprocessor.expected import LIFT
from geoprint.postprocessor.interface import RobotProgram
from geoprint.postprocessor.orders import dispensing_along
from geoprint.postprocessor.urscript.executed import printing
from geoprint.postprocessor.urscript.execution import execute
from geoprint.postprocessor.urscript.forms import FILE
from geoprint.postprocessor.urscript.guard import output_of
from geoprint.postprocessor.urscript.language import Script
from geoprint.postprocessor.urscript.motion import places_of
from geoprint.robot.arm import Arm

# The motion is looked at so often [s].
_STEP = 0.001


def dispensing_of(script: Script, program: RobotProgram, cell: Cell) -> Dispensing:
    """Return where the tip of a script is when, and what it commands, by the clock of its execution.

    Args:
        script: that was read.
        program: what it was written for.
        cell: arm and outputs.

    Raises:
        VerificationError: it does not run, or has other targets than planned.
    """
    bare = Arm(cell.robot, T_flange_tool=np.eye(4))
    log = execute(script, printing(cell, program.placement), bare.tool_poses)
    path, orders = [move for move in log.moves if move.verb != "movej"], program.orders
    if log.ended != "end" or len(path) != orders.count - 1:
        raise VerificationError(
            f"{FILE}: the program moves to {len(path) + 1} targets along its path, targets.csv has {orders.count}. "
            "Timing is known only for planned moves: restore them, or plan again.",
            targets=len(path) + 1,
            planned=orders.count,
        )
    begins, ends = path[0].begins, path[-1].ends
    times = np.arange(begins, ends + 0.5 * _STEP, _STEP)
    pieces = [piece for piece in log.pieces if begins <= piece.begins <= ends]
    tips = 1e3 * places_of(pieces, times)
    if program.placement.missing:
        tips[:, 2] -= LIFT
    tips = transforms.apply(transforms.inverse(program.placement.T_base_work), tips)
    starts = np.array([move.begins for move in path])
    moves = np.clip(np.searchsorted(starts, times, side="right"), 1, orders.count - 1)
    kind, number = output_of(cell.signals.dispenser)
    # Threads switch along the path; what runs set besides is low already.
    valve = [each for each in log.switches if each.output == f"{kind} {number}" and each.thread != script.main.name]
    return dispensing_along(
        orders, times=times, tips=tips, moves=moves, runs=orders.runs[moves],
        valve=[(each.time, each.on) for each in valve],
    )  # fmt: skip
