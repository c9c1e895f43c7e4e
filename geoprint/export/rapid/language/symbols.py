"""Resolves the names of a whole task: declared once, every use means something, and arguments and values fit.

It judges the text as it is written and knows nothing of whoever wrote it. In a closed task everything must resolve; in
an open one (not all modules are at hand) a name that nothing declares may stand in another module.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import final

from geoprint.errors import VerificationError
from geoprint.export.rapid.language.context import Context
from geoprint.export.rapid.language.declarations import judge_module, judge_names
from geoprint.export.rapid.language.kinds import Kinds
from geoprint.export.rapid.language.names import Names, names_of
from geoprint.export.rapid.language.parsing import parse_module
from geoprint.export.rapid.language.places import Place, refusal
from geoprint.export.rapid.language.syntax import Module


@final
@dataclass(frozen=True, slots=True)
class Task:
    """Modules whose names are resolved.

    Attributes:
        modules: as given.
        names: what each name means.
        open_names: file, line and name of what nothing declares; empty in a closed task.
    """

    modules: tuple[Module, ...]
    names: Names
    open_names: tuple[tuple[str, int, str], ...]


def read_task(modules: Sequence[tuple[str, str]], *, signals: Mapping[str, str] | None, closed: bool = True) -> Task:
    """Parse the modules of a task and resolve its names.

    Args:
        modules: file name and text of each module, those loaded later among them.
        signals: as for `resolve`.
        closed: as for `resolve`.

    Raises:
        VerificationError: a text is no RAPID, or something in it means nothing; the first such place is named.
    """
    return resolve([parse_module(file, text) for file, text in modules], signals=signals, closed=closed)


def resolve(modules: Sequence[Module], *, signals: Mapping[str, str] | None, closed: bool = True) -> Task:
    """Resolve the names of a task.

    Args:
        modules: all of the task, those loaded later among them.
        signals: type of each signal of the cell (`signaldo`, ...) by its name; where None, whatever stands in the
            place of a signal is one of the controller's configuration.
        closed: whether everything must resolve.

    Raises:
        VerificationError: something is wrong; the first such place is named.
    """
    task, errors = examine(modules, signals=signals, closed=closed)
    if errors:
        raise errors[0]
    return task


def examine(
    modules: Sequence[Module], *, signals: Mapping[str, str] | None, closed: bool = True
) -> tuple[Task, list[VerificationError]]:
    """Return a task and all that is wrong in it, in the order of its modules; the arguments are those of `resolve`."""
    names = names_of(modules, signals=signals)
    errors: list[VerificationError] = []
    missing: list[tuple[str, int, str]] = []
    assumed: set[str] = set()

    def say(file: str, line: int, reason: str) -> None:
        errors.append(refusal(Place(file, line), reason))

    def miss(file: str, line: int, name: str) -> None:
        missing.append((file, line, name))

    def assume(name: str) -> None:
        assumed.add(name.lower())

    judge_names(modules, names, say, closed=closed)
    kinds = Kinds(names)
    for module in modules:
        judge_module(
            module,
            Context(names, kinds, module.file, partial(say, module.file), partial(miss, module.file), assume),
            closed=closed,
        )
    missing = [entry for entry in missing if entry[2].lower() not in assumed]
    if closed:
        for file, line, name in missing:
            say(file, line, f"{name} is declared nowhere, and the controller does not bring it")
    return Task(tuple(modules), names, tuple(missing)), errors
