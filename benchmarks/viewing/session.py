"""A whole session in the live view, as a film: a heart's labels, a patch drawn on it, its plan, and the arm.

    python -m benchmarks.viewing.session VOLUME FILM.mp4 [--label NUMBER] [--smoke]

The label of the volume becomes a surface, an outline of eight points is drawn on its side, one of them is dragged, a
dry run is asked for, planned, checked and written, and replayed in the same page; a frame of the film is what headless
Chromium shows after each step. Everything is done through what the page calls: the rays of clicks and drags, and its
buttons. Printed is how long each step took by the clock, and what the page said after it. With --smoke a plate takes
the place of the volume, and no film is taken.
"""

from __future__ import annotations

import io
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from PIL import Image

from benchmarks import DATA
from benchmarks.guide.filming import opened
from benchmarks.parts.tables import row, script_parser, table
from geoprint import job_of
from geoprint.errors import VerificationError
from geoprint.model import FloatArray
from geoprint.viewer.capture import FILM_RATE
from geoprint.viewer.drawing import OUTLINE, Drawing
from geoprint.viewer.editor import EditView
from geoprint.viewer.page import address, served
from geoprint.workflow import check_bundle

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

SIZE, PORT = (1280, 800), 8965
SPACING, RADIUS, CORNERS = 1.5, 13.0, 8
# Closes the page's notice that no graphics card draws.
NOTICE = ".mantine-Notification-closeButton"
# Frames that a step stays, and frames of the replay.
HELD, REPLAYED = 12, 60


def main() -> None:
    """Take the film and print the steps."""
    parser = script_parser(__doc__, smoke="on a plate, no film")
    parser.add_argument("volume", type=Path, nargs="?", default=DATA / "plate.ply")
    parser.add_argument("film", type=Path, nargs="?")
    parser.add_argument("--label", type=int, default=None, metavar="NUMBER")
    arguments = parser.parse_args()
    part = DATA / "plate.ply" if arguments.smoke else arguments.volume
    unit = "mm" if part.suffix == ".ply" else None
    job = job_of(
        surface=part, unit=unit, label=arguments.label, spacing=6.0 if arguments.smoke else SPACING, robot=False
    )
    print(*table("step", "seconds", "the page says"), sep="\n")
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        server = stack.enter_context(served(PORT, label="geoprint"))
        view = stack.enter_context(closing(EditView(Drawing(job, folder / "heart.toml"), server)))
        film = None if arguments.smoke or arguments.film is None else arguments.film
        browser = None
        if film is not None:
            browser = stack.enter_context(opened(address(server), size=SIZE, drawn=NOTICE))
            browser.find_element("css selector", NOTICE).click()
        frames = session(view, folder, browser)
    if film is not None:
        written(frames, film)


def session(view: EditView, folder: Path, browser: Chrome | None) -> list[bytes]:
    """Take the steps, and return a picture of the page for each frame of the film; none without a browser."""
    frames = list[bytes]()

    def step(name: str, act: Callable[[], object], *, held: int = HELD) -> None:
        begun = time.perf_counter()
        act()
        view.complete()
        print(row(name, f"{time.perf_counter() - begun:.1f}", _plain(view.message) or _plain(view.written)), flush=True)
        if browser is not None:
            time.sleep(2.0)
            frames.extend([browser.get_screenshot_as_png()] * held)

    step("part opened", lambda: None)
    middle, outward, across = side_of(view)
    for client in view.server.get_clients().values():
        client.camera.position = middle + 150.0 * outward + 40.0 * across[0]
        client.camera.look_at = middle
    view.choose(OUTLINE)
    for number, angle in enumerate(np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False).tolist(), start=1):
        place = middle + RADIUS * (np.cos(angle) * across[0] + np.sin(angle) * across[1])
        step(f"corner {number}", lambda place=place: view.pick(place + 60.0 * outward, -outward), held=4)
    corner = np.array(view.drawing.items[-1].places[0])
    farther = corner + 3.0 * across[0] + 60.0 * outward
    step("a corner dragged", lambda: view.drag(0, 0, farther, -outward, ends=True))
    step("dry run asked for", lambda: view.change(robot=True, place="demo"))
    step("planned and checked", view.plan)
    bundle = folder / "heart-plan"
    findings = check_bundle(bundle).findings
    if findings:
        raise VerificationError(f"{bundle}: {findings[0].reason}")
    view.replay(bundle)
    replay = view.replayed
    if browser is not None and replay is not None:
        replay.complete()
        replay.show_robot()
        for moment in np.linspace(0.0, replay.end, REPLAYED).tolist():
            replay.show_moment(moment)
            time.sleep(1.0)
            frames.extend([browser.get_screenshot_as_png()] * 2)
    return frames


def side_of(view: EditView) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the place of a part that is farthest to its side, the direction there, and (2, 3) two across that."""
    vertices = view.body.vertices
    centre = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    outward = view.upright.T @ np.array([0.0, 0.0, 1.0]) if np.ptp(vertices[:, 2]) < 1.0 else np.array([1.0, 0.0, 0.0])
    middle = centre if np.ptp(vertices[:, 2]) < 1.0 else vertices[(vertices @ outward).argmax()]
    first = np.cross(outward, [0.0, 1.0, 0.0])
    return middle, outward, np.array([first, np.cross(outward, first)])


def written(frames: list[bytes], path: Path) -> None:
    """Write frames, PNG pictures, as a film."""
    film = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"vp09"), FILM_RATE, SIZE)
    for frame in frames:
        # The window of a headless browser is a little lower than was asked for.
        with Image.open(io.BytesIO(frame)) as image:
            film.write(np.asarray(image.convert("RGB").resize(SIZE))[:, :, ::-1])
    film.release()


def _plain(html: str) -> str:
    return html.partition(">")[2].rpartition("<")[0]


if __name__ == "__main__":
    main()
