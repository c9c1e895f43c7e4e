"""What cells.json, the terminal and the report page say of a part on several cells."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from geoprint.errors import how_many, percent
from geoprint.reporting.html import Document, element, joined, row_table
from geoprint.reporting.page import document_page
from geoprint.reporting.records.comparison import CellRecord, CellsRecord
from geoprint.reporting.records.plan import FileRecord
from geoprint.reporting.records.rounding import listed, stamp
from geoprint.reporting.tables import Cells, fitting, grid, left_out
from geoprint.results import CellComparison, CellOutcome

# What the columns show, and how much each matters: where the terminal is narrow, the highest numbers go first.
COLUMNS = {
    "cell": 0, "arm": 6, "printable": 1, "reached": 2, "margin deg": 5, "nearest to": 7, "mm/s": 4, "time s": 3,
    "clear mm": 4,
}  # fmt: skip
_LEFT = {"cell", "arm", "printable", "nearest to"}
_NONE = "-"


def record_cells(found: CellComparison) -> CellsRecord:
    """Return what cells.json says: the source of table and page."""
    rows = tuple(_row(outcome) for outcome in found.outcomes)
    part = found.plans[0].workpiece.files[0]
    return CellsRecord(
        **stamp(CellsRecord),
        part=FileRecord.of(part, sha256=part.digest),
        backend=found.job.backend,
        verdict=_verdict(rows, part=part.name),
        cells=rows,
    )


def cells_text(record: CellsRecord, *, width: int | None = None) -> str:
    """Return the table and, below it, what it means.

    Args:
        record: what cells.json says.
        width: letters in a line, where they are counted; columns that do not fit are left out.
    """
    rows = [_cells(row) for row in record.cells]
    names = fitting([*COLUMNS], rows, width=width, weights=COLUMNS)
    lines = [
        f"{record.part.name} with {record.backend}, on {how_many(len(rows), 'cell')}",
        "",
        *grid(names, [rows], left=_LEFT),
        "",
    ]
    if len(names) < len(COLUMNS):
        lines += [f"columns left out at this width, see cells.json: {left_out([*COLUMNS], names, COLUMNS)}", ""]
    return "\n".join([*lines, *record.verdict])


def cells_page(found: CellComparison, record: CellsRecord) -> bytes:
    """Return report.html of a part on several cells: verdict, table, and why it cannot be printed where that is so."""
    rows = [tuple(_cells(row)[column] for column in COLUMNS) for row in record.cells]
    refused = [f"{row.cell}: {row.refused}" for row in record.cells if row.refused]
    blocks = [("Cells", row_table([*COLUMNS], rows, label="the part on each cell"))]
    if refused:
        blocks.append(("Not printable", joined(*(element("p", each) for each in refused))))
    return document_page(
        f"geoprint compare: {record.part.name} on {how_many(len(rows), 'cell')}",
        Document(
            name=record.part.name,
            verdict=record.verdict,
            cautions=_not_checked(found),
            blocks=tuple(blocks),
            settings=(("backend", record.backend), *((each.name, _arm(each) or _NONE) for each in found.outcomes)),
            inputs=((record.part.name, record.part.sha256),),
        ),
    )


def _row(outcome: CellOutcome) -> CellRecord:
    plan, margin = outcome.plan, outcome.margin
    return CellRecord(
        cell=outcome.name,
        arm=_arm(outcome),
        refused=outcome.refused,
        reached=1.0 if plan is not None else None if outcome.lost is None else 1.0 - outcome.lost,
        margin_deg=None if margin is None else float(np.degrees(margin.angle)),
        limiting=None if margin is None else margin.limiting,
        speed_mm_s=None if plan is None else plan.workpiece.cell.process.speed,
        duration_s=None if plan is None else sum(float(robot.trajectory.times[-1]) for robot in plan.robot),
        clearance_mm=None if plan is None else min(robot.clearance.smallest for robot in plan.robot),
    )


def _arm(outcome: CellOutcome) -> str | None:
    return None if outcome.cell is None else outcome.cell.robot.model


def _cells(row: CellRecord) -> Cells:
    """Return what the columns say of a cell."""
    return {
        "cell": row.cell,
        "arm": row.arm or _NONE,
        "printable": "yes" if row.refused is None else "no",
        "reached": _NONE if row.reached is None else percent(row.reached, 1),
        "margin deg": _NONE if row.margin_deg is None else f"{row.margin_deg:.1f}",
        "nearest to": row.limiting or _NONE,
        "mm/s": _NONE if row.speed_mm_s is None else f"{row.speed_mm_s:.3g}",
        "time s": _NONE if row.duration_s is None else f"{row.duration_s:.1f}",
        "clear mm": _NONE if row.clearance_mm is None else f"{row.clearance_mm:.2f}",
    }


def _verdict(rows: Sequence[CellRecord], *, part: str) -> tuple[str, ...]:
    """Return what the figures mean: where the part prints, where it takes least, where the arm has most room."""
    printed = [row for row in rows if row.refused is None]
    first = f"{part} can be printed on {listed([row.cell for row in printed])}."
    said = [
        first
        if len(printed) < len(rows)
        else f"{part} can be printed on all of them: {listed([row.cell for row in rows])}."
    ]
    if len(printed) > 1:
        said += [
            _best(
                printed,
                "prints in the shortest time",
                "take as long",
                lambda row: -(row.duration_s or 0.0),
                "{0.duration_s:.1f} s",
            ),
            _best(
                printed,
                "keeps the largest margin",
                "keep the same margin",
                lambda row: row.margin_deg or 0.0,
                "{0.margin_deg:.1f} degrees",
            ),
            _best(
                printed,
                "stays clear by most",
                "stay as clear",
                lambda row: row.clearance_mm or 0.0,
                "{0.clearance_mm:.2f} mm",
            ),
        ]
    return (*said, *(f"{row.cell} cannot print it: {row.refused}" for row in rows if row.refused))


def _best(rows: Sequence[CellRecord], what: str, alike: str, merit: Callable[[CellRecord], float], form: str) -> str:
    best, *others = sorted(rows, key=merit, reverse=True)
    if all(form.format(row) == form.format(best) for row in others):
        return f"All of these {alike}: {form.format(best)}."
    behind = " and ".join(f"{form.format(row)} on {row.cell}" for row in others)
    return f"{best.cell} {what}: {form.format(best)}, {behind}."


def _not_checked(found: CellComparison) -> tuple[str, ...]:
    unchecked = dict.fromkeys(
        text for plan in found.plans for robot in plan.robot for text in robot.clearance.not_checked
    )
    return (f"Not checked: {'; '.join(unchecked)}.",) if unchecked else ()
