"""Waypoints, outputs and triggers as RAPID text: everything a program says is written by these."""

from __future__ import annotations

import math
import re
import textwrap
import zlib
from collections.abc import Mapping, Sequence

import numpy as np

from geoprint import transforms
from geoprint.errors import InputError, UsageError
from geoprint.model import FloatArray, Signals
from geoprint.postprocessor.orders import Event, Orders, Output

# RAPID data as text: names, comments, numbers, frames. Everything a program says passes through here.
#
# A controller reads a module as code, so nothing that a person can name may reach it unchecked: names are refused
# unless they are plain identifiers, comments are reduced to printable ASCII on one line. Numbers are single
# precision on the controller (about seven digits), which the decimals here allow for.


# Micrometres are the robot's repeatability / 10; a tenth of one more keeps rounding out of every comparison.
POSITION_DECIMALS = 4
# 1e-8 of a unit quaternion is 1e-6 degree, below the single precision of the controller.
QUATERNION_DECIMALS = 8
# 1e-5 degree at the end of a 600 mm arm is 0.1 um.
ANGLE_DECIMALS = 5
INERTIA_DECIMALS = 6
# What the RAPID kernel allows in an identifier.
NAME_LENGTH = 32
# A comment is wrapped to what the teach pendant shows, and cut where it is longer than anybody reads there.
COMMENT_WIDTH = 96
COMMENT_LENGTH = 480
# External axes that do not exist.
NO_AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
# Words of the RAPID kernel, and the predefined names that the modules themselves rely on.
_KERNEL_WORDS = (
    "alias and backward case connect const default div do else elseif endfor endfunc endif endmodule endproc "
    "endrecord endtest endtrap endwhile error exit false for from func goto if inout local mod module nostepin not "
    "noview or pers proc raise readonly record retry return step sysmodule task test then to trap true trynext undo "
    "var viewonly while with xor "
)
_USED_NAMES = (
    "bool num string pos orient pose confdata robtarget jointtarget tooldata loaddata wobjdata speeddata zonedata "
    "triggdata loadsession movej movel moveabsj triggl triggio triggspeed setdo setao confj confl singarea velset "
    "pdispset pdispoff eoffsoff tperase tpwrite tpreadfk cjointt cspeedoverride poseinv posemult vectmagn abs atan2 "
    "startload waitload load unload waittime diskhome errno err_unload fine tool0 wobj0 load0 main on off start wobj "
    "posevect noeoffs dynamic file dop diplag ctask t t2 t3 t4 t5 t6 t7 t8 "
    # Parameters and local data of the guard's routines would hide an output of the same name.
    "why shift axis turn jnow far answer run runs file target lifted "
)
RESERVED = frozenset((_KERNEL_WORDS + _USED_NAMES).split())
# Every name that geoprint declares itself starts so, after at most one letter for its type.
_OWN_NAME = re.compile(r"[a-z]?geo", re.ASCII)


def identifier(name: str, *, what: str) -> str:
    """Return a name from the cell file, provided that RAPID takes it as one.

    Args:
        name: as somebody wrote it.
        what: what it names, for the message.

    Raises:
        UsageError: it is no identifier, too long, a word of RAPID, or could collide with a name of geoprint.

    Examples:
        >>> identifier("doValve", what="signals.dispenser")
        'doValve'
    """
    allowed = f"allowed are at most {NAME_LENGTH} letters, digits and underscores, a letter first"
    if len(name) > NAME_LENGTH or not _NAME.fullmatch(name):
        raise UsageError(f"{what}: {name[:60]!r} is no RAPID name; {allowed}. Rename it in the cell file.", name=name)
    if name.lower() in RESERVED or _OWN_NAME.match(name.lower()):
        raise UsageError(
            f"{what}: {name!r} is a word of RAPID or a name of geoprint's own modules (geo...). Choose another name "
            "for the output in the controller and in the cell file.",
            name=name,
        )
    return name


def comment(text: str, *, indent: str = "  ") -> list[str]:
    """Return text as comment lines of printable ASCII; what is not printable becomes a question mark.

    What is cut ends in three dots.

    Examples:
        >>> comment("heart" + chr(10) + "SetDO doUV,1;")
        ['  ! heart?SetDO doUV,1;']
    """
    plain = "".join(character if " " <= character <= "~" else "?" for character in text)
    if len(plain) > COMMENT_LENGTH:
        plain = plain[: COMMENT_LENGTH - 3] + "..."
    return [f"{indent}! {line}" for line in textwrap.wrap(plain, COMMENT_WIDTH) or ["?"]]


