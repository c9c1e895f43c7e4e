"""How a plan lands on disk: tables, program, surface and plan.json, read back before they count."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

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
from geoprint.pipeline.chart_picture import chart_pictures
from geoprint.pipeline.checking import RAPID_FOLDER, check_program
from geoprint.pipeline.summary import summary
from geoprint.results import Plan
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
