"""What verification reads of a program's text, as values: places, data and comments. Names are in lower case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias, final

from geoprint.export.rapid.language.places import Place, refuse as refuse
from geoprint.export.rapid.language.syntax import Module

Value: TypeAlias = "float | int | bool | str | list[Value] | None"


@final
@dataclass(frozen=True, slots=True)
class Declaration:
    """A datum of a module: storage is PERS, CONST or VAR, kind its RAPID type; one without a literal has no value."""

    place: Place
    storage: str
    kind: str
    value: Value


@final
@dataclass(frozen=True, slots=True)
class RapidText:
    """What the modules say: their syntax, data by name, and the comments of each module."""

    modules: tuple[Module, ...]
    declarations: Mapping[str, Declaration]
    comments: Mapping[str, tuple[str, ...]]
