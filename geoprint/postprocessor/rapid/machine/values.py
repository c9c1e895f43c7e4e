"""What RAPID computes with: records, poses, operators, what every controller declares, and errors."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping
from functools import cache
from typing import NoReturn, TypeAlias, cast, final

from geoprint.errors import VerificationError
from geoprint.postprocessor.rapid.language.syntax import Value

# Errors of a running RAPID program, which its error handlers see by number, and what this machine does not know.
#
# The names are those of the controller; its numbers are its own, and a program that compares ERRNO with a number
# instead of a name is none that this machine takes.


_NAMES = (
    "ERR_ARGDUPCND", "ERR_ARGNOTPER", "ERR_ARGVALERR", "ERR_CALLPROC", "ERR_DIVZERO", "ERR_FILNOTFND", "ERR_ILLRAISE",
    "ERR_INVDIM", "ERR_LOADED", "ERR_LOADNO_INUSE", "ERR_LOADNO_NOUSE", "ERR_NOTPRES", "ERR_NUM_LIMIT", "ERR_OUTOFBND",
    "ERR_REFUNKDAT", "ERR_REFUNKFUN", "ERR_REFUNKPRC", "ERR_REFUNKTRP", "ERR_STRTOOLNG", "ERR_UNLOAD",
    "ERR_WAIT_MAXTIME", "ERR_TP_MAXTIME", "ERR_SPEED_REFRESH_LIM", "ERR_SIGSUPSEARCH", "ERR_NORUNUNIT", "ERR_ROBLIMIT",
)  # fmt: skip
# Behind those that a program raises itself (1 to 90) and those that it books.
_FIRST = 1001
ERRORS = {name.lower(): float(number) for number, name in enumerate(_NAMES, start=_FIRST)}
_NAME_OF = {number: name.upper() for name, number in ERRORS.items()}


@final
class Fault(Exception):  # noqa: N818  # RAPID calls it an error; whoever programs it takes it for a state.
    """An error of the running program.

    Attributes:
        number: that ERRNO takes.
        what: happened.
        file: where it happened; empty until somebody looks.
        line: where it happened.
    """

    def __init__(self, number: float, what: str) -> None:
        super().__init__(what)
        self.number = number
        self.what = what
        self.file, self.line = "", 0

    @property
    def name(self) -> str:
        """The error's name, or its number where a program has chosen it."""
        return _NAME_OF.get(self.number, f"error {self.number:g}")


def fault(name: str, what: str) -> NoReturn:
    """Raise a named error of the running program.

    Raises:
        Fault: always.
    """
    raise Fault(ERRORS[name.lower()], what)


def unknown(file: str, line: int, what: str) -> NoReturn:
    """Raise the error that says what this machine cannot execute, and where it stands.

    Raises:
        VerificationError: always.
    """
    raise VerificationError(
        f"{file}, line {line}: {what}, which was not checked. Do not run this program: write it again from its plan.",
        module=file,
        line=line,
        reason=what,
    )


# What the types of RAPID are made of, and the values that data have before anybody gives them one.
#
# A record is a tuple in the order of its components. A num is single precision on the controller: numbers are
# rounded to that wherever they are stored, so also in targets; expressions are computed in double precision in
# between.


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


# Poses as RAPID has them, a place [mm] and a unit quaternion, in plain numbers: what one instruction needs of them.


Pos: TypeAlias = tuple[float, float, float]
Orient: TypeAlias = tuple[float, float, float, float]
Pose: TypeAlias = tuple[Pos, Orient]

IDENTITY: Pose = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
# How far from 1 the length of a quaternion may be that a controller still takes.
_UNIT_TOLERANCE = 1e-3


def pose_of(value: Value) -> Pose:
    """Return a value as a pose with a unit quaternion.

    Raises:
        Fault: its quaternion is none.
    """
    place, turn = cast("Pose", value)
    return place, normalised(turn)


def normalised(q: Orient) -> Orient:
    """Return a quaternion of length 1.

    Raises:
        Fault: it is none, by more than a controller corrects.
    """
    w, x, y, z = q
    length = math.sqrt(w * w + x * x + y * y + z * z)
    if not abs(length - 1.0) <= _UNIT_TOLERANCE:
        fault("ERR_ARGVALERR", f"the orientation {list(q)} is not a unit quaternion")
    return w / length, x / length, y / length, z / length


def times(p: Orient, q: Orient) -> Orient:
    """Return the product of two quaternions: first q, then p."""
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def turned(q: Orient, v: Pos) -> Pos:
    """Return a vector turned by a unit quaternion."""
    w, x, y, z = q
    a, b, c = v
    i, j, k = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * i + y * k - z * j, b + w * j + z * i - x * k, c + w * k + x * j - y * i


def compose(first: Pose, second: Pose) -> Pose:
    """Return the pose `second`, which is given in coordinates of the first, in those of the first's own frame."""
    (x, y, z), q = first
    a, b, c = turned(q, second[0])
    return (x + a, y + b, z + c), times(q, second[1])


