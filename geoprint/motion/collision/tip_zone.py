"""The room under the needle's flat end while it lays material.

The end of the needle is a disc in the tip plane. Where the surface curves upwards or the tool leans, the surface comes
nearer to the rim of the disc than the stand-off. The *room* at a placement is the height of the tip plane over the
highest point of any surface within the needle's circle, seen along the tool's axis. For a plane under a lean a it is
(standoff - r sin a) / cos a. It is exact (`circle_tops`).
"""

from __future__ import annotations

from math import inf
from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import FloatArray
from geoprint.motion.collision.circle_tops import raise_tops
from geoprint.motion.collision.tool_distance import circumscribed, quarter
from geoprint.motion.collision.tool_solids import TIP_ZONE

# Less room than this is none [mm]: what is written to the controller is thinned to 0.01 mm.
SMALLEST_ROOM = 0.01
# Surfaces this much farther below the tip than its stand-off are not looked for [mm].
BELOW_STANDOFF = 0.2
# Largest radius of the fragments that faces near the path are cut into [mm], so that few fragments are near each tip.
FRAGMENT_RADIUS = 0.5
# Placements worked on at a time: some hundred fragments are near each, about 20 MB of pairs.
PLACEMENTS_AT_A_TIME = 2000


@final
class TipZone:
    """A surface that the needle's end passes over, prepared to be asked of many sets of placements.

    Args:
        triangles: (m, 3, 3) corners of the surface [mm].
    """

    __slots__ = ("_highest", "_lowest", "_triangles")

    def __init__(self, triangles: FloatArray) -> None:
        self._triangles = triangles
        # By axis, so that most triangles are left out by one comparison.
        self._lowest = np.ascontiguousarray(triangles.min(axis=1).T)
        self._highest = np.ascontiguousarray(triangles.max(axis=1).T)

    def rooms(self, poses: FloatArray, *, radius: float | FloatArray, standoff: float) -> FloatArray:
        """Return the room under the needle's end at each placement.

        Args:
            poses: (k, 4, 4) poses of the tool in the frame of the triangles [mm].
            radius: of the circle, one for all placements or (k,) one each [mm].
            standoff: height at which the tip should be over the surface [mm].

        Returns:
            (k,) room [mm]; negative where the surface reaches above the tip plane within the circle; infinite where
            there is none within the circle from BELOW_STANDOFF under the stand-off to TIP_ZONE above the tip plane.
        """
        # Arrays of one kind, so that the loop is compiled once.
        poses = np.array(poses)
        lowest = -(standoff + BELOW_STANDOFF)
        middle = (TIP_ZONE + lowest) / 2
        centres = poses[:, :3, 3] - middle * poses[:, :3, 2]
        radii = np.broadcast_to(np.asarray(radius, dtype=np.float64), len(poses)).copy()
        reach = float(np.hypot(radii.max(initial=0.0), TIP_ZONE - middle))
        tops = np.full(len(poses), -inf)
        fragments = _fragments_near(self._around(centres, reach=reach), centres, reach=reach)
        if not len(fragments):
            return -tops
        tree = KDTree(fragments.mean(axis=1))
        reach += float(circumscribed(fragments)[1].max())
        for first in range(0, len(poses), PLACEMENTS_AT_A_TIME):
            block = KDTree(centres[first : first + PLACEMENTS_AT_A_TIME])
            near = block.sparse_distance_matrix(tree, reach, output_type="ndarray")
            rows, chosen = (np.array(near[key], dtype=np.int64) for key in ("i", "j"))
            raise_tops(tops, (rows + first, chosen), fragments, (poses, radii), (lowest, TIP_ZONE))
        return -tops

    def _around(self, points: FloatArray, *, reach: float) -> FloatArray:
        """Return the triangles whose bounding boxes are within reach of that of some points."""
        low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
        kept = np.flatnonzero((self._highest[0] >= low[0]) & (self._lowest[0] <= high[0]))
        for axis in (1, 2):
            kept = kept[(self._highest[axis, kept] >= low[axis]) & (self._lowest[axis, kept] <= high[axis])]
        return self._triangles[kept]


def _fragments_near(triangles: FloatArray, points: FloatArray, *, reach: float) -> FloatArray:
    """Return what of triangles is within reach of any of the points, cut into fragments of FRAGMENT_RADIUS."""
    tree = KDTree(points)
    fragments: list[FloatArray] = []
    rest = triangles
    while len(rest):
        centres, radii = circumscribed(rest)
        bound = reach + float(radii.max())
        near = tree.query(centres, distance_upper_bound=bound)[0] <= reach + radii
        small = radii <= FRAGMENT_RADIUS
        fragments.append(rest[near & small])
        rest = quarter(rest[near & ~small])
    return np.concatenate([np.empty((0, 3, 3)), *fragments])
