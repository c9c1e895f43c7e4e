"""Frozen values: the decorators that make them, their array types and the check of arrays."""

from __future__ import annotations

import re
import reprlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from inspect import cleandoc
from pathlib import PurePath
from typing import Annotated, Any, Protocol, TypeAlias, TypeVar, cast, dataclass_transform

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, ConfigDict, Field

from geoprint.errors import InputError, percent

# Frozen values: the decorators that make them, and the few lines in which they print.


_C = TypeVar("_C")

# What a file or a command line can say of an option.
OptionValue: TypeAlias = bool | int | float | str

# A line that a value prints is at most this wide, so that most terminals hold it.
WIDTH = 100
# What suffices to know a number again; the value itself has all its figures.
_FIGURES = ".5g"
# A unit as a docstring writes it, as in `speed: of the tip [mm/s].`
_UNIT = re.compile(r"(?<![\w`])\[([A-Za-z][\w/]*)\]")
# An attribute as a docstring describes it.
_ENTRY = re.compile(r"^ {4}(\w+): (.*(?:\n {8}.*)*)", re.MULTILINE)


@dataclass_transform(frozen_default=True, eq_default=False)
def frozen(cls: type[_C]) -> type[_C]:
    """Make a class a frozen, slotted dataclass that is equal only to itself and prints as `described`."""
    return _completed(dataclass(frozen=True, slots=True, eq=False, repr=False)(cls))


@dataclass_transform(frozen_default=True)
def comparable(cls: type[_C]) -> type[_C]:
    """Make a class a frozen, slotted dataclass that is equal to what holds the same and prints as `described`."""
    return _completed(dataclass(frozen=True, slots=True, repr=False)(cls))


@dataclass_transform(frozen_default=True)
def recorded(name: str, /, **keys: str) -> Callable[[type[_C]], type[_C]]:
    """Make a class `comparable`, and its values fields of records, which check and round them as they take them in.

    Args:
        name: of the class in JSON Schemas. What its docstring says of its attributes describes them there.
        **keys: of fields in JSON, where these are called otherwise: with their unit.
    """

    def completed(cls: type[_C]) -> type[_C]:
        def describe(schema: dict[str, Any]) -> None:
            schema["description"] = cleandoc(cls.__doc__ or "").partition("\n\nAttributes:\n")[0]
            for field, said in _attributes(cls).items():
                text = " ".join(said.split()).rstrip(".").replace("None", "null")
                schema["properties"][keys.get(field, field)]["description"] = text

        config: ConfigDict = {
            **RECORDS, "title": name, "revalidate_instances": "always", "populate_by_name": True,
            "json_schema_extra": describe, "alias_generator": lambda field: keys.get(field, field),
        }  # fmt: skip
        type.__setattr__(cls, "__pydantic_config__", config)
        return comparable(cls)

    return completed


def described(self: object) -> str:
    """Return what a value holds, a line a field or all in one: shape, kind and range of arrays, and units.

    Units are those that the docstring of the value's class gives its attributes. A value within it takes one line.

    Args:
        self: a frozen dataclass, or a model of pydantic; this is their `__repr__`.

    Examples:
        >>> @frozen
        ... class Line:
        ...     '''A line.
        ...
        ...     Attributes:
        ...         corners: (k, 3) in their order [mm].
        ...         closed: whether the last is joined to the first.
        ...     '''
        ...
        ...     corners: NDArray[np.float64]
        ...     closed: bool
        >>> Line(np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]]), closed=False)
        Line
          corners  (2, 3) float, 0 to 4 mm
          closed   False
    """
    names, said = _names(self), _attributes(type(self))
    lines = {name: _line(getattr(self, name), unit=_unit(said.get(name, ""))) for name in names}
    short = f"{type(self).__name__}({', '.join(f'{name}={line}' for name, line in lines.items())})"
    if len(short) <= WIDTH and not any(isinstance(getattr(self, name), np.ndarray) for name in names):
        return short
    widest = max(map(len, names))
    record = (f"  {name:{widest}}  {line}" for name, line in lines.items())
    return "\n".join(
        [type(self).__name__, *(line if len(line) <= WIDTH else f"{line[: WIDTH - 3]}..." for line in record)]
    )


def _completed(cls: type[_C]) -> type[_C]:
    cls.__repr__ = described
    for name, function in (("__getstate__", _state), ("__setstate__", _restore)):
        setattr(cls, name, function)
    return cls


def _state(self: object) -> tuple[dict[str, object], tuple[str, ...]]:
    """Return what a value holds, and which are arrays that nobody may write: copies and pickles forget that of them."""
    held: dict[str, object] = {name: getattr(self, name) for name in _names(self)}
    arrays = {name: cast("NDArray[Any]", value) for name, value in held.items() if isinstance(value, np.ndarray)}
    return held, tuple(name for name, array in arrays.items() if not array.flags.writeable)


def _restore(self: object, state: tuple[dict[str, Any], tuple[str, ...]]) -> None:
    held, read_only = state
    for name, value in held.items():
        if name in read_only:
            value.setflags(write=False)
        object.__setattr__(self, name, value)


def _names(value: object) -> tuple[str, ...]:
    """Return the names of a value's fields; none of what is no value."""
    kind = type(value)
    held: Iterable[str] = getattr(kind, "__dataclass_fields__", None) or getattr(kind, "model_fields", None) or ()
    return tuple(held)


class _Words(reprlib.Repr):
    """Says in a word what stands among others: of what is large its size or its kind alone."""

    def repr_instance(self, x: object, level: int) -> str:
        if isinstance(x, np.ndarray):
            return str(cast("NDArray[Any]", x).shape)
        if _names(x):
            return type(x).__name__
        return super().repr_instance(str(x) if isinstance(x, PurePath) else x, level)

    def repr_float(self, x: float, _level: int) -> str:
        return f"{x:{_FIGURES}}"