def number(value: float, *, decimals: int) -> str:
    """Return a number with fixed decimals, never minus zero.

    Raises:
        InputError: it is NaN or infinite.

    Examples:
        >>> number(-0.00001, decimals=4)
        '0.0000'
    """
    if not math.isfinite(value):
        raise InputError(f"a RAPID number must be finite, found {value}; check the cell file.")
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


def significant(value: float) -> str:
    """Return a number with at most six significant digits, which single precision holds.

    Raises:
        InputError: it is NaN or infinite.

    Examples:
        >>> significant(20.0), significant(0.00001234)
        ('20', '1.234E-05')
    """
    if not math.isfinite(value):
        raise InputError(f"a RAPID number must be finite, found {value}; check the cell file.")
    return f"{value + 0.0:.6G}"


def array(values: FloatArray | Sequence[float], *, decimals: int) -> str:
    """Return numbers as a RAPID record of num.

    Examples:
        >>> array([1.0, -2.5], decimals=1)
        '[1.0,-2.5]'
    """
    return f"[{','.join(number(float(value), decimals=decimals) for value in values)}]"


def pose(T_a_b: FloatArray) -> str:
    """Return a (4, 4) transform [mm] as a RAPID pose: position, then unit quaternion, w first.

    Examples:
        >>> pose(np.eye(4))
        '[[0.0000,0.0000,0.0000],[1.00000000,0.00000000,0.00000000,0.00000000]]'
    """
    position = array(T_a_b[:3, 3], decimals=POSITION_DECIMALS)
    return f"[{position},{array(transforms.quaternion_of(T_a_b[:3, :3]), decimals=QUATERNION_DECIMALS)}]"


def rounded_down(values: FloatArray, *, digits: int) -> FloatArray:
    """Return positive numbers cut to a few significant digits, so that few distinct ones remain; zero stays zero.

    Examples:
        >>> rounded_down(np.array([0.0, 0.1999, 20.0, 37.68]), digits=2)
        array([ 0.  ,  0.19, 20.  , 37.  ])
    """
    exponents = np.floor(np.log10(np.where(values > 0.0, values, 1.0))) - (digits - 1)
    # Dividing by a power of ten keeps 0.3 the number that is written as 0.3; the tiny share keeps 20.0 at 20.
    scale = 10.0**-exponents
    return np.floor(values * scale * (1.0 + 1e-12)) / scale


# The names of the outputs in RAPID, and the numbers by which a program knows the resident module that it needs.


# Of geo_resident.sys: raised with every change of its text, because a program runs with no other.
RESIDENT_VERSION = 1
# A RAPID num holds whole numbers up to 2^24 exactly.
_LARGEST_SUM = 1_000_000


def output_names(signals: Signals) -> dict[str, str]:
    """Return the RAPID name of each output, by the placeholder that stands for it in the texts of the package.

    Raises:
        UsageError: a name is no RAPID name.
    """
    names = {
        "VALVE": identifier(signals.dispenser, what="signals.dispenser"),
        "LAMP": identifier(signals.uv_lamp, what="signals.uv_lamp"),
    }
    if signals.vacuum is not None:
        names["VACUUM"] = identifier(signals.vacuum, what="signals.vacuum")
    if signals.flow is None or signals.mode == "io":
        return names
    return names | {"FLOW": identifier(signals.flow, what="signals.flow")}


def output_words(names: Mapping[str, str]) -> dict[str, str]:
    """Return what the placeholders of the texts stand for: the outputs, and what a program asks the resident for.

    Args:
        names: RAPID name of each output, by placeholder.
    """
    known = ",".join(f"{place}={name.lower()}" for place, name in sorted(names.items()))
    sum_of = zlib.crc32(known.encode("ascii")) % _LARGEST_SUM
    return {**names, "OUTPUTS": str(sum_of), "VERSION": str(RESIDENT_VERSION)}


