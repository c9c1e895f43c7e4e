"""How figures appear in JSON: frozen records with rounded numbers, and how a file was read."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self, TypeAlias, TypeVar, cast, get_args

import numpy as np
from pydantic import BaseModel, ValidationError

from geoprint.config.strict import describe
from geoprint.errors import VerificationError, reason_of
from geoprint.model import RECORDS, described
from geoprint.postprocessor import Json, json_bytes, write_bundle

# How figures appear in what geoprint tells: frozen records with rounded numbers, written to JSON and read back.


_R = TypeVar("_R", bound="Record")


def listed(phrases: Sequence[str]) -> str:
    """Return phrases as a list in a sentence: 'a', 'a and b', 'a, b and c'."""
    return phrases[0] if len(phrases) == 1 else f"{', '.join(phrases[:-1])} and {phrases[-1]}"


# First and last of what follows each other.
Pair: TypeAlias = tuple[int, int]


class Record(BaseModel):
    """Figures that belong together, each with its name and, in its description, its unit.

    What has a default is left out of the JSON where it has that value; everything else always stands there.
    """

    model_config = RECORDS
    __repr__ = __str__ = described

    @classmethod
    def of(cls, value: object, **others: Any) -> Self:
        """Return the record of a value: its attributes that have the names of fields, and what is given besides.

        An attribute has the name of its field, or this without the unit at its end: angles of `_deg` are rad, times of
        `_ms` are s, others have the unit already. Where a field holds records, values become records likewise.

        Raises:
            ValidationError: a field without a default is neither an attribute nor given.
        """
        found = {name: _attribute(value, name) for name in cls.model_fields if name not in others}
        every = {**{name: each for name, each in found.items() if each is not _ABSENT}, **others}
        return cls(**{name: _as_field(each, cls.model_fields[name].annotation) for name, each in every.items()})


# Stands for an attribute that a value does not have.
_ABSENT = object()
# Units at the ends of names, with what makes them of the units inside.
_UNITS: Mapping[str, Callable[[Any], Any]] = {
    "_deg": np.degrees,
    "_ms": lambda time: 1e3 * time,
    **dict.fromkeys(("_mm_s", "_mm3", "_mm2", "_mm", "_px", "_s"), lambda figure: figure),
}


def stamp(kind: type[Record]) -> dict[str, Any]:
    """Return what a file says of its layout, whose number a change that breaks a reader raises, and of geoprint."""
    return {"schema": get_args(kind.model_fields["layout"].annotation)[0], "version": version("geoprint")}


def _attribute(value: object, name: str) -> object:
    """Return the attribute of a value that a field is of, in the field's unit; _ABSENT where there is none."""
    found = getattr(value, name, _ABSENT)
    for unit, scaled in _UNITS.items():
        if found is _ABSENT and name.endswith(unit):
            found = getattr(value, name.removesuffix(unit), _ABSENT)
            found = found if found is _ABSENT or found is None else scaled(found)
    return found


def _as_field(value: Any, annotation: Any) -> Any:
    """Return a value as a field takes it: an array as tuples; a value, or several, as records where the field's are."""
    if isinstance(value, np.ndarray | np.generic):
        return _tuples(cast("object", value.tolist()))
    kind = _kind_of(annotation)
    if kind is None or value is None or isinstance(value, Record):
        return value
    if type(value) is tuple:
        return tuple(_as_field(each, kind) for each in cast("tuple[object, ...]", value))
    return kind.of(value)


def _tuples(values: object) -> object:
    return tuple(_tuples(each) for each in cast("list[object]", values)) if isinstance(values, list) else values


def _kind_of(annotation: Any) -> type[Record] | None:
    """Return the kind of record that a field holds: one, several, or one that may be left out."""
    if isinstance(annotation, type) and issubclass(annotation, Record):
        return annotation
    return next((kind for each in get_args(annotation) if (kind := _kind_of(each)) is not None), None)


def place_of(values: Iterable[float | np.floating]) -> tuple[float, float, float]:
    """Return a (3,) place [mm] as records take it."""
    x, y, z = (float(value) for value in values)
    return x, y, z


def as_json(record: Record) -> dict[str, Json]:
    """Return a record as JSON carries it, its keys in the order of the fields."""
    return cast("dict[str, Json]", record.model_dump(mode="json", by_alias=True, exclude_defaults=True))


def read_record(path: Path | str, kind: type[_R]) -> _R:
    """Return the record that a JSON file holds.

    Raises:
        VerificationError: it cannot be read, or a key is unknown, missing or wrong; the sentence says which.
    """
    path = Path(path)
    try:
        # Parsed first: the sentence on what is no JSON at all names its line.
        parsed = json.loads(content := path.read_bytes())
        _check_layout(path.name, parsed, kind)
        return kind.model_validate_json(content)
    except ValidationError as error:
        raise VerificationError(
            f"{path.name}: {describe(error, kind=kind)}; restore the file as it was written, or write it again."
        ) from error
    except (OSError, ValueError, RecursionError) as error:
        raise VerificationError(f"{path.name} cannot be read ({reason_of(error)}); write it again.") from error


def _check_layout(name: str, parsed: object, kind: type[Record]) -> None:
    """Refuse a record whose layout is a whole number, but another one than is read."""
    layout = kind.model_fields.get("layout")
    found = cast("dict[str, object]", parsed).get("schema") if isinstance(parsed, dict) else None
    if layout is None or not isinstance(found, int) or found in get_args(layout.annotation):
        return
    raise VerificationError(
        f"{name} has layout {found} of another version of geoprint, this one reads {get_args(layout.annotation)[0]}; "
        "read it with that version, or write it again with this one."
    )


def verify_record(path: Path, record: Record) -> None:
    """Check that a JSON file holds a record as it was told.

    Raises:
        VerificationError: it does not.
    """
    if read_record(path, type(record)) != record:
        raise VerificationError(f"{path.name} does not read back as written; the disk may be faulty: write it again.")


def save_record(
    record: _R,
    name: str,
    files: Mapping[str, bytes],
    directory: Path | str,
    *,
    overwrite: bool,
    verify: Callable[[Path], None] = lambda _: None,
    unlisted: Mapping[str, bytes] = MappingProxyType({}),
) -> _R:
    """Write a folder with a record and what belongs to it: complete and verified, or not at all.

    Args:
        record: what its JSON file says.
        name: of that file.
        files: name to content of the others.
        directory: where the folder shall stand.
        overwrite: whether an existing one may be replaced.
        verify: reads the other files back where that can find more than their bytes say.
        unlisted: as in `write_bundle`.

    Returns:
        The record.

    Raises:
        UsageError: the folder exists already.
        ExportError: nothing can be written there.
        VerificationError: what was written reads back otherwise.
    """

    def verify_all(folder: Path) -> None:
        verify(folder)
        verify_record(folder / name, record)

    every = {name: json_bytes(as_json(record)), **files}
    write_bundle(directory, every, overwrite=overwrite, verify=verify_all, unlisted=unlisted)
    return record
