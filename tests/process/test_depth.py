"""Light within the material: Beer and Lambert by hand, the depth that is cured, and layers lit through others."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.process import bottom_doses, cured_depth


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
