"""Checks GeoGuard.mod, the routines around the path, against the template that comes with geoprint.

They are the same in every program but for the names of the outputs and what a cell has, so that they are compared word
for word: whatever was changed in them is found, with its line.
"""

from __future__ import annotations

import re
from importlib import resources

from geoprint.export.rapid.reader import check_line
from geoprint.export.rapid.text import Place, refuse
from geoprint.model import Cell, Placement

GUARD = "GeoGuard.mod"


def check_guard(text: str, *, cell: Cell, placement: Placement, loading: bool) -> None:
    """Check the text of GeoGuard.mod.

    Args:
        text: of the module.
        cell: whose outputs it switches.
        placement: whether all of it was stated.
        loading: whether the program loads modules while it runs.

    Raises:
        VerificationError: a line is not what it must be.
    """
    found, wanted = text.split("\n"), _expected(cell, placement=placement, loading=loading)
    for number, line in enumerate(found, start=1):
        place = Place(GUARD, number)
        check_line(line, place)
        if number > len(wanted):
            refuse(place, f"{line.strip()[:60]!r} stands behind the end of the guard")
        if line != wanted[number - 1]:
            refuse(place, f"the guard must say {wanted[number - 1].strip()!r} here, found {line.strip()[:80]!r}")
    if len(found) < len(wanted):
        refuse(Place(GUARD, len(found)), f"the guard breaks off before {wanted[len(found)].strip()!r}")


def _expected(cell: Cell, *, placement: Placement, loading: bool) -> list[str]:
    """Return the lines of the template whose conditions all hold, with the outputs' names."""
    holds = {
        "io": cell.signals.mode == "io",
        "analog": cell.signals.mode == "analog",
        "known": not placement.missing,
        "unknown": bool(placement.missing),
        "prime": cell.purge is not None,
        "vacuum": cell.signals.vacuum is not None,
        "flood": cell.flood is not None and cell.flood.joints is not None,
        "byhand": cell.flood is not None and cell.flood.joints is None,
        "loading": loading,
    }
    outputs = {
        "<VALVE>": cell.signals.dispenser,
        "<LAMP>": cell.signals.uv_lamp,
        "<FLOW>": cell.signals.flow or "",
        "<VACUUM>": cell.signals.vacuum or "",
    }
    template = resources.files("geoprint.export.rapid").joinpath("geo_guard.mod").read_text(encoding="ascii")
    lines: list[str] = []
    for line in template.split("\n"):
        condition = re.match(r"@([a-z+]+)\|", line)
        if condition is None or all(holds[word] for word in condition[1].split("+")):
            bare = line if condition is None else line[condition.end() :]
            lines.append(re.sub("<[A-Z]+>", lambda match: outputs[match[0]], bare))
    return lines
