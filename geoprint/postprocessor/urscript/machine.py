"""Executes URScript frame by frame: threads, moves, outputs and questions, as the URScript manual describes them.

The controller runs at 500 Hz: in each frame of 2 ms every thread that can go on does so, until it uses physical time by
a move, `sync` or `sleep` or waits for another thread; one that only computes ends in an error [URScript, Threads]. A
move with a blend lets its thread go on when the blend begins [URManual]. Outputs that a program has assigned a run
state go low when it ends, however it ends [URScript, Module ioconfiguration]. Nothing here is shared with what writes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias, cast, final

import numpy as np

from geoprint.errors import VerificationError
from geoprint.model import FloatArray, frozen
from geoprint.postprocessor.execution import refusal
from geoprint.postprocessor.urscript.language import (
    Call,
    Constant,
    Expression,
    Items,
    Name,
    Operation,
    Routine,
    Script,
    Statement,
)
from geoprint.postprocessor.urscript.motion import (
    NO_WAY,
    Arc,
    JointWay,
    Line,
    Pace,
    Piece,
    Rest,
    Start,
    pose_on,
    stopping,
    through,
    timed,
)
from geoprint.postprocessor.urscript.poses import (
    Pose,
    Turn,
    between,
    pose_inv,
    pose_of_matrix,
    pose_trans,
    position,
    product,
    turn,
    turned,
)

# The controller's period [s].
FRAME = 0.002
# A thread that has made so many statements in a frame only computes.
_MOST_STATEMENTS = 20000
# A program that lasts longer than this has no end [s].
_LONGEST = 48.0 * 3600.0
# How near an inverse solution comes [mm, and rad times 100 mm], and in how many steps.
_NEAR, _STEPS = 1e-9, 60
# Outputs by the names of the functions that set them.
_OUTPUTS = {
    "set_standard_digital_out": "standard",
    "set_configurable_digital_out": "configurable",
    "set_tool_digital_out": "tool",
}
_RUN_STATES = {
    "set_runstate_standard_digital_output_to_value": "standard",
    "set_runstate_configurable_digital_output_to_value": "configurable",
    "set_runstate_tool_digital_output_to_value": "tool",
}
# How many outputs there are of each kind.
_COUNTS = {"standard": 8, "configurable": 8, "tool": 2}
# Names of the arguments of functions of the manual, in their order, and how many a call must have.
_SIGNATURES: Mapping[str, tuple[int, tuple[str, ...]]] = {
    "movej": (1, ("q", "a", "v", "t", "r")),
    "movel": (1, ("pose", "a", "v", "t", "r")),
    "movep": (1, ("pose", "a", "v", "r")),
    "sleep": (1, ("t",)),
    "sync": (0, ()),
    "popup": (1, ("s", "title", "warning", "error", "blocking")),
    "textmsg": (1, ("s1", "s2")),
    "set_tcp": (1, ("pose", "tcp_name")),
    "set_target_payload": (2, ("m", "cog", "inertia", "transition_time")),
    "pose_trans": (2, ("p_from", "p_from_to")),
    "pose_inv": (1, ("p_from",)),
    "get_target_tcp_pose": (0, ()),
    "get_actual_joint_positions": (0, ()),
    "get_inverse_kin": (1, ("x", "qnear")),
    **dict.fromkeys(_OUTPUTS, (2, ("n", "b"))),
    **dict.fromkeys(_RUN_STATES, (2, ("outputId", "state"))),
}
_BLOCKING = frozenset({"movej", "movel", "movep", "sleep", "sync", "popup"})

Value: TypeAlias = "float | int | bool | str | list[Value] | Pose | Thread | None"
Locals: TypeAlias = dict[str, Value]
_Evaluated: TypeAlias = Callable[["Machine", Locals], Value]
# What a thread waits for: None for the next frame, else a question whether it may go on.
_Wait: TypeAlias = Callable[[], bool] | None
_Run: TypeAlias = Generator[_Wait, None, Value]


@final
@frozen
class Scenario:
    """How a program is run.

    Attributes:
        settings: values of global variables that the program sets first, as a person has changed them.
        held: global variables that keep a value whatever the program sets.
        joints: of the arm at the start [rad].
        goes_on: whether whoever is asked lets the program go on.
        stops_at: when somebody stops it [s]; infinite where nobody does.
        frame: period in which threads go on [s].
    """

    joints: tuple[float, ...]
    settings: tuple[tuple[str, float | int | bool], ...] = ()
    held: tuple[tuple[str, float | int | bool], ...] = ()
    goes_on: bool = True
    stops_at: float = math.inf
    frame: float = FRAME


@final
@dataclass(slots=True)
class Move:
    """A move that was made.

    Attributes:
        verb: name of its function.
        line: where it stands.
        target: pose of the tool in the base frame, of a move in joint space what follows from its joints.
        joints: of a move in joint space [rad]; none else.
        acceleration: that it names [m/s2, rad/s2].
        speed: likewise [m/s, rad/s].
        blend: its radius [m].
        seconds: that it is given; 0 where it goes by its speed [s].
        issued: when its statement is reached [s].
        step: value of the global variable geo_step then.
        begins: when it leaves the blend or place before [s].
        ends: when its blend begins, or the tool rests [s].
    """

    verb: str
    line: int
    target: Pose
    joints: tuple[float, ...]
    acceleration: float
    speed: float
    blend: float
    seconds: float
    issued: float
    step: Value = None
    begins: float = math.nan
    ends: float = math.inf


@final
@frozen
class Switch:
    """An output that was set, to another value or to the one that it has.

    Attributes:
        time: [s].
        output: kind and number, as "standard 0".
        on: its value.
        line: of the statement of the routine that a program or thread consists of, which led to it.
        thread: its name.
    """

    time: float
    output: str
    on: bool
    line: int
    thread: str


@final
@frozen
class Called:
    """A call of a function of the program: when, its name and arguments, line and thread of the call."""

    time: float
    name: str
    arguments: tuple[Value, ...]
    line: int
    thread: str


@final
@dataclass(slots=True)
class Log:
    """What a program did."""

    moves: list[Move] = field(default_factory=list[Move])
    pieces: list[Piece] = field(default_factory=list[Piece])
    switches: list[Switch] = field(default_factory=list[Switch])
    calls: list[Called] = field(default_factory=list[Called])
    asked: list[str] = field(default_factory=list[str])
    tools: list[tuple[float, Pose]] = field(default_factory=list[tuple[float, Pose]])
    loads: list[tuple[float, tuple[Value, ...]]] = field(default_factory=list[tuple[float, tuple[Value, ...]]])
    lines: set[int] = field(default_factory=set[int])
    rests: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    ended: str = ""
    time: float = 0.0
    lit: tuple[str, ...] = ()


@final
class Thread:
    """A thread: where it is, and what it waits for."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.stack: list[int] = []
        self.run: _Run | None = None
        self.waits: _Wait = None
        self.statements = 0

    def line(self) -> int:
        """Return the line that it is at."""
        return self.stack[-1] if self.stack else 1


