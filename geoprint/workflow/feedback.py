"""The last print, held against this plan, corrects flow and valve within what the cell can do."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import cast, final

import numpy as np
from pydantic import ValidationError

from geoprint.config import Job
from geoprint.config.strict import text_of
from geoprint.errors import InputError, UsageError, how_many, naming, reason_of
from geoprint.model import Cell, FloatArray, PoseStream, frozen
from geoprint.postprocessor import Json
from geoprint.process.feedback import Correction, FlowBounds, MeasuredRuns, corrected, dispenser_of
from geoprint.reporting.records.inspection import (
    PRINTED,
    SEAL,
    AppraisalRecord,
    PrintedRecord,
    ScanAppraisalRecord,
    seal_of,
)
from geoprint.results import Fed, Plan

# The last print by its appraisal: read, held against the part and the paths, and as what was measured along its
# runs.
#
# A scan gives the volume of parts of runs. A photograph gives their width, and so the volume only beside that of the
# rest of the print: how far material spreads is not seen in it. Nothing of a file is used that somebody has edited.


# Runs are as long as those that were printed within this [mm] and this share, and lie within the third where these do
# [mm]: tables have six decimals.
SAME_LENGTH, SAME_SHARE, SAME_PLACE = 0.01, 1e-3, 0.05
# An appraisal of 2000 parts has half a megabyte.
MOST_BYTES = 32_000_000
# Volume goes with the width of a bead to a power between 1 and 2, by its standard deviation; how wide a bead is for its
# volume nobody knows better than by this (standard deviation of the logarithm: 0.4 to 2.5 times).
VOLUME_POWER, POWER_DEVIATION, SPREADING = 1.5, 0.29, 0.53
# The width of a whole run is off by this, or this share of a pixel: what lies beside it shifts its edges [mm].
LEAST_EDGES, EDGES_SHARE = 0.03, 0.5
WRITTEN = "give the appraisal.json of its print, from `geoprint appraise FILE --plan DIR --out FOLDER`"


@final
@frozen
class LastPrint:
    """A print that was appraised.

    Attributes:
        printed: the program.
        seen_in: name of the file of the scan or photograph.
        measured: along its runs.
    """

    printed: PrintedRecord
    seen_in: str
    measured: MeasuredRuns


def check_single(job: Job) -> None:
    """Refuse feedback where several plans are made: it is of the paths of one.

    Raises:
        UsageError: the job names some.
    """
    if job.feedback is not None:
        raise UsageError(
            f"`--feedback {job.feedback}` fits the paths of one plan, but several are made here. Give it to `geoprint "
            "plan`, with the printed backend and layer."
        )


def feedback_text(path: Path | str) -> str:
    """Return the text of an appraisal, once it is known to be one.

    Raises:
        UsageError: it cannot be read.
        InputError: it is no appraisal of a print.
    """
    path = Path(path)
    try:
        text = text_of(path, most=MOST_BYTES)
    except (OSError, ValueError) as error:
        raise UsageError(f"`--feedback {path}` cannot be read ({reason_of(error)}); {WRITTEN}.") from error
    with naming(f"`--feedback {path.name}`"):
        last_print(text)
    return text


def last_print(text: str) -> LastPrint:
    """Return the print that an appraisal is of.

    Raises:
        InputError: it is no appraisal of a print, an edited one, or one of another version.
    """
    try:
        found: object = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"it is not an appraisal of a print ({error}); {WRITTEN}.") from error
    content = cast("dict[str, Json]", found) if isinstance(found, dict) else {}
    printed = content.get(PRINTED)
    if not isinstance(printed, dict):
        raise InputError(_without_program(content))
    again = f"appraise the print again: `geoprint appraise FILE --plan {printed.get('plan')} --out appraised`"
    if printed.get(SEAL) != seal_of(content):
        raise InputError(f"its figures were edited after `geoprint appraise` wrote them: {again}.")
    try:
        if "photographs" in content:
            return _of_photograph(AppraisalRecord.model_validate_json(text))
        return _of_scan(ScanAppraisalRecord.model_validate_json(text))
    except ValidationError as error:
        raise InputError(f"geoprint {content.get('version')} wrote it in another layout: {again}.") from error


def _without_program(content: dict[str, Json]) -> str:
    """Return why a file does not say which program was printed, and what to do."""
    photographs = content.get("photographs")
    if isinstance(photographs, list) and photographs:
        if len(photographs) > 1 and "plan" in content:
            return (
                f"it covers {how_many(len(photographs), 'photograph')}, but feedback needs one. Appraise it alone: "
                f"`geoprint appraise PHOTO --plan {content['plan']} --lens LENS --out appraised`."
            )
        if "plan" not in content:
            return (
                "its photograph was not compared with a plan: run `geoprint appraise PHOTO --plan DIR --lens LENS "
                "--out appraised`."
            )
    if "version" in content and "plan" in content:
        return (
            f"geoprint {content['version']} wrote it without the deposit of the printed program: appraise the print "
            f"again, `geoprint appraise FILE --plan {content['plan']} --out appraised`."
        )
    return f"it is not an appraisal of a print; {WRITTEN}."


def _of_scan(record: ScanAppraisalRecord) -> LastPrint:
    """Return a print by a scan; all parts share the height of the scan, along the direction it is known worst."""
    parts = record.parts
    measured = _measured(
        record.printed,
        runs=[part.run for part in parts],
        columns=[(part.start_mm, part.end_mm, part.ratio or 0.0, part.deviation or 0.0) for part in parts],
        seen=[part.ratio is not None for part in parts],
        common=record.registration.shift_deviation_mm / record.layer_height_mm,
    )
    return LastPrint(record.printed, record.scan.file, measured)


def _of_photograph(record: AppraisalRecord) -> LastPrint:
    """Return a print by a photograph, its volumes beside that of the rest of the print.

    Where a bead keeps its shape its volume goes with the square of its width, where it keeps its height with the width.
    So the volume is the width to the power of `VOLUME_POWER`, give or take; and how wide a bead is for its volume
    differs from material to material by more than any print does.
    """
    (photograph,) = record.photographs
    assert photograph.on_plan is not None and record.printed is not None  # noqa: S101, PT018  (`appraise` writes both)
    parts, width_mean = photograph.on_plan.parts, photograph.on_plan.width_mean_mm
    if width_mean is None:
        raise InputError(
            f"{photograph.file} shows no width of any run, so feedback is impossible. Take a sharp photograph that is "
            "not overexposed, and appraise that."
        )
    widths = [(part.width_mm or 0.0) / part.width_planned_mm for part in parts]
    usual = float(np.median([width for width in widths if width > 0.0] or [1.0]))
    ratios = [(width / usual) ** VOLUME_POWER for width in widths]
    deviations = [
        VOLUME_POWER * ratio * (part.width_deviation_mm or 0.0) / (part.width_mm or 1.0)
        for ratio, part in zip(ratios, parts, strict=True)
    ]
    edges = max(LEAST_EDGES, EDGES_SHARE * photograph.on_plan.camera.mm_per_px)
    measured = _measured(
        record.printed,
        runs=[part.run for part in parts],
        columns=[
            (part.start_mm, part.end_mm, ratio, deviation)
            for part, ratio, deviation in zip(parts, ratios, deviations, strict=True)
        ],
        seen=[part.width_mm is not None for part in parts],
        common=VOLUME_POWER * SPREADING,
        by_run=VOLUME_POWER * edges / width_mean,
        scale=POWER_DEVIATION / VOLUME_POWER,
    )
    return LastPrint(record.printed, photograph.file, measured)


def _measured(
    printed: PrintedRecord,
    *,
    runs: list[int],
    columns: list[tuple[float, float, float, float]],
    seen: list[bool],
    common: float,
    by_run: float = 0.0,
    scale: float = 0.0,
) -> MeasuredRuns:
    starts, ends, ratios, deviations = np.array(columns, dtype=np.float64).reshape(-1, 4).T
    return MeasuredRuns(
        runs=np.array(runs, dtype=np.int64),
        starts=starts,
        ends=ends,
        seen=np.array(seen, dtype=np.bool_),
        ratios=ratios,
        deviations=deviations,
        factors=np.array([part.factor for part in printed.parts], dtype=np.float64),
        deposited=np.array([part.deposited for part in printed.parts], dtype=np.float64),
        common=common,
        by_run=by_run,
        scale=scale,
        opened=printed.opened_mm,
        shut=printed.shut_mm,
    )


def check_same(printed: PrintedRecord, paths: Plan) -> None:
    """Refuse what was printed of another part, or by other paths on it.

    Raises:
        InputError: it was.
    """
    part = paths.workpiece.files[0]
    if printed.part_sha256 != part.digest:
        raise InputError(
            f"it shows a print of {printed.part}, plan {printed.plan}, whose file differs from {part.name}. Plan the "
            "part that was printed, or appraise a print of this one."
        )
    poses = paths.poses
    numbers = np.unique(poses.runs[poses.deposit]).tolist()
    again = f"plan what was printed: `geoprint plan --from {printed.plan} --feedback FILE --out next`"
    if [each.run for each in printed.runs] != numbers:
        raise InputError(f"it has {how_many(len(printed.runs), 'run')}, the plan has {len(numbers)}: {again}.")
    for each in printed.runs:
        length, middle = _length_and_middle(poses, each.run)
        if abs(length - each.length_mm) > SAME_LENGTH + SAME_SHARE * length:
            raise InputError(
                f"run {each.run + 1} was {each.length_mm:.2f} mm long in print, {length:.2f} mm in the plan: {again}.",
                run=each.run,
            )
        apart = float(np.linalg.norm(middle - each.middle_mm))
        if apart > SAME_PLACE:
            raise InputError(
                f"the middle of run {each.run + 1} is {apart:.2f} mm off the plan, so another layer or other paths "
                f"were printed: {again}.",
                run=each.run,
            )


def _length_and_middle(poses: PoseStream, number: int) -> tuple[float, FloatArray]:
    """Return the length of a run on the surface, and the place halfway along it [mm]."""
    places = poses.surface_points[poses.deposit & (poses.runs == number)]
    arcs: FloatArray = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    length = float(arcs[-1])
    halfway = [float(np.interp(0.5 * length, arcs, places[:, axis])) for axis in range(3)]
    return length, np.array(halfway)


# Flow and valve as the last print teaches them, within what the cell can do.
#
# The print was held against what its program deposits on its cell, so what is left is of its dispenser and material.
# That is carried to the next program where the same dispenser prints it. A flow that is set along the path takes it
# out there; a valve that only opens and shuts gets the volume of the whole print right, by the speed at which it
# passes.


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
        f"the print of {plan} was off by its material or dispenser, and the next one differs: {other} was "
        f"{_shown(printed, other)}, in {cell.name} it is {_shown(here, other)}. The cause is ambiguous: plan without "
        f"feedback, `geoprint plan --from {plan} --cell {cell.name} --out next`, print that, and feed back its own "
        "print.",
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
    """Return the cell with the speed at which its valve deposits the flow to command, at the last print's pressure.

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
            f"the valve should give {share:.2f} of the planned flow, which takes {speed:.3g} mm/s, but "
            f"process.speed_mm_s of {cell.name} is {cell.process.speed:g}. Lower the air pressure and plan without "
            f"feedback, `geoprint plan --from {last.printed.plan} --out next`. Then feed back the print of that.",
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
