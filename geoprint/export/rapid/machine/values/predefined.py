"""Data that every controller declares: speeds, zones, the frames without a tool or work object, and a few words."""

from __future__ import annotations

import math
from collections.abc import Mapping

from geoprint.export.rapid.language.syntax import Value
from geoprint.export.rapid.machine.values.faults import ERRORS

_POSE: Value = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
_LOAD: Value = (0.001, (0.0, 0.0, 0.001), (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
_SPEEDS = (
    5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800, 1000, 1500, 2000, 2500, 3000, 4000, 5000,
    6000, 7000,
)  # fmt: skip
# Path zone of the tip, of the attitude and its angle: mm, mm, degrees [ABBRapid, zonedata].
_ZONES = {
    0: (0.3, 0.3, 0.03), 1: (1.0, 1.0, 0.1), 5: (5.0, 8.0, 0.8), 10: (10.0, 15.0, 1.5), 15: (15.0, 23.0, 2.3),
    20: (20.0, 30.0, 3.0), 30: (30.0, 45.0, 4.5), 40: (40.0, 60.0, 6.0), 50: (50.0, 75.0, 7.5), 60: (60.0, 90.0, 9.0),
    80: (80.0, 120.0, 12.0), 100: (100.0, 150.0, 15.0), 150: (150.0, 225.0, 23.0), 200: (200.0, 300.0, 30.0),
}  # fmt: skip


def _predefined() -> dict[str, tuple[str, Value]]:
    found: dict[str, tuple[str, Value]] = {
        "tool0": ("tooldata", (True, _POSE, _LOAD)),
        "wobj0": ("wobjdata", (False, True, "", _POSE, _POSE)),
        "load0": ("loaddata", _LOAD),
        "diskhome": ("string", "HOME:"),
        "pi": ("num", math.pi),
        "fine": ("zonedata", (True, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        "vmax": ("speeddata", (5000.0, 500.0, 5000.0, 1000.0)),
    }
    found |= {f"v{speed}": ("speeddata", (float(speed), 500.0, 5000.0, 1000.0)) for speed in _SPEEDS}
    found |= {
        f"z{name}": ("zonedata", (False, tip, turn, turn, degrees, turn, degrees))
        for name, (tip, turn, degrees) in _ZONES.items()
    }
    for name, value in (("low", 0.0), ("high", 1.0), ("edge", 2.0)):
        found[name] = ("dionum", value)
    return found | {name: ("errnum", number) for name, number in ERRORS.items()}


# Kind and value by the name in lower case.
PREDEFINED: Mapping[str, tuple[str, Value]] = _predefined()
