"""The guide's picture of how far a program is proven."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from pathlib import Path

from matplotlib.patches import Rectangle

from benchmarks.guide.shaded import BLUE, GREY, ORANGE, bare, panels, small_png
from geoprint.account.evidence import WORDS

# Each step stands so much higher than the one before, and is so wide.
RISE, WIDTH = 0.55, 1.9


def again(_data: Path) -> bytes:
    """Draw the steps from a program that was read back to one that printed, and who says so."""
    figure, (axis,) = panels(1, width=7.6, height=3.6)
    steps = [("parsed", BLUE), ("executed", BLUE), *((word, ORANGE) for word in WORDS.values())]
    for number, (word, colour) in enumerate(steps):
        left, top = number * WIDTH, (number + 1) * RISE
        axis.add_patch(Rectangle((left, 0.0), WIDTH - 0.06, top, color=colour, alpha=0.35 + 0.1 * number))
        axis.annotate(
            word.replace(" on a ", "\non a ").replace("virtual ", "virtual\n"), (left + WIDTH / 2, top + 0.08),
            ha="center", va="bottom", fontsize=9,
        )  # fmt: skip
    for text, first, last in (("geoprint itself", 0, 2), ("a person who saw it", 2, len(steps))):
        axis.annotate(text, ((first + last) / 2 * WIDTH, -0.3), ha="center", va="center", fontsize=10)
        axis.plot([first * WIDTH + 0.1, last * WIDTH - 0.16], [-0.12, -0.12], color=GREY, linewidth=1.5)
    axis.set_xlim(-0.1, len(steps) * WIDTH + 0.1)
    axis.set_ylim(-0.5, len(steps) * RISE + 0.3)
    bare(axis)
    axis.set_aspect("auto")
    return small_png(figure)
