"""What a plan leaves on its part, and what a scan is registered to."""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from geoprint.geometry import face_areas, normals
from geoprint.inspection.against_plan import PART_SHARE, PlannedRuns, parts_of, planned_runs
from geoprint.model import FloatArray, IntArray, PoseStream, Surface, SurfacePoints, freeze_arrays, frozen

# What a plan is to leave on its part: the height of the material over every place, and how it slopes.
#
# A bead is a parabola across, whose area is the flow; it ends in half a cap, and where beads meet they add up. So
# each stretch of a run deposits its volume along a straight line, and sqrt(R^2 - r^2) about every point of that, with R
# half the width: integrated along the line this has a closed form, and across a long one it is the parabola.
#
# How far material spreads, and whether all of it lies beside its path, nobody knows before it is printed: both are
# asked for, and what a little more of each makes of the height comes along, so that a scan can tell.


# What wider beads make of the height is told by beads as much wider and narrower as this (logarithm of the width). The
# mean of both is not the height: it is rounded where beads meet, and a scan that is laid onto it sinks by 0.01 mm.
SPREAD_STEP = 0.06
# Widths that are known: narrower beads would fall apart, wider ones are level (over the flow over the layer's height).
NARROWEST, WIDEST = 0.4, 2.5
# Places that are asked for at once; each meets a hundred stretches, so this takes 0.2 GB.
BATCH = 20_000


@final
@frozen
class Deposited:
    """Material over k places of a part.

    Attributes:
        heights: (k, 3) height [mm], and by how much more it is for a width that is e times as large [mm], and for beads
            that lie farther to the left.
        slopes: (k, 3, 3) gradient of these along the surface; 0 for the last, which hardly changes over a place.
    """

    heights: FloatArray
    slopes: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, heights="float: k 3", slopes="float: k 3 3")


