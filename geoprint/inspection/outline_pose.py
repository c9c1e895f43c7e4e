"""Where a camera stood, by the outline of the part in its photograph: many poses tried, the best ones fitted.

Where several fit alike, as of a part that looks the same from two sides, the lines that are printed decide, if they do
so clearly. Where they do not, or do not lie where the plan has them, or the outline leaves open what is seen where,
nothing is placed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation
from scipy.stats import t as student

from geoprint.errors import InputError, how_many, percent
from geoprint.geometry import mean_normal, united
from geoprint.inspection.against_plan import PlannedRuns
from geoprint.inspection.beads import BeadLine
from geoprint.inspection.camera import Camera, Lens, OutlinePlacing
from geoprint.inspection.on_part import place_beads
from geoprint.inspection.outline import OutlinedPart, PartOutline, PictureOutline
from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.transforms import apply, inverse, rigid, rotation_angle

# How near to the plan the lines of a photograph lie, if the camera stood at a place that is tried.


# No place between runs is farther from one than this, over the spacing.
FARTHEST_LINE = 0.5


@final
class PrintedLines:
    """The lines of a photograph, and the plan that they are a print of."""

    def __init__(self, beads: tuple[BeadLine, ...], surface: Surface, plan: PlannedRuns) -> None:
        self._beads, self._surface, self._spacing = beads, surface, plan.spacing
        self._planned = KDTree(plan.finely(np.ones(len(plan.places), dtype=np.bool_)))

    def off(self, camera: Camera) -> float:
        """Return the mean distance from the lines to the nearest runs, over the spacing: 0 on them, at most a half.

        Lines that are no print of these runs are about a quarter off.

        Args:
            camera: that is thought to have seen them.
        """
        try:
            middles = place_beads(self._beads, camera, self._surface).middles
        except InputError:
            return FARTHEST_LINE
        distances = np.asarray(self._planned.query(middles)[0]) / self._spacing
        return float(np.minimum(distances, FARTHEST_LINE).mean())


# How well a pose is known that was fitted to an outline: least squares whose errors are alike along it.
#
# What is left of a fit is alike over stretches of the outline, so its covariance is that of blocks of it that are
# the more alike the nearer they are [Conley1999]. Each block counts with what it would pull if the fit had been made
# without it [Bell2002], and residuals that count less move the fit more than their weights say, by the slope of
# Tukey's function [Huber1964]. Errors of the edge itself, which a fit takes up and leaves nothing of, are added.


# Of [Beaton1974], and from a median to a standard deviation; no edge is found better than this [pixels].
TUKEY, MAD, LEAST_NOISE = 4.685, 1.4826, 0.02
# An outline is cut into so many blocks; they are alike over so many (standard deviation).
BLOCKS, ALIKE_BLOCKS = 72, 2.0
# A block fixes no more of a direction than this share, where its pull without it is asked for; and residuals move the
# fit by no less than this share of their weights.
MOST_LEVERAGE, LEAST_SLOPE = 0.9, 0.3
# The steepest place of an edge is off where the edge is by this (standard deviation) [coarse pixels]: all along an
# outline by one amount, and by another on each of so many stretches.
EDGE_BIAS, COVARIANCE_STRETCHES = 0.05, 12
# Directions are fixed by no less than this share of the best fixed one; what nothing fixes becomes very uncertain.
LEAST_EIGENVALUE = 1e-10
# A covariance from so few blocks that are on their own is no better known than its degrees of freedom: 95 of 100 lie
# within so many standard deviations, of Student's t.
FITTED = 6
WITHIN_95 = float(student.ppf(0.975, BLOCKS / (float(np.sqrt(2.0 * np.pi)) * ALIKE_BLOCKS) - FITTED))


def robust_weights(off: FloatArray) -> FloatArray:
    """Return the (k,) weights of residuals [pixels]: 1 at none, 0 far beyond their spread [Beaton1974]."""
    return (1.0 - _ratios(off) ** 2) ** 2


def covariance_of(off: FloatArray, slopes: FloatArray, order: IntArray, *, count: int, unit: float) -> FloatArray:
    """Return the (6, 6) covariance of what was fitted.

    Args:
        off: (k,) residuals at the end of the fit [pixels].
        slopes: (k, 6) of them with what was fitted.
        order: (k,) place of each in the closed outline, from 0 to the count.
        count: of places of the outline.
        unit: pixels that were one where the part was looked for.
    """
    weights = robust_weights(off)
    scale: FloatArray = 1.0 / np.sqrt(np.maximum((weights[:, None] * slopes**2).sum(axis=0), 1e-300))
    rows = slopes * scale
    weighted = rows * weights[:, None]
    sizes, axes = np.linalg.eigh(weighted.T @ rows)
    sizes = np.maximum(sizes, LEAST_EIGENVALUE * sizes[-1])
    # In units in which all residuals together fix each direction to 1.
    to_unit: FloatArray = axes / np.sqrt(sizes)
    pulled = _pulled(off, rows @ to_unit, order * BLOCKS // count, weights)
    stretches = order * COVARIANCE_STRETCHES // count
    leaning = np.array([weighted[stretches == stretch].sum(axis=0) for stretch in range(COVARIANCE_STRETCHES)])
    biases = np.vstack([leaning.sum(axis=0), leaning]) @ to_unit
    inner = pulled + (EDGE_BIAS * unit) ** 2 * biases.T @ biases
    return scale[:, None] * (to_unit @ inner @ to_unit.T) * scale


def _pulled(off: FloatArray, rows: FloatArray, blocks: IntArray, weights: FloatArray) -> FloatArray:
    """Return the (6, 6) covariance of the sum of all pulls, in units in which the weighted rows fix all to 1."""
    weighted = rows * weights[:, None]
    pulls, fixed = np.zeros((BLOCKS, 6)), np.zeros((BLOCKS, 6, 6))
    np.add.at(pulls, blocks, weighted * off[:, None])
    np.add.at(fixed, blocks, np.einsum("ki,kj->kij", weighted, rows))
    gaps = np.abs(np.arange(BLOCKS)[:, None] - np.arange(BLOCKS))
    alike = np.exp(-0.5 * (np.minimum(gaps, BLOCKS - gaps) / ALIKE_BLOCKS) ** 2)
    shares, directions = np.linalg.eigh(np.einsum("gh,hij->gij", alike, fixed))
    own = np.einsum("gji,gj->gi", directions, pulls) / (1.0 - np.clip(shares, 0.0, MOST_LEVERAGE))
    without = np.einsum("gij,gj->gi", directions, own)
    u = _ratios(off)
    # Of r (1 - u^2)^2 with r: (1 - u^2) (1 - 5 u^2).
    slope = max(float(((1.0 - u**2) * (1.0 - 5.0 * u**2)).sum() / weights.sum()), LEAST_SLOPE)
    variances, principal = np.linalg.eigh(without.T @ alike @ without / slope**2)
    # Nothing is known better than if all residuals erred on their own.
    return (principal * np.maximum(variances, _noise(off) ** 2)) @ principal.T


def _noise(off: FloatArray) -> float:
    return max(MAD * float(np.median(np.abs(off))), LEAST_NOISE)


def _ratios(off: FloatArray) -> FloatArray:
    """Return the (k,) residuals over what is too far, at most 1."""
    return np.minimum(np.abs(off) / (TUKEY * _noise(off)), 1.0)


# A pose fitted to an outline in a picture, by Gauss and Newton.
#
# Each place of the part's outline is drawn towards the nearest edge in the picture, across that edge alone, and
# counts the less the farther off it is [Beaton1974]. On a rounded part the outline moves over it as the camera
# moves; across the edge that is of second order.


# A fit ends where a step moves the outline by less [pixels].
SETTLED = 0.005
# A step of a fit turns by no more than this [rad], and shifts by no more than this share of the distance; what is fixed
# by less than this share of the rest stays.
LONGEST_TURN, LONGEST_SHIFT, LEAST_FIXED = 0.2, 0.2, 1e-10
# Places of the part's outline count where they face as the nearest edge does (cosine), and lie no farther from it than
# so many medians, or than this [pixels]; so many of them do, at least this share.
SAME_FACING, FARTHEST, NEAR, FEWEST, LEAST_MATCHED = 0.3, 3.0, 2.0, 16, 0.4
# How far a place is off counts up to this [pixels], or this share of the outline's extent: beyond, it is another edge.
MOST_OFF, MOST_OFF_SHARE = 1.5, 0.0025
# Slopes are differences over this share of the distance.
NUDGE = 1e-5
# So many vertices stand for all of a part.
SOME_VERTICES = 500


@final
@frozen
class FittedPose:
    """A pose, and how well the outline fits.

    Attributes:
        T_camera_work: (4, 4).
        off: root mean square distance of both outlines from each other [pixels].
    """

    T_camera_work: FloatArray
    off: float

    def __post_init__(self) -> None:
        freeze_arrays(self, T_camera_work="float: 4 4")


@final
@frozen
class _Matched:
    """Places of the part's outline, matched with the nearest edges in the picture.

    Attributes:
        off: (k,) how far out of these they lie [pixels].
        slopes: (k, 6) by how much more for a turn [rad] about the middle and a shift [mm], in the camera's coordinates.
        order: (k,) that the edges have in the picture's outline.
        middle: (3,) of the part, in the camera's coordinates [mm].
        own: all of the part's outline, also what is not matched.
        away: (j,) distance of its places from the nearest edges [pixels].
        across: (j,) the same, across these edges [pixels].
    """

    off: FloatArray
    slopes: FloatArray
    order: IntArray
    middle: FloatArray
    own: PartOutline
    away: FloatArray
    across: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, off="float: k", slopes="float: k 6", order="int: k", middle="float: 3", away="float: j",
            across="float: j",
        )  # fmt: skip


@final
class OutlineFit:
    """An outline in a picture, and the part whose outline it is, to which poses are fitted.

    Attributes:
        seen: the outline in the picture.
        outlined: all that has it.
        lens: of the camera.
        places: (k, 3) that stand for all of the part that is printed on [mm].
        most_off: how far a place of an outline counts as off [pixels].
    """

    def __init__(self, seen: PictureOutline, outlined: OutlinedPart, lens: Lens, *, printed: Surface) -> None:
        self.seen, self.outlined, self.lens = seen, outlined, lens
        self.places: FloatArray = printed.vertices[:: max(1, len(printed.vertices) // SOME_VERTICES)]
        self.most_off = max(MOST_OFF, MOST_OFF_SHARE * float(np.ptp(seen.pixels, axis=0).max()))
        self._middle: FloatArray = outlined.surface.vertices.mean(axis=0)
        self._tree = KDTree(seen.pixels)

    def fitted(self, T_camera_work: FloatArray, *, steps: int, places: int) -> FittedPose | None:
        """Return a pose fitted to the outline in the picture; None where it loses it.

        Args:
            T_camera_work: (4, 4) to start from.
            steps: at most.
            places: of the part's outline.
        """
        pose = T_camera_work
        for _ in range(steps):
            matched = self._matched(pose, places=places)
            if matched is None:
                return None
            step = _step(matched)
            turn = rigid(Rotation.from_rotvec(step[:3]).as_matrix(), np.zeros(3))
            about = rigid(np.eye(3), matched.middle)
            pose = about @ rigid(np.eye(3), step[3:]) @ turn @ inverse(about) @ pose
            if float(np.sqrt(((matched.slopes @ step) ** 2).mean())) < SETTLED:
                break
        matched = self._matched(pose, places=places)
        if matched is None:
            return None
        return FittedPose(pose, _mutual(matched, self.seen, most=self.most_off))

    def within(self, pose: FittedPose, *, places: int) -> float:
        """Return within what a place of the part is seen with 95 % confidence, the largest of all places [pixels].

        Args:
            pose: that was fitted.
            places: of the part's outline.
        """
        T, matched = pose.T_camera_work, self._matched(pose.T_camera_work, places=places)
        if matched is None:
            return np.inf
        covariance = covariance_of(
            matched.off, matched.slopes, matched.order, count=len(self.seen.pixels), unit=self.seen.unit
        )
        slopes = _slopes(apply(T, self.places), matched.middle, self.lens)
        spreads = np.linalg.eigvalsh(slopes @ covariance @ slopes.transpose(0, 2, 1))[:, -1]
        return WITHIN_95 * float(np.sqrt(spreads.max()))

    def apart(self, one: FittedPose, other: FittedPose) -> float:
        """Return how far apart two poses see a place of the part, the largest of all places [pixels]."""
        seen = [self.lens.seen(apply(each.T_camera_work, self.places)) for each in (one, other)]
        return float(np.linalg.norm(seen[0] - seen[1], axis=1).max())

    def _matched(self, T_camera_work: FloatArray, *, places: int) -> _Matched | None:
        """Return the outline under a pose matched with that in the picture; None where too little of it lies near."""
        T = T_camera_work
        if (self.outlined.surface.vertices @ T[2, :3] + T[2, 3]).min() <= 0.0:
            return None
        own = self.outlined.under(Camera(self.lens, T, 0.0, 0), places=places)
        if len(own.pixels) < FEWEST:
            return None
        away, nearest = (np.asarray(each) for each in self._tree.query(own.pixels))
        normals = self.seen.outward[nearest]
        facing = (normals * own.outward).sum(axis=1) > SAME_FACING
        if not facing.any():
            return None
        used = facing & (away <= max(FARTHEST * float(np.median(away[facing])), NEAR))
        if used.sum() < max(FEWEST, LEAST_MATCHED * len(away)):
            return None
        off = ((own.pixels - self.seen.pixels[nearest]) * normals).sum(axis=1)
        middle = T[:3, :3] @ self._middle + T[:3, 3]
        slopes = np.einsum("ki,kij->kj", normals[used], _slopes(apply(T, own.places[used]), middle, self.lens))
        return _Matched(off[used], slopes, nearest[used], middle, own, away, off)


def _step(matched: _Matched) -> FloatArray:
    """Return the (6,) step of a fit: a turn about the middle [rad], and a shift [mm]."""
    weights = robust_weights(matched.off)
    normal = (matched.slopes * weights[:, None]).T @ matched.slopes
    found = np.linalg.lstsq(normal, matched.slopes.T @ (weights * matched.off), rcond=LEAST_FIXED)[0]
    step = -np.asarray(found, dtype=np.float64)
    step = step * min(1.0, LONGEST_TURN / max(float(np.linalg.norm(step[:3])), 1e-12))
    return step * min(1.0, LONGEST_SHIFT * float(matched.middle[2]) / max(float(np.linalg.norm(step[3:])), 1e-12))


def _mutual(matched: _Matched, seen: PictureOutline, *, most: float) -> float:
    """Return the root mean square distance of two outlines, across them where places are opposite each other."""
    own = matched.own
    tree = KDTree(own.pixels)
    back, nearest = (np.asarray(each) for each in tree.query(seen.pixels))
    gap = 2.0 * float(np.median(np.asarray(tree.query(own.pixels, k=2)[0])[:, 1]))
    across = ((seen.pixels - own.pixels[nearest]) * own.outward[nearest]).sum(axis=1)
    there = np.where(matched.away <= np.abs(matched.across) + NEAR, matched.across, matched.away)
    here = np.where(back <= np.abs(across) + gap + NEAR, across, back)
    squares = [float((np.minimum(np.abs(each), most) ** 2).mean()) for each in (there, here)]
    return float(np.sqrt(0.5 * sum(squares)))


def _slopes(places: FloatArray, middle: FloatArray, lens: Lens) -> FloatArray:
    """Return the (k, 2, 6) slopes of pixels with a turn about the middle [rad] and a shift [mm].

    Args:
        places: (k, 3) in the camera's coordinates [mm].
        middle: (3,) likewise.
        lens: of the camera.
    """
    nudge = NUDGE * middle[2]
    shifts = [nudge * axis for axis in np.eye(3)]
    along = np.stack([(lens.seen(places + each) - lens.seen(places - each)) / (2.0 * nudge) for each in shifts], axis=2)
    # A turn w moves a place at r from the middle by w x r: its slope with w is r x (slope with the place).
    turning = np.cross((places - middle)[:, None, :], along)
    return np.concatenate([turning, along], axis=2)


# Poses from which a part may have the outline that is seen: one for every direction and likely turn about its axis.
#
# From every direction the outline of the part is compared with the one in the picture as a curve of its distance
# from its own middle over the angle: that tells how the camera was turned about its axis, and how far away it stood.


# Directions to look from, all around: neighbours are about 10 degrees apart.
DIRECTIONS = 420
# Bins of the angle, and turns about the axis that are kept of each direction.
BINS, TURNS = 120, 3
# Places of an outline that is compared, and how large it is for that [pixels].
PLACES, SIZE = 200, 300.0
# The mean normal of what is printed is longer than this where it has a side.
LEAST_FACING = 0.5
# Distances that are compared from, over the size of a part: farther than this nothing of it is behind the camera.
LEAST_AWAY, MEAN_SIZE = 1.5, 0.8


def likely_poses(seen: PictureOutline, outlined: OutlinedPart, lens: Lens, *, facing: FloatArray) -> list[FloatArray]:
    """Return (4, 4) poses of the camera, one for each direction and likely turn, the likeliest outline first.

    Args:
        seen: the outline in the picture.
        outlined: the part.
        lens: of the camera.
        facing: (3,) the mean normal of what is printed, which the camera looks at.
    """
    looked = lens.directions(seen.pixels)
    R_ray = _toward(looked.mean(axis=0))
    flat = looked @ R_ray
    middle, curve, size = _signature(flat[:, :2] / flat[:, 2:])
    vertices = outlined.surface.vertices
    centre = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    radius = float(np.linalg.norm(vertices - centre, axis=1).max())
    away = radius * max(MEAN_SIZE / size, LEAST_AWAY)
    focal = SIZE * away / radius
    pinhole = Lens((1, 1), np.full(2, focal), np.zeros(2), np.zeros(2))
    tried: list[tuple[float, FloatArray]] = []
    for direction in _directions(facing):
        R_first = _toward(-direction).T
        T_first = rigid(R_first, np.array([0.0, 0.0, away]) - R_first @ centre)
        outline = outlined.under(Camera(pinhole, T_first, 0.0, 0), places=PLACES)
        if len(outline.pixels) < BINS // 4:
            continue
        shift, own, own_size = _signature(outline.pixels / focal)
        distance = away * own_size / size
        for unlike, turn in _turns(curve, own):
            R_turn = Rotation.from_rotvec([0.0, 0.0, turn]).as_matrix()
            place = R_turn @ np.array([-away * shift[0], -away * shift[1], distance])
            place += distance * np.array([*middle, 0.0])
            R = R_ray @ R_turn @ R_first
            tried.append((unlike, rigid(R, R_ray @ place - R @ centre)))
    return [pose for _, pose in sorted(tried, key=lambda each: each[0])]


def _directions(facing: FloatArray) -> FloatArray:
    """Return (n, 3) unit directions evenly all around, from which what is printed is looked at."""
    steps = np.arange(DIRECTIONS) + 0.5
    high, turns = 1.0 - 2.0 * steps / DIRECTIONS, np.pi * (1.0 + 5.0**0.5) * steps
    level = np.sqrt(1.0 - high**2)
    around = np.column_stack([level * np.cos(turns), level * np.sin(turns), high])
    return around[around @ facing > 0.0] if has_a_side(facing) else around


def has_a_side(facing: FloatArray) -> bool:
    """Return whether what is printed has a side: its mean normal is short where it goes all around a part."""
    return float(np.linalg.norm(facing)) > LEAST_FACING


def _toward(ahead: FloatArray) -> FloatArray:
    """Return a (3, 3) rotation whose third column looks ahead."""
    z = ahead / np.linalg.norm(ahead)
    guide = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(guide, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _signature(flat: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return the (2,) middle of an outline, its (BINS,) distance from there over the angle, and the mean of it."""
    middle = flat.mean(axis=0)
    off = flat - middle
    bins = np.floor((np.arctan2(off[:, 1], off[:, 0]) / (2.0 * np.pi) + 0.5) * BINS).astype(np.int64) % BINS
    far = np.zeros(BINS)
    np.maximum.at(far, bins, np.linalg.norm(off, axis=1))
    known = np.flatnonzero(far)
    far = np.interp(np.arange(BINS), known, far[known], period=BINS)
    size = float(far.mean())
    return middle, far / size, size


