"""The comparison as a table that a person reads in a terminal."""

from __future__ import annotations

import io

from geoprint.pipeline.comparison import Comparison, Planned, Refused

# Wide enough for every column on one line; a narrower terminal wraps the reasons below the table, not the figures.
WIDTH = 124
HEADINGS = (
    "backend", "spacing mean", "CV", "p95", "uncovered", "runs", "length mm", "print s", "printable", "clearance mm",
    "planned in s",
)  # fmt: skip


def comparison_table(comparison: Comparison) -> str:
    """Return the table and, below it, why a backend is refused or its path cannot be printed.

    Spacing figures are ratios to the wanted spacing; uncovered is the share of the area farther than 0.55 spacings
    from every path.
    """
    from rich.console import Console
    from rich.table import Table

    table = Table(title=_title(comparison), title_justify="left", title_style="")
    for heading in HEADINGS:
        table.add_column(heading, justify="left" if heading in {"backend", "printable"} else "right", no_wrap=True)
    for name, outcome in comparison.outcomes:
        table.add_row(*(_refused_row(name) if isinstance(outcome, Refused) else _row(name, outcome)))
    buffer = io.StringIO()
    Console(file=buffer, width=WIDTH, highlight=False).print(table)
    return "\n".join([buffer.getvalue().rstrip(), *_notes(comparison)])


def _title(comparison: Comparison) -> str:
    spacings = {
        f"{outcome.plan.contours.spacing:.3g}" for _, outcome in comparison.outcomes if isinstance(outcome, Planned)
    }
    return f"{comparison.job.surface.name}, paths {' / '.join(sorted(spacings))} mm apart"


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


def _notes(comparison: Comparison) -> list[str]:
    notes: list[str] = []
    for name, outcome in comparison.outcomes:
        if isinstance(outcome, Refused):
            notes.append(f"{name} refused: {outcome.reason}")
        elif outcome.not_printable is not None:
            notes.append(f"{name} not printable: {outcome.not_printable}")
    robots = [outcome.plan.robot for _, outcome in comparison.outcomes if isinstance(outcome, Planned)]
    for robot in [robot for robot in robots if robot is not None][:1]:
        notes.append(f"not checked: {', '.join(robot.clearance.not_checked)}")
        if not robot.placement.calibrated:
            notes.append("PLACEMENT NOT CALIBRATED: the programs run only dry.")
    return notes
