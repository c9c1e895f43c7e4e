r"""The RAPID program of a plan: GeoCell (what the cell is), GeoGuard (what is around the path), GeoPrint (the path).

The forms are those that run in public programs: one `MoveL` or `TriggL` a target with its robtarget written out in the
line, about 165 characters (no arrays to index, a line stands for itself; where a move pulls many triggers, in the line
before), shared speeddata and zonedata, ASCII throughout.

`ConfL\On`: every target carries the configuration of the planned joint path, which is the one that was checked for
collisions; a controller that would reach a target in another configuration stops instead of printing on. The dry run
drives the same targets higher, where an axis may stand in another quadrant: such a target goes through `GeoAloft` of
the guard, which gives it the configuration that it has there, so that the dry run is driven with `ConfL\On` as well.
`SingArea\Off`: the nozzle's attitude is never traded for a path around a singularity.

The modules run dry until somebody sets `geoDryRun` to FALSE: until then, and on runs before `geoFirstRun`, `geoOn` is 0
and the path is lifted; every trigger that switches on writes `geoOn`. Where somebody has yet to state where fixture and
part stand, no line of the guard sets it, so no setting makes such a program deposit. Switching off writes 0 and never
asks.

A program that does not fit one module is spread over GeoPath1, GeoPath2, ..., which main loads from the controller's
home folder while the one before runs. A run is never split: between two modules the tool is lifted and shut off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from geoprint.errors import UsageError
from geoprint.model import Cell, FloatArray, Placement, Program
from geoprint.postprocessor.orders import Event, Orders
from geoprint.postprocessor.rapid import writing
from geoprint.postprocessor.rapid.cell_module import (
    cell_module,
    external_axes,
    guard_module,
    header_lines,
    program_file,
)
from geoprint.postprocessor.rapid.configuration import configurations
from geoprint.postprocessor.rapid.writing import output_names, triggers_of
from geoprint.postprocessor.switching import waits

# More lines in a module load slowly and are beyond what the controller's editor opens.
MODULE_LINES = 15000
# Public programs that load have no longer lines; a move that pulls many triggers would have one.
LONGEST_LINE = 250
_TARGET = "geoTarget"
# Five digits of a speed keep its time to 0.01 %, two of a zone are below 10 % of it; neither is ever above the plan.
_SPEED_DIGITS = 5
_ZONE_DIGITS = 2
# A zone below 1 um is a stop in all but name, and zonedata that small serves nobody.
_SMALLEST_ZONE = 0.001
# Reorientation and external axes as in the controller's own v20 ... v1000 [deg/s, mm/s, deg/s].
_OTHER_SPEEDS = "500,5000,1000"
# The controller shrinks a zone to the smallest of its shares, so a zone must allow as much turning as the path has: a
# surface of 6 mm radius turns the nozzle by 10 degrees each mm. The 0.1 of the predefined zones would stop at targets.
_ZONE_TURN_DEG_PER_MM = 10.0
# What an error does in every routine that moves: shut off, and let the caller know.
_ON_ERROR = ("  ERROR", "    GeoSafe;", "    RAISE;", "  ENDPROC")


def written_program(
    orders: Orders,
    events: tuple[Event, ...],
    *,
    cell: Cell,
    placement: Placement,
    surface_within: float | None,
    part_name: str,
    spacing: float,
    checked: Sequence[str] = (),
    not_checked: Sequence[str] = (),
) -> Program:
    """Write the modules that drive the tool through the targets.

    The program asks its questions, goes home and to the first target in the planned times (MoveAbsJ), along the
    targets in part coordinates (MoveL), and home again. Valve and lamp switch as it goes. The same input gives the
    same bytes.

    Args:
        orders: targets and times.
        events: where outputs switch.
        cell: the robot, the tool, the signals.
        placement: where the part stands: uframe and oframe of the work object.
        surface_within: what its surface is known within along its normal, in 95 of 100 calibrations [mm], or None.
        part_name: for the header.
        spacing: distance of neighbouring paths [mm], for the header.
        checked: sentences about what was checked, for the header.
        not_checked: sentences about what was not.

    Returns:
        The modules, and `GeoPrint.pgf` which lists those that are loaded at once.

    Raises:
        UsageError: the cell has what RAPID cannot take, or a run is longer than a module.
    """
    header = header_lines(
        cell=cell, placement=placement, surface_within=surface_within, part_name=part_name, spacing=spacing,
        runs=int(np.count_nonzero(np.diff(orders.runs))) + 1, targets=orders.count, checked=checked,
        not_checked=not_checked,
    )  # fmt: skip
    return _written(orders, events, header, cell=cell, placement=placement)


def _written(
    orders: Orders, events: tuple[Event, ...], header: list[str], *, cell: Cell, placement: Placement
) -> Program:
    """Return the cell's module, the guard, the modules that print, and the list of those that are loaded at once."""
    speeds, zones, declarations = _name_shared_data(orders)
    triggered, definitions, pulled = triggers_of(orders, events, signals=cell.signals, names=output_names(cell.signals))
    moves = _moves(orders, cell, speeds=speeds, zones=zones, pulled=pulled, axes=external_axes(cell, placement))
    runs = _procedures(orders, moves, definitions=definitions, waiting=waits(orders, cell.signals))
    declared = [*declarations, *triggered]
    cell_text = cell_module(cell, orders, placement=placement, declarations=declared, header=header)
    printing = _print_modules(runs, header=header, last_run=int(orders.runs[-1]) + 1)
    guard = guard_module(cell, placement=placement, loading=len(printing) > 1)
    modules = [("GeoCell.mod", cell_text), ("GeoGuard.mod", guard), *printing]
    at_once = [name for name, _ in modules if not name.startswith("GeoPath")]
    modules.append(("GeoPrint.pgf", program_file(at_once)))
    return Program(tuple(modules), targets=orders.count, dry_run=bool(placement.missing))


