"""Figures show what they are given: colours follow the ratios, nothing is cut off, the bytes repeat."""

from __future__ import annotations

import io

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread

from geoprint.model import FloatArray
from geoprint.reporting import CoveragePanel, coverage_figure
from geoprint.reporting.figures import add_title, png_bytes
from tests.meshes import plate

NO_GAPS: FloatArray = np.empty((0, 3))


def drawn(ratio: float) -> tuple[FloatArray, bytes]:
    x = np.linspace(2.0, 38.0, 200)
    places = np.concatenate([np.column_stack([x, np.full(200, y), np.zeros(200)]) for y in (8.0, 15.0, 22.0)])
    panel = CoveragePanel("one", "caption", places, np.array([0, 200, 400, 600]), np.full(600, ratio), NO_GAPS)
    png = png_bytes(coverage_figure(plate(), [panel, panel], R_view_work=np.eye(3), spacing=6.0, title="test"))
    return np.asarray(imread(io.BytesIO(png)), dtype=np.float64), png


def share_where_first_exceeds_second(image: FloatArray, first: int, second: int) -> float:
    """Look at the left three quarters only: the colour scale stands on the right."""
    panels = image[:, : 3 * image.shape[1] // 4]
    return float((panels[..., first] > panels[..., second] + 0.2).mean())


def test_paths_too_close_are_red_and_paths_too_far_are_blue() -> None:
    near, far = drawn(0.82)[0], drawn(1.18)[0]
    assert share_where_first_exceeds_second(near, 0, 2) > 0.05
    assert share_where_first_exceeds_second(near, 2, 0) < 0.001
    assert share_where_first_exceeds_second(far, 2, 0) > 0.05
    assert share_where_first_exceeds_second(far, 0, 2) < 0.001


def test_paths_without_a_neighbour_are_grey() -> None:
    image, _ = drawn(float("nan"))
    assert share_where_first_exceeds_second(image, 0, 2) < 0.001
    assert share_where_first_exceeds_second(image, 2, 0) < 0.001


def test_nothing_reaches_the_edge_of_the_picture_and_the_bytes_repeat() -> None:
    image, png = drawn(1.0)
    for edge in (image[0], image[-1], image[:, 0], image[:, -1]):
        np.testing.assert_allclose(edge[:, :3], 1.0)
    assert drawn(1.0)[1] == png


@pytest.mark.parametrize("size", [(4.0, 120.0), (120.0, 4.0)])
def test_a_long_strip_makes_no_long_picture(size: tuple[float, float]) -> None:
    strip = plate(size, (4, 4))
    middle = np.array([[0.4 * size[0], 0.4 * size[1], 0.0], [0.6 * size[0], 0.6 * size[1], 0.0]])
    panel = CoveragePanel("one", "caption", middle, np.array([0, 2]), np.ones(2), NO_GAPS)
    strip_figure = coverage_figure(strip, [panel], R_view_work=np.eye(3), spacing=1.0, title="test")
    seen = imread(io.BytesIO(png_bytes(strip_figure)))
    assert 200 < seen.shape[0] < 900
    assert seen.shape[1] < 900


def test_a_title_that_is_longer_than_the_figure_is_wide_goes_on_in_a_line_below() -> None:
    figure = Figure(figsize=(6.3, 6.2))
    FigureCanvasAgg(figure)
    add_title(figure, "rodero01_lv_epicardium.ply, paths 1.5 mm apart, seen along the mean normal, MMMM")
    assert figure.get_suptitle().count("\n") == 1
    (title,) = figure.texts
    assert title.get_window_extent().x1 < figure.bbox.x1
