"""RAPID data as text: names, comments, numbers, frames. Everything a program says passes through here.

A controller reads a module as code, so nothing that a person can name may reach it unchecked: names are refused unless
they are plain identifiers, comments are reduced to printable ASCII on one line. Numbers are single precision on the
controller (about seven digits), which the decimals here allow for.
"""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Sequence

import numpy as np

from geoprint import transforms
from geoprint.errors import InputError, UsageError
from geoprint.model import FloatArray

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
            f"{what}: {name!r} is a word of RAPID or a name of geoprint's own modules (geo...); "
            "choose another name for the output in the controller and in the cell file.",
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
