"""Pictures of an appraisal: what was found, drawn over each photograph, and its edges as the paper shows them."""

from __future__ import annotations

import io
from itertools import pairwise

import numpy as np

from geoprint.appraisal import Appraisal, AppraisedPhotograph, BeadLine, edges
from geoprint.model import BoolArray, FloatArray, IntArray
from geoprint.report.overlay import Overlay, overlay_picture, shown_scale

# Each place of an outline is drawn as a short line [pixels].
DASH = np.array([[-1.5, 0.0], [1.5, 0.0]])


def appraisal_pictures(found: Appraisal) -> dict[str, bytes]:
    """Return name and PNG of two pictures a photograph, by their numbers from 1."""
    pictures: dict[str, bytes] = {}
    for number, each in enumerate(found.photographs, start=1):
        pictures[f"overlay-{number}.png"] = photograph_overlay(each)
        pictures[f"edges-{number}.png"] = edge_picture(each)
    return pictures


def photograph_overlay(each: AppraisedPhotograph) -> bytes:
    """Return a PNG: the photograph with edges, middles and breaks of its beads, and what is missing of the plan."""
    missing: list[FloatArray] = []
    outline: FloatArray = np.zeros((0, 2), dtype=np.float64)
    if each.on_plan is not None:
        held = each.on_plan.held
        bare = held.judged & ~held.seen
        pixels = each.on_plan.camera.seen(held.plan.places)
        missing = [pixels[rows] for rows in _stretches(bare, held.plan.runs)]
        placing = each.on_plan.camera.outline
        outline = outline if placing is None else placing.pixels
    return overlay_picture(
        each.photograph.grey,
        Overlay(
            middles=tuple(part for bead in each.beads for part in _parts(bead.middles, bead)),
            edges=tuple(
                part for bead in each.beads for side in (bead.lefts, bead.rights) for part in _parts(side, bead)
            ),
            breaks=tuple(
                bead.middles[max(first - 1, 0) : last + 2] for bead in each.beads for first, last in bead.breaks
            ),
            missing=tuple(missing),
            outline=tuple(place + DASH for place in outline),
        ),
        title=each.photograph.name,
    )


def edge_picture(each: AppraisedPhotograph) -> bytes:
    """Return a PNG: white where |dI/dx| + |dI/dy| of the photograph in even light is above its threshold."""
    from PIL import Image

    grey = each.photograph.grey
    scale = shown_scale(grey)
    small = Image.fromarray((255.0 * grey).astype(np.uint8))
    small = small.resize([max(1, round(scale * side)) for side in small.size])
    found = edges(np.asarray(small, dtype=np.float64) / 255.0, width=scale * each.width)
    written = io.BytesIO()
    Image.fromarray(np.where(found, 255, 0).astype(np.uint8)).save(written, format="PNG", optimize=True)
    return written.getvalue()


def _parts(line: FloatArray, bead: BeadLine) -> list[FloatArray]:
    """Return what is seen of a line, stretch by stretch."""
    return [line[rows] for rows in _stretches(bead.seen, np.zeros(bead.seen.size, dtype=np.int64))]


def _stretches(marked: BoolArray, owners: IntArray) -> list[slice]:
    """Return the rows of each stretch that is marked and of one owner."""
    ends = np.flatnonzero(
        np.diff(marked.astype(np.int64), prepend=0, append=0) | np.diff(owners, prepend=-1, append=-1)
    )
    return [slice(a, b) for a, b in pairwise(ends.tolist()) if marked[a]]
