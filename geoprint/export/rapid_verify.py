"""Compares a RAPID program, read back from its text, with the plan that it should carry out."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geoprint.export.rapid_reader import read_modules, read_program_file
from geoprint.export.rapid_run import Motion, Step, run_program
from geoprint.export.rapid_text import Declaration, Place, RapidText, Switch, Value, refuse
from geoprint.model import BoolArray, Cell, FloatArray, JointPath, Placement, Program, Signals, Targets

# Half of the fourth decimal on each axis is 0.00005 mm.
_POSITION_TOLERANCE = 1e-4
# Far above the rounding of eight decimals, far below anything a robot repeats [degree].
_TURN_TOLERANCE_DEG = 1e-3
# A frame's rotation has a lever arm of some 100 mm: 1e-7 there is 0.01 um.
_ROTATION_TOLERANCE = 1e-7
_ANGLE_TOLERANCE_DEG = 1e-5
_LOAD_TOLERANCE = 1e-4
_INERTIA_TOLERANCE = 1e-6
# Unit length of a quaternion of rounded components.
_UNIT_TOLERANCE = 1e-7
# Speeds and zones are rounded down to three and two digits, never up; a zone below 1 um is a stop.
_SMALLEST_SPEED_SHARE = 0.99
_SMALLEST_ZONE_SHARE = 0.9
_SMALLEST_ZONE = 0.001
_NO_EXCESS = 1.0 + 1e-9
_SETTINGS = frozenset({"ConfJ\\On;", "ConfL\\On;", "SingArea\\Off;"})
_NO_AXES = 9e9


def verify_program(
    program: Program, joint_path: JointPath, targets: Targets, *, cell: Cell, placement: Placement
) -> None:
    """Read the modules back and check that they say what the plan says, no more and no less.

    Checked: every target's position, attitude, configuration, zone and speed; the tool, the work object and home; that
    the outputs are on exactly on depositing stretches, switch only at rest, stay off in a dry run and, without a
    calibrated placement, in any run; that the list of modules is complete.

    Args:
        program: the texts.
        joint_path: the plan's poses and configurations.
        targets: the poses that are written.
        cell: tool, home and outputs.
        placement: where the part stands.

    Raises:
        VerificationError: they disagree; module, line and reason are named.
    """
    modules = program.modules[:-1]
    list_name, list_text = program.modules[-1]
    if read_program_file(list_name, list_text) != tuple(name for name, _ in modules):
        refuse(Place(list_name, 1), "it does not list the modules of this program in their order")
    text = read_modules(modules)
    entry = Place(modules[-1][0], 1)
    motion = run_program(text, entry=entry, deposit=True)
    _verify_rest(motion, text, entry=entry, cell=cell)
    _verify_targets(motion.steps[1:-1], text, joint_path=joint_path, targets=targets)
    _verify_frames(motion.steps, text, cell=cell, placement=placement)
    _verify_switches(text, signals=cell.signals, placement=placement)
    _verify_stretches(motion, joint_path=joint_path, targets=targets, signals=cell.signals, placement=placement)
    for step in run_program(text, entry=entry, deposit=False).steps:
        if step.on:
            refuse(step.move.place, f"{', '.join(sorted(step.on))} is on in a dry run")


def _verify_rest(motion: Motion, text: RapidText, *, entry: Place, cell: Cell) -> None:
    """Check what surrounds the targets: settings, and the moves from and to home."""
    if motion.settings != _SETTINGS:
        refuse(entry, f"main must set {' '.join(sorted(_SETTINGS))} before it moves")
    if len(motion.steps) < 2:
        refuse(entry, "main must begin and end with a move to home")
    for step in (motion.steps[0], motion.steps[-1]):
        move = step.move
        if move.verb != "MoveAbsJ" or not isinstance(move.target, str) or move.zone != "fine":
            refuse(move.place, "the program must begin and end with MoveAbsJ to home and a stop there")
        home = _declared(text, move.target, kind="jointtarget", place=move.place)
        expected: Value = [_literal(np.degrees(cell.robot.home)), _literal(np.full(6, _NO_AXES))]
        _compare(home.value, expected, tolerance=_ANGLE_TOLERANCE_DEG, place=home.place, what="home")
        found, planned = _speed(text, step), cell.process.travel_speed
        if not _SMALLEST_SPEED_SHARE * planned <= found <= planned * _NO_EXCESS:
            refuse(move.place, f"the speed is {found:g} mm/s, the plan has {planned:g}")


@dataclass(frozen=True, slots=True)
class _Finding:
    """(t,) where something differs, and the words for it, filled with what was found and what was planned."""

    wrong: BoolArray
    words: str
    found: FloatArray
    planned: FloatArray


def _verify_targets(steps: tuple[Step, ...], text: RapidText, *, joint_path: JointPath, targets: Targets) -> None:
    """Compare target by target, and report the first that differs."""
    for index, step in enumerate(steps):
        if step.move.verb != ("MoveL" if index else "MoveJ") or isinstance(step.move.target, str):
            refuse(step.move.place, f"{step.move.verb} is not how the plan moves here (MoveJ first, then MoveL)")
    count = min(len(steps), targets.poses.size)
    findings = _findings(steps[:count], text, joint_path=joint_path, targets=targets)
    firsts = [int(np.argmax(finding.wrong)) if finding.wrong.any() else count for finding in findings]
    first = min(firsts)
    if first < count:
        finding = findings[firsts.index(first)]
        found, planned = finding.found[first].round(6).tolist(), finding.planned[first].round(6).tolist()
        refuse(steps[first].move.place, f"target {first + 1}: {finding.words} {found}, the plan has {planned}")
    if len(steps) != targets.poses.size:
        place = steps[min(count, len(steps) - 1)].move.place if steps else Place("GeoPrint.mod", 1)
        refuse(place, f"there are {len(steps)} targets, the plan has {targets.poses.size}")


def _findings(
    steps: tuple[Step, ...], text: RapidText, *, joint_path: JointPath, targets: Targets
) -> tuple[_Finding, ...]:
    data = np.array([step.move.target for step in steps], dtype=np.float64).reshape(-1, 17)
    chosen = targets.poses[: len(steps)]
    tips, quaternions = joint_path.poses.tips[chosen], joint_path.poses.quaternions[chosen]
    configuration = joint_path.configuration[chosen].astype(np.float64)
    speed_of = {step.move.speed: _speed(text, step) for step in _one_each(steps, lambda step: step.move.speed)}
    zone_of = {step.move.zone: _zone(text, step) for step in _one_each(steps, lambda step: step.move.zone)}
    speeds = np.array([speed_of[step.move.speed] for step in steps])
    zones = np.array([zone_of[step.move.zone] for step in steps])
    planned_speeds, planned_zones = targets.speeds[: len(steps)], targets.zones[: len(steps)]
    stops = planned_zones < _SMALLEST_ZONE
    zone_kept = (zones <= planned_zones * _NO_EXCESS) & (zones >= planned_zones * _SMALLEST_ZONE_SHARE)
    speed_kept = (speeds <= planned_speeds * _NO_EXCESS) & (speeds >= planned_speeds * _SMALLEST_SPEED_SHARE)
    return (
        _Finding(_any(np.abs(data[:, :3] - tips) > _POSITION_TOLERANCE), "the position is", data[:, :3], tips),
        _Finding(_turned(data[:, 3:7], quaternions), "the quaternion is", data[:, 3:7], quaternions),
        _Finding(_any(data[:, 7:11] != configuration), "the configuration is", data[:, 7:11], configuration),
        _Finding(
            _any(data[:, 11:] != _NO_AXES),
            "external axes are",
            data[:, 11:],
            np.full((len(steps), 6), _NO_AXES),
        ),
        _Finding((stops & (zones != 0.0)) | ~(stops | zone_kept), "the zone [mm] is", zones, planned_zones),
        _Finding(~speed_kept, "the speed [mm/s] is", speeds, planned_speeds),
    )


def _any(flags: BoolArray) -> BoolArray:
    """Return (t,) whether any of the (t, k) flags of each row is set."""
    return np.logical_or.reduce(flags, axis=1)


def _one_each(steps: tuple[Step, ...], name: Callable[[Step], str]) -> list[Step]:
    """Return the first step of each name, so that what many moves share is looked up once."""
    return list({name(step): step for step in reversed(steps)}.values())


def _turned(found: FloatArray, planned: FloatArray) -> BoolArray:
    """Whether quaternions are no unit quaternions or differ in attitude; q and -q are the same."""
    lengths = np.linalg.norm(found, axis=1)
    nearest = np.minimum(np.linalg.norm(found - planned, axis=1), np.linalg.norm(found + planned, axis=1))
    angle_deg = np.degrees(4.0 * np.arcsin(np.minimum(nearest / 2.0, 1.0)))
    return (np.abs(lengths - 1.0) > _UNIT_TOLERANCE) | (angle_deg > _TURN_TOLERANCE_DEG)


def _speed(text: RapidText, step: Step) -> float:
    datum = _declared(text, step.move.speed, kind="speeddata", place=step.move.place)
    speed = datum.value[0] if isinstance(datum.value, list) and datum.value else 0.0
    _compare(datum.value, [speed, 500, 5000, 1000], tolerance=0.0, place=datum.place, what="speeddata")
    return float(speed) if isinstance(speed, float | int) else 0.0


def _zone(text: RapidText, step: Step) -> float:
    if step.move.zone == "fine":
        return 0.0
    datum = _declared(text, step.move.zone, kind="zonedata", place=step.move.place)
    size = datum.value[1] if isinstance(datum.value, list) and len(datum.value) > 1 else 0.0
    radius = float(size) if isinstance(size, float | int) else 0.0
    turn = 10.0 * radius
    expected: Value = [False, radius, radius, radius, turn, radius, turn]
    _compare(datum.value, expected, tolerance=1e-9, place=datum.place, what="zonedata")
    return radius


def _verify_frames(steps: tuple[Step, ...], text: RapidText, *, cell: Cell, placement: Placement) -> None:
    """Check the tool and the work object, and that every move uses them."""
    for step in _one_each(steps, lambda step: step.move.tool):
        _verify_tool(_declared(text, step.move.tool, kind="tooldata", place=step.move.place), cell=cell)
    for step in _one_each(steps[1:-1], lambda step: step.move.work):
        datum = _declared(text, step.move.work, kind="wobjdata", place=step.move.place)
        value = datum.value if isinstance(datum.value, list) else []
        _compare(value[:3], [False, True, ""], tolerance=0.0, place=datum.place, what="wobjdata")
        if len(value) != 5:
            refuse(datum.place, f"wobjdata has five parts, found {len(value)}")
        _compare_frame(value[3], placement.T_base_fixture, place=datum.place, what="uframe")
        _compare_frame(value[4], placement.T_fixture_work, place=datum.place, what="oframe")


def _verify_tool(datum: Declaration, *, cell: Cell) -> None:
    tool, value = cell.tool, datum.value
    load = value[2] if isinstance(value, list) and len(value) == 3 else None
    if not isinstance(value, list) or value[0] is not True or not isinstance(load, list) or len(load) != 6:
        refuse(datum.place, "tooldata is no tool held by the robot")
    _compare_frame(value[1], tool.T_flange_tool, place=datum.place, what="tool frame")
    _compare(load[0], tool.mass_kg, tolerance=_LOAD_TOLERANCE, place=datum.place, what="load")
    axes = np.eye(4)
    axes[:3, :3], axes[:3, 3] = tool.principal_axes, tool.cog
    _compare_frame(load[1:3], axes, place=datum.place, what="load")
    _compare(load[3:], _literal(tool.inertia_kg_m2), tolerance=_INERTIA_TOLERANCE, place=datum.place, what="inertia")


def _verify_switches(text: RapidText, *, signals: Signals, placement: Placement) -> None:
    """Check what may switch at all: the cell's outputs, guarded by geoDryRun, off only where nobody calibrated."""
    for statement in itertools.chain.from_iterable(text.procedures.values()):
        if not isinstance(statement, Switch):
            continue
        if statement.signal.lower() not in _outputs(signals):
            refuse(statement.place, f"{statement.signal} is no output of this cell")
        if statement.value and not placement.calibrated:
            refuse(statement.place, f"{statement.signal} is switched on although the placement is not calibrated")
    guard = text.declarations.get("geodryrun")
    if guard is None or guard.value is not True:
        refuse(guard.place if guard else Place("GeoCell.mod", 1), "geoDryRun must be declared TRUE")
    for module in () if placement.calibrated else ("GeoCell.mod", "GeoPrint.mod"):
        if not any("PLACEMENT NOT CALIBRATED" in line for line in text.comments.get(module, ())):
            refuse(Place(module, 2), "the header must say PLACEMENT NOT CALIBRATED")


