"""The standing part of a RAPID program: header, tool, work object, home, guard, and the list of its modules."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.model import Cell, FloatArray, Placement, TiltTurn, Tool
from geoprint.positioner import driven_seconds
from geoprint.postprocessor.orders import Orders
from geoprint.postprocessor.rapid import writing
from geoprint.postprocessor.rapid.templates import conditions, driving_unit, filled, unit_words
from geoprint.postprocessor.rapid.writing import output_names, output_words
from geoprint.robot.controller import LIFT

# A work object is refused by which any point of the part may lie off by more than this share of the stand-off; one half
# of it may be a shift of the part's middle, the other a turn about it.
_FRAME_SHARE = 0.2
# The controller's numbers have single precision: less than this [mm] would refuse the planned frame itself.
_SMALLEST_ROOM = 1e-3
# Digits of these limits, which are rounded down.
_LIMIT_DIGITS = 4
# The tip's speed in motions that nobody has checked, with the controller's own slow turning [mm/s, deg/s, mm/s, deg/s].
_SLOW = "[20,10,5000,1000]"
# A person brings a table to so many decimals of a degree or a millimetre.
_TABLE_DECIMALS = 4
# A joint move that is planned to take no time, because the arm is there already, is given this [s].
_SHORTEST_MOVE = 0.1


def header_lines(
    *,
    cell: Cell,
    placement: Placement,
    surface_within: float | None,
    part_name: str,
    spacing: float,
    runs: int,
    targets: int,
    checked: Sequence[str],
    not_checked: Sequence[str],
) -> list[str]:
    """Return the comment that tells whoever stands at the robot what the program is; it carries no date.

    Args:
        cell: its name and arm are given.
        placement: how well the fixture is known, and what of it nobody has stated.
        surface_within: what the surface is known within along its normal, in 95 of 100 calibrations [mm], or None.
        part_name: any text.
        spacing: [mm].
        runs: number of runs.
        targets: number of robtargets.
        checked: sentences about what was checked, besides that the text reads back as the plan.
        not_checked: sentences about what was not.
    """
    lines = writing.comment(
        f"Written by geoprint {version('geoprint')}. Do not edit: change the plan and write it again."
    )
    if placement.calibrated:
        miss = float(placement.misses.max(initial=0.0))
        words = f"Fixture calibrated; largest residual of the touched points: {miss:.2f} mm."
        lines += writing.comment(words)
    if placement.missing:
        lines += writing.comment("PLACEMENT UNKNOWN: only runs dry, whatever geoDryRun is.")
        for what in placement.missing:
            lines += writing.comment(f"Not stated: {what}.")
    if surface_within is not None:
        lines += writing.comment(f"Surface known within {surface_within:.2f} mm along its normal (95 %).")
    lines += writing.comment(f"Part: {part_name}")
    lines += writing.comment(f"Cell: {cell.name}; robot: {cell.robot.model}")
    lines += writing.comment(f"Spacing: {writing.number(spacing, decimals=4)} mm; runs: {runs}; targets: {targets}")
    lines += writing.comment("Checked: the text matches the plan: targets, speeds, zones, outputs, frames.")
    for sentence in checked:
        lines += writing.comment(f"Checked: {sentence}")
    for sentence in not_checked:
        lines += writing.comment(f"Not checked: {sentence}")
    lines += writing.comment("Not checked: the real cell. Run it dry and slowly first.")
    lines += writing.comment("It needs GeoResident.sys, which shuts outputs off at stops: controller/first_load.md.")
    return lines


def check_cell(cell: Cell) -> None:
    """Check what a program needs of a cell, before a long plan is made for it.

    Raises:
        UsageError: an output has no RAPID name or is missing, or the load is not physical.
    """
    _tooldata(cell.tool)
    output_names(cell.signals)


def cell_module(
    cell: Cell, orders: Orders, *, placement: Placement, declarations: Sequence[str], header: Sequence[str]
) -> str:
    """Return the text of GeoCell.mod: what a person sets, what was measured, and the data that the runs share.

    Args:
        cell: tool, home and outputs.
        orders: joints and times of the motions from and to home, and the part's extent.
        placement: uframe and oframe of the work object.
        declarations: lines of the shared speeddata and zonedata.
        header: comment lines.

    Raises:
        UsageError: the load is not physical.
    """
    frames = f"{writing.pose(placement.T_base_fixture)},{writing.pose(placement.T_fixture_work)}"
    lift = transforms.inverse(placement.T_base_work)[:3, :3] @ np.array([0.0, 0.0, LIFT])
    travel, axes = writing.significant(cell.process.travel_speed), external_axes(cell, placement)
    lines = [
        "MODULE GeoCell",
        *header,
        "  PERS bool geoDryRun:=TRUE;",
        "  PERS num geoSpeedPct:=25;",
        "  PERS num geoFirstRun:=1;",
        f"  PERS tooldata tGeoNozzle:={_tooldata(cell.tool)};",
        f'  PERS wobjdata wGeoPart:=[FALSE,TRUE,"",{frames}];',
        f"  CONST pose geoFrame:={writing.pose(placement.T_base_work)};",
        *_frame_limits(cell, orders),
        f"  CONST pose geoLift:=[{writing.array(lift, decimals=writing.POSITION_DECIMALS)},[1,0,0,0]];",
        _jointtarget("jGeoHome", cell.robot.home),
        _jointtarget("jGeoStart", orders.start, axes),
        _jointtarget("jGeoAloft", orders.lifted, axes),
        *_prime_data(cell, orders, axes),
        *_flood_data(cell, axes),
        *_table_data(cell, placement),
        f"  CONST num nGeoThere:={_seconds(orders.there)};",
        f"  CONST num nGeoBack:={_seconds(orders.back)};",
        f"  CONST speeddata vGeoHome:=[{travel},500,5000,1000];",
        f"  CONST speeddata vGeoSlow:={_SLOW};",
        *declarations,
        "ENDMODULE",
        "",
    ]
    return "\n".join(lines)


def guard_module(cell: Cell, *, placement: Placement, loading: bool, stacked: bool = False) -> str:
    """Return the text of GeoGuard.mod: the routines of the package's template that this cell and program need.

    Args:
        cell: its outputs, and what it has besides valve and lamp.
        placement: whether all of it was stated.
        loading: whether the program loads its modules while it runs.
        stacked: whether it is a layer of a stack, or one of several attitudes.

    Raises:
        UsageError: an output has no RAPID name or is missing.
    """
    return filled(
        "geo_guard.mod",
        holding=conditions(cell, placement=placement, loading=loading, stacked=stacked),
        words=output_words(output_names(cell.signals)) | unit_words(placement) | _station(cell, placement),
    )


def external_axes(cell: Cell, placement: Placement) -> str:
    """Return the external axes of every target: those of the attitude where a mechanical unit holds it, else none."""
    if driving_unit(cell, placement) is None or placement.table is None:
        return writing.NO_AXES
    angles = [writing.number(angle, decimals=_TABLE_DECIMALS) for angle in np.degrees(placement.table.axes).tolist()]
    return f"[{','.join([*angles, *['9E9'] * (6 - len(angles))])}]"


def program_file(modules: Sequence[str]) -> str:
    """Return the .pgf file that makes a controller load the modules together."""
    lines = [f"\t<Module>{name}</Module>" for name in modules]
    return "\n".join(['<?xml version="1.0" encoding="ISO-8859-1" ?>', "<Program>", *lines, "</Program>", ""])


def _tooldata(tool: Tool) -> str:
    if tool.mass_kg <= 0.0 or not tool.cog.any() or tool.inertia_kg_m2.min() < 0.0:
        raise UsageError(
            f"tool: the controller refuses a load of {tool.mass_kg} kg at {tool.cog.tolist()} mm with inertia "
            f"{tool.inertia_kg_m2.tolist()} kg m2. Give a mass above 0, the measured centre of gravity (not 0, 0, 0) "
            "and moments of at least 0."
        )
    mass = writing.number(tool.mass_kg, decimals=writing.POSITION_DECIMALS)
    cog = writing.array(tool.cog, decimals=writing.POSITION_DECIMALS)
    inertia = writing.array(tool.inertia_kg_m2, decimals=writing.INERTIA_DECIMALS)[1:-1]
    axes = writing.array(transforms.quaternion_of(tool.principal_axes), decimals=writing.QUATERNION_DECIMALS)
    return f"[TRUE,{writing.pose(tool.T_flange_tool)},[{mass},{cog},{axes},{inertia}]]"


def _frame_limits(cell: Cell, orders: Orders) -> list[str]:
    """Return the middle of the part, and how far a work object may shift and turn it [mm, degrees]."""
    low, high = orders.extent
    # Nor may an axis leave its quadrant, whose number the targets carry.
    room = max(min(_FRAME_SHARE * cell.process.standoff / 2.0, orders.frame), _SMALLEST_ROOM)
    turn = np.degrees(room / (np.linalg.norm(high - low) / 2.0))
    limits = writing.rounded_down(np.array([room, turn]), digits=_LIMIT_DIGITS).tolist()
    return [
        f"  CONST pos geoMiddle:={writing.array((low + high) / 2.0, decimals=writing.POSITION_DECIMALS)};",
        *(
            f"  CONST num {name}:={writing.significant(limit)};"
            for name, limit in zip(("nGeoShift", "nGeoTurn"), limits, strict=True)
        ),
    ]


def _station(cell: Cell, placement: Placement) -> dict[str, str]:
    unit = driving_unit(cell, placement)
    return {} if unit is None else {"STATION": writing.identifier(unit, what="table.mechanical_unit")}


def _jointtarget(name: str, joints: FloatArray, axes: str = writing.NO_AXES) -> str:
    angles = writing.array(np.degrees(joints), decimals=writing.ANGLE_DECIMALS)
    return f"  CONST jointtarget {name}:=[{angles},{axes}];"


def _seconds(duration: float) -> str:
    return writing.number(max(duration, _SHORTEST_MOVE), decimals=3)


def _prime_data(cell: Cell, orders: Orders, axes: str) -> list[str]:
    if cell.purge is None:
        return []
    lines = [
        _jointtarget("jGeoPrime", cell.purge.joints, axes),
        f"  CONST num nGeoPrime:={writing.number(cell.purge.duration, decimals=3)};",
    ]
    if cell.signals.sets_flow:
        output = cell.signals.flow_per_mm3_s * float(orders.flow.max()) * cell.process.speed
        lines.append(f"  CONST num nGeoPrimeFlow:={writing.significant(output)};")
    return lines


def _flood_data(cell: Cell, axes: str) -> list[str]:
    if cell.flood is None:
        return []
    lines = [f"  CONST num nGeoFlood:={writing.number(cell.flood.duration, decimals=3)};"]
    return lines if cell.flood.joints is None else [_jointtarget("jGeoFlood", cell.flood.joints, axes), *lines]


def _table_data(cell: Cell, placement: Placement) -> list[str]:
    """Return what a person brings the table to: number of the attitude, its axes, and of legs the plate's pose."""
    pose = placement.table
    if pose is None:
        return []
    if isinstance(cell.table, TiltTurn):
        named = dict(zip(("nGeoTilt", "nGeoTurned"), np.degrees(pose.axes).tolist(), strict=True))
    else:
        named = {f"nGeoLeg{leg}": length for leg, length in enumerate(pose.axes.tolist(), start=1)}
        turns = Rotation.from_matrix(pose.T_table_plate[:3, :3]).as_euler("xyz", degrees=True)
        plate = np.concatenate([pose.T_table_plate[:3, 3], turns]).tolist()
        named |= dict(zip((f"nGeoPlate{name}" for name in ("X", "Y", "Z", "Roll", "Pitch", "Yaw")), plate, strict=True))
    moving: list[str] = []
    if isinstance(cell.table, TiltTurn) and cell.table.unit is not None:
        seconds = driven_seconds(cell.table, share=cell.process.joint_speed_share)
        moving.append(_jointtarget("jGeoTable", cell.robot.home, external_axes(cell, placement)))
        moving.append(f"  CONST num nGeoTableMove:={_seconds(seconds)};")
    return [
        *moving,
        f"  CONST num nGeoTable:={pose.number};",
        *(f"  CONST num {name}:={writing.number(value, decimals=_TABLE_DECIMALS)};" for name, value in named.items()),
    ]
