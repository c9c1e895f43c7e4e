"""A part that stands elsewhere, or turned: its placement, the poses that depend on it, and the room that it has."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.spatial import ConvexHull

from geoprint.model import FloatArray, Placement, PoseStream, Surface, Toolpath
from geoprint.motion.arm import Arm
from geoprint.motion.placing import LEAST_MEAN_NORMAL, Room, Stand, demo_placement
from geoprint.paths import poses
from geoprint.results import Plan, Workpiece
from geoprint.transforms import apply

# A surface with more corners is replaced by those of its convex hull: they alone decide what it stands on.
MANY_POINTS = 1000
# The part at the base's origin, its mean normal up.
UPRIGHT = Stand(np.zeros(3), np.zeros(3))


def stood(paths: Plan, stand: Stand) -> Plan:
    """Return a plan of paths for a part that stands elsewhere; the cell's demonstration position goes with it.

    The deposits stay where they are on the part, with what flows on them; attitude and travel depend on how it stands.
    """
    T_base_fixture = stand.T_base_fixture
    cell = replace(paths.workpiece.cell, demo_position=T_base_fixture[:3, 3], demo_rotation=T_base_fixture[:3, :3])
    workpiece = replace(paths.workpiece, cell=cell, placement=stand_placement(paths.workpiece, stand))
    stream = pose_stream(paths.toolpath, workpiece, max_tilt_deg=paths.job.max_tilt)
    return replace(paths, workpiece=workpiece, poses=with_flow_of(stream, paths.poses))


def with_flow_of(stream: PoseStream, before: PoseStream) -> PoseStream:
    """Return a stream of the same deposits with the flow of another."""
    flow = np.zeros(stream.count)
    flow[stream.deposit] = before.flow[before.deposit]
    return replace(stream, flow=flow)


def stand_placement(workpiece: Workpiece, stand: Stand) -> Placement:
    """Return the placement of a part at a stand; nobody has measured it."""
    T_base_fixture = stand.T_base_fixture
    return demo_placement(
        workpiece.part, position=T_base_fixture[:3, 3], rotation=T_base_fixture[:3, :3], least=LEAST_MEAN_NORMAL
    )


def pose_stream(
    toolpath: Toolpath, workpiece: Workpiece, *, max_tilt_deg: float, travel: Literal["low", "high"] = "low"
) -> PoseStream:
    """Return the poses of a toolpath on a workpiece, as it stands; the nozzle leans by at most so many degrees.

    What travel means is said by `paths.poses`.
    """
    process = workpiece.cell.process
    return poses(
        toolpath,
        workpiece.surface,
        R_base_work=workpiece.upright,
        standoff=process.standoff,
        retract=process.retract,
        layer_height=process.layer_height,
        max_tilt=float(np.radians(max_tilt_deg)),
        tool=workpiece.cell.tool,
        body=workpiece.body,
        travel=travel,
    )


def arm_of(workpiece: Workpiece) -> Arm:
    """Return the arm of a workpiece's cell, with its tool."""
    return Arm(workpiece.cell.robot, T_flange_tool=workpiece.cell.tool.T_flange_tool)


def room_of(workpiece: Workpiece) -> Room:
    """Return where part and body may stand, from the corners that decide it."""
    T_fixture_work = stand_placement(workpiece, UPRIGHT).T_base_work
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
