"""What a scan is laid onto: places all over the part, with the material that is planned over each."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.appraisal.scanned.deposit import Deposited, PlannedDeposit
from geoprint.model import FloatArray, IntArray, Surface, SurfacePoints
from geoprint.surfaces import face_areas, normals

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
