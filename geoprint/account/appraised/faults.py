"""What is wrong in a photographed print, and where: gaps, blobs and thin stretches of runs, or breaks of lines."""

from __future__ import annotations

import numpy as np

from geoprint.appraisal import AppraisedPhotograph, OnPlan

# Rows on what is held against a plan, and on what is not.
PLAN_COLUMNS = ("run", "fault", "from mm", "to mm", "length mm", "x mm", "y mm", "z mm", "u px", "v px")
LINE_COLUMNS = ("line", "fault", "from px", "to px", "length px", "u px", "v px")


def fault_rows(each: AppraisedPhotograph) -> list[tuple[str, ...]]:
    """Return a row a fault, run after run or line after line; the places are those of its middle.

    Returns:
        Cells below `PLAN_COLUMNS` where the photograph is held against a plan, else below `LINE_COLUMNS`.
    """
    return _of_lines(each) if each.on_plan is None else _of_runs(each.on_plan)


def _of_runs(found: OnPlan) -> list[tuple[str, ...]]:
    held, plan = found.held, found.held.plan
    rows: list[tuple[str, ...]] = []
    for run in np.unique(plan.runs).tolist():
        own = np.flatnonzero(plan.runs == run)
        whole = held.whole(run)
        ends = (0.0, float(plan.lengths[own].sum()))
        kinds = (
            ("gap", held.gaps(run)), ("blob", held.blobs(run)), ("thin", held.thin(run)),
            *(() if whole is None else ((whole, [ends]),)),
        )  # fmt: skip
        faults = sorted((start, end, kind) for kind, stretches in kinds for start, end in stretches)
        for start, end, kind in faults:
            middle = own[np.argmin(np.abs(plan.arcs[own] - 0.5 * (start + end)))]
            pixel = found.camera.seen(plan.places[middle][None])[0]
            rows.append((
                str(run + 1), kind, *(f"{value:.1f}" for value in (start, end, end - start, *plan.places[middle])),
                *(f"{value:.0f}" for value in pixel),
            ))  # fmt: skip
    return rows


def _of_lines(each: AppraisedPhotograph) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for line, bead in enumerate(each.beads, start=1):
        arcs = np.concatenate([[0.0], np.cumsum(bead.steps)])
        for first, last in bead.breaks:
            start, end, pixel = float(arcs[first]), float(arcs[last]), bead.middles[(first + last) // 2]
            rows.append(
                (str(line), "break", *(f"{value:.0f}" for value in (start, end, end - start, *pixel)))
            )  # fmt: skip
    return rows
