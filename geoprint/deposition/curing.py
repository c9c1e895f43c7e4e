"""Light: the dose that a passing lamp and a final flood exposure give, and the speed that a wanted dose allows.

The lamp's spot is taken as a disc of even irradiance that moves along the path. mW/cm2 times s are mJ/cm2.
"""

from __future__ import annotations

import numpy as np


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
