"""Do the tests notice when the code is wrong? Small changes, each against the tests that reach it.

    python -m benchmarks.mutants [MODULE ...] [--seed N] [--count N] [--tests PATH ...] [--limit S]
        [--seconds S] [--smoke]

A MODULE is a file or folder of the package, such as geoprint/robot/collision; without any, the packages that
keep people safe. Of each file a number of mutants is drawn (`syntax`, `templates`) and tried in a copy of the tree
(`trying`) against the tests that reach the changed line (`reaching`), the quickest first, as many as fit into half of
the limit.
Outcomes are kept by content, so that only what has changed is tried again. What takes longer than the limit has timed
out, which counts for itself. Mutation tools of others change the tree in
place and try every mutant on the whole suite, or leave out what is decorated, constants and texts; here one is tried
in a second or two. What survives is either no fault (an equivalent, a mere matter of cost) or a test that is missing.

With --seconds it is done by then, on a machine without records as well: nothing is recorded, each mutant is tried
against the files of tests of its package, those that speak of its module first, for a tenth of the time at most.
"""

from __future__ import annotations

import math
import os
import random
import re
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

from benchmarks import ROOT
from benchmarks.mutants.reaching import READ_BY, Record, reaching_tests, records
from benchmarks.mutants.syntax import Mutant, mutants_of, mutants_of_text
from benchmarks.mutants.trying import KILLED, LATE, SURVIVED, UNSEEN, Outcome, Trial, tried
from benchmarks.parts.tables import row, script_parser, table

SAFETY = (
    "geoprint/robot/collision", "geoprint/robot/controller", "geoprint/robot/timing", "geoprint/postprocessor/rapid",
    "geoprint/config/cell_file.py", "geoprint/workflow/workpiece.py",
)  # fmt: skip
# Tests of other packages that hold a module besides those of its own.
BESIDES = {
    "geoprint/robot": ("tests/benchmarks/test_collisions.py",),
    "geoprint/postprocessor": ("tests/workflow/test_checking.py", "tests/benchmarks/test_destruction.py"),
    "geoprint/config": ("tests/cli", "tests/workflow/test_cell_writer.py"),
    "geoprint/workflow/workpiece.py": ("tests/robot/test_other_arms.py",),
    "geoprint/reporting": ("tests/workflow/test_comparison.py",),
    "geoprint/toolpath": ("tests/workflow/test_travel.py",),
}


def main() -> None:
    """Print the table."""
    parser = script_parser(__doc__, smoke="a mutant of one small module")
    parser.add_argument("modules", nargs="*", metavar="MODULE", help="files or folders of the package")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the draw")
    parser.add_argument("--count", type=int, default=20, metavar="N", help="mutants of each file")
    parser.add_argument("--all-together", action="store_true", help="that many of all files together")
    parser.add_argument("--tests", nargs="*", metavar="PATH", help="files or folders of tests that are recorded")
    parser.add_argument("--limit", type=float, default=120.0, metavar="S", help="seconds that a mutant may take")
    parser.add_argument("--seconds", type=float, metavar="S", help="in which all ends; records nothing")
    arguments = parser.parse_args()
    modules = ["geoprint/robot/collision/surroundings.py"] if arguments.smoke else arguments.modules or SAFETY
    tests: list[str] | None = ["tests/robot/collision/test_sides.py"] if arguments.smoke else arguments.tests
    count: int = 1 if arguments.smoke else arguments.count
    seconds: float = arguments.seconds or math.inf
    limit: float = min(arguments.limit, seconds / 10)
    end = time.monotonic() + seconds
    chosen = drawn(modules, seed=arguments.seed, count=count, together=arguments.all_together)
    for line in table("file", "line", "change", "outcome", "by"):
        print(line, flush=True)
    outcomes: list[Outcome] = []
    with tempfile.TemporaryDirectory(dir=ROOT.parent, prefix="mutants-") as scratch:
        hurried = arguments.seconds is not None
        trials = map(nearest, chosen) if hurried else trials_of(chosen, tests=tests, seconds=limit / 2)
        processors = os.cpu_count() or 1
        for outcome in tried(ROOT, trials, scratch=Path(scratch), limit=limit, processors=processors, end=end):
            outcomes.append(outcome)
            mutant = outcome.mutant
            print(row(mutant.file, str(mutant.line), mutant.what[:160], outcome.verdict, outcome.why), flush=True)
    for line in summary(outcomes):
        print(line)


