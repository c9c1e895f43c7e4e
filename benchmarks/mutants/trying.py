"""Runs tests against mutants, each in a copy of the tree and in a process of its own, on all processors.

The working tree is never touched. A copy keeps what numba compiled, but for kernels that a changed module may have gone
into. The libraries are imported once, before the processes fork.
"""

from __future__ import annotations

import importlib
import json
import math
import os
import re
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import cast, final

import pytest

from benchmarks.mutants.reaching import digest, kept
from benchmarks.mutants.syntax import Mutant

COPIED = (
    "geoprint", "tests", "benchmarks", "data", ".github", ".ci", "pyproject.toml", "README.md", "CHANGELOG.md",
    "CITATION.cff", "LICENSE", "MANIFEST.in",
)  # fmt: skip
LIBRARIES = (
    "numpy", "scipy.sparse.linalg", "scipy.spatial", "scipy.optimize", "scipy.interpolate", "numba", "trimesh",
    "pinocchio", "fcl", "toppra", "pydantic", "typer", "tomlkit", "rich",
)  # fmt: skip
# A library that was imported before the tests cannot be rewritten, and need not be.
_QUIET = ("-W", "ignore::pytest.PytestAssertRewriteWarning")
KILLED, SURVIVED, LATE, UNSEEN = "killed", "survived", "timed out", "not looked at"


