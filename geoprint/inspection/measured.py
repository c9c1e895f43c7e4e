"""What a photograph shows of every stretch of a plan: whether material lies there, how wide, and how far beside it.

Where runs lie is known, so only what is beside each of them is asked: is there a step to the usual light of beads, and
where are both edges of it? The rim of the part and the edges of neighbouring beads are known too, and are no edge of
the bead that is measured.
"""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree

from geoprint.errors import InputError, percent
from geoprint.inspection.against_plan import PlannedRuns
from geoprint.inspection.camera import Camera
from geoprint.inspection.edge_model import MOST_GAMMA, FittedEdges, Optics, Rows, fitted_edges, found_optics
from geoprint.inspection.outline import OutlinedPart, PartOutline
from geoprint.inspection.profiles import BIN, MOST_WHITE, LookedAt, Profiles, aside_of, looked_at, profiles_of
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen

# Inside is what is nearer to the middle of a bead than this, over the spacing.
INSIDE_SHARE = 0.1
# Bins with fewer pixels tell nothing; profiles with fewer bins neither.
FEWEST_PIXELS, FEWEST_BINS = 2, 20
# Material is where the step of light is at least this share of the usual one among so many stretches nearby.
PRESENT, NEARBY = 0.5, 40
# A step of grey values below this is none.
LEAST_STEP = 0.02
# Optics are found by so many profiles, so many of the rim, which reach so far [pixels].
SOME_RUNS, SOME_RIM, RIM_REACH = 60, 240, 14.0
# The rim counts where it steps by so much and is straight to this (cosine). What is nearer to the next bead than the
# first number of blurs shows light of that, and the rim needs the second number of them.
RIM_STEP, RIM_STRAIGHT, BEAD_BLURS, RIM_BLURS = 0.05, 0.97, 3.0, 2.0
# What a fit may leave of the rim, mean square over the noise; what leaves more is no straight step.
RIM_LEFT = 3.0
# Light is averaged as the tone curve has it, which is found so often.
RIM_ROUNDS = 2
# How far off blur [pixels] and logarithm of gamma may be where beads alone show these, whose light nobody knows: all
# tone curves are as likely; and where the gamma is the steepest there is.
BEADS_OFF, STEEPEST_OFF = (0.0, 0.9), (0.4, 1.2)
# Grey values from here on are about white.
NEARLY_WHITE = 0.97
# Lines that lie nearer to each other than this, over the spacing, join; and a run turns a corner where it turns by more
# than this (cosine) over so many stretches.
JOINED_SHARE, CORNER, OVER = 0.6, 0.9, 2
# Edges nearer together than this cannot be told apart [pixels].
NARROWEST = 4.0
# A run is shown where its bead lies as far beside it as beads do all over, within this share of the spacing.
SHOWN_SHARE = 0.06
# A picture that shows this much more of the plan when it is turned or mirrored is; and alike within the other.
CLEARER, ALIKE = 1.5, 1.1
TURNS = (
    "turned by 90 degrees",
    "turned by 180 degrees",
    "turned by 270 degrees",
    "mirrored",
    "mirrored and turned by 90 degrees",
    "mirrored upside down",
    "mirrored and turned by 270 degrees",
)


@final
@frozen
class MeasuredStretches:
    """What a photograph shows of the k stretches of a plan.

    Attributes:
        present: (k,) whether material lies there.
        edged: (k,) whether both of its edges were found.
        lefts: (k,) its left edge, to the left of the run as seen from outside; where it is edged [mm].
        rights: (k,) its right edge, likewise [mm].
        deviations: (k, 2) standard deviation of width and middle by noise [mm].
        common: (2,) of mean width and middle by the optics, which all share [mm].
        lone: (k,) whether the run is alone and straight there: no corner, and no other line joins.
        flanks: (k,) light that a bead adds at its darker edge, over that in its middle; 0 where it is not edged.
        sights: (k,) tangent of how far aslant across the run it is seen.
        optics: blur and tone curve.
        darker: whether beads are darker than what they lie on.
        white: share of the beads' places that is white.
        alike: how else the picture could be held and show the same; empty where there is no such way.
        scale: length that a pixel covers, in the mean [mm].
    """

    present: BoolArray
    edged: BoolArray
    lefts: FloatArray
    rights: FloatArray
    deviations: FloatArray
    common: FloatArray
    lone: BoolArray
    flanks: FloatArray
    sights: FloatArray
    optics: Optics
    darker: bool
    white: float
    alike: str
    scale: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self, present="bool: k", edged="bool: k", lefts="float: k", rights="float: k", deviations="float: k 2",
            common="float: 2", lone="bool: k", flanks="float: k", sights="float: k",
        )  # fmt: skip


