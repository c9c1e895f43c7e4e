"""The stages in their order: a mesh file in, a frozen plan out that keeps every intermediate value.

    file -> Workpiece -> Paths -> Toolpath -> PoseStream -> evenness, flow and layer       plan_paths
    PoseStream -> JointPath -> Trajectory -> Targets -> ControllerPath -> Clearance -> Orders -> Program -> Timeline
                                                                                             with_robot

Where the robot cannot follow or touches something, its stages are taken again with the nozzle leaning, and with travel
over everything.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from geoprint.config import Job
from geoprint.errors import ClearanceError, FieldError, LimitError, PlanError, ReachError, naming, percent
from geoprint.geometry import face_areas
from geoprint.metrics.executed_flow import deposited_shares, deposited_volume, executed_flow
from geoprint.model import (
    Cell,
    Clearance,
    ControllerPath,
    FloatArray,
    JointPath,
    Placement,
    PoseStream,
    Program,
    Trajectory,
)
from geoprint.postprocessor import Executed, Orders, Timeline, TrajectoryTable, check_timeline, orders_of, timeline
from geoprint.postprocessor.interface import RobotProgram
from geoprint.postprocessor.registry import post_processor_of
from geoprint.postprocessor.switching import switching_events
from geoprint.process import following_flow
from geoprint.results import DepositedLayer, Plan, RobotPlan, Workpiece
from geoprint.robot.arm import Arm, check_load
from geoprint.robot.collision import ClearanceCheck
from geoprint.robot.controller import (
    LIFTED_STEP,
    controller_path,
    lifted_joints,
    lifted_path,
    there_and_back,
    written_path,
)
from geoprint.robot.reach import Leaning, frame_room, lost_shares, reach
from geoprint.robot.timing import held_straight, off_moves, timed_print, tips_at
from geoprint.threads import both
from geoprint.workflow.backend_choice import check_options, check_part, with_backend
from geoprint.workflow.covering import Measured, measured_covers, shared_surface, taken_alike, with_print
from geoprint.workflow.feedback import printing_at, with_feedback
from geoprint.workflow.placement import arm_of, clearance_check, leaning_of, pose_stream, with_flow_of
from geoprint.workflow.refusals import printed
from geoprint.workflow.stages import Stages
from geoprint.workflow.tilting import with_attitudes, with_table
from geoprint.workflow.workpiece import prepare_workpiece, with_rounds

# What no check looks at where a table holds the part.
OVER_A_TABLE = (
    "how exactly the table reaches and holds its attitude",
    "table motion other than straight from one attitude to the next, and past obstacles",
)
# What nothing proves of an arm without a closed form.
BY_ITERATION = "whether iteration, by which the inverse kinematics of this arm are solved, misses a solution"
# A layer of a stack is slowed down by so much at most, to make up for what its paths miss: fronts that meet leave a few
# percent, and more is a hole.
MOST_MADE_UP = 1.03
# No program is written that deposits less or more than this of what a run was planned to get.
LEAST_DEPOSITED, MOST_DEPOSITED = 0.9, 1.1


def plan(job: Job, *, observe: Callable[[str], None] = lambda _: None) -> Plan:
    """Plan a part: paths on its surface and, with a robot, the checked program.

    Args:
        job: what to plan.
        observe: called with the name of each stage as it starts.

    Returns:
        The plan. A plan that fails a check is not returned: the check raises.

    Raises:
        UsageError: the job or its cell is unclear or contradicts itself.
        InputError: a file cannot be planned on.
        PlanError: no valid motion exists; the sentence says where and why.
    """
    check_part(job)
    check_options(job, [job.backend])
    stage = Stages(observe)
    if job.compared:
        backends = list(dict.fromkeys([*job.compared, job.backend]))
        workpiece, unplaced = compared_workpiece(job, stage, backends=backends)
        job = with_rounds(job, workpiece.cell)
        return plan_compared(_compared_cover(job, workpiece, stage, backends=backends), stage, unplaced=unplaced)[0]
    workpiece = prepare_workpiece(job, stage, backends=[job.backend])
    job = with_rounds(job, workpiece.cell)
    return plan_measured(lambda: measured_covers(job, workpiece, stage), workpiece, stage)


def plan_measured(measured: Callable[[], tuple[Measured, ...]], workpiece: Workpiece, stage: Stages) -> Plan:
    """Plan with one backend from its paths on a workpiece on.

    Args:
        measured: returns what `measured_covers` does.
        workpiece: that they cover.
        stage: names and times the work.
    """
    paths, at_rest = _with_check(lambda: _with_layer(taken_alike([measured()])[0], stage), workpiece)
    if workpiece.placement is not None:
        paths = _with_robots(paths, workpiece.placement, stage, at_rest=at_rest)
    return with_print(paths, stage)


def compared_workpiece(job: Job, stage: Stages, *, backends: Sequence[str]) -> tuple[Workpiece, str | None]:
    """Prepare what several backends plan on; where it cannot be placed, without a robot and with the reason.

    Whichever of them asks, the surface is the same: the job's own backend does not count.
    """
    check_options(job, backends)
    job = with_backend(job, Job.model_fields["backend"].default)
    try:
        return prepare_workpiece(job, stage, backends=backends), None
    except PlanError as error:
        return prepare_workpiece(job.model_copy(update={"robot": False}), stage, backends=backends), str(error)


def _compared_cover(job: Job, workpiece: Workpiece, stage: Stages, *, backends: Sequence[str]) -> Measured:
    """Return what a comparison takes of the job's backend: the middle is that of all of them."""
    on = shared_surface(job, workpiece)
    covers = {job.backend: measured_covers(job, workpiece, stage, on=on)}
    if len(covers[job.backend]) > 1:
        for name in backends:
            with suppress(FieldError):
                if name not in covers:
                    covers[name] = measured_covers(with_backend(job, name), workpiece, stage, on=on)
    in_order = [name for name in backends if name in covers]
    return taken_alike([covers[name] for name in in_order])[in_order.index(job.backend)]


