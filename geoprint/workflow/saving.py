"""How plans and comparisons land on disk, read back before they count."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial, singledispatch
from pathlib import Path
from typing import final

import numpy as np

from geoprint.errors import UsageError, VerificationError
from geoprint.geometry.files import load, ply_bytes
from geoprint.model import Cell, PoseStream, Surface, Trajectory, frozen
from geoprint.postprocessor import (
    FEEDBACK_TABLE,
    PLAN,
    TIMINGS,
    Setup,
    feedback_table,
    json_bytes,
    poses_table,
    setup_file,
    targets_table,
    trajectory_table,
    verify_poses_table,
    verify_trajectory_table,
)
from geoprint.postprocessor.interface import CONTROLLER_FOLDER
from geoprint.postprocessor.registry import post_processor_name, post_processor_of
from geoprint.reporting.check import Finding
from geoprint.reporting.comparison import comparison_report, plan_report, recorded_comparison
from geoprint.reporting.pictures import ComparisonPictures, chart_pictures, comparison_pictures
from geoprint.reporting.plan import record_plan, record_timings
from geoprint.reporting.records.comparison import ComparisonRecord, RecordedComparison
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.rounding import Record, as_json, read_record, save_record, verify_record
from geoprint.reporting.tables import spacing_table
from geoprint.results import Comparison, FailedPart, Plan, RobotPlan, Workpiece
from geoprint.workflow.bundles import COMPARISON, REPORT, check_joined, part_folders
from geoprint.workflow.checking import check_program
from geoprint.workflow.processes import OtherProcesses, shared
from geoprint.workflow.replan import input_files
from geoprint.workflow.tilting import attitude_cell, part_folder


def save(result: object, directory: Path | str, *, overwrite: bool = False) -> Record:
    """Write a result as the command that makes it does: complete and verified, or not at all.

    Args:
        result: a plan (written as a bundle), a comparison (bundles and a report), measured toolpaths, compared cells,
            or what a feature makes: a print that was simulated or appraised.
        directory: folder to write; `check` reads a plan or a comparison back.
        overwrite: whether to replace what geoprint wrote there before.

    Returns:
        What its JSON file says.

    Raises:
        UsageError: the folder exists already, or this is no result.
        ExportError: nothing can be written there.
        VerificationError: the files, read back, differ from the result.
    """
    return written(result, directory, overwrite=overwrite)


@singledispatch
def written(result: object, directory: Path | str, *, overwrite: bool) -> Record:  # noqa: ARG001  (of those registered)
    """Write a result as `save` does; what makes a kind of result registers how it is written."""
    kind = type(result).__name__
    raise UsageError(f"{directory}: `{kind}` is no result that is written; give what `plan` or `compare` returned.")


def save_plan(plan: Plan, directory: Path | str, *, overwrite: bool = False, report: bool = False) -> PlanRecord:
    """Write a plan's bundle: complete and verified, or not at all.

    Args:
        plan: what to write.
        directory: where the bundle shall stand.
        overwrite: whether an existing bundle may be replaced.
        report: whether report.html is written beside it, for a plan whose evenness was measured.

    Returns:
        What plan.json says.

    Raises:
        UsageError: the folder exists already.
        ExportError: nothing can be written there.
        VerificationError: what was written differs from the plan when it is read back.
    """
    if report:
        record, charts, page = plan_report(plan)
        shown = {REPORT: page}
    else:
        record, charts, shown = record_plan(plan), chart_pictures(plan), {}
    files, timings = plan_files(plan, record, charts=charts) | shown, {TIMINGS: _timings(plan)}
    verify = partial(verify_files, plan, record)
    return save_record(record, PLAN, files, directory, overwrite=overwrite, verify=verify, unlisted=timings)


written.register(Plan, save_plan)


@written.register
def _save_comparison(found: Comparison, directory: Path | str, *, overwrite: bool) -> ComparisonRecord:
    return save_comparisons([found], directory, overwrite=overwrite).record


def save_comparisons(
    parts: Sequence[Comparison | FailedPart],
    directory: Path | str,
    *,
    samples: bool = False,
    figures: bool = False,
    overwrite: bool = False,
    helper: OtherProcesses | None = None,
) -> RecordedComparison:
    """Write compare.json, report.html, and for each part a picture and a bundle a planned backend: all or nothing.

    One part's files stand in the folder itself, those of several in a folder each, named after the part.

    Args:
        parts: what was compared, at least one.
        directory: where the result shall stand.
        samples: whether spacing.csv is added to each bundle (`geoprint.reporting.tables` names its columns).
        figures: whether figures for papers are added in the folder figures/ of each part.
        overwrite: whether an existing result may be replaced.
        helper: processes that share the work, as `compare_parts`.

    Returns:
        What compare.json says of the parts, and what plan.json says of each plan.

    Raises:
        UsageError: the folder exists already.
        ExportError: nothing can be written there.
        VerificationError: what was written differs from the plans when it is read back.
    """
    record = recorded_comparison(parts)
    drawn = [_drawn(part, helper) if isinstance(part, Comparison) else None for part in parts]
    report = comparison_report(parts, record, pictures=drawn)
    files = {REPORT: report}
    bundles: list[tuple[Plan, PlanRecord, str]] = []
    for part, plans, pictures, folder in zip(parts, record.plans, drawn, part_folders(_names(parts)), strict=True):
        if isinstance(part, Comparison) and pictures is not None:
            shown = _shown_files(part, pictures, samples=samples, figures=figures)
            files |= {f"{folder}{file}": content for file, content in shown.items()}
            for name, outcome in part.planned:
                bundles.append((outcome.plan, plans[name], f"{folder}{name}/"))
                of_plan = plan_files(outcome.plan, plans[name], charts=pictures.charts[name])
                files |= {f"{folder}{name}/{file}": content for file, content in of_plan.items()}

    def verify(written: Path) -> None:
        shared(helper, _verified, [(_promised(plan, of), written / folder) for plan, of, folder in bundles])

    timings = {f"{folder}{TIMINGS}": _timings(plan) for plan, _, folder in bundles}
    save_record(record.record, COMPARISON, files, directory, overwrite=overwrite, verify=verify, unlisted=timings)
    return record


def _drawn(part: Comparison, helper: OtherProcesses | None) -> ComparisonPictures:
    return comparison_pictures(part, draw=partial(shared, helper, _bytes_of))


def _bytes_of(drawing: Callable[[], bytes]) -> bytes:
    return drawing()


def _verified(written: tuple[_Promise, Path]) -> None:
    promise, folder = written
    _verify(promise, folder)


def _names(parts: Sequence[Comparison | FailedPart]) -> list[str]:
    return [part.job.surface.name if isinstance(part, FailedPart) else part.workpiece.name for part in parts]


def _timings(plan: Plan) -> bytes:
    return json_bytes(as_json(record_timings(plan)))


def _shown_files(part: Comparison, pictures: ComparisonPictures, *, samples: bool, figures: bool) -> dict[str, bytes]:
    """Return name and content of what one part has beside its bundles: its picture, and what was asked for."""
    files = {"compare.png": pictures.together}
    for name, outcome in part.planned:
        if samples:
            files[f"{name}/spacing.csv"] = spacing_table(outcome.uniformity)
    if figures:
        from geoprint.reporting.paper_figures import paper_files

        drawn = paper_files(part.workpiece, part.planned)
        files |= {f"figures/{file}": content for file, content in drawn.items()}
    return files


def plan_files(plan: Plan, record: PlanRecord, *, charts: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return name and content of every file of a plan's bundle.

    Args:
        plan: what to write.
        record: what plan.json says of it.
        charts: its `chart_pictures`.
    """
    files = {
        PLAN: json_bytes(as_json(record)),
        "poses.csv": poses_table(plan.poses),
        "surface.ply": ply_bytes(plan.workpiece.surface),
        **input_files(plan),
        **charts,
    }
    if plan.fed is not None:
        files[FEEDBACK_TABLE] = feedback_table(plan.poses, plan.fed.wanted)
    for number, (robot, folder) in enumerate(zip(plan.robot, robot_folders(plan), strict=True), start=1):
        cell = attitude_cell(plan.workpiece.cell, number=number, count=len(plan.robot))
        own = _robot_files(plan.workpiece, robot, cell)
        own |= {"poses.csv": poses_table(robot.joint_path.poses)} if folder else {}
        files |= {f"{folder}{name}": content for name, content in own.items()}
    if plan.joined is not None:
        together = (*plan.joined.modules, *plan.joined.beside)
        program = post_processor_name(plan.workpiece.cell)
        files |= {f"{program}/{name}": text.encode("ascii") for name, text in together}
    return files