@final
@frozen
class _Levels:
    """Where a bead is in each profile, as half of the step to both sides has it."""

    lefts: FloatArray
    rights: FloatArray
    inside: FloatArray
    beside: FloatArray
    found: BoolArray


def measured_stretches(
    grey: FloatArray, plan: PlannedRuns, camera: Camera, surface: Surface, *, visible: BoolArray
) -> MeasuredStretches:
    """Return what a photograph shows of a plan.

    Args:
        grey: (h, w) of the photograph.
        plan: in stretches.
        camera: that took it.
        surface: of the part.
        visible: (k,) which stretches the camera sees.

    Raises:
        InputError: nothing is printed where the plan has it, or the picture is turned or mirrored.
    """
    seen = looked_at(plan, camera, surface, size=(grey.shape[1], grey.shape[0]))
    alike = _held_otherwise(grey, seen, plan, camera, visible)
    profiles = profiles_of(grey, seen, plan, camera)
    shift, darker = _shift(profiles, plan, visible)
    levels = _levels(profiles, plan, shift=shift, darker=darker)
    present = visible & _present(levels, plan, darker=darker)
    usable = present & levels.found
    if not usable.any():
        raise InputError(
            "no beads are visible along the planned runs. Check the fiducials and the plan, light the print from the "
            "side, or change the exposure."
        )
    half = _half_widths(levels, profiles, usable)
    outline = OutlinedPart(surface).under(camera, places=SOME_RIM)
    nearest, joined = _next_edges(plan, half, outline.places)
    if darker:
        # Beads, or what they lie on, may be cut off at black, as in a negative.
        black = profiles_of(1.0 - grey, seen, plan, camera).white
        profiles = replace(profiles, white=np.maximum(profiles.white, black))
    which = np.flatnonzero(usable)
    rows = _rows(profiles, levels, nearest * profiles.scales[:, None], darker=darker).some(which)
    optics = found_optics(_some(rows))
    if darker and (negative := found_optics(_some(rows.negative()))).cost < optics.cost:
        # A picture with darker beads may be a negative, whose tone curve is that of the picture before it was one.
        rows, optics, grey = rows.negative(), negative, 1.0 - grey
    outer = np.where(usable, np.maximum(levels.lefts, -levels.rights), half * profiles.scales)
    by_beads = optics
    for _ in range(RIM_ROUNDS):
        optics = _by_rim(_rim_rows(grey, camera, plan, outer, outline, optics=optics), by_beads)
    fitted = fitted_edges(rows, optics)
    toward = camera.place - plan.places
    sights = np.abs((toward * aside_of(plan)).sum(axis=1)) / np.maximum((toward * plan.normals).sum(axis=1), 1e-9)
    return _on_part(
        fitted, which, profiles, present, _lone(plan, joined), sights=sights, optics=optics, darker=darker, alike=alike
    )  # fmt: skip


def _half_widths(levels: _Levels, profiles: Profiles, usable: BoolArray) -> FloatArray:
    """Return (k,) half of the width of each bead, the usual one where it is not known [pixels]."""
    half = np.where(usable, 0.5 * (levels.lefts - levels.rights) / profiles.scales, 0.0)
    return np.where(usable, half, np.median(half[usable]))


