"""What a run sheet says of a URScript program, and the page about the controller before the first load."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources

from geoprint.model import Cell, Placement
from geoprint.postprocessor.execution import Settings
from geoprint.postprocessor.interface import Handling
from geoprint.postprocessor.orders import Orders


def handling(
    orders: Orders, cell: Cell, *, placement: Placement, names: Sequence[str], settings: Settings | None
) -> Handling:
    """Return how a program is loaded, set and started.

    Args:
        orders: that it carries out.
        cell: its outputs.
        placement: whether all of it was stated.
        names: of its files.
        settings: how it is set; None where nobody knows.
    """
    del orders
    outputs = [cell.signals.dispenser, cell.signals.uv_lamp, cell.signals.vacuum]
    steps = [
        "1. before the first load on a controller, follow urscript/controller/first_load.md: required",
        f"   outputs {', '.join(name for name in outputs if name)} go low at the end and at every stop of the program",
        "2. run it as written: dry, 20 mm higher, at 25 % (geo_dry_run True, geo_speed_pct 25)",
        "3. speed: movep keeps the tool's speed where the arm can; in blends and on short moves nobody promises it",
    ]
    if not placement.missing:
        steps.append(
            "4. to print: set geo_dry_run False and geo_speed_pct 100, speed slider 100 %; to resume at run k: clean "
            "the nozzle, set geo_first_run k, start anew"
        )
    return Handling(
        loading=(f"load {names[0]} as a Script node of kind File, and call geoprint() in a Script line behind it",),
        settings=() if settings is None else (_set_to(placement, settings),),
        steps=tuple(steps),
    )


def _set_to(placement: Placement, settings: Settings) -> str:
    """Say how the program would run now, by its three settings."""
    if settings.dry_run or placement.missing:
        return f"run dry at {settings.speed_pct:g} % speed (geo_dry_run {settings.dry_run})"
    if settings.speed_pct != 100.0:
        return "it will refuse to print: printing needs geo_speed_pct 100"
    return f"PRINT at 100 % speed, from run {settings.first_run} (geo_dry_run False)"


def first_load(cell: Cell, placement: Placement) -> str:
    """Return the page about what a controller must be set to, and what to try before the first print.

    Args:
        cell: its outputs.
        placement: whether all of it was stated.
    """
    signals = cell.signals
    words = {
        "<ARM>": cell.robot.model,
        "<VALVE>": signals.dispenser,
        "<LAMP>": signals.uv_lamp,
        "<VACUUM>": signals.vacuum or "",
    }
    holds = {"known": not placement.missing, "unknown": bool(placement.missing), "vacuum": signals.vacuum is not None}
    lines: list[str] = []
    text = resources.files("geoprint.postprocessor.urscript").joinpath("first_load.md").read_text(encoding="ascii")
    for line in text.split("\n"):
        condition, _, rest = line.partition("|")
        if condition.startswith("@") and condition[1:] in holds:
            if holds[condition[1:]]:
                lines.append(rest)
        else:
            lines.append(line)
    page = "\n".join(lines)
    for word, value in words.items():
        page = page.replace(word, value)
    return page
