"""The raster: exact distances against brute force, level curves against a plain sixteen-case table."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.ndimage import distance_transform_edt, gaussian_filter

from geoprint.backends.chart_lookup import locate
from geoprint.backends.lscm.raster import DistanceImage, clipped, filled, region_image, seed_image
from geoprint.backends.lscm.segment_distance import grid_distances, point_distances
from geoprint.model import FloatArray
from geoprint.surfaces import closest, positions
from tests.backends.polygons import LETTER, LETTER_HOLES, segments_of, slow_distances, star, surrounded
from tests.meshes import disc, plate

# Corners of a cell in the order of the paper's table: bit 1 (row, column), 2 (row, column + 1), 4 (row + 1,
# column + 1), 8 (row + 1, column); edges 0 bottom, 1 right, 2 top, 3 left. Each case lists pairs of edges.
SIXTEEN_CASES: dict[int, list[tuple[int, int]]] = {
    0: [], 1: [(0, 3)], 2: [(0, 1)], 3: [(1, 3)], 4: [(1, 2)], 6: [(0, 2)], 7: [(2, 3)],
    8: [(2, 3)], 9: [(0, 2)], 11: [(1, 2)], 12: [(1, 3)], 13: [(0, 1)], 14: [(0, 3)], 15: [],
}  # fmt: skip
SADDLES: dict[tuple[int, bool], list[tuple[int, int]]] = {
    (5, True): [(0, 1), (2, 3)], (5, False): [(0, 3), (1, 2)],
    (10, True): [(0, 3), (1, 2)], (10, False): [(0, 1), (2, 3)],
}  # fmt: skip
TURN = np.array([[np.cos(0.4), np.sin(0.4)], [-np.sin(0.4), np.cos(0.4)]])


def image_of(values: FloatArray) -> DistanceImage:
    return DistanceImage(values, np.zeros(2), 1.0, np.ones(values.shape, dtype=np.bool_))


def centres(image: DistanceImage) -> FloatArray:
    rows, columns = np.indices(image.values.shape)
    return np.column_stack([columns.ravel(), rows.ravel()]) * image.pixel + image.origin


def marching_squares(values: FloatArray, level: float) -> set[frozenset[tuple[float, float]]]:
    """Return the pieces (x, y) of a level curve by the 16-case table, cell by cell: slow and plain."""
    pieces: set[frozenset[tuple[float, float]]] = set()
    for row in range(values.shape[0] - 1):
        for column in range(values.shape[1] - 1):
            corners = [(row, column), (row, column + 1), (row + 1, column + 1), (row + 1, column)]
            z = [float(values[corner]) for corner in corners]
            case = sum(1 << i for i in range(4) if z[i] > level)
            pairs = SADDLES[case, sum(z) / 4 > level] if case in {5, 10} else SIXTEEN_CASES[case]
            for pair in pairs:
                ends: list[tuple[float, float]] = []
                for edge in pair:
                    i, j = edge, (edge + 1) % 4
                    share = (level - z[i]) / (z[j] - z[i])
                    y, x = (corners[i][k] + share * (corners[j][k] - corners[i][k]) for k in range(2))
                    ends.append((round(x, 9), round(y, 9)))
                pieces.add(frozenset(ends))
    return pieces


@pytest.mark.parametrize("smooth", [True, False], ids=["smooth", "noise"])
def test_level_curves_of_fifty_images_are_those_of_the_sixteen_case_table(*, smooth: bool) -> None:
    saddles = 0
    for seed in range(50):
        noise = np.random.default_rng(seed).normal(size=(12, 15))
        values = gaussian_filter(noise, 1.5) if smooth else noise
        level = 0.1 * float(values.std())
        found = {
            frozenset((round(float(x), 9), round(float(y), 9)) for x, y in piece)
            for line in image_of(values).contours(np.array([level]))[0]
            for piece in pairwise(line)
        }
        assert found == marching_squares(values, level)
        above = values > level
        saddles += int(((above[:-1, :-1] == above[1:, 1:]) & (above[:-1, :-1] != above[:-1, 1:])
                        & (above[1:, :-1] == above[:-1, 1:])).sum())  # fmt: skip
    assert smooth or saddles > 500


@pytest.mark.parametrize("smooth", [True, False], ids=["smooth", "noise"])
def test_larger_values_lie_on_the_left_of_every_piece(*, smooth: bool) -> None:
    for seed in range(50):
        noise = np.random.default_rng(seed).normal(size=(12, 15))
        image = image_of(gaussian_filter(noise, 1.5) if smooth else noise)
        for line in image.contours(np.array([0.1 * float(image.values.std())]))[0]:
            along = np.diff(line, axis=0)
            lengths = np.linalg.norm(along, axis=1)
            middles, left = line[:-1] + 0.5 * along, np.column_stack([-along[:, 1], along[:, 0]])
            step = 1e-6 * left[lengths > 1e-6] / lengths[lengths > 1e-6, None]
            rise = image.sample(middles[lengths > 1e-6] + step) - image.sample(middles[lengths > 1e-6] - step)
            assert (rise > 0.0).all()


def test_a_closed_level_curve_repeats_its_first_point_and_one_that_leaves_the_image_does_not() -> None:
    x, y = np.meshgrid(np.arange(21.0), np.arange(21.0))
    circles = image_of(np.hypot(x - 10, y - 10)).contours(np.array([4.0, 12.0]))
    assert [len(lines) for lines in circles] == [1, 4]
    assert (circles[0][0][0] == circles[0][0][-1]).all()
    assert not (circles[1][0][0] == circles[1][0][-1]).all()


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


@pytest.mark.dear
@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10_000), rows=st.integers(1, 70), columns=st.integers(1, 70))
def test_with_outside_pixels_for_segments_it_is_the_distance_transform_of_the_binary_image(
    seed: int, rows: int, columns: int
) -> None:
    inside = np.random.default_rng(seed).random((rows, columns)) > 0.02
    inside[0, 0] = False
    outside = np.argwhere(~inside)[:, ::-1].astype(np.float64)
    found = grid_distances(np.stack([outside, outside], axis=1), inside)
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
    image = seed_image(region, seed)
    beyond = np.array([[11.0, 6.0]])
    assert image.sample(beyond)[0] == pytest.approx(9.0, abs=1e-3)


def test_a_curve_is_cut_where_it_leaves_the_region_and_keeps_its_direction() -> None:
    region = region_image(segments_of(np.array([[0.0, 0], [10, 0], [10, 10], [0, 10]])), resolution=100)
    angles = np.linspace(0, 2 * np.pi, 200)
    circle = np.array([5.0, 10.0]) + 3 * np.column_stack([np.cos(angles), np.sin(angles)])
    circle[-1] = circle[0]
    (piece,) = clipped(circle, region)
    np.testing.assert_allclose(piece[[0, -1]], [[2.0, 10.0], [8.0, 10.0]], atol=0.01)
    assert piece[:, 1].min() == pytest.approx(7.0, abs=0.01)
    across = np.column_stack([np.linspace(-3, 13, 81), np.full(81, 4.0)])
    (piece,) = clipped(across, region)
    np.testing.assert_allclose(piece[[0, -1]], [[0.0, 4.0], [10.0, 4.0]], atol=1e-6)
    within = across[20:50]
    assert clipped(within, region)[0] is within
    assert clipped(within + np.array([0.0, 8.0]), region) == []
    inward = clipped(across[20:], region)
    np.testing.assert_allclose(inward[0][[0, -1]], [across[20], [10.0, 4.0]], atol=1e-6)


def test_points_of_a_chart_are_found_in_the_triangle_that_holds_them() -> None:
    for surface, reach in ((plate((40.0, 30.0), (16, 12), jitter_seed=1), 50.0), (disc(rings=9, jitter_seed=2), 21.0)):
        places = np.random.default_rng(0).uniform(-reach, reach, (500, 2))
        places = np.vstack([places, surface.vertices[:, :2]])
        found = locate(surface, places)
        wanted, _ = closest(surface, np.column_stack([places, np.zeros(len(places))]))
        np.testing.assert_allclose(positions(surface, found), positions(surface, wanted), atol=1e-9)
