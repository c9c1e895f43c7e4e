"""Every picture of the guide by the name of its file, and what draws it from the folder `data/`."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

from benchmarks.field.figures import KEPT, field_picture, loaded
from benchmarks.guide import cells, layers, prints, surfaces
from benchmarks.guide.shaded import smaller
from benchmarks.parts.stamps import stamp, stamped
from geoprint.config import job_of
from geoprint.guide import page_named
from geoprint.reporting import figure
from geoprint.reporting.figures import png_bytes
from geoprint.workflow import compare, plan, save_comparisons

# The part of the report that is its first screen [px].
SCREEN = (1280, 900)
# Seconds until the scenes are drawn.
PATIENCE = 20.0
FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", "--enable-webgl",
    "--ignore-gpu-blocklist", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
)  # fmt: skip


def report(data: Path) -> bytes:
    """Photograph the first screen of a report in a headless browser.

    Raises:
        RuntimeError: there is no Chromium with its driver here.
    """
    from selenium.common.exceptions import TimeoutException
    from selenium.webdriver import Chrome, ChromeOptions, ChromeService
    from selenium.webdriver.support.wait import WebDriverWait

    job = job_of(surface=data / "heart_apex_patch.ply", unit="mm", spacing=1.5, robot=False)
    chromium, driver = shutil.which("chromium") or shutil.which("google-chrome"), shutil.which("chromedriver")
    if chromium is None or driver is None:
        raise RuntimeError("no Chromium with its driver here (Debian: chromium, chromium-driver)")
    options = ChromeOptions()
    options.binary_location = chromium
    for argument in (*FLAGS, f"--window-size={SCREEN[0]},{SCREEN[1]}"):
        options.add_argument(argument)
    with tempfile.TemporaryDirectory() as folder, Chrome(options=options, service=ChromeService(driver)) as browser:
        save_comparisons([compare(job)], Path(folder) / "compared")
        browser.get((Path(folder) / "compared" / "report.html").as_uri())
        # A scene is drawn only where it is on the screen; waiting for one that is not there would never end.
        with suppress(TimeoutException):
            WebDriverWait(browser, PATIENCE).until(lambda _: browser.find_elements("class name", "live"))
        return smaller(browser.get_screenshot_as_png(), width=1000)


def scripting(data: Path) -> bytes:
    """Draw what the page on scripting draws."""
    planned = plan(job_of(surface=data / "heart_flat_patch.ply", unit="mm", spacing=3.0, robot=False))
    return smaller(png_bytes(figure(planned)), width=600)


def own_backend(data: Path) -> bytes:
    """Draw the level curves of the page's own backend: that block is what makes it known."""
    (block,) = (each for each in page_named("own-backend").blocks if each.language == "python")
    defined, _, _ = block.text.partition("job = ")
    exec(compile(defined, "own-backend.md", "exec"), {"__name__": "own_backend"})  # noqa: S102  (our own text)
    return surfaces.own_backend(data)


def yardstick(_data: Path) -> bytes:
    """Draw the figures that are kept of every planner, and say of which they are."""
    return stamped(smaller(field_picture(loaded()), width=1210), stamp(KEPT.read_text(encoding="utf-8")))


PICTURES: Mapping[str, Callable[[Path], bytes]] = {
    "first-comparison.png": surfaces.first_comparison,
    "your-part.png": surfaces.your_part,
    "your-cell.png": cells.your_cell,
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
