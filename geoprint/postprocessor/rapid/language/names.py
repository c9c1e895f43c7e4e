"""The names of a task and where they are declared: in routines, modules, the task, the controller.

RAPID ignores case. What is LOCAL belongs to its module and hides what the task declares; what a routine declares hides
both. All kinds of declaration share their names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Literal, TypeAlias, final

from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.language.syntax import Alias, Datum, Module, Parameter, RecordType, Routine

# What a controller brings: its types, data, instructions and functions, and further names of its options.


@final
@dataclass(frozen=True, slots=True)
class Builtins:
    """What a controller brings.

    Attributes:
        module: declarations as RAPID would write them.
        known: names whose declaration is not at hand, in lower case.
    """

    module: Module
    known: frozenset[str]


@cache
def builtins() -> Builtins:
    """Return what a controller brings, read from the tables beside this module."""
    folder = resources.files("geoprint.postprocessor.rapid.language")
    module = parse_module("builtins.mod", folder.joinpath("builtins.mod").read_text(encoding="ascii"))
    lines = folder.joinpath("known_names.txt").read_text(encoding="ascii").splitlines()
    known = " ".join(line for line in lines if not line.startswith(("#", "[")))
    return Builtins(module, frozenset(known.lower().split()))


Role: TypeAlias = Literal["datum", "parameter", "loop", "routine", "type", "module", "signal", "known"]


@final
@dataclass(frozen=True, slots=True)
class Symbol:
    """A declared name.

    Attributes:
        name: as written.
        role: what it is; `known` where the controller brings it and its declaration is not at hand.
        file: of its module; empty for what the controller brings.
        line: of its declaration.
        node: the declaration; None for a loop's variable, a module, a signal and what is known by name only.
        detail: type of a signal, or empty.
    """

    name: str
    role: Role
    file: str
    line: int
    node: Datum | Parameter | Routine | RecordType | Alias | None
    detail: str = ""


Table: TypeAlias = Mapping[str, Symbol]


@final
@dataclass(frozen=True, slots=True)
class Names:
    """All names of a task, in lower case.

    Attributes:
        task: declared for all modules.
        local: declared LOCAL, by the file of their module.
        brought: by the controller.
        signals: type of each signal of the cell; None where nobody knows them.
    """

    task: Table
    local: Mapping[str, Table]
    brought: Table
    signals: Mapping[str, str] | None

    def find(self, name: str, *, file: str, inner: Table) -> Symbol | None:
        """Return what a name means in a module, with what the routine around it declares, or None."""
        word = name.lower()
        found = inner.get(word) or self.local.get(file, {}).get(word) or self.task.get(word) or self.brought.get(word)
        if found is None and self.signals is not None and word in self.signals:
            return Symbol(name, "signal", "", 0, None, self.signals[word])
        return found


def declared(module: Module) -> list[tuple[Symbol, bool]]:
    """Return what a module declares outside its routines, in the order of its lines, and whether each is LOCAL."""
    nodes = [
        *((Symbol(node.name, "type", module.file, node.line, node), node.local) for node in module.types),
        *((Symbol(node.name, "datum", module.file, node.line, node), node.local) for node in module.data),
        *((Symbol(node.name, "routine", module.file, node.line, node), node.local) for node in module.routines),
    ]
    return sorted(nodes, key=lambda entry: entry[0].line)


def declared_in(routine: Routine, file: str) -> list[Symbol]:
    """Return parameters and data of a routine."""
    return [
        *(Symbol(node.name, "parameter", file, node.line, node) for node in routine.parameters),
        *(Symbol(node.name, "datum", file, node.line, node) for node in routine.data),
    ]


def names_of(modules: Sequence[Module], *, signals: Mapping[str, str] | None) -> Names:
    """Gather the names of a task; of several declarations of one name the first counts."""
    task: dict[str, Symbol] = {}
    local: dict[str, dict[str, Symbol]] = {module.file: {} for module in modules}
    for module in modules:
        for symbol, is_local in declared(module):
            table = local[module.file] if is_local else task
            table.setdefault(symbol.name.lower(), symbol)
    lowered = None if signals is None else {name.lower(): kind.lower() for name, kind in signals.items()}
    return Names(task, local, _brought(), lowered)


@cache
def _brought() -> Table:
    known = builtins()
    table = {name: Symbol(name, "known", "", 0, None) for name in known.known}
    for symbol, _ in declared(known.module):
        table[symbol.name.lower()] = Symbol(symbol.name, symbol.role, "", 0, symbol.node)
    return table