def inverted(pose: Pose) -> Pose:
    """Return the inverse of a pose."""
    place, (w, x, y, z) = pose
    back = (w, -x, -y, -z)
    a, b, c = turned(back, place)
    return (-a, -b, -c), back


def distance(a: Pos, b: Pos) -> float:
    """Return how far two places lie apart [mm]."""
    return math.dist(a, b)


def angle(p: Orient, q: Orient) -> float:
    """Return by how much two unit quaternions differ [rad]; q and -q are the same."""
    if p == q:
        return 0.0
    w, x, y, z = times((p[0], -p[1], -p[2], -p[3]), q)
    return 2.0 * math.atan2(math.sqrt(x * x + y * y + z * z), abs(w))


def between(start: Pose, end: Pose, share: float) -> Pose:
    """Return the pose at a share of a straight line along which the attitude turns at a constant rate (slerp)."""
    (a, b, c), p = start
    (x, y, z), q = end
    place = (a + share * (x - a), b + share * (y - b), c + share * (z - c))
    dot = sum(i * j for i, j in zip(p, q, strict=True))
    sign = -1.0 if dot < 0.0 else 1.0
    half = math.acos(min(abs(dot), 1.0))
    if half < 1e-9:
        return place, p
    one, other = math.sin((1.0 - share) * half) / math.sin(half), sign * math.sin(share * half) / math.sin(half)
    w, i, j, k = (one * s + other * t for s, t in zip(p, q, strict=True))
    return place, normalised((w, i, j, k))


def circle(start: Pos, through: Pos, end: Pos) -> tuple[float, float]:
    """Return length and radius of the arc through three places [mm].

    Raises:
        Fault: they lie on a line.
    """
    a, b, c = distance(through, end), distance(start, end), distance(start, through)
    half = (a + b + c) / 2.0
    area = math.sqrt(max(half * (half - a) * (half - b) * (half - c), 0.0))
    if area <= 1e-9 * max(a, b, c, 1e-9) ** 2:
        fault("ERR_ARGVALERR", "the points of the circle lie on a line")
    radius = a * b * c / (4.0 * area)
    halves = [2.0 * math.asin(min(side / (2.0 * radius), 1.0)) for side in (c, a)]
    # A side longer than the two others would span has its arc around the far side.
    for index, (side, others) in enumerate(((c, (a, b)), (a, (b, c)))):
        if side * side > others[0] ** 2 + others[1] ** 2:
            halves[index] = 2.0 * math.pi - halves[index]
    return radius * sum(halves), radius


# Data that every controller declares: speeds, zones, the frames without a tool or work object, and a few words.


_POSE: Value = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
_LOAD: Value = (0.001, (0.0, 0.0, 0.001), (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
_SPEEDS = (
    5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800, 1000, 1500, 2000, 2500, 3000, 4000, 5000,
    6000, 7000,
)  # fmt: skip
# Path zone of the tip, of the attitude and its angle: mm, mm, degrees [ABBRapid, zonedata].
_ZONES = {
    0: (0.3, 0.3, 0.03), 1: (1.0, 1.0, 0.1), 5: (5.0, 8.0, 0.8), 10: (10.0, 15.0, 1.5), 15: (15.0, 23.0, 2.3),
    20: (20.0, 30.0, 3.0), 30: (30.0, 45.0, 4.5), 40: (40.0, 60.0, 6.0), 50: (50.0, 75.0, 7.5), 60: (60.0, 90.0, 9.0),
    80: (80.0, 120.0, 12.0), 100: (100.0, 150.0, 15.0), 150: (150.0, 225.0, 23.0), 200: (200.0, 300.0, 30.0),
}  # fmt: skip


def _predefined() -> dict[str, tuple[str, Value]]:
    found: dict[str, tuple[str, Value]] = {
        "tool0": ("tooldata", (True, _POSE, _LOAD)),
        "wobj0": ("wobjdata", (False, True, "", _POSE, _POSE)),
        "load0": ("loaddata", _LOAD),
        "diskhome": ("string", "HOME:"),
        "pi": ("num", math.pi),
        "fine": ("zonedata", (True, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        "vmax": ("speeddata", (5000.0, 500.0, 5000.0, 1000.0)),
    }
    found |= {f"v{speed}": ("speeddata", (float(speed), 500.0, 5000.0, 1000.0)) for speed in _SPEEDS}
    found |= {
        f"z{name}": ("zonedata", (False, tip, turn, turn, degrees, turn, degrees))
        for name, (tip, turn, degrees) in _ZONES.items()
    }
    for name, value in (("low", 0.0), ("high", 1.0), ("edge", 2.0)):
        found[name] = ("dionum", value)
    return found | {name: ("errnum", number) for name, number in ERRORS.items()}


# Kind and value by the name in lower case.
PREDEFINED: Mapping[str, tuple[str, Value]] = _predefined()


# What the operators of RAPID do with numbers, texts and places.


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
