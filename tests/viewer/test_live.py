"""The view itself: what it shows at a moment, what a picked point is, who can reach it, and what it writes."""

from __future__ import annotations

import re
import socket
from collections.abc import Generator
from contextlib import closing, contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from geoprint.errors import UsageError
from geoprint.geometry import prepare
from geoprint.model import FloatArray, Surface
from geoprint.reporting.colouring import coverage_scale, overhang_scale, thickness_scale
from geoprint.reporting.replaying import replay
from geoprint.viewer import capture, load_viewed, notebook_scene
from geoprint.viewer.live import LiveView
from geoprint.viewer.page import Plot, address, plot_html, scale_html, served
from geoprint.viewer.scene import PlanScene, mean_curvature, quantities, scale_of
from tests.commands import called
from tests.meshes import plate, spherical_cap
from tests.reporting.browser import Page
from tests.shared_plans import SharedPlans
from tests.workflow.test_checking import shared_bundle
from tests.workflow.test_printing import bundle_of_the_arch, plan_of_the_arch


@pytest.fixture(scope="module")
def bundle(shared_plans: SharedPlans) -> Path:
    return shared_bundle(shared_plans)


@pytest.fixture(scope="module")
def view(bundle: Path) -> Generator[LiveView]:
    pytest.importorskip("viser")
    with served(8900, label="test") as server, closing(LiveView(load_viewed(bundle), server)) as shown:
        shown.complete()
        yield shown


@pytest.mark.needs("viser")
def test_only_this_machine_reaches_the_page(view: LiveView) -> None:
    port = view.server.get_port()
    with socket.create_connection(("127.0.0.1", port), timeout=5.0):
        pass
    listening = [
        line.split()[1] for line in Path("/proc/net/tcp").read_text("ascii").splitlines()[1:] if line.split()[3] == "0A"
    ]
    hosts = {address.split(":")[0] for address in listening if int(address.split(":")[1], 16) == port}
    assert hosts == {"0100007F"}


@pytest.mark.needs("viser")
def test_a_click_on_the_part_says_what_is_there_and_goes_there_in_time(view: LiveView) -> None:
    (scene,) = view.scenes
    (motion,) = scene.plan.motions
    pose = int(np.flatnonzero(scene.plan.poses.deposit)[40])
    place, normal = scene.plan.poses.surface_points[pose], scene.plan.poses.normals[pose]
    view.pick(place + 50.0 * normal, -normal)
    said = view.picked
    assert f"run {scene.plan.poses.runs[pose] + 1}," in said
    assert "of the wanted one" in said
    line = motion.line_of(motion.target(float(motion.pose_times[pose])))
    assert f"`{line}`" in said
    assert view.moment == pytest.approx(float(motion.pose_times[pose]), abs=0.002)
    view.pick(place + 50.0 * normal, normal)
    assert view.picked == said


@pytest.mark.needs("viser")
def test_a_line_leads_to_the_moment_of_its_move(view: LiveView) -> None:
    (motion,) = view.scenes[0].plan.motions
    place = motion.line_of(12)
    assert place is not None
    view.go_to_line(int(place.split(":")[1]))
    assert view.moment == pytest.approx(float(motion.orders.times[12]), abs=0.001)
    with pytest.raises(UsageError, match=r"`--line 1000000`: no move of the program stands there or behind it\."):
        view.go_to_line(1_000_000)


@pytest.mark.needs("viser")
def test_every_quantity_colours_the_part(view: LiveView) -> None:
    (scene,) = view.scenes
    for heading, key in quantities(scene.plan).items():
        scale, values = scale_of([scene], key), scene.values(key)
        assert scale.heading == heading
        assert values.shape == (len(scene.plan.surface.vertices),)
        assert np.isfinite(values).all()
        assert scale.title in scale_html(scale)


def test_plans_that_stand_side_by_side_have_one_scale() -> None:
    def shown(half: float) -> PlanScene:
        def values(_: str) -> FloatArray:
            return np.array([1.0 - half, 1.0 + half])

        return cast("PlanScene", SimpleNamespace(plan=None, values=values))

    both = [shown(0.1), shown(0.5)]
    assert scale_of(both, "thickness") == scale_of(both[::-1], "thickness")
    assert scale_of(both, "thickness").high >= 1.5 > scale_of(both[:1], "thickness").high


