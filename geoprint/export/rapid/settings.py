"""The three switches of a program that a person sets in GeoCell before a run, as its run sheet asks for.

They are as they were written in a new program: dry, at a quarter of the speed, from the first run on. Whoever prints
changes them, so that other values within their ranges are no damage.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import final

from geoprint.export.rapid.compare import declared
from geoprint.export.rapid.text import Place, RapidText, Value, refuse
from geoprint.model import comparable

CELL_MODULE = "GeoCell.mod"
_CELL = Place(CELL_MODULE, 1)
# Type and value of each switch in a new program.
_NEW: Mapping[str, tuple[str, str]] = {
    "geoDryRun": ("bool", "TRUE"),
    "geoSpeedPct": ("num", "25"),
    "geoFirstRun": ("num", "1"),
}


@final
@comparable
class Settings:
    """How a program is set.

    Attributes:
        dry_run: whether it runs dry.
        speed_pct: its speed, in per cent of the planned one.
        first_run: the run from which on it prints, from 1.
    """

    dry_run: bool
    speed_pct: float
    first_run: int


def read_settings(text: RapidText, *, runs: int) -> Settings:
    """Return how a program is set.

    Args:
        text: its modules.
        runs: how many it has.

    Raises:
        VerificationError: a switch is missing, or stands at a value that the guard refuses.
    """
    data = {name: declared(text, name, kind=kind, storage="PERS", place=_CELL) for name, (kind, _) in _NEW.items()}
    dry_run, speed_pct, first_run = (datum.value for datum in data.values())
    if not isinstance(dry_run, bool):
        refuse(data["geoDryRun"].place, f"geoDryRun must be TRUE or FALSE, found {_shown(dry_run)}")
    if isinstance(speed_pct, bool) or not isinstance(speed_pct, int | float) or not 1 <= speed_pct <= 100:
        refuse(data["geoSpeedPct"].place, f"geoSpeedPct must lie between 1 and 100, found {_shown(speed_pct)}")
    if (
        isinstance(first_run, bool)
        or not isinstance(first_run, int | float)
        or first_run != int(first_run)
        or not 1 <= first_run <= runs
    ):
        refuse(
            data["geoFirstRun"].place,
            f"geoFirstRun must be a run of this program, 1 to {runs}, found {_shown(first_run)}",
        )
    return Settings(dry_run, float(speed_pct), int(first_run))


def _shown(value: Value) -> str:
    """Return a value as it is written."""
    return f"{value:g}" if isinstance(value, float) else str(value).upper()


def check_new(text: RapidText) -> None:
    """Check that a program is set as a new one must be.

    Raises:
        VerificationError: it is not.
    """
    for name, (kind, value) in _NEW.items():
        datum = declared(text, name, kind=kind, storage="PERS", place=_CELL)
        found = _shown(datum.value)
        if found != value:
            refuse(datum.place, f"{name} must be declared {value} in a new program, found {found}")


def as_new(text: str) -> str:
    """Return the text of GeoCell with its switches as they were written, where they are plain values.

    Examples:
        >>> as_new("  PERS num geoFirstRun:=7;")
        '  PERS num geoFirstRun:=1;'
    """
    for name, (kind, value) in _NEW.items():
        text = re.sub(rf"(?m)^(  PERS {kind} {name}:=)[A-Z0-9.]+;$", rf"\g<1>{value};", text)
    return text
