"""Flow of a Herschel-Bulkley fluid through needle and taper under air pressure, and the pressure for a wanted flow.

In steady laminar flow without slip the flow through a round bore depends on the stress at its wall alone, whatever the
fluid: Q / (pi R^3) = 1 / tau_w^3 * integral of tau^2 * shear rate(tau) from 0 to tau_w [Rabinowitsch1929]. For a
Herschel-Bulkley fluid the integral has a closed form [Chhabra2008, ch. 3]. A taper is a stack of short bores, each
with the wall stress that the same flow needs at its radius.

Losses where the bore narrows suddenly, friction of the piston and weight of the column are left out. Lengths are mm,
stresses and pressures Pa, flows mm3/s.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, final

import numpy as np

from geoprint.errors import InputError, VerificationError
from geoprint.model import FloatArray, Fluid, Tool, comparable

# Nodes of the quadrature along a taper; its error is below 1e-9 from needle to barrel.
TAPER_NODES = 16
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(TAPER_NODES)
# Shares by which a shear and, above it, a pressure may miss.
SHEAR_TOLERANCE = 1e-13
PRESSURE_TOLERANCE = 1e-11
# Share of a place below which a bracket is rounding.
SMALLEST_SPAN = 4 * np.finfo(np.float64).eps
# Steps of the root search; ten are usual.
MOST_STEPS = 200


@final
@comparable
class Bore:
    """The inside of a nozzle: a taper that narrows to a needle.

    Attributes:
        radius: of the needle [mm].
        length: of the needle [mm].
        wide_radius: where the taper starts [mm].
        half_angle: of the taper [rad].
    """

    radius: float
    length: float
    wide_radius: float
    half_angle: float

    def __post_init__(self) -> None:
        if not (0.0 < self.radius < self.wide_radius and self.length > 0.0 and 0.0 < self.half_angle < np.pi / 2):
            raise InputError(
                f"a bore needs a radius and a length above 0, found {self.radius:g} and {self.length:g} mm. Its taper "
                f"must widen, found {self.wide_radius:g} mm at {self.half_angle:g} rad."
            )


class PressureBudget(NamedTuple):
    """Pressure that a flow needs [Pa].

    Attributes:
        needle: (k,) share of the needle.
        taper: (k,) share of the taper.
    """

    needle: FloatArray
    taper: FloatArray

    @property
    def total(self) -> FloatArray:
        """(k,) both together."""
        return self.needle + self.taper


def bore_of(tool: Tool) -> Bore:
    """Return the bore of a tool's nozzle; the taper's wall is taken to be as thick as the needle's."""
    wall = 0.5 * (tool.needle_diameter - tool.inner_diameter)
    return Bore(
        radius=0.5 * tool.inner_diameter,
        length=tool.needle_length,
        wide_radius=0.5 * tool.barrel_diameter - wall,
        half_angle=tool.cone_half_angle,
    )


def starting_pressure(fluid: Fluid, bore: Bore) -> float:
    """Return the pressure up to which the yield stress holds everything back [Pa]."""
    taper = np.log(bore.wide_radius / bore.radius) / np.tan(bore.half_angle)
    return float(2.0 * fluid.yield_stress * (bore.length / bore.radius + taper))


def flow_through(fluid: Fluid, bore: Bore, *, pressures: FloatArray) -> FloatArray:
    """Return the flow that drives through needle and taper.

    Args:
        fluid: what flows.
        bore: through what.
        pressures: (k,) above that at the tip [Pa].

    Returns:
        (k,) flow [mm3/s], 0 up to the starting pressure.
    """
    result = np.zeros(pressures.size)
    flowing = pressures > starting_pressure(fluid, bore)
    wanted = pressures[flowing]
    if wanted.size == 0:
        return result
    # The needle alone would take the whole pressure at the higher stress, none of it flows at the lower.
    highest = wanted * bore.radius / (2.0 * bore.length)
    lowest = np.full(wanted.size, fluid.yield_stress, dtype=np.float64)

    def excess(stress: FloatArray) -> FloatArray:
        return _budget(fluid, bore, stress).total / wanted - 1.0

    stress = _rising_root(excess, lowest, highest, tolerance=PRESSURE_TOLERANCE)
    result[flowing] = np.pi * bore.radius**3 * shear_at(fluid, stress)
    return result


def pressure_for(fluid: Fluid, bore: Bore, *, flows: FloatArray) -> PressureBudget:
    """Return the pressure that (k,) flows [mm3/s] need in needle and taper."""
    return _budget(fluid, bore, wall_stress(fluid, flows / (np.pi * bore.radius**3)))


