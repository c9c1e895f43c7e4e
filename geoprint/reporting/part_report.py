"""A comparison as the report page shows it: its table, quantity by quantity, and its parts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TypeVar, cast

import numpy as np
from scipy.spatial import KDTree

from geoprint.config import SourceTable
from geoprint.distance import backend, predicted_spacing
from geoprint.geometry import in_words
from geoprint.model import IntArray
from geoprint.reporting.cautions import fibres_text, patch_evenness, said_once
from geoprint.reporting.evenness import expected_rows, overhang_rows
from geoprint.reporting.evidence import NOT_SIMULATED, WORDS, evidence_rows, of_all
from geoprint.reporting.features import feature_rows, feature_sections
from geoprint.reporting.metrics import CATALOGUE, COVERED_ONCE, THICKNESS
from geoprint.reporting.pictures import ComparisonPictures, coverage_panel
from geoprint.reporting.records.comparison import PartRecord, PlannedRecord
from geoprint.reporting.records.evenness import EvennessRecord
from geoprint.reporting.records.evidence import STAGES
from geoprint.reporting.records.plan import PlanRecord, SettingsRecord
from geoprint.reporting.records.rounding import as_json
from geoprint.reporting.replaying import at_rest, machine, motion_shades, replay
from geoprint.reporting.values import (
    COVERED,
    GAP,
    OVERLAP,
    BackendView,
    Machine,
    PartReport,
    PathDistances,
    Picture,
    Row,
)
from geoprint.reporting.view import ViewSurface, view_surface
from geoprint.results import Comparison, Plan, Planned

# The table of a comparison on the report page: one row a quantity, one column a backend.


_T = TypeVar("_T")

# What the rows on what people see mean in a page that is written before anybody can have seen it.
SEEN_LATER = "when this page was written; `geoprint check` lists what people have recorded since"
# What the report leaves out, because it is the same in every column and too long for one.
SAID_ELSEWHERE = "the run sheet lists what simulation cannot show"


def report_table(
    rows: Sequence[PlannedRecord], record: Mapping[str, PlanRecord], plans: Sequence[Plan]
) -> tuple[Row, ...]:
    """Return the rows; the best values of a row are marked where backends differ in what is printed.

    Args:
        rows: of compare.json, a column each.
        record: what is said of their plans, by backend.
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
        table += _chart([record[row.backend] for row in rows], plans)
    if rows[0].printable is not None:
        table += [*_robot(rows), *evidence_table([record[row.backend] for row in rows])]
    return (*table, *feature_rows([row.features for row in rows]))


def evenness_rows(record: Sequence[EvennessRecord]) -> list[Row]:
    """Return a row for each figure of the catalogue that was measured of any of some paths; the best one is marked."""
    return [
        _row(
            "Evenness", metric.label, metric.meaning, record, metric.text,
            badness=None if metric.lower_is_better is None else metric.badness, decides=metric.decides,
        )
        for metric in CATALOGUE
        if any(metric.of(each) is not None for each in record)
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
            group, "stops during deposit", "at sharp corners, with the valve open", rows,
            lambda r: str(r.paths.stops_while_laying), badness=lambda r: r.paths.stops_while_laying,
        ),
        *_fibres(rows),
    ]  # fmt: skip


def _fibres(rows: Sequence[PlannedRecord]) -> list[Row]:
    """Return a row that says how fibres run; none where paths follow no lines."""
    if any(row.paths.fibres is None for row in rows):
        return []
    return [_row("Path", "fibres", "", rows, lambda r: "-" if r.paths.fibres is None else fibres_text(r.paths.fibres))]