def robot_folders(plan: Plan) -> list[str]:
    """Return the folder in the bundle of each placement's files, with a slash at its end: none for a single one."""
    folders = [part_folder(number, len(plan.robot)) for number, _ in enumerate(plan.robot, start=1)]
    return [f"{folder}/" if folder else "" for folder in folders]


def _robot_files(workpiece: Workpiece, robot: RobotPlan, cell: Cell) -> dict[str, bytes]:
    orders = robot.orders
    program, names = post_processor_name(cell), [name for name, _ in robot.program.modules]
    kept = post_processor_of(cell).kept(cell, placement=robot.placement, names=names)
    setup = Setup(
        cell,
        robot.placement,
        workpiece.surface_within,
        extent=orders.extent,
        frame=orders.frame if np.isfinite(orders.frame) else None,
    )
    return {
        "trajectory.csv": trajectory_table(robot.trajectory),
        "targets.csv": targets_table(orders),
        "setup.json": setup_file(setup),
        **{f"{program}/{name}": text.encode("ascii") for name, text in robot.program.modules},
        **{f"{program}/{CONTROLLER_FOLDER}/{name}": text.encode("ascii") for name, text in kept.items()},
    }


def verify_files(plan: Plan, record: PlanRecord, folder: Path) -> None:
    """Read a plan's bundle back and compare it with the plan.

    Args:
        plan: that was written.
        record: what plan.json shall say of it.
        folder: the bundle.

    Raises:
        VerificationError: a file differs; the message names it.
    """
    _verify(_promised(plan, record), folder)


