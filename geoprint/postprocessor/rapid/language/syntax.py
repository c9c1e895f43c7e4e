"""What RAPID text says, as frozen values: modules, declarations, routines, statements and expressions.

Names stand as they were written; whoever compares them takes them without regard to case. Every node knows its line;
its module is that of the routine or declaration it belongs to. Literals are whole: an aggregate of nothing but literals
is one `Literal` whose value is a nested tuple, so that a robtarget of 17 numbers is one node.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal as OneOf, NoReturn, TypeAlias, cast, final

from geoprint.errors import VerificationError
from geoprint.postprocessor.execution import refusal as refused

# Where something stands in the text of a module, and the error that names it.


@final
@dataclass(frozen=True, slots=True)
class Place:
    """Where something stands: module file and line, from 1."""

    module: str
    line: int


def refuse(place: Place, reason: str) -> NoReturn:
    """Raise the error that names a place in a module and what is wrong there.

    Raises:
        VerificationError: always.
    """
    raise refusal(place, reason)


def refusal(place: Place, reason: str) -> VerificationError:
    """Return the error that names a place in a module and what is wrong there."""
    return refused(place.module, place.line, reason)


# What RAPID expressions and arguments say, as frozen values; `syntax` has the rest and names these, too.


# A num or dnum, a bool, a string, or an aggregate of these.
Value: TypeAlias = "float | bool | str | tuple[Value, ...]"


@final
@dataclass(frozen=True, slots=True)
class Literal:
    """A number, text, TRUE or FALSE, or an aggregate of literals as nested tuples."""

    line: int
    value: Value


@final
@dataclass(frozen=True, slots=True)
class Aggregate:
    """`[a, b, ...]` with at least one part that is no literal."""

    line: int
    parts: tuple[Expression, ...]


@final
@dataclass(frozen=True, slots=True)
class Name:
    """A datum, parameter or signal by its name."""

    line: int
    name: str


@final
@dataclass(frozen=True, slots=True)
class Component:
    """`record.name`."""

    line: int
    of: Expression
    name: str


@final
@dataclass(frozen=True, slots=True)
class Element:
    """`array{i, j}`."""

    line: int
    of: Expression
    indices: tuple[Expression, ...]


@final
@dataclass(frozen=True, slots=True)
class FunctionCall:
    """`name(arguments)`."""

    line: int
    name: str
    arguments: tuple[Argument, ...]


@final
@dataclass(frozen=True, slots=True)
class Unary:
    """`+`, `-` or `NOT` of an operand."""

    line: int
    operator: str
    operand: Expression


@final
@dataclass(frozen=True, slots=True)
class Binary:
    """Two operands; the operator's word is in capitals: + - * / DIV MOD = <> < > <= >= AND OR XOR."""

    line: int
    operator: str
    left: Expression
    right: Expression


Expression: TypeAlias = "Literal | Aggregate | Name | Component | Element | FunctionCall | Unary | Binary"
# What can be assigned to, or handed over by reference.
Reference: TypeAlias = "Name | Component | Element"


@final
@dataclass(frozen=True, slots=True)
class Argument:
    r"""What a call hands over.

    Attributes:
        line: where it stands.
        name: of its parameter where it is written (`Name:=`, `\Name`), else empty.
        value: None for a switch (`\On`).
        optional: whether a backslash stands before it.
        forwarded: for `\Name?parameter`, the optional parameter of the routine around it that is handed on if present.
    """

    line: int
    name: str
    value: Expression | None
    optional: bool
    forwarded: str = ""


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


# Numbers of a robtarget, and where each of its parts ends.
TARGET = 17
_ENDS = (3, 7, 11, TARGET)


@final
@dataclass(frozen=True, slots=True)
class Series:
    """Calls one behind the other, each of a robtarget in numbers and of names: a program has tens of thousands.

    Attributes:
        lines: of each call.
        forms: which of the forms each has.
        numbers: those of the targets, 17 a call.
        shapes: the first call of each form in the module.
    """

    lines: array[int]
    forms: array[int]
    numbers: array[float]
    shapes: list[Call]

    @property
    def line(self) -> int:
        """The line of the first call."""
        return self.lines[0]

    @property
    def name(self) -> str:
        """The instruction that is called first."""
        return self.shapes[self.forms[0]].name

    def kinds(self) -> list[Call]:
        """Return one call of each form that is there."""
        return [self.shapes[form] for form in sorted(set(self.forms))]

    def calls(self) -> Iterator[Call]:
        """Yield the calls."""
        for row, (line, form) in enumerate(zip(self.lines, self.forms, strict=True)):
            shape, found = self.shapes[form], tuple(self.numbers[TARGET * row : TARGET * (row + 1)])
            target = tuple(found[first:last] for first, last in zip((0, *_ENDS), _ENDS, strict=False))
            names = [
                Argument(line, each.name, Name(line, cast("Name", each.value).name), each.optional)
                for each in shape.arguments[1:]
            ]
            first = Argument(line, "", Literal(line, target), optional=False)
            yield Call(line, shape.name, None, (first, *names))


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


Statement: TypeAlias = "Assignment | Call | Series | If | Test | For | While | Leave | Goto | Label | Connect"


def each_kind(statements: Iterable[Statement]) -> Iterator[Statement]:
    """Yield statements, of a series one call of each form."""
    for statement in statements:
        if isinstance(statement, Series):
            yield from statement.kinds()
        else:
            yield statement


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
