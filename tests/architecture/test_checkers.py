"""What checks takes no name from what plans and writes, not even through the list of a package."""

from __future__ import annotations

import ast
import importlib
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
NAME = "What checks shares no code with what plans and writes"


def contract() -> tuple[list[str], list[str]]:
    """Return the modules that check, and those of the writer, as pyproject.toml lists them."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (found,) = [each for each in contracts if each["name"] == NAME]
    return found["source_modules"], found["forbidden_modules"]


def files_of(module: str) -> list[Path]:
    path = ROOT / module.replace(".", "/")
    return sorted(path.rglob("*.py")) if path.is_dir() else [path.with_suffix(".py")]


def imported(path: Path) -> Iterator[tuple[str, str]]:
    """Yield package and name of what a module takes from geoprint."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("geoprint"):
            yield from ((node.module or "", each.name) for each in node.names)


def writers(path: Path, forbidden: list[str]) -> list[str]:
    """Return what a module takes from the writer's, wherever it was made."""
    found: list[str] = []
    for package, name in imported(path):
        made = getattr(getattr(importlib.import_module(package), name, None), "__module__", package)
        if any(f"{made}.".startswith(f"{module}.") for module in forbidden):
            found.append(f"{path.name}: {name} of {made}")
    return found


def test_what_checks_takes_no_name_from_the_writer_through_a_package_either() -> None:
    checking, forbidden = contract()
    paths = [path for module in checking for path in files_of(module)]
    assert len(paths) > 30
    assert [each for path in paths for each in writers(path, forbidden)] == []


def test_a_name_that_comes_through_a_package_is_seen(tmp_path: Path) -> None:
    (tmp_path / "borrowed.py").write_text("from geoprint.postprocessor import Orders, orders_of, waits\n")
    assert writers(tmp_path / "borrowed.py", contract()[1]) == [
        "borrowed.py: orders_of of geoprint.postprocessor.ordering",
        "borrowed.py: waits of geoprint.postprocessor.switching",
    ]
