"""The stages in their order: a mesh file in, a frozen plan out that keeps every intermediate value."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, final

import numpy as np

from geoprint.backends import Backend, Flattening, Lscm
from geoprint.config import Job
from geoprint.errors import ClearanceError
from geoprint.export import rapid_program
from geoprint.model import (
    Clearance,
    Contours,
    ControllerPath,
    JointPath,
    Placement,
    PoseStream,
    Program,
    Surface,
    Targets,
    Toolpath,
    Trajectory,
)
from geoprint.motion import Arm, clearance, controller_path, reach, retime, written_targets
from geoprint.paths import arrange, poses
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.workpiece import Workpiece, backend_factory, prepare_workpiece, require_raster, upright
from geoprint.quality import Uniformity, uniformity


@final
@dataclass(frozen=True, slots=True, eq=False)
class RobotPlan:
    """The robot's part of a plan; it exists only where every check was passed."""

    placement: Placement
    joint_path: JointPath
    trajectory: Trajectory
    targets: Targets
    controller_path: ControllerPath
    clearance: Clearance
    program: Program


@final
@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Everything from the mesh to the program.

    Attributes:
        job: what was asked for.
        workpiece: what was planned on.
        contours: level curves of the backend.
        toolpath: runs in printing order.
        poses: tool poses, in the work frame; with a robot as the robot is commanded.
        uniformity: how even the paths are, or None where there is but one level.
        robot: the robot's part, or None where it was left out.
        timings: seconds each stage took, in order.
        flattening: chart and raster of a backend that works in the plane, else None.
    """

    job: Job
    workpiece: Workpiece
    contours: Contours
    toolpath: Toolpath
    poses: PoseStream
    uniformity: Uniformity | None
    robot: RobotPlan | None
    timings: tuple[tuple[str, float], ...]
    flattening: Flattening | None


def plan(job: Job, *, observe: Callable[[str], None] = lambda _: None) -> Plan:
    """Plan a part: contours on its surface, and the checked program of the robot.

    Args:
        job: what to plan.
        observe: called with the name of each stage as it starts.

    Returns:
        The plan; what could not be checked raises instead.

    Raises:
        UsageError: the job or its cell is unclear or contradicts itself.
        InputError: a file cannot be planned on.
        PlanError: no valid motion exists; says where and why.
    """
    stage = Stages(observe)
    workpiece = prepare_workpiece(job, stage, backends=[job.backend])
    paths = plan_paths(job, workpiece, stage)
    return paths if workpiece.placement is None else with_robot(paths, workpiece.placement, stage)


def plan_paths(job: Job, workpiece: Workpiece, stage: Stages) -> Plan:
    """Cover the workpiece with contours, turn them into poses and measure their evenness; the robot is left out."""
    paths = cover(job, workpiece, stage)
    with stage("evenness"):
        even = np.ptp(paths.toolpath.levels) > 0
        measured = uniformity(paths.poses, workpiece.part, spacing=paths.contours.spacing) if even else None
    return replace(paths, uniformity=measured, timings=tuple(stage.timings))


def cover(job: Job, workpiece: Workpiece, stage: Stages) -> Plan:
    """Cover the workpiece with contours and turn them into poses; evenness and the robot are left out."""
    surface = workpiece.surface
    with stage("contours"):
        backend = _backend(job, surface)
        spacing = job.spacing
        if spacing is None:
            spacing = backend.distance(workpiece.seed).maximum / (job.rounds or 1)
        contours = backend.contours(workpiece.seed, spacing=spacing)
        flattening = backend.flattening(spacing=spacing) if isinstance(backend, Lscm) else None
    with stage("path"):
        toolpath = arrange(contours, surface)
        stream = pose_stream(toolpath, workpiece)
    return Plan(job, workpiece, contours, toolpath, stream, None, None, tuple(stage.timings), flattening)


def pose_stream(toolpath: Toolpath, workpiece: Workpiece, *, travel: Literal["low", "high"] = "low") -> PoseStream:
    """Return the poses of a toolpath on a workpiece, as it stands; `paths.poses` says what travel means."""
    process = workpiece.cell.process
    return poses(
        toolpath,
        workpiece.surface,
        R_base_work=upright(workpiece),
        standoff=process.standoff,
        retract=process.retract,
        layer_height=process.layer_height,
        tool=workpiece.cell.tool,
        body=workpiece.body,
        travel=travel,
    )


def with_robot(paths: Plan, placement: Placement, stage: Stages) -> Plan:
    """Add the robot to a plan of paths: joints, time, clearance, program.

    Where travel alone is not clear, all of it is planned again over everything.

    Raises:
        PlanError: no valid motion exists; says where and why.
    """
    try:
        return _with_robot(paths, placement, stage)
    except ClearanceError as error:
        if not error.details.get("travelling", False):
            raise
    high = pose_stream(paths.toolpath, paths.workpiece, travel="high")
    return _with_robot(replace(paths, poses=high), placement, stage)


def _with_robot(paths: Plan, placement: Placement, stage: Stages) -> Plan:
    workpiece, cell = paths.workpiece, paths.workpiece.cell
    with stage("reach"):
        arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
        joint_path = reach(paths.poses, arm, T_base_work=placement.T_base_work)
    with stage("timing"):
        trajectory = retime(joint_path, cell.robot, process=cell.process)
        targets = written_targets(joint_path, trajectory, process=cell.process, period=cell.robot.target_period)
    with stage("collision check"):
        path = controller_path(joint_path, targets, arm)
        found = clearance(
            path,
            arm,
            tool=cell.tool,
            process=cell.process,
            T_base_work=placement.T_base_work,
            poses=joint_path.poses,
            part=workpiece.part,
            body=workpiece.body,
            obstacles=cell.obstacles,
        )
    with stage("program"):
        program = rapid_program(
            joint_path,
            targets,
            cell=cell,
            placement=placement,
            part_name=paths.job.surface.name,
            spacing=paths.contours.spacing,
            checked=found.checked,
            not_checked=found.not_checked,
        )
    robot = RobotPlan(placement, joint_path, trajectory, targets, path, found, program)
    return replace(paths, poses=joint_path.poses, robot=robot, timings=tuple(stage.timings))


def _backend(job: Job, surface: Surface) -> Backend:
    require_raster(job, [job.backend])
    if job.resolution is not None:
        return Lscm(surface, resolution=job.resolution)
    return backend_factory(job.backend)(surface)
