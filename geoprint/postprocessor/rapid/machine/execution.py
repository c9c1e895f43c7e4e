"""What an execution is given and yields: the scenario, modal state, motion, switchings, texts and lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, TypeAlias, final

import numpy as np

from geoprint import transforms
from geoprint.model import BoolArray, FloatArray, IntArray, freeze_arrays, frozen
from geoprint.postprocessor.rapid.language.syntax import Value

# What a person and the world do while a program runs: the switches that are set, answers, the arm, files, events.


Event: TypeAlias = Literal["PowerOn", "Reset", "Start", "Stop", "QStop", "Restart"]
# What this machine leaves out, so that whoever tells of an execution can say it.
NOT_KNOWN = (
    "the lag of the arm behind its path, and its vibration",
    "ramps: each move takes its length over its speed",
    "the maker's own path in a corner: a parabola through the zone is taken, passed in the time of both lines",
    "the controller's own delays: instructions and outputs take no time",
)
# Nobody's program makes so many steps: one that does is not going to end.
MOST_STEPS = 20_000_000


@final
@dataclass(frozen=True, slots=True)
class Scenario:
    """How a program is run.

    Attributes:
        data: values that a person has set before the start, by the name of the PERS.
        held: values of data that stay whatever the program assigns: what would happen if.
        answers: that the operator gives, question by question; without one the program waits for ever.
        joints: of the arm at the start [rad].
        override: speed override of the panel [%], and of the task.
        signals: values at the start, by name; the others are 0.
        disk: files in the controller's home folder, or None for all modules of the task that are not loaded at once.
        loading: seconds that a module takes to load.
        ties: routines that the configuration ties to system events, in order.
        watched: routines whose calls are noted with their arguments.
        entry: where it begins.
        most_steps: after which it is taken to run for ever; what takes longer than a plain step counts for more.
    """

    data: Mapping[str, Value] = field(default_factory=dict[str, Value])
    held: Mapping[str, Value] = field(default_factory=dict[str, Value])
    answers: tuple[float, ...] = ()
    joints: tuple[float, ...] = (0.0,) * 6
    override: float = 100.0
    signals: Mapping[str, float] = field(default_factory=dict[str, float])
    disk: frozenset[str] | None = None
    loading: float = 0.5
    ties: Mapping[Event, tuple[str, ...]] = field(default_factory=dict[Event, tuple[str, ...]])
    watched: frozenset[str] = frozenset()
    entry: str = "main"
    most_steps: int = MOST_STEPS


# What instructions set for every motion behind them: the modal state of a program.
#
# A controller keeps it until another instruction or the next start from main changes it [ABBRapid, motsetdata].
# Speeds count in the time of a move; the rest changes how a true arm moves, which no simulation here knows: whoever
# looks at an execution finds with each move the state in which it was ordered.


@final
class Modes(NamedTuple):
    """The state; its first values are those at a start from main.

    Attributes:
        override: of VelSet [%].
        fastest: of the tip, by VelSet [mm/s].
        acceleration: AccSet: acceleration, its ramp, and that at a stop [%].
        world_acceleration: WorldAccLim: the highest [m/s2], or infinite.
        path_acceleration: PathAccLim: the highest acceleration and deceleration [m/s2], or infinite.
        resolution: PathResol [%].
        lines: ConfL: whether the configuration of straight moves is supervised.
        joints: ConfJ: the same of moves of the joints.
        singularities: SingArea: `off`, or what gives way: `wrist`, `lockaxis4`.
        supervision: MotionSup: whether collisions are supervised, and how [%].
        soft: SoftAct: axes that give way, in order, each with its softness [%].
        circles: CirPathMode: how the tool turns along a circle.
    """

    override: float = 100.0
    fastest: float = 5000.0
    acceleration: tuple[float, float, float] = (100.0, 100.0, 100.0)
    world_acceleration: float = float("inf")
    path_acceleration: tuple[float, float] = (float("inf"), float("inf"))
    resolution: float = 100.0
    lines: bool = True
    joints: bool = True
    singularities: str = "off"
    supervision: tuple[bool, float] = (True, 100.0)
    soft: tuple[tuple[int, float], ...] = ()
    circles: str = "pathframe"


# The state at a start from main.
START = Modes()
# The instruction that sets each, for messages.
INSTRUCTION_OF: Mapping[str, str] = {
    "override": "VelSet", "fastest": "VelSet", "acceleration": "AccSet", "world_acceleration": "WorldAccLim",
    "path_acceleration": "PathAccLim", "resolution": "PathResol", "lines": "ConfL", "joints": "ConfJ",
    "singularities": "SingArea", "supervision": "MotionSup", "soft": "SoftAct", "circles": "CirPathMode",
}  # fmt: skip


def chosen(options: Mapping[str, Value], *, default: str) -> str:
    """Return the switch that is given among some that exclude each other."""
    return next((name for name, value in options.items() if value is True), default)


# What an execution yields: motion, switchings, texts, calls, and which lines were executed.


VERBS = ("MoveL", "MoveC", "MoveJ", "MoveAbsJ", "TriggL", "TriggC", "TriggJ")
JOINT_MOVES = frozenset({"MoveAbsJ"})
Ending: TypeAlias = Literal["runs", "end", "exit", "waits", "stopped", "error"]


@final
@frozen
class Moves:
    """The moves that were made, in order: n of them.

    Attributes:
        verbs: (n,) place of each instruction in `VERBS`.
        files: (n,) place of its module in the execution's `files`.
        lines: (n,) where it stands, from 1.
        places: (n, 3) of the target in its work object [mm]; of a move of the joints their first three angles [rad].
        turns: (n, 4) attitude of the target as it was given, w x y z; of a move of the joints their last three, and 0.
        configurations: (n, 4) that the target asks for.
        other_axes: (n, 6) axes beside the arm where the target has them [degrees or mm]; 9E9 for what is not there.
        speeds: (n,) of the tip by the speeddata [mm/s].
        zones: (n,) radius of the zone of the tip [mm], 0 for a stop.
        tools: (n,) place of the tool's name in `names`.
        works: (n,) place of the work object's name in `names`.
        frames: (n,) place of the frame of the target in `Ts_base_target`.
        begins: (n,) [s].
        ends: (n,) when the tip is at the target, or passes its corner [s].
        lengths: (n,) of path [mm].
        names: of tools and work objects, as declared, in lower case.
        Ts_base_target: (f, 4, 4) the frames in which targets are given, with their displacement, in base coordinates.
        modes: (n,) place in `settings` of the modal state in which each is ordered.
        settings: modal states.
    """

    verbs: IntArray
    files: IntArray
    lines: IntArray
    places: FloatArray
    turns: FloatArray
    configurations: FloatArray
    other_axes: FloatArray
    speeds: FloatArray
    zones: FloatArray
    tools: IntArray
    works: IntArray
    frames: IntArray
    begins: FloatArray
    ends: FloatArray
    lengths: FloatArray
    names: tuple[str, ...]
    Ts_base_target: FloatArray
    modes: IntArray
    settings: tuple[Modes, ...]

    def __post_init__(self) -> None:
        freeze_arrays(
            self, verbs="int: n", files="int: n", lines="int: n", places="float: n 3", turns="float: n 4",
            configurations="float: n 4", other_axes="float: n 6", speeds="float: n", zones="float: n", tools="int: n",
            works="int: n", frames="int: n", begins="float: n", ends="float: n", lengths="float: n",
            Ts_base_target="float: f 4 4", modes="int: n",
        )  # fmt: skip

    @property
    def count(self) -> int:
        """How many there are."""
        return int(self.verbs.size)

    @property
    def along_path(self) -> IntArray:
        """Which of them lead the tip to a target, not the joints."""
        return np.flatnonzero(~np.isin(self.verbs, [VERBS.index(verb) for verb in JOINT_MOVES]))

    def tips(self, rows: IntArray) -> FloatArray:
        """Return (k, 3) where the tip is at the targets of some moves along the path, in base coordinates [mm]."""
        places, frames = self.places[rows], self.frames[rows]
        for frame in np.unique(frames).tolist():
            there = frames == frame
            places[there] = transforms.apply(self.Ts_base_target[frame], places[there])
        return places

    def Ts_base_tip(self, rows: IntArray) -> FloatArray:
        """Return (k, 4, 4) poses of the tool at the targets of some moves along the path, in base coordinates [mm]."""
        targets = transforms.rigid(transforms.rotation_of(self.turns[rows]), self.places[rows])
        return self.Ts_base_target[self.frames[rows]] @ targets


@final
@dataclass(frozen=True, slots=True)
class Switching:
    r"""An output that was given a value.

    Attributes:
        time: when [s].
        signal: its name in lower case.
        value: that it was given; for a flow, that of 1 mm/s.
        file: module of the instruction that asked for it.
        line: where that stands.
        move: number of the move that carried it, from 0, or -1 where the program switched it by itself.
        distance: from the end of the move, or from its start [mm].
        from_start: whether the distance counts from the start.
        flow: whether the output follows the speed of the tip (TriggSpeed).
        lag: by which it leads [s].
        dip_lag: by which it leads changes of the speed [s].
    """

    time: float
    signal: str
    value: float
    file: str
    line: int
    move: int = -1
    distance: float = 0.0
    from_start: bool = False
    flow: bool = False
    lag: float = 0.0
    dip_lag: float = 0.0


@final
@dataclass(frozen=True, slots=True)
class Called:
    """A watched routine that was called: its name in lower case, arguments, when, and after how many moves."""

    routine: str
    arguments: tuple[Value | None, ...]
    time: float
    moves: int
    file: str
    line: int


@final
@dataclass(frozen=True, slots=True)
class Execution:
    """What happened.

    Attributes:
        ended: how it ended: at the end of main, by EXIT, waiting for what never comes, by Stop, by an error that
            nobody handled, or not yet.
        reason: why, in words; empty at the end of main.
        file: where it ended.
        line: where it ended.
        seconds: that it took.
        files: modules of the task.
        moves: that were made.
        switchings: in the order in which the outputs took their values.
        texts: moment and text of each that was shown.
        questions: texts of the questions that were asked.
        calls: of watched routines.
        statements: for each file the lines of its statements, and whether each of these was executed.
        loaded: files of the modules that are loaded at the end.
        data: values of the data of modules at the end, by name.
        signals: values at the end.
        corners_missed: moves with a zone whose next move came too late, so that the arm stopped there.
        not_known: what no simulation knows.
    """

    ended: Ending
    reason: str
    file: str
    line: int
    seconds: float
    files: tuple[str, ...]
    moves: Moves
    switchings: tuple[Switching, ...]
    texts: tuple[tuple[float, str], ...]
    questions: tuple[str, ...]
    calls: tuple[Called, ...]
    statements: Mapping[str, tuple[IntArray, BoolArray]]
    loaded: frozenset[str]
    data: Mapping[str, Value | None]
    signals: Mapping[str, float]
    corners_missed: tuple[int, ...]
    not_known: tuple[str, ...] = NOT_KNOWN
