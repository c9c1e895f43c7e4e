"""The robot as report and live view draw it, from the solids of the collision check, and its motion."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint import transforms
from geoprint.model import (
    Cell,
    Cylinder,
    FloatArray,
    IntArray,
    Obstacle,
    Placement,
    Robot,
    Surface,
    TiltingTable,
    freeze_arrays,
    frozen,
)
from geoprint.positioner import straight_course, table_machine, work_poses
from geoprint.reporting.values import MOST_FRAMES, Body, Machine, MotionShades, Replay, TableReplay
from geoprint.reporting.view import shading_normals, view_surface
from geoprint.results import Plan, RobotPlan
from geoprint.robot.arm import JOINTS, Arm, tilts
from geoprint.robot.collision import link_solids, obstacle_target, polytope, tool_solids
from geoprint.robot.reach import bead_steps

# Faces of the body that the part lies on, and of a link, as they are drawn.
BODY_FACES = 6_000
LINK_FACES = 3_000
# How far the body is drawn below its surface, which the part shares, over its size.
BODY_SUNK = 0.006
# A table that comes to its attitude sooner is shown moving so long [s]: times of a replay rise.
SHORTEST_MOVE = 0.1
# What a table turns between two frames at most [rad]: straight between them what is far out comes in by a thousandth.
TABLE_STEP = np.radians(5.0)


def machine(
    cell: Cell,
    *,
    T_base_work: FloatArray,
    body: Surface | None,
    cell_file: Path | None,
) -> Machine:
    """Return the arm, its tool, what stands in the cell and the body, in the work frame.

    All joints are at zero, and a table rests.

    Args:
        cell: what is drawn.
        T_base_work: (4, 4) where the part stands [mm].
        body: that the part lies on, if there is one.
        cell_file: beside which the meshes of an arm's own URDF lie; without it its solids are drawn.
    """
    T_work_base = transforms.inverse(T_base_work)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    screws, Ts_work_link = arm.screws(), T_work_base @ arm.link_poses(np.zeros((1, JOINTS)))[0]
    links, notes = _links(cell.robot, cell_file)
    thinned = ((joint, view_surface(one, faces=LINK_FACES).surface) for joint, one in links)
    bodies = [Body("arm", joint, _moved(one, Ts_work_link[joint])) for joint, one in thinned]
    tool = (Surface(*polytope(solid, by=0.0)) for solid in tool_solids(cell.tool))
    bodies += [Body("tool", JOINTS, _moved(one, Ts_work_link[-1])) for one in tool]
    bodies += [Body("cell", 0, _outside(one, T_work_base)) for one in cell.obstacles]
    solids = enumerate(() if cell.table is None else table_machine(cell.table).solids(np.eye(4)), start=1)
    bodies += [Body("table", number, _outside(one, T_work_base)) for number, one in solids]
    if body is not None:
        bodies.append(Body("body", 0, _sunk(view_surface(body, faces=BODY_FACES).surface)))
    return Machine(
        points=transforms.apply(T_work_base, screws.points),
        directions=screws.directions @ T_work_base[:3, :3].T,
        bodies=tuple(bodies),
        note=" ".join(notes),
    )


def at_rest(cell: Cell, placement: Placement) -> FloatArray:
    """Return (4, 4) T_base_work as the part stands while the table of a cell rests."""
    if placement.table is None or cell.table is None:
        return placement.T_base_work
    T_base_table = cell.table.T_base_table
    T_table_work = transforms.inverse(T_base_table) @ placement.T_base_work
    return T_base_table @ transforms.inverse(placement.table.T_table_plate) @ T_table_work


def motion_shades(plan: Plan, vertices: FloatArray) -> MotionShades:
    """Return lean and speed at the piece of deposit that lies nearest to each of (n, 3) vertices [mm]."""
    middles, leans, speeds = (np.concatenate(each) for each in zip(*map(_deposited, plan.robot), strict=True))
    _, nearest = KDTree(middles).query(vertices)
    pieces = np.asarray(nearest)
    return MotionShades(np.degrees(leans[pieces]), speeds[pieces] / plan.workpiece.cell.process.speed)


def _deposited(robot: RobotPlan) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the (k, 3) middles of the pieces of deposit of a robot's part, their leans [rad] and speeds [mm/s]."""
    poses, times = robot.joint_path.poses, robot.trajectory.pose_times
    lengths, durations = bead_steps(poses), np.diff(times)
    rows = np.flatnonzero(poses.deposited & (lengths > 0.0) & (durations > 0.0))
    places = poses.surface_points
    return (places[rows] + places[rows + 1]) / 2.0, tilts(poses)[rows], lengths[rows] / durations[rows]