def _turns(curve: FloatArray, own: FloatArray) -> list[tuple[float, float]]:
    """Return how unlike two signatures are, and by what angle the other is turned, at its least values."""
    together = np.fft.irfft(np.fft.rfft(curve) * np.conj(np.fft.rfft(own)), BINS) / BINS
    unlike = np.sqrt(np.maximum((curve**2).mean() + (own**2).mean() - 2.0 * together, 0.0))
    lowest = np.flatnonzero((unlike <= np.roll(unlike, 1)) & (unlike < np.roll(unlike, -1)))
    best = lowest[np.argsort(unlike[lowest])][:TURNS]
    return [(float(unlike[k]), 2.0 * np.pi * k / BINS) for k in best.tolist()]


# A camera looks at the print at least this steeply [rad].
FLATTEST = np.radians(10.0)
# So many of the poses that are tried are fitted coarsely, and so many of these finely.
COARSE, FINE = 100, 12
COARSE_PLACES, FINE_PLACES = 200, 900
COARSE_STEPS, FINE_STEPS = 12, 40
# Poses are one that see all places of the part within this share of what counts as another edge.
SAME_COARSELY, SAME_FINELY = 4.0, 0.25
# An outline fits where it is off by no more of what counts as another edge, and tells enough where places of the part
# are seen within so much of that, with 95 % confidence.
WORST_SHARE, MOST_WITHIN = 0.5, 2.0
# Another pose fits as well where residuals of so many stretches that err on their own are no more likely under the best
# one than by this factor of their squares (a factor of 20,000 in likelihood).
STRETCHES, LEAST_WORSE = 40.0, 20.0
# Lines of a print lie within this of the runs, over the spacing, half of what lines elsewhere do; and they tell one
# place of the camera from another where they lie so many times nearer. None is nearer than the last one says.
MOST_LINES_OFF, CLEARLY, NEAREST_LINES = 0.125, 2.0, 0.01


