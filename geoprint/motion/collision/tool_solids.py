"""The tool as convex solids of revolution, how far they move, and their inflated shapes.

All solids stand in the tool frame, whose origin is the tip and whose z axis points out of the nozzle; a *height* is a
distance from the tip plane into the tool, minus z. From the tip up:

    tip      the last TIP_ZONE of the needle: may come close to the part, must not touch anything on travel
    needle   from there to the needle's length
    cone     widens to the barrel
    barrel   to the barrel's top
    bracket  about the flange's z axis, from the flange outwards
    lamp     a cylinder beside them, where the cell says where it is

Inflating a solid by d gives a convex polytope that holds every point within d of it, so that a polytope that is free
proves a distance of d. Its corners are rounded by tangent planes and its circle is a polygon around the true circle:
nothing is lost, and at most EXCESS is too much.

Downwards, the needle grows no farther than to the tip plane. On a flat part at a stand-off of 0.3 mm the cut end is
1.3 mm above the part. With a clearance of 0.5 mm and steps of 0.5 mm it is inflated by 0.75 mm: its end comes down to
0.25 mm above the tip plane, 0.55 mm above the part, and its radius grows to 1.4 mm, so that it stays free up to a lean
of 21 degrees and down to a concave radius of 1.8 mm. Larger inflations end at the tip plane, which a part leaves free
by its stand-off; what lies below the tip plane is the subject of `tip_zone`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from math import atan2, ceil, inf, pi, sqrt
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import InputError
from geoprint.model import FloatArray, IntArray, Lamp, Tool, frozen

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
