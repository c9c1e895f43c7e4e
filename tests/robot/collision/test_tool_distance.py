from __future__ import annotations

import fcl
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.model import FloatArray
from geoprint.robot.collision.closest import shapes_of
from geoprint.robot.collision.surroundings import mesh_target
from geoprint.robot.collision.tool_solids import (
    RESOLUTION,
    SIDES,
    Revolution,
    _distances_and_slopes,  # pyright: ignore[reportPrivateUsage]
    nearest,
    polytope,
    quarter,
    revolution,
    signed_distances,
    tool_solids,
)
from tests.meshes import spherical_cap
from tests.robot.cells import straight_cell

SOLIDS = tool_solids(straight_cell().tool)
NEEDLE, BARREL = shapes_of(SOLIDS)[1:3]
CONE = np.radians(10.0)


@pytest.mark.parametrize(
    ("shape", "point", "distance"),
    [
        (NEEDLE, (0.0, 0.0, 0.0), 1.0),  # the tip: the needle starts a millimetre behind it
        (NEEDLE, (2.65, 0.0, -10.0), 2.0),  # beside the needle
        (NEEDLE, (0.0, 0.35, -10.0), -0.3),  # in the needle
        (BARREL, (0.0, 13.0, -100.0), 3.0),  # beside the barrel
        (BARREL, (9.0, 0.0, -100.0), -1.0),  # in the barrel
        (BARREL, (3.0, 0.0, -123.0), 3.0),  # above the barrel
        (BARREL, (13.0, 0.0, -124.0), 5.0),  # off the rim of the barrel's top
        (BARREL, (0.65 + 10.0 * np.tan(CONE) + np.cos(CONE), 0.0, -25.4 - 10.0 + np.sin(CONE)), 1.0),  # off the cone
    ],
)
def test_distance_of_known_points(shape: Revolution, point: tuple[float, float, float], distance: float):
    assert signed_distances(shape, np.array([point]))[0] == pytest.approx(distance, abs=1e-12)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_distance_changes_by_no_more_than_two_points_are_apart(seed: int):
    generator = np.random.default_rng(seed)
    points = generator.uniform([-15.0, -15.0, -130.0], [15.0, 15.0, 5.0], (50, 3))
    others = points + generator.normal(scale=0.5, size=(50, 3))

    change = np.abs(signed_distances(BARREL, points) - signed_distances(BARREL, others))

    assert (change <= np.linalg.norm(points - others, axis=1) + 1e-12).all()


def test_slopes_are_how_distances_change():
    generator = np.random.default_rng(4)
    points = generator.uniform([-15.0, -15.0, -130.0], [15.0, 15.0, 5.0], (300, 3))

    slopes = _distances_and_slopes(BARREL, points)[1]

    ahead, behind = (
        np.column_stack([signed_distances(BARREL, points + step * axis) for axis in np.eye(3)])
        for step in (1e-6, -1e-6)
    )
    np.testing.assert_allclose(slopes, (ahead - behind) / 2e-6, atol=1e-3)
    np.testing.assert_allclose(np.linalg.norm(slopes, axis=1), 1.0)
    # On the axis and on the surface no direction is any better.
    known = _distances_and_slopes(BARREL, BARREL.origin + np.array([[0.0, 0.0, -40.0], [0.65, 0.0, 0.0]]))
    assert np.isfinite(known[1]).all()
    assert known[0][1] == 0.0
    assert not known[1][1].any()


def test_nearest_point_lies_inside_a_large_triangle():
    wall = np.array([[[12.5, -400.0, -400.0], [12.5, 400.0, -400.0], [12.5, 0.0, 400.0]]])

    distance, point = nearest(BARREL, wall)

    assert distance == pytest.approx(2.5, abs=RESOLUTION)
    assert BARREL.solid_at(point).name == "barrel"


def test_deepest_point_of_a_triangle_through_the_barrel_is_found():
    blade = np.array([[[-30.0, 4.0, -90.0], [30.0, 4.0, -90.0], [0.0, 4.0, -200.0]]])

    assert nearest(BARREL, blade)[0] == pytest.approx(-6.0, abs=RESOLUTION)


def test_no_triangle_is_infinitely_far():
    assert nearest(BARREL, np.empty((0, 3, 3)))[0] == np.inf


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_nearest_is_not_farther_than_any_sample(seed: int):
    generator = np.random.default_rng(seed)
    triangles = generator.uniform([-20.0, -20.0, -130.0], [20.0, 20.0, 10.0], (5, 3, 3))
    samples: FloatArray = triangles
    for _ in range(4):
        samples = quarter(samples)
    spread = np.linalg.norm(samples - samples.mean(axis=1, keepdims=True), axis=2).max()

    sampled = signed_distances(BARREL, samples.reshape(-1, 3)).min()
    found = nearest(BARREL, triangles)[0]

    assert sampled - spread <= found <= sampled + RESOLUTION


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(-1.0, 1.0))
def test_what_lies_within_a_distance_is_found_as_without_one_and_else_nothing_is(seed: int, share: float):
    generator = np.random.default_rng(seed)
    triangles = generator.uniform([-20.0, -20.0, -130.0], [20.0, 20.0, 10.0], (5, 3, 3))
    wanted, place = nearest(BARREL, triangles)
    within = wanted + 3.0 * share

    distance, point = nearest(BARREL, triangles, within=within)

    if within >= wanted:
        assert distance == wanted
        np.testing.assert_array_equal(point, place)
    else:
        assert distance > within


def test_what_lies_far_beyond_a_distance_is_not_measured_to_the_end():
    far = np.array([[[50.0, 0.0, -10.0], [60.0, 10.0, -30.0], [55.0, -10.0, -90.0]]])

    assert nearest(BARREL, far, within=20.0)[0] > nearest(BARREL, far)[0] + RESOLUTION


def test_face_flat_against_a_lid_is_found_at_once():
    floor = np.array([[[-500.0, -500.0, 0.3], [500.0, -500.0, 0.3], [0.0, 800.0, 0.3]]])

    assert nearest(NEEDLE, floor)[0] == pytest.approx(1.3, abs=1e-9)


def test_quarters_cover_the_triangle():
    triangle = np.array([[[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 2.0, 0.0]]])

    parts = quarter(triangle)

    areas = np.linalg.norm(np.cross(parts[:, 1] - parts[:, 0], parts[:, 2] - parts[:, 0]), axis=1) / 2
    np.testing.assert_allclose(areas, 1.0)
    np.testing.assert_allclose(parts.mean(axis=(0, 1)), triangle.mean(axis=(0, 1)))


@pytest.mark.parametrize("index", [1, 2, 3, 4])
def test_fcl_measures_the_same_distance(index: int):
    cap = mesh_target(spherical_cap(rings=6), role="part")
    corners, triangles = polytope(SOLIDS[index], by=0.0)
    faces = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
    solid = fcl.CollisionObject(fcl.Convex(corners, len(triangles), faces))
    shift = np.array([3.0, 4.0, 34.0]) - SOLIDS[index].start * [1.0, -1.0, -1.0]
    pose = np.diag([1.0, -1.0, -1.0])
    solid.setTransform(fcl.Transform(pose, shift))

    measured = fcl.distance(solid, cap.model, fcl.DistanceRequest(), fcl.DistanceResult())
    found = nearest(revolution((SOLIDS[index],)), (cap.triangles - shift) @ pose)[0]

    polygon = SOLIDS[index].end_radius * (1.0 / np.cos(np.pi / SIDES) - 1.0)
    assert measured - RESOLUTION <= found <= measured + polygon + RESOLUTION
