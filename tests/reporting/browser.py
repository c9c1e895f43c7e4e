"""A headless Chromium that opens one file, offline, and tells what it saw."""

from __future__ import annotations

import base64
import io
import json
import os
import shutil
import time
from collections.abc import Generator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import numpy as np
import pytest
from matplotlib.image import imread
from numpy.typing import NDArray

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

# Set to "required" where a missing browser is a failure and no reason to skip.
BROWSER_TESTS = "GEOPRINT_BROWSER_TESTS"
# Seconds to wait for what a page draws; a software renderer on a busy machine takes some.
PATIENCE = 60.0
# Virtual key codes of the keys that are pressed.
KEYS = {
    "Enter": 13, " ": 32, "Tab": 9, "PageDown": 34, "Home": 36, "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39,
    "ArrowDown": 40,
}  # fmt: skip
FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", "--force-device-scale-factor=1",
    "--enable-webgl", "--ignore-gpu-blocklist", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--disable-background-networking", "--disable-component-update", "--no-first-run",
)  # fmt: skip


def required_browser() -> tuple[str, str]:
    """Return the paths of Chromium and its driver, or skip the test where they are missing and not required."""
    if find_spec("selenium") is None:
        _missing("selenium is not installed: pip install -e '.[slow]'")
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    driver = shutil.which("chromedriver")
    if chromium is None or driver is None:
        _missing("no Chromium with its driver here (Debian: chromium, chromium-driver)")
    return chromium, driver


def _missing(what: str) -> NoReturn:
    if os.environ.get(BROWSER_TESTS) == "required":
        pytest.fail(what)
    pytest.skip(what)


