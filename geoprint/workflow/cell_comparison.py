"""The same part on several cells: whether it prints there, how fast, and how much room is left."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from geoprint.config import Job, load_cell
from geoprint.errors import PlanError, UsageError, how_many
from geoprint.model import Cell
from geoprint.reporting.cell_comparison import cells_page, record_cells
from geoprint.reporting.records.comparison import CellsRecord
from geoprint.reporting.records.rounding import save_record
from geoprint.results import CellComparison, CellOutcome, Plan
from geoprint.robot.arm import Arm
from geoprint.robot.reach import Margin, depositing, smallest_margin
from geoprint.workflow.bundles import REPORT
from geoprint.workflow.placing import best_placed
from geoprint.workflow.planning import plan
from geoprint.workflow.saving import written

CELLS = "cells.json"


def compare_cells(
    job: Job, cells: Sequence[Path | str], *, observe: Callable[[str], None] = lambda _: None
) -> CellComparison:
    """Plan a part on several cells, each by itself.

    Args:
        job: what to plan, with the robot; its cell does not count.
        cells: two or more files, or names of packaged cells.
        observe: called with the name of each stage as it starts, behind that of its cell.

    Returns:
        What becomes of the part on each.

    Raises:
        UsageError: fewer than two cells are given, one comes twice, or the job leaves the robot out.
        GeoprintError: the part can be printed on none of them; that of the last one.
    """
    paths = [Path(cell) for cell in cells]
    names = [str(path) for path in paths]
    if len(set(names)) < max(len(names), 2):
        raise UsageError(
            f"`--cells {','.join(names)}` names {how_many(len(set(names)), 'cell')}: give two or more that differ, "
            "with commas between them."
        )
    if not job.robot or job.divided:
        raise UsageError("cells are compared by their programs for one skin: omit `--no-robot`, and name a `--layer`.")
    outcomes: list[CellOutcome] = []
    for path in paths:
        try:
            outcomes.append(_planned(job, path, lambda stage, path=path: observe(f"{path.name}: {stage}")))
        except (PlanError, UsageError) as error:
            if len(outcomes) + 1 == len(cells) and not any(each.plan for each in outcomes):
                raise
            lost = error.details.get("lost")
            outcomes.append(
                CellOutcome(str(path), _cell(path), None, None, str(error), lost if isinstance(lost, float) else None)
            )
    return CellComparison(job, tuple(outcomes))


@written.register
def _save(found: CellComparison, directory: Path | str, *, overwrite: bool) -> CellsRecord:
    """Write cells.json and report.html."""
    record = record_cells(found)
    return save_record(record, CELLS, {REPORT: cells_page(found, record)}, directory, overwrite=overwrite)


def _planned(job: Job, path: Path, observe: Callable[[str], None]) -> CellOutcome:
    placed = best_placed(job.model_copy(update={"cell": path}), observe=observe)
    found = plan(placed, observe=observe)
    return CellOutcome(str(path), found.workpiece.cell, found, _margin(found), None, None)


def _margin(found: Plan) -> Margin:
    """Return the smallest margin of all motions of a plan."""
    cell = found.workpiece.cell
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    paths = [robot.joint_path for robot in found.robot]
    margins = [smallest_margin(path.joints, arm, deposit=depositing(path.poses)) for path in paths]
    return min(margins, key=lambda margin: margin.angle)


def _cell(path: Path) -> Cell | None:
    """Return a cell, or None where what refuses it is its file."""
    try:
        return load_cell(path)
    except UsageError:
        return None