@final
@frozen
class ArmMotion:
    """The motion of the arm in one attitude of the part.

    Attributes:
        times: (k,) of the rows of its trajectory, from 0 [s].
        joints: (k, j) then [rad].
        placement: where the part stands meanwhile.
    """

    times: FloatArray
    joints: FloatArray
    placement: Placement

    def __post_init__(self) -> None:
        freeze_arrays(self, times="float: k", joints="float: k j")


@final
class PrintMotion:
    """The motion of a print on one time line: of the arm, attitude after attitude, and of part and table before each.

    All motions are from how things stand with the table at rest and all joints at zero, in the frame of the part there.

    Args:
        cell: that prints.
        arms: of each attitude; one without a table.
        seconds: what the table takes at least to come to each [s]; none without a table.

    Attributes:
        begins: (a,) when the arm begins to move in each attitude [s].
        end: of the print [s].
        table: how part and table move; None without one.
        T_base_work: (4, 4) where the part stands while the table rests.
    """

    def __init__(self, cell: Cell, arms: Sequence[ArmMotion], *, seconds: Sequence[float] = ()) -> None:
        durations = [float(each.times[-1]) for each in arms]
        turns = np.array([max(each, SHORTEST_MOVE) for each in seconds]) if seconds else np.zeros(1)
        self.begins: FloatArray = np.cumsum(turns) + np.cumsum([0.0, *durations[:-1]])
        self.end = float(self.begins[-1]) + durations[-1]
        placements = [each.placement for each in arms]
        self.T_base_work: FloatArray = at_rest(cell, placements[0])
        turning = np.column_stack([self.begins - turns, self.begins])
        self.table: TableReplay | None = table_replay(cell, placements, turning=turning) if seconds else None
        self._arms, self._turning = arms, turning
        self._arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
        self._at_zero = transforms.inverse(self._arm.link_poses(np.zeros((1, JOINTS)))[0])

    def attitude(self, time: float) -> int:
        """Return the attitude that the part has at a moment [s], or that the table brings it to, from 0."""
        return max(int(np.searchsorted(self._turning[:, 0], time, side="right")) - 1, 0)

    def links(self, time: float) -> FloatArray:
        """Return the (j + 2, 4, 4) motions of base, links and tool at a moment [s]."""
        number = self.attitude(time)
        motion = self._arms[number]
        local = time - float(self.begins[number])
        joints: FloatArray = np.empty((1, motion.joints.shape[1]))
        for axis, angles in enumerate(motion.joints.T):
            joints[0, axis] = np.interp(local, motion.times, angles)
        moved = self._arm.link_poses(joints)[0] @ self._at_zero
        return transforms.inverse(self.T_base_work) @ moved @ self.T_base_work

    def table_poses(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Return the (3, 4) motion of the part and the (s, 3, 4) ones of the solids of the table at a moment [s]."""
        if self.table is None:
            return np.eye(4)[:3], np.empty((0, 3, 4))
        times = self.table.times
        row = min(max(int(np.searchsorted(times, time)) - 1, 0), times.size - 2)
        share = float(np.clip((time - times[row]) / (times[row + 1] - times[row]), 0.0, 1.0))
        part, solids = self.table.part, self.table.solids
        return (
            (1.0 - share) * part[row] + share * part[row + 1],
            (1.0 - share) * solids[row] + share * solids[row + 1],
        )


def print_motion(plan: Plan) -> PrintMotion:
    """Return the motion of a plan with a robot."""
    arms = [ArmMotion(one.trajectory.times, one.trajectory.joints, one.placement) for one in plan.robot]
    return PrintMotion(plan.workpiece.cell, arms, seconds=plan.tilting.seconds if plan.tilting else ())


def replay(plan: Plan) -> Replay:
    """Return the motion at so many rows of the trajectories as the page shows, one attitude after the other."""
    motion, cell = print_motion(plan), plan.workpiece.cell
    durations = np.array([float(robot.trajectory.times[-1]) for robot in plan.robot])
    # Each has its first moment and its last, and shares in the other frames as long as it takes.
    frames = 2 + (durations / durations.sum() * (MOST_FRAMES - 2 * len(durations))).astype(np.int64)
    parts = [
        _part_replay(cell, robot, begin=begin, frames=count)
        for robot, begin, count in zip(plan.robot, motion.begins.tolist(), frames.tolist(), strict=True)
    ]
    ends = np.cumsum([len(each.bead) for each in parts])
    offsets = [each.bead_offsets[:-1] + end - len(each.bead) for each, end in zip(parts, ends.tolist(), strict=True)]
    return Replay(
        times=np.concatenate([each.times for each in parts]),
        joints=np.concatenate([each.joints for each in parts]),
        speeds=np.concatenate([each.speeds for each in parts]),
        valve=np.concatenate([each.valve for each in parts]),
        lamp=np.concatenate([each.lamp for each in parts]),
        bead=np.concatenate([each.bead for each in parts]),
        bead_offsets=np.append(np.concatenate(offsets), ends[-1]),
        bead_times=np.concatenate([each.bead_times for each in parts]),
        table=motion.table,
    )


def table_replay(cell: Cell, placements: Sequence[Placement], *, turning: FloatArray) -> TableReplay:
    """Return how part and table stand at rest and on the course to each attitude of a print.

    The table goes straight, all of its axes in proportion and evenly in time: that is the course which is proven to
    keep clear of the arm, in the time that the plan counts.

    Args:
        cell: with a table.
        placements: a of the part, one an attitude.
        turning: (a, 2) when the table moves to each attitude [s].
    """
    noun = cell.table
    assert noun is not None  # noqa: S101  # The print is over a table.
    table, T_base_rest = table_machine(noun), at_rest(cell, placements[0])
    T_rest_base, resting = transforms.inverse(T_base_rest), table.solids(np.eye(4))
    knots = [np.eye(4), *(one.table.T_table_plate for one in placements if one.table)]
    times: list[FloatArray] = []
    poses: list[FloatArray] = []
    for ends, (begin, end) in zip(pairwise(knots), turning.tolist(), strict=True):
        shares = _shares(table, np.stack(ends))
        times.append(np.append(begin + shares[:-1] * (end - begin), end))
        poses.append(straight_course(table, np.stack(ends), shares))
    motions = [
        [
            (T_rest_base @ _stretch(rests, stands) @ T_base_rest)[:3]
            for rests, stands in zip(resting, table.solids(pose), strict=True)
        ]
        for pose in np.concatenate(poses)
    ]
    works = work_poses(table, Ts_table_plate=np.concatenate(poses), T_base_work=T_base_rest)
    return TableReplay(turning, np.concatenate(times), (T_rest_base @ works)[:, :3], np.array(motions))


def _shares(table: TiltingTable, ends: FloatArray) -> FloatArray:
    """Return at which shares of a table's course from one of (2, 4, 4) poses to the other its frames are."""
    turned = float(np.arccos(np.clip((np.trace(ends[0, :3, :3].T @ ends[1, :3, :3]) - 1.0) / 2.0, -1.0, 1.0)))
    axes = np.abs(np.diff(table.axes(ends), axis=0)) if table.rotary else np.zeros(1)
    return np.linspace(0.0, 1.0, max(int(np.ceil(max(turned, float(axes.sum())) / TABLE_STEP)), 1) + 1)


def _part_replay(cell: Cell, robot: RobotPlan, *, begin: float, frames: int) -> Replay:
    """Return so many frames of one attitude's motion, which begins at a moment of the whole [s]."""
    trajectory, poses = robot.trajectory, robot.joint_path.poses
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    last = trajectory.times.size - 1
    rows = np.unique(np.linspace(0, last, frames).astype(np.int64))
    deposited = np.flatnonzero(poses.deposit)
    starts = np.flatnonzero(np.diff(poses.runs[deposited], prepend=-1))
    return Replay(
        times=begin + trajectory.times[rows],
        joints=trajectory.joints[rows],
        speeds=tip_speeds(arm, trajectory.times, trajectory.joints, rows=rows),
        valve=begin + robot.switching.material,
        lamp=begin + np.minimum(robot.switching.lamp, trajectory.duration),
        bead=poses.tips[deposited],
        bead_offsets=np.append(starts, deposited.size),
        bead_times=begin + trajectory.pose_times[deposited],
    )


def tip_speeds(arm: Arm, times: FloatArray, joints: FloatArray, *, rows: IntArray) -> FloatArray:
    """Return the (r,) speeds of the tip at r rows of a trajectory, between the rows before and behind [mm/s].

    Args:
        arm: with its tool.
        times: (k,) of the trajectory [s].
        joints: (k, 6) then [rad].
        rows: of it.
    """
    ends = np.clip([rows - 1, rows + 1], 0, times.size - 1)
    tips = arm.link_poses(joints[ends.ravel()])[:, -1, :3, 3].reshape(2, -1, 3)
    return np.linalg.norm(tips[1] - tips[0], axis=1) / np.diff(times[ends], axis=0)[0]


def _stretch(rests: Cylinder, stands: Cylinder) -> FloatArray:
    """Return the (4, 4) affine map of a cylinder onto another as thick: turned as little as can be, and stretched."""
    before, after = rests.end - rests.start, stands.end - stands.start
    lengths = np.linalg.norm(before), np.linalg.norm(after)
    axis = before / lengths[0]
    turn = transforms.smallest_rotation(axis, (after / lengths[1])[None])[0]
    linear = turn @ (np.eye(3) + (lengths[1] / lengths[0] - 1.0) * np.outer(axis, axis))
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = linear, stands.start - linear @ rests.start
    return found


def _links(robot: Robot, cell_file: Path | None) -> tuple[list[tuple[int, Surface]], list[str]]:
    """Return the meshes of the links, or their solids, each with the joint that moves it; and what lacks its mesh."""
    meshes: dict[int, list[Surface]] = {}
    notes: list[str] = []
    if robot.urdf is not None and cell_file is not None:
        from geoprint.robot.arm.link_meshes import link_meshes

        meshes, notes = link_meshes(robot, cell=cell_file)
    links = link_solids(robot.model, urdf=robot.urdf, flange=robot.flange)
    return [
        (link.joint, one)
        for link in links
        for one in meshes.get(link.joint, [Surface(*polytope(solid, by=0.0)) for solid in link.solids])
    ], notes


def _outside(obstacle: Obstacle, T_work_base: FloatArray) -> Surface:
    corners = obstacle_target(obstacle, T_work_base=T_work_base).triangles.reshape(-1, 3)
    return Surface(corners, np.arange(len(corners)).reshape(-1, 3))


def _moved(surface: Surface, T_a_b: FloatArray) -> Surface:
    return Surface(transforms.apply(T_a_b, surface.vertices), surface.faces)


def _sunk(body: Surface) -> Surface:
    """Return the body a little smaller, so that it does not come through the part that lies on it."""
    depth = BODY_SUNK * float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
    return Surface(body.vertices - depth * shading_normals(body), body.faces)
