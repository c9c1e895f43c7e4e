"""How finely the numbers of a file tell where a mesh lies, and whether that is fine enough."""

from __future__ import annotations

import re

import numpy as np

from geoprint.model import FloatArray

# Where the steps between neighbouring coordinates exceed this share of the part's size, vertices of a fine mesh fall
# together: in single precision a part of 40 mm may lie up to 33 m from the origin.
RESOLUTION_SHARE = 1e-4
# So much of a text tells how its numbers are written [bytes].
SAMPLE = 1 << 16
WRITTEN = re.compile(rb"[-+]?\d+\.(\d+)(?:[eE]([-+]?\d{1,3}))?")


def single_step(vertices: FloatArray) -> float:
    """Return the step between neighbouring numbers of single precision as large as the largest coordinate."""
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.spacing(np.float32(np.abs(vertices).max(initial=0.0))))


def written_step(text: bytes, vertices: FloatArray) -> float:
    """Return the step that the decimals leave with which a text writes its largest coordinates.

    It is never more than that of single precision: round numbers with few decimals are meant.
    """
    least = 0.5 * float(np.abs(vertices).max(initial=0.0))
    found = [one for one in WRITTEN.finditer(text[:SAMPLE]) if abs(float(one[0])) >= least]
    return min([single_step(vertices), *(10.0 ** (int(one[2] or 0) - len(one[1])) for one in found)])


def resolves(step: float, vertices: FloatArray) -> bool:
    """Return whether steps are small enough for the extent of a mesh."""
    return step <= RESOLUTION_SHARE * float(np.ptp(vertices, axis=0).max(initial=0.0))
