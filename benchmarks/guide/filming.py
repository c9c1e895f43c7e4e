"""A report in a headless browser: its first screen, and its print as the moving picture of README."""

from __future__ import annotations

import io
import shutil
import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from PIL import Image

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", "--enable-webgl",
    "--ignore-gpu-blocklist", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
)  # fmt: skip
# Seconds until the scenes are drawn, and until a change of them is.
PATIENCE, SETTLED = 60.0, 1.0
# What the moving picture is of: the views of a report side by side, with the figures that a glance takes in.
WINDOW = (1040, 1000)
STYLE = """
.stage { height: 372px !important; }
.view-head:nth-child(2) span:not(:first-child):not(:nth-last-child(2)) { display: none; }
"""


def _camera(x: float, y: float, z: float, *, down: float) -> dict[str, dict[str, float]]:
    return {"eye": {"x": x, "y": y, "z": z}, "up": {"x": 0, "y": 0, "z": 1}, "center": {"x": 0, "y": 0, "z": down}}


FROM_ABOVE, NEARBY = _camera(0.12, -0.78, 1.0, down=-0.12), _camera(0.09, -0.56, 0.78, down=-0.06)
FRAME_MS, HELD_MS = 90, 3500
# Of WebP, in 100: lines stay crisp.
QUALITY = 82


class Shot(NamedTuple):
    """Frames between which nothing but time changes.

    Attributes:
        choices: controls that are switched before it, by what CSS names them with.
        camera: that it is seen with; None leaves it as it is.
        times: of the replay, over its duration; one frame each.
    """

    choices: Sequence[str]
    camera: object
    times: Sequence[float]


def _control(name: str, value: str = "") -> str:
    return f'[name="part0-{name}"]' + (f'[value="{value}"]' if value else "")


# The arm from its home, then its needle from nearby, then what lies there: beads as wide as they are wanted.
SHOTS = (
    Shot((_control("robot"), _control("frame", "robot")), None, [0.02 * step for step in range(9)]),
    Shot((_control("frame", "part"),), FROM_ABOVE, [0.18 + 0.82 * step / 44 for step in range(45)]),
    Shot((_control("robot"), _control("colour", "beads")), NEARBY, [1.0]),
)  # fmt: skip


@contextmanager
def opened(address: str, *, size: tuple[int, int], drawn: str = ".scene.live") -> Generator[Chrome]:
    """Open a page in a headless browser and wait until what a selector names is there: the first scene of a report.

    Raises:
        RuntimeError: there is no Chromium with its driver here.
    """
    from selenium.common.exceptions import TimeoutException
    from selenium.webdriver import Chrome, ChromeOptions, ChromeService
    from selenium.webdriver.support.wait import WebDriverWait

    chromium, driver = shutil.which("chromium") or shutil.which("google-chrome"), shutil.which("chromedriver")
    if chromium is None or driver is None:
        raise RuntimeError("no Chromium with its driver here (Debian: chromium, chromium-driver)")
    options = ChromeOptions()
    options.binary_location = chromium
    for argument in (*FLAGS, f"--window-size={size[0]},{size[1]}"):
        options.add_argument(argument)
    with Chrome(options=options, service=ChromeService(driver)) as browser:
        browser.get(address)
        # A scene is drawn only where it is on the screen; waiting for one that is not there would never end.
        with suppress(TimeoutException):
            WebDriverWait(browser, PATIENCE).until(lambda _: browser.find_elements("css selector", drawn))
        yield browser


def settled(browser: Chrome) -> bytes:
    """Return a screenshot once the page has stopped to change."""
    before = b""
    for _ in range(40):
        time.sleep(2.0)
        now = browser.get_screenshot_as_png()
        if now == before:
            break
        before = now
    return before


def film(report: Path) -> bytes:
    """Return an animated WebP of the print that a report replays: first the arm, then the needle, then the beads."""
    with opened(report.resolve().as_uri(), size=WINDOW) as browser:
        _run(browser, "const style = document.createElement('style'); style.textContent = it;"
                      " document.head.append(style)", STYLE)  # fmt: skip
        frames = [frame for shot in SHOTS for frame in _taken(browser, shot)]
    held = [FRAME_MS] * (len(frames) - 1) + [HELD_MS]
    buffer = io.BytesIO()
    frames[0].save(
        buffer, format="webp", save_all=True, append_images=frames[1:], duration=held, loop=0, quality=QUALITY, method=6
    )
    return buffer.getvalue()


def _taken(browser: Chrome, shot: Shot) -> Generator[Image.Image]:
    for control in shot.choices:
        _run(browser, "document.querySelector(it).click()", control)
    if shot.camera is not None:
        _run(
            browser,
            "document.querySelectorAll('.plot').forEach((plot) => Plotly.relayout(plot, { 'scene.camera': it }))",
            shot.camera,
        )
    time.sleep(SETTLED)
    for share in shot.times:
        _run(
            browser,
            "const slider = document.querySelector('.player input');"
            " if (document.querySelector('[name=\"part0-robot\"]').checked) {"
            " slider.value = it * slider.max; slider.dispatchEvent(new Event('input', { bubbles: true })); }",
            share,
        )
        time.sleep(SETTLED / 5)
        png = browser.find_element("css selector", ".views").screenshot_as_png
        yield Image.open(io.BytesIO(png)).convert("RGB")


def _run(browser: Chrome, script: str, value: object) -> None:
    """Run a script that finds a value by the name `it`."""
    browser.execute_script(f"const it = arguments[0]; {script}", value)  # pyright: ignore[reportUnknownMemberType]
