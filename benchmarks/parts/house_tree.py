"""The package as its files have it: rooms and wings, how long they are, what their doors name, what they import."""

from __future__ import annotations

import ast
import tomllib
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, cast, final

ROOT = Path(__file__).parents[2]
PACKAGE = "geoprint"


@final
@dataclass(frozen=True, slots=True)
class Import:
    """One name that a module imports from the package.

    Attributes:
        module: that it is imported from, as written.
        name: what is imported; a module, or what one holds.
        at_use: within a function, not as the module starts.
    """

    module: str
    name: str
    at_use: bool


@final
@dataclass(frozen=True, slots=True)
class Module:
    """One file of the package.

    Attributes:
        name: with dots; a package's own file has the package's name.
        path: of the file.
        lines: of the file.
        code: of these, lines that are not blank, no comment and no docstring.
        functions: name and lines of each, its docstring included.
        classes: names of those of the module.
        public: names that it binds for others: defined here without a leading underscore, or imported `as` themselves.
        imports: from the package, those for type checkers left out.
        door: what each name that it passes on is, as module and name.
    """

    name: str
    path: Path
    lines: int
    code: int
    functions: Sequence[tuple[str, int]]
    classes: Sequence[str]
    public: Sequence[str]
    imports: Sequence[Import]
    door: Mapping[str, tuple[str, str]]


@final
@dataclass(frozen=True)
class House:
    """The modules of a tree and the contracts of its pyproject.toml.

    Attributes:
        root: folder of pyproject.toml.
    """

    root: Path = ROOT

    @cached_property
    def modules(self) -> Mapping[str, Module]:
        """All modules by name, in order."""
        paths = sorted((self.root / PACKAGE).rglob("*.py"))
        found = (read_module(path, root=self.root) for path in paths)
        return {module.name: module for module in found}

    @cached_property
    def floors(self) -> Mapping[str, Sequence[Sequence[str]]]:
        """Per room with an order (the house itself too) its floors from the top: full names of modules and wings."""
        return {
            container: [
                [f"{container}.{name}" for name in floor.replace("|", ":").replace(" ", "").split(":")]
                for floor in contract["layers"]
            ]
            for contract in self._contracts("layers")
            for container in contract["containers"]
        }

    @cached_property
    def optional(self) -> Sequence[str]:
        """Modules that the core does without."""
        alone = (each for each in self._contracts("forbidden") if each["name"] == "The core stands alone")
        return [name for contract in alone for name in contract["forbidden_modules"]]

    @cached_property
    def rooms(self) -> Sequence[str]:
        """Rooms from the top floor to the lowest, each followed by its wings."""
        return [name for room in _each(self.floors[PACKAGE]) for name in (room, *self._wings(room))]

    def _wings(self, room: str) -> Iterator[str]:
        """Yield the wings of a room, each followed by its own."""
        for wing in _each(self.floors.get(room, ())):
            if self.is_room(wing):
                yield from (wing, *self._wings(wing))

    def is_room(self, name: str) -> bool:
        """Return whether a name is a folder of the package."""
        return name in self.modules and self.modules[name].path.name == "__init__.py"

    def room_of(self, module: str) -> str:
        """Return the room or wing that a module stands in; its own name where it stands in the house itself."""
        return max((room for room in self.rooms if within(module, room)), key=len, default=PACKAGE)

    def members(self, room: str) -> Sequence[Module]:
        """Return the modules that stand in a room itself, not in its wings."""
        return [module for name, module in self.modules.items() if self.room_of(name) == room]

    def may_import(self, room: str) -> Sequence[str]:
        """Return what the contracts let a room or wing import: all that stands on floors below its own."""
        outer = next((name for name in self.rooms if name != room and within(room, name)), room)
        inside = self.floors.get(outer, ())
        highest = next((at for at, floor in enumerate(inside) if self._of(floor, room)), -1)
        below = _each(inside[highest + 1 :])
        core = [] if all(map(self.is_room, below)) else [outer]
        at = next(at for at, floor in enumerate(self.floors[PACKAGE]) if outer in floor)
        return [*filter(self.is_room, below), *core, *_each(self.floors[PACKAGE][at + 1 :])]

    def _of(self, floor: Sequence[str], room: str) -> bool:
        """Return whether a room, or where it has wings what stands in the room itself, is on a floor."""
        return room in floor or (room in self.floors and not all(map(self.is_room, floor)))

    def upwards(self) -> Iterator[tuple[str, str]]:
        """Yield module and what it imports where that stands on a higher floor, of the house or of their room."""
        for module in self.modules.values():
            for target in dict.fromkeys(map(self.target, module.imports)):
                for container in self.floors:
                    if all(name.startswith(f"{container}.") for name in (module.name, target)) and (
                        self._floor(container, target) < self._floor(container, module.name)
                    ):
                        yield module.name, target

    def _floor(self, container: str, module: str) -> int:
        """Return on which floor a module stands, counted from the top; one that is not listed stands lowest."""
        floors = self.floors[container]
        found = (at for at, floor in enumerate(floors) if any(within(module, name) for name in floor))
        return next(found, len(floors) - 1)

    def arrows(self) -> Mapping[str, set[str]]:
        """Return for each room and wing the others whose doors or modules it imports, at use too."""
        found: dict[str, set[str]] = {room: set() for room in self.rooms}
        for module in self.modules.values():
            room = self.room_of(module.name)
            others = {self.room_of(self.target(each)) for each in module.imports}
            # A door passes on what its wings make.
            wings = {other for other in others if module.name == room and within(other, room)}
            found.setdefault(room, set()).update(others - wings)
        return {room: others - {room, PACKAGE} for room, others in found.items() if room != PACKAGE}

    def target(self, each: Import) -> str:
        """Return the module that an import names."""
        whole = f"{each.module}.{each.name}"
        return whole if whole in self.modules else each.module

    def needed(self, *starts: str) -> Mapping[str, Module]:
        """Return the modules that functions of doors need, without the optional ones.

        Args:
            starts: such as "geoprint.pipeline.plan". Names that a door passes on are looked up where they are made, so
                that a door's other names are not counted.
        """
        found: dict[str, Module] = {}
        ahead = [self._source(*start.rpartition(".")[::2]) for start in starts]
        while ahead:
            name = ahead.pop()
            if name not in found and not any(within(name, one) for one in self.optional):
                found[name] = self.modules[name]
                ahead += [self._source(each.module, each.name) for each in self.modules[name].imports]
        return found

    def _source(self, module: str, name: str) -> str:
        """Return the module in which a name is made."""
        while module in self.modules and name in self.modules[module].door:
            module, name = self.modules[module].door[name]
        return self.target(Import(module, name, at_use=False))

    def _contracts(self, kind: str) -> Iterator[dict[str, Any]]:
        table = tomllib.loads((self.root / "pyproject.toml").read_text(encoding="utf-8"))
        return (each for each in table["tool"]["importlinter"]["contracts"] if each["type"] == kind)


