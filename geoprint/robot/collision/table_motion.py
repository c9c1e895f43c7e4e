"""Whether a table that moves the part keeps clear of the arm, which waits at home meanwhile.

The table is taken to go straight from one attitude to the next, at any pace: a table of rotary axes with all of them
together, or with one after the other in either order; legs so that the plate shifts and turns evenly. What it does
otherwise nobody can know. Everything that moves is held by balls, each solid of the arm by the sausage about its axis,
and between two poses of the table no ball comes nearer than half of what it moves: so a distance that is found is kept.
What as a whole is farther away than the smallest so far is not looked at more closely.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import TypeAlias, final

import numpy as np

from geoprint import transforms
from geoprint.errors import ClearanceError
from geoprint.geometry import in_words, triple
from geoprint.model import Cylinder, FloatArray, Surface, TiltingTable, Tool, frozen
from geoprint.positioner import straight_course, turned_course
from geoprint.robot.arm import Arm
from geoprint.robot.collision.tool_solids import ARC_ALLOWANCE, circumscribed, link_solids, tool_solids

# Balls about what moves have their centres this far apart, or less [mm].
BALL_STEP = 10.0
# Radius of balls about a cylinder: no point of it is farther from a centre along each of the three axes than half of a
# step [mm].
AROUND = BALL_STEP * np.sqrt(3.0) / 2.0
# From one pose of the table to the next nothing moves farther than this [mm].
MOTION_STEP = 8.0
# Poses between two attitudes at first: what moves along them tells how many are needed.
FEWEST_POSES = 9
# (n,) shares of a motion -> (n, 4, 4) poses of the plate.
Course: TypeAlias = Callable[[FloatArray], FloatArray]
# (b, 3) centres and (b,) radii of balls [mm].
Balls: TypeAlias = tuple[FloatArray, FloatArray]


@final
@frozen
class _Moving:
    """Something that moves with the table, where it stands.

    Attributes:
        name: what messages call it.
        balls: returns those that hold it.
        middle: (3,) of one ball that holds them all [mm].
        reach: of that ball [mm].
        marks: (k, 3) points of it, the farthest of which moves as far as any: of a cylinder the ends of its axis [mm].
        radius: how far it reaches beyond these, across its axis [mm].
    """

    name: str
    balls: Callable[[], Balls]
    middle: FloatArray
    reach: float
    marks: FloatArray
    radius: float


@final
@frozen
class _Carried:
    """Balls about a surface, in the plate's frame.

    Attributes:
        name: what messages call it.
        centres: (b, 3) [mm].
        radii: (b,) [mm].
        middle: (3,) of one ball that holds them all [mm].
        reach: of that ball [mm].
    """

    name: str
    centres: FloatArray
    radii: FloatArray
    middle: FloatArray
    reach: float


def table_motion_clearance(
    arm: Arm,
    *,
    tool: Tool,
    table: TiltingTable,
    Ts_table_plate: FloatArray,
    T_base_work: FloatArray,
    surfaces: Sequence[Surface],
    kept: float,
    to: str,
) -> float:
    """Prove that a table keeps clear of the arm at home while it goes from one pose of its plate to another.

    Args:
        arm: kinematics with this tool.
        tool: its solids.
        table: that moves.
        Ts_table_plate: (2, 4, 4) from where to where.
        T_base_work: (4, 4) where the part stands while the table is at rest [mm].
        surfaces: what moves with the plate: the part, and what it lies on.
        kept: distance to keep [mm].
        to: where it goes, as messages call it.

    Returns:
        A distance that is kept [mm]; the true one is a little larger.

    Raises:
        ClearanceError: a smaller distance is all that can be proven.
        ReachError: the table has no such poses.
    """
    sausages = _at_home(arm, tool)
    apart = _distances(sausages)
    T_plate_work = transforms.inverse(table.T_base_table) @ T_base_work
    held = [_held(surface, T_plate_work) for surface in surfaces]
    found = np.inf
    for course in _courses(table, Ts_table_plate):
        for one, moved in _along(table, course, held):
            near = np.flatnonzero(apart(one.middle) - one.reach - moved / 2.0 < found).tolist()
            centres, radii = one.balls() if near else (np.empty((0, 3)), np.empty(0))
            for sausage in (sausages[row] for row in near):
                distances = _to_lines(centres, sausage) - radii - sausage.radius - moved / 2.0
                row = int(distances.argmin())
                found = min(found, float(distances[row]))
                if found < kept:
                    raise _too_close(
                        f"{table.name} goes to {to}", one, sausage, place=centres[row], distance=found, kept=kept
                    )
    return found


def _at_home(arm: Arm, tool: Tool) -> list[Cylinder]:
    """Return lines that hold the solids of the arm as it stands at home, each all within a radius of its line."""
    frames = arm.link_poses(arm.robot.home[None])[0]
    links = link_solids(arm.robot.model, urdf=arm.robot.urdf, flange=arm.robot.flange)
    solids = [(frames[link.joint], solid) for link in links for solid in link.solids]
    solids += [(frames[-1], solid) for solid in tool_solids(tool)]
    sausages: list[Cylinder] = []
    for T_base_solid, solid in solids:
        start, end = transforms.apply(T_base_solid, np.stack([solid.start, solid.end]))
        sausages.append(Cylinder(solid.name, start, end, max(solid.start_radius, solid.end_radius)))
    return sausages


def _courses(table: TiltingTable, ends: FloatArray) -> list[Course]:
    """Return each straight motion that a table may make from one pose of its plate to another."""
    courses = [partial(straight_course, table, ends)]
    if not table.rotary:
        return courses
    start, end = table.axes(ends)
    for axis in range(len(start)):
        bent = start.copy()
        bent[axis] = end[axis]
        courses.append(partial(turned_course, table, np.stack([start, bent, end])))
    return courses


def _along(table: TiltingTable, course: Course, held: Sequence[_Carried]) -> Iterator[tuple[_Moving, float]]:
    """Yield what moves at poses of the table along a course, each with how far it moves to the next at most [mm]."""
    coarse = [_standing(table, pose, held) for pose in course(np.linspace(0.0, 1.0, FEWEST_POSES))]
    moved = max(
        _moved(one, other) for before, behind in pairwise(coarse) for one, other in zip(before, behind, strict=True)
    )
    count = max(int(np.ceil((FEWEST_POSES - 1) * moved / MOTION_STEP)), 1) + 1
    fine = [_standing(table, pose, held) for pose in course(np.linspace(0.0, 1.0, count))]
    steps = [
        [_moved(one, other) for one, other in zip(before, behind, strict=True)] for before, behind in pairwise(fine)
    ]
    around = np.array([steps[0], *steps, steps[-1]])
    for row, moving in enumerate(fine):
        yield from zip(moving, np.maximum(around[row], around[row + 1]).tolist(), strict=True)


def _standing(table: TiltingTable, T_table_plate: FloatArray, held: Sequence[_Carried]) -> list[_Moving]:
    """Return all that moves, in the base frame: surfaces on the plate, and the table's own solids."""
    T_base_plate = table.T_base_table @ T_table_plate
    surfaces = [_carried(one, T_base_plate) for one in held]
    return [*surfaces, *(_moving(one) for one in table.solids(T_table_plate))]


