"""The tool and the arm's links as convex solids, how far they move, and how far triangles are from them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import atan2, ceil, inf, pi, sqrt
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import InputError
from geoprint.model import FloatArray, IntArray, Lamp, Tool, frozen
from geoprint.robot.arm import FLANGE_FRAME, JOINTS, LinkShape, link_shapes, read_urdf

# The tool as convex solids of revolution, how far they move, and their inflated shapes.
#
# All solids stand in the tool frame, whose origin is the tip and whose z axis points out of the nozzle; a *height*
# is a distance from the tip plane into the tool, minus z. From the tip up:
#
#     tip      the last TIP_ZONE of the needle: may come close to the part, must not touch anything on travel
#     needle   from there to the needle's length
#     cone     widens to the barrel
#     barrel   to the barrel's top
#     bracket  about the flange's z axis, from the flange outwards
#     lamp     a cylinder beside them, where the cell says where it is
#
# Inflating a solid by d gives a convex polytope that holds every point within d of it, so that a polytope that is
# free proves a distance of d. Its corners are rounded by tangent planes and its circle is a polygon around the true
# circle: nothing is lost, and at most EXCESS is too much.
#
# Downwards, the needle grows no farther than to the tip plane. On a flat part at a stand-off of 0.3 mm the cut end
# is 1.3 mm above the part. With a clearance of 0.5 mm and steps of 0.5 mm it is inflated by 0.75 mm: its end comes
# down to 0.25 mm above the tip plane, 0.55 mm above the part, and its radius grows to 1.4 mm, so that it stays free
# up to a lean of 21 degrees and down to a concave radius of 1.8 mm. Larger inflations end at the tip plane, which a
# part leaves free by its stand-off; what lies below the tip plane is the subject of `tip_zone`.


# The end of the needle that is left out of the check for clearance [mm]: a whole needle at its stand-off alarms always.
TIP_ZONE = 1.0
# Sides of the polygon around a circle: at least these, and so many more that it adds no more than POLYGON_EXCESS [mm].
SIDES = 48
POLYGON_EXCESS = 0.02
# Tangent planes by which a corner of the profile is rounded: at most 3.5 % of the inflation too much.
CORNER_STEPS = 3
# What both may add together [mm], for tools of the size that an IRB 120 carries.
EXCESS = 0.045
# A point on a turning solid runs along an arc, which is longer than its chord: 1 % covers turns of 0.5 rad a step.
ARC_ALLOWANCE = 1.01


@final
@frozen
class Solid:
    """A part of the tool or of a link: a cylinder or a cone between two circles, in the frame that moves with it.

    Solids with the same values are equal: what was worked out for a cell serves whoever reads it again.

    Attributes:
        name: what messages call it.
        start: (3,) centre of the circle nearer to the tip [mm].
        end: (3,) centre of the other circle [mm].
        start_radius: [mm].
        end_radius: [mm].
        reach_below: how far an inflated solid may extend beyond its start [mm].
    """

    name: str
    start: FloatArray
    end: FloatArray
    start_radius: float
    end_radius: float
    reach_below: float = inf

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Solid) and self._values == other._values

    def __hash__(self) -> int:
        return hash(self._values)

    @property
    def _values(self) -> tuple[object, ...]:
        return (
            self.name, *self.start.tolist(), *self.end.tolist(), self.start_radius, self.end_radius, self.reach_below
        )  # fmt: skip

    @property
    def length(self) -> float:
        """Distance between both circles [mm]."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def axis(self) -> FloatArray:
        """(3,) unit vector from start to end."""
        return (self.end - self.start) / self.length

    @property
    def frame(self) -> FloatArray:
        """(3, 3) rotation whose z axis is the solid's; the other two lie anyhow."""
        axis = self.axis
        x = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
        x /= np.linalg.norm(x)
        return np.column_stack([x, np.cross(axis, x), axis])

    @property
    def centre(self) -> FloatArray:
        """(3,) the middle of the axis [mm]."""
        return (self.start + self.end) / 2


