"""Every picture of the guide by the name of its file, and what draws it from the folder `data/`."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.field.figures import field_picture, loaded
from benchmarks.guide import cells, layers, prints, surfaces
from benchmarks.guide.filming import opened, settled
from benchmarks.guide.shaded import smaller
from benchmarks.guide.stamps import with_figures
from benchmarks.paths import uniformity
from benchmarks.whole.figures import loaded as times_kept, speed_picture
from geoprint.config import job_of
from geoprint.guide import page_named
from geoprint.reporting.figures import png_bytes
from geoprint.reporting.metrics import THICKNESS
from geoprint.sweep import read_study
from geoprint.sweep.report import distributions
from geoprint.sweep.running import outcomes, run_study
from geoprint.viewer import load_viewed
from geoprint.viewer.drawing import KEEP_OUT, POINT, Drawing
from geoprint.viewer.editor import EditView
from geoprint.viewer.live import LiveView
from geoprint.viewer.page import address, served
from geoprint.workflow import compare, plan, save_comparisons

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

# The part of the report that is its first screen [px].
SCREEN = (1280, 900)


def report(data: Path) -> bytes:
    """Photograph the first screen of a report in a headless browser.

    Raises:
        RuntimeError: there is no Chromium with its driver here.
    """
    job = job_of(surface=data / "heart_apex_patch.ply", unit="mm", spacing=1.5, robot=False)
    with tempfile.TemporaryDirectory() as folder:
        save_comparisons([compare(job)], Path(folder) / "compared")
        with opened((Path(folder) / "compared" / "report.html").as_uri(), size=SCREEN) as browser:
            return smaller(browser.get_screenshot_as_png(), width=1000)


def live_view(data: Path) -> bytes:
    """Photograph the live view of a comparison in a headless browser, with the needle on the first of its plans.

    Raises:
        RuntimeError: there is no Chromium with its driver here.
    """
    job = job_of(surface=data / "heart_apex_patch.ply", unit="mm", spacing=1.5, place="demo")
    with tempfile.TemporaryDirectory() as folder:
        save_comparisons([compare(job)], Path(folder) / "compared")
        viewed = load_viewed(Path(folder) / "compared")
        with served(8950, label="geoprint") as server, closing(LiveView(viewed, server)) as view:
            view.complete()
            view.show_robot()
            view.show_moment(0.4 * view.end)
            with opened(address(server), size=SCREEN, drawn=".geoprint-plot svg") as browser:
                return smaller(_without_notice(browser), width=1000)


def drawn_on(data: Path) -> bytes:
    """Photograph a part that is drawn on in the live view: a source, a keep-out, and the paths that follow.

    Raises:
        RuntimeError: there is no Chromium with its driver here.
    """
    job = job_of(surface=data / "heart_apex_patch.ply", unit="mm", spacing=1.5, place="demo")
    with (
        tempfile.TemporaryDirectory() as folder,
        served(8951, label="geoprint") as server,
        closing(EditView(Drawing(job, Path(folder) / "heart.toml"), server)) as view,
    ):
        middle = 0.5 * (view.body.vertices.min(axis=0) + view.body.vertices.max(axis=0))
        around = [[-9.0, -3.0], [-3.0, -4.0], [-2.0, 2.0], [-8.0, 3.0]]
        for tool, places in ((POINT, [[6.0, 1.0]]), (KEEP_OUT, around)):
            view.choose(tool)
            for x, y in places:
                view.pick(middle + np.array([x, y, 100.0]) @ view.upright, -view.upright[2])
        view.complete()
        with opened(address(server), size=SCREEN, drawn="canvas") as browser:
            return smaller(_without_notice(browser), width=1000)


def study(data: Path) -> bytes:
    """Draw the distributions of the study that the page on studies runs."""
    (block,) = re.findall(r"```toml study.toml\n(.*?)```", page_named("sweep").text, flags=re.DOTALL)
    with tempfile.TemporaryDirectory() as folder:
        file, out = Path(folder, "study.toml"), Path(folder, "study")
        Path(folder, "data").symlink_to(data.resolve())
        file.write_text(block, encoding="utf-8")
        asked = read_study(file)
        run_study(asked, out)
        return distributions(list(outcomes(asked, out))).content


def _without_notice(browser: Chrome) -> bytes:
    """Return a picture of a page of the view without its notice that no graphics card draws."""
    browser.find_element("css selector", ".mantine-Notification-closeButton").click()
    return settled(browser)


def scripting(data: Path) -> bytes:
    """Draw what the page on scripting draws."""
    planned = plan(job_of(surface=data / "heart_flat_patch.ply", unit="mm", spacing=3.0, robot=False))
    return smaller(png_bytes(planned.figure()), width=600)


def own_backend(data: Path) -> bytes:
    """Draw the level curves of the page's own backend: that block is what makes it known."""
    (block,) = (each for each in page_named("own-backend").blocks if each.language == "python")
    defined, _, _ = block.text.partition("job = ")
    exec(compile(defined, "own-backend.md", "exec"), {"__name__": "own_backend"})  # noqa: S102  (our own text)
    return surfaces.own_backend(data)


def yardstick(_data: Path) -> bytes:
    """Draw the figures that are kept of every planner."""
    return smaller(field_picture(loaded()), width=1210)


def evenness(_data: Path) -> bytes:
    """Draw the figures that are kept of every backend."""
    text = uniformity.KEPT.read_text(encoding="utf-8")
    rows = uniformity.loaded(text)
    (apex,) = (row for row in rows if row.part == uniformity.SMALLEST)
    figures = [f"{100.0 * apex.backends[name][THICKNESS.key]:.2f}" for name in ("lscm", "heat")]
    return with_figures(smaller(uniformity.picture(rows), width=900), figures)


def speed(_data: Path) -> bytes:
    """Draw the times that are kept of the same work by geoprint and by peers."""
    return smaller(speed_picture(times_kept()), width=1100)


PICTURES: Mapping[str, Callable[[Path], bytes]] = {
    "first-comparison.png": surfaces.first_comparison,
    "your-part.png": surfaces.your_part,
    "your-cell.png": cells.your_cell,
    "another-arm.png": cells.another_arm,
    "calibrate.png": cells.calibrate,
    "fine-lines.png": cells.fine_lines,
    "middle.png": surfaces.middle,
    "spiral.png": surfaces.spiral,
    "guided.png": surfaces.guided,
    "layers.png": layers.layers,
    "sliced.png": layers.sliced,
    "fibres.png": surfaces.fibres,
    "widths.png": surfaces.widths,
    "through.png": layers.through,
    "overhang.png": layers.tilted,
    "several-patches.png": surfaces.several_patches,
    "controller.png": cells.controller,
    "again.png": cells.again,
    "report.png": report,
    "view.png": live_view,
    "draw.png": drawn_on,
    "study.png": study,
    "evenness.png": evenness,
    "speed.png": speed,
    "measure.png": cells.measured,
    "appraise.png": prints.appraised,
    "simulate.png": prints.simulated,
    "paper.png": prints.paper,
    "yardstick.png": yardstick,
    "checked.png": cells.checked,
    "scripting.png": scripting,
    "own-backend.png": own_backend,
    "refused.png": surfaces.refused,
    "words.png": surfaces.words,
}