def _verify_stretches(
    motion: Motion, *, joint_path: JointPath, targets: Targets, signals: Signals, placement: Placement
) -> None:
    """Check that both outputs are on on exactly the depositing stretches, and off before and after."""
    outputs = _outputs(signals)
    if motion.cleared != outputs:
        refuse(motion.steps[0].move.place, "all outputs must be switched off before the first move")
    deposit, runs = joint_path.poses.deposit[targets.poses], joint_path.poses.runs[targets.poses]
    laid = deposit[1:] & deposit[:-1] & (runs[1:] == runs[:-1]) & placement.calibrated
    for step, lays in zip(motion.steps, [False, False, *laid.tolist(), False], strict=True):
        if step.on != (outputs if lays else frozenset()):
            found = ", ".join(sorted(step.on)) or "no output"
            wanted = "deposits" if lays else "lays nothing"
            refuse(step.move.place, f"on the way here {found} is on, but the plan {wanted} on this stretch")
    if motion.left_on:
        refuse(motion.steps[-1].move.place, f"{', '.join(sorted(motion.left_on))} is on at the end")


def _outputs(signals: Signals) -> frozenset[str]:
    return frozenset({signals.dispenser.lower(), signals.uv_lamp.lower()})


def _declared(text: RapidText, name: str, *, kind: str, place: Place) -> Declaration:
    datum = text.declarations.get(name)
    if datum is None or datum.kind != kind:
        refuse(place, f"{name or 'nothing'} is named where a {kind} is needed, but none is declared so")
    if datum.storage != ("PERS" if kind in {"tooldata", "wobjdata"} else "CONST"):
        refuse(datum.place, f"a {kind} is not declared {datum.storage}")
    return datum


