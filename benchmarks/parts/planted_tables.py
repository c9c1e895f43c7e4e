"""Tables shifted under a part, so that a solid of them is at a known distance from what moves over it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.parts.planted import Spot, near_miss
from benchmarks.parts.planted_cylinders import facing
from benchmarks.parts.planted_scenes import BEYOND, DEPTHS, GRAZE, SOLIDS, Scene
from geoprint import transforms
from geoprint.errors import ClearanceError
from geoprint.model import Cylinder, FloatArray, Hexapod, TiltTurn
from geoprint.pipeline.tilting import move_clearance

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
