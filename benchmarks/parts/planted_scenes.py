"""A planned part whose path is checked again with planted bodies, or over a planted table."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from benchmarks.parts.planted import Sweep
from benchmarks.parts.planted_cylinders import table_cylinders
from geoprint import transforms
from geoprint.errors import ClearanceError
from geoprint.model import Cell, Cylinder, Hexapod, Lamp, PoseStream, Surface, TiltTurn
from geoprint.motion.arm import Arm
from geoprint.motion.collision import clearance
from geoprint.motion.controller import controller_path, written_targets
from geoprint.motion.machine import obstacles_at
from geoprint.motion.reach import reach
from geoprint.motion.timing import retime
from geoprint.results import Plan, RobotPlan

SOLIDS = ("needle", "cone", "barrel", "bracket", "UV lamp", *(f"arm's link {joint}" for joint in range(2, 7)))
# How deep collisions go beyond the kept distance and into the solid itself [mm].
GRAZE = 0.05
DEPTHS = (0.05, 0.5, 4.0)
# How far near misses are beyond the kept distance [mm]: a tenth for the steps of the check, and a tenth for what the
# controller may round in a tight bend, where it need not do so.
BEYOND = 0.2
STANDOFF_ERROR = 0.05
# The lamp's housing, which the packaged cells do not describe: beside the flange.
LAMP = Lamp(transforms.rigid(np.eye(3), np.array([0.0, 45.0, 10.0])), length=60.0, diameter=20.0)


@final
@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A planned part whose path is checked against planted bodies, in one attitude where a table tilts it."""

    planned: Plan
    robot: RobotPlan
    arm: Arm
    cell: Cell
    sweep: Sweep

    def is_refused(self, body: Surface) -> bool:
        """Say whether the check refuses the path for the body's sake."""
        return self.is_refused_for([f"body {body.name}"], body, self.planned.workpiece.ground)

    def is_refused_by(self, ground: Surface) -> bool:
        """Say whether the check refuses the path of a layer for the sake of what is printed below it."""
        return self.is_refused_for([f"part {ground.name}"], self.planned.workpiece.body, ground)

    def over(self, table: Hexapod | TiltTurn) -> Scene:
        """Return the scene with another table that holds the part where it is."""
        return replace(self, cell=replace(self.cell, table=table))

    def solids(self, table: Hexapod | TiltTurn) -> list[Cylinder]:
        """Return the solids of a table in the scene's attitude, in the base."""
        assert self.robot.placement.table is not None
        return table_cylinders(table, self.robot.placement.table.T_table_plate)

    def check_without_layers(self) -> None:
        """Check the path of a layer over the bare part, where nothing is printed; raise what the check raises."""
        place = self.planned.workpiece.place
        assert place is not None
        self.check(None, place.base, below=place.middle)

    def check(self, body: Surface | None, ground: Surface, *, below: float) -> None:
        """Check the path, whose tip counts its stand-off from so far over the ground; raise what the check raises."""
        robot, cell = self.robot, self.cell
        clearance(
            robot.controller_path, self.arm, tool=cell.tool, process=cell.process,
            T_base_work=robot.placement.T_base_work, poses=robot.joint_path.poses, part=ground,
            body=body, obstacles=obstacles_at(cell, robot.placement), below=below,
        )  # fmt: skip

    def is_refused_for(self, names: Collection[str], body: Surface | None, ground: Surface) -> bool:
        """Say whether the check refuses the path for the sake of one of these, as its error names it."""
        try:
            self.check(body, ground, below=self.planned.workpiece.below)
        except ClearanceError as error:
            return error.details["against"] in names
        return False

    def check_lowered(self) -> None:
        """Check the path of a tip that is lower than it should be on all deposit; raise what the check raises."""
        T_base_work = self.robot.placement.T_base_work
        low = reach(_lowered(self.robot.joint_path.poses, by=STANDOFF_ERROR), self.arm, T_base_work=T_base_work)
        process = self.cell.process
        targets = written_targets(low, retime(low, self.cell.robot, process=process), process=process)
        clearance(
            controller_path(low, targets, self.arm), self.arm, tool=self.cell.tool, process=process,
            T_base_work=T_base_work, poses=low.poses, part=self.planned.workpiece.part, body=None,
            obstacles=self.cell.obstacles,
        )  # fmt: skip


def scene_at(planned: Plan, robot: RobotPlan) -> Scene:
    """Return a planned part as it stands for a part of its robot, with the lamp on the tool."""
    cell = planned.workpiece.cell
    cell = replace(cell, tool=replace(cell.tool, lamp=LAMP))
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    T_work_base = transforms.inverse(robot.placement.T_base_work)
    sweep = Sweep(robot.controller_path, arm, tool=cell.tool, T_work_base=T_work_base)
    scene = Scene(planned, robot, arm, cell, sweep)
    scene.check(planned.workpiece.body, planned.workpiece.ground, below=planned.workpiece.below)
    return scene


def _lowered(poses: PoseStream, *, by: float) -> PoseStream:
    return replace(poses, tips=poses.tips - by * np.where(poses.deposit, 1.0, 0.0)[:, None] * poses.normals)
