"""Figures for papers: the same bytes for the same input, nothing cut off, colours that say what was given."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from matplotlib.image import imread

from geoprint.model import FloatArray
from geoprint.reporting import CoveragePanel
from geoprint.reporting.paper_figures import paper_figures
from tests.meshes import plate

NAMES = {"spacing-map.png", "spacing-map.svg", "spacing-histogram.png", "spacing-histogram.svg"}


NO_GAPS: FloatArray = np.empty((0, 3))


def panel(ratios: tuple[float, float, float], *, title: str = "one") -> CoveragePanel:
    """Return three straight runs, each with one ratio."""
    x = np.linspace(2.0, 38.0, 50)
    places = np.concatenate([np.column_stack([x, np.full(50, y), np.zeros(50)]) for y in (8.0, 15.0, 22.0)])
    return CoveragePanel(title, "caption", places, np.array([0, 50, 100, 150]), np.repeat(ratios, 50), NO_GAPS)


def drawn(*panels: CoveragePanel) -> dict[str, bytes]:
    return paper_figures(plate(), panels, R_view_work=np.eye(3), spacing=6.0)


@cache
def even() -> dict[str, bytes]:
    """Return the figures of one panel whose runs are all as far apart as wanted."""
    return drawn(panel((1.0, 1.0, 1.0), title="backend 0 of $3"))


@cache
def side_by_side(count: int) -> dict[str, bytes]:
    """Return the figures of several panels."""
    return drawn(*(panel((0.9, 1.0, 1.1), title=f"backend {i} of $3") for i in range(count)))


@cache
def coloured() -> dict[str, bytes]:
    """Return the figures of one panel: the lowest run too close, the next too far, and the uppermost unmeasured."""
    return drawn(panel((0.8, 1.2, np.nan)))


def image(png: bytes) -> FloatArray:
    return np.asarray(imread(io.BytesIO(png)), dtype=np.float64)


@pytest.mark.parametrize("count", [1, 3])
def test_nothing_reaches_the_edge_of_the_figures(count: int) -> None:
    files = even() if count == 1 else side_by_side(count)
    assert set(files) == NAMES
    for name in ("spacing-map.png", "spacing-histogram.png"):
        found = image(files[name])
        for edge in (found[0], found[-1], found[:, 0], found[:, -1]):
            np.testing.assert_allclose(edge[:, :3], 1.0)


def test_the_bytes_of_the_figures_repeat() -> None:
    drawn_again = side_by_side.__wrapped__
    assert drawn_again(3) == side_by_side(3)


def test_an_svg_has_the_width_of_a_column_or_page_and_neither_date_nor_letters_that_a_machine_may_lack() -> None:
    alone, three = even(), side_by_side(3)
    for files, name, width in (
        (alone, "spacing-map.svg", 3.5), (three, "spacing-map.svg", 7.2), (three, "spacing-histogram.svg", 3.5),
    ):  # fmt: skip
        text = files[name].decode()
        found = re.search(r'<svg [^>]*width="([0-9.]+)pt"', text)
        assert found is not None
        assert float(found[1]) == pytest.approx(72 * width)
        assert "<dc:date>" not in text
        assert "<text" not in text


def test_a_run_of_one_shade_is_one_line_of_the_svg_and_a_change_of_shade_cuts_it() -> None:
    def lines(files: dict[str, bytes]) -> int:
        text = files["spacing-map.svg"].decode()
        return text.split('id="PolyCollection_1"')[1].split("</g>")[0].count("<path ")

    assert lines(even()) == 3
    # The middle run turns from exact to too far halfway.
    one, number = panel((1.0, 1.0, 1.0)), np.arange(150)
    assert lines(drawn(replace(one, ratios=np.where((number >= 75) & (number < 100), 1.1, 1.0)))) == 5


def test_the_map_shows_paths_too_close_red_too_far_blue_and_unmeasured_ones_grey() -> None:
    found = image(coloured()["spacing-map.png"])
    # Below the panel stands the colour scale, which is red and blue itself.
    part = found[: int(0.6 * len(found)), :, :3]
    red = (part[..., 0] > part[..., 2] + 0.2).any(axis=1)
    blue = (part[..., 2] > part[..., 0] + 0.2).any(axis=1)
    grey = (np.abs(part - 0x9A / 255) < 0.02).all(axis=2).sum(axis=1) > part.shape[1] // 2
    assert red.any()
    assert blue.any()
    assert grey.any()
    # The first run lies lowest.
    assert np.flatnonzero(red).min() > np.flatnonzero(blue).max() > np.flatnonzero(grey).max()


def test_the_histogram_of_even_paths_stands_in_one_bin_and_that_of_uneven_ones_does_not() -> None:
    def columns(files: dict[str, bytes]) -> int:
        pixels = image(files["spacing-histogram.png"])[250:, 250:, :3]
        line = (pixels[..., 0] > 0.7) & (pixels[..., 1] < 0.5) & (pixels[..., 2] < 0.3)
        return int(np.ptp(np.flatnonzero(line.any(axis=0))))

    assert 0 < columns(even()) < 40
    assert columns(coloured()) > 500
