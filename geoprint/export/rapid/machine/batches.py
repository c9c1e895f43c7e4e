"""Moves to constant targets that stand one behind the other, executed in one go as far as time goes.

Nothing happens between them but motion, so that one computation with arrays does what a step a line would do: lines of
a run are hundreds, of a program a hundred thousand. Each keeps its step, its line and its moment.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import cast, final

import numpy as np

from geoprint.export.rapid.language.syntax import Value
from geoprint.export.rapid.machine.arm_state import tip_of
from geoprint.export.rapid.machine.moves import NO_AXIS, ON_THE_SPOT, begins, scale, target_frame, tool_frame
from geoprint.export.rapid.machine.state import ROW, Leg, State
from geoprint.export.rapid.machine.values.faults import fault
from geoprint.export.rapid.machine.values.poses import Orient, Pos, Pose, compose, inverted
from geoprint.model import FloatArray, IntArray

# Numbers of a robtarget.
_TARGET = 17
_UNIT_TOLERANCE = 1e-3
Look = Callable[[State], Value]


@final
class Batches:
    """The moves of one routine to constant targets; rows are filled while it is compiled, then they are sealed."""

    __slots__ = (
        "_angles", "_axes", "_file", "_keys", "_lengths", "_lines", "_looks", "_numbers", "_places", "_rows", "_same",
        "_speeds", "_stops", "_table", "_tools", "_turns", "_units", "_verb", "_written", "_zones",
    )  # fmt: skip

    def __init__(self, *, file: int, verb: int) -> None:
        self._file, self._verb = file, verb
        self._numbers = array("d")
        self._lines, self._speeds, self._zones, self._tools = array("i"), array("i"), array("i"), array("i")
        # What names stand for: speeds, zones, and pairs of tool and work object with their numbers.
        self._looks: list[Look] = []
        self._keys: dict[str, int] = {}
        self._table: list[tuple[Look, Look, int, int]] = []
        # What a move with the same names has come to: speed, zone, and pair of tool and work object.
        self._same: dict[tuple[str, ...], tuple[int, int, int]] = {}
        # Row of each step, by its number.
        self._rows: dict[int, int] = {}

    def add(
        self, step: int, line: int, target: Value, *, speed: tuple[str, Look], zone: tuple[str, Look],
        held: tuple[str, Look, int], work: tuple[str, Look, int],
    ) -> None:  # fmt: skip
        """Add a move, the names in it with what gives their values, and the numbers of tool and work object."""
        self._rows[step] = len(self._lines)
        for part in cast("tuple[tuple[float, ...], ...]", target):
            self._numbers.extend(part)
        self._lines.append(line)
        self._speeds.append(self._look(speed[0], speed[1]))
        self._zones.append(self._look(zone[0], zone[1]))
        both = f"{held[0]} {work[0]}"
        if both not in self._keys:
            self._keys[both] = len(self._table)
            self._table.append((held[1], work[1], held[2], work[2]))
        self._tools.append(self._keys[both])
        self._same[speed[0], zone[0], held[0], work[0]] = self._speeds[-1], self._zones[-1], self._tools[-1]

    def again(self, step: int, line: int, target: Value, names: tuple[str, ...]) -> bool:
        """Add a move whose names (speed, zone, tool, work object) are those of one before; False if there is none."""
        same = self._same.get(names)
        if same is None:
            return False
        self._rows[step] = len(self._lines)
        for part in cast("tuple[tuple[float, ...], ...]", target):
            self._numbers.extend(part)
        self._lines.append(line)
        self._speeds.append(same[0])
        self._zones.append(same[1])
        self._tools.append(same[2])
        return True

    def _look(self, name: str, look: Look) -> int:
        if name not in self._keys:
            self._keys[name] = len(self._looks)
            self._looks.append(look)
        return self._keys[name]

    def seal(self) -> None:
        """Compute what does not depend on the state: lengths, turns, and how far each goes on without a break."""
        numbers = np.array(self._numbers, dtype=np.float64).reshape(-1, _TARGET)
        # A num is single precision.
        single: FloatArray = numbers.astype(np.float32).astype(np.float64)
        self._numbers = array("d")
        self._places, self._written = single[:, :3], single[:, 3:7]
        turns = self._written
        norms = np.linalg.norm(turns, axis=1, keepdims=True)
        self._units = np.abs(norms[:, 0] - 1.0) <= _UNIT_TOLERANCE
        self._turns: FloatArray = turns / np.where(norms > 0.0, norms, 1.0)
        self._axes: FloatArray = np.column_stack([single[:, 7:11], single[:, 11:].min(axis=1) < NO_AXIS])
        self._lengths: FloatArray = np.linalg.norm(np.diff(self._places, axis=0, prepend=np.nan), axis=1)
        products: FloatArray = np.einsum("ij,ij->i", self._turns[1:], self._turns[:-1])
        same: FloatArray = np.where(products < 0.0, -1.0, 1.0)[:, None] * self._turns[:-1]
        chords: FloatArray = np.minimum(np.linalg.norm(self._turns[1:] - same, axis=1) / 2.0, 1.0)
        # The chord is exact where the cosine is not, near 0.
        angles: FloatArray = 4.0 * np.arcsin(chords)
        self._angles: FloatArray = np.append(np.nan, angles)
        steps = np.fromiter(self._rows, dtype=np.int64, count=len(self._rows))
        tools = np.array(self._tools)
        last = np.append((np.diff(steps) != 1) | (np.diff(tools) != 0), np.True_)
        ends = np.flatnonzero(last) + 1
        self._stops: IntArray = ends[np.searchsorted(ends, np.arange(len(steps)), side="right")]

    def run(self, state: State) -> None:
        """Execute the moves from the present step on that are ordered before time is up."""
        frame = state.frames[-1]
        first = self._rows[frame.pc - 1]
        rows = slice(first, int(self._stops[first]))
        if not self._units[rows].all():
            row = first + int(np.argmin(self._units[rows]))
            frame.pc += row - first
            fault("ERR_ARGVALERR", f"the orientation {self._turns[row].tolist()} is no unit quaternion")
        tool, work, tool_name, work_name = self._table[self._tools[first]]
        held = tool_frame(tool(state))
        pose, number = target_frame(state, work(state))
        tip = tip_of(state.motion, state, held)
        block, entries = self._block(state, rows, tip=compose(inverted(pose), tip))
        count = 1 + int(np.searchsorted(entries[:-1], state.until, side="right"))
        block = block[:count]
        block[:, 17:20] = tool_name, work_name, number
        log, motion = state.log, state.motion
        log.close()
        log.closed.append(block)
        log.count += count
        legs = [self._leg(block, row, first, pose, tip) for row in range(max(count - 2, 0), count)]
        motion.legs = (*motion.legs, *legs)[-2:]
        motion.near = motion.joints if motion.joints is not None else motion.near
        motion.tip, motion.joints, motion.tool = compose(pose, self._target(first + count - 1)), None, held
        motion.end, motion.entry = float(block[-1, 21]), float(entries[count - 1])
        state.clock = motion.entry
        pc = frame.pc - 1
        log.seen[frame.routine.number][pc : pc + count] = b"\x01" * count
        frame.pc = pc + count
        state.steps += count - 1

    def _block(self, state: State, rows: slice, *, tip: Pose) -> tuple[FloatArray, FloatArray]:
        """Return the rows of the log of moves from where the tip is, and when the program may go on after each."""
        motion = state.motion
        lengths, angles = self._from(rows, tip)
        wanted = {*self._speeds[rows], *self._zones[rows]}
        values = {k: self._looks[k](state) for k in wanted}
        speeds = np.array([cast("tuple[float, ...]", values[k])[:2] for k in self._speeds[rows]])
        zones = np.array([_radius(values[k]) for k in self._zones[rows]])
        if speeds.min() <= 0.0:
            fault("ERR_SPEED_REFRESH_LIM", "the speed of a move is 0, so that the arm would never arrive")
        share = scale(state)
        durations = np.maximum(
            lengths / np.minimum(speeds[:, 0] * share, motion.fastest), angles / (np.radians(speeds[:, 1]) * share)
        )
        begin = begins(state)
        ends = begin + np.cumsum(durations)
        moving = lengths > ON_THE_SPOT
        rounded = np.where(moving, np.minimum(zones, lengths / 2.0) / np.where(moving, lengths, 1.0), 0.0) * durations
        block = np.empty((len(ends), ROW))
        block[:, 0], block[:, 1], block[:, 2] = self._file, self._lines[rows], self._verb
        block[:, 3:6], block[:, 6:10], block[:, 10:15] = self._places[rows], self._written[rows], self._axes[rows]
        block[:, 15], block[:, 16], block[:, 20] = speeds[:, 0], zones, np.append(begin, ends[:-1])
        block[:, 21], block[:, 22] = ends, lengths
        return block, ends - rounded

    def _target(self, row: int) -> Pose:
        place, turn = self._places[row].tolist(), self._turns[row].tolist()
        return cast("Pos", tuple(place)), cast("Orient", tuple(turn))

    def _leg(self, block: FloatArray, row: int, first: int, pose: Pose, tip: Pose) -> Leg:
        start = tip if row == 0 else compose(pose, self._target(first + row - 1))
        end = compose(pose, self._target(first + row))
        return Leg(float(block[row, 20]), float(block[row, 21]), (start, end), None)

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


def _radius(zone: Value) -> float:
    stop, radius, *_ = cast("tuple[bool, float]", zone)
    return 0.0 if stop else radius
