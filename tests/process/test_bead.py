"""Beads and light: balance of mass, the circle's segment, and doses by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import InputError
from geoprint.process.bead import bead_width, flow_for, segment_area, segment_width, strand_diameter
from geoprint.process.curing import dose_of_pass, dose_of_passes, fastest_curing


def test_a_half_circle_is_twice_as_wide_as_high() -> None:
    assert segment_area(2.0, height=1.0) == pytest.approx(np.pi / 2)
    assert segment_width(np.pi / 2, height=1.0) == pytest.approx(2.0)


def test_a_flat_bead_is_a_parabola() -> None:
    assert segment_area(100.0, height=1.0) == pytest.approx(2 / 3 * 100.0, rel=1e-3)


def test_a_strand_as_thick_as_the_stand_off_only_touches() -> None:
    assert segment_width(np.pi / 4, height=1.0) == pytest.approx(0.0, abs=1e-6)
    assert strand_diameter(np.pi / 4) == pytest.approx(1.0)


@settings(max_examples=100, deadline=None)
@given(
    share=st.floats(0.01, 500.0), height=st.floats(0.05, 2.0), speed=st.floats(1.0, 100.0),
)  # fmt: skip
def test_width_and_flow_undo_each_other_and_mass_is_kept(share: float, height: float, speed: float) -> None:
    flow = flow_for(width=share * height, speed=speed, standoff=height)
    width = bead_width(flow=flow, speed=speed, standoff=height)
    assert segment_area(width, height=height) * speed == pytest.approx(flow, rel=1e-6)
    assert width == pytest.approx(share * height, rel=1e-6)


def test_a_strand_thinner_than_the_stand_off_is_refused() -> None:
    with pytest.raises(InputError, match=r"thinner than the stand-off of 1 mm"):
        bead_width(flow=1.0, speed=10.0, standoff=1.0)


def test_a_bead_without_flow_is_refused() -> None:
    with pytest.raises(InputError, match="above 0"):
        bead_width(flow=0.0, speed=10.0, standoff=1.0)


@pytest.mark.parametrize("area", [0.1, 1e5])
def test_an_area_that_no_segment_has_is_refused(area: float) -> None:
    with pytest.raises(InputError, match="a bead of 1 mm height cannot"):
        segment_width(area, height=1.0)


def test_a_pass_gives_irradiance_times_the_time_in_the_spot() -> None:
    assert dose_of_pass(irradiance=500.0, spot_diameter=6.0, speed=20.0) == pytest.approx(150.0)
    assert fastest_curing(dose=150.0, irradiance=500.0, spot_diameter=6.0) == pytest.approx(20.0)


def test_many_passes_give_the_power_over_the_area_swept_in_a_second() -> None:
    # Summed over lines: the chord of the spot at each, averaged over where the place lies between them.
    offsets = np.arange(-40, 41) * 1.5 + np.linspace(-0.75, 0.75, 2001)[:, None]
    chords = 2.0 * np.sqrt(np.maximum(9.0 - offsets**2, 0.0))
    summed = float((500.0 * chords / 20.0).sum(axis=1).mean())
    assert dose_of_passes(irradiance=500.0, spot_diameter=6.0, speed=20.0, spacing=1.5) == pytest.approx(
        summed, rel=1e-3
    )
