"""Photographs of 21 printed lines, their masks, and other lightings of the same."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PIL import Image

from geoprint.model import BoolArray, FloatArray

# Lines between two rails of a frame, which are lines of the mask as well.
LINES, RAILS = 21, 2
# No line is thicker in the mask [pixels]; what is thicker is the frame seen along a rail.
THICKEST = 60
# A middle nearer than this to that of the mask is right [pixels], and a line is found where so much of it is.
RIGHT, FOUND_SHARE = 3.0, 0.8
PHOTOGRAPHS = ("pacamera_black_frame45_4-5", "pacamera_gold_frame50_4-5")


def reference_lines(mask: BoolArray) -> list[FloatArray]:
    """Return of each of the 21 lines the (k, 2) middles (u, v), where a column of the mask shows all of them.

    Args:
        mask: (h, w) white of the supplied mask.
    """
    found: list[tuple[int, FloatArray]] = []
    for column in range(mask.shape[1]):
        steps = np.diff(np.concatenate([[0], mask[:, column].astype(np.int64), [0]]))
        starts, ends = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
        thin = ends - starts <= THICKEST
        middles: FloatArray = (0.5 * (starts + ends - 1.0))[thin].astype(np.float64)
        if middles.size == LINES + RAILS:
            found.append((column, middles[1:-1]))
    columns = np.array([column for column, _ in found], dtype=np.float64)
    rows = np.array([middles for _, middles in found]).reshape(-1, LINES)
    return [np.column_stack([columns, rows[:, line]]) for line in range(LINES)]


def judged(middles: FloatArray, lines: list[FloatArray]) -> tuple[int, float]:
    """Return how many lines are found, and which share of the length of all has a middle within 3 pixels.

    Lines run about along u: at each column the nearest middle within half a pixel of it counts.

    Args:
        middles: (n, 2) that were found.
        lines: of the mask.
    """
    order = middles[np.argsort(middles[:, 0])]
    shares: list[float] = []
    for line in lines:
        firsts = np.searchsorted(order[:, 0], line[:, 0] - 1.0)
        lasts = np.searchsorted(order[:, 0], line[:, 0] + 1.0)
        misses = [
            np.abs(order[first:last, 1] - row).min(initial=np.inf)
            for first, last, row in zip(firsts, lasts, line[:, 1], strict=True)
        ]
        shares.append(float((np.array(misses) <= RIGHT).mean()))
    return sum(share >= FOUND_SHARE for share in shares), float(np.mean(shares))


def lightings(grey: FloatArray) -> Mapping[str, FloatArray]:
    """Return a photograph as it is and under other lights: darker, with another gamma, with light from one side.

    Args:
        grey: (h, w).
    """
    height, width = grey.shape
    down, right = np.linspace(0.0, 1.0, height)[:, None], np.linspace(0.0, 1.0, width)[None, :]
    return {
        "as taken": grey,
        "darker by half": 0.5 * grey,
        "gamma 1.8": grey**1.8,
        "from the left, 3 to 1": grey * (1.0 - 0.66 * right),
        "from above, 1 to 3": np.clip(grey * (0.4 + 0.8 * down), 0.0, 1.0),
    }


def mask_of(path: Path) -> BoolArray:
    """Return (h, w) what is white in a mask."""
    return np.asarray(np.asarray(Image.open(path).convert("L")) > 127)