def _carried(held: _Carried, T_base_plate: FloatArray) -> _Moving:
    there = transforms.apply(T_base_plate, np.vstack([held.middle, held.centres]))
    return _Moving(held.name, lambda: (there[1:], held.radii), there[0], held.reach, there[1:], 0.0)


def _moving(cylinder: Cylinder) -> _Moving:
    ends = np.stack([cylinder.start, cylinder.end])
    reach = float(np.hypot(np.linalg.norm(ends[1] - ends[0]) / 2.0, cylinder.radius)) + AROUND
    return _Moving(cylinder.name, partial(_around, cylinder), ends.mean(axis=0), reach, ends, cylinder.radius)


def _moved(one: _Moving, other: _Moving) -> float:
    """Bound how far any point moves: as its marks do, and across a cylinder's axis as this turns [mm]."""
    turned = np.linalg.norm(_axis(one.marks) - _axis(other.marks)) if one.radius else 0.0
    shifted = np.linalg.norm(one.marks - other.marks, axis=1).max()
    return ARC_ALLOWANCE * float(shifted + one.radius * turned)


def _axis(ends: FloatArray) -> FloatArray:
    along = ends[1] - ends[0]
    return along / np.linalg.norm(along)


def _held(surface: Surface, T_plate_work: FloatArray) -> _Carried:
    """Return balls about a surface, in the plate's frame: those about its triangles, gathered in a grid."""
    centres, radii = circumscribed(transforms.apply(T_plate_work, surface.vertices)[surface.faces])
    cells, own = np.unique(np.floor(centres / BALL_STEP).astype(np.int64), axis=0, return_inverse=True)
    middles, own = (cells + 0.5) * BALL_STEP, own.reshape(-1)
    largest = np.zeros(len(cells))
    np.maximum.at(largest, own, np.linalg.norm(centres - middles[own], axis=1) + radii)
    middles = np.asarray(middles, dtype=np.float64)
    middle = middles.mean(axis=0)
    reach = float((np.linalg.norm(middles - middle, axis=1) + largest).max())
    return _Carried(surface.name, middles, largest, middle, reach)


