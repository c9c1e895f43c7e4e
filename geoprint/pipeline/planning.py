"""The stages in their order: a mesh file in, a frozen plan out that keeps every intermediate value."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from geoprint.backends import BACKENDS, Backend
from geoprint.config import Job, load_cell
from geoprint.errors import FieldError, UsageError
from geoprint.export import rapid_program
from geoprint.model import (
    Cell,
    Clearance,
    Contours,
    ControllerPath,
    FloatArray,
    JointPath,
    Placement,
    PoseStream,
    Program,
    Seed,
    Surface,
    Targets,
    Toolpath,
    Trajectory,
)
from geoprint.motion import (
    Arm,
    clearance,
    controller_path,
    demo_placement,
    fit_touched_points,
    reach,
    retime,
    written_targets,
)
from geoprint.paths import arrange, poses
from geoprint.quality import Uniformity, uniformity
from geoprint.surfaces import (
    PreparationReport,
    boundary_seed,
    load,
    mean_normal,
    point_seed,
    prepare,
    refine,
)
from geoprint.transforms import smallest_rotation

# Triangles per spacing: a distance that is linear in each triangle follows a curved front to a per cent of a spacing.
TRIANGLES_PER_SPACING = 4
# Resolution at which the largest distance is estimated before the spacing is known, in triangles across the part.
TRIANGLES_ACROSS = 60
# A seed point may miss the surface by this [mm]: what is read off a screen is rounded.
SEED_TOLERANCE = 1.0


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
class Workpiece:
    """What every backend of a job starts from.

    Attributes:
        cell: the machine.
        part: the surface as prepared, before refinement.
        body: what the part lies on, or None.
        preparation: what preparing changed.
        surface: the refined surface to plan on.
        seed: where distance is zero.
        placement: where the part stands, or None where the job leaves the robot out.
    """

    cell: Cell
    part: Surface
    body: Surface | None
    preparation: PreparationReport
    surface: Surface
    seed: Seed
    placement: Placement | None


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
    """

    job: Job
    workpiece: Workpiece
    contours: Contours
    toolpath: Toolpath
    poses: PoseStream
    uniformity: Uniformity | None
    robot: RobotPlan | None
    timings: tuple[tuple[str, float], ...]


@final
class Stages:
    """Names the stage that runs, for whoever watches, and times each.

    Args:
        observe: called with the name of each stage as it starts.
    """

    def __init__(self, observe: Callable[[str], None]) -> None:
        self._observe = observe
        self.timings: list[tuple[str, float]] = []

    @contextmanager
    def __call__(self, name: str) -> Generator[None]:
        """Run the body as a stage."""
        self._observe(name)
        start = time.perf_counter()
        yield
        self.timings.append((name, time.perf_counter() - start))


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
    workpiece = prepare_workpiece(job, stage)
    paths = plan_paths(job, workpiece, stage)
    return paths if workpiece.placement is None else with_robot(paths, workpiece.placement, stage)


def prepare_workpiece(job: Job, stage: Stages) -> Workpiece:
    """Read cell, part and body, decide where the part stands, and refine it to what the spacing needs."""
    factory = _backend(job)
    with stage("reading"):
        cell = load_cell(job.cell)
        _require_placement(job, cell)
        part, preparation = prepare(load(job.surface, unit=job.unit, flip=job.flip))
        body = None if job.body is None else load(job.body, unit=job.unit)
        placement = _placement(job, cell, part)
    with stage("refining"):
        surface = refine(part, edge_length=_wanted_spacing(job, part, factory) / TRIANGLES_PER_SPACING)
        seed = _seed(job, surface)
    return Workpiece(cell, part, body, preparation, surface, seed, placement)


