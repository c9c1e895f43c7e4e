"""What was appraised of the last print: read, held against the part and the paths, and as parts of runs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from geoprint.account.records.scan import PartOfRunRecord, ScanAppraisalRecord
from geoprint.config import Job
from geoprint.config.strict import describe, text_of
from geoprint.deposition.feedback import MeasuredRuns
from geoprint.errors import InputError, UsageError, naming
from geoprint.model import PoseStream
from geoprint.results import Plan

# Runs are as long as those that were printed within this [mm] and this share: tables have six decimals.
SAME_LENGTH, SAME_SHARE = 0.01, 1e-3
WRITTEN = "give the appraisal.json that `geoprint appraise SCAN --plan DIR` wrote; photographs tell no thickness"


def check_single(job: Job) -> None:
    """Refuse feedback where several plans are made: it is of the paths of one.

    Raises:
        UsageError: the job names some.
    """
    if job.feedback is not None:
        raise UsageError(
            f"`--feedback {job.feedback}` is of the paths of one plan, but several are made here: give it to "
            "`geoprint plan`, with the backend, and the layer, that was printed."
        )


def feedback_text(path: Path | str) -> str:
    """Return the text of an appraisal, once it is known to be one.

    Raises:
        UsageError: it cannot be read.
        InputError: it is no appraisal of a scan.
    """
    path = Path(path)
    try:
        text = text_of(path)
    except (OSError, ValueError) as error:
        raise UsageError(f"`--feedback {path}` cannot be read ({error}); {WRITTEN}.") from error
    with naming(f"`--feedback {path.name}`"):
        told_print(text)
    return text


def told_print(text: str) -> ScanAppraisalRecord:
    """Return what an appraisal says of a scan of a print.

    Raises:
        InputError: it is none.
    """
    try:
        # Parsed first: the sentence on what is no JSON at all names its line.
        json.loads(text)
        return ScanAppraisalRecord.model_validate_json(text)
    except ValidationError as error:
        raise InputError(f"it is no appraisal of a scan: {describe(error)}; {WRITTEN}.") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"it is no appraisal of a scan ({error}); {WRITTEN}.") from error


def check_same(told: ScanAppraisalRecord, paths: Plan) -> None:
    """Refuse what was appraised of another part, or of other paths on it.

    Raises:
        InputError: it is.
    """
    part = paths.workpiece.files[0]
    if told.part_sha256 != part.digest:
        raise InputError(
            f"it is of a print of {told.part}, plan {told.plan}, whose file is not that of {part.name}: plan the part "
            "that was printed, or appraise a print of this one."
        )
    poses = paths.poses
    printed = {each.run: each.length_mm for each in told.runs}
    numbers = np.unique(poses.runs[poses.deposit]).tolist()
    planned = {number: _length(poses, number) for number in numbers}
    again = f"plan with the settings of {told.plan}, as `geoprint plan --from {told.plan} --feedback` does"
    if sorted(printed) != numbers:
        raise InputError(f"it is of {len(printed)} runs, but {len(numbers)} are planned: {again}.")
    off = {run: abs(planned[run] - printed[run]) for run in numbers}
    worst = max(off, key=lambda run: off[run])
    if off[worst] > SAME_LENGTH + SAME_SHARE * planned[worst]:
        raise InputError(
            f"run {worst} was {printed[worst]:.2f} mm long in print, but {planned[worst]:.2f} mm are planned: {again}.",
            run=worst,
        )


def measured_runs(told: ScanAppraisalRecord) -> MeasuredRuns:
    """Return what was measured; all parts share the height of the scan, along the direction it is known worst.

    Raises:
        InputError: what it says cannot have been measured.
    """
    parts = told.parts

    def of(part: PartOfRunRecord) -> tuple[float, ...]:
        return part.start_mm, part.end_mm, part.ratio or 0.0, part.deviation or 0.0, part.factor

    starts, ends, ratios, deviations, factors = np.array([of(part) for part in parts]).reshape(-1, 5).T
    return MeasuredRuns(
        runs=np.array([part.run for part in parts], dtype=np.int64),
        starts=starts,
        ends=ends,
        seen=np.array([part.ratio is not None for part in parts], dtype=np.bool_),
        ratios=ratios,
        deviations=deviations,
        factors=factors,
        common=told.registration.shift_deviation_mm / told.layer_height_mm,
        opened=told.opened_mm,
        shut=told.shut_mm,
    )


def _length(poses: PoseStream, number: int) -> float:
    rows = poses.surface_points[poses.deposit & (poses.runs == number)]
    return float(np.linalg.norm(np.diff(rows, axis=0), axis=1).sum())
