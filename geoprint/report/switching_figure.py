"""Static figure: when material is laid, when it flows, when the lamp is on and when a vacuum draws."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from geoprint.model import FloatArray
from geoprint.report.figures import DOTS_PER_INCH, add_title, png_bytes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Dark enough on white, and apart for colour-blind readers.
COLOURS = ("#7a7a7a", "#0072b2", "#e69f00", "#009e73")
LABELS = ("planned deposit", "material flows", "lamp is on", "vacuum draws")
# What is shown before and after the ends of a run [s].
AROUND = 0.3
BAR = 0.7


def switching_figure(
    deposits: FloatArray, material: FloatArray, lamp: FloatArray, vacuum: FloatArray, *, title: str
) -> bytes:
    """Draw the whole program above, and the beginning and the end of its longest run below.

    Args:
        deposits: (d, 2) when each planned deposit begins and ends [s].
        material: (d, 2) when material begins and ends to flow [s].
        lamp: (l, 2) when the lamp is on [s].
        vacuum: (v, 2) when the vacuum draws material back [s]; without any the figure has no row for it.
        title: above everything.

    Returns:
        The PNG's bytes; the same for the same input.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.4, 4.2), dpi=DOTS_PER_INCH, layout="constrained")
    grid = figure.add_gridspec(2, 2)
    longest = int(np.argmax(np.diff(deposits, axis=1)[:, 0]))
    start, end = deposits[longest].tolist()
    spans = (deposits, material, lamp, vacuum) if vacuum.size else (deposits, material, lamp)
    panels: list[tuple[Axes, str, tuple[float, float]]] = [
        (figure.add_subplot(grid[0, :]), "whole program", (0.0, float(max(span.max() for span in spans)) * 1.01)),
        (figure.add_subplot(grid[1, 0]), f"where run {longest + 1} begins", (start - AROUND, start + AROUND)),
        (figure.add_subplot(grid[1, 1]), f"where run {longest + 1} ends", (end - AROUND, end + AROUND)),
    ]
    for axis, name, limits in panels:
        for row, (span, colour) in enumerate(zip(spans, COLOURS, strict=False)):
            bars = [(first, last - first) for first, last in span.tolist()]
            axis.broken_barh(bars, (row - BAR / 2, BAR), facecolors=colour)
        axis.set_yticks(range(len(spans)), LABELS[: len(spans)], fontsize=9)
        axis.set_ylim(len(spans) - 0.5, -0.5)
        axis.set_xlim(*limits)
        axis.set_xlabel("time [s]", fontsize=9)
        axis.set_title(name, fontsize=10, loc="left")
    for axis, moment in ((panels[1][0], start), (panels[2][0], end)):
        axis.axvline(moment, color="black", linewidth=0.8)
    add_title(figure, title, font_size=11.0)
    return png_bytes(figure)
