"""What a person and the world do while a program runs: the switches that are set, answers, the arm, files, events."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias, final

from geoprint.export.rapid.language.syntax import Value

Event: TypeAlias = Literal["PowerOn", "Reset", "Start", "Stop", "QStop", "Restart"]
# What this machine leaves out, so that whoever tells of an execution can say it.
NOT_KNOWN = (
    "how far the arm lags behind its path, and how it swings",
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
        most_steps: after which it is taken to run for ever.
        most_seconds: of processor time after which it is taken to run for ever [s].
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
    most_seconds: float = math.inf
