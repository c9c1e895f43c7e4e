"""What a key of a job says of itself: its option, its line in job.toml, its name in plan.json.

A `Key` stands in the annotation of a field; nothing else anywhere lists the keys.
"""

from __future__ import annotations

import json
import re
import types
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal, Union, final, get_args, get_origin

from annotated_types import MinLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo

# Comments in job.toml begin here, or three columns behind a longer line.
COMMENT_COLUMN = 28

_HEADER = re.compile(r"\[\[?[a-z]")


@final
@dataclass(frozen=True, slots=True)
class Key:
    """What is said of a key wherever a person meets it.

    Attributes:
        help: of its option.
        example: its value in job.toml, as TOML, and the comment behind it; the default where there is only a comment;
            or lines that begin with a table's header.
        shown: whether that line counts; otherwise it is commented out.
        group: part of job.toml in which the line stands, by its name there.
        option: name of its option without dashes, where that is not the key's; none where it is empty.
        told: name in the settings of plan.json, where that is not the key's: it ends with the unit; none where empty.
        always: whether it is told there with its default, too.
    """

    help: str = ""
    example: str = ""
    shown: bool = False
    group: str = ""
    option: str | None = None
    told: str | None = None
    always: bool = True

    def lines(self, name: str, field: FieldInfo) -> list[str]:
        """Return what job.toml says of the key with this name and field."""
        if _HEADER.match(self.example):
            return [f"# {line}" for line in self.example.splitlines()]
        value, _, comment = self.example.partition("# ")
        line = f"{'' if self.shown else '# '}{name} = {value.rstrip() or json.dumps(field.default)}"
        return [f"{line:<{COMMENT_COLUMN - 3}}   # {comment}" if comment else line]


def keys_of(model: type[BaseModel]) -> Iterator[tuple[str, Key, FieldInfo]]:
    """Return the keys of a table in the order of its fields: name, what it says of itself, and the field."""
    for name, field in model.model_fields.items():
        for said in field.metadata:
            if isinstance(said, Key):
                yield name, said, field


def table_of(field: FieldInfo) -> type[BaseModel] | None:
    """Return the table of which a key has a list, or None where it has none."""
    for inner in get_args(field.annotation):
        if get_origin(field.annotation) is list and isinstance(inner, type) and issubclass(inner, BaseModel):
            return inner
    return None


def part_of(field: FieldInfo) -> type[BaseModel] | None:
    """Return the table that a key is, or None where it is none."""
    kind = option_type(field)
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None


def option_type(field: FieldInfo) -> object:
    """Return the type of a key's value as an option takes it: without None, numbers in a row as a tuple of so many."""
    kind: object = field.annotation
    if get_origin(kind) in {Union, types.UnionType}:
        (kind,) = (one for one in get_args(kind) if one is not type(None))
    bounds = [*field.metadata]
    while get_origin(kind) is Annotated:
        kind, *more = get_args(kind)
        bounds += [bound for info in more if isinstance(info, FieldInfo) for bound in info.metadata]
    if kind == list[float]:
        (length,) = (bound.min_length for bound in bounds if isinstance(bound, MinLen))
        return tuple[(float,) * length]
    return str if get_origin(kind) is Literal else kind
