"""What routines become: flat lists of steps with jumps; and the names that can be seen where one is compiled."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias, final

from geoprint.export.rapid.language.syntax import Parameter, Value
from geoprint.export.rapid.machine.state import State
from geoprint.export.rapid.machine.values.records import Components

if TYPE_CHECKING:
    from geoprint.export.rapid.machine.batches import Batches

Step: TypeAlias = Callable[[State], None]
Evaluate: TypeAlias = Callable[[State], Value]


@final
@dataclass(frozen=True, slots=True)
class Code:
    """An expression that was compiled.

    Attributes:
        kind: its type in lower case; empty for an aggregate, whose type is that of where it goes.
        run: gives its value.
    """

    kind: str
    run: Evaluate


@final
@dataclass(frozen=True, slots=True)
class Local:
    """A routine's own datum or parameter: its slot, type, and whether the slot holds a reference."""

    slot: int
    kind: str
    by_reference: bool


@final
@dataclass(frozen=True, slots=True)
class Global:
    """A module's datum: its slot, type, storage, module, and whether that is loaded from the start."""

    slot: int
    kind: str
    storage: str
    file: str
    resident: bool


@final
class RoutineCode:
    """A routine as steps.

    Attributes:
        number: in the task.
        name: as written.
        file: of its module.
        kind: PROC, FUNC or TRAP.
        returns: type of its value in lower case.
        parameters: in order.
        local: whether only its module sees it.
        steps: what is done, in order.
        lines: of each step; negative for one that belongs to no statement of its own.
        after: for each step the one behind its statement.
        handlers: error numbers that a handler takes, and its first step.
        setup: gives its own data their first values.
        size: slots of its frame.
        batches: its moves to constant targets.
    """

    __slots__ = (
        "after", "batches", "file", "handlers", "kind", "lines", "local", "name", "number", "parameters", "returns",
        "setup", "size", "steps",
    )  # fmt: skip

    def __init__(
        self, number: int, name: str, file: str, *, kind: str, returns: str, parameters: tuple[Parameter, ...],
        local: bool,
    ) -> None:  # fmt: skip
        self.number = number
        self.name, self.file, self.kind, self.returns = name, file, kind, returns.lower()
        self.parameters, self.local = parameters, local
        self.steps: list[Step] = []
        self.lines = array("i")
        self.after = array("i")
        self.handlers: list[tuple[tuple[Evaluate, ...], int]] = []
        self.setup: list[tuple[int, Evaluate]] = []
        self.size = 0
        self.batches: Batches | None = None

    def line_of(self, step: int) -> int:
        """Return where a step stands."""
        return abs(self.lines[step])


@final
@dataclass(frozen=True, slots=True)
class Declared:
    """All that the modules of a task declare, by name in lower case.

    Modules in a folder of the controller's disk see one another and those outside of folders, which call them by their
    names only: so two folders may declare the same, as long as one is forgotten before the other is loaded.

    Attributes:
        data: of all modules outside of folders, by name.
        own_data: LOCAL ones, by file and name; those of the modules in a folder, by folder and name.
        routines: by name.
        own_routines: as `own_data`.
        records: components of each record type.
        aliases: types by another name.
        signals: type of each signal of the controller.
    """

    data: dict[str, Global] = field(default_factory=dict[str, Global])
    own_data: dict[tuple[str, str], Global] = field(default_factory=dict[tuple[str, str], Global])
    routines: dict[str, RoutineCode] = field(default_factory=dict[str, RoutineCode])
    own_routines: dict[tuple[str, str], RoutineCode] = field(default_factory=dict[tuple[str, str], RoutineCode])
    records: dict[str, Components] = field(default_factory=dict[str, Components])
    aliases: dict[str, str] = field(default_factory=dict[str, str])
    signals: Mapping[str, str] = field(default_factory=dict[str, str])


@final
class Scope:
    """The names that can be seen where an expression stands."""

    __slots__ = ("declared", "file", "folder", "locals", "named", "size")

    def __init__(self, declared: Declared, file: str) -> None:
        self.declared = declared
        self.file = file
        self.folder = file.rpartition("/")[0]
        self.locals: dict[str, Local] = {}
        # What was compiled of names that no routine declares.
        self.named: dict[str, Code] = {}
        self.size = 0

    def add(self, name: str, kind: str, *, by_reference: bool = False) -> int:
        """Declare a datum of the routine, or a hidden one under an empty name, and return its slot."""
        slot, self.size = self.size, self.size + 1
        if name:
            self.locals[name.lower()] = Local(slot, self.kind(kind), by_reference)
        return slot

    def kind(self, name: str) -> str:
        """Return a type by its own name, in lower case."""
        name = name.lower()
        return self.declared.aliases.get(name, name)

    def datum(self, name: str) -> Global | None:
        """Return the module's datum of a name."""
        name = name.lower()
        own = self.declared.own_data
        return own.get((self.file, name)) or own.get((self.folder, name)) or self.declared.data.get(name)

    def routine(self, name: str) -> RoutineCode | None:
        """Return the routine of a name, whether its module is loaded or not."""
        name = name.lower()
        own = self.declared.own_routines
        return own.get((self.file, name)) or own.get((self.folder, name)) or self.declared.routines.get(name)
