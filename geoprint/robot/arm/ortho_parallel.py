"""Arms with an ortho-parallel base and a spherical wrist, whatever the conventions of their URDF [Brandstötter2014].

`closed_form` knows such an arm in one pose of zero angles: axis 1 up, lower arm upright, forearm ahead, axes along
z y y x y x. A URDF may count each joint from elsewhere and in the other direction, and may turn the frames of base and
flange. All of that is read off the lines of the axes in space: angle = offset + sign * q of each joint, and two frames.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import Generic, Protocol, TypeVar, final

import numpy as np

from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.kernels import inner, njit
from geoprint.model import FloatArray, freeze_arrays, frozen

# The joint axes of an arm as lines in space at zero angles: all that its kinematics consist of.


@final
@frozen
class Screws:
    """Six axes of rotation and the flange, all joints at zero, in the base frame.

    Attributes:
        points: (6, 3) a point on each axis [mm].
        directions: (6, 3) unit vectors about which joints turn positively.
        T_base_flange: (4, 4) where the flange is [mm].
    """

    points: FloatArray
    directions: FloatArray
    T_base_flange: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, points="float: 6 3", directions="float: 6 3", T_base_flange="float: 4 4")

    def nearest(self, one: int, other: int) -> FloatArray:
        """Return the (3,) point on one axis, numbered from 0, that is nearest to another.

        On parallel axes every point is as near: the one beside the other's own point is returned.
        """
        p, d = self.points[one], self.directions[one]
        q, e = self.points[other], self.directions[other]
        across = np.cross(d, e)
        squared = float(across @ across)
        if squared < PARALLEL**2:
            return p + ((q - p) @ d) * d
        return p + (np.cross(q - p, e) @ across) / squared * d

    def distance(self, axis: int, point: FloatArray) -> float:
        """Return how far a (3,) point is from an axis [mm]."""
        away = point - self.points[axis]
        return float(np.linalg.norm(away - (away @ self.directions[axis]) * self.directions[axis]))


# Sine of the angle below which two axes count as parallel when a common point is asked for: it would lie far away, in a
# place that says nothing about the arm.
PARALLEL = 1e-3


# All eight inverse solutions of an arm with an ortho-parallel base and a spherical wrist [Brandstötter2014].
#
# A compiled loop over poses: a fraction of a microsecond for each, so that a search may ask millions of them.


BRANCHES = 8
JOINTS = 6
# By how much rounding lifts the cosine of a stretched arm above one: it still reaches.
RIM = 1e-12
# Sine of joint 5 that is rounding: what joint 4 would be there says nothing.
SINGULAR = 1e-12


def all_branches(Ts_base_flange: FloatArray, lengths: FloatArray) -> FloatArray:
    """Return the joint angles of all eight branches, limits not applied.

    Args:
        Ts_base_flange: (k, 4, 4) poses of the flange [mm].
        lengths: (7,) a1, a2, b, c1, c2, c3, c4 of the source [mm].

    Returns:
        (k, 8, 6) angles [rad] in (-pi, pi], branch = 4 * wrist + 2 * shoulder + elbow; NaN where a branch does not
        exist. Joint 3 counts from the forearm pointing ahead.
    """
    joints = np.empty((len(Ts_base_flange), BRANCHES, JOINTS))
    _solve(np.ascontiguousarray(Ts_base_flange), lengths, joints)
    return joints


@njit
def _solve(Ts: FloatArray, lengths: FloatArray, joints: FloatArray) -> None:
    """Fill (k, 8, 6) joints."""
    for k in range(Ts.shape[0]):
        solve_pose(Ts[k], lengths, joints[k])


@inner
def solve_pose(T: FloatArray, lengths: FloatArray, joints: FloatArray) -> None:
    """Fill (8, 6) joints of one pose: on each side of axis 1, with the elbow up or down, and the wrist turned over."""
    a1, a2, b, c1, c2, c3, c4 = lengths
    forearm, bend = math.hypot(a2, c3), math.atan2(a2, c3)
    joints[:] = np.nan
    x, y, z = T[0, 3] - c4 * T[0, 2], T[1, 3] - c4 * T[1, 2], T[2, 3] - c4 * T[2, 2]
    across = x * x + y * y - b * b
    if not across >= 0.0:
        return
    azimuth, aside = math.atan2(y, x), math.atan2(b, math.sqrt(across))
    for shoulder in range(2):
        # In front of axis 1, or reaching over to the side behind it.
        first = azimuth - aside if shoulder == 0 else azimuth + aside - math.pi
        ahead = math.sqrt(across) - a1 if shoulder == 0 else -math.sqrt(across) - a1
        squared = ahead * ahead + (z - c1) * (z - c1)
        cosine_2 = (squared + c2 * c2 - forearm * forearm) / (2.0 * math.sqrt(squared) * c2)
        cosine_3 = (squared - c2 * c2 - forearm * forearm) / (2.0 * c2 * forearm)
        if not (abs(cosine_2) <= 1.0 + RIM and abs(cosine_3) <= 1.0 + RIM):
            continue
        open_2 = math.acos(min(max(cosine_2, -1.0), 1.0))
        open_3 = math.acos(min(max(cosine_3, -1.0), 1.0))
        for elbow in range(2):
            sign = 2.0 * elbow - 1.0
            second = math.atan2(ahead, z - c1) + sign * open_2
            third = -sign * open_3 - bend
            _fill(joints[2 * shoulder + elbow :: 4], T, first, second, third)


@inner
def _fill(joints: FloatArray, T: FloatArray, first: float, second: float, third: float) -> None:
    """Fill (2, 6) joints of one place of the forearm: the wrist that gives the flange its attitude, and turned over."""
    sine_1, cosine_1 = math.sin(first), math.cos(first)
    sine, cosine = math.sin(second + third), math.cos(second + third)
    # The flange's axes seen along the plane of the arm and across it; then from the forearm.
    aside_x, aside_y = cosine_1 * T[1, 0] - sine_1 * T[0, 0], cosine_1 * T[1, 1] - sine_1 * T[0, 1]
    ahead_z, aside_z = cosine_1 * T[0, 2] + sine_1 * T[1, 2], cosine_1 * T[1, 2] - sine_1 * T[0, 2]
    over_x = cosine * (cosine_1 * T[0, 0] + sine_1 * T[1, 0]) - sine * T[2, 0]
    over_y = cosine * (cosine_1 * T[0, 1] + sine_1 * T[1, 1]) - sine * T[2, 1]
    over_z, along = cosine * ahead_z - sine * T[2, 2], sine * ahead_z + cosine * T[2, 2]
    lean = math.hypot(aside_z, over_z)
    # On the singularity of the wrist joint 4 is free: it stays at zero, and joint 6 follows from it as everywhere.
    singular = lean < SINGULAR
    sine_4, cosine_4 = (0.0, 1.0) if singular else (aside_z / lean, over_z / lean)
    fourth, fifth = math.atan2(sine_4, cosine_4), math.atan2(lean, along)
    sixth = math.atan2(cosine_4 * aside_x - sine_4 * over_x, cosine_4 * aside_y - sine_4 * over_y)
    half_turn = 0.0 if singular else math.pi
    for wrist in range(2):
        joints[wrist, 0] = wrapped(first)
        joints[wrist, 1] = wrapped(second)
        joints[wrist, 2] = wrapped(third - math.pi / 2.0)
        joints[wrist, 3] = wrapped(fourth + wrist * half_turn)
        joints[wrist, 4] = fifth if wrist == 0 else -fifth
        joints[wrist, 5] = wrapped(sixth + wrist * half_turn)


@inner
def wrapped(angle: float) -> float:
    """Return an angle within three half turns of zero in (-pi, pi]."""
    if angle > math.pi:
        return angle - 2.0 * math.pi
    if angle <= -math.pi:
        return angle + 2.0 * math.pi
    return angle


# By how much axes may miss being parallel, at right angles [rad] or in one point [mm]: the rounding of a URDF whose
# numbers have 12 digits. Angles written as 1.5708 miss it, and the closed form would miss its poses by micrometres.
ANGLE_ROUNDING = 1e-9
LENGTH_ROUNDING = 1e-6
# An angle that misses by less [rad] was written with too few digits.
ROUNDED_ANGLE = 1e-3
# What is this near to a whole number [rad, mm] was meant to be it.
EXACT = 1e-12


@final
@dataclass(frozen=True, slots=True)
class Lengths:
    """The lengths of an arm with an ortho-parallel base and a spherical wrist, in the letters of [Brandstötter2014].

    Attributes:
        a1: from axis 1 to axis 2, ahead [mm].
        a2: from the forearm's axis 4 up to axis 3 [mm]; negative where axis 4 runs above axis 3.
        b: lateral offset of the wrist centre [mm].
        c1: height of axis 2 [mm].
        c2: length of the lower arm, axis 2 to axis 3 [mm].
        c3: length of the forearm, axis 3 to the wrist centre along axis 4 [mm].
        c4: from the wrist centre to the flange [mm].
    """

    a1: float
    a2: float
    b: float
    c1: float
    c2: float
    c3: float
    c4: float

    @property
    def forearm(self) -> float:
        """From axis 3 to the wrist centre [mm]."""
        return float(np.hypot(self.a2, self.c3))


class ArmLengths(Protocol):
    """What the lengths of every arm with a closed form say."""

    @property
    def c1(self) -> float:
        """From the foot of axis 1 to the height of axis 2 [mm]."""
        ...


_Lengths = TypeVar("_Lengths", bound=ArmLengths, covariant=True)


@dataclass(frozen=True, slots=True, eq=False)
class ClosedForm(Generic[_Lengths]):
    """An inverse in closed form: how its angles and frames lead to those of the arm's URDF.

    Attributes:
        lengths: of the arm.
        signs: (6,) 1 or -1: the direction in which each joint of the URDF counts.
        offsets: (6,) angle in the closed form's convention where the URDF's is zero [rad].
        T_base_foot: (4, 4) foot of axis 1 in the URDF's base frame, z up along it [mm].
        T_end_flange: (4, 4) the URDF's flange frame in the closed form's, whose z axis points out of it [mm].
    """

    lengths: _Lengths
    signs: FloatArray
    offsets: FloatArray
    T_base_foot: FloatArray
    T_end_flange: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, signs="float: 6", offsets="float: 6", T_base_foot="float: 4 4", T_end_flange="float: 4 4"
        )  # fmt: skip

    @property
    def shoulder(self) -> FloatArray:
        """(3,) the point of axis 1 at the height of axis 2, in the base frame [mm]."""
        return transforms.apply(self.T_base_foot, np.array([[0.0, 0.0, self.lengths.c1]]))[0]

    def _Ts_foot_end(self, Ts_base_flange: FloatArray) -> FloatArray:
        return transforms.inverse(self.T_base_foot) @ Ts_base_flange @ transforms.inverse(self.T_end_flange)


@final
@dataclass(frozen=True, slots=True, eq=False)
class OrthoParallel(ClosedForm[Lengths]):
    """The inverse of such an arm: all eight branches in closed form; attributes as of `ClosedForm`."""

    @property
    def reach(self) -> float:
        """How far from the shoulder the flange may come at most [mm]."""
        lengths = self.lengths
        beside = float(np.linalg.norm(self.T_end_flange[:3, 3]))
        return abs(lengths.a1) + abs(lengths.b) + lengths.c2 + lengths.forearm + abs(lengths.c4) + beside

    def solutions(self, Ts_base_flange: FloatArray) -> FloatArray:
        """Return the joint angles of all eight branches, limits not applied.

        Args:
            Ts_base_flange: (k, 4, 4) poses of the flange [mm].

        Returns:
            (k, 8, 6) angles [rad] in (-pi, pi], branch = 4 * wrist + 2 * shoulder + elbow; NaN where a branch does not
            exist. On a singularity of the wrist only the sum of joints 4 and 6 is determined; one of many is given.
        """
        angles = all_branches(self._Ts_foot_end(Ts_base_flange), np.array(astuple(self.lengths)))
        if not self.offsets.any() and (self.signs == 1.0).all():
            return angles
        return transforms.wrapped(self.signs * (angles - self.offsets))

    def singularity_distances(self, joints: FloatArray) -> FloatArray:
        """Return how far (k, 6) joint angles [rad] are from the arm's three singularities, with the side as sign.

        Returns:
            (k, 3): how far the wrist centre lies ahead of axis 1, seen in the plane of the arm [mm]; the angle [rad] in
            (-pi, pi] by which the wrist centre has bent forward from the stretched arm (0 and pi are singular); the
            angle of axis 5 [rad] in (-pi, pi] (0 and pi are singular).
        """
        lengths, angles = self.lengths, self.offsets + self.signs * joints
        tilt, bend = angles[:, 1], angles[:, 2] + np.arctan2(lengths.c3, -lengths.a2)
        ahead = lengths.a1 + lengths.c2 * np.sin(tilt) + lengths.forearm * np.sin(tilt + bend)
        return np.column_stack([ahead, transforms.wrapped(bend), transforms.wrapped(angles[:, 4])])

    def wrist_distances(self, Ts_base_flange: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (k,) distances of the wrist centre from axis 2 with the arm facing it, and their (2,) bounds [mm]."""
        lengths, Ts = self.lengths, self._Ts_foot_end(Ts_base_flange)
        x, y, z = (Ts[:, :3, 3] - lengths.c4 * Ts[:, :3, 2]).T
        ahead = np.sqrt(np.maximum(x**2 + y**2 - lengths.b**2, 0.0)) - lengths.a1
        bounds = np.array([abs(lengths.c2 - lengths.forearm), lengths.c2 + lengths.forearm])
        return np.hypot(ahead, z - lengths.c1), bounds


