"""Comparisons as a table that a person reads in a terminal."""

from __future__ import annotations

import io
from collections.abc import Sequence

from geoprint.account.robot_summary import placement_warnings
from geoprint.account.verdict import verdict
from geoprint.results import Comparison, FailedPart, Planned, Refused

# Wider than any table of figures, so that no cell is cut; a narrower terminal wraps whole lines.
WIDTH = 1000
HEADINGS = (
    "backend", "mean", "CV", "p95", "gap", "overlap", "runs", "length mm", "print s", "printable", "clear mm",
    "planned in s",
)  # fmt: skip
TEXT_COLUMNS = {"part", "backend", "printable"}


def comparison_table(parts: Sequence[Comparison | FailedPart]) -> str:
    """Return the table and, below it, what it means and why something is missing.

    Mean, CV and p95 are of the spacing over the wanted one; gap is the share of the area farther than 0.55 spacings
    from every path, overlap the share within 0.45 spacings of two stretches.
    """
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table

    several = len(parts) > 1
    table = Table(box=SIMPLE_HEAD, title=_title(parts), title_justify="left", title_style="")
    for heading in ("part", *HEADINGS) if several else HEADINGS:
        table.add_column(heading, justify="left" if heading in TEXT_COLUMNS else "right", no_wrap=True)
    notes: list[str] = []
    mind: list[str] = []
    for part in parts:
        name = part.job.surface.name
        for row in _rows(part):
            table.add_row(*((name, *row) if several else row))
        table.add_section()
        notes += [f"{name}: {reason}" for reason in _reasons(part)] if several else _words(part)
        mind += _cautions(part)
    buffer = io.StringIO()
    Console(file=buffer, width=WIDTH, highlight=False).print(table)
    return "\n".join([*(line.rstrip() for line in buffer.getvalue().splitlines()), *notes, *dict.fromkeys(mind)])


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
    return f"{named}, paths {' / '.join(spacings)} mm apart; mean and p95 are multiples of that"


def _rows(part: Comparison | FailedPart) -> list[tuple[str, ...]]:
    if isinstance(part, FailedPart):
        return [("-", *("-" for _ in HEADINGS[1:9]), "failed", "-", "-")]
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
        f"{measured.overlap:.2%}",
        str(plan.toolpath.curves.count),
        f"{measured.length:.0f}",
        "-" if robot is None else f"{robot.trajectory.duration:.0f}",
        printable,
        "-" if robot is None else f"{robot.clearance.smallest:.2f}",
        f"{outcome.planning_time:.1f}",
    )


def _refused_row(name: str) -> tuple[str, ...]:
    return (name, *("-" for _ in HEADINGS[1:9]), "refused", "-", "-")


def _words(part: Comparison | FailedPart) -> Sequence[str]:
    return [part.reason] if isinstance(part, FailedPart) else verdict(part)


def _reasons(part: Comparison | FailedPart) -> list[str]:
    """Say why something is missing in the rows of a part."""
    if isinstance(part, FailedPart):
        return [part.reason]
    unprinted = [(name, outcome.not_printable) for name, outcome in part.planned if outcome.not_printable is not None]
    return [
        *(f"{name} could not plan: {reason}" for name, reason in part.refused),
        *(f"{name} cannot be printed: {reason}" for name, reason in unprinted),
    ]


def _cautions(part: Comparison | FailedPart) -> list[str]:
    robots = [outcome.plan.robot for _, outcome in part.planned] if isinstance(part, Comparison) else []
    for robot in robots:
        if robot is not None:
            not_checked = f"not checked: {', '.join(robot.clearance.not_checked)}"
            return [not_checked, *placement_warnings(robot.placement)]
    return []
