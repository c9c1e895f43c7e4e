"""How fast does the live view open and replay a comparison of 15,000 faces and 50,000 poses?

    python -m benchmarks.viewing.replaying [--smoke]

A cap is planned by lscm and heat, with the robot, and the comparison is written. Then it is read and served, opened in
headless Chromium, and played, without the arm and with it. `read s` is from the folder to a page that can be opened, in
seconds of the processor; `open s` from there until the browser has the panel with its plots, by the clock. Frames are
those that the browser draws in ten seconds. Without a graphics card most of a frame is spent in drawing its triangles,
so beside it stand what the scripts of the page and the server take for each second of playing, in seconds, and how many
frames an empty scene of the same page has.
"""

from __future__ import annotations

import tempfile
import time
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.guide.filming import opened
from benchmarks.parts.surfaces import cap, triangulated
from benchmarks.parts.tables import row, script_parser, table
from geoprint import compare, job_of
from geoprint.geometry.files import save_ply
from geoprint.viewer import load_viewed
from geoprint.viewer.live import LiveView
from geoprint.viewer.page import address, served
from geoprint.workflow import save_comparisons

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

FACES, SPACING = 15_000, 0.37
# Angle of the cap from its pole to the rim [degrees], and its depth [mm].
CAP_DEG, DEPTH = 40.0, 22.0
SIZE, PORT, SECONDS = (1280, 800), 8960, 10.0
# Counts what the browser draws: a frame of the scene is drawn for each.
COUNTING = """
window.drawnFrames = 0;
const count = () => { window.drawnFrames += 1; requestAnimationFrame(count); };
requestAnimationFrame(count);
"""
COLUMNS = ("faces", "poses", "read s", "open s", "arm", "frames/s", "scripts s", "server s", "errors")


def main() -> None:
    """Print the table."""
    smoke = script_parser(__doc__, smoke="a small part, for a moment").parse_args().smoke
    faces, spacing, seconds = (300, 8.0, 0.2) if smoke else (FACES, SPACING, SECONDS)
    with tempfile.TemporaryDirectory() as folder:
        part, out = Path(folder, "cap.ply"), Path(folder, "compared")
        save_ply(triangulated(cap(CAP_DEG, depth=DEPTH), name="cap", faces=faces), part)
        job = job_of(surface=part, unit="mm", spacing=spacing, place="demo")
        save_comparisons([compare(job, backends=["lscm", "heat"])], out)
        print(*table(*COLUMNS), *measured(out, seconds=seconds), sep="\n")


def measured(folder: Path, *, seconds: float) -> list[str]:
    """Return the lines of a comparison."""
    begun = time.process_time()
    viewed = load_viewed(folder)
    with served(PORT, label="benchmark") as server, closing(LiveView(viewed, server)) as view:
        read, served_at = time.process_time() - begun, time.perf_counter()
        with opened(address(server), size=SIZE, drawn=".geoprint-plot svg") as browser:
            open_after = time.perf_counter() - served_at
            view.complete()
            _asked(browser, "Performance.enable")
            _run(browser, COUNTING)
            view.play()
            lines = [("no", played(browser, seconds=seconds))]
            view.show_robot()
            lines.append(("yes", played(browser, seconds=seconds)))
            errors = [each for each in _logged(browser) if each["level"] == "SEVERE"]
            for scene in view.scenes:
                scene.show(all_of_it=False, paths=False, travel=False, robot=False)
            lines.append(("empty scene", played(browser, seconds=seconds)))
    faces, poses = max(len(plan.surface.faces) for plan in viewed.plans), sum(plan.poses.count for plan in viewed.plans)
    return [
        row(
            str(faces), str(poses), f"{read:.1f}", f"{open_after:.1f}", arm, *(f"{value:.2f}" for value in values),
            str(len(errors)),
        )
        for arm, values in lines
    ]  # fmt: skip


def played(browser: Chrome, *, seconds: float) -> tuple[float, float, float]:
    """Return frames, seconds of the page's scripts, and seconds of the server, for each second of playing."""

    def counted() -> tuple[float, float, float]:
        metrics = _asked(browser, "Performance.getMetrics")["metrics"]
        scripts = next(each["value"] for each in metrics if each["name"] == "ScriptDuration")
        return float(_run(browser, "return window.drawnFrames")), float(scripts), time.process_time()

    before, begun = counted(), time.perf_counter()
    time.sleep(seconds)
    after, passed = counted(), time.perf_counter() - begun
    frames, scripts, server = ((b - a) / passed for a, b in zip(before, after, strict=True))
    return frames, scripts, server


def _logged(browser: Chrome) -> list[dict[str, Any]]:
    return browser.get_log("browser")  # pyright: ignore[reportUnknownMemberType]


def _asked(browser: Chrome, method: str) -> Any:
    return browser.execute_cdp_cmd(method, {})  # pyright: ignore[reportUnknownMemberType]


def _run(browser: Chrome, script: str) -> Any:
    return browser.execute_script(script)  # pyright: ignore[reportUnknownMemberType]


if __name__ == "__main__":
    main()
