"""Cuts the execution of a stack into its layers, and compares one with the execution of that layer's own program."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import final

import numpy as np

from geoprint.export.rapid.machine import Called, Execution, Moves, Switching
from geoprint.export.rapid.made import BEGIN
from geoprint.export.rapid.text import Place, refuse
from geoprint.model import FloatArray, IntArray, comparable

# Numbers of a move that are those of its text, so that nothing but equality will do; and what they are in words.
_WRITTEN = {
    "verbs": "instruction", "places": "position", "turns": "attitude", "configurations": "configuration",
    "other_axes": "external axis", "speeds": "speed", "zones": "zone",
}  # fmt: skip
# What the controller does at its events is no layer's: it comes before the first one, at the same moment.
_RESIDENT = ".sys"
# A move takes the same time in both, but for the rounding of the clock that counts on [s].
_TIME_TOLERANCE = 1e-6


@final
@comparable
class Part:
    """What was executed of one layer, from the call that begins it to the one that begins the next.

    Attributes:
        execution: that it is a part of.
        folder: of its modules; empty for a program by itself.
        first: its first move.
        count: how many moves it makes.
        begin: when it is begun [s].
        end: when the arm is home again [s].
        calls: of watched routines.
        switchings: with their moves counted from its first.
    """

    execution: Execution
    folder: str
    first: int
    count: int
    begin: float
    end: float
    calls: tuple[Called, ...]
    switchings: tuple[Switching, ...]

    @property
    def rows(self) -> IntArray:
        """Which moves of the execution are its own."""
        return np.arange(self.first, self.first + self.count)

    @property
    def runs(self) -> int:
        """How many runs it says that it has."""
        given = self.calls[0].arguments[0] if self.calls[0].arguments else None
        return int(given) if isinstance(given, float) else 0

    def place(self, row: int) -> Place:
        """Return where one of its moves stands."""
        moves = self.execution.moves
        if not self.count:
            return Place(self.calls[0].file, self.calls[0].line)
        at = self.first + min(row, self.count - 1)
        return Place(self.execution.files[int(moves.files[at])], int(moves.lines[at]))


def parts_of(execution: Execution) -> list[Part]:
    """Return the layers of an execution, in the order in which they were begun."""
    begun = [call for call in execution.calls if call.routine == BEGIN]
    edges = [*((call.moves, call.time) for call in begun), (execution.moves.count, np.inf)]
    parts: list[Part] = []
    for call, (first, begin), (last, behind) in zip(begun, edges, edges[1:], strict=False):
        switchings = tuple(
            replace(each, move=each.move - first if each.move >= 0 else -1)
            for each in execution.switchings
            if begin <= each.time < behind and not each.file.endswith(_RESIDENT)
        )
        ends = execution.moves.ends[first:last]
        parts.append(
            Part(
                execution, folder=call.file.rpartition("/")[0], first=first, count=last - first, begin=begin,
                end=float(ends[-1]) if ends.size else begin,
                calls=tuple(each for each in execution.calls if begin <= each.time < behind), switchings=switchings,
            )
        )  # fmt: skip
    return parts


def state_of(switchings: Iterable[Switching], moment: float) -> dict[str, float]:
    """Return the value of each output at a moment; what was never switched is left out."""
    return {each.signal: each.value for each in switchings if each.time <= moment and not each.flow}


def compare_part(part: Part, own: Part, *, course: str) -> None:
    """Check that a layer of a stack moves and switches as its own program does, number by number.

    Args:
        part: of the stack's execution.
        own: of the execution of its own program, run likewise.
        course: how the stack is run, for the message.

    Raises:
        VerificationError: it does not; the first line that differs is named.
    """
    said = f"{course}: {part.folder}"
    if part.count != own.count:
        refuse(part.place(own.count), f"{said} makes {part.count} moves, its own program {own.count}")
    for name, words in _WRITTEN.items():
        _same(part, _column(part, name), _column(own, name), f"{said}: the {words}")
    _same_names(part, own, said)
    along = np.intersect1d(part.execution.moves.along_path, part.rows)
    alike = np.intersect1d(own.execution.moves.along_path, own.rows)
    frames = [_frames(each.execution.moves, rows) for each, rows in ((part, along), (own, alike))]
    _same(part, frames[0], frames[1], f"{said}: the frame", rows=along - part.first)
    times = [_durations(each.execution.moves, rows) for each, rows in ((part, along), (own, alike))]
    slow = np.flatnonzero(np.abs(times[0] - times[1]) > _TIME_TOLERANCE)
    if slow.size:
        row = int(along[slow[0]]) - part.first
        refuse(part.place(row), f"{said}: a move takes another time than in its own program")
    _same_calls(part, own, said)
    _same_switchings(part, own, said)


def _column(part: Part, name: str) -> FloatArray:
    """Return (n, ...) what moves of a part have of one kind, as numbers."""
    return getattr(part.execution.moves, name)[part.rows].astype(np.float64)


def _same(part: Part, found: FloatArray, wanted: FloatArray, what: str, *, rows: IntArray | None = None) -> None:
    differs = np.flatnonzero((found != wanted).reshape(len(found), -1).any(axis=1))
    if differs.size:
        row = int(differs[0])
        refuse(
            part.place(row if rows is None else int(rows[row])),
            f"{what} is {found[row].tolist()}, its own program has {wanted[row].tolist()}",
        )


def _same_names(part: Part, own: Part, said: str) -> None:
    """Check the tools and work objects, whose numbers are each execution's own."""
    found, wanted = (_named(each) for each in (part, own))
    for row, (one, other) in enumerate(zip(found, wanted, strict=True)):
        if one != other:
            words, own_words = (" in ".join(each) for each in (one, other))
            refuse(part.place(row), f"{said}: the move is made with {words}, in its own program with {own_words}")


