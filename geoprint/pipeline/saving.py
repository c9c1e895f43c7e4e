"""How plans and comparisons land on disk, read back before they count."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from geoprint.account.chart_picture import chart_pictures
from geoprint.account.comparison_summary import comparison_picture, comparison_report, comparison_summary
from geoprint.account.coverage_picture import paper_files
from geoprint.account.spacing_table import spacing_table
from geoprint.account.summary import summary
from geoprint.errors import VerificationError
from geoprint.export import (
    Setup,
    json_bytes,
    poses_table,
    setup_file,
    targets_table,
    trajectory_table,
    verify_poses_table,
    verify_trajectory_table,
    write_bundle,
)
from geoprint.pipeline.checking import RAPID_FOLDER, check_program
from geoprint.results import Comparison, FailedPart, Plan
from geoprint.surfaces.files import load, ply_bytes


def save_plan(plan: Plan, directory: Path, *, overwrite: bool = False) -> None:
    """Write a plan's bundle: complete and verified, or not at all.

    Args:
        plan: what to write.
        directory: where the bundle shall stand.
        overwrite: whether an existing bundle may be replaced.

    Raises:
        UsageError: the folder exists already.
        ExportError: nothing can be written there.
        VerificationError: what was written differs from the plan when it is read back.
    """
    write_bundle(directory, plan_files(plan), overwrite=overwrite, verify=lambda folder: verify_files(plan, folder))


def save_comparisons(
    parts: Sequence[Comparison | FailedPart],
    directory: Path,
    *,
    samples: bool = False,
    figures: bool = False,
    overwrite: bool = False,
) -> None:
    """Write compare.json, report.html, and for each part a picture and a bundle a planned backend: all or nothing.

    One part's files stand in the folder itself, those of several in a folder each, named after the part.

    Args:
        parts: what was compared, at least one.
        directory: where the result shall stand.
        samples: whether spacing.csv is added to each bundle (`geoprint.account.spacing_table` names its columns).
        figures: whether figures for papers are added in the folder figures/ of each part.
        overwrite: whether an existing result may be replaced.

    Raises:
        UsageError: the folder exists already.
        ExportError: nothing can be written there.
        VerificationError: what was written differs from the plans when it is read back.
    """
    folders = part_folders(parts)
    files = {"compare.json": json_bytes(comparison_summary(parts)), "report.html": comparison_report(parts)}
    for part, folder in zip(parts, folders, strict=True):
        if isinstance(part, Comparison):
            files[f"{folder}compare.png"] = comparison_picture(part)
            for name, outcome in part.planned:
                files |= {f"{folder}{name}/{file}": content for file, content in plan_files(outcome.plan).items()}
                if samples:
                    files[f"{folder}{name}/spacing.csv"] = spacing_table(outcome.uniformity)
            if figures:
                drawn = paper_files(part.workpiece, part.planned)
                files |= {f"{folder}figures/{file}": content for file, content in drawn.items()}

    def verify(written: Path) -> None:
        for part, folder in zip(parts, folders, strict=True):
            for name, outcome in part.planned if isinstance(part, Comparison) else ():
                verify_files(outcome.plan, written / folder / name)
        found = [row["part"] for row in json.loads((written / "compare.json").read_bytes())["parts"]]
        if found != [part.job.surface.name for part in parts]:
            raise VerificationError("compare.json does not list the compared parts; write again.")

    write_bundle(directory, files, overwrite=overwrite, verify=verify)


def plan_files(plan: Plan) -> dict[str, bytes]:
    """Return name and content of every file of a plan's bundle."""
    files = {
        "plan.json": json_bytes(summary(plan)),
        "poses.csv": poses_table(plan.poses),
        "surface.ply": ply_bytes(plan.workpiece.surface),
    }
    files |= chart_pictures(plan)
    if plan.robot is not None:
        orders = plan.robot.orders
        files["trajectory.csv"] = trajectory_table(plan.robot.trajectory)
        files["targets.csv"] = targets_table(orders)
        workpiece, placement = plan.workpiece, plan.robot.placement
        files["setup.json"] = setup_file(
            Setup(
                workpiece.cell,
                placement,
                workpiece.surface_within,
                start=orders.start,
                aloft=orders.aloft,
                extent=orders.extent,
            )
        )
        for name, text in plan.robot.program.modules:
            files[f"{RAPID_FOLDER}/{name}"] = text.encode("ascii")
    return files


def verify_files(plan: Plan, folder: Path) -> None:
    """Read a plan's bundle back and compare it with the plan.

    Raises:
        VerificationError: a file differs; the message names it.
    """
    verify_poses_table(folder / "poses.csv", plan.poses)
    _verify_surface(plan, folder / "surface.ply")
    if json.loads((folder / "plan.json").read_bytes())["paths"]["poses"] != plan.poses.count:
        raise VerificationError("plan.json does not count the poses of the plan; the disk may be faulty: write again.")
    if plan.robot is None:
        return
    verify_trajectory_table(folder / "trajectory.csv", plan.robot.trajectory)
    for finding in check_program(folder, [f"{RAPID_FOLDER}/{name}" for name, _ in plan.robot.program.modules]).findings:
        raise VerificationError(
            f"{finding.file}, line {finding.line}: {finding.reason}; please report this as a defect of geoprint."
        )


def _verify_surface(plan: Plan, path: Path) -> None:
    written, planned = load(path, unit="mm"), plan.workpiece.surface
    if not (np.array_equal(written.vertices, planned.vertices) and np.array_equal(written.faces, planned.faces)):
        raise VerificationError(f"{path.name} differs from the planned surface; the disk may be faulty: write again.")


def part_folders(parts: Sequence[Comparison | FailedPart]) -> list[str]:
    """Return the folder of each part, with a slash at its end: none for a single part; equal names are numbered."""
    if len(parts) == 1:
        return [""]
    seen: Counter[str] = Counter()
    folders: list[str] = []
    for part in parts:
        stem = part.job.surface.stem
        seen[stem] += 1
        folders.append(f"{stem}/" if seen[stem] == 1 else f"{stem}-{seen[stem]}/")
    return folders