@lru_cache(maxsize=8)
def tool_solids(tool: Tool) -> tuple[Solid, ...]:
    """Return tip, needle, cone, barrel and bracket, and the lamp where the tool has one whose place is known.

    Raises:
        InputError: a length is not positive, the needle is shorter than its tip zone, or the cone passes the barrel's
            top.
    """
    _check_lengths(tool)
    cone_top = tool.needle_length + tool.cone_length
    needle_radius, barrel_radius = tool.needle_diameter / 2, tool.barrel_diameter / 2
    T_tool_flange = transforms.inverse(tool.T_flange_tool)
    flange = T_tool_flange[:3, 3]
    lamp = () if tool.lamp is None else (_lamp(tool.lamp, T_tool_flange=T_tool_flange),)
    return (
        Solid("needle's tip", _height(0.0), _height(TIP_ZONE), needle_radius, needle_radius, reach_below=0.0),
        Solid("needle", _height(TIP_ZONE), _height(tool.needle_length), needle_radius, needle_radius, TIP_ZONE),
        Solid("cone", _height(tool.needle_length), _height(cone_top), needle_radius, barrel_radius),
        Solid("barrel", _height(cone_top), _height(tool.barrel_top), barrel_radius, barrel_radius),
        Solid(
            "bracket",
            flange + tool.bracket_length * T_tool_flange[:3, 2],
            flange,
            tool.bracket_diameter / 2,
            tool.bracket_diameter / 2,
        ),
        *lamp,
    )


def movements(solids: tuple[Solid, ...], poses: FloatArray) -> FloatArray:
    """Return the (k - 1, s) `movements_between` of s solids from each of (k, 4, 4) poses to the next [mm]."""
    return movements_between(solids, poses[:-1], poses[1:])


def movements_between(solids: tuple[Solid, ...], starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Bound how far any point of each solid moves from a pose to another.

    A solid of revolution looks the same after a turn about its axis, so that only its axis counts: the end of the
    axis that moves more, plus the radius times the change of direction, plus 1 % because points move on arcs.

    Args:
        solids: s of the tool or a link.
        starts: (k, 4, 4) poses of what the solids belong to [mm].
        ends: (k, 4, 4) where they go [mm].

    Returns:
        (k, s) bounds on the movement [mm].
    """
    changes = ends[:, :3] - starts[:, :3]
    turns = _lengths(changes[:, :, :3], [solid.axis for solid in solids], 0.0 * changes[:, :, 3])
    first, last = (
        _lengths(changes[:, :, :3], places, changes[:, :, 3])
        for places in ([solid.start for solid in solids], [solid.end for solid in solids])
    )
    start_radii, end_radii = np.array([[solid.start_radius, solid.end_radius] for solid in solids]).T
    return ARC_ALLOWANCE * np.maximum(first + start_radii * turns, last + end_radii * turns)


def _lengths(matrices: FloatArray, vectors: list[FloatArray], shifts: FloatArray) -> FloatArray:
    """Return the (k, s) lengths of the products of (k, 3, 3) matrices with s vectors, each with its (k, 3) shift.

    Coordinate by coordinate: several times as fast as NumPy is along an axis of three.
    """
    each = np.array(vectors).T
    x, y, z = (matrices[:, axis] @ each + shifts[:, axis, None] for axis in range(3))
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def inflated_profile(solid: Solid, *, by: float) -> FloatArray:
    """Return the convex half profile of a solid that is inflated by a distance.

    Args:
        solid: one of the tool or a link.
        by: distance [mm], not negative.

    Returns:
        (r, 2) position along the axis from the start, ascending, and radius [mm].
    """
    if by == 0.0:
        return np.array([[0.0, solid.start_radius], [solid.length, solid.end_radius]])
    slope = atan2(solid.end_radius - solid.start_radius, solid.length)
    side = pi / 2 + slope
    below = _rounded(np.array([0.0, solid.start_radius]), by=by, directions=np.linspace(pi, side, CORNER_STEPS + 1))
    above = _rounded(
        np.array([solid.length, solid.end_radius]), by=by, directions=np.linspace(side, 0.0, CORNER_STEPS + 1)
    )
    profile = np.concatenate([below, above])
    if by <= solid.reach_below:
        return profile
    cut = -solid.reach_below
    radius = float(np.interp(cut, profile[:, 0], profile[:, 1]))
    return np.concatenate([[[cut, radius]], profile[profile[:, 0] > cut]])


def sides_of(solid: Solid) -> int:
    """Return how many sides the polygon around a solid's circles has."""
    # A polygon of n sides around a circle of radius r reaches out to r / cos(pi / n), about r + r (pi / n)^2 / 2.
    needed = pi * sqrt(max(solid.start_radius, solid.end_radius) / (2 * POLYGON_EXCESS))
    return max(SIDES, ceil(needed))


def polytope(solid: Solid, *, by: float) -> tuple[FloatArray, IntArray]:
    """Return a convex polytope around all points within a distance of a solid.

    Args:
        solid: one of the tool or a link.
        by: distance [mm], not negative.

    Returns:
        (n, 3) corners in the tool frame [mm] and (m, 3) triangles, counter-clockwise from outside.
    """
    return next(polytopes(solid, [inflated_profile(solid, by=by)]))


def polytopes(solid: Solid, profiles: Sequence[FloatArray]) -> Iterator[tuple[FloatArray, IntArray]]:
    """Yield the polytope of a solid for each of its profiles, inflated by whatever, as `polytope` returns it."""
    sides, frame = sides_of(solid), solid.frame
    turns = 2 * np.pi * np.arange(sides) / sides
    circle = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(sides)]) / np.cos(np.pi / sides)
    triangles: dict[int, IntArray] = {}
    for profile in profiles:
        rings = profile[:, None, 1, None] * circle + profile[:, None, 0, None] * np.array([0.0, 0.0, 1.0])
        if len(profile) not in triangles:
            triangles[len(profile)] = _ring_triangles(len(profile), sides=sides)
        yield rings.reshape(-1, 3) @ frame.T + solid.start, triangles[len(profile)]


