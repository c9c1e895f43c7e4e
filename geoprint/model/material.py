"""The material: how it flows and how it cures."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model.values import comparable


@final
@comparable
class Fluid:
    """A Herschel-Bulkley fluid: shear stress = yield stress + consistency * shear rate ** index.

    Without yield stress it is a power law, with an index of 1 besides a Newtonian fluid.

    Attributes:
        consistency: [Pa s^index], above 0; the viscosity of a Newtonian fluid [Pa s].
        index: above 0; below 1 the fluid thins where it is sheared.
        yield_stress: below which nothing flows [Pa], 0 or more.
    """

    consistency: float
    index: float = 1.0
    yield_stress: float = 0.0

    def __post_init__(self) -> None:
        values = (self.consistency, self.index, self.yield_stress)
        if not np.isfinite(values).all() or self.consistency <= 0.0 or self.index <= 0.0 or self.yield_stress < 0.0:
            raise InputError(
                f"a fluid needs a consistency and an index above 0 and a yield stress of 0 or more, found {values}."
            )


@final
@comparable
class Material:
    """What the syringe holds.

    Attributes:
        density: [mg/mm3], the same number as in g/cm3.
        fluid: how it flows.
        irradiance: of the lamp's spot [mW/cm2], or None where nobody has measured it.
        spot_diameter: of that spot on the surface [mm], or None with the irradiance.
        dose: that cures the material [mJ/cm2], or None where nobody knows it.
        penetration: depth in it at which 1/e of the lamp's light is left [mm], or None where nobody has measured it.
    """

    density: float
    fluid: Fluid
    irradiance: float | None = None
    spot_diameter: float | None = None
    dose: float | None = None
    penetration: float | None = None
