"""What the backends say of themselves, and who is chosen by it."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import geoprint
from geoprint.distance import (
    BACKENDS,
    accuracy,
    backend,
    backend_names,
    compared_backends,
    most_accurate_backend,
    register,
    with_option,
)
from geoprint.errors import UsageError


def test_every_backend_says_what_it_is_in_words_of_its_own() -> None:
    assert backend_names()[: len(BACKENDS)] == tuple(BACKENDS)
    found = [backend(name) for name in BACKENDS]
    assert len({entry.factory.title for entry in found}) == len(BACKENDS)
    for entry in found:
        assert entry.summary.endswith(".")
        assert entry.summary != entry.factory.title


def test_a_chart_and_a_mesh_are_compared_and_the_most_accurate_is_advised() -> None:
    assert compared_backends() == ("lscm", "heat")
    assert most_accurate_backend().name == "fast-marching"
    ranks = [accuracy(backend(name)) for name in ("lscm", "heat", "fast-marching")]
    assert ranks == sorted(set(ranks))
    assert with_option("resolution") == ("lscm",)


def test_a_name_that_is_built_in_cannot_be_registered_again() -> None:
    with pytest.raises(UsageError, match="a backend named 'heat' already"):
        register("heat", BACKENDS["lscm"])


def test_no_room_but_their_own_knows_the_name_of_a_backend() -> None:
    package = Path(geoprint.__file__).parent
    texts = {path.relative_to(package): path.read_text(encoding="utf-8") for path in package.rglob("*.py")}
    found = {
        (path.as_posix(), node.value)
        for path, text in texts.items()
        # Most files hold none of the names, and need not be parsed for it.
        if path.parts[0] != "distance" and any(name in text for name in BACKENDS)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Constant) and node.value in BACKENDS
    }
    # The one that plans where nobody chooses.
    assert found <= {("config/job.py", "heat"), ("cli/options.py", "heat")}
