"""The room under the needle's flat end and at its rim while it deposits material."""

from __future__ import annotations

from math import hypot, inf, sqrt
from typing import TypeAlias, final

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import ClearanceError, InputError, VerificationError, how_many
from geoprint.geometry import in_words, triple
from geoprint.kernels import inner, uncounted
from geoprint.model import BoolArray, FloatArray, IntArray
from geoprint.robot.collision.contact import CollisionWorld
from geoprint.robot.collision.surroundings import Target
from geoprint.robot.collision.sweep import Placements
from geoprint.robot.collision.tool_solids import TIP_ZONE, circumscribed, quarter

# How high small triangles reach within the circle of the needle's end, pair by pair.
#
# A triangle is highest within a circle at the circle's highest point of its plane, or where one of its sides enters
# or leaves the circle, or at a corner.


# x, y and height above the tip plane, and those of a triangle's corners [mm].
Point: TypeAlias = tuple[float, float, float]
Corners: TypeAlias = tuple[Point, Point, Point]


@uncounted
def raise_tops(
    tops: FloatArray,
    pairs: tuple[IntArray, IntArray],
    corners: FloatArray,
    placements: tuple[FloatArray, FloatArray],
    heights: tuple[float, float],
) -> None:
    """Raise the highest point found at each placement to that of triangles near it.

    Args:
        tops: (k,) heights over the tip planes, raised here [mm].
        pairs: (n,) placement and (n,) triangle of each pair.
        corners: (3 m, 3) of the triangles in the frame of the poses [mm].
        placements: (k, 4, 4) poses of the tool, whose z leads into the surface, and (k,) radii about it [mm].
        heights: triangles wholly below the first and above the second are left out, and points below the first [mm].
    """
    (rows, chosen), (poses, radii), (lowest, highest) = pairs, placements, heights
    for pair in range(rows.size):
        row, first = rows[pair], 3 * chosen[pair]
        triangle = (
            _into_tool(corners, first, poses, row),
            _into_tool(corners, first + 1, poses, row),
            _into_tool(corners, first + 2, poses, row),
        )
        low = min(triangle[0][2], triangle[1][2], triangle[2][2])
        high = max(triangle[0][2], triangle[1][2], triangle[2][2])
        if low > highest or high < lowest or high <= tops[row]:
            continue
        radius = float(radii[row])
        top = max(_top_of_sides(triangle, radius), _top_of_plane(triangle, radius))
        if top >= lowest:
            tops[row] = max(tops[row], top)


@inner
def _into_tool(corners: FloatArray, corner: int, poses: FloatArray, row: int) -> Point:
    """Return a corner of a triangle as a pose of the tool sees it, its height away from the surface."""
    x = corners[corner, 0] - poses[row, 0, 3]
    y = corners[corner, 1] - poses[row, 1, 3]
    z = corners[corner, 2] - poses[row, 2, 3]
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


# The room under the needle's flat end while it deposits material.
#
# The end of the needle is a disc in the tip plane. Where the surface curves upwards or the tool leans, the surface
# comes nearer to the rim of the disc than the stand-off. The *room* at a placement is the height of the tip plane
# over the highest point of any surface within the needle's circle, seen along the tool's axis. For a plane under a
# lean a it is (standoff - r sin a) / cos a. It is exact (`circle_tops`).


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
            raise_tops(tops, (rows + first, chosen), fragments.reshape(-1, 3), (poses, radii), (lowest, TIP_ZONE))
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


# The rim of the needle along a motion: whether it has room over the surface wherever material is deposited.


# What a person may do where nothing is known of what helps.
NO_ROOM_ADVICE = "raise the stand-off, lean less, or use a thinner needle"