def _name_shared_data(orders: Orders) -> tuple[list[str], list[str], list[str]]:
    """Return the names of the speeddata and of the zonedata of each target, and their declarations."""
    speeds = writing.rounded_down(orders.speeds, digits=_SPEED_DIGITS)
    zones = np.where(orders.zones < _SMALLEST_ZONE, 0.0, writing.rounded_down(orders.zones, digits=_ZONE_DIGITS))
    distinct_speeds, speed_of = np.unique(speeds, return_inverse=True)
    distinct_zones, zone_of = np.unique(np.append(zones, 0.0), return_inverse=True)
    speed_names = [f"vGeo{k + 1}" for k in range(distinct_speeds.size)]
    zone_names = ["fine", *(f"zGeo{k + 1}" for k in range(distinct_zones.size - 1))]
    declarations = [
        f"  CONST speeddata {name}:=[{_plain(speed)},{_OTHER_SPEEDS}];"
        for name, speed in zip(speed_names, distinct_speeds, strict=True)
    ]
    for name, zone in zip(zone_names[1:], distinct_zones[1:], strict=True):
        radius, turn = _plain(zone), _plain(zone * _ZONE_TURN_DEG_PER_MM)
        declarations.append(f"  CONST zonedata {name}:=[FALSE,{radius},{radius},{radius},{turn},{radius},{turn}];")
    return [speed_names[int(k)] for k in speed_of], [zone_names[int(k)] for k in zone_of[:-1]], declarations


def _plain(value: float) -> str:
    """Return a number that has few significant digits without the zeros that carry nothing."""
    return writing.number(value, decimals=5).rstrip("0").rstrip(".")


def _moves(
    orders: Orders, cell: Cell, *, speeds: list[str], zones: list[str], pulled: Mapping[int, list[str]], axes: str
) -> list[str]:
    """Return the motion instruction of each target; where its line would be too long, the target in one before it."""
    tips = np.round(orders.tips, writing.POSITION_DECIMALS) + 0.0
    quaternions = np.round(_unit(orders.quaternions), writing.QUATERNION_DECIMALS) + 0.0
    position, turn = f"%.{writing.POSITION_DECIMALS}f", f"%.{writing.QUATERNION_DECIMALS}f"
    target = f"[[{','.join([position] * 3)}],[{','.join([turn] * 4)}],[%d,%d,%d,%d],{axes}]"
    form = "    %s %s%s%s,%s,%s%s,tGeoNozzle\\WObj:=wGeoPart;"
    printed, dry = configurations(orders, cell)
    lifted = [("", "")] * orders.count
    for index in np.flatnonzero((dry != printed).any(axis=1)).tolist():
        cf = dry[index].tolist()
        lifted[index] = ("GeoAloft(", f",[{','.join(map(str, cf))}])")
    verbs, pulls = ["MoveL"] * orders.count, [""] * orders.count
    for index, trigger_names in pulled.items():
        verbs[index] = "TriggL"
        others = "".join(f"\\T{k}:={name}" for k, name in enumerate(trigger_names[1:], start=2))
        pulls[index] = f"{trigger_names[0]}{others},"
    rows = zip(
        verbs, lifted, tips.tolist(), quaternions.tolist(), printed.tolist(), speeds, pulls, zones,
        strict=True,
    )  # fmt: skip
    moves: list[str] = []
    for verb, (opened, closed), tip, turned, cf, speed, pull, zone in rows:
        place = target % (*tip, *turned, *cf)
        move = form % (verb, opened, place, closed, speed, pull, zone)
        if len(move) > LONGEST_LINE:
            move = f"    {_TARGET}:={place};\n{form % (verb, opened, _TARGET, closed, speed, pull, zone)}"
        moves.append(move)
    return moves


