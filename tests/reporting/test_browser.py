"""In a real browser the report draws, answers mouse and keyboard, asks for nothing and fits the screen."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from geoprint.reporting import html_report
from tests.reporting.browser import Page
from tests.reporting.report_cases import HEIGHT, RADIUS, dome, part, tilting_part

HOSTILE = "</script><script>window.hacked=1</script><img src=x onerror='window.hacked=2'>\"&%{x}<b>"
# Share of pixels that differ when something else is drawn, and when nothing is.
CHANGED, SAME = 0.004, 0.001
STAGE, SECOND, SLIDER, PLAY = ".view:not([hidden]) .stage", ".view:nth-child(2) .stage", "#part0-time", ".play"
# How long the replay of the cases takes [s].
SECONDS = 4.0
START_OVER = """(() => {
    document.activeElement.blur();
    const play = document.querySelector('.play');
    if (play.textContent === 'Pause') play.click();
    for (const input of document.querySelectorAll('.scene input')) {
        if (input.type === 'range') {
            input.value = input.max;
            input.dispatchEvent(new Event('input'));
        } else input.checked = input.defaultChecked;
    }
    if (innerWidth < 640) document.querySelector('[name=part0-backend][value="0"]').checked = true;
    document.querySelector('.controls').dispatchEvent(new Event('change'));
    document.querySelector('.reset').click();
})()"""


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_bytes(
        html_report([part(surface=dome(rings=12), names=("first", "second", "last"), seconds=SECONDS)], title="Dome")
    )
    return path


@pytest.fixture(scope="module", params=[(1440, 900), (390, 844)])
def loaded(request: pytest.FixtureRequest, browser: Page, report: Path) -> Page:
    """Load the page once for each width: the browser's time goes into reading plotly.js."""
    width, height = request.param
    browser.resize(width=int(width), height=int(height))
    return opened(browser, report)


@pytest.fixture
def page(loaded: Page) -> Page:
    """Return the page with every control as it was when loaded."""
    loaded.run(START_OVER)
    return loaded


wide_only = pytest.mark.parametrize("loaded", [(1440, 900)], indirect=True)
narrow_only = pytest.mark.parametrize("loaded", [(390, 844)], indirect=True)


def opened(browser: Page, path: Path) -> Page:
    browser.forget()
    browser.open(path)
    browser.wait_until("document.querySelector('.scene.live, .scene.failed') !== null")
    return browser


def inside(page: Page, selector: str) -> bool:
    """Return whether all of an element is on the screen, without scrolling."""
    return bool(
        page.run(
            f"(() => {{ const b = document.querySelector({selector!r}).getBoundingClientRect(); return b.width > 100"
            " && b.top >= 0 && b.bottom <= innerHeight && b.left >= 0 && b.right <= innerWidth; })()"
        )
    )


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
    """Return the share of pixels that are no grey."""
    return float((np.ptp(picture, axis=2) > 0.1).mean())


def test_the_page_draws_without_error_or_request_and_fits(page: Page, report: Path) -> None:
    assert coloured(settled(page)) > CHANGED
    assert page.errors() == []
    assert page.requests() == [report.as_uri()]
    assert page.run("document.documentElement.scrollWidth <= window.innerWidth")
    # The plot fills its stage and no more.
    assert page.run(
        f"['.plot', '.plot .main-svg'].every(name => Math.abs(document.querySelector('{STAGE}').querySelector(name)"
        f".clientHeight - document.querySelector('{STAGE}').clientHeight) < 3)"
    )


@wide_only
def test_verdict_and_all_backends_are_seen_without_scrolling(page: Page) -> None:
    assert page.run("scrollY") == 0
    for place in (1, 2, 3):
        assert inside(page, f".view:nth-child({place}) .stage")
    assert (
        page.run("new Set([...document.querySelectorAll('.stage')].map((one) => one.getBoundingClientRect().y)).size")
        == 1
    )
    assert inside(page, ".verdict")


@narrow_only
def test_where_there_is_room_for_one_it_is_the_best(loaded: Page) -> None:
    assert inside(loaded, ".verdict")
    assert inside(loaded, ".view.best .stage")
    assert loaded.run("document.querySelectorAll('.view:not([hidden])').length") == 1


@wide_only
def test_what_decides_stands_above_what_else_is_known(page: Page) -> None:
    order = "[...document.querySelectorAll('.verdict, .stage, .deciding, .cautions, .comparison:not(.deciding)')]"
    found = page.run(f"{order}.map((one) => one.className)")
    assert found == ["verdict", *3 * ["stage"], "comparison deciding", "cautions", "comparison"]


