"""Curing by light: the dose of a passing lamp and a flood exposure, how deep it cures, and the speed it allows."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.model import FloatArray, Flood, Material, recorded

# Light within the material: how deep a dose cures, and the doses within a stack.
#
# Light falls to 1/e within the penetration depth of the material (Beer and Lambert), and what got its critical dose
# is solid [Jacobs1992, ch. 4]. Both are taken to be the same before the cure and after it.


def cured_depth(dose: float, *, needed: float, penetration: float) -> float:
    """Return how deep a dose cures the material [mm]: penetration * ln(dose / needed) [Jacobs1992, ch. 4].

    Args:
        dose: at the surface [mJ/cm2].
        needed: that cures the material [mJ/cm2].
        penetration: depth at which 1/e of it is left [mm].

    Returns:
        0 where the dose cures not even the surface.

    Examples:
        >>> round(cured_depth(271.828, needed=100.0, penetration=0.4), 3)
        0.4
    """
    return penetration * max(float(np.log(dose / needed)), 0.0)


def bottom_doses(doses: FloatArray, heights: FloatArray, *, penetration: float) -> tuple[FloatArray, FloatArray]:
    """Return the doses at the bottoms of layers that are deposited and lit one upon the other [mJ/cm2].

    Light of the passes for a layer enters at its top and reaches all layers below, weaker with the depth.

    Args:
        doses: (n,) at the top of each layer from its own passes, the lowest first [mJ/cm2].
        heights: (n,) of the layers [mm].
        penetration: depth at which 1/e of it is left [mm].

    Returns:
        (n,) at the bottom of each layer after its own passes, and after those for all layers.

    Examples:
        >>> own, whole = bottom_doses(np.array([100.0, 100.0]), np.array([1.0, 1.0]), penetration=1.0)
        >>> own.round(1), whole.round(1)
        (array([36.8, 36.8]), array([50.3, 36.8]))
    """
    tops = np.cumsum(heights)
    bottoms = tops - heights
    # A row a bottom, a column the passes for a layer; those before the layer itself was deposited do not count.
    depths = np.maximum(tops[None, :] - bottoms[:, None], 0.0)
    reaching = np.triu(doses[None, :] * np.exp(-depths / penetration))
    return np.diagonal(reaching).copy(), reaching.sum(axis=1)


# Light: the dose that a passing lamp and a final flood exposure give, and the speed that a wanted dose allows.
#
# The lamp's spot is taken as a disc of even irradiance that moves along the path. mW/cm2 times s are mJ/cm2.


@final
@recorded("LightRecord")
class Exposure:
    """What the lamp gives as it passes over the part, and what the material needs.

    Attributes:
        one_pass: dose on the path's own line when the spot passes once [mJ/cm2].
        all_passes: mean dose of all passes together [mJ/cm2].
        wanted: dose that cures the material [mJ/cm2], or None where nobody knows it.
        fastest: largest speed at which one pass gives the dose that cures the material [mm/s], or None.
        flood: time of the final exposure of the whole part [s], or None where there is none.
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
            "add a final exposure ([flood])"
            if self.flood is None
            else f"the final exposure of {self.flood:g} s must add the rest"
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
