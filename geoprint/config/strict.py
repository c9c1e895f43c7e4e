"""Tables that a person writes: what a key says of itself, unknown keys refused, wrong values named with their line."""

from __future__ import annotations

import json
import re
import tomllib
import types
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from reprlib import Repr
from typing import Annotated, Literal, TypeAlias, Union, cast, final, get_args, get_origin

from annotated_types import MinLen
from pydantic import BaseModel, ConfigDict, Field, GetJsonSchemaHandler, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, ErrorDetails

from geoprint.errors import UsageError
from geoprint.model import described

# What every table that a person writes has in common: unknown keys, wrong types, NaN and infinity are refused.


# Three numbers: a place, or three angles.
Triple = Annotated[list[float], Field(min_length=3, max_length=3)]
# Where a key stands: keys of tables, and items of lists.
Place: TypeAlias = tuple[int | str, ...]
Schema: TypeAlias = Mapping[str, object]
# Rounds from the border to the farthest point.
Rounds = Annotated[int, Field(ge=1, le=100_000)]


# A job or a cell has a few kilobytes.
MOST_BYTES = 1_000_000
# Tables whose keys depend on their `kind`.
KINDED = frozenset({"table"})
# Letters of a key or a value, and items of a list, that a message repeats.
MOST_SHOWN, MOST_ITEMS = 60, 12
# Least likeness, as `difflib` counts it, of a key that an unknown one may have been meant as.
NEAR = 0.6

_HEADER = re.compile(r"\s*(\[\[?)\s*([\w.-]+)\s*\]")
_KEY = re.compile(r"\s*([\w-]+)\s*[.=]")

_SHORT = Repr()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = MOST_SHOWN
_SHORT.maxlist = MOST_ITEMS


# Errors that pydantic finds for a key that a table or a value does not have.
_UNKNOWN = frozenset({"extra_forbidden", "unexpected_keyword_argument"})
# What a value must be, by the kinds of errors that pydantic finds.
_MUST_BE = {
    "missing": "this key is missing",
    **dict.fromkeys(_UNKNOWN, "there is no such key"),
    "greater_than": "it must be greater than {gt:g}",
    "greater_than_equal": "it must be at least {ge:g}",
    "less_than": "it must be less than {lt:g}",
    "less_than_equal": "it must be at most {le:g}",
    "literal_error": "it must be {expected}",
    "finite_number": "it must be a finite number",
    "float_type": "it must be a number",
    "int_type": "it must be a whole number",
    "bool_type": "it must be true or false",
    "string_type": "it must be a text in quotes",
    "list_type": "it must be a list",
    "path_type": "it must be the name of a file",
    "too_short": "it must have at least {min_length} items",
}