class _HaltError(Exception):
    """The program ends here."""


class _ReturnError(Exception):
    """A function ends here; carries its value."""

    def __init__(self, value: Value) -> None:
        super().__init__()
        self.value = value


def execute(script: Script, scenario: Scenario, flange: Callable[[FloatArray], FloatArray]) -> Log:
    """Execute a program from its first statement to its end.

    Args:
        script: that was read.
        scenario: how it is run.
        flange: (k, 6) joints [rad] to (k, 4, 4) poses of the flange in the base frame [mm].

    Raises:
        VerificationError: it does what the controller refuses or this machine does not know; the line is named.
    """
    return Machine(script, scenario, flange).run()


@final
class Machine:
    """The controller: variables, threads, the motion and the outputs."""

    def __init__(self, script: Script, scenario: Scenario, flange: Callable[[FloatArray], FloatArray]) -> None:
        self.script, self.scenario, self.flange = script, scenario, flange
        self.routines = {each.name: each for each in script.routines}
        self.compiled: dict[str, list[_Step]] = {}
        self.variables: Locals = {}
        self.log = Log()
        self.outputs: dict[str, bool] = {}
        self.run_states: dict[str, int] = {}
        self.threads: list[Thread] = []
        self.thread = Thread(script.main.name)
        self.now = 0.0
        self.tcp = Pose((0.0,) * 6)
        self.joints: tuple[float, ...] | None = scenario.joints
        self.pose = self.forward(scenario.joints)
        # A line that ends where a blend begins, its target and the attitude that it comes from, until a move follows.
        self.pending: tuple[Piece, Line, Move, Turn, float] | None = None
        self.moving: Thread | None = None
        self.settings, self.held = dict(scenario.settings), dict(scenario.held)

    def run(self) -> Log:
        """Execute the program."""
        main = self.thread
        main.run = self._routine(self.script.main, main, {})
        self.threads.append(main)
        frame = 0
        try:
            while self.threads and self.threads[0] is main:
                self.now = frame * self.scenario.frame
                if self.now >= self.scenario.stops_at:
                    self.log.ended = "stopped"
                    break
                if self.now > _LONGEST:
                    raise self.refused("the program has no end")
                for thread in list(self.threads):
                    self._go_on(thread)
                frame += 1
            else:
                self.log.ended = "end"
        except _HaltError:
            self.log.ended = "halt"
        if self.pending is not None and self.log.ended == "end":
            raise self.refused("a blend has no move behind it", line=self.pending[2].line)
        self.log.time = self.now
        for output, state in self.run_states.items():
            if state in {1, 3} and self.outputs.get(output, False):
                self.outputs[output] = False
        self.log.lit = tuple(sorted(output for output, on in self.outputs.items() if on))
        return self.log

    def refused(self, reason: str, *, line: int | None = None) -> VerificationError:
        """Return the error that names the line that a thread is at."""
        return refusal(self.script.file, self.thread.line() if line is None else line, reason)

    def _go_on(self, thread: Thread) -> None:
        if thread.run is None or (thread.waits is not None and not thread.waits()):
            return
        self.thread, thread.statements = thread, 0
        try:
            thread.waits = next(thread.run)
        except StopIteration:
            thread.run = None
            self.threads.remove(thread)
        except _ReturnError:
            raise self.refused("a value is returned to nobody") from None
        except RecursionError:
            raise self.refused("functions call one another without end") from None

    # Routines and statements.

    def steps(self, routine: Routine) -> list[_Step]:
        """Return the statements of a routine, compiled once."""
        if routine.name not in self.compiled:
            self.compiled[routine.name] = [_compiled(each, self) for each in routine.body]
        return self.compiled[routine.name]

    def _routine(self, routine: Routine, thread: Thread, local: Locals) -> _Run:
        thread.stack.append(routine.line)
        if len(thread.stack) > 50:
            raise self.refused("functions call one another without end")
        try:
            yield from _block(self.steps(routine), self, thread, local)
        except _ReturnError as returned:
            return returned.value
        finally:
            thread.stack.pop()
        return None

    def start(self, name: str) -> Thread:
        """Start a thread."""
        routine = self.routines.get(name)
        if routine is None or not routine.is_thread:
            raise self.refused(f"there is no thread {name}")
        thread = Thread(name)
        thread.run = self._routine(routine, thread, {})
        self.threads.append(thread)
        return thread

    def called(self, call: _Called, local: Locals) -> _Run:
        """Call a function of the program, or one of the manual that takes time."""
        values = [each(self, local) for each in call.arguments]
        named = {name: each(self, local) for name, each in call.named}
        if call.name in _SIGNATURES:
            arguments = self.bound(call.name, values, named)
            return (yield from self._blocking(call.name, arguments))
        routine = self.routines.get(call.name)
        if routine is None or routine.is_thread:
            raise self.refused(f"there is no function {call.name}")
        if named or len(values) != len(routine.arguments):
            raise self.refused(f"{call.name} takes {len(routine.arguments)} arguments")
        thread = self.thread
        self.log.calls.append(Called(self.now, call.name, tuple(values), thread.line(), thread.name))
        return (yield from self._routine(routine, thread, dict(zip(routine.arguments, values, strict=True))))

    def bound(self, name: str, values: Sequence[Value], named: Mapping[str, Value]) -> dict[str, Value]:
        """Return the arguments of a function of the manual by their names."""
        least, names = _SIGNATURES[name]
        arguments = {**dict(zip(names, values, strict=False)), **named}
        if len(values) > len(names) or not set(named) <= set(names[len(values) :]) or len(arguments) < least:
            raise self.refused(f"{name} is called with other arguments than ({', '.join(names)})")
        return arguments

    # Functions of the manual that take time.

    def _blocking(self, name: str, arguments: dict[str, Value]) -> _Run:
        if name == "sync":
            yield None
        elif name == "sleep":
            until = self.now + self.number(arguments, "t", least=0.0)
            if self.thread.name == self.script.main.name:
                self.log.rests.append((self.now, until))
            yield lambda: self.now >= until - 1e-9
        elif name == "popup":
            self.log.asked.append(str(arguments["s"]))
            if arguments.get("blocking") is True:
                if not self.scenario.goes_on:
                    raise _HaltError
                yield None
        elif name == "movej":
            yield from self._move_joints(arguments)
        elif name in {"movel", "movep"}:
            yield from self._move_tool(name, arguments)
        else:
            return self.instant(name, arguments)
        return None

    def number(self, arguments: Mapping[str, Value], name: str, default: float = math.nan, *, least: float) -> float:
        """Return an argument that is a number, at least so large."""
        value = arguments.get(name, default)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not value >= least:
            raise self.refused(f"{name} must be a number of at least {least:g}")
        return float(value)

    def six(self, value: Value) -> tuple[float, ...]:
        """Return six numbers of a list."""
        if not isinstance(value, list) or len(value) != 6 or any(isinstance(each, bool) for each in value):
            raise self.refused("six joints must stand here")
        if not all(isinstance(each, (int, float)) for each in value):
            raise self.refused("six joints must stand here")
        return tuple(float(cast("float", each)) for each in value)

    def pose_in(self, value: Value) -> Pose:
        """Return a pose."""
        if not isinstance(value, Pose):
            raise self.refused("a pose p[x,y,z,rx,ry,rz] must stand here")
        return value

    def forward(self, joints: Sequence[float]) -> Pose:
        """Return the pose of the tool that joints have, with the tool that is set."""
        return pose_trans(pose_of_matrix(self.flange(np.array([joints]))[0]), self.tcp)

    def _begin(self, verb: str) -> None:
        if self.moving is not None and self.moving is not self.thread:
            raise self.refused(f"{verb} while another thread moves the arm")

    def _move_joints(self, arguments: dict[str, Value]) -> _Run:
        self._begin("movej")
        joints = self.six(arguments["q"])
        seconds = self.number(arguments, "t", 0.0, least=0.0)
        acceleration = self.number(arguments, "a", 1.4, least=1e-6)
        speed = self.number(arguments, "v", 1.05, least=1e-6)
        if self.number(arguments, "r", 0.0, least=0.0) > 0.0:
            raise self.refused("a blend in joint space is not of the subset")
        if self.pending is not None:
            raise self.refused("a blend leads into a move in joint space")
        took = seconds
        if took == 0.0:
            if self.joints is None:
                raise self.refused("a move in joint space from an unknown place needs a time")
            way = max(abs(a - b) for a, b in zip(joints, self.joints, strict=True))
            took = (
                way / speed + speed / acceleration
                if way * acceleration > speed**2
                else 2.0 * math.sqrt(way / acceleration)
            )
        move = Move(
            "movej", self.thread.line(), self.forward(joints), joints, acceleration, speed, 0.0, seconds, self.now
        )
        start = joints if self.joints is None else self.joints
        piece = timed(JointWay((np.array(start), np.array(joints))), len(self.log.moves), self.now, took)
        yield from self._made(move, [piece])
        self.joints, self.pose = joints, move.target

    def _move_tool(self, verb: str, arguments: dict[str, Value]) -> _Run:
        self._begin(verb)
        target = self.pose_in(arguments["pose"])
        acceleration = self.number(arguments, "a", 1.2, least=1e-6)
        speed = self.number(arguments, "v", 0.25, least=1e-9)
        blend = self.number(arguments, "r", 0.0, least=0.0)
        seconds = self.number(arguments, "t", 0.0, least=0.0)
        move = Move(verb, self.thread.line(), target, (), acceleration, speed, blend, seconds, self.now)
        pieces = self._timed(move) if seconds > 0.0 else self._straight(move)
        self.joints, self.pose = None, target
        yield from self._made(move, pieces)

    def _made(self, move: Move, pieces: list[Piece]) -> _Run:
        """Wait until a move is made."""
        move.begins, move.ends = pieces[0].begins, pieces[-1].ends
        move.step = self.variables.get("geo_step")
        self.log.moves.append(move)
        self.log.pieces += pieces
        self.moving = self.thread
        yield lambda: self.now >= move.ends - 1e-9
        self.moving = None

    def _timed(self, move: Move) -> list[Piece]:
        """Return a straight move, or a turn on the spot, in a given time."""
        if self.pending is not None or move.blend > 0.0:
            raise self.refused("a move in a given time has no blends")
        turns = turn(self.pose), turn(move.target)
        start, end = position(self.pose), position(move.target)
        way = Rest(start, turns) if math.dist(start, end) < NO_WAY else Line(start, end, turns)
        return [timed(way, len(self.log.moves), self.now, move.seconds)]

    def _straight(self, move: Move) -> list[Piece]:
        """Return the ways of a straight move: the blend that leads to it, and its line up to its own blend or rest."""
        number, before = len(self.log.moves), self.pending
        self.pending = None
        first, last = turn(self.pose), turn(move.target)
        start, end = position(self.pose), position(move.target)
        whole = math.dist(start, end)
        radius = before[2].blend if before is not None else 0.0
        if radius + move.blend > whole - NO_WAY and radius + move.blend > 0.0:
            raise self.refused(
                f"blends of {1e3 * radius:g} and {1e3 * move.blend:g} mm overlap on {1e3 * whole:.4f} mm"
            )
        if whole < NO_WAY and abs(product((first[0], -first[1], -first[2], -first[3]), last)[0]) < 1.0 - 1e-10:
            raise self.refused("the tool turns on the spot: that needs a time")
        pieces: list[Piece] = []
        path, pace = Line(start, end, (first, last)), Pace(move.speed, move.acceleration)
        begins = Start(self.now, 0.0)
        if before is not None:
            piece, line, _, came, share = before
            if self.now - piece.ends > self.scenario.frame:
                raise self.refused("the program takes time where a blend leads on")
            turns = between(came, first, share), between(first, last, radius / whole)
            arc = Arc(start, (line.along, path.along), radius, turns)
            pieces.append(through(arc, number, Start(piece.ends, piece.leaves), pace))
            begins = Start(pieces[-1].ends, pieces[-1].leaves)
        some = max(whole, NO_WAY)
        own = Line(
            path.place(radius), path.place(whole - move.blend),
            (between(first, last, radius / some), between(first, last, 1.0 - move.blend / some)),
        )  # fmt: skip
        if move.blend > 0.0:
            pieces.append(through(own, number, begins, pace))
            self.pending = pieces[-1], path, move, first, 1.0 - move.blend / whole
        else:
            pieces.append(stopping(own, number, begins, pace))
        return pieces

    # Functions of the manual that take none.

    def instant(self, name: str, arguments: dict[str, Value]) -> Value:
        """Return the value of a function that takes no time."""
        if name in _OUTPUTS:
            return self._set_output(name, arguments)
        if name in _RUN_STATES:
            output = self._output(_RUN_STATES[name], arguments["outputId"])
            state = arguments["state"]
            if isinstance(state, bool) or state not in range(8):
                raise self.refused("a run state is a number from 0 to 7")
            self.run_states[output] = cast("int", state)
            return None
        return _INSTANT[name](self, arguments)

    def _output(self, kind: str, number: Value) -> str:
        if isinstance(number, bool) or number not in range(_COUNTS[kind]):
            raise self.refused(f"there is no {kind} output {number!r}")
        return f"{kind} {number}"

    def _set_output(self, name: str, arguments: dict[str, Value]) -> None:
        output, on = self._output(_OUTPUTS[name], arguments["n"]), arguments["b"]
        if not isinstance(on, bool):
            raise self.refused("an output is set to True or False")
        thread = self.thread
        line = thread.line() if thread.name == self.script.main.name else thread.stack[0]
        self.log.switches.append(Switch(self.now, output, on, line, thread.name))
        self.outputs[output] = on

    def set_tcp(self, arguments: dict[str, Value]) -> None:
        """Set the tool."""
        if self.joints is None:
            raise self.refused("the tool is set on the path")
        self.tcp = self.pose_in(arguments["pose"])
        self.pose = self.forward(self.joints)
        self.log.tools.append((self.now, self.tcp))

    def target_pose(self, arguments: dict[str, Value]) -> Pose:
        """Return where the motion is in this frame."""
        del arguments
        if not self.log.pieces:
            return self.pose
        # The last piece that has begun.
        for piece in reversed(self.log.pieces):
            if piece.begins <= self.now:
                if isinstance(piece.way, JointWay):
                    return self.forward(piece.way.at(piece.share(self.now)).tolist())
                return pose_on(piece, self.now)
        return self.pose

    def inverse(self, arguments: dict[str, Value]) -> list[Value]:
        """Return the joints near given ones that have a pose, by Newton's method on the forward kinematics."""
        wanted = self.pose_in(arguments["x"])
        near = self.six(arguments.get("qnear", list(self.joints or ())))
        joints: FloatArray = np.array(near, dtype=np.float64)
        T = _matrix(pose_trans(wanted, pose_inv(self.tcp)))
        step = 1e-6 * np.eye(6)
        for _ in range(_STEPS):
            every = np.append(joints[None, :], joints + step, axis=0)
            errors: FloatArray = np.array([_twist(each, T) for each in self.flange(every)])
            if np.abs(errors[0]).max() < _NEAR:
                return [float(angle) for angle in joints]
            jacobian: FloatArray = 1e6 * (errors[1:] - errors[0]).T
            if np.linalg.matrix_rank(jacobian) < 6:
                break
            joints = np.subtract(joints, np.clip(np.linalg.solve(jacobian, errors[0]), -0.3, 0.3))
        raise self.refused("no joints near the given ones have this pose")


