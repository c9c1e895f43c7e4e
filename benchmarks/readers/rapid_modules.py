"""Reads RAPID modules that others wrote: what the parser and the symbol table make of them.

    python -m benchmarks.readers.rapid_modules FOLDER [--open-names]
    python -m benchmarks.readers.rapid_modules --smoke

FOLDER has a folder for each project (`owner+name`); the modules of a folder below are one task (several, where they
declare the same names: each with all modules that it can have), read as open: names that other modules of the project
may declare are not judged. The table counts modules, lines and findings of each project; each finding follows. A
finding is an error of that text or of geoprint's, which a person has to say.
"""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from benchmarks.parts.tables import script_parser
from geoprint.errors import VerificationError
from geoprint.postprocessor.rapid.language.names import declared
from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.language.symbols import examine
from geoprint.postprocessor.rapid.language.syntax import Module

# Folders in which a backup keeps the program modules and the system modules of a task.
HALVES = {"PROGMOD", "SYSMOD"}
SUFFIXES = {".mod", ".sys", ".modx", ".sysx", ".prg"}


def main() -> None:
    """Print the table and all findings."""
    parser = script_parser(__doc__, smoke="a module of one line only, to see that the script runs")
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--open-names", action="store_true", help="print names that nothing declares, too")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder: Path | None = options.folder
        if folder is None and not options.smoke:
            parser.error("give the FOLDER of the projects, or --smoke")
        _tell(folder or _smallest(Path(scratch)), open_names=options.open_names)


def _smallest(scratch: Path) -> Path:
    """Write the smallest project there is."""
    (scratch / "own+smallest").mkdir()
    (scratch / "own+smallest" / "Main.mod").write_text(
        "MODULE Main\nPROC main()\nENDPROC\nENDMODULE\n", encoding="ascii"
    )
    return scratch


def _tell(every: Path, *, open_names: bool) -> None:
    print(f"{'project':52} {'modules':>7} {'lines':>7} {'findings':>8}")
    findings: list[str] = []
    names: Counter[str] = Counter()
    for project in sorted(path for path in every.iterdir() if path.is_dir()):
        modules = lines = found = 0
        for folder in _folders(project):
            read, errors = _read(folder)
            modules += len(read)
            lines += sum(module.lines for module in read)
            for task in _tasks(read):
                resolved, judged = examine(task, signals=None, closed=False)
                errors += [error for error in judged if str(error) not in {str(known) for known in errors}]
                names.update(name.lower() for _, _, name in resolved.open_names)
            found += len(errors)
            findings += [f"{folder.relative_to(every)}: {_said(error)}" for error in errors]
        print(f"{project.name:52} {modules:7d} {lines:7d} {found:8d}")
    print(*findings, sep="\n")
    if open_names:
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
    """Divide the modules of a folder into tasks: each with all modules that declare no name of it again."""
    tasks: list[list[Module]] = []
    left = modules
    while left:
        task: list[Module] = []
        taken: set[str] = set()
        for module in [*left, *(one for one in modules if one not in left)]:
            if taken.isdisjoint(_names(module)):
                task.append(module)
                taken.update(_names(module))
        tasks.append(task)
        left = [module for module in left if module not in task]
    return tasks


def _names(module: Module) -> set[str]:
    names = {symbol.name.lower() for symbol, is_local in declared(module) if not is_local}
    return names | {f"module {module.name.lower()}"}


def _said(error: VerificationError) -> str:
    """Return what is wrong, without the advice to write the program again."""
    return str(error).partition(". Do not run")[0]


def _folders(project: Path) -> list[Path]:
    """Return the folders of a project; a backup keeps a task's modules in two, which count as the one above."""
    folders = [project, *(path for path in project.rglob("*") if path.is_dir())]
    return sorted(folder for folder in folders if folder.name.upper() not in HALVES)


def _files(folder: Path) -> Iterator[Path]:
    halves = (path for path in folder.iterdir() if path.is_dir() and path.name.upper() in HALVES)
    paths = (path for one in (folder, *halves) for path in one.iterdir())
    return (path for path in sorted(paths) if path.is_file() and path.suffix.lower() in SUFFIXES)


def _text(path: Path) -> str:
    content = path.read_bytes()
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        return content.decode("latin-1")


if __name__ == "__main__":
    main()
