"""What a person reads of comparisons: the table in a terminal, and in plain words what it means."""

from __future__ import annotations

import io
from collections.abc import Mapping

from geoprint.account.plan_text import placement_warnings
from geoprint.account.records.comparison import FailedRecord, PartRecord, PlannedRecord, RefusedRecord, ToldComparison
from geoprint.account.records.plan import PlanRecord

# Wider than any table of figures, so that no cell is cut; a narrower terminal wraps whole lines.
WIDTH = 1000
HEADINGS = (
    "backend", "mean", "CV", "p95", "gap", "overlap", "runs", "length mm", "print s", "printable", "clear mm",
    "planned in s",
)  # fmt: skip
TEXT_COLUMNS = {"part", "backend", "printable"}


def comparison_table(told: ToldComparison) -> str:
    """Return the table and, below it, what it means and why something is missing.

    Mean, CV and p95 are of the spacing over the wanted one; gap is the share of the area farther than 0.55 spacings
    from every path, overlap the share within 0.45 spacings of two stretches.
    """
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table

    parts = told.record.parts
    several = len(parts) > 1
    table = Table(box=SIMPLE_HEAD, title=_title(parts), title_justify="left", title_style="")
    for heading in ("part", *HEADINGS) if several else HEADINGS:
        table.add_column(heading, justify="left" if heading in TEXT_COLUMNS else "right", no_wrap=True)
    notes: list[str] = []
    mind: list[str] = []
    for part, plans in zip(parts, told.plans, strict=True):
        for row in _rows(part):
            table.add_row(*((part.part, *row) if several else row))
        table.add_section()
        notes += [f"{part.part}: {reason}" for reason in _reasons(part)] if several else _words(part)
        mind += _cautions(plans)
    buffer = io.StringIO()
    Console(file=buffer, width=WIDTH, highlight=False).print(table)
    return "\n".join([*(line.rstrip() for line in buffer.getvalue().splitlines()), *notes, *dict.fromkeys(mind)])


def _title(parts: tuple[PartRecord | FailedRecord, ...]) -> str:
    rows = [row for part in parts if isinstance(part, PartRecord) for row in part.planned]
    spacings = sorted({f"{row.spacing_mm:.3g}" for row in rows}, key=float)
    named = parts[0].part if len(parts) == 1 else f"{len(parts)} parts"
    return f"{named}, paths {' / '.join(spacings)} mm apart; mean and p95 are multiples of that"


def _rows(part: PartRecord | FailedRecord) -> list[tuple[str, ...]]:
    if isinstance(part, FailedRecord):
        return [_empty_row("-", "failed")]
    return [
        _empty_row(row.backend, "refused") if isinstance(row, RefusedRecord) else _row(row) for row in part.backends
    ]


def _row(row: PlannedRecord) -> tuple[str, ...]:
    measured = row.uniformity
    spacing = measured.spacing
    return (
        row.backend,
        *(("-", "-", "-") if spacing is None else (f"{spacing.mean:.3f}", f"{spacing.cv:.2%}", f"{spacing.p95:.3f}")),
        f"{measured.gap:.2%}",
        f"{measured.overlap:.2%}",
        str(row.paths.runs),
        f"{row.paths.deposit_mm:.0f}",
        "-" if row.print_time_s is None else f"{row.print_time_s:.0f}",
        "not asked" if row.printable is None else "yes" if row.printable else "no",
        "-" if row.smallest_clearance_mm is None else f"{row.smallest_clearance_mm:.2f}",
        f"{row.planning_s:.1f}",
    )


def _empty_row(name: str, why: str) -> tuple[str, ...]:
    return (name, *("-" for _ in HEADINGS[1:9]), why, "-", "-")


def _words(part: PartRecord | FailedRecord) -> tuple[str, ...]:
    return (part.failed,) if isinstance(part, FailedRecord) else part.verdict


def _reasons(part: PartRecord | FailedRecord) -> list[str]:
    """Say why something is missing in the rows of a part."""
    if isinstance(part, FailedRecord):
        return [part.failed]
    unprinted = [row for row in part.planned if row.not_printable is not None]
    return [
        *(f"{row.backend} could not plan: {row.refused}" for row in part.refused),
        *(f"{row.backend} cannot be printed: {row.not_printable}" for row in unprinted),
    ]


def _cautions(plans: Mapping[str, PlanRecord]) -> list[str]:
    robots = next((plan.robot for plan in plans.values() if plan.robot), ())
    not_checked = [f"not checked: {', '.join(robot.clearance.not_checked)}" for robot in robots]
    return [*dict.fromkeys(not_checked), *placement_warnings(robots)]
