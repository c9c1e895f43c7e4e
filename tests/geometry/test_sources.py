"""Seeds: rims and points."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.errors import FieldError, InputError
from geoprint.geometry import (
    boundary_loops,
    boundary_source,
    loop_source,
    nearest_loop,
    part_source,
    point_source,
    positions,
)
from geoprint.model import FloatArray
from tests import meshes


def test_the_boundary_seed_of_an_annulus_is_both_rims_closed_the_longer_first() -> None:
    annulus = meshes.annulus(inner=8.0, outer=20.0)
    curves = boundary_source(annulus).curves
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
    with pytest.raises(FieldError, match="--from point:X,Y,Z"):
        boundary_source(meshes.sphere())


def test_a_point_seed_is_one_open_curve_at_the_closest_point() -> None:
    curves = point_source(meshes.plate(), np.array([11.0, 7.0, 0.3]), tolerance=0.5).curves
    assert curves.count == 1
    assert not curves.closed.any()
    np.testing.assert_allclose(positions(meshes.plate(), curves.points), [[11.0, 7.0, 0.0]], atol=1e-12)


def test_a_point_off_the_surface_is_refused_with_its_distance() -> None:
    with pytest.raises(FieldError, match=r"lies 3 mm off plate, at most 0\.5 mm") as caught:
        point_source(meshes.plate(), np.array([11.0, 7.0, 3.0]), tolerance=0.5)
    assert caught.value.details == {"distance": pytest.approx(3.0), "tolerance": 0.5}


@pytest.mark.parametrize("xyz", [np.zeros(2), np.array([0.0, np.nan, 0.0]), np.zeros((1, 3))])
def test_a_point_without_three_finite_coordinates_is_refused(xyz: FloatArray) -> None:
    with pytest.raises(InputError, match="three finite coordinates"):
        point_source(meshes.plate(), xyz, tolerance=1.0)


def radii(places: FloatArray) -> FloatArray:
    return np.linalg.norm(places, axis=1)


def test_loops_are_numbered_from_the_longest() -> None:
    annulus = meshes.annulus(inner=8.0, outer=20.0)
    for numbers, wanted in (([1], {20.0}), ([2], {8.0}), ([2, 1, 2], {8.0, 20.0})):
        curves = loop_source(annulus, numbers).curves
        assert curves.count == len(wanted)
        assert curves.closed.all()
        assert set(radii(positions(annulus, curves.points)).round(9).tolist()) == wanted


def test_a_loop_that_is_not_there_is_refused_with_those_that_are() -> None:
    with pytest.raises(FieldError, match=r"no loop 3 .* which has 2: 1, 12\d mm long at .*; 2, 50(\.\d)? mm long at"):
        loop_source(meshes.annulus(inner=8.0, outer=20.0), [1, 3])
    with pytest.raises(FieldError, match="--from point:X,Y,Z"):
        loop_source(meshes.sphere(), [1])


def test_the_nearest_loop_is_that_with_the_nearest_vertex() -> None:
    annulus = meshes.annulus(inner=8.0, outer=20.0)
    assert [nearest_loop(annulus, np.array([x, 0.0, 0.0])) for x in (0.0, 13.9, 14.1, 50.0)] == [2, 2, 1, 1]


@pytest.mark.parametrize(("through", "angles"), [(None, (0.0, 90.0)), ((-20.0, 0.0, 0.0), (90.0, 360.0))])
def test_a_part_of_a_loop_is_the_shorter_one_or_that_by_a_point(
    through: tuple[float, float, float] | None, angles: tuple[float, float]
) -> None:
    rim = meshes.annulus(inner=8.0, outer=20.0)
    middle = None if through is None else np.array(through)
    for first, last in ((0.0, 90.0), (90.0, 0.0)):
        ends = [20.0 * np.array([np.cos(np.radians(at)), np.sin(np.radians(at)), 0.0]) for at in (first, last)]
        curves = part_source(rim, ends[0], ends[1], through=middle).curves
        assert (curves.count, curves.closed.any()) == (1, False)
        places = positions(rim, curves.points)
        np.testing.assert_allclose(radii(places), 20.0)
        around = np.degrees(np.arctan2(places[:, 1], places[:, 0])) % 360.0
        around[(around < 1e-9) & (through is not None)] = 360.0
        assert np.sort(around)[[0, -1]] == pytest.approx(angles, abs=1e-6)


@pytest.mark.parametrize(
    ("last", "why"),
    [((8.0, 0.0, 0.0), "different loops of the border"), ((20.0, 0.0, 0.0), "one vertex of the border")],
)
def test_a_part_of_a_loop_needs_two_ends_on_it(last: tuple[float, float, float], why: str) -> None:
    with pytest.raises(FieldError, match=why):
        part_source(meshes.annulus(inner=8.0, outer=20.0), np.array([20.0, 0.0, 0.0]), np.array(last))
