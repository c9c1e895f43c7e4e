"""What the paper does not say of its prints: each value that is fixed beforehand, how far it may plausibly lie from it.

The paper names pressure, step and final exposure. Nobody can tell the rest from it: material, valve, light. A value
here is fixed by what the packaged cell has or by what is assumed, with the reason beside it, and never by what comes
out; the table that `python -m benchmarks.paper` prints is made of these.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from types import MappingProxyType
from typing import Literal, TypeAlias, final

import numpy as np

from geoprint.model import comparable

Drawn: TypeAlias = Literal["evenly", "by factors"]


@final
@comparable
class Printing:
    """How three prints are laid and photographed, beyond what Table I says.

    Attributes:
        fill: what case C lays, over what its layer holds.
        index: flow index of the material.
        yield_share: of case C's pressure, which the material's yield stress holds back.
        angle_deg: at which a bead meets the part as it is cured; the smaller, the more it has spread [deg].
        valve_open: time from the command until material flows [s].
        valve_close: time from the command until none flows [s].
        width_noise: standard deviation of the width along a bead, over its mean.
        slant_deg: of the light from the line of sight [deg].
        turn_deg: of the light about the line of sight [deg].
        part: share of light that the part gives back.
        bead: share of light that a bead gives back.
        grain: standard deviation of the noise of each pixel.
        blur: standard deviation of the unsharpness [pixels].
        scale: pixels of the photograph for each mm in the middle of the part.
    """

    fill: float
    index: float
    yield_share: float
    angle_deg: float
    valve_open: float
    valve_close: float
    width_noise: float
    slant_deg: float
    turn_deg: float
    part: float
    bead: float
    grain: float
    blur: float
    scale: float


@final
@comparable
class Plausible:
    """One value of a printing: what it is fixed at, and the range of what it may be.

    Attributes:
        fixed: beforehand.
        low: least that is plausible.
        high: most that is plausible.
        why: source of the fixed value, and why the range is that.
        drawn: evenly between both, or evenly in the logarithm.
    """

    fixed: float
    low: float
    high: float
    why: str
    drawn: Drawn = "evenly"

    def at(self, share: float) -> float:
        """Return the value that a share of the range lies below."""
        if self.drawn == "by factors":
            return float(self.low * (self.high / self.low) ** share)
        return self.low + share * (self.high - self.low)


PLAUSIBLE: Mapping[str, Plausible] = MappingProxyType(
    {
        "fill": Plausible(
            1.0, 0.5, 2.0, "the paper calls C the best print, so the flow is taken to fill its layer: ASSUMED; half "
            "to twice as much, as a print that fails by less still looks whole", "by factors",
        ),
        "index": Plausible(
            0.6, 0.4, 1.0, "the packaged cell's example; 1 is Newtonian, below 0.4 a paste would hardly flow at half "
            "the pressure: ASSUMED",
        ),
        "yield_share": Plausible(
            0.0, 0.0, 0.3, "the packaged cell's example; what holds back more than a third stops at small changes: "
            "ASSUMED",
        ),
        "angle_deg": Plausible(
            55.0, 22.0, 90.0, "a bead of case C is then about as high as the cell's layer, 0.5 mm; 22: pressed wholly "
            "to the stand-off of 0.3 mm; 90: cured as a half round",
        ),
        "valve_open": Plausible(0.05, 0.0, 0.1, "the packaged cell's example; up to twice that: ASSUMED"),
        "valve_close": Plausible(0.08, 0.0, 0.16, "the packaged cell's example; up to twice that: ASSUMED"),
        "width_noise": Plausible(0.05, 0.02, 0.15, "ASSUMED: as its flow errors; beads that vary more look torn"),
        "slant_deg": Plausible(0.0, 0.0, 45.0, "from the camera, as the guide asks; a lamp beside it"),
        "turn_deg": Plausible(0.0, 0.0, 360.0, "any side"),
        "part": Plausible(0.35, 0.15, 0.5, "of `geoprint.silico`; a dark to a light model of a heart: ASSUMED"),
        "bead": Plausible(0.9, 0.6, 0.95, "of `geoprint.silico`; a milky to a white silicone: ASSUMED"),
        "grain": Plausible(
            0.01, 0.003, 0.03, "of `geoprint.silico`; bright light to a dim room: ASSUMED", "by factors"
        ),
        "blur": Plausible(0.7, 0.5, 2.0, "of `geoprint.silico`; sharp to slightly out of focus: ASSUMED"),
        "scale": Plausible(
            8.0, 4.0, 12.0, "480 pixels then hold either patch; a needle 3 to 10 pixels wide, as nobody knows the "
            "paper's camera: ASSUMED", "by factors",
        ),
    }
)  # fmt: skip


def fixed_printing() -> Printing:
    """Return the printing whose every value is fixed beforehand."""
    return Printing(**{name: each.fixed for name, each in PLAUSIBLE.items()})


def drawn_printing(random: np.random.Generator) -> Printing:
    """Return a printing whose values are drawn from their ranges, each by itself."""
    return Printing(**{each.name: PLAUSIBLE[each.name].at(float(random.uniform())) for each in fields(Printing)})
