"""A comparison as the report page shows it."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version

import numpy as np
from scipy.spatial import KDTree

from geoprint.account.cautions import said_once
from geoprint.account.compared.pictures import ComparisonPictures
from geoprint.account.compared.table import report_table
from geoprint.account.metrics import COVERED_ONCE, THICKNESS
from geoprint.account.pictures import coverage_panel
from geoprint.account.records.comparison import PartRecord
from geoprint.account.records.plan import PlanRecord, SettingsRecord
from geoprint.account.records.rounding import as_json
from geoprint.account.replaying import machine, motion_shades, replay
from geoprint.backends import backend
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
    ViewSurface,
    view_surface,
)
from geoprint.results import Comparison, Plan, Planned

# Faces in all views of a part: finer than can be seen, and every one costs time when the page opens.
VIEWED_FACES = 60_000
# Packages whose version changes figures.
PACKAGES = ("geoprint", "numpy", "scipy", "numba", "toppra", "pin", "python-fcl")
# Units of settings by the ends of their keys, the longest first.
UNITS = {"_mm_s": "mm/s", "_mm": "mm", "_deg": "degrees", "_kpa": "kPa", "_s": "s"}


def part_report(
    comparison: Comparison,
    told: PartRecord,
    plans: Mapping[str, PlanRecord],
    *,
    pictures: ComparisonPictures,
    faces: int,
) -> PartReport:
    """Return what the report page says of a comparison.

    Args:
        comparison: with one planned backend or more.
        told: what compare.json says of it.
        plans: what plan.json says of each plan, by backend.
        pictures: of the comparison.
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
        backends=tuple(_view(name, outcome, view, still=pictures.stills[name]) for name, outcome in planned),
        refused=tuple((row.backend, row.refused) for row in told.refused),
        table=report_table(told.planned, plans, [outcome.plan for _, outcome in planned]),
        path_distances=PathDistances(apart.backends, np.array(apart.hausdorff), np.array(apart.mean))
        if len(planned) > 1
        else None,
        pictures=(
            *_lines(pictures),
            *(each for name, outcome in planned for each in _pictures(name, outcome.plan, pictures)),
        ),
        settings=_settings(told.settings),
        inputs=tuple((file.name, file.sha256) for file in (told.input, told.input.body) if file is not None),
        versions=(("Python", platform.python_version()), *((name, installed_version(name)) for name in PACKAGES)),
        critical_deg=float(np.degrees(workpiece.cell.critical_overhang)),
    )


def installed_version(package: str) -> str:
    """Return the version of a package, or that it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _lines(pictures: ComparisonPictures) -> list[Picture]:
    """Return the picture of the lines that paths follow, the same for every backend; none where they follow none."""
    if pictures.lines is None:
        return []
    caption = "The lines that paths follow, and the places about which these turn with their index"
    return [Picture(caption, "png", pictures.lines)]


def _pictures(name: str, plan: Plan, pictures: ComparisonPictures) -> list[Picture]:
    """Return the figures of one backend that are not interactive, its charts first."""
    charts = [*pictures.charts[name].values()]
    shown = [
        Picture(
            f"{name}{f', patch {number}' if len(charts) > 1 else ''}: chart, distance image and level curves",
            "png",
            chart,
        )
        for number, chart in enumerate(charts, start=1)
    ]
    switching = pictures.switching[name]
    for number, (robot, drawn) in enumerate(zip(plan.robot, switching, strict=True), start=1):
        which = f", attitude {number}" if len(switching) > 1 else ""
        on = "the lamp is on and the vacuum draws" if robot.switching.vacuum.size else "and the lamp is on"
        shown.append(Picture(f"{name}{which}: when material is laid, flows, {on}", "png", drawn))
    return shown


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


def _overview(told: PartRecord) -> tuple[tuple[str, str], ...]:
    best = next(row for row in told.planned if row.backend == told.best)
    printable = [row.backend for row in told.planned if row.printable]
    return (
        ("covers best", best.backend),
        (COVERED_ONCE.label, COVERED_ONCE.text(best.uniformity)),
        (THICKNESS.label, THICKNESS.text(best.uniformity)),
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
