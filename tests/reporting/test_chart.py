"""The picture of a chart shows what it is given: colours follow area scale and distance, nothing is cut off."""

from __future__ import annotations

import io
from functools import cache

import numpy as np
from matplotlib.image import imread

from geoprint.model import FloatArray, FollowedLines, IntArray, Surface
from geoprint.reporting import FlattenedPart, chart_figure, lines_figure
from tests.meshes import plate


@cache
def drawn(*, scale: float, levels: int = 3) -> tuple[FloatArray, bytes]:
    """Draw a plate whose left half has an area scale and whose right half has its inverse."""
    rows, columns = np.indices((60, 80))
    x = np.linspace(2.0, 38.0, 50)
    y = np.repeat(np.linspace(3.0, 27.0, levels), 50)
    places = np.column_stack([np.tile(x, levels), y, np.zeros(50 * levels)])
    part = FlattenedPart(
        area_scales=np.where(columns < 40, scale, 1 / scale),
        distances=0.5 * rows.astype(np.float64),
        inside=np.ones((60, 80)),
        extent=np.array([0.0, 40.0, 0.0, 30.0]),
        chart_places=places[:, :2],
        places=places,
        offsets=50 * np.arange(levels + 1),
        levels=np.arange(levels),
        chart_offsets=50 * np.arange(levels + 1),
    )
    png = chart_figure(plate(), part, R_view_work=np.eye(3), spacing=30.0 / levels, title="test")
    return np.asarray(imread(io.BytesIO(png)), dtype=np.float64), png


def panel(image: FloatArray, number: int) -> FloatArray:
    """Return the upper part of one of the three panels, without its colour scale."""
    width = image.shape[1] // 3
    return image[: 3 * image.shape[0] // 4, number * width : (number + 1) * width, :3]


def share(pixels: FloatArray, colour: tuple[float, float, float]) -> float:
    return float((np.abs(pixels - np.array(colour)).max(axis=-1) < 0.12).mean())


def test_shrunk_parts_of_the_chart_are_orange_and_stretched_ones_purple() -> None:
    # The ends of the scale: dark orange below, dark purple above.
    orange, purple = (0.50, 0.23, 0.03), (0.18, 0.0, 0.29)
    for scale, left, right in ((0.7, orange, purple), (1.4, purple, orange)):
        chart = panel(drawn(scale=scale)[0], 0)
        middle = chart.shape[1] // 2
        assert share(chart[:, :middle], left) > 0.4
        assert share(chart[:, middle:], right) > 0.4
        assert share(chart[:, :middle], right) < 0.02


def test_a_chart_that_is_true_to_area_is_light() -> None:
    assert share(panel(drawn(scale=1.0, levels=8)[0], 0), (0.97, 0.97, 0.97)) > 0.4


def test_curves_are_black_on_the_light_half_and_thinned_where_there_are_too_many() -> None:
    def dark(levels: int) -> float:
        distances = panel(drawn(scale=1.0, levels=levels)[0], 1)
        upper = distances[distances.shape[0] // 4 : distances.shape[0] // 2]
        return float((upper.max(axis=-1) < 0.4).mean())

    assert 0.0 < dark(8) < 0.6 * dark(20)
    assert dark(40) < 1.3 * dark(20)


def test_a_curve_that_goes_on_at_the_other_side_of_a_cut_is_not_drawn_across_the_chart() -> None:
    # Two curves whose points jump from right to left in the middle: below the cut is not known, above it is.
    x = np.tile(np.concatenate([np.linspace(25.0, 38.0, 25), np.linspace(2.0, 15.0, 25)]), 2)
    places = np.column_stack([x, np.repeat([15.0, 21.0], 50)])
    part = FlattenedPart(
        area_scales=np.ones((60, 80)),
        distances=np.full((60, 80), 30.0),
        inside=np.ones((60, 80)),
        extent=np.array([0.0, 40.0, 0.0, 30.0]),
        chart_places=places,
        places=np.column_stack([places, np.zeros(100)]),
        offsets=np.array([0, 50, 100]),
        levels=np.array([0, 0]),
        chart_offsets=np.array([0, 50, 75, 100]),
    )
    png = chart_figure(plate(), part, R_view_work=np.eye(3), spacing=60.0, title="test")
    distances = panel(np.asarray(imread(io.BytesIO(png)), dtype=np.float64), 1)
    height, width = distances.shape[:2]
    dark = distances[height // 4 : 3 * height // 4].max(axis=-1) < 0.4

    def crossings(first: float, last: float) -> IntArray:
        """Return the rows at which curves begin between two shares of the width, from above."""
        rows = dark[:, int(first * width) : int(last * width)].any(axis=1)
        return np.flatnonzero(np.diff(rows.astype(np.int64)) == 1)

    upper, lower = crossings(0.7, 0.8)
    (across,) = crossings(0.46, 0.54)
    assert abs(across - lower) < 0.5 * (lower - upper)


def test_nothing_reaches_the_edge_of_the_picture_and_the_bytes_repeat() -> None:
    image, png = drawn(scale=0.7)
    for edge in (image[0], image[-1], image[:, 0], image[:, -1]):
        np.testing.assert_allclose(edge[:, :3], 1.0)
    assert drawn.__wrapped__(scale=0.7)[1] == png


# The picture of the lines that paths follow: dashes along them, and marks where they turn.


# Colours of marks: lines turn as who walks around, and against that.
WITH, AGAINST = (0.835, 0.369, 0.0), (0.0, 0.447, 0.698)


def _drawn(*direction: float, indices: tuple[float, ...] = ()) -> FloatArray:
    surface = plate((20.0, 20.0), (40, 40), jitter_seed=1)
    places = np.array([[5.0 + 10.0 * number, 10.0, 0.0] for number in range(len(indices))]).reshape(-1, 3)
    followed = FollowedLines(np.tile(direction, (len(surface.faces), 1)), places, np.array(indices))
    return _image(surface, followed)


def _image(surface: Surface, followed: FollowedLines) -> FloatArray:
    png = lines_figure(surface, followed, R_view_work=np.eye(3), title="")
    assert png == lines_figure(surface, followed, R_view_work=np.eye(3), title="")
    return np.asarray(imread(io.BytesIO(png)), dtype=np.float64)[..., :3]


def _pixels(image: FloatArray, colour: tuple[float, float, float]) -> int:
    return int((np.abs(image - np.array(colour)).max(axis=-1) < 0.12).sum())


def test_dashes_run_along_the_lines() -> None:
    # Along a dash darkness changes less than across it.
    for direction, along in (((1.0, 0.0, 0.0), 1), ((0.0, 1.0, 0.0), 0)):
        part = _drawn(*direction)[100:400, 100:400].mean(axis=-1)
        changes = [float(np.abs(np.diff(part, axis=axis)).mean()) for axis in (0, 1)]
        assert changes[along] < 0.7 * changes[1 - along]


def test_places_are_marked_in_the_colour_of_how_lines_turn_about_them() -> None:
    none, mixed, against = (_drawn(1.0, 0.0, 0.0, indices=each) for each in ((), (0.5, -0.5), (-0.5, -1.0)))
    assert _pixels(none, WITH) == _pixels(none, AGAINST) == 0
    assert _pixels(mixed, WITH) > 30
    assert _pixels(mixed, AGAINST) > 30
    assert _pixels(against, WITH) == 0
    assert _pixels(against, AGAINST) > 1.5 * _pixels(mixed, AGAINST)