def _around(cylinder: Cylinder) -> Balls:
    """Return balls about a solid of the table: on circles about its axis, one within the other."""
    axis = cylinder.end - cylinder.start
    length = float(np.linalg.norm(axis))
    rings = np.linspace(0.0, 1.0, int(np.ceil(length / BALL_STEP)) + 1)
    radii = np.linspace(0.0, cylinder.radius, int(np.ceil(cylinder.radius / BALL_STEP)) + 1)
    angles = np.linspace(0.0, 2.0 * np.pi, int(np.ceil(2.0 * np.pi * cylinder.radius / BALL_STEP)) + 1)[:-1]
    x, y = _across(axis / length)
    circle = np.cos(angles)[:, None] * x + np.sin(angles)[:, None] * y
    disc = (radii[:, None, None] * circle).reshape(-1, 3)
    centres = (cylinder.start + rings[:, None, None] * axis + disc).reshape(-1, 3)
    return centres, np.full(len(centres), AROUND)


def _across(axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two unit vectors across an axis, and across one another."""
    rotation = transforms.smallest_rotation(np.array([0.0, 0.0, 1.0]), axis[None])[0]
    return rotation[:, 0], rotation[:, 1]


def _to_lines(points: FloatArray, sausage: Cylinder) -> FloatArray:
    """Return the (b,) distances of points from the line in a sausage [mm]."""
    along = sausage.end - sausage.start
    # A solid without length is its start.
    shares = np.clip((points - sausage.start) @ along / (along @ along or 1.0), 0.0, 1.0)
    return np.linalg.norm(points - sausage.start - shares[:, None] * along, axis=1)


def _distances(sausages: Sequence[Cylinder]) -> Callable[[FloatArray], FloatArray]:
    """Return what tells the (s,) distances of a (3,) point from each of them [mm]."""
    starts, radii = np.stack([one.start for one in sausages]), np.array([one.radius for one in sausages])
    along = np.stack([one.end for one in sausages]) - starts
    # A solid without length is its start.
    squares = np.maximum(np.sum(along**2, axis=1), np.finfo(np.float64).tiny)

    def distances(point: FloatArray) -> FloatArray:
        shares = np.clip(np.sum((point - starts) * along, axis=1) / squares, 0.0, 1.0)
        return np.linalg.norm(point - starts - shares[:, None] * along, axis=1) - radii

    return distances


def _too_close(
    said: str, moving: _Moving, sausage: Cylinder, *, place: FloatArray, distance: float, kept: float
) -> ClearanceError:
    return ClearanceError(
        f"while the {said}, {moving.name} may come within {max(distance, 0.0):.1f} mm of the {sausage.name} at home, "
        f"at {in_words(place)} in the base frame; {kept:.2f} mm are required. Choose a home with the arm higher or "
        "farther back, or move the table away.",
        solid=sausage.name,
        against=moving.name,
        distance=distance,
        wanted=kept,
        place=triple(place),
    )
