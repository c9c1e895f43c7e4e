"""Where a demonstration stands: with its mean normal up where that can be printed, else as a search turns or moves it.

What changes with it: its placement, the poses that depend on it, and the room that it has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from geoprint.config import PLACEMENT_DECIMALS, cell_at
from geoprint.errors import ClearanceError, Detail, InputError, PlanError, ReachError
from geoprint.model import Cell, Cylinder, FloatArray, Placement, PoseStream, Surface, Toolpath
from geoprint.positioner import obstacles_at
from geoprint.results import Orientation, Plan, Workpiece
from geoprint.robot.arm import Arm
from geoprint.robot.collision import CheckedWorld, ClearanceCheck, obstacle_target, tool_solids
from geoprint.robot.controller import tightest_bend
from geoprint.robot.placing import (
    LEAST_MEAN_NORMAL,
    ROUND_SOLIDS,
    Candidate,
    FixturePose,
    Oriented,
    Room,
    Scene,
    demo_placement,
    search_orientation,
    search_placement,
)
from geoprint.robot.reach import Leaning, NozzleRoom
from geoprint.toolpath import Leads, PosedSurface, posed_surface, poses
from geoprint.transforms import apply, inverse
from geoprint.workflow.stages import Stages

Chain = Callable[[Plan, Placement, Stages], Plan]

# A surface with more corners is replaced by those of its convex hull: they alone decide what it stands on.
MANY_POINTS = 1000
# The tool is to turn with this share of what its weakest joint is accelerated by: near the wrist's singularity joints
# turn more than the tool does, and the controller changes its turn within the zones of targets alone.
TURNING_SHARE = 0.5
# An arm comes up to the speed of a print in so long [s], but where it is slow near a singularity: there the valve waits
# for what is left of the ramp.
LEAD_TIME = 0.08
# Candidates for a place that are planned through before giving up.
ATTEMPTS = 4
# The part at the base's origin, its mean normal up.
UPRIGHT = FixturePose(np.zeros(3), np.zeros(3))


def placed(paths: Plan, placement: Placement, stage: Stages, *, chain: Chain) -> Plan:
    """Plan the robot where the part stands, and where that is refused and nobody stated it, where a search turns it.

    What prints with its mean normal up stays there.

    Args:
        paths: of the part as it stands.
        placement: where that is.
        stage: names and times the work.
        chain: plans the robot at a placement.

    Raises:
        PlanError: as the chain; where a search was of no use, it says so.
    """
    try:
        return chain(paths, placement, stage)
    except (ReachError, ClearanceError) as error:
        if not paths.workpiece.turnable or not _may_help(error, paths.workpiece):
            raise
        refusal = error
    with stage("orientation"):
        found, tried = _search(paths)
    refused: list[str] = []
    alike, turned_at = "", None
    for oriented in found:
        turned, turned_placement = paths_at(paths, oriented.pose), placement_at(paths.workpiece, oriented.pose)
        try:
            planned = chain(turned, turned_placement, stage)
        except PlanError as error:
            refused.append(str(error))
            if not _may_help(error, paths.workpiece):
                alike = f". Turned by {_in_words(oriented)}, it fails for a reason that turning hardly changes: {error}"
                turned_at = error.details.get("place")
                break
            continue
        orientation = Orientation(
            rpy=oriented.pose.rpy,
            tilt=oriented.tilt,
            margin=oriented.margin,
            tried=tried,
            start=str(refusal),
            refused=tuple(refused),
        )
        return replace(planned, workpiece=replace(planned.workpiece, orientation=orientation))
    raise _refusal(refusal, len(found), tried, paths.workpiece, alike=alike, turned_at=turned_at) from refusal


def _may_help(error: PlanError, workpiece: Workpiece) -> bool:
    """Say whether a part that is turned may be printed: needle, cone and barrel stand over it as they did."""
    solid, against = error.details.get("solid"), str(error.details.get("against", ""))
    around_the_axis = {each.name for each in tool_solids(workpiece.cell.tool)[:ROUND_SOLIDS]}
    of_the_part = against.startswith(("part ", "body "))
    return arm_of(workpiece).closed_form is not None and not (solid in around_the_axis and of_the_part)


def _search(paths: Plan) -> tuple[tuple[Oriented, ...], int]:
    workpiece, cell = paths.workpiece, paths.workpiece.cell
    return search_orientation(
        paths.poses,
        arm_of(workpiece),
        T_fixture_work=placement_at(workpiece, UPRIGHT).T_base_work,
        position=cell.demo_position,
        scene=Scene(cell.tool, cell.process, workpiece.part, workpiece.body, room_of(workpiece)),
    )


def candidates_of(
    paths: Plan, poses: PoseStream, room: Room, *, height: float | None = None, tilt: float = 0.0
) -> tuple[Candidate, ...]:
    """Return places for a part as `search_placement` finds them, rounded as a cell file states them."""
    workpiece, cell = paths.workpiece, paths.workpiece.cell
    found = search_placement(
        poses,
        arm_of(workpiece),
        T_fixture_work=placement_at(workpiece, UPRIGHT).T_base_work,
        start=FixturePose(cell.demo_position, demo_rpy(cell)),
        room=room,
        height=height,
        tilt=tilt,
    )
    return tuple(replace(candidate, pose=_rounded(candidate.pose)) for candidate in found)


def demo_rpy(cell: Cell) -> FloatArray:
    """Return roll, pitch, yaw of a cell's demonstration after its mean normal was turned up [rad]."""
    return Rotation.from_matrix(cell.demo_turn).as_euler("xyz")


