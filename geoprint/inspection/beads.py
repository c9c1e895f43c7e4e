"""Beads along their middles: paired edges to a part of a pixel, and the width between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias, final

import numpy as np
from scipy import fft, ndimage

from geoprint.errors import InputError
from geoprint.inspection.skeleton import EDGE_SHARE, evened, light_on, midlines, otsu
from geoprint.model import BoolArray, FloatArray, freeze_arrays, frozen

if TYPE_CHECKING:
    from numpy.typing import NDArray


# Where beads run: edges that face each other a bead's width apart, over a stretch of its length.
#
# A bead is lighter than what it lies on (or darker): going across it, the grey values rise once and fall once. The
# texture of a bed, a glare or the rim of a part do one of the two, or both at another distance. So at every pixel
# and for every direction the slope half a width to one side is paired with the slope half a width to the other, each
# averaged along the direction, and the weaker of the two counts: as in the coupled filters of [Koller1995]. Divided
# by what a bead of contrast 1 gives, this is a contrast.


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
            f"beads of {width:.3g} pixels cannot be found in a photograph of {grey.shape[1]} x {grey.shape[0]}: "
            f"allowed are {NARROWEST:g} to {_widest(grey):.3g}. Change the distance of the camera.",
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
            f"no bead {shade} than its ground and {width:.3g} pixels wide: the contrast is at most "
            f"{float(contrast.max()):.2g}, the threshold {limit:.2g}, at least {LEAST_LINE_CONTRAST:g} is needed. "
            "Light the print from the side, or state shade and width of the beads.",
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


# Beads along their middles: both edges to a part of a pixel, the width between them, and where there is no bead.
#
# Across a line the grey values are read along its normal. From the middle outwards the edge is where they have
# fallen halfway to the lowest beside it. A place at which that contrast is too weak, or one side has no edge, is no
# bead: a gap. Where the light of beads fills the middle and a side, another line joins or the line turns a corner:
# no gap, and both edges go on from before it to behind it.


# Beads are looked at this often [pixels], and across them twice as often.
STEP = 1.0
ACROSS_STEP = 0.5
# Grey values are read so far to both sides, over the width: a bead twice as wide has its edge there.
REACH_SHARE = 1.25
# Inside is what is nearer to the middle than this share of the width; beside it what is farther than the other.
INSIDE_SHARE, BESIDE_SHARE = 0.12, 0.4
# Grey values are averaged along the line over this share of the width, against grain (standard deviation).
GRAIN_SHARE = 0.2
# The middle of a skeleton jumps from pixel to pixel; so much of the width calms it.
CALM_SHARE = 0.5
# Thinning ends a line up to so much of the width before its material does.
LENGTHENED_SHARE = 1.5
# A bead whose contrast falls below this share of the line's own is not there.
FAINT_SHARE = 0.4
# What an edge does over less than half of this share of the width is a grain beside it.
SPIKE_SHARE = 0.6
# The light of beads and of what is beside them is the median over so many widths to both sides.
NEARBY_SHARE = 4.0
# Its edges lie no nearer together than this share of the width.
THINNEST_SHARE = 0.25
# Breaks shorter than this share of the width are noise, and so are beads.
SHORTEST_BREAK_SHARE = 0.3
# Lines of which less than this, over the width, is seen, are none.
SHORTEST_LINE_SHARE = 3.0


@final
@frozen
class BeadLine:
    """A line of material in a photograph.

    Attributes:
        middles: (k, 2) halfway between its edges, about a pixel apart, in their order [pixels].
        lefts: (k, 2) edge to the left of that order, v pointing down [pixels].
        rights: (k, 2) edge to the right [pixels].
        seen: (k,) whether there is a bead; where not, middles are what lies between, and both edges on them.
        closed: whether its end meets its start.
    """

    middles: FloatArray
    lefts: FloatArray
    rights: FloatArray
    seen: BoolArray
    closed: bool

    def __post_init__(self) -> None:
        freeze_arrays(self, middles="float: k 2", lefts="float: k 2", rights="float: k 2", seen="bool: k")

    @property
    def widths(self) -> FloatArray:
        """(k,) distance of both edges, 0 where there is no bead [pixels]."""
        return np.asarray(np.linalg.norm(self.rights - self.lefts, axis=1))

    @property
    def steps(self) -> FloatArray:
        """(k - 1,) distance from each middle to the next [pixels]."""
        return np.asarray(np.linalg.norm(np.diff(self.middles, axis=0), axis=1))

    @property
    def breaks(self) -> list[tuple[int, int]]:
        """First and last place of each stretch without material."""
        labels, _ = ndimage.label(~self.seen)
        return [(int(part[0].start), int(part[0].stop) - 1) for part in ndimage.find_objects(labels)]

    @property
    def length(self) -> float:
        """Of what is seen [pixels]."""
        return float(self.steps[self.seen[1:] & self.seen[:-1]].sum())


def beads_of(grey: FloatArray, found: PairedEdges, *, shade: Shade = "lighter") -> tuple[BeadLine, ...]:
    """Return the beads of a photograph, the longest first.

    Args:
        grey: (h, w) of the photograph.
        found: where beads run in it.
        shade: what beads are, beside what they lie on.

    Raises:
        InputError: no line is long enough.
    """
    height = grey if shade == "lighter" else 1.0 - grey
    # The centre of pixel 0 of the small picture stands half a large pixel, less half a small one, further in.
    lines = [(line + 0.5) / found.scale - 0.5 for line in midlines(found.beads, width=found.scale * found.width)]
    long = [line for line in lines if len(line) > 2 and _length(line) >= SHORTEST_LINE_SHARE * found.width]
    beads = [bead for line in long if (bead := _bead(height, line, found)) is not None]
    if not beads:
        raise InputError(
            f"none of {len(lines)} lines of beads {found.width:.3g} pixels wide is {SHORTEST_LINE_SHARE:g} widths "
            "long. Light the print from the side, or state shade and width of the beads.",
            lines=len(lines),
        )
    return tuple(sorted(beads, key=lambda bead: -bead.length))


def _bead(height: FloatArray, line: FloatArray, found: PairedEdges) -> BeadLine | None:
    """Return the bead along a line, or None where too little of one is there."""
    width = found.width
    closed = bool(np.abs(line[0] - line[-1]).max() < 1e-9)
    path = _calmed(line if closed else _lengthened(line, width=width), width=width, closed=closed)
    ahead = _unit(_gradient(path, closed=closed))
    aside = np.column_stack([ahead[:, 1], -ahead[:, 0]])
    offsets = np.arange(-REACH_SHARE * width, REACH_SHARE * width + ACROSS_STEP, ACROSS_STEP)
    profiles = _profiles(height, path, aside, offsets, width=width, closed=closed)
    left, right, edged, joined = _edges(profiles, offsets, _spreads(found, path), width=width)
    seen = _without_short(edged | joined, shortest=SHORTEST_BREAK_SHARE * width / STEP, closed=closed)
    kept = np.flatnonzero(edged & seen)
    if kept.size * STEP < SHORTEST_LINE_SHARE * width:
        return None
    rows = slice(None) if closed else slice(int(kept[0]), int(kept[-1]) + 1)
    left, right = (np.interp(np.arange(seen.size), kept, edge[kept]) for edge in (left, right))
    middle = 0.5 * (left + right)
    left, right = np.where(seen, left, middle), np.where(seen, right, middle)
    at = [path + offset[:, None] * aside for offset in (middle, left, right)]
    return BeadLine(at[0][rows], at[1][rows], at[2][rows], seen[rows], closed)


def _profiles(
    height: FloatArray, path: FloatArray, aside: FloatArray, offsets: FloatArray, *, width: float, closed: bool
) -> FloatArray:
    """Return (k, j) grey values across a line, at each of k places, calmed along it and across."""
    at = path[:, None, :] + offsets[None, :, None] * aside[:, None, :]
    values = ndimage.map_coordinates(height, [at[..., 1], at[..., 0]], order=1, mode="nearest")
    spreads = (GRAIN_SHARE * width / STEP, 0.5 / ACROSS_STEP)
    return ndimage.gaussian_filter(values, spreads, mode=("wrap" if closed else "nearest", "nearest"))


def _spreads(found: PairedEdges, path: FloatArray) -> FloatArray:
    """Return the (k,) spread of the grey values around each place of a path: the largest within two widths along it.

    It falls towards the end of a line, behind which nothing is, and would draw the end out.
    """
    at = (path + 0.5) * found.scale - 0.5
    spreads = ndimage.map_coordinates(found.spreads, [at[:, 1], at[:, 0]], order=1, mode="nearest")
    return np.asarray(ndimage.maximum_filter1d(spreads, 2 * round(2.0 * found.width / STEP) + 1, mode="nearest"))


def _edges(
    profiles: FloatArray, offsets: FloatArray, spreads: FloatArray, *, width: float
) -> tuple[FloatArray, FloatArray, BoolArray, BoolArray]:
    """Return (k,) offsets of the left and of the right edge, whether both are there, and whether a line joins instead.

    How light falls along a line and across it makes one bead faint here and bright there: its contrast counts over the
    spread of what lies around it.
    """
    inside = profiles[:, np.abs(offsets) <= max(INSIDE_SHARE * width, ACROSS_STEP)].mean(axis=1)
    sides: list[FloatArray] = []
    besides: list[FloatArray] = []
    for sign in (1.0, -1.0):
        order = np.argsort(sign * offsets)
        out = order[sign * offsets[order] >= 0.0]
        away, values = np.abs(offsets[out]), profiles[:, out]
        beside = values[:, away >= BESIDE_SHARE * width].min(axis=1)
        sides.append(sign * _first_below(values, away, 0.5 * (inside + beside)))
        besides.append(beside)
    contrast = (inside - np.maximum(*besides)) / spreads
    left, right = sides
    usual = float(np.median(contrast[contrast > 0.0])) if (contrast > 0.0).any() else np.inf
    there = np.isfinite(left) & np.isfinite(right) & (contrast > FAINT_SHARE * usual)
    there &= np.where(there, left - right, 0.0) >= THINNEST_SHARE * width
    joined = np.zeros_like(there)
    if there.any():
        light, dark = (_nearby(values, there, width=width) for values in (inside, np.minimum(*besides)))
        joined = ~there & (np.minimum(inside, np.maximum(*besides)) > 0.5 * (light + dark))
    return _without_spikes(left, there, width=width), _without_spikes(right, there, width=width), there, joined


def _nearby(values: FloatArray, there: BoolArray, *, width: float) -> FloatArray:
    """Return the (k,) median of values along a line nearby, of where there is a bead."""
    kept = np.flatnonzero(there)
    filled = np.interp(np.arange(there.size), kept, values[kept])
    return ndimage.median_filter(filled, 2 * round(NEARBY_SHARE * width / STEP) + 1, mode="nearest")


def _without_spikes(edge: FloatArray, there: BoolArray, *, width: float) -> FloatArray:
    """Return the (k,) offsets of an edge without what sticks out for less than half of a stretch; 0 where it is not."""
    calm = np.zeros(edge.size)
    calm[there] = ndimage.median_filter(edge[there], max(1, round(SPIKE_SHARE * width / STEP)), mode="mirror")
    return calm


def _first_below(values: FloatArray, away: FloatArray, level: FloatArray) -> FloatArray:
    """Return (k,) how far out values first fall below a level, linear between places; NaN where they do not."""
    below = values < level[:, None]
    first = np.argmax(below, axis=1)
    rows = np.arange(len(values))
    before = np.maximum(first - 1, 0)
    high, low = values[rows, before], values[rows, first]
    share = np.divide(high - level, high - low, out=np.zeros_like(level), where=high > low)
    return np.where(below.any(axis=1) & (first > 0), away[before] + share * (away[first] - away[before]), np.nan)


def _without_short(seen: BoolArray, *, shortest: float, closed: bool) -> BoolArray:
    """Return what is seen without breaks, and then without pieces, that are shorter than so many places."""
    for what in (False, True):
        padded = np.concatenate([seen, seen, seen]) if closed else seen
        labels, count = ndimage.label(padded == what)
        sizes = np.bincount(labels, minlength=count + 1)
        short = (labels > 0) & (sizes[labels] < shortest)
        if not closed and not what:
            short[labels == labels[0]] = False
            short[labels == labels[-1]] = False
        changed = np.where(short, not what, padded)
        seen = changed[len(seen) : 2 * len(seen)] if closed else changed
    return seen


def _lengthened(line: FloatArray, *, width: float) -> FloatArray:
    """Return a line that goes on straight at both ends: where its material ends is seen across it, not by thinning."""
    reach = min(len(line) - 1, max(1, round(width)))
    ends = [line[0] - line[reach], line[-1] - line[-1 - reach]]
    out = [LENGTHENED_SHARE * width * end / max(float(np.linalg.norm(end)), 1e-12) for end in ends]
    return np.vstack([line[0] + out[0], line, line[-1] + out[1]])


def _calmed(line: FloatArray, *, width: float, closed: bool) -> FloatArray:
    """Return a line at even steps, without the stairs of its pixels."""
    arcs = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    count = max(3, round(float(arcs[-1]) / STEP) + 1)
    even: FloatArray = np.linspace(0.0, float(arcs[-1]), count)
    points: FloatArray = np.column_stack([np.interp(even, arcs, line[:, axis]) for axis in (0, 1)])
    spread = CALM_SHARE * width / STEP
    if closed:
        calm: FloatArray = ndimage.gaussian_filter1d(points[:-1], spread, axis=0, mode="wrap")
        return np.vstack([calm, calm[:1]])
    # Mirrored through the ends, so that these stay where they are.
    margin = min(count - 1, int(np.ceil(4.0 * spread)))
    front, back = 2.0 * points[0] - points[margin:0:-1], 2.0 * points[-1] - points[-2 : -margin - 2 : -1]
    smooth: FloatArray = ndimage.gaussian_filter1d(np.vstack([front, points, back]), spread, axis=0)
    return smooth[margin : margin + count]


def _gradient(path: FloatArray, *, closed: bool) -> FloatArray:
    if not closed:
        return np.asarray(np.gradient(path, axis=0))
    around = np.vstack([path[-2], path, path[1]])
    return 0.5 * (around[2:] - around[:-2])


def _unit(rows: FloatArray) -> FloatArray:
    return rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-12)


def _length(line: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def middles_of(beads: Sequence[BeadLine]) -> FloatArray:
    """Return the (n, 2) middles of all that is seen of beads [pixels]."""
    return np.vstack([bead.middles[bead.seen] for bead in beads])
