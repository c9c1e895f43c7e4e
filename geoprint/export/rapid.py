r"""The RAPID program of a plan: GeoCell (what the cell is), GeoPrint (what is printed), GeoPath1... if it is long.

The forms are those that run in public programs: one `MoveL` a target with its robtarget written out in the line (no
arrays to index, a line stands for itself, about 165 characters), shared speeddata and zonedata, ASCII throughout.

`ConfL\On`: every target carries the configuration of the planned joint path, which is the one that was checked for
collisions; a controller that would reach a target in another configuration stops instead of printing on.
`SingArea\Off`: the nozzle's attitude is never traded for a way around a singularity.

The modules run dry until somebody sets `geoDryRun` to FALSE: only then `GeoOn` opens the valve and lights the lamp.
Without a calibrated placement `GeoOn` holds no instruction at all, so no setting makes such a program deposit. `GeoOff`
never asks: switching off is always safe.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from geoprint.errors import InputError
from geoprint.export import rapid_values as values
from geoprint.export.rapid_cell import cell_module, header_lines, program_file
from geoprint.export.rapid_verify import verify_program
from geoprint.model import BoolArray, Cell, FloatArray, JointPath, Placement, PoseStream, Program, Targets

# More lines in a module load slowly and are beyond what the controller's editor opens.
MODULE_LINES = 15000
# Three digits of a speed are below 1 % of it, two of a zone below 10 %: few distinct values, never above the plan.
_SPEED_DIGITS = 3
_ZONE_DIGITS = 2
# Below this a controller knows no speed [mm/s].
_SMALLEST_SPEED = 0.01
# A zone below 1 um is a stop in all but name, and zonedata that small serves nobody.
_SMALLEST_ZONE = 0.001
# Reorientation and external axes as in the controller's own v20 ... v1000 [deg/s, mm/s, deg/s].
_OTHER_SPEEDS = "500,5000,1000"
# The controller shrinks a zone to the smallest of its shares, so a zone must allow as much turning as the path has: a
# surface of 6 mm radius turns the nozzle by 10 degrees each mm. The 0.1 of the predefined zones would stop at targets.
_ZONE_TURN_DEG_PER_MM = 10.0
# uframe and oframe must be the placement that the joint path was computed for.
_SAME_PLACEMENT = 1e-6


def rapid_program(
    joint_path: JointPath,
    targets: Targets,
    *,
    cell: Cell,
    placement: Placement,
    part_name: str,
    spacing: float,
    checked: Sequence[str] = (),
    not_checked: Sequence[str] = (),
) -> Program:
    """Write the modules that drive the tool through the targets, and verify them by reading them back.

    The program goes home (MoveAbsJ), to the first target (MoveJ), along the targets in part coordinates (MoveL), and
    home again. The valve and the lamp are switched on at the first pose of each deposit and off at its last, both
    stop points. Joint moves run at the tip speed of the first target and at travel speed: RAPID knows no share of the
    joint speeds. The same input gives the same bytes.

    Args:
        joint_path: poses, joint angles and configurations.
        targets: which poses are written, how fast, how rounded.
        cell: the robot, the tool, the signals.
        placement: where the part stands: uframe and oframe of the work object.
        part_name: for the header.
        spacing: distance of neighbouring paths [mm], for the header.
        checked: sentences about what was checked, for the header.
        not_checked: sentences about what was not.

    Returns:
        `GeoCell.mod`, path modules if any, `GeoPrint.mod`, and `GeoPrint.pgf` which lists them.

    Raises:
        UsageError: the cell names or describes something that RAPID cannot take.
        InputError: the targets do not cover the stream, or do not stop where the signals switch.
        VerificationError: the text that was written does not read back as the plan.
    """
    deposits = _deposits(joint_path.poses, targets)
    _check_placement(joint_path, placement)
    names = _name_shared_data(targets, cell=cell)
    runs = _motion_lines(joint_path, targets, deposits=deposits, names=names)
    header = header_lines(
        cell=cell, placement=placement, part_name=part_name, spacing=spacing, runs=len(runs),
        targets=targets.poses.size, checked=checked, not_checked=not_checked,
    )  # fmt: skip
    cell_text = cell_module(cell, placement=placement, declarations=names.declarations, header=header)
    modules = [("GeoCell.mod", cell_text), *_path_modules(_procedures(runs), names=names, header=header)]
    modules.append(("GeoPrint.pgf", program_file([name for name, _ in modules])))
    program = Program(modules=tuple(modules), targets=targets.poses.size, dry_run=not placement.calibrated)
    verify_program(program, joint_path, targets, cell=cell, placement=placement)
    return program


@dataclass(frozen=True, slots=True)
class _Deposits:
    """(t,) flags of the targets where the outputs are switched on, and off."""

    starts: BoolArray
    ends: BoolArray


@dataclass(frozen=True, slots=True)
class _SharedNames:
    """Names of the speeddata and zonedata: of each target, of the way home, and their declarations."""

    speeds: list[str]
    zones: list[str]
    home_speed: str
    declarations: list[str]


def _deposits(poses: PoseStream, targets: Targets) -> _Deposits:
    """Find where outputs switch, and check that the targets serve the whole stream and stop there."""
    _check_targets(poses, targets)
    after, before = np.append(poses.laid, np.False_), np.insert(poses.laid, 0, np.False_)
    rests = np.zeros(poses.count, dtype=np.bool_)
    rests[targets.poses[targets.zones == 0.0]] = True
    alone = poses.deposit & ~after & ~before
    wrong = np.flatnonzero(alone | ((after ^ before) & ~rests))
    if wrong.size:
        raise InputError(
            f"pose {wrong[0]} of run {poses.runs[wrong[0]]} begins or ends a deposit, but is no target with zone 0 or "
            "is the only pose of its deposit; outputs are switched where the tool rests. Thin the stream again.",
            pose=int(wrong[0]),
        )
    return _Deposits(starts=(after & ~before)[targets.poses], ends=(before & ~after)[targets.poses])


def _check_targets(poses: PoseStream, targets: Targets) -> None:
    chosen = targets.poses
    if not chosen.size or chosen[0] != 0 or chosen[-1] != poses.count - 1 or (np.diff(chosen) <= 0).any():
        raise InputError(
            f"targets must rise from pose 0 to pose {poses.count - 1}, the first and the last of the stream; "
            "thin the stream again."
        )
    if targets.speeds.min() < _SMALLEST_SPEED or targets.zones.min() < 0.0:
        raise InputError(
            f"targets need speeds of at least {_SMALLEST_SPEED} mm/s and zones of at least 0 mm, found "
            f"{targets.speeds.min():g} mm/s and {targets.zones.min():g} mm; thin the stream again."
        )


def _check_placement(joint_path: JointPath, placement: Placement) -> None:
    difference = float(np.abs(joint_path.T_base_work - placement.T_base_work).max())
    if difference > _SAME_PLACEMENT:
        raise InputError(
            f"the joint path was computed for another placement of the part (frames differ by {difference:.3g}); "
            "compute it again for this one.",
            difference=difference,
        )


def _name_shared_data(targets: Targets, *, cell: Cell) -> _SharedNames:
    speeds = values.rounded_down(np.append(targets.speeds, cell.process.travel_speed), digits=_SPEED_DIGITS)
    zones = np.where(targets.zones < _SMALLEST_ZONE, 0.0, values.rounded_down(targets.zones, digits=_ZONE_DIGITS))
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
    return _SharedNames(
        speeds=[speed_names[int(k)] for k in speed_of[:-1]],
        zones=[zone_names[int(k)] for k in zone_of[:-1]],
        home_speed=speed_names[int(speed_of[-1])],
        declarations=declarations,
    )


def _plain(value: float) -> str:
    """Return a number that has few significant digits without the zeros that carry nothing."""
    return values.number(value, decimals=5).rstrip("0").rstrip(".")


def _motion_lines(
    joint_path: JointPath, targets: Targets, *, deposits: _Deposits, names: _SharedNames
) -> list[tuple[int, list[str]]]:
    """Return run number and instructions of each run."""
    poses = joint_path.poses
    tips = np.round(poses.tips[targets.poses], values.POSITION_DECIMALS) + 0.0
    quaternions = np.round(_unit(poses.quaternions[targets.poses]), values.QUATERNION_DECIMALS) + 0.0
    position, turn = f"%.{values.POSITION_DECIMALS}f", f"%.{values.QUATERNION_DECIMALS}f"
    form = (
        f"    %s [[{','.join([position] * 3)}],[{','.join([turn] * 4)}],[%d,%d,%d,%d],{values.NO_AXES}]"
        ",%s,%s,tGeoNozzle\\WObj:=wGeoPart;"
    )
    rows = zip(
        tips.tolist(), quaternions.tolist(), joint_path.configuration[targets.poses].tolist(), names.speeds,
        names.zones, strict=True,
    )  # fmt: skip
    moves = [form % ("MoveL", *tip, *quaternion, *cf, speed, zone) for tip, quaternion, cf, speed, zone in rows]
    moves[0] = moves[0].replace("MoveL", "MoveJ", 1)
    runs = poses.runs[targets.poses]
    members = ((int(run), np.flatnonzero(runs == run).tolist()) for run in np.unique(runs))
    return [(run, _with_switching(moves, targets_of_run, deposits)) for run, targets_of_run in members]


def _with_switching(moves: list[str], members: list[int], deposits: _Deposits) -> list[str]:
    lines: list[str] = []
    for k in members:
        lines.append(moves[k])
        if deposits.starts[k]:
            lines.append("    GeoOn;")
        if deposits.ends[k]:
            lines.append("    GeoOff;")
    return lines


def _unit(quaternions: FloatArray) -> FloatArray:
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


def _procedures(runs: list[tuple[int, list[str]]]) -> list[tuple[str, list[str]]]:
    """Return name and lines of the procedures: one a run, several only where a run alone would overflow a module.

    A call costs the motion nothing: the controller looks ahead across it.
    """
    room = MODULE_LINES - 4  # MODULE, PROC, ENDPROC, ENDMODULE
    procedures: list[tuple[str, list[str]]] = []
    for run, lines in runs:
        for part, start in enumerate(range(0, len(lines), room)):
            name = f"GeoRun{run + 1}" if len(lines) <= room else f"GeoRun{run + 1}Part{part + 1}"
            procedures.append((name, [f"  PROC {name}()", *lines[start : start + room], "  ENDPROC"]))
    return procedures


def _path_modules(
    procedures: list[tuple[str, list[str]]], *, names: _SharedNames, header: list[str]
) -> list[tuple[str, str]]:
    """Return GeoPrint.mod with main and all runs, or with main alone behind as many GeoPath modules as are needed."""
    home = f"    MoveAbsJ jGeoHome,{names.home_speed},fine,tGeoNozzle;"
    settings = ["    GeoOff;", "    ConfJ\\On;", "    ConfL\\On;", "    SingArea\\Off;"]
    calls = [f"    {name};" for name, _ in procedures]
    main = [*header, "  PROC main()", *settings, home, *calls, "    GeoOff;", home, "  ENDPROC"]
    room = MODULE_LINES - 2  # MODULE, ENDMODULE
    if len(main) + sum(len(lines) for _, lines in procedures) <= room:
        runs = [line for _, lines in procedures for line in lines]
        return [("GeoPrint.mod", _module("GeoPrint", [*main, *runs]))]
    groups: list[list[str]] = [[]]
    for _, lines in procedures:
        if len(groups[-1]) + len(lines) > room:
            groups.append([])
        groups[-1] += lines
    paths = [(f"GeoPath{k + 1}.mod", _module(f"GeoPath{k + 1}", lines)) for k, lines in enumerate(groups)]
    return [*paths, ("GeoPrint.mod", _module("GeoPrint", main))]


def _module(name: str, lines: Sequence[str]) -> str:
    return "\n".join([f"MODULE {name}", *lines, "ENDMODULE", ""])