def plan_compared(
    measured: Measured, stage: Stages, *, unplaced: str | None
) -> tuple[Plan, tuple[tuple[str, float], ...]]:
    """Plan one of several backends: evenness counts whether or not the robot can print it.

    Args:
        measured: its paths on the workpiece of all of them.
        stage: names and times the work.
        unplaced: why the part cannot be placed, or None.

    Returns:
        The plan, which says why it cannot be printed, and what the arm cannot reach, as `Planned.lost`.
    """
    workpiece = measured[0].workpiece
    paths, at_rest = _with_check(lambda: _with_layer(measured, stage), workpiece)
    if workpiece.placement is None:
        return with_print(replace(paths, not_printable=unplaced), stage), ()
    try:
        return with_print(_with_robots(paths, workpiece.placement, stage, at_rest=at_rest), stage), ()
    except PlanError as error:
        return with_print(replace(paths, not_printable=str(error)), stage), lost_shares(error)


def plan_paths(job: Job, workpiece: Workpiece, stage: Stages) -> Plan:
    """Cover the workpiece, measure evenness and give the poses their flow; the robot is left out."""
    return _with_layer(taken_alike([measured_covers(job, workpiece, stage)])[0], stage)


def _with_layer(covered: Measured, stage: Stages) -> Plan:
    """Give the poses of measured paths their flow."""
    paths, measured = covered
    workpiece = paths.workpiece
    with stage("layer"):
        stream, deposited = _deposit(paths.poses, measured.pose_widths, workpiece, spacing=paths.contours.spacing)
    paths = _whole_layer(replace(paths, poses=stream, deposited=deposited))
    if workpiece.cell.table is not None:
        with stage("table"):
            paths = with_table(paths, workpiece.cell.table)
    return with_feedback(replace(paths, timings=tuple(stage.timings)))


def with_robot(paths: Plan, placement: Placement, stage: Stages, *, known: ClearanceCheck | None = None) -> Plan:
    """Add the robot to a plan of paths: joints, time, clearance, program.

    The nozzle first stays as upright as the path has it. Where that is out of reach or hits something, it may lean.
    Where travel alone is not clear, all of it is planned again over everything.

    Args:
        paths: of the part as it stands there.
        placement: where it stands.
        stage: names and times the work.
        known: as `clearance_check`.

    Raises:
        PlanError: no valid motion exists; says where and why.
    """
    with stage("surroundings"):
        check = clearance_check(paths.workpiece, placement, known=known)
    try:
        return _low_or_high(paths, placement, stage, check=check)
    except (ReachError, ClearanceError):
        if paths.job.max_tilt == 0.0:
            raise
    with stage("room to lean"):
        leaning = leaning_of(paths, placement, check.scene)
    return _low_or_high(paths, placement, stage, check=check, leaning=leaning)


def _with_check(make: Callable[[], Plan], workpiece: Workpiece) -> tuple[Plan, ClearanceCheck | None]:
    """Make paths while another thread prepares the collision check; of a layer that depends on what they miss."""
    placement = workpiece.placement
    if placement is None or workpiece.place is not None:
        return make(), None
    return both(make, lambda: clearance_check(workpiece, placement))