@final
@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a mutant: killed by which test, survived how many, timed out, or not looked at and why."""

    mutant: Mutant
    verdict: str
    why: str


@final
@dataclass(frozen=True, slots=True)
class Trial:
    """A mutant and the tests that are tried on it, in their order; how long they take is known if recorded."""

    mutant: Mutant
    tests: tuple[str, ...]
    left_out: int
    recorded: bool = True

    def key(self, root: Path) -> str:
        """Return what its outcome is kept under: the whole package with the change, and the tests."""
        files = sorted({test.split("::", maxsplit=1)[0] for test in self.tests})
        package = sorted((root / "geoprint").rglob("*.py"))
        parts = [self.mutant.source.encode(), "\n".join(self.tests).encode()]
        return digest(*parts, *((root / file).read_bytes() for file in files), *(file.read_bytes() for file in package))


def tried(
    root: Path, trials: Iterable[Trial], *, scratch: Path, limit: float, processors: int, end: float = math.inf
) -> Iterator[Outcome]:
    """Yield what became of mutants, as it is known.

    Args:
        root: of the working tree.
        trials: mutants with their tests.
        scratch: an empty folder on the same disc.
        limit: that each may take [s]; what takes longer has timed out, which no test has said to be wrong: it may go on
            for ever, or the machine be busy. Where its tests were not recorded it counts as not looked at.
        processors: how many are tried at once.
        end: of all, on the monotonic clock [s]; what is not done by then counts as not looked at.
    """
    waiting: list[tuple[Trial, Path]] = []
    for trial in trials:
        place = kept() / f"verdict-{trial.key(root)}.json"
        if not trial.tests:
            yield Outcome(trial.mutant, UNSEEN, "no test of those that were recorded reaches it")
        elif place.exists():
            yield Outcome(trial.mutant, *cast("list[str]", json.loads(place.read_text(encoding="utf-8"))))
        else:
            waiting.append((trial, place))
    if not waiting:
        return
    for library in LIBRARIES:
        with suppress(ImportError):
            importlib.import_module(library)
    runs = _run(root, waiting, scratch=scratch, limit=limit, processors=processors, end=end)
    for trial, verdict, why, place in runs:
        # What has timed out may come to an end another time.
        if verdict in {KILLED, SURVIVED}:
            place.write_text(json.dumps([verdict, why]), encoding="utf-8")
        yield Outcome(trial.mutant, verdict, why)


def _run(
    root: Path, waiting: list[tuple[Trial, Path]], *, scratch: Path, limit: float, processors: int, end: float
) -> Iterator[tuple[Trial, str, str, Path]]:
    """Fork a process for each trial, so many at once, and yield how it ended."""
    free = [copied(root, scratch / f"tree-{number}") for number in range(min(processors, len(waiting)))]
    running: dict[int, tuple[Trial, Path, Path, float]] = {}
    left = list(waiting)
    while left or running:
        if time.monotonic() > end:
            yield from ((trial, UNSEEN, "no time was left", place) for trial, place in left)
            left.clear()
        while left and free:
            trial, place = left.pop(0)
            tree = free.pop()
            _put(tree, trial.mutant)
            running[_forked(tree, trial.tests)] = (trial, place, tree, min(time.monotonic() + limit, end))
        time.sleep(0.05)
        for process, (trial, place, tree, last) in list(running.items()):
            ended, status = os.waitpid(process, os.WNOHANG)
            late = not ended and time.monotonic() > last
            if not ended and not late:
                continue
            if late:
                os.killpg(process, signal.SIGKILL)
                os.waitpid(process, 0)
            del running[process]
            verdict, why = _verdict(tree, trial, status=os.waitstatus_to_exitcode(status), late=late, limit=limit)
            _put_back(root, tree, trial.mutant.file)
            free.append(tree)
            yield trial, verdict, why, place


def copied(root: Path, tree: Path) -> Path:
    """Return a copy of what the tests need of the working tree."""
    tree.mkdir(parents=True)
    for name in COPIED:
        if (root / name).is_dir():
            shutil.copytree(root / name, tree / name)
        elif (root / name).exists():
            shutil.copy2(root / name, tree / name)
    # Real hearts, which are not part of the project, lie beside the tree.
    shared = root.parent / "shared"
    beside = tree.parent / "shared"
    if shared.exists() and not beside.exists():
        beside.symlink_to(shared.resolve())
    return tree


def _put(tree: Path, mutant: Mutant) -> None:
    """Change a file of a copy, and forget what was compiled of it."""
    path = tree / mutant.file
    path.unlink()
    path.write_text(mutant.source, encoding="utf-8")
    if "njit" not in mutant.source:
        return
    names = {Path(mutant.file).stem}
    sources = {file: file.read_text(encoding="utf-8") for file in (tree / "geoprint").rglob("*.py")}
    grown = True
    while grown:
        found = {
            file.stem for file, text in sources.items() if "njit" in text and names & set(re.findall(r"\w+", text))
        }
        grown = not found <= names
        names |= found
    for file in (tree / "geoprint").rglob("*.nb[ic]"):
        if file.name.split(".")[0].split("-")[0] in names:
            file.unlink()


def _put_back(root: Path, tree: Path, file: str) -> None:
    for kernel in (tree / Path(file).parent / "__pycache__").glob(f"{Path(file).stem}.*"):
        kernel.unlink()
    (tree / file).unlink()
    shutil.copy2(root / file, tree / file)


def _forked(tree: Path, tests: tuple[str, ...]) -> int:
    """Run tests in a copy of the tree, in a process that ends with their status; return its number."""
    sys.stdout.flush()
    process = os.fork()
    if process:
        return process
    status = 70
    try:
        os.setpgid(0, 0)
        os.chdir(tree)
        out = os.open(tree / "said.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(out, 1)
        os.dup2(out, 2)
        sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
        sys.path[:] = [str(tree), *(path for path in sys.path[1:] if path)]
        os.environ["PYTHONPATH"] = str(tree)
        os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
        os.environ["PYTEST_ADDOPTS"] = ""
        sys.dont_write_bytecode = True
        for name in [name for name in sys.modules if name.split(".")[0] in {"geoprint", "benchmarks", "tests"}]:
            del sys.modules[name]
        status = int(
            pytest.main(
                ["-q", "-x", "-m", "not fuzz", "--tb=line", "-p", "no:dash", "-p", "no:cacheprovider", *_QUIET, *tests]
            )
        )
        sys.stdout.flush()
    except BaseException:  # Whatever it is, this process must not go on as its parent would.
        Path(tree, "said.txt").write_text(traceback.format_exc(), encoding="utf-8")
    finally:
        os._exit(status)


def _verdict(tree: Path, trial: Trial, *, status: int, late: bool, limit: float) -> tuple[str, str]:
    said = (tree / "said.txt").read_text(encoding="utf-8", errors="replace") if (tree / "said.txt").exists() else ""
    if late and not trial.recorded:
        return UNSEEN, f"no test failed within {limit:.0f} s or before the end"
    if late:
        return LATE, f"not done within {limit:.0f} s"
    if status == 0:
        rest = f", {trial.left_out} more left out" if trial.left_out else ""
        return SURVIVED, f"{len(trial.tests)} tests{rest}"
    found = re.search(r"^(FAILED|ERROR) (\S+)", said, re.MULTILINE)
    # A file that cannot be collected ends as an interruption, or as a test of it that is not found.
    ended = {pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.INTERRUPTED, pytest.ExitCode.USAGE_ERROR}
    if status in ended and found:
        return KILLED, found[2]
    return UNSEEN, f"the tests ended with status {status}: {' '.join(said.split())[-200:]}"
