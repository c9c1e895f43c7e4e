"""Compares the data of a RAPID program that was read back with the cell, the placement and the joint motions."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import cast

import numpy as np

from geoprint import transforms
from geoprint.model import Cell, FloatArray, Placement, TiltTurn
from geoprint.positioner import table_machine
from geoprint.postprocessor.orders import Orders
from geoprint.postprocessor.rapid.language.syntax import Call, FunctionCall, Name, Place, Statement, each_kind, refuse
from geoprint.postprocessor.rapid.made import Made
from geoprint.postprocessor.rapid.reader import (
    POSITION_TOLERANCE,
    Declaration,
    Listed,
    RapidText,
    compare,
    compare_frame,
    declared,
    literal,
)
from geoprint.postprocessor.rapid.settings import CELL_MODULE, read_settings

_ANGLE_TOLERANCE_DEG = 1e-5
_LOAD_TOLERANCE = 1e-4
_INERTIA_TOLERANCE = 1e-6
_TIME_TOLERANCE = 1e-3
# Six significant digits.
_SHARE_TOLERANCE = 1e-5
# No point of the part may lie off by more than this share of the stand-off; a limit far below would refuse every frame.
_LARGEST_FRAME_SHARE, _SMALLEST_FRAME_SHARE = 0.2, 0.15
# So much [mm] any frame may lie off, however near an axis is to a border of its quadrants: the controller rounds.
_FINEST_FRAME = 2e-3
# A joint move may take longer than planned by this where the plan needs no time at all [s].
_SHORTEST_MOVE = 0.1
_NO_AXES = 9e9
# So much higher is the path driven dry [mm].
_LIFT = 20.0
_CELL = Place(CELL_MODULE, 1)
# Modules that hold the path, and those whose data are compared with the plan.
_PATHS = frozenset({"GeoPrint.mod"})
_OWN = frozenset({CELL_MODULE, "GeoPrint.mod"})
# What a program declares besides speeddata, zonedata and triggdata.
_NAMES = frozenset(
    {
        "geodryrun", "geospeedpct", "geofirstrun", "tgeonozzle", "wgeopart", "geoframe", "geomiddle", "ngeoshift",
        "ngeoturn", "geolift", "jgeohome", "jgeostart", "jgeoaloft", "ngeothere", "ngeoback", "vgeohome", "vgeoslow",
    }
)  # fmt: skip
_TILT_TURN_NAMES = ("nGeoTilt", "nGeoTurned")
_PLATE_NAMES = ("nGeoPlateX", "nGeoPlateY", "nGeoPlateZ", "nGeoPlateRoll", "nGeoPlatePitch", "nGeoPlateYaw")
_LEG_NAMES = ("nGeoLeg1", "nGeoLeg2", "nGeoLeg3", "nGeoLeg4", "nGeoLeg5", "nGeoLeg6")
# What a person brings a table to is written to four decimals [mm, degrees].
_TABLE_TOLERANCE = 1e-4
# A num is single precision.
_ROUNDING = 1e-6
_PRIME_NAMES = frozenset({"jgeoprime", "ngeoprime"})


def verify_data(text: RapidText, orders: Orders, *, cell: Cell, placement: Placement) -> None:
    """Check every datum that is not shared by targets: switches, tool, work object and its limits, home, times.

    Raises:
        VerificationError: one differs from the plan, or a switch stands at a value that the guard refuses.
    """
    read_settings(text, runs=int(orders.runs[-1]) + 1)
    _verify_tool(declared(text, "tGeoNozzle", kind="tooldata", storage="PERS", place=_CELL), cell=cell)
    _verify_work(text, placement=placement)
    _verify_table(text, cell=cell, placement=placement)
    _verify_frame_limits(text, orders, standoff=cell.process.standoff)
    _verify_motions(text, orders, cell=cell, placement=placement)


def verify_header(text: RapidText, *, placement: Placement, surface_within: float | None) -> None:
    """Check that the headers say, from their second line on, how well it is known where the part stands.

    Raises:
        VerificationError: a header does not.
    """
    wanted: list[str] = []
    if placement.calibrated:
        wanted.append(f"largest residual of the touched points: {float(placement.misses.max(initial=0.0)):.2f} mm.")
    if placement.missing:
        wanted += ["PLACEMENT UNKNOWN: only runs dry", *(f"Not stated: {what}." for what in placement.missing)]
    if surface_within is not None:
        wanted.append(f"Surface known within {surface_within:.2f} mm along its normal (95 %).")
    for module in (CELL_MODULE, "GeoPrint.mod"):
        found = text.comments.get(module, ())
        for row, words in enumerate(wanted, start=1):
            if words not in "".join(found[row : row + 1]):
                refuse(Place(module, row + 2), f"the header must say {words!r} here")


def verify_names(text: RapidText, made: Made, *, cell: Cell, placement: Placement) -> None:
    """Check that nothing is declared that the program does not use, and that all moves use the tool and work object.

    Raises:
        VerificationError: something is left over, or a move names another tool or work object.
    """
    used = set(_NAMES)
    if cell.purge is not None:
        used |= _PRIME_NAMES
        used |= {"ngeoprimeflow"} if cell.signals.sets_flow else set()
    if cell.flood is not None:
        used |= {"ngeoflood"} if cell.flood.joints is None else {"ngeoflood", "jgeoflood"}
    used |= {name.lower() for name in _table_wanted(cell, placement)}
    if _axes_wanted(cell, placement)[0] < _NO_AXES:
        used |= {"jgeotable", "ngeotablemove"}
    moves, rows = made.execution.moves, made.rows
    _verify_axes(made, cell=cell, placement=placement)
    wanted = [moves.names.index(name) if name in moves.names else -1 for name in ("tgeonozzle", "wgeopart")]
    wrong = np.flatnonzero((moves.tools[rows] != wanted[0]) | (moves.works[rows] != wanted[1]))
    if wrong.size:
        row = int(rows[wrong[0]])
        tool, work = moves.names[int(moves.tools[row])], moves.names[int(moves.works[row])]
        refuse(made.place(int(wrong[0])), f"the move is made with {tool} in {work}")
    for module in text.modules:
        if module.file in _PATHS or module.file.startswith("GeoPath"):
            used |= {name for routine in module.routines for each in each_kind(routine.body) for name in _named(each)}
    for name, datum in text.declarations.items():
        if datum.place.module in _OWN and name not in used and datum.kind != "loadsession":
            refuse(datum.place, f"{name} is declared, but the plan has no use for it")


def _axes_wanted(cell: Cell, placement: Placement) -> FloatArray:
    """Return (6,) the external axes of every target, as the plate's pose has them anew [degrees]."""
    wanted = np.full(6, _NO_AXES)
    if placement.table is not None and isinstance(cell.table, TiltTurn) and cell.table.unit is not None:
        wanted[:2] = np.degrees(table_machine(cell.table).axes(placement.table.T_table_plate[None])[0])
    return wanted


