"""The README's picture of speed: seconds over size, geoprint beside its peers."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator, StrMethodFormatter

from benchmarks.whole.figures import Pair

PICTURE = Path(__file__).parents[2] / ".github/images/speed.png"
# What a work's name begins with, what is above its panel, and what its sizes count.
PANELS = (
    ("distance", "geodesic distance", "faces"),
    ("levels", "distance and 20 levels of an image", "pixels across"),
    ("speeds", "speeds along a path", "poses"),
)
# What is imported under another name than people know it by.
PEERS = {"igl": "libigl", "scipy + contourpy": "scipy and contourpy"}
# Of Okabe and Ito, safe for colour-blind readers; shapes tell the lines apart in grey.
OURS = (("#0072B2", "o-"), ("#009E73", "s-"))
OTHERS = (("#D55E00", "^--"), ("#E69F00", "v--"))
DOTS_PER_INCH = 130


def speed_picture(found: Sequence[Pair]) -> bytes:
    """Return a PNG, the same bytes for the same figures."""
    figure = Figure(figsize=(11.0, 3.4), dpi=DOTS_PER_INCH, layout="constrained")
    axes: Sequence[Axes] = figure.subplots(1, len(PANELS))
    for axis, (word, title, counted) in zip(axes, PANELS, strict=True):
        pairs = [pair for pair in found if pair.work.startswith(word)]
        ours = _lines((_name(pair), pair.size, pair.own) for pair in pairs)
        others = _lines((PEERS.get(pair.library, pair.library), pair.size, pair.other) for pair in pairs)
        for lines, styles in ((ours, OURS), (others, OTHERS)):
            for (name, seconds), (colour, style) in zip(lines.items(), styles, strict=False):
                axis.plot(
                    list(seconds), list(seconds.values()), style, color=colour, markersize=5, linewidth=1.4, label=name
                )
        axis.set(xscale="log", yscale="log")
        sizes = sorted({pair.size for pair in pairs})
        axis.xaxis.set_major_locator(FixedLocator(sizes))
        axis.xaxis.set_major_formatter(FixedFormatter([f"{size:,}".replace(",", " ") for size in sizes]))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_title(title, fontsize=10)
        axis.set_xlabel(counted, fontsize=9)
        axis.tick_params(labelsize=8)
        axis.grid(color="#e8e8e8", linewidth=0.7)
        axis.set_axisbelow(True)
        axis.legend(fontsize=8, frameon=False)
        for side in ("top", "right"):
            axis.spines[side].set_visible(False)
    axes[0].set_ylabel("seconds", fontsize=9)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _name(pair: Pair) -> str:
    """Return what geoprint's line is called: with the backend, where the work names one."""
    return ", ".join(["geoprint", *pair.work.split(", ")[1:]])


def _lines(points: Iterable[tuple[str, int, float]]) -> dict[str, dict[int, float]]:
    """Return the seconds of each size, line by line; the least where a size stands twice."""
    lines: dict[str, dict[int, float]] = {}
    for name, size, seconds in points:
        line = lines.setdefault(name, {})
        line[size] = min(seconds, line.get(size, seconds))
    return lines
