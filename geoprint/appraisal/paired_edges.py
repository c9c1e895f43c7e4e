"""Where beads run: edges that face each other a bead's width apart, over a stretch of its length.

A bead is lighter than what it lies on (or darker): going across it, the grey values rise once and fall once. The
texture of a bed, a glare or the rim of a part do one of the two, or both at another distance. So at every pixel and
for every direction the slope half a width to one side is paired with the slope half a width to the other, each averaged
along the direction, and the weaker of the two counts: as in the coupled filters of [Koller1995]. Divided by what a bead
of contrast 1 gives, this is a contrast.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, TypeAlias, final

import numpy as np
from scipy import fft

from geoprint.appraisal.gradient import EDGE_SHARE, evened, light_on, otsu
from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, freeze_arrays, frozen

if TYPE_CHECKING:
    from numpy.typing import NDArray

Shade: TypeAlias = Literal["lighter", "darker"]

# Directions that are tried: with 16 the worst is missed by 6 degrees, which the averaging bears.
DIRECTIONS = 16
# Half of them tell how wide beads are.
FEWER_DIRECTIONS = 8
# Slopes are averaged along the direction over this share of the width (standard deviation): more calms a textured bed
# and loses bends.
ALONG_SHARE = 1.0
# Beads are looked for where they are so wide [pixels]: coarser pictures of the same show them as well, and sooner.
SEARCH_WIDTH = 9.0
# Narrower beads cannot be told from grain [pixels].
NARROWEST = 5.0
# Widths that are tried where none is given: from the narrowest, each wider than the one before by this factor.
LADDER = 1.25
# A bead wider than this share of the picture's shorter side is no line in it.
WIDEST_SHARE = 1.0 / 8.0
# Larger pictures are halved for the search alone [pixels].
MOST_SEARCHED = 1_200_000
# Lines whose contrast is less than this, over the spread of the grey values around them, are texture.
LEAST_LINE_CONTRAST = 0.25

_Single: TypeAlias = "NDArray[np.float32]"


@final
@frozen
class PairedEdges:
    """How much every pixel looks like the middle of a bead.

    Attributes:
        width: of the beads that were looked for [pixels of the photograph].
        scale: pixels of this picture for one of the photograph, at most 1.
        contrast: (h, w) of a bead through the pixel with what lies on its sides, over the spread of the grey values
            around it; 0 where there is none.
        spreads: (h, w) standard deviation of the grey values around every pixel.
        threshold: from which on it is a bead.
        chosen: whether the threshold was chosen [Otsu1979], not given.
    """

    width: float
    scale: float
    contrast: FloatArray
    spreads: FloatArray
    threshold: float
    chosen: bool

    def __post_init__(self) -> None:
        freeze_arrays(self, contrast="float: h w", spreads="float: h w")

    @property
    def beads(self) -> BoolArray:
        """(h, w) which pixels are at least the threshold."""
        return self.contrast >= self.threshold


def paired_edges(
    grey: FloatArray, *, width: float, shade: Shade = "lighter", threshold: float | None = None
) -> PairedEdges:
    """Find where beads of one width run.

    Args:
        grey: (h, w) of a photograph.
        width: of a bead [pixels].
        shade: what beads are, beside what they lie on.
        threshold: of the contrast; [Otsu1979] of all pixels that have any if not given.

    Raises:
        InputError: the width does not fit the picture, or nothing in it looks like a bead.
    """
    if not NARROWEST <= width <= _widest(grey):
        raise InputError(
            f"beads of {width:.3g} pixels cannot be looked for in a photograph of {grey.shape[1]} x {grey.shape[0]}: "
            f"allowed are {NARROWEST:g} to {_widest(grey):.3g}; take the photograph from another distance.",
            width=width,
        )
    shown = 1.0 if shade == "lighter" else -1.0
    small, scale = _shrunk(grey, min(1.0, SEARCH_WIDTH / width))
    mean, spreads = light_on(small, width=scale * width)
    even = shown * (small - mean) / spreads
    contrast = _contrast(even, width=scale * width, directions=DIRECTIONS)
    limit = threshold if threshold is not None else _limit(contrast)
    found = PairedEdges(width, scale, contrast.astype(np.float64), spreads, limit, threshold is None)
    if not found.beads.any() or limit < LEAST_LINE_CONTRAST:
        raise InputError(
            f"nothing looks like a bead {shade} than what it lies on and {width:.3g} pixels wide: the contrast is at "
            f"most {float(contrast.max()):.2g}, the threshold {limit:.2g}, needed are {LEAST_LINE_CONTRAST:g}; light "
            "the print from the side, or state the beads' shade and width.",
            contrast=float(contrast.max()),
        )
    return found


def bead_width(grey: FloatArray, *, shade: Shade = "lighter") -> float:
    """Return the width of the beads [pixels]: the one of a ladder at which what is found has the highest contrast.

    Args:
        grey: (h, w) of a photograph.
        shade: what beads are.

    Raises:
        InputError: the picture is of one colour, or too small for any.
    """
    shrink = min(1.0, float(np.sqrt(MOST_SEARCHED / grey.size)))
    searched, scale = _shrunk(grey, shrink)
    shown = 1.0 if shade == "lighter" else -1.0
    best, highest = NARROWEST, 0.0
    width = NARROWEST
    while width <= _widest(searched):
        small, smaller = _shrunk(searched, min(1.0, SEARCH_WIDTH / width))
        even = shown * evened(small, width=smaller * width)
        contrast = _contrast(even, width=smaller * width, directions=FEWER_DIRECTIONS)
        limit = _limit(contrast)
        mean = float(contrast[contrast >= limit].mean()) if limit > 0.0 else 0.0
        if mean > highest:
            best, highest = width, mean
        width *= LADDER
    return best / scale


def _widest(grey: FloatArray) -> float:
    return WIDEST_SHARE * min(grey.shape)


def _limit(contrast: _Single) -> float:
    some = contrast[contrast > 0.0]
    return otsu(some.astype(np.float64)) if some.size and some.min() < some.max() else 0.0


def _shrunk(grey: FloatArray, scale: float) -> tuple[FloatArray, float]:
    """Return a picture with fewer pixels, each a mean of those that it stands for, and its true scale."""
    if scale >= 1.0:
        return grey, 1.0
    from skimage.transform import resize

    shape = [max(1, round(side * scale)) for side in grey.shape]
    return resize(grey, shape, anti_aliasing=True), shape[1] / grey.shape[1]


def _contrast(even: FloatArray, *, width: float, directions: int) -> _Single:
    """Return (h, w) the weaker of two facing slopes in the direction in which it is strongest, as a contrast."""
    margin = int(np.ceil(3.0 * width))
    padded = np.pad(even.astype(np.float32), margin, mode="reflect")
    shape = [int(fft.next_fast_len(side, real=True)) for side in padded.shape]
    inside = tuple(slice(margin, margin + side) for side in even.shape)
    spectrum = fft.rfft2(padded, s=shape)
    down = fft.fftfreq(shape[0]).astype(np.float32)[:, None]
    right = fft.rfftfreq(shape[1]).astype(np.float32)[None, :]
    smoothing, stretch = EDGE_SHARE * width, ALONG_SHARE * width
    # An ideal edge of height 1, smoothed, is as steep as this.
    steepest = 1.0 / (smoothing * np.sqrt(2.0 * np.pi))
    best = np.zeros(even.shape, dtype=np.float32)
    for turn in (np.pi * np.arange(directions) / directions).tolist():
        along = right * math.cos(turn) + down * math.sin(turn)
        across = down * math.cos(turn) - right * math.sin(turn)
        blur = np.exp(-2.0 * math.pi**2 * ((stretch * along) ** 2 + (smoothing * across) ** 2))
        slopes = spectrum * (np.complex64(2j * math.pi / steepest) * across * blur)
        half = np.exp(np.complex64(1j * math.pi * width) * across)
        rising = fft.irfft2(slopes * half.conj(), s=shape)[inside]
        falling = -fft.irfft2(slopes * half, s=shape)[inside]
        np.maximum(best, np.minimum(rising, falling), out=best)
    return best
