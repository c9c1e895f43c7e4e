"""What the types of RAPID are made of, and the values that data have before anybody gives them one.

A record is a tuple in the order of its components. A num is single precision on the controller: numbers are rounded to
that wherever they are stored, so also in targets; expressions are computed in double precision in between.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from functools import cache

from geoprint.export.rapid.language.syntax import Value
from geoprint.export.rapid.machine.values.faults import fault

Components = tuple[tuple[str, str], ...]
# Elements of an array: a controller's memory holds no more.
MOST_ELEMENTS = 10_000_000


def _numbers(names: str) -> Components:
    return tuple((name, "num") for name in names.split())


RECORDS: Mapping[str, Components] = {
    "pos": _numbers("x y z"),
    "orient": _numbers("q1 q2 q3 q4"),
    "pose": (("trans", "pos"), ("rot", "orient")),
    "confdata": _numbers("cf1 cf4 cf6 cfx"),
    "extjoint": _numbers("eax_a eax_b eax_c eax_d eax_e eax_f"),
    "robjoint": _numbers("rax_1 rax_2 rax_3 rax_4 rax_5 rax_6"),
    "robtarget": (("trans", "pos"), ("rot", "orient"), ("robconf", "confdata"), ("extax", "extjoint")),
    "jointtarget": (("robax", "robjoint"), ("extax", "extjoint")),
    "loaddata": (("mass", "num"), ("cog", "pos"), ("aom", "orient"), *_numbers("ix iy iz")),
    "tooldata": (("robhold", "bool"), ("tframe", "pose"), ("tload", "loaddata")),
    "wobjdata": (
        ("robhold", "bool"), ("ufprog", "bool"), ("ufmec", "string"), ("uframe", "pose"), ("oframe", "pose"),
    ),
    "speeddata": _numbers("v_tcp v_ori v_leax v_reax"),
    "zonedata": (("finep", "bool"), *_numbers("pzone_tcp pzone_ori pzone_eax zone_ori zone_leax zone_reax")),
}  # fmt: skip
# Types that are a number by another name.
_NUMBERS = frozenset({"num", "errnum", "intnum", "dionum", "byte", "triggios", "tpnum", "opnum", "symnum"})
# Only of a fixed order of bytes a number that is too large is refused.
_SINGLE = struct.Struct("<f")
_NUMBERS_ALONE = {float}
_WHOLE = 16777216.0


def initial(kind: str, records: Mapping[str, Components]) -> Value | None:
    """Return the value of a datum of a type that is given none; None for a type whose content no program sees."""
    if kind in _NUMBERS or kind == "dnum":
        return 0.0
    if kind == "bool":
        return False
    if kind == "string":
        return ""
    if kind in records:
        parts = [initial(part, records) for _, part in records[kind]]
        return tuple(part for part in parts if part is not None)
    return None


def array_of(value: Value | None, sizes: tuple[int, ...]) -> Value | None:
    """Return an array of equal elements, nested by its dimensions.

    Raises:
        ValueError: no controller has the memory for it.
    """
    if math.prod(sizes) > MOST_ELEMENTS:
        raise ValueError(f"an array of {' x '.join(map(str, sizes))} elements, which no controller has the memory for")
    for size in reversed(sizes):
        value = None if value is None else (value,) * size
    return value


def stored(value: Value) -> Value:
    """Return a value as a controller holds it: every number in single precision.

    Raises:
        Fault: a number is too large.

    Examples:
        >>> stored((0.1, "a", (True, 16777215.0)))
        (0.10000000149011612, 'a', (True, 16777215.0))
    """
    if type(value) is float:
        if value.is_integer() and -_WHOLE <= value <= _WHOLE:
            return value
        return single(value)
    if type(value) is tuple:
        if set(map(type, value)) == _NUMBERS_ALONE:
            try:
                singles = _singles(len(value))
                return singles.unpack(singles.pack(*value))
            except OverflowError:
                # Its part says which.
                pass
        return tuple([stored(part) for part in value])
    return value


@cache
def _singles(count: int) -> struct.Struct:
    return struct.Struct(f"<{count}f")


def single(value: float) -> float:
    """Return a number in single precision.

    Raises:
        Fault: it is too large.
    """
    try:
        (rounded,) = _SINGLE.unpack(_SINGLE.pack(value))
    except OverflowError:
        fault("ERR_NUM_LIMIT", f"{value:g} is larger than a num can hold")
    return float(rounded)
