"""How large is the code base, beside an earlier commit, and which retired words does it still say?

    python -m benchmarks.code_base [--at REVISION] [--words] [--picture] [--smoke]

One row each for the package, the tests and the benchmarks: modules, folders, lines of code (neither blank nor comment
nor docstring), all lines, classes, the share of code that imports, and the longest function. The core is what `plan`
and `compare` need to reach their files, each name looked up where it is made, without what is optional. With --at, the
same of a commit, from git, and by how much each has changed since. With --words, how often each word that
CONTRIBUTING's glossary replaces stands in the package, and names that two classes share. With --picture, the picture of
the imports that CONTRIBUTING shows, as Mermaid. Nothing here is a limit.
"""

from __future__ import annotations

import ast
import io
import re
import subprocess
import tarfile
import tempfile
import tomllib
from collections import defaultdict, deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, cast, final

from benchmarks import ROOT
from benchmarks.parts.tables import row, script_parser, table

PACKAGE = "geoprint"
# Folder of scripts to be copied, which are no modules.
SCRIPTS = "examples"
AREAS = (PACKAGE, "tests", "benchmarks")
# Of these, those that the package passes on: what the main job starts from.
CORE = ("plan", "compare", "compare_parts", "save", "save_plan", "save_comparisons")
SIZES = (
    "modules",
    "folders",
    "code lines",
    "lines",
    "classes",
    "imports [% of code]",
    "longest function",
    "core lines",
)
CONTRIBUTING = ".github/CONTRIBUTING.md"
# Of the rows behind this heading: what to say, and instead of what.
GLOSSARY = "| say | not |"
# What stands in the body of something.
HOLDERS = (ast.stmt, ast.excepthandler, ast.match_case)


@final
@dataclass(frozen=True, slots=True)
class Module:
    """One file.

    Attributes:
        path: of the file.
        lines: of the file.
        code: of these, lines that are not blank, no comment and no docstring.
        import_lines: of these, lines of import statements.
        longest_function: lines of the longest, its docstring included.
        classes: names of those in it.
        imports: module and name of what it imports from the package, those for type checkers left out.
        passes_on: of a package's own file, module and name of what each name is that it imports, at the top.
    """

    path: Path
    lines: int
    code: int
    import_lines: int
    longest_function: int
    classes: Sequence[str]
    imports: Sequence[tuple[str, str]]
    passes_on: Mapping[str, tuple[str, str]]


