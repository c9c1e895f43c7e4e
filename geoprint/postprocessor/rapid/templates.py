"""The texts that come with the package: lines that stand only under conditions, and names that are filled in.

A line such as `@known+io|text` stands where all its conditions hold, and `<VALVE>` is replaced by the name in the cell.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from importlib import resources

from geoprint.model import Cell, Hexapod, Placement, TiltTurn


def filled(template: str, *, holding: Collection[str], words: Mapping[str, str]) -> str:
    """Return a text of the package for one program.

    Args:
        template: name of the file.
        holding: the conditions that hold.
        words: what each placeholder stands for, without its brackets.

    Raises:
        KeyError: the text has a placeholder that `words` does not name.
    """
    text = resources.files("geoprint.postprocessor.rapid").joinpath(template).read_text(encoding="ascii")
    lines: list[str] = []
    for line in text.split("\n"):
        tags, _, bare = line[1:].partition("|") if line.startswith("@") else ("", "", line)
        if not tags or set(tags.split("+")) <= set(holding):
            lines.append(re.sub(r"<([A-Z]+)>", lambda match: words[match[1]], bare))
    return "\n".join(lines)


def conditions(cell: Cell, *, placement: Placement, loading: bool, stacked: bool = False) -> set[str]:
    """Return the conditions that hold for a program.

    Args:
        cell: its outputs, and what it has besides valve and lamp.
        placement: whether all of it was stated, and how a table holds the part.
        loading: whether the program loads its modules while it runs.
        stacked: whether it is a layer of a stack or one of several attitudes, or all of them.
    """
    holding = {
        "analog" if cell.signals.sets_flow else "io",
        "unknown" if placement.missing else "known",
        "stacked" if stacked else "single",
    }
    holding |= {"prime"} if cell.purge is not None else set()
    holding |= {"vacuum"} if cell.signals.vacuum is not None else set()
    holding |= {"lag" if cell.signals.sets_flow and cell.signals.flow_lag > 0.0 else "nolag"}
    if cell.flood is not None:
        holding.add("byhand" if cell.flood.joints is None else "flood")
    if placement.table is not None:
        holding |= {"table", "hexapod" if isinstance(cell.table, Hexapod) else "tiltturn"}
    holding.add("undriven" if driving_unit(cell, placement) is None else "driven")
    return holding | ({"loading"} if loading else set())


def driving_unit(cell: Cell, placement: Placement) -> str | None:
    """Return the mechanical unit that brings the part to its attitude; None where the program moves no table."""
    return cell.table.unit if placement.table is not None and isinstance(cell.table, TiltTurn) else None


def unit_words(placement: Placement) -> dict[str, str]:
    """Return what the placeholders for parts of one program stand for: layers of a stack, or attitudes of a table."""
    if placement.table is None:
        return {"UNIT": "Layer", "LOWER": "layer", "WHOLE": "stack"}
    return {"UNIT": "Attitude", "LOWER": "attitude", "WHOLE": "program"}