_word = _Words().repr


def _line(value: object, *, unit: str) -> str:
    """Return a field in one line: a value with what it holds, an array with its range."""
    if isinstance(value, np.ndarray):
        return _array(cast("NDArray[Any]", value), unit=unit)
    if names := _names(value):
        return f"{type(value).__name__}: {', '.join(f'{name} {_word(getattr(value, name))}' for name in names)}"
    held = cast("Sequence[object]", value) if isinstance(value, tuple | list) else ()
    if any(map(_names, held)):
        return f"{len(held)} of {' or '.join(dict.fromkeys(type(one).__name__ for one in held))}"
    said = repr(value) if isinstance(value, str) else _word(cast("object", value))
    return f"{said}{unit}" if isinstance(value, float) else said


def _array(array: NDArray[Any], *, unit: str) -> str:
    """Return shape, kind and range of an array."""
    kind = array.dtype.name.rstrip("0123456789_")
    if array.size == 0:
        return f"{array.shape} {kind}"
    if kind == "bool":
        return f"{array.shape} {kind}, {percent(array.mean())} true"
    ends = dict.fromkeys(f"{end:{_FIGURES}}" for end in (array.min(), array.max()))
    return f"{array.shape} {kind}, {' to '.join(ends)}{unit}"


def _attributes(kind: type) -> dict[str, str]:
    """Return what a class's docstring says of each attribute."""
    # Pythons from 3.13 on cut the margin of docstrings themselves.
    return dict(_ENTRY.findall(cleandoc(kind.__doc__ or "")))


def _unit(said: str) -> str:
    """Return the unit that an attribute's description ends with, with a space before it, or nothing."""
    found = _UNIT.findall(said)
    return f" {found[-1]}" if found else ""


# How figures appear in what geoprint says: rounded as a record takes them in.


# How a record takes in what it holds, and how a value is taken in that is a field of one.
RECORDS = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)
# Decimals of lengths [mm] and angles [degrees]: finer than any machine, short enough to read.
DECIMALS = 6


def rounded(value: float | np.floating) -> float:
    """Return a number as JSON carries it; zero has no sign."""
    return round(float(value), DECIMALS) + 0.0


def _thousandths(value: float) -> float:
    return round(value, 3)


# A figure with six decimals, and one with three.
Rounded: TypeAlias = Annotated[float, AfterValidator(rounded)]
Thousandths: TypeAlias = Annotated[float, AfterValidator(_thousandths)]
Count: TypeAlias = Annotated[int, Field(ge=0)]
Place: TypeAlias = tuple[Rounded, Rounded, Rounded]


# Array types, and the check that every noun of the model runs on its own arrays.


FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]
# Columns by name, as `table["x"]`; whatever makes tables of arrays takes it.
Table: TypeAlias = "np.recarray[tuple[int], np.dtype[np.record]]"


def table_of(columns: Mapping[str, NDArray[np.generic]]) -> Table:
    """Return arrays of one length as a table."""
    kinds = np.dtype([(name, column.dtype) for name, column in columns.items()])
    return np.rec.fromarrays([*columns.values()], dtype=kinds)


class _Value(Protocol):
    def __setattr__(self, name: str, value: object, /) -> None: ...


def freeze_arrays(owner: _Value, **shapes: str) -> dict[str, int]:
    """Check the named array fields of a frozen dataclass and make them read-only.

    Writable arrays are copied, so that nobody who still holds one can change the value; read-only ones are shared.

    Args:
        owner: the dataclass instance, called from its `__post_init__`.
        **shapes: field name to `"kind: shape"`, where kind is float, int or bool and the shape is a list of
            integers and letters; a letter has the same size in all fields of the owner.

    Returns:
        The size bound to each letter.

    Raises:
        InputError: a shape or dtype differs, or a float is not finite.
    """
    sizes: dict[str, int] = {}
    where = type(owner).__name__
    for name, spec in shapes.items():
        kind, _, letters = spec.partition(":")
        array = _of_kind(getattr(owner, name), kind=kind.strip(), name=f"{where}.{name}")
        _bind_shape(array, letters.split(), sizes, name=f"{where}.{name}")
        if array.dtype == np.float64 and not np.isfinite(array).all():
            raise InputError(f"{where}.{name} holds NaN or infinity; only finite numbers are meaningful there.")
        if array.flags.writeable:
            array = array.copy()
            array.setflags(write=False)
        object.__setattr__(owner, name, array)
    return sizes


def _of_kind(value: object, *, kind: str, name: str) -> NDArray[Any]:
    array = np.asarray(value)
    if kind == "float" and array.dtype.kind in "fiu":
        return array.astype(np.float64, copy=False)
    if kind == "int" and array.dtype.kind in "iu":
        return array.astype(np.int64, copy=False)
    if kind == "bool" and array.dtype.kind == "b":
        return array
    raise InputError(f"{name} must be an array of {kind}, found {array.dtype}.")


def _bind_shape(array: NDArray[Any], letters: list[str], sizes: dict[str, int], *, name: str) -> None:
    if array.ndim != len(letters):
        raise InputError(f"{name} must have shape ({', '.join(letters)}), found {array.shape}.")
    for size, letter in zip(array.shape, letters, strict=True):
        wanted = int(letter) if letter.isdigit() else sizes.setdefault(letter, size)
        if size != wanted:
            raise InputError(
                f"{name} must have shape ({', '.join(letters)}) with {letter} = {wanted}, found {array.shape}."
            )