def ortho_parallel(screws: Screws) -> OrthoParallel:
    """Recognise an ortho-parallel base and a spherical wrist in the axes of an arm.

    Where the axes leave a choice it falls on what is usual: z along axis 1 points from the base to axis 2; axis 2 lies
    ahead of axis 1, or turns as the URDF has it where both meet; the forearm points to the wrist; joint 4 is turned by
    90 degrees at most; the end's z axis is the flange's, or points from the wrist to the flange.

    Args:
        screws: the axes at zero angles.

    Raises:
        UsageError: the arm is of another kind; says in what.
    """
    _require_kind(screws)
    points, directions = screws.points, screws.directions
    wrist = screws.nearest(3, 4)
    up = directions[0] * (-1.0 if points[1] @ directions[0] < -LENGTH_ROUNDING else 1.0)
    foot = points[0] - (points[0] @ up) * up
    side = directions[1]
    if (points[1] - foot) @ np.cross(side, up) < -LENGTH_ROUNDING:
        side = -side
    ahead = np.cross(side, up)
    lower, fore = points[2] - points[1], wrist - points[2]
    along = directions[3] * (-1.0 if fore @ directions[3] < -LENGTH_ROUNDING else 1.0)
    turned = directions[4] * (-1.0 if directions[4] @ side < -ANGLE_ROUNDING else 1.0)
    out = outwards(screws, wrist)
    second = angle_between(up, lower - (lower @ side) * side, about=side)
    third, fourth = angle_between(ahead, along, about=side) - second, angle_between(side, turned, about=along)
    offsets = np.array([0.0, second, third, fourth, angle_between(along, out, about=turned), 0.0])
    end = np.array([np.cross(turned, out), turned, out]).T
    height = float((screws.T_base_flange[:3, 3] - wrist) @ out)
    T_base_end = transforms.rigid(end, wrist + height * out)
    return OrthoParallel(
        lengths=Lengths(
            a1=float((points[1] - foot) @ ahead),
            a2=float(fore @ np.cross(side, along)),
            b=float((wrist - foot) @ side),
            c1=float((points[1] - foot) @ up),
            c2=float(np.linalg.norm(lower - (lower @ side) * side)),
            c3=float(fore @ along),
            c4=height,
        ),
        signs=np.sign(np.sum(directions * [up, side, side, along, turned, out], axis=1)),
        offsets=cleared(offsets),
        T_base_foot=cleared(transforms.rigid(np.column_stack([ahead, side, up]), foot)),
        T_end_flange=cleared(transforms.inverse(T_base_end) @ screws.T_base_flange),
    )