class Page:
    """An open page."""

    def __init__(self, driver: Chrome) -> None:
        self.driver = driver

    def resize(self, *, width: int, height: int = 900) -> None:
        self._devtools(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
        )

    def open(self, path: Path) -> None:
        """Open a file; what the page before says as it goes is not held against this one."""
        self.driver.get("about:blank")
        self.forget()
        self.driver.get(path.as_uri())

    def run(self, script: str) -> object:
        """Return what a script returns."""
        return self.driver.execute_script(f"return {script}")  # pyright: ignore[reportUnknownMemberType]

    def wait_until(self, script: str) -> None:
        """Wait until a script's value is true."""
        from selenium.webdriver.support.wait import WebDriverWait

        WebDriverWait(self.driver, PATIENCE, poll_frequency=0.05).until(lambda _: bool(self.run(script)), script)

    def picture(self, selector: str | None = None) -> NDArray[np.float32]:
        """Return the pixels of an element, or of the whole page, as (rows, columns, 3) in 0 to 1."""
        return np.asarray(imread(io.BytesIO(self.png(selector))), dtype=np.float32)[..., :3]

    def png(self, selector: str | None = None) -> bytes:
        where = "document.documentElement" if selector is None else f"document.querySelector({json.dumps(selector)})"
        box = self.run(
            f"(() => {{ const b = {where}.getBoundingClientRect(); "
            "return [b.x + scrollX, b.y + scrollY, b.width, b.height] })()"
        )
        assert isinstance(box, list)
        x, y, width, height = (float(value) for value in box)  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
        found = self._devtools(
            "Page.captureScreenshot",
            {
                "format": "png", "captureBeyondViewport": True,
                "clip": {"x": x, "y": y, "width": width, "height": height, "scale": 1},
            },
        )  # fmt: skip
        return base64.b64decode(str(found["data"]))

    def click(self, selector: str) -> None:
        """Click an element with the mouse."""
        self.driver.find_element("css selector", selector).click()

    def point_at(self, selector: str, *, across: float, down: float) -> None:
        """Move the mouse over an element, to a share of its width and height."""
        box = self.run(
            f"(() => {{ const b = document.querySelector({json.dumps(selector)}).getBoundingClientRect();"
            f" return {{x: b.x + {across} * b.width, y: b.y + {down} * b.height}} }})()"
        )
        assert isinstance(box, dict)
        for x in (2.0, 1.0, 0.0):
            self._devtools("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": box["x"] + x, "y": box["y"]})

    def drag(self, selector: str, *, to: float) -> None:
        """Drag the handle of a slider with the mouse to a share of its track; beyond 0 and 1 it stops at its ends."""
        places = self.run(
            f"(() => {{ const slider = document.querySelector({json.dumps(selector)});"
            " slider.scrollIntoView({ block: 'center', behavior: 'instant' });"
            " const b = slider.getBoundingClientRect(), handle = b.height / 2;"
            " const x = (share) => b.x + handle + share * (b.width - 2 * handle);"
            f" return [x((slider.value - slider.min) / (slider.max - slider.min)), x({to}), b.y + b.height / 2] }})()"
        )
        assert isinstance(places, list)
        first, last, y = (float(value) for value in places)  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
        for kind, x, button in (
            ("mouseMoved", first, "none"), ("mousePressed", first, "left"), ("mouseMoved", last, "left"),
            ("mouseReleased", last, "left"),
        ):  # fmt: skip
            self._devtools(
                "Input.dispatchMouseEvent", {"type": kind, "x": x, "y": y, "button": button, "clickCount": 1}
            )

    def focus(self, selector: str) -> None:
        self.run(f"document.querySelector({json.dumps(selector)}).focus()")

    def press(self, key: str) -> None:
        """Press a key, by its name in the browser's events, where the focus is."""
        code = KEYS[key]
        text = {"text": "\r" if key == "Enter" else key} if key in {"Enter", " "} else {}
        for kind in ("keyDown", "keyUp"):
            self._devtools(
                "Input.dispatchKeyEvent",
                {"type": kind, "key": key, "windowsVirtualKeyCode": code, **(text if kind == "keyDown" else {})},
            )

    def turn(self, selector: str, *, by: float) -> None:
        """Drag across an element with the mouse, from its middle, by a share of its width."""
        box = self.run(
            f"(() => {{ const b = document.querySelector({json.dumps(selector)}).getBoundingClientRect();"
            f" return [b.x + b.width / 2, b.x + ({by} + 0.5) * b.width, b.y + b.height / 2] }})()"
        )
        assert isinstance(box, list)
        first, last, y = (float(value) for value in box)  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
        for kind, x, pressed in (
            ("mouseMoved", first, 0), ("mousePressed", first, 1), ("mouseMoved", 0.5 * (first + last), 1),
            ("mouseMoved", last, 1), ("mouseReleased", last, 0),
        ):  # fmt: skip
            button = "none" if kind == "mouseMoved" and not pressed else "left"
            self._devtools(
                "Input.dispatchMouseEvent",
                {"type": kind, "x": x, "y": y, "button": button, "buttons": pressed, "clickCount": 1},
            )
            time.sleep(0.1)

    @contextmanager
    def dark(self) -> Generator[None]:
        """Show the page as where the system is dark."""
        self._devtools("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": "dark"}]})
        yield
        self._devtools("Emulation.setEmulatedMedia", {"features": []})

    @contextmanager
    def printed(self) -> Generator[None]:
        """Show the page as on paper."""
        self._devtools("Emulation.setEmulatedMedia", {"media": "print"})
        yield
        self._devtools("Emulation.setEmulatedMedia", {"media": ""})

    @contextmanager
    def without_webgl(self) -> Generator[None]:
        """Open pages as on a machine whose browser has no WebGL."""
        script = "HTMLCanvasElement.prototype.getContext = () => null"
        added = self._devtools("Page.addScriptToEvaluateOnNewDocument", {"source": script})
        yield
        self._devtools("Page.removeScriptToEvaluateOnNewDocument", {"identifier": added["identifier"]})

    def forget(self) -> None:
        """Drop what the logs hold."""
        self.errors()
        self.requests()

    def pdf(self) -> bytes:
        found = self._devtools("Page.printToPDF", {"printBackground": True, "preferCSSPageSize": True})
        return base64.b64decode(str(found["data"]))

    def errors(self) -> list[str]:
        """Return the errors in the console since the last call."""
        return [str(entry["message"]) for entry in self._log("browser") if entry["level"] == "SEVERE"]

    def requests(self) -> list[str]:
        """Return the addresses that were asked for since the last call; those inside the page itself do not count."""
        found: list[str] = []
        for entry in self._log("performance"):
            message = json.loads(str(entry["message"]))["message"]
            if message["method"] == "Network.requestWillBeSent":
                found.append(message["params"]["request"]["url"])
        return [address for address in found if not address.startswith(("data:", "blob:"))]

    def _log(self, kind: str) -> list[dict[str, object]]:
        return self.driver.get_log(kind)  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]

    def _devtools(self, command: str, arguments: dict[str, object]) -> dict[str, object]:
        return self.driver.execute_cdp_cmd(command, arguments)  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]


@contextmanager
def opened_browser() -> Generator[Page]:
    """Start a browser; where there is none the test is skipped, or fails if it is required."""
    chromium, path = required_browser()
    from selenium.webdriver import Chrome, ChromeOptions, ChromeService

    options = ChromeOptions()
    options.binary_location = chromium
    for flag in FLAGS:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})  # pyright: ignore[reportUnknownMemberType]
    driver = Chrome(options=options, service=ChromeService(path))
    try:
        yield Page(driver)
    finally:
        driver.quit()
