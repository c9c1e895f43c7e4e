"""The standing part of a URScript program, word for word: who writes it and who checks it read the same text.

A person reviews it line by line, and it is executed in every scenario besides. It is the same in every program but for
its outputs and for what a cell has.
"""

from __future__ import annotations

import re
from importlib import resources

from geoprint.errors import UsageError
from geoprint.model import Cell, Placement

# Outputs by the names that a cell gives them, of the first output of each kind and how many there are.
_KINDS = {"digital_out": ("standard", 8), "config_out": ("configurable", 8), "tool_out": ("tool", 2)}
_NAME = re.compile(r"(digital_out|config_out|tool_out)_(\d)")


def output_of(name: str) -> tuple[str, int]:
    """Return kind and number of an output of a cell.

    Raises:
        UsageError: no controller of Universal Robots has it.
    """
    match = _NAME.fullmatch(name.lower())
    if match is None or int(match[2]) >= _KINDS[match[1]][1]:
        raise UsageError(
            f"the output {name!r} of [signals] is none of a UR controller: name one of digital_out_0 to digital_out_7, "
            "config_out_0 to config_out_7, tool_out_0 and tool_out_1."
        )
    return _KINDS[match[1]][0], int(match[2])


def guard_lines(cell: Cell, placement: Placement) -> list[str]:
    """Return the lines of the guard for a cell.

    Args:
        cell: its outputs, and what it has.
        placement: whether all of it was stated.
    """
    holds = {
        "known": not placement.missing,
        "unknown": bool(placement.missing),
        "vacuum": cell.signals.vacuum is not None,
        "prime": cell.purge is not None,
        "flood": cell.flood is not None and cell.flood.joints is not None,
        "byhand": cell.flood is not None and cell.flood.joints is None,
    }
    words = {
        "PURGE": "" if cell.purge is None else f"{cell.purge.duration:g}",
        "FLOOD": "" if cell.flood is None else f"{cell.flood.duration:g}",
    }
    signals = cell.signals
    for word, name in (("VALVE", signals.dispenser), ("LAMP", signals.uv_lamp), ("VACUUM", signals.vacuum)):
        if name is not None:
            kind, number = output_of(name)
            words[word] = f"set_{kind}_digital_out({number}"
            words[f"{word}_STATE"] = f"set_runstate_{kind}_digital_output_to_value({number}"
    template = resources.files("geoprint.postprocessor.urscript").joinpath("geo_guard.script")
    lines: list[str] = []
    for line in template.read_text(encoding="ascii").rstrip("\n").split("\n"):
        condition = re.match(r"@([a-z+]+)\|", line)
        if condition is None or all(holds[word] for word in condition[1].split("+")):
            bare = line if condition is None else line[condition.end() :]
            lines.append(re.sub("<([A-Z_]+)>", lambda match: words[match[1]], bare))
    return lines
