r"""The trigger instructions of a program: what is defined before which move, and which move pulls it.

`TriggIO` defines a switching at a distance from the end of the move that pulls it, or from its start (`\Start`); for a
flow that follows the speed `TriggSpeed` makes an analog output proportional to the speed of the tip, from a place on,
until the next `TriggSpeed`. Values that switch on are `geoOn`, or a multiple of it: 0 in a dry run. Both instructions
are executed anew before each move that pulls them, so that they take the value that `geoOn` has then.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from geoprint.errors import UsageError
from geoprint.export.orders import Event, Orders, Output
from geoprint.export.rapid import values
from geoprint.model import Signals

# Decimals of the distance of a trigger from the end of a move [mm].
_DISTANCE_DECIMALS = 4
# TriggL has places for so many triggers: the first, and T2 to T8.
_MOST_TRIGGERS = 8
# The flow is written anew where it has changed by this share: below what a bead shows.
_FLOW_STEP = 0.01
_PLACEHOLDERS: dict[Output, str] = {"dispenser": "VALVE", "uv_lamp": "LAMP", "vacuum": "VACUUM"}
_NAMES: dict[tuple[Output, bool], str] = {
    ("dispenser", True): "tGeoValveOn",
    ("dispenser", False): "tGeoValveOff",
    ("uv_lamp", True): "tGeoLampOn",
    ("uv_lamp", False): "tGeoLampOff",
    ("vacuum", True): "tGeoVacuumOn",
    ("vacuum", False): "tGeoVacuumOff",
}
_FLOW, _NO_FLOW = "tGeoFlow", "tGeoNoFlow"


@final
@dataclass(frozen=True, slots=True)
class Triggers:
    """What the writer adds to the moves.

    Attributes:
        declarations: of the triggdata.
        definitions: instructions before the move to a target.
        pulled: names of the triggers of the move to a target.
    """

    declarations: list[str]
    definitions: dict[int, list[str]]
    pulled: dict[int, list[str]]


def triggers_of(orders: Orders, events: tuple[Event, ...], *, signals: Signals, names: dict[str, str]) -> Triggers:
    """Return the trigger instructions of a program.

    Args:
        orders: targets.
        events: where the outputs switch.
        signals: mode, scale and lag of the flow.
        names: of the outputs, by placeholder.

    Raises:
        UsageError: a move would pull more triggers than a controller takes.
    """
    definitions: dict[int, list[str]] = {}
    pulled: dict[int, list[str]] = {}

    def pull(target: int, name: str, definition: str) -> None:
        definitions.setdefault(target, []).append(f"    {definition}")
        pulled.setdefault(target, []).append(name)

    for event in events:
        name = _NAMES[event.output, event.on]
        place = values.number(event.distance, decimals=_DISTANCE_DECIMALS) + ("\\Start" if event.from_start else "")
        value = "geoOn" if event.on else "0"
        pull(event.target, name, f"TriggIO {name},{place}\\DOp:={names[_PLACEHOLDERS[event.output]]},{value};")
    if signals.sets_flow:
        for target, name, definition in _flow_triggers(orders, signals=signals, output=names["FLOW"]):
            pull(target, name, definition)
    most = max((len(each) for each in pulled.values()), default=0)
    if most > _MOST_TRIGGERS:
        raise UsageError(
            f"a move would switch {most} outputs at once, a controller takes {_MOST_TRIGGERS}: the lags of [signals] "
            "are longer than the moves between runs; raise retract_mm."
        )
    switched = [name for (output, _), name in _NAMES.items() if output != "vacuum" or signals.vacuum is not None]
    used = [*switched, *((_FLOW, _NO_FLOW) if signals.sets_flow else ())]
    return Triggers([f"  VAR triggdata {name};" for name in used], definitions, pulled)


def _flow_triggers(orders: Orders, *, signals: Signals, output: str) -> list[tuple[int, str, str]]:
    """Return target, name and definition of each change of the flow: where a deposit starts, varies and ends."""
    lag = values.significant(signals.flow_lag)
    dip = f"\\DipLag:={lag}" if signals.flow_lag > 0.0 else ""
    scales = (signals.flow_per_mm3_s * orders.flow).tolist()
    changes: list[tuple[int, str, str]] = []
    for first, last in orders.deposits:
        current = 0.0
        for target in range(first, last):
            if abs(scales[target] - current) > _FLOW_STEP * current:
                current = scales[target]
                scale = f"{values.significant(current)}*geoOn"
                changes.append((target + 1, _FLOW, f"TriggSpeed {_FLOW},0\\Start,{lag},{output},{scale}{dip};"))
        changes.append((last, _NO_FLOW, f"TriggSpeed {_NO_FLOW},0,{lag},{output},0;"))
    return changes
