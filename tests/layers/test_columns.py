"""Columns over a part: evenly spread, met over a crease as geometry says, and as thick as the layers that they meet."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.geometry import prepare, turned_over
from geoprint.geometry.files import load
from geoprint.layers import TargetShape, TargetThickness, layer_level
from geoprint.layers.feet import Ground
from geoprint.layers.stack_thickness import column_feet, deposited_over, have_met, wanted_over, within_sides
from geoprint.model import FloatArray, Surface
from tests import meshes
from tests.shared_data import shared

COUNT = 4000
HEIGHT = 0.4


def valley(angle: float, *, length: float = 12.0, side: float = 10.0) -> Surface:
    """Return two plates that meet in a crease along y, each by an angle from the level [rad]."""
    flat = meshes.plate((2.0 * side, length), (20, 12))
    across, along = flat.vertices[:, 0] - side, flat.vertices[:, 1]
    vertices = np.column_stack([across * np.cos(angle), along, np.abs(across) * np.sin(angle)])
    return Surface(vertices, flat.faces, "valley")


def deposited(part: Surface, number: int, thickness: float = HEIGHT) -> FloatArray:
    """Return how thick the layer of a number from 0 is on columns, if it has one thickness everywhere."""
    feet, ground = column_feet(part, count=COUNT), Ground(part)
    level = layer_level(part, (number + 0.5) * HEIGHT, height=HEIGHT)
    field = np.full((1, len(level.vertices)), thickness)
    return deposited_over(feet, ground, level, field, bottom=number * HEIGHT, height=HEIGHT)[0]


def test_feet_of_columns_are_spread_evenly_and_are_the_same_again() -> None:
    part = meshes.plate((40.0, 30.0), (8, 6), jitter_seed=3)
    places = column_feet(part, count=COUNT).places
    counts, _, _ = np.histogram2d(places[:, 0], places[:, 1], bins=(8, 6), range=((0.0, 40.0), (0.0, 30.0)))
    np.testing.assert_allclose(counts, COUNT / 48.0, atol=6)
    np.testing.assert_array_equal(places, column_feet(part, count=COUNT).places)


def test_on_a_cap_as_many_stand_below_each_height_as_the_sphere_has_area_there() -> None:
    feet = column_feet(meshes.spherical_cap(radius=12.0, angle=0.8, rings=30), count=COUNT)
    lowest = 12.0 * np.cos(0.8)
    # The area of a sphere between two heights goes with their difference [Archimedes].
    shares = (feet.places[:, 2] - lowest) / (12.0 - lowest)
    np.testing.assert_allclose(np.sort(shares), (np.arange(COUNT) + 0.5) / COUNT, atol=0.006)
    np.testing.assert_allclose(feet.upright, feet.places / 12.0, atol=0.01)


@pytest.mark.parametrize("side", ["outside", "inside"])
@pytest.mark.parametrize("shape", ["cap", "cylinder"])
def test_columns_go_through_every_layer_over_what_is_round(shape: str, side: str) -> None:
    part = (
        meshes.spherical_cap(radius=12.0, angle=0.4, rings=14)
        if shape == "cap"
        else meshes.cylinder_patch(radius=12.0, angle=1.2, length=10.0, divisions=(40, 10))
    )
    part = part if side == "outside" else turned_over(part)
    for number in (0, 7):
        np.testing.assert_allclose(deposited(part, number), HEIGHT)
    assert not have_met(column_feet(part, count=COUNT), Ground(part), height=8 * HEIGHT).any()


def test_columns_meet_over_a_crease_as_high_as_they_stand_beside_it() -> None:
    part, height = valley(np.pi / 4.0), 2.0
    feet = column_feet(part, count=COUNT)
    met = have_met(feet, Ground(part), height=height)
    beside = np.hypot(feet.places[:, 0], feet.places[:, 2])
    # Sides at a right angle: a column is as far from the other side as it stands from the crease.
    np.testing.assert_array_equal(met, beside < 0.95 * height)


def test_over_a_crease_a_layer_is_met_until_columns_meet() -> None:
    part = valley(np.pi / 4.0, length=5.0, side=6.0)
    found = deposited(part, 3)
    met = have_met(column_feet(part, count=COUNT), Ground(part), height=4 * HEIGHT)
    np.testing.assert_allclose(found[~met], HEIGHT)


def test_columns_leave_through_a_side_that_leans_in_over_the_triangles_beside_it() -> None:
    part = turned_over(meshes.cylinder_patch(radius=12.0, angle=1.2, length=10.0, divisions=(6, 10)))
    feet, height = column_feet(part, count=COUNT), 3.0
    found = within_sides(feet, Ground(part), height=height)
    # The side stands on the radius, and columns on the last triangles half of the angle of one off that.
    seen = feet.at(height)
    out = np.abs(seen[:, 0]) * np.cos(0.6) - seen[:, 2] * np.sin(0.6)
    # At its corners two sides meet.
    clear = (np.abs(out) > 0.03) & (np.abs(seen[:, 1] - 5.0) < 4.0)
    np.testing.assert_array_equal(found[clear], out[clear] < 0.0)
    assert 0.03 < (out[clear] > 0.0).mean() < 0.05


def test_a_layer_lies_on_every_column_between_the_sides_of_a_band_whose_rim_bends() -> None:
    part, height, number = prepare(load(shared("patches/aortic_root_band_6mm.ply"), unit="mm"))[0], 0.75, 3
    feet, ground, over = column_feet(part, count=COUNT), Ground(part), (number + 0.5) * height
    level = layer_level(part, over, height=height)
    field = np.full((1, len(level.vertices)), height)
    there = deposited_over(feet, ground, level, field, bottom=number * height, height=height)[0] > 0.0
    within, met = within_sides(feet, ground, height=over), have_met(feet, ground, height=(number + 1) * height)
    assert (there | met)[within].mean() > 0.999
    # One of twenty leaves through a side before: without these in mind, layers would be missed there.
    assert 0.03 < (~within & ~met).mean() < 0.08


def test_where_a_layer_is_not_nothing_is_laid() -> None:
    part = meshes.plate((20.0, 10.0), (20, 10))
    feet, half = column_feet(part, count=COUNT), meshes.plate((10.0, 10.0), (10, 10))
    level = Surface(half.vertices + np.array([0.0, 0.0, 0.2]), half.faces, "half")
    found = deposited_over(feet, Ground(part), level, np.full((2, 121), HEIGHT), bottom=0.0, height=HEIGHT)
    np.testing.assert_array_equal(found[1] > 0.0, feet.places[:, 0] <= 10.0 + 0.25 * HEIGHT)


def test_a_layer_that_is_thinner_on_one_side_is_so_on_its_columns() -> None:
    part = meshes.plate((20.0, 10.0), (20, 10))
    level = layer_level(part, 0.2, height=HEIGHT)
    field = 0.02 * level.vertices[None, :, 0]
    feet = column_feet(part, count=COUNT)
    found = deposited_over(feet, Ground(part), level, field, bottom=0.0, height=HEIGHT)[0]
    np.testing.assert_allclose(found, 0.02 * feet.places[:, 0], atol=2e-4)


def test_a_shape_is_wanted_as_high_as_it_is_and_only_where_it_is() -> None:
    part = meshes.plate((20.0, 10.0), (20, 10))
    low, high = meshes.plate((10.0, 10.0), (2, 2)), meshes.plate((10.0, 10.0), (2, 2))
    slope = 1.0 + 0.1 * high.vertices[:, 0]
    corners = np.concatenate([low.vertices, np.column_stack([high.vertices[:, :2], slope])])
    rim = [0, 3, 6, 7, 8, 5, 2, 1]
    sides = [(a, b, b + 9, a, b + 9, a + 9) for a, b in zip(rim, rim[1:] + rim[:1], strict=True)]
    shape = Surface(
        corners, np.concatenate([low.faces[:, ::-1], high.faces + 9, np.array(sides).reshape(-1, 3)]), "wedge"
    )
    feet = column_feet(part, count=COUNT)
    found = wanted_over(feet, TargetShape(shape, part), height=HEIGHT)
    inside = feet.places[:, 0] < 10.0
    np.testing.assert_allclose(found[inside], 1.0 + 0.1 * feet.places[inside, 0], atol=0.002)
    np.testing.assert_array_equal(found[~inside], 0.0)


def test_a_thickness_that_varies_is_wanted_as_it_varies() -> None:
    part = meshes.plate((20.0, 10.0), (20, 10))
    feet = column_feet(part, count=COUNT)
    found = wanted_over(feet, TargetThickness(part, 0.1 * part.vertices[:, 0]), height=HEIGHT)
    np.testing.assert_allclose(found[found > 0.0], 0.1 * feet.places[found > 0.0, 0], atol=0.001)
    assert feet.places[found == 0.0, 0].max() < 1.0 + 1e-9
