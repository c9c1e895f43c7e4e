"""The robot as the report page draws it, from the solids of the collision check, and its motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from geoprint import transforms
from geoprint.model import FloatArray, Robot, Surface
from geoprint.motion.arm import JOINTS, Arm, tilts
from geoprint.motion.collision import link_solids, obstacle_target, polytope, tool_solids
from geoprint.motion.machine import obstacles_at
from geoprint.report import MOST_FRAMES, Body, Machine, MotionShades, Replay, shading_normals, view_surface
from geoprint.results import Plan, RobotPlan, Workpiece

# Faces of the body that the part lies on, and of a link, as they are drawn.
BODY_FACES = 6_000
LINK_FACES = 3_000
# How far the body is drawn below its surface, which the part shares, over its size.
BODY_SUNK = 0.006


def machine(workpiece: Workpiece, robot: RobotPlan, *, cell_file: Path | None) -> Machine:
    """Return the arm, its tool, what stands in the cell and the body, with all joints at zero, in the work frame."""
    cell, T_work_base = workpiece.cell, transforms.inverse(robot.placement.T_base_work)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    screws, Ts_work_link = arm.screws(), T_work_base @ arm.link_poses(np.zeros((1, JOINTS)))[0]
    links, notes = _links(cell.robot, cell_file)
    thinned = ((joint, view_surface(one, faces=LINK_FACES).surface) for joint, one in links)
    bodies = [Body("arm", joint, _moved(one, Ts_work_link[joint])) for joint, one in thinned]
    tool = (Surface(*polytope(solid, by=0.0)) for solid in tool_solids(cell.tool))
    bodies += [Body("tool", JOINTS, _moved(one, Ts_work_link[-1])) for one in tool]
    for obstacle in obstacles_at(cell, robot.placement):
        corners = obstacle_target(obstacle, T_work_base=T_work_base).triangles.reshape(-1, 3)
        bodies.append(Body("cell", 0, Surface(corners, np.arange(len(corners)).reshape(-1, 3))))
    if workpiece.body is not None:
        bodies.append(Body("body", 0, _sunk(view_surface(workpiece.body, faces=BODY_FACES).surface)))
    return Machine(
        points=transforms.apply(T_work_base, screws.points),
        directions=screws.directions @ T_work_base[:3, :3].T,
        bodies=tuple(bodies),
        note=" ".join([*notes, *_attitude(robot)]),
    )


def _attitude(robot: RobotPlan) -> list[str]:
    pose = robot.placement.table
    return [] if pose is None else [f"The replay shows attitude {pose.number} of the table."]


def motion_shades(plan: Plan, vertices: FloatArray) -> MotionShades:
    """Return lean and speed at the piece of deposit that lies nearest to each of (n, 3) vertices [mm]."""
    middles, leans, speeds = (np.concatenate(each) for each in zip(*map(_laid, plan.robot), strict=True))
    _, nearest = KDTree(middles).query(vertices)
    pieces = np.asarray(nearest)
    return MotionShades(np.degrees(leans[pieces]), speeds[pieces] / plan.workpiece.cell.process.speed)


def _laid(robot: RobotPlan) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the (k, 3) middles of the pieces of deposit of a robot's part, their leans [rad] and speeds [mm/s]."""
    poses, times = robot.joint_path.poses, robot.trajectory.pose_times
    lengths, durations = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1), np.diff(times)
    rows = np.flatnonzero(poses.laid & (lengths > 0.0) & (durations > 0.0))
    places = poses.surface_points
    return (places[rows] + places[rows + 1]) / 2.0, tilts(poses)[rows], lengths[rows] / durations[rows]


def replay(plan: Plan, robot: RobotPlan) -> Replay:
    """Return the motion at so many rows of the trajectory as the page shows."""
    cell, trajectory, poses = plan.workpiece.cell, robot.trajectory, robot.joint_path.poses
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    last = trajectory.times.size - 1
    rows = np.unique(np.linspace(0, last, MOST_FRAMES).astype(np.int64))
    ends = np.clip([rows - 1, rows + 1], 0, last)
    tips = arm.link_poses(trajectory.joints[ends.ravel()])[:, -1, :3, 3].reshape(2, -1, 3)
    laid = np.flatnonzero(poses.deposit)
    starts = np.flatnonzero(np.diff(poses.runs[laid], prepend=-1))
    return Replay(
        times=trajectory.times[rows],
        joints=trajectory.joints[rows],
        speeds=np.linalg.norm(tips[1] - tips[0], axis=1) / np.diff(trajectory.times[ends], axis=0)[0],
        valve=robot.switching.material,
        lamp=robot.switching.lamp,
        bead=poses.tips[laid],
        bead_offsets=np.append(starts, laid.size),
        bead_times=trajectory.pose_times[laid],
    )


def _links(robot: Robot, cell_file: Path | None) -> tuple[list[tuple[int, Surface]], list[str]]:
    """Return the meshes of the links, or their solids, each with the joint that moves it; and what lacks its mesh."""
    meshes: dict[int, list[Surface]] = {}
    notes: list[str] = []
    if robot.urdf is not None and cell_file is not None:
        from geoprint.motion.arm.link_meshes import link_meshes

        meshes, notes = link_meshes(robot, cell=cell_file)
    links = link_solids(robot.model, urdf=robot.urdf, flange=robot.flange)
    return [
        (link.joint, one)
        for link in links
        for one in meshes.get(link.joint, [Surface(*polytope(solid, by=0.0)) for solid in link.solids])
    ], notes


def _moved(surface: Surface, T_a_b: FloatArray) -> Surface:
    return Surface(transforms.apply(T_a_b, surface.vertices), surface.faces)


def _sunk(body: Surface) -> Surface:
    """Return the body a little smaller, so that it does not come through the part that lies on it."""
    depth = BODY_SUNK * float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
    return Surface(body.vertices - depth * shading_normals(body), body.faces)
