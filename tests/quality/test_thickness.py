"""The simulated layer: flat where flow fits the spacing, uneven where it does not, no volume lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.config import load_cell
from geoprint.deposition import following_flow
from geoprint.errors import InputError
from geoprint.model import FloatArray, PoseStream, Process, Surface
from geoprint.quality import LevelledLayer, uniformity
from tests.meshes import disc, plate, spherical_cap
from tests.quality.deposits import circle, deposited, rectangle_line, straight_line


def process(layer_height: float) -> Process:
    return replace(load_cell(None).process, layer_height=layer_height)


def lines_at(heights: list[float]) -> PoseStream:
    lines = [straight_line((0.0, y), (40.0, y), points=161) for y in heights]
    return deposited(lines, range(len(lines)))


def fine_plate() -> Surface:
    return plate((40.0, 30.0), (40, 30), jitter_seed=1)


def followed(stream: PoseStream, surface: Surface, *, spacing: float, layer_height: float) -> FloatArray:
    widths = uniformity(stream, surface, spacing=spacing).pose_widths
    return following_flow(widths, deposit=stream.deposit, spacing=spacing, process=process(layer_height))


def test_lines_one_spacing_apart_make_an_even_layer_of_the_right_height() -> None:
    stream = lines_at([1.0 + 2.0 * k for k in range(15)])
    found = LevelledLayer(stream, fine_plate(), spacing=2.0)(np.full(stream.count, 2.0 * 0.5))
    assert found.mean == pytest.approx(0.5, rel=1e-4)
    assert found.cv is not None
    assert found.cv < 0.001


def test_the_laid_volume_is_the_volume_of_the_layer() -> None:
    stream = deposited([circle(7.0), circle(3.0)], [0, 1])
    found = LevelledLayer(stream, disc(radius=10.0, rings=20), spacing=2.0)(np.full(stream.count, 0.8))
    points = stream.surface_points
    laid = 0.8 * np.linalg.norm(np.diff(points, axis=0), axis=1)[stream.laid].sum()
    area = 0.5 * 120 * 10.0**2 * np.sin(2 * np.pi / 120)
    assert found.mean * area == pytest.approx(laid, rel=1e-4)


def test_a_flow_that_doubles_from_end_to_end_is_reported_as_the_unevenness_that_it_is() -> None:
    stream = lines_at([1.0 + 2.0 * k for k in range(15)])
    flow = 1.0 + stream.surface_points[:, 0] / 40.0
    found = LevelledLayer(stream, fine_plate(), spacing=2.0)(flow)
    # A linear ramp from 1 to 2: standard deviation 1 / sqrt(12), mean 1.5; levelling flattens only its ends.
    assert found.cv == pytest.approx(1.0 / np.sqrt(12.0) / 1.5, rel=0.03)


def test_flow_that_follows_the_width_evens_out_lines_that_draw_apart() -> None:
    heights = np.cumsum([1.0, *np.linspace(1.5, 2.5, 14)]).tolist()
    stream = lines_at(heights)
    layer = LevelledLayer(stream, fine_plate(), spacing=2.0)
    constant = layer(np.full(stream.count, 1.0))
    following = layer(followed(stream, fine_plate(), spacing=2.0, layer_height=0.5))
    assert constant.cv is not None
    assert following.cv is not None
    assert constant.cv > 0.1
    assert following.cv < constant.cv / 4
    assert following.mean == pytest.approx(0.5, rel=0.01)


def test_the_gap_where_two_fronts_meet_counts_as_near_the_medial_axis() -> None:
    # Rectangles whose last lines stay 3.6 mm apart: their strips are 2.8 mm wide.
    insets = [1.0 + 2.0 * k for k in range(7)]
    stream = deposited([rectangle_line((d, d), (40.0 - d, 29.6 - d)) for d in insets], range(7))
    surface = plate((40.0, 29.6), (40, 30), jitter_seed=1)
    layer = LevelledLayer(stream, surface, spacing=2.0)
    constant = layer(np.full(stream.count, 1.0))
    following = layer(followed(stream, surface, spacing=2.0, layer_height=0.5))
    assert constant.cv is not None
    assert constant.near_cv is not None
    assert following.near_cv is not None
    assert constant.cv < 0.01
    assert constant.near_cv > 5 * constant.cv
    assert following.near_cv < constant.near_cv / 2
    assert 0.4 < constant.away_share < 0.9


def test_where_every_front_meets_nothing_is_away() -> None:
    stream = deposited([circle(2.0, points=91), circle(0.6, points=91)], [0, 1])
    found = LevelledLayer(stream, disc(radius=3.0, rings=8), spacing=2.0)(np.full(stream.count, 1.0))
    assert found.cv is None
    assert found.near_cv is not None
    assert found.away_share == 0.0


def test_the_width_at_a_pose_is_that_of_its_strip_on_every_level() -> None:
    polar = 0.95 - np.arange(0.0, 8.0) * 2.2 / 30.0
    lines = [circle(30.0 * np.sin(a), height=30.0 * np.cos(a)) for a in polar.tolist()]
    stream = deposited(lines, range(8))
    stream = replace(stream, flow=np.zeros(stream.count))
    widths = uniformity(stream, spherical_cap(radius=30.0, angle=1.0, rings=32), spacing=2.0).pose_widths
    inner = (stream.levels > 0) & (stream.levels < 7)
    np.testing.assert_allclose(widths[inner], 1.1, atol=0.012)
    # Outermost: half of the spacing inwards, and 0.05 rad to the border.
    outer = (1.1 + 1.5 / 2.0 * np.sin(0.975) / np.sin(0.95)) - 0.55
    np.testing.assert_allclose(widths[stream.levels == 0], outer, atol=0.02)


def test_rows_of_triangles_that_run_along_the_paths_do_not_bias_the_widths() -> None:
    stream = deposited([circle(r, points=361) for r in np.arange(14.5, 0.0, -1.0)], range(15))
    surface = disc(radius=15.0, rings=22)
    widths = uniformity(stream, surface, spacing=1.0).pose_widths
    means = [widths[stream.deposit & (stream.levels == level)].mean() for level in range(1, 13)]
    # Triangles judged by their middles alone were off by up to 0.8 %, and the layer by 0.3 %.
    np.testing.assert_allclose(means, 1.0, atol=0.002)
    flow = following_flow(widths, deposit=stream.deposit, spacing=1.0, process=process(0.5))
    found = LevelledLayer(stream, surface, spacing=1.0)(flow)
    assert found.cv is not None
    assert found.cv < 0.0013


def test_widths_stay_true_where_the_budget_of_work_leaves_out_much_of_the_surface() -> None:
    stream = deposited([circle(r, points=361) for r in np.arange(14.5, 0.0, -1.0)], range(15))
    found = uniformity(stream, disc(radius=15.0, rings=22), spacing=1.0, windows=300_000)
    assert found.unknown > 0.3
    inner = stream.deposit & (stream.levels > 0) & (stream.levels < 13)
    # Without what was left out, strips seemed narrower here and there: by 9 % in the mean.
    assert found.pose_widths[inner].std() < 0.04


def test_flow_is_width_times_spacing_times_layer_height_within_its_bounds() -> None:
    widths, deposit = np.array([1.0, 1.2, 0.1, 5.0, 1.0]), np.array([True, True, True, True, False])
    found = following_flow(widths, deposit=deposit, spacing=2.0, process=process(0.5))
    np.testing.assert_allclose(found, [1.0, 1.2, 0.5, 1.5, 0.0])
    narrow = replace(process(0.5), least_flow=0.9, most_flow=1.1)
    found = following_flow(widths, deposit=deposit, spacing=2.0, process=narrow)
    np.testing.assert_allclose(found, [1.0, 1.1, 0.9, 1.1, 0.0])
    with pytest.raises(InputError, match="positive spacing and layer height"):
        following_flow(widths, deposit=deposit, spacing=0.0, process=process(0.5))
