"""A pose fitted to an outline in a picture, by Gauss and Newton.

Each place of the part's outline is drawn towards the nearest edge in the picture, across that edge alone, and counts
the less the farther off it is [Beaton1974]. On a rounded part the outline moves over it as the camera moves; across the
edge that is of second order.
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from geoprint.appraisal.camera import Camera, Lens
from geoprint.appraisal.outlined.covariance import WITHIN_95, covariance_of, robust_weights
from geoprint.appraisal.outlined.part_outline import OutlinedPart, PartOutline
from geoprint.appraisal.outlined.picture_outline import PictureOutline
from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.transforms import apply, inverse, rigid

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
