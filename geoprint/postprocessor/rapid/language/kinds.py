"""Types of RAPID: what a type's name stands for, what is made of what, and whether a value fits.

A kind is a type with its aliases resolved, and how many dimensions an array of it has. Where a type is not at hand the
kind is None, and everything fits: what is not known is not judged.
"""

from __future__ import annotations

from typing import NamedTuple, final

from geoprint.errors import how_many
from geoprint.postprocessor.rapid.language.names import Names, Symbol
from geoprint.postprocessor.rapid.language.syntax import Alias, Datum, Literal, Parameter, RecordType, Routine, Value

# A RAPID num is single precision.
LARGEST_NUM = 3.4e38
STRING_LENGTH = 80


@final
class Kind(NamedTuple):
    """A type without its aliases.

    Attributes:
        name: in lower case; `number` for a number as written, which is a num or a dnum as it is needed.
        home: the file of its module where it is LOCAL, else empty.
        dimensions: of an array; 0 for one value.
    """

    name: str
    home: str = ""
    dimensions: int = 0

    def shown(self) -> str:
        """Return it as RAPID writes it."""
        name = "num" if self.name == "number" else self.name
        return name + (f"{{{','.join('*' * self.dimensions)}}}" if self.dimensions else "")


NUM, DNUM, BOOL, STRING, NUMBER = Kind("num"), Kind("dnum"), Kind("bool"), Kind("string"), Kind("number")
# There is one of each of these.
_PLAIN = {kind: kind for kind in (NUM, DNUM, BOOL, STRING)}
# As a value a digital signal is 0 or 1, a group or an analog one a number.
SIGNALS = frozenset({"signaldi", "signaldo", "signalai", "signalao", "signalgi", "signalgo"})
# What the configuration of a controller names, too, so that a program does not declare it.
CONFIGURED = SIGNALS | {"mecunit", "taskid", "sensor", "cameradev"}
_LEAVES: dict[str, type] = {"num": float, "dnum": float, "bool": bool, "string": str}
# Longer chains of aliases would be a circle.
_ALIASES = 16


