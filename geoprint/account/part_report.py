"""A comparison as the report page shows it, with its table: one row a quantity, one column a backend."""

from __future__ import annotations

import platform
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version

import numpy as np
from scipy.spatial import KDTree

from geoprint.account.cautions import patch_evenness, said_once
from geoprint.account.evidence import NOT_SIMULATED, WORDS, evidence_rows
from geoprint.account.pictures import coverage_panel, coverage_picture, lines_picture, spread_of
from geoprint.account.prints.expected import expected_rows
from geoprint.account.prints.sides import of_spacing, side_rows
from geoprint.account.records.comparison import PartRecord, PlannedRecord
from geoprint.account.records.evidence import STAGES
from geoprint.account.records.plan import PlanRecord, SettingsRecord
from geoprint.account.records.rounding import as_json
from geoprint.account.replaying import machine, motion_shades, replay
from geoprint.backends import backend, predicted_spacing
from geoprint.config import Source
from geoprint.model import IntArray
from geoprint.report import (
    COVERED,
    GAP,
    OVERLAP,
    BackendView,
    PartReport,
    PathDistances,
    Picture,
    Row,
    ViewSurface,
    switching_figure,
    view_surface,
)
from geoprint.results import Comparison, Plan, Planned
from geoprint.surfaces import in_words

# Faces in all views of a part: finer than can be seen, and every one costs time when the page opens.
VIEWED_FACES = 60_000
# What the rows on what people see mean in a page that is written before anybody can have seen it.
SEEN_LATER = "as this page was written; `geoprint check` tells what people recorded since"
# What the report leaves out, because it is the same in every column and too long for one.
SAID_ELSEWHERE = "the run sheet says what no simulation knows"
# Packages whose version changes figures.
PACKAGES = ("geoprint", "numpy", "scipy", "numba", "toppra", "pin", "python-fcl")
# Units of settings by the ends of their keys, the longest first.
UNITS = {"_mm_s": "mm/s", "_mm": "mm", "_deg": "degrees", "_kpa": "kPa", "_s": "s"}


