"""Settings that fit a pressure, for a material that is known or beside a print that worked."""

from __future__ import annotations

from typing import final

from geoprint.deposition.fitting.recommendation import Recommendation, RelativeSetting
from geoprint.model import Process, comparable


@final
@comparable
class Advice:
    """A recommendation for a known material, for a part if one was given.

    Attributes:
        told: what fits.
        process: speed, stand-off and layer height that it is for.
        pressure_kpa: that was asked.
        spacing: that was asked [mm], or None.
        depth: largest distance from the seed over the part [mm], or None without one.
        mass_g: of one layer on the part, or None without one.
    """

    told: Recommendation
    process: Process
    pressure_kpa: float
    spacing: float | None
    depth: float | None
    mass_g: float | None


@final
@comparable
class Beside:
    """Pressure and rounds beside those of a print that worked.

    Attributes:
        told: how they compare.
        pressure_kpa: that was asked.
        rounds: that were asked.
        good_pressure_kpa: of the print that worked.
        good_rounds: of the print that worked.
    """

    told: RelativeSetting
    pressure_kpa: float
    rounds: int
    good_pressure_kpa: float
    good_rounds: int
