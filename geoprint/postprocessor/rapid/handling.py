"""What a run sheet says of a RAPID program: what to load, how its switches stand, what to do before the start."""

from __future__ import annotations

from collections.abc import Sequence

from geoprint.errors import how_many
from geoprint.model import Cell, Placement
from geoprint.postprocessor.execution import Settings, StackSettings
from geoprint.postprocessor.interface import Handling
from geoprint.postprocessor.orders import Orders
from geoprint.postprocessor.rapid.configuration import configurations

_HOME = "the controller's HOME folder"


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
    loaded = sum(name.startswith("GeoPath") for name in names)
    copies = f"; copy the {loaded} GeoPath modules to {_HOME}" if loaded else ""
    return Handling(
        loading=(f"load GeoPrint.pgf ({len(names) - 1 - loaded} modules){copies}",),
        settings=() if settings is None else tuple(_settings(cell, placement, settings)),
        steps=tuple(_steps(orders, cell, placement)),
    )


def _settings(cell: Cell, placement: Placement, settings: Settings) -> list[str]:
    """Say how the program would run now, by its three switches."""
    if settings.dry_run or placement.missing:
        return [f"run dry at {settings.speed_pct:g} % speed (geoDryRun {str(settings.dry_run).upper()})"]
    texts = [f"PRINT at {settings.speed_pct:g} % speed, from run {settings.first_run} (geoDryRun FALSE)"]
    if cell.signals.mode == "io" and settings.speed_pct != 100.0:
        texts.append("it will refuse to print: a fixed pressure needs geoSpeedPct 100")
    return texts


def _steps(orders: Orders, cell: Cell, placement: Placement) -> list[str]:
    signals = cell.signals
    texts = ["1. before the first load on a controller, follow rapid/controller/first_load.md: required"]
    if signals.mode == "analog" and signals.flow_lag > 0.0:
        texts.append(
            f"   set the system parameter Event Preset Time to at least {signals.flow_lag:g} s, for TriggSpeed"
        )
    texts.append("2. run it as written: dry, 20 mm higher, at 25 % (geoDryRun TRUE, geoSpeedPct 25)")
    printed, dry = configurations(orders, cell)
    others = int((dry != printed).any(axis=1).sum())
    if others:
        texts.append(f"   {how_many(others, 'target')} with other configuration data there: only the print proves them")
    if not placement.missing:
        full = " and geoSpeedPct 100, speed override 100 %" if signals.mode == "io" else ""
        texts.append(
            f"3. to print: set geoDryRun FALSE{full}; to resume at run k: clean the nozzle, set geoFirstRun k, start "
            "from main"
        )
    return texts


def parts_handling(
    one: str, count: int, settings: StackSettings | None, *, dry_only: bool, table: str
) -> list[tuple[str, list[str]]]:
    """Return how a program of several parts is set, printed, stopped and begun again.

    Args:
        one: what it loads one after another: a layer, or an attitude of a table.
        count: of them.
        settings: how it is set to run; None where nobody knows.
        dry_only: whether it runs dry only.
        table: name of the table that tilts the part; empty where it stands still.
    """
    attitude = one == "attitude"
    first, last = f"geoFirst{one.title()}", f"geoLast{one.title()}"
    each = ", with the table in each attitude" if attitude else ""
    printing = [f"first run it as written: dry, 20 mm higher, at 25 %{each} (geoDryRun TRUE, geoSpeedPct 25)"]
    stopping = (
        f"{last}, 1 to {count}, ends the program after that {one}, at home with all outputs off; lower it at any time "
        f"while {'an' if attitude else 'a'} {one} prints"
    )
    rows = [("is set to", [] if settings is None else [_set_to(one, settings, dry_only=dry_only)])]
    rows += [("table", _table_lines(table))] if table else []
    if dry_only:
        return [*rows, ("to print", printing), *([("to stop", [stopping])] if count > 1 else [])]
    printing.append("then set geoDryRun FALSE; at a fixed pressure, also geoSpeedPct 100 and speed override 100 %")
    begun = (
        f"{first} holds the unfinished {one}: clean the nozzle, set geoFirstRun to the run shown on the pendant, "
        "start from main"
    )
    resuming = [
        begun,
        f"after the last {one}, set {first} to 1 for a new part",
    ]
    return [
        *rows, ("to print", printing), *([("to stop", [stopping])] if count > 1 else []), ("to resume", resuming)
    ]  # fmt: skip


def _set_to(one: str, settings: StackSettings, *, dry_only: bool) -> str:
    parts = f"{one}s {settings.first_layer} to {settings.last_layer}"
    if settings.dry_run or dry_only:
        return f"run {parts} dry at {settings.speed_pct:g} % speed (geoDryRun {str(settings.dry_run).upper()})"
    return (
        f"PRINT {parts} at {settings.speed_pct:g} % speed, from run {settings.first_run} of the first (geoDryRun FALSE)"
    )


def _table_lines(name: str) -> list[str]:
    """Return what a person must know who brings a table to its attitudes."""
    return [
        f"the {name} moves only while the arm is at home and asks you: check it, move it or let it move, then answer",
        "only you can notice a wrong attitude or a wrong zero of a driven table: the tool would hit the part",
    ]


def parts_loading(folders: str, file: str) -> str:
    """Return what a person copies and loads of a program of several parts.

    Args:
        folders: of the parts, in words.
        file: that is loaded, in the bundle.
    """
    return f"copy {folders} to {_HOME}, then load {file}"
