"""Plots over the time of a motion as SVG: joints, speed of the tip and flow, with their limits.

A click in a plot writes its moment into the field that holds the time of the replay: what the panel draws of numbers
reports no clicks by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from typing import Final, NamedTuple

import numpy as np

from geoprint.model import FloatArray, IntArray
from geoprint.viewer.loaded import ViewedPlan

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
