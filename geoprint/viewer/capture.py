"""The view as files: pictures and films, which a headless Chromium draws without a window, and an offline page."""

# matplotlib leaves the keyword arguments of its functions untyped.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import shutil
import subprocess
import time
from collections.abc import Generator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Final

import numpy as np

from geoprint.errors import ExportError, UsageError
from geoprint.geometry.files import write_whole
from geoprint.geometry.native import missing
from geoprint.viewer.live import LiveView
from geoprint.viewer.page import address

if TYPE_CHECKING:
    import viser
    from numpy.typing import NDArray

# Size of pictures and films [pixels], frames of a film, and how many of them a second are shown.
WIDTH, HEIGHT = 1280, 800
FILM_FRAMES, FILM_RATE = 150, 25
# So long a page may take to open, and to draw one frame [s]: without a graphics card on a busy machine it takes some.
PATIENCE: Final = 120.0
# A scene that does not change for so long is drawn [s].
SETTLED: Final = 1.5
BROWSERS: Final = ("chromium", "google-chrome", "chromium-browser", "chrome")
FLAGS: Final = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run", "--disable-background-networking",
    "--ignore-gpu-blocklist", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
)  # fmt: skip


def save_still(server: viser.ViserServer, path: Path) -> None:
    """Write what a page shows as a PNG file.

    Raises:
        UsageError: the file is no .png, or there is no browser.
        ExportError: the browser does not draw, or the file cannot be written.
    """
    _check_name(path, ".png")
    from matplotlib.image import imsave

    with browser(server) as client:
        picture = _drawn(client)
    content = BytesIO()
    imsave(content, picture, format="png")
    write_whole(path, content.getvalue())


def save_film(view: LiveView, path: Path) -> None:
    """Write the replay of the view's motion as an MP4 film.

    Raises:
        UsageError: the file is no .mp4, there is no motion, no browser, or opencv is missing.
        ExportError: the browser does not draw, or the file cannot be written.
    """
    _check_name(path, ".mp4")
    if view.end <= 0.0:
        raise UsageError("this plan has no robot motion to record; `--still` draws its paths.")
    try:
        import cv2
    except ImportError as error:
        raise missing("opencv-python-headless", extra="view", work="a film") from error

    with TemporaryDirectory() as folder:
        trial = Path(folder, "film.mp4")
        film = cv2.VideoWriter(str(trial), cv2.VideoWriter.fourcc(*"vp09"), FILM_RATE, (WIDTH, HEIGHT))
        if not film.isOpened():
            raise ExportError(f"{path} cannot be written: opencv has no encoder for VP9 here.")
        try:
            with browser(view.server) as client:
                for moment in np.linspace(0.0, view.end, FILM_FRAMES).tolist():
                    view.show_moment(moment)
                    film.write(_drawn(client)[:, :, ::-1])
        finally:
            film.release()
        write_whole(path, trial.read_bytes())


def save_page(server: viser.ViserServer, path: Path) -> None:
    """Write the scene of a page as it stands as one HTML file that opens offline.

    Raises:
        UsageError: the file is no .html.
        ExportError: it cannot be written.
    """
    _check_name(path, ".html")
    write_whole(path, server.scene.as_html().encode())


@contextmanager
def browser(server: viser.ViserServer) -> Generator[viser.ClientHandle]:
    """Open a page in a headless browser, as wide as pictures are, and give its connection.

    Raises:
        UsageError: there is no browser.
        ExportError: it does not open the page.
    """
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        raise UsageError("pictures and films need Chromium or Chrome on the PATH (Debian: `apt install chromium`).")
    with TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [found, *FLAGS, f"--window-size={WIDTH},{HEIGHT}", f"--user-data-dir={profile}", address(server)]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:  # noqa: S603
            try:
                client = _connected(server)
                _settle(client)
                yield client
            finally:
                process.terminate()


def _connected(server: viser.ViserServer) -> viser.ClientHandle:
    ends = time.monotonic() + PATIENCE
    while time.monotonic() < ends:
        clients = server.get_clients()
        if clients:
            return clients[max(clients)]
        time.sleep(0.1)
    raise ExportError(f"the browser did not open the view within {PATIENCE:.0f} s; try again on a less busy machine.")


def _settle(client: viser.ClientHandle) -> None:
    """Wait until all of the scene is drawn: meshes come one by one."""
    before, ends = _drawn(client), time.monotonic() + PATIENCE
    while time.monotonic() < ends:
        time.sleep(SETTLED)
        now = _drawn(client)
        if np.ptp(now) and np.array_equal(now, before):
            return
        before = now
    raise ExportError(f"the browser did not draw the view within {PATIENCE:.0f} s; try again on a less busy machine.")


def _drawn(client: viser.ClientHandle) -> NDArray[np.uint8]:
    try:
        return client.get_render(HEIGHT, WIDTH, transport_format="jpeg", timeout=PATIENCE)[:, :, :3]
    except Exception as error:  # whatever the connection raises
        raise ExportError(f"the browser did not draw the view ({error}); try again on a less busy machine.") from error


def _check_name(path: Path, suffix: str) -> None:
    if path.suffix.lower() != suffix:
        raise UsageError(f"{path}: name a file that ends in {suffix}.")
