"""The room under the needle's flat end while it lays material.

The end of the needle is a disc in the tip plane. Where the surface curves upwards or the tool leans, the surface comes
nearer to the rim of the disc than the stand-off. The *room* at a placement is the height of the tip plane over the
highest point of any surface within the needle's circle, seen along the tool's axis. For a plane under a lean a it is
(standoff - r sin a) / cos a. It is exact: the highest point of a triangle within a circle lies at the circle's highest
point of the triangle's plane, or where a side of the triangle enters or leaves the circle, or at a corner.
"""

from __future__ import annotations

from math import inf
from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import BoolArray, FloatArray, IntArray
from geoprint.motion.collision.tool_distance import circumscribed, quarter
from geoprint.motion.collision.tool_solids import TIP_ZONE

# Less room than this is none [mm]: what is written to the controller is thinned to 0.01 mm.
SMALLEST_ROOM = 0.01
# Surfaces this much farther below the tip than its stand-off are not looked for [mm].
BELOW_STANDOFF = 0.2
# Largest radius of the fragments that faces near the path are cut into [mm], so that few fragments are near each tip.
FRAGMENT_RADIUS = 0.5
# Placements worked on at a time: some hundred fragments are near each, about 200 MB of intermediate arrays.
PLACEMENTS_AT_A_TIME = 2000


def tip_rooms(poses: FloatArray, triangles: FloatArray, *, radius: float | FloatArray, standoff: float) -> FloatArray:
    """Return the room under the needle's end at each placement; who asks more than once makes a `TipZone`.

    Args:
        poses: (k, 4, 4) poses of the tool in the frame of the triangles [mm].
        triangles: (m, 3, 3) corners of a surface [mm].
        radius: as `TipZone.rooms`.
        standoff: likewise.
    """
    return TipZone(triangles).rooms(poses, radius=radius, standoff=standoff)


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
        lowest = -(standoff + BELOW_STANDOFF)
        middle = (TIP_ZONE + lowest) / 2
        centres = poses[:, :3, 3] - middle * poses[:, :3, 2]
        radii = np.broadcast_to(np.asarray(radius, dtype=np.float64), len(poses))
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
            rows = np.asarray(near["i"], dtype=np.int64) + first
            corners = _in_tool(fragments[near["j"]], poses=poses[rows])
            _raise_tops(tops, rows, corners, radii=radii, lowest=lowest)
        return -tops

    def _around(self, points: FloatArray, *, reach: float) -> FloatArray:
        """Return the triangles whose bounding boxes are within reach of that of some points."""
        low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
        kept = np.flatnonzero((self._highest[0] >= low[0]) & (self._lowest[0] <= high[0]))
        for axis in (1, 2):
            kept = kept[(self._highest[axis, kept] >= low[axis]) & (self._lowest[axis, kept] <= high[axis])]
        return self._triangles[kept]


def _raise_tops(tops: FloatArray, rows: IntArray, corners: FloatArray, *, radii: FloatArray, lowest: float) -> None:
    """Raise the highest point found at each placement to those of fragments near it, fragment i near rows[i].

    The middle of a fragment is a quick lower bound: the exact work is left to the few that could be higher.
    """
    heights = corners[:, :, 2]
    relevant = (heights.min(axis=1) <= TIP_ZONE) & (heights.max(axis=1) >= lowest)
    rows, corners = rows[relevant], corners[relevant]
    middles = corners.mean(axis=1)
    within = np.hypot(middles[:, 0], middles[:, 1]) <= radii[rows]
    np.maximum.at(tops, rows[within], np.where(middles[within, 2] >= lowest, middles[within, 2], -inf))
    higher = corners[:, :, 2].max(axis=1) > tops[rows]
    rows = rows[higher]
    highest = _highest_in_circle(corners[higher], radii=radii[rows])
    np.maximum.at(tops, rows, np.where(highest >= lowest, highest, -inf))


def _highest_in_circle(corners: FloatArray, *, radii: FloatArray) -> FloatArray:
    """Return the (n,) greatest height of (n, 3, 3) triangles (x, y, height) within circles about the height's axis.

    It is minus infinity where a triangle has no point within its circle, of (n,) radii.
    """
    return np.maximum(_highest_on_sides(corners, radii=radii), _highest_on_circle(corners, radii=radii))


def _highest_on_sides(corners: FloatArray, *, radii: FloatArray) -> FloatArray:
    """Clip the sides to the circle; a height is linear along a side, so that it is greatest where the clip ends."""
    sides = np.roll(corners, -1, axis=1) - corners
    squares = (sides[:, :, :2] ** 2).sum(axis=2)
    products = (corners[:, :, :2] * sides[:, :, :2]).sum(axis=2)
    outside = (corners[:, :, :2] ** 2).sum(axis=2) - (radii * radii)[:, None]
    upright = squares == 0.0
    root = np.sqrt(np.maximum(products**2 - squares * outside, 0.0))
    safe = np.where(upright, 1.0, squares)
    enter = np.where(upright, 0.0, np.maximum((-products - root) / safe, 0.0))
    leave = np.where(upright, 1.0, np.minimum((-products + root) / safe, 1.0))
    meets: BoolArray = (products**2 >= squares * outside) & (enter <= leave)
    meets = (meets & ~upright) | (upright & (outside <= 0.0))
    heights = corners[:, :, 2] + np.maximum(enter * sides[:, :, 2], leave * sides[:, :, 2])
    return np.where(meets, heights, -inf).max(axis=1)


def _highest_on_circle(corners: FloatArray, *, radii: FloatArray) -> FloatArray:
    """Return the height of each triangle's plane at its highest point of the circle, where the triangle holds it."""
    sides = np.roll(corners, -1, axis=1) - corners
    normals = np.cross(sides[:, 0], sides[:, 1])
    upright = normals[:, 2] == 0.0
    slopes = -normals[:, :2] / np.where(upright, 1.0, normals[:, 2])[:, None]
    steepness = np.linalg.norm(slopes, axis=1)
    highest = radii[:, None] * slopes / np.where(steepness == 0.0, 1.0, steepness)[:, None]
    offsets = highest[:, None] - corners[:, :, :2]
    turns = sides[:, :, 0] * offsets[:, :, 1] - sides[:, :, 1] * offsets[:, :, 0]
    holds = (turns * np.sign(normals[:, 2])[:, None] >= 0.0).all(axis=1) & ~upright
    heights = corners[:, 0, 2] + (slopes * offsets[:, 0]).sum(axis=1)
    return np.where(holds, heights, -inf)


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


def _in_tool(corners: FloatArray, *, poses: FloatArray) -> FloatArray:
    """Return (n, 3, 3) corners as x, y and height above the tip plane of the n poses."""
    local = (corners - poses[:, None, :3, 3]) @ poses[:, :3, :3]
    local[:, :, 2] *= -1.0
    return local
