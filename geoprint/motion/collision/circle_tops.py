"""How high small triangles reach within the circle of the needle's end, pair by pair.

A triangle is highest within a circle at the circle's highest point of its plane, or where one of its sides enters or
leaves the circle, or at a corner.
"""

from __future__ import annotations

from math import hypot, inf, sqrt
from typing import TypeAlias

from geoprint.kernels import inner, uncounted
from geoprint.model import FloatArray, IntArray

# x, y and height above the tip plane, and those of a triangle's corners [mm].
Point: TypeAlias = tuple[float, float, float]
Corners: TypeAlias = tuple[Point, Point, Point]


@uncounted
def raise_tops(
    tops: FloatArray,
    pairs: tuple[IntArray, IntArray],
    triangles: FloatArray,
    placements: tuple[FloatArray, FloatArray],
    heights: tuple[float, float],
) -> None:
    """Raise the highest point found at each placement to that of triangles near it.

    Args:
        tops: (k,) heights over the tip planes, raised here [mm].
        pairs: (n,) placement and (n,) triangle of each pair.
        triangles: (m, 3, 3) corners in the frame of the poses [mm].
        placements: (k, 4, 4) poses of the tool, whose z leads into the surface, and (k,) radii about it [mm].
        heights: triangles wholly below the first and above the second are left out, and points below the first [mm].
    """
    (rows, chosen), (poses, radii), (lowest, highest) = pairs, placements, heights
    for pair in range(rows.size):
        row, triangle = rows[pair], chosen[pair]
        corners = (
            _into_tool(triangles, triangle, 0, poses, row),
            _into_tool(triangles, triangle, 1, poses, row),
            _into_tool(triangles, triangle, 2, poses, row),
        )
        low = min(corners[0][2], corners[1][2], corners[2][2])
        high = max(corners[0][2], corners[1][2], corners[2][2])
        if low > highest or high < lowest or high <= tops[row]:
            continue
        radius = float(radii[row])
        top = max(_top_of_sides(corners, radius), _top_of_plane(corners, radius))
        if top >= lowest:
            tops[row] = max(tops[row], top)


@inner
def _into_tool(triangles: FloatArray, triangle: int, corner: int, poses: FloatArray, row: int) -> Point:
    """Return a corner of a triangle as a pose of the tool sees it, its height away from the surface."""
    x = triangles[triangle, corner, 0] - poses[row, 0, 3]
    y = triangles[triangle, corner, 1] - poses[row, 1, 3]
    z = triangles[triangle, corner, 2] - poses[row, 2, 3]
    return (
        x * poses[row, 0, 0] + y * poses[row, 1, 0] + z * poses[row, 2, 0],
        x * poses[row, 0, 1] + y * poses[row, 1, 1] + z * poses[row, 2, 1],
        -(x * poses[row, 0, 2] + y * poses[row, 1, 2] + z * poses[row, 2, 2]),
    )


@inner
def _top_of_sides(corners: Corners, radius: float) -> float:
    """Clip the sides to the circle; a height is linear along a side, so that it is greatest where the clip ends."""
    top = -inf
    for corner in range(3):
        x, y, height = corners[corner]
        end = corners[(corner + 1) % 3]
        along, aside, rise = end[0] - x, end[1] - y, end[2] - height
        square, product = along * along + aside * aside, x * along + y * aside
        outside = x * x + y * y - radius * radius
        enter, leave = 0.0, 1.0
        if square == 0.0:
            if outside > 0.0:
                continue
        else:
            inner = product * product - square * outside
            if inner < 0.0:
                continue
            root = sqrt(inner)
            enter, leave = max((-product - root) / square, 0.0), min((-product + root) / square, 1.0)
            if enter > leave:
                continue
        top = max(top, height + max(enter * rise, leave * rise))
    return top


@inner
def _top_of_plane(corners: Corners, radius: float) -> float:
    """Return the height of a triangle's plane at its highest point of the circle, where the triangle holds it."""
    first_x, first_y = corners[1][0] - corners[0][0], corners[1][1] - corners[0][1]
    first_z = corners[1][2] - corners[0][2]
    next_x, next_y = corners[2][0] - corners[1][0], corners[2][1] - corners[1][1]
    next_z = corners[2][2] - corners[1][2]
    upright = first_x * next_y - first_y * next_x
    if upright == 0.0:
        return -inf
    slope_x = -(first_y * next_z - first_z * next_y) / upright
    slope_y = -(first_z * next_x - first_x * next_z) / upright
    steepness = hypot(slope_x, slope_y)
    share = 0.0 if steepness == 0.0 else radius / steepness
    x, y = share * slope_x, share * slope_y
    for corner in range(3):
        following = (corner + 1) % 3
        side_x = corners[following][0] - corners[corner][0]
        side_y = corners[following][1] - corners[corner][1]
        turn = side_x * (y - corners[corner][1]) - side_y * (x - corners[corner][0])
        if turn * upright < 0.0:
            return -inf
    return corners[0][2] + slope_x * (x - corners[0][0]) + slope_y * (y - corners[0][1])
