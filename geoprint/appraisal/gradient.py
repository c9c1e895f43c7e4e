"""Grey values freed of the light on them, and how steep they are: what the paper takes lines from."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray

# Light is told from what it falls on by being alike over so many widths of a bead.
REACH_SHARE = 2.5
# What varies by less than this share of the picture's own contrast is flat, and stays so.
FLAT_SHARE = 0.1
# Edges are looked at through a smoothing of this share of a bead's width.
EDGE_SHARE = 1.0 / 6.0
# Grey values that vary by less are one colour: a step of 8 bits.
LEAST_CONTRAST = 1.0 / 255.0


def evened(grey: FloatArray, *, width: float) -> FloatArray:
    """Return grey values as they would be in even light: the remapping before edges are looked for.

    What is left has zero mean and unit standard deviation over the neighbourhood of every pixel, so that brightness
    and contrast of the whole, and a gradient of light over it, do not count.

    Args:
        grey: (h, w).
        width: of a bead [pixels].

    Raises:
        InputError: the picture is of one colour.
    """
    mean, spread = light_on(grey, width=width)
    return (grey - mean) / spread


def light_on(grey: FloatArray, *, width: float) -> tuple[FloatArray, FloatArray]:
    """Return (h, w) mean and spread of the grey values around every pixel, as its neighbourhood is lit.

    Args:
        grey: (h, w).
        width: of a bead [pixels].

    Raises:
        InputError: the picture is of one colour.
    """
    contrast = float(grey.std())
    if contrast < LEAST_CONTRAST:
        raise InputError(
            f"the photograph is of one colour: its grey values vary by {contrast:.2g}, needed are at least "
            f"{LEAST_CONTRAST:.2g}; light it so that beads stand out.",
            contrast=contrast,
        )
    reach = REACH_SHARE * width
    mean = ndimage.gaussian_filter(grey, reach)
    spread = np.sqrt(ndimage.gaussian_filter((grey - mean) ** 2, reach))
    return mean, spread + FLAT_SHARE * contrast


def steepness(grey: FloatArray, *, width: float) -> FloatArray:
    """Return G(I) = |dI/dx| + |dI/dy|, the paper's edge picture before its threshold.

    Args:
        grey: (h, w).
        width: of a bead [pixels]; what is much finer than it is smoothed away.

    Returns:
        (h, w) [1/pixel].
    """
    smoothing = EDGE_SHARE * width
    across = ndimage.gaussian_filter(grey, smoothing, order=(0, 1))
    down = ndimage.gaussian_filter(grey, smoothing, order=(1, 0))
    return np.abs(across) + np.abs(down)


def edges(grey: FloatArray, *, width: float) -> BoolArray:
    """Return which pixels are edges as the paper has them: G(I) of the remapped picture above a threshold [Otsu1979].

    Args:
        grey: (h, w).
        width: of a bead [pixels].

    Raises:
        InputError: the picture is of one colour.
    """
    steep = steepness(evened(grey, width=width), width=width)
    return steep > otsu(steep)


def otsu(values: FloatArray) -> float:
    """Return the threshold that parts values into two classes that differ most [Otsu1979]."""
    from skimage.filters import threshold_otsu

    return float(threshold_otsu(values))
