"""The switches that a person sets in a RAPID program, and its modules as they were written but for these.

They are as they were written in a new program: dry, at a quarter of the speed, from the first run on. Whoever prints
changes them, so that other values of them are no other file.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

# Modules that hold switches.
CELL_MODULE, STACK_MODULE = "GeoCell.mod", "GeoStack.mod"
# Type and value of each switch in a new program.
NEW: Mapping[str, tuple[str, str]] = {
    "geoDryRun": ("bool", "TRUE"),
    "geoSpeedPct": ("num", "25"),
    "geoFirstRun": ("num", "1"),
}
# What GeoStack declares besides; the program itself moves the first two on. geoLastLayer is the uppermost in a new one.
NEW_STACK: Mapping[str, tuple[str, str]] = {"geoFirst{}": ("num", "1"), "geo{}Begun": ("num", "0")}
_PARTS = re.compile(r"(?m)^  CONST num nGeo(Layer|Attitude)s:=(\d+);$")


def as_written(name: str, text: str) -> str:
    """Return a file of a program with its switches as in a new program.

    Args:
        name: of the file; it may hold switches or not.
        text: of it.
    """
    return as_new(text) if name in {CELL_MODULE, STACK_MODULE} else text


def as_new(text: str) -> str:
    """Return the text of GeoCell or GeoStack with its switches as they were written, where they are plain values.

    Examples:
        >>> as_new("  PERS num geoFirstRun:=7;")
        '  PERS num geoFirstRun:=1;'
    """
    parts, switches = _PARTS.search(text), {**NEW}
    if parts is not None:
        switches |= {name.format(parts[1]): new for name, new in NEW_STACK.items()}
        switches[f"geoLast{parts[1]}"] = ("num", parts[2])
    for name, (kind, value) in switches.items():
        text = re.sub(rf"(?m)^(  PERS {kind} {name}:=)[A-Z0-9.]+;$", rf"\g<1>{value};", text)
    return text