def _verify_axes(made: Made, *, cell: Cell, placement: Placement) -> None:
    """Check that every target has the table where the attitude has it."""
    axes, wanted = made.execution.moves.other_axes[made.rows], _axes_wanted(cell, placement)
    # Of the axes that are not there 9E9 is written, which is rounded.
    wrong = np.flatnonzero((np.abs(axes - wanted) > _TABLE_TOLERANCE + _ROUNDING * np.abs(wanted)).any(axis=1))
    if wrong.size:
        row = int(wrong[0])
        found, planned = axes[row].round(4).tolist(), wanted.round(4).tolist()
        refuse(made.place(row), f"target {row + 1}: the external axes are {found}, the plan has {planned}")


def _named(statement: Statement) -> Iterator[str]:
    """Yield the data that a call hands over."""
    for argument in statement.arguments if isinstance(statement, Call) else ():
        if isinstance(argument.value, Name):
            yield argument.value.name.lower()
        elif isinstance(argument.value, FunctionCall):
            yield from (each.value.name.lower() for each in argument.value.arguments if isinstance(each.value, Name))


def _verify_work(text: RapidText, *, placement: Placement) -> None:
    datum = declared(text, "wGeoPart", kind="wobjdata", storage="PERS", place=_CELL)
    value = datum.value if isinstance(datum.value, list) else []
    compare(value[:3], [False, True, ""], tolerance=0.0, place=datum.place, what="wobjdata")
    if len(value) != 5:
        refuse(datum.place, f"wobjdata has five parts, found {len(value)}")
    compare_frame(value[3], placement.T_base_fixture, place=datum.place, what="uframe")
    compare_frame(value[4], placement.T_fixture_work, place=datum.place, what="oframe")
    frame = declared(text, "geoFrame", kind="pose", storage="CONST", place=_CELL)
    compare_frame(frame.value, placement.T_base_work, place=frame.place, what="geoFrame")
    lift = declared(text, "geoLift", kind="pose", storage="CONST", place=_CELL)
    up = transforms.inverse(placement.T_base_work)[:3, 2] * _LIFT
    compare(lift.value, [literal(up), [1, 0, 0, 0]], tolerance=POSITION_TOLERANCE, place=lift.place, what="geoLift")


