"""The outline of a part: under a camera, and in a photograph."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy import ndimage

from geoprint.errors import InputError, percent
from geoprint.geometry import face_normals
from geoprint.geometry.rays import RayTree
from geoprint.geometry.topology import numbered_edges
from geoprint.inspection.camera import Camera
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen

# The outline of a part under a camera: the edges of its mesh beyond which a line of sight meets nothing.


# An edge is the outline's where a line of sight beside it, this far in pixels, meets nothing.
BESIDE = 0.75


@final
@frozen
class PartOutline:
    """The outline of a part as a camera sees it, in no order.

    Attributes:
        places: (k, 3) of the part [mm].
        pixels: (k, 2) where they are seen [pixels].
        outward: (k, 2) unit normals out of the part in the picture.
    """

    places: FloatArray
    pixels: FloatArray
    outward: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, places="float: k 3", pixels="float: k 2", outward="float: k 2")


@final
class OutlinedPart:
    """A part that is looked at from many places: its edges, and the faces on both sides of them."""

    def __init__(self, surface: Surface) -> None:
        edges, side_edge = numbered_edges(surface.faces)
        order = np.argsort(side_edge.ravel(), kind="stable")
        counts = np.bincount(side_edge.ravel(), minlength=len(edges))
        firsts = np.cumsum(counts) - counts
        self.surface = surface
        self._rays = RayTree(surface)
        self._edges = edges
        self._one = order[firsts] // 3
        # A border has the same face on both sides; so has, harmlessly, what more than two faces share.
        self._other = order[firsts + counts - 1] // 3
        self._border = counts != 2
        self._normals = face_normals(surface)
        self._corners = surface.vertices[surface.faces[:, 0]]

    def under(self, camera: Camera, *, places: int) -> PartOutline:
        """Return the outline of the part under a camera.

        Args:
            camera: all of the part lies ahead of it.
            places: about so many are looked at, evenly in the picture; those that are not outermost are left out.
        """
        toward = ((camera.place - self._corners) * self._normals).sum(axis=1) > 0.0
        edge = np.flatnonzero(self._border | (toward[self._one] != toward[self._other]))
        starts, ends = (self.surface.vertices[self._edges[edge, side]] for side in (0, 1))
        first, last = camera.seen(starts), camera.seen(ends)
        lengths: FloatArray = np.linalg.norm(last - first, axis=1)
        reached: FloatArray = np.concatenate([[0.0], np.cumsum(lengths)])
        at = (np.arange(places) + 0.5) * reached[-1] / places
        behind: IntArray = np.asarray(np.searchsorted(reached, at, side="right"), dtype=np.int64)
        owner = np.minimum(behind - 1, len(edge) - 1)
        share = ((at - reached[owner]) / np.maximum(lengths[owner], 1e-12))[:, None]
        points = starts[owner] + share * (ends - starts)[owner]
        pixels = camera.seen(points)
        along = (last - first)[owner] / np.maximum(lengths[owner], 1e-12)[:, None]
        aside = np.column_stack([along[:, 1], -along[:, 0]])
        beside = np.vstack([pixels + BESIDE * aside, pixels - BESIDE * aside])
        left, right = self._meets(camera, beside).reshape(2, places)
        outer = left != right
        out = np.where(left[:, None], -aside, aside)
        return PartOutline(points[outer], pixels[outer], out[outer])

    def _meets(self, camera: Camera, pixels: FloatArray) -> BoolArray:
        """Return which (k,) lines of sight meet the part."""
        toward = camera.directions(pixels)
        return self._rays.first_hits(np.broadcast_to(camera.place, toward.shape).copy(), toward).met


# The outline of the part in a photograph: where what stands out from the rim of the picture ends, between pixels.


# A part is looked for in a picture of no more pixels; its outline is then found in the whole one.
COARSE_PIXELS = 1_000_000
# The rim of a picture, over its shorter side, shows what the part lies on.
RIM_SHARE = 0.02
# What differs from the rim by more than so many of its spreads, and by more than this, stands out from it.
RIM_SPREADS, LEAST_CONTRAST = 6.0, 0.03
# What is thinner than this is a cable or a shadow, and cut off [coarse pixels].
THINNEST = 5
# A part fills at least this share of the picture, and nothing else does so by more than this share of the part.
LEAST_PART, MOST_OTHER = 0.01, 0.3
# Places along an outline, at most, and at least this far apart [pixels].
MOST_PLACES, LEAST_STEP = 3000, 1.0
# Edges are looked for so far to either side, in steps of this, and the grey value outside is that beyond half as far.
# The steepest place lies no farther in from where the part first stands out than the first of these that so much of the
# outline has it within, since what is printed lies farther in; and no farther out than the last [coarse pixels].
REACH, STEP, INWARD, OUTWARD = 7.0, 0.25, (1.5, 2.5, 4.0), 0.25
# An edge is one where a pixel's step takes so much of the difference between inside and outside.
LEAST_STEEP = 1.0 / 8.0
# What is so near to the ends of what is looked at is no place of an edge [coarse pixels].
ENDS = 2.0
# Noise is calmed over so much along the outline [places] and across it [steps].
CALM_NOISE = (1.0, 2.0)
# So much of an outline is a sharp edge.
LEAST_SHARP = 0.5
# Normals are taken of an outline that is calmed over so many places.
CALM = 4.0


@final
@frozen
class PictureOutline:
    """The outline of a part in a photograph, in its order.

    Attributes:
        pixels: (k, 2) (u, v), between pixels.
        outward: (k, 2) unit normals out of the part.
        unit: pixels that were one where the part was looked for.
    """

    pixels: FloatArray
    outward: FloatArray
    unit: float

    def __post_init__(self) -> None:
        freeze_arrays(self, pixels="float: k 2", outward="float: k 2")


def picture_outline(grey: FloatArray) -> PictureOutline:
    """Return the outline of what stands out from the rim of a picture.

    Args:
        grey: (h, w) from 0 to 1.

    Raises:
        InputError: nothing stands out, it reaches the rim, there are two of its kind, or its edge is not to be seen.
    """
    step = int(np.ceil(np.sqrt(grey.size / COARSE_PIXELS)))
    coarse = ndimage.gaussian_filter(grey, 0.5 * step + 0.5)[::step, ::step]
    region, spread = _part(coarse)
    line = step * _border(region)
    length = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    line = _even(line, step=max(LEAST_STEP, length / MOST_PLACES))
    outward = _outward(line)
    least = max(RIM_SPREADS * spread, LEAST_CONTRAST)
    values = _across(grey, line, outward, unit=step)
    shifts, there = _edges(values, least=least, inward=INWARD[0])
    for inward in INWARD[1:]:
        if there.mean() < LEAST_SHARP:
            shifts, there = _edges(values, least=least, inward=inward)
    if there.mean() < LEAST_SHARP:
        raise InputError(
            f"only {percent(there.mean())} of the outline of the part is a sharp edge, needed are "
            f"{percent(LEAST_SHARP)}. Light the part, use an even background, or give `--fiducials`.",
            sharp=float(there.mean()),
        )
    sharp = line[there] + step * shifts[there, None] * outward[there]
    return PictureOutline(sharp, outward[there], float(step))


def _part(coarse: FloatArray) -> tuple[BoolArray, float]:
    """Return which pixels are the part's, holes filled, and the spread of the grey values around it."""
    rim = max(2, round(RIM_SHARE * min(coarse.shape)))
    frame = np.ones(coarse.shape, dtype=np.bool_)
    frame[rim:-rim, rim:-rim] = False
    level = float(np.median(coarse[frame]))
    spread = 1.4826 * float(np.median(np.abs(coarse[frame] - level)))
    apart = np.abs(coarse - level) > max(RIM_SPREADS * spread, LEAST_CONTRAST)
    solid = ndimage.binary_opening(ndimage.binary_fill_holes(apart), np.ones((THINNEST, THINNEST), dtype=np.int64))
    labels, count = ndimage.label(solid)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    sizes[0] = 0
    largest = int(np.argmax(sizes))
    if sizes[largest] < LEAST_PART * coarse.size:
        raise InputError(
            "no part is visible against the rim of the picture. Use an even background that is lighter or darker, or "
            "give `--fiducials`, at least four points of the part."
        )
    part = labels == largest
    if (part & frame).any():
        raise InputError(
            "the part reaches the rim of the picture, so its outline is incomplete. Show the whole part before an "
            "even background, or give `--fiducials`."
        )
    others = np.sort(sizes)[-2] if count > 1 else 0
    if others > MOST_OTHER * sizes[largest]:
        raise InputError(
            f"the picture shows a second object, {percent(others / sizes[largest])} of the size of the largest. Remove "
            "it, or give `--fiducials`."
        )
    return np.asarray(part), spread


