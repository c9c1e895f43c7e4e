"""Directions across a mean normal: where they are counted from, and which way."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.geometry import direction_across, turned_over
from geoprint.model import Surface
from tests.meshes import plate, spherical_cap


def test_angles_count_counter_clockwise_seen_from_outside_from_x() -> None:
    level = plate((4.0, 3.0))
    np.testing.assert_allclose(direction_across(level, angle=0.0), [1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(direction_across(level, angle=np.pi / 2.0), [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(direction_across(turned_over(level), angle=np.pi / 2.0), [0.0, -1.0, 0.0], atol=1e-12)


def test_where_the_mean_normal_is_nearly_x_the_y_axis_stands_in_for_it() -> None:
    level = plate((4.0, 3.0))
    upright = Surface(level.vertices[:, [2, 0, 1]], level.faces)
    np.testing.assert_allclose(direction_across(upright, angle=0.0), [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(direction_across(upright, angle=np.pi / 2.0), [0.0, 0.0, 1.0], atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1.0, -2.0])
def test_a_direction_is_of_unit_length_and_square_to_the_mean_normal(angle: float) -> None:
    cap = spherical_cap(radius=10.0, angle=0.9, rings=8)
    tilt = np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]])
    found = direction_across(Surface(cap.vertices @ tilt.T, cap.faces), angle=angle)
    assert np.linalg.norm(found) == pytest.approx(1.0)
    assert found @ tilt @ [0.0, 0.0, 1.0] == pytest.approx(0.0, abs=1e-9)
