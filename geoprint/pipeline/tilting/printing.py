"""The robot's parts of a plan over a table: one an attitude, each with the whole chain, in the order of printing.

An attitude that the chain refuses is taken again with other directions of the part up, of those that its beads admit:
first the one nearest to rest, where a cell is usually laid out for the arm, then those that lie farthest from all that
were tried. Only when all of them are refused the part is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import final

import numpy as np

from geoprint.errors import ClearanceError, PlanError, ReachError
from geoprint.model import FloatArray, IntArray, Placement, TiltingTable, frozen
from geoprint.motion.machine import table_machine, tilted_placement
from geoprint.motion.tilting import Attitude, UpRange
from geoprint.paths import PosedSurface, check_sum, posed_surface
from geoprint.pipeline.refusals import proven
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.standing import Chain
from geoprint.pipeline.tilting.division import deposited, plate_turn, tilting_of, up_range
from geoprint.pipeline.tilting.joining import attitude_cell, joined_program
from geoprint.pipeline.tilting.pieces import Portions, attitude_paths, portions
from geoprint.pipeline.tilting.sweeping import sweep_clearance
from geoprint.results import Plan, RobotPlan, Tilting

# Directions that are tried for an attitude at most, the one that was chosen first included.
MOST_DIRECTIONS = 5


@final
@frozen
class _Asked:
    """An attitude that is to be printed.

    Attributes:
        number: from 1.
        count: of all attitudes.
        attitude: as it was chosen.
        portion: what is printed in it.
        aims: (k, 3) normals of its beads, those that overhang whatever the table does led as it was chosen for.
        known: of the whole part, for the poses of each direction.
    """

    number: int
    count: int
    attitude: Attitude
    portion: Portions
    aims: FloatArray
    known: PosedSurface


@final
@frozen
class _Printed:
    """An attitude that the chain has passed.

    Attributes:
        attitude: with the direction that was taken.
        T_table_plate: (4, 4) the plate's pose.
        robot: its part of the plan.
        refused: directions before it, in words.
        speed: at which it prints [mm/s].
    """

    attitude: Attitude
    T_table_plate: FloatArray
    robot: RobotPlan
    refused: tuple[str, ...]
    speed: float


def with_attitudes(paths: Plan, placement: Placement, stage: Stages, *, chain: Chain) -> Plan:
    """Plan the robot in every attitude of the table, and prove that the arm at home is clear while the table moves.

    Args:
        paths: with the attitudes of the table.
        placement: where the part stands while the table is at rest.
        stage: names and times the work.
        chain: plans the robot at a placement.

    Raises:
        PlanError: an attitude is refused with every direction that was tried, or the table cannot move past the arm.
    """
    table, tilting = paths.workpiece.cell.table, paths.tilting
    if table is None or tilting is None:
        return chain(paths, placement, stage)
    machine, within = table_machine(table), up_range(paths, table_machine(table))
    overlap = table.overlap if paths.workpiece.cell.signals.mode == "analog" else 0.0
    divided = portions(tilting.attitudes, deposited(paths), overlap=overlap, critical=within.critical)
    known = posed_surface(paths.workpiece.surface, paths.workpiece.body)
    asked = [
        _Asked(number, len(divided), attitude, portion, _aims(paths, portion, tilting, within), known)
        for number, (attitude, portion) in enumerate(zip(tilting.attitudes, divided, strict=True), start=1)
    ]

    def printed_at(of: _Asked, speed: float) -> _Printed:
        cell = attitude_cell(paths.workpiece.cell.at_speed(speed), number=of.number, count=of.count)
        own = replace(paths, workpiece=replace(paths.workpiece, cell=cell))
        return _printed(own, placement, of, stage, table=machine, within=within, chain=chain)

    ceiling = paths.workpiece.cell.process.speed
    printed = [printed_at(of, ceiling) for of in asked]
    # One pressure deposits what is planned in all attitudes at one speed only.
    while len({one.speed for one in printed}) > 1:
        slowest = min(one.speed for one in printed)
        printed = [
            one if one.speed == slowest else printed_at(of, slowest) for of, one in zip(asked, printed, strict=True)
        ]
    printed = [replace(one, robot=replace(one.robot, ceiling=ceiling)) for one in printed]
    cell = paths.workpiece.cell.at_speed(printed[0].speed)
    paths = replace(paths, workpiece=replace(paths.workpiece, cell=cell))
    robots = _swept(paths, placement, machine, printed, stage)
    changed = tuple(one.attitude for one in printed)
    found = tilting_of(paths, machine, changed, order=tilting.order, moves=tilting.moves)
    refused = tuple(text for one in printed for text in one.refused)
    paths = replace(paths, robot=robots, tilting=replace(found, refused=refused))
    check_sum(paths.poses, [robot.joint_path.poses for robot in robots])
    if len(robots) == 1:
        # As without a table: what the one program is commanded.
        paths = replace(paths, poses=robots[0].joint_path.poses)
    with stage("program of all attitudes"):
        paths = replace(paths, joined=joined_program(paths))
    return replace(paths, timings=tuple(stage.timings))


def _printed(
    paths: Plan,
    placement: Placement,
    asked: _Asked,
    stage: Stages,
    *,
    table: TiltingTable,
    within: UpRange,
    chain: Chain,
) -> _Printed:
    """Take an attitude through the chain, at one direction of the part up after the other."""
    refused: list[str] = []
    errors: list[PlanError] = []
    starts: list[tuple[Plan, Placement]] = []
    for up in _directions(asked, within):
        T_table_plate = table.plates((plate_turn(paths, table) @ up)[None])[0]
        stands = tilted_placement(table, placement, T_table_plate=T_table_plate, number=asked.number)
        own = attitude_paths(paths, asked.portion, stands, known=asked.known)
        stage.observe(f"attitude {asked.number} of {asked.count}")
        try:
            planned = chain(own, stands, stage)
        except (ReachError, ClearanceError) as error:
            refused.append(f"{_said(asked, table, stands)}: {error}")
            errors.append(error)
            starts.append((own, stands))
            continue
        attitude = asked.attitude if not refused else replace(asked.attitude, up=up, slack=within.slack(up, asked.aims))
        speed = planned.workpiece.cell.process.speed
        return _Printed(attitude, T_table_plate, planned.robot[0], tuple(refused), speed)
    raise _refusal(asked, table, errors, starts, stage)


def _aims(paths: Plan, portion: Portions, tilting: Tilting, within: UpRange) -> FloatArray:
    """Return the (k, 3) normals of an attitude's beads; the last pose of a piece may be that of the next."""
    firsts = np.concatenate([each.pieces[:, 0] for each in tilting.attitudes])
    pieces = portion.pieces
    ends = pieces[:, 1] - np.isin(pieces[:, 1] - 1, firsts)
    ranges: list[IntArray] = [np.arange(first, end) for first, end in zip(pieces[:, 0], ends, strict=True)]
    rows = np.concatenate(ranges)
    normals = deposited(paths).normals[rows]
    return within.aims(normals, within.nearest(normals))


