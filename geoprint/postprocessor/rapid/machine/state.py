"""The state of a running program, which can be copied at any moment, and where the arm is."""

from __future__ import annotations

import heapq
import math
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, TypeAlias, cast, final

import numpy as np

from geoprint import transforms
from geoprint.model import FloatArray
from geoprint.postprocessor.rapid.language.syntax import Value
from geoprint.postprocessor.rapid.machine.execution import START, Called, Ending, Modes, Scenario, Switching
from geoprint.postprocessor.rapid.machine.values import IDENTITY, Fault, Pose, between, compose, fault, inverted, stored
from geoprint.robot.arm import Arm

if TYPE_CHECKING:
    from geoprint.postprocessor.rapid.machine.task import MachineTask, RoutineCode


# The state of a running program, which can be copied at any moment: frames, data, outputs, motion, and its log.


# Numbers that are kept of a move; `moves` fills them and `log` takes them apart.
ROW = 29
PACKED_ROW = struct.Struct(f"{ROW}d")


@final
class Missing:
    """Stands for an optional argument that was left out, and for data of a module that is not loaded."""


MISSING = Missing()
Slot: TypeAlias = "Value | Missing | Reference | None"


@final
@dataclass(frozen=True, slots=True)
class Reference:
    """A datum that is handed over itself: where it is kept, and the path to the part of it that is meant.

    Attributes:
        frame: number of the frame from the bottom, or -1 for a module's datum.
        slot: its place there.
        path: numbers of components and elements, from outside inwards.
    """

    frame: int
    slot: int
    path: tuple[int, ...] = ()

    def get(self, state: State) -> Value:
        """Return its value.

        Raises:
            Fault: its module is not loaded.
        """
        value = (state.data if self.frame < 0 else state.frames[self.frame].data)[self.slot]
        if isinstance(value, Missing):
            fault("ERR_REFUNKDAT", "data is used whose module is not loaded")
        for part in self.path:
            value = cast("tuple[Value, ...]", value)[part]
        return cast("Value", value)

    def put(self, state: State, value: Slot) -> None:
        """Give it a value."""
        place = state.data if self.frame < 0 else state.frames[self.frame].data
        if self.path:
            state.steps += elements(place[self.slot]) // ELEMENTS
        place[self.slot] = replaced(place[self.slot], self.path, value) if self.path else value


# Elements of a value that are copied, rounded or compared in about the time of a step, or less.
ELEMENTS = 4


def elements(value: Slot) -> int:
    """Return how many elements an array has, each of which may have more than one number; of a record about as many."""
    count = 1
    while isinstance(value, tuple) and value:
        count *= len(value)
        value = value[0]
    return count


def kept(state: State, value: Value) -> Value:
    """Return a value as a controller holds it (`stored`), and count the steps that this takes of an array."""
    if type(value) is tuple:
        state.steps += elements(value) // ELEMENTS
    return stored(value)


def replaced(whole: Slot, path: tuple[int, ...], part: Slot) -> Slot:
    """Return a nested tuple with one part replaced."""
    if not path:
        return part
    parts = list(cast("tuple[Value, ...]", whole))
    parts[path[0]] = cast("Value", replaced(parts[path[0]], path[1:], part))
    return tuple(parts)


@final
class Frame:
    """A routine that is being executed."""

    __slots__ = ("data", "failed", "pc", "returned", "routine")

    def __init__(self, routine: RoutineCode, data: list[Slot], *, pc: int = 0, failed: int = -1) -> None:
        self.routine = routine
        self.data = data
        self.pc = pc
        # The step whose error is being handled, or -1.
        self.failed = failed
        self.returned: Value | None = None


@final
class Leg(NamedTuple):
    """One of the last moves: when, and between which tips in base coordinates, or which joints [rad]."""

    begin: float
    end: float
    tips: tuple[Pose, Pose] | None
    joints: tuple[tuple[float, ...], tuple[float, ...]] | None


@final
@dataclass(slots=True)
class Moving:
    """Where the arm is, and how it is commanded to move.

    Attributes:
        tip: pose of the tool at the end of the last move, in base coordinates, or None where only the joints are known.
        joints: at the end of the last move [rad], or None where only the tip is known; `near` are the last known ones.
        near: see above.
        tool: frame of the tool that the tip belongs to.
        end: when the last move ends [s].
        entry: when the zone of the last move is entered, or it ends [s]; the next move must be known then.
        displacement: of the program.
        legs: the last two moves.
        modes: what instructions have set for the moves to come.
        unit: the mechanical unit beside the arm that is active, in lower case; empty where none is.
        axes: of it, where the last move of the joints has brought them [degrees or mm].
    """

    tip: Pose | None
    joints: tuple[float, ...] | None
    near: tuple[float, ...]
    tool: Pose = IDENTITY
    end: float = 0.0
    entry: float = 0.0
    displacement: Pose = IDENTITY
    legs: tuple[Leg, ...] = ()
    modes: Modes = START
    unit: str = ""
    axes: tuple[float, ...] = ()

    def copy(self) -> Moving:
        """Return the same again."""
        return Moving(
            self.tip, self.joints, self.near, self.tool, self.end, self.entry, self.displacement, self.legs, self.modes,
            self.unit, self.axes,
        )  # fmt: skip


