"""What the RAPID reader understands, as values: places, data and statements. Names are in lower case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias, final

from geoprint.export.rapid.language.places import Place, refuse as refuse

Value: TypeAlias = "float | int | bool | str | list[Value] | None"
MoveVerb: TypeAlias = Literal["MoveL", "TriggL"]
LoadVerb: TypeAlias = Literal["StartLoad", "WaitLoad", "UnLoad"]


@final
@dataclass(frozen=True, slots=True)
class Move:
    """A straight move to a robtarget.

    Attributes:
        place: where it stands.
        verb: the instruction.
        target: the 17 numbers of the robtarget (position, quaternion, configuration, external axes).
        aloft: the four numbers of the configuration where the target is lifted.
        speed: name of its speeddata.
        triggers: names of the triggdata that it pulls.
        zone: name of its zonedata, or 'fine'.
        tool: name of its tooldata.
        work: name of its wobjdata, or empty.
    """

    place: Place
    verb: MoveVerb
    target: tuple[float, ...]
    aloft: tuple[float, ...]
    speed: str
    triggers: tuple[str, ...]
    zone: str
    tool: str
    work: str


@final
@dataclass(frozen=True, slots=True)
class SwitchAt:
    """TriggIO: a digital output takes a value at a distance from the end of a move, or from its start.

    Attributes:
        place: where it stands.
        name: of its triggdata.
        distance: [mm].
        from_start: whether the distance counts from the start.
        signal: the output.
        on: whether the value is geoOn; else 0.
    """

    place: Place
    name: str
    distance: float
    from_start: bool
    signal: str
    on: bool


@final
@dataclass(frozen=True, slots=True)
class FlowAt:
    """TriggSpeed: from a place on an analog output is proportional to the speed of the tip.

    Attributes:
        place: where it stands.
        name: of its triggdata.
        distance: [mm].
        from_start: whether the distance counts from the start.
        lag: by which the output leads [s].
        signal: the output.
        scale: output for 1 mm/s; multiplied by geoOn unless 0.
        dip_lag: by which the output leads a change of the speed [s].
    """

    place: Place
    name: str
    distance: float
    from_start: bool
    lag: float
    signal: str
    scale: float
    dip_lag: float


@final
@dataclass(frozen=True, slots=True)
class Call:
    """Call of a procedure, by name or late by a string, with at most one number or text."""

    place: Place
    name: str
    argument: float | str | None
    late: bool


@final
@dataclass(frozen=True, slots=True)
class Loading:
    """StartLoad or UnLoad of a file, or WaitLoad for the one that is being loaded (no file)."""

    place: Place
    verb: LoadVerb
    file: str


Statement: TypeAlias = Move | SwitchAt | FlowAt | Call | Loading


@final
@dataclass(frozen=True, slots=True)
class Declaration:
    """A datum of a module: storage is PERS, CONST or VAR, kind its RAPID type; a VAR has no value."""

    place: Place
    storage: str
    kind: str
    value: Value


@final
@dataclass(frozen=True, slots=True)
class Procedure:
    """Statements of a procedure, whose error handler shuts off and raises."""

    place: Place
    body: tuple[Statement, ...]


@final
@dataclass(frozen=True, slots=True)
class RapidText:
    """What the modules say: data and procedures by name, and the comments of each module."""

    declarations: Mapping[str, Declaration]
    procedures: Mapping[str, Procedure]
    comments: Mapping[str, tuple[str, ...]]