def _table_wanted(cell: Cell, placement: Placement) -> dict[str, float]:
    """Return what a table must be brought to, by the name of its datum: the axes follow anew from the plate's pose."""
    if placement.table is None or cell.table is None:
        return {}
    pose = placement.table.T_table_plate
    axes = table_machine(cell.table).axes(pose[None])[0]
    wanted = {"nGeoTable": float(placement.table.number)}
    if isinstance(cell.table, TiltTurn):
        return wanted | dict(zip(_TILT_TURN_NAMES, np.degrees(axes).tolist(), strict=True))
    roll = np.arctan2(pose[2, 1], pose[2, 2])
    pitch, yaw = np.arctan2(-pose[2, 0], np.hypot(pose[2, 1], pose[2, 2])), np.arctan2(pose[1, 0], pose[0, 0])
    plate = [*pose[:3, 3].tolist(), *np.degrees([roll, pitch, yaw]).tolist()]
    return wanted | dict(zip((*_LEG_NAMES, *_PLATE_NAMES), [*axes.tolist(), *plate], strict=True))


def _verify_table(text: RapidText, *, cell: Cell, placement: Placement) -> None:
    """Check what the program shows of the attitude to whoever brings the table there."""
    for name, value in _table_wanted(cell, placement).items():
        datum = declared(text, name, kind="num", storage="CONST", place=_CELL)
        compare(datum.value, value, tolerance=_TABLE_TOLERANCE, place=datum.place, what=name)


def _verify_frame_limits(text: RapidText, orders: Orders, *, standoff: float) -> None:
    """Check how far the guard lets a point of the part lie off: at the corners of its box, where that is most.

    Less than a share of the stand-off is right where an axis would leave its quadrant.
    """
    middle = declared(text, "geoMiddle", kind="pos", storage="CONST", place=_CELL)
    compare(middle.value, literal(np.zeros(3)), tolerance=np.inf, place=middle.place, what="geoMiddle")
    limits = [declared(text, name, kind="num", storage="CONST", place=_CELL) for name in ("nGeoShift", "nGeoTurn")]
    for limit in limits:
        compare(limit.value, 0.0, tolerance=np.inf, place=limit.place, what="a limit of the work object")
    shift, turn_deg = (float(cast("float", limit.value)) for limit in limits)
    corners = np.array([*product(*orders.extent.T)]) - np.array(middle.value, dtype=np.float64)
    reach = float(np.linalg.norm(corners, axis=1).max())
    share = (shift + 2.0 * np.sin(np.radians(turn_deg) / 2.0) * reach) / standoff
    allowed = min(_LARGEST_FRAME_SHARE, max(2.0 * orders.frame, _FINEST_FRAME) / standoff)
    least = _SMALLEST_FRAME_SHARE / _LARGEST_FRAME_SHARE * allowed
    # geoMiddle is written rounded, so that a corner may be a little farther from it than from the middle itself.
    if not least <= share <= allowed + _SHARE_TOLERANCE or min(shift, turn_deg) <= 0.0:
        refuse(
            limits[0].place,
            f"geoMiddle, nGeoShift and nGeoTurn let the part lie off by {share:.3g} of the stand-off, allowed is "
            f"{allowed:.3g}",
        )


