"""Arms whose axes 2, 3 and 4 are parallel, whatever the conventions of their URDF: the family of Universal Robots.

Such an arm has no spherical wrist: axes 4 and 5, and 5 and 6, meet in two points. All eight inverse solutions follow in
closed form [Hawkins2013]: joint 1 from the lateral offset of axis 5, joints 5 and 6 from the attitude of the flange,
joints 2 to 4 as a planar chain of three links. `closed_form` knows the arm in one pose of zero angles: axis 1, lower
arm, forearm and axis 5 up, axes along z y y y z y. A URDF may count each joint from elsewhere and in the other
direction: angle = offset + sign * q, read off the lines of the axes in space as in `ortho_parallel`.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.kernels import inner, njit
from geoprint.model import FloatArray
from geoprint.robot.arm.ortho_parallel import (
    BRANCHES,
    JOINTS,
    LENGTH_ROUNDING,
    RIM,
    SINGULAR,
    ClosedForm,
    Screws,
    angle_between,
    cleared,
    outwards,
    require_angles,
    solve_pose,
    wrapped,
)


@final
@dataclass(frozen=True, slots=True)
class ParallelLengths:
    """The lengths of an arm with three parallel axes, in the order that the compiled loops take.

    Attributes:
        c1: height of axis 2 [mm].
        c2: length of the lower arm, axis 2 to axis 3 [mm].
        c3: length of the forearm, axis 3 to axis 4 [mm].
        b: lateral offset of axis 5 from axis 1 [mm].
        c5: from axis 4 to axis 6, along axis 5 [mm].
        c6: from axis 5 to the flange, along axis 6 [mm].
    """

    c1: float
    c2: float
    c3: float
    b: float
    c5: float
    c6: float


@njit
def _solve(Ts: FloatArray, lengths: FloatArray, joints: FloatArray) -> None:
    """Fill (k, 8, 6) joints."""
    for k in range(Ts.shape[0]):
        solve_parallel_pose(Ts[k], lengths, joints[k])


@inner
def solve_parallel_pose(T: FloatArray, lengths: FloatArray, joints: FloatArray) -> None:
    """Fill (8, 6) joints of one pose: on each side of axis 1, with the wrist turned over, and the elbow up or down."""
    c1, c2, c3, b, c5, c6 = lengths
    joints[:] = np.nan
    x, y, z = T[0, 3] - c6 * T[0, 2], T[1, 3] - c6 * T[1, 2], T[2, 3] - c6 * T[2, 2] - c1
    across = x * x + y * y - b * b
    if not across >= 0.0:
        return
    azimuth, aside = math.atan2(y, x), math.atan2(b, math.sqrt(across))
    for shoulder in range(2):
        # In front of axis 1, or reaching over to the side behind it.
        first = azimuth - aside if shoulder == 0 else azimuth + aside - math.pi
        ahead = math.sqrt(across) if shoulder == 0 else -math.sqrt(across)
        sine, cosine = math.sin(first), math.cos(first)
        # Axis 6 and the other axes of the end, seen along the plane of the arm and across it.
        out_x, out_y, out_z = cosine * T[0, 2] + sine * T[1, 2], cosine * T[1, 2] - sine * T[0, 2], T[2, 2]
        lean = math.hypot(out_x, out_z)
        singular = lean < SINGULAR
        for wrist in range(2):
            side = 1.0 - 2.0 * wrist
            # On the singularity of the wrist joint 6 is free: it stays at zero, and the turn of axis 5 follows.
            if singular:
                along_x, along_z = -(cosine * T[0, 1] + sine * T[1, 1]), -T[2, 1]
            else:
                along_x, along_z = side * out_z / lean, -side * out_x / lean
            turned_x = along_x * (cosine * T[0, 0] + sine * T[1, 0]) + along_z * T[2, 0]
            turned_z = along_x * (cosine * T[0, 1] + sine * T[1, 1]) + along_z * T[2, 1]
            # Axis 4 as axis 2 sees it, and how far the elbow must bend to reach it.
            reached, height = ahead - c5 * along_x, z - c5 * along_z
            cosine_3 = (reached * reached + height * height - c2 * c2 - c3 * c3) / (2.0 * c2 * c3)
            if not abs(cosine_3) <= 1.0 + RIM:
                continue
            open_3 = math.acos(min(max(cosine_3, -1.0), 1.0))
            for elbow in range(2):
                third = open_3 if elbow == 0 else -open_3
                second = math.atan2(reached, height) - math.atan2(c3 * math.sin(third), c2 + c3 * math.cos(third))
                found = joints[4 * wrist + 2 * shoulder + elbow]
                found[0], found[1], found[2] = wrapped(first), wrapped(second), third
                found[3] = wrapped(wrapped(math.atan2(along_x, along_z) - third) - found[1])
                found[4], found[5] = side * math.atan2(lean, out_y), math.atan2(-turned_x, -turned_z)


@final
@dataclass(frozen=True, slots=True, eq=False)
class ThreeParallel(ClosedForm[ParallelLengths]):
    """The inverse of such an arm: all eight branches in closed form; attributes as of `ClosedForm`."""

    @property
    def reach(self) -> float:
        """How far from the shoulder the flange may come at most [mm]."""
        lengths = self.lengths
        beside = float(np.linalg.norm(self.T_end_flange[:3, 3]))
        return abs(lengths.b) + lengths.c2 + lengths.c3 + abs(lengths.c5) + abs(lengths.c6) + beside

    def solutions(self, Ts_base_flange: FloatArray) -> FloatArray:
        """Return the joint angles of all eight branches, limits not applied.

        Args:
            Ts_base_flange: (k, 4, 4) poses of the flange [mm].

        Returns:
            (k, 8, 6) angles [rad] in (-pi, pi], branch = 4 * wrist + 2 * shoulder + elbow; NaN where a branch does not
            exist. Where axis 6 is parallel to axis 4 only the sum of the turns about both is determined; one of many is
            given.
        """
        angles = np.empty((len(Ts_base_flange), BRANCHES, JOINTS))
        _solve(np.ascontiguousarray(self._Ts_foot_end(Ts_base_flange)), np.array(astuple(self.lengths)), angles)
        return transforms.wrapped(self.signs * (angles - self.offsets))

    def singularity_distances(self, joints: FloatArray) -> FloatArray:
        """Return how far (k, 6) joint angles [rad] are from the arm's three singularities, with the side as sign.

        Returns:
            (k, 3): how far the point where axes 5 and 6 meet lies ahead of axis 1, seen in the plane of the arm [mm];
            the angle [rad] in (-pi, pi] by which the elbow is bent; the angle of joint 5 [rad] in (-pi, pi] from where
            axis 6 is parallel to axis 4 (0 and pi are singular).
        """
        lengths, angles = self.lengths, self.offsets + self.signs * joints
        tilt, bent, turn = np.cumsum(angles[:, 1:4], axis=1).T
        ahead = lengths.c2 * np.sin(tilt) + lengths.c3 * np.sin(bent) + lengths.c5 * np.sin(turn)
        return np.column_stack([ahead, transforms.wrapped(angles[:, 2]), transforms.wrapped(angles[:, 4])])

    def wrist_distances(self, Ts_base_flange: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (k,) distances of axis 4 from axis 2, of the branch that is reached best, and their bounds [mm]."""
        lengths, Ts = self.lengths, self._Ts_foot_end(Ts_base_flange)
        x, y, z = (Ts[:, :3, 3] - lengths.c6 * Ts[:, :3, 2]).T
        ahead = np.sqrt(np.maximum(x**2 + y**2 - lengths.b**2, 0.0))
        azimuth, aside = np.arctan2(y, x), np.arctan2(lengths.b, ahead)
        low, high = abs(lengths.c2 - lengths.c3), lengths.c2 + lengths.c3
        found = list[FloatArray]()
        for first, reached in ((azimuth - aside, ahead), (azimuth + aside - np.pi, -ahead)):
            out_x = np.cos(first) * Ts[:, 0, 2] + np.sin(first) * Ts[:, 1, 2]
            turn = np.arctan2(Ts[:, 2, 2], -out_x)
            for along in (1.0, -1.0):
                away = reached - along * lengths.c5 * np.sin(turn), z - lengths.c1 - along * lengths.c5 * np.cos(turn)
                found.append(np.hypot(*away))
        each = np.array(found)
        best = np.maximum(low - each, each - high).argmin(axis=0)
        return each[best, np.arange(len(Ts))], np.array([low, high])


