"""Flow and valve as the last print teaches them, within what the cell can do.

The print was held against what its program deposits on its cell, so what is left is of its dispenser and material. That
is carried to the next program where the same dispenser prints it. A flow that is set along the path takes it out there;
a valve that only opens and shuts gets the volume of the whole print right, by the speed at which it passes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from hashlib import sha256

import numpy as np

from geoprint.deposition.feedback import Correction, FlowBounds, MeasuredRuns, corrected, dispenser_of
from geoprint.errors import UsageError, naming
from geoprint.model import Cell, FloatArray, PoseStream
from geoprint.pipeline.feeding.printed import LastPrint, check_same, last_print
from geoprint.results import Fed, Plan

NAMED = "the feedback"
# A valve that is later than this [mm of path] is not late: it is stuck, or the runs are not those that were printed.
MOST_EARLIER = 3.0
# Decimals of a speed [mm/s], as plan.json has them.
SPEED_DECIMALS = 6
# Figures of a dispenser that differ by less are one: appraisals have six decimals.
SAME = 2e-6


def with_feedback(paths: Plan) -> Plan:
    """Return a plan of paths with the flow, and in its cell valve times and speed, that the last print teaches.

    Args:
        paths: with the flow that they ask for.

    Raises:
        InputError: what was appraised is of another part or other paths.
        UsageError: another dispenser printed, or the cell cannot do what is needed.
    """
    text = paths.workpiece.feedback_text
    if text is None:
        return paths
    with naming(NAMED):
        last = last_print(text)
        check_same(last.printed, paths)
        cell = paths.workpiece.cell
        correction = corrected(last.measured, bounds=_bounds(cell))
        _check_dispenser(last, correction, cell)
        wanted = paths.poses.flow[paths.poses.deposit]
        poses, held = _commanded(paths.poses, correction, cell, spacing=paths.contours.spacing)
        passed = cell if _follows(cell) else _slower(cell, last, correction)
    speed = None if passed.process.speed == cell.process.speed else passed.process.speed
    digest = sha256(text.encode("utf-8")).hexdigest()
    fed = Fed(digest, last.printed.plan, last.seen_in, correction, wanted, held, speed)
    workpiece = replace(paths.workpiece, cell=_later(passed, correction, duration=1.0 / passed.process.speed))
    return replace(paths, poses=poses, workpiece=workpiece, fed=fed)


def printing_at(paths: Plan, speed: float) -> Cell:
    """Return the cell of a plan with the speed of its print [mm/s]; what a valve is late by is a length of path."""
    cell = paths.workpiece.cell
    slower = cell.at_speed(speed)
    if paths.fed is None:
        return slower
    return _later(slower, paths.fed.correction, duration=1.0 / speed - 1.0 / cell.process.speed)


def _follows(cell: Cell) -> bool:
    """Say whether the flow is set along the path."""
    return cell.signals.mode == "analog"


def _bounds(cell: Cell) -> FlowBounds:
    signals, process = cell.signals, cell.process
    latest = process.speed * min(signals.valve_open, signals.valve_close)
    return FlowBounds(process.least_flow, process.most_flow, MOST_EARLIER, latest, even=not _follows(cell))


def _check_dispenser(last: LastPrint, found: Correction, cell: Cell) -> None:
    """Refuse to carry an error to another dispenser: what of it is the material's, no single print can tell.

    Raises:
        UsageError: there is one, and the dispenser is another.
    """
    printed, here = last.printed.dispenser, dispenser_of(cell)
    other = next((key for key in {**printed, **here} if not _alike(printed, here, key)), None)
    unchanged = not found.changes and bool((found.factors == 1.0).all()) and found.opening == found.shutting == 0.0
    if other is None or unchanged:
        return
    plan = last.printed.plan
    raise UsageError(
        f"the print of {plan} was off by its material or by its dispenser, and the next one has another: {other} was "
        f"{_shown(printed, other)}, in {cell.name} it is {_shown(here, other)}; nobody can tell which of both it was: "
        f"plan without it, `geoprint plan --from {plan} --cell {cell.name} --out next`, print that, and feed back its "
        "own print.",
        key=other,
    )


def _alike(one: Mapping[str, float | str], other: Mapping[str, float | str], key: str) -> bool:
    a, b = one.get(key), other.get(key)
    if isinstance(a, float) and isinstance(b, float):
        return abs(a - b) <= SAME
    return a == b


def _shown(dispenser: Mapping[str, float | str], key: str) -> str:
    value = dispenser.get(key)
    return "not stated" if value is None else f'"{value}"' if isinstance(value, str) else f"{value:g}"


def _commanded(poses: PoseStream, found: Correction, cell: Cell, *, spacing: float) -> tuple[PoseStream, float]:
    """Return the poses with the flow to command, and at which share of them the cell's bounds hold it."""
    if bool((found.factors == 1.0).all()):
        return poses, 0.0
    there = poses.deposit
    wanted: FloatArray = poses.flow * found.at(poses.runs, poses.arcs)
    if not _follows(cell):
        return replace(poses, flow=wanted), float(found.bounded > 0)
    nominal = spacing * cell.process.layer_height
    flow = np.where(there, np.clip(wanted, cell.process.least_flow * nominal, cell.process.most_flow * nominal), 0.0)
    return replace(poses, flow=flow), float((flow != wanted)[there].mean())


def _slower(cell: Cell, last: LastPrint, found: Correction) -> Cell:
    """Return the cell with the speed at which its valve lays the flow to command, at the pressure of the last print.

    Raises:
        UsageError: that is faster than the cell prints.
    """
    share = float(found.factors[0])
    if share == 1.0:
        return cell
    nominal = min(cell.process.speed, last.printed.speed_mm_s * _even(last.measured))
    speed = round(nominal / share, SPEED_DECIMALS)
    if speed > cell.process.speed:
        raise UsageError(
            f"the valve is to let {share:.2f} of the wanted flow through, which takes {speed:.3g} mm/s, but "
            f"process.speed_mm_s of {cell.name} is {cell.process.speed:g}: lower the air pressure, plan without "
            f"feedback, `geoprint plan --from {last.printed.plan} --out next`, and feed back the print of that.",
            factor=share,
        )
    return cell.at_speed(speed)


def _even(measured: MeasuredRuns) -> float:
    """Return the flow that was commanded for the last print, over the wanted one, as a whole."""
    return float(1.0 / np.average(1.0 / measured.factors, weights=measured.lengths))


def _later(cell: Cell, found: Correction, *, duration: float) -> Cell:
    """Return the cell with a valve that is later by what was found, at so many seconds for a millimetre."""
    valve_open = max(cell.signals.valve_open + found.opening * duration, 0.0)
    valve_close = max(cell.signals.valve_close + found.shutting * duration, 0.0)
    return replace(cell, signals=replace(cell.signals, valve_open=valve_open, valve_close=valve_close))