def _rounded(pose: FixturePose) -> FixturePose:
    return FixturePose(
        pose.position.round(PLACEMENT_DECIMALS), np.radians(np.degrees(pose.rpy).round(PLACEMENT_DECIMALS))
    )


def moved(paths: Plan, refused: PlanError, stage: Stages, *, chain: Chain) -> Plan:
    """Return the plan of a demonstration where the arm reaches it with the largest margin that passes every check.

    Args:
        paths: that are refused where the cell puts the part, however it is turned.
        refused: why.
        stage: names and times the work.
        chain: plans the robot at a placement.

    Raises:
        PlanError: the cell says how the part stands, moving it does not help, or every other place is refused as well.
    """
    workpiece = paths.workpiece
    if not workpiece.turnable or not _may_help(refused, workpiece):
        raise refused
    with stage("position"):
        try:
            candidates = candidates_of(paths, paths.poses, room_of(workpiece))
        except InputError:
            raise refused from None
    reached = [candidate.pose for candidate in candidates if candidate.margin > 0.0][:ATTEMPTS]
    for pose in reached:
        try:
            return chain(paths_at(paths, pose), placement_at(workpiece, pose), stage)
        except PlanError as error:
            if not _may_help(error, workpiece):
                raise refused from None
    found = "It is refused in the best other place as well" if reached else "No other place is within reach"
    raise type(refused)(f"{str(refused).rstrip('.')}. {found}.", **refused.details) from refused


def _in_words(oriented: Oriented) -> str:
    roll, pitch, yaw = np.degrees(oriented.pose.rpy).tolist()
    return f"({roll:.4g}, {pitch:.4g}, {yaw:.4g}) degrees"


def _refusal(
    error: PlanError, found: int, tried: int, workpiece: Workpiece, *, alike: str, turned_at: Detail
) -> PlanError:
    """Return the error of the start, with what was tried besides, and what is refused however it is turned."""
    if alike:
        return type(error)(f"{str(error).rstrip('.')}{alike}", **error.details, turned_place=turned_at)
    x, y, z = workpiece.cell.demo_position.tolist()
    planned = f", {found} of them planned completely" if found else ""
    return type(error)(
        f"{str(error).rstrip('.')}. That holds with its mean normal up, and for {tried} orientations about ({x:g}, "
        f"{y:g}, {z:g}) mm{planned}.",
        **error.details,
    )


def paths_at(paths: Plan, pose: FixturePose) -> Plan:
    """Return a plan of paths for a part that stands elsewhere; the cell's demonstration and its table go with it.

    The deposits stay where they are on the part, with what flows on them; attitude and travel depend on how it stands.
    """
    cell = cell_at(paths.workpiece.cell, pose.T_base_fixture)
    workpiece = replace(paths.workpiece, cell=cell, placement=placement_at(paths.workpiece, pose))
    stream = pose_stream(paths.toolpath, workpiece, max_tilt_deg=paths.job.max_tilt)
    return replace(paths, workpiece=workpiece, poses=with_flow_of(stream, paths.poses))


def with_flow_of(stream: PoseStream, before: PoseStream) -> PoseStream:
    """Return a stream of the same deposits with the flow of another."""
    flow = np.zeros(stream.count)
    flow[stream.deposit] = before.flow[before.deposit]
    return replace(stream, flow=flow)


def placement_at(workpiece: Workpiece, pose: FixturePose) -> Placement:
    """Return the placement of a part at a place; nobody has measured it."""
    T_base_fixture = pose.T_base_fixture
    found = demo_placement(
        workpiece.part, position=T_base_fixture[:3, 3], rotation=T_base_fixture[:3, :3], least=LEAST_MEAN_NORMAL
    )
    return replace(found, flow_unstated=workpiece.cell.signals.flow_unstated)


