"""Drawing on a part in the view: paths and figures follow, a plan is written, and the mouse does what it should."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from geoprint import job_of
from geoprint.geometry.files import save_ply
from geoprint.model import FloatArray
from geoprint.viewer.drawing import KEEP_OUT, POINT, Drawing
from geoprint.viewer.editor import EditView
from geoprint.viewer.page import address, served
from geoprint.workflow import Planner, check_bundle
from tests.commands import called
from tests.meshes import plate
from tests.reporting.browser import Page

DOWN = np.array([0.0, 0.0, -1.0])
PATIENCE = 120.0


@pytest.fixture
def view(tmp_path: Path) -> Generator[EditView]:
    pytest.importorskip("viser")
    save_ply(plate((30.0, 24.0), (30, 24)), tmp_path / "part.ply")
    job = job_of(surface=tmp_path / "part.ply", unit="mm", spacing=3.0, robot=False)
    drawing = Drawing(job, tmp_path / "drawn.toml")
    with served(8910, label="test") as server, closing(EditView(drawing, server)) as shown:
        rested(shown)
        yield shown


def rested(view: EditView) -> None:
    ends = time.monotonic() + PATIENCE
    while not view.at_rest:
        assert time.monotonic() < ends
        time.sleep(0.02)


def above(x: float, y: float) -> FloatArray:
    return np.array([x, y, 60.0])


@pytest.mark.needs("viser")
def test_a_click_draws_with_the_tool_and_the_figures_are_those_of_the_job(view: EditView) -> None:
    view.pick(above(9.0, 8.0), DOWN)
    assert view.drawing.items == ()
    view.choose(POINT)
    view.pick(above(9.0, 8.0), DOWN)
    view.pick(above(90.0, 8.0), DOWN)
    rested(view)
    assert view.drawing.items[0].places == ((9.0, 8.0, 0.0),)
    measured = Planner(view.drawing.job).figures(view.drawing.job)
    assert f"<b>{measured.toolpath.curves.count}</b>" in view.figures
    assert measured.uniformity is not None
    assert f"{100.0 * measured.uniformity.thickness.cv:.2f} %" in view.figures.replace("\xa0", " ")


@pytest.mark.needs("viser")
def test_what_is_dragged_is_kept_where_the_drag_ends(view: EditView) -> None:
    view.choose(POINT)
    view.pick(above(9.0, 8.0), DOWN)
    text = view.drawing.file.read_text()
    for x in (10.0, 11.0):
        view.drag(0, 0, above(x, 8.0), DOWN, ends=False)
    assert view.drawing.file.read_text() == text
    view.drag(0, 0, above(12.0, 8.0), DOWN, ends=True)
    assert view.drawing.items[0].places == ((12.0, 8.0, 0.0),)
    assert view.drawing.edits == 2
    assert view.drawing.file.read_text() != text


@pytest.mark.needs("viser")
def test_what_cannot_be_planned_is_said_and_mended_by_the_next_edit(view: EditView) -> None:
    view.choose(KEEP_OUT)
    for x, y in ((5.0, 5.0), (20.0, 15.0), (20.0, 5.0), (5.0, 15.0)):
        view.pick(above(x, y), DOWN)
    rested(view)
    assert "crosses itself" in view.message
    view.drawing.undo()
    view.pick(above(12.0, 3.0), DOWN)
    rested(view)
    assert "crosses itself" not in view.message


@pytest.mark.needs("viser")
def test_a_plan_is_written_checked_and_replayed_and_the_drawing_comes_back(view: EditView) -> None:
    view.drawing.change(robot=True, place="demo")
    view.plan()
    rested(view)
    folder = view.drawing.file.with_name("drawn-plan")
    assert f"written and verified: {folder}" in view.written
    assert not check_bundle(folder).findings
    view.replay(folder)
    assert view.replayed is not None
    assert view.replayed.end > 1.0
    view.draw_again()
    assert view.replayed is None
    rested(view)
    assert "runs" in view.figures
    assert view.replays == ["Replay drawn-plan"]


@pytest.mark.needs("viser")
def test_the_best_place_is_sought_for_the_plan_and_paths_are_shown_before(view: EditView) -> None:
    view.change(robot=True, place="best", margin=2.0)
    rested(view)
    assert "runs" in view.figures
    view.plan()
    rested(view)
    found = check_bundle(view.drawing.file.with_name("drawn-plan"))
    assert not found.findings
    assert view.drawing.job.place == "best"


@pytest.mark.needs("viser")
@pytest.mark.usefixtures("tmp_path")
def test_the_command_refuses_what_a_part_does_not_have(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    save_ply(plate((30.0, 24.0), (30, 24)), tmp_path / "part.ply")
    assert called(monkeypatch, "view", "part.ply", "--unit", "mm", "--line", 3) == 2
    assert "`--line` needs the folder of a plan, and part.ply is a file" in capsys.readouterr().err
    (tmp_path / "part.toml").write_text("surface = 'part.ply'\n")
    assert called(monkeypatch, "view", "part.ply", "--unit", "mm") == 2
    assert "`geoprint view part.toml` goes on with it" in capsys.readouterr().err
    assert called(monkeypatch, "view", ".", "--unit", "mm") == 2
    assert "options of a part go with a part or a job file" in capsys.readouterr().err


@pytest.mark.needs("viser")
def test_the_mouse_draws_a_place_and_drags_it(view: EditView, browser: Page) -> None:
    from selenium.webdriver import ActionChains

    browser.resize(width=1100, height=700)
    browser.forget()
    view.choose(POINT)
    browser.driver.get(address(view.server))
    browser.wait_until("document.querySelector('canvas') !== null")
    browser.wait_until("document.body.innerText.includes('Plan, check and write')")
    canvas = browser.driver.find_element("css selector", "canvas")
    ActionChains(browser.driver).move_to_element(canvas).perform()
    # The scene is drawn a while after the page stands; a click before hits nothing.
    followed(view, browser, lambda: ActionChains(browser.driver).click().perform())
    x, y, _ = view.drawing.items[0].places[0]
    assert (x, y) == (pytest.approx(15.0, abs=1.5), pytest.approx(12.0, abs=1.5))
    rested(view)
    drag = ActionChains(browser.driver).click_and_hold()
    for _ in range(8):
        drag = drag.move_by_offset(10, 0).pause(0.15)
    drag = drag.release()
    followed(view, browser, drag.perform)
    moved_x, moved_y, _ = view.drawing.items[0].places[0]
    assert moved_x - x > 1.0
    assert moved_y == pytest.approx(y, abs=1.0)
    # Of the camera's controls, which any drag over a scene of viser calls forth.
    assert [each for each in browser.errors() if "passive event listener" not in each] == []


def followed(view: EditView, browser: Page, act: Callable[[], object]) -> None:
    """Act with the mouse until the drawing has followed."""
    edits, ends = view.drawing.edits, time.monotonic() + PATIENCE
    while view.drawing.edits == edits:
        assert time.monotonic() < ends
        act()
        for _ in range(40):
            browser.run("1")
            time.sleep(0.05)
            if view.drawing.edits != edits:
                break
