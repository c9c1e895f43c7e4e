"""Checks GeoGuard.mod and GeoResident.sys, which stand around the path, against the templates that come with geoprint.

They are the same in every program but for the names of the outputs and what a cell has, so that they are compared word
for word: whatever was changed in them is found, with its line.
"""

from __future__ import annotations

import re
import zlib
from importlib import resources

from geoprint.model import Cell, Hexapod, Placement, TiltTurn
from geoprint.postprocessor.rapid.language.syntax import Place, refuse
from geoprint.postprocessor.rapid.reader import check_line

GUARD = "GeoGuard.mod"
# Where it lies in the folder of the program.
RESIDENT = "controller/GeoResident.sys"
# The version of the resident that programs ask for.
_VERSION = 1


def check_guard(text: str, *, cell: Cell, placement: Placement, loading: bool, stacked: bool = False) -> None:
    """Check the text of GeoGuard.mod.

    Args:
        text: of the module.
        cell: whose outputs it switches.
        placement: whether all of it was stated.
        loading: whether the program loads modules while it runs.
        stacked: whether it is a layer of a stack, or one of several attitudes.

    Raises:
        VerificationError: a line is not what it must be.
    """
    _compare(GUARD, text, _expected("geo_guard.mod", cell, placement=placement, loading=loading, stacked=stacked))


def check_resident(text: str, *, cell: Cell, placement: Placement) -> None:
    """Check the text of GeoResident.sys, the module that outlasts programs.

    Args:
        text: of the module.
        cell: whose outputs it switches.
        placement: of the part.

    Raises:
        VerificationError: a line is not what it must be.
    """
    _compare(RESIDENT, text, _expected("geo_resident.sys", cell, placement=placement, loading=False))


def resident_module(cell: Cell, placement: Placement) -> tuple[str, str]:
    """Return file name and text of the module that a controller must keep for the programs of a cell.

    Args:
        cell: whose outputs it switches.
        placement: of the part.
    """
    lines = _expected("geo_resident.sys", cell, placement=placement, loading=False)
    return RESIDENT.rpartition("/")[2], "\n".join(lines)


def _compare(module: str, text: str, wanted: list[str]) -> None:
    found = text.split("\n")
    for number, line in enumerate(found, start=1):
        place = Place(module, number)
        check_line(line, place)
        if number > len(wanted):
            refuse(place, f"{line.strip()[:60]!r} follows the end of the module")
        if line != wanted[number - 1]:
            refuse(place, f"the guard must say {wanted[number - 1].strip()!r} here, found {line.strip()[:80]!r}")
    if len(found) < len(wanted):
        refuse(Place(module, len(found)), f"the guard ends before {wanted[len(found)].strip()!r}")


def _expected(file: str, cell: Cell, *, placement: Placement, loading: bool, stacked: bool = False) -> list[str]:
    """Return the lines of the template whose conditions all hold, with the outputs' names."""
    unit = cell.table.unit if placement.table is not None and isinstance(cell.table, TiltTurn) else None
    holds = {
        "io": not cell.signals.sets_flow,
        "analog": cell.signals.sets_flow,
        "known": not placement.missing,
        "unknown": bool(placement.missing),
        "prime": cell.purge is not None,
        "vacuum": cell.signals.vacuum is not None,
        "flood": cell.flood is not None and cell.flood.joints is not None,
        "byhand": cell.flood is not None and cell.flood.joints is None,
        "loading": loading,
        "single": not stacked,
        "stacked": stacked,
        "table": placement.table is not None,
        "hexapod": placement.table is not None and isinstance(cell.table, Hexapod),
        "tiltturn": placement.table is not None and isinstance(cell.table, TiltTurn),
        "driven": unit is not None,
        "undriven": unit is None,
    }
    signals = cell.signals
    outputs = {"<VALVE>": signals.dispenser, "<LAMP>": signals.uv_lamp, "<VACUUM>": signals.vacuum or ""}
    if signals.sets_flow:
        outputs["<FLOW>"] = signals.flow or ""
    named = sorted(f"{place[1:-1]}={name.lower()}" for place, name in outputs.items() if name)
    outputs["<OUTPUTS>"] = str(zlib.crc32(",".join(named).encode("ascii")) % 1000000)
    outputs["<VERSION>"], outputs["<STATION>"] = str(_VERSION), unit or ""
    outputs["<UNIT>"], outputs["<LOWER>"] = ("Layer", "layer") if placement.table is None else ("Attitude", "attitude")
    template = resources.files("geoprint.postprocessor.rapid").joinpath(file).read_text(encoding="ascii")
    lines: list[str] = []
    for line in template.split("\n"):
        condition = re.match(r"@([a-z+]+)\|", line)
        if condition is None or all(holds[word] for word in condition[1].split("+")):
            bare = line if condition is None else line[condition.end() :]
            lines.append(re.sub("<[A-Z]+>", lambda match: outputs[match[0]], bare))
    return lines
