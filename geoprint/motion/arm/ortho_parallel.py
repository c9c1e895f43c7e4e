"""Arms with an ortho-parallel base and a spherical wrist, whatever the conventions of their URDF [Brandstötter2014].

`closed_form` knows such an arm in one pose of zero angles: axis 1 up, lower arm upright, forearm ahead, axes along
z y y x y x. A URDF may count each joint from elsewhere and in the other direction, and may turn the frames of base and
flange. All of that is read off the lines of the axes in space: angle = offset + sign * q of each joint, and two frames.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.model import FloatArray, freeze_arrays
from geoprint.motion.arm.closed_form import all_branches
from geoprint.motion.arm.screws import Screws

# By how much axes may miss being parallel, at right angles [rad] or in one point [mm]: the rounding of a URDF whose
# numbers have 12 digits. Angles written as 1.5708 miss it, and the closed form would miss its poses by micrometres.
ANGLE_ROUNDING = 1e-9
LENGTH_ROUNDING = 1e-6
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


@final
@dataclass(frozen=True, slots=True, eq=False)
class OrthoParallel:
    """The inverse of such an arm: all eight branches in closed form.

    Attributes:
        lengths: of the arm.
        signs: (6,) 1 or -1: the direction in which each joint of the URDF counts.
        offsets: (6,) angle in the closed form's convention where the URDF's is zero [rad].
        T_base_foot: (4, 4) foot of axis 1 in the URDF's base frame, z up along it [mm].
        T_end_flange: (4, 4) the URDF's flange frame in the closed form's, whose z axis points out of it [mm].
    """

    lengths: Lengths
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

    def _Ts_foot_end(self, Ts_base_flange: FloatArray) -> FloatArray:
        return transforms.inverse(self.T_base_foot) @ Ts_base_flange @ transforms.inverse(self.T_end_flange)


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
    out = _outwards(screws, wrist)
    second = _angle(up, lower - (lower @ side) * side, about=side)
    third, fourth = _angle(ahead, along, about=side) - second, _angle(side, turned, about=along)
    offsets = np.array([0.0, second, third, fourth, _angle(along, out, about=turned), 0.0])
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
        offsets=_cleared(offsets),
        T_base_foot=_cleared(transforms.rigid(np.column_stack([ahead, side, up]), foot)),
        T_end_flange=_cleared(transforms.inverse(T_base_end) @ screws.T_base_flange),
    )


def _require_kind(screws: Screws) -> None:
    """Refuse axes of another kind."""
    d = screws.directions
    tilted = [(2, 3, float(np.linalg.norm(np.cross(d[1], d[2]))), "parallel")]
    tilted += [(i, j, abs(float(d[i - 1] @ d[j - 1])), "at right angles") for i, j in [(1, 2), (3, 4), (4, 5), (5, 6)]]
    for one, other, off, wanted in tilted:
        if off > ANGLE_ROUNDING:
            raise UsageError(
                f"axes {one} and {other} are not {wanted}: they miss it by {off:.3g} rad, allowed is "
                f"{ANGLE_ROUNDING:g} (angles in a URDF need 12 digits)"
            )
    wrist = screws.nearest(3, 4)
    apart = max(screws.distance(axis, wrist) for axis in (4, 5))
    if apart > LENGTH_ROUNDING:
        raise UsageError(
            f"axes 4, 5 and 6 do not meet: they pass each other by {apart:.3g} mm, allowed is {LENGTH_ROUNDING:g}"
        )
    if screws.distance(1, screws.points[2]) < LENGTH_ROUNDING or screws.distance(2, wrist) < LENGTH_ROUNDING:
        raise UsageError("axes 2 and 3, or axis 3 and the wrist, lie in one line: the arm cannot stretch")


def _outwards(screws: Screws, wrist: FloatArray) -> FloatArray:
    """Return axis 6 as the flange's z axis points along it, or else from the wrist to the flange."""
    axis, T_base_flange = screws.directions[5], screws.T_base_flange
    along = float(T_base_flange[:3, 2] @ axis)
    if abs(along) < 1.0 - ANGLE_ROUNDING:
        along = float((T_base_flange[:3, 3] - wrist) @ axis)
    return -axis if along < -ANGLE_ROUNDING else axis


def _angle(start: FloatArray, end: FloatArray, *, about: FloatArray) -> float:
    """Return the angle in (-pi, pi] from one direction to another about an axis at right angles to both [rad]."""
    return float(np.arctan2(np.cross(start, end) @ about, start @ end))


def _cleared(values: FloatArray) -> FloatArray:
    """Return values with those that are a whole number but for rounding set to it, so that usual arms stay exact."""
    whole = np.rint(values)
    return np.where(np.abs(values - whole) < EXACT, whole, values) + 0.0
