"""What a controller brings: its types, data, instructions and functions, and further names of its options."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import final

from geoprint.export.rapid.language.parsing import parse_module
from geoprint.export.rapid.language.syntax import Module


@final
@dataclass(frozen=True, slots=True)
class Builtins:
    """What a controller brings.

    Attributes:
        module: declarations as RAPID would write them.
        known: names whose declaration is not at hand, in lower case.
    """

    module: Module
    known: frozenset[str]


@cache
def builtins() -> Builtins:
    """Return what a controller brings, read from the tables beside this module."""
    folder = resources.files("geoprint.export.rapid.language")
    module = parse_module("builtins.mod", folder.joinpath("builtins.mod").read_text(encoding="ascii"))
    lines = folder.joinpath("known_names.txt").read_text(encoding="ascii").splitlines()
    known = " ".join(line for line in lines if not line.startswith(("#", "[")))
    return Builtins(module, frozenset(known.lower().split()))