def _with_robots(paths: Plan, placement: Placement, stage: Stages, *, at_rest: ClearanceCheck | None) -> Plan:
    """Plan the robot where the part stands, or in each attitude of the table that tilts it."""
    if at_rest is None:
        with stage("surroundings"):
            at_rest = clearance_check(paths.workpiece, placement)
    chain = partial(with_robot, known=at_rest)
    if paths.tilting is not None:
        return with_attitudes(paths, placement, stage, chain=chain)
    return printed(paths, placement, stage, chain=chain)


def _with_robot(
    paths: Plan,
    placement: Placement,
    stage: Stages,
    *,
    check: ClearanceCheck,
    leaning: Leaning | None,
) -> Plan:
    """Take the robot's stages in their order, from the poses to the program that was executed."""
    workpiece, cell = paths.workpiece, paths.workpiece.cell
    with stage("reach"):
        arm = arm_of(workpiece)
        joint_path = reach(
            paths.poses, arm, T_base_work=placement.T_base_work, weights=cell.search, leaning=leaning,
            refuse=check.refuse_poses,
        )  # fmt: skip
    with stage("timing"):
        joint_path = held_straight(joint_path, arm, process=cell.process)
        constant_flow = cell.signals.mode == "io" and paths.job.on_slowdown == "auto"
        process, trajectory, targets = timed_print(
            joint_path, arm, process=cell.process, constant_flow=constant_flow, settle=cell.signals.settle
        )
        ceiling, cell = cell.process.speed, printing_at(paths, process.speed)
        paths = replace(paths, workpiece=replace(workpiece, cell=cell))
    with stage("collision check"):
        motion = TrajectoryTable(trajectory.times, trajectory.joints, trajectory.deposit, trajectory.runs)
        path = post_processor_of(cell).driven(joint_path, targets, motion, arm)
        found = _checked(check, path, joint_path.poses, placement=placement, arm=arm)
        lifted, lifted_targets = lifted_path(joint_path, targets, arm)
        dry_found = check(controller_path(lifted, lifted_targets, arm, step=LIFTED_STEP), poses=lifted.poses)
        _check_stations(lifted, cell, arm, check=check)
    with stage("program"):
        written = written_path(joint_path, targets, arm)
        off = off_moves(trajectory, written, targets, arm)
        extent = np.stack([workpiece.part.vertices.min(axis=0), workpiece.part.vertices.max(axis=0)])
        passed = np.vstack([written.joints[targets.poses], lifted.joints])
        orders = orders_of(
            written, targets, trajectory, placement=placement, extent=extent,
            lifted_joints=lifted_joints(lifted, joint_path, targets),
            frame=frame_room(passed, arm, extent=extent, T_base_work=placement.T_base_work),
        )  # fmt: skip
        program, executed, switching = _program(paths, orders, motion, found, placement=placement, arm=arm)
        _check_deposit(joint_path.poses, trajectory, switching, paths)
    robot = RobotPlan(
        placement, joint_path, trajectory, targets, path, found, dry_found, orders, program, switching, executed, off,
        ceiling,
    )  # fmt: skip
    return replace(paths, poses=joint_path.poses, robot=(robot,), timings=tuple(stage.timings))


def _low_or_high(
    paths: Plan,
    placement: Placement,
    stage: Stages,
    *,
    check: ClearanceCheck,
    leaning: Leaning | None = None,
) -> Plan:
    """Plan with low travel and with leads, and where only these fail, without leads and over everything."""
    try:
        return _with_robot(paths, placement, stage, check=check, leaning=leaning)
    except (ClearanceError, ReachError) as error:
        if not error.details.get("travelling", False):
            raise
    high = pose_stream(paths.toolpath, paths.workpiece, max_tilt_deg=paths.job.max_tilt, travel="high")
    # Only travel differs: what was chosen to flow on the deposits stays.
    paths = replace(paths, poses=with_flow_of(high, paths.poses))
    return _with_robot(paths, placement, stage, check=check, leaning=leaning)


def _deposit(
    poses: PoseStream, widths: FloatArray, workpiece: Workpiece, *, spacing: float
) -> tuple[PoseStream, DepositedLayer]:
    """Give a stream the flow that the cell's signals allow.

    'io' can only open and shut a valve, so the flow is constant; 'analog' sets it along the path, so it follows.

    Args:
        poses: the stream with constant flow, or where the width differs with that of the wanted one.
        widths: (p,) of the strip of surface at each pose, over the wanted one.
        workpiece: with its cell.
        spacing: distance between neighbouring paths [mm].

    Returns:
        The stream with the flow to print, and what is to be said of it.
    """
    cell = workpiece.cell
    wanted = poses.flow / (spacing * cell.process.layer_height)
    followed = following_flow(widths, deposit=poses.deposit, spacing=spacing, process=cell.process, wanted=wanted)
    deposited = DepositedLayer(cell.signals.mode, spacing * float(wanted.max()), following_flow=followed)
    return (replace(poses, flow=followed) if deposited.mode == "analog" else poses), deposited


