"""What the RAPID reader understands, as values: places, data and statements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NoReturn, TypeAlias, final

from geoprint.errors import VerificationError

Value: TypeAlias = "float | int | bool | str | list[Value]"
MoveVerb: TypeAlias = Literal["MoveAbsJ", "MoveJ", "MoveL"]


@final
@dataclass(frozen=True, slots=True)
class Place:
    """Where something stands: module file and line, from 1."""

    module: str
    line: int


@final
@dataclass(frozen=True, slots=True)
class Move:
    """A motion instruction; names are in lower case, `work` is empty where no work object is given.

    Attributes:
        place: where it stands.
        verb: the instruction.
        target: the 17 numbers of a robtarget (position, quaternion, configuration, external axes), or the name of a
            jointtarget.
        speed: name of its speeddata.
        zone: name of its zonedata, or 'fine'.
        tool: name of its tooldata.
        work: name of its wobjdata.
    """

    place: Place
    verb: MoveVerb
    target: tuple[float, ...] | str
    speed: str
    zone: str
    tool: str
    work: str


@final
@dataclass(frozen=True, slots=True)
class Switch:
    """SetDO of one output to 0 or 1."""

    place: Place
    signal: str
    value: int


@final
@dataclass(frozen=True, slots=True)
class Call:
    """Call of a procedure; the name is in lower case."""

    place: Place
    name: str


@final
@dataclass(frozen=True, slots=True)
class Guard:
    """IF NOT variable THEN; what follows up to EndGuard runs while the variable is FALSE."""

    place: Place
    variable: str


@final
@dataclass(frozen=True, slots=True)
class EndGuard:
    """ENDIF."""

    place: Place


@final
@dataclass(frozen=True, slots=True)
class Setting:
    """ConfJ, ConfL or SingArea with its switch, as written."""

    place: Place
    text: str


Statement: TypeAlias = Move | Switch | Call | Guard | EndGuard | Setting


@final
@dataclass(frozen=True, slots=True)
class Declaration:
    """A datum of a module: storage is PERS or CONST, kind its RAPID type."""

    place: Place
    storage: str
    kind: str
    value: Value


@final
@dataclass(frozen=True, slots=True)
class RapidText:
    """What the modules say: data and procedures by lower-case name, and the comments of each module."""

    declarations: Mapping[str, Declaration]
    procedures: Mapping[str, tuple[Statement, ...]]
    comments: Mapping[str, tuple[str, ...]]


def refuse(place: Place, reason: str) -> NoReturn:
    """Raise the error that names a place in a module and what is wrong there.

    Raises:
        VerificationError: always.
    """
    raise VerificationError(
        f"{place.module}, line {place.line}: {reason}. Do not run this program; write it again from its plan.",
        module=place.module,
        line=place.line,
    )
