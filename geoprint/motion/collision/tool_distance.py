"""How far triangles are from the tool, or how deep inside it: exact, for the few placements that a message is about.

The tool is covered by convex solids of revolution whose half profile is a polyline, so that the signed distance of a
point is that of a point to a polyline in the plane, negative inside. It is convex and changes by at most the
distance of two points: over a triangle it is nowhere lower than its tangent plane at the triangle's middle, nor than
its value there minus the triangle's radius. A triangle whose bound is above the smallest value found is dropped, and
what is left is quartered until the answer is known to RESOLUTION: branch and bound.
"""

from __future__ import annotations

from math import inf
from typing import final

import numpy as np

from geoprint.model import FloatArray, frozen
from geoprint.motion.collision.tool_solids import Solid

# Distances are found to this [mm].
RESOLUTION = 0.005
# Most triangles kept while quartering, the most promising ones: a face that lies flat against a lid of the tool has
# the same distance everywhere, and any of its fragments gives the answer.
MOST_FRAGMENTS = 5_000


@final
@frozen
class Revolution:
    """Solids on a common axis that touch each other in turn, as one convex solid of revolution.

    Attributes:
        solids: in the order along the axis.
        origin: (3,) start of the axis in the tool frame [mm].
        axis: (3,) unit vector.
        profile: (r, 2) position along the axis, ascending, and radius [mm], without the lids.
    """

    solids: tuple[Solid, ...]
    origin: FloatArray
    axis: FloatArray
    profile: FloatArray

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """(3,) lowest and (3,) highest coordinates in the tool frame, or a little beyond [mm]."""
        ends = self.origin + self.profile[[0, -1], :1] * self.axis
        radius = self.profile[:, 1].max()
        return ends.min(axis=0) - radius, ends.max(axis=0) + radius

    def solid_at(self, point: FloatArray) -> Solid:
        """Return the solid beside which a (3,) point of the tool frame lies; beyond the ends the first or last."""
        position = float((point - self.origin) @ self.axis)
        ends = np.cumsum([solid.length for solid in self.solids])
        return self.solids[min(int(np.searchsorted(ends, position)), len(self.solids) - 1)]


@final
@frozen
class NearestPoint:
    """The point of some triangles that is nearest to a solid of revolution, or deepest inside it.

    Attributes:
        distance: [mm]; negative inside. Infinite where there is no triangle.
        point: (3,) in the tool frame [mm].
    """

    distance: float
    point: FloatArray


def revolution(solids: tuple[Solid, ...]) -> Revolution:
    """Join solids whose circles meet, first to last, into one solid of revolution; together they must be convex."""
    positions = np.concatenate([[0.0], np.cumsum([solid.length for solid in solids])])
    radii = [solids[0].start_radius, *(solid.end_radius for solid in solids)]
    return Revolution(
        solids=solids, origin=solids[0].start, axis=solids[0].axis, profile=np.column_stack([positions, radii])
    )


def signed_distances(shape: Revolution, points: FloatArray) -> FloatArray:
    """Return the (k,) distance [mm] of (k, 3) points of the tool frame from a solid of revolution, negative inside."""
    return _distances_and_slopes(shape, points)[0]


def nearest(shape: Revolution, triangles: FloatArray, *, within: float = inf) -> NearestPoint:
    """Find the point of triangles that is nearest to a solid of revolution, or deepest inside it.

    Args:
        shape: solid of revolution in the tool frame.
        triangles: (m, 3, 3) corners in the tool frame [mm].
        within: points farther away than this need not be told apart [mm].

    Returns:
        The nearest point, its distance right to RESOLUTION; where none lies within that distance, any that does not.
    """
    best = NearestPoint(inf, np.zeros(3))
    fragments = triangles
    while len(fragments):
        centres, radii = circumscribed(fragments)
        distances, slopes = _distances_and_slopes(shape, centres)
        rises = np.einsum("mcx,mx->mc", fragments - centres[:, None], slopes)
        # Where a slope is not known it is zero, and only the other bound holds.
        known = slopes.any(axis=1)
        lowest = np.where(known, distances + rises.min(axis=1), distances - radii)
        least = int(np.argmin(lowest))
        tried = np.stack([centres[np.argmin(distances)], fragments[least, np.argmin(rises[least])]])
        values = signed_distances(shape, tried)
        if values.min() < best.distance:
            best = NearestPoint(float(values.min()), tried[np.argmin(values)])
        if min(best.distance, float(lowest[least])) > within:
            return best
        kept = np.flatnonzero(lowest < best.distance - RESOLUTION)
        if len(kept) > MOST_FRAGMENTS:
            kept = kept[np.argpartition(lowest[kept], MOST_FRAGMENTS)[:MOST_FRAGMENTS]]
        fragments = quarter(fragments[kept])
    return best


def _distances_and_slopes(shape: Revolution, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (k,) signed distances of (k, 3) points and their (k, 3) gradients; zero where there is none."""
    offsets = points - shape.origin
    along = offsets @ shape.axis
    aside = offsets - along[:, None] * shape.axis
    out = np.linalg.norm(aside, axis=1)
    first, last = float(shape.profile[0, 0]), float(shape.profile[-1, 0])
    outline = np.concatenate([[[first, 0.0]], shape.profile, [[last, 0.0]]])
    nearest_along, nearest_out = np.full(len(points), inf), np.full(len(points), inf)
    for (x, y), (dx, dy) in zip(outline[:-1], np.diff(outline, axis=0), strict=True):
        share = np.clip(((along - x) * dx + (out - y) * dy) / (dx * dx + dy * dy), 0.0, 1.0)
        step_along, step_out = along - x - share * dx, out - y - share * dy
        nearer = np.hypot(step_along, step_out) < np.hypot(nearest_along, nearest_out)
        nearest_along = np.where(nearer, step_along, nearest_along)
        nearest_out = np.where(nearer, step_out, nearest_out)
    radius: FloatArray = np.interp(along, shape.profile[:, 0], shape.profile[:, 1])
    inside = (along >= first) & (along <= last) & (out <= radius)
    distances = np.where(inside, -1.0, 1.0) * np.hypot(nearest_along, nearest_out)
    slopes = nearest_along[:, None] * shape.axis + (nearest_out / np.where(out > 0.0, out, 1.0))[:, None] * aside
    return distances, slopes / np.where(distances == 0.0, 1.0, distances)[:, None]


def circumscribed(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (m, 3) middles of (m, 3, 3) triangles and the (m,) radii of the balls around them that hold them [mm]."""
    corners = [triangles[:, corner] for corner in range(3)]
    centres = (corners[0] + corners[1] + corners[2]) / 3.0
    # Corner by corner: NumPy is several times as slow along an axis of three.
    squares = [((corner - centres) ** 2) @ np.ones(3) for corner in corners]
    return centres, np.sqrt(np.maximum.reduce(squares))


def quarter(triangles: FloatArray) -> FloatArray:
    """Return the (4 m, 3, 3) quarters of (m, 3, 3) triangles, cut at the middles of their sides.

    The quarters of triangle i are i, m + i, 2 m + i and 3 m + i.
    """
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    corners = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.concatenate([np.stack(three, axis=1) for three in corners])
