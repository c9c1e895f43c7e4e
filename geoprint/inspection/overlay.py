"""Lines drawn over a photograph, and below it what their colours mean."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.model import FloatArray, frozen

if TYPE_CHECKING:
    from PIL.Image import Image as Shown

# Longer sides of a photograph are shown with so many pixels.
MOST_SHOWN = 1600
# Grey values are pressed together, so that lines of colour stand out on white as on black.
DARKEST, LIGHTEST = 10.0, 175.0
# Of Okabe and Ito, safe for colour-blind readers.
COLOURS = {
    "middles": "#D55E00", "edges": "#56B4E9", "breaks": "#F0E442", "missing": "#CC79A7", "outline": "#009E73",
}  # fmt: skip
MEANINGS = {
    "middles": "middle", "edges": "edge", "breaks": "break of a line", "missing": "planned, not there",
    "outline": "outline of the part",
}  # fmt: skip
# Lines are wider in larger pictures: one pixel for so many.
PIXELS_A_WIDTH = 700
# Letters, over the longer side, within what can be read.
LETTER_SHARE, SMALLEST_LETTER, LARGEST_LETTER = 1.0 / 50.0, 11, 26


@final
@frozen
class Overlay:
    """What is drawn over a photograph, as lines of (k, 2) pixels (u, v) of it.

    Attributes:
        middles: of beads.
        edges: of beads.
        breaks: where a line has no material.
        missing: of the plan, where there is no material.
        outline: of the part, where the camera that it placed sees it.
    """

    middles: tuple[FloatArray, ...]
    edges: tuple[FloatArray, ...]
    breaks: tuple[FloatArray, ...]
    missing: tuple[FloatArray, ...]
    outline: tuple[FloatArray, ...]


def shown_scale(grey: FloatArray) -> float:
    """Return pixels of the picture for one of a photograph of (h, w) grey values, at most 1."""
    return min(1.0, MOST_SHOWN / max(grey.shape))


def overlay_picture(grey: FloatArray, overlay: Overlay, *, title: str) -> bytes:
    """Return a PNG: a photograph in grey with lines over it, and a legend below.

    Args:
        grey: (h, w) from 0 to 1.
        overlay: what is drawn.
        title: at the beginning of the legend.
    """
    from PIL import Image, ImageDraw

    scale = shown_scale(grey)
    pressed = Image.fromarray((DARKEST + (LIGHTEST - DARKEST) * grey).astype(np.uint8))
    shown = pressed.resize([max(1, round(scale * side)) for side in pressed.size]).convert("RGB")
    draw = ImageDraw.Draw(shown)
    wide = max(1, round(max(shown.size) / PIXELS_A_WIDTH))
    for name, thicker in (("edges", 0), ("middles", 0), ("breaks", 1), ("missing", 2), ("outline", 0)):
        lines: Sequence[FloatArray] = getattr(overlay, name)
        for line in lines:
            points = [(float(u), float(v)) for u, v in (line + 0.5) * scale - 0.5]
            if len(points) > 1:
                draw.line(points, fill=COLOURS[name], width=wide + thicker, joint="curve")
    kinds = [name for name in COLOURS if getattr(overlay, name)]
    written = io.BytesIO()
    _with_legend(shown, kinds, title=title).save(written, format="PNG", optimize=True)
    return written.getvalue()


def _with_legend(shown: Shown, kinds: Sequence[str], *, title: str) -> Shown:
    """Return a picture with a strip below it that says what colours mean, in as many lines as it takes."""
    from PIL import Image, ImageDraw, ImageFont

    letter = int(np.clip(LETTER_SHARE * max(shown.size), SMALLEST_LETTER, LARGEST_LETTER))
    font = ImageFont.load_default(size=letter)
    row, left = round(1.6 * letter), letter // 2
    placed: list[tuple[int, int, str | None, str]] = []
    x, y = left, 0
    for colour, text in ((None, title), *((COLOURS[kind], MEANINGS[kind]) for kind in kinds)):
        mark = 0 if colour is None else 2 * letter
        width = round(mark + font.getlength(text) + letter)
        if x > left and x + width > shown.width:
            x, y = left, y + row
        placed.append((x, y, colour, text))
        x += width
    full = Image.new("RGB", (shown.width, shown.height + y + row), "white")
    full.paste(shown, (0, 0))
    draw = ImageDraw.Draw(full)
    for x, y, colour, text in placed:
        top, mark = shown.height + y, 0
        if colour is not None:
            mark = 2 * letter
            draw.rectangle((x, top + 0.6 * row, x + 1.6 * letter, top + 0.6 * row + letter / 4), fill=colour)
        draw.text((x + mark, top + 0.12 * row), text, fill="black", font=font)
    return full
