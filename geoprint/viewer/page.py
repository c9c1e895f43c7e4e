"""What every page of the view has: a server that this machine alone reaches, light, camera, tables and plots.

Plots show a motion over time as SVG: joints, speed of the tip and flow, with their limits. A click in a plot writes its
moment into the field that holds the time of the replay: what the panel draws of numbers reports no clicks by itself.
"""

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
from collections.abc import Sequence
from typing import NamedTuple

from geoprint.model import IntArray
from geoprint.viewer.loaded import ViewedPlan

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


# Label of the field that a click writes into.
TIME_FIELD: Final = "Time [s]"
# Places along a plot: finer than its pixels.
COLUMNS: Final = 280
WIDTH, HEIGHT, LEFT, BOTTOM = 300, 92, 34, 14
COLOURS: Final = ("#1f77b4", "#d95f02", "#1b9e77", "#7570b3", "#e7298a", "#666666")
# React keeps a field's value itself: it has to be set past it, and an event has to follow.
_JUMP: Final = (
    "const box=this.getBoundingClientRect();"
    "const share=Math.min(Math.max(((event.clientX-box.left)/box.width*{width}-{left})/{inner},0),1);"
    "const label=[...document.querySelectorAll('label')].find((one)=>one.textContent.trim()==='{field}');"
    "const field=document.getElementById(label.htmlFor);"
    "Object.getOwnPropertyDescriptor(HTMLInputElement.prototype,'value').set.call(field,(share*{end}).toFixed(3));"
    "field.dispatchEvent(new Event('input',{{bubbles:true}}));field.dispatchEvent(new Event('blur',{{bubbles:true}}));"
)


class Plot(NamedTuple):
    """Values over time.

    Attributes:
        title: what they are, with the unit.
        names: of the lines.
        lines: (k,) values of each.
        limits: values at which a dashed line is drawn.
    """

    title: str
    names: tuple[str, ...]
    lines: tuple[FloatArray, ...]
    limits: tuple[float, ...] = ()


def plots_of(plan: ViewedPlan) -> tuple[FloatArray, tuple[Plot, ...]]:
    """Return the (k,) moments of a print [s], and joints, speed of the tip and flow there."""
    motions = plan.motions
    cell, tables = motions[0].setup.cell, [motion.table for motion in motions]
    times = np.concatenate([plan.moment(number, 0.0) + table.times for number, table in enumerate(tables)])
    joints = np.concatenate([table.joints for table in tables])
    shares = joints / np.where(joints >= 0.0, cell.robot.limits[:, 1], -cell.robot.limits[:, 0])
    speeds = np.concatenate([motion.speeds * motion.table.deposit for motion in motions])
    flows = np.concatenate([np.interp(motion.table.times, motion.pose_times, motion.poses.flow) for motion in motions])
    plots = (
        Plot(
            "joints 1 to 6, share of their limits",
            tuple(str(axis) for axis in range(1, 7)),
            tuple(shares.T),
            (-1.0, 1.0),
        ),
        Plot("tip on deposit [mm/s]", ("speed",), (speeds,), (cell.process.speed,)),
        Plot("flow wanted [mm3/s]", ("flow",), (flows * speeds,)),
    )
    return times, plots


def plot_html(times: FloatArray, plot: Plot) -> str:
    """Return a plot as HTML; each column shows the values of its moment that lie farthest apart."""
    end = float(times[-1])
    columns = np.floor(times / end * (COLUMNS - 1)).astype(np.int64)
    starts = np.flatnonzero(np.diff(columns, prepend=-1))
    pieces = list(
        zip((columns[starts] / (COLUMNS - 1)).tolist(), np.split(np.arange(times.size), starts[1:]), strict=True)
    )
    every = np.concatenate([*plot.lines, np.array(plot.limits)])
    low, high = float(min(every.min(), 0.0)), float(every.max())
    high = high if high > low else low + 1.0
    inner = WIDTH - LEFT - 4

    def at(share: float, value: float) -> str:
        return f"{LEFT + inner * share:.1f},{4 + (HEIGHT - BOTTOM - 4) * (high - value) / (high - low):.1f}"

    drawn = [_line(pieces, line, colour, at) for line, colour in zip(plot.lines, COLOURS, strict=False)]
    for limit in plot.limits:
        ends = [at(0.0, limit), at(1.0, limit)]
        drawn.append(f'<polyline points="{" ".join(ends)}" stroke="#b2182b" stroke-dasharray="4 3" fill="none"/>')
    text = 'font-size="10" fill="currentColor"'
    for value in (low, high):
        x, y = at(0.0, value).split(",")
        drawn.append(f'<text x="{float(x) - 3}" y="{float(y) + 4}" text-anchor="end" {text}>{value:.3g}</text>')
    drawn.append(f'<text x="{WIDTH - 4}" y="{HEIGHT - 2}" text-anchor="end" {text}>{end:.1f} s</text>')
    jump = _JUMP.format(width=WIDTH, left=LEFT, inner=inner, end=end, field=TIME_FIELD)
    keys = " ".join(
        f'<span style="color:{colour}">{escape(name)}</span>'
        for name, colour in zip(plot.names, COLOURS, strict=False)
        if len(plot.names) > 1
    )
    return (
        f'<div class="geoprint-plot" style="padding:0 12px 6px;font-size:12px">{escape(plot.title)} {keys}'
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" style="width:100%;cursor:pointer" onclick="{escape(jump)}">'
        f"{''.join(drawn)}</svg></div>"
    )


def _line(
    pieces: Sequence[tuple[float, IntArray]], values: FloatArray, colour: str, at: Callable[[float, float], str]
) -> str:
    places: list[str] = []
    for share, rows in pieces:
        some = values[rows]
        places += [at(share, float(some.min())), at(share, float(some.max()))]
    return f'<polyline points="{" ".join(places)}" stroke="{colour}" fill="none"/>'
