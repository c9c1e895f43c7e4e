"""Where a judgement stands: the names that hold there, and who hears what is wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import final

from geoprint.postprocessor.rapid.language.kinds import Kind, Kinds
from geoprint.postprocessor.rapid.language.names import Names, Symbol, Table
from geoprint.postprocessor.rapid.language.syntax import Routine


@final
@dataclass(frozen=True, slots=True)
class Context:
    """A place in a task.

    Attributes:
        names: of the task.
        kinds: of the task.
        file: of the module.
        say: takes line and reason of what is wrong.
        miss: takes line and name of what nothing declares.
        assume: takes the name of what the controller's configuration must hold.
        inner: names that the routine around declares, loops' variables among them.
        routine: around, or None.
        handling: whether an error handler is around.
        labels: of the routine, in lower case.
        sound: forms of the module's calls of which nothing is wrong where no routine hides a name.
        known: kinds of the names that were judged here, and of which nothing is wrong.
    """

    names: Names
    kinds: Kinds
    file: str
    say: Callable[[int, str], None]
    miss: Callable[[int, str], None]
    assume: Callable[[str], None]
    inner: Table = field(default_factory=dict[str, Symbol])
    routine: Routine | None = None
    handling: bool = False
    labels: frozenset[str] = frozenset()
    sound: set[object] = field(default_factory=set[object])
    known: dict[str, Kind] = field(default_factory=dict[str, Kind])

    def find(self, name: str) -> Symbol | None:
        """Return what a name means here, or None."""
        return self.names.find(name, file=self.file, inner=self.inner)

    def within_loop(self, variable: str, line: int) -> Context:
        """Return the place within a loop with a variable."""
        inner = {**self.inner, variable.lower(): Symbol(variable, "loop", self.file, line, None)}
        return replace(self, inner=inner, known={})

    def within(self, routine: Routine, inner: Table, labels: frozenset[str]) -> Context:
        """Return the place within a routine with its names and labels."""
        return replace(self, routine=routine, inner=inner, labels=labels, known={})

    def within_handler(self) -> Context:
        """Return the place within an error handler."""
        return replace(self, handling=True)
