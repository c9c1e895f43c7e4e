"""A planned part whose path is checked again with planted bodies, or over a planted table."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from benchmarks.motion.planted import Spot, Sweep, facing, near_miss, table_cylinders
from geoprint import transforms
from geoprint.errors import ClearanceError
from geoprint.geometry import united
from geoprint.layers import layer_level, with_sides
from geoprint.model import Cell, Cylinder, FloatArray, Hexapod, Lamp, PoseStream, Surface, TiltTurn
from geoprint.positioner import obstacles_at
from geoprint.results import Plan, RobotPlan
from geoprint.robot.arm import Arm
from geoprint.robot.collision import clearance
from geoprint.robot.controller import controller_path, written_targets
from geoprint.robot.reach import reach
from geoprint.robot.timing import retime
from geoprint.workflow.table_motion import move_clearance

SOLIDS = ("needle", "cone", "barrel", "bracket", "UV lamp", *(f"arm's link {joint}" for joint in range(2, 7)))
# How deep collisions go beyond the kept distance and into the solid itself [mm].
GRAZE = 0.05
DEPTHS = (0.05, 0.5, 4.0)
# How far near misses are beyond the kept distance [mm]: a tenth for the steps of the check, and a tenth for what the
# controller may round in a tight bend, where it need not do so.
BEYOND = 0.2
STANDOFF_ERROR = 0.05
# The lamp's housing, which the packaged cells do not describe: beside the flange, on the first of these sides on which
# the path is clear.
SIDES = ((0.0, 45.0), (0.0, -45.0), (45.0, 0.0), (-45.0, 0.0))
LAMPS = tuple(Lamp(transforms.rigid(np.eye(3), np.array([*side, 10.0])), length=60.0, diameter=20.0) for side in SIDES)


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
    for lamp in LAMPS[:-1]:
        with suppress(ClearanceError):
            return _with_lamp(planned, robot, lamp)
    return _with_lamp(planned, robot, LAMPS[-1])


def _with_lamp(planned: Plan, robot: RobotPlan, lamp: Lamp) -> Scene:
    cell = planned.workpiece.cell
    cell = replace(cell, tool=replace(cell.tool, lamp=lamp))
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    T_work_base = transforms.inverse(robot.placement.T_base_work)
    sweep = Sweep(robot.controller_path, arm, tool=cell.tool, T_work_base=T_work_base)
    scene = Scene(planned, robot, arm, cell, sweep)
    scene.check(planned.workpiece.body, planned.workpiece.ground, below=planned.workpiece.below)
    return scene


def _lowered(poses: PoseStream, *, by: float) -> PoseStream:
    return replace(poses, tips=poses.tips - by * np.where(poses.deposit, 1.0, 0.0)[:, None] * poses.normals)


# A table that is nearer than wanted by more than this [mm] is moved on before anybody asks by how much.
STRIDE = 5.0


def tables_in_the_way(
    scene: Scene, *, count: int, random: np.random.Generator
) -> Iterator[tuple[str, Hexapod | TiltTurn]]:
    """Yield which solid of a table is how near to what moves, and the table."""
    for case in range(count):
        spot, solid = _met(scene, case, random)
        distance = (scene.cell.process.clearance - GRAZE, *(-depth for depth in DEPTHS))[case % (len(DEPTHS) + 1)]
        distance = max(distance, -0.5) if spot.name == "needle" else distance
        point = facing(solid, _in_base(scene, spot.outward), random)
        yield f"{solid.name} {distance:g} mm from the {spot.name}", _shifted(scene, spot, point, distance)


def tables_beside(scene: Scene, *, count: int, random: np.random.Generator) -> Iterator[tuple[str, Hexapod | TiltTurn]]:
    """Yield which solid of a table was moved away from what, and the table, whose nearest is a known distance away."""
    wanted = scene.cell.process.clearance + BEYOND
    case = 0
    while case < count:
        spot, solid = _met(scene, case, random)
        point = facing(solid, _in_base(scene, spot.outward), random)
        table = near_miss(
            lambda at, spot=spot, point=point: _shifted(scene, spot, point, at),
            lambda table: scene.sweep.distance_from(scene.solids(table), enough=wanted - STRIDE),
            distance=wanted,
        )
        if table is not None:
            case += 1
            yield f"{solid.name} beside the {spot.name}", table


def tables_at_home(
    scene: Scene, *, count: int, random: np.random.Generator
) -> Iterator[tuple[str, Hexapod | TiltTurn]]:
    """Yield which solid of a table in the attitude comes how near to which solid of the arm at home, and the table."""
    for case in range(count):
        _, solid = _met(scene, case, random)
        spot = scene.sweep.spot(SOLIDS[case % len(SOLIDS)], random, at_home=True)
        distance = scene.cell.process.clearance - GRAZE
        point = facing(solid, _in_base(scene, spot.outward), random)
        yield f"{solid.name} {distance:g} mm from the {spot.name} at home", _shifted(scene, spot, point, distance)


def is_refused_over(scene: Scene, table: Hexapod | TiltTurn) -> bool:
    """Say whether the check refuses the path for the sake of a table that holds the part where it is."""
    workpiece, names = scene.planned.workpiece, [one.name for one in scene.solids(table)]
    return scene.over(table).is_refused_for(names, workpiece.body, workpiece.ground)


def is_refused_in_motion(scene: Scene) -> bool:
    """Say whether the table is refused that goes from rest to the scene's attitude past the arm at home."""
    try:
        move_clearance(
            scene.cell, before=None, stands=scene.robot.placement, surfaces=(scene.planned.workpiece.base,),
            place=None, to="the attitude",
        )  # fmt: skip
    except ClearanceError:
        return True
    return False


def _met(scene: Scene, case: int, random: np.random.Generator) -> tuple[Spot, Cylinder]:
    """Return where which solid of the table is to be met in a case: each with each, in turn."""
    assert scene.cell.table is not None
    solids = scene.solids(scene.cell.table)
    return scene.sweep.spot(SOLIDS[case % len(SOLIDS)], random), solids[case % len(solids)]


def _in_base(scene: Scene, direction: FloatArray) -> FloatArray:
    return scene.robot.placement.T_base_work[:3, :3] @ direction


def _shifted(scene: Scene, spot: Spot, point: FloatArray, distance: float) -> Hexapod | TiltTurn:
    """Return the table, shifted so that a point of it in the base is so far from a spot; the part stays."""
    table = scene.cell.table
    assert table is not None
    place = transforms.apply(scene.robot.placement.T_base_work, (spot.place + distance * spot.outward)[None])[0]
    T_base_table = table.T_base_table.copy()
    T_base_table[:3, 3] += place - point
    return replace(table, T_base_table=T_base_table)


def with_lump(ground: Surface, lump: Surface) -> Surface:
    """Return what is printed below a layer with a lump of the same material."""
    return united([ground, lump])


def raised_layers(planned: Plan, *, by: float) -> Surface:
    """Return what is printed below a planned layer as it would be if all of it were higher [mm].

    The tip goes over the true one at its stand-off, along the normal: raised by that and a depth more, it goes through.
    """
    place, ground = planned.workpiece.place, planned.workpiece.ground
    assert place is not None
    level = layer_level(place.base, place.bottom + by, height=place.height)
    found = with_sides(place.base, level)
    return Surface(found.vertices, found.faces, ground.name)
