"""What layers fill: how deep within a shape or a thickness places lie, how high it is, and what is no target."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.errors import FieldError, MeshError
from geoprint.geometry import closest, part_of, signed_volume, turned_over
from geoprint.layers import TargetShape, TargetThickness
from geoprint.model import FloatArray, Surface
from tests import meshes

PART = meshes.plate((20.0, 12.0), (10, 6))


def _box(low: tuple[float, float, float] = (-2.0, -2.0, -1.0), high: tuple[float, float, float] = (22.0, 14.0, 3.0)):
    x, y, z = ([first, last] for first, last in zip(low, high, strict=True))
    return meshes.blocks([[[1]]], x=x, y=y, z=z)


def _window() -> Surface:
    """Return a box with a window of 6 by 4 mm through it."""
    filled = [[[1], [1], [1]], [[1], [0], [1]], [[1], [1], [1]]]
    return meshes.blocks(filled, x=[-2.0, 7.0, 13.0, 22.0], y=[-2.0, 4.0, 8.0, 14.0], z=[-1.0, 3.0])


def _places(count: int = 2000) -> FloatArray:
    return np.random.default_rng(7).uniform([-5.0, -5.0, -3.0], [25.0, 17.0, 6.0], (count, 3))


def test_depth_within_a_box_is_that_to_its_nearest_side() -> None:
    places = _places()
    low, high = np.array([-2.0, -2.0, -1.0]), np.array([22.0, 14.0, 3.0])
    within: FloatArray = np.minimum(places - low, high - places).min(axis=1)
    out: FloatArray = np.linalg.norm(np.maximum(np.maximum(low - places, places - high), 0.0), axis=1)
    wanted = np.where(out > 0.0, -out, within)
    found = TargetShape(_box(), PART).depth(places)
    np.testing.assert_allclose(found, wanted, atol=1e-9)
    # At an edge and at a corner of the box the nearest place has no one normal.
    corners = np.array([[23.0, 15.0, 4.0], [23.0, 5.0, 4.0], [-2.0, -2.0, 3.0]])
    np.testing.assert_allclose(TargetShape(_box(), PART).depth(corners), [-np.sqrt(3.0), -np.sqrt(2.0), 0.0], atol=1e-9)


@pytest.mark.parametrize("inside_out", [False, True])
def test_sides_are_told_where_a_shape_is_hollow(*, inside_out: bool) -> None:
    shape, places = _window(), _places()
    x, y, z = places.T
    within = (x > -2) & (x < 22) & (y > -2) & (y < 14) & (z > -1) & (z < 3) & ~((x > 7) & (x < 13) & (y > 4) & (y < 8))
    target = TargetShape(turned_over(shape) if inside_out else shape, PART)
    found = target.depth(places)
    np.testing.assert_array_equal(found > 0.0, within)
    np.testing.assert_allclose(np.abs(found), closest(shape, places)[1])
    assert target.volume == pytest.approx((20.0 * 12.0 - 24.0) * 3.0, rel=0.003)


def test_a_shape_is_as_high_as_it_ends_over_the_part() -> None:
    assert TargetShape(_box(), PART).thickness == pytest.approx(3.0)
    # It rises to 6 mm, but the part ends before.
    rising = meshes.wedge(length=30.0, width=12.0, height=6.0)
    assert TargetShape(rising, PART).thickness == pytest.approx(4.0, abs=1e-3)
    ball = meshes.sphere(radius=6.0, subdivisions=3)
    shell = TargetShape(meshes.sphere(radius=8.0, subdivisions=3), ball)
    assert shell.thickness == pytest.approx(2.0, abs=0.02)


def test_an_open_shape_is_refused() -> None:
    box = _box()
    with pytest.raises(MeshError, match=r"is open: it has 1 border\. Close it"):
        TargetShape(part_of(box, np.arange(12) > 0), PART)
    with pytest.raises(MeshError, match="it has 2 borders"):
        TargetShape(part_of(box, ~np.isin(np.arange(12), [0, 2])), PART)


@pytest.mark.parametrize(
    ("low", "high"),
    [
        ((30.0, 0.0, -1.0), (40.0, 10.0, 3.0)),
        ((0.0, 0.0, -5.0), (20.0, 12.0, -1.0)),
        ((0.0, 0.0, -4.0), (9.0, 9.0, 0.0)),
    ],
)
def test_a_shape_beside_or_under_the_part_is_refused(
    low: tuple[float, float, float], high: tuple[float, float, float]
) -> None:
    with pytest.raises(FieldError, match=r"no part of the target blocks lies over the outer side .* Check coordinates"):
        TargetShape(_box(low, high), PART)


def test_a_thickness_is_linear_in_the_triangles_of_the_part() -> None:
    target = TargetThickness(PART, 0.1 * PART.vertices[:, 0])
    places = np.array([[10.0, 6.0, 0.4], [10.0, 6.0, 1.0], [3.3, 2.2, 1.0], [20.0, 12.0, 0.0]])
    np.testing.assert_allclose(target.depth(places), [0.6, 0.0, -0.67, 2.0], atol=1e-12)
    assert (target.thickness, target.volume) == (pytest.approx(2.0), None)


def test_a_thickness_of_nothing_is_refused() -> None:
    with pytest.raises(FieldError, match="the thickness over plate is 0 everywhere"):
        TargetThickness(PART, np.zeros(len(PART.vertices)))


def test_the_volume_of_a_shape_is_that_of_what_is_over_the_part() -> None:
    part = meshes.plate((20.0, 20.0), (10, 10))
    # A ball whose upper half is over the part, and one beside whose half is beyond the rim.
    ball = meshes.sphere(radius=5.0, subdivisions=3)
    half = 0.5 * abs(signed_volume(ball))
    for place in ((10.0, 10.0, 0.0), (20.0, 10.0, 6.0)):
        moved = Surface(ball.vertices + np.array(place), ball.faces, "ball")
        assert TargetShape(moved, part).volume == pytest.approx(half, rel=0.005)
