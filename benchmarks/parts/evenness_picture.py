"""The README's picture of evenness: one row a part, one dot a backend, on a logarithmic axis."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

# Of Okabe and Ito, safe for colour-blind readers; shapes tell the backends apart in grey.
STYLES = (("#D55E00", "o"), ("#0072B2", "s"), ("#009E73", "^"))
TICKS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
ROW_INCHES = 0.24
DOTS_PER_INCH = 160


def evenness_picture(cvs: Mapping[str, Mapping[str, float]], *, nearly_flat: int, backends: Sequence[str]) -> bytes:
    """Return a PNG, the same bytes for the same input.

    Args:
        cvs: part to backend to coefficient of variation of the thickness; from nearly flat to strongly curved.
        nearly_flat: how many of the first parts are nearly flat; a line divides them from the others.
        backends: which to draw, at most three.
    """
    figure = Figure(figsize=(7.2, ROW_INCHES * len(cvs) + 1.1), dpi=DOTS_PER_INCH, layout="constrained")
    axis = figure.subplots()
    for row, found in enumerate(cvs.values()):
        shown = [100.0 * found[name] for name in backends if name in found]
        axis.plot([min(shown), max(shown)], [row, row], color="#c8c8c8", linewidth=1.0, zorder=1)
    for name, (colour, marker) in zip(backends, STYLES, strict=False):
        rows = [row for row, found in enumerate(cvs.values()) if name in found]
        values = [100.0 * found[name] for found in cvs.values() if name in found]
        axis.plot(values, rows, marker, color=colour, markersize=6, label=name, markeredgecolor="white", zorder=2)
        for row, found in enumerate(cvs.values()):
            if name not in found:
                axis.annotate(
                    f"{name} refuses", (1.0, row), xycoords=("axes fraction", "data"), xytext=(-4, 0),
                    textcoords="offset points", ha="right", va="center", fontsize=9, color=colour,
                )  # fmt: skip
    axis.set_yticks(range(len(cvs)), [part.replace("_", " ") for part in cvs], fontsize=9, parse_math=False)
    axis.set_ylim(len(cvs) - 0.4, -0.6)
    if 0 < nearly_flat < len(cvs):
        axis.axhline(nearly_flat - 0.5, color="#808080", linewidth=0.8, linestyle="--")
        for place, side, text in ((nearly_flat - 0.5, "bottom", "nearly flat"), (nearly_flat - 0.45, "top", "curved")):
            axis.annotate(
                text, (1.0, place), xycoords=("axes fraction", "data"), xytext=(-4, 0), textcoords="offset points",
                ha="right", va=side, fontsize=9, color="#606060",
            )  # fmt: skip
    axis.set_xscale("log")
    axis.xaxis.set_major_locator(FixedLocator(TICKS))
    axis.xaxis.set_minor_locator(NullLocator())
    axis.xaxis.set_major_formatter(FixedFormatter([f"{tick:g}" for tick in TICKS]))
    axis.tick_params(axis="x", labelsize=9)
    axis.tick_params(axis="y", length=0)
    axis.grid(axis="x", color="#e8e8e8", linewidth=0.7)
    axis.set_axisbelow(True)
    axis.set_xlabel("layer thickness, variation (CV), % (less is more even)", fontsize=10)
    figure.legend(loc="outside upper center", ncols=len(backends), fontsize=10, frameon=False)
    for side in ("top", "right", "left"):
        axis.spines[side].set_visible(False)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()
