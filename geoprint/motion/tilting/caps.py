"""Where spherical caps of one size meet: the common direction that is nearest to a given one.

Caps of less than a quarter turn are convex, and so is what they share. The caps are taken one after the other; where
the nearest direction so far lies outside the next one, the new one lies on that cap's border circle, as in linear
programs of two variables [Seidel1991]. On the circle each other cap leaves an arc of at most half a turn, so that what
all of them leave is one arc again, or nothing. In an order that jumps about this takes a time that grows as the number
of caps.
"""

from __future__ import annotations

from math import acos, atan2, cos, pi, sin, sqrt, tan

import numpy as np

from geoprint.kernels import njit
from geoprint.model import FloatArray

# Caps are wider by this [rad]: those that only touch, as a table of one angle makes them, still meet.
ANGLE_TOLERANCE = 1e-9
# Steps through a list with which it is taken in an order that jumps about: a prime number near 2**32 over the golden
# ratio, which no list is long enough to be a multiple of.
STRIDE = 2_654_435_761


def common_direction(centres: FloatArray, *, half_angle: float, start: FloatArray) -> FloatArray:
    """Return the direction within all caps that is nearest to a given one.

    Args:
        centres: (k, 3) unit vectors, at least one.
        half_angle: of each cap, in (0, pi / 2) [rad].
        start: (3,) unit vector.

    Returns:
        (1, 3) the unit vector, or (0, 3) where the caps share nothing. It is in all caps whatever the start is, and
        the nearest to the start where it is within a quarter turn of it.
    """
    order = np.arange(len(centres)) * STRIDE % len(centres)
    found, direction = nearest_common(centres[order], half_angle + ANGLE_TOLERANCE, start)
    return direction[None] if found else np.empty((0, 3))


@njit
def nearest_common(centres: FloatArray, half_angle: float, start: FloatArray) -> tuple[bool, FloatArray]:
    """Return whether caps about (k, 3) centres share a direction, and the (3,) one that is nearest to the start."""
    cosine, sine, cotangent = cos(half_angle), sin(half_angle), 1.0 / tan(half_angle)
    best = start.copy()
    for i in range(len(centres)):
        n = centres[i]
        if n[0] * best[0] + n[1] * best[1] + n[2] * best[2] >= cosine:
            continue
        aside = np.cross(n, start)
        length = sqrt(aside[0] ** 2 + aside[1] ** 2 + aside[2] ** 2)
        if length < ANGLE_TOLERANCE:
            # The start is opposite, or the centre itself: every point of the circle is as near.
            aside = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
            length = sqrt(aside[0] ** 2 + aside[1] ** 2 + aside[2] ** 2)
        across = aside / length
        towards = np.cross(across, n)
        low, high = -pi, pi
        bounded = False
        middle = 0.0
        for j in range(i):
            m = centres[j]
            x = m[0] * towards[0] + m[1] * towards[1] + m[2] * towards[2]
            y = m[0] * across[0] + m[1] * across[1] + m[2] * across[2]
            along = m[0] * n[0] + m[1] * n[1] + m[2] * n[2]
            aside_of = sqrt(x * x + y * y)
            if aside_of < ANGLE_TOLERANCE and along > 0.0:
                continue
            # The tangent of half the angle between both centres, over that of the caps.
            ratio = cotangent * aside_of / (1.0 + along) if along > -1.0 else 2.0
            if ratio > 1.0:
                return False, best
            half, at = acos(ratio), atan2(y, x)
            if not bounded:
                bounded, middle, low, high = True, at, -half, half
                continue
            # Angles from the middle of the first arc, which is half a turn at most, in (-pi, pi].
            off = (at - middle + pi) % (2.0 * pi) - pi
            low, high = max(low, off - half), min(high, off + half)
            if low > high:
                return False, best
        # The start lies in the direction of angle 0.
        nearest = (-middle + pi) % (2.0 * pi) - pi
        angle = nearest
        if nearest < low or nearest > high:
            before, behind = (low - nearest) % (2.0 * pi), (nearest - high) % (2.0 * pi)
            angle = low if before < behind else high
        angle += middle
        best = cosine * n + sine * (cos(angle) * towards + sin(angle) * across)
    return True, best


@njit
def first_common(directions: FloatArray, centres: FloatArray, half_angle: float) -> int:
    """Return the first of (n, 3) directions that is within caps about all of (k, 3) centres; -1 where none is."""
    cosine = cos(half_angle)
    for i in range(len(directions)):
        u, inside = directions[i], True
        for j in range(len(centres)):
            n = centres[j]
            if n[0] * u[0] + n[1] * u[1] + n[2] * u[2] < cosine:
                inside = False
                break
        if inside:
            return i
    return -1