def camera_by_outline(
    seen: PictureOutline, printed: Surface, lens: Lens, *, lines: PrintedLines, beside: Sequence[Surface] = ()
) -> Camera:
    """Return where a camera stood, by the outline of the part in its photograph.

    Args:
        seen: the outline in the picture.
        printed: the surface that is printed on, and that the camera looks at.
        lens: of the camera.
        lines: that the photograph shows, and their plan.
        beside: what stands there besides, as the body that the surface lies on.

    Raises:
        InputError: no pose fits, several do and the lines tell none from another, the lines lie beside the plan, or
            the outline leaves open what is seen where.
    """
    fit = OutlineFit(seen, OutlinedPart(united([printed, *beside])), lens, printed=printed)
    alike = _alike(_fitted(fit, facing=mean_normal(printed)), fit)
    allowed = MOST_WITHIN * fit.most_off
    # What is seen within what is allowed is no other place of the camera: it makes the best one less certain.
    others = [each for each in alike[1:] if fit.apart(alike[0], each) > allowed]
    best, off, clearer = _decided([alike[0], *others], fit, lines)
    if off > MOST_LINES_OFF:
        raise InputError(
            f"placed by the outline of {printed.name}, the printed lines lie {percent(off)} of the spacing off the "
            f"runs on average, allowed are {percent(MOST_LINES_OFF, 1)}. Check plan, part and `--width`, or give "
            "`--fiducials`, at least four points of the part.",
            lines_off=off,
        )
    spread = max(apart for each in alike if (apart := fit.apart(best, each)) <= allowed)
    within = float(np.hypot(fit.within(best, places=FINE_PLACES), spread))
    if not within <= allowed:
        raise InputError(
            f"the outline of {printed.name} leaves the camera uncertain: points of the part are seen within "
            f"{within:.3g} pixels (95 %), allowed are {allowed:.3g}. Give `--fiducials`, at least four points of the "
            "part.",
            within=within,
        )
    camera = Camera(lens, best.T_camera_work, best.off, 0)
    pixels = fit.outlined.under(camera, places=FINE_PLACES).pixels
    placing = OutlinePlacing(pixels, within, 1 + len(others), clearer)
    return Camera(lens, best.T_camera_work, best.off, 0, placing)


