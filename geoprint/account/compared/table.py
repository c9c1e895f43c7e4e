"""The table of a comparison on the report page: one row a quantity, one column a backend."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import numpy as np

from geoprint.account.cautions import fibres_text, patch_evenness
from geoprint.account.evidence import NOT_SIMULATED, WORDS, evidence_rows, of_all
from geoprint.account.metrics import CATALOGUE
from geoprint.account.prints.expected import expected_rows
from geoprint.account.prints.overhang import overhang_rows
from geoprint.account.records.comparison import PlannedRecord
from geoprint.account.records.evenness import EvennessRecord
from geoprint.account.records.evidence import STAGES
from geoprint.account.records.plan import PlanRecord
from geoprint.backends import predicted_spacing
from geoprint.report import Row
from geoprint.results import Plan
from geoprint.surfaces import in_words

_T = TypeVar("_T")

# What the rows on what people see mean in a page that is written before anybody can have seen it.
SEEN_LATER = "as this page was written; `geoprint check` tells what people recorded since"
# What the report leaves out, because it is the same in every column and too long for one.
SAID_ELSEWHERE = "the run sheet says what no simulation knows"


def report_table(
    rows: Sequence[PlannedRecord], told: Mapping[str, PlanRecord], plans: Sequence[Plan]
) -> tuple[Row, ...]:
    """Return the rows; the best values of a row are marked where backends differ in what is printed.

    Args:
        rows: of compare.json, a column each.
        told: what is said of their plans, by backend.
        plans: in the order of the columns.
    """
    headline, *others = evenness_rows([row.uniformity for row in rows])
    table = [
        headline,
        *expected_rows([row.uniformity.printed for row in rows]),
        *others,
        *_path(rows),
        *overhang_rows(rows),
        *_patches(rows),
    ]
    if any(plan.flattenings for plan in plans):
        table += _chart([told[row.backend] for row in rows], plans)
    if rows[0].printable is not None:
        table += [*_robot(rows), *evidence_table([told[row.backend] for row in rows])]
    return tuple(table)


def evenness_rows(told: Sequence[EvennessRecord]) -> list[Row]:
    """Return a row for each figure of the catalogue that was measured of any of some paths; the best one is marked."""
    return [
        _row(
            "Evenness", metric.label, metric.meaning, told, metric.text,
            badness=None if metric.lower_is_better is None else metric.badness, decides=metric.decides,
        )
        for metric in CATALOGUE
        if any(metric.of(each) is not None for each in told)
    ]  # fmt: skip


def _patches(rows: Sequence[PlannedRecord]) -> list[Row]:
    """Return a row for each of several patches."""
    if len(rows[0].patches) < 2:
        return []
    return [
        Row(
            f"Patch {number}", "spacing, variation (CV)",
            f"{same[0].area_mm2:.4g} mm2 about {in_words(np.array(same[0].place_mm, dtype=np.float64))}; runs "
            + " / ".join(f"{patch.runs[0] + 1} to {patch.runs[1] + 1}" for patch in same),
            tuple(patch_evenness(patch) for patch in same),
        )
        for number, same in enumerate(zip(*(row.patches for row in rows), strict=True), start=1)
    ]  # fmt: skip


def _path(rows: Sequence[PlannedRecord]) -> list[Row]:
    group = "Path"
    return [
        _row(group, "runs", "each starts and stops the dispenser", rows, lambda r: str(r.paths.runs)),
        _row(group, "length [mm]", "", rows, lambda r: f"{r.paths.deposit_mm:.0f}"),
        _row(
            group, "stops while laying", "at sharp corners, with the valve open", rows,
            lambda r: str(r.paths.stops_while_laying), badness=lambda r: r.paths.stops_while_laying,
        ),
        *_fibres(rows),
    ]  # fmt: skip


def _fibres(rows: Sequence[PlannedRecord]) -> list[Row]:
    """Return a row that says how fibres run; none where paths follow no lines."""
    if any(row.paths.fibres is None for row in rows):
        return []
    return [_row("Path", "fibres", "", rows, lambda r: "-" if r.paths.fibres is None else fibres_text(r.paths.fibres))]


def _chart(told: Sequence[PlanRecord], plans: Sequence[Plan]) -> list[Row]:
    def predicted(plan: Plan) -> str:
        if not plan.flattenings:
            return "-"
        found = predicted_spacing(plan.workpiece.surface, plan.flat_surface, plan.contours.curves.points)
        low, high = np.percentile(found, [5, 95]).tolist()
        return f"{low:.3f} - {high:.3f}"

    scales = [None if plan.chart is None else plan.chart.area_scale for plan in told]
    between = tuple("-" if scale is None else f"{scale.p1:.2f} - {scale.p99:.2f}" for scale in scales)
    spacings = tuple(predicted(plan) for plan in plans)
    group, one_over = "Flattening", "one over its scale of length"
    return [
        Row(group, "area scale of the chart, 1st and 99th percentile", "1 everywhere on a plane", between),
        Row(group, "spacing that the chart predicts, 5th and 95th percentile", one_over, spacings),
    ]


def _robot(rows: Sequence[PlannedRecord]) -> list[Row]:
    group = "Robot"
    return [
        _row(group, "printable", "", rows, lambda r: "yes" if r.printable else "no"),
        _row(
            group, "print time [s]", "", rows,
            lambda r: "-" if r.print_time_s is None else f"{r.print_time_s:.0f}", decides=True,
        ),
        _row(
            group, "smallest clearance [mm]", "tool to part and body, above the tip", rows,
            lambda r: "-" if r.smallest_clearance_mm is None else f"{r.smallest_clearance_mm:.2f}",
        ),
    ]  # fmt: skip


def evidence_table(told: Sequence[PlanRecord]) -> list[Row]:
    """Return how far each program was proven when the page was written; what people see later `geoprint check` says."""
    proven = [[robot.evidence for robot in plan.robot] for plan in told]
    each = [dict(evidence_rows(of_all(one), (), program_sha256="")) if one else {} for one in proven]
    names = dict.fromkeys(name for one in each for name in one if name != NOT_SIMULATED)
    meanings = {WORDS[STAGES[0]]: SEEN_LATER, "executed": SAID_ELSEWHERE}
    return [
        Row(
            "Evidence", name, meanings.get(name, ""),
            tuple(one.get(name, "no program") for one in each),
        )
        for name in names
    ]  # fmt: skip


def _row(
    group: str,
    quantity: str,
    meaning: str,
    rows: Sequence[_T],
    text: Callable[[_T], str],
    *,
    badness: Callable[[_T], float] | None = None,
    decides: bool = False,
) -> Row:
    values = tuple(text(row) for row in rows)
    if badness is None or len(set(values)) == 1:
        return Row(group, quantity, meaning, values, decides=decides)
    leading = values[int(np.argmin([badness(row) for row in rows]))]
    return Row(
        group, quantity, meaning, values, tuple(i for i, value in enumerate(values) if value == leading), decides
    )
