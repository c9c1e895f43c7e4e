"""The switches that a person sets before a run, as the run sheet asks for: three in GeoCell, five in GeoStack.

They are as they were written in a new program: dry, at a quarter of the speed, from the first run on. Whoever prints
changes them, so that other values within their ranges are no damage, and make no other file.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from geoprint.model import Placement
from geoprint.postprocessor.execution import Settings, StackSettings
from geoprint.postprocessor.rapid.language.syntax import Place, refuse
from geoprint.postprocessor.rapid.reader import Listed, RapidText, declared

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
_CELL, _STACK = Place(CELL_MODULE, 1), Place(STACK_MODULE, 1)


def unit_of(placement: Placement) -> str:
    """Return what the parts of one program are, as names of its data have it: layers, or attitudes of a table."""
    return "Layer" if placement.table is None else "Attitude"


def read_stack_settings(text: RapidText, *, runs: Sequence[int], unit: str) -> StackSettings:
    """Return how the program of a stack is set.

    Args:
        text: its GeoStack.
        runs: of each layer, how many.
        unit: as `unit_of`.

    Raises:
        VerificationError: a switch is missing, or stands at a value that the program refuses.
    """
    dry_run, speed_pct = _pace(text, _STACK)
    one = unit.lower()
    some, whole = ("a layer", "this stack") if one == "layer" else ("an attitude", "this program")
    first = _whole(text, f"geoFirst{unit}", most=len(runs), of=f"{some} of {whole}", place=_STACK)
    last = _whole(text, f"geoLast{unit}", least=first, most=len(runs), of=f"{some} from the first on", place=_STACK)
    run = _whole(text, "geoFirstRun", most=runs[first - 1], of=f"a run of {one} {first}", place=_STACK)
    return StackSettings(dry_run, speed_pct, first, run, last)


def read_settings(text: RapidText, *, runs: int) -> Settings:
    """Return how a program is set.

    Args:
        text: its modules.
        runs: how many it has.

    Raises:
        VerificationError: a switch is missing, or stands at a value that the guard refuses.
    """
    dry_run, speed_pct = _pace(text, _CELL)
    return Settings(dry_run, speed_pct, _whole(text, "geoFirstRun", most=runs, of="a run of this program", place=_CELL))


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


def check_new(text: RapidText) -> None:
    """Check that a program is set as a new one must be.

    Raises:
        VerificationError: it is not.
    """
    for name, (kind, value) in NEW.items():
        datum = declared(text, name, kind=kind, storage="PERS", place=_CELL)
        found = _shown(datum.value)
        if found != value:
            refuse(datum.place, f"{name} must be declared {value} in a new program, found {found}")


def _pace(text: RapidText, place: Place) -> tuple[bool, float]:
    """Return whether a program runs dry, and at which speed [%]."""
    dry_run, speed_pct = (
        declared(text, name, kind=NEW[name][0], storage="PERS", place=place) for name in ("geoDryRun", "geoSpeedPct")
    )
    value = speed_pct.value
    if not isinstance(dry_run.value, bool):
        refuse(dry_run.place, f"geoDryRun must be TRUE or FALSE, found {_shown(dry_run.value)}")
    if isinstance(value, bool) or not isinstance(value, int | float) or not 1 <= value <= 100:
        refuse(speed_pct.place, f"geoSpeedPct must lie between 1 and 100, found {_shown(value)}")
    return dry_run.value, float(value)


def _whole(text: RapidText, name: str, *, most: int, of: str, place: Place, least: int = 1) -> int:
    """Return a switch that counts."""
    datum = declared(text, name, kind="num", storage="PERS", place=place)
    value = datum.value
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float)
        or value != int(value)
        or not least <= value <= most
    ):
        refuse(datum.place, f"{name} must be {of}, {least} to {most}, found {_shown(value)}")
    return int(value)


def _shown(value: Listed) -> str:
    """Return a value as it is written."""
    return f"{value:g}" if isinstance(value, float) else str(value).upper()