def _fitted(fit: OutlineFit, *, facing: FloatArray) -> list[FittedPose]:
    """Return the poses that the outline may have been seen from, the best first."""
    tried = likely_poses(fit.seen, fit.outlined, fit.lens, facing=facing)[:COARSE]
    coarse = [fit.fitted(pose, steps=COARSE_STEPS, places=COARSE_PLACES) for pose in tried]
    likely = _distinct(coarse, fit, share=SAME_COARSELY)[:FINE]
    fine = [fit.fitted(each.T_camera_work, steps=FINE_STEPS, places=FINE_PLACES) for each in likely]
    return [each for each in _distinct(fine, fit, share=SAME_FINELY) if _looks_at(each, fit, facing)]


def _distinct(poses: Sequence[FittedPose | None], fit: OutlineFit, *, share: float) -> list[FittedPose]:
    """Return poses that see a place of the part farther apart than a share of `most_off`, the best first."""
    found: list[FittedPose] = []
    for each in sorted((pose for pose in poses if pose is not None), key=lambda pose: pose.off):
        if all(fit.apart(each, other) > share * fit.most_off for other in found):
            found.append(each)
    return found


def _looks_at(each: FittedPose, fit: OutlineFit, facing: FloatArray) -> bool:
    """Return whether a camera looks at what is printed."""
    away = inverse(each.T_camera_work)[:3, 3] - fit.places.mean(axis=0)
    steep = float(away @ facing) / float(np.linalg.norm(away) * max(float(np.linalg.norm(facing)), 1e-12))
    return steep > np.sin(FLATTEST) or not has_a_side(facing)


