"""Compares a RAPID program, read back from its text, with the orders that it should carry out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from geoprint.errors import VerificationError
from geoprint.export.orders import Orders
from geoprint.export.rapid.compare import UNIT_TOLERANCE, compare, declared
from geoprint.export.rapid.guard import GUARD, check_guard
from geoprint.export.rapid.names import check_names
from geoprint.export.rapid.reader import joined, read_module, read_modules, read_program_file
from geoprint.export.rapid.run import Step, run_program
from geoprint.export.rapid.settings import CELL_MODULE, Settings, check_new, read_settings
from geoprint.export.rapid.text import FlowAt, Place, RapidText, SwitchAt, Value, refuse
from geoprint.export.rapid.verify_cell import verify_data, verify_header, verify_names
from geoprint.export.switching import Event
from geoprint.model import BoolArray, Cell, FloatArray, Placement, Program, Signals

# Half of the fourth decimal on each axis is 0.00005 mm.
_POSITION_TOLERANCE = 1e-4
# Far above the rounding of eight decimals, far below anything a robot repeats [degree].
_TURN_TOLERANCE_DEG = 1e-3
# Speeds and zones are rounded down to four and two digits, never up; a zone below 1 um is a stop.
_SMALLEST_SPEED_SHARE = 0.999
_SMALLEST_ZONE_SHARE = 0.9
_SMALLEST_ZONE = 0.001
# Tables hold six decimals of speeds [mm/s] and zones [mm].
_NO_EXCESS = 1e-6
# Distance of a switching from where the plan has it [mm].
_PLACE_TOLERANCE = 2e-4
# A flow is written anew where it has changed by 1 % of what was written last, and to six digits.
_FLOW_SHARE = 0.0102
_NO_AXES = 9e9
_LIST = "GeoPrint.pgf"
# Modules that are there from the start; the others a program loads as it runs.
_RESIDENT = frozenset({CELL_MODULE, "GeoPrint.mod"})
_ENTRY = Place("GeoPrint.mod", 1)


def verify_program(
    program: Program,
    orders: Orders,
    *,
    cell: Cell,
    placement: Placement,
    surface_within: float | None,
    events: tuple[Event, ...],
) -> None:
    """Read the modules back and check that they say what the plan says, no more and no less.

    Args:
        program: the texts.
        orders: the targets.
        cell: tool, home and outputs.
        placement: where the part stands.
        surface_within: what its surface is known within [mm], which the header must say; None where nobody calibrated.
        events: where the outputs switch.

    Raises:
        VerificationError: they disagree; module, line and reason are named.
    """
    for finding in program_findings(
        program.modules, orders, cell=cell, placement=placement, surface_within=surface_within, events=events
    ):
        raise finding
    check_new(_cell(program.modules))


def program_findings(
    modules: tuple[tuple[str, str], ...],
    orders: Orders,
    *,
    cell: Cell,
    placement: Placement,
    surface_within: float | None,
    events: tuple[Event, ...],
) -> Iterator[VerificationError]:
    """Yield what is wrong with a program: the first finding of each kind, in the order in which they matter.

    Checked: that no name is declared twice in the task; the guard, word for word; every target's position, attitude,
    zone and speed, its configuration, printed and lifted, and that no move goes nowhere; the tool, the work object,
    home and the times to and from it; that valve and lamp switch exactly where the plan has it, always by
    `geoOn` or 0; the flow; that modules are there when they are called.

    Args:
        modules: name and text of each file.
        orders: the targets.
        cell: tool, home and outputs.
        placement: where the part stands.
        surface_within: what its surface is known within [mm], which the header must say; None where nobody calibrated.
        events: where the outputs switch.
    """
    texts = dict(modules)
    paths = tuple((name, text) for name, text in modules if name not in {GUARD, _LIST})
    loading = any(name.startswith("GeoPath") for name, _ in paths)
    yield from _failing(lambda: _verify_list(texts, loading=loading))
    yield from _failing(lambda: check_names(modules))
    yield from _failing(lambda: check_guard(texts.get(GUARD, ""), cell=cell, placement=placement, loading=loading))
    read: list[RapidText] = []
    for name, text in paths:
        yield from _failing(lambda name=name, text=text: read.append(read_module(name, text)))
    whole: list[RapidText] = []
    if len(read) == len(paths):
        yield from _failing(lambda: whole.append(joined(tuple(read))))
    for text in whole:
        yield from _failing(lambda text=text: verify_header(text, placement=placement, surface_within=surface_within))
        yield from _text_findings(text, orders, cell=cell, placement=placement, events=events)


def read_back(modules: tuple[tuple[str, str], ...]) -> tuple[Step, ...]:
    """Return the moves of a program with their triggers, in order.

    Args:
        modules: name and text of each file.

    Raises:
        VerificationError: it is not RAPID as the reader knows it, or does not run.
    """
    text = read_modules(tuple((name, text) for name, text in modules if name not in {GUARD, _LIST}))
    return run_program(text, entry=_ENTRY, resident=_RESIDENT)


def program_settings(modules: tuple[tuple[str, str], ...], *, runs: int) -> Settings:
    """Return how a program is set.

    Args:
        modules: name and text of each file.
        runs: how many it has.

    Raises:
        VerificationError: GeoCell is not RAPID as the reader knows it, or a switch stands at a value that the guard
            refuses.
    """
    return read_settings(_cell(modules), runs=runs)


def _cell(modules: tuple[tuple[str, str], ...]) -> RapidText:
    return read_module(CELL_MODULE, dict(modules).get(CELL_MODULE, ""))


def _text_findings(
    text: RapidText, orders: Orders, *, cell: Cell, placement: Placement, events: tuple[Event, ...]
) -> Iterator[VerificationError]:
    yield from _failing(lambda: verify_data(text, orders, cell=cell, placement=placement))
    ran: list[tuple[Step, ...]] = []
    yield from _failing(lambda: ran.append(run_program(text, entry=_ENTRY, resident=_RESIDENT)))
    for steps in ran:
        yield from _failing(lambda steps=steps: _verify_targets(steps, text, orders))
        yield from _failing(lambda steps=steps: verify_names(text, steps, cell=cell))
        if len(steps) == orders.count:
            yield from _failing(lambda steps=steps: _verify_switching(steps, events, signals=cell.signals))
            yield from _failing(lambda steps=steps: _verify_flow(steps, orders, signals=cell.signals))


def _failing(check: Callable[[], None]) -> Iterator[VerificationError]:
    """Yield what a check raises."""
    try:
        check()
    except VerificationError as error:
        yield error


def _verify_list(texts: dict[str, str], *, loading: bool) -> None:
    if _LIST not in texts:
        refuse(Place(_LIST, 1), "the list of modules is missing")
    listed = read_program_file(_LIST, texts[_LIST])
    wanted = tuple(name for name in texts if name != _LIST and not name.startswith("GeoPath"))
    if listed != wanted or listed != (CELL_MODULE, GUARD, "GeoPrint.mod"):
        refuse(Place(_LIST, 1), f"it must list GeoCell, GeoGuard and GeoPrint in this order, found {', '.join(listed)}")
    count = sum(name.startswith("GeoPath") for name in texts)
    missing = [k for k in range(1, count + 1) if f"GeoPath{k}.mod" not in texts]
    if loading and missing:
        refuse(Place(f"GeoPath{missing[0]}.mod", 1), "this module is missing")


@dataclass(frozen=True, slots=True)
class _Finding:
    """(t,) where something differs, and the words for it, filled with what was found and what was planned."""

    wrong: BoolArray
    words: str
    found: FloatArray
    planned: FloatArray


def _verify_targets(steps: tuple[Step, ...], text: RapidText, orders: Orders) -> None:
    """Compare target by target, and report the first that differs."""
    count = min(len(steps), orders.count)
    findings = _findings(steps[:count], text, orders)
    firsts = [int(np.argmax(finding.wrong)) if finding.wrong.any() else count for finding in findings]
    first = min(firsts)
    if first < count:
        finding = findings[firsts.index(first)]
        found, planned = finding.found[first].round(6).tolist(), finding.planned[first].round(6).tolist()
        refuse(steps[first].move.place, f"target {first + 1}: {finding.words} {found}, the plan has {planned}")
    _refuse_standing(steps)
    if len(steps) != orders.count:
        place = steps[min(count, len(steps) - 1)].move.place if steps else _ENTRY
        refuse(place, f"there are {len(steps)} targets, the plan has {orders.count}")


def _refuse_standing(steps: tuple[Step, ...]) -> None:
    """Refuse a move that ends where it begins: a controller may stop there, and there is nothing to do between."""
    data = np.array([step.move.target for step in steps], dtype=np.float64).reshape(-1, 17)
    near = np.abs(np.diff(data[:, :3], axis=0)).max(axis=1, initial=0.0) < _POSITION_TOLERANCE
    standing = np.flatnonzero(near & ~_turned(data[1:, 3:7], data[:-1, 3:7]))
    if standing.size:
        row = int(standing[0]) + 1
        refuse(steps[row].move.place, f"target {row + 1}: the move goes nowhere, the target before is the same")


def _findings(steps: tuple[Step, ...], text: RapidText, orders: Orders) -> tuple[_Finding, ...]:
    count = len(steps)
    data = np.array([step.move.target for step in steps], dtype=np.float64).reshape(-1, 17)
    tips, quaternions = orders.tips[:count], orders.quaternions[:count]
    aloft = np.array([step.move.aloft for step in steps], dtype=np.float64).reshape(-1, 4)
    configuration = orders.configuration[:count].astype(np.float64)
    aloft_configuration = orders.aloft_configuration[:count].astype(np.float64)
    speed_of = {step.move.speed: _speed(text, step) for step in _one_each(steps, lambda step: step.move.speed)}
    zone_of = {step.move.zone: _zone(text, step) for step in _one_each(steps, lambda step: step.move.zone)}
    speeds = np.array([speed_of[step.move.speed] for step in steps])
    zones = np.array([zone_of[step.move.zone] for step in steps])
    runs = np.array([step.run for step in steps], dtype=np.float64)
    planned_runs = (orders.runs[:count] + 1).astype(np.float64)
    planned_speeds, planned_zones = orders.speeds[:count], orders.zones[:count]
    stops = planned_zones < _SMALLEST_ZONE
    zone_kept = (zones <= planned_zones + _NO_EXCESS) & (zones >= planned_zones * _SMALLEST_ZONE_SHARE - _NO_EXCESS)
    speed_kept = (speeds <= planned_speeds + _NO_EXCESS) & (speeds >= planned_speeds * _SMALLEST_SPEED_SHARE)
    no_axes = np.full((count, 6), _NO_AXES)
    return (
        _Finding(_any(np.abs(data[:, :3] - tips) > _POSITION_TOLERANCE), "the position is", data[:, :3], tips),
        _Finding(_turned(data[:, 3:7], quaternions), "the quaternion is", data[:, 3:7], quaternions),
        _Finding(_any(data[:, 7:11] != configuration), "the configuration is", data[:, 7:11], configuration),
        _Finding(_any(aloft != aloft_configuration), "the configuration of the dry run is", aloft, aloft_configuration),
        _Finding(_any(data[:, 11:] != _NO_AXES), "external axes are", data[:, 11:], no_axes),
        _Finding((stops & (zones != 0.0)) | ~(stops | zone_kept), "the zone [mm] is", zones, planned_zones),
        _Finding(~speed_kept, "the speed [mm/s] is", speeds, planned_speeds),
        _Finding(runs != planned_runs, "the run is", runs, planned_runs),
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
    return (np.abs(lengths - 1.0) > UNIT_TOLERANCE) | (angle_deg > _TURN_TOLERANCE_DEG)


def _speed(text: RapidText, step: Step) -> float:
    datum = declared(text, step.move.speed, kind="speeddata", storage="CONST", place=step.move.place)
    speed = datum.value[0] if isinstance(datum.value, list) and datum.value else 0.0
    compare(datum.value, [speed, 500, 5000, 1000], tolerance=0.0, place=datum.place, what="speeddata")
    return float(speed) if isinstance(speed, float | int) else 0.0


def _zone(text: RapidText, step: Step) -> float:
    if step.move.zone == "fine":
        return 0.0
    datum = declared(text, step.move.zone, kind="zonedata", storage="CONST", place=step.move.place)
    size = datum.value[1] if isinstance(datum.value, list) and len(datum.value) > 1 else 0.0
    radius = float(size) if isinstance(size, float | int) else 0.0
    turn = 10.0 * radius
    expected: Value = [False, radius, radius, radius, turn, radius, turn]
    compare(datum.value, expected, tolerance=1e-9, place=datum.place, what="zonedata")
    return radius


def _verify_switching(steps: tuple[Step, ...], events: tuple[Event, ...], *, signals: Signals) -> None:
    """Check that each move switches the outputs that the plan switches there, and no others."""
    outputs = {"dispenser": signals.dispenser, "uv_lamp": signals.uv_lamp, "vacuum": signals.vacuum or ""}
    names = {output: name.lower() for output, name in outputs.items()}
    planned: dict[int, list[Event]] = {}
    for event in events:
        planned.setdefault(event.target, []).append(event)
    for index, step in enumerate(steps):
        found = [trigger for trigger in step.triggers if isinstance(trigger, SwitchAt)]
        wanted = planned.get(index, [])
        if len(found) != len(wanted):
            refuse(step.move.place, f"{len(found)} outputs switch in the move here, the plan switches {len(wanted)}")
        for trigger, event in zip(found, wanted, strict=True):
            said = (trigger.signal, trigger.on, trigger.from_start)
            if said != (names[event.output], event.on, event.from_start):
                refuse(trigger.place, f"{trigger.signal} switches here, the plan switches the {event.output} otherwise")
            if abs(trigger.distance - event.distance) > _PLACE_TOLERANCE:
                refuse(
                    trigger.place,
                    f"{trigger.signal} switches {trigger.distance:g} mm away, the plan has {event.distance:.4f} mm",
                )


def _verify_flow(steps: tuple[Step, ...], orders: Orders, *, signals: Signals) -> None:
    """Check that the output of the flow is what each stretch needs by 1 %, and 0 from the end of each deposit."""
    scale = signals.flow_per_mm3_s if signals.mode == "analog" else 0.0
    current = 0.0
    for index, step in enumerate(steps):
        ends = False
        for trigger in (trigger for trigger in step.triggers if isinstance(trigger, FlowAt)):
            if trigger.signal != (signals.flow or "").lower() or signals.mode != "analog":
                refuse(trigger.place, f"{trigger.signal} is no output for a flow that follows the speed")
            ends = trigger.scale == 0.0
            lags: Value = [signals.flow_lag, 0.0 if ends else signals.flow_lag]
            compare(
                [trigger.lag, trigger.dip_lag], lags, tolerance=1e-6, place=trigger.place, what="the lag of the flow"
            )
            if trigger.distance != 0.0 or trigger.from_start == ends:
                refuse(trigger.place, "a flow changes at the start of a move, and ends at the end of one")
            current = current if ends else trigger.scale
        laid = index > 0 and bool(orders.laid[index - 1])
        wanted = scale * float(orders.flow[index - 1]) if laid else 0.0
        if abs(current - wanted) > _FLOW_SHARE * wanted:
            refuse(step.move.place, f"the flow in the move here is {current:g} a mm/s, the plan has {wanted:g}")
        if laid and scale > 0.0 and ends == bool(orders.laid[index]):
            refuse(step.move.place, "the flow ends where the plan goes on, or goes on where the plan ends")
        current = 0.0 if ends else current