@final
@dataclass(frozen=True)
class CodeBase:
    """The modules of a tree and the contracts of its pyproject.toml.

    Attributes:
        root: folder of pyproject.toml.
    """

    root: Path = ROOT

    @cached_property
    def modules(self) -> Mapping[str, Module]:
        """All modules of the package by name, in order."""
        return self.area(PACKAGE)

    def area(self, folder: str) -> Mapping[str, Module]:
        """Return all modules below a folder by name, in order."""
        paths = [path for path in sorted((self.root / folder).rglob("*.py")) if path.parent.name != SCRIPTS]
        names = (".".join(path.relative_to(self.root).with_suffix("").parts) for path in paths)
        return {name.removesuffix(".__init__"): read_module(path) for name, path in zip(names, paths, strict=True)}

    @cached_property
    def layers(self) -> Mapping[str, Sequence[Sequence[str]]]:
        """Full names of what stands on each layer, from the top, for each package that has an order."""
        return {
            container: [
                [f"{container}.{name}" for name in re.split(r"[:|]", layer.replace(" ", ""))]
                for layer in contract["layers"]
            ]
            for contract in self._contracts("layers")
            for container in contract["containers"]
        }

    @cached_property
    def features(self) -> Sequence[str]:
        """Full names of the packages that are features."""
        return [f"{PACKAGE}.{path.parent.name}" for path in sorted((self.root / PACKAGE).glob("*/feature.toml"))]

    @cached_property
    def optional(self) -> Sequence[str]:
        """Modules that the core does without: features, and those that a contract names."""
        alone = (each for each in self._contracts("forbidden") if each["name"] == "The core stands alone")
        return [*self.features, *(name for contract in alone for name in contract["forbidden_modules"])]

    def upwards(self) -> Iterator[tuple[str, str]]:
        """Yield module and what it imports where that stands on a higher layer, within a function too.

        Features stand above all, and none imports another.
        """
        for name, module in self.modules.items():
            for target in dict.fromkeys(self._target(*each) for each in module.imports):
                if any(within(target, each) and not within(name, each) for each in self.features):
                    yield name, target
                for container in self.layers:
                    if all(each.startswith(f"{container}.") for each in (name, target)) and (
                        self._layer(container, target) < self._layer(container, name)
                    ):
                        yield name, target

    def unlisted(self) -> Iterator[str]:
        """Yield modules that are neither on a layer nor part of a feature."""
        known = [*self.features, *(name for layer in self.layers[PACKAGE] for name in layer)]
        for name in self.modules:
            if name != PACKAGE and not any(within(name, each) for each in known):
                yield name

    def picture(self) -> Iterator[str]:
        """Yield the imports between the folders of the package as Mermaid, those that others imply left out."""
        folders = {name.split(".")[1] for name in self.modules if name.count(".") > 1}
        below: defaultdict[str, set[str]] = defaultdict(set)
        for name, module in self.modules.items():
            for target in (self._target(*each) for each in module.imports):
                upper, lower = (each.split(".")[1] if "." in each else each for each in (name, target))
                if upper != lower and {upper, lower} <= folders:
                    below[upper].add(lower)
        yield "flowchart TD"
        for upper in sorted(below):
            implied = set[str]().union(*(reached(below, lower) for lower in below[upper]))
            if drawn := sorted(below[upper] - implied):
                yield f"    {upper} --> {' & '.join(drawn)}"

    def _layer(self, container: str, module: str) -> int:
        """Return on which layer a module stands, counted from the top: features above, what is not listed lowest."""
        layers = [self.features, *self.layers[container]]
        found = (at for at, layer in enumerate(layers) if any(within(module, name) for name in layer))
        return next(found, len(layers) - 1)

    def _target(self, module: str, name: str) -> str:
        """Return the module that an import names."""
        whole = f"{module}.{name}"
        return whole if whole in self.modules else module

    def core(self) -> Mapping[str, Module]:
        """Return the modules that the main job needs, without the optional ones."""
        return self.needed(*(name for name in CORE if name in self.modules[PACKAGE].passes_on))

    def needed(self, *starts: str) -> Mapping[str, Module]:
        """Return the modules that names which the package passes on need, without the optional ones.

        What a package passes on is looked up where it is made, so that its other names are not counted.
        """
        found: dict[str, Module] = {}
        pending = [self._source(PACKAGE, start) for start in starts]
        while pending:
            name = pending.pop()
            if name not in found and not any(within(name, one) for one in self.optional):
                found[name] = self.modules[name]
                pending += [self._source(*each) for each in self.modules[name].imports]
        return found

    def _source(self, module: str, name: str) -> str:
        """Return the module in which a name is made."""
        while module in self.modules and name in self.modules[module].passes_on:
            module, name = self.modules[module].passes_on[name]
        return self._target(module, name)

    def _contracts(self, kind: str) -> Iterator[dict[str, Any]]:
        contents = tomllib.loads((self.root / "pyproject.toml").read_text(encoding="utf-8"))
        return (each for each in contents["tool"]["importlinter"]["contracts"] if each["type"] == kind)

    def retired_words(self) -> Sequence[tuple[str, str]]:
        """Return the words of the glossary that are not said any more, each with what is said instead."""
        text = (self.root / CONTRIBUTING).read_text(encoding="utf-8")
        rows = text[text.index(GLOSSARY) :].split("\n\n")[0].splitlines()[2:]
        cells = [line.strip("| ").split("|") for line in rows]
        return [(word, say.strip()) for say, words in cells for word in re.findall(r"`([^`]+)`", words)]

    def count_word(self, word: str) -> Mapping[str, int]:
        """Return how often each module says a word, in text or as a part of a name such as `TipWay` or `way_back`."""
        first, rest = re.escape(word[0]), re.escape(word[1:])
        pattern = re.compile(rf"(?:(?<![A-Za-z]){first}|(?<![A-Z]){first.upper()}){rest}(?![a-z])")
        counts = {
            name: len(pattern.findall(module.path.read_text(encoding="utf-8"))) for name, module in self.modules.items()
        }
        return {name: count for name, count in counts.items() if count}

    def shared_names(self) -> Iterator[str]:
        """Yield a line for each name that two classes of the package have."""
        owners: defaultdict[str, list[str]] = defaultdict(list)
        for module, each in self.modules.items():
            for name in each.classes:
                owners[name].append(module)
        for name, modules in sorted(owners.items()):
            if len(modules) > 1:
                yield f"{name} is a class of {' and of '.join(modules)}"


def main() -> None:
    """Print the sizes, or the words."""
    parser = script_parser(__doc__, smoke="the same: it takes seconds")
    parser.add_argument("--at", metavar="REVISION", help="also the sizes at this commit, and the changes since")
    parser.add_argument("--words", action="store_true", help="count retired words and shared names instead")
    parser.add_argument("--picture", action="store_true", help="draw the imports between packages instead")
    arguments = parser.parse_args()
    lines = size_tables(arguments.at)
    if arguments.words:
        lines = words(CodeBase())
    if arguments.picture:
        lines = CodeBase().picture()
    print(*lines, sep="\n")


def size_tables(revision: str | None) -> Iterator[str]:
    """Yield the table of sizes; with a revision also that of the commit, and the changes since in percent."""
    now = sizes(CodeBase())
    yield from size_table("now", now, digits=0)
    if revision is not None:
        with tempfile.TemporaryDirectory() as folder:
            extract_commit(revision, Path(folder))
            then = sizes(CodeBase(Path(folder)))
        yield from size_table(f"at {revision}", then, digits=0)
        changes = {
            area: {size: 100.0 * (value / then[area][size] - 1.0) for size, value in row.items()}
            for area, row in now.items()
        }
        yield from size_table("change [%]", changes, digits=1)


