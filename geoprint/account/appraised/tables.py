"""The places behind the figures of an appraisal, as CSV: what other programs, and the next print, take up."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence

import numpy as np

from geoprint.appraisal import Appraisal, AppraisedPhotograph, OnPlan

# A row for each place of a line.
BEADS_COLUMNS = ("line", "u", "v", "seen", "width_px")
# A row for each stretch of a run.
STRETCHES_COLUMNS = (
    "run", "s_mm", "length_mm", "judged", "seen", "sized", "width_mm", "width_planned_mm", "offset_mm", "of_usual"
)  # fmt: skip


def appraisal_tables(found: Appraisal) -> dict[str, bytes]:
    """Return name and content of the tables of all photographs, by their numbers from 1."""
    tables: dict[str, bytes] = {}
    for number, each in enumerate(found.photographs, start=1):
        tables[f"lines-{number}.csv"] = _lines(each)
        if each.on_plan is not None:
            tables[f"stretches-{number}.csv"] = _stretches(each.on_plan)
    return tables


def _lines(each: AppraisedPhotograph) -> bytes:
    rows = [
        (line, f"{u:.2f}", f"{v:.2f}", int(seen), f"{width:.2f}")
        for line, bead in enumerate(each.beads, start=1)
        for (u, v), seen, width in zip(bead.middles, bead.seen, bead.widths, strict=True)
    ]
    return _written(BEADS_COLUMNS, rows)


def _stretches(found: OnPlan) -> bytes:
    held = found.held
    plan = held.plan
    rows = [
        (
            int(plan.runs[k]), f"{plan.arcs[k]:.3f}", f"{plan.lengths[k]:.3f}", int(held.judged[k]), int(held.seen[k]),
            int(held.sized[k]), f"{held.widths[k]:.4f}", f"{held.planned[k]:.4f}", f"{held.offsets[k]:.4f}",
            f"{held.relative[k]:.4f}",
        )
        for k in range(np.size(plan.runs))
    ]  # fmt: skip
    return _written(STRETCHES_COLUMNS, rows)


def _written(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return text.getvalue().encode("utf-8")