@final
class Log:
    """What happened so far. Rows of moves are kept in closed blocks, which copies share, and one that is open."""

    __slots__ = (
        "calls", "closed", "count", "frames", "missed", "modes", "open", "questions", "seen", "switchings", "texts",
    )  # fmt: skip

    def __init__(self) -> None:
        self.closed: list[FloatArray] = []
        self.open = bytearray()
        self.count = 0
        self.frames: dict[Pose, int] = {}
        self.modes: dict[Modes, int] = {}
        self.switchings: list[Switching] = []
        self.texts: list[tuple[float, str]] = []
        self.questions: list[str] = []
        self.calls: list[Called] = []
        self.missed: list[int] = []
        # One byte a step of each routine.
        self.seen: list[bytearray] = []

    def copy(self) -> Log:
        """Return the same again."""
        self.close()
        other = Log()
        other.closed, other.count, other.frames = list(self.closed), self.count, dict(self.frames)
        other.modes = dict(self.modes)
        other.switchings, other.texts = list(self.switchings), list(self.texts)
        other.questions, other.calls, other.missed = list(self.questions), list(self.calls), list(self.missed)
        other.seen = [bytearray(each) for each in self.seen]
        return other

    def close(self) -> None:
        """Close the open block."""
        if self.open:
            self.closed.append(np.frombuffer(self.open).reshape(-1, ROW))
            self.open = bytearray()

    def rows(self) -> FloatArray:
        """Return the rows of all moves, which nothing changes any more."""
        self.close()
        whole = np.concatenate(self.closed) if self.closed else np.empty((0, ROW))
        whole.setflags(write=False)
        # They need not be there twice.
        self.closed = [whole]
        return whole


@final
class State:
    """Everything that a continuation depends on."""

    __slots__ = (
        "answered", "arm", "base", "clock", "data", "ended", "error", "file", "frame", "frames", "line",
        "loaded",
        "loading", "local", "log", "mode", "motion", "order", "pending", "reason",
        "routines", "scenario", "signals", "steps", "task", "tool",
        "until", "watched",
    )  # fmt: skip

    def __init__(self, task: MachineTask, scenario: Scenario, arm: Arm) -> None:
        self.task = task
        self.scenario = scenario
        self.arm = arm
        self.data: list[Slot] = []
        self.frames: list[Frame] = []
        self.local: list[Slot] = []
        # Below this number of frames an execution that is nested in an expression or event does not go.
        self.base = 0
        self.clock = 0.0
        self.until = np.inf
        self.signals: dict[str, float] = {}
        # Outputs that are to switch as the arm moves: time, order, what.
        self.pending: list[tuple[float, int, Switching]] = []
        self.order = 0
        # The frame of targets that was used last: work object, displacement, pose in the base, number in the log.
        self.frame: tuple[object, Pose, Pose, int] | None = None
        # The tool that was used last, and its frame.
        self.tool: tuple[object, Pose] | None = None
        # The modal state that was asked for last, and its number in the log.
        self.mode: tuple[Modes, int] | None = None
        self.motion = Moving(None, scenario.joints, scenario.joints)
        self.log = Log()
        self.loaded: frozenset[str] = frozenset()
        # Routines that can be called by name in the loaded modules.
        self.routines: dict[str, RoutineCode] = {}
        # File and moment of what is being loaded, by the number of its session.
        self.loading: dict[float, tuple[str, float]] = {}
        self.answered = 0
        # The error that is being handled, or was last.
        self.error: Fault | None = None
        self.steps = 0
        self.ended: Ending = "runs"
        self.reason = ""
        self.file, self.line = "", 0
        self.watched = frozenset(name.lower() for name in scenario.watched)

    def copy(self) -> State:
        """Return the same again; neither changes with the other."""
        other = State(self.task, self.scenario, self.arm)
        other.data = list(self.data)
        for frame in self.frames:
            same = Frame(frame.routine, list(frame.data), pc=frame.pc, failed=frame.failed)
            same.returned = frame.returned
            other.frames.append(same)
        other.local = other.frames[-1].data if other.frames else []
        other.base, other.clock, other.until = self.base, self.clock, self.until
        other.signals, other.pending, other.order = dict(self.signals), list(self.pending), self.order
        other.motion, other.log = self.motion.copy(), self.log.copy()
        other.loaded, other.routines, other.loading = self.loaded, self.routines, dict(self.loading)
        other.answered, other.error, other.steps = self.answered, self.error, self.steps
        other.ended, other.reason, other.file, other.line = self.ended, self.reason, self.file, self.line
        return other

    def end(self, how: Ending, reason: str) -> None:
        """End the execution where it stands."""
        frame = self.frames[-1] if self.frames else None
        self.ended, self.reason = how, reason
        if frame is not None:
            self.file, self.line = frame.routine.file, frame.routine.line_of(max(frame.pc - 1, 0))

    def switch(self, switching: Switching) -> None:
        """Give an output a value now."""
        self.log.switchings.append(switching)
        if not switching.flow:
            self.signals[switching.signal] = switching.value

    def plan(self, switching: Switching) -> None:
        """Give an output a value when the arm will be there."""
        self.order += 1
        heapq.heappush(self.pending, (switching.time, self.order, switching))

    def fire(self, moment: float) -> None:
        """Switch all that is to switch up to a moment."""
        while self.pending and self.pending[0][0] <= moment:
            self.switch(heapq.heappop(self.pending)[2])


