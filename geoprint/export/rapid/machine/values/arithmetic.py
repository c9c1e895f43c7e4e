"""What the operators of RAPID do with numbers, texts and places."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NoReturn, TypeAlias, cast

from geoprint.export.rapid.language.syntax import Value
from geoprint.export.rapid.machine.values.faults import fault

Parts: TypeAlias = tuple[float, ...]


def added(a: Value, b: Value) -> Value:
    """Return the sum of two numbers or places, or two texts one behind the other."""
    if isinstance(a, tuple):
        return tuple(x + y for x, y in zip(cast("Parts", a), cast("Parts", b), strict=True))
    # Of two texts as well.
    return cast("float", a) + cast("float", b)


def subtracted(a: Value, b: Value) -> Value:
    """Return the difference of two numbers or places."""
    if isinstance(a, tuple):
        return tuple(x - y for x, y in zip(cast("Parts", a), cast("Parts", b), strict=True))
    return cast("float", a) - cast("float", b)


def multiplied(a: Value, b: Value) -> Value:
    """Return the product of two numbers, a place scaled by a number, or the vector product of two places."""
    if isinstance(a, tuple) and isinstance(b, tuple):
        (u, v, w), (x, y, z) = cast("Parts", a), cast("Parts", b)
        return v * z - w * y, w * x - u * z, u * y - v * x
    if isinstance(b, tuple):
        a, b = b, a
    if isinstance(a, tuple):
        return tuple(x * cast("float", b) for x in cast("Parts", a))
    return cast("float", a) * cast("float", b)


def divided(a: Value, b: Value) -> Value:
    """Return the quotient of two numbers, or of a place and a number."""
    by = cast("float", b)
    if not by:
        _by_zero()
    return tuple(x / by for x in cast("Parts", a)) if isinstance(a, tuple) else cast("float", a) / by


def _whole(a: Value, b: Value) -> Value:
    one, other = cast("float", a), cast("float", b)
    return float(int(one / other)) if other else _by_zero()


def _rest(a: Value, b: Value) -> Value:
    one, other = cast("float", a), cast("float", b)
    return one - other * int(one / other) if other else _by_zero()


def _by_zero() -> NoReturn:
    fault("ERR_DIVZERO", "a number is divided by 0")


ARITHMETIC: Mapping[str, Callable[[Value, Value], Value]] = {
    "+": added,
    "-": subtracted,
    "*": multiplied,
    "/": divided,
    "DIV": _whole,
    "MOD": _rest,
}
