"""Where a part should stand: the placement with the largest margin that passes every check of a plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from geoprint.config import PLACEMENT_DECIMALS, Job, job_cell
from geoprint.errors import PlanError, UsageError
from geoprint.model import Cell, FloatArray, PoseStream
from geoprint.results import Plan, Proposal, Workpiece
from geoprint.robot.placing import LEAST_MEAN_NORMAL, FixturePose, Room, demo_placement
from geoprint.robot.reach import reach_map, reach_margin
from geoprint.workflow.backend_choice import check_part
from geoprint.workflow.placement import ATTEMPTS, arm_of, candidates_of, paths_at, placement_at, room_of
from geoprint.workflow.planning import plan_paths, with_robot
from geoprint.workflow.stages import Stages
from geoprint.workflow.tilting import in_turn, poses_at_rest, seen_at_rest, table_pose, with_attitudes
from geoprint.workflow.workpiece import prepare_workpiece, with_rounds

# Rounds that stand for the paths where neither spacing nor rounds are given: reach hardly depends on them.
DEFAULT_ROUNDS = 10


def propose_placement(
    job: Job, *, height: float | None = None, tilt_deg: float = 0.0, observe: Callable[[str], None] = lambda _: None
) -> Proposal:
    """Propose where a part stands with the largest margin, and prove it by planning there.

    Args:
        job: what to plan; it is placed as a demonstration whatever it says, because nobody has measured a proposal.
        height: of the part's centroid in the base frame [mm], or None where any will do.
        tilt_deg: how far from upright the part may be tilted [degrees].
        observe: called with the name of each stage as it starts.

    Returns:
        The best candidate that passes every check.

    Raises:
        UsageError: the job or its cell is unclear or contradicts itself.
        InputError: a file cannot be planned on, or the part finds no room in the cell.
        PlanError: no candidate passes; says why.
    """
    if not 0.0 <= tilt_deg <= 90.0:
        raise UsageError(f"`--tilt` is {tilt_deg:g} degrees; give 0 (upright) to 90.")
    check_part(job)
    cell = job_cell(job)
    if cell.table is not None:
        _check_table(cell, tilt_deg=tilt_deg)
        # A table stands on something: it stays as high as it is, unless another height is asked for.
        height = float(cell.demo_position[2]) if height is None else height
    stage = Stages(observe)
    paths = _covered(job, cell, stage)
    workpiece, poses, room = paths.workpiece, _poses(paths), room_of(paths.workpiece)
    with stage("search"):
        candidates = candidates_of(paths, poses, room, height=height, tilt=float(np.radians(tilt_deg)))
    refused: list[str] = []
    for candidate in candidates[:ATTEMPTS]:
        pose = candidate.pose
        try:
            planned = _planned(paths, pose, stage)
        except PlanError as error:
            refused.append(str(error))
            continue
        return _proposal(paths, poses, planned, pose=pose, room=room, refused=tuple(refused))
    # A candidate that the arm reaches is refused for another reason, with which a higher home does not help.
    higher = higher_home(paths, room, height=height) if candidates[0].margin <= 0.0 else ""
    raise PlanError(
        f"{workpiece.name} has no placement in {workpiece.cell.name}{higher}; the best of {len(candidates)} "
        f"candidates is refused: {refused[0]}",
        margin_deg=float(np.degrees(candidates[0].margin)),
    )


def best_placed(job: Job, *, observe: Callable[[str], None] = lambda _: None) -> Job:
    """Return a job whose place is 'best' as a demonstration where `propose_placement` puts it; others as they are.

    Of layers the one on the part decides. Where no place is better than that of the cell the part stands there.

    Raises:
        GeoprintError: as `propose_placement`.
    """
    if job.place != "best" or not job.robot:
        return job
    first = job.model_copy(update={"layer": job.layer or 1}) if job.layered else job
    found = propose_placement(first, observe=observe)
    pose = [*found.pose.position.tolist(), *np.degrees(found.pose.rpy).round(PLACEMENT_DECIMALS).tolist()]
    return job.model_copy(update={"place": "demo", "stand": pose if found.better else None})


def _covered(job: Job, cell: Cell, stage: Stages) -> Plan:
    """Return the paths that a plan of the part would take, as a demonstration, over a table with its attitudes."""
    job = with_rounds(job, cell)
    rounds = DEFAULT_ROUNDS if job.spacing is None and job.rounds is None else job.rounds
    job = job.model_copy(update={"place": "demo", "robot": True, "rounds": rounds})
    return plan_paths(job, prepare_workpiece(job, stage, backends=[job.backend]), stage)


def _check_table(cell: Cell, *, tilt_deg: float) -> None:
    if tilt_deg:
        raise UsageError(
            f"`--tilt` is {tilt_deg:g} degrees, but the cell {cell.name} has a table that tilts the part itself: omit "
            "`--tilt`."
        )


def _poses(paths: Plan) -> PoseStream:
    """Return the poses by which a place is judged: over a table those of all attitudes, as one motion."""
    placement = paths.workpiece.placement
    assert placement is not None  # noqa: S101  # It was asked for as a demonstration.
    return paths.poses if paths.tilting is None else poses_at_rest(paths, placement)


def _planned(paths: Plan, pose: FixturePose, stage: Stages) -> Plan:
    """Plan the robot for a part that stands elsewhere, over a table in all its attitudes."""
    placement = placement_at(paths.workpiece, pose)
    if paths.tilting is None:
        return with_robot(paths_at(paths, pose), placement, stage)
    return with_attitudes(paths_at(paths, pose), placement, stage, chain=with_robot)


def higher_home(paths: Plan, room: Room, *, height: float | None) -> str:
    """Say where the part could be reached if home were higher; nothing where that does not help."""
    if height is not None:
        return ""
    best = candidates_of(paths, _poses(paths), replace(room, ceiling=np.inf))[0]
    if best.margin <= 0.0:
        return ""
    x, y, z = best.pose.position
    return (
        f" below the tip at home, {room.ceiling:.0f} mm high. With a higher home, it is reachable at ({x:z.0f}, "
        f"{y:z.0f}, {z:z.0f}) mm, yaw {np.degrees(best.pose.rpy[2]):.0f} degrees, {np.degrees(best.margin):.0f} "
        "degrees inside every limit"
    )


def _proposal(
    paths: Plan, poses: PoseStream, planned: Plan, *, pose: FixturePose, room: Room, refused: tuple[str, ...]
) -> Proposal:
    arm, before, table = arm_of(paths.workpiece), _placed(paths.workpiece), planned.workpiece.cell.table
    placement = planned.workpiece.placement
    assert placement is not None  # noqa: S101  # It stands there.
    printed = [seen_at_rest(robot.joint_path.poses, robot.placement, placement) for robot in planned.robot]
    return Proposal(
        plan=planned,
        placement=placement,
        pose=pose,
        table=None if table is None else table_pose(table),
        before=reach_margin(poses, arm, T_base_work=before),
        map_before=reach_map(poses, arm, T_base_work=before),
        after=reach_margin(in_turn(printed), arm, T_base_work=placement.T_base_work),
        above=room.lowest(pose),
        refused=refused,
    )


def _placed(workpiece: Workpiece) -> FloatArray:
    cell = workpiece.cell
    return demo_placement(
        workpiece.part, position=cell.demo_position, rotation=cell.demo_turn, least=LEAST_MEAN_NORMAL
    ).T_base_work