def three_parallel(screws: Screws) -> ThreeParallel:
    """Recognise three parallel axes and the wrist that goes with them in the axes of an arm.

    Where the axes leave a choice it falls on what is usual: z along axis 1 points from the base to axis 2, axis 2 turns
    as the URDF has it, axis 5 points from axis 4 to axis 6, and the end's z axis is the flange's, or points from the
    wrist to the flange.

    Args:
        screws: the axes at zero angles.

    Raises:
        UsageError: the arm is of another kind; says in what.
    """
    _require_kind(screws)
    points, directions = screws.points, screws.directions
    wrist, side = screws.nearest(4, 5), directions[1]
    up = directions[0] * (-1.0 if points[1] @ directions[0] < -LENGTH_ROUNDING else 1.0)
    foot = points[0] - (points[0] @ up) * up
    lower, fore = (_across(points[joint + 1] - points[joint], side) for joint in (1, 2))
    hand = _across(wrist - points[3], side)
    along = directions[4] * (-1.0 if hand @ directions[4] < -LENGTH_ROUNDING else 1.0)
    out = outwards(screws, wrist)
    second, third = angle_between(up, lower, about=side), angle_between(lower, fore, about=side)
    fourth, fifth = angle_between(fore, along, about=side), angle_between(side, out, about=along)
    height = float((screws.T_base_flange[:3, 3] - wrist) @ out)
    end: FloatArray = np.array([np.cross(out, along), -along, out], dtype=np.float64).T
    T_base_end = transforms.rigid(end, wrist + height * out)
    return ThreeParallel(
        lengths=ParallelLengths(
            c1=float((points[1] - foot) @ up),
            c2=float(np.linalg.norm(lower)),
            c3=float(np.linalg.norm(fore)),
            b=float((wrist - foot) @ side),
            c5=float(hand @ along),
            c6=height,
        ),
        signs=np.sign(np.sum(directions * [up, side, side, side, along, out], axis=1)),
        offsets=cleared(np.array([0.0, second, third, fourth, fifth, 0.0])),
        T_base_foot=cleared(transforms.rigid(np.array([np.cross(side, up), side, up]).T, foot)),
        T_end_flange=cleared(transforms.inverse(T_base_end) @ screws.T_base_flange),
    )


