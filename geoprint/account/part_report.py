"""A comparison as the report page shows it."""

from __future__ import annotations

import platform
from importlib.metadata import version

import numpy as np
from scipy.spatial import KDTree

from geoprint.account.chart_picture import chart_pictures
from geoprint.account.coverage_picture import coverage_panel, coverage_picture
from geoprint.account.report_table import report_table
from geoprint.account.robot_summary import placement_warnings
from geoprint.account.summary import settings_summary
from geoprint.account.verdict import verdict
from geoprint.backends import backend
from geoprint.export import Json
from geoprint.model import FloatArray, IntArray
from geoprint.motion.arm import Arm
from geoprint.quality import agreement
from geoprint.report import (
    COVERED,
    GAP,
    MOST_FRAMES,
    OVERLAP,
    BackendView,
    PartReport,
    PathDistances,
    Picture,
    Replay,
    ViewSurface,
    switching_figure,
    view_surface,
)
from geoprint.results import Comparison, Plan, Planned, RobotPlan
from geoprint.transforms import apply, inverse

# Packages whose version changes figures.
PACKAGES = ("geoprint", "numpy", "scipy", "numba", "toppra", "pin", "python-fcl")
# Units of settings by the ends of their keys, the longest first.
UNITS = {"_mm_s": "mm/s", "_mm": "mm", "_deg": "degrees", "_kpa": "kPa", "_s": "s"}


def part_report(comparison: Comparison, *, faces: int) -> PartReport:
    """Return what the report page says of a comparison.

    Args:
        comparison: with one planned backend or more.
        faces: of the surface that is drawn, at most.
    """
    workpiece, planned = comparison.workpiece, comparison.planned
    first = planned[0][1].plan
    spacing = first.contours.spacing
    view = view_surface(workpiece.surface, faces=faces)
    names = tuple(name for name, _ in planned)
    apart = agreement([outcome.plan.poses for _, outcome in planned], spacing=spacing)
    return PartReport(
        name=comparison.job.surface.name,
        verdict=verdict(comparison),
        cautions=_cautions(comparison),
        overview=_overview(comparison),
        surface=view.surface,
        R_view_work=workpiece.upright,
        spacing=spacing,
        backends=tuple(_view(name, outcome, view) for name, outcome in planned),
        refused=comparison.refused,
        table=report_table(planned),
        path_distances=PathDistances(names, apart.hausdorff, apart.mean) if len(names) > 1 else None,
        pictures=tuple(picture for name, outcome in planned for picture in _pictures(name, outcome.plan)),
        settings=_settings(first),
        inputs=tuple(
            (path.name, digest)
            for path, digest in zip((comparison.job.surface, comparison.job.body), workpiece.digests, strict=False)
            if path is not None
        ),
        versions=(("Python", platform.python_version()), *((name, version(name)) for name in PACKAGES)),
    )


def _pictures(name: str, plan: Plan) -> list[Picture]:
    """Return the figures of one backend that are not interactive."""
    charts = list(chart_pictures(plan).values())
    pictures = [
        Picture(
            f"{name}{f', patch {number}' if len(charts) > 1 else ''}: chart, distance image and level curves",
            "png",
            chart,
        )
        for number, chart in enumerate(charts, start=1)
    ]
    if plan.robot is not None:
        found = plan.robot.switching
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
        f"{name}: paths {plan.contours.spacing:.3g} mm apart; spacing varies by {measured.cv:.2%} (CV), "
        f"{measured.uncovered:.2%} of the area uncovered. Red: too close, blue: too far apart, grey: outermost."
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
        replay=None if plan.robot is None else _replay(plan, plan.robot),
    )


def _replay(plan: Plan, robot: RobotPlan) -> Replay:
    """Return the motion at so many rows of the trajectory as the page shows, in the work frame."""
    cell, trajectory = plan.workpiece.cell, robot.trajectory
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    rows = np.unique(np.linspace(0, trajectory.times.size - 1, MOST_FRAMES).astype(np.int64))
    joints = trajectory.joints[rows]
    T_work_base = inverse(robot.placement.T_base_work)
    skeleton: FloatArray = apply(T_work_base, arm.joint_places(joints).reshape(-1, 3)).reshape(len(rows), -1, 3)
    tools = T_work_base @ arm.tool_poses(joints)
    laid = np.flatnonzero(plan.poses.deposit)
    starts = np.flatnonzero(np.diff(plan.poses.runs[laid], prepend=-1))
    return Replay(
        times=trajectory.times[rows],
        joints=skeleton,
        tips=tools[:, :3, 3],
        axes=tools[:, :3, 2],
        deposit=trajectory.deposit[rows].astype(np.int64),
        needle=cell.tool.needle_length,
        bead=plan.poses.tips[laid],
        bead_offsets=np.append(starts, laid.size),
        bead_times=trajectory.pose_times[laid],
    )


def _cautions(comparison: Comparison) -> tuple[str, ...]:
    """Say what nobody may overlook; what cannot be printed and why stands in the verdict."""
    robots = [outcome.plan.robot for _, outcome in comparison.planned if outcome.plan.robot is not None]
    if not robots:
        return ()
    cautions = placement_warnings(robots[0].placement)
    laid = comparison.planned[0][1].plan.laid
    if laid is not None and laid.light is not None and laid.light.lacking is not None:
        cautions.append(f"{laid.light.lacking[0].upper()}{laid.light.lacking[1:]}")
    return (*cautions, f"Not checked: {'; '.join(robots[0].clearance.not_checked)}.")


def _overview(comparison: Comparison) -> tuple[tuple[str, str], ...]:
    best, outcome = min(comparison.planned, key=lambda pair: pair[1].uniformity.cv)
    printable = [name for name, other in comparison.planned if other.plan.robot is not None]
    asked = comparison.job.robot
    return (
        ("most even", best),
        ("its spacing CV", f"{outcome.uniformity.cv:.2%}"),
        ("printable", (", ".join(printable) or "none") if asked else "not asked"),
    )


def _settings(plan: Plan) -> tuple[tuple[str, str], ...]:
    def text(value: Json) -> str:
        if isinstance(value, bool):
            return "yes" if value else "no"
        return "none" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)

    settings = {name: value for name, value in settings_summary(plan).items() if name not in {"backend", "patches"}}
    regions = [region.model_dump(exclude_none=True).items() for region in plan.job.patches]
    return (
        *((_with_unit(name), text(value)) for name, value in settings.items()),
        *(
            (f"patch {i}", ", ".join(f"{name} {value}" for name, value in each))
            for i, each in enumerate(regions, start=1)
        ),
    )


def _with_unit(key: str) -> str:
    """Return a key of plan.json in words, with its unit in brackets."""
    end = next((end for end in UNITS if key.endswith(end)), None)
    return key.replace("_", " ") if end is None else f"{key.removesuffix(end).replace('_', ' ')} [{UNITS[end]}]"