def _verify_motions(text: RapidText, orders: Orders, *, cell: Cell, placement: Placement) -> None:
    """Check the joint moves: home, the first targets, their times, and where nozzle and part are primed and flooded."""
    joints = {"jGeoHome": cell.robot.home, "jGeoStart": orders.start, "jGeoAloft": orders.lifted}
    times = {"nGeoThere": max(orders.there, _SHORTEST_MOVE), "nGeoBack": max(orders.back, _SHORTEST_MOVE)}
    if cell.purge is not None:
        joints["jGeoPrime"] = cell.purge.joints
        times["nGeoPrime"] = cell.purge.duration
    if cell.flood is not None:
        times["nGeoFlood"] = cell.flood.duration
        joints |= {} if cell.flood.joints is None else {"jGeoFlood": cell.flood.joints}
    axes = _axes_wanted(cell, placement)
    if isinstance(cell.table, TiltTurn) and axes[0] < _NO_AXES:
        joints["jGeoTable"] = cell.robot.home
        spans = np.diff(cell.table.ranges, axis=1)[:, 0]
        times["nGeoTableMove"] = float((spans / cell.table.speeds).max()) / cell.process.joint_speed_share
    for name, angles in joints.items():
        datum = declared(text, name, kind="jointtarget", storage="CONST", place=_CELL)
        value = datum.value if isinstance(datum.value, list) and len(datum.value) == 2 else [None, None]
        compare(value[0], literal(np.degrees(angles)), tolerance=_ANGLE_TOLERANCE_DEG, place=datum.place, what=name)
        expected = literal(np.full(6, _NO_AXES) if name == "jGeoHome" else axes)
        compare(value[1], expected, tolerance=_TABLE_TOLERANCE, place=datum.place, what=f"{name}'s external axes")
    for name, duration in times.items():
        datum = declared(text, name, kind="num", storage="CONST", place=_CELL)
        compare(datum.value, duration, tolerance=_TIME_TOLERANCE, place=datum.place, what=name)
    _verify_shared(text)
    speeds: dict[str, list[float]] = {
        "vGeoHome": [cell.process.travel_speed, 500, 5000, 1000],
        "vGeoSlow": [20, 10, 5000, 1000],
    }
    for name, speed in speeds.items():
        datum = declared(text, name, kind="speeddata", storage="CONST", place=_CELL)
        compare(datum.value, [*speed], tolerance=_SHARE_TOLERANCE * speed[0], place=datum.place, what=name)
    if cell.purge is not None and cell.signals.sets_flow:
        _verify_prime_flow(text, orders.flow, cell=cell)


def _verify_shared(text: RapidText) -> None:
    """Check that what targets share differs in speed and zone only: turning and other axes are the controller's own."""
    for name, datum in text.declarations.items():
        parts = datum.value if isinstance(datum.value, list) else []
        first = parts[1 if datum.kind == "zonedata" else 0] if len(parts) > 1 else 0.0
        size = float(first) if isinstance(first, float | int) else 0.0
        if datum.kind == "speeddata" and name not in {"vgeohome", "vgeoslow"}:
            compare(datum.value, [size, 500, 5000, 1000], tolerance=0.0, place=datum.place, what="speeddata")
        elif datum.kind == "zonedata":
            wanted: Listed = [False, size, size, size, 10.0 * size, size, 10.0 * size]
            compare(datum.value, wanted, tolerance=1e-9, place=datum.place, what="zonedata")


def _verify_prime_flow(text: RapidText, flow: FloatArray, *, cell: Cell) -> None:
    planned = cell.signals.flow_per_mm3_s * float(flow.max()) * cell.process.speed
    datum = declared(text, "nGeoPrimeFlow", kind="num", storage="CONST", place=_CELL)
    compare(datum.value, planned, tolerance=_SHARE_TOLERANCE * planned, place=datum.place, what="nGeoPrimeFlow")


def _verify_tool(datum: Declaration, *, cell: Cell) -> None:
    tool, value = cell.tool, datum.value
    load = value[2] if isinstance(value, list) and len(value) == 3 else None
    if not isinstance(value, list) or value[0] is not True or not isinstance(load, list) or len(load) != 6:
        refuse(datum.place, "tooldata must be a tool held by the robot")
    compare_frame(value[1], tool.T_flange_tool, place=datum.place, what="tool frame")
    compare(load[0], tool.mass_kg, tolerance=_LOAD_TOLERANCE, place=datum.place, what="load")
    axes = transforms.rigid(tool.principal_axes, tool.cog)
    compare_frame(load[1:3], axes, place=datum.place, what="load")
    compare(load[3:], literal(tool.inertia_kg_m2), tolerance=_INERTIA_TOLERANCE, place=datum.place, what="inertia")
