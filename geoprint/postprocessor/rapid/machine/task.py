"""A task: the modules of a program and of the controller, compiled once for all scenarios."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeVar, cast, final

from geoprint.postprocessor.rapid.language.syntax import Alias, Datum, Module, RecordType, Routine, Value
from geoprint.postprocessor.rapid.machine.execution import Scenario
from geoprint.postprocessor.rapid.machine.expressions import compiled
from geoprint.postprocessor.rapid.machine.state import MISSING, State
from geoprint.postprocessor.rapid.machine.statements import compile_routine
from geoprint.postprocessor.rapid.machine.stepping import Declared, Evaluate, Global, RoutineCode, Scope
from geoprint.postprocessor.rapid.machine.values import PREDEFINED, RECORDS, array_of, initial, stored, unknown
from geoprint.robot.arm import Arm

First = tuple[int, str, str, Evaluate]
Seen = TypeVar("Seen", Global, RoutineCode)


def compile_task(
    modules: Sequence[Module], *, at_once: Iterable[str], signals: Mapping[str, str], arm: Arm
) -> MachineTask:
    """Compile modules.

    Args:
        modules: all of them, those that a program loads later among them.
        at_once: files of those that are loaded from the start.
        signals: type of each signal of the controller, by name in any case.
        arm: that moves.

    Raises:
        VerificationError: they do what this machine does not know.
    """
    return MachineTask(modules, resident=frozenset(at_once), signals=signals, arm=arm)


@final
class MachineTask:
    """Modules as steps; nothing in it changes by an execution.

    Attributes:
        declared: by all modules, by name.
        routines: all of them, by number.
        files: of the modules.
        resident: files of those that are loaded from the start.
        words: names of tools and work objects, by number.
        blank: a state without anything in it, to compute constants with.
        arm: that moves.
    """

    __slots__ = (
        "_firsts", "_numbers", "_shared", "arm", "blank", "declared", "files", "resident", "routines", "slots", "words",
    )  # fmt: skip

    def __init__(
        self, modules: Sequence[Module], *, resident: frozenset[str], signals: Mapping[str, str], arm: Arm
    ) -> None:
        self.declared = Declared(signals={name.lower(): kind.lower() for name, kind in signals.items()})
        self.declared.records.update(RECORDS)
        self.routines: list[RoutineCode] = []
        self.files = tuple(module.file for module in modules)
        self.resident = resident
        self.words: list[str] = []
        self.slots = 0
        self.arm = arm
        self._numbers: dict[str, int] = {}
        self._firsts: dict[str, list[First]] = {file: [] for file in self.files}
        self._shared: dict[str, set[str]] = {module.file: {module.name.lower()} for module in modules}
        self.blank = State(self, Scenario(), arm)
        for module in modules:
            self._declare_types(module)
        for module in modules:
            self._declare(module)
        for module in modules:
            self._first_values(module)
        place = 0
        for module in modules:
            for routine in module.routines:
                compile_routine(routine, self.routines[place], self)
                place += 1

    def disk(self, scenario: Scenario) -> frozenset[str]:
        """Return the files in the controller's home folder."""
        return frozenset(self.files) - self.resident if scenario.disk is None else scenario.disk

    def slots_of(self, file: str) -> list[int]:
        """Return the slots of a module's data."""
        return [slot for slot, _, _, _ in self._firsts[file]]

    def first_values(self, file: str) -> list[First]:
        """Return slot, name, storage and first value of each datum of a module."""
        return self._firsts.get(file, [])

    def shared_names(self, file: str) -> set[str]:
        """Return the names that a module declares for others, its own among them."""
        return self._shared[file]

    def file_number(self, file: str) -> int:
        """Return the number of a module."""
        return self.files.index(file)

    def name_number(self, name: str) -> int:
        """Return the number of a name of a tool or work object."""
        if name not in self._numbers:
            self._numbers[name] = len(self.words)
            self.words.append(name)
        return self._numbers[name]

    def look(self, name: str, scope: Scope) -> Callable[[State], Value]:
        """Return what gives the value of a module's or the controller's datum."""
        datum = scope.datum(name)
        if datum is None:
            value = PREDEFINED[name][1]
            return lambda _: value
        slot = datum.slot
        return lambda state: cast("Value", state.data[slot])

    def _declare_types(self, module: Module) -> None:
        for declared in module.types:
            match declared:
                case RecordType():
                    parts = tuple((name, kind.lower()) for kind, name in declared.components)
                    self.declared.records[declared.name.lower()] = parts
                case Alias():
                    self.declared.aliases[declared.name.lower()] = declared.of.lower()

    def _declare(self, module: Module) -> None:
        scope = Scope(self.declared, module.file)
        for datum in module.data:
            name = datum.name.lower()
            found = Global(
                self.slots, scope.kind(datum.kind), datum.storage, module.file,
                module.file in self.resident,
            )  # fmt: skip
            self.slots += 1
            self.blank.data.append(MISSING)
            if self._once(module, datum, found, self.declared.data, self.declared.own_data):
                self._shared[module.file].add(name)
        for routine in module.routines:
            name = routine.name.lower()
            code = RoutineCode(
                len(self.routines), routine.name, module.file, kind=routine.kind, returns=routine.returns,
                parameters=routine.parameters, local=routine.local,
            )  # fmt: skip
            self.routines.append(code)
            if self._once(module, routine, code, self.declared.routines, self.declared.own_routines):
                self._shared[module.file].add(routine.name.lower())

    def _once(
        self, module: Module, node: Datum | Routine, found: Seen, shared: dict[str, Seen],
        own: dict[tuple[str, str], Seen],
    ) -> bool:  # fmt: skip
        """Note what a module declares; return whether other modules see it."""
        name, folder = node.name.lower(), module.file.rpartition("/")[0]
        place = module.file if node.local else folder
        if not node.local and (name in shared or (folder, name) in own):
            unknown(module.file, node.line, f"{node.name} is declared twice")
        if place:
            own[place, name] = found
        else:
            shared[name] = found
        return not node.local

    def _first_values(self, module: Module) -> None:
        scope = Scope(self.declared, module.file)
        for datum in module.data:
            found = cast("Global", scope.datum(datum.name))
            run = self._first_value(datum, scope)
            self._firsts[module.file].append((found.slot, datum.name.lower(), datum.storage, run))
            # Sizes of arrays are constants of what was declared before.
            if datum.storage == "CONST":
                self.blank.data[found.slot] = run(self.blank)

    def _first_value(self, datum: Datum, scope: Scope) -> Evaluate:
        if datum.value is not None:
            run = compiled(datum.value, scope).run
            return lambda state: stored(run(state))
        sizes = tuple(int(cast("float", compiled(size, scope).run(self.blank))) for size in datum.sizes)
        value = array_of(initial(scope.kind(datum.kind), self.declared.records), sizes)
        return lambda _: cast("Value", value)