@pytest.mark.needs("viser", "cv2")
def test_a_film_has_its_frames_and_a_picture_its_pixels(
    view: LiveView, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import cv2

    drawn: list[float] = []

    @contextmanager
    def browser(_: LiveView) -> Generator[SimpleNamespace]:
        def render(height: int, width: int, **_: object) -> np.ndarray:
            drawn.append(view.moment)
            return np.full((height, width, 3), [200, 30, 40], dtype=np.uint8)

        yield SimpleNamespace(get_render=render)

    monkeypatch.setattr(capture, "browser", browser)
    monkeypatch.setattr(capture, "FILM_FRAMES", 12)
    capture.save_film(view, tmp_path / "film.mp4")
    assert drawn == sorted(drawn)
    assert (drawn[0], drawn[-1]) == (0.0, pytest.approx(view.end, abs=0.001))
    film = cv2.VideoCapture(str(tmp_path / "film.mp4"))
    assert int(film.get(cv2.CAP_PROP_FRAME_COUNT)) == capture.FILM_FRAMES
    _, frame = film.read()
    np.testing.assert_allclose(frame[10, 10], [40, 30, 200], atol=12)
    capture.save_still(view.server, tmp_path / "still.png")
    still = cv2.imread(str(tmp_path / "still.png"))
    assert still is not None
    assert still.shape == (capture.HEIGHT, capture.WIDTH, 3)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["film.mp4", "still.png"]


@pytest.mark.needs("viser")
def test_files_of_other_kinds_are_refused_before_anything_is_drawn(view: LiveView, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"name a file that ends in \.png"):
        capture.save_still(view.server, tmp_path / "still.jpg")
    with pytest.raises(UsageError, match=r"name a file that ends in \.mp4"):
        capture.save_film(view, tmp_path / "film.gif")
    with pytest.raises(UsageError, match=r"name a file that ends in \.html"):
        capture.save_page(view.server, tmp_path / "page.txt")


@pytest.mark.needs("viser")
def test_the_page_in_a_browser_shows_the_part_and_a_click_in_a_plot_moves_the_arm(
    view: LiveView, browser: Page
) -> None:
    browser.resize(width=1100, height=700)
    browser.forget()
    browser.driver.get(address(view.server))
    browser.wait_until("document.querySelectorAll('.geoprint-plot svg').length === 3")
    browser.wait_until("document.querySelector('canvas') !== null")
    view.go_to_line(1)
    before = view.moment
    browser.run(
        "(() => { const plot = document.querySelector('.geoprint-plot svg'); plot.scrollIntoView();"
        " const box = plot.getBoundingClientRect(); plot.dispatchEvent(new MouseEvent('click',"
        " { bubbles: true, clientX: box.x + 0.8 * box.width })); })()"
    )
    browser.wait_until("true")
    for _ in range(100):
        if view.moment != before:
            break
        browser.run("1")
    assert view.moment == pytest.approx((0.8 * 300 - 34) / 262 * view.end, rel=0.02)
    assert browser.errors() == []
    addresses = {re.sub(r"^(\w+://[^/]+)/.*", r"\1", each) for each in browser.requests()}
    assert addresses <= {address(view.server), address(view.server).replace("http", "ws")}


def test_without_viser_the_command_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "viser", None)
    with (
        pytest.raises(UsageError, match=r"the live view needs the package viser, .*\[view\]'`"),
        served(8901, label=""),
    ):
        pass


def test_scales_have_the_colours_of_their_ends_and_grey_for_what_is_not_measured() -> None:
    scale = thickness_scale(0.8, 1.2)
    found = scale.rgb(np.array([0.5, 0.8, 1.0, 1.2, 2.0, np.nan]))
    assert found.tolist() == [
        [33, 102, 172], [33, 102, 172], [244, 244, 242], [178, 24, 43], [178, 24, 43], [154, 154, 154],
    ]  # fmt: skip
    assert (scale.said(0.913), scale.said(np.nan)) == ("thickness 0.913 of the wanted one", "not judged")
    assert (coverage_scale().said(1.0), coverage_scale().said(2.0)) == ("gap", "overlap")
    assert coverage_scale().rgb(np.array([0, 1, 2])).tolist() == [[221, 226, 230], [213, 94, 0], [0, 114, 178]]
    below, beyond = overhang_scale(30.0).rgb(np.array([29.9, 30.2])).tolist()
    assert below[2] > 200
    assert beyond[2] < 120


