"""setup.json: the cell and the placement that a program was written for, so that it can be checked without their files.

Any frozen value of the model is written: fields by name, arrays as nested lists, numbers to the last bit.
"""

from __future__ import annotations

import json
import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar, Union, cast, final, get_args, get_origin, get_type_hints

import numpy as np

from geoprint.errors import InputError, VerificationError
from geoprint.model import Cell, FloatArray, Placement, frozen
from geoprint.postprocessor.bundle import Json, json_bytes

Noun = TypeVar("Noun")

# Fields that only some cells have; left out where there is nothing, so that the setup of all others stays as it is.
_SOMETIMES = frozenset({"table", "settle", "flow_unstated", "options", "post_processor"})


@final
@frozen
class Setup:
    """What a program was written for, besides its targets.

    Attributes:
        cell: the machine.
        placement: where the part stands.
        surface_within: what its surface is known within along its normal, in 95 of 100 calibrations [mm], or None
            where nobody calibrated.
        extent: (2, 3) lowest and highest coordinates of the part in its own frame [mm].
        frame: as `Orders` [mm]; None where no program reads it.
    """

    cell: Cell
    placement: Placement
    surface_within: float | None
    extent: FloatArray
    frame: float | None = None


def setup_file(setup: Setup) -> bytes:
    """Return the content of setup.json."""
    return json_bytes(_written(setup))


def read_setup(path: Path | str) -> Setup:
    """Read a setup.json.

    Args:
        path: the file.

    Raises:
        VerificationError: it cannot be read, or holds something else.
    """
    try:
        return _read(Setup, json.loads(Path(path).read_bytes()))
    except OSError as error:
        raise VerificationError(f"{path} cannot be read ({error.strerror}); write the plan again.") from error
    except (ValueError, KeyError, TypeError, RecursionError, InputError) as error:
        raise VerificationError(f"{path} is no description of a cell ({error}); write the plan again.") from error


def _written(value: object) -> Json:
    if isinstance(value, np.ndarray):
        return cast("Json", value.tolist())
    if is_dataclass(value):
        held = {field.name: getattr(value, field.name) for field in fields(value)}
        return {name: _written(one) for name, one in held.items() if name not in _SOMETIMES or one}
    if isinstance(value, tuple):
        return [_written(item) for item in cast("tuple[object, ...]", value)]
    return cast("Json", value)


def _read(kind: type[Noun], data: object) -> Noun:
    """Return a value of the model from its fields."""
    if not isinstance(data, Mapping):
        raise TypeError(f"{kind.__name__} is {type(data).__name__}")
    hints = get_type_hints(kind)
    given = cast("Mapping[str, object]", data)
    unknown = given.keys() - hints.keys()
    if unknown:
        raise KeyError(f"{kind.__name__} has no {min(unknown)}")
    return kind(**{name: _value(hints[name], value) for name, value in given.items()})


def _value(hint: Any, data: object) -> object:
    """Return a field of the type that its annotation says."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in {Union, types.UnionType}:
        return None if data is None else _value(_alternative(arguments, data), data)
    if origin is tuple:
        return tuple(_value(arguments[0], item) for item in cast("list[object]", data))
    # Not by its origin: what NDArray is made of differs from one NumPy and Python to the next.
    if hint == FloatArray:
        return np.array(data, dtype=np.float64)
    if origin is dict and isinstance(data, dict):
        return cast("dict[str, object]", data)
    if is_dataclass(hint):
        return _read(cast("type[object]", hint), data)
    allowed = (int, float) if hint is float else (str if origin is Literal else hint)
    if not isinstance(data, allowed) or (origin is Literal and data not in arguments):
        raise TypeError(f"{data!r} is no {hint}")
    return float(data) if hint is float and isinstance(data, int) else data


def _alternative(arguments: tuple[Any, ...], data: object) -> Any:
    """Return the first type of a union whose fields are those of the data, or its last."""
    kinds = [each for each in arguments if each is not type(None)]
    keys = set(cast("Mapping[str, object]", data)) if isinstance(data, Mapping) else set[str]()
    return next(
        (each for each in kinds if is_dataclass(each) and keys == {one.name for one in fields(each)}), kinds[-1]
    )
