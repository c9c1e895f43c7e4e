"""What a moving solid must not touch, and on which side of a closed surface points lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import final

import fcl
import numpy as np

from geoprint import transforms
from geoprint.errors import InputError
from geoprint.geometry import half_edges
from geoprint.model import BoolArray, Box, FloatArray, IntArray, Obstacle, Surface, frozen
from geoprint.robot.collision.tool_solids import Solid, circumscribed, polytope, polytopes

# On which side of a closed surface points lie, by the generalised winding number [Jacobson2013].
#
# Checks of surface against surface call a tool free that is wholly inside a closed body; this one does not. The
# winding number is the solid angle under which a surface is seen, over that of the full sphere: 1 inside, 0 outside.


# Closed surfaces give 0 or 1, or -1 where they are wound inside out; half is safely between.
INSIDE = 0.5
# Pairs of points and triangles worked on at a time: about 150 MB of intermediate arrays.
PAIRS_AT_A_TIME = 500_000


def is_closed(surface: Surface) -> bool:
    """Say whether every side of every face has a neighbour that runs along it in the opposite direction.

    Vertices at the very same place count as one, because some formats store every triangle by itself.
    """
    places, joined = np.unique(surface.vertices, axis=0, return_inverse=True)
    sides = joined.reshape(-1)[half_edges(surface.faces)]
    count = len(places)
    forth = np.sort(sides[:, 0] * count + sides[:, 1])
    back = np.sort(sides[:, 1] * count + sides[:, 0])
    return bool((forth == back).all())


def inside(points: FloatArray, triangles: FloatArray) -> BoolArray:
    """Return (k,) whether (k, 3) points [mm] are inside a closed surface of (m, 3, 3) triangles of either winding."""
    within = ((points >= triangles.min(axis=(0, 1))) & (points <= triangles.max(axis=(0, 1)))).all(axis=1)
    within[within] = np.abs(winding_numbers(points[within], triangles)) > INSIDE
    return within


def winding_numbers(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """Return how often triangles wind around points.

    The solid angle of a triangle is that of [VanOosterom1983, eq. 8]. Points on the surface itself are undefined.

    Args:
        points: (k, 3) [mm].
        triangles: (m, 3, 3) corners [mm], counter-clockwise from outside.

    Returns:
        (k,) winding numbers.

    Examples:
        >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
        >>> tetrahedron = corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
        >>> winding_numbers(np.array([[0.1, 0.1, 0.1], [1.0, 1.0, 1.0]]), tetrahedron).round(6) + 0.0
        array([1., 0.])
    """
    total = np.zeros(len(points))
    step = max(PAIRS_AT_A_TIME // max(len(points), 1), 1)
    for first in range(0, len(triangles), step):
        corners = triangles[None, first : first + step] - points[:, None, None]
        a, b, c = corners[:, :, 0], corners[:, :, 1], corners[:, :, 2]
        la, lb, lc = (np.linalg.norm(corner, axis=2) for corner in (a, b, c))
        volume = (a * np.cross(b, c)).sum(axis=2)
        rest = la * lb * lc + (a * b).sum(axis=2) * lc + (b * c).sum(axis=2) * la + (c * a).sum(axis=2) * lb
        total += np.arctan2(volume, rest).sum(axis=1)
    return total / (2 * np.pi)


# What a moving solid must not touch, as FCL and the exact distance see it: surfaces, boxes, and solids of the tool.


_BOX_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_BOX_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


@final
@frozen
class Target:
    """Something that a solid must not touch, in the frame in which it does not move: mostly the work frame.

    Attributes:
        name: what messages call it.
        triangles: (m, 3, 3) corners of its surface [mm], counter-clockwise from outside.
        model: the same for FCL; a box is solid there, a mesh is its surface.
        closed: whether the surface has an inside that FCL does not know of.
        balls: (m, 3) middles of the triangles and (m,) radii of the balls about them that hold them [mm].
        axes: (3, 3) directions along which its bounding box is taken, in the columns; a box's are its own.
        bounds: (3,) lowest and (3,) highest coordinates along its axes [mm].
    """

    name: str
    triangles: FloatArray
    model: fcl.CollisionObject
    closed: bool
    balls: tuple[FloatArray, FloatArray]
    axes: FloatArray
    bounds: tuple[FloatArray, FloatArray] = field(init=False)

    def __post_init__(self) -> None:
        along = self.triangles @ self.axes
        object.__setattr__(self, "bounds", (along.min(axis=(0, 1)), along.max(axis=(0, 1))))


def mesh_target(surface: Surface, *, role: str) -> Target:
    """Return a surface as a target; its role ('part', 'body') stands before its name in messages."""
    model = mesh_model(surface.vertices, surface.faces)
    triangles = surface.vertices[surface.faces]
    return Target(
        f"{role} {surface.name}",
        triangles,
        model,
        closed=is_closed(surface),
        balls=circumscribed(triangles),
        axes=np.eye(3),
    )


def obstacle_target(obstacle: Obstacle, *, T_work_base: FloatArray) -> Target:
    """Return what stands in the cell as a target: a box, or a solid of the table as a prism around its cylinder.

    Raises:
        InputError: an edge length of a box is not positive.
    """
    if isinstance(obstacle, Box):
        return box_target(obstacle, T_work_base=T_work_base)
    start, end = transforms.apply(T_work_base, np.stack([obstacle.start, obstacle.end]))
    return solid_target(Solid(obstacle.name, start, end, obstacle.radius, obstacle.radius))


def box_target(box: Box, *, T_work_base: FloatArray) -> Target:
    """Return an obstacle of the cell as a target.

    Raises:
        InputError: an edge length of the box is not positive.
    """
    if box.size.min() <= 0.0:
        raise InputError(f"obstacle {box.name}: the size is {box.size.tolist()} mm; correct it to positive lengths.")
    T_work_box = T_work_base @ transforms.rigid(np.eye(3), box.centre)
    corners = transforms.apply(T_work_box, _BOX_CORNERS * box.size)
    model = fcl.CollisionObject(fcl.Box(*map(float, box.size)), fcl_transform(T_work_box))
    triangles = corners[_BOX_FACES]
    return Target(
        f"obstacle {box.name}", triangles, model, closed=False, balls=circumscribed(triangles), axes=T_work_box[:3, :3]
    )


def solid_target(solid: Solid) -> Target:
    """Return a solid of tool, arm or table as a target, in its own frame; FCL takes a convex solid as solid."""
    corners, triangles = polytope(solid, by=0.0)
    return Target(
        solid.name,
        corners[triangles],
        _convex_model(corners, triangles),
        closed=False,
        balls=circumscribed(corners[triangles]),
        axes=np.eye(3),
    )


def mesh_model(vertices: FloatArray, faces: IntArray) -> fcl.CollisionObject:
    """Return (n, 3) vertices and (m, 3) triangles as FCL's model of a surface; it is not empty."""
    model = fcl.BVHModel()
    model.beginModel(len(faces), len(vertices))
    model.addSubModel(vertices, faces)
    model.endModel()
    return fcl.CollisionObject(model)


def convex_models(solid: Solid, profiles: Sequence[FloatArray]) -> list[fcl.CollisionObject]:
    """Return FCL's model of a solid for each of its profiles, as `inflated_profile` returns them."""
    return [_convex_model(corners, triangles) for corners, triangles in polytopes(solid, profiles)]


def _convex_model(corners: FloatArray, triangles: IntArray) -> fcl.CollisionObject:
    faces = np.column_stack([np.full(len(triangles), 3), triangles])
    return fcl.CollisionObject(fcl.Convex(corners, len(triangles), faces.ravel()))


def fcl_transform(T_a_b: FloatArray) -> fcl.Transform:
    """Return a (4, 4) rigid transform [mm] as FCL takes it."""
    return fcl.Transform(np.ascontiguousarray(T_a_b[:3, :3]), np.ascontiguousarray(T_a_b[:3, 3]))
