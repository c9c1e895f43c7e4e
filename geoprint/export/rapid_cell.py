"""The standing part of a RAPID program: header, tool, work object, home, switching, and the list of its modules."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version

import numpy as np

from geoprint.errors import UsageError
from geoprint.export import rapid_values as values
from geoprint.model import Cell, Placement, Tool
from geoprint.transforms import quaternion_of

NOT_CALIBRATED = "PLACEMENT NOT CALIBRATED"


def header_lines(
    *,
    cell: Cell,
    placement: Placement,
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
        placement: whether it is calibrated, and how well.
        part_name: any text.
        spacing: [mm].
        runs: number of runs.
        targets: number of robtargets.
        checked: sentences about what was checked, besides that the text reads back as the plan.
        not_checked: sentences about what was not.
    """
    lines = values.comment(f"Written by geoprint {version('geoprint')}. Change the plan and write again, not this.")
    if placement.calibrated:
        miss = float(placement.misses.max(initial=0.0))
        lines += values.comment(
            f"Placement calibrated; touched points lie within {miss:.2f} mm of where others put them."
        )
    else:
        lines += values.comment(f"{NOT_CALIBRATED}: runs dry only. GeoOn holds no instruction, whatever geoDryRun is.")
    lines += values.comment(f"Part: {part_name}")
    lines += values.comment(f"Cell: {cell.name}; robot: {cell.robot.model}")
    lines += values.comment(f"Spacing: {values.number(spacing, decimals=4)} mm; runs: {runs}; targets: {targets}")
    lines += values.comment("Checked: the text reads back as the plan: targets, speeds, zones, outputs, frames.")
    for sentence in checked:
        lines += values.comment(f"Checked: {sentence}")
    for sentence in not_checked:
        lines += values.comment(f"Not checked: {sentence}")
    lines += values.comment("Not checked: the real cell. Run it dry and slowly first.")
    lines += values.comment(
        "A stop of the program leaves outputs as they are: tie them to the controller's stop events."
    )
    return lines


def check_cell(cell: Cell) -> None:
    """Check what a program needs of a cell, before a long plan is made for it.

    Raises:
        UsageError: an output has no RAPID name, the mode is one that cannot be written, or the load is not physical.
    """
    _tooldata(cell.tool)
    _switching(cell, calibrated=True)


def cell_module(cell: Cell, *, placement: Placement, declarations: Sequence[str], header: Sequence[str]) -> str:
    """Return the text of GeoCell.mod.

    Args:
        cell: tool, home and outputs.
        placement: uframe and oframe of the work object.
        declarations: lines of the shared speeddata and zonedata.
        header: comment lines.

    Raises:
        UsageError: an output has no RAPID name, the mode is one that cannot be written, or the load is not physical.
    """
    frames = f"{values.pose(placement.T_base_fixture)},{values.pose(placement.T_fixture_work)}"
    home = values.array(np.degrees(cell.robot.home), decimals=values.ANGLE_DECIMALS)
    lines = [
        "MODULE GeoCell",
        *header,
        "  PERS bool geoDryRun:=TRUE;",
        f"  PERS tooldata tGeoNozzle:={_tooldata(cell.tool)};",
        f'  PERS wobjdata wGeoPart:=[FALSE,TRUE,"",{frames}];',
        f"  CONST jointtarget jGeoHome:=[{home},{values.NO_AXES}];",
        *declarations,
        *_switching(cell, calibrated=placement.calibrated),
        "ENDMODULE",
        "",
    ]
    return "\n".join(lines)


def program_file(modules: Sequence[str]) -> str:
    """Return the .pgf file that makes a controller load the modules together."""
    lines = [f"\t<Module>{name}</Module>" for name in modules]
    return "\n".join(['<?xml version="1.0" encoding="ISO-8859-1" ?>', "<Program>", *lines, "</Program>", ""])


def _tooldata(tool: Tool) -> str:
    if tool.mass_kg <= 0.0 or not tool.cog.any() or tool.inertia_kg_m2.min() < 0.0:
        raise UsageError(
            f"tool: the controller refuses a load of {tool.mass_kg} kg at {tool.cog.tolist()} mm with inertia "
            f"{tool.inertia_kg_m2.tolist()} kg m2; give a mass above 0, the measured centre of gravity (not 0, 0, 0) "
            "and moments of at least 0 in the cell file."
        )
    mass = values.number(tool.mass_kg, decimals=values.POSITION_DECIMALS)
    cog = values.array(tool.cog, decimals=values.POSITION_DECIMALS)
    inertia = values.array(tool.inertia_kg_m2, decimals=values.INERTIA_DECIMALS)[1:-1]
    axes = values.array(quaternion_of(tool.principal_axes), decimals=values.QUATERNION_DECIMALS)
    return f"[TRUE,{values.pose(tool.T_flange_tool)},[{mass},{cog},{axes},{inertia}]]"


def _switching(cell: Cell, *, calibrated: bool) -> list[str]:
    """Return the procedures GeoOn and GeoOff: the only places that name an output."""
    if cell.signals.mode != "io":
        raise UsageError(
            f"signals.mode {cell.signals.mode!r} cannot be written: it needs an analog output that the cell file does "
            "not name; set mode to 'io'."
        )
    dispenser = values.identifier(cell.signals.dispenser, what="signals.dispenser")
    uv_lamp = values.identifier(cell.signals.uv_lamp, what="signals.uv_lamp")
    on = [
        "    IF NOT geoDryRun THEN",
        f"      SetDO {dispenser},1;",
        f"      SetDO {uv_lamp},1;",
        "    ENDIF",
    ]
    nothing = values.comment(f"{NOT_CALIBRATED}: nothing is switched on.", indent="    ")
    return [
        "  PROC GeoOn()",
        *(on if calibrated else nothing),
        "  ENDPROC",
        "  PROC GeoOff()",
        f"    SetDO {dispenser},0;",
        f"    SetDO {uv_lamp},0;",
        "  ENDPROC",
    ]
