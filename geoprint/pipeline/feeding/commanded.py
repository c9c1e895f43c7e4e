"""Flow and valve as the last print teaches them, within what the cell can do."""

from __future__ import annotations

from dataclasses import replace
from hashlib import sha256

import numpy as np

from geoprint.deposition.feedback import Correction, FlowBounds, corrected
from geoprint.errors import UsageError, naming
from geoprint.model import Cell, FloatArray, PoseStream
from geoprint.pipeline.feeding.printed import check_same, measured_runs, told_print
from geoprint.results import Fed, Plan

NAMED = "the feedback"
# A valve that is later than this [mm of path] is not late: it is stuck, or the runs are not those that were printed.
MOST_EARLIER = 3.0


def with_feedback(paths: Plan) -> Plan:
    """Return a plan of paths with the flow, and in its cell the times of the valve, that the last print teaches.

    Args:
        paths: with the flow that they ask for.

    Raises:
        InputError: what was appraised is of another part or other paths.
        UsageError: the flow is to change along runs, which the cell cannot do.
    """
    text = paths.workpiece.feedback_text
    if text is None:
        return paths
    with naming(NAMED):
        told = told_print(text)
        check_same(told, paths)
        measured, cell = measured_runs(told), paths.workpiece.cell
        correction = corrected(measured, bounds=_bounds(cell))
        wanted = paths.poses.flow[paths.poses.deposit]
        poses, held = _commanded(paths.poses, correction, cell, spacing=paths.contours.spacing)
    fed = Fed(sha256(text.encode("utf-8")).hexdigest(), told.plan, told.scan.file, correction, wanted, held)
    workpiece = replace(paths.workpiece, cell=_timed(cell, correction))
    return replace(paths, poses=poses, workpiece=workpiece, fed=fed)


def printing_at(paths: Plan, speed: float) -> Cell:
    """Return the cell of a plan with the speed of its print [mm/s]; what a valve is late by is a length of path."""
    cell = paths.workpiece.cell
    slower = cell.at_speed(speed)
    if paths.fed is None:
        return slower
    return _later(slower, paths.fed.correction, duration=1.0 / speed - 1.0 / cell.process.speed)


def _bounds(cell: Cell) -> FlowBounds:
    signals, process = cell.signals, cell.process
    latest = process.speed * min(signals.valve_open, signals.valve_close)
    return FlowBounds(process.least_flow, process.most_flow, MOST_EARLIER, latest)


def _commanded(poses: PoseStream, found: Correction, cell: Cell, *, spacing: float) -> tuple[PoseStream, float]:
    """Return the poses with the flow to command, and at which share of them the cell's bounds hold it."""
    if bool((found.factors == 1.0).all()):
        return poses, 0.0
    if cell.signals.mode != "analog":
        mean = float(np.mean(found.factors))
        raise UsageError(
            f"the flow is to be {found.factors.min():.2f} to {found.factors.max():.2f} of the planned one along the "
            f'runs, but the cell {cell.name} can only open and shut its valve (signals.mode "io"): give a cell with '
            f'mode "analog", or plan without feedback at a speed_mm_s of {cell.process.speed / mean:.3g} instead of '
            f"{cell.process.speed:g}, which lays the mean of it.",
            factor=mean,
        )
    there = poses.deposit
    wanted: FloatArray = poses.flow * found.at(poses.runs, poses.arcs)
    nominal = spacing * cell.process.layer_height
    flow = np.where(there, np.clip(wanted, cell.process.least_flow * nominal, cell.process.most_flow * nominal), 0.0)
    return replace(poses, flow=flow), float((flow != wanted)[there].mean())


def _timed(cell: Cell, found: Correction) -> Cell:
    """Return the cell with a valve that is as much later as what was found, so that it is commanded earlier."""
    return _later(cell, found, duration=1.0 / cell.process.speed)


def _later(cell: Cell, found: Correction, *, duration: float) -> Cell:
    """Return the cell with a valve that is later by what was found, at so many seconds for a millimetre."""
    valve_open = max(cell.signals.valve_open + found.opening * duration, 0.0)
    valve_close = max(cell.signals.valve_close + found.shutting * duration, 0.0)
    return replace(cell, signals=replace(cell.signals, valve_open=valve_open, valve_close=valve_close))
