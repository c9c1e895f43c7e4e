"""Obstacles planted at known distances from everything that moves, by a construction of its own.

What moves is sampled here from the joints of the controller's path, a quarter of its rows apart and across the corners
that it may round; the distance of a point from a cylinder or cone is that from its half profile. Nothing is asked of
the collision check.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import TypeVar, final

import numpy as np

from geoprint import transforms
from geoprint.kernels import inner, njit
from geoprint.model import BoolArray, ControllerPath, Cylinder, FloatArray, Hexapod, IntArray, Surface, TiltTurn, Tool
from geoprint.robot.arm import Arm
from geoprint.robot.collision.tool_solids import Solid, link_solids, tool_solids

# Samples of a step of the path, and across a rounded corner from one edge to the other.
SHARES = (0.0, 0.25, 0.5, 0.75)
ACROSS = (-1.0, 0.0, 1.0)
# Points of an obstacle are at most this far apart [mm], first and at last: an edge half a millimetre away is then right
# to 0.01 mm.
COARSE_STEP = 0.5
POINT_STEP = 0.12
# A near miss is moved until its distance is right to this [mm], in at most so many moves.
DISTANCE_TOLERANCE = 0.005
MOST_MOVES = 25
# Extent of the kinds of obstacles, along the solid's side, across it and away from it [mm].
KINDS = {"post": (8.0, 0.2, 0.2), "plate": (3.0, 3.0, 0.0), "block": (3.0, 3.0, 3.0)}
FRAME_OF_TOOL = 7
Planted = TypeVar("Planted")
# Faces of a box whose corner 4 i + 2 j + k lies at place i, j, k of its three directions.
BOX_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


@final
@dataclass(frozen=True, slots=True, eq=False)
class Moving:
    """A solid of tool or arm, and the column of `Arm.link_poses` that says where it is."""

    solid: Solid
    frame: int


@final
@dataclass(frozen=True, slots=True, eq=False)
class Spot:
    """A point of a moving solid's side at some moment.

    Attributes:
        name: of the solid.
        place: (3,) in the work frame [mm].
        outward: (3,) unit normal of the side there.
        along: (3,) unit direction along the side there.
    """

    name: str
    place: FloatArray
    outward: FloatArray
    along: FloatArray

    def obstacle(self, kind: str, *, distance: float) -> Surface:
        """Return an obstacle whose near side faces the spot from a distance [mm], negative inside the solid."""
        sizes = KINDS[kind]
        axes = np.stack([self.along, np.cross(self.outward, self.along), self.outward])
        near = self.place + distance * self.outward
        corners = [
            near + sizes[0] * (i - 0.5) * axes[0] + sizes[1] * (j - 0.5) * axes[1] + sizes[2] * k * axes[2]
            for i in (0, 1)
            for j in (0, 1)
            for k in (0, 1)
        ]
        if kind == "plate":
            return Surface(np.array(corners)[::2], np.array([[0, 2, 3], [0, 3, 1]]), name="planted")
        return Surface(np.array(corners), BOX_FACES, name="planted")


@final
class Sweep:
    """Everything that moves, from home to home, and the base.

    Args:
        path: as the controller runs it.
        arm: with its tool.
        tool: what the arm carries.
        T_work_base: (4, 4) base frame in the work frame [mm].
    """

    __slots__ = ("_T_work_base", "_arm", "_frames", "_moved", "_path", "moving")

    def __init__(self, path: ControllerPath, arm: Arm, *, tool: Tool, T_work_base: FloatArray) -> None:
        self._path, self._arm, self._T_work_base = path, arm, T_work_base
        links = link_solids(arm.robot.model, urdf=arm.robot.urdf, flange=arm.robot.flange)
        self.moving = tuple(Moving(solid, link.joint) for link in links for solid in link.solids)
        self.moving += tuple(Moving(solid, FRAME_OF_TOOL) for solid in tool_solids(tool))
        self._frames = self._placed(path.joints)
        self._moved = [self._largest_step(piece) for piece in self.moving]

    def spot(self, name: str, random: np.random.Generator, *, at_home: bool = False) -> Spot:
        """Return a random spot on the side of a solid, at home or at a random moment."""
        choices = [piece for piece in self.moving if piece.solid.name == name]
        piece = choices[int(random.integers(len(choices)))]
        row, share = int(random.integers(len(self._path.joints) - 1)), float(random.random())
        row, share = (0, 0.0) if at_home else (row, share)
        joints = (1.0 - share) * self._path.joints[row] + share * self._path.joints[row + 1]
        pose = self._placed(joints[None])[0, piece.frame]
        solid, at, turn = piece.solid, float(random.random()), 2.0 * np.pi * float(random.random())
        radial = solid.frame @ np.array([np.cos(turn), np.sin(turn), 0.0])
        rise = solid.end_radius - solid.start_radius
        outward = (solid.length * radial - rise * solid.axis) / np.hypot(solid.length, rise)
        along = (solid.length * solid.axis + rise * radial) / np.hypot(solid.length, rise)
        place = solid.start + at * solid.length * solid.axis + (solid.start_radius + at * rise) * radial
        R = pose[:3, :3]
        return Spot(name, R @ place + pose[:3, 3], R @ outward, R @ along)

    def distance(self, surface: Surface) -> float:
        """Return the smallest distance of a surface from everything that moves [mm]; negative inside."""
        points = _points(surface, step=COARSE_STEP)
        centre = points.mean(axis=0)
        radius = float(np.linalg.norm(points - centre, axis=1).max())
        rough = [_least_distances(piece.solid, self._frames[:, piece.frame], centre[None]) for piece in self.moving]
        bound = min(float(values.min()) for values in rough) + radius
        close: list[tuple[Solid, FloatArray]] = []
        for piece, moved, values in zip(self.moving, self._moved, rough, strict=True):
            rows = np.flatnonzero(values - moved - radius < bound)
            at_rows = _least_distances(piece.solid, self._frames[rows, piece.frame], points)
            bound = min(bound, float(at_rows.min(initial=np.inf)))
            frames = self._dense(rows[at_rows - moved[rows] - COARSE_STEP < bound])[:, piece.frame]
            distances = _least_distances(piece.solid, frames, points)
            bound = min(bound, float(distances.min(initial=np.inf)))
            close.append((piece.solid, frames[distances - COARSE_STEP < bound]))
        fine = _points(surface, step=POINT_STEP)
        return min(float(_least_distances(solid, frames, fine).min(initial=np.inf)) for solid, frames in close)

    def distance_from(self, cylinders: Sequence[Cylinder], *, enough: float = -np.inf) -> float:
        """Return the smallest distance of the surfaces of cylinders in the base from everything that moves [mm].

        Patches of the surfaces are halved, and moments left out, as long as one may be nearer than the nearest so far.

        Args:
            cylinders: in the base frame.
            enough: where something is nearer than this, it is not asked how near the nearest is [mm].
        """
        patches = Patches.of([_moved(one, self._T_work_base) for one in cylinders])
        points, radii = patches.balls()
        rough = [
            _bounds(piece.solid, self._frames[:, piece.frame], moved, points, radii)[2]
            for piece, moved in zip(self.moving, self._moved, strict=True)
        ]
        bound = min(rough)
        for column in sorted(range(len(rough)), key=rough.__getitem__):
            if bound >= enough:
                bound = self._nearer(self.moving[column], self._moved[column], patches, bound=bound)
        return bound

    def _nearer(self, piece: Moving, moved: FloatArray, patches: Patches, *, bound: float) -> float:
        """Return the smaller of a bound and of the distance of patches from one moving solid [mm]."""
        rows, frames = np.arange(len(moved)), self._frames[:, piece.frame]
        while True:
            points, radii = patches.balls()
            at_rows, at_points, least = _bounds(piece.solid, frames, moved, points, radii)
            bound = min(bound, least)
            near, kept = at_rows < bound, at_points < bound
            if radii.max() <= POINT_STEP / 2.0 or not near.any():
                return bound
            patches, frames, moved = patches.split(kept), frames[near], moved[near]
            if len(rows):
                rows = rows[near]
                if radii.max() <= COARSE_STEP:
                    frames = self._dense(rows)[:, piece.frame]
                    rows, moved = rows[:0], np.zeros(len(frames))

    def _largest_step(self, piece: Moving) -> FloatArray:
        """Return (k,) about how far a solid moves in the step behind each row, and by the rounding there [mm]."""
        ends = np.stack([piece.solid.start, piece.solid.end, piece.solid.frame[:, 0] * piece.solid.end_radius])
        rounded = self._placed(self._path.joints + self._path.rounding)[:, piece.frame]
        here, off = (
            np.einsum("kij,aj->kai", frames[:, :3, :3], ends) + frames[:, None, :3, 3]
            for frames in (self._frames[:, piece.frame], rounded)
        )
        steps = np.linalg.norm(np.diff(here, axis=0, append=here[-1:]), axis=2).max(axis=1)
        return steps + np.linalg.norm(off - here, axis=2).max(axis=1)

    def _dense(self, rows: IntArray) -> FloatArray:
        following = np.minimum(rows + 1, len(self._path.joints) - 1)
        samples: list[FloatArray] = []
        for share in SHARES:
            joints, off = (
                (1.0 - share) * values[rows] + share * values[following]
                for values in (self._path.joints, self._path.rounding)
            )
            samples += [joints + across * off for across in ACROSS]
        return self._placed(np.concatenate(samples))

    def _placed(self, joints: FloatArray) -> FloatArray:
        return self._T_work_base @ self._arm.link_poses(joints)


def near_miss(
    placed: Callable[[float], Planted], distance_of: Callable[[Planted], float], *, distance: float
) -> Planted | None:
    """Move something away from a spot until it is a distance [mm] from everything that moves.

    Args:
        placed: places it so far from the spot [mm].
        distance_of: returns how far it is from everything that moves [mm].
        distance: that is wanted [mm].

    Returns:
        It; None where that takes more than MOST_MOVES moves.
    """
    at, too_near, too_far, stride = distance, -np.inf, np.inf, distance
    for _ in range(MOST_MOVES):
        planted = placed(at)
        missing = distance - distance_of(planted)
        if abs(missing) <= DISTANCE_TOLERANCE:
            return planted
        too_near, too_far = (at, too_far) if missing > 0.0 else (too_near, at)
        # Out of what sweeps over wide places in ever longer strides; then in between what is too near and too far.
        stride *= 2.0
        at += max(missing, stride) if np.isinf(too_far) else missing
        if not too_near < at < too_far:
            at = (too_near + too_far) / 2.0
    return None


def hall(sweep: Sweep) -> Surface:
    """Return a closed box around everything."""
    low, high = -2000.0, 2000.0
    corners = np.array([[x, y, z] for x in (low, high) for y in (low, high) for z in (low, high)])
    return Surface(corners + sweep.spot("barrel", np.random.default_rng(0)).place, BOX_FACES, name="planted")


def _moved(cylinder: Cylinder, T_a_b: FloatArray) -> Cylinder:
    start, end = transforms.apply(T_a_b, np.stack([cylinder.start, cylinder.end]))
    return replace(cylinder, start=start, end=end)


def _points(surface: Surface, *, step: float) -> FloatArray:
    """Return points of a surface, spread over each face at most a step apart [mm], its corners among them."""
    found: list[FloatArray] = []
    for corners in surface.vertices[surface.faces]:
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
        count = max(int(np.ceil(sides.max() / step)), 1)
        i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1))
        weights = np.stack([i, j, count - i - j], axis=-1)[i + j <= count] / count
        found.append(weights @ corners)
    return np.concatenate(found)


def _least_distances(solid: Solid, poses: FloatArray, points: FloatArray) -> FloatArray:
    """Return the (k,) smallest signed distances of (m, 3) points from a solid at (k, 4, 4) poses [mm]."""
    return _least_from_axes(*_placed(solid, poses), points)


def _bounds(
    solid: Solid, poses: FloatArray, moved: FloatArray, points: FloatArray, radii: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Return how near balls may come to a solid [mm].

    Args:
        solid: that moves.
        poses: (k, 4, 4) of it.
        moved: (k,) how far it goes about each [mm].
        points: (m, 3) middles of the balls.
        radii: (m,) of the balls [mm].

    Returns:
        (k,) lower bounds for each pose, (m,) for each ball, and the smallest distance of a middle from a pose.
    """
    return _bounds_from_axes(*_placed(solid, poses), moved, np.column_stack([points, radii]))