def plan_paths(job: Job, workpiece: Workpiece, stage: Stages) -> Plan:
    """Cover the workpiece with contours and turn them into poses; the robot is left out."""
    surface, process = workpiece.surface, workpiece.cell.process
    with stage("contours"):
        backend = _backend(job)(surface)
        spacing = job.spacing
        if spacing is None:
            spacing = backend.distance(workpiece.seed).maximum / (job.rounds or 1)
        contours = backend.contours(workpiece.seed, spacing=spacing)
    with stage("path"):
        toolpath = arrange(contours, surface)
        stream = poses(
            toolpath,
            surface,
            R_base_work=upright(workpiece),
            standoff=process.standoff,
            retract=process.retract,
            layer_height=process.layer_height,
        )
    with stage("evenness"):
        measured = uniformity(stream, workpiece.part, spacing=spacing) if np.ptp(toolpath.levels) > 0 else None
    return Plan(job, workpiece, contours, toolpath, stream, measured, None, tuple(stage.timings))


def with_robot(paths: Plan, placement: Placement, stage: Stages) -> Plan:
    """Add the robot to a plan of paths: joints, time, clearance, program.

    Raises:
        PlanError: no valid motion exists; says where and why.
    """
    workpiece, cell = paths.workpiece, paths.workpiece.cell
    with stage("reach"):
        arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
        joint_path = reach(paths.poses, arm, T_base_work=placement.T_base_work)
    with stage("timing"):
        trajectory = retime(joint_path, cell.robot, process=cell.process)
        targets = written_targets(joint_path, trajectory, process=cell.process)
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


def _backend(job: Job) -> Callable[..., Backend]:
    if job.backend not in BACKENDS:
        raise UsageError(f"there is no backend named '{job.backend}'; choose one of: {', '.join(BACKENDS)}.")
    return BACKENDS[job.backend]


def _require_placement(job: Job, cell: Cell) -> None:
    if job.robot and job.place is None and cell.fixture is None:
        raise UsageError(
            f"the cell {cell.name} is not calibrated, so nobody knows where the part stands: list the points of the "
            "fixture that the tool touched under [work], or add `--place demo` for a program that only runs dry, or "
            "`--no-robot` for the path alone."
        )


def _placement(job: Job, cell: Cell, part: Surface) -> Placement | None:
    if not job.robot:
        return None
    if job.place == "demo":
        return demo_placement(part, position=cell.demo_position)
    if cell.fixture is None:
        raise UsageError(f"the cell {cell.name} is not calibrated.")
    return fit_touched_points(cell.fixture)


def upright(workpiece: Workpiece) -> FloatArray:
    """Return how the part stands; where nobody places it its mean normal is up, or its own z axis without one."""
    if workpiece.placement is not None:
        return workpiece.placement.T_base_work[:3, :3]
    mean = mean_normal(workpiece.part)
    length = float(np.linalg.norm(mean))
    if length < np.finfo(np.float64).eps:
        return np.eye(3)
    return smallest_rotation(mean / length, np.array([[0.0, 0.0, 1.0]]))[0]


def _seed(job: Job, surface: Surface) -> Seed:
    if job.seed is None:
        return boundary_seed(surface)
    return point_seed(surface, np.array(job.seed), tolerance=SEED_TOLERANCE)


def _wanted_spacing(job: Job, part: Surface, factory: Callable[..., Backend]) -> float:
    """Return the spacing, or where rounds are given an estimate of it that is good enough to refine by.

    Raises:
        UsageError: neither is given; the sentence says what both would be on this part.
        FieldError: the spacing is larger than the part.
    """
    across = float(np.linalg.norm(np.ptp(part.vertices, axis=0)))
    if job.spacing is not None and job.spacing > across:
        raise FieldError(
            f"spacing is {job.spacing:g} mm, but the whole part is only {across:.3g} mm across: choose a smaller one."
        )
    if job.spacing is not None:
        return job.spacing
    coarse = refine(part, edge_length=across / TRIANGLES_ACROSS)
    depth = factory(coarse).distance(_seed(job, coarse)).maximum
    if job.rounds is None:
        raise UsageError(
            f"give `--spacing` or `--rounds`; on this part 10 rounds are about {depth / 10:.2g} mm, 20 about "
            f"{depth / 20:.2g} mm.",
            depth_mm=depth,
        )
    return depth / job.rounds
