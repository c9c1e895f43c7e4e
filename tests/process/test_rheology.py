"""Flow through needle and taper: closed forms, the integral behind them, and both directions undoing each other."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import quad

from geoprint.errors import InputError
from geoprint.model import Fluid
from geoprint.process import bottom_doses, cured_depth
from geoprint.process.rheology import (
    Bore,
    bore_of,
    flow_through,
    pressure_for,
    shear_at,
    starting_pressure,
    wall_stress,
)
from tests.robot.cells import bent_cell

NEEDLE = Bore(radius=0.42, length=25.4, wide_radius=9.77, half_angle=np.radians(10.0))

fluids = st.builds(
    Fluid,
    consistency=st.floats(0.1, 1000.0),
    index=st.floats(0.2, 1.5),
    yield_stress=st.one_of(st.just(0.0), st.floats(0.01, 500.0)),
)


def one(value: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([value])


def test_a_newtonian_fluid_follows_hagen_and_poiseuille() -> None:
    viscosity, flow = 20.0, 4.0
    needle, _ = pressure_for(Fluid(viscosity), NEEDLE, flows=one(flow))
    assert needle[0] == pytest.approx(8 * viscosity * NEEDLE.length * flow / (np.pi * NEEDLE.radius**4), rel=1e-12)


def test_a_newtonian_fluid_in_the_taper_needs_the_closed_form() -> None:
    viscosity, flow, slope = 20.0, 4.0, np.tan(NEEDLE.half_angle)
    _, taper = pressure_for(Fluid(viscosity), NEEDLE, flows=one(flow))
    exact = 8 * viscosity * flow / (3 * np.pi * slope) * (NEEDLE.radius**-3 - NEEDLE.wide_radius**-3)
    assert taper[0] == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("n", [0.3, 0.6, 1.0, 1.4])
def test_a_power_law_fluid_needs_the_closed_forms_in_needle_and_taper(n: float) -> None:
    K, flow = 50.0, 3.0
    needle, taper = pressure_for(Fluid(K, n), NEEDLE, flows=one(flow))
    wall = K * ((3 * n + 1) / n * flow / (np.pi * NEEDLE.radius**3)) ** n
    assert needle[0] == pytest.approx(2 * wall * NEEDLE.length / NEEDLE.radius, rel=1e-12)
    narrowing = 1.0 - (NEEDLE.radius / NEEDLE.wide_radius) ** (3 * n)
    assert taper[0] == pytest.approx(2 * wall * narrowing / (3 * n * np.tan(NEEDLE.half_angle)), rel=1e-9)


def test_a_bingham_fluid_follows_buckingham_and_reiner() -> None:
    viscosity, yield_stress, wall = 5.0, 40.0, 100.0
    share = yield_stress / wall
    exact = wall / (4 * viscosity) * (1 - 4 / 3 * share + share**4 / 3)
    assert shear_at(Fluid(viscosity, 1.0, yield_stress), one(wall))[0] == pytest.approx(exact, rel=1e-12)


@settings(max_examples=60, deadline=None)
@given(fluid=fluids, above=st.floats(1e-3, 1e3))
def test_the_closed_form_is_the_integral_of_the_shear_rate_over_the_stress(fluid: Fluid, above: float) -> None:
    wall = fluid.yield_stress + above

    def sheared(stress: float) -> float:
        return stress**2 * ((stress - fluid.yield_stress) / fluid.consistency) ** (1.0 / fluid.index)

    integral, _ = quad(sheared, fluid.yield_stress, wall, epsabs=0.0, epsrel=1e-10)
    assert shear_at(fluid, one(wall))[0] == pytest.approx(integral / wall**3, rel=1e-7)


@settings(max_examples=60, deadline=None)
@given(fluid=fluids, logarithms=st.lists(st.floats(-12.0, 12.0), min_size=1, max_size=5))
def test_the_wall_stress_undoes_the_shear(fluid: Fluid, logarithms: list[float]) -> None:
    stresses = fluid.yield_stress + np.exp(logarithms) * max(fluid.yield_stress, 1.0)
    np.testing.assert_allclose(wall_stress(fluid, shear_at(fluid, stresses)), stresses, rtol=1e-9)


@settings(max_examples=60, deadline=None)
@given(fluid=fluids, factors=st.lists(st.floats(1.001, 1e3), min_size=1, max_size=5))
def test_the_pressure_for_a_flow_is_the_pressure_that_made_it(fluid: Fluid, factors: list[float]) -> None:
    pressures = np.array(factors) * max(starting_pressure(fluid, NEEDLE), 100.0)
    flows = flow_through(fluid, NEEDLE, pressures=pressures)
    assert (flows > 0.0).all()
    needle, taper = pressure_for(fluid, NEEDLE, flows=flows)
    np.testing.assert_allclose(needle + taper, pressures, rtol=1e-8)


def test_nothing_flows_up_to_the_yield_stress_and_more_with_more_pressure_above() -> None:
    fluid = Fluid(30.0, 0.5, 50.0)
    start = starting_pressure(fluid, NEEDLE)
    exact = 2 * 50.0 * (NEEDLE.length / NEEDLE.radius + np.log(NEEDLE.wide_radius / NEEDLE.radius) / np.tan(0.1745329))
    assert start == pytest.approx(exact, rel=1e-6)
    flows = flow_through(fluid, NEEDLE, pressures=start * np.array([0.0, 0.5, 1.0, 1.01, 1.5, 3.0]))
    assert flows[:3].tolist() == [0.0, 0.0, 0.0]
    assert (np.diff(flows[2:]) > 0.0).all()
    assert shear_at(fluid, np.array([0.0, 49.9, 50.0])).tolist() == [0.0, 0.0, 0.0]


@settings(max_examples=40, deadline=None)
@given(fluid=fluids.filter(lambda fluid: fluid.index <= 1.0), factor=st.floats(1.1, 5.0))
def test_a_fluid_that_does_not_thicken_flows_at_least_as_much_faster_as_the_pressure_rises(
    fluid: Fluid, factor: float
) -> None:
    pressure = 2.0 * max(starting_pressure(fluid, NEEDLE), 100.0)
    low, high = flow_through(fluid, NEEDLE, pressures=pressure * np.array([1.0, factor]))
    assert high >= factor * low * (1.0 - 1e-9)


def test_the_bore_of_a_tool_has_the_wall_of_its_needle() -> None:
    found = bore_of(bent_cell().tool)
    assert (found.radius, found.length) == (0.42, 25.4)
    assert found.wide_radius == pytest.approx(10.0 - 0.23)
    assert found.half_angle == pytest.approx(np.radians(10.0))


@pytest.mark.parametrize("values", [(0.0, 1.0, 2.0, 0.1), (1.0, 0.0, 2.0, 0.1), (1.0, 1.0, 1.0, 0.1), (1, 1, 2, 1.6)])
def test_a_bore_that_does_not_narrow_is_refused(values: tuple[float, float, float, float]) -> None:
    with pytest.raises(InputError, match="bore needs"):
        Bore(*values)


@pytest.mark.parametrize("values", [(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, -1.0), (np.nan, 1.0, 0.0)])
def test_a_fluid_without_meaning_is_refused(values: tuple[float, float, float]) -> None:
    with pytest.raises(InputError, match="a fluid needs"):
        Fluid(*values)


# Light within the material: Beer and Lambert by hand, the depth that is cured, and layers lit through others.


def test_a_dose_e_times_as_large_as_needed_cures_one_penetration_deep() -> None:
    assert cured_depth(np.e * 100.0, needed=100.0, penetration=0.7) == pytest.approx(0.7)
    assert cured_depth(np.e**2 * 100.0, needed=100.0, penetration=0.7) == pytest.approx(1.4)


@pytest.mark.parametrize("dose", [100.0, 99.0, 1.0])
def test_a_dose_that_is_not_larger_than_needed_cures_nothing(dose: float) -> None:
    assert cured_depth(dose, needed=100.0, penetration=0.7) == 0.0


def test_light_of_the_layers_above_arrives_through_them() -> None:
    own, whole = bottom_doses(np.array([80.0, 50.0, 60.0]), np.array([0.5, 0.4, 0.3]), penetration=0.6)
    np.testing.assert_allclose(own, [80 * np.exp(-0.5 / 0.6), 50 * np.exp(-0.4 / 0.6), 60 * np.exp(-0.3 / 0.6)])
    # The passes for the third layer go through 1.2 mm to the bottom of the first, through 0.7 mm to that of the second.
    assert whole[0] == pytest.approx(own[0] + 50 * np.exp(-0.9 / 0.6) + 60 * np.exp(-1.2 / 0.6))
    assert whole[1] == pytest.approx(own[1] + 60 * np.exp(-0.7 / 0.6))
    # Nothing is above the highest.
    assert whole[2] == pytest.approx(own[2])


def test_in_a_high_stack_the_doses_are_a_geometric_series() -> None:
    _, whole = bottom_doses(np.full(200, 10.0), np.full(200, 0.5), penetration=0.5)
    share = np.exp(-1.0)
    assert whole[0] == pytest.approx(10.0 * share / (1.0 - share))


@settings(max_examples=50, deadline=None)
@given(dose=st.floats(1.0, 1e4), needed=st.floats(1.0, 1e3), penetration=st.floats(0.05, 5.0))
def test_a_layer_as_high_as_its_dose_cures_gets_just_what_it_needs_at_its_bottom(
    dose: float, needed: float, penetration: float
) -> None:
    height = cured_depth(dose, needed=needed, penetration=penetration)
    (own,), (whole,) = bottom_doses(np.array([dose]), np.array([height]), penetration=penetration)
    assert own == whole == pytest.approx(min(dose, needed), rel=1e-9)
