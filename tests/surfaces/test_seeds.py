"""Seeds: rims and points."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.errors import FieldError, InputError
from geoprint.model import FloatArray
from geoprint.surfaces import boundary_loops, boundary_seed, point_seed, positions
from tests import meshes


def test_the_boundary_seed_of_an_annulus_is_both_rims_closed_the_longer_first() -> None:
    annulus = meshes.annulus(inner=8.0, outer=20.0)
    curves = boundary_seed(annulus).curves
    assert curves.count == 2
    assert curves.closed.all()
    places = positions(annulus, curves.points)
    for loop, first, last, radius in zip(
        boundary_loops(annulus), curves.offsets[:-1], curves.offsets[1:], (20.0, 8.0), strict=True
    ):
        curve = places[first:last]
        np.testing.assert_allclose(curve, annulus.vertices[np.append(loop, loop[0])])
        np.testing.assert_allclose(np.linalg.norm(curve, axis=1), radius)


def test_a_closed_surface_asks_for_a_point() -> None:
    with pytest.raises(FieldError, match="--seed X Y Z"):
        boundary_seed(meshes.sphere())


def test_a_point_seed_is_one_open_curve_at_the_closest_point() -> None:
    curves = point_seed(meshes.plate(), np.array([11.0, 7.0, 0.3]), tolerance=0.5).curves
    assert curves.count == 1
    assert not curves.closed.any()
    np.testing.assert_allclose(positions(meshes.plate(), curves.points), [[11.0, 7.0, 0.0]], atol=1e-12)


def test_a_point_off_the_surface_is_refused_with_its_distance() -> None:
    with pytest.raises(FieldError, match=r"lies 3 mm off plate, at most 0\.5 mm") as caught:
        point_seed(meshes.plate(), np.array([11.0, 7.0, 3.0]), tolerance=0.5)
    assert caught.value.details == {"distance": pytest.approx(3.0), "tolerance": 0.5}


@pytest.mark.parametrize("xyz", [np.zeros(2), np.array([0.0, np.nan, 0.0]), np.zeros((1, 3))])
def test_a_point_without_three_finite_coordinates_is_refused(
    xyz: FloatArray,
) -> None:
    with pytest.raises(InputError, match="three finite coordinates"):
        point_seed(meshes.plate(), xyz, tolerance=1.0)