def _compare_frame(found: Value, planned: FloatArray, *, place: Place, what: str) -> None:
    """Compare a RAPID pose with a (4, 4) transform."""
    if not isinstance(found, list) or len(found) != 2:
        refuse(place, f"{what} is no pose")
    position, quaternion = found
    _compare(position, _literal(planned[:3, 3]), tolerance=_POSITION_TOLERANCE, place=place, what=f"{what} position")
    _compare(quaternion, _literal(np.zeros(4)), tolerance=1.0, place=place, what=f"{what} quaternion")
    w, x, y, z = np.array(quaternion, dtype=np.float64)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    unit = abs(w * w + x * x + y * y + z * z - 1.0) <= _UNIT_TOLERANCE
    if not unit or np.abs(rotation - planned[:3, :3]).max() > _ROTATION_TOLERANCE:
        refuse(place, f"{what} is turned by {quaternion}, which is not the plan's attitude")


def _literal(values: FloatArray) -> Value:
    return [float(value) for value in values]


def _compare(found: Value, planned: Value, *, tolerance: float, place: Place, what: str) -> None:
    """Compare nested literals: same form, same words, numbers within the tolerance."""
    if isinstance(planned, list):
        if not isinstance(found, list) or len(found) != len(planned):
            refuse(place, f"{what} is {found}, the plan has {planned}")
        for one, other in zip(found, planned, strict=True):
            _compare(one, other, tolerance=tolerance, place=place, what=what)
    elif isinstance(planned, bool | str) or isinstance(found, bool | str | list):
        if type(found) is not type(planned) or found != planned:
            refuse(place, f"{what} is {found}, the plan has {planned}")
    elif not abs(found - planned) <= tolerance:
        refuse(place, f"{what} is {found}, the plan has {planned}")
