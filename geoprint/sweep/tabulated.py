"""The table of a study: a row for each cell, with its figures or the reason why there are none."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from geoprint.geometry.files import write_whole
from geoprint.reporting.metrics import CATALOGUE
from geoprint.reporting.records.plan import PlanRecord
from geoprint.sweep.running import Outcome

TABLE: Final = "study.csv"
_ASKED: Final = ("cell", "part", "site", "setting", "backend", "pattern", "robot_cell", "status", "reason")
_FOUND: Final = (
    "faces", "area_mm2", "spacing_mm", "runs", "deposit_mm", "speed_mm_s", "time_s", "clearance_mm", "deposited_share",
)  # fmt: skip


def save_study_table(found: Iterable[Outcome], folder: Path) -> Path:
    """Write study.csv, the same bytes whoever has planned the cells.

    Raises:
        ExportError: it cannot be written.
    """
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    metrics = [metric.key.replace(".", "_") for metric in CATALOGUE]
    rows.writerow([*_ASKED, *_FOUND, *metrics])
    for outcome in found:
        rows.writerow(row_of(outcome))
    write_whole(folder / TABLE, text.getvalue().encode())
    return folder / TABLE


def row_of(outcome: Outcome) -> Sequence[str]:
    """Return the row of a cell; what it does not have is empty."""
    cell, job = outcome.cell, outcome.cell.job
    robot_cell = "" if job.cell is None else job.cell.stem
    asked = [
        cell.name, cell.part, cell.site, cell.setting, job.backend, job.pattern, robot_cell, outcome.status,
        outcome.reason,
    ]  # fmt: skip
    if outcome.record is None:
        return [*asked, *[""] * (len(_FOUND) + len(CATALOGUE))]
    return [*asked, *map(_text, _found(outcome.record)), *_metrics(outcome.record)]


def _found(record: PlanRecord) -> Iterable[float | None]:
    """Yield the values of the columns that are no metrics of evenness."""
    robots = record.robot
    yield record.surface.prepared.faces
    yield record.surface.area_mm2
    yield record.settings.spacing_mm
    yield record.paths.runs
    yield record.paths.deposit_mm
    yield record.settings.speed_mm_s if robots else None
    yield sum(robot.motion.duration_s for robot in robots) if robots else None
    yield min(robot.clearance.smallest_mm for robot in robots) if robots else None
    shares = [robot.motion.deposited.share for robot in robots if robot.motion.deposited is not None]
    yield sum(shares) / len(shares) if shares else None


def _metrics(record: PlanRecord) -> list[str]:
    measured = record.uniformity
    return [_text(None if measured is None else metric.of(measured)) for metric in CATALOGUE]


def _text(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"
