"""What every page of the view has: a server that this machine alone reaches, light, camera, and tables of figures."""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator
from contextlib import contextmanager, redirect_stdout
from html import escape
from io import StringIO
from typing import TYPE_CHECKING, Final

import numpy as np

from geoprint.geometry.native import missing
from geoprint.model import FloatArray
from geoprint.reporting.colouring import Scale

if TYPE_CHECKING:
    import viser

# Only this machine can open the page; on the next port where this one is taken.
HOST: Final = "127.0.0.1"
PORT: Final = 8080


@contextmanager
def served(port: int, *, label: str) -> Generator[viser.ViserServer]:
    """Serve a page that only this machine reaches.

    Args:
        port: of the page; another one if it is taken.
        label: in the title of the browser.

    Raises:
        UsageError: viser is not installed.
    """
    try:
        import viser
    except ImportError as error:
        raise missing("viser", extra="view", work="the live view") from error
    # A browser opens connections that it does not use; each would be reported as a failure.
    logging.getLogger("websockets").setLevel(logging.CRITICAL)
    # What viser says of itself does not belong on stdout, where results go.
    with redirect_stdout(StringIO()):
        server = viser.ViserServer(host=HOST, port=port, label=label, verbose=False)
    try:
        # It is computed for seconds where no graphics card is.
        server.scene.configure_environment_map(hdri=None)
        server.scene.configure_default_lights(enabled=False)
        yield server
    finally:
        with redirect_stdout(StringIO()):
            server.stop()


def address(server: viser.ViserServer) -> str:
    """Return where a page is."""
    return f"http://{HOST}:{server.get_port()}"


def on_ray(server: viser.ViserServer, call: Callable[[FloatArray, FloatArray], None]) -> None:
    """Call with start and direction of the ray (3,) of each click in a scene; nothing else hears of clicks then."""
    server.scene.remove_click_callback("all")  # pyright: ignore[reportUnknownMemberType]
    server.scene.on_click()(lambda event: call(np.array(event.ray_origin), np.array(event.ray_direction)))


def open_panel(server: viser.ViserServer, title: str) -> None:
    """Begin the panel of a page, to the right of the scene, with a choice between light and dark."""

    def themed(*, dark: bool) -> None:
        server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False, dark_mode=dark)

    themed(dark=False)
    server.gui.main_panel.dock_right()
    server.gui.set_panel_label(f"geoprint: {title}")
    dark = server.gui.add_checkbox("Dark", initial_value=False)
    dark.on_update(lambda _: themed(dark=dark.value))


def light(server: viser.ViserServer, upright: FloatArray) -> None:
    """Light a scene plainly from above; rows of (3, 3) `upright` are its right, its depth and its height."""
    server.scene.set_up_direction(tuple(upright[2].tolist()))
    server.scene.add_light_ambient("/lights/all", intensity=3.0)
    towards = upright.T @ np.array([0.4, -0.6, 1.0])
    server.scene.add_light_directional("/lights/key", intensity=1.4, position=tuple((1000.0 * towards).tolist()))


def look(server: viser.ViserServer, middle: FloatArray, upright: FloatArray, *, distance: float) -> None:
    """Let a page open with a view of a place (3,) from such a distance [mm]."""
    towards = upright.T @ np.array([0.0, -0.75, 0.75])
    camera = server.initial_camera
    camera.up, camera.look_at = upright[2], middle
    camera.position, camera.near, camera.far = middle + distance * towards, 0.01 * distance, 100.0 * distance


def scale_html(scale: Scale) -> str:
    """Return a colour scale as HTML."""
    ramp = ", ".join(f"{colour} {100 * place:.1f}%" for place, colour in scale.colours)
    ticks = "".join(
        f'<text x="{300.0 * place:.0f}" y="11" font-size="11" fill="currentColor" text-anchor="{_anchor(place)}">'
        f"{escape(words)}</text>"
        for place, words in scale.ticks
    )
    return (
        f'<div style="padding:4px 12px;font-size:12px"><b>{escape(scale.title)}</b>'
        f'<div style="height:12px;border-radius:2px;background:linear-gradient(90deg, {ramp})"></div>'
        f'<svg viewBox="0 0 300 15" style="overflow:visible">{ticks}</svg><small>{escape(scale.legend)}</small></div>'
    )


def _anchor(place: float) -> str:
    """Return which end of a text stands at a place of a scale, so that it stays within."""
    return "start" if place < 0.1 else "end" if place > 0.9 else "middle"


def table_html(rows: list[tuple[str, str]]) -> str:
    """Return names and values as HTML."""
    cells = "".join(
        f'<tr><td style="padding-right:12px">{escape(name)}</td>'
        f'<td style="text-align:right"><b>{escape(value)}</b></td></tr>'
        for name, value in rows
    )
    return f'<table style="margin:4px 12px;font-size:12px">{cells}</table>'
