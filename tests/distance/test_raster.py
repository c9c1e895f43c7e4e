"""The raster: exact distances against brute force, and level curves where they were not measured before."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.ndimage import distance_transform_edt, map_coordinates

from geoprint.distance.distortion import locate
from geoprint.distance.lscm_raster import DistanceImage, clipped, filled, level_lines, region_image, source_image
from geoprint.distance.segment_distance import ALL, counted_everywhere, measure_pixels, point_distances
from geoprint.geometry import closest, positions
from geoprint.model import FloatArray
from tests.distance.polygons import LETTER, LETTER_HOLES, segments_of, slow_distances, star, surrounded
from tests.meshes import disc, plate

TURN = np.array([[np.cos(0.4), np.sin(0.4)], [-np.sin(0.4), np.cos(0.4)]])


def centres(image: DistanceImage) -> FloatArray:
    rows, columns = np.indices(image.values.shape)
    return np.column_stack([columns.ravel(), rows.ravel()]) * image.pixel + image.origin


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000), corners=st.integers(3, 25), resolution=st.integers(16, 60))
def test_distances_to_the_border_of_random_polygons_with_holes_are_exact(
    seed: int, corners: int, resolution: int
) -> None:
    loops = star(corners, radius=9.0, seed=seed), star(5, radius=3.0, seed=seed + 1), star(4, radius=1.0, seed=seed + 2)
    border = segments_of(*loops)
    image = region_image(border, resolution=resolution)
    places = centres(image)
    wanted = slow_distances(places, border).reshape(image.values.shape)
    inside = surrounded(places, border).reshape(image.values.shape)
    assert image.measured[inside].all()
    signed = np.where(inside, wanted, -wanted)
    np.testing.assert_allclose(image.values[image.measured], signed[image.measured], atol=1e-9)
    assert (image.values[~image.measured] < 0.0).all()


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 40), points=st.integers(1, 300))
def test_distances_of_scattered_points_to_segments_and_points_are_exact(seed: int, count: int, points: int) -> None:
    rng = np.random.default_rng(seed)
    segments = rng.normal(size=(count, 2, 2)) * [7.0, 2.0] + 3.0
    segments[::3, 1] = segments[::3, 0]
    places = rng.normal(size=(points, 2)) * rng.uniform(0.01, 10.0)
    np.testing.assert_allclose(point_distances(segments, places), slow_distances(places, segments), atol=1e-9)


def test_from_the_middle_of_a_disc_every_segment_is_as_near_and_one_point_may_stand_for_all() -> None:
    angles = 2 * np.pi * np.arange(300) / 300
    border = segments_of(np.column_stack([np.cos(angles), np.sin(angles)]))
    assert point_distances(border, np.zeros((1, 2)))[0] == pytest.approx(np.cos(np.pi / 300), abs=1e-12)
    assert (point_distances(border, np.zeros((5, 2))) == point_distances(border, np.zeros((1, 2)))).all()


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10_000), rows=st.integers(1, 70), columns=st.integers(1, 70))
def test_with_outside_pixels_for_segments_it_is_the_distance_transform_of_the_binary_image(
    seed: int, rows: int, columns: int
) -> None:
    inside = np.random.default_rng(seed).random((rows, columns)) > 0.02
    inside[0, 0] = False
    outside = np.argwhere(~inside)[:, ::-1].astype(np.float64)
    points, found = counted_everywhere(np.stack([outside, outside], axis=1)), np.zeros(inside.shape)
    measure_pixels(points, inside.astype(np.uint8), 0, ALL, found)
    np.testing.assert_allclose(found, distance_transform_edt(inside), atol=1e-12)


def test_the_binary_staircase_is_off_by_up_to_a_pixel_and_does_not_reach_the_image() -> None:
    border = segments_of(np.array([[0.0, 0], [20, 0], [20, 10], [0, 10]]) @ TURN)
    image = region_image(border, resolution=200)
    inside = image.values > 0.0
    binary = np.asarray(distance_transform_edt(inside)) * image.pixel
    assert (binary - image.values)[inside].max() > 0.9 * image.pixel
    x, y = (centres(image) @ TURN.T).T
    wanted = np.minimum(np.minimum(x, 20 - x), np.minimum(y, 10 - y)).reshape(image.values.shape)
    np.testing.assert_allclose(image.values[inside], wanted[inside], atol=1e-12)


def test_a_slit_thinner_than_a_pixel_still_parts_the_region() -> None:
    comb = np.array([[0.0, 0], [10, 0], [10, 10], [5.001, 10], [5, 2], [4.999, 10], [0, 10]])
    image = region_image(segments_of(comb), resolution=33)
    assert image.sample(np.array([[3.5, 5.0]]))[0] == pytest.approx(1.499, abs=1e-3)


def test_the_zero_level_is_the_border_and_half_a_spacing_is_its_true_offset() -> None:
    border = segments_of(LETTER @ TURN, *(hole @ TURN for hole in LETTER_HOLES))
    spacing = 1.0
    image = region_image(border, resolution=int(16 * np.ptp(border, axis=(0, 1)).max() / spacing))
    zero, half = image.contours(np.array([0.0, 0.5 * spacing]))
    assert len(zero) == len(half) == 3
    for lines, level in ((zero, 0.0), (half, 0.5 * spacing)):
        nodes = np.vstack(lines)
        error = np.abs(slow_distances(nodes, border) - level)
        # Corners are cut by part of a pixel; there are few of them.
        assert np.percentile(error, 97) < 0.005 * spacing
        assert error.max() < 0.75 * image.pixel


@pytest.mark.parametrize("name", ["border", "seed"])
def test_level_curves_are_those_of_the_whole_image_to_the_last_bit(name: str) -> None:
    # More rows than a band has, and a seed from which some levels leave the region.
    region = region_image(segments_of(LETTER @ TURN, *(hole @ TURN for hole in LETTER_HOLES)), resolution=300)
    image = region if name == "border" else source_image(region, np.array([[[2.0, 6.0], [3.0, 8.0]]]) @ TURN)
    levels = np.linspace(0.02, 0.98, 12) * float(image.values[image.measured].max())
    whole = (0, np.where(image.measured, image.values, np.nan))
    for found, wanted in zip(image.contours(levels), level_lines([whole], levels=levels), strict=True):
        assert wanted
        for one, other in zip(found, wanted, strict=True):
            np.testing.assert_array_equal(one, other * image.pixel + image.origin)


def test_few_pixels_are_measured_for_levels_far_apart() -> None:
    border = segments_of(LETTER @ TURN)
    region = region_image(border, resolution=400)
    segments = counted_everywhere((border - region.origin) / region.pixel)
    found = np.full(region.marks.shape, np.nan)
    measure_pixels(segments, region.marks, 0, np.array([20.0]), found)
    near = np.abs(np.abs(region.values) / region.pixel - 20.0) <= 1.0
    assert np.isfinite(found[near & region.measured]).all()
    assert np.isfinite(found).sum() < 0.2 * region.measured.sum()


def test_samples_are_interpolated_between_all_pixels_whatever_the_order_of_the_points() -> None:
    region = region_image(segments_of(LETTER @ TURN), resolution=300)
    rng = np.random.default_rng(0)
    places = region.origin + rng.uniform(-3.0, 303.0, (2000, 2)) * region.pixel
    columns, rows = ((places - region.origin) / region.pixel).T
    wanted = map_coordinates(region.values, [rows, columns], order=1, mode="nearest")
    np.testing.assert_array_equal(region.sample(places), wanted)


def test_loops_are_filled_by_the_even_odd_rule() -> None:
    segments = segments_of(*(2.0 * loop + 3.3 for loop in (LETTER, *LETTER_HOLES)))
    shape = (70, 69)
    rows, columns = np.indices(shape)
    places = np.column_stack([columns.ravel(), rows.ravel()]).astype(np.float64)
    wanted = surrounded(places, segments).reshape(shape)
    assert 0.3 < wanted.mean() < 0.7
    np.testing.assert_array_equal(filled(segments, shape=shape), wanted)
    np.testing.assert_array_equal(filled(segments[::-1, ::-1], shape=shape), wanted)
    # Loops may reach beyond the image.
    corner = filled(segments - 20.0, shape=(30, 30))
    np.testing.assert_array_equal(corner, wanted[20:50, 20:50])


def test_distances_from_a_seed_are_straight_also_through_a_hole() -> None:
    region = region_image(segments_of(LETTER, *LETTER_HOLES), resolution=200)
    seed = np.array([[[2.0, 6.0], [2.0, 6.0]]])
    image = source_image(region, seed)
    beyond = np.array([[11.0, 6.0]])
    assert image.sample(beyond)[0] == pytest.approx(9.0, abs=1e-3)


def cut(line: FloatArray, region: DistanceImage) -> list[FloatArray]:
    return clipped(line, depth=region.sample(line), shortest=region.pixel)


def test_a_curve_is_cut_where_it_leaves_the_region_and_keeps_its_direction() -> None:
    region = region_image(segments_of(np.array([[0.0, 0], [10, 0], [10, 10], [0, 10]])), resolution=100)
    angles = np.linspace(0, 2 * np.pi, 200)
    circle = np.array([5.0, 10.0]) + 3 * np.column_stack([np.cos(angles), np.sin(angles)])
    circle[-1] = circle[0]
    (piece,) = cut(circle, region)
    np.testing.assert_allclose(piece[[0, -1]], [[2.0, 10.0], [8.0, 10.0]], atol=0.01)
    assert piece[:, 1].min() == pytest.approx(7.0, abs=0.01)
    across = np.column_stack([np.linspace(-3, 13, 81), np.full(81, 4.0)])
    (piece,) = cut(across, region)
    np.testing.assert_allclose(piece[[0, -1]], [[0.0, 4.0], [10.0, 4.0]], atol=1e-6)
    within = across[20:50]
    assert cut(within, region)[0] is within
    assert cut(within + np.array([0.0, 8.0]), region) == []
    inward = cut(across[20:], region)
    np.testing.assert_allclose(inward[0][[0, -1]], [across[20], [10.0, 4.0]], atol=1e-6)


def test_points_of_a_chart_are_found_in_the_triangle_that_holds_them() -> None:
    for surface, reach in ((plate((40.0, 30.0), (16, 12), jitter_seed=1), 50.0), (disc(rings=9, jitter_seed=2), 21.0)):
        places = np.random.default_rng(0).uniform(-reach, reach, (500, 2))
        places = np.vstack([places, surface.vertices[:, :2]])
        found = locate(surface, places)
        wanted, _ = closest(surface, np.column_stack([places, np.zeros(len(places))]))
        np.testing.assert_allclose(positions(surface, found), positions(surface, wanted), atol=1e-9)
