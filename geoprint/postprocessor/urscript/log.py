"""What an execution is given and what it yields: the scenario, values of variables, threads, and the log.

The log says what a program made in one scenario: its moves, how long they are and last, and where the tip is when.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import TypeAlias, final

import numpy as np

from geoprint.model import FloatArray, comparable, frozen
from geoprint.postprocessor.urscript.motion import Arc, Line, Piece, Rest
from geoprint.postprocessor.urscript.poses import Pose, position

# The controller's period [s].
FRAME = 0.002

Value: TypeAlias = "float | int | bool | str | list[Value] | Pose | Thread | None"
Locals: TypeAlias = dict[str, Value]
# What a thread waits for: None for the next frame, else a question whether it may go on.
Wait: TypeAlias = Callable[[], bool] | None
Run: TypeAlias = Generator[Wait, None, Value]


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
        self.run: Run | None = None
        self.waits: Wait = None
        self.statements = 0

    def line(self) -> int:
        """Return the line that it is at."""
        return self.stack[-1] if self.stack else 1


class HaltError(Exception):
    """The program ends here."""


class ReturnError(Exception):
    """A function ends here; carries its value."""

    def __init__(self, value: Value) -> None:
        super().__init__()
        self.value = value


@final
@comparable
class Made:
    """A program that was executed in one scenario.

    Attributes:
        name: of the scenario, in words.
        log: what happened.
        path: the moves to the targets but the first.
        start: the move to the first.
    """

    name: str
    log: Log
    path: tuple[Move, ...]
    start: Move


def lengths(made: Made) -> tuple[FloatArray, FloatArray]:
    """Return (t - 1,) lengths of the blend that leads to each move, and of its line [mm]."""
    ways = _middles(made)
    arcs = [0.0 if arc is None else arc.way.length for arc, _ in ways]
    lines = [0.0 if line is None else line.way.length for _, line in ways]
    return 1e3 * np.array(arcs), 1e3 * np.array(lines)


def durations(made: Made) -> FloatArray:
    """Return (t - 1,) how long each move takes, from the middle of one blend to that of the next [s]."""
    ways = _middles(made)
    begins = [
        move.begins if arc is None else arc.passed(0.5 * arc.way.length)
        for move, (arc, _) in zip(made.path, ways, strict=True)
    ]
    ends = [
        move.ends if move.blend == 0.0 else following
        for move, following in zip(made.path, [*begins[1:], math.inf], strict=True)
    ]
    return np.array(ends) - np.array(begins)


def tip_at(made: Made, time: float) -> FloatArray:
    """Return where the tip is [mm]."""
    for piece in reversed(made.log.pieces):
        if piece.begins <= time:
            way = piece.way
            if isinstance(way, (Line, Arc, Rest)):
                return 1e3 * np.array(way.place(piece.gone(time)))
            break
    return 1e3 * np.array(position(made.start.target))


def pieces_by_move(log: Log) -> dict[int, list[Piece]]:
    """Return the ways of each move by its number."""
    found: dict[int, list[Piece]] = {}
    for piece in log.pieces:
        found.setdefault(piece.move, []).append(piece)
    return found


def _middles(made: Made) -> list[tuple[Piece | None, Piece | None]]:
    """Return of each move the blend that leads to it, if any, and its line."""
    pieces = pieces_by_move(made.log)
    first = next(k for k, move in enumerate(made.log.moves) if move is made.path[0])
    found: list[tuple[Piece | None, Piece | None]] = []
    for k in range(len(made.path)):
        own = pieces[first + k]
        found.append((own[0] if isinstance(own[0].way, Arc) else None, own[-1]))
    return found
