"""The picture of the yardstick: a row for each planner, a dot for each part."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import io
from collections.abc import Sequence
from statistics import median

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

from benchmarks.field.figures import Figures

# Of Okabe and Ito, safe for colour-blind readers.
OURS, OTHERS = "#0072B2", "#D55E00"
TICKS = (0.02, 0.1, 0.5, 2.0, 10.0, 50.0)
LABELS = (
    "layer thickness, variation (CV), %", "the same with a flow that follows, %", "area missed + covered twice, %"
)  # fmt: skip
# What is less than this is drawn here [%].
LEAST = 0.02
ROW_INCHES = 0.3
DOTS_PER_INCH = 110


def field_picture(found: Sequence[Figures]) -> bytes:
    """Return a PNG, the same bytes for the same figures; planners from the most even down."""
    planned = [each for each in found if not each.refused]
    by_planner = {name: [each for each in planned if each.planner == name] for name in {e.planner for e in planned}}
    order = sorted(by_planner, key=lambda name: (median(_values(by_planner[name])[0]), name))
    figure = Figure(figsize=(11.0, ROW_INCHES * len(order) + 1.2), dpi=DOTS_PER_INCH, layout="constrained")
    panels: Sequence[Axes] = figure.subplots(1, 3, sharey=True)
    for row, name in enumerate(order):
        colour = OURS if by_planner[name][0].ours else OTHERS
        for axis, values in zip(panels, _values(by_planner[name]), strict=True):
            axis.plot(values, [row] * len(values), "o", color=colour, alpha=0.45, markersize=5, markeredgewidth=0)
            axis.plot([median(values)], [row], "|", color=colour, markersize=15, markeredgewidth=2.5)
    for axis, label in zip(panels, LABELS, strict=True):
        axis.set_xscale("log")
        axis.xaxis.set_major_locator(FixedLocator(TICKS))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.xaxis.set_major_formatter(FixedFormatter([f"{tick:g}" for tick in TICKS]))
        axis.grid(axis="x", color="#e8e8e8", linewidth=0.7)
        axis.set_axisbelow(True)
        axis.set_xlabel(label, fontsize=10)
        axis.tick_params(axis="both", labelsize=9)
        axis.tick_params(axis="y", length=0)
        for side in ("top", "right", "left"):
            axis.spines[side].set_visible(False)
    parts, served = len({each.part for each in found}), [len(by_planner[name]) for name in order]
    panels[0].set_yticks(
        range(len(order)),
        [f"{name}{'' if n == parts else f' ({n} of {parts} parts)'}" for name, n in zip(order, served, strict=True)],
    )
    panels[0].set_ylim(len(order) - 0.4, -0.6)
    figure.suptitle("geoprint (blue) and others (orange): a dot a part, a bar the median", fontsize=10)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _values(found: Sequence[Figures]) -> tuple[list[float], list[float], list[float]]:
    """Return variation of the thickness with a constant flow and with one that follows, and the area not once [%]."""
    shares = [(each.thickness_cv, each.following_cv, each.gap + each.overlap) for each in found]
    even, following, area = ([max(100.0 * share, LEAST) for share in column] for column in zip(*shares, strict=True))
    return even, following, area