def _alike(found: Sequence[FittedPose], fit: OutlineFit) -> list[FittedPose]:
    """Return the best pose, if it fits, and those that fit as well."""
    allowed = WORST_SHARE * fit.most_off
    if not found or found[0].off > allowed:
        off = f"; the nearest is {found[0].off:.2g} pixels off, allowed are {allowed:.2g}" if found else ""
        raise InputError(
            f"no camera position shows the outline of {fit.outlined.surface.name} as in the photograph{off}. Check "
            "the lens, and that only the part and its body are visible, or give `--fiducials`, at least four points "
            "of the part.",
        )
    squares = [STRETCHES * (each.off / found[0].off) ** 2 for each in found]
    return [each for each, square in zip(found, squares, strict=True) if square - STRETCHES < LEAST_WORSE]


def _decided(
    alike: Sequence[FittedPose], fit: OutlineFit, lines: PrintedLines
) -> tuple[FittedPose, float, float | None]:
    """Return of poses that fit alike the one by the lines, how far off these are, and how much clearer it is."""
    tried = sorted(
        ((lines.off(Camera(fit.lens, each.T_camera_work, each.off, 0)), each) for each in alike),
        key=lambda pair: pair[0],
    )
    (off, best), *rest = tried
    if not rest:
        return best, off, None
    clearer = max(rest[0][0], NEAREST_LINES) / max(off, NEAREST_LINES)
    if clearer < CLEARLY:
        turn = np.degrees(rotation_angle(best.T_camera_work[:3, :3] @ rest[0][1].T_camera_work[:3, :3].T))
        raise InputError(
            f"the outline of {fit.outlined.surface.name} fits {how_many(len(alike), 'camera position')}, two of them "
            f"{float(turn):.0f} degrees apart. The printed lines do not decide: their distances to the plan "
            f"differ by a factor of {clearer:.2g}, needed is {CLEARLY:g}. Give `--fiducials`, at least four points of "
            "the part.",
            alike=len(alike),
            clearer=clearer,
        )
    return best, off, clearer