def _placed(solid: Solid, poses: FloatArray) -> tuple[FloatArray, FloatArray, tuple[float, float, float]]:
    """Return the (k, 3) starts and axes of a solid at poses; and its length, first and last radius [mm]."""
    starts = poses[:, :3, :3] @ solid.start + poses[:, :3, 3]
    return starts, poses[:, :3, :3] @ solid.axis, (solid.length, solid.start_radius, solid.end_radius)


@njit
def _least_from_axes(
    starts: FloatArray, axes: FloatArray, shape: tuple[float, float, float], points: FloatArray
) -> FloatArray:
    found = np.full(len(starts), np.inf)
    for k in range(len(starts)):
        for point in points:
            found[k] = min(found[k], _from_solid(point, starts[k], axes[k], shape))
    return found


@njit
def _bounds_from_axes(
    starts: FloatArray, axes: FloatArray, shape: tuple[float, float, float], moved: FloatArray, balls: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    at_poses, at_balls, least = np.full(len(starts), np.inf), np.full(len(balls), np.inf), np.inf
    for k in range(len(starts)):
        for m in range(len(balls)):
            distance = _from_solid(balls[m], starts[k], axes[k], shape)
            least = min(least, distance)
            bound = distance - moved[k] - balls[m, 3]
            at_poses[k], at_balls[m] = min(at_poses[k], bound), min(at_balls[m], bound)
    return at_poses, at_balls, least


@inner
def _from_solid(point: FloatArray, start: FloatArray, axis: FloatArray, shape: tuple[float, float, float]) -> float:
    x, y, z = point[0] - start[0], point[1] - start[1], point[2] - start[2]
    along = x * axis[0] + y * axis[1] + z * axis[2]
    return _from_frustum(along, sqrt(max(x * x + y * y + z * z - along * along, 0.0)), shape)


@inner
def _from_frustum(along: float, out: float, shape: tuple[float, float, float]) -> float:
    """Return the signed distance of a point from a frustum, given where it is along its axis and away from it [mm]."""
    length, first, last = shape
    slope = (last - first) / length
    beside = out - first - slope * along
    if beside <= 0.0 and 0.0 <= along <= length:
        return max(beside / sqrt(1.0 + slope * slope), -along, along - length)
    on_side = min(max((along + slope * (out - first)) / (1.0 + slope * slope), 0.0), length)
    to_side = (along - on_side) ** 2 + (out - first - slope * on_side) ** 2
    to_start = along**2 + max(out - first, 0.0) ** 2
    to_end = (along - length) ** 2 + max(out - last, 0.0) ** 2
    return sqrt(min(to_side, to_start, to_end))


# Each cylinder's side and both ends begin as so many patches, an eighth of a turn to either side of their middles.
QUARTERS = 4
# A direction whose share along an axis is larger than this meets the end of a cylinder first, else its side.
STEEP = 0.8


@final
@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """Patches of the surfaces of cylinders.

    Attributes:
        cylinders: that they lie on.
        own: (n,) which of these.
        ends: (n,) 0 on the side, -1 and 1 on the end at the start and on the other.
        middles: (n, 2) angle about the axis [rad], and share of the length, or on an end of the radius.
        halves: (n, 2) by how much a patch goes beyond its middle to either side.
    """

    cylinders: Sequence[Cylinder]
    own: IntArray
    ends: IntArray
    middles: FloatArray
    halves: FloatArray

    @classmethod
    def of(cls, cylinders: Sequence[Cylinder]) -> Patches:
        """Return patches that together are the surfaces of cylinders."""
        own, ends, turns = (
            each.ravel() for each in np.meshgrid(range(len(cylinders)), [-1, 0, 1], range(QUARTERS), indexing="ij")
        )
        halves = np.tile([np.pi / QUARTERS, 0.5], (len(own), 1))
        middles = np.column_stack([2.0 * np.pi * turns / QUARTERS, np.full(len(own), 0.5)])
        return cls(cylinders, own, ends, middles, halves)

    def balls(self) -> tuple[FloatArray, FloatArray]:
        """Return the (n, 3) middles of the patches, and the (n,) radii of the balls about them that hold them [mm]."""
        at = self._points(self.middles)
        # Distance from the middle grows with the angle, and towards both ends of the other range: a corner is farthest.
        corners = np.stack([self._points(self.middles + self.halves * [i, j]) for i in (-1, 1) for j in (-1, 1)])
        return at, np.linalg.norm(corners - at, axis=2).max(axis=0)

    def split(self, kept: BoolArray) -> Patches:
        """Return the quarters of those of n patches that are kept."""
        middles, halves = self.middles[kept], self.halves[kept] / 2.0
        quarters = np.concatenate([middles + halves * [i, j] for i in (-1, 1) for j in (-1, 1)])
        return replace(
            self,
            own=np.tile(self.own[kept], 4),
            ends=np.tile(self.ends[kept], 4),
            middles=quarters,
            halves=np.tile(halves, (4, 1)),
        )

    def _points(self, places: FloatArray) -> FloatArray:
        starts, along = _axes_of(self.cylinders)
        radii = np.array([one.radius for one in self.cylinders])[self.own]
        x, y = _across(along)
        angles, shares = places.T
        outwards = np.cos(angles)[:, None] * x[self.own] + np.sin(angles)[:, None] * y[self.own]
        out = radii * np.where(self.ends == 0, 1.0, shares)
        up = np.where(self.ends == 0, shares, (self.ends + 1) / 2.0)
        return starts[self.own] + up[:, None] * along[self.own] + out[:, None] * outwards


def facing(cylinder: Cylinder, outward: FloatArray, random: np.random.Generator) -> FloatArray:
    """Return a random (3,) point of a cylinder's surface, on the side that a (3,) unit direction meets from outside."""
    (start,), (along,) = _axes_of([cylinder])
    axis = along / np.linalg.norm(along)
    rise = float(outward @ axis)
    x, y = _across(axis[None])
    if abs(rise) > STEEP:
        turn, out = 2.0 * np.pi * float(random.random()), cylinder.radius * float(np.sqrt(random.random()))
        return start + (rise < 0.0) * along + out * (np.cos(turn) * x[0] + np.sin(turn) * y[0])
    aside = outward - rise * axis
    return start + float(random.random()) * along - cylinder.radius * aside / np.linalg.norm(aside)


def table_cylinders(table: Hexapod | TiltTurn, T_table_plate: FloatArray) -> list[Cylinder]:
    """Return the solids of a table at a (4, 4) pose of its plate, in the robot's base."""
    T_base_plate = table.T_base_table @ T_table_plate
    under = -table.plate_thickness
    plate = _cylinder("table's plate", T_base_plate, (0.0, 0.0, 0.0), (0.0, 0.0, under), table.plate_diameter)
    if isinstance(table, TiltTurn):
        deep, end = under - table.hub_length, (-table.stand_distance, 0.0, -table.axis_depth)
        foot = (end[0], 0.0, end[2] - table.stand_height)
        hub = _cylinder("table's hub", T_base_plate, (0.0, 0.0, under), (0.0, 0.0, deep), table.hub_diameter)
        beam = _cylinder("table's beam", table.T_base_table, (0.0, 0.0, end[2]), end, table.stand_diameter)
        return [plate, hub, beam, _cylinder("table's post", table.T_base_table, end, foot, table.stand_diameter)]
    feet = transforms.apply(table.T_base_table, table.base_joints)
    heads = transforms.apply(T_base_plate, table.plate_joints)
    legs = [
        Cylinder(f"table's leg {number}", foot, head, table.leg_diameter / 2.0)
        for number, (foot, head) in enumerate(zip(feet, heads, strict=True), start=1)
    ]
    low = float(table.base_joints[:, 2].min())
    base = ((0.0, 0.0, low), (0.0, 0.0, low - table.base_height))
    return [plate, *legs, _cylinder("table's base", table.T_base_table, *base, table.base_diameter)]


def _cylinder(
    name: str,
    T_base_own: FloatArray,
    start: tuple[float, float, float],
    end: tuple[float, float, float],
    diameter: float,
) -> Cylinder:
    ends = transforms.apply(T_base_own, np.array([start, end]))
    return Cylinder(name, ends[0], ends[1], diameter / 2.0)


def _axes_of(cylinders: Sequence[Cylinder]) -> tuple[FloatArray, FloatArray]:
    starts = np.stack([one.start for one in cylinders])
    return starts, np.stack([one.end for one in cylinders]) - starts


def _across(along: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (n, 3) unit vectors across (n, 3) axes, and across these and one another."""
    x = np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(along, x)
    return x, y / np.linalg.norm(y, axis=1, keepdims=True)
