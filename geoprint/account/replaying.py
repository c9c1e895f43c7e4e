"""The robot as the report page draws it, from the solids of the collision check, and its motion."""

from __future__ import annotations

import numpy as np

from geoprint import transforms
from geoprint.model import FloatArray, Robot, Surface
from geoprint.motion.arm import JOINTS, Arm
from geoprint.motion.collision import box_target, link_solids, polytope, tool_solids
from geoprint.report import MOST_FRAMES, Body, Machine, Replay, view_surface
from geoprint.results import Plan, RobotPlan, Workpiece
from geoprint.surfaces import vertex_normals

# Faces of the body that the part lies on, as it is drawn; and how far it is drawn below its surface, which the part
# shares, over its size.
BODY_FACES = 6_000
BODY_SUNK = 0.006


def machine(workpiece: Workpiece, robot: RobotPlan) -> Machine:
    """Return the arm, its tool, the obstacles of the cell and the body, with all joints at zero, in the work frame."""
    cell, T_work_base = workpiece.cell, transforms.inverse(robot.placement.T_base_work)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    screws, Ts_base_link = arm.screws(), arm.link_poses(np.zeros((1, JOINTS)))[0]
    bodies = [
        *(Body("arm", joint, _moved(one, T_work_base @ Ts_base_link[joint])) for joint, one in _links(cell.robot)),
        *(
            Body("tool", JOINTS, _moved(Surface(*polytope(solid, by=0.0)), T_work_base @ Ts_base_link[-1]))
            for solid in tool_solids(cell.tool)
        ),
    ]
    for obstacle in cell.obstacles:
        corners = box_target(obstacle, T_work_base=T_work_base).triangles.reshape(-1, 3)
        bodies.append(Body("cell", 0, Surface(corners, np.arange(len(corners)).reshape(-1, 3))))
    if workpiece.body is not None:
        bodies.append(Body("body", 0, _sunk(view_surface(workpiece.body, faces=BODY_FACES).surface)))
    return Machine(
        points=transforms.apply(T_work_base, screws.points),
        directions=screws.directions @ T_work_base[:3, :3].T,
        bodies=tuple(bodies),
    )


def replay(plan: Plan, robot: RobotPlan) -> Replay:
    """Return the motion at so many rows of the trajectory as the page shows."""
    cell, trajectory = plan.workpiece.cell, robot.trajectory
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    last = trajectory.times.size - 1
    rows = np.unique(np.linspace(0, last, MOST_FRAMES).astype(np.int64))
    ends = np.clip([rows - 1, rows + 1], 0, last)
    tips = arm.link_poses(trajectory.joints[ends.ravel()])[:, -1, :3, 3].reshape(2, -1, 3)
    laid = np.flatnonzero(plan.poses.deposit)
    starts = np.flatnonzero(np.diff(plan.poses.runs[laid], prepend=-1))
    return Replay(
        times=trajectory.times[rows],
        joints=trajectory.joints[rows],
        speeds=np.linalg.norm(tips[1] - tips[0], axis=1) / np.diff(trajectory.times[ends], axis=0)[0],
        valve=robot.switching.material,
        lamp=robot.switching.lamp,
        bead=plan.poses.tips[laid],
        bead_offsets=np.append(starts, laid.size),
        bead_times=trajectory.pose_times[laid],
    )


def _links(robot: Robot) -> list[tuple[int, Surface]]:
    """Return the solids of the links in their own frames, with the joint that moves each."""
    return [
        (link.joint, Surface(*polytope(solid, by=0.0)))
        for link in link_solids(robot.model, urdf=robot.urdf, flange=robot.flange)
        for solid in link.solids
    ]


def _moved(surface: Surface, T_a_b: FloatArray) -> Surface:
    return Surface(transforms.apply(T_a_b, surface.vertices), surface.faces)


def _sunk(body: Surface) -> Surface:
    """Return the body a little smaller, so that it does not come through the part that lies on it."""
    depth = BODY_SUNK * float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
    return Surface(body.vertices - depth * vertex_normals(body), body.faces)