def _ring_triangles(rings: int, *, sides: int) -> IntArray:
    """Return the triangles of stacked rings of corners, with fans as lids."""
    corner = np.arange(sides)
    following = (corner + 1) % sides
    bottom = np.column_stack([np.zeros(sides - 2, dtype=np.int64), corner[2:], corner[1:-1]])
    top = np.column_stack([np.zeros(sides - 2, dtype=np.int64), corner[1:-1], corner[2:]]) + sides * (rings - 1)
    band = np.concatenate(
        [
            np.column_stack([corner, following, following + sides]),
            np.column_stack([corner, following + sides, corner + sides]),
        ]
    )
    bands = [band + sides * ring for ring in range(rings - 1)]
    return np.concatenate([bottom, *bands, top])


def _rounded(corner: FloatArray, *, by: float, directions: FloatArray) -> FloatArray:
    """Return where the neighbouring tangents of a circle about a corner meet; directions are angles from the axis."""
    normals = np.column_stack([np.cos(directions), np.sin(directions)])
    middle = normals[:-1] + normals[1:]
    return corner + 2 * by * middle / (middle * middle).sum(axis=1, keepdims=True)


def _lamp(lamp: Lamp, *, T_tool_flange: FloatArray) -> Solid:
    if not (0.0 < lamp.length < inf and 0.0 < lamp.diameter < inf):
        raise InputError(
            f"lamp: its length is {lamp.length} mm and its diameter {lamp.diameter} mm; correct them to positive ones."
        )
    ends = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, lamp.length]])
    start, end = transforms.apply(T_tool_flange @ lamp.T_flange_lamp, ends)
    return Solid("UV lamp", start, end, lamp.diameter / 2, lamp.diameter / 2)


def _height(height: float) -> FloatArray:
    return np.array([0.0, 0.0, -height])