def refuse_rim(
    placements: Placements, world: CollisionWorld, zones: tuple[TipZone, ...], *, radius: float, standoff: float
) -> float:
    """Refuse a rim of the needle that lacks room on deposit; return the smallest room that it has [mm].

    Each placement stands for half of the step before it and half of the step behind it: its circle is widened so that
    it holds the needle in both, and by the rounding of a corner anywhere in them; the tip may be as much lower there.
    """
    depositing = placements.deposit.copy()
    depositing[1:] |= placements.deposit[:-1]
    rows = np.flatnonzero(depositing)
    if not len(rows):
        raise InputError("the path has no deposit under the needle's rim to check.")
    tips = placements.poses[:, :3, 3]
    steps = np.where(placements.deposit[:-1], np.linalg.norm(np.diff(tips, axis=0), axis=1), 0.0)
    beside = np.maximum(np.append(steps, 0.0), np.append(0.0, steps))[rows]
    rounding = _largest_around(placements.rounding(world.solids[:1])[:, 0])[rows]
    widened = np.hypot(radius, beside / 2) + rounding
    rooms = np.array([zone.rooms(placements.poses[rows], radius=widened, standoff=standoff) for zone in zones])
    rooms -= rounding
    target, index = np.unravel_index(int(np.argmin(rooms)), rooms.shape)
    least, row = float(rooms[target, index]), int(rows[index])
    if least == np.inf:
        raise VerificationError(
            f"no surface lies below the tip where material is deposited ({how_many(len(rows), 'placement')}): path "
            "and part do not match. Check where the part stands."
        )
    if least < SMALLEST_ROOM:
        short = int((rooms.min(axis=0) < SMALLEST_ROOM).sum())
        raise _no_room(placements, world.targets[int(target)], row=row, room=least, standoff=standoff, short=short)
    return least


def refuse_rim_at(
    placements: Placements,
    rows: BoolArray,
    targets: tuple[Target, ...],
    zones: tuple[TipZone, ...],
    *,
    radius: float,
    standoff: float,
    off: float,
    turn: float,
) -> None:
    """Refuse a rim that lacks more room at some placements than a motion gains that passes them a little off.

    Args:
        placements: k of the tool.
        rows: (k,) which of them deposit material, some do.
        targets: what the zones are of.
        zones: that the needle's end passes over.
        radius: of the needle [mm].
        standoff: height at which the tip should be over the surface [mm].
        off: how far a motion may be off [mm].
        turn: by how much it may be turned there [rad].
    """
    asked = np.flatnonzero(rows)
    rooms = np.array([zone.rooms(placements.poses[asked], radius=radius, standoff=standoff) for zone in zones])
    least = rooms.min(axis=0)
    if least.min() >= SMALLEST_ROOM - off - radius * turn:
        return
    target, index = np.unravel_index(int(np.argmin(rooms)), rooms.shape)
    raise _no_room(
        placements, targets[int(target)], row=int(asked[index]), room=float(rooms[target, index]), standoff=standoff,
        short=int((least < SMALLEST_ROOM).sum()),
    )  # fmt: skip


def _largest_around(values: FloatArray) -> FloatArray:
    """Return the largest of each value and its neighbours."""
    padded = np.concatenate([values[:1], values, values[-1:]])
    return np.maximum(np.maximum(padded[:-2], padded[2:]), values)


def _no_room(
    placements: Placements, target: Target, *, row: int, room: float, standoff: float, short: int
) -> ClearanceError:
    tip = placements.poses[row, :3, 3]
    height = f"{room:z.2f}"
    side = "; if this is the wrong side of the part, `--flip` turns it" if height.startswith("-") else ""
    return ClearanceError(
        f"{placements.stretch(row)} at tip {in_words(tip)} the needle's rim is {height} mm above the {target.name} "
        f"(stand-off {standoff:.2f} mm); at least {SMALLEST_ROOM} mm are needed. {short} placements have too little: "
        f"{NO_ROOM_ADVICE}{side}.",
        solid="needle's tip",
        against=target.name,
        run=int(placements.runs[row]),
        place=triple(tip),
        room=room,
        placements=short,
        advice=NO_ROOM_ADVICE,
    )
