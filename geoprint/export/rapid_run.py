"""Runs a RAPID program that was read, on paper: which moves it makes, and which outputs are on during each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from geoprint.export.rapid_text import (
    Call,
    EndGuard,
    Guard,
    Move,
    Place,
    RapidText,
    Setting,
    Statement,
    Switch,
    refuse,
)


@final
@dataclass(frozen=True, slots=True)
class Step:
    """A move and the outputs (lower case) that are on while it is made."""

    move: Move
    on: frozenset[str]


@final
@dataclass(frozen=True, slots=True)
class Motion:
    """What the program does from the start of main to its end.

    Attributes:
        steps: the moves in order.
        settings: ConfJ, ConfL and SingArea as set before the first move.
        cleared: outputs that were set to 0 before the first move.
        left_on: outputs that are on at the end.
    """

    steps: tuple[Step, ...]
    settings: frozenset[str]
    cleared: frozenset[str]
    left_on: frozenset[str]


def run_program(text: RapidText, *, entry: Place, deposit: bool) -> Motion:
    """Run a program from its procedure main.

    Args:
        text: the modules.
        entry: the module that should hold main, for messages.
        deposit: whether somebody has set the guarding variables to FALSE; else they are as declared.

    Raises:
        VerificationError: something is called that does not exist or calls itself, an output switches where the tool
            does not rest, or a guard is no PERS bool.
    """
    runner = _Runner(text, deposit=deposit)
    runner.call("main", place=entry)
    return runner.motion()


@final
class _Runner:
    def __init__(self, text: RapidText, *, deposit: bool) -> None:
        self._text = text
        self._deposit = deposit
        self._active: list[str] = []
        self._steps: list[Step] = []
        self._outputs: dict[str, int] = {}
        self._on: frozenset[str] = frozenset()
        self._settings: dict[str, str] = {}
        self._cleared: frozenset[str] = frozenset()

    def motion(self) -> Motion:
        return Motion(
            steps=tuple(self._steps),
            settings=frozenset(self._settings.values()),
            cleared=self._cleared,
            left_on=self._on,
        )

    def call(self, name: str, *, place: Place) -> None:
        if name not in self._text.procedures:
            refuse(place, f"there is no procedure {name}")
        if name in self._active:
            refuse(place, f"procedure {name} calls itself")
        self._active.append(name)
        skipping = False
        for statement in self._text.procedures[name]:
            if isinstance(statement, Guard):
                skipping = self._holds(statement)
            elif isinstance(statement, EndGuard):
                skipping = False
            elif not skipping:
                self._do(statement)
        self._active.pop()

    def _do(self, statement: Statement) -> None:
        match statement:
            case Move():
                if not self._steps:
                    self._cleared = frozenset(name for name, value in self._outputs.items() if value == 0)
                self._steps.append(Step(statement, self._on))
            case Switch():
                self._switch(statement)
            case Call():
                self.call(statement.name, place=statement.place)
            case Setting():
                self._set(statement)
            case Guard() | EndGuard():
                pass

    def _switch(self, switch: Switch) -> None:
        signal = switch.signal.lower()
        changes = self._outputs.get(signal) != switch.value
        if changes and self._steps and self._steps[-1].move.zone != "fine":
            refuse(switch.place, f"{switch.signal} switches after a rounded target; the tool must rest there (fine)")
        self._outputs[signal] = switch.value
        self._on = frozenset(name for name, value in self._outputs.items() if value)

    def _set(self, setting: Setting) -> None:
        if self._steps:
            refuse(setting.place, f"{setting.text} changes how the robot moves on its way")
        self._settings[setting.text.partition("\\")[0]] = setting.text

    def _holds(self, guard: Guard) -> bool:
        """Whether the guard keeps what follows from running: IF NOT variable THEN."""
        declaration = self._text.declarations.get(guard.variable)
        if declaration is None or (declaration.storage, declaration.kind) != ("PERS", "bool"):
            refuse(guard.place, f"{guard.variable} is no PERS bool")
        return declaration.value is True and not self._deposit
