"""Common dispensing needles, and what a cell and a job are with one that is screwed on instead of another."""

from __future__ import annotations

from collections.abc import Mapping
from csv import DictReader
from dataclasses import replace
from importlib import resources
from math import pi
from pathlib import Path
from typing import final

from geoprint.config.cells import load_cell
from geoprint.errors import UsageError
from geoprint.model import Tool, comparable

# Lengths in which makers list them: 1/4, 1/2, 1 and 1 1/2 inch [mm].
NEEDLE_LENGTHS = (6.35, 12.7, 25.4, 38.1)
# Decimals of the lengths [mm] that are told: a cell file with them is the cell that was tried.
DECIMALS = 4
# A needle is meant that differs by so much [mm] at most: half of what the bores of neighbouring gauges do.
SAME_BORE = 0.035
# Decimals of spacing, layer height and stand-off [mm], and of the speed [mm/s], that follow from a needle.
LENGTH_DECIMALS, SPEED_DECIMALS = 3, 1


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


def needle_with_bore(bore: float, tool: Tool) -> Needle:
    """Return the needle with a bore [mm]: what a tool carries, or a common one of the same length.

    Raises:
        UsageError: there is none.
    """
    own = needle_of(tool)
    common = [replace(needle, length=own.length) for needle in common_needles() if needle.length == NEEDLE_LENGTHS[0]]
    found = min((own, *common), key=lambda needle: abs(needle.inner - bore))
    if abs(found.inner - bore) > SAME_BORE:
        bores = ", ".join(f"{needle.inner:g} ({needle.gauge} gauge)" for needle in common)
        raise UsageError(
            f"no needle has an inner diameter of {bore:g} mm: `--needle` takes {bores}, or {own.inner:g} of the cell; "
            "describe another one under [nozzle] of the cell file."
        )
    return found


def with_needle_settings(keys: Mapping[str, object]) -> dict[str, object]:
    """Return the keys of a job with what follows from its needle, where they do not say it themselves.

    The strand leaves the needle as fast as the tip moves: spacing times layer height is the area of the bore, and paths
    are one bore apart. The tip rides on top of the layer. The speed is as much below that of the cell as the bore is
    narrower: what is sheared at the wall of the needle goes with speed over diameter [Rabinowitsch1929].

    Raises:
        UsageError: as `load_cell`.
    """
    bore = keys.get("needle")
    if not isinstance(bore, float | int) or bore <= 0.0:
        return dict(keys)
    asked, path = keys.get("spacing"), keys.get("cell")
    spacing = asked if isinstance(asked, float | int) and asked > 0.0 else bore
    cell = load_cell(path if isinstance(path, Path) else None)
    layer = round(pi / 4.0 * bore**2 / spacing, LENGTH_DECIMALS)
    slower = min(1.0, bore / cell.tool.inner_diameter)
    set_by_it: dict[str, object] = {"layer_height": layer, "standoff": layer}
    set_by_it["speed"] = max(round(slower * cell.process.speed, SPEED_DECIMALS), 10.0**-SPEED_DECIMALS)
    if keys.get("rounds") is None:
        set_by_it["spacing"] = float(spacing)
    return set_by_it | dict(keys)


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