def _some(rows: Rows) -> Rows:
    """Return some of many profiles."""
    return rows.some(np.arange(0, rows.rims.size, max(1, rows.rims.size // SOME_RUNS)))


def _by_rim(rim: Rows, optics: Optics) -> Optics:
    """Return blur and tone curve by the rim, where enough of it is seen and is a straight step; else those of beads."""
    if rim.rims.size >= SOME_RUNS:
        found = found_optics(rim)
        if found.cost < RIM_LEFT * float((rim.counts > 0.0).sum()):
            # Beads may have another blur: the truth lies between both.
            return replace(found, spread=_wider(found.spread, np.array([0.5 * (found.blur - optics.blur), 0.0])))
    off = BEADS_OFF if optics.gamma < 0.99 * MOST_GAMMA else STEEPEST_OFF
    return replace(optics, spread=_wider(optics.spread, np.array(off)))


def _wider(spread: FloatArray, off: FloatArray) -> FloatArray:
    """Return the spread of optics that are off by so much (standard deviations) besides."""
    return np.asarray(np.linalg.cholesky(spread @ spread.T + np.diag(off**2)), dtype=np.float64)


def _held_otherwise(grey: FloatArray, seen: LookedAt, plan: PlannedRuns, camera: Camera, visible: BoolArray) -> str:
    """Return how else a picture could be held and show the plan as well, or nothing.

    Raises:
        InputError: it shows the plan much clearer if it is held otherwise.
    """
    shown: dict[str, tuple[float, bool]] = {}
    for number, how in enumerate(("", *TURNS)):
        turned = np.rot90(grey, -(number % 4)) if number < 4 else np.rot90(np.fliplr(grey), -(number % 4))
        if turned.shape == grey.shape:
            profiles = profiles_of(turned, seen, plan, camera)
            shift, darker = _shift(profiles, plan, visible)
            levels = _levels(profiles, plan, shift=shift, darker=darker)
            there = visible & levels.found & _present(levels, plan, darker=darker)
            middles = 0.5 * (levels.lefts + levels.rights) / profiles.scales
            near = np.abs(middles - np.median(middles[there])) < SHOWN_SHARE * plan.spacing if there.any() else there
            shown[how] = float((there & near).sum() / visible.sum()), darker
    best = max(shown, key=lambda how: shown[how][0])
    if shown[best][0] > CLEARER * shown[""][0]:
        raise InputError(
            f"the picture shows {percent(shown[best][0])} of the plan if it is {best}, otherwise "
            f"{percent(shown[''][0])}. It was turned or mirrored after the fiducials were taken, or their columns u "
            "and v are swapped: give the original picture."
        )
    own, darker = shown[""]
    others = [how for how, (share, other) in shown.items() if how and share * ALIKE > own and other == darker]
    return others[0] if others else ""


def _shift(profiles: Profiles, plan: PlannedRuns, visible: BoolArray) -> tuple[float, bool]:
    """Return how far to the left of their runs beads lie in the mean [mm], and whether they are darker."""
    places = np.linspace(-0.5, 0.5, 101) * plan.spacing
    sums, counts = np.zeros((2, places.size))
    there = (profiles.counts >= FEWEST_PIXELS) & visible[:, None]
    at = np.rint((profiles.asides / profiles.scales[:, None] / plan.spacing + 0.5) * 100.0).astype(np.int64)
    inner = there & (at >= 0) & (at < places.size)
    np.add.at(sums, at[inner], profiles.greys[inner])
    np.add.at(counts, at[inner], 1.0)
    if not counts.any():
        raise InputError("the camera sees no run of the plan; check the fiducials, and that the plan is of this part.")
    mean = np.interp(places, places[counts > 0.0], (sums / np.maximum(counts, 1.0))[counts > 0.0])
    smooth = ndimage.uniform_filter1d(mean, 25, mode="nearest")
    off = smooth - np.median(mean)
    middle = np.abs(places) <= 0.4 * plan.spacing
    ends = 0.5 * (mean[:10].mean() + mean[-10:].mean())
    darker = (
        bool(abs(off[middle].min()) > abs(off[middle].max()))
        if abs(ends - mean[50]) < LEAST_STEP
        else bool(mean[50] < ends)
    )
    peak = int(np.argmax(np.where(middle, -smooth if darker else smooth, -np.inf)))
    return float(places[peak]), darker


def _levels(profiles: Profiles, plan: PlannedRuns, *, shift: float, darker: bool) -> _Levels:
    """Return where a bead is in each profile, as half of the step of grey values to both sides has it."""
    sign = -1.0 if darker else 1.0
    used = profiles.counts >= FEWEST_PIXELS
    calm = ndimage.gaussian_filter1d(np.where(used, sign * profiles.greys, 0.0), 2.0, axis=1)
    calm = calm / np.maximum(ndimage.gaussian_filter1d(used.astype(np.float64), 2.0, axis=1), 1e-6)
    bins = profiles.greys.shape[1]
    places: FloatArray = (np.arange(bins, dtype=np.float64) - bins // 2) * BIN
    from_middle: FloatArray = places - shift * profiles.scales[:, None]
    inner = used & (np.abs(from_middle) < INSIDE_SHARE * plan.spacing * profiles.scales[:, None])
    inside = np.where(inner, calm, 0.0).sum(axis=1) / np.maximum(inner.sum(axis=1), 1)
    edges: list[FloatArray] = []
    besides: list[FloatArray] = []
    for side in (1.0, -1.0):
        out = used & (side * from_middle > 0.0)
        beside = np.where(out, calm, np.inf).min(axis=1)
        below = out & (calm < (0.5 * (inside + beside))[:, None])
        first = np.where(below, side * from_middle, np.inf).min(axis=1)
        edges.append(side * first + shift * profiles.scales - 0.5 * side * BIN)
        besides.append(beside)
    enough = (used.sum(axis=1) >= FEWEST_BINS) & (inner.sum(axis=1) > 2)
    found = enough & np.isfinite(edges[0]) & np.isfinite(edges[1])
    left, right = np.where(found, edges[0], 1.0), np.where(found, edges[1], -1.0)
    found &= left - right >= NARROWEST
    left, right = np.where(found, left, 1.0), np.where(found, right, -1.0)
    lower = np.where(enough, np.median(besides, axis=0), inside)
    return _Levels(left, right, sign * inside, sign * np.where(np.isfinite(lower), lower, inside), found)


def _present(levels: _Levels, plan: PlannedRuns, *, darker: bool) -> BoolArray:
    """Return on which (k,) stretches there is the step of light that beads nearby have."""
    sign = -1.0 if darker else 1.0
    nearby = np.asarray(KDTree(plan.places).query(plan.places, k=min(NEARBY, len(plan.places)))[1])
    inside, beside = sign * levels.inside, sign * levels.beside
    usual, lower = np.percentile(inside[nearby], 75.0, axis=1), np.percentile(beside[nearby], 25.0, axis=1)
    overall = float(np.percentile(inside, 75.0) - np.percentile(beside, 25.0))
    step = np.maximum(usual - lower, max(PRESENT * overall, LEAST_STEP))
    return np.asarray(inside - lower > PRESENT * step)


def _next_edges(plan: PlannedRuns, half: FloatArray, rim: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return how far the next edge is to the left and right of each stretch, (k, 2) [mm], and where lines join.

    Next is the rim of the part, or the near edge of another bead.
    """
    count, reach = len(plan.places), 1.7 * plan.spacing
    places = np.vstack([plan.places, rim])
    nearer = np.concatenate([half, np.zeros(len(rim))])
    lengths = np.cumsum(np.concatenate([[0.0], plan.lengths]))[:-1]
    aside, result, joined = aside_of(plan), np.full((count, 2), np.inf), np.zeros(count, dtype=np.bool_)
    for row, close in enumerate(KDTree(places).query_ball_point(plan.places, reach)):
        near = np.array(close, dtype=np.int64)
        off = places[near] - plan.places[row]
        forward, left = off @ plan.ahead[row], off @ aside[row]
        runs = near < count
        own = np.zeros(near.size, dtype=np.bool_)
        own[runs] = plan.runs[near[runs]] == plan.runs[row]
        along = np.zeros(near.size)
        along[own] = np.abs(lengths[near[own]] - lengths[row])
        whole = float(plan.lengths[plan.runs == plan.runs[row]].sum()) if own.any() else 0.0
        along = np.minimum(along, np.abs(whole - along))
        other = ~(own & (along < 1.5 * np.linalg.norm(off, axis=1) + plan.lengths[row]))
        joined[row] = bool((other & runs & (np.linalg.norm(off, axis=1) < JOINED_SHARE * plan.spacing)).any())
        for side, sign in enumerate((1.0, -1.0)):
            beyond = other & (np.abs(forward) < 0.7 * plan.lengths[row]) & (sign * left > 0.0)
            if beyond.any():
                result[row, side] = max(float((np.abs(left) - nearer[near])[beyond].min()), 0.1)
    return result, joined


def _rows(profiles: Profiles, levels: _Levels, next_edges: FloatArray, *, darker: bool) -> Rows:
    """Return profiles as they are fitted, without what is white, or black, and what is beyond the next edge."""
    kept = (profiles.counts >= FEWEST_PIXELS) & (profiles.white <= MOST_WHITE) & (profiles.greys < NEARLY_WHITE)
    if darker:
        kept &= profiles.greys > 1.0 - NEARLY_WHITE
    kept &= (profiles.asides < next_edges[:, :1]) & (profiles.asides > -next_edges[:, 1:])
    reach = 40.0
    return Rows(
        profiles.asides, profiles.greys, np.where(kept, profiles.counts, 0.0), levels.lefts, levels.rights,
        levels.inside, levels.beside, np.where(next_edges[:, 0] < reach, next_edges[:, 0], np.inf),
        np.where(next_edges[:, 1] < reach, -next_edges[:, 1], -np.inf), np.zeros(len(levels.lefts), dtype=np.int64),
    )  # fmt: skip


def _rim_rows(
    grey: FloatArray, camera: Camera, plan: PlannedRuns, outer: FloatArray, outline: PartOutline, *, optics: Optics
) -> Rows:
    """Return profiles across the rim of the part, from it outwards, where it is straight, steps, and has no bead near.

    Args:
        grey: (h, w) of the photograph.
        camera: that took it.
        plan: in stretches.
        outer: (k,) how far beside its run the edge of each bead is [pixels].
        outline: the part's.
        optics: about; noise in the dark moves means of grey values, but not those of light.
    """
    across = np.arange(-RIM_REACH, RIM_REACH + 0.5 * BIN, BIN)
    pixels, outward = outline.pixels, outline.outward
    along = np.column_stack([-outward[:, 1], outward[:, 0]])
    at = pixels[:, None, None, :] + across[:, None, None] * outward[:, None, None, :]
    at = at + np.arange(-3.0, 4.0)[:, None] * along[:, None, None, :]
    light = ndimage.map_coordinates(grey**optics.gamma, [at[..., 1], at[..., 0]], order=1, mode="nearest")
    greys = light.mean(axis=2) ** (1.0 / optics.gamma)
    distances, owners = KDTree(camera.seen(plan.places)).query(pixels)
    free = np.asarray(distances) - outer[np.asarray(owners)] - BEAD_BLURS * optics.blur
    inside, beside = greys[:, (across > -5.0) & (across < -2.0)].mean(axis=1), greys[:, -6:].mean(axis=1)
    margin = RIM_REACH + 5.0
    good = ((pixels > margin) & (pixels < np.array(grey.shape[::-1]) - 1.0 - margin)).all(axis=1)
    good &= (np.abs(inside - beside) > RIM_STEP) & (free > RIM_BLURS * optics.blur)
    if len(pixels):
        for row, near in enumerate(KDTree(pixels).query_ball_point(pixels, RIM_REACH + 6.0)):
            good[row] &= bool((outward[near] @ outward[row] > RIM_STRAIGHT).all())
    kept = (across > -free[:, None]) & (greys < NEARLY_WHITE)
    count = int(good.sum())
    return Rows(
        np.tile(across, (count, 1)), greys[good], np.where(kept, 7.0, 0.0)[good], np.zeros(count),
        np.full(count, -1e3), inside[good], beside[good], np.full(count, np.inf),
        np.full(count, -np.inf), np.ones(count, dtype=np.int64),
    )  # fmt: skip


def _lone(plan: PlannedRuns, joined: BoolArray) -> BoolArray:
    """Return which (k,) stretches are neither a corner nor where lines join."""
    corner = np.zeros(plan.runs.size, dtype=np.bool_)
    ends = np.zeros(plan.runs.size, dtype=np.bool_)
    for run in np.unique(plan.runs).tolist():
        own = np.flatnonzero(plan.runs == run)
        ahead = plan.ahead[own]
        for step in range(1, min(OVER, own.size - 1) + 1):
            turned = (ahead[step:] * ahead[:-step]).sum(axis=1) < CORNER
            for shift in range(step + 1):
                corner[own[shift : own.size - step + shift]] |= turned
        ends[own[:1]] = ends[own[-1:]] = True
    wide = ndimage.binary_dilation(corner, iterations=OVER)
    return ~(joined | wide | ends)


def _on_part(
    fitted: FittedEdges,
    which: IntArray,
    profiles: Profiles,
    present: BoolArray,
    lone: BoolArray,
    *,
    sights: FloatArray,
    optics: Optics,
    darker: bool,
    alike: str,
) -> MeasuredStretches:
    """Return what was fitted in mm on the part."""
    count, scales = present.size, profiles.scales[which]
    edged, lefts, rights = np.zeros(count, dtype=np.bool_), np.zeros(count), np.zeros(count)
    deviations, flanks = np.zeros((count, 2)), np.zeros(count)
    edged[which], flanks[which] = True, fitted.flanks
    lefts[which], rights[which] = fitted.lefts / scales, fitted.rights / scales
    deviations[which] = fitted.deviations / scales[:, None]
    # Of most stretches: those that have lost an edge move by anything.
    common = np.linalg.norm(np.median(fitted.common / scales[:, None, None], axis=0), axis=1)
    middle = np.abs(profiles.asides) < 0.5 * np.median(fitted.lefts - fitted.rights)
    weights = np.where(middle & present[:, None], profiles.counts, 0.0)
    white = float((weights * profiles.white).sum() / max(float(weights.sum()), 1.0))
    return MeasuredStretches(
        present, edged, lefts, rights, deviations, common, lone, flanks, sights, optics, darker, white, alike,
        float((1.0 / profiles.scales).mean()),
    )  # fmt: skip