def _border(region: BoolArray) -> FloatArray:
    """Return the (k, 2) outer border of a region in its order, closed, as (u, v)."""
    from skimage.measure import find_contours

    lines = find_contours(np.pad(region, 1).astype(np.float64), 0.5)
    longest = max(lines, key=len)
    return np.asarray(longest[:, ::-1] - 1.0, dtype=np.float64)


def _even(line: FloatArray, *, step: float) -> FloatArray:
    """Return places along a closed line, so far apart, without its end, which is its start."""
    arcs = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.linspace(0.0, float(arcs[-1]), max(16, round(float(arcs[-1]) / step)), endpoint=False)
    return np.column_stack([np.interp(at, arcs, line[:, axis]) for axis in (0, 1)]).astype(np.float64)


def _outward(line: FloatArray) -> FloatArray:
    """Return the (k, 2) unit normals out of what a closed line goes around."""
    calm: FloatArray = ndimage.gaussian_filter1d(line, CALM, axis=0, mode="wrap")
    ahead = np.roll(calm, -1, axis=0) - np.roll(calm, 1, axis=0)
    area = float((line[:, 0] * np.roll(line[:, 1], -1) - np.roll(line[:, 0], -1) * line[:, 1]).sum())
    out = np.sign(area) * np.column_stack([ahead[:, 1], -ahead[:, 0]])
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)


