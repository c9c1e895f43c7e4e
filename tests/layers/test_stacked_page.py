"""The page of a stack: complete in itself, the same again, and its layers are laid by a slider."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.layers.slice_figure import bead_outlines, seams_figure, sliced_figure
from geoprint.layers.slices import Slice
from geoprint.reporting.figures import png_bytes
from geoprint.reporting.thickness_page import thickness_figure, thickness_report, thickness_scene_data
from tests.layers.stack_cases import LAYERS, RADII, compared_stacks, flow, paths, stack
from tests.reporting.browser import Page
from tests.reporting.report_cases import circles, dome
from tests.reporting.test_browser import CHANGED, HOSTILE, changed, coloured, settled
from tests.reporting.test_report_page import Reader

SLIDER = "[name=part0-layers]"


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("stack") / "report.html"
    path.write_bytes(thickness_report(stack(HOSTILE), title=HOSTILE))
    return path


def opened(browser: Page, path: Path, *, width: int) -> Page:
    browser.resize(width=width, height=900)
    browser.forget()
    browser.open(path)
    browser.wait_until("document.querySelector('.scene.live, .scene.failed') !== null")
    return browser


def slid(page: Page, layers: int) -> None:
    page.run(
        f"(() => {{ const one = document.querySelector('{SLIDER}'); one.value = {layers};"
        " one.dispatchEvent(new Event('input')); })()"
    )


def test_the_page_is_the_same_again_and_says_what_it_was_given() -> None:
    page = thickness_report(stack(), title="A stack")
    assert page == thickness_report(stack(), title="A stack")
    text = " ".join(Reader(page).text.split())
    for said in (
        "Finished thickness varies by 1 %.",
        "Layer by layer",
        "Not checked: hoses.",
        "A cut",
        "90 % of the area",
    ):
        assert said in text
    assert "Empty" not in text


def test_the_layers_of_the_scene_end_where_their_runs_do() -> None:
    data = json.loads(json.dumps(thickness_scene_data(stack())))
    # Five circles of 120 points a layer, a break between two.
    assert data["layers"] == [5 * 120 + 4, 10 * 120 + 9, 15 * 120 + 14]


@pytest.fixture(scope="module", params=[1440, 390])
def loaded(request: pytest.FixtureRequest, browser: Page, report: Path) -> Page:
    """Load the page once for each width: the browser's time goes into reading plotly.js."""
    return opened(browser, report, width=request.param)


def test_it_draws_offline_without_error_and_fits(loaded: Page, report: Path) -> None:
    assert coloured(settled(loaded)) > CHANGED
    assert loaded.errors() == []
    assert loaded.requests() == [report.as_uri()]
    assert loaded.run("window.hacked === undefined")
    assert loaded.run("document.documentElement.scrollWidth <= window.innerWidth")


@pytest.mark.parametrize("loaded", [1440], indirect=True)
def test_layers_are_laid_one_upon_another_by_the_slider(loaded: Page) -> None:
    page = loaded
    seen = settled(page)
    assert page.run("document.querySelector('output.layers').textContent") == "none"
    for layers in range(1, LAYERS + 1):
        slid(page, layers)
        seen = changed(page, seen)
        assert page.run("document.querySelector('output.layers').textContent") == f"{layers} of {LAYERS}"
        places = page.run("document.querySelector('.plot').data[1].z.length")
        assert places == 5 * 120 * layers + 5 * layers - 1
    # The uppermost stands within the axes, 2 mm over the part.
    low, high = np.array(page.run("document.querySelector('.plot')._fullLayout.scene.zaxis.range"), dtype=np.float64)
    z = np.array(
        page.run("[...document.querySelector('.plot').data[1].z].filter((one) => !isNaN(one))"), dtype=np.float64
    )
    assert low < z.min() < z.max() < high
    assert page.errors() == []


@pytest.mark.parametrize("loaded", [390], indirect=True)
def test_where_there_is_room_for_one_flow_it_is_the_printed_one_and_so_when_it_is_opened_again(
    loaded: Page, report: Path
) -> None:
    one = "document.querySelectorAll('.view:not([hidden])').length"
    which = "document.querySelector('.view:not([hidden]) em').textContent"
    assert (loaded.run(one), loaded.run(which)) == (1, "printed")
    again = opened(loaded, report, width=390)
    assert coloured(settled(again)) > CHANGED
    assert again.errors() == []
    assert again.requests() == [report.as_uri()]
    assert (again.run(one), again.run(which)) == (1, "printed")


def test_compared_stacks_each_have_their_own_paths_and_page(browser: Page, tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    path.write_bytes(thickness_report(compared_stacks(), title="Two"))
    page = opened(browser, path, width=1440)
    seen = settled(page)
    slid(page, 2)
    changed(page, seen)
    drawn = page.run("[...document.querySelectorAll('.plot')].map((one) => one.data[1].z.length)")
    assert drawn == [2 * 5 * 120 + 9, 2 * 2 * 120 + 3]
    assert page.run("document.querySelector('.view:not([hidden]) em').textContent") == "best"
    links = page.run("[...document.querySelectorAll('a')].map((one) => one.getAttribute('href'))")
    assert links == ["heat/report.html", "lscm/report.html"]
    assert page.errors() == []


def test_a_page_that_does_not_fit_together_is_refused() -> None:
    with pytest.raises(InputError, match="each layer needs a run"):
        replace(paths(RADII), layers=np.array([5, 5, 15]))
    with pytest.raises(InputError, match="give one set of paths"):
        replace(stack(), paths=())
    with pytest.raises(InputError, match="values for"):
        replace(stack(), flows=(replace(flow("some", error=0.1), thickness=np.ones(3)),))
    with pytest.raises(InputError, match="needs at least one flow"):
        replace(stack(), flows=())


def test_beads_are_as_wide_and_as_high_as_they_are_and_lie_along_their_layer() -> None:
    turn = np.array([np.cos(0.3), np.sin(0.3)])
    found = bead_outlines(np.array([[1.0, 2.0]]), turn[None], np.array([0.8]), height=0.4)[0] - [1.0, 2.0]
    along, up = found @ turn, found @ [-turn[1], turn[0]]
    assert (np.ptp(along), np.ptp(up)) == pytest.approx((0.8, 0.4))


def test_figures_are_the_same_again_and_differ_where_what_is_drawn_does() -> None:
    line = np.column_stack([np.linspace(0.0, 10.0, 30), np.zeros(30)])
    beads = np.column_stack([np.linspace(0.5, 9.5, 10), np.full(10, 0.2)])
    offsets = np.array([0, 30])
    layer = Slice(line + np.array([0.0, 0.2]), offsets, beads, np.tile([1.0, 0.0], (10, 1)), np.ones(10))
    narrower = replace(layer, widths=np.full(10, 0.5))
    drawn, same, other = (
        png_bytes(sliced_figure((line, offsets), [each], [0.4], title="cut")) for each in (layer, layer, narrower)
    )
    assert drawn == same != other
    surface, starts = dome(rings=12), circles([15.0], points=8)[0]
    maps = [
        thickness_figure(surface, flow("", error=error).thickness, R_view_work=np.eye(3), title="some")
        for error in (0.0, 0.1)
    ]
    assert maps[0] != maps[1]
    seams = [seams_figure(surface, count * [starts], R_view_work=np.eye(3), title="some") for count in (1, 2, 2)]
    assert seams[0] != seams[1] == seams[2]