@final
class Kinds:
    """Answers what types are, for the names of one task."""

    def __init__(self, names: Names) -> None:
        self._names = names
        # Of the types and records met so far.
        self._types: dict[tuple[str, str, int], Kind | None] = {}
        self._parts: dict[Kind, tuple[tuple[str, Kind | None], ...] | None] = {}

    def of_type(self, name: str, *, file: str, dimensions: int = 0) -> Kind | None:
        """Return the kind that a type's name stands for in a module, or None."""
        key = (name, file, dimensions)
        if key not in self._types:
            self._types[key] = self._of_type(name, file=file, dimensions=dimensions)
        return self._types[key]

    def _of_type(self, name: str, *, file: str, dimensions: int) -> Kind | None:
        for _ in range(_ALIASES):
            symbol = self._names.find(name, file=file, inner={})
            if symbol is None or symbol.role != "type" or symbol.node is None:
                return None
            if isinstance(symbol.node, Alias):
                name, file = symbol.node.of, symbol.file or file
                continue
            home = symbol.file if isinstance(symbol.node, RecordType) and symbol.node.local else ""
            found = Kind(symbol.name.lower(), home, dimensions)
            return _PLAIN.get(found, found)
        return None

    def of_symbol(self, symbol: Symbol) -> Kind | None:
        """Return the kind of a datum, parameter, loop's variable or signal, or of what a function returns."""
        if symbol.role == "loop":
            return NUM
        if symbol.role == "signal":
            return Kind(symbol.detail) if symbol.detail in SIGNALS else None
        node = symbol.node
        if isinstance(node, Datum):
            return self.of_type(node.kind, file=symbol.file, dimensions=len(node.sizes))
        if isinstance(node, Parameter):
            return self.of_type(node.kind, file=symbol.file, dimensions=node.dimensions)
        if isinstance(node, Routine) and node.kind == "FUNC":
            return self.of_type(node.returns, file=symbol.file)
        return None

    def components(self, kind: Kind) -> tuple[tuple[str, Kind | None], ...] | None:
        """Return names and kinds of a record's components, or None for what has none or shows none."""
        if kind.dimensions:
            return None
        found = self._names.find(kind.name, file=kind.home, inner={})
        if found is None or not isinstance(found.node, RecordType) or not found.node.components:
            return None
        file = found.file
        return tuple((name.lower(), self.of_type(of, file=file)) for of, name in found.node.components)

    def misfit(self, value: Value, kind: Kind | None, sizes: tuple[int | None, ...] = ()) -> str:
        """Say what does not fit where a literal is to be of a kind, or '' where it fits.

        Args:
            value: of the literal.
            kind: the kind.
            sizes: of the dimensions of an array, as far as they are known.
        """
        if kind is None or kind.name == "anytype":
            return ""
        if kind.dimensions:
            return self._array_misfit(value, kind, sizes)
        if kind.name in _LEAVES:
            return _leaf_misfit(value, kind)
        return self._record_misfit(value, kind)

    def _record_misfit(self, value: Value, kind: Kind) -> str:
        if kind not in self._parts:
            self._parts[kind] = self.components(kind)
        parts = self._parts[kind]
        if parts is None:
            return "" if isinstance(value, tuple) else f"{_shown(value)} is not a {kind.shown()}"
        if not isinstance(value, tuple) or len(value) != len(parts):
            found = f"{len(value)}" if isinstance(value, tuple) else _shown(value)
            return f"a {kind.shown()} has {how_many(len(parts), 'component')}, found {found}"
        for one, (_, part) in zip(value, parts, strict=True):
            # Most of a program are the numbers of targets.
            if part == NUM and type(one) is float and -LARGEST_NUM <= one <= LARGEST_NUM:
                continue
            if why := self.misfit(one, part):
                return why
        return ""

    def _array_misfit(self, value: Value, kind: Kind, sizes: tuple[int | None, ...]) -> str:
        if not isinstance(value, tuple):
            return f"{_shown(value)} is not an array"
        size = sizes[0] if sizes else None
        if size is not None and len(value) != size:
            return f"the array has {size} elements, found {len(value)}"
        inner = kind._replace(dimensions=kind.dimensions - 1)
        return next((why for one in value if (why := self.misfit(one, inner, sizes[1:]))), "")


def fits(found: Kind | None, wanted: Kind | None) -> bool:
    """Say whether a value of one kind may stand where another is wanted."""
    if found is None or wanted is None or wanted.name == "anytype" or found.name == "anytype":
        return True
    if found.name in SIGNALS and not found.dimensions and wanted.name in {"num", "dnum"}:
        return not wanted.dimensions
    if found.name == "number":
        return wanted.name in {"num", "dnum", "number"} and not wanted.dimensions
    return found == wanted or (wanted.name == "number" and found.name in {"num", "dnum"})


def kind_of_literal(literal: Literal) -> Kind | None:
    """Return the kind of a literal; None for an aggregate, whose kind depends on where it stands."""
    value = literal.value
    if isinstance(value, bool):
        return BOOL
    if isinstance(value, str):
        return STRING
    return NUMBER if isinstance(value, float) else None


def _leaf_misfit(value: Value, kind: Kind) -> str:
    if type(value) is not _LEAVES[kind.name]:
        return f"{_shown(value)} is not a {kind.name}"
    if isinstance(value, str) and len(value) > STRING_LENGTH:
        return f"a string has at most {STRING_LENGTH} characters, found {len(value)}"
    if isinstance(value, float) and kind.name == "num" and abs(value) > LARGEST_NUM:
        return f"{value:g} is too large for a num"
    return ""


def _shown(value: Value) -> str:
    if isinstance(value, tuple):
        return "an aggregate"
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    return f'"{value[:40]}"' if isinstance(value, str) else f"{value:g}"
