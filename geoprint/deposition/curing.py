"""Light: the dose that a passing lamp and a final flood exposure give, and the speed that a wanted dose allows.

The lamp's spot is taken as a disc of even irradiance that moves along the path. mW/cm2 times s are mJ/cm2.
"""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.model import Flood, Material, comparable


@final
@comparable
class Exposure:
    """What the lamp gives as it passes over the part, beside what the material needs.

    Attributes:
        one_pass: dose on the path's own line when the spot passes once [mJ/cm2].
        all_passes: mean dose of all passes together [mJ/cm2].
        wanted: dose that cures the material [mJ/cm2], or None where nobody knows it.
        fastest: speed up to which one pass gives it [mm/s], or None.
        flood: final exposure of the whole part [s], or None where there is none.
    """

    one_pass: float
    all_passes: float
    wanted: float | None
    fastest: float | None
    flood: float | None

    @property
    def lacking(self) -> str | None:
        """One sentence where one pass does not cure the material, else None."""
        if self.wanted is None or self.fastest is None or self.one_pass >= self.wanted:
            return None
        flooded = (
            "no final exposure is named ([flood])"
            if self.flood is None
            else f"the final exposure of {self.flood:g} s must do the rest"
        )
        return (
            f"one pass of the lamp gives {self.one_pass:.3g}, all passes together {self.all_passes:.3g} of "
            f"{self.wanted:.3g} mJ/cm2: up to {self.fastest:.3g} mm/s it would cure at once; {flooded}."
        )


def exposure(material: Material | None, *, speed: float, spacing: float, flood: Flood | None) -> Exposure | None:
    """Return the light on a part, or None where nobody has measured the lamp's spot.

    Args:
        material: with the spot and the dose that it needs.
        speed: of the tip [mm/s].
        spacing: between paths [mm].
        flood: final exposure of the whole part.
    """
    if material is None or material.irradiance is None or material.spot_diameter is None:
        return None
    irradiance, spot = material.irradiance, material.spot_diameter
    dose = material.dose
    return Exposure(
        one_pass=dose_of_pass(irradiance=irradiance, spot_diameter=spot, speed=speed),
        all_passes=dose_of_passes(irradiance=irradiance, spot_diameter=spot, speed=speed, spacing=spacing),
        wanted=dose,
        fastest=None if dose is None else fastest_curing(dose=dose, irradiance=irradiance, spot_diameter=spot),
        flood=None if flood is None else flood.duration,
    )


def dose_of_pass(*, irradiance: float, spot_diameter: float, speed: float) -> float:
    """Return the dose on the path's own line when the spot passes once [mJ/cm2].

    Args:
        irradiance: [mW/cm2].
        spot_diameter: [mm].
        speed: of the spot [mm/s].
    """
    return irradiance * spot_diameter / speed


def dose_of_passes(*, irradiance: float, spot_diameter: float, speed: float, spacing: float) -> float:
    """Return the mean dose when the spot passes along all of many lines a spacing [mm] apart [mJ/cm2].

    Every place is in the spot on as many passes as reach it: the power of the spot spread over speed times spacing.
    """
    return irradiance * np.pi * spot_diameter**2 / 4.0 / (speed * spacing)


def fastest_curing(*, dose: float, irradiance: float, spot_diameter: float) -> float:
    """Return the speed up to which one pass gives a dose [mJ/cm2] on the path's own line [mm/s]."""
    return irradiance * spot_diameter / dose