def pose_stream(
    toolpath: Toolpath,
    workpiece: Workpiece,
    *,
    max_tilt_deg: float,
    travel: Literal["low", "high"] = "low",
    known: PosedSurface | None = None,
) -> PoseStream:
    """Return the poses of a toolpath on a workpiece, as it stands; the nozzle leans by at most so many degrees.

    What travel means is said by `toolpath.poses`; high, runs have no leads either. What is known, if anything, is what
    `posed` returns.
    """
    cell, process = workpiece.cell, workpiece.cell.process
    return poses(
        toolpath,
        known or posed(workpiece),
        R_base_work=workpiece.upright,
        standoff=workpiece.standoff,
        retract=process.retract,
        layer_height=process.layer_height,
        max_tilt=float(np.radians(max_tilt_deg)),
        largest_bend=TURNING_SHARE * float(cell.robot.accelerations.min()) / process.speed**2,
        tool=cell.tool,
        leads=_leads(cell) if travel == "low" else None,
        beside=_table(workpiece),
        travel=travel,
    )


def _leads(cell: Cell) -> Leads | None:
    """Return how runs begin and end: at rest where the flow follows the speed, or settles before the tip moves."""
    if cell.signals.mode == "analog" or cell.signals.settle > 0.0:
        return None
    speed = cell.process.speed
    return Leads(length=LEAD_TIME * speed / 2.0, radius=tightest_bend(speed, period=cell.robot.target_period))


def posed(workpiece: Workpiece) -> PosedSurface:
    """Return what poses on a workpiece need of its surface however it stands."""
    return posed_surface(workpiece.surface, part=workpiece.part, body=workpiece.body)


def _table(workpiece: Workpiece) -> FloatArray:
    """Return the (b, 3) corners of a table's solids as it holds the part, in its coordinates; none without a table."""
    placement = workpiece.placement
    if placement is None or placement.table is None:
        return np.empty((0, 3))
    T_work_base = inverse(placement.T_base_work)
    solids = [one for one in obstacles_at(workpiece.cell, placement) if isinstance(one, Cylinder)]
    return np.concatenate([obstacle_target(one, T_work_base=T_work_base).triangles.reshape(-1, 3) for one in solids])


def arm_of(workpiece: Workpiece) -> Arm:
    """Return the arm of a workpiece's cell, with its tool."""
    return Arm(workpiece.cell.robot, T_flange_tool=workpiece.cell.tool.T_flange_tool)


def clearance_check(
    workpiece: Workpiece, placement: Placement, *, known: ClearanceCheck | None = None
) -> ClearanceCheck:
    """Return what proves that tool and arm of a workpiece's cell keep clear where it stands.

    Args:
        workpiece: the part, and the cell.
        placement: where it stands.
        known: the check of another placement, so that nothing is prepared twice.
    """
    return ClearanceCheck(
        arm_of(workpiece),
        tool=workpiece.cell.tool,
        process=workpiece.cell.process,
        T_base_work=placement.T_base_work,
        part=workpiece.ground,
        body=workpiece.body,
        obstacles=obstacles_at(workpiece.cell, placement),
        below=workpiece.below,
        known=known,
    )


def scene_at(workpiece: Workpiece, placement: Placement) -> CheckedWorld:
    """Return what the tool must not touch where a workpiece stands, as its `clearance_check` has it."""
    return CheckedWorld(
        workpiece.cell.tool,
        process=workpiece.cell.process,
        part=workpiece.ground,
        body=workpiece.body,
        obstacles=obstacles_at(workpiece.cell, placement),
        T_work_base=inverse(placement.T_base_work),
    )


def leaning_of(paths: Plan, placement: Placement, scene: CheckedWorld) -> Leaning:
    """Return how far the nozzle may lean, and what it must not touch where the part stands."""
    cell = paths.workpiece.cell
    room = NozzleRoom(
        cell.tool,
        process=cell.process,
        standoff=cell.process.standoff,
        scene=scene,
        T_base_work=placement.T_base_work,
    )
    return Leaning(float(np.radians(paths.job.max_tilt)), room)


def room_of(workpiece: Workpiece) -> Room:
    """Return where part and body may stand, from the corners that decide it."""
    T_fixture_work = placement_at(workpiece, UPRIGHT).T_base_work
    home = arm_of(workpiece).tool_poses(workpiece.cell.robot.home[None])[0]
    body = np.empty((0, 3)) if workpiece.body is None else _corners(workpiece.body)
    return Room(
        part=apply(T_fixture_work, _corners(workpiece.part)),
        body=apply(T_fixture_work, body),
        obstacles=workpiece.cell.obstacles,
        ceiling=float(home[2, 3]) - workpiece.cell.process.retract,
    )


def _corners(surface: Surface) -> FloatArray:
    if len(surface.vertices) <= MANY_POINTS:
        return surface.vertices
    # Joggled, because a plate has no volume.
    return surface.vertices[ConvexHull(surface.vertices, qhull_options="QJ").vertices]
