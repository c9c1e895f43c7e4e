"""In a real browser the report draws, answers mouse and keyboard, asks for nothing and fits the screen."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from geoprint.report import html_report
from tests.report.browser import Page, opened_browser
from tests.report.report_cases import dome, part

HOSTILE = "</script><script>window.hacked=1</script><img src=x onerror='window.hacked=2'>\"&%{x}<b>"
# Share of pixels that differ when something else is drawn, and when nothing is.
CHANGED, SAME = 0.004, 0.001
STAGE, SLIDER, PLAY = ".stage", "#part0-time", ".play"
START_OVER = """(() => {
    document.activeElement.blur();
    const play = document.querySelector('.play');
    if (play.textContent === 'Pause') play.click();
    for (const input of document.querySelectorAll('.scene input')) {
        if (input.type === 'range') input.value = input.defaultValue; else input.checked = input.defaultChecked;
    }
    document.querySelector('.controls').dispatchEvent(new Event('change'));
    document.querySelector('.reset').click();
})()"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Page]:
    with opened_browser() as page:
        yield page


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_bytes(html_report([part(surface=dome(rings=12), names=("first", "second", "last"))], title="Dome"))
    return path


@pytest.fixture(scope="module", params=[1280, 390])
def loaded(request: pytest.FixtureRequest, browser: Page, report: Path) -> Page:
    """Load the page once for each width: the browser's time goes into reading plotly.js."""
    browser.resize(width=int(request.param))
    return opened(browser, report)


@pytest.fixture
def page(loaded: Page) -> Page:
    """Return the page with every control as it was when loaded."""
    loaded.run(START_OVER)
    return loaded


wide_only = pytest.mark.parametrize("loaded", [1280], indirect=True)
narrow_only = pytest.mark.parametrize("loaded", [390], indirect=True)


def opened(browser: Page, path: Path) -> Page:
    browser.forget()
    browser.open(path)
    browser.run("document.querySelector('.scene').scrollIntoView()")
    browser.wait_until("document.querySelector('.scene.live, .scene.failed') !== null")
    return browser


def difference(first: NDArray[np.float32], second: NDArray[np.float32]) -> float:
    """Return the share of pixels that differ visibly; 1 where the sizes differ."""
    if first.shape != second.shape:
        return 1.0
    return float((np.abs(first - second).max(axis=2) > 0.08).mean())


def settled(page: Page) -> NDArray[np.float32]:
    """Return the stage once two pictures in a row are equal."""
    before = page.picture(STAGE)
    for _ in range(40):
        after = page.picture(STAGE)
        if difference(before, after) < SAME:
            return after
        before = after
    raise AssertionError("the stage does not settle")