@wide_only
def test_colours_and_backends_switch_by_mouse(page: Page) -> None:
    spacing = settled(page)
    page.click("[name=part0-colour][value=coverage]")
    coverage = changed(page, spacing)
    assert "Orange" in str(page.run("document.querySelector('.legend').textContent"))
    page.click("[name=part0-colour][value=distance]")
    assert difference(changed(page, coverage), spacing) > CHANGED
    spaced = settled(page)
    page.click("[name=part0-colour][value=overhang]")
    overhanging = changed(page, spaced)
    assert "overhangs as the part stands" in str(page.run("document.querySelector('.legend').textContent"))
    page.click("[name=part0-colour][value=lean]")
    leaning = changed(page, overhanging)
    assert "8.0" in str(page.run("document.querySelector('.ticks').textContent"))
    page.click("[name=part0-colour][value=beads]")
    beads = changed(page, leaning)
    # Across each bead, from its left side to its right, as far as it is wide.
    corners = "['x', 'y', 'z'].map((axis) => [0, 6].map((at) => document.querySelector('.plot').data[1][axis][at]))"
    assert np.linalg.norm(np.diff(np.asarray(page.run(corners)), axis=1)) == pytest.approx(2.0, abs=0.01)
    page.click("[name=part0-colour][value=speed]")
    changed(page, beads)
    page.click("[name=part0-backend][value='1']")
    assert page.run("document.querySelectorAll('.view:not([hidden])').length") == 1
    page.click("[name=part0-paths]")
    page.click("[name=part0-backend][value=all]")
    page.wait_until("document.querySelectorAll('.view.live').length === 3")
    assert page.errors() == []


def test_colours_and_backends_switch_by_keyboard(page: Page) -> None:
    first = settled(page)
    page.focus("[name=part0-colour]")
    page.press("ArrowRight")
    assert page.run("document.activeElement.value") == "coverage"
    second = changed(page, first)
    page.focus("[name=part0-backend]:checked")
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
    page.point_at(".plot", across=0.5, down=0.5)
    page.wait_until("document.querySelector('.pointed').textContent !== ''")
    said = str(page.run("document.querySelector('.pointed').textContent"))
    assert "of the wanted one; x " in said
    assert "mm in the file" in said
    # The middle of the dome is under the middle of its plot.
    places = [float(word.split()[1]) for word in said.split("; ")[1].removesuffix(" mm in the file").split(", ")]
    radius = float(np.hypot(places[0], places[1]))
    assert radius < RADIUS / 2
    assert places[2] == pytest.approx(HEIGHT * (1 - radius**2 / RADIUS**2), abs=0.02)


@wide_only
def test_every_control_is_reached_by_the_tabulator(page: Page) -> None:
    page.focus(".plot")
    reached: list[str] = []
    for _ in range(13):
        reached.append(str(page.run("document.activeElement.name || document.activeElement.className")))
        page.press("Tab")
    text = " ".join(reached)
    for name in ("part0-backend", "part0-colour", "part0-frame", "part0-paths", "part0-robot", "reset", "plot", "play"):
        assert name in text


@wide_only
def test_views_turn_together_by_keys_and_mouse(page: Page) -> None:
    straight, other = settled(page), page.picture(SECOND)
    page.focus(".plot")
    for _ in range(3):
        page.press("ArrowUp")
    turned = changed(page, straight)
    assert difference(page.picture(SECOND), other) > CHANGED
    page.press("Home")
    assert difference(changed(page, turned), straight) < CHANGED
    page.turn(".view:nth-child(2) .plot", by=0.3)
    changed(page, straight)
    page.wait_until(
        "(() => { const [a, b] = [...document.querySelectorAll('.plot')].map((one) => one._fullLayout.scene._scene"
        ".getCamera().eye); return Math.hypot(a.x - b.x, a.y - b.y, a.z - b.z) < 1e-3 })()"
    )
    page.click(".reset")
    restored(page, straight)
    assert page.errors() == []


def seconds(page: Page) -> tuple[float, float]:
    """Return the replay's time and when it ends, as the page says them."""
    time, end = str(page.run("document.querySelector('.player output').textContent")).split(" s")[0].split(" of ")
    return float(time), float(end)


