"""Where paths are counted from, as a job states it: loops of the border, part of one, a curve, an angle, or a point."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, PositiveInt, model_validator

from geoprint.config.curve_table import read_curve
from geoprint.config.key import Key
from geoprint.config.strict import Table, Triple
from geoprint.errors import UsageError

# A line is sought between each two points of a drawn curve.
MOST_SOURCE_POINTS = 500
SHAPES = (
    "border, best, loops:1,3, near:X,Y,Z, between:X,Y,Z:X,Y,Z, point:X,Y,Z, angle:45, or a CSV file x,y,z of a drawn "
    "curve"
)

# Of a line, which looks the same after half a turn [degrees].
Angle = Annotated[float, Field(ge=-180.0, le=180.0)]


class Source(Table):
    """Where distance is zero; one of these is given. Places [mm] are on or near the surface."""

    border: Annotated[bool, Key("", "true # the whole border")] = False
    best: Annotated[bool, Key("", "true # try what the part has, take what covers it best")] = False
    loops: Annotated[
        list[PositiveInt] | None,
        Field(min_length=1),
        Key("", "[1] # some loops of the border, the longest is 1; `geoprint inspect` lists them"),
    ] = None
    near: Annotated[
        list[Triple] | None, Field(min_length=1), Key("", "[[0.0, 0.0, 0.0]] # the loops nearest to these points")
    ] = None
    between: Annotated[
        list[Triple] | None,
        Field(min_length=2, max_length=3),
        Key("", "[[-8.0, 0.0, 30.0], [8.0, 0.0, 30.0]] # the shorter part of a loop, or by a point in the middle"),
    ] = None
    curve: Annotated[
        list[Triple] | None,
        Field(min_length=2, max_length=MOST_SOURCE_POINTS),
        Key("", "[[-8.0, 0.0, 30.0], [8.0, 0.0, 30.0]] # points of a drawn curve, joined by shortest lines"),
    ] = None
    point: Annotated[Triple | None, Key("", "[0.0, 0.0, 0.0] # one point")] = None
    angle: Annotated[
        Angle | None, Key("", "45.0 # a straight line over the middle, in degrees from the x axis seen from outside")
    ] = None

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, given: object) -> object:
        return _keys_of(given) if isinstance(given, str) else given

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        given = [name for name, value in self if value is not None and value is not False]
        if len(given) != 1:
            found = " and ".join(given) if given else "none"
            raise ValueError(f"a source is one of {', '.join(type(self).model_fields)}, found {found}")
        return self

    def __str__(self) -> str:
        """Return it in a few words, as `--from` takes them; a drawn curve by its number of points."""
        if self.loops is not None:
            return f"loops:{','.join(map(str, self.loops))}"
        if self.angle is not None:
            return f"angle:{self.angle:g}"
        if self.curve is not None:
            return f"a curve of {len(self.curve)} points"
        point = None if self.point is None else [self.point]
        for name, places in (("near", self.near), ("between", self.between), ("point", point)):
            if places is not None:
                return f"{name}:{':'.join(','.join(f'{value:g}' for value in place) for place in places)}"
        return "best" if self.best else "border"


def source_named(text: str) -> dict[str, object]:
    """Return the keys of the source that an option means, such as `loops:1,3`, or a table with a drawn curve.

    Raises:
        UsageError: it means none.
        InputError: the table cannot be read.
    """
    if Path(text).is_file():
        return {"curve": read_curve(text)}
    try:
        return _keys_of(text)
    except ValueError as error:
        raise UsageError(f"`--from`: {error}.") from error


def _keys_of(text: str) -> dict[str, object]:
    """Return the keys that a text means."""
    kind, _, rest = text.strip().partition(":")
    if text.strip() in {"border", "best"}:
        return {text.strip(): True}
    try:
        return {"loops" if kind == "loop" else kind: READERS[kind](rest)}
    except (KeyError, ValueError) as error:
        raise ValueError(f"{text[:60]!r} is no source, and no file: give one of {SHAPES}") from error


def _numbers(text: str) -> list[int]:
    return [int(number) for number in text.split(",")]


def _place(text: str) -> list[float]:
    return [float(number) for number in text.split(",")]


def _places(text: str) -> list[list[float]]:
    return [_place(place) for place in text.split(":")]


READERS: dict[str, Callable[[str], object]] = {
    "loop": _numbers, "loops": _numbers, "near": _places, "between": _places, "point": _place, "angle": float
}  # fmt: skip