def _across(grey: FloatArray, line: FloatArray, outward: FloatArray, *, unit: int) -> FloatArray:
    """Return (k, s) grey values across a line, from inside to outside, in steps of so many units of pixels."""
    offsets = unit * _offsets()
    at = line[:, None, :] + offsets[None, :, None] * outward[:, None, :]
    values: FloatArray = ndimage.map_coordinates(grey, [at[..., 1], at[..., 0]], order=1, mode="nearest")
    return np.asarray(ndimage.gaussian_filter(values, CALM_NOISE, mode=("wrap", "nearest")), dtype=np.float64)


def _edges(values: FloatArray, *, least: float, inward: float) -> tuple[FloatArray, BoolArray]:
    """Return (k,) how far out the grey value rises most steeply, and whether there is such a place.

    It is that of the outermost rise: what is printed near the rim of a part rises again farther in.

    Args:
        values: (k, s) across the outline.
        least: by which grey values of the part differ from those outside.
        inward: how far in from where it first stands out it is looked for [coarse pixels].
    """
    offsets = _offsets()
    outside, inside = (np.median(values[:, side * offsets > 0.5 * REACH], axis=1) for side in (1.0, -1.0))
    stands = np.abs(values - outside[:, None]) > least
    outermost = stands.shape[1] - 1 - np.argmax(stands[:, ::-1], axis=1)
    rise = np.abs(np.diff(values, axis=1))
    window = np.arange(-round(inward / STEP), round(OUTWARD / STEP) + 1)
    looked = np.clip(outermost[:, None] + window, round(ENDS / STEP), rise.shape[1] - 1 - round(ENDS / STEP))
    rows = np.arange(len(values))
    peak = looked[rows, np.argmax(rise[rows[:, None], looked], axis=1)]
    # A parabola through the steepest step and its neighbours.
    low, mid, high = (rise[rows, peak + k] for k in (-1, 0, 1))
    curved = low - 2.0 * mid + high
    fine = np.divide(0.5 * (low - high), curved, out=np.zeros_like(mid), where=curved < 0.0)
    steep = mid > STEP * LEAST_STEEP * np.abs(inside - outside)
    there = stands.any(axis=1) & steep & (np.abs(fine) <= 1.0) & (mid > low) & (mid >= high)
    return offsets[peak] + STEP * (0.5 + fine), np.asarray(there)


def _offsets() -> FloatArray:
    """Return the (s,) places across an outline, from inside to outside [coarse pixels]."""
    return np.arange(-REACH, REACH + 0.5 * STEP, STEP)
