"""A plugin of pytest that records which lines of the package each test reaches, and how long each test takes.

    python -m pytest -p benchmarks.mutants.recording --reached FILE TESTS

What is set up for several tests counts for the file of the test that happens to set it up (`NODE|set up`).
"""

from __future__ import annotations

import json
from collections.abc import Generator
from pathlib import Path
from typing import cast

import coverage
import pytest

SET_UP = "|set up"
_COUNTING: dict[str, coverage.Coverage] = {}
_SECONDS: dict[str, float] = {}
_FAILED: set[str] = set()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Say where the record goes."""
    parser.addoption("--reached", type=Path, required=True)


def pytest_configure() -> None:
    """Start before anything of the package is imported."""
    counting = coverage.Coverage(data_file=None, source=["geoprint"], config_file=False, messages=False)
    counting.set_option("run:disable_warnings", ["no-data-collected", "module-not-measured", "already-imported"])
    counting.start()
    _COUNTING["now"] = counting


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None]:
    """Count what a test needs."""
    _COUNTING["now"].switch_context(item.nodeid + SET_UP)
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None]:
    """Count what a test does."""
    _COUNTING["now"].switch_context(item.nodeid)
    return (yield)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up the seconds; a test that does not pass says nothing of mutants."""
    if not report.passed:
        _FAILED.add(report.nodeid)
    _SECONDS[report.nodeid] = _SECONDS.get(report.nodeid, 0.0) + report.duration


def pytest_unconfigure(config: pytest.Config) -> None:
    """Write the record: seconds by test, and tests by line by file."""
    counting = _COUNTING["now"]
    counting.stop()
    data, here = counting.get_data(), Path.cwd()
    lines: dict[str, dict[str, list[str]]] = {}
    for file in data.measured_files():
        by_line = {str(line): [each for each in tests if each] for line, tests in data.contexts_by_lineno(file).items()}
        lines[str(Path(file).relative_to(here))] = {line: tests for line, tests in by_line.items() if tests}
    passed = {test: took for test, took in _SECONDS.items() if test not in _FAILED}
    path = cast("Path", config.getoption("--reached"))
    path.write_text(json.dumps({"seconds": passed, "lines": lines}), encoding="utf-8")