def _whole_layer(paths: Plan) -> Plan:
    """Slow a layer of a stack down by what its paths miss of it, so that an open valve deposits its whole volume.

    Flow to a mm rises as the speed falls: what is let through in a second, and so the pressure, stays that of the cell.
    A flow that follows needs none of it, a single skin has nothing above it that would be too low, and what is missed
    in gaps that are too large to be filled from beside stays missed.
    """
    place, cell, poses = paths.workpiece.place, paths.workpiece.cell, paths.poses
    if place is None or cell.signals.mode == "analog":
        return paths
    wanted, deposited = place.height * face_areas(paths.workpiece.part).sum(), deposited_volume(poses, poses.flow)
    share = float(np.clip(wanted / deposited, 1.0, MOST_MADE_UP)) if deposited else 1.0
    return replace(
        paths,
        poses=replace(poses, flow=share * poses.flow),
        workpiece=replace(paths.workpiece, cell=cell.at_speed(cell.process.speed / share)),
    )


def _checked(
    check: ClearanceCheck, path: ControllerPath, poses: PoseStream, *, placement: Placement, arm: Arm
) -> Clearance:
    """Return what a motion keeps clear of, and what nobody checks over a table or for an arm by iteration."""
    found = check(path, poses=poses)
    unchecked = (*(OVER_A_TABLE if placement.table else ()), *((BY_ITERATION,) if arm.no_closed_form else ()))
    return replace(found, not_checked=(*found.not_checked, *unchecked))


def _check_stations(lifted: JointPath, cell: Cell, arm: Arm, *, check: ClearanceCheck) -> None:
    """Check the motion from home and back to where the program primes the nozzle and floods the part."""
    stations = (("purge", cell.purge), ("flood", cell.flood))
    for name, at in stations:
        if at is not None and at.joints is not None:
            with naming(f"the joints of [{name}]"):
                check(there_and_back(at.joints, arm, step=LIFTED_STEP), poses=lifted.poses)


def _check_deposit(poses: PoseStream, trajectory: Trajectory, switching: Timeline, paths: Plan) -> None:
    """Check that every run gets about the volume that was planned, as the program was executed.

    Raises:
        LimitError: one does not, and the job does not accept that.
    """
    cell = paths.workpiece.cell
    flow = executed_flow(poses, trajectory.pose_times, switching.material, cell=cell)
    runs, shares = deposited_shares(poses, flow, layer_height=cell.process.layer_height)
    if paths.job.accept_flow or not (wrong := (shares < LEAST_DEPOSITED) | (shares > MOST_DEPOSITED)).any():
        return
    worst = int(np.abs(shares - 1.0).argmax())
    remedy = "choose a wider spacing, which makes longer runs"
    if cell.signals.mode == "io" and paths.job.on_slowdown != "auto":
        remedy = "`--set on_slowdown=auto` finds the speed that deposits the planned volume"
    raise LimitError(
        f"the program would deposit {percent(shares[worst])} of the volume of run {runs[worst] + 1}, allowed are "
        f"{percent(LEAST_DEPOSITED)} to {percent(MOST_DEPOSITED)} ({int(wrong.sum())} of {runs.size} runs). {remedy}; "
        "or accept it with `--set accept_flow=true`.",
        run=int(runs[worst]), share=float(shares[worst]),
    )  # fmt: skip


def _program(
    paths: Plan,
    orders: Orders,
    motion: TrajectoryTable,
    found: Clearance,
    *,
    placement: Placement,
    arm: Arm,
) -> tuple[Program, Executed, Timeline]:
    """Return a program with what was executed of it and when its outputs switch, both within what is allowed."""
    cell = paths.workpiece.cell
    tips = tips_at(motion.times, motion.joints, arm, T_base_work=placement.T_base_work)
    program = RobotProgram(
        part_name=paths.workpiece.name,
        spacing=paths.contours.spacing,
        placement=placement,
        surface_within=paths.workpiece.surface_within,
        orders=orders,
        events=switching_events(orders, signals=cell.signals, tips_at=tips, speed=cell.process.speed),
        tips_at=tips,
        motion=motion,
        checked=(*found.checked, check_load(cell.tool, arm).sentence),
        not_checked=found.not_checked,
    )
    written, execution = post_processor_of(cell).write(program, cell)
    assert execution.executed is not None  # noqa: S101  # What is written was executed.
    switching = timeline(execution.switched, orders, signals=cell.signals, tips_at=tips)
    check_timeline(switching)
    return written, execution.executed, switching