def part_report(
    comparison: Comparison,
    told: PartRecord,
    plans: Mapping[str, PlanRecord],
    *,
    charts: Mapping[str, Mapping[str, bytes]],
    faces: int,
) -> PartReport:
    """Return what the report page says of a comparison.

    Args:
        comparison: with one planned backend or more.
        told: what compare.json says of it.
        plans: what plan.json says of each plan, by backend.
        charts: the `chart_pictures` of each plan, by backend.
        faces: of the surface that is drawn, at most.
    """
    workpiece, planned = comparison.workpiece, comparison.planned
    first = planned[0][1].plan
    spacing = first.contours.spacing
    view = view_surface(workpiece.surface, faces=min(faces, VIEWED_FACES // len(planned)))
    apart = told.path_distances_mm
    robots = [robot for _, outcome in planned for robot in outcome.plan.robot[:1]]
    return PartReport(
        name=told.part,
        verdict=told.verdict,
        cautions=_cautions(plans),
        overview=_overview(told),
        surface=view.surface,
        R_view_work=workpiece.upright,
        spacing=spacing,
        machine=machine(workpiece, robots[0], cell_file=comparison.job.cell) if robots else None,
        winner=[row.backend for row in told.planned].index(told.best),
        backends=tuple(_view(name, outcome, view) for name, outcome in planned),
        refused=tuple((row.backend, row.refused) for row in told.refused),
        table=report_table(told.planned, plans, [outcome.plan for _, outcome in planned]),
        path_distances=PathDistances(apart.backends, np.array(apart.hausdorff), np.array(apart.mean))
        if len(planned) > 1
        else None,
        pictures=(
            *_lines(first),
            *(each for name, outcome in planned for each in _pictures(name, outcome.plan, [*charts[name].values()])),
        ),
        settings=_settings(told.settings),
        inputs=tuple((file.name, file.sha256) for file in (told.input, told.input.body) if file is not None),
        versions=(("Python", platform.python_version()), *((name, version(name)) for name in PACKAGES)),
    )


def _lines(plan: Plan) -> list[Picture]:
    """Return the picture of the lines that paths follow, the same for every backend; none where they follow none."""
    if plan.followed is None:
        return []
    caption = "The lines that paths follow, and the places about which these turn with their index"
    drawn = lines_picture(plan.workpiece, plan.followed, title="")
    return [Picture(caption, "png", drawn)]


def _pictures(name: str, plan: Plan, charts: Sequence[bytes]) -> list[Picture]:
    """Return the figures of one backend that are not interactive, its charts first."""
    pictures = [
        Picture(
            f"{name}{f', patch {number}' if len(charts) > 1 else ''}: chart, distance image and level curves",
            "png",
            chart,
        )
        for number, chart in enumerate(charts, start=1)
    ]
    for robot in plan.robot:
        found = robot.switching
        title = f"{name}: dispenser and lamp, simulated from the program as it was read back, with the cell's lags"
        drawn = switching_figure(found.deposits, found.material, found.lamp, found.vacuum, title=title)
        on = "the lamp is on and the vacuum draws" if found.vacuum.size else "and the lamp is on"
        pictures.append(Picture(f"{name}: when material is laid, flows, {on}", "png", drawn))
    return pictures


def _view(name: str, outcome: Planned, view: ViewSurface) -> BackendView:
    plan, measured = outcome.plan, outcome.uniformity
    panel = coverage_panel(name, outcome)
    vertices = view.surface.vertices
    _, nearest = KDTree(panel.places).query(vertices)
    _, judged = KDTree(measured.judged_places).query(vertices)
    marks: IntArray = np.where(measured.gaps, GAP, np.where(measured.overlaps, OVERLAP, COVERED))
    caption = (
        f"{name}: paths {plan.contours.spacing:.3g} mm apart; {spread_of(measured, digits=2)}, "
        f"{measured.uncovered:.2%} of the area uncovered. Red: too close, blue: too far apart, grey: outermost, "
        "yellow: uncovered."
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
        still=Picture(caption, "png", coverage_picture(plan.workpiece, [(name, outcome)], title="")),
        replay=replay(plan, plan.robot[0]) if plan.robot else None,
        shades=motion_shades(plan, plan.robot[0], vertices) if plan.robot else None,
    )


def _cautions(plans: Mapping[str, PlanRecord]) -> tuple[str, ...]:
    """Say what nobody may overlook, by weight; what cannot be printed and why stands in the verdict."""
    robots = next((plan.robot for plan in plans.values() if plan.robot), ())
    warnings = said_once({name: plan.warnings for name, plan in plans.items()})
    notes = said_once({name: plan.notes for name, plan in plans.items()})
    return (
        *(f"Warning: {text}" for text in warnings),
        *(f"Note: {text}" for text in notes),
        *(f"Not checked: {'; '.join(robot.clearance.not_checked)}." for robot in robots[:1]),
    )


def _overview(told: PartRecord) -> tuple[tuple[str, str], ...]:
    best = next(row for row in told.planned if row.backend == told.best)
    printable = [row.backend for row in told.planned if row.printable]
    return (
        ("covers best", best.backend),
        ("missed or laid twice", f"{best.uniformity.gap + best.uniformity.overlap:.2%}"),
        ("its spacing CV", of_spacing(best, lambda s: f"{s.cv:.2%}", "-")),
        ("printable", "not asked" if best.printable is None else ", ".join(printable) or "none"),
    )


def _settings(told: SettingsRecord) -> tuple[tuple[str, str], ...]:
    def text(value: object) -> str:
        if isinstance(value, bool):
            return "yes" if value else "no"
        return "none" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)

    settings = {name: value for name, value in as_json(told).items() if name not in {"patches", "source"}}
    source = as_json(told).get("source")
    regions = [region.model_dump(exclude_none=True).items() for region in told.patches]
    return (
        *((_with_unit(name), text(value)) for name, value in settings.items()),
        ("source", "border" if source is None else str(Source.model_validate(source))),
        *(
            (f"patch {i}", ", ".join(f"{name} {value}" for name, value in each))
            for i, each in enumerate(regions, start=1)
        ),
    )


def _with_unit(key: str) -> str:
    """Return a key of plan.json in words, with its unit in brackets."""
    end = next((end for end in UNITS if key.endswith(end)), None)
    return key.replace("_", " ") if end is None else f"{key.removesuffix(end).replace('_', ' ')} [{UNITS[end]}]"


def report_table(
    rows: Sequence[PlannedRecord], told: Mapping[str, PlanRecord], plans: Sequence[Plan]
) -> tuple[Row, ...]:
    """Return the rows; the best values of a row are marked where backends differ in what is printed.

    Args:
        rows: of compare.json, a column each.
        told: what is said of their plans, by backend.
        plans: in the order of the columns.
    """
    planned, *others = _evenness(rows)
    table = [planned, *side_rows(rows), *expected_rows(rows), *others, *_path(rows), *_patches(rows)]
    if any(plan.flattenings for plan in plans):
        table += _chart([told[row.backend] for row in rows], plans)
    if rows[0].printable is not None:
        table += [*_robot(rows), *evidence_table([told[row.backend] for row in rows])]
    return tuple(table)


def _evenness(rows: Sequence[PlannedRecord]) -> list[Row]:
    group = "Evenness"
    return [
        _row(
            group, "spacing, variation (CV)", "standard deviation over mean; 0% is perfectly even", rows,
            lambda r: of_spacing(r, lambda s: f"{s.cv:.2%}", "-"),
            badness=lambda r: of_spacing(r, lambda s: s.cv, 0.0), decides=True,
        ),
        _row(group, "spacing, mean", "1 is as wanted", rows,
            lambda r: of_spacing(r, lambda s: f"{s.mean:.3f}", "-"),
        ),
        _row(
            group, "spacing, 5th and 95th percentile", "nine tenths of the path lie between", rows,
            lambda r: of_spacing(r, lambda s: f"{s.p5:.3f} - {s.p95:.3f}", "-"),
            badness=lambda r: of_spacing(r, lambda s: s.p95 - s.p5, 0.0),
        ),
        _row(
            group, "within 5% of the wanted", "share of the path", rows,
            lambda r: of_spacing(r, lambda s: f"{s.within_5_percent:.1%}", "-"),
            badness=lambda r: of_spacing(r, lambda s: -s.within_5_percent, 0.0),
        ),
        _row(
            group, "area uncovered", "farther than 0.55 spacings from every path", rows,
            lambda r: f"{r.uniformity.gap:.2%}", badness=lambda r: r.uniformity.gap, decides=True,
        ),
        _row(
            group, "area overlapped", "within 0.45 spacings of two stretches of path", rows,
            lambda r: f"{r.uniformity.overlap:.2%}", badness=lambda r: r.uniformity.overlap,
        ),
        _row(
            group, "strip width, variation (CV)", "thickness error of a constant flow", rows,
            lambda r: f"{r.uniformity.width_cv:.2%}", badness=lambda r: r.uniformity.width_cv,
        ),
        _row(
            group, "layer thickness, variation (CV)", "constant flow / flow that follows the width, fronts apart", rows,
            _layer,
        ),
        _row(group, "measured by", "", rows, lambda r: r.uniformity.method),
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


def _layer(row: PlannedRecord) -> str:
    told = row.deposition
    cvs = () if told is None else (told.constant_flow.cv, told.following_flow.cv)
    return " / ".join("-" if cv is None else f"{cv:.2%}" for cv in cvs) or "-"


def _path(rows: Sequence[PlannedRecord]) -> list[Row]:
    group = "Path"
    return [
        _row(group, "runs", "each starts and stops the dispenser", rows, lambda r: str(r.paths.runs)),
        _row(group, "length [mm]", "", rows, lambda r: f"{r.paths.deposit_mm:.0f}"),
        _row(
            group, "stops while laying", "at sharp corners, with the valve open", rows,
            lambda r: str(r.paths.stops_while_laying), badness=lambda r: r.paths.stops_while_laying,
        ),
    ]  # fmt: skip


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
    each = [dict(evidence_rows(plan.robot[0].evidence, (), program_sha256="")) if plan.robot else {} for plan in told]
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
    rows: Sequence[PlannedRecord],
    text: Callable[[PlannedRecord], str],
    *,
    badness: Callable[[PlannedRecord], float] | None = None,
    decides: bool = False,
) -> Row:
    values = tuple(text(row) for row in rows)
    if badness is None or len(set(values)) == 1:
        return Row(group, quantity, meaning, values, decides=decides)
    leading = values[int(np.argmin([badness(row) for row in rows]))]
    return Row(
        group, quantity, meaning, values, tuple(i for i, value in enumerate(values) if value == leading), decides
    )