def _across(vector: FloatArray, axis: FloatArray) -> FloatArray:
    """Return the part of a (3,) vector that is at right angles to an axis."""
    along: FloatArray = (vector @ axis) * axis
    return vector - along


def _require_kind(screws: Screws) -> None:
    """Refuse axes of another kind."""
    require_angles(screws, parallel=[(2, 3), (3, 4)], right=[(1, 2), (4, 5), (5, 6)])
    for one, other in ((1, 2), (4, 5), (5, 6)):
        apart = screws.distance(other - 1, screws.nearest(one - 1, other - 1))
        if apart > LENGTH_ROUNDING:
            raise UsageError(
                f"axes {one} and {other} do not meet: they pass each other by {apart:.3g} mm, allowed is "
                f"{LENGTH_ROUNDING:g}"
            )
    for one, other in ((2, 3), (3, 4)):
        if screws.distance(one - 1, screws.points[other - 1]) < LENGTH_ROUNDING:
            raise UsageError(f"axes {one} and {other} lie in one line: the arm cannot stretch")


# What a kernel asks of either kind of arm, which it knows by how many lengths there are.


PARALLEL_LENGTHS = 6


@inner
def solve_either(T: FloatArray, lengths: FloatArray, joints: FloatArray) -> None:
    """Fill (8, 6) joints of one pose of the end."""
    if lengths.size == PARALLEL_LENGTHS:
        solve_parallel_pose(T, lengths, joints)
    else:
        solve_pose(T, lengths, joints)


@inner
def singular_terms(joints: FloatArray, lengths: FloatArray) -> tuple[float, float, float]:
    """Return how far (6,) joints of a closed form are from its singularities of shoulder [mm], elbow and wrist [rad].

    All are at least 0. A spherical wrist counts from where joint 5 is zero alone: its limits keep it from half a turn.
    """
    if lengths.size == PARALLEL_LENGTHS:
        bent = joints[1] + joints[2]
        reached = lengths[1] * math.sin(joints[1]) + lengths[2] * math.sin(bent)
        ahead = reached + lengths[4] * math.sin(bent + joints[3])
        bend, wrist = abs(joints[2]), abs(joints[4])
        return abs(ahead), min(bend, math.pi - bend), min(wrist, math.pi - wrist)
    _, a2, _, _, c2, c3, _ = lengths
    bend = _centred(joints[2] + math.atan2(c3, -a2))
    ahead = lengths[0] + c2 * math.sin(joints[1]) + math.hypot(a2, c3) * math.sin(joints[1] + bend)
    return abs(ahead), min(abs(bend), math.pi - abs(bend)), abs(joints[4])


@inner
def _centred(angle: float) -> float:
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)
