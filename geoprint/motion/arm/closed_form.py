"""All eight inverse solutions of an arm with an ortho-parallel base and a spherical wrist [Brandstötter2014].

A compiled loop over poses: a fraction of a microsecond for each, so that a search may ask millions of them.
"""

from __future__ import annotations

import math

import numpy as np

from geoprint.kernels import inner, njit
from geoprint.model import FloatArray

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
        joints[wrist, 0] = _wrapped(first)
        joints[wrist, 1] = _wrapped(second)
        joints[wrist, 2] = _wrapped(third - math.pi / 2.0)
        joints[wrist, 3] = _wrapped(fourth + wrist * half_turn)
        joints[wrist, 4] = fifth if wrist == 0 else -fifth
        joints[wrist, 5] = _wrapped(sixth + wrist * half_turn)


@inner
def _wrapped(angle: float) -> float:
    """Return an angle within three half turns of zero in (-pi, pi]."""
    if angle > math.pi:
        return angle - 2.0 * math.pi
    if angle <= -math.pi:
        return angle + 2.0 * math.pi
    return angle