def drawn(modules: Iterable[str], *, seed: int, count: int, together: bool) -> list[Mutant]:
    """Return mutants of files, or of the files below folders: so many of each, or of all together."""
    every = [every_mutant(file) for file in _files(modules)]
    if together:
        every = [[mutant for mutants in every for mutant in mutants]]
    return [one for mutants in every for one in random.Random(seed).sample(mutants, min(count, len(mutants)))]  # noqa: S311


def every_mutant(file: str) -> list[Mutant]:
    """Return all mutants of a module or template."""
    text = (ROOT / file).read_text(encoding="utf-8")
    return mutants_of(file, text) if file.endswith(".py") else mutants_of_text(file, text)


def trials_of(mutants: Iterable[Mutant], *, tests: list[str] | None, seconds: float) -> Iterator[Trial]:
    """Yield mutants with the tests that reach them, the quickest first, as many as take so many seconds together."""
    known: dict[str, list[Record]] = {}
    for mutant in mutants:
        module = READ_BY.get(mutant.file, mutant.file)
        if module not in known:
            known[module] = records(ROOT, _test_files(tests or _tests_beside(module)), module=module)
        source = (ROOT / mutant.file).read_text(encoding="utf-8")
        every = reaching_tests(mutant.line, module=mutant.file, source=source, known=known[module])
        took = {test: second for record in known[module] for test, second in record.seconds.items()}
        fitting: list[str] = []
        for test in every:
            if fitting and sum(took[each] for each in fitting) + took[test] > seconds:
                break
            fitting.append(test)
        yield Trial(mutant, tuple(fitting), len(every) - len(fitting))


def nearest(mutant: Mutant) -> Trial:
    """Return a mutant with the files of tests that bear its module's name, those that speak of it, its package's."""
    module = READ_BY.get(mutant.file, mutant.file)
    name = Path(module).stem
    files = _test_files(_tests_beside(module))
    own = [file for file in files if Path(file).stem.startswith(f"test_{name}")]
    word = re.compile(rf"\b{name}\b")
    others = [file for file in files if file not in own and word.search((ROOT / file).read_text(encoding="utf-8"))]
    return Trial(mutant, tuple(dict.fromkeys([*own, *others, *files])), 0, recorded=False)


def summary(outcomes: list[Outcome]) -> Iterator[str]:
    """Yield how many mutants of each file were killed, and which share: without those that timed out, and with them."""
    verdicts = (KILLED, SURVIVED, LATE, UNSEEN)
    counts = Counter((outcome.mutant.file, outcome.verdict) for outcome in outcomes)
    yield from table("file", *verdicts, "share killed", "or timed out")
    files = sorted({file for file, _ in counts})
    for file in [*files, "all"]:
        found = [sum(counts[each, verdict] for each in (files if file == "all" else [file])) for verdict in verdicts]
        shares = [100 * killed / max(sum(found), 1) for killed in (found[0], found[0] + found[2])]
        yield row(file, *map(str, found), *(f"{share:.0f} %" for share in shares))


def _files(modules: Iterable[str]) -> list[str]:
    """Return modules and templates at or below paths of the tree."""
    found: list[str] = []
    for module in modules:
        path = ROOT / module
        files = sorted(path.rglob("*.py")) if path.is_dir() else [path]
        files += [ROOT / file for file in READ_BY if path.is_dir() and (ROOT / file).is_relative_to(path)]
        found += [str(file.relative_to(ROOT)) for file in files if file.name != "__init__.py"]
    return found


def _tests_beside(module: str) -> list[str]:
    """Return the tests of a module's package, the nearest folder of tests, and those that hold it besides."""
    parts = Path(module).parts[1:-1]
    while not (ROOT / "tests" / Path(*parts)).is_dir():
        parts = parts[:-1]
    besides = [test for place, tests in BESIDES.items() if module.startswith(place) for test in tests]
    return [str(Path("tests", *parts)), *besides]


def _test_files(paths: Iterable[str]) -> list[str]:
    found: list[str] = []
    for path in paths:
        files = sorted((ROOT / path).rglob("test_*.py")) if (ROOT / path).is_dir() else [ROOT / path]
        found += [str(file.relative_to(ROOT)) for file in files]
    return list(dict.fromkeys(found))


if __name__ == "__main__":
    main()