@narrow_only
def test_the_robot_is_where_its_joints_say_and_its_speed_and_valve_are_shown(page: Page) -> None:
    still = settled(page)
    page.click("[name=part0-frame][value=robot]")
    last = changed(page, still)
    # The tool hangs below the end of the arm, over the middle of the dome.
    middle = "(() => { const t = document.querySelector('.plot').data[7]; return [t.x, t.y, t.z].map("
    middle += "(row) => row.reduce((sum, each) => sum + each, 0) / row.length) })()"
    height = 25.0 - 3.0
    np.testing.assert_allclose(np.array(page.run(middle)), [0.0, 0.0, height], atol=0.01)
    page.drag(SLIDER, to=-0.1)
    changed(page, last)
    # A quarter turn about the post's axis, 60 mm away.
    np.testing.assert_allclose(np.array(page.run(middle)), [-60.0, 60.0, height], atol=0.01)
    assert page.run("document.querySelector('.moving').textContent") == "run 0 of 5 · 20 mm/s · valve shut"
    page.drag(SLIDER, to=0.5)
    assert seconds(page)[0] == pytest.approx(0.5 * SECONDS, abs=0.1)
    assert page.run("document.querySelector('.moving').textContent") == "run 3 of 5 · 20 mm/s · valve open · lamp on"
    assert page.errors() == []


@narrow_only
def test_a_backend_without_a_robot_plays_nothing(page: Page) -> None:
    page.click("[name=part0-backend][value='2']")
    assert page.run(f"document.querySelector('{SLIDER}').disabled")
    assert page.run("document.querySelector('.player output').textContent") == "not printable"
    assert page.errors() == []


def played(page: Page, *, speed: int) -> None:
    """Play from the first moment to the last; at real speed with a pause, and while what is shown changes."""
    page.run(f"document.querySelector('.player select').value = '{speed}'")
    page.focus(PLAY)
    page.press("Enter")
    if speed == 1:
        page.wait_until(f"20 < Number(document.querySelector('{SLIDER}').value)")
        page.press("Enter")
        assert page.run(f"document.querySelector('{PLAY}').textContent") == "Play"
        assert 0.0 < seconds(page)[0] < SECONDS
        page.press("Enter")
        seen = [page.picture(STAGE)]
        for control in ("colour][value=coverage", "paths", "colour][value=spacing", "paths"):
            page.run(f"document.querySelector('[name=part0-{control}]').click()")
            seen.append(page.picture(STAGE))
        assert all(difference(one, other) > SAME for one, other in pairwise(seen))
    page.wait_until(f"document.querySelector('{PLAY}').textContent === 'Play'")
    assert seconds(page) == (SECONDS, SECONDS)


@wide_only
def test_side_by_side_the_replays_run_together(page: Page) -> None:
    page.run("document.querySelector('[name=part0-robot]').click()")
    page.drag(SLIDER, to=0.3)
    before, other = settled(page), page.picture(SECOND)
    said = "[...document.querySelectorAll('.moving')].map((one) => one.textContent)"
    assert page.run(said) == [*2 * ["run 2 of 5 · 20 mm/s · valve open · lamp on"], "not printable"]
    page.run(f"document.querySelector('{PLAY}').click()")
    page.wait_until(f"document.querySelector('{PLAY}').textContent === 'Play'")
    assert seconds(page) == (SECONDS, SECONDS)
    changed(page, before)
    assert difference(page.picture(SECOND), other) > CHANGED
    assert page.errors() == []


@narrow_only
@pytest.mark.parametrize("frame", ["part", "robot"])
def test_the_replay_plays_through_at_every_speed_and_again_while_controls_change(page: Page, frame: str) -> None:
    page.run(f"document.querySelector('[name=part0-frame][value={frame}]').click()")
    page.run("(() => { const box = document.querySelector('[name=part0-robot]'); if (!box.checked) box.click() })()")
    last = settled(page)
    # At real speed once: what is in the way of the controls then is so in either frame.
    for speed in (1, 5, 50) if frame == "robot" else (5, 50):
        played(page, speed=speed)
        restored(page, last)
    page.drag(SLIDER, to=-0.1)
    assert seconds(page) == (0.0, SECONDS)
    changed(page, last)
    page.drag(SLIDER, to=1.1)
    restored(page, last)
    assert page.errors() == []


def box_of(page: Page, trace: int) -> NDArray[np.float64]:
    """Return (3, 2) the lowest and highest x, y and z of what a trace draws."""
    rows = f"(() => {{ const t = document.querySelector('.plot').data[{trace}]; return [t.x, t.y, t.z].map("
    found = page.run(rows + "(row) => [Math.min(...row), Math.max(...row)]) })()")
    return np.array(found, dtype=np.float64)


@pytest.fixture(scope="module")
def tilting(browser: Page, tmp_path_factory: pytest.TempPathFactory) -> Page:
    """The page of the dome over a table, with the robot shown."""
    path = tmp_path_factory.mktemp("tilting") / "tilting.html"
    path.write_bytes(html_report([tilting_part(seconds=SECONDS)], title="Tilting"))
    browser.resize(width=390, height=844)
    page = opened(browser, path)
    page.run("document.querySelector('[name=part0-robot]').click()")
    return page


