"""Compares a RAPID program, read from its text and executed, with the orders that it should carry out.

The comment at the head of a module is held against the sentences that it must say.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import takewhile
from typing import cast

import numpy as np

from geoprint.errors import VerificationError
from geoprint.model import BoolArray, Cell, FloatArray, Placement, Program
from geoprint.postprocessor.execution import Settings, refusal
from geoprint.postprocessor.expected import expected_waits
from geoprint.postprocessor.orders import Event, Orders
from geoprint.postprocessor.rapid.configuration import configurations
from geoprint.postprocessor.rapid.executed import Proof, prove, verify_flow, verify_switching
from geoprint.postprocessor.rapid.guard import GUARD, check_guard, resident_module
from geoprint.postprocessor.rapid.language.parsing import parse_module, uncollected
from geoprint.postprocessor.rapid.language.symbols import examine
from geoprint.postprocessor.rapid.language.syntax import Module, Place, refuse
from geoprint.postprocessor.rapid.machine import INSTRUCTION_OF, VERBS, Modes
from geoprint.postprocessor.rapid.made import Made, make, printing, signals_of, task_of
from geoprint.postprocessor.rapid.reader import (
    UNIT_TOLERANCE,
    RapidText,
    check_form,
    check_routines,
    check_statements,
    read_modules,
    read_program_file,
    read_text,
)
from geoprint.postprocessor.rapid.settings import CELL_MODULE, STACK_MODULE, check_new, read_settings
from geoprint.postprocessor.rapid.verify_cell import verify_data, verify_header, verify_names
from geoprint.robot.arm import Arm

# Half of the fourth decimal on each axis is 0.00005 mm.
_POSITION_TOLERANCE = 1e-4
# Far above the rounding of eight decimals, far below anything a robot repeats [degree].
_TURN_TOLERANCE_DEG = 1e-3
# Speeds and zones are rounded down to five and two digits, never up; a zone below 1 um is a stop.
_SMALLEST_SPEED_SHARE = 0.9999
_SMALLEST_ZONE_SHARE = 0.9
_SMALLEST_ZONE = 0.001
# A num is single precision [mm/s, mm].
_NO_EXCESS = 1e-5
# The arm stands still between two moves of a run for no longer than it has to wait there, and this [s].
_STANDING = 1e-6
# A wait that is wanted is written to six digits.
_WAIT_SHARE = 1e-5
# The modal state that the guard sets; what it does not set is as at a start from main.
GUARDED = Modes(fastest=250.0)
# So much higher is the path driven dry [mm].
DRY_HEIGHT = 20.0
# Frames are written to four decimals of a millimetre, and are of single precision [mm, share].
_FRAME_PLACE, _FRAME_TURN = 1e-3, 1e-6
_LIST = "GeoPrint.pgf"
_ENTRY = Place("GeoPrint.mod", 1)
# What every program is held against, and what a controller has to keep for it.
_COMPARED = "Checked: the text matches the plan: targets, speeds, zones, outputs, frames."
_RESIDENT = "It needs GeoResident.sys, which shuts outputs off at stops: controller/first_load.md."
# How sentences of headers begin; each begins in a line of its own.
_BEGINS = (
    "Written by ", "Fixture ", "PLACEMENT ", "Not stated: ", "Surface ", "Part: ", "Cell: ", "Spacing: ", "Layer ",
    "Checked: ", "Not checked: ", "It needs ", "A person sets ",
)  # fmt: skip


def verify_program(
    program: Program,
    orders: Orders,
    *,
    cell: Cell,
    placement: Placement,
    surface_within: float | None,
    events: tuple[Event, ...],
) -> Proof:
    """Read the modules, execute them, and check that they do what the plan says, no more and no less.

    Args:
        program: the texts.
        orders: the targets.
        cell: tool, home and outputs.
        placement: where the part stands.
        surface_within: what its surface is known within [mm], which the header must say; None where nobody calibrated.
        events: where the outputs switch.

    Returns:
        What was executed.

    Raises:
        VerificationError: they disagree; module, line and reason are named.
    """
    findings, proof = judge_program(
        program.modules, orders, cell=cell, placement=placement, surface_within=surface_within, events=events
    )
    for finding in findings:
        raise finding
    check_new(_cell(program.modules))
    assert proof is not None  # noqa: S101  # Without a finding it ran.
    return proof


@uncollected()
def judge_program(
    modules: tuple[tuple[str, str], ...],
    orders: Orders,
    *,
    cell: Cell,
    placement: Placement,
    surface_within: float | None,
    events: tuple[Event, ...],
) -> tuple[tuple[VerificationError, ...], Proof | None]:
    """Return the findings of each kind, in the order in which they matter, and the executions; None if it does not run.

    It is executed dry, printing, and resumed, together with the resident module that its cell's controller keeps.
    Checked: that it is RAPID whose names and types all resolve; the guard, word for word; every target's position,
    attitude, zone and speed, its configuration, printed and lifted, that no move goes nowhere, and that the arm waits
    where the cell's signals need it and nowhere else; the tool, the work object, home and the times to and from it;
    that valve and lamp switch just where the plan has it, never in a dry run; the flow; that what is called is there.

    Args:
        modules: name and text of each file.
        orders: the targets.
        cell: tool, home and outputs.
        placement: where the part stands.
        surface_within: what its surface is known within [mm], which the header must say; None where nobody calibrated.
        events: where the outputs switch.
    """
    texts = dict(modules)
    loading = any(name.startswith("GeoPath") for name, _ in modules)
    listed = [*_failing(lambda: _verify_list(texts, loading=loading))]
    guard = [*_failing(lambda: check_guard(texts.get(GUARD, ""), cell=cell, placement=placement, loading=loading))]
    parsed, broken = _parsed_modules(modules)
    if broken:
        return (*listed, *guard, *broken), None
    task = [*parsed, parse_module(*resident_module(cell, placement))]
    _, unresolved = examine(task, signals=signals_of(cell))
    text, path = read_text(parsed), [module for module in parsed if module.file not in {GUARD, CELL_MODULE}]
    findings = [
        *listed,
        *unresolved,
        *guard,
        *(each for module in path for each in _routines(module)),
        *_failing(lambda: verify_header(text, placement=placement, surface_within=surface_within)),
        *_failing(lambda: verify_data(text, orders, cell=cell, placement=placement)),
    ]
    proofs: list[Proof] = []
    if not unresolved:
        findings += _failing(lambda: proofs.append(prove(task, orders, cell=cell, placement=placement, events=events)))
    for proof in proofs:
        findings += _motion_findings(proof, text, orders, cell=cell, placement=placement, events=events)
    findings += [each for module in path for each in _failing(lambda module=module: check_statements(module))]
    return tuple(findings), proofs[0] if proofs else None


def read_back(modules: tuple[tuple[str, str], ...], *, cell: Cell, placement: Placement) -> Made:
    """Return the path of a program that prints, executed.

    Args:
        modules: name and text of each file.
        cell: its outputs and arm.
        placement: whether it is known where the part stands.

    Raises:
        VerificationError: it is not RAPID, or does not run.
    """
    parsed = [_parsed(name, text) for name, text in modules if name != _LIST]
    parsed.append(parse_module(*resident_module(cell, placement)))
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    return make(task_of(parsed, cell=cell, arm=arm), printing(cell, placement=placement))


def program_settings(modules: tuple[tuple[str, str], ...], *, runs: int) -> Settings:
    """Return how a program is set.

    Args:
        modules: name and text of each file.
        runs: how many it has.

    Raises:
        VerificationError: GeoCell is not RAPID as geoprint writes it, or a switch stands at a value that the guard
            refuses.
    """
    return read_settings(_cell(modules), runs=runs)


def header_findings(files: Mapping[str, str], sentences: Sequence[str]) -> Iterator[VerificationError]:
    """Yield where a header of a program does not say what it must, or claims another check.

    Args:
        files: text of each file of the program.
        sentences: that it must say, besides what a controller has to keep for it.
    """
    wanted = [*sentences, _COMPARED, _RESIDENT]
    for name in sorted(files.keys() & {CELL_MODULE, "GeoPrint.mod"}):
        found = _header(files[name])
        for sentence in wanted:
            if not any(_says(each, sentence) for each in found):
                yield refusal(name, 2, f"the header must say {sentence[:100]!r}, as plan.json does")
        for each in found:
            judged = each.startswith(("Checked:", "Notchecked:"))
            if judged and not any(_says(each, sentence) for sentence in wanted):
                yield refusal(name, 2, f"the header says {each[:100]!r}, plan.json does not")


def joined_header_findings(files: Mapping[str, str], sentences: Sequence[str]) -> Iterator[VerificationError]:
    """Yield where the header of a program of several does not say what it must: as `header_findings`."""
    found = _header(files.get(STACK_MODULE, ""))
    for sentence in [*sentences, _RESIDENT]:
        if not any(_says(each, sentence) for each in found):
            yield refusal(STACK_MODULE, 2, f"the header must say {sentence!r}")


def _parsed_modules(modules: tuple[tuple[str, str], ...]) -> tuple[list[Module], list[VerificationError]]:
    """Return the modules that are RAPID as geoprint writes it, and what is wrong with the others."""
    parsed: list[Module] = []
    broken: list[VerificationError] = []
    for name, text in modules:
        if name != _LIST:
            broken += _failing(lambda name=name, text=text: parsed.append(_parsed(name, text)))
    return parsed, broken


def _parsed(name: str, text: str) -> Module:
    if name != GUARD:
        check_form(name, text)
    return parse_module(name, text)


def _routines(module: Module) -> Iterator[VerificationError]:
    yield from _failing(lambda: check_routines(module))


def _cell(modules: tuple[tuple[str, str], ...]) -> RapidText:
    return read_modules([(CELL_MODULE, dict(modules).get(CELL_MODULE, ""))])


def _motion_findings(
    proof: Proof,
    text: RapidText,
    orders: Orders,
    *,
    cell: Cell,
    placement: Placement,
    events: tuple[Event, ...],
) -> Iterator[VerificationError]:
    made = proof.printing
    yield from _failing(lambda: _verify_targets(made, proof.dry, orders, cell))
    yield from _failing(lambda: verify_names(text, made, cell=cell, placement=placement))
    for one, lifted in ((made, bool(placement.missing)), (proof.dry, True)):
        yield from _failing(lambda one=one: _verify_modes(one))
        yield from _failing(lambda one=one, lifted=lifted: _verify_frames(one, placement, lifted=lifted))
    if made.count == orders.count:
        yield from _failing(lambda: verify_switching(made, events, signals=cell.signals))
        yield from _failing(lambda: verify_flow(made, orders, signals=cell.signals))
        yield from _failing(lambda: _verify_going_on(made, expected_waits(orders, cell.signals)))
    yield from proof.wrong


def _verify_modes(made: Made) -> None:
    """Check that every move is made in the modal state that the guard sets, and in no other.

    The speed is scaled along the path only: around it moves are given their time, which has the scale in it.
    """
    moves, scale = made.execution.moves, float(cast("float", made.scenario.data["geoSpeedPct"]))
    on_path = np.zeros(moves.count, dtype=np.bool_)
    on_path[made.rows] = True
    for number, found in enumerate(moves.settings):
        for there, wanted in ((on_path, GUARDED._replace(override=scale)), (~on_path, GUARDED)):
            rows = np.flatnonzero((moves.modes == number) & there)
            for name, planned in wanted._asdict().items() if rows.size else ():
                if getattr(found, name) != planned:
                    place = Place(made.execution.files[int(moves.files[rows[0]])], int(moves.lines[rows[0]]))
                    what = f"{INSTRUCTION_OF[name]} has set {name.replace('_', ' ')} to {getattr(found, name)}"
                    refuse(place, f"the move is made otherwise than planned: {what}, the guard sets {planned}")


def _verify_frames(made: Made, placement: Placement, *, lifted: bool) -> None:
    """Check that every target is given in the frame of the part, or that frame higher by what a dry run keeps off."""
    moves, wanted = made.execution.moves, placement.T_base_work.copy()
    wanted[2, 3] += DRY_HEIGHT if lifted else 0.0
    most = np.full((4, 4), _FRAME_TURN)
    most[:3, 3] = _FRAME_PLACE
    wrong: BoolArray = np.logical_or.reduce((np.abs(moves.Ts_base_target - wanted) > most).reshape(-1, 16), axis=1)
    rows = np.flatnonzero(wrong[moves.frames[made.rows]])
    if rows.size:
        row = int(rows[0])
        place = moves.Ts_base_target[int(moves.frames[made.rows[row]])][:3, 3].round(4).tolist()
        refuse(
            made.place(row),
            f"target {row + 1}{' of the dry run' if lifted else ''} is given in a frame at {place}, planned is one at "
            f"{wanted[:3, 3].round(4).tolist()}. Restore work object and displacement",
        )


def _verify_going_on(made: Made, wanted: FloatArray) -> None:
    """Check that within each run the arm waits at each of t targets so long as is wanted (t,) [s]."""
    moves, rows = made.execution.moves, made.rows
    waits = moves.begins[rows[1:]] - moves.ends[rows[:-1]]
    off = np.where(np.diff(made.runs) != 0, 0.0, np.abs(waits - wanted[:-1]))
    if (off > _STANDING + _WAIT_SHARE * wanted[:-1]).any():
        target = int(off.argmax()) + 1
        refuse(
            made.place(target),
            f"target {target + 1}: the arm waits {waits[target - 1]:.3g} s before the move here, planned are "
            f"{wanted[target - 1]:.3g} s",
        )


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


def _verify_targets(made: Made, dry: Made, orders: Orders, cell: Cell) -> None:
    """Compare target by target, and report the first that differs."""
    count = min(made.count, dry.count, orders.count)
    findings = _findings(made, dry, orders, cell, count=count)
    firsts = [int(np.argmax(wrong)) if wrong.any() else count for wrong, *_ in findings]
    first = min(firsts)
    if first < count:
        _, words, found, planned = findings[firsts.index(first)]
        there, wanted = (each[first].round(6).tolist() for each in (found, planned))
        refuse(made.place(first), f"target {first + 1}: {words} {there}, the plan has {wanted}")
    _refuse_other_verbs(made)
    _refuse_standing(made)
    for driven, when in ((made.count, ""), (dry.count, " in the dry run")):
        if driven != orders.count:
            place = made.place(min(count, made.count - 1)) if made.count else _ENTRY
            refuse(place, f"there are {driven} targets{when}, the plan has {orders.count}")


def _refuse_other_verbs(made: Made) -> None:
    """Refuse a move to a target that is not a straight line."""
    verbs = made.execution.moves.verbs[made.rows]
    others = np.flatnonzero(~np.isin(verbs, [VERBS.index(verb) for verb in ("MoveL", "TriggL")]))
    if others.size:
        target = int(others[0])
        refuse(made.place(target), f"target {target + 1}: {VERBS[verbs[target]]} is not a straight move")


def _refuse_standing(made: Made) -> None:
    """Refuse a move that ends where it begins: a controller may stop there, and there is nothing to do between."""
    near = np.abs(np.diff(made.places, axis=0)).max(axis=1, initial=0.0) < _POSITION_TOLERANCE
    standing = np.flatnonzero(near & ~_turned(made.turns[1:], made.turns[:-1]))
    if standing.size:
        row = int(standing[0]) + 1
        refuse(made.place(row), f"target {row + 1}: the move has no length: the target before is the same")


def _findings(
    made: Made, dry: Made, orders: Orders, cell: Cell, *, count: int
) -> tuple[tuple[BoolArray, str, FloatArray, FloatArray], ...]:
    """Return (t,) where something differs, the words for it, and (t, ...) what was found and what was planned."""
    rows, moves = made.rows[:count], made.execution.moves
    places, turns, found = made.places[:count], made.turns[:count], made.configurations[:count]
    lifted = dry.configurations[:count]
    configuration, lifted_configuration = (each[:count].astype(np.float64) for each in configurations(orders, cell))
    speeds, zones, runs = moves.speeds[rows], moves.zones[rows], made.runs[:count].astype(np.float64)
    planned_runs = (orders.runs[:count] + 1).astype(np.float64)
    planned_speeds, planned_zones = orders.speeds[:count], orders.zones[:count]
    stops = planned_zones < _SMALLEST_ZONE
    zone_kept = (zones <= planned_zones + _NO_EXCESS) & (zones >= planned_zones * _SMALLEST_ZONE_SHARE)
    speed_kept = (speeds <= planned_speeds + _NO_EXCESS) & (speeds >= planned_speeds * _SMALLEST_SPEED_SHARE)
    tips, quaternions = orders.tips[:count], orders.quaternions[:count]
    return (
        (_any(np.abs(places - tips) > _POSITION_TOLERANCE), "the position is", places, tips),
        (_turned(turns, quaternions), "the quaternion is", turns, quaternions),
        (_any(found != configuration), "the configuration is", found, configuration),
        (_any(lifted != lifted_configuration), "the configuration of the dry run is", lifted, lifted_configuration),
        ((stops & (zones != 0.0)) | ~(stops | zone_kept), "the zone [mm] is", zones, planned_zones),
        (~speed_kept, "the speed [mm/s] is", speeds, planned_speeds),
        (runs != planned_runs, "the run is", runs, planned_runs),
    )


def _any(flags: BoolArray) -> BoolArray:
    """Return (t,) whether any of the (t, k) flags of each row is set."""
    return np.logical_or.reduce(flags, axis=1)


def _turned(found: FloatArray, planned: FloatArray) -> BoolArray:
    """Whether quaternions are no unit quaternions or differ in attitude; q and -q are the same."""
    lengths = np.linalg.norm(found, axis=1)
    nearest = np.minimum(np.linalg.norm(found - planned, axis=1), np.linalg.norm(found + planned, axis=1))
    angle_deg = np.degrees(4.0 * np.arcsin(np.minimum(nearest / 2.0, 1.0)))
    return (np.abs(lengths - 1.0) > 2.0 * UNIT_TOLERANCE) | (angle_deg > _TURN_TOLERANCE_DEG)


def _header(text: str) -> list[str]:
    """Return the sentences in the comment at the beginning of a module, without spaces: lines break anywhere."""
    lines = takewhile(lambda line: line.startswith("  ! "), text.split("\n")[1:])
    sentences: list[str] = []
    for line in lines:
        bare = line.removeprefix("  ! ")
        if not sentences or bare.startswith(_BEGINS) or bare[:1].isdigit():
            sentences.append("")
        sentences[-1] += "".join(bare.split())
    return sentences


def _says(found: str, wanted: str) -> bool:
    """Return whether a sentence of a header, without spaces, is one that it must have; a long one is cut."""
    plain = "".join("".join(letter if " " <= letter <= "~" else "?" for letter in wanted).split())
    return found == plain or (found.endswith("...") and plain.startswith(found.removesuffix("...")))
