"""The state of the controller that executes URScript, and how it makes moves: timed, straight, with blends."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias, cast, final

import numpy as np

from geoprint.errors import VerificationError
from geoprint.model import FloatArray
from geoprint.postprocessor.execution import refusal
from geoprint.postprocessor.urscript.language import Script
from geoprint.postprocessor.urscript.log import (
    Locals,
    Log,
    Move,
    Run,
    Scenario,
    Thread,
    Value,
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
    stopping,
    through,
    timed,
)
from geoprint.postprocessor.urscript.poses import (
    Pose,
    Turn,
    between,
    pose_of_matrix,
    pose_trans,
    position,
    product,
    turn,
)

# What an expression is compiled to.
Evaluated: TypeAlias = Callable[["Machine", Locals], Value]


@final
@dataclass(frozen=True, slots=True)
class CompiledCall:
    """A call, with its arguments compiled."""

    name: str
    arguments: tuple[Evaluated, ...]
    named: tuple[tuple[str, Evaluated], ...]

    def values(self, machine: Machine, local: Locals) -> tuple[list[Value], dict[str, Value]]:
        """Return the values of the arguments without and with a name."""
        named = {name: each(machine, local) for name, each in self.named}
        return [each(machine, local) for each in self.arguments], named


@final
@dataclass(frozen=True, slots=True)
class Step:
    """A statement, compiled."""

    kind: str
    line: int
    scope: str
    name: str
    value: Evaluated | None
    call: CompiledCall | None
    body: list[Step]
    otherwise: list[Step]


@final
class Machine:
    """The state of the controller, and the motion: it makes moves, and converts the values that they are given."""

    def __init__(self, script: Script, scenario: Scenario, flange: Callable[[FloatArray], FloatArray]) -> None:
        self.script, self.scenario, self.flange = script, scenario, flange
        self.routines = {each.name: each for each in script.routines}
        self.compiled: dict[str, list[Step]] = {}
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

    def refused(self, reason: str, *, line: int | None = None) -> VerificationError:
        """Return the error that names the line that a thread is at."""
        return refusal(self.script.file, self.thread.line() if line is None else line, reason)

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

    def move_joints(self, arguments: dict[str, Value]) -> Run:
        """Move in joint space: URScript's movej."""
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

    def move_tool(self, verb: str, arguments: dict[str, Value]) -> Run:
        """Move the tool along a line: URScript's movel and movep."""
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

    def _made(self, move: Move, pieces: list[Piece]) -> Run:
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