# Where the arm is at a moment: its joints and its tip, from the moves that were made.


def flange_matrix(tip: Pose, tool: Pose) -> FloatArray:
    """Return the (4, 4) pose of the flange where a tool's tip is [mm]."""
    place, turn = compose(tip, inverted(tool))
    return transforms.rigid(transforms.rotation_of(np.array([turn]))[0], np.array(place))


def poses_of_matrices(Ts: FloatArray) -> list[Pose]:
    """Return (k, 4, 4) transforms as poses."""
    rows = zip(Ts[:, :3, 3].tolist(), transforms.quaternion_of(Ts[:, :3, :3]).tolist(), strict=True)
    return [cast("Pose", (tuple(place), tuple(turn))) for place, turn in rows]


def tip_of(motion: Moving, state: State, tool: Pose) -> Pose:
    """Return the tip of a tool where the arm is at the end of its last move, in base coordinates."""
    if motion.tip is not None:
        return motion.tip if motion.tool == tool else compose(compose(motion.tip, inverted(motion.tool)), tool)
    joints = cast("tuple[float, ...]", motion.joints)
    return compose(poses_of_matrices(state.arm.flange_poses(np.array([joints])))[0], tool)


def joints_of(motion: Moving, state: State) -> tuple[float, ...]:
    """Return the joints at the end of the last move: the solution nearest to the last ones that were known [rad].

    Where the arm does not reach, the last known ones stand: whether it can follow the targets is judged elsewhere, from
    the arm's own side.
    """
    if motion.joints is not None:
        return motion.joints
    tip = cast("Pose", motion.tip)
    flange = flange_matrix(tip, motion.tool)
    found = state.arm.solutions((flange @ state.arm.T_flange_tool)[None])[0]
    found = found[~np.isnan(found).any(axis=1)]
    if not len(found):
        return motion.near
    near = np.array(motion.near)
    wound = found + 2.0 * math.pi * np.rint((near - found) / (2.0 * math.pi))
    best = wound[int(np.abs(wound - near).max(axis=1).argmin())]
    return tuple(best.tolist())


def stand_still(state: State) -> None:
    """Let the arm stand where it is at this moment: what it has not yet gone of its moves is forgotten."""
    state.motion = _at(state, min(state.until, state.motion.end))
    state.pending.clear()


def joints_now(state: State) -> tuple[float, ...]:
    """Return the joints at the present moment [rad]."""
    return joints_of(_at(state, state.clock), state)


def tip_now(state: State) -> Pose:
    """Return the tip of the tool that moved last at the present moment, in base coordinates."""
    motion = _at(state, state.clock)
    return tip_of(motion, state, motion.tool)


def _at(state: State, moment: float) -> Moving:
    """Return the motion as if it had ended at a moment; corners are taken as they are programmed."""
    motion = state.motion.copy()
    if moment >= motion.end:
        return motion
    motion.end = moment
    for leg in reversed(motion.legs):
        if leg.begin <= moment:
            share = min((moment - leg.begin) / max(leg.end - leg.begin, 1e-12), 1.0)
            if leg.joints is not None:
                start, end = leg.joints
                motion.joints = tuple(a + share * (b - a) for a, b in zip(start, end, strict=True))
                motion.tip = None
            elif leg.tips is not None:
                motion.tip, motion.joints = between(*leg.tips, share), None
            break
    return motion
