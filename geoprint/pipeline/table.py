"""Comparisons as a table that a person reads in a terminal."""

from __future__ import annotations

import io
from collections.abc import Sequence

from geoprint.pipeline.comparison import Comparison, FailedPart, Planned, Refused
from geoprint.pipeline.verdict import verdict

# Wide enough for every column on one line; a narrower terminal wraps the reasons below the table, not the figures.
WIDTH = 124
HEADINGS = (
    "backend", "spacing mean", "CV", "p95", "uncovered", "runs", "length mm", "print s", "printable", "clearance mm",
    "planned in s",
)  # fmt: skip
TEXT_COLUMNS = {"part", "backend", "printable"}


def comparison_table(parts: Sequence[Comparison | FailedPart]) -> str:
    """Return the table and, below it, what it means and why something is missing.

    Spacing figures are ratios to the wanted spacing; uncovered is the share of the area farther than 0.55 spacings
    from every path.
    """
    from rich.console import Console
    from rich.table import Table

    several = len(parts) > 1
    table = Table(title=_title(parts), title_justify="left", title_style="")
    for heading in ("part", *HEADINGS) if several else HEADINGS:
        table.add_column(heading, justify="left" if heading in TEXT_COLUMNS else "right", no_wrap=True)
    notes: list[str] = []
    for part in parts:
        name = part.job.surface.name
        for row in _rows(part):
            table.add_row(*((name, *row) if several else row))
        table.add_section()
        notes += [f"{name}: {note}" for note in _notes(part)] if several else _notes(part)
    buffer = io.StringIO()
    width = WIDTH + (max(len(part.job.surface.name) for part in parts) + 3 if several else 0)
    Console(file=buffer, width=width, highlight=False).print(table)
    return "\n".join([buffer.getvalue().rstrip(), *dict.fromkeys(notes)])


def _title(parts: Sequence[Comparison | FailedPart]) -> str:
    spacings = sorted(
        {
            f"{outcome.plan.contours.spacing:.3g}"
            for part in parts
            if isinstance(part, Comparison)
            for _, outcome in part.planned
        },
        key=float,
    )
    named = parts[0].job.surface.name if len(parts) == 1 else f"{len(parts)} parts"
    return f"{named}, paths {' / '.join(spacings)} mm apart"


def _rows(part: Comparison | FailedPart) -> list[tuple[str, ...]]:
    if isinstance(part, FailedPart):
        return [("-", *("-" for _ in HEADINGS[1:8]), "failed", "-", "-")]
    return [_refused_row(name) if isinstance(out, Refused) else _row(name, out) for name, out in part.outcomes]


def _row(name: str, outcome: Planned) -> tuple[str, ...]:
    measured, plan, robot = outcome.uniformity, outcome.plan, outcome.plan.robot
    printable = "not asked" if not plan.job.robot else "no" if robot is None else "yes"
    return (
        name,
        f"{measured.mean:.3f}",
        f"{measured.cv:.2%}",
        f"{measured.percentile(95):.3f}",
        f"{measured.uncovered:.2%}",
        str(plan.toolpath.curves.count),
        f"{measured.length:.0f}",
        "-" if robot is None else f"{robot.trajectory.duration:.0f}",
        printable,
        "-" if robot is None else f"{robot.clearance.smallest:.2f}",
        f"{outcome.planning_time:.1f}",
    )


def _refused_row(name: str) -> tuple[str, ...]:
    return (name, *("-" for _ in HEADINGS[1:8]), "refused", "-", "-")


def _notes(part: Comparison | FailedPart) -> list[str]:
    if isinstance(part, FailedPart):
        return [part.reason]
    notes = list(verdict(part))
    for robot in [outcome.plan.robot for _, outcome in part.planned if outcome.plan.robot is not None][:1]:
        notes.append(f"not checked: {', '.join(robot.clearance.not_checked)}")
        if not robot.placement.calibrated:
            notes.append("PLACEMENT NOT CALIBRATED: the programs run only dry.")
    return notes
