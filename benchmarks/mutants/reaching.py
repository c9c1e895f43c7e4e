"""Which tests reach a line: recorded once for each file of tests, and kept beside the user's caches.

A record of a file of tests holds for a module of the package as long as both have the same bytes; what else has
changed since may only change which tests are tried.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast, final

import pytest

from benchmarks import ROOT
from benchmarks.mutants.syntax import kernel_lines, top_lines

SET_UP = "|set up"
# Files that are read by a module rather than imported: their tests are those of the module.
READ_BY = {
    "geoprint/postprocessor/rapid/geo_guard.mod": "geoprint/postprocessor/rapid/guard.py",
    "geoprint/postprocessor/rapid/geo_resident.sys": "geoprint/postprocessor/rapid/guard.py",
}


@final
@dataclass(frozen=True, slots=True)
class Record:
    """What a file of tests reaches.

    Attributes:
        seconds: of each of its tests.
        lines: the tests that reach each line, by file of the package.
        modules: the bytes of each such file, as a hash.
    """

    seconds: dict[str, float]
    lines: dict[str, dict[str, list[str]]]
    modules: dict[str, str]


def kept() -> Path:
    """Return the folder of the user in which records and results are kept."""
    folder = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "geoprint-mutants"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def digest(*parts: bytes) -> str:
    """Return a short hash of some bytes."""
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:24]


def records(root: Path, tests: Iterable[str], *, module: str) -> list[Record]:
    """Return what files of tests reach; those without a record that holds for a module are run once."""
    current = digest((root / module).read_bytes())
    found: dict[str, Record] = {}
    missing: list[str] = []
    for test in tests:
        path = _place(root, test)
        known = Record(**json.loads(path.read_text(encoding="utf-8"))) if path.exists() else None
        if known is not None and known.modules.get(module, current) == current:
            found[test] = known
        else:
            missing.append(test)
    return [*found.values(), *_recorded(root, missing)]


def reaching_tests(line: int, *, module: str, source: str, known: Sequence[Record]) -> list[str]:
    """Return the tests that reach a line, the quickest first; then the others of what their set-up reaches it for.

    What is executed as the module is imported, and what is compiled, is reached by whatever reaches the module.
    """
    anywhere = line in top_lines(source) | kernel_lines(source) if module.endswith(".py") else True
    reached_file = READ_BY.get(module, module)
    direct: dict[str, float] = {}
    shared: dict[str, float] = {}
    for record in known:
        lines = record.lines.get(reached_file, {})
        nodes = {node for tests in lines.values() for node in tests} if anywhere else set(lines.get(str(line), []))
        direct |= {node: record.seconds[node] for node in nodes if node in record.seconds}
        # Who only reads a constant reaches no line.
        if (anywhere and nodes) or any(node.endswith(SET_UP) for node in nodes):
            shared |= record.seconds
    if not any(record.lines.get(reached_file) for record in known):
        # A module that is only imported, whose lines no test executes.
        imported = [record for record in known if reached_file in record.modules]
        shared = {node: took for record in imported for node, took in record.seconds.items()}
    later = {node: took for node, took in shared.items() if node not in direct}
    return [*sorted(direct, key=direct.__getitem__), *sorted(later, key=later.__getitem__)]


def _place(root: Path, test: str) -> Path:
    plugin = Path(__file__).with_name("recording.py").read_bytes()
    return kept() / f"reached-{digest(test.encode(), (root / test).read_bytes(), plugin)}.json"


def _recorded(root: Path, tests: list[str]) -> list[Record]:
    """Run files of tests, half of them on each processor, and keep what they reach."""
    lanes = [lane for lane in (tests[::2], tests[1::2]) if lane]
    outs = [kept() / f"recording-{os.getpid()}-{number}.json" for number in range(len(lanes))]
    running = [_recording(root, lane, out) for lane, out in zip(lanes, outs, strict=True)]
    result: list[Record] = []
    for process, out, lane in zip(running, outs, lanes, strict=True):
        _, errors = process.communicate()
        if process.returncode == pytest.ExitCode.USAGE_ERROR or not out.exists():
            out.unlink(missing_ok=True)
            raise RuntimeError(f"the tests {' '.join(lane)} could not be recorded: {errors[-2000:]}")
        whole = json.loads(out.read_text(encoding="utf-8"))
        out.unlink()
        result += [_kept(root, test, whole) for test in lane]
    return result


def _recording(root: Path, tests: list[str], out: Path) -> subprocess.Popen[str]:
    # The plugin of dash comes with open3d, and fails where warnings are errors.
    plugins = ["-p", "no:dash", "-p", "no:cacheprovider", "-p", "benchmarks.mutants.recording"]
    # Slow or not.
    command = [sys.executable, "-m", "pytest", "-q", "-m", "not fuzz", *plugins]
    command += ["--reached", str(out), *tests]
    return subprocess.Popen(  # noqa: S603
        command,
        cwd=root,
        # What options pytest was given from outside is not meant for these tests.
        env=os.environ | {"PYTHONPATH": str(ROOT), "PYTEST_ADDOPTS": ""},
        text=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )


def _kept(root: Path, test: str, whole: dict[str, dict[str, object]]) -> Record:
    """Keep the part of a recording that is of one file of tests."""
    seconds = {node: took for node, took in cast("dict[str, float]", whole["seconds"]).items() if _is_of(node, test)}
    every = cast("dict[str, dict[str, list[str]]]", whole["lines"])
    lines: dict[str, dict[str, list[str]]] = {}
    for file, by_line in every.items():
        own = {line: [node for node in nodes if _is_of(node, test)] for line, nodes in by_line.items()}
        lines[file] = {line: nodes for line, nodes in own.items() if nodes}
    modules = {file: digest((root / file).read_bytes()) for file in every if (root / file).exists()}
    record = Record(seconds, {file: by_line for file, by_line in lines.items() if by_line}, modules)
    text = json.dumps({"seconds": record.seconds, "lines": record.lines, "modules": record.modules})
    _place(root, test).write_text(text, encoding="utf-8")
    return record


def _is_of(node: str, test: str) -> bool:
    return node.split("::", maxsplit=1)[0] == test
