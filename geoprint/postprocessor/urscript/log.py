"""What an execution is given and what it yields: the scenario, values of variables, threads, and the log."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import TypeAlias, final

from geoprint.model import frozen
from geoprint.postprocessor.urscript.motion import Piece
from geoprint.postprocessor.urscript.poses import Pose

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