@final
class PlannedDeposit:
    """What a plan deposits, asked place by place.

    Args:
        poses: of the plan.
        spacing: between neighbouring runs [mm].
        height: of the layer [mm].

    Attributes:
        runs: of the plan, in stretches.
        spacing: as given [mm].
        height: as given [mm].
        width: of a bead: its flow over the height, at most the spacing [mm].
        lefts: (k, 3) directions to the left of the stretches, as seen from outside.
        parts: (k,) of which part of its run each stretch is, about two spacings long, counted over all runs.

    Raises:
        InputError: nothing is deposited.
    """

    def __init__(self, poses: PoseStream, *, spacing: float, height: float) -> None:
        flow = poses.flow[poses.deposit]
        wide = float(np.median(flow)) / height if flow.size else spacing
        self.spacing, self.height, self.width = spacing, height, min(wide, spacing)
        self.runs: PlannedRuns = planned_runs(poses, spacing=self.width)
        self.parts: IntArray = parts_of(self.runs, long=PART_SHARE * spacing)
        self.lefts: FloatArray = np.cross(self.runs.normals, self.runs.ahead)
        self._tree = KDTree(self.runs.places)

    @property
    def volume(self) -> float:
        """All that is deposited [mm3]."""
        return float((self.runs.flows * self.runs.lengths).sum())

    def at(self, places: FloatArray, normals: FloatArray, *, spread: float = 1.0, offset: float = 0.0) -> Deposited:
        """Return the material over places of the part.

        Args:
            places: (k, 3) [mm].
            normals: (k, 3) outward unit normals there.
            spread: width of the beads, over the flow over the height of the layer.
            offset: by which all lie to the left of their paths, as seen from outside [mm].
        """
        deposited = self.runs.places + offset * self.lefts
        parts = [
            self._batch(places[start : start + BATCH], normals[start : start + BATCH], deposited, spread * self.width)
            for start in range(0, max(len(places), 1), BATCH)
        ]
        return Deposited(*(np.concatenate(each) for each in zip(*parts, strict=True)))

    def nearest(self, places: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return the (k,) distance [mm] and number of the stretch nearest to each of (k, 3) places."""
        away, which = self._tree.query(places)
        return np.asarray(away), np.asarray(which)

    def _batch(
        self, places: FloatArray, normals: FloatArray, deposited: FloatArray, width: float
    ) -> tuple[FloatArray, FloatArray]:
        runs, count = self.runs, len(places)
        radii = 0.5 * width * np.exp([SPREAD_STEP, 0.0, -SPREAD_STEP])
        longest = 0.5 * float(runs.lengths.max())
        near = KDTree(places).sparse_distance_matrix(
            KDTree(deposited), float(radii.max()) + longest, output_type="ndarray"
        )
        place, stretch = near["i"], near["j"]
        off, flows = places[place] - deposited[stretch], runs.flows[stretch]
        found: list[FloatArray] = []
        for radius in radii.tolist():
            high, slope = _deposited(off, runs.ahead[stretch], runs.lengths[stretch], radius)
            columns = [high, *slope.T]
            sums = [np.bincount(place, flows * each, minlength=count) for each in columns]
            found.append(np.column_stack(sums).astype(np.float64))
        wide, exact, narrow = found
        more = (wide - narrow) / (2.0 * SPREAD_STEP)
        lefts = self.lefts[self.nearest(places)[1]]
        heights = np.column_stack([exact[:, 0], more[:, 0], -(exact[:, 1:] * lefts).sum(axis=1)])
        slopes = np.stack([exact[:, 1:], more[:, 1:], np.zeros((count, 3))], axis=1)
        across = np.einsum("ksx,kx->ks", slopes, normals)
        return heights, slopes - across[:, :, None] * normals[:, None, :]


def _deposited(
    off: FloatArray, ahead: FloatArray, lengths: FloatArray, radius: float
) -> tuple[FloatArray, NDArray[np.float64]]:
    """Return (j,) height over (j, 3) places about straight stretches of flow 1, and its (j, 3) gradient."""
    along = (off * ahead).sum(axis=1)
    aside = off - along[:, None] * ahead
    room = radius**2 - (aside * aside).sum(axis=1)
    reach = np.sqrt(np.maximum(room, 0.0))
    scale = np.where(room > 0.0, 1.5 / (np.pi * radius**3), 0.0)
    ends = [np.clip(sign * 0.5 * lengths - along, -reach, reach) for sign in (-1.0, 1.0)]
    caps = [np.sqrt(np.maximum(reach**2 - end**2, 0.0)) for end in ends]
    angles = [np.arctan2(end, cap) for end, cap in zip(ends, caps, strict=True)]
    turned = angles[1] - angles[0]
    height = 0.5 * scale * (ends[1] * caps[1] - ends[0] * caps[0] + reach**2 * turned)
    slope = (scale * (caps[0] - caps[1]))[:, None] * ahead - (scale * turned)[:, None] * aside
    return height, slope


# What a scan is laid onto: places all over the part, with the material that is planned over each.


# Places are so far apart, over the width of a bead: between them the height of a ridge is straight to a hundredth.
APART_SHARE = 0.06
# Without beads, over the root of the area.
APART_BARE = 0.004
# More places than these take longer to find than they tell.
MOST_PLACES = 150_000
# A seed makes the same places of the same part.
SEED = 24


@final
class ScanTarget:
    """Places spread evenly over a part, as a scan is to find them, or those below the points of one.

    Args:
        surface: of the part.
        deposit: that is planned on it; None where nothing is.
        spread: width of its beads, over what their flow asks for.
        offset: by which they lie to the left of their paths [mm].
        below: places to take, the feet of a scan whose pose is nearly known: over each, the height is that of the
            deposit itself and not that of a slope beside it, which is another one across the line where beads meet.

    Attributes:
        surface: the part.
        places: (k, 3) on it [mm].
        normals: (k, 3) outward unit normals there.
        material: over them.
        parts: (k,) part of a run that is nearest to each.
        apart: usual distance of neighbouring places, where they are spread evenly [mm].
        area: of the part [mm2].
        deposit: as given.
        spread: as given.
        offset: as given.
    """

    def __init__(
        self,
        surface: Surface,
        deposit: PlannedDeposit | None,
        *,
        spread: float = 1.0,
        offset: float = 0.0,
        below: SurfacePoints | None = None,
    ) -> None:
        self.surface, self.deposit = surface, deposit
        self.spread, self.offset = spread, offset
        areas = face_areas(surface)
        self.area = float(areas.sum())
        side = APART_BARE * float(np.sqrt(self.area)) if deposit is None else APART_SHARE * deposit.width
        count = int(min(np.ceil(self.area / side**2), MOST_PLACES))
        points = spread_over(areas, count) if below is None else below
        self.places: FloatArray = points.xyz(surface)
        self.normals: FloatArray = normals(surface, points)
        self.apart = float(np.sqrt(self.area / count))
        taken = len(self.places)
        nothing = Deposited(np.zeros((taken, 3)), np.zeros((taken, 3, 3)))
        self.material = (
            nothing if deposit is None else deposit.at(self.places, self.normals, spread=spread, offset=offset)
        )
        self.parts: IntArray = (
            np.zeros(taken, dtype=np.int64) if deposit is None else deposit.parts[deposit.nearest(self.places)[1]]
        )
        self._tree = KDTree(self.places)

    @property
    def size(self) -> float:
        """Diagonal of the box about the part [mm]."""
        return float(np.linalg.norm(np.ptp(self.places, axis=0)))

    def nearest(self, points: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return the (j,) distance [mm] and number of the place nearest to each of (j, 3) points."""
        away, which = self._tree.query(points)
        return np.asarray(away), np.asarray(which)


def spread_over(areas: FloatArray, count: int) -> SurfacePoints:
    """Return places spread over faces by their areas: by steps of equal area over the faces, anywhere within each.

    Args:
        areas: (m,) of the faces.
        count: how many places.
    """
    random = np.random.default_rng(SEED)
    reached: FloatArray = np.cumsum(areas)
    steps = (np.arange(count) + random.random(count)) * float(reached[-1]) / count
    faces = np.minimum(np.searchsorted(reached, steps), len(areas) - 1)
    return SurfacePoints(faces, random.dirichlet(np.ones(3), count))


def even_pieces(areas: FloatArray, count: int) -> tuple[SurfacePoints, FloatArray]:
    """Return the middles of small triangles that faces are cut into, about equally large, and their (k,) areas [mm2].

    A mean over them is that over the surface with an error that falls with their area; of places at random, with the
    root of it.

    Args:
        areas: (m,) of the faces [mm2].
        count: about how many; at least one a face.
    """
    sides = np.maximum(np.rint(np.sqrt(areas * (count / areas.sum()))), 1.0).astype(np.int64)
    faces: list[IntArray] = []
    weights: list[FloatArray] = []
    for side in np.unique(sides).tolist():
        own = np.flatnonzero(sides == side)
        middles = _cut_middles(side)
        faces.append(np.repeat(own, len(middles)))
        weights.append(np.tile(middles, (len(own), 1)))
    cut = np.concatenate(faces)
    return SurfacePoints(cut, np.concatenate(weights)), areas[cut] / sides[cut] ** 2


def _cut_middles(side: int) -> FloatArray:
    """Return barycentric middles of the side^2 triangles that lines parallel to its sides cut a triangle into."""
    first, second = (each.ravel() for each in np.meshgrid(np.arange(side), np.arange(side)))
    upright, turned = first + second < side, first + second < side - 1
    corners = [np.column_stack([first, second])[which] + third for which, third in ((upright, 1 / 3), (turned, 2 / 3))]
    two = np.concatenate(corners) / side
    return np.column_stack([1.0 - two.sum(axis=1), two])