def within(name: str, room: str) -> bool:
    """Return whether a module is a room or stands in it."""
    return name == room or name.startswith(f"{room}.")


def _each(floors: Sequence[Sequence[str]]) -> Sequence[str]:
    return [name for floor in floors for name in floor]


def read_module(path: Path, *, root: Path) -> Module:
    """Read one file of the package below a root."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    name = ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__")
    nodes = _statements(tree)
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    bound = {
        each.asname or each.name: (node.module, each.name)
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and node.module and within(node.module, PACKAGE)
        for each in node.names
    }
    return Module(
        name,
        path,
        lines=len(text.splitlines()),
        code=_code_lines(text, nodes),
        functions=[(node.name, (node.end_lineno or 0) - node.lineno + 1) for node in functions],
        classes=[node.name for node in tree.body if isinstance(node, ast.ClassDef)],
        public=_public(tree),
        imports=list(_imports(tree, at_use=False)),
        door=bound if path.name == "__init__.py" else {},
    )


def _public(tree: ast.Module) -> Sequence[str]:
    names: list[str] = []
    for node in tree.body:
        if isinstance(node, ast.ImportFrom):
            names += [each.name for each in node.names if each.asname == each.name]
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.append(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names += [target.id for target in targets if isinstance(target, ast.Name)]
            if names[-1:] == ["__all__"] and node.value:
                return list(ast.literal_eval(node.value))
    return [name for name in names if not name.startswith("_")]


def _imports(node: ast.AST, *, at_use: bool) -> Iterator[Import]:
    for child in _below(node):
        if isinstance(child, ast.If) and isinstance(child.test, ast.Name) and child.test.id == "TYPE_CHECKING":
            continue
        if isinstance(child, ast.ImportFrom) and child.module and within(child.module, PACKAGE):
            yield from (Import(child.module, each.name, at_use) for each in child.names)
        yield from _imports(child, at_use=at_use or isinstance(child, ast.FunctionDef))


def _statements(tree: ast.Module) -> Sequence[ast.AST]:
    """Return a module, its statements and what holds some of them, in the order of `ast.walk`."""
    found: list[ast.AST] = []
    ahead = deque[ast.AST]([tree])
    while ahead:
        found.append(ahead.popleft())
        ahead.extend(_below(found[-1]))
    return found


def _below(node: ast.AST) -> Iterator[ast.AST]:
    """Yield statements right below a node, and what holds some; expressions, of which there are far more, do not."""
    for name in node._fields:
        value: object = getattr(node, name, None)
        if isinstance(value, list) and value and isinstance(value[0], ast.stmt | ast.excepthandler | ast.match_case):
            yield from cast("list[ast.AST]", value)


def _code_lines(text: str, nodes: Sequence[ast.AST]) -> int:
    told: set[int] = set()
    for node in nodes:
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node, clean=False):
            told.update(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    lines = enumerate(text.splitlines(), start=1)
    return sum(1 for number, line in lines if number not in told and line.strip() and line.strip()[0] != "#")