def shear_at(fluid: Fluid, stress: FloatArray) -> FloatArray:
    """Return the flow through a round bore over pi times its radius cubed [1/s], from the stress at its wall [Pa]."""
    n, excess = fluid.index, np.maximum(stress - fluid.yield_stress, 0.0)
    plug = np.divide(fluid.yield_stress, stress, out=np.zeros_like(stress), where=stress > 0.0)
    sheared = 1.0 - plug
    profile = sheared**2 / (3 * n + 1) + 2 * plug * sheared / (2 * n + 1) + plug**2 / (n + 1)
    return np.maximum(n * (excess / fluid.consistency) ** (1 / n) * sheared * profile, 0.0)


def wall_stress(fluid: Fluid, shear: FloatArray) -> FloatArray:
    """Return the stress at the wall [Pa] from the flow over pi times the radius cubed [1/s]: `shear_at` inverted.

    The stress above yield, e, lies between closed bounds: shear is at most (e / K)^(1/n) / 3 everywhere, and at least
    (e / 2 K)^(1/n) / 12 once e exceeds the yield stress.
    """
    n, K = fluid.index, fluid.consistency
    if fluid.yield_stress == 0.0:
        return K * ((3 + 1 / n) * shear) ** n
    result = np.full(shear.shape, fluid.yield_stress, dtype=np.float64)
    flowing = shear > 0.0
    wanted = shear[flowing]
    lowest = np.log(K * (3 * wanted) ** n)
    highest = np.log(np.maximum(fluid.yield_stress, 2 * K * (12 * wanted) ** n))

    def excess(logarithm: FloatArray) -> FloatArray:
        return _log_shear(fluid, logarithm) - np.log(wanted)

    result[flowing] += np.exp(_rising_root(excess, lowest, highest, tolerance=SHEAR_TOLERANCE))
    return result


def _log_shear(fluid: Fluid, logarithm: FloatArray) -> FloatArray:
    """Return log `shear_at` from the logarithm of the stress above yield, exact however small that is."""
    n, e = fluid.index, np.exp(logarithm)
    stress = fluid.yield_stress + e
    sheared, plug = e / stress, fluid.yield_stress / stress
    profile = sheared**2 / (3 * n + 1) + 2 * plug * sheared / (2 * n + 1) + plug**2 / (n + 1)
    return np.log(n * sheared * profile) + (logarithm - np.log(fluid.consistency)) / n


def _budget(fluid: Fluid, bore: Bore, stress: FloatArray) -> PressureBudget:
    """Return the pressures in needle and taper from the stress at the needle's wall."""
    # Evenly in the logarithm of the radius, in which the stress falls as an exponential.
    widening = np.log(bore.wide_radius / bore.radius)
    logs = 0.5 * widening * (1.0 + _NODES)
    shear = shear_at(fluid, stress)[:, None] * np.exp(-3.0 * logs)
    along = wall_stress(fluid, shear) @ _WEIGHTS * widening / np.tan(bore.half_angle)
    return PressureBudget(needle=2.0 * stress * bore.length / bore.radius, taper=along)


def _rising_root(
    function: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray, *, tolerance: float
) -> FloatArray:
    """Return where (k,) rising functions vanish, by false position between brackets that never open [Dowell1971].

    Args:
        function: from (k,) places to (k,) values.
        low: (k,) places where it is not positive.
        high: (k,) places where it is not negative.
        tolerance: value that counts as 0.

    Raises:
        VerificationError: a root was not found, which would be a defect.
    """
    low_values, high_values = function(low), function(high)
    was_below, was_above = np.zeros(low.size, dtype=np.bool_), np.zeros(low.size, dtype=np.bool_)
    for _ in range(MOST_STEPS):
        span = high_values - low_values
        share = np.divide(-low_values, span, out=np.full_like(span, 0.5), where=span > 0.0)
        place = low + np.clip(share, 0.0, 1.0) * (high - low)
        values = function(place)
        if ((np.abs(values) <= tolerance) | (high - low <= SMALLEST_SPAN * np.abs(high))).all():
            return place
        below = values < 0.0
        # An end that stays twice counts half from then on, so that it is left soon.
        high_values = np.where(below, np.where(was_below, 0.5 * high_values, high_values), values)
        low_values = np.where(below, values, np.where(was_above, 0.5 * low_values, low_values))
        low, high = np.where(below, place, low), np.where(below, high, place)
        was_below, was_above = below, ~below
    raise VerificationError("the wall stress of a flow was not found between its bounds: this is a defect of geoprint.")
