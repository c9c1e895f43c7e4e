"""What compare.json and a person's terminal say of a comparison."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, final

import numpy as np

from geoprint.errors import percent
from geoprint.metrics import agreement
from geoprint.model import FloatArray
from geoprint.reporting.cautions import coverage_warnings, evener_backends, said_once
from geoprint.reporting.evenness import expected_text, in_print, record_apart, record_evenness
from geoprint.reporting.features import feature_lines
from geoprint.reporting.metrics import COVERED_ONCE, FOLLOWING, GAP, HOLE, OFF, OVERLAP, THICKNESS
from geoprint.reporting.page import html_report
from geoprint.reporting.part_report import part_report
from geoprint.reporting.pictures import ComparisonPictures, comparison_pictures
from geoprint.reporting.plan import record_plan
from geoprint.reporting.prints import print_seconds
from geoprint.reporting.records.comparison import (
    ComparisonRecord,
    FailedRecord,
    PartRecord,
    PathDistancesRecord,
    PlannedRecord,
    RecordedComparison,
    RefusedRecord,
)
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.rounding import stamp
from geoprint.reporting.tables import GAP as SEAM, Cells, fitting, grid, left_out, line_width, marked_lines
from geoprint.reporting.verdict import medial_axis_sentences, ranked, verdict
from geoprint.results import Comparison, FailedPart, Plan, Planned

# From comparisons to what compare.json says of them, with what is said of each plan, and the report page.


# Faces that the report draws in all, and at least of each part: more are not seen, and make the file heavy.
VIEW_FACES = 100_000
FEWEST_VIEW_FACES = 10_000


def recorded_comparison(parts: Sequence[Comparison | FailedPart]) -> RecordedComparison:
    """Return what is said of compared parts, at least one: the source of compare.json, table, report and bundles."""
    plans = tuple(
        {name: record_plan(outcome.plan) for name, outcome in part.planned} if isinstance(part, Comparison) else {}
        for part in parts
    )
    recorded = tuple(
        _part(part, of)
        if isinstance(part, Comparison)
        else FailedRecord(part=part.job.surface.name, failed=part.reason)
        for part, of in zip(parts, plans, strict=True)
    )
    seconds = tuple(
        {name: outcome.planning_time for name, outcome in part.planned} if isinstance(part, Comparison) else {}
        for part in parts
    )
    record = ComparisonRecord(**stamp(ComparisonRecord), parts=recorded)
    return RecordedComparison(record, plans, seconds)


def comparison_report(
    parts: Sequence[Comparison | FailedPart],
    recorded: RecordedComparison,
    *,
    pictures: Sequence[ComparisonPictures | None],
    command: Literal["compare", "plan"] = "compare",
) -> bytes:
    """Return report.html: verdict, figures and a 3D scene for each part, in one file that opens offline.

    Args:
        parts: what was compared, at least one of them with success.
        recorded: their figures.
        pictures: theirs; None of one that failed.
        command: that it is of.
    """
    each = zip(parts, recorded.record.parts, recorded.plans, pictures, strict=True)
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
        failed=[(record.part, record.failed) for record in recorded.record.parts if isinstance(record, FailedRecord)],
    )


def plan_report(plan: Plan) -> tuple[PlanRecord, Mapping[str, bytes], bytes]:
    """Return what plan.json says of a plan, the pictures of its charts by file name, and report.html of it alone."""
    name, alone = plan.job.backend, compared_alone(plan)
    record = recorded_comparison([alone])
    pictures = comparison_pictures(alone, draw=lambda drawings: [drawing() for drawing in drawings])
    page = comparison_report([alone], record, pictures=[pictures], command="plan")
    return record.plans[0][name], pictures.charts[name], page


def compared_alone(plan: Plan) -> Comparison:
    """Return a plan as the comparison of its one backend, which is reported alike."""
    return Comparison(plan.job, plan.workpiece, ((plan.job.backend, Planned(plan, plan.not_printable)),))


def _part(part: Comparison, plans: Mapping[str, PlanRecord]) -> PartRecord:
    first = next(iter(plans.values()))
    rows = tuple(
        _planned_row(name, outcome, plans[name])
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


def _planned_row(name: str, outcome: Planned, record: PlanRecord) -> PlannedRecord:
    plan = outcome.plan
    return PlannedRecord(
        backend=name,
        spacing_mm=plan.contours.spacing,
        uniformity=record.uniformity or record_evenness(outcome.uniformity, distance=plan.distance),
        paths=record.paths,
        deposition=record.deposition,
        overhang=record.overhang,
        patches=record.patches,
        middles=record.middles,
        features=record.features,
        printable=bool(plan.robot) if plan.job.robot else None,
        not_printable=outcome.not_printable,
        not_reached=dict(outcome.lost),
        print_time_s=print_seconds(plan),
        smallest_clearance_mm=min((robot.clearance.smallest for robot in plan.robot), default=None),
        warnings=record.warnings,
    )


# What a person reads of comparisons: the table in a terminal, and in plain words what it means.


# What the columns show, and how much each matters: where the terminal is narrow, the highest numbers go first.
METRICS = (THICKNESS, FOLLOWING, COVERED_ONCE, GAP, OVERLAP, HOLE, OFF)
COLUMNS = {
    "backend": 0, THICKNESS.column: 1, FOLLOWING.column: 8, "printed CV": 5, COVERED_ONCE.column: 2, GAP.column: 3,
    OVERLAP.column: 4, HOLE.column: 9, OFF.column: 11, "overhang": 14, "runs": 7, "length mm": 10, "print s": 6,
    "printable": 3, "clear mm": 12, "planned in s": 13,
}  # fmt: skip
LEFT_ALIGNED = {"part", "backend", "printable"}
# Narrower than this a table tells nothing: each backend has a line of words.
NARROWEST_TABLE = 60
# What the column says of a printable backend, in words.
NOT_ASKED = "not asked"
PRINTABLE = {"yes": "printable", "no": "not printable", NOT_ASKED: ""}
_IN_WORDS = (THICKNESS.column, GAP.column, OVERLAP.column)
_NONE = "-"


@final
@dataclass(frozen=True, slots=True)
class _Rows:
    """The rows of one part, a backend each, by the names of the columns."""

    part: str
    cells: tuple[Cells, ...]


def comparison_table(record: RecordedComparison, *, width: int | None = None, verbose: bool = False) -> str:
    """Return the table and, below it, what it means, why something is missing and what to mind.

    What the figures of evenness mean stands in `geoprint.reporting.metrics`; printed CV is the mean of prints and, in
    brackets, what 95 of 100 of them have; overhang is the share of the deposit beyond the critical angle.

    Args:
        record: what is said of the comparison.
        width: letters in a line, where they are counted; columns that do not fit are left out, and below 60 there is
            a line of words for each backend instead.
        verbose: whether to list all that was not checked.
    """
    parts = record.record.parts
    several = len(parts) > 1
    rows = [_Rows(part.part, tuple(_cells(part, took))) for part, took in zip(parts, record.seconds, strict=True)]
    planned = [row for part in parts if isinstance(part, PartRecord) for row in part.planned]
    # What overhangs by an angle that nobody has stated is a detail.
    stated = verbose or any(row.overhang is not None and row.overhang.stated for row in planned)
    columns = [name for name in COLUMNS if stated or name != "overhang"]
    said: list[str] = []
    for part in parts:
        named = {row.backend: row.features for row in part.planned} if isinstance(part, PartRecord) else {}
        said += feature_lines(named)
        said += (
            [*_decision(part), *(f"{part.part}: {reason}" for reason in _reasons(part))] if several else _words(part)
        )
    table = _table(rows, width=width, columns=columns)
    return "\n".join([_title(parts), "", *table, "", *said, *_mind(record, verbose=verbose)])


def _table(parts: Sequence[_Rows], *, width: int | None, columns: Sequence[str]) -> Iterator[str]:
    """Return the lines of the table, with as many of the columns as fit."""
    if width is not None and width < NARROWEST_TABLE:
        yield from _lines(parts)
        return
    several = len(parts) > 1
    beside = [{"part": part.part, **cells} for part in parts for cells in part.cells]
    names = ["part", *columns] if several else columns
    if width is None or line_width(names, beside) <= width:
        yield from grid(names, [beside], left=LEFT_ALIGNED)
        return
    # Who can be printed goes early where nobody asked.
    asked = any(cells["printable"] != NOT_ASKED for cells in beside)
    weights = COLUMNS if asked else COLUMNS | {"printable": COLUMNS["print s"]}
    names = fitting(columns, beside, width=width - len(SEAM) * several, weights=weights)
    titles = [part.part if several else None for part in parts]
    yield from grid(names, [part.cells for part in parts], titles=titles, left=LEFT_ALIGNED)
    if names != columns:
        gone = left_out(columns, names, weights)
        yield from ("", f"columns left out at this width, see compare.json and timings.json: {gone}")


def _lines(parts: Sequence[_Rows]) -> Iterator[str]:
    """Return a line for each backend, without a table."""
    several = len(parts) > 1
    for part in parts:
        if several:
            yield part.part
        for cells in part.cells:
            figures = [f"{name} {cells[name]}" for name in (*_IN_WORDS, "print s") if cells[name] != _NONE]
            said = PRINTABLE.get(cells["printable"], cells["printable"])
            yield f"{'  ' if several else ''}{cells['backend']}: {', '.join([*figures, said] if said else figures)}"


def _title(parts: tuple[PartRecord | FailedRecord, ...]) -> str:
    rows = [row for part in parts if isinstance(part, PartRecord) for row in part.planned]
    spacings = sorted({f"{row.spacing_mm:.3g}" for row in rows}, key=float)
    named = parts[0].part if len(parts) == 1 else f"{len(parts)} parts"
    return f"{named}, paths {' / '.join(spacings)} mm apart"


def _cells(part: PartRecord | FailedRecord, took: Mapping[str, float]) -> Iterator[Cells]:
    if isinstance(part, FailedRecord):
        yield _empty(_NONE, "failed")
        return
    for row in part.backends:
        yield _empty(row.backend, "refused") if isinstance(row, RefusedRecord) else _row(row, took[row.backend])


def _row(row: PlannedRecord, seconds: float) -> Cells:
    return {
        "backend": row.backend,
        **{metric.column: metric.text(row.uniformity) for metric in METRICS},
        "printed CV": expected_text(row.uniformity.printed, digits=1),
        "overhang": _NONE if row.overhang is None else percent(row.overhang.share, 1),
        "runs": str(row.paths.runs),
        "length mm": f"{row.paths.deposit_mm:.0f}",
        "print s": _NONE if row.print_time_s is None else f"{row.print_time_s:.0f}",
        "printable": NOT_ASKED if row.printable is None else "yes" if row.printable else "no",
        "clear mm": _NONE if row.smallest_clearance_mm is None else f"{row.smallest_clearance_mm:.2f}",
        "planned in s": f"{seconds:.1f}",
    }


def _empty(name: str, why: str) -> Cells:
    return {**dict.fromkeys(COLUMNS, _NONE), "backend": name, "printable": why}


def _words(part: PartRecord | FailedRecord) -> tuple[str, ...]:
    return (part.failed,) if isinstance(part, FailedRecord) else part.verdict


def _decision(part: PartRecord | FailedRecord) -> tuple[str, ...]:
    """Return the sentence that decides, of one part among several; it names the part."""
    return () if isinstance(part, FailedRecord) else part.verdict[:1]


def _reasons(part: PartRecord | FailedRecord) -> list[str]:
    """Say why something is missing in the rows of a part."""
    if isinstance(part, FailedRecord):
        return [part.failed]
    unprinted = [row for row in part.planned if row.not_printable is not None]
    return [
        *(f"{row.backend} could not plan: {row.refused}" for row in part.refused),
        *(f"the robot cannot print {row.backend}: {row.not_printable}" for row in unprinted),
    ]


def _mind(record: RecordedComparison, *, verbose: bool) -> list[str]:
    """Return what to mind of all parts, by weight; what of it the verdict or the table says is left out."""
    warnings = _of_all(record, lambda plan: [text for text in plan.warnings if text not in coverage_warnings(plan)])
    notes = _of_all(record, lambda plan: [text for text in plan.notes if text not in evener_backends(plan)])
    details = _of_all(
        record, lambda plan: [text for text in plan.details if text not in medial_axis_sentences(plan.middles)]
    )
    unchecked = [text for plans in record.plans for text in _unchecked(plans)]
    return marked_lines(warnings=warnings, notes=notes, details=details, not_checked=unchecked, verbose=verbose)


def _of_all(record: RecordedComparison, said: Callable[[PlanRecord], Sequence[str]]) -> list[str]:
    """Return what is said of the plans of all parts, each sentence once; what not all parts have names its part."""
    of_parts = [said_once({name: said(plan) for name, plan in plans.items()}) for plans in record.plans]
    planned = [sentences for sentences, plans in zip(of_parts, record.plans, strict=True) if plans]
    common = [text for text in of_parts[0] if all(text in sentences for sentences in planned)]
    own = [
        text if part.part in text else f"{part.part}: {text}"
        for part, sentences in zip(record.record.parts, of_parts, strict=True)
        for text in sentences
        if text not in common
    ]
    return [*common, *own]


def _unchecked(plans: Mapping[str, PlanRecord]) -> tuple[str, ...]:
    robots = next((plan.robot for plan in plans.values() if plan.robot), ())
    return tuple(dict.fromkeys(text for robot in robots for text in robot.clearance.not_checked))
