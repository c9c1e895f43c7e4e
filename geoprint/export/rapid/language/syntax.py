"""What RAPID text says, as frozen values: modules, declarations, routines, statements and expressions.

Names stand as they were written; whoever compares them takes them without regard to case. Every node knows its line;
its module is that of the routine or declaration it belongs to. Literals are whole: an aggregate of nothing but literals
is one `Literal` whose value is a nested tuple, so that a robtarget of 17 numbers is one node.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal as OneOf, TypeAlias, final

from geoprint.export.rapid.language.expression_syntax import (
    Aggregate as Aggregate,
    Argument as Argument,
    Binary as Binary,
    Component as Component,
    Element as Element,
    Expression as Expression,
    FunctionCall as FunctionCall,
    Literal as Literal,
    Name as Name,
    Reference as Reference,
    Unary as Unary,
    Value as Value,
)

Storage: TypeAlias = OneOf["VAR", "PERS", "CONST"]
RoutineKind: TypeAlias = OneOf["PROC", "FUNC", "TRAP"]


@final
@dataclass(frozen=True, slots=True)
class Assignment:
    """`target := value;`."""

    line: int
    target: Reference
    value: Expression


@final
@dataclass(frozen=True, slots=True)
class Call:
    """An instruction or a procedure: `name arguments;`, or late by a text: `%late% arguments;` (then `name` is '')."""

    line: int
    name: str
    late: Expression | None
    arguments: tuple[Argument, ...]


@final
@dataclass(frozen=True, slots=True)
class If:
    """Conditions with their bodies, in order, and what is done otherwise; a compact IF has one of one statement."""

    line: int
    branches: tuple[tuple[Expression, tuple[Statement, ...]], ...]
    otherwise: tuple[Statement, ...]


@final
@dataclass(frozen=True, slots=True)
class Test:
    """`TEST subject`: the values of each CASE with their body, and the DEFAULT."""

    line: int
    subject: Expression
    cases: tuple[tuple[tuple[Expression, ...], tuple[Statement, ...]], ...]
    default: tuple[Statement, ...]


@final
@dataclass(frozen=True, slots=True)
class For:
    """`FOR variable FROM first TO last STEP step DO`; without a step it is None."""

    line: int
    variable: str
    first: Expression
    last: Expression
    step: Expression | None
    body: tuple[Statement, ...]


@final
@dataclass(frozen=True, slots=True)
class While:
    """`WHILE condition DO`."""

    line: int
    condition: Expression
    body: tuple[Statement, ...]


@final
@dataclass(frozen=True, slots=True)
class Leave:
    """RETURN, EXIT, RETRY, TRYNEXT or RAISE, with the value or error number that stands behind it, or None."""

    line: int
    verb: OneOf["RETURN", "EXIT", "RETRY", "TRYNEXT", "RAISE"]
    value: Expression | None


@final
@dataclass(frozen=True, slots=True)
class Goto:
    """`GOTO label;`."""

    line: int
    label: str


@final
@dataclass(frozen=True, slots=True)
class Label:
    """`label:`."""

    line: int
    name: str


@final
@dataclass(frozen=True, slots=True)
class Connect:
    """`CONNECT interrupt WITH trap;`."""

    line: int
    interrupt: Reference
    trap: str


Statement: TypeAlias = "Assignment | Call | If | Test | For | While | Leave | Goto | Label | Connect"


@final
@dataclass(frozen=True, slots=True)
class Datum:
    """A declared datum.

    Attributes:
        line: where it stands.
        name: as written.
        storage: VAR, PERS or CONST.
        kind: RAPID type.
        sizes: of the dimensions of an array; empty for a scalar.
        value: its initial value, or None.
        local: whether it is declared LOCAL.
    """

    line: int
    name: str
    storage: Storage
    kind: str
    sizes: tuple[Expression, ...]
    value: Expression | None
    local: bool = False


@final
@dataclass(frozen=True, slots=True)
class RecordType:
    """A record type: types and names of its components."""

    line: int
    name: str
    components: tuple[tuple[str, str], ...]
    local: bool = False


@final
@dataclass(frozen=True, slots=True)
class Alias:
    """A type by another name."""

    line: int
    name: str
    of: str
    local: bool = False


@final
@dataclass(frozen=True, slots=True)
class Parameter:
    r"""A parameter of a routine.

    Attributes:
        line: where it stands.
        name: as written.
        kind: RAPID type; `switch` for a switch.
        mode: how it is handed over: '' (IN), 'VAR', 'PERS', 'INOUT'.
        optional: whether a backslash stands before it.
        group: parameters of one number exclude each other (`\A | \B`); each stands in one.
        dimensions: of an array `{*, *}`; 0 for a scalar.
    """

    line: int
    name: str
    kind: str
    mode: str
    optional: bool
    group: int
    dimensions: int


@final
@dataclass(frozen=True, slots=True)
class Handler:
    """An ERROR clause: the error numbers that it takes, all of them where none is named, and its statements."""

    line: int
    errors: tuple[Expression, ...]
    body: tuple[Statement, ...]


@final
@dataclass(frozen=True, slots=True)
class Routine:
    """A procedure, function or trap.

    Attributes:
        line: where it begins.
        last_line: where it ends.
        name: as written.
        kind: PROC, FUNC or TRAP.
        returns: type of a function's value, else empty.
        parameters: in order.
        data: its own.
        body: its statements.
        handlers: its ERROR clauses.
        undo: statements of its UNDO clause.
        backward: statements of its BACKWARD clause.
        local: whether it is declared LOCAL.
    """

    line: int
    last_line: int
    name: str
    kind: RoutineKind
    returns: str
    parameters: tuple[Parameter, ...]
    data: tuple[Datum, ...]
    body: tuple[Statement, ...]
    handlers: tuple[Handler, ...]
    undo: tuple[Statement, ...]
    backward: tuple[Statement, ...]
    local: bool = False


@final
@dataclass(frozen=True, slots=True)
class Module:
    """A module.

    Attributes:
        file: name of its file.
        name: behind MODULE.
        attributes: SYSMODULE, NOVIEW, ... in capitals.
        types: records and aliases.
        data: of the module.
        routines: in order.
        comments: number and text of each comment line, from its exclamation mark.
        lines: how many it has.
    """

    file: str
    name: str
    attributes: tuple[str, ...]
    types: tuple[RecordType | Alias, ...]
    data: tuple[Datum, ...]
    routines: tuple[Routine, ...]
    comments: tuple[tuple[int, str], ...]
    lines: int
