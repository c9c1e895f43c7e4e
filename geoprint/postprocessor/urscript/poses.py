"""Poses as URScript has them: a position [m] and a rotation vector [rad], in six numbers; plain numbers for speed."""

from __future__ import annotations

import math
from typing import TypeAlias, final

from geoprint.model import FloatArray

Vector: TypeAlias = tuple[float, float, float]
# w x y z of a unit quaternion.
Turn: TypeAlias = tuple[float, float, float, float]


@final
class Pose(tuple[float, float, float, float, float, float]):
    """A value p[x,y,z,rx,ry,rz]."""

    __slots__ = ()


def position(pose: Pose) -> Vector:
    """Return the position of a pose [m]."""
    return pose[0], pose[1], pose[2]


def turn(pose: Pose) -> Turn:
    """Return the attitude of a pose as a quaternion."""
    x, y, z = pose[3], pose[4], pose[5]
    angle = math.sqrt(x * x + y * y + z * z)
    share = 0.5 if angle < 1e-12 else math.sin(0.5 * angle) / angle
    return math.cos(0.5 * angle), x * share, y * share, z * share


def pose_of(place: Vector, attitude: Turn) -> Pose:
    """Return the pose of a position and a quaternion."""
    w, x, y, z = attitude if attitude[0] >= 0.0 else (-attitude[0], -attitude[1], -attitude[2], -attitude[3])
    sine = math.sqrt(x * x + y * y + z * z)
    share = 2.0 if sine < 1e-12 else 2.0 * math.atan2(sine, w) / sine
    return Pose((*place, x * share, y * share, z * share))


def turned(attitude: Turn, vector: Vector) -> Vector:
    """Return a vector that a quaternion has turned."""
    w, x, y, z = attitude
    a, b, c = vector
    u, v, t = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * u + y * t - z * v, b + w * v + z * u - x * t, c + w * t + x * v - y * u


def product(first: Turn, second: Turn) -> Turn:
    """Return the attitude of a second one that is seen from the first."""
    a, b, c, d = first
    e, f, g, h = second
    return (
        a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e,
    )  # fmt: skip


def conjugate(attitude: Turn) -> Turn:
    """Return the opposite turn."""
    return attitude[0], -attitude[1], -attitude[2], -attitude[3]


def pose_trans(first: Pose, second: Pose) -> Pose:
    """Return a pose that is given in the frame of another: URScript's pose_trans."""
    attitude = turn(first)
    x, y, z = turned(attitude, position(second))
    return pose_of((first[0] + x, first[1] + y, first[2] + z), product(attitude, turn(second)))


def pose_inv(pose: Pose) -> Pose:
    """Return the inverse of a pose: URScript's pose_inv."""
    back = conjugate(turn(pose))
    x, y, z = turned(back, position(pose))
    return pose_of((-x, -y, -z), back)


def between(first: Turn, second: Turn, share: float) -> Turn:
    """Return the attitude at a share of the shorter turn from one to another."""
    w, x, y, z = product(conjugate(first), second)
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    sine = math.sqrt(x * x + y * y + z * z)
    if sine < 1e-12:
        return first
    half = share * math.atan2(sine, w)
    scale = math.sin(half) / sine
    return product(first, (math.cos(half), x * scale, y * scale, z * scale))


def angle_between(first: Turn, second: Turn) -> float:
    """Return the angle between two attitudes [rad]."""
    same = abs(sum(a * b for a, b in zip(first, second, strict=True)))
    near = math.sqrt(sum((a - b) ** 2 for a, b in zip(first, second, strict=True)))
    other = math.sqrt(sum((a + b) ** 2 for a, b in zip(first, second, strict=True)))
    return 4.0 * math.asin(min(0.5 * min(near, other), 1.0)) if same > 0.5 else math.pi


def pose_of_matrix(T: FloatArray) -> Pose:
    """Return the pose of a (4, 4) transform in mm."""
    (a, b, c), (d, e, f), (g, h, i) = T[:3, :3].tolist()
    # The largest of the four squares keeps the division safe.
    squares = (1.0 + a + e + i, 1.0 + a - e - i, 1.0 - a + e - i, 1.0 - a - e + i)
    most = max(range(4), key=squares.__getitem__)
    s = math.sqrt(squares[most])
    r = 0.5 / s
    attitude = (
        (0.5 * s, (h - f) * r, (c - g) * r, (d - b) * r),
        ((h - f) * r, 0.5 * s, (b + d) * r, (c + g) * r),
        ((c - g) * r, (b + d) * r, 0.5 * s, (f + h) * r),
        ((d - b) * r, (c + g) * r, (f + h) * r, 0.5 * s),
    )[most]
    x, y, z = T[:3, 3].tolist()
    return pose_of((1e-3 * x, 1e-3 * y, 1e-3 * z), attitude)