def _unit(quaternions: FloatArray) -> FloatArray:
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


def _procedures(
    orders: Orders, moves: list[str], *, definitions: Mapping[int, list[str]], waiting: FloatArray
) -> list[tuple[str, list[str]]]:
    """Return name and lines of the procedures: one a run. At a target the arm waits so long [s], but never dry."""
    edges = [0, *(np.flatnonzero(np.diff(orders.runs) != 0) + 1).tolist(), orders.count]
    procedures: list[tuple[str, list[str]]] = []
    for first, last in pairwise(edges):
        number = int(orders.runs[first]) + 1
        own = [f"    VAR robtarget {_TARGET};"] if any("\n" in move for move in moves[first:last]) else []
        lines = [f"  PROC GeoRun{number}()", *own, f"    GeoEnter {number};"]
        for target in range(first, last):
            lines += definitions.get(target, [])
            lines += moves[target].split("\n")
            if waiting[target] > 0.0:
                lines.append(f"    WaitTime\\InPos,{writing.significant(float(waiting[target]))}*geoOn;")
        lines += _ON_ERROR
        if len(lines) > MODULE_LINES - 2:  # MODULE, ENDMODULE
            raise UsageError(
                f"run {number} has {last - first} targets, more than the {MODULE_LINES} lines of a RAPID module, and "
                "cannot be split while the valve is open. Print faster, or a smaller part.",
                run=number - 1,
                targets=last - first,
            )
        procedures.append((f"GeoRun{number}", lines))
    return procedures


def _print_modules(
    procedures: list[tuple[str, list[str]]], *, header: list[str], last_run: int
) -> list[tuple[str, str]]:
    """Return GeoPrint.mod with main and all runs, or behind as many GeoPath modules as are needed."""
    calls = [f"    {name};" for name, _ in procedures]
    main = [*header, "  PROC main()", f"    GeoBegin {last_run};", *calls, f"    GeoEnd {last_run};", *_ON_ERROR]
    room = MODULE_LINES - 2  # MODULE, ENDMODULE
    if len(main) + sum(len(lines) for _, lines in procedures) <= room:
        runs = [line for _, lines in procedures for line in lines]
        return [("GeoPrint.mod", _module("GeoPrint", [*main, *runs]))]
    groups: list[list[tuple[str, list[str]]]] = [[]]
    for procedure in procedures:
        if sum(len(lines) for _, lines in groups[-1]) + len(procedure[1]) > room:
            groups.append([])
        groups[-1].append(procedure)
    paths = [
        (f"GeoPath{k}.mod", _module(f"GeoPath{k}", [line for _, lines in group for line in lines]))
        for k, group in enumerate(groups, start=1)
    ]
    main = _loading_main([[name for name, _ in group] for group in groups], header=header, last_run=last_run)
    return [*paths, ("GeoPrint.mod", _module("GeoPrint", main))]


def _loading_main(groups: list[list[str]], *, header: list[str], last_run: int) -> list[str]:
    """Return a main that loads each module while the one before runs, and forgets it afterwards."""
    files = [f'"GeoPath{k}.mod"' for k in range(1, len(groups) + 1)]
    lines = [*header, "  VAR loadsession geoLoading;", "  PROC main()"]
    lines += [f"    GeoForget {file};" for file in files]
    lines += [_start_load(files[0]), "    WaitLoad geoLoading;", f"    GeoBegin {last_run};"]
    for k, names in enumerate(groups):
        following = files[k + 1 : k + 2]
        lines += [_start_load(file) for file in following]
        lines += [f'    %"{name}"%;' for name in names]
        lines += ["    WaitLoad geoLoading;" for _ in following]
        lines.append(f"    UnLoad diskhome\\File:={files[k]};")
    return [*lines, f"    GeoEnd {last_run};", *_ON_ERROR]


def _start_load(file: str) -> str:
    return f"    StartLoad\\Dynamic,diskhome\\File:={file},geoLoading;"


def _module(name: str, lines: Sequence[str]) -> str:
    return "\n".join([f"MODULE {name}", *lines, "ENDMODULE", ""])
