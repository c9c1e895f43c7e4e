"""Compares what a program switches as it is executed with where the plan switches, and with nothing in a dry run."""

from __future__ import annotations

from geoprint.export.orders import Event, Orders
from geoprint.export.rapid.compare import compare
from geoprint.export.rapid.made import Made
from geoprint.export.rapid.text import Place, Value, refuse
from geoprint.model import Signals

# Distance of a switching from where the plan has it [mm].
_PLACE_TOLERANCE = 2e-4
# A flow is written anew where it has changed by 1 % of what was written last, and to six digits.
_FLOW_SHARE = 0.0102


def verify_dry(made: Made) -> None:
    """Check that a dry run never switches anything on.

    Raises:
        VerificationError: it does.
    """
    for each in made.execution.switchings:
        if each.value != 0.0:
            refuse(Place(each.file, each.line), f"{each.signal} is switched to {each.value:g} here in a dry run")


def verify_switching(made: Made, events: tuple[Event, ...], *, signals: Signals) -> None:
    """Check that each move switches the outputs that the plan switches there, and no others.

    Raises:
        VerificationError: one switches elsewhere, otherwise, or not at all.
    """
    outputs = {"dispenser": signals.dispenser, "uv_lamp": signals.uv_lamp, "vacuum": signals.vacuum or ""}
    names = {output: name.lower() for output, name in outputs.items()}
    planned: dict[int, list[Event]] = {}
    for event in events:
        planned.setdefault(event.target, []).append(event)
    switched = made.switchings
    for index in sorted(switched.keys() | planned.keys()):
        found = [each for each in switched.get(index, ()) if not each.flow]
        wanted = planned.get(index, [])
        if len(found) != len(wanted):
            refuse(made.place(index), f"{len(found)} outputs switch in the move here, the plan switches {len(wanted)}")
        for trigger, event in zip(found, wanted, strict=True):
            place = Place(trigger.file, trigger.line)
            said = (trigger.signal, trigger.value, trigger.from_start)
            if said != (names[event.output], float(event.on), event.from_start):
                refuse(place, f"{trigger.signal} switches here, the plan switches the {event.output} otherwise")
            if abs(trigger.distance - event.distance) > _PLACE_TOLERANCE:
                refuse(
                    place,
                    f"{trigger.signal} switches {trigger.distance:g} mm away, the plan has {event.distance:.4f} mm",
                )


def verify_flow(made: Made, orders: Orders, *, signals: Signals) -> None:
    """Check that the output of the flow is what each stretch needs by 1 %, and 0 from the end of each deposit.

    Raises:
        VerificationError: it is not.
    """
    scale = signals.flow_per_mm3_s if signals.sets_flow else 0.0
    current = 0.0
    switched = made.switchings
    for index in range(made.count):
        ends = False
        for trigger in (each for each in switched.get(index, ()) if each.flow):
            place = Place(trigger.file, trigger.line)
            if trigger.signal != (signals.flow or "").lower() or not signals.sets_flow:
                refuse(place, f"{trigger.signal} is no output for a flow that follows the speed")
            ends = trigger.value == 0.0
            lags: Value = [signals.flow_lag, 0.0 if ends else signals.flow_lag]
            compare([trigger.lag, trigger.dip_lag], lags, tolerance=1e-6, place=place, what="the lag of the flow")
            if trigger.distance != 0.0 or trigger.from_start == ends:
                refuse(place, "a flow changes at the start of a move, and ends at the end of one")
            current = current if ends else trigger.value
        laid = index > 0 and bool(orders.laid[index - 1])
        wanted = scale * float(orders.flow[index - 1]) if laid else 0.0
        if abs(current - wanted) > _FLOW_SHARE * wanted:
            refuse(made.place(index), f"the flow in the move here is {current:g} a mm/s, the plan has {wanted:g}")
        if laid and scale > 0.0 and ends == bool(orders.laid[index]):
            refuse(made.place(index), "the flow ends where the plan goes on, or goes on where the plan ends")
        current = 0.0 if ends else current
