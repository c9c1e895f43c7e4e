"""Thickness in whole layers, and the levels between them."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.geometry import closest, face_areas
from geoprint.layers import layer_level, whole_layers
from tests import meshes


@pytest.mark.parametrize(
    ("thickness", "height", "count"), [(3.2, 0.4, 8), (3.0, 0.4, 8), (0.1, 0.4, 1), (0.5, 0.5, 1), (1.0, 0.3, 3)]
)
def test_layers_come_out_whole(thickness: float, height: float, count: int) -> None:
    found, adapted = whole_layers(thickness, height=height)
    assert found == count
    assert found * adapted == pytest.approx(thickness)


@pytest.mark.parametrize(("thickness", "height"), [(0.0, 0.4), (3.0, -0.4), (float("nan"), 0.4), (3.0, float("inf"))])
def test_what_is_no_thickness_is_refused(thickness: float, height: float) -> None:
    with pytest.raises(InputError, match="must be a positive number of mm"):
        whole_layers(thickness, height=height)


def test_more_layers_than_anybody_prints_are_refused() -> None:
    with pytest.raises(InputError, match="are 7,500 layers, at most 500"):
        whole_layers(3000.0, height=0.4)


def test_layers_between_levels_fill_a_shell() -> None:
    part = meshes.spherical_cap(radius=6.0, angle=0.7, rings=20)
    count, height = whole_layers(1.9, height=0.5)
    volume = 0.0
    for number in range(count):
        level = layer_level(part, (number + 0.5) * height, height=height)
        _, distances = closest(part, level.vertices)
        np.testing.assert_allclose(distances, (number + 0.5) * height, atol=1e-6)
        volume += float(face_areas(level).sum()) * height
    # A shell of a sphere: the mean of the squared radius over its thickness.
    share = (7.9**3 - 6.0**3) / (3.0 * 6.0**2)
    assert volume == pytest.approx(share * float(face_areas(part).sum()), rel=0.005)