def size_table(title: str, values: Mapping[str, Mapping[str, float]], *, digits: int) -> Iterator[str]:
    """Yield a table with a row for each area."""
    yield from table(title, *SIZES)
    for area, of_area in values.items():
        cells = (f"{of_area[size]:.{max(digits, int('%' in size))}f}" if size in of_area else "" for size in SIZES)
        yield row(area, *cells)


def sizes(code_base: CodeBase) -> Mapping[str, Mapping[str, float]]:
    """Return the sizes of each area by their names; lines of the core for the package alone."""
    found: dict[str, dict[str, float]] = {}
    for area in AREAS:
        modules = (code_base.modules if area == PACKAGE else code_base.area(area)).values()
        code = sum(each.code for each in modules)
        values = (
            len(modules),
            len({each.path.parent for each in modules}),
            code,
            sum(each.lines for each in modules),
            sum(len(each.classes) for each in modules),
            100.0 * sum(each.import_lines for each in modules) / code,
            max(each.longest_function for each in modules),
        )
        found[area] = dict(zip(SIZES, values, strict=False))
    found[PACKAGE]["core lines"] = sum(each.code for each in code_base.core().values())
    return found


def extract_commit(revision: str, folder: Path) -> None:
    """Write the tree of a commit into a folder.

    Raises:
        SystemExit: git knows no such commit.
    """
    packed = subprocess.run(  # noqa: S603  (a commit of this tree)
        ["git", "archive", revision],  # noqa: S607
        cwd=ROOT, capture_output=True, check=False,
    )  # fmt: skip
    if packed.returncode:
        raise SystemExit(packed.stderr.decode().strip())
    with tarfile.open(fileobj=io.BytesIO(packed.stdout)) as archive:
        archive.extractall(folder, filter="data")


def words(code_base: CodeBase) -> Iterator[str]:
    """Yield how often each retired word is said, and which names two classes share."""
    yield from table("not", "say", "times", "modules")
    for word, better in code_base.retired_words():
        counts = code_base.count_word(word)
        yield row(word, better, str(sum(counts.values())), str(len(counts)))
    yield from code_base.shared_names()


def reached(below: Mapping[str, Collection[str]], start: str) -> set[str]:
    """Return what is reached from a start along one arrow or more; there are no circles."""
    return set[str]().union(*({lower} | reached(below, lower) for lower in below.get(start, ())))


def within(name: str, package: str) -> bool:
    """Return whether a module is a package or stands in it."""
    return name == package or name.startswith(f"{package}.")


def read_module(path: Path) -> Module:
    """Read one file."""
    text = path.read_text(encoding="utf-8")
    nodes = _statements(ast.parse(text))
    documented = [
        node.body[0]
        for node in nodes
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        and ast.get_docstring(node, clean=False)
    ]
    importing = [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    docstrings = _lines_of(documented)
    lines = text.splitlines()
    types_only = _statements(*(node for node in nodes if _is_for_types(node)))
    own = (node for node in importing if isinstance(node, ast.ImportFrom) and within(node.module or "", PACKAGE))
    named = [(node, cast("str", node.module), each) for node in own for each in node.names]
    return Module(
        path,
        lines=len(lines),
        code=sum(
            1 for at, line in enumerate(lines, 1) if at not in docstrings and line.strip() and line.strip()[0] != "#"
        ),
        import_lines=len(_lines_of(importing)),
        longest_function=max((len(_lines_of([node])) for node in functions), default=0),
        classes=[node.name for node in nodes if isinstance(node, ast.ClassDef)],
        imports=[(module, each.name) for node, module, each in named if node not in types_only],
        passes_on={
            each.asname or each.name: (module, each.name)
            for node, module, each in named
            if path.name == "__init__.py" and node.col_offset in {0, 4} and module != PACKAGE
        },
    )


def _is_for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def _lines_of(nodes: Sequence[ast.stmt]) -> set[int]:
    """Return the numbers of the lines that statements stand in."""
    return {line for node in nodes for line in range(node.lineno, (node.end_lineno or 0) + 1)}


def _statements(*roots: ast.AST) -> Sequence[ast.AST]:
    """Return nodes, their statements and what holds some of them; expressions, of which there are far more, do not."""
    found: list[ast.AST] = []
    pending = deque(roots)
    while pending:
        found.append(node := pending.popleft())
        for name in node._fields:
            value: object = getattr(node, name, None)
            if (
                isinstance(value, list)
                and value
                and isinstance(value[0], ast.stmt | ast.excepthandler | ast.match_case)
            ):
                pending.extend(cast("list[ast.AST]", value))
    return found


if __name__ == "__main__":
    main()