def _check_lengths(tool: Tool) -> None:
    for name in ("needle_diameter", "barrel_diameter", "barrel_top", "bracket_length", "bracket_diameter"):
        if not 0.0 < getattr(tool, name) < inf:
            raise InputError(f"tool: {name} is {getattr(tool, name)} mm; correct it to a positive length.")
    if not TIP_ZONE < tool.needle_length < inf:
        raise InputError(f"tool: needle_length is {tool.needle_length} mm; it must be longer than {TIP_ZONE} mm.")
    if not tool.needle_diameter < tool.barrel_diameter or not 0.0 < tool.cone_half_angle < np.pi / 2:
        raise InputError(
            f"tool: the cone widens from {tool.needle_diameter} to {tool.barrel_diameter} mm at "
            f"{np.degrees(tool.cone_half_angle):.1f} degrees; it must widen, at an angle between 0 and 90 degrees."
        )
    cone_top = tool.needle_length + tool.cone_length
    if not cone_top < tool.barrel_top < inf:
        raise InputError(
            f"tool: the cone ends {cone_top:.1f} mm from the tip and barrel_top is {tool.barrel_top} mm; "
            "it must be farther: correct barrel_top or cone_half_angle."
        )


# How far triangles are from the tool, or how deep inside it: exact, for the few placements that a message is about.
#
# The tool is covered by convex solids of revolution whose half profile is a polyline, so that the signed distance of
# a point is that of a point to a polyline in the plane, negative inside. It is convex and changes by at most the
# distance of two points: over a triangle it is nowhere lower than its tangent plane at the triangle's middle, nor
# than its value there minus the triangle's radius. A triangle whose bound is above the smallest value found is
# dropped, and what is left is quartered until the answer is known to RESOLUTION: branch and bound.


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


def nearest(shape: Revolution, triangles: FloatArray, *, within: float = inf) -> tuple[float, FloatArray]:
    """Find the point of triangles that is nearest to a solid of revolution, or deepest inside it.

    Args:
        shape: solid of revolution in the tool frame.
        triangles: (m, 3, 3) corners in the tool frame [mm].
        within: points farther away than this need not be distinguished [mm].

    Returns:
        The distance [mm], right to RESOLUTION and negative inside, infinite where there is no triangle; and (3,) the
        nearest point. Where none lies within that distance, any that does not.
    """
    distance, point = inf, np.zeros(3)
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
        if values.min() < distance:
            distance, point = float(values.min()), tried[np.argmin(values)]
        if min(distance, float(lowest[least])) > within:
            break
        kept = np.flatnonzero(lowest < distance - RESOLUTION)
        if len(kept) > MOST_FRAGMENTS:
            kept = kept[np.argpartition(lowest[kept], MOST_FRAGMENTS)[:MOST_FRAGMENTS]]
        fragments = quarter(fragments[kept])
    return distance, point


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


# The links of the arm as cylinders that contain them: the collision elements of its URDF.


@final
@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """What of the arm moves as one.

    Attributes:
        name: what messages call it.
        joint: the joint that moves it, from 1; 0 for the base.
        solids: cylinders in the link's own frame; together they contain it.
    """

    name: str
    joint: int
    solids: tuple[Solid, ...]


@lru_cache(maxsize=8)
def link_solids(model: str, *, urdf: str | None = None, flange: str = FLANGE_FRAME) -> tuple[Link, ...]:
    """Read the collision shapes of an arm from its URDF.

    Args:
        model: name of the arm.
        urdf: its text, or None where it is package data.
        flange: name of its flange frame.

    Returns:
        The base and the links 1 to 6, in the order of the joints.

    Raises:
        UsageError: there is no such arm, or as `link_shapes`.
    """
    shapes = link_shapes(read_urdf(model) if urdf is None else urdf, name=model, flange=flange)
    names = ["arm's base", *(f"arm's link {joint}" for joint in range(1, JOINTS + 1))]
    return tuple(
        Link(name, joint, tuple(_solid(shape, name) for shape in shapes if shape.joint == joint))
        for joint, name in enumerate(names)
    )


def _solid(shape: LinkShape, name: str) -> Solid:
    centre, half = shape.T_link_cylinder[:3, 3], shape.T_link_cylinder[:3, 2] * shape.length / 2
    return Solid(name, centre - half, centre + half, shape.radius, shape.radius)
