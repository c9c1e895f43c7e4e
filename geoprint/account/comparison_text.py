"""What a person reads of comparisons: the table in a terminal, and in plain words what it means."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence

from geoprint.account.comparison_record import FailedRecord, PartRecord, PlannedRecord, RefusedRecord, ToldComparison
from geoprint.account.plan_record import PlanRecord
from geoprint.account.plan_text import placement_warnings

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
    return (
        row.backend,
        f"{measured.spacing.mean:.3f}",
        f"{measured.spacing.cv:.2%}",
        f"{measured.spacing.p95:.3f}",
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


# Spacing that varies by less than this is even enough for any bead: its width varies by no more.
EVEN_ENOUGH = 0.02
# Backends whose variation differs by less than this are equally even.
SAME = 0.002
# Uncovered area below this share is not worth a word.
NOTABLE_GAP = 0.001


def verdict(part: str, rows: Sequence[PlannedRecord | RefusedRecord]) -> tuple[str, ...]:
    """Return sentences that say which backend covers the part more evenly, whether it matters, and what prints.

    The first one decides; the last ones name what is not comparable.

    Args:
        part: its name.
        rows: a backend each, at least one that planned.
    """
    planned = [row for row in rows if isinstance(row, PlannedRecord)]
    refused = [row for row in rows if isinstance(row, RefusedRecord)]
    ranked = sorted(planned, key=_cv)
    return (
        _evenness(part, ranked, alone=not refused),
        *_gaps(ranked),
        *_printing(ranked),
        *_levels(ranked),
        *(f"{row.backend} could not plan on this part: {row.refused}" for row in refused),
    )


def _cv(row: PlannedRecord) -> float:
    return row.uniformity.spacing.cv


def _evenness(part: str, ranked: Sequence[PlannedRecord], *, alone: bool) -> str:
    name, best, worst = ranked[0].backend, _cv(ranked[0]), _cv(ranked[-1])
    spread = f"its spacing varies by {best:.1%} (standard deviation over mean)"
    if len(ranked) == 1:
        # Alone, no other was asked.
        return f"{'' if alone else 'Only '}{name} covers {part}; {spread}."
    others = _listed([f"that of {row.backend} by {_cv(row):.1%}" for row in ranked[1:]])
    if worst - best < SAME:
        names = _listed([row.backend for row in ranked])
        first = f"the spacing of {name} varies by {best:.1%} (standard deviation over mean)"
        return f"{names} cover {part} equally evenly: {first}, {others}."
    enough = " All of them are even enough to print." if worst <= EVEN_ENOUGH else ""
    return f"{name} covers {part} most evenly: {spread}, {others}.{enough}"


def _gaps(ranked: Sequence[PlannedRecord]) -> list[str]:
    return [
        f"{row.backend} leaves {row.uniformity.gap:.1%} of the area farther than 0.55 spacings from every path."
        for row in ranked
        if row.uniformity.gap >= NOTABLE_GAP
    ]


def _printing(ranked: Sequence[PlannedRecord]) -> list[str]:
    if ranked[0].printable is None:
        return ["Whether the robot can print them was not asked."]
    taken = [f"{row.print_time_s:.0f} s with {row.backend}" for row in ranked if row.print_time_s is not None]
    said = [f"Printing takes {_listed(taken)}."] if taken else []
    unprinted = [row for row in ranked if row.not_printable is not None]
    return said + [f"{row.backend} cannot be printed: {row.not_printable}" for row in unprinted]


def _levels(ranked: Sequence[PlannedRecord]) -> list[str]:
    spacings = [row.spacing_mm for row in ranked]
    if len({row.paths.levels for row in ranked}) > 1:
        counted = _listed([f"{row.paths.levels} with {row.backend}" for row in ranked])
        why = "because each backend measures its own distance to the middle"
        return [f"The number of levels differs ({counted}), {why}; what is compared is evenness, not level by level."]
    if max(spacings) > 1.005 * min(spacings):
        wanted = _listed([f"{row.spacing_mm:.3g} mm with {row.backend}" for row in ranked])
        return [f"Equal rounds mean different spacings ({wanted}): figures are ratios to each one's own."]
    return []


def _listed(phrases: Sequence[str]) -> str:
    return phrases[0] if len(phrases) == 1 else f"{', '.join(phrases[:-1])} and {phrases[-1]}"