class Table(BaseModel):
    """A table whose keys are all known and whose numbers are all finite."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)
    __repr__ = __str__ = described


def text_of(path: Path, *, most: int = MOST_BYTES) -> str:
    """Return the text of a file that a person writes, or a program with more room for it.

    Args:
        path: of the file.
        most: largest size [bytes].

    Raises:
        OSError: it cannot be read.
        ValueError: it is no plain file, larger than that, or no UTF-8.
    """
    check_plain(path, most=most)
    return path.read_text(encoding="utf-8")


def check_plain(path: Path, *, most: int = MOST_BYTES) -> None:
    """Refuse what no person writes.

    Raises:
        OSError: it cannot be read.
        ValueError: it is no plain file, or larger than so many bytes.
    """
    # Reading a pipe or a device might never end.
    if path.exists() and not path.is_file():
        raise ValueError("it is not a regular file")
    if path.stat().st_size > most:
        raise ValueError(f"it is larger than {most / 1e6:g} MB")


def parsed_toml(text: str, *, name: str) -> dict[str, object]:
    """Return the tables and keys of a TOML text.

    Raises:
        UsageError: it is not TOML; the sentence names the file and the line.
    """
    try:
        return tomllib.loads(text)
    except ValueError as error:  # a number of thousands of digits too
        raise UsageError(f"{name} is not valid TOML: {error}; compare with a file from `geoprint init`.") from error
    except RecursionError as error:
        raise UsageError(
            f"{name}: its lists are nested too deeply; compare with a file from `geoprint init`."
        ) from error


def key_at(place: Place) -> str:
    """Return the path of a key; items of a list are counted from 1, as in `patches.2.radius`."""
    return ".".join(str(part + 1 if isinstance(part, int) else part[:MOST_SHOWN]) for part in place)


def describe(
    error: ValidationError, named: Callable[[Place], str] = key_at, *, kind: type[object] | None = None
) -> str:
    """Say in one phrase what the first wrong key of a table is, and how many more there are.

    Args:
        error: about the table.
        named: what the place of a key is called.
        kind: of the table; an unknown key is then followed by the nearest one there, or by all.
    """
    first = _first(error)
    where = named(_place(first["loc"]))
    shown = first["type"] not in {"missing", "value_error", "too_long"} and not isinstance(first["input"], Mapping)
    found = f", found {_SHORT.repr(first['input'])}" if shown else ""
    more = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
    allowed = _allowed(kind, _place(first["loc"])) if kind is not None and first["type"] in _UNKNOWN else ""
    return f"{where}{': ' if where else ''}{in_words(first)}{found}{more}{allowed}"


def unknown_key(error: ValidationError) -> str:
    """Return the path of the first key that a table does not have, or nothing where something else is wrong."""
    first = _first(error)
    return key_at(_place(first["loc"])) if first["type"] in _UNKNOWN else ""


def in_words(problem: ErrorDetails) -> str:
    """Return what a value must be, where it is wrong."""
    bounds = problem.get("ctx", {})
    if problem["type"] in _MUST_BE:
        return _MUST_BE[problem["type"]].format(**bounds).replace(" 1 items", " 1 item")
    message = problem["msg"].removeprefix("Value error, ").replace("Input should be", "it must be")
    return f"{message[0].lower()}{message[1:]}"


def line_of(error: ValidationError, text: str, *, name: str) -> str:
    """Return a file's name and the line, from 1, of its first wrong key or of what is around that.

    Args:
        error: about the file.
        text: of the file.
        name: of it, alone where the whole of it is meant.
    """
    where = _place(_first(error)["loc"])
    lines: dict[Place, int] = {}
    counts: dict[str, int] = {}
    table: Place = ()
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            table = tuple(header[2].split("."))
            if header[1] == "[[":
                table += (counts.setdefault(header[2], 0),)
                counts[header[2]] += 1
            lines.setdefault(table, number)
        elif key := _KEY.match(line):
            lines.setdefault((*table, key[1]), number)
    known = (lines[where[:length]] for length in range(len(where), 0, -1) if where[:length] in lines)
    line = next(known, None)
    return name if line is None else f"{name}, line {line}"


def _allowed(kind: type[object], place: Place) -> str:
    """Return the key that is nearest to an unknown one in its table, or all keys of that table, in brackets."""
    schema = cast("Schema", TypeAdapter(kind).json_schema())
    tables = list(_tables(schema, schema))
    for part in place[:-1]:
        inner = [table.get("items") if isinstance(part, int) else _properties(table).get(part) for table in tables]
        tables = [table for each in inner if each is not None for table in _tables(schema, cast("Schema", each))]
    keys = list(dict.fromkeys(key for table in tables for key in _properties(table)))
    near = get_close_matches(str(place[-1]), keys, n=1, cutoff=NEAR)
    if near:
        return f" (did you mean `{near[0]}`?)"
    return f" (allowed here: {', '.join(keys[:MOST_ITEMS])}{', ...' if len(keys) > MOST_ITEMS else ''})" if keys else ""


def _tables(schema: Schema, node: Schema) -> Iterator[Schema]:
    """Yield what a node of a JSON schema stands for: references followed, alternatives one by one."""
    if "$ref" in node:
        definitions = cast("Mapping[str, Schema]", schema["$defs"])
        yield from _tables(schema, definitions[str(node["$ref"]).rpartition("/")[2]])
    elif alternatives := cast("list[Schema]", node.get("anyOf") or node.get("oneOf") or node.get("allOf")):
        for each in alternatives:
            yield from _tables(schema, each)
    else:
        yield node


def _properties(table: Schema) -> Schema:
    return cast("Schema", table.get("properties", {}))


def _first(error: ValidationError) -> ErrorDetails:
    """Return what is wrong with a table: an unknown key first, since a mistyped one is missing by its own name, too."""
    problems = error.errors()
    return next((problem for problem in problems if problem["type"] in _UNKNOWN), problems[0])


def _place(found: Place) -> Place:
    """Return where a key stands in the file: without the kind that pydantic puts behind the name of such a table."""
    return tuple(part for at, part in enumerate(found) if at == 0 or found[at - 1] not in KINDED)


# What a key of a job says of itself: its option, its line in job.toml, its name in plan.json.
#
# A `Key` stands in the annotation of a field; nothing else anywhere lists the keys.


# Comments in job.toml begin here, or three columns behind a longer line.
COMMENT_COLUMN = 28

_TABLE_LINE = re.compile(r"\[\[?[a-z]")


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
        shape: of the value of its option, as help shows it, where its type does not say it.
        rare: whether commands that take all keys leave its option out: `--set` gives it there.
        record: name in the settings of plan.json, where that is not the key's: it ends with the unit; none where empty.
        always: whether it is told there with its default, too.
    """

    help: str = ""
    example: str = ""
    shown: bool = False
    group: str = ""
    option: str | None = None
    shape: str = ""
    rare: bool = False
    record: str | None = None
    always: bool = True

    @property
    def meaning(self) -> str:
        """What is said of it in a list of keys: its comment in job.toml, else the help of its option."""
        return self.example.partition("# ")[2] or self.help

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Describe its key in JSON schemas."""
        return handler(schema) | {"description": self.meaning}

    def lines(self, name: str, field: FieldInfo) -> list[str]:
        """Return what job.toml says of the key with this name and field."""
        if _TABLE_LINE.match(self.example):
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
