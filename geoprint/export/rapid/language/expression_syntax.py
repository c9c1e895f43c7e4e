"""What RAPID expressions and arguments say, as frozen values; `syntax` has the rest and names these, too."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias, final

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
