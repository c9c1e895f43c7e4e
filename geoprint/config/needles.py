"""Common dispensing needles, and what a cell file says of one that is screwed on instead of another."""

from __future__ import annotations

from csv import DictReader
from dataclasses import replace
from importlib import resources
from typing import final

from geoprint.model import Tool, comparable

# Lengths in which makers list them: 1/4, 1/2, 1 and 1 1/2 inch [mm].
NEEDLE_LENGTHS = (6.35, 12.7, 25.4, 38.1)
# Decimals of the lengths [mm] that are told: a cell file with them is the cell that was tried.
DECIMALS = 4


@final
@comparable
class Needle:
    """A dispensing needle.

    Attributes:
        length: [mm].
        outer: diameter [mm].
        inner: diameter of the bore [mm].
        gauge: number of the gauge, or None of one that stands in no table.
    """

    length: float
    outer: float
    inner: float
    gauge: int | None = None

    @property
    def words(self) -> str:
        """What a person asks a shop for."""
        width = f"{self.gauge} gauge" if self.gauge is not None else f"{self.outer:g} mm"
        return f"a {self.length:g} mm needle of {width}"


def needle_of(tool: Tool) -> Needle:
    """Return the needle that a tool carries."""
    return Needle(tool.needle_length, tool.needle_diameter, tool.inner_diameter)


def common_needles() -> tuple[Needle, ...]:
    """Return needles of all lengths and gauges of the table, the widest first."""
    text = resources.files("geoprint.robots").joinpath("needles.csv").read_text(encoding="utf-8")
    rows = DictReader(line for line in text.splitlines() if not line.startswith("#"))
    gauges = [(int(row["gauge"]), float(row["outer_mm"]), float(row["inner_mm"])) for row in rows]
    return tuple(Needle(length, outer, inner, gauge) for gauge, outer, inner in gauges for length in NEEDLE_LENGTHS)


def with_needle(tool: Tool, needle: Needle) -> Tool:
    """Return a tool with another needle: it is as much longer as the needle is, along its axis; its mass stays."""
    longer = round(needle.length - tool.needle_length, DECIMALS)
    T_flange_tool = tool.T_flange_tool.copy()
    T_flange_tool[:3, 3] = (T_flange_tool[:3, 3] + longer * T_flange_tool[:3, 2]).round(DECIMALS)
    return replace(
        tool,
        T_flange_tool=T_flange_tool if longer else tool.T_flange_tool,
        needle_length=needle.length,
        needle_diameter=needle.outer,
        inner_diameter=needle.inner,
        barrel_top=round(tool.barrel_top + longer, DECIMALS),
    )


def needle_keys(before: Tool, after: Tool) -> str:
    """Return the keys of a cell file that change with a needle, and their values, as a person writes them."""
    nozzle = {
        "needle_length_mm": (before.needle_length, after.needle_length),
        "outer_diameter_mm": (before.needle_diameter, after.needle_diameter),
        "inner_diameter_mm": (before.inner_diameter, after.inner_diameter),
        "barrel_top_mm": (before.barrel_top, after.barrel_top),
    }
    keys = "[nozzle] " + ", ".join(f"{key} = {new:g}" for key, (old, new) in nozzle.items() if new != old)
    if (tip := after.T_flange_tool[:3, 3]).tolist() == before.T_flange_tool[:3, 3].tolist():
        return keys
    return f"{keys}, [tool] tcp_mm = [{', '.join(f'{value:.{DECIMALS}f}'.rstrip('0').rstrip('.') for value in tip)}]"