def _matrix(pose: Pose) -> FloatArray:
    """Return the (4, 4) transform of a pose in mm."""
    attitude = turn(pose)
    T = np.eye(4)
    T[:3, :3] = np.array([turned(attitude, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]).T
    T[:3, 3] = 1e3 * np.array(position(pose))
    return T


def _twist(found: FloatArray, wanted: FloatArray) -> list[float]:
    """Return by how much one pose is off another: mm, and rad times 100 mm."""
    R = found[:3, :3] @ wanted[:3, :3].T
    turns = 50.0 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return [*(found[:3, 3] - wanted[:3, 3]).tolist(), *turns.tolist()]


def _payload(machine: Machine, arguments: dict[str, Value]) -> None:
    machine.log.loads.append((machine.now, tuple(arguments.values())))


def _message(machine: Machine, arguments: dict[str, Value]) -> None:
    del machine, arguments


_INSTANT: Mapping[str, Callable[[Machine, dict[str, Value]], Value]] = {
    "set_tcp": Machine.set_tcp,
    "set_target_payload": _payload,
    "textmsg": _message,
    "pose_trans": lambda machine, each: pose_trans(machine.pose_in(each["p_from"]), machine.pose_in(each["p_from_to"])),
    "pose_inv": lambda machine, each: pose_inv(machine.pose_in(each["p_from"])),
    "get_target_tcp_pose": Machine.target_pose,
    "get_actual_joint_positions": lambda machine, _: _actual(machine),
    "get_inverse_kin": Machine.inverse,
}


def _actual(machine: Machine) -> list[Value]:
    if machine.joints is None:
        raise machine.refused("joints on the path are not of the subset")
    return cast("list[Value]", list(machine.joints))


# Statements and expressions, compiled to functions.


@final
@dataclass(frozen=True, slots=True)
class _Called:
    """A call, with its arguments compiled."""

    name: str
    arguments: tuple[_Evaluated, ...]
    named: tuple[tuple[str, _Evaluated], ...]


@final
@dataclass(frozen=True, slots=True)
class _Step:
    """A statement, compiled."""

    kind: str
    line: int
    scope: str
    name: str
    value: _Evaluated | None
    call: _Called | None
    body: list[_Step]
    otherwise: list[_Step]


def _compiled(statement: Statement, machine: Machine) -> _Step:
    value, call = statement.value, None
    if statement.kind == "call":
        assert isinstance(value, Call)  # noqa: S101
        call = _Called(
            value.name,
            tuple(_evaluated(each) for each in value.arguments),
            tuple((name, _evaluated(each)) for name, each in value.named),
        )
        if value.starts:
            raise refusal(machine.script.file, statement.line, "a thread is started that nobody can join")
    return _Step(
        statement.kind, statement.line, statement.scope, statement.name,
        None if value is None or call is not None else _evaluated(value), call,
        [_compiled(each, machine) for each in statement.body],
        [_compiled(each, machine) for each in statement.otherwise],
    )  # fmt: skip


def _block(steps: list[_Step], machine: Machine, thread: Thread, local: Locals) -> _Run:
    """Make statements one after another."""
    lines, stack = machine.log.lines, thread.stack
    for step in steps:
        stack[-1] = step.line
        lines.add(step.line)
        thread.statements += 1
        if thread.statements > _MOST_STATEMENTS:
            raise machine.refused("a thread computes without an end: it needs sync() or sleep()")
        kind = step.kind
        if kind == "set":
            assert step.value is not None  # noqa: S101
            _assign(machine, step, step.value(machine, local), local)
        elif kind == "call":
            assert step.call is not None  # noqa: S101
            name = step.call.name
            if name in _SIGNATURES and name not in _BLOCKING:
                values = [each(machine, local) for each in step.call.arguments]
                named = {key: each(machine, local) for key, each in step.call.named}
                machine.instant(name, machine.bound(name, values, named))
            else:
                yield from machine.called(step.call, local)
        else:
            yield from _controlled(step, machine, thread, local)


def _controlled(step: _Step, machine: Machine, thread: Thread, local: Locals) -> _Run:
    """Make a statement that decides what follows."""
    kind = step.kind
    if kind == "while":
        assert step.value is not None  # noqa: S101
        while _truth(machine, step.value(machine, local)):
            yield from _block(step.body, machine, thread, local)
            thread.stack[-1] = step.line
            thread.statements += 1
            if thread.statements > _MOST_STATEMENTS:
                raise machine.refused("a thread computes without an end: it needs sync() or sleep()")
    elif kind == "if":
        assert step.value is not None  # noqa: S101
        chosen = step.body if _truth(machine, step.value(machine, local)) else step.otherwise
        yield from _block(chosen, machine, thread, local)
    elif kind == "return":
        raise _ReturnError(None if step.value is None else step.value(machine, local))
    elif kind == "halt":
        raise _HaltError
    else:
        other = local.get(step.name, machine.variables.get(step.name))
        if not isinstance(other, Thread):
            raise machine.refused(f"{step.name} is no thread")
        if kind == "join":
            yield lambda: other.run is None
        elif other.run is not None:
            other.run = None
            machine.threads.remove(other)
    return None


def _truth(machine: Machine, value: Value) -> bool:
    if not isinstance(value, bool):
        raise machine.refused("a condition must be True or False")
    return value


def _assign(machine: Machine, step: _Step, value: Value, local: Locals) -> None:
    name = step.name
    if name in machine.routines or name in _SIGNATURES or name in {"True", "False"}:
        raise machine.refused(f"{name} is a function")
    if step.scope == "global":
        if name in machine.held:
            value = machine.held[name]
        elif name in machine.settings and name not in machine.variables:
            value = machine.settings[name]
        machine.variables[name] = value
    elif step.scope == "local" or name in local:
        local[name] = value
    else:
        raise machine.refused(f"{name} is neither global nor local here")


def _evaluated(expression: Expression) -> _Evaluated:
    """Return a function of machine and local variables that has the value of an expression."""
    if isinstance(expression, Constant):
        return _constant(expression.value)
    if isinstance(expression, Name):
        return _named(expression.name)
    if isinstance(expression, Items):
        return _items(expression)
    if isinstance(expression, Operation):
        return _operation(expression)
    return _call_value(expression)


def _constant(constant: Value) -> _Evaluated:
    def value(machine: Machine, local: Locals) -> Value:
        del machine, local
        return constant

    return value


def _named(name: str) -> _Evaluated:
    def value(machine: Machine, local: Locals) -> Value:
        if name in local:
            return local[name]
        if name not in machine.variables:
            raise machine.refused(f"{name} has no value here")
        return machine.variables[name]

    return value


def _items(expression: Items) -> _Evaluated:
    items = [_evaluated(each) for each in expression.items]
    if not expression.is_pose:
        return lambda machine, local: [each(machine, local) for each in items]
    if all(isinstance(each, Constant) for each in expression.items) and len(items) == 6:
        numbers = [cast("Constant", each).value for each in expression.items]
        if all(isinstance(each, (int, float)) and not isinstance(each, bool) for each in numbers):
            return _constant(Pose(float(cast("float", each)) for each in numbers))

    def value(machine: Machine, local: Locals) -> Value:
        found = [each(machine, local) for each in items]
        if len(found) != 6 or any(isinstance(each, bool) or not isinstance(each, (int, float)) for each in found):
            raise machine.refused("a pose has six numbers")
        return Pose(float(cast("float", each)) for each in found)

    return value


_NUMBERS: Mapping[str, Callable[[float, float], float | bool]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
}


def _operation(expression: Operation) -> _Evaluated:
    sign = expression.sign
    operands = [_evaluated(each) for each in expression.operands]
    first, last = operands[0], operands[-1]
    if sign == "-" and len(operands) == 1:
        return _arithmetic(lambda a, b: a - b, _constant(0), first)
    if sign in _NUMBERS:
        return _arithmetic(_NUMBERS[sign], first, last)
    others: Mapping[str, _Evaluated] = {
        "not": lambda machine, local: not _truth(machine, first(machine, local)),
        "and": lambda machine, local: _truth(machine, first(machine, local)) and _truth(machine, last(machine, local)),
        "or": lambda machine, local: _truth(machine, first(machine, local)) or _truth(machine, last(machine, local)),
        "==": lambda machine, local: first(machine, local) == last(machine, local),
        "!=": lambda machine, local: first(machine, local) != last(machine, local),
        "[": _item(first, last),
    }
    if sign not in others:
        return _unknown(sign)
    return others[sign]


def _unknown(sign: str) -> _Evaluated:
    def value(machine: Machine, local: Locals) -> Value:
        del local
        raise machine.refused(f"{sign} is not of the subset")

    return value


def _item(values: _Evaluated, place: _Evaluated) -> _Evaluated:
    def value(machine: Machine, local: Locals) -> Value:
        found, index = values(machine, local), place(machine, local)
        if not isinstance(found, (list, Pose)) or isinstance(index, bool) or index not in range(len(found)):
            raise machine.refused("there is no such item")
        return found[cast("int", index)]

    return value


def _arithmetic(operation: Callable[[float, float], float | bool], left: _Evaluated, right: _Evaluated) -> _Evaluated:
    def value(machine: Machine, local: Locals) -> Value:
        a, b = left(machine, local), right(machine, local)
        for each in (a, b):
            if isinstance(each, bool) or not isinstance(each, (int, float)):
                raise machine.refused("a number must stand here")
        try:
            return operation(cast("float", a), cast("float", b))
        except ZeroDivisionError:
            raise machine.refused("a division by 0") from None

    return value


def _call_value(expression: Call) -> _Evaluated:
    call = _Called(
        expression.name,
        tuple(_evaluated(each) for each in expression.arguments),
        tuple((name, _evaluated(each)) for name, each in expression.named),
    )
    if expression.starts:
        return lambda machine, _: machine.start(call.name)

    def value(machine: Machine, local: Locals) -> Value:
        if call.name in _BLOCKING:
            raise machine.refused(f"{call.name} has no value")
        if call.name in _SIGNATURES:
            values = [each(machine, local) for each in call.arguments]
            named = {name: each(machine, local) for name, each in call.named}
            return machine.instant(call.name, machine.bound(call.name, values, named))
        return _at_once(machine, machine.called(call, local))

    return value


def _at_once(machine: Machine, run: Iterator[_Wait]) -> Value:
    try:
        next(run)
    except StopIteration as ended:
        return cast("Value", ended.value)
    raise machine.refused("a function within an expression takes time")
