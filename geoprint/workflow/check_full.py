"""`geoprint check --full`: collision check and evenness once more, from nothing but what the bundle holds.

Part, body and cell are read from the bundle, the part is prepared anew, the motion is that of the targets as they are
written. What comes out must be what plan.json says; so must what a table keeps from the arm as it comes to each
attitude.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from geoprint.errors import GeoprintError
from geoprint.metrics import uniformity
from geoprint.model import Clearance, JointPath, Obstacle, Placement, PoseStream, Targets
from geoprint.positioner import table_machine
from geoprint.postprocessor import PLAN, Orders, Setup, TrajectoryTable, read_trajectory_table
from geoprint.postprocessor.registry import post_processor_of
from geoprint.reporting import peak_memory, record_evenness
from geoprint.reporting.check import Finding, RepeatedRecord
from geoprint.reporting.metrics import CATALOGUE, OF_BACKEND
from geoprint.reporting.records.evenness import EvennessRecord
from geoprint.reporting.records.plan import ClearanceRecord, PlanRecord, RobotRecord
from geoprint.robot.arm import Arm
from geoprint.robot.collision import ClearanceCheck
from geoprint.robot.controller import LIFTED_STEP, controller_path, lifted_path
from geoprint.robot.reach import tool_poses
from geoprint.robot.timing import joints_at
from geoprint.workflow.bundles import listed, stream_of
from geoprint.workflow.check_inputs import planned_job
from geoprint.workflow.replan import JOB
from geoprint.workflow.table_motion import move_clearance
from geoprint.workflow.tilting import part_folder
from geoprint.workflow.workpiece import SidedPart, read_part

# Clearances agree with those of the plan to this [mm], and figures of evenness to this.
CLEARANCE_TOLERANCE = 0.01
EVENNESS_TOLERANCE = 5e-4

_T = TypeVar("_T")


def repeat(
    folder: Path, record: PlanRecord, motions: Sequence[tuple[Path, Setup, Orders]]
) -> tuple[RepeatedRecord, tuple[Finding, ...]]:
    """Check clearance and evenness of a bundle once more.

    Args:
        folder: the bundle.
        record: its plan.json.
        motions: folder, cell and targets of each of its programs, as many as plan.json tells of; none without one.

    Returns:
        What was found now, and where that is not what plan.json says or could not be found.
    """
    started = time.perf_counter()
    findings: list[Finding] = []
    part = _found(JOB, lambda: read_part(planned_job(folder, listed(folder))), findings)
    even = None
    printing: list[Clearance] = []
    dry: list[Clearance] = []
    if part is not None:
        even = _found("poses.csv", lambda: _evenness(folder, record, part), findings)
        for number, ((place, setup, orders), of) in enumerate(zip(motions, record.robot, strict=False), start=1):
            targets = (place / "targets.csv").relative_to(folder).as_posix()
            passed = _found(targets, partial(_clearances, place, part, setup, orders), findings)
            if passed is not None:
                printing.append(passed[0])
                dry.append(passed[1])
                findings += _closer(*passed, of.clearance, number=number)
        findings += _table_findings(part, [setup for _, setup, _ in motions], record.robot)
    if even is not None and record.uniformity is not None:
        findings += _uneven(even, record.uniformity)
    seconds = time.perf_counter() - started
    clear, lifted = _narrowest(printing), _narrowest(dry)
    repeated = RepeatedRecord(
        smallest_mm=None if clear is None else clear.smallest,
        arm_smallest_mm=None if clear is None else clear.arm_smallest,
        tip_margin_mm=None if clear is None else clear.tip_margin,
        dry_run_smallest_mm=None if lifted is None else lifted.smallest,
        uniformity=even,
        seconds=seconds,
        peak_memory_mb=peak_memory(),
    )
    return repeated, tuple(findings)


def _narrowest(found: Sequence[Clearance]) -> Clearance | None:
    return min(found, key=lambda each: each.smallest, default=None)


def _found(file: str, check: Callable[[], _T], findings: list[Finding]) -> _T | None:
    """Return what a check finds; where it refuses, that is a finding."""
    try:
        return check()
    except GeoprintError as error:
        findings.append(Finding(file, 1, f"checked again: {error}"))
        return None


def _evenness(folder: Path, record: PlanRecord, part: SidedPart) -> EvennessRecord | None:
    if record.uniformity is None:
        return None
    stream, spacing = stream_of(folder, record), record.settings.spacing_mm
    found = uniformity(stream, part.part, spacing=spacing, wanted=part.widths, flow_shares=record.settings.flow_shares)
    return record_evenness(found)


def _clearances(folder: Path, part: SidedPart, setup: Setup, orders: Orders) -> tuple[Clearance, Clearance]:
    """Return what the collision check finds of the print and of the dry run."""
    cell, place = setup.cell, part.place
    ground, below = (part.part, 0.0) if place is None else (place.ground, place.below)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    table = read_trajectory_table(folder / "trajectory.csv")
    path, targets = _written_motion(setup, orders, table, arm, standoff=cell.process.standoff - below)
    lifted, lifted_targets = lifted_path(path, targets, arm)

    check = ClearanceCheck(
        arm, tool=cell.tool, process=cell.process, T_base_work=path.T_base_work, part=ground, body=part.body,
        obstacles=_solids(setup), below=below,
    )  # fmt: skip
    printing = check(post_processor_of(cell).driven(path, targets, table, arm), poses=path.poses)
    return printing, check(controller_path(lifted, lifted_targets, arm, step=LIFTED_STEP), poses=lifted.poses)


def _solids(setup: Setup) -> tuple[Obstacle, ...]:
    """Return what of a cell must not be touched, derived apart from `obstacles_at`, which plans ask.

    The plate's pose is that which the part's placement was held against, attitude by attitude.
    """
    around, table, pose = setup.cell.obstacles, setup.cell.table, setup.placement.table
    if table is not None:
        around = (*around, *table_machine(table).solids(np.eye(4) if pose is None else pose.T_table_plate))
    return around


def _written_motion(
    setup: Setup, orders: Orders, table: TrajectoryTable, arm: Arm, *, standoff: float
) -> tuple[JointPath, Targets]:
    """Return a path whose poses are the targets as written, with the joints that the inverse has for them."""
    none = np.zeros(orders.count)
    stream = PoseStream(
        tips=orders.tips,
        quaternions=orders.quaternions / np.linalg.norm(orders.quaternions, axis=1, keepdims=True),
        normals=np.tile([0.0, 0.0, 1.0], (orders.count, 1)),
        runs=orders.runs,
        levels=np.full(orders.count, -1),
        layers=np.zeros(orders.count, dtype=np.int64),
        deposit=orders.deposited | np.insert(orders.deposited[:-1], 0, np.False_),
        stops=orders.zones == 0.0,
        arcs=none,
        flow=none,
        standoff=standoff,
    )
    T_base_work = setup.placement.T_base_work
    solutions = arm.solutions(tool_poses(stream, T_base_work=T_base_work))
    planned = joints_at(table.times, table.joints, orders.times)
    wound = solutions + 2.0 * np.pi * np.rint((planned[:, None] - solutions) / (2.0 * np.pi))
    misses = np.abs(wound[0] - orders.start).max(axis=1)
    branch = int(np.nanargmin(np.where(np.isnan(misses), np.inf, misses)))
    path = JointPath(
        poses=stream,
        joints=wound[:, branch],
        branch=branch,
        rotations=none,
        leans=np.zeros((orders.count, 2)),
        T_base_work=T_base_work,
    )
    return path, Targets(np.arange(orders.count), orders.zones, orders.speeds)


def _closer(printing: Clearance, dry: Clearance, record: ClearanceRecord, *, number: int) -> Iterator[Finding]:
    """Yield each clearance that is not the one of the plan."""
    pairs = {
        "smallest_mm": (record.smallest_mm, printing.smallest),
        "arm_smallest_mm": (record.arm_smallest_mm, printing.arm_smallest),
        "tip_margin_mm": (record.tip_margin_mm, printing.tip_margin),
        "dry_run.smallest_mm": (record.dry_run.smallest_mm, dry.smallest),
    }
    for name, (said, now) in pairs.items():
        if (said is None) is not (now is None) or abs((said or 0.0) - (now or 0.0)) > CLEARANCE_TOLERANCE:
            yield Finding(PLAN, 1, f"robot.{number}.clearance.{name} is {said}, checked again it is {now}")


def _table_findings(part: SidedPart, setups: Sequence[Setup], record: Sequence[RobotRecord]) -> Iterator[Finding]:
    """Yield what is wrong with how a table comes to each attitude, the first from rest."""
    surfaces = (part.base,) if part.body is None else (part.base, part.body)
    before: Placement | None = None
    for number, (setup, of) in enumerate(zip(setups, record, strict=False), start=1):
        if of.table is None:
            continue
        to = f"attitude {number} of {len(record)}"
        try:
            kept = move_clearance(
                setup.cell, before=before, stands=setup.placement, surfaces=surfaces, place=part.place, to=to
            )
        except GeoprintError as error:
            yield Finding(f"{part_folder(number, len(record))}/setup.json", 1, f"checked again: {error}")
            return
        if abs(kept - of.table.kept_mm) > CLEARANCE_TOLERANCE:
            yield Finding(
                PLAN, 1, f"robot.{number}.table.kept_mm is {of.table.kept_mm}, checked again it is {kept:.3f}"
            )
        before = setup.placement


def _uneven(now: EvennessRecord, record: EvennessRecord) -> Iterator[Finding]:
    """Yield each figure of evenness that is not the one of the plan."""
    for metric in (each for each in CATALOGUE if each not in OF_BACKEND):
        said, found = metric.of(record), metric.of(now)
        off, largest = abs((said or 0.0) - (found or 0.0)), max(abs(said or 0.0), 1.0)
        if (said is None) is not (found is None) or off > EVENNESS_TOLERANCE * largest:
            yield Finding(PLAN, 1, f"uniformity.{metric.key} is {said}, measured again it is {found}")
