"""All eight inverse solutions of an arm with an ortho-parallel base and a spherical wrist [Brandstötter2014].

A compiled loop over poses: a fraction of a microsecond for each, so that a search may ask millions of them.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from geoprint.model import FloatArray

BRANCHES = 8
JOINTS = 6
# By how much rounding lifts the cosine of a stretched arm above one: it still reaches.
RIM = 1e-12


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


@numba.njit(cache=True, error_model="numpy")
def _solve(Ts: FloatArray, lengths: FloatArray, joints: FloatArray) -> None:
    """Fill (k, 8, 6) joints: the formulas of the source, each sine and cosine computed once."""
    a1, a2, b, c1, c2, c3, c4 = lengths
    forearm = math.hypot(a2, c3)
    bend = math.atan2(a2, c3)
    for k in range(Ts.shape[0]):
        x = Ts[k, 0, 3] - c4 * Ts[k, 0, 2]
        y = Ts[k, 1, 3] - c4 * Ts[k, 1, 2]
        z = Ts[k, 2, 3] - c4 * Ts[k, 2, 2] - c1
        across = x * x + y * y - b * b
        if not across >= 0.0:
            joints[k] = np.nan
            continue
        root = math.sqrt(across)
        azimuth, aside = math.atan2(y, x), math.atan2(b, root)
        for shoulder in range(2):
            # In front of axis 1, or reaching over to the side behind it.
            ahead = root - a1 if shoulder == 0 else root + a1
            first = azimuth - aside if shoulder == 0 else azimuth + aside - math.pi
            squared = ahead * ahead + z * z
            cosine_2 = (squared + c2 * c2 - forearm * forearm) / (2.0 * math.sqrt(squared) * c2)
            cosine_3 = (squared - c2 * c2 - forearm * forearm) / (2.0 * c2 * forearm)
            if not (abs(cosine_2) <= 1.0 + RIM and abs(cosine_3) <= 1.0 + RIM):
                for branch in (2 * shoulder, 2 * shoulder + 1, 2 * shoulder + 4, 2 * shoulder + 5):
                    joints[k, branch] = np.nan
                continue
            open_2 = math.acos(min(max(cosine_2, -1.0), 1.0))
            open_3 = math.acos(min(max(cosine_3, -1.0), 1.0))
            rise = math.atan2(ahead, z)
            sine_1, cosine_1 = math.sin(first), math.cos(first)
            # The flange's axes seen along the plane of the arm and across it.
            x_ahead = Ts[k, 0, 0] * cosine_1 + Ts[k, 1, 0] * sine_1
            x_aside = Ts[k, 1, 0] * cosine_1 - Ts[k, 0, 0] * sine_1
            y_ahead = Ts[k, 0, 1] * cosine_1 + Ts[k, 1, 1] * sine_1
            y_aside = Ts[k, 1, 1] * cosine_1 - Ts[k, 0, 1] * sine_1
            z_ahead = Ts[k, 0, 2] * cosine_1 + Ts[k, 1, 2] * sine_1
            z_aside = Ts[k, 1, 2] * cosine_1 - Ts[k, 0, 2] * sine_1
            for elbow in range(2):
                sign = -1.0 if elbow == 0 else 1.0
                second = sign * open_2 + (rise if shoulder == 0 else -rise)
                third = -sign * open_3 - bend
                sine, cosine = math.sin(second + third), math.cos(second + third)
                along = z_ahead * sine + Ts[k, 2, 2] * cosine
                across_4 = z_ahead * cosine - Ts[k, 2, 2] * sine
                lean = math.hypot(z_aside, across_4)
                fifth = math.atan2(lean, along)
                # On the singularity of the wrist joint 4 is free; joint 6 follows from it there as everywhere.
                sine_4, cosine_4 = (z_aside / lean, across_4 / lean) if lean > 0.0 else (0.0, 1.0)
                fourth = math.atan2(sine_4, cosine_4)
                sixth = math.atan2(
                    cosine_4 * x_aside - sine_4 * (x_ahead * cosine - Ts[k, 2, 0] * sine),
                    cosine_4 * y_aside - sine_4 * (y_ahead * cosine - Ts[k, 2, 1] * sine),
                )
                for wrist in range(2):
                    row = joints[k, 4 * wrist + 2 * shoulder + elbow]
                    row[0] = _wrapped(first)
                    row[1] = _wrapped(second)
                    row[2] = _wrapped(third - math.pi / 2.0)
                    row[3] = _wrapped(fourth + wrist * math.pi)
                    row[4] = fifth if wrist == 0 else -fifth
                    row[5] = _wrapped(sixth + wrist * math.pi)


@numba.njit(cache=True)
def _wrapped(angle: float) -> float:
    """Return an angle within three half turns of zero in (-pi, pi]."""
    if angle > math.pi:
        return angle - 2.0 * math.pi
    if angle <= -math.pi:
        return angle + 2.0 * math.pi
    return angle
