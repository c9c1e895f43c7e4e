"""Functions that every controller has: numbers, poses, texts, and what the arm and the panel say."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TypeAlias, cast

from geoprint.postprocessor.rapid.language.syntax import Value
from geoprint.postprocessor.rapid.machine.state import State, elements, joints_now, tip_now
from geoprint.postprocessor.rapid.machine.values import (
    Orient,
    Pos,
    Pose,
    compose,
    distance,
    fault,
    inverted,
    pose_of,
    stored,
    times,
    turned,
)

Options: TypeAlias = Mapping[str, Value]
Function: TypeAlias = Callable[[State, list[Value], Options], Value]
_NO_AXES = (9e9,) * 6


def _of_numbers(compute: Callable[..., float]) -> Function:
    def function(_: State, values: list[Value], __: Options) -> Value:
        try:
            return float(compute(*cast("list[float]", values)))
        except (ValueError, OverflowError, ZeroDivisionError) as error:
            fault("ERR_ARGVALERR", f"a function of {values} has no value ({error})")

    return function


def _round(_: State, values: list[Value], options: Options) -> Value:
    number, decimals = cast("float", values[0]), int(cast("float", options.get("dec", 0.0)))
    scale = 10.0**decimals
    return math.copysign(math.floor(abs(number) * scale + 0.5) / scale, number)


def _trunc(_: State, values: list[Value], options: Options) -> Value:
    scale = 10.0 ** int(cast("float", options.get("dec", 0.0)))
    return math.trunc(cast("float", values[0]) * scale) / scale


def _pose_mult(_: State, values: list[Value], __: Options) -> Value:
    return compose(pose_of(values[0]), pose_of(values[1]))


def _pose_inv(_: State, values: list[Value], __: Options) -> Value:
    return inverted(pose_of(values[0]))


def _pose_vect(_: State, values: list[Value], __: Options) -> Value:
    (x, y, z), turn = pose_of(values[0])
    a, b, c = turned(turn, cast("Pos", values[1]))
    return x + a, y + b, z + c


def _magnitude(_: State, values: list[Value], __: Options) -> Value:
    return distance(cast("Pos", values[0]), (0.0, 0.0, 0.0))


def _distance(_: State, values: list[Value], __: Options) -> Value:
    return distance(cast("Pos", values[0]), cast("Pos", values[1]))


def _dot(_: State, values: list[Value], __: Options) -> Value:
    return sum(a * b for a, b in zip(cast("Pos", values[0]), cast("Pos", values[1]), strict=True))


def _offs(_: State, values: list[Value], __: Options) -> Value:
    (x, y, z), *rest = cast("tuple[Pos, Value, Value, Value]", values[0])
    a, b, c = cast("list[float]", values[1:4])
    return (x + a, y + b, z + c), *rest


def _rel_tool(_: State, values: list[Value], options: Options) -> Value:
    place, turn, *rest = cast("tuple[Pos, Orient, Value, Value]", values[0])
    rx, ry, rz = (math.radians(cast("float", options.get(name, 0.0))) / 2.0 for name in ("rx", "ry", "rz"))
    about = times(
        times((math.cos(rx), math.sin(rx), 0.0, 0.0), (math.cos(ry), 0.0, math.sin(ry), 0.0)),
        (math.cos(rz), 0.0, 0.0, math.sin(rz)),
    )
    moved: Pose = compose((place, turn), (cast("Pos", tuple(values[1:4])), about))
    return *moved, *rest


def _orient(_: State, values: list[Value], __: Options) -> Value:
    rz, ry, rx = (math.radians(cast("float", value)) / 2.0 for value in values)
    about_z, about_y = (math.cos(rz), 0.0, 0.0, math.sin(rz)), (math.cos(ry), 0.0, math.sin(ry), 0.0)
    return times(times(about_z, about_y), (math.cos(rx), math.sin(rx), 0.0, 0.0))


def _normalised(_: State, values: list[Value], __: Options) -> Value:
    turn = cast("Orient", values[0])
    length = math.sqrt(sum(part * part for part in turn))
    return tuple(part / length for part in turn)


def _joints(state: State, _: list[Value], __: Options) -> Value:
    return stored((tuple(math.degrees(angle) for angle in joints_now(state)), _NO_AXES))


def _target(state: State, _: list[Value], __: Options) -> Value:
    place, turn = tip_now(state)
    return stored((place, turn, (0.0, 0.0, 0.0, 0.0), _NO_AXES))


def _place(state: State, _: list[Value], __: Options) -> Value:
    return stored(tip_now(state)[0])


def _override(state: State, _: list[Value], __: Options) -> Value:
    return state.scenario.override


def _output(state: State, values: list[Value], __: Options) -> Value:
    return state.signals.get(cast("str", values[0]).lower(), 0.0)


def _text(_: State, values: list[Value], options: Options) -> Value:
    decimals = int(cast("float", values[1]))
    form = "E" if options.get("exp") else "f"
    return f"{cast('float', values[0]):.{decimals}{form}}"


def text_of(value: Value) -> str:
    """Return a value as a controller shows it: numbers with up to six significant digits, no needless zeros.

    Examples:
        >>> text_of(7.0), text_of(True), text_of((1.5, 2.0))
        ('7', 'TRUE', '[1.5,2]')
    """
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, tuple):
        return f"[{','.join(map(text_of, value))}]"
    return value if isinstance(value, str) else f"{value:.6G}"


def _value_text(state: State, values: list[Value], _: Options) -> Value:
    state.steps += elements(values[0])
    return text_of(values[0])


def _part(_: State, values: list[Value], __: Options) -> Value:
    text, first, length = cast("tuple[str, float, float]", tuple(values))
    if not 1 <= first <= len(text) + 1 or first - 1 + length > len(text):
        fault("ERR_OUTOFBND", f"the text {text!r} has no part from {first:g} of {length:g} characters")
    return text[int(first) - 1 : int(first - 1 + length)]


def _abs(value: float) -> float:
    return abs(value)


def _atan(value: float) -> float:
    return math.degrees(math.atan(value))


def _atan2(y: float, x: float) -> float:
    return math.degrees(math.atan2(y, x))


def _asin(value: float) -> float:
    return math.degrees(math.asin(value))


def _acos(value: float) -> float:
    return math.degrees(math.acos(value))


def _sin(angle: float) -> float:
    return math.sin(math.radians(angle))


def _cos(angle: float) -> float:
    return math.cos(math.radians(angle))


def _tan(angle: float) -> float:
    return math.tan(math.radians(angle))


# Type of the value, and what gives it, by name in lower case.
FUNCTIONS: Mapping[str, tuple[str, Function]] = {
    "abs": ("num", _of_numbers(_abs)),
    "sqrt": ("num", _of_numbers(math.sqrt)),
    "exp": ("num", _of_numbers(math.exp)),
    "pow": ("num", _of_numbers(math.pow)),
    "sin": ("num", _of_numbers(_sin)),
    "cos": ("num", _of_numbers(_cos)),
    "tan": ("num", _of_numbers(_tan)),
    "atan": ("num", _of_numbers(_atan)),
    "atan2": ("num", _of_numbers(_atan2)),
    "asin": ("num", _of_numbers(_asin)),
    "acos": ("num", _of_numbers(_acos)),
    "round": ("num", _round),
    "trunc": ("num", _trunc),
    "posemult": ("pose", _pose_mult),
    "poseinv": ("pose", _pose_inv),
    "posevect": ("pos", _pose_vect),
    "vectmagn": ("num", _magnitude),
    "distance": ("num", _distance),
    "dotprod": ("num", _dot),
    "offs": ("robtarget", _offs),
    "reltool": ("robtarget", _rel_tool),
    "orientzyx": ("orient", _orient),
    "norient": ("orient", _normalised),
    "cjointt": ("jointtarget", _joints),
    "crobt": ("robtarget", _target),
    "cpos": ("pos", _place),
    "cspeedoverride": ("num", _override),
    "doutput": ("dionum", _output),
    "aoutput": ("num", _output),
    "testdi": ("bool", lambda state, values, options: _output(state, values, options) == 1.0),
    "numtostr": ("string", _text),
    "valtostr": ("string", _value_text),
    "strpart": ("string", _part),
    "strlen": ("num", lambda _, values, __: float(len(cast("str", values[0])))),
}
# Options that these take; others are not known here.
FUNCTION_OPTIONS: Mapping[str, frozenset[str]] = {
    "round": frozenset({"dec"}), "trunc": frozenset({"dec"}), "reltool": frozenset({"rx", "ry", "rz"}),
    "cspeedoverride": frozenset({"ctask"}), "numtostr": frozenset({"exp"}), "crobt": frozenset({"tool", "wobj"}),
    "cpos": frozenset({"tool", "wobj"}),
}  # fmt: skip