def _directions(asked: _Asked, within: UpRange) -> Iterator[FloatArray]:
    """Yield the (3,) direction of an attitude, then others that its beads admit: near rest, then far from those."""
    tried = [asked.attitude.up]
    yield tried[0]
    others = within.admitting(asked.aims)
    wanted = within.rest
    for _ in range(min(MOST_DIRECTIONS - 1, len(others))):
        near = others @ np.stack(tried).T
        row = int((others @ wanted).argmax()) if len(tried) == 1 else int(near.max(axis=1).argmin())
        tried.append(others[row])
        yield others[row]


def _swept(
    paths: Plan, placement: Placement, table: TiltingTable, printed: list[_Printed], stage: Stages
) -> tuple[RobotPlan, ...]:
    """Return the robot's parts with what is kept while the table comes to each attitude, the arm at home."""
    workpiece = paths.workpiece
    robots: list[RobotPlan] = []
    before = np.eye(4)
    with stage("table's motion"):
        for number, one in enumerate(printed, start=1):
            kept = sweep_clearance(
                workpiece.cell,
                table,
                Ts_table_plate=np.stack([before, one.T_table_plate]),
                T_base_work=placement.T_base_work,
                surfaces=(workpiece.base,) if workpiece.body is None else (workpiece.base, workpiece.body),
                place=workpiece.place,
                to=f"attitude {number} of {len(printed)}",
            )
            robots.append(replace(one.robot, table_kept=kept))
            before = one.T_table_plate
    return tuple(robots)


def _refusal(
    asked: _Asked,
    table: TiltingTable,
    errors: list[PlanError],
    starts: list[tuple[Plan, Placement]],
    stage: Stages,
) -> PlanError:
    """Return the refusal of the direction that was chosen first, proven, with how many others are refused, too."""
    own, stands = starts[0]
    error = proven(errors[0], own, stands, stage)
    others = f" So it is with {len(errors) - 1} other directions up that its beads admit." if len(errors) > 1 else ""
    pieces = f"{len(asked.portion.pieces)} pieces of runs"
    return type(error)(
        f"{_said(asked, table, stands)}, {pieces}, counted from its own first: {error}{others}",
        **error.details,
        attitude=asked.number,
        attitudes=asked.count,
        directions=len(errors),
    )


def _said(asked: _Asked, table: TiltingTable, stands: Placement) -> str:
    """Name an attitude as a person finds it: its number, and what the table's axes show."""
    assert stands.table is not None  # noqa: S101  # It stands in an attitude.
    axes = np.degrees(stands.table.axes) if table.rotary else stands.table.axes
    unit = "degrees" if table.rotary else "mm"
    shown = ", ".join(f"{value:.1f}" for value in axes)
    return f"attitude {asked.number} of {asked.count} ({table.name} at {shown} {unit})"