def _chart(record: Sequence[PlanRecord], plans: Sequence[Plan]) -> list[Row]:
    def predicted(plan: Plan) -> str:
        if not plan.flattenings:
            return "-"
        found = predicted_spacing(plan.workpiece.surface, plan.flat_surface, plan.contours.curves.points)
        low, high = np.percentile(found, [5, 95]).tolist()
        return f"{low:.3f} - {high:.3f}"

    scales = [None if plan.chart is None else plan.chart.area_scale for plan in record]
    between = tuple("-" if scale is None else f"{scale.p1:.2f} - {scale.p99:.2f}" for scale in scales)
    spacings = tuple(predicted(plan) for plan in plans)
    group, one_over = "Flattening", "one over its scale of length"
    return [
        Row(group, "area scale of the UV map, 1st and 99th percentile", "1 on a plane", between),
        Row(group, "spacing predicted by the UV map, 5th and 95th percentile", one_over, spacings),
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


def evidence_table(record: Sequence[PlanRecord]) -> list[Row]:
    """Return how far each program was proven when the page was written; what people see later `geoprint check` says."""
    proven = [[robot.evidence for robot in plan.robot] for plan in record]
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


# A comparison as the report page shows it.


# Faces in all views of a part: finer than can be seen, and every one costs time when the page opens.
VIEWED_FACES = 60_000
# Units of settings by the ends of their keys, the longest first.
UNITS = {"_mm_s": "mm/s", "_mm": "mm", "_deg": "degrees", "_kpa": "kPa", "_s": "s"}


def part_report(
    comparison: Comparison,
    record: PartRecord,
    plans: Mapping[str, PlanRecord],
    *,
    pictures: ComparisonPictures,
    faces: int,
) -> PartReport:
    """Return what the report page says of a comparison.

    Args:
        comparison: with one planned backend or more.
        record: what compare.json says of it.
        plans: what plan.json says of each plan, by backend.
        pictures: of the comparison.
        faces: of the surface that is drawn, at most.
    """
    workpiece, planned = comparison.workpiece, comparison.planned
    first = planned[0][1].plan
    spacing = first.contours.spacing
    view = view_surface(workpiece.surface, faces=min(faces, VIEWED_FACES // len(planned)))
    apart = record.path_distances_mm
    return PartReport(
        name=record.part,
        verdict=record.verdict,
        cautions=_cautions(plans),
        overview=_overview(record),
        surface=view.surface,
        R_view_work=workpiece.upright,
        spacing=spacing,
        machine=_machine(comparison),
        winner=[row.backend for row in record.planned].index(record.best),
        backends=tuple(_view(name, outcome, view, still=pictures.stills[name]) for name, outcome in planned),
        refused=tuple((row.backend, row.refused) for row in record.refused),
        table=report_table(record.planned, plans, [outcome.plan for _, outcome in planned]),
        path_distances=PathDistances(apart.backends, np.array(apart.hausdorff), np.array(apart.mean))
        if len(planned) > 1
        else None,
        pictures=tuple(_pictures(planned, pictures)),
        settings=_settings(record.settings),
        inputs=tuple((file.name, file.sha256) for file in (record.input, record.input.body) if file is not None),
        critical_deg=float(np.degrees(workpiece.cell.critical_overhang)),
        sections=feature_sections({name: outcome.plan for name, outcome in planned}),
    )


def _machine(comparison: Comparison) -> Machine | None:
    """Return the arm over the part as the first plan with a program has it; None where there is none."""
    workpiece = comparison.workpiece
    robots = [robot for _, outcome in comparison.planned for robot in outcome.plan.robot]
    if not robots:
        return None
    return machine(
        workpiece.cell,
        T_base_work=at_rest(workpiece.cell, robots[0].placement),
        body=workpiece.body,
        cell_file=comparison.job.cell,
    )


def _pictures(planned: Sequence[tuple[str, Planned]], pictures: ComparisonPictures) -> Iterator[Picture]:
    """Yield the figures that are not interactive: the lines that paths follow, then those of each backend."""
    # They are the same for every backend.
    if pictures.lines is not None:
        yield Picture("The lines that paths follow, and their singular points with the index", "png", pictures.lines)
    for name, outcome in planned:
        charts, switching = pictures.charts[name].values(), pictures.switching[name]
        for number, chart in enumerate(charts, start=1):
            which = f", patch {number}" if len(charts) > 1 else ""
            yield Picture(f"{name}{which}: UV map, distance image and level curves", "png", chart)
        for number, (robot, drawn) in enumerate(zip(outcome.plan.robot, switching, strict=True), start=1):
            which = f", attitude {number}" if len(switching) > 1 else ""
            on = "the lamp is on and the vacuum draws" if robot.switching.vacuum.size else "and the lamp is on"
            yield Picture(f"{name}{which}: when material is planned, flows, {on}", "png", drawn)


def _view(name: str, outcome: Planned, view: ViewSurface, *, still: bytes) -> BackendView:
    plan, measured = outcome.plan, outcome.uniformity
    panel = coverage_panel(name, outcome)
    vertices = view.surface.vertices
    _, nearest = KDTree(panel.places).query(vertices)
    _, judged = KDTree(measured.judged_places).query(vertices)
    marks: IntArray = np.where(measured.gaps, GAP, np.where(measured.overlaps, OVERLAP, COVERED))
    caption = (
        f"{name}: paths {plan.contours.spacing:.3g} mm apart; {panel.caption}. Red: too close, blue: too far apart, "
        "grey: no neighbour, yellow: missed."
    )
    return BackendView(
        name=name,
        title=backend(name).factory.title,
        distance=plan.contours.distance.values[view.vertices],
        spacing_ratios=panel.ratios[np.asarray(nearest)],
        coverage=marks[np.asarray(judged)],
        places=panel.places,
        offsets=panel.offsets,
        ratios=panel.ratios,
        widths=np.broadcast_to(plan.contours.spacing * panel.widths, len(panel.places)),
        still=Picture(caption, "png", still),
        replay=replay(plan) if plan.robot else None,
        shades=motion_shades(plan, vertices) if plan.robot else None,
    )


def _cautions(plans: Mapping[str, PlanRecord]) -> tuple[str, ...]:
    """Say what nobody may overlook, by weight; what cannot be printed and why stands in the verdict."""
    robots = next((plan.robot for plan in plans.values() if plan.robot), ())
    warnings = said_once({name: plan.warnings for name, plan in plans.items()})
    notes = said_once({name: plan.notes for name, plan in plans.items()})
    details = said_once({name: plan.details for name, plan in plans.items()})
    return (
        *(f"Warning: {text}" for text in warnings),
        *(f"Note: {text}" for text in notes),
        *(f"Detail: {text}" for text in details),
        *(f"Not checked: {'; '.join(robot.clearance.not_checked)}." for robot in robots[:1]),
    )


def _overview(record: PartRecord) -> tuple[tuple[str, str], ...]:
    best = next(row for row in record.planned if row.backend == record.best)
    printable = [row.backend for row in record.planned if row.printable]
    return (
        ("covers best", best.backend),
        (COVERED_ONCE.label, COVERED_ONCE.text(best.uniformity)),
        (THICKNESS.label, THICKNESS.text(best.uniformity)),
        ("printable", "not asked" if best.printable is None else ", ".join(printable) or "none"),
    )


def printed_with(settings: SettingsRecord) -> tuple[tuple[str, str], ...]:
    """Return what the page of a print says of the plan and the cell that it was printed with."""
    return settings_facts(
        {name: getattr(settings, name) for name in ("spacing_mm", "cell", "needle_mm", "layer_height_mm")}
    )


def settings_facts(settings: Mapping[str, object]) -> tuple[tuple[str, str], ...]:
    """Return keys of plan.json in words, with their units, and their values, as every page writes them."""

    def text(value: object) -> str:
        if isinstance(value, bool):
            return "yes" if value else "no"
        return "none" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)

    return tuple((_with_unit(name), text(value)) for name, value in settings.items())


def _settings(record: SettingsRecord) -> tuple[tuple[str, str], ...]:
    values = as_json(record)
    settings = {name: value for name, value in values.items() if name not in {"patches", "source", "keep_outs"}}
    source, kept_out = values.get("source"), cast("list[list[object]]", values.get("keep_outs", []))
    regions = [region.model_dump(exclude_none=True).items() for region in record.patches]
    return (
        *settings_facts(settings),
        ("source", "border" if source is None else str(SourceTable.model_validate(source))),
        *(
            (f"patch {i}", ", ".join(f"{name} {value}" for name, value in each))
            for i, each in enumerate(regions, start=1)
        ),
        *((f"keep-out {i}", f"inside a curve of {len(each)} points") for i, each in enumerate(kept_out, start=1)),
    )


def _with_unit(key: str) -> str:
    """Return a key of plan.json in words, with its unit in brackets."""
    end = next((end for end in UNITS if key.endswith(end)), None)
    return key.replace("_", " ") if end is None else f"{key.removesuffix(end).replace('_', ' ')} [{UNITS[end]}]"