@pytest.mark.parametrize(
    ("surface", "wanted"),
    [(spherical_cap(radius=15.0, angle=0.5, rings=12), 1.0 / 15.0), (plate((10.0, 8.0), (10, 8)), 0.0)],
    ids=["sphere", "plate"],
)
def test_mean_curvature_is_that_of_the_shape(surface: Surface, wanted: float) -> None:
    found = mean_curvature(prepare(surface)[0])
    assert np.median(found) == pytest.approx(wanted, abs=0.002)


def test_a_plot_shows_its_lines_limits_and_names() -> None:
    plot = Plot("tip [mm/s]", ("a", "<b>"), (np.array([0.0, 10.0]), np.array([5.0, 5.0])), (20.0,))
    found = plot_html(np.array([0.0, 4.0]), plot)
    assert found.count("<polyline") == 3
    assert "&lt;b&gt;" in found
    assert "4.0 s" in found


@pytest.mark.needs("viser")
def test_clearance_and_distance_are_those_of_the_plan(view: LiveView) -> None:
    plan = view.scenes[0].plan
    (robot,) = plan.record.robot
    assert view.scenes[0].values("clearance").min() == pytest.approx(robot.clearance.smallest_mm, abs=0.02)
    assert view.scenes[0].values("distance").max() == pytest.approx(plan.record.paths.largest_distance_mm, rel=0.01)
    assert view.scenes[0].values("margin").min() > 0.0


@pytest.mark.needs("viser")
def test_the_command_writes_the_scene_and_a_notebook_has_it_too(
    bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert called(monkeypatch, "view", bundle, "--robot", "--html", tmp_path / "scene.html") == 0
    assert f"written: {tmp_path / 'scene.html'}" in capsys.readouterr().err
    page = (tmp_path / "scene.html").read_bytes()
    assert page.startswith(b"<!doctype html>")
    shown = notebook_scene(bundle)
    assert shown.page.startswith(b"<!doctype html>")
    assert len(shown.page) == pytest.approx(len(page), rel=0.2)


@pytest.mark.slow
@pytest.mark.needs("viser")
def test_attitudes_of_a_table_follow_one_another_on_the_time_line_of_the_report(
    shared_plans: SharedPlans, tmp_path: Path
) -> None:
    planned = plan_of_the_arch(shared_plans, tmp_path)
    viewed = load_viewed(bundle_of_the_arch(shared_plans, planned))
    with served(8902, label="test") as server, closing(LiveView(viewed, server)) as view:
        (scene,) = view.scenes
        moving, shown = scene.plan.moving, replay(planned)
        assert moving is not None
        assert moving.table is not None
        assert shown.table is not None
        assert len(scene.plan.motions) > 1
        assert view.end == pytest.approx(float(shown.times[-1]), abs=1e-3)
        np.testing.assert_allclose(moving.table.times, shown.table.times, atol=1e-3)
        np.testing.assert_allclose(moving.table.part, shown.table.part, atol=1e-6)
        T_base_tip = scene.plan.motions[0].arm.link_poses(np.zeros((1, 6)))[0, -1]
        resting = (np.linalg.inv(moving.T_base_work) @ T_base_tip)[:3, 3]
        for number, motion in enumerate(scene.plan.motions):
            view.show_attitude(number + 1)
            assert view.moment == pytest.approx(float(moving.begins[number]), abs=1e-3)
            pose = int(np.flatnonzero(motion.poses.deposit)[30])
            time = scene.plan.moment(number, float(motion.pose_times[pose]))
            turned, moved = moving.table_poses(time)[0], moving.links(time)[-1]
            tip = turned[:, :3] @ motion.poses.tips[pose] + turned[:, 3]
            np.testing.assert_allclose(moved[:3, :3] @ resting + moved[:3, 3], tip, atol=0.05)
            place, normal = motion.poses.surface_points[pose], motion.poses.normals[pose]
            # The part turns where it is.
            middle = 0.5 * (scene.plan.surface.vertices.min(axis=0) + scene.plan.surface.vertices.max(axis=0))
            start = turned[:, :3] @ (place + 50.0 * normal - middle) + middle
            view.show_moment(time)
            found = scene.hit(start, -turned[:, :3] @ normal, time=view.moment)
            assert found is not None
            np.testing.assert_allclose(found, place, atol=0.05)
        deposited = [motion.poses.deposit.sum() for motion in scene.plan.motions]
        assert sum(deposited) >= scene.plan.poses.deposit.sum()
