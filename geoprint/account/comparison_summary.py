"""From comparisons to what compare.json says of them, with what is said of each plan, and the report page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Literal

import numpy as np

from geoprint.account.compared.pictures import ComparisonPictures, comparison_pictures
from geoprint.account.evenness import record_evenness
from geoprint.account.part_report import part_report
from geoprint.account.prints.attitudes import print_seconds
from geoprint.account.prints.expected import in_print, record_apart
from geoprint.account.records.comparison import (
    ComparisonRecord,
    FailedRecord,
    PartRecord,
    PathDistancesRecord,
    PlannedRecord,
    RefusedRecord,
    ToldComparison,
)
from geoprint.account.records.plan import PlanRecord
from geoprint.account.summary import record_plan
from geoprint.account.verdict import ranked, verdict
from geoprint.model import FloatArray
from geoprint.quality import agreement
from geoprint.report import html_report
from geoprint.results import Comparison, FailedPart, Plan, Planned

# Version of the layout of compare.json; a change that breaks a reader raises it.
COMPARISON_SCHEMA = 9
# Faces that the report draws in all, and at least of each part: more are not seen, and make the file heavy.
VIEW_FACES = 100_000
FEWEST_VIEW_FACES = 10_000


def tell_comparison(parts: Sequence[Comparison | FailedPart]) -> ToldComparison:
    """Return what is said of compared parts, at least one: the source of compare.json, table, report and bundles."""
    plans = tuple(
        {name: record_plan(outcome.plan) for name, outcome in part.planned} if isinstance(part, Comparison) else {}
        for part in parts
    )
    told = tuple(
        _part(part, of)
        if isinstance(part, Comparison)
        else FailedRecord(part=part.job.surface.name, failed=part.reason)
        for part, of in zip(parts, plans, strict=True)
    )
    seconds = tuple(
        {name: outcome.planning_time for name, outcome in part.planned} if isinstance(part, Comparison) else {}
        for part in parts
    )
    record = ComparisonRecord(schema=COMPARISON_SCHEMA, version=version("geoprint"), parts=told)
    return ToldComparison(record, plans, seconds)


def comparison_report(
    parts: Sequence[Comparison | FailedPart],
    told: ToldComparison,
    *,
    pictures: Sequence[ComparisonPictures | None],
    command: Literal["compare", "plan"] = "compare",
) -> bytes:
    """Return report.html: verdict, figures and a 3D scene for each part, in one file that opens offline.

    Args:
        parts: what was compared, at least one of them with success.
        told: their figures.
        pictures: theirs; None of one that failed.
        command: that it is of.
    """
    each = zip(parts, told.record.parts, told.plans, pictures, strict=True)
    compared = [
        (part, record, plans, drawn)
        for part, record, plans, drawn in each
        if isinstance(part, Comparison) and isinstance(record, PartRecord) and drawn is not None
    ]
    named = compared[0][1].part if len(parts) == 1 else f"{len(parts)} parts"
    faces = max(VIEW_FACES // len(compared), FEWEST_VIEW_FACES)
    return html_report(
        [part_report(part, record, plans, pictures=drawn, faces=faces) for part, record, plans, drawn in compared],
        title=f"geoprint {command}: {named}",
        failed=[(record.part, record.failed) for record in told.record.parts if isinstance(record, FailedRecord)],
    )


def plan_report(plan: Plan) -> tuple[PlanRecord, Mapping[str, bytes], bytes]:
    """Return what plan.json says of a plan, the pictures of its charts by file name, and report.html of it alone."""
    name = plan.job.backend
    alone = Comparison(plan.job, plan.workpiece, ((name, Planned(plan, plan.not_printable)),))
    told = tell_comparison([alone])
    pictures = comparison_pictures(alone, draw=lambda drawings: [drawing() for drawing in drawings])
    page = comparison_report([alone], told, pictures=[pictures], command="plan")
    return told.plans[0][name], pictures.charts[name], page


def _part(part: Comparison, plans: Mapping[str, PlanRecord]) -> PartRecord:
    first = next(iter(plans.values()))
    rows = tuple(
        _row(name, outcome, plans[name])
        if isinstance(outcome, Planned)
        else RefusedRecord(backend=name, refused=outcome.reason)
        for name, outcome in part.outcomes
    )
    name, planned = part.workpiece.name, [outcome.plan for _, outcome in part.planned]
    in_pairs = record_apart([(backend, outcome.plan) for backend, outcome in part.planned])
    apart = agreement([plan.poses for plan in planned], spacing=planned[0].contours.spacing)
    return PartRecord(
        part=name,
        input=first.input,
        settings=first.settings.model_copy(update={"backend": None}),
        surface=first.surface,
        verdict=verdict(name, rows, printed=in_print(ranked(rows), in_pairs)),
        best=ranked(rows)[0].backend,
        backends=rows,
        printed_apart=in_pairs,
        path_distances_mm=PathDistancesRecord(
            backends=tuple(plans), hausdorff=_matrix(apart.hausdorff), mean=_matrix(apart.mean)
        ),
    )


def _matrix(values: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in np.asarray(values).tolist())


def _row(name: str, outcome: Planned, told: PlanRecord) -> PlannedRecord:
    plan = outcome.plan
    return PlannedRecord(
        backend=name,
        spacing_mm=plan.contours.spacing,
        uniformity=told.uniformity or record_evenness(outcome.uniformity, distance=plan.distance),
        paths=told.paths,
        deposition=told.deposition,
        overhang=told.overhang,
        patches=told.patches,
        middles=told.middles,
        printable=bool(plan.robot) if plan.job.robot else None,
        not_printable=outcome.not_printable,
        not_reached=dict(outcome.lost),
        print_time_s=print_seconds(plan),
        smallest_clearance_mm=min((robot.clearance.smallest for robot in plan.robot), default=None),
        warnings=told.warnings,
    )
