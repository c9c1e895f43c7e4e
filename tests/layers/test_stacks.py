"""Thickness in whole layers, and the surfaces of a stack."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.layers import stack, whole_layers
from geoprint.surfaces import closest, face_areas
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


def test_each_layer_lies_on_the_one_below() -> None:
    part = meshes.spherical_cap(radius=12.0, angle=0.7, rings=20)
    found = stack(part, thickness=1.9, layer_height=0.5, edge_length=0.6)
    assert [layer.number for layer in found.layers] == [0, 1, 2, 3]
    assert [layer.height for layer in found.layers] == pytest.approx([0.475] * 4)
    assert (found.layers[0].bottom, found.layers[-1].top) == (0.0, pytest.approx(1.9))
    for layer in found.layers:
        _, distances = closest(part, layer.surface.vertices)
        np.testing.assert_allclose(distances, (layer.bottom + layer.top) / 2.0, atol=1e-6)
    volume = sum(float(face_areas(layer.surface).sum()) * layer.height for layer in found.layers)
    # A shell of a sphere: the mean of the squared radius over its thickness.
    share = (13.9**3 - 12.0**3) / (3.0 * 12.0**2)
    assert volume == pytest.approx(share * float(face_areas(part).sum()), rel=0.005)