def _named(part: Part) -> list[tuple[str, str]]:
    moves, rows = part.execution.moves, part.rows
    names = moves.names
    return [(names[tool], names[work]) for tool, work in zip(moves.tools[rows], moves.works[rows], strict=True)]


def _frames(moves: Moves, rows: IntArray) -> FloatArray:
    return moves.Ts_base_target[moves.frames[rows]]


def _durations(moves: Moves, rows: IntArray) -> FloatArray:
    return moves.ends[rows] - moves.begins[rows]


def _same_calls(part: Part, own: Part, said: str) -> None:
    found, wanted = ([(call.routine, call.arguments) for call in each.calls] for each in (part, own))
    if found != wanted:
        call = part.calls[min(_first_other(found, wanted), len(part.calls) - 1)]
        refuse(Place(call.file, call.line), f"{said}: its runs follow one another otherwise than in its own program")


def _same_switchings(part: Part, own: Part, said: str) -> None:
    """Check that all outputs are given the same values, in the same order, at the same places of the same moves."""
    found, wanted = (_bare(each.switchings) for each in (part, own))
    if found == wanted:
        return
    if not part.switchings:
        refuse(part.place(0), f"{said} switches nothing, its own program does")
    each = part.switchings[min(_first_other(found, wanted), len(part.switchings) - 1)]
    refuse(Place(each.file, each.line), f"{said}: {each.signal} switches here otherwise than in its own program")


def _first_other(found: Sequence[object], wanted: Sequence[object]) -> int:
    """Return the place of the first that differs, or where the shorter one ends."""
    pairs = enumerate(zip(found, wanted, strict=False))
    return next((k for k, (one, other) in pairs if one != other), min(len(found), len(wanted)))


def _bare(switchings: Sequence[Switching]) -> list[Switching]:
    """Return switchings without when they come and where they stand."""
    return [replace(each, time=0.0, file="", line=0) for each in switchings]