def changed(page: Page, before: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the stage once it differs from what it was."""
    for _ in range(40):
        after = page.picture(STAGE)
        if difference(before, after) > CHANGED:
            return settled(page)
    raise AssertionError("nothing else is drawn")


def restored(page: Page, before: NDArray[np.float32]) -> None:
    """Wait until the stage is what it was."""
    for _ in range(40):
        if difference(page.picture(STAGE), before) < SAME:
            return
    raise AssertionError("something else is drawn")


def coloured(picture: NDArray[np.float32]) -> float:
    """Return the share of pixels that are no grey; the colour bar below the scene does not count."""
    scene = picture[: 4 * len(picture) // 5]
    return float((np.ptp(scene, axis=2) > 0.1).mean())


def test_the_page_draws_without_error_or_request_and_fits(page: Page, report: Path) -> None:
    assert coloured(settled(page)) > CHANGED
    assert page.errors() == []
    assert page.requests() == [report.as_uri()]
    assert page.run("document.documentElement.scrollWidth <= window.innerWidth")
    assert page.run("document.querySelector('.scene').classList.contains('live')")
    # The plot fills its stage and no more.
    assert page.run(
        "['.plot', '.plot .main-svg'].every(name => Math.abs("
        "document.querySelector(name).clientHeight - document.querySelector('.stage').clientHeight) < 3)"
    )


@wide_only
def test_colours_and_backends_switch_by_mouse(page: Page) -> None:
    spacing = settled(page)
    page.click("[name=part0-colour][value=coverage]")
    coverage = changed(page, spacing)
    assert "Orange" in str(page.run("document.querySelector('.legend').textContent"))
    page.click("[name=part0-colour][value=distance]")
    assert difference(changed(page, coverage), spacing) > CHANGED
    page.click("[name=part0-colour][value=spacing]")
    page.click("[name=part0-backend][value='1']")
    assert difference(changed(page, coverage), spacing) > CHANGED
    page.click("[name=part0-paths]")
    assert not page.run("document.querySelector('[name=part0-paths]').checked")
    assert page.errors() == []


def test_colours_and_backends_switch_by_keyboard(page: Page) -> None:
    first = settled(page)
    page.focus("[name=part0-colour]")
    page.press("ArrowRight")
    assert page.run("document.activeElement.value") == "coverage"
    second = changed(page, first)
    page.focus("[name=part0-backend]")
    page.press("ArrowRight")
    changed(page, second)
    page.focus("[name=part0-paths]")
    page.press(" ")
    assert not page.run("document.querySelector('[name=part0-paths]').checked")
    # Where the focus is can be seen.
    assert page.run("getComputedStyle(document.activeElement).outlineStyle") == "solid"


@wide_only
def test_pointing_at_the_part_shows_value_and_place_in_the_file(page: Page) -> None:
    settled(page)
    page.point_at(".plot", across=0.5, down=0.45)
    page.wait_until("document.querySelector('.hovertext') !== null")
    said = str(page.run("document.querySelector('.hovertext').textContent"))
    assert "of the wanted one" in said
    assert "mm in the file" in said


@wide_only
def test_every_control_is_reached_by_the_tabulator(page: Page) -> None:
    page.focus("[name=part0-backend]")
    reached: list[str] = []
    for _ in range(12):
        reached.append(str(page.run("document.activeElement.name || document.activeElement.className")))
        page.press("Tab")
    text = " ".join(reached)
    for name in ("part0-backend", "part0-colour", "part0-frame", "part0-paths", "part0-robot", "reset", "plot", "play"):
        assert name in text


@wide_only
def test_arrow_keys_turn_the_part_and_home_brings_it_back(page: Page) -> None:
    straight = settled(page)
    page.focus(".plot")
    for _ in range(3):
        page.press("ArrowUp")
    turned = changed(page, straight)
    page.press("Home")
    assert difference(changed(page, turned), straight) < CHANGED


@narrow_only
def test_the_slider_moves_the_robot_and_the_deposit(page: Page) -> None:
    still = settled(page)
    page.focus("#part0-time")
    page.press("PageDown")
    moved = changed(page, still)
    assert "of 40.0 s, depositing" in str(page.run("document.querySelector('.player output').textContent"))
    for _ in range(5):
        page.press("PageDown")
    changed(page, moved)
    page.click("[name=part0-frame][value=robot]")
    changed(page, moved)
    assert page.errors() == []


@narrow_only
def test_play_runs_and_pauses_and_a_backend_without_a_robot_has_none(page: Page) -> None:
    settled(page)
    page.run("document.querySelector('.player select').value = '1'")
    page.focus(".play")
    page.press("Enter")
    page.wait_until("0 < Number(document.querySelector('#part0-time').value)")
    assert page.run("document.querySelector('.play').textContent") == "Pause"
    page.press("Enter")
    page.wait_until("document.querySelector('.play').textContent === 'Play'")
    page.click("[name=part0-backend][value='2']")
    assert page.run("document.querySelector('#part0-time').disabled")
    assert page.errors() == []


def seconds(page: Page) -> tuple[float, float]:
    """Return the replay's time and when it ends, as the page says them."""
    time, end = str(page.run("document.querySelector('.player output').textContent")).split(" s")[0].split(" of ")
    return float(time), float(end)


def played(page: Page, still: NDArray[np.float32]) -> None:
    """Play from the first moment to the last, with a pause between in which the stage is not the still one."""
    page.run("document.querySelector('.player select').value = '1'")
    page.focus(PLAY)
    page.press("Enter")
    page.wait_until(f"25 < Number(document.querySelector('{SLIDER}').value)")
    page.press("Enter")
    time, end = seconds(page)
    assert 0.0 < time < end
    changed(page, still)
    page.run("document.querySelector('.player select').value = '60'")
    page.press("Enter")
    page.wait_until(f"document.querySelector('{PLAY}').textContent === 'Play'")


@narrow_only
@pytest.mark.parametrize("frame", ["part", "robot"])
@pytest.mark.parametrize("backend", [0, 1])
def test_the_replay_plays_twice_and_can_be_dragged_to_both_ends(page: Page, frame: str, backend: int) -> None:
    page.click(f"[name=part0-backend][value='{backend}']")
    page.click(f"[name=part0-frame][value={frame}]")
    if frame == "part":
        page.click("[name=part0-robot]")
    last = settled(page)
    for _ in range(2):
        played(page, last)
        assert seconds(page) == (40.0, 40.0)
        restored(page, last)
    page.drag(SLIDER, to=-0.1)
    assert seconds(page) == (0.0, 40.0)
    changed(page, last)
    page.drag(SLIDER, to=1.1)
    assert seconds(page) == (40.0, 40.0)
    restored(page, last)
    assert page.errors() == []


@narrow_only
def test_the_robot_stays_where_it_is_when_the_window_changes_its_size(page: Page) -> None:
    page.click("[name=part0-frame][value=robot]")
    last = settled(page)
    page.drag(SLIDER, to=0.5)
    half = changed(page, last)
    for width in (600, 390):
        page.resize(width=width)
        page.wait_until(
            f"innerWidth === {width} && Math.abs(document.querySelector('.plot .main-svg').clientWidth"
            " - document.querySelector('.stage').clientWidth) < 3"
        )
    restored(page, half)
    assert page.errors() == []


def test_a_part_far_down_the_page_answers_before_it_is_drawn(browser: Page, tmp_path: Path) -> None:
    path = tmp_path / "two.html"
    path.write_bytes(html_report([part(surface=dome(rings=6)), part("other.ply", surface=dome(rings=6))], title="Two"))
    browser.resize(width=390)
    opened(browser, path)
    scene, time = "document.querySelector('#part1 .scene')", "Number(document.querySelector('#part1-time').value)"
    assert not browser.run(f"{scene}.classList.contains('live')")
    browser.run("document.querySelector('[name=part1-frame][value=robot]').click()")
    assert browser.run("document.querySelector('[name=part1-robot]').checked")
    browser.run(f"{scene}.querySelector('select').value = '1'")
    browser.run(f"{scene}.querySelector('.play').click()")
    browser.wait_until(f"0 < {time} && {time} < 1000")
    assert not browser.run(f"{scene}.classList.contains('live')")
    browser.run(f"{scene}.querySelector('select').value = '60'")
    browser.run(f"{scene}.scrollIntoView()")
    browser.wait_until(f"{scene}.classList.contains('live') && {time} === 1000")
    assert browser.errors() == []


def test_without_webgl_and_in_print_the_still_pictures_stand_in(browser: Page, report: Path) -> None:
    browser.resize(width=1280)
    shown = "getComputedStyle(document.querySelector('.still')).visibility"
    with browser.without_webgl():
        opened(browser, report)
        assert browser.run("document.querySelector('.scene').classList.contains('failed')")
        assert browser.run(shown) == "visible"
        assert "no 3D" in str(browser.run("document.querySelector('.status').textContent"))
    opened(browser, report)
    assert browser.run(shown) == "hidden"
    with browser.printed():
        assert browser.run(shown) == "visible"
        assert browser.run("getComputedStyle(document.querySelector('.plot')).display") == "none"
        assert browser.run("getComputedStyle(document.querySelector('.controls')).display") == "none"


def test_hostile_names_run_nothing(browser: Page, tmp_path: Path) -> None:
    path = tmp_path / "hostile.html"
    path.write_bytes(html_report([part(HOSTILE, surface=dome(rings=6), names=(HOSTILE, "second"))] * 2, title=HOSTILE))
    opened(browser, path)
    settled(browser)
    assert browser.run("window.hacked === undefined")
    assert browser.run("document.querySelector('h1').textContent") == HOSTILE
    assert browser.errors() == []
    assert browser.requests() == [path.as_uri()]