def _require_kind(screws: Screws) -> None:
    """Refuse axes of another kind."""
    require_angles(screws, parallel=[(2, 3)], right=[(1, 2), (3, 4), (4, 5), (5, 6)])
    wrist = screws.nearest(3, 4)
    apart = max(screws.distance(axis, wrist) for axis in (4, 5))
    if apart > LENGTH_ROUNDING:
        raise UsageError(
            f"axes 4, 5 and 6 do not meet: they pass each other by {apart:.3g} mm, allowed is {LENGTH_ROUNDING:g}"
        )
    if screws.distance(1, screws.points[2]) < LENGTH_ROUNDING or screws.distance(2, wrist) < LENGTH_ROUNDING:
        raise UsageError("axes 2 and 3, or axis 3 and the wrist, lie in one line: the arm cannot stretch")


def require_angles(screws: Screws, *, parallel: list[tuple[int, int]], right: list[tuple[int, int]]) -> None:
    """Refuse axes, numbered from 1, that are not parallel or at right angles where they should be."""
    d = screws.directions
    tilted = [(i, j, float(np.linalg.norm(np.cross(d[i - 1], d[j - 1]))), "parallel") for i, j in parallel]
    tilted += [(i, j, abs(float(d[i - 1] @ d[j - 1])), "at right angles") for i, j in right]
    for one, other, off, wanted in tilted:
        if off > ANGLE_ROUNDING:
            rounded = " (angles in a URDF need 12 digits)" if off < ROUNDED_ANGLE else ""
            raise UsageError(
                f"axes {one} and {other} are not {wanted}: they miss it by {off:.3g} rad, allowed is "
                f"{ANGLE_ROUNDING:g}{rounded}"
            )


def outwards(screws: Screws, wrist: FloatArray) -> FloatArray:
    """Return axis 6 as the flange's z axis points along it, or else from the wrist to the flange."""
    axis, T_base_flange = screws.directions[5], screws.T_base_flange
    along = float(T_base_flange[:3, 2] @ axis)
    if abs(along) < 1.0 - ANGLE_ROUNDING:
        along = float((T_base_flange[:3, 3] - wrist) @ axis)
    return -axis if along < -ANGLE_ROUNDING else axis


def angle_between(start: FloatArray, end: FloatArray, *, about: FloatArray) -> float:
    """Return the angle in (-pi, pi] from one direction to another about an axis at right angles to both [rad]."""
    return float(np.arctan2(np.cross(start, end) @ about, start @ end))


def cleared(values: FloatArray) -> FloatArray:
    """Return values with those that are a whole number but for rounding set to it, so that usual arms stay exact."""
    whole = np.rint(values)
    return np.where(np.abs(values - whole) < EXACT, whole, values) + 0.0
