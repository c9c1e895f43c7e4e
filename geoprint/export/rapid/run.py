"""Runs a RAPID program that was read, on paper: which moves it makes, in which runs, pulling which triggers."""

from __future__ import annotations

from typing import final

from geoprint.export.rapid.text import (
    Call,
    FlowAt,
    Loading,
    Move,
    Place,
    Procedure,
    RapidText,
    Statement,
    SwitchAt,
    refuse,
)
from geoprint.model import comparable

# What the guard's routines are called; `rapid_guard` checks what they do.
_BEGIN, _ENTER, _END, _FORGET = "geobegin", "geoenter", "geoend", "geoforget"


@final
@comparable
class Step:
    """A move, the run in which it is made (from 1), and the triggers that it pulls, as they were defined last."""

    move: Move
    run: int
    triggers: tuple[SwitchAt | FlowAt, ...]


def run_program(text: RapidText, *, entry: Place, resident: frozenset[str]) -> tuple[Step, ...]:
    """Run a program from its procedure main, as a person would who deposits from the first run on.

    Args:
        text: the modules.
        entry: the module that should hold main, for messages.
        resident: modules that are loaded from the start; the others the program must load itself.

    Raises:
        VerificationError: something is called that does not exist or is not loaded, a module is loaded or unloaded at
            the wrong time, a move pulls a trigger that was not defined, or main does not begin and end as it must.
    """
    runner = _Runner(text, resident=resident)
    if "main" not in text.procedures:
        refuse(entry, "there is no procedure main")
    runner.run(text.procedures["main"])
    if not runner.ended:
        refuse(text.procedures["main"].place, "main does not end with GeoEnd")
    return tuple(runner.steps)


@final
class _Runner:
    def __init__(self, text: RapidText, *, resident: frozenset[str]) -> None:
        self.steps: list[Step] = []
        self.ended = False
        self._text = text
        self._loaded = set(resident)
        self._loading: str | None = None
        self._begin: Call | None = None
        self._run = 0
        self._defined: dict[str, SwitchAt | FlowAt] = {}
        self._active: list[Procedure] = []

    def run(self, procedure: Procedure) -> None:
        if procedure in self._active:
            refuse(procedure.place, "a procedure calls itself")
        self._active.append(procedure)
        for statement in procedure.body:
            if self.ended and not isinstance(statement, Loading):
                refuse(statement.place, "the program goes on after GeoEnd")
            self._do(statement)
        self._active.pop()

    def _do(self, statement: Statement) -> None:
        match statement:
            case Move():
                self._move(statement)
            case SwitchAt() | FlowAt():
                datum = self._text.declarations.get(statement.name)
                if datum is None or (datum.storage, datum.kind) != ("VAR", "triggdata"):
                    refuse(statement.place, f"{statement.name} is no VAR triggdata")
                if statement.name in self._defined:
                    refuse(statement.place, f"{statement.name} is defined anew before a move has pulled it")
                self._defined[statement.name] = statement
            case Call():
                self._call(statement)
            case Loading():
                self._load(statement)

    def _move(self, move: Move) -> None:
        if self._begin is None or not self._run:
            refuse(move.place, "the program moves before GeoBegin and GeoEnter")
        missing = [name for name in move.triggers if name not in self._defined]
        if missing:
            refuse(move.place, f"the trigger {missing[0]} is pulled, but not defined before")
        self.steps.append(Step(move, self._run, tuple(self._defined.pop(name) for name in move.triggers)))
        for name, definition in self._defined.items():
            refuse(definition.place, f"the trigger {name} is defined, but the next move does not pull it")

    def _call(self, call: Call) -> None:
        if call.name == _BEGIN and isinstance(call.argument, float) and self._begin is None:
            self._begin = call
        elif call.name == _ENTER and isinstance(call.argument, float) and self._begin is not None:
            if call.argument != float(self._run + 1):
                refuse(call.place, f"run {call.argument:g} is entered after run {self._run}")
            self._run += 1
        elif call.name == _END and call.argument == float(self._run) and self._begin is not None:
            if self._begin.argument != call.argument:
                refuse(self._begin.place, f"{self._begin.argument} runs are announced, there are {self._run}")
            self.ended = True
        elif call.name == _FORGET and isinstance(call.argument, str) and self._begin is None:
            self._loaded.discard(call.argument)
        else:
            self._call_procedure(call)

    def _call_procedure(self, call: Call) -> None:
        procedure = self._text.procedures.get(call.name)
        if procedure is None or call.argument is not None:
            refuse(call.place, f"there is no procedure {call.name} that can be called so here")
        if procedure.place.module not in self._loaded:
            refuse(call.place, f"{call.name} is called, but {procedure.place.module} is not loaded")
        if call.late == (procedure.place.module == call.place.module):
            refuse(call.place, "a routine of a module that is loaded later, and only such a one, is called by %")
        self.run(procedure)

    def _load(self, loading: Loading) -> None:
        if loading.verb == "StartLoad":
            if self._loading is not None or loading.file in self._loaded:
                refuse(loading.place, f"{loading.file} is loaded while another is being loaded, or twice")
            self._loading = loading.file
        elif loading.verb == "WaitLoad":
            if self._loading is None:
                refuse(loading.place, "WaitLoad waits for nothing")
            self._loaded.add(self._loading)
            self._loading = None
        elif loading.file not in self._loaded:
            refuse(loading.place, f"{loading.file} is unloaded, but is not loaded")
        else:
            self._loaded.remove(loading.file)
