"""The guide's picture of the paper's three prints: photographs made in silico, and their edge images below."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import io
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

from benchmarks.guide.shaded import DOTS_PER_INCH
from benchmarks.paper.__main__ import PARTS, SEED
from benchmarks.paper.comparing import Compared, compared
from benchmarks.paper.printing import fixed_printing
from benchmarks.paper.prints import studio_of
from geoprint.model import PASCAL_PER_KPA

# Of the figure [inches].
WIDTH, HEIGHT = 4.8, 3.4
# Greys that the picture keeps: the grain of the photographs would fill a larger file with more.
GREYS = 16


def paper(data: Path) -> bytes:
    """Draw the prints of Table I on the free wall of the heart, as all that the paper does not say is fixed."""
    studio = studio_of(data / PARTS[0], body=data / "heart.ply")
    return paper_picture(compared(studio, fixed_printing(), seed=SEED))


def paper_picture(found: Compared) -> bytes:
    """Draw three photographs, and below them what is compared."""
    figure = Figure(figsize=(WIDTH, HEIGHT), dpi=DOTS_PER_INCH, layout="constrained")
    above, below = figure.subplots(2, len(found.prints))
    for axis, under, each, edges in zip(above, below, found.prints, found.edges, strict=True):
        case = each.case
        axis.imshow(each.grey, cmap="gray", vmin=0.0, vmax=1.0)
        axis.set_title(f"{case.name}: {case.pressure / PASCAL_PER_KPA:g} kPa, {case.rounds} rounds", fontsize=9)
        under.imshow(edges, cmap="gray_r", vmin=0.0, vmax=1.0)
        for one in (axis, under):
            one.axis("off")
    drawn, written = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", metadata={"Software": None})
    grey = Image.open(drawn).convert("L")
    grey.quantize(GREYS, dither=Image.Dither.NONE).save(written, format="png", optimize=True)
    return written.getvalue()