@final
@frozen
class _Promise:
    """What of a plan its files are compared with: a helper gets no more of it, for bodies are large.

    Attributes:
        record: what plan.json shall say.
        poses: of poses.csv.
        surface: of surface.ply.
        robots: of each placement its folder, its trajectory, and the files of its program.
        joined: the files of the program of all attitudes of a table, or none.
    """

    record: PlanRecord
    poses: PoseStream
    surface: Surface
    robots: tuple[tuple[str, Trajectory, list[str]], ...]
    joined: list[str]


def _promised(plan: Plan, record: PlanRecord) -> _Promise:
    program = post_processor_name(plan.workpiece.cell)
    robots = [
        (part, robot.trajectory, [f"{program}/{name}" for name, _ in robot.program.modules])
        for robot, part in zip(plan.robot, robot_folders(plan), strict=True)
    ]
    joined = [f"{program}/{name}" for name, _ in plan.joined.modules] if plan.joined else []
    return _Promise(record, plan.poses, plan.workpiece.surface, tuple(robots), joined)


def _verify(promise: _Promise, folder: Path) -> None:
    verify_poses_table(folder / "poses.csv", promise.poses)
    _verify_surface(promise.surface, folder / "surface.ply")
    verify_record(folder / PLAN, promise.record)
    for part, trajectory, names in promise.robots:
        verify_trajectory_table(folder / part / "trajectory.csv", trajectory)
        _refuse(check_program(folder / part, names, plan=folder).findings)
    if promise.joined:
        _refuse(check_joined(folder, promise.joined, read_record(folder / PLAN, PlanRecord))[0])


def _refuse(findings: Sequence[Finding]) -> None:
    for finding in findings:
        raise VerificationError(
            f"{finding.file}, line {finding.line}: {finding.reason}; please report this as a defect of geoprint."
        )


def _verify_surface(planned: Surface, path: Path) -> None:
    written = load(path, unit="mm")
    if not (np.array_equal(written.vertices, planned.vertices) and np.array_equal(written.faces, planned.faces)):
        raise VerificationError(f"{path.name} differs from the planned surface; the disk may be faulty: write again.")