# The trigger instructions of a program: what is defined before which move, and which move pulls it.
#
# `TriggIO` defines a switching at a distance from the end of the move that pulls it, or from its start (`\Start`);
# for a flow that follows the speed `TriggSpeed` makes an analog output proportional to the speed of the tip, from a
# place on, until the next `TriggSpeed`. Values that switch on are `geoOn`, or a multiple of it: 0 in a dry run. Both
# instructions are executed anew before each move that pulls them, so that they take the value that `geoOn` has then.


# Decimals of the distance of a trigger from the end of a move [mm].
_DISTANCE_DECIMALS = 4
# TriggL has places for so many triggers: the first, and T2 to T8.
_MOST_TRIGGERS = 8
# The flow is written anew where it has changed by this share: below what a bead shows.
_FLOW_STEP = 0.01
_PLACEHOLDERS: dict[Output, str] = {"dispenser": "VALVE", "uv_lamp": "LAMP", "vacuum": "VACUUM"}
_NAMES: dict[tuple[Output, bool], str] = {
    ("dispenser", True): "tGeoValveOn",
    ("dispenser", False): "tGeoValveOff",
    ("uv_lamp", True): "tGeoLampOn",
    ("uv_lamp", False): "tGeoLampOff",
    ("vacuum", True): "tGeoVacuumOn",
    ("vacuum", False): "tGeoVacuumOff",
}
_FLOW, _NO_FLOW = "tGeoFlow", "tGeoNoFlow"


def triggers_of(
    orders: Orders, events: tuple[Event, ...], *, signals: Signals, names: dict[str, str]
) -> tuple[list[str], dict[int, list[str]], dict[int, list[str]]]:
    """Return the trigger instructions of a program.

    Args:
        orders: targets.
        events: where the outputs switch.
        signals: mode, scale and lag of the flow.
        names: of the outputs, by placeholder.

    Returns:
        The declarations of the triggdata; and by target the instructions before the move to it, and the names of the
        triggers of that move.

    Raises:
        UsageError: a move would pull more triggers than a controller takes.
    """
    definitions: dict[int, list[str]] = {}
    pulled: dict[int, list[str]] = {}

    def pull(target: int, name: str, definition: str) -> None:
        definitions.setdefault(target, []).append(f"    {definition}")
        pulled.setdefault(target, []).append(name)

    for event in events:
        name = _NAMES[event.output, event.on]
        place = number(event.distance, decimals=_DISTANCE_DECIMALS) + ("\\Start" if event.from_start else "")
        value = "geoOn" if event.on else "0"
        pull(event.target, name, f"TriggIO {name},{place}\\DOp:={names[_PLACEHOLDERS[event.output]]},{value};")
    if signals.sets_flow:
        for target, name, definition in _flow_triggers(orders, signals=signals, output=names["FLOW"]):
            pull(target, name, definition)
    most = max((len(each) for each in pulled.values()), default=0)
    if most > _MOST_TRIGGERS:
        raise UsageError(
            f"a move would switch {most} outputs at once, a controller takes {_MOST_TRIGGERS}: the lags of [signals] "
            "are longer than the moves between runs; raise retract_mm."
        )
    switched = [name for (output, _), name in _NAMES.items() if output != "vacuum" or signals.vacuum is not None]
    used = [*switched, *((_FLOW, _NO_FLOW) if signals.sets_flow else ())]
    return [f"  VAR triggdata {name};" for name in used], definitions, pulled


def _flow_triggers(orders: Orders, *, signals: Signals, output: str) -> list[tuple[int, str, str]]:
    """Return target, name and definition of each change of the flow: where a deposit starts, varies and ends."""
    lag = significant(signals.flow_lag)
    dip = f"\\DipLag:={lag}" if signals.flow_lag > 0.0 else ""
    scales = (signals.flow_per_mm3_s * orders.flow).tolist()
    changes: list[tuple[int, str, str]] = []
    for first, last in orders.deposits:
        current = 0.0
        for target in range(first, last):
            if abs(scales[target] - current) > _FLOW_STEP * current:
                current = scales[target]
                scale = f"{significant(current)}*geoOn"
                changes.append((target + 1, _FLOW, f"TriggSpeed {_FLOW},0\\Start,{lag},{output},{scale}{dip};"))
        changes.append((last, _NO_FLOW, f"TriggSpeed {_NO_FLOW},0,{lag},{output},0;"))
    return changes
