"""How targets follow each other, part by part: a table of `benchmarks.motion --targets`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.parts.tables import row, table
from geoprint.account.metrics import THICKNESS
from geoprint.config import Job, job_of
from geoprint.errors import GeoprintError
from geoprint.model import FloatArray
from geoprint.motion.arm import Arm
from geoprint.motion.controller.fitting import rounded_deviations
from geoprint.motion.timing import largest_jerk, tips_at
from geoprint.pipeline import plan
from geoprint.results import Plan, RobotPlan
from geoprint.surfaces import PolylineDistance

DATA = Path(__file__).parents[2] / "data"
SPACING = 1.5
SMOKE_SPACING = 4.0
COLUMNS = (
    "part", "targets", "laid moves", "below 12 ms", "below 20 ms", "least ms", "p1 ms", "smallest zone mm",
    "bends rounded, close", "places slower for targets", "time s", "at speed", "written speed", "trajectory's speed",
    "rounded mm", "trajectory off mm", "jerk m/s3", "speeds", THICKNESS.column,
)  # fmt: skip
SHORTEST, PERIOD = 0.012, 0.02
ROUNDING = 1e-9
AT_SPEED = 0.99


def target_table(folder: Path | None) -> Iterator[str]:
    """Yield the table of data/'s parts, and of the patches below a folder; without one, of a coarse plate alone."""
    yield from table(*COLUMNS)
    for job in _jobs(folder):
        try:
            planned = plan(job)
        except GeoprintError as error:
            yield row(job.surface.stem, f"refused: {str(error).split(';', maxsplit=1)[0]}")
            continue
        assert planned.uniformity is not None
        yield row(job.surface.stem, *_cells(planned, planned.robot[0]), f"{planned.uniformity.thickness.cv:.3%}")


def _jobs(folder: Path | None) -> Iterator[Job]:
    if folder is None:
        yield job_of(surface=DATA / "plate.ply", unit="mm", spacing=SMOKE_SPACING, place="demo")
        return
    yield job_of(surface=DATA / "plate.ply", unit="mm", spacing=SPACING, place="demo")
    yield job_of(surface=DATA / "heart_apex_patch.ply", unit="mm", spacing=1.0, place="demo", backend="heat")
    for part in sorted((folder / "patches").glob("*.ply")):
        yield job_of(surface=part, unit="mm", spacing=SPACING, place="demo", backend="heat")


def _cells(planned: Plan, robot: RobotPlan) -> Iterator[str]:
    """Yield what the table says of a plan."""
    poses, trajectory, targets = robot.joint_path.poses, robot.trajectory, robot.targets
    arm = Arm(planned.workpiece.cell.robot, T_flange_tool=planned.workpiece.cell.tool.T_flange_tool)
    laid = robot.orders.laid[:-1]
    times = np.diff(trajectory.pose_times[targets.poses])[laid]
    near = np.isin(np.arange(robot.orders.count), targets.moved)
    off = rounded_deviations(poses.tips, targets.poses, robot.orders.tips, targets.zones)[near[1:] | near[:-1]]
    written, driven, missed = _paces(planned, robot, arm)
    kinds = [bend.kind for bend in targets.bends]
    yield str(robot.orders.count)
    yield str(times.size)
    yield str(int((times < SHORTEST - ROUNDING).sum()))
    yield f"{(times < PERIOD - ROUNDING).mean():.1%}"
    yield f"{1e3 * times.min():.1f}"
    yield f"{1e3 * np.percentile(times, 1):.1f}"
    yield f"{targets.zones[targets.zones > 0.0].min(initial=np.inf):.3f}"
    yield f"{kinds.count('rounded')}, {kinds.count('close')}"
    yield str(sum(slow.limit == "targets" for slow in trajectory.slowdowns))
    yield f"{trajectory.duration:.1f}"
    yield f"{trajectory.share_at_speed:.1%}"
    yield f"{written.min(initial=1.0) - 1.0:+.1%} {written.max(initial=1.0) - 1.0:+.1%}"
    yield f"{driven.min(initial=1.0) - 1.0:+.1%} {driven.max(initial=1.0) - 1.0:+.1%}"
    yield f"{off.max(initial=0.0):.4f}"
    yield f"{missed:.3f}"
    yield f"{largest_jerk(trajectory, arm, T_base_work=robot.placement.T_base_work):.0f}"
    yield str(np.unique(targets.speeds).size)


def _paces(planned: Plan, robot: RobotPlan, arm: Arm) -> tuple[FloatArray, FloatArray, float]:
    """Return written speeds and the tip's, over the run's, off the ramps; and how far it leaves the path [mm]."""
    poses, trajectory = robot.joint_path.poses, robot.trajectory
    speed = planned.workpiece.cell.process.speed
    tips = tips_at(trajectory.times, trajectory.joints, arm, T_base_work=robot.placement.T_base_work)(trajectory.times)
    speeds = np.linalg.norm(np.diff(tips, axis=0), axis=1) / np.diff(trajectory.times)
    written, driven, missed = [np.empty(0)], [np.empty(0)], 0.0
    for run in range(int(poses.runs[-1]) + 1):
        rows = np.flatnonzero(poses.deposit & (poses.runs == run))
        steps = np.linalg.norm(np.diff(poses.tips[rows], axis=0), axis=1)
        times = trajectory.pose_times[rows]
        fast = np.flatnonzero(steps >= AT_SPEED * speed * np.diff(times) - ROUNDING)
        if not fast.size:
            continue
        start, end = times[fast[0]], times[fast[-1] + 1]
        inside = np.flatnonzero((trajectory.times[:-1] > start) & (trajectory.times[1:] < end))
        moves = np.flatnonzero((robot.orders.times[:-1] >= start - 1e-6) & (robot.orders.times[1:] <= end + 1e-6))
        written.append(robot.orders.speeds[moves + 1] / speed)
        driven.append(speeds[inside] / speed)
        line = PolylineDistance([poses.tips[rows]], step=1.0)
        missed = max(missed, float(line(tips[inside]).max(initial=0.0)))
    return np.concatenate(written), np.concatenate(driven), missed