def test_part_and_table_move_along_while_the_table_does(tilting: Page) -> None:
    page, one = tilting, tilting_part(seconds=SECONDS)
    moving = one.backends[0].replay
    assert moving is not None
    assert moving.table is not None
    assert one.machine is not None
    (block,) = (body.surface.vertices for body in one.machine.bodies if body.kind == "table")
    words = (("0.02", 1), ("0.05", 1), ("0.08", 1), ("0.52", 2), ("0.57", 2))
    for share, number in (*words, *words[::-1]):
        page.drag(SLIDER, to=float(share))
        settled(page)
        said = str(page.run("document.querySelector('.moving').textContent"))
        assert said.startswith(f"table moves to attitude {number} of 2 · run")
        time = float(
            str(page.run(f"(() => {{ const s = document.querySelector('{SLIDER}'); return s.value / s.max }})()"))
        )
        entries = [np.interp(time * SECONDS, moving.table.times, each) for each in moving.table.part.reshape(-1, 12).T]
        motion = np.reshape(entries, (3, 4))
        for trace, vertices in ((0, one.surface.vertices), (8, block)):
            # What is shown has the middle of the dome's box as its origin.
            places = vertices @ motion[:, :3].T + motion[:, 3] - [0.0, 0.0, HEIGHT / 2.0]
            wanted = np.column_stack([places.min(axis=0), places.max(axis=0)])
            np.testing.assert_allclose(box_of(page, trace), wanted, atol=0.02)
    assert page.errors() == []


def test_part_and_table_stand_in_each_attitude_as_long_as_it_is_printed(tilting: Page) -> None:
    page = tilting
    # Seen from the middle of the dome's box, and the middle of the block under it.
    low, high = -HEIGHT / 2.0, HEIGHT / 2.0
    rest = np.array([[-RADIUS, RADIUS], [-RADIUS, RADIUS], [low, high]]), [0.0, 0.0, low - 15.0]
    turned = np.array([[-RADIUS, RADIUS], [2.0 * low, 0.0], [low - RADIUS, low + RADIUS]]), [0.0, 15.0, low]
    lifted = np.array([[-RADIUS, RADIUS], [-RADIUS, RADIUS], [low + 30.0, high + 30.0]]), [0.0, 0.0, low + 15.0]
    for share, words, (dome_box, block) in ((0.3, "attitude 1 of 2", turned), (0.8, "attitude 2 of 2", lifted)):
        page.drag(SLIDER, to=share)
        settled(page)
        assert str(page.run("document.querySelector('.moving').textContent")).startswith(f"{words} · run")
        np.testing.assert_allclose(box_of(page, 0), dome_box, atol=0.01)
        np.testing.assert_allclose(box_of(page, 8).mean(axis=1), block, atol=0.01)
    for _ in range(2):
        page.run("document.querySelector('.player select').value = '5'")
        page.run(f"document.querySelector('{PLAY}').click()")
        page.wait_until(f"document.querySelector('{PLAY}').textContent === 'Play'")
        assert seconds(page) == (SECONDS, SECONDS)
        np.testing.assert_allclose(box_of(page, 0), lifted[0], atol=0.01)
    page.run("document.querySelector('[name=part0-robot]').click()")
    settled(page)
    np.testing.assert_allclose(box_of(page, 0), rest[0], atol=0.01)
    assert page.errors() == []


@narrow_only
def test_the_robot_stays_where_it_is_when_the_window_changes_its_size(page: Page) -> None:
    page.click("[name=part0-frame][value=robot]")
    last = settled(page)
    page.drag(SLIDER, to=0.5)
    half = changed(page, last)
    for width in (600, 390):
        page.resize(width=width, height=844)
        page.wait_until(
            f"innerWidth === {width} && Math.abs(document.querySelector('.plot .main-svg').clientWidth"
            " - document.querySelector('.stage').clientWidth) < 3"
        )
    restored(page, half)
    assert page.errors() == []


@wide_only
def test_in_the_dark_page_and_scenes_are_dark_and_paper_stays_light(page: Page) -> None:
    light = settled(page)
    assert np.median(light) > 0.9
    with page.dark():
        dark = changed(page, light)
        assert np.median(dark) < 0.2
        assert page.run("getComputedStyle(document.body).backgroundColor") == "rgb(18, 23, 28)"
        # The part keeps the colours of its scale.
        assert coloured(dark) > 0.5 * coloured(light)
    restored(page, light)
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
    browser.run(f"{scene}.querySelector('select').value = '50'")
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
