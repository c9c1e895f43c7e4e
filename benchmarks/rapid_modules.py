"""Reads RAPID modules that others wrote: what the parser and the symbol table make of them.

    python -m benchmarks.rapid_modules FOLDER [--open-names]

FOLDER has a folder for each project (`owner+name`); the modules of a folder below are one task (several, where they
declare the same names), read as open: names that other modules of the project may declare are not judged. The table
counts modules, lines and findings of each project; each finding follows. A finding is an error of that text or of
geoprint's, which a person has to say.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from geoprint.errors import VerificationError
from geoprint.export.rapid.language.names import declared
from geoprint.export.rapid.language.parsing import parse_module
from geoprint.export.rapid.language.symbols import examine
from geoprint.export.rapid.language.syntax import Module

SUFFIXES = {".mod", ".sys", ".modx", ".sysx", ".prg"}


def main() -> None:
    """Print the table and all findings."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--open-names", action="store_true", help="print names that nothing declares, too")
    options = parser.parse_args()
    print(f"{'project':52} {'modules':>7} {'lines':>7} {'findings':>8}")
    findings: list[str] = []
    names: Counter[str] = Counter()
    for project in sorted(path for path in options.folder.iterdir() if path.is_dir()):
        modules = lines = found = 0
        for folder in [project, *sorted(path for path in project.rglob("*") if path.is_dir())]:
            read, errors = _read(folder)
            modules += len(read)
            lines += sum(module.lines for module in read)
            for task in _tasks(read):
                resolved, judged = examine(task, signals=None, closed=False)
                errors += judged
                names.update(name.lower() for _, _, name in resolved.open_names)
            found += len(errors)
            findings += [f"{folder.relative_to(options.folder)}: {_said(error)}" for error in errors]
        print(f"{project.name:52} {modules:7d} {lines:7d} {found:8d}")
    print(*findings, sep="\n")
    if options.open_names:
        print(*(f"{count:5d} {name}" for name, count in names.most_common()), sep="\n")


def _read(folder: Path) -> tuple[list[Module], list[VerificationError]]:
    modules: list[Module] = []
    errors: list[VerificationError] = []
    for path in _files(folder):
        try:
            modules.append(parse_module(path.name, _text(path)))
        except VerificationError as error:
            errors.append(error)
    return modules, errors


def _tasks(modules: list[Module]) -> list[list[Module]]:
    """Divide the modules of a folder into tasks; what declares a name of a task again is of another one."""
    tasks: list[tuple[list[Module], set[str]]] = []
    for module in modules:
        names = {symbol.name.lower() for symbol, is_local in declared(module) if not is_local}
        names.add(f"module {module.name.lower()}")
        task = next((task for task in tasks if task[1].isdisjoint(names)), None)
        if task is None:
            tasks.append(([module], names))
        else:
            task[0].append(module)
            task[1].update(names)
    return [task for task, _ in tasks]


def _said(error: VerificationError) -> str:
    """Return what is wrong, without the advice to write the program again."""
    return str(error).partition(". Do not run")[0]


def _files(folder: Path) -> Iterator[Path]:
    return (path for path in sorted(folder.iterdir()) if path.is_file() and path.suffix.lower() in SUFFIXES)


def _text(path: Path) -> str:
    content = path.read_bytes()
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        return content.decode("latin-1")


if __name__ == "__main__":
    main()
