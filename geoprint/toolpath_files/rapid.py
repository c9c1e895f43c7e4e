"""Paths as RAPID modules: the program is executed as a controller would, and its targets are taken in the work object.

Deposited is where an output is on (SetDO, Set, TriggIO with TriggL and the like); of several outputs it must be named
which one deposits. Where no output is switched, MoveL and MoveC deposit, and MoveJ and MoveAbsJ travel.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TypeAlias, cast, final

import numpy as np

from geoprint.config import load_cell
from geoprint.errors import InputError, UsageError, VerificationError, how_many
from geoprint.model import FloatArray, IntArray, reading
from geoprint.postprocessor.rapid.language.parsing import parse_module, uncollected
from geoprint.postprocessor.rapid.language.symbols import resolve
from geoprint.postprocessor.rapid.language.syntax import Module
from geoprint.postprocessor.rapid.machine import VERBS, Execution, Moves, Scenario, compile_task, execute
from geoprint.robot.arm import Arm
from geoprint.toolpath_files.foreign_rapid import THROUGH, Notes, translated
from geoprint.toolpath_files.gcode_blocks import along_arc
from geoprint.toolpath_files.path_file import PathFile, Point, Recorder, lines_of, refuse

TITLE = "RAPID"
# Characters of all modules; they are parsed as a whole.
MOST_TEXT = 50_000_000
# Steps in which a program must come to its end, one to two microseconds each: so many, less what it takes to parse its
# letters, but never fewer than so many; and each that it is written with so often. Seconds would refuse on one machine
# what another one reads.
MOST_STEPS, LEAST_STEPS, STEPS_A_LETTER, MOST_TIMES = 3_000_000, 1_000_000, 2.0, 10
# Names of files that hold modules end so.
SUFFIXES = frozenset({".mod", ".modx", ".sys", ".sysx", ".prg"})
# What the machine, which is made for programs of geoprint, raises of a program that no controller would run either.
_FOREIGN = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)
_LOOKS = re.compile(r"^[ \t]*(?:%%%|MODULE[ \t]+\w)", re.IGNORECASE | re.MULTILINE)
_Target: TypeAlias = tuple[tuple[float, float, float], tuple[float, ...], tuple[float, ...], tuple[float, ...]]
_CURVED = [VERBS.index("MoveC"), VERBS.index("TriggC")]
_JOINT = VERBS.index("MoveAbsJ")
_STRAIGHT = [VERBS.index("MoveL"), VERBS.index("TriggL"), *_CURVED]
# How much of a move deposits.
_NONE, _SOME, _ALL = 0, 1, 2


def is_rapid(head: str) -> bool:
    """Return whether a text begins a module of RAPID."""
    return _LOOKS.search(head) is not None


def modules_in(folder: Path) -> list[Path]:
    """Return the files of a folder that hold modules; a folder of a backup has them in PROGMOD and SYSMOD."""
    places = [folder, *(each for each in sorted(folder.iterdir()) if each.name.upper() in {"PROGMOD", "SYSMOD"})]
    files = [file for place in places for file in sorted(place.iterdir()) if file.suffix.lower() in SUFFIXES]
    return [file for file in files if file.is_file()]


def read_rapid(path: Path, *, deposit: str | None) -> PathFile:
    """Read the runs that a program deposits.

    Args:
        path: of a module, or of a folder with the modules of one program.
        deposit: name of the output that deposits; None where there is but one, or none.

    Raises:
        UsageError: the named output is not switched, or none is named of several.
        InputError: a module cannot be read or executed; names its line.
    """
    files = modules_in(path) if path.is_dir() else [path]
    texts = {file.name: _text(file) for file in files}
    with uncollected():
        try:
            ran, notes = _ran(path.name, texts)
        except VerificationError as error:
            reason = str(error.details.get("reason") or error)
            refuse(str(error.details.get("module") or path.name), int(str(error.details.get("line") or 1)), reason)
        except InputError:
            raise
        except _FOREIGN as error:
            raise InputError(f"{path.name} cannot be executed ({error}); check its data and targets.") from error
        if ran.ended not in {"end", "exit"}:
            reason = f"the program does not run to its end: {ran.reason.rstrip('.')}"
            refuse(ran.file or path.name, max(ran.line, 1), reason)
        return _runs(path.name, ran, notes, deposit)


def _ran(name: str, texts: Mapping[str, str]) -> tuple[Execution, Notes]:
    """Parse the modules of a program, execute it, and return what happened and what was done to it before."""
    modules = [parse_module(file, text) for file, text in texts.items()]
    # What the controller brings by itself.
    modules = [module for module in modules if module.name.upper() != "BASE" or len(modules) == 1]
    modules, signals, notes = translated(modules)
    # What the machine executes must fit: every name means something, and arguments are of their kind.
    resolve(modules, signals=signals)
    letters = sum(map(len, texts.values()))
    most = max(MOST_STEPS - round(STEPS_A_LETTER * letters), LEAST_STEPS)
    return _executed(modules, signals, entry=_entry(name, modules), most=most), notes


def _executed(modules: Sequence[Module], signals: Mapping[str, str], *, entry: str, most: int) -> Execution:
    """Execute a program on the arm that comes with geoprint; where that stands does not count in the work object.

    Args:
        modules: of the program.
        signals: their kinds, by name.
        entry: where it begins.
        most: steps that it may make besides what its own are worth.
    """
    cell = load_cell(None)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    task = compile_task(modules, at_once=[module.file for module in modules], signals=signals, arm=arm)
    scenario = Scenario(
        joints=tuple(cell.robot.home.tolist()),
        # Whoever waits for an input gets it.
        signals={name: 1.0 for name, kind in signals.items() if kind == "signaldi"},
        entry=entry,
        watched=frozenset({THROUGH}),
        most_steps=most + MOST_TIMES * sum(len(each.steps) for each in task.routines),
    )
    # Numbers that are too large become infinite, which is refused where they are used.
    with np.errstate(all="ignore"):
        return execute(task, scenario)


def _text(file: Path) -> str:
    lines: list[str] = []
    length = 0
    for number, line in lines_of(file):
        length += len(line) + 1
        if length > MOST_TEXT:
            refuse(file.name, number, f"the module has more than {MOST_TEXT} letters; give the program of one part")
        lines.append(line)
    return "\n".join(lines)


def _entry(name: str, modules: Sequence[Module]) -> str:
    """Return the routine that the program begins with: main, or the only one that stands alone."""
    alone = [each.name for module in modules for each in module.routines if each.kind == "PROC" and not each.parameters]
    if "main" in {each.lower() for each in alone}:
        return "main"
    if len(alone) != 1:
        raise InputError(
            f"{name} has no procedure main and {how_many(len(alone), 'procedure')} without parameters, so its start "
            "is unknown. Add a main that calls what deposits."
        )
    return alone[0]


def _runs(name: str, ran: Execution, notes: Notes, deposit: str | None) -> PathFile:
    """Return what an execution deposits."""
    signal = _depositing(name, ran, notes, deposit)
    switched = _Switched(ran, signal)
    moves = ran.moves
    # The last place that was told before a move is its own.
    through = {call.moves: np.array(cast("_Target", call.arguments[0])[0]) for call in ran.calls}
    through = {row: place for row, place in through.items() if row < moves.count and moves.verbs[row] in _CURVED}
    recorder = Recorder(name)
    shares = _shares(moves, switched if signal is not None else None)
    lines, moves_within = moves.lines.tolist(), list(zip(moves.begins.tolist(), moves.ends.tolist(), strict=True))
    # Moves of one kind one behind the other: all of each deposits, none of it, or each is looked at by itself.
    bounds = [0, *(np.flatnonzero(np.diff(shares)) + 1).tolist(), moves.count] if moves.count else []
    for first, end in pairwise(bounds):
        if shares[first] == _NONE:
            recorder.count(lines[end - 1], int((moves.verbs[first:end] != _JOINT).sum()))
        elif shares[first] == _ALL:
            recorder.path(lines[end - 1], moves.places[first - 1 : end])
        else:
            for row in range(first, end):
                corners = along_arc(moves.places[row - 1], through.get(row), moves.places[row])
                on = [(0.0, 1.0)] if signal is None else switched.within(*moves_within[row])
                shares[row] = _SOME if on else _NONE
                _deposit(recorder, lines[row], corners, on)
    deposits = shares != _NONE
    bent = int((deposits & ~np.isin(moves.verbs, _STRAIGHT)).sum())
    frames = moves.frames[deposits]
    if (others := np.flatnonzero(frames != frames[:1])).size:
        line = int(moves.lines[deposits][others[0]])
        refuse(name, line, "it deposits in a second work object or displacement; give one part at a time")
    record = "MoveL and MoveC, while MoveJ travels" if signal is None else f"the output {signal}"
    others = {f"switchings of {each}": 0 for each in dict.fromkeys(each.signal for each in ran.switchings)}
    for each in ran.switchings:
        others[f"switchings of {each.signal}"] += 1
    used = {"moves": moves.count} | {kind: n for kind, n in others.items() if kind == f"switchings of {signal}"}
    skipped = dict(notes.skipped) | {kind: n for kind, n in others.items() if kind not in used}
    bends = [f"{bent} MoveJ that deposit lead straight"] if bent else []
    said = reading(used=used, skipped=skipped, assumed=[*notes.assumed, *bends])
    return recorder.file(title=TITLE, deposit=record, reading=said)


def _depositing(name: str, ran: Execution, notes: Notes, deposit: str | None) -> str | None:
    """Return the output that deposits, or None where none is switched at all."""
    switched = list(dict.fromkeys(each.signal for each in ran.switchings))
    if deposit is not None:
        if deposit.lower() not in switched:
            raise UsageError(
                f"`--deposit {deposit}`: {name} switches no such output, but {', '.join(switched) or 'none'}."
            )
        return deposit.lower()
    if len(process := [each for each in switched if each in notes.process]) == 1:
        return process[0]
    if len(switched) > 1:
        raise UsageError(
            f"{name} switches the outputs {', '.join(switched)}; say with `--deposit NAME` which of them deposits."
        )
    return switched[0] if switched else None


@final
class _Switched:
    """When an output is on."""

    def __init__(self, ran: Execution, signal: str | None) -> None:
        own = [each for each in ran.switchings if each.signal == signal]
        self._times, self._values = [each.time for each in own], [each.value for each in own]

    def shares(self, begins: FloatArray, ends: FloatArray) -> IntArray:
        """Return whether the output is on within all of each move, some of it (at most), or none."""
        last = np.searchsorted(self._times, begins, side="right")
        on = np.array([0.0, *self._values])[last] > 0.0
        changes = np.searchsorted(self._times, ends) > last
        return np.where(ends > begins, np.where(changes, _SOME, np.where(on, _ALL, _NONE)), _NONE)

    def within(self, begin: float, end: float) -> list[tuple[float, float]]:
        """Return the shares of a move between which the output is on."""
        if end <= begin:
            return []
        place = bisect_right(self._times, begin)
        value, since = self._values[place - 1] if place else 0.0, begin
        found: list[tuple[float, float]] = []
        for i in range(place, bisect_left(self._times, end)):
            moment, after = self._times[i], self._values[i]
            if value > 0.0 and moment > since:
                found.append(((since - begin) / (end - begin), (moment - begin) / (end - begin)))
            value, since = after, moment
        if value > 0.0:
            found.append(((since - begin) / (end - begin), 1.0))
        return found


def _shares(moves: Moves, switched: _Switched | None) -> IntArray:
    """Return of each move whether all, some (at most) or none of it deposits; straight ones without an output."""
    follows = moves.verbs != _JOINT
    # Where a move of the joints leads is not known in the work object.
    follows[1:] &= moves.verbs[:-1] != _JOINT
    follows[:1] = False
    if switched is None:
        shares = np.where(np.isin(moves.verbs, _STRAIGHT), _ALL, _NONE)
    else:
        shares = switched.shares(moves.begins, moves.ends)
    curved = (shares == _ALL) & np.isin(moves.verbs, _CURVED)
    return np.where(follows, np.where(curved, _SOME, shares), _NONE)


def _deposit(recorder: Recorder, line: int, corners: FloatArray, on: list[tuple[float, float]]) -> None:
    """Deposit along shares of a move."""
    if not on:
        recorder.count(line)
        return
    if on == [(0.0, 1.0)]:
        recorder.path(line, corners)
        return
    arcs = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    for first, last in on:
        low, high = first * arcs[-1], last * arcs[-1]
        stations = np.concatenate([[low], arcs[(arcs > low) & (arcs < high)], [high]])
        points = np.column_stack([np.interp(stations, arcs, corners[:, axis]) for axis in range(3)]).tolist()
        places: list[Point] = [(x, y, z) for x, y, z in points]
        for start, end in pairwise(places):
            recorder.line(line, start, end)
