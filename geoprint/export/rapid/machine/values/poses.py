"""Poses as RAPID has them, a place [mm] and a unit quaternion, in plain numbers: what one instruction needs of them."""

from __future__ import annotations

import math
from typing import TypeAlias, cast

from geoprint.export.rapid.language.syntax import Value
from geoprint.export.rapid.machine.values.faults import fault

Pos: TypeAlias = tuple[float, float, float]
Orient: TypeAlias = tuple[float, float, float, float]
Pose: TypeAlias = tuple[Pos, Orient]

IDENTITY: Pose = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
# How far from 1 the length of a quaternion may be that a controller still takes.
_UNIT_TOLERANCE = 1e-3


def pose_of(value: Value) -> Pose:
    """Return a value as a pose with a unit quaternion.

    Raises:
        Fault: its quaternion is none.
    """
    place, turn = cast("Pose", value)
    return place, normalised(turn)


def normalised(q: Orient) -> Orient:
    """Return a quaternion of length 1.

    Raises:
        Fault: it is none, by more than a controller corrects.
    """
    w, x, y, z = q
    length = math.sqrt(w * w + x * x + y * y + z * z)
    if not abs(length - 1.0) <= _UNIT_TOLERANCE:
        fault("ERR_ARGVALERR", f"the orientation {list(q)} is no unit quaternion")
    return w / length, x / length, y / length, z / length


def times(p: Orient, q: Orient) -> Orient:
    """Return the product of two quaternions: first q, then p."""
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def turned(q: Orient, v: Pos) -> Pos:
    """Return a vector turned by a unit quaternion."""
    w, x, y, z = q
    a, b, c = v
    i, j, k = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * i + y * k - z * j, b + w * j + z * i - x * k, c + w * k + x * j - y * i


def compose(first: Pose, second: Pose) -> Pose:
    """Return the pose `second`, which is given in coordinates of the first, in those of the first's own frame."""
    (x, y, z), q = first
    a, b, c = turned(q, second[0])
    return (x + a, y + b, z + c), times(q, second[1])


def inverted(pose: Pose) -> Pose:
    """Return the inverse of a pose."""
    place, (w, x, y, z) = pose
    back = (w, -x, -y, -z)
    a, b, c = turned(back, place)
    return (-a, -b, -c), back


def distance(a: Pos, b: Pos) -> float:
    """Return how far two places lie apart [mm]."""
    return math.dist(a, b)


def angle(p: Orient, q: Orient) -> float:
    """Return by how much two unit quaternions differ [rad]; q and -q are the same."""
    w, x, y, z = times((p[0], -p[1], -p[2], -p[3]), q)
    return 2.0 * math.atan2(math.sqrt(x * x + y * y + z * z), abs(w))


def between(start: Pose, end: Pose, share: float) -> Pose:
    """Return the pose at a share of a straight line along which the attitude turns at a constant rate (slerp)."""
    (a, b, c), p = start
    (x, y, z), q = end
    place = (a + share * (x - a), b + share * (y - b), c + share * (z - c))
    dot = sum(i * j for i, j in zip(p, q, strict=True))
    sign = -1.0 if dot < 0.0 else 1.0
    half = math.acos(min(abs(dot), 1.0))
    if half < 1e-9:
        return place, p
    one, other = math.sin((1.0 - share) * half) / math.sin(half), sign * math.sin(share * half) / math.sin(half)
    w, i, j, k = (one * s + other * t for s, t in zip(p, q, strict=True))
    return place, normalised((w, i, j, k))


def circle(start: Pos, through: Pos, end: Pos) -> tuple[float, float]:
    """Return length and radius of the arc through three places [mm].

    Raises:
        Fault: they lie on a line.
    """
    a, b, c = distance(through, end), distance(start, end), distance(start, through)
    half = (a + b + c) / 2.0
    area = math.sqrt(max(half * (half - a) * (half - b) * (half - c), 0.0))
    if area <= 1e-9 * max(a, b, c, 1e-9) ** 2:
        fault("ERR_ARGVALERR", "the circle's places lie on a line")
    radius = a * b * c / (4.0 * area)
    halves = [2.0 * math.asin(min(side / (2.0 * radius), 1.0)) for side in (c, a)]
    # A side longer than the two others would span has its arc around the far side.
    for index, (side, others) in enumerate(((c, (a, b)), (a, (b, c)))):
        if side * side > others[0] ** 2 + others[1] ** 2:
            halves[index] = 2.0 * math.pi - halves[index]
    return radius * sum(halves), radius
