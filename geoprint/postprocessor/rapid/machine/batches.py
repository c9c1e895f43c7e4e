"""Moves to constant targets that stand one behind the other, executed in one go as far as time goes.

Nothing happens between them but motion and the triggers that are defined for it and pulled along it, so that one
computation with arrays does what a step a line would do: lines of a run are hundreds, of a program a hundred thousand.
Each keeps its step, its line and its moment.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable
from typing import cast, final

import numpy as np

from geoprint.model import FloatArray, IntArray
from geoprint.postprocessor.rapid.language.syntax import Value
from geoprint.postprocessor.rapid.machine.moves import (
    ON_THE_SPOT,
    begins,
    check_axes,
    mode_number,
    pull,
    scale,
    target_frame,
    tool_frame,
)
from geoprint.postprocessor.rapid.machine.state import ROW, Leg, State, tip_of
from geoprint.postprocessor.rapid.machine.values import Fault, Orient, Pos, Pose, compose, fault, inverted

# Numbers of a robtarget.
_TARGET = 17
_UNIT_TOLERANCE = 1e-3
# For how many steps one go counts, besides its moves.
_WEIGHT = 100
Look = Callable[[State], Value]
# What a move pulls, and steps before it that define triggers.
_Switch = tuple[range, tuple[Look, ...]]


@final
class Batches:
    """The moves of one routine to constant targets; rows are filled while it is compiled, then they are sealed."""

    __slots__ = (
        "_angles", "_axes", "_between", "_busy", "_file", "_forms", "_keys", "_lengths", "_lines", "_looks", "_moved",
        "_numbers",
        "_of", "_places", "_pulled", "_same", "_steps", "_stops", "_switches", "_turns", "_units", "_work", "_written",
        "definitions",
    )  # fmt: skip

    def __init__(self, *, file: int) -> None:
        self._file = file
        self._numbers = array("d")
        self._lines, self._of, self._steps = array("i"), array("i"), array("i")
        # Steps that define triggers.
        self._between: set[int] = set()
        # What defines triggers, by its form.
        self.definitions: dict[object, Callable[[State], None]] = {}
        # What names stand for.
        self._looks: list[Look] = []
        self._keys: dict[str, int] = {}
        # What moves with the same names have in common: verb, speed, zone, pair of tool and work object, triggers.
        self._forms: list[tuple[int, int, int, int]] = []
        self._pulled: list[tuple[Look, ...]] = []
        self._same: dict[tuple[str, ...], int] = {}
        # Tools and work objects with their numbers.
        self._work: list[tuple[Look, Look, int, int]] = []

    def form(self, names: tuple[str, ...]) -> int | None:
        """Return the number of the form of moves with this verb and these names, or None where it is not known."""
        return self._same.get(names)

    def add_form(
        self, names: tuple[str, ...], verb: int, *, speed: tuple[str, Look], zone: tuple[str, Look],
        held: tuple[str, Look, int], work: tuple[str, Look, int], pulled: tuple[Look, ...],
    ) -> int:  # fmt: skip
        """Add a form of moves, with what gives the values of its names, and the numbers of tool and work object."""
        both = f"{held[0]} {work[0]}"
        if both not in self._keys:
            self._keys[both] = len(self._work)
            self._work.append((held[1], work[1], held[2], work[2]))
        self._same[names] = len(self._forms)
        self._forms.append((verb, self._look(*speed), self._look(*zone), self._keys[both]))
        self._pulled.append(pulled)
        return self._same[names]

    def extend(self, numbers: Iterable[float]) -> None:
        """Add the numbers of targets, to which the moves lead that are added."""
        self._numbers.extend(numbers)

    def add(self, step: int, line: int, form: int) -> None:
        """Add a move."""
        self._steps.append(step)
        self._lines.append(line)
        self._of.append(form)

    def define(self, step: int) -> None:
        """Note a step that defines a trigger and does nothing else, which may stand between moves."""
        self._between.add(step)

    def _look(self, name: str, look: Look) -> int:
        if name not in self._keys:
            self._keys[name] = len(self._looks)
            self._looks.append(look)
        return self._keys[name]

    def seal(self) -> None:
        """Compute what does not depend on the state: lengths, turns, and how far each goes on without a break."""
        if not self._lines:
            return
        numbers = np.array(self._numbers, dtype=np.float64).reshape(-1, _TARGET)
        # A num is single precision.
        single: FloatArray = numbers.astype(np.float32).astype(np.float64)
        self._numbers = array("d")
        self._places, self._written = single[:, :3].copy(), single[:, 3:7].copy()
        turns = self._written
        norms = np.linalg.norm(turns, axis=1, keepdims=True)
        self._units = np.abs(norms[:, 0] - 1.0) <= _UNIT_TOLERANCE
        self._turns: FloatArray = turns / np.where(norms > 0.0, norms, 1.0)
        # Configuration and external axes.
        self._axes: FloatArray = single[:, 7:17].copy()
        self._moved = np.append(np.flatnonzero(np.diff(self._axes[:, 4:], axis=0).any(axis=1)) + 1, len(single))
        self._lengths: FloatArray = np.linalg.norm(np.diff(self._places, axis=0, prepend=np.nan), axis=1)
        products: FloatArray = np.einsum("ij,ij->i", self._turns[1:], self._turns[:-1])
        same: FloatArray = np.where(products < 0.0, -1.0, 1.0)[:, None] * self._turns[:-1]
        chords: FloatArray = np.minimum(np.linalg.norm(self._turns[1:] - same, axis=1) / 2.0, 1.0)
        # The chord is exact where the cosine is not, near 0.
        angles: FloatArray = 4.0 * np.arcsin(chords)
        self._angles: FloatArray = np.append(np.nan, angles)
        works = np.array(self._forms)[np.array(self._of), 3]
        breaks = [
            behind is None or not all(step in self._between for step in range(before + 1, behind))
            for before, behind in zip(self._steps, (*self._steps[1:], None), strict=True)
        ]
        ends = np.flatnonzero(breaks | np.append(np.diff(works) != 0, np.True_)) + 1
        self._stops: IntArray = ends[np.searchsorted(ends, np.arange(len(works)), side="right")]
        # Rows at which something is defined or pulled.
        self._switches: dict[int, _Switch] = {}
        for row, (step, form) in enumerate(zip(self._steps, self._of, strict=True)):
            first = self._steps[row - 1] + 1 if row and not breaks[row - 1] else step
            if first < step or self._pulled[form]:
                self._switches[row] = range(first, step), self._pulled[form]
        self._busy = np.array(list(self._switches), dtype=np.int64)

    def run(self, state: State) -> None:
        """Execute the moves from the present step on that are ordered before time is up."""
        frame = state.frames[-1]
        pc = frame.pc - 1
        first = int(np.searchsorted(self._steps, pc))
        rows = slice(first, int(self._stops[first]))
        if not self._units[first]:
            fault("ERR_ARGVALERR", f"the orientation {self._turns[first].tolist()} is not a unit quaternion")
        if not self._units[rows].all():
            # The step of the one that is none is executed by itself.
            rows = slice(first, first + int(np.argmin(self._units[rows])))
        check_axes(state.motion, tuple(self._axes[first, 4:].tolist()))
        # Where the external axes change the step is executed by itself.
        rows = slice(first, min(rows.stop, int(self._moved[np.searchsorted(self._moved, first, side="right")])))
        tool, work, tool_name, work_name = self._work[self._forms[self._of[first]][3]]
        held = tool_frame(state, tool(state))
        pose, number = target_frame(state, work(state))
        tip = tip_of(state.motion, state, held)
        block, entries = self._block(state, rows, tip=compose(inverted(pose), tip))
        count = 1 + int(np.searchsorted(entries[:-1], state.until, side="right"))
        count, failed = self._switch(state, first, count, block)
        if count:
            block = block[:count]
            block[:, 22:25] = tool_name, work_name, number
            block[:, 28] = mode_number(state)
            log, motion = state.log, state.motion
            log.close()
            log.closed.append(block)
            log.count += count
            legs = [self._leg(block, row, first, pose, tip) for row in range(max(count - 2, 0), count)]
            motion.legs = (*motion.legs, *legs)[-2:]
            motion.near = motion.joints if motion.joints is not None else motion.near
            motion.tip, motion.joints, motion.tool = compose(pose, self._target(first + count - 1)), None, held
            motion.end, motion.entry = float(block[-1, 26]), float(entries[count - 1])
            state.clock = motion.entry
        last = frame.pc if failed else self._steps[first + count - 1] + 1
        log = state.log
        log.seen[frame.routine.number][pc:last] = b"\x01" * (last - pc)
        frame.pc = last
        # Moves that were computed and not made count too.
        state.steps += sum(frame.routine.weights[pc + 1 : last]) + rows.stop - first - count + _WEIGHT
        if failed:
            raise failed

    def _switch(self, state: State, first: int, count: int, block: FloatArray) -> tuple[int, Fault | None]:
        """Define and pull the triggers of moves; return how many of them are made, and what ends them before."""
        frame, log = state.frames[-1], state.log
        steps = frame.routine.steps
        begins, ends = np.searchsorted(self._busy, (first, first + count))
        for row in self._busy[begins:ends].tolist():
            definitions, pulled = self._switches[row]
            at = row - first
            try:
                for step in definitions if at else ():
                    frame.pc = step + 1
                    steps[step](state)
                frame.pc = self._steps[row] + 1
                begin, end, length = block[at, 25:28].tolist()
                for trigger in pulled:
                    pull(state, trigger(state), move=log.count + at, begin=begin, end=end, length=length)
            except Fault as error:
                return at, error
        return count, None

    def _block(self, state: State, rows: slice, *, tip: Pose) -> tuple[FloatArray, FloatArray]:
        """Return the rows of the log of moves from where the tip is, and when the program may go on after each."""
        motion = state.motion
        lengths, angles = self._from(rows, tip)
        distinct: list[int] = sorted(set(self._of[rows]))
        forms: IntArray = np.searchsorted(distinct, self._of[rows])
        common = [self._forms[form] for form in distinct]
        known = {look: self._looks[look](state) for form in common for look in form[1:3]}
        of_form = np.array([(form[0], *_speeds(known[form[1]]), _radius(known[form[2]])) for form in common])
        verbs, speeds, turning, zones = of_form[forms].T
        if speeds.min() <= 0.0 or turning.min() <= 0.0:
            fault("ERR_SPEED_REFRESH_LIM", "the speed of a move is 0: the arm would never arrive")
        share = scale(state)
        durations = np.maximum(
            lengths / np.minimum(speeds * share, motion.modes.fastest), angles / (np.radians(turning) * share)
        )
        begin = begins(state)
        ends = begin + np.cumsum(durations)
        moving = lengths > ON_THE_SPOT
        rounded = np.where(moving, np.minimum(zones, lengths / 2.0) / np.where(moving, lengths, 1.0), 0.0) * durations
        block = np.empty((len(ends), ROW))
        block[:, 0], block[:, 1], block[:, 2] = self._file, self._lines[rows], verbs
        block[:, 3:6], block[:, 6:10], block[:, 10:20] = self._places[rows], self._written[rows], self._axes[rows]
        block[:, 20], block[:, 21], block[:, 25] = speeds, zones, np.append(begin, ends[:-1])
        block[:, 26], block[:, 27] = ends, lengths
        return block, ends - rounded

    def _target(self, row: int) -> Pose:
        place, turn = self._places[row].tolist(), self._turns[row].tolist()
        return cast("Pos", tuple(place)), cast("Orient", tuple(turn))

    def _leg(self, block: FloatArray, row: int, first: int, pose: Pose, tip: Pose) -> Leg:
        start = tip if row == 0 else compose(pose, self._target(first + row - 1))
        end = compose(pose, self._target(first + row))
        return Leg(float(block[row, 25]), float(block[row, 26]), (start, end), None)

    def _from(self, rows: slice, tip: tuple[Pos, Orient]) -> tuple[FloatArray, FloatArray]:
        """Return lengths and turns of moves, the first from where the tip is, in coordinates of the targets."""
        place, turn = tip
        lengths, angles = self._lengths[rows].copy(), self._angles[rows].copy()
        lengths[0] = np.linalg.norm(self._places[rows.start] - place)
        chord = min(
            float(np.linalg.norm(self._turns[rows.start] - turn)), float(np.linalg.norm(self._turns[rows.start] + turn))
        )
        angles[0] = 4.0 * np.arcsin(min(chord / 2.0, 1.0))
        return lengths, angles


def _speeds(speed: Value) -> tuple[float, float]:
    tip, turning, *_ = cast("tuple[float, float]", speed)
    return tip, turning


def _radius(zone: Value) -> float:
    stop, radius, *_ = cast("tuple[bool, float]", zone)
    return 0.0 if stop else radius
